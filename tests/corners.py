"""Text of kernels with which tests cover pixels."""

_PLACE = """
class Corner:
    position: vec4

def place(vertex: Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0))
"""


def placed(fragments: str) -> str:
    """Fragment kernels that take a ``Corner``, and ``place``, a vertex kernel that leaves it where the mesh has it."""
    return _PLACE + fragments
