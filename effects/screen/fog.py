"""Fog over distance and height, from a picture and its depth."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import log

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.quantities import Color, FieldOfView, Height, NotNegative, Share, Width
from passgraph.effects.surfaces.geometry import ViewFrame, line_of_sight, view_position
from passgraph.effects.surfaces.seen_by import camera_of
from passgraph.effects.surfaces.views import View
from passgraph.language import Image, clamp, dot, exp, length, uv, vec3, vec4
from passgraph.scene.camera import DEFAULT_FOV_RAD

#: Below this the mean of an exponential is a series; its next term is 5e-8 there, and the quotient's rounding 5e-7.
SERIES = 0.25
#: Distance of the sky, whose square fits float32.
ENDLESS = 1e18
#: e to this, times any distance, is the most fog that float32 can express.
DENSEST = log(1e18)


@pg.function
def mean_of_exponential(x: float) -> float:
    """Return the mean of exp(-t) for t from 0 to x, x ≥ 0: (1 - exp(-x)) / x without cancellation near 0."""
    t = min(x, SERIES)
    series = 1.0 + t * (-1.0 / 2.0 + t * (1.0 / 6.0 + t * (-1.0 / 24.0 + t * (1.0 / 120.0 - t / 720.0))))
    return series if x < SERIES else (1.0 - exp(-x)) / max(x, SERIES)


@pg.function
def optical_depth(density: float, falloff: float, height: float, rise: float, way: float) -> float:
    """Return the fog along a ray of this length that begins at ``height`` above the base and rises by ``rise``.

    The closed integral of density · exp(-falloff · height) is the density at the lower end, times the mean of an
    exponential that falls from there: neither exceeds the result, so nothing overflows or cancels.
    """
    lowest = min(-falloff * (height + min(rise, 0.0)), DENSEST)
    return density * exp(lowest) * mean_of_exponential(falloff * abs(rise)) * way


@pg.kernel
def fogged(
    color: Image, depth: Image, frame: ViewFrame, up: vec3, eye_height: float, fog_color: vec3, density: float,
    falloff: float, start: float, back: float, most: float, sky: float,
) -> vec4:  # fmt: skip
    """Return a picture behind its fog; ``back`` is clear too, as it is behind the engine's eye."""
    here = color[0, 0]
    z = depth[0, 0].r
    if z <= 0.0 and sky <= 0.0:
        return here
    # start of the ray: at the eye, or beside it where rays are parallel
    begin = view_position(frame, uv(), 0.0)
    ray = line_of_sight(frame, uv()) * (z if z > 0.0 else ENDLESS)
    far = length(ray)
    clear = min((start + back) / far, 1.0)
    thick = optical_depth(
        density, falloff, eye_height + dot(up, begin + ray * clear), dot(up, ray) * (1.0 - clear), far * (1.0 - clear)
    )
    share = clamp(1.0 - exp(-thick), 0.0, most)
    return vec4(here.rgb + (fog_color - here.rgb) * share, here.a)


@effect("fog", "picture+depth")
def fog(
    color: pg.Target,
    depth: pg.Target,
    *,
    density: NotNegative | pg.Value = 0.05,
    falloff: NotNegative | pg.Value = 0.0,
    height: Height = 0.0,
    start: Width | pg.Value = 0.0,
    fog_color: Color | pg.Value = (0.5, 0.6, 0.7),
    most: Share | pg.Value = 1.0,
    sky: bool = False,
    camera: pg.Camera | pg.Value | None = None,
    vertical_fov_rad: FieldOfView = DEFAULT_FOV_RAD,
    into: pg.TargetSpec | None = None,
    name: str = "fog",
) -> pg.Target:
    """Add fog that thickens with distance and thins with height.

    Parameters
    ----------
    color : any picture, linear light
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``color``. `passgraph.effects.surfaces.engine_depth.distances` computes it from an engine's depth buffer
    density : density of the fog at ``height``, per scene unit: after 1 / density a fraction 1 / e is still visible
    falloff : decrease of density with height, per scene unit: 1 / falloff higher it is 1 / e. With 0 it is uniform
    height : world y with the given density
    start : distance from the eye without fog
    fog_color : scene-linear light of the fog itself
    most : largest fraction of the fog's color
    sky : True to apply fog to the sky, where there is no surface
    camera : the camera of both, from `passgraph.Camera.from_matrices` for an engine's, or its run value. Default: one
        with ``vertical_fov_rad`` at the origin
    vertical_fov_rad : full vertical angle of view, without ``camera``
    into : destination target; default: float32 named ``name``
    name : name of the pass and target

    Source: C. Wenzel, "Real-time Atmospheric Effects in Games", SIGGRAPH 2006, the integral of exponential height
    fog. Deviation: it is computed from the lower end of the ray, where it neither overflows nor, on level rays,
    cancels.

    Examples
    --------
    >>> import numpy as np
    >>> made = fog(pg.Input("frame"), pg.Input("depth"), density=0.5, fog_color=(1.0, 1.0, 1.0))
    >>> with pg.compile(made, backend="reference", size=(1, 1)) as program:
    ...     seen = program(frame=np.zeros((1, 1, 4)), depth=np.full((1, 1, 1), 2.0))["fog"]
    >>> round(seen[0, 0, 0].item(), 4)  # 1 - 1 / e
    0.6321
    """
    view = View(camera_of(camera, vertical_fov_rad))
    foggy: pg.Target = fogged(
        color, depth, view.frame(), view.up(), view.derived(lambda seen_by: seen_by.eye[1] - height), fog_color,
        density, falloff, start, view.derived(lambda seen_by: seen_by.back), most, float(sky),
        into=into or pg.target(name, "rgba32f"), name=name,
    )  # fmt: skip
    return foggy
