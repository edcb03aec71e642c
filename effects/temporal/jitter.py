"""Cameras jittered by fractions of a pixel per frame, for effects that accumulate samples over frames."""

from __future__ import annotations

from dataclasses import replace

import passgraph as pg
from passgraph import arguments

#: Frames after which positions repeat.
PERIOD = 16


def radical_inverse(number: int, base: int) -> float:
    """Mirror the digits of an integer at the radix point: return a number from 0 to 1.

    >>> [radical_inverse(number, 2) for number in (1, 2, 3, 4)]
    [0.5, 0.25, 0.75, 0.125]
    """
    share, value = 1.0, 0.0
    while number:
        share /= base
        number, digit = divmod(number, base)
        value += share * digit
    return value


def jitter_px(number: int, period: int = PERIOD) -> tuple[float, float]:
    """Return the sample position of a frame, right and down from the pixels' centers, in pixels from -0.6 to 0.6.

    Parameters
    ----------
    number : index of the frame, from 0
    period : frames after which positions repeat, 1 to 1024; their mean is the center

    Source: J. H. Halton, 1960, in bases 2 and 3.

    >>> jitter_px(0, 1), [round(x, 3) for x in jitter_px(0, 2)]
    ((0.0, 0.0), [0.125, -0.167])
    """
    number = arguments.whole_number(number, "jitter: number", 0, 2**62)
    period = arguments.whole_number(period, "jitter: period", 1, 1024)
    places = [(radical_inverse(place, 2), radical_inverse(place, 3)) for place in range(1, period + 1)]
    x, y = places[number % period]
    return x - sum(p[0] for p in places) / period, y - sum(p[1] for p in places) / period


def jittered(camera: pg.Camera, number: int, size: tuple[int, int], period: int = PERIOD) -> pg.Camera:
    """Return a camera whose picture of a size (width, height) is sampled at `jitter_px`.

    Give it to the run that draws the scene; `passgraph.effects.taa` gets the camera without jitter.

    >>> camera = pg.Camera((0, 0, 5), (0, 0, 0))
    >>> [round(x, 5) for x in jittered(camera, 0, (100, 50), period=2).shift]
    [0.0025, 0.00667]
    """
    camera = arguments.instance(camera, pg.Camera, "jitter: camera", "a passgraph.Camera")
    sides = arguments.several(size, object, "jitter: size", "width and height in pixels")
    if len(sides) != 2:
        raise pg.GraphError(f"jitter: size must be width and height in pixels, got {arguments.shown(size)}")
    width, height = (arguments.whole_number(side, "jitter: size", 1, 65536) for side in sides)
    x, y = jitter_px(number, period)
    across, up = camera.shift
    return replace(camera, shift=(across + 2.0 * x / width, up - 2.0 * y / height))
