"""A draw that reads a picture, for tests of who owns memory."""

from __future__ import annotations

from typing import Any

import passgraph as pg
from passgraph.scene import Mesh

KERNELS = """
class Corner:
    position: vec4
    uv: vec2

def place(vertex: Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0), vertex.position.xy * 0.5 + 0.5)

def paint(corner: Corner, picture: Image) -> vec4:
    return picture.sample(corner.uv)
"""


def triangle_over(picture: pg.Target) -> Any:
    """Its colour and depth; a third of the picture is covered, and what is not is cleared."""
    mesh = Mesh.make(positions=[[-1, -1, 0.25], [0.8, -0.6, 0.5], [-0.2, 0.9, 0.75]], triangles=[[0, 1, 2]])
    color = pg.draw(
        mesh, vertex=pg.vertex(source=KERNELS, name="place"), fragment=pg.fragment(source=KERNELS, name="paint"),
        into=pg.target("color", "rgba8"), depth=pg.target("color_depth", "depth32f"), cull="none", picture=picture,
    )  # fmt: skip
    return [color, color.depth]
