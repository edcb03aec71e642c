"""Supersampling: compute a picture at twice the size, and average four samples per pixel."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph.effects.checked import checked
from passgraph.effects.color.srgb_encoding import decode_srgb, encode_srgb_wide
from passgraph.language import Const, Image, ivec2, pixel, vec3, vec4

#: Samples along each side of a pixel.
ACROSS = 2


@pg.kernel
def mean_of_four(color: Image, encoded: Const[bool], straight: Const[bool]) -> vec4:
    """Return the mean of a pixel's four samples in linear light; straight alpha weights colors by alpha."""
    first = ACROSS * pixel()
    total = vec4(0.0)
    for y in range(ACROSS):
        for x in range(ACROSS):
            c = color.texel(first + ivec2(x, y))
            if encoded:
                c.rgb = vec3(decode_srgb(c.r), decode_srgb(c.g), decode_srgb(c.b))
            if straight:
                c.rgb = c.rgb * c.a
            total += c
    mean = total / float(ACROSS * ACROSS)
    if straight and mean.a > 0.0:
        mean.rgb = mean.rgb / mean.a
    if encoded:
        mean.rgb = vec3(encode_srgb_wide(mean.r), encode_srgb_wide(mean.g), encode_srgb_wide(mean.b))
    return mean


@checked
def supersampled(
    color: pg.Target,
    encoded: bool = True,
    straight: bool = False,
    into: pg.TargetSpec | None = None,
    name: str = "supersampled",
) -> pg.Target:
    """Reduce a picture to half the size: each pixel is the mean of four samples, in linear light.

    Parameters
    ----------
    color : the picture to smooth, computed at twice the final size
    encoded : colors are sRGB-encoded, 0 to 1, as after a tone map, and so is the result; off, they are linear light of
        any range
    straight : color is not multiplied by alpha, also in the result
    into : destination target; default: half of ``color`` each way, 8 bits per channel if encoded, else float16, named
        ``name``
    name : name of the pass

    Samples are averaged after tone mapping: before it, one bright sample would dominate the other three, and edges of
    lamps would stay jagged.  Compile at twice the size; sizes in pixels of earlier effects are halved.

    Examples
    --------
    >>> import numpy as np
    >>> smooth = supersampled(pg.Input("frame"), encoded=False)
    >>> samples = np.arange(16, dtype=np.float32).reshape(2, 2, 4)
    >>> with pg.compile(smooth, backend="reference") as program:
    ...     program(frame=samples)["supersampled"].tolist()
    [[[6.0, 7.0, 8.0, 9.0]]]
    """
    target = into or pg.target(name, "rgba8" if encoded else "rgba16f", like=color, scale=1.0 / ACROSS)
    return mean_of_four(color, encoded, straight, into=target, name=name)
