"""Depth of field: what is out of focus is blurred as a lens does it."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import Reach
from passgraph.effects.screen.aperture import ThinLens
from passgraph.effects.screen.lens_layers import (
    HALF,
    TILE,
    blurred_a_little,
    circle,
    fillings,
    gathers,
    halved,
    together,
    widest_around_by,
    widest_of_tile,
)


@effect("depth-of-field", "picture+depth", linear=True)
def depth_of_field(
    color: pg.Target,
    depth: pg.Target,
    focus_distance: Reach | pg.Value | pg.Derived = 5.0,
    f_number: Annotated[float, pg.Range(0.5, 128)] = 2.8,
    focal_length_mm: Annotated[float, pg.Range(1, 2000, "mm")] = 50.0,
    sensor_height_mm: Annotated[float, pg.Range(1, 500, "mm")] = 24.0,
    unit_m: Annotated[float, pg.Range(0, None, "metres", above=True)] = 1.0,
    blades: Annotated[int, pg.Range(0, 16)] = 0,
    widest_px: Annotated[int, pg.Range(1, 128, "px")] = 32,
    taps: Annotated[int, pg.Range(4, 256)] = 96,
    into: pg.TargetSpec | None = None,
    name: str = "depth_of_field",
) -> pg.Target:
    """Blur what is out of focus, by the circle of confusion of a thin lens.

    Parameters
    ----------
    color : linear light, any range; in front of the tone map. Alpha stays
    depth : red is the distance along the view axis in scene units, 0 where nothing is drawn; of the size of ``color``
    focus_distance : of what is sharp
    f_number : focal length through the aperture's diameter; 1.4 blurs much, 16 little
    focal_length_mm : of the lens. The picture's vertical angle of view is 2 atan(sensor height / (2 focal length))
    sensor_height_mm : 24 is full frame
    unit_m : metres of a scene unit
    blades : corners of the aperture, and of highlights; 0 is round, else 3 or more
    widest_px : radii above this are cut off
    taps : places at which the aperture is sampled
    into : where it goes; left out, float16 with the name ``name``
    name : of the passes and targets

    What is sharp does not bleed into what is blurred behind it, and what is near is blurred over what is sharp, where
    it covers that share of the lens.  What lies hidden behind a near thing's blurred rim is guessed from around it.

    Source: M. Potmesil, I. Chakravarty, "A Lens and Aperture Camera Model for Synthetic Image Generation", 1981 (circle
    of confusion); J. Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare", SIGGRAPH 2014
    (layers gathered at half size, tiles). Deviation: each layer is gathered by a radius of its own.

    Examples
    --------
    >>> import numpy as np
    >>> made = depth_of_field(pg.Input("frame"), pg.Input("depth"), 2.0, f_number=1.4, focal_length_mm=135)
    >>> step = np.where(np.arange(32) < 16, 1.0, 0.0).astype(np.float32)
    >>> frame, sharp = np.tile(step[:, None], (24, 1, 4)), np.full((24, 32), 2.0, np.float32)
    >>> with pg.compile(made, backend="numpy") as program:
    ...     focused, behind = (program(frame=frame, depth=sharp * far)["depth_of_field"][12, :, 0] for far in (1, 9))
    >>> bool((focused == step).all()), bool(0.0 < behind[17] < behind[14] < 1.0)
    (True, True)
    """
    if 0 < blades < 3:
        raise pg.GraphError(f"depth_of_field: blades must be 0 or 3 to 16, got {blades}")
    color = decoded(color, f"{name}_light")
    lens = ThinLens(f_number, focal_length_mm, sensor_height_mm, unit_m)
    blur: Any = (
        focus_distance.map(lens.blur)
        if isinstance(focus_distance, (pg.Value, pg.Derived))
        else lens.blur(focus_distance)
    )
    circles = circle(depth, blur, float(widest_px), into=pg.target(f"{name}_circle", "r16f"), name=f"{name}_circle")

    def half(part: str, format: str = "rgba16f", scale: float = HALF) -> pg.TargetSpec:
        return pg.target(f"{name}_{part}", format, like=color, scale=scale)

    layers = (half("back"), half("front"), half("reach", "r16f"))
    back, front, reach = halved(color, circles, into=layers, name=f"{name}_layers")
    behind, before = gathers(taps, blades)
    fill_behind, fill_before = fillings(taps)
    gathered = behind(back, into=half("far_taps"), name=f"{name}_far_taps")
    far = fill_behind(gathered, back, into=half("far"), name=f"{name}_far")
    tiles = pg.target(f"{name}_tiles", "r16f", like=reach, scale=1.0 / TILE)
    widest = widest_around_by(1 - -widest_px // (2 * TILE))(
        widest_of_tile(reach, into=tiles, name=f"{name}_tiles"),
        into=pg.target(f"{name}_widest", "r16f", like=reach, scale=1.0 / TILE), name=f"{name}_widest",
    )  # fmt: skip
    into_taps = (half("near_taps"), half("hidden_taps"))
    near, hidden = before(front, reach, back, widest, into=into_taps, name=f"{name}_near_taps")
    near, hidden = fill_before(near, hidden, widest, into=(half("near"), half("hidden")), name=f"{name}_near")
    little = blurred_a_little(color, circles, into=pg.target(f"{name}_little", "rgba16f", like=color))
    made: pg.Target = together(little, circles, far, near, hidden, into=into or pg.target(name, "rgba16f"), name=name)
    return made
