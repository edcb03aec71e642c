# mypy: disable-error-code="no-any-return"
"""Show a target: a pass that maps its values to bytes, and the encoding of these to a file."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.effects.color.srgb_encoding import encode_srgb
from passgraph.graph import targets
from passgraph.graph.calls import kernel
from passgraph.graph.run_values import Value
from passgraph.graph.targets import Target
from passgraph.language import Image, clamp, dot, isinf, isnan, vec3, vec4
from passgraph.language.kernel import function

#: How a texel is shown: its color, a channel, Rec. 709 luminance, or luminance in false color.
CHANNELS = ("color", "red", "green", "blue", "alpha", "luminance", "false color")
Bytes = NDArray[Any]


@dataclass(frozen=True)
class Look:
    """The mapping of a target's values to the screen.

    Attributes
    ----------
    channel : one of `CHANNELS`
    exposure : stops; values are multiplied by 2 to this power after `low` and `high` are mapped to 0 and 1
    low, high : the values shown as black and as white
    srgb : True to encode linear light as sRGB
    mark : True to show NaN in magenta and infinity in cyan
    """

    channel: str = "color"
    exposure: float = 0.0
    low: float = 0.0
    high: float = 1.0
    srgb: bool = False
    mark: bool = True

    def values(self) -> dict[str, Any]:
        """Return the run values of the pass that `shown` adds.

        >>> Look("red").values()["look_channel"]
        1
        """
        values = asdict(self)
        values["channel"] = CHANNELS.index(self.channel)
        values["srgb"], values["mark"] = int(self.srgb), int(self.mark)
        return {f"look_{name}": value for name, value in values.items()}


@function
def false_color(x: float) -> vec3:
    """Map 0 to 1 to colors of growing lightness: dark violet, blue, green, orange, light yellow."""
    t = clamp(x, 0.0, 1.0)
    red = clamp(0.28 + t * (-1.2 + t * (2.1 - 0.18 * t)), 0.0, 1.0)
    green = clamp(0.01 + t * (1.35 + t * (-0.6 + 0.15 * t)), 0.0, 1.0)
    blue = clamp(0.33 + t * (1.75 + t * (-4.7 + 2.75 * t)), 0.0, 1.0)
    return vec3(red, green, blue)


@kernel
def look(picture: Image, channel: int, exposure: float, low: float, high: float, srgb: int, mark: int) -> vec4:
    """Map a texel to 0 to 1; opaque, since alpha that is data would hide the picture."""
    held = picture[0, 0]
    scale = 2.0**exposure / (high - low)
    color = (held.rgb - low) * scale
    luminance = dot(color, vec3(0.2126, 0.7152, 0.0722))
    if channel == 1:
        color = vec3(color.r)
    if channel == 2:
        color = vec3(color.g)
    if channel == 3:
        color = vec3(color.b)
    if channel == 4:
        color = vec3((held.a - low) * scale)
    if channel == 5:
        color = vec3(luminance)
    if channel == 6:
        color = false_color(luminance)
    if srgb == 1 and channel != 6:
        color = clamp(color, 0.0, 1.0)
        color = vec3(encode_srgb(color.r), encode_srgb(color.g), encode_srgb(color.b))
    if mark == 1:
        total = held.r + held.g + held.b
        if isnan(held.r) or isnan(held.g) or isnan(held.b) or isnan(held.a):
            color = vec3(1.0, 0.0, 1.0)
        if isinf(held.r) or isinf(held.g) or isinf(held.b) or isinf(total):
            color = vec3(0.0, 1.0, 1.0)
    return vec4(color, 1.0)


@kernel
def spread(picture: Image) -> vec4:
    """Convert a picture of one channel to gray RGB."""
    return vec4(vec3(picture[0, 0].r), 1.0)


def shown(target: Target) -> Target:
    """Return the output "shown", in rgba8, of a pass that shows a target; its parameters are run values."""
    names = ("channel", "exposure", "low", "high", "srgb", "mark")
    values: dict[str, Any] = {name: Value(f"look_{name}") for name in names}
    format_ = target.spec.format
    color = (
        spread(target, into=targets.target("shown value", "rgba32f", like=target))
        if format_ and format_.channels == 1
        else target
    )
    return look(color, **values, into=targets.target("shown", "rgba8", like=target))


def encode(picture: Bytes, exact: bool) -> tuple[bytes, str]:
    """Encode an 8-bit picture without alpha, as PNG if ``exact``, else as JPEG; return the bytes and the media type."""
    from PIL import Image

    file = BytesIO()
    if exact:
        Image.fromarray(np.ascontiguousarray(picture[:, :, :3])).save(file, "PNG", compress_level=1)
        return file.getvalue(), "image/png"
    # RGBX avoids a copy without alpha, which would take twice as long as encoding.
    height, width, channels = picture.shape
    mode = "RGBX" if channels == 4 else "RGB"
    image = Image.frombuffer(mode, (width, height), np.ascontiguousarray(picture), "raw", mode, 0, 1)
    image.save(file, "JPEG", quality=90, subsampling=0)
    return file.getvalue(), "image/jpeg"


def range_of(values: NDArray[Any]) -> tuple[float, float]:
    """Return the least and the largest finite number, (0, 1) if there is none; their difference is never 0.

    >>> range_of(np.array([[[2.0], [np.nan], [6.0]]]))
    (2.0, 6.0)
    """
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 0.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    return (low, high) if high - low > 1e-30 else (low, low + 1.0)


def histogram_of(values: NDArray[Any], low: float, high: float, bins: int = 64) -> list[list[int]]:
    """Return the histogram from low to high, for at most three channels."""
    count = 1 if values.shape[2] < 3 else 3
    return [np.histogram(values[:, :, k], bins, (low, high))[0].tolist() for k in range(count)]
