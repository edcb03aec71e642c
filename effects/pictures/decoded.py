"""Decode pictures that an effect reads many times at each pixel, and encode results for files."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph.effects.color.srgb_encoding import decode_srgb, encode_srgb_wide
from passgraph.language import Image, vec4


@pg.kernel
def as_it_is(color: Image) -> vec4:
    """Return the color unchanged."""
    return color[0, 0]


def decoded(color: pg.Target, name: str, stored: str = "rgba16f") -> pg.Target:
    """Convert a picture of an sRGB format to floats of linear light; return others unchanged.

    Each read of an sRGB format costs a power per channel; half floats distinguish its 256 steps.

    >>> decoded(pg.Input("frame", "rgba8"), "light").name, decoded(pg.Input("frame", "rgba8_srgb"), "light").name
    ('frame', 'light')
    """
    format = color.spec.format
    if format is None or not format.srgb:
        return color
    linear: pg.Target = as_it_is(color, into=pg.target(name, stored, like=color), name=name)
    return linear.border(color.border_rule)


@pg.kernel
def srgb_of(color: Image) -> vec4:
    light = color[0, 0]
    return vec4(encode_srgb_wide(light.r), encode_srgb_wide(light.g), encode_srgb_wide(light.b), light.a)


@pg.kernel
def light_of(color: Image) -> vec4:
    code = color[0, 0]
    return vec4(decode_srgb(code.r), decode_srgb(code.g), decode_srgb(code.b), code.a)


def encoded(color: pg.Target) -> pg.Target:
    """Encode linear light as sRGB, for files that hold integers; alpha stays."""
    return _converted(color, srgb_of, f"{color.name}_encoded")


def as_light(color: pg.Target) -> pg.Target:
    """Decode colors for a display, in floats, to linear light: the inverse of `encoded`."""
    return _converted(color, light_of, f"{color.name}_light")


def _converted(color: pg.Target, kernel: pg.PixelKernel[pg.Target], name: str) -> pg.Target:
    result: pg.Target = kernel(color, into=pg.target(name, "rgba32f", like=color), name=name)
    return result
