"""Functions that several effects' kernels share: packed normals, positions from depth."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph import dot, normalize, uv, vec2, vec3


@pg.function
def pack_normal(n: vec3) -> vec2:
    """A unit vector as a point of the octahedron's unfolded square, each coordinate in [-1, 1].

    Source: Q. Meyer et al., "On Floating-Point Normal Vectors", 2010.
    """
    p = vec2(n.x, n.y) / max(abs(n.x) + abs(n.y) + abs(n.z), 1e-20)
    folded = vec2((1.0 - abs(p.y)) * (1.0 if p.x >= 0.0 else -1.0), (1.0 - abs(p.x)) * (1.0 if p.y >= 0.0 else -1.0))
    return folded if n.z < 0.0 else p


@pg.function
def unpack_normal(p: vec2) -> vec3:
    """The unit vector behind `pack_normal`."""
    z = 1.0 - abs(p.x) - abs(p.y)
    t = max(-z, 0.0)
    return normalize(vec3(p.x + (-t if p.x >= 0.0 else t), p.y + (-t if p.y >= 0.0 else t), z))


@pg.function
def view_ray(tan_half: vec2) -> vec3:
    """From the eye through this pixel, at distance 1 along the view axis (camera frame, looking along -z)."""
    place = uv()
    return vec3((2.0 * place.x - 1.0) * tan_half.x, (1.0 - 2.0 * place.y) * tan_half.y, -1.0)


@pg.function
def facing(n: vec3, toward: vec3) -> float:
    """Cosine between a unit normal and a unit direction, 0 behind the surface."""
    return max(dot(n, toward), 0.0)
