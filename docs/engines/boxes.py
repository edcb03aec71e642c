"""Lit boxes on a floor, drawn with moderngl: the scene in engines that bring a window and no scenes of their own."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import passgraph as pg

_VERTEX = """#version 330
in vec3 position; in vec3 normal; uniform mat4 seen; uniform mat4 placed; out vec3 facing;
void main() { facing = mat3(placed) * normal; gl_Position = seen * placed * vec4(position, 1.0); }
"""
_FRAGMENT = """#version 330
in vec3 facing; uniform vec3 colour; out vec4 stored;
void main() {
    float light = 0.45 + 0.55 * max(dot(normalize(facing), normalize(vec3(0.4, 0.8, 0.5))), 0.0);
    stored = vec4(colour * light, 1.0);
}
"""
_COLOURS = ((0.80, 0.35, 0.30), (0.35, 0.60, 0.80), (0.85, 0.75, 0.40), (0.45, 0.70, 0.45))


def box() -> np.ndarray[Any, np.dtype[np.float32]]:
    """The six sides of a cube from -1 to 1: position and normal, (36, 6)."""
    made = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            corners = [(-1, -1), (1, -1), (1, 1), (-1, -1), (1, 1), (-1, 1)]
            for u, v in corners:
                position, normal = np.zeros(3), np.zeros(3)
                position[axis], position[(axis + 1) % 3], position[(axis + 2) % 3] = sign, u * sign, v
                normal[axis] = sign
                made.append([*position, *normal])
    return np.array(made, np.float32)


class Boxes:
    """For one context; ``angle_rad`` says how far its middle box has turned."""

    camera = pg.Camera((7.0, 5.5, 8.0), (0.0, 0.4, 0.0), vertical_fov_rad=0.7, near=1.0, far=60.0)

    def __init__(self, context: Any) -> None:
        self.context = context
        self.program = context.program(_VERTEX, _FRAGMENT)
        self.corners = context.buffer(box().tobytes())
        self.array = context.vertex_array(self.program, [(self.corners, "3f 3f", "position", "normal")])
        self.angle_rad = 0.3

    def draw(self, size: tuple[int, int]) -> None:
        """Into the framebuffer that is bound, which it clears; the next frame is turned a little."""
        context = self.context
        context.viewport = (0, 0, *size)
        context.clear(0.55, 0.65, 0.80, 1.0)
        context.enable_only(context.DEPTH_TEST)
        seen = self.camera.projection_matrix(size[0] / size[1]) @ self.camera.view_matrix()
        self.program["seen"].write(np.float32(seen).T.tobytes())
        self._box((0.0, -1.0, 0.0), (6.0, 1.0, 6.0), 0.0, (0.72, 0.70, 0.66))
        for k in range(5):
            turn = math.tau * k / 5
            self._box((3.2 * math.cos(turn), 0.5 + 0.2 * k, 3.2 * math.sin(turn)), (0.7, 0.5 + 0.2 * k, 0.7), turn,
                      _COLOURS[k % 4])  # fmt: skip
        self._box((0.0, 1.0, 0.0), (1.0, 1.0, 1.0), self.angle_rad, _COLOURS[3])
        context.enable_only(context.NOTHING)
        self.angle_rad += 0.1

    def _box(
        self, at: tuple[float, float, float], half: tuple[float, float, float], angle_rad: float,
        colour: tuple[float, float, float],
    ) -> None:  # fmt: skip
        cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
        turned = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]) * half
        placed = np.eye(4, dtype=np.float32)
        placed[:3, :3], placed[:3, 3] = turned, at
        self.program["placed"].write(placed.T.tobytes())
        self.program["colour"].value = colour
        self.array.render()

    def release(self) -> None:
        for made in (self.array, self.corners, self.program):
            made.release()
