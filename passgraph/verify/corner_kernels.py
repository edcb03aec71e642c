"""Kernels of draws, shared by the suite and the fuzzer."""

#: Two vertex kernels, one of them tilted in depth, and two fragment kernels, one of which discards.
CORNER_KERNELS = """
class Corner:
    position: vec4
    color: vec4

def place(vertex: Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0), vertex.color)

def lean(vertex: Vertex) -> Corner:
    w = 1.5 + vertex.position.x
    return Corner(vec4(vertex.position.xy, vertex.position.z * w, w), vertex.color)

def paint(corner: Corner) -> vec4:
    return corner.color

def holes(corner: Corner) -> vec4:
    if (pixel().x + pixel().y) % 3 == 0:
        discard()
    return corner.color

"""
