"""HDR10's static metadata of a video: the display that it was mastered on (SMPTE ST 2086), and its light levels."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from passgraph.records import dataclass

if TYPE_CHECKING:
    from av.video.frame import VideoFrame

#: libavutil's AVMasteringDisplayMetadata: x and y of red, green, blue and white, then the least and greatest luminance,
#: as fractions, and two flags that these are given. AVContentLightMetadata: two whole numbers.
_DISPLAY, _LIGHT = struct.Struct("=20i2i"), struct.Struct("=2I")
#: Units of x265's and x264's numbers: 0.00002 of chromaticity, 0.0001 candela per square meter.
_CHROMATICITY, _LUMINANCE = 50_000, 10_000

#: Encoders that store it: the option with their own parameters, and the parameters of the display and of light.
_OPTIONS = {
    "libx265": ("x265-params", "master-display", "max-cll"),
    "libx264": ("x264-params", "mastering-display", "cll"),
    "libsvtav1": ("svtav1-params", "mastering-display", "content-light"),
}


@dataclass(frozen=True)
class HdrMetadata:
    """HDR10's static metadata.

    Attributes
    ----------
    chromaticities : x and y of red, green, blue and white of the mastering display; empty if not given
    luminance : its least and greatest luminance, in candelas per square meter; empty if not given
    light : the greatest light level of a pixel, and of a frame's mean, in candelas per square meter; empty if not given
    """

    chromaticities: tuple[float, ...] = ()
    luminance: tuple[float, ...] = ()
    light: tuple[int, ...] = ()

    @staticmethod
    def of(frame: VideoFrame) -> HdrMetadata:
        """Return the metadata of a decoded frame."""
        from av.sidedata.sidedata import Type

        side_data: Any = frame.side_data
        display, light = side_data.get(Type.MASTERING_DISPLAY_METADATA), side_data.get(Type.CONTENT_LIGHT_LEVEL)
        chromaticities: tuple[float, ...] = ()
        luminance: tuple[float, ...] = ()
        if display is not None and len(bytes(display)) >= _DISPLAY.size:
            *pairs, has_primaries, has_luminance = _DISPLAY.unpack_from(bytes(display))
            numbers = [top / bottom if bottom else 0.0 for top, bottom in zip(pairs[::2], pairs[1::2], strict=True)]
            chromaticities = tuple(numbers[:8]) if has_primaries else ()
            luminance = tuple(numbers[8:]) if has_luminance else ()
        levels = _LIGHT.unpack_from(bytes(light)) if light is not None else ()
        return HdrMetadata(chromaticities, luminance, levels if any(levels) else ())  # 0 is unknown (CTA-861.3)

    def parameters(self, encoder: str) -> tuple[str, str] | None:
        """Return an encoder's option that stores it, and the option's value; None if there is nothing, or no option."""
        if encoder not in _OPTIONS:
            return None
        option, display, light = _OPTIONS[encoder]
        texts = []
        if self.chromaticities and self.luminance:
            texts.append(f"{display}={self._display(encoder)}")
        if self.light:
            texts.append(f"{light}={self.light[0]},{self.light[1]}")
        return (option, ":".join(texts)) if texts else None

    def _display(self, encoder: str) -> str:
        """Return the display as encoders write it: green, blue, red, white, greatest and least luminance."""
        scales = (1, 1) if encoder == "libsvtav1" else (_CHROMATICITY, _LUMINANCE)

        def pair(name: str, numbers: tuple[float, ...], scale: int) -> str:
            words = [f"{number:.6g}" if scale == 1 else str(round(number * scale)) for number in numbers]
            return f"{name}({','.join(words)})"

        red, green, blue, white = (self.chromaticities[i : i + 2] for i in (0, 2, 4, 6))
        colors = zip("GBR", (green, blue, red), strict=True)
        return (
            "".join(pair(name, numbers, scales[0]) for name, numbers in colors)
            + pair("WP", white, scales[0])
            + pair("L", self.luminance[::-1], scales[1])
        )
