"""Light streaks: lines of light through bright points, as from anamorphic lenses and star filters."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import log, pi
from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.lens.god_rays import shining
from passgraph.effects.quantities import Color, NotNegative, axis_of, combined
from passgraph.language import Const, Image, exp, output_size, uv, vec2, vec3, vec4

#: Reads of one pass, each a stride farther than the one before.
READS = 4
#: Passes along one streak; each has `READS` times the stride of the one before, so that they reach 1,024 texels.
PASSES = 5
#: The logarithm of the remaining fraction of light at the end of a streak, a hundredth.
LOG_END = log(0.01)


@pg.function
def share_left(texels: float, length: float, rows: int) -> float:
    """Return the remaining fraction of a streak's light after some texels; ``length`` is a fraction of ``rows``."""
    return exp(texels * LOG_END / max(length * float(rows), 1.0))


@pg.kernel
def streaked(source: Image, along: vec2, length: float, stride: Const[int]) -> vec4:
    """Return the sum of texels in a direction, a stride apart, with falling weights."""
    share = share_left(float(stride), length, output_size().y)
    step, total, weight = along * float(stride) / vec2(source.size), vec3(0.0), 1.0
    for i in range(READS):
        total += source.sample(uv() - step * float(i)).rgb * weight
        weight *= share
    return vec4(total, 1.0)


@pg.kernel
def with_streak(color: Image, streak: Image, strength: vec3, length: float) -> vec4:
    """Add a streak of half the size, with as much light as its source, times ``strength``."""
    c = color[0, 0]
    # for an odd side, half of it ends beyond the picture
    light = streak.sample(0.5 * uv() * vec2(output_size()) / vec2(streak.size)).rgb
    return vec4(c.rgb + light * strength * (1.0 - share_left(1.0, length, streak.size.y)), c.a)


@effect("light-streaks", linear=True, alpha="premultiplied")
def light_streaks(
    color: pg.Target,
    threshold: NotNegative | pg.Value | pg.Derived = 0.8,
    intensity: NotNegative | pg.Value | pg.Derived = 0.5,
    length: Annotated[float, pg.Range(0, 1)] | pg.Value | pg.Derived = 0.3,
    streaks: Annotated[int, pg.Range(1, 16)] = 2,
    angle_rad: Annotated[float, pg.Range(-2 * pi, 2 * pi, "rad")] | pg.Value | pg.Derived = 0.0,
    tint: Color | pg.Value | pg.Derived = (1.0, 1.0, 1.0),
    into: pg.TargetSpec | None = None,
    name: str = "light_streaks",
) -> pg.Target:
    """Draw lines of light through bright points: two make an anamorphic lens, four or six a star filter.

    Parameters
    ----------
    color : any picture, linear light
    threshold : least luminance of light that makes streaks, scene-linear
    intensity : fraction of that light that all streaks together add
    length : length at which a hundredth of a streak's light remains, as a fraction of the picture's height
    streaks : number of streaks from a point, at equal angles
    angle_rad : angle of the first, counterclockwise from the right
    tint : factors of red, green and blue of the streaks, scene-linear; typical of anamorphic lenses is ``(0.3, 0.5,
        1.0)``
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    Light falls off exponentially along a streak.  It is summed in five passes of four reads each at half the size, each
    reading four times as far as the one before. NaN and infinity make no streaks.
    Source: M. Kawase, "Frame Buffer Postprocessing Effects in DOUBLE-S.T.E.A.L (Wreckless)", GDC 2003.

    Examples
    --------
    A lamp has light to its left and right, and none above:

    >>> import numpy as np
    >>> frame = np.zeros((32, 64, 4), np.float32)
    >>> frame[16:18, 32:34] = 1000.0
    >>> with pg.compile(light_streaks(pg.Input("frame")), backend="reference") as program:
    ...     light = program(frame=frame)["light_streaks"][..., 0]
    >>> bool(light[16, 26] > 1.0), bool(light[16, 39] > 1.0), float(light[8, 32])
    (True, True, 0.0)
    """
    half = pg.target(f"{name}_source", "rgba32f", like=color, scale=0.5)
    source = shining(color, color, threshold, False, into=half, name=half.name).border("zero")
    strength = combined(lambda light, of_colors: tuple(light * one / streaks for one in of_colors), intensity, tint)
    result = color
    for number in range(streaks):
        turn = 2 * pi * number / streaks
        # rows count downward
        along = combined(lambda angle, turn=turn: (axis_of(angle + turn)[0], -axis_of(angle + turn)[1]), angle_rad)
        streak = source
        for level in range(PASSES):
            own = pg.target(f"{name}_{number}_{level}", "rgba32f", like=source)
            streak = streaked(streak, along, length, READS**level, into=own, name=own.name).border("zero")
        last = number == streaks - 1
        where = into or pg.target(name, "rgba32f", like=color)
        where = where if last else pg.target(f"{name}_{number}", "rgba32f", like=color)
        result = with_streak(result, streak, strength, length, into=where, name=name if last else where.name)
    return result
