# mypy: disable-error-code="no-any-return"
"""A target as a picture to look at: a pass that maps its values to bytes, and those bytes as a file."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.color.tone_map import encode_srgb

#: What is shown of a texel: its color, one channel, Rec. 709 luminance, or luminance in false color.
CHANNELS = ("color", "red", "green", "blue", "alpha", "luminance", "false color")
Bytes = NDArray[Any]


@dataclass(frozen=True)
class Look:
    """How a target is looked at.

    Attributes
    ----------
    channel : one of `CHANNELS`
    exposure : stops; values are multiplied by 2 to this power after `low` and `high` are mapped to 0 and 1
    low, high : what is shown as black and as white
    srgb : whether values are linear light, encoded as sRGB for the screen
    mark : whether NaN is shown in magenta, infinity in cyan
    """

    channel: str = "color"
    exposure: float = 0.0
    low: float = 0.0
    high: float = 1.0
    srgb: bool = False
    mark: bool = True

    def values(self) -> dict[str, Any]:
        """Run values of the pass that `shown` adds.

        >>> Look("red").values()["look_channel"]
        1
        """
        made = asdict(self)
        made["channel"] = CHANNELS.index(self.channel)
        made["srgb"], made["mark"] = int(self.srgb), int(self.mark)
        return {f"look_{name}": value for name, value in made.items()}


@pg.function
def false_color(x: float) -> pg.vec3:
    """From dark violet through blue, green and orange to light yellow, growing in lightness."""
    t = pg.clamp(x, 0.0, 1.0)
    red = pg.clamp(0.28 + t * (-1.2 + t * (2.1 - 0.18 * t)), 0.0, 1.0)
    green = pg.clamp(0.01 + t * (1.35 + t * (-0.6 + 0.15 * t)), 0.0, 1.0)
    blue = pg.clamp(0.33 + t * (1.75 + t * (-4.7 + 2.75 * t)), 0.0, 1.0)
    return pg.vec3(red, green, blue)


@pg.kernel
def look(picture: pg.Image, channel: int, exposure: float, low: float, high: float, srgb: int, mark: int) -> pg.vec4:
    """One texel as bytes hold it; opaque, since alpha that is data would hide the picture."""
    held = picture[0, 0]
    scale = 2.0**exposure / (high - low)
    color = (held.rgb - low) * scale
    luminance = pg.dot(color, pg.vec3(0.2126, 0.7152, 0.0722))
    if channel == 1:
        color = pg.vec3(color.r)
    if channel == 2:
        color = pg.vec3(color.g)
    if channel == 3:
        color = pg.vec3(color.b)
    if channel == 4:
        color = pg.vec3((held.a - low) * scale)
    if channel == 5:
        color = pg.vec3(luminance)
    if channel == 6:
        color = false_color(luminance)
    if srgb == 1 and channel != 6:
        color = pg.clamp(color, 0.0, 1.0)
        color = pg.vec3(encode_srgb(color.r), encode_srgb(color.g), encode_srgb(color.b))
    if mark == 1:
        total = held.r + held.g + held.b
        if pg.isnan(held.r) or pg.isnan(held.g) or pg.isnan(held.b) or pg.isnan(held.a):
            color = pg.vec3(1.0, 0.0, 1.0)
        if pg.isinf(held.r) or pg.isinf(held.g) or pg.isinf(held.b) or pg.isinf(total):
            color = pg.vec3(0.0, 1.0, 1.0)
    return pg.vec4(color, 1.0)


@pg.kernel
def spread(picture: pg.Image) -> pg.vec4:
    """A picture of one channel as gray."""
    return pg.vec4(pg.vec3(picture[0, 0].r), 1.0)


def shown(target: pg.Target) -> pg.Target:
    """Return a pass over a target that makes its picture, "shown" in rgba8; its numbers come with each run."""
    names = ("channel", "exposure", "low", "high", "srgb", "mark")
    values: dict[str, Any] = {name: pg.Value(f"look_{name}") for name in names}
    format_ = target.spec.format
    held = (
        spread(target, into=pg.target("shown value", "rgba32f", like=target))
        if format_ and format_.channels == 1
        else target
    )
    return look(held, **values, into=pg.target("shown", "rgba8", like=target))


def encode(picture: Bytes, exact: bool) -> tuple[bytes, str]:
    """Return a file of a picture of bytes and its media type: PNG where it must be exact, else JPEG; without alpha."""
    from PIL import Image

    file = BytesIO()
    if exact:
        Image.fromarray(np.ascontiguousarray(picture[:, :, :3])).save(file, "PNG", compress_level=1)
        return file.getvalue(), "image/png"
    # As it is: a copy without alpha would take twice the time of the encoder.
    height, width, channels = picture.shape
    mode = "RGBX" if channels == 4 else "RGB"
    image = Image.frombuffer(mode, (width, height), np.ascontiguousarray(picture), "raw", mode, 0, 1)
    image.save(file, "JPEG", quality=90, subsampling=0)
    return file.getvalue(), "image/jpeg"


def range_of(values: NDArray[Any]) -> tuple[float, float]:
    """Return the least and the largest finite number, apart enough to divide by; (0, 1) where there is none.

    >>> range_of(np.array([[[2.0], [np.nan], [6.0]]]))
    (2.0, 6.0)
    """
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 0.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    return (low, high) if high - low > 1e-30 else (low, low + 1.0)


def histogram_of(values: NDArray[Any], low: float, high: float, bins: int = 64) -> list[list[int]]:
    """Return how many texels fall into bins from low to high, for each of at most three channels."""
    count = 1 if values.shape[2] < 3 else 3
    return [np.histogram(values[:, :, k], bins, (low, high))[0].tolist() for k in range(count)]
