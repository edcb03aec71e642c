"""Lens distortion: bend straight lines like a lens, or straighten them."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.channels import result_like
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import mapped, tan_half
from passgraph.language import Const, Image, clamp, dot, length, output_size, pixel, vec2, vec4

#: Steps of Newton's method, each of which doubles the number of correct digits.
STEPS = 8
#: Where the polynomial is flat or falls, the lens has no such ray: the least slope for a step, and the largest radius
#: relative to the distorted one.
LEAST_SLOPE, FARTHEST = 0.05, 3.0
Coefficient = Annotated[float, pg.Range(-1, 1)]


@pg.function
def undistorted(radius: float, k1: float, k2: float, k3: float) -> float:
    """Return the undistorted radius as a fraction of a distorted one."""
    r = radius
    for _ in range(STEPS):
        q = r * r
        found = r * (1.0 + q * (k1 + q * (k2 + q * k3)))
        slope = 1.0 + q * (3.0 * k1 + q * (5.0 * k2 + q * 7.0 * k3))
        r = clamp(r - (found - radius) / max(slope, LEAST_SLOPE), 0.0, FARTHEST * radius)
    return r / radius if radius > 0.0 else 1.0


@pg.kernel(alike=True)
def bent(color: Image, tan_half: float, k1: float, k2: float, k3: float, zoom: float, undo: Const[bool]) -> vec4:
    """Sample the other picture along the ray of this pixel."""
    size = vec2(output_size())
    ray = (2.0 * vec2(pixel()) + 1.0 - size) * (tan_half / (size.y * zoom))
    if undo:
        q = dot(ray, ray)
        ray *= 1.0 + q * (k1 + q * (k2 + q * k3))
    else:
        ray *= undistorted(length(ray), k1, k2, k3)
    return color.sample(0.5 + 0.5 * ray * vec2(size.y / size.x, 1.0) / tan_half)


@effect("lens-distortion", alpha="premultiplied", alike=True)
def lens_distortion(
    color: pg.Target,
    k1: Coefficient | pg.Value | pg.Derived = -0.2,
    k2: Coefficient | pg.Value | pg.Derived = 0.0,
    k3: Coefficient | pg.Value | pg.Derived = 0.0,
    vertical_fov_rad: Annotated[float, pg.Range(0.001, 3.1, "radians")] | pg.Value | pg.Derived = 0.8,
    zoom: Annotated[float, pg.Range(0.1, 10)] | pg.Value | pg.Derived = 1.0,
    undo: bool = False,
    into: pg.TargetSpec | None = None,
    name: str = "lens_distortion",
) -> pg.Target:
    """Distort a picture like a lens, or undo the distortion of one.

    Parameters
    ----------
    color : any picture, any range; outside of it, reads follow the rule of ``color.border(...)``. Alpha should be
        premultiplied
    k1, k2, k3 : coefficients of the second, fourth and sixth power of the distance from the center, as in OpenCV's
        calibration. Negative ones give barrel distortion
    vertical_fov_rad : undistorted vertical angle of view; distances are 1 at 45 degrees from the axis
    zoom : magnification of the result; above 1 it hides corners that the lens does not see
    undo : undistort a picture that was distorted with the same numbers
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    ``distorted = r (1 + k1 r² + k2 r⁴ + k3 r⁶)``; distorting solves for r at each pixel by Newton's method.  Where the
    polynomial falls again, far out, the lens has no ray, and pixels farther inside are stretched.  Sampling is
    bilinear.
    Source: D. C. Brown, "Decentering Distortion of Lenses", 1966, its radial part.

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.linspace(-1.0, 1.0, 101, dtype=np.float32)[:, None, None] * np.ones(4, np.float32)
    >>> bend = lens_distortion(pg.Input("frame"), k1=0.1, vertical_fov_rad=1.5707963, undo=True)
    >>> with pg.compile(bend, backend="reference") as program:
    ...     shown = program(frame=ramp)["lens_distortion"]
    >>> round(float(shown[75, 0, 0] / ramp[75, 0, 0]), 3), round(1.0 + 0.1 * (50 / 101) ** 2, 3)
    (1.025, 1.025)
    """
    light = decoded(color, f"{name}_light")
    half = mapped(vertical_fov_rad, tan_half)
    return bent(light, half, k1, k2, k3, zoom, undo, into=result_like(light, into, name), name=name)
