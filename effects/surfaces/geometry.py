"""Functions that several effects' kernels share: packed normals, positions from depth, directions."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import pi

import passgraph as pg
from passgraph.language import clamp, cos, dot, ivec2, normalize, output_size, sin, sqrt, vec2, vec3


@pg.struct
class ViewFrame:
    """Converts a position in the picture and a distance to a position in the camera's frame, which looks along -z.

    In perspective lengths are given at distance 1 and grow with the distance; in parallel views they do not.
    """

    half_height: float  # half the visible height
    aspect: float  # its width / height; 0 for that of the picture
    shift: vec2  # offset of the picture's center from the view axis, in half its width and height
    perspective: bool


@pg.function
def half_extent(frame: ViewFrame, size: ivec2) -> vec2:
    """Return half the visible width and height per unit of `spread`, for a picture of this size."""
    aspect = frame.aspect if frame.aspect > 0.0 else float(size.x) / float(size.y)
    return vec2(frame.half_height * aspect, frame.half_height)


@pg.function
def spread(frame: ViewFrame, distance: float) -> float:
    """Return the scale of the frame's lengths at a distance along the view axis."""
    return distance if frame.perspective else 1.0


@pg.function
def flat_place(frame: ViewFrame, at: vec2) -> vec2:
    """Return x and y per unit of `spread` at a position in the picture, (0, 0) at its top left, (1, 1) bottom right."""
    return (frame.shift + vec2(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y)) * half_extent(frame, output_size())


@pg.function
def view_position(frame: ViewFrame, at: vec2, distance: float) -> vec3:
    """Return the 3-D position for a position in the picture, (0, 0) at its top left and (1, 1) at its bottom right."""
    return vec3(flat_place(frame, at) * spread(frame, distance), -distance)


@pg.function
def line_of_sight(frame: ViewFrame, at: vec2) -> vec3:
    """Return the change of position for each unit of distance along the view axis, at a place in the picture."""
    return vec3(flat_place(frame, at) if frame.perspective else vec2(0.0), -1.0)


@pg.function
def linear_on_planes(frame: ViewFrame, distance: float) -> float:
    """Return 1 / distance in perspective, the distance in parallel views; its own inverse, and 0 for 0."""
    return (1.0 / distance if frame.perspective else distance) if distance > 0.0 else 0.0


@pg.function
def plane_terms(frame: ViewFrame, n: vec3, flat: vec2) -> vec2:
    """Return ``t`` such that ``t.x * spread(frame, distance) + t.y * distance`` is n · position at a `flat_place`.

    Between two positions ``t.x`` grows by n.xy · offset.
    """
    across = dot(n.xy, flat)
    return vec2(across - n.z, 0.0) if frame.perspective else vec2(across, -n.z)


@pg.function
def picture_place(frame: ViewFrame, position: vec3) -> vec2:
    """Project a position in front of the eye to the picture, as in `view_position`."""
    flat = position.xy / (spread(frame, -position.z) * half_extent(frame, output_size())) - frame.shift
    return vec2(0.5 + 0.5 * flat.x, 0.5 - 0.5 * flat.y)


@pg.function
def toward_eye(frame: ViewFrame, position: vec3) -> vec3:
    """Return the unit direction from a position back along its line of sight."""
    return -normalize(position) if frame.perspective else vec3(0.0, 0.0, 1.0)


@pg.function
def pixel_step(frame: ViewFrame, size: ivec2, distance: float) -> vec2:
    """Return the width and height of a pixel at a distance along the view axis, scene units."""
    return 2.0 * half_extent(frame, size) / vec2(size) * spread(frame, distance)


@pg.function
def pack_normal(n: vec3) -> vec2:
    """Pack a unit vector as a point of the octahedron's unfolded square, each coordinate in [-1, 1].

    Source: Q. Meyer et al., "On Floating-Point Normal Vectors", 2010.
    """
    p = vec2(n.x, n.y) / max(abs(n.x) + abs(n.y) + abs(n.z), 1e-20)
    folded = vec2((1.0 - abs(p.y)) * (1.0 if p.x >= 0.0 else -1.0), (1.0 - abs(p.x)) * (1.0 if p.y >= 0.0 else -1.0))
    return folded if n.z < 0.0 else p


@pg.function
def across_plane(frame: ViewFrame, flat: vec2, distance: float, slope: vec2) -> vec3:
    """Return a normal, toward the eye, of any length, of a plane on which `linear_on_planes` grows by ``slope`` per
    unit of a `flat_place`."""
    steep = linear_on_planes(frame, distance) - dot(slope, flat)
    return vec3(-slope, steep) if frame.perspective else vec3(slope, 1.0)


@pg.function
def unpack_normal(p: vec2) -> vec3:
    """Return the unit vector packed by `pack_normal`."""
    z = 1.0 - abs(p.x) - abs(p.y)
    t = max(-z, 0.0)
    return normalize(vec3(p.x + (-t if p.x >= 0.0 else t), p.y + (-t if p.y >= 0.0 else t), z))


@pg.function
def on_sphere(z: float, turn: float) -> vec3:
    """Return the point of the unit sphere at a height, -1 to 1, at a fraction of a full turn about z."""
    flat = sqrt(clamp(1.0 - z * z, 0.0, 1.0))
    return vec3(flat * cos(2.0 * pi * turn), flat * sin(2.0 * pi * turn), z)


@pg.function
def facing(n: vec3, toward: vec3) -> float:
    """Return the cosine between a unit normal and a unit direction, 0 behind the surface."""
    return max(dot(n, toward), 0.0)
