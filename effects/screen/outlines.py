"""Outlines: draw lines along silhouettes and creases."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import cos, pi
from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.quantities import Color, FieldOfView, Share
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.effects.surfaces.geometry import ViewFrame, linear_on_planes, spread, unpack_normal
from passgraph.effects.surfaces.seen_by import camera_of
from passgraph.effects.surfaces.views import View
from passgraph.language import Const, Image, clamp, dot, ivec2, mix, pixel, smoothstep, vec3, vec4
from passgraph.scene.camera import DEFAULT_FOV_RAD

#: Distance of the sky where rays are parallel; float32 can represent differences from it.
ENDLESS = 1e18
#: Lines reach full strength at this multiple of the threshold.
FULL = 1.5


@pg.function
def linear_or_sky(frame: ViewFrame, distance: float) -> float:
    """Return a depth value that is linear on planes; the sky is infinitely far."""
    drawn = linear_on_planes(frame, distance)
    return drawn if distance > 0.0 else (0.0 if frame.perspective else ENDLESS)


@pg.function
def step_back(frame: ViewFrame, depth: Image, here: float, by: ivec2) -> float:
    """Return how far the neighbors on both sides are behind this pixel's plane, scene units; negative in front.

    Second differences vanish on planes at any angle.  At the picture's border no plane is known.
    """
    at = pixel()
    low, high = at - by, at + by
    size = depth.size
    bend = 0.0
    if low.x >= 0 and low.y >= 0 and high.x < size.x and high.y < size.y:
        middle = linear_or_sky(frame, here)
        bend = linear_or_sky(frame, depth.texel(low).r) - 2.0 * middle + linear_or_sky(frame, depth.texel(high).r)
    return -bend * here * here if frame.perspective else bend


@pg.kernel
def lined(
    color: Image, depth: Image, normals: Image, frame: ViewFrame, line_color: vec3, opacity: float, jump: float,
    crease_cosine: float, width: Const[int],
) -> vec4:  # fmt: skip
    """Draw lines inside of the outlined objects."""
    c, here = color[0, 0], depth[0, 0].r
    if here <= 0.0:
        return c
    least = jump * 2.0 * frame.half_height * spread(frame, here)
    n = unpack_normal(normals[0, 0].xy)
    line = 0.0
    for axis in range(2):
        by = ivec2(width * (1 - axis), width * axis)
        step = step_back(frame, depth, here, by)
        line = max(line, smoothstep(1.0, FULL, step / least))
        # on one side of the crease only, and not where depth jumps
        neighbor = pixel() + by
        inside = neighbor.x < depth.size.x and neighbor.y < depth.size.y
        if crease_cosine > -1.0 and inside and abs(step) < least and depth.texel(neighbor).r > 0.0:
            bent = dot(n, unpack_normal(normals.texel(neighbor).xy))
            line = max(line, 1.0 if bent < crease_cosine else 0.0)
    return vec4(mix(c.rgb, line_color, clamp(line * opacity, 0.0, 1.0)), c.a)


@effect("outlines", "picture+depth")
def outlines(
    color: pg.Target,
    depth: pg.Target,
    *,
    line_color: Color | pg.Value = (0.0, 0.0, 0.0),
    opacity: Share | pg.Value = 1.0,
    width_px: Annotated[int, pg.Range(1, 8, "px")] = 1,
    jump: Annotated[float, pg.Range(0, None, above=True)] | pg.Value = 0.02,
    crease_rad: Annotated[float, pg.Range(0.05, pi, "radians")] = 0.6,
    camera: pg.Camera | pg.Value | None = None,
    vertical_fov_rad: FieldOfView = DEFAULT_FOV_RAD,
    into: pg.TargetSpec | None = None,
    name: str = "outlines",
) -> pg.Target:
    """Draw lines along silhouettes and creases.

    Parameters
    ----------
    color : any picture
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``color``. `passgraph.effects.surfaces.engine_depth.distances` computes it from an engine's depth buffer
    line_color : color of the lines, in the picture's own encoding
    opacity : opacity of the lines
    width_px : width of the lines, which are inside the outlined objects
    jump : threshold of an edge: a step in distance, as a fraction of the visible height there
    crease_rad : surfaces that meet at a larger angle than this have a line between them; pi draws none
    camera : the camera of both, from `passgraph.Camera.from_matrices` for an engine's; a run may set another. Default:
        one with ``vertical_fov_rad`` at the origin
    vertical_fov_rad : full vertical angle of view, without ``camera``
    into : destination target; default: float32 named ``name``
    name : name of the last pass and target

    Steps are deviations from the plane through a pixel, so floors have no lines at any angle, up to the horizon. Lines
    have hard edges, which `fxaa` can smooth.  A 16-bit depth buffer has steps of its own far away.

    Source: T. Saito, T. Takahashi, "Comprehensible Rendering of 3-D Shapes", SIGGRAPH 1990 (profiles and edges from
    differences of depth). Deviation: second differences of a quantity that is linear on planes, on the near side only.

    Examples
    --------
    >>> import numpy as np
    >>> near = np.where((np.arange(9) > 2) & (np.arange(9) < 6), 2.0, 5.0) * np.ones((9, 1))
    >>> made = outlines(pg.Input("frame"), pg.Input("depth"))
    >>> with pg.compile(made, backend="reference", size=(9, 9)) as program:
    ...     shown = program(frame=np.ones((9, 9, 4)), depth=near[:, :, None])["outlines"]
    >>> shown[4, :, 0].tolist()
    [1.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0]
    """
    seen_by = camera_of(camera, vertical_fov_rad)
    normals = depth_normals(depth, seen_by, f"{name}_normals")
    # below any cosine if creases are off
    cosine = cos(crease_rad) if crease_rad < pi else -2.0
    drawing: Any = lined(
        color, depth, normals, View(seen_by).frame(), line_color, opacity, jump, cosine, width_px,
        into=into or pg.target(name, "rgba32f"), name=name,
    )  # fmt: skip
    assert isinstance(drawing, pg.Target)
    return drawing
