"""A table of the formats of render targets.

A kernel quantizes its results before it stores them (the prelude functions named in ``store``).  So storing is exact on
every backend, and a value read back is the value that the reference computes.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from passgraph.arguments import among, near, shown
from passgraph.cached import cached_property
from passgraph.errors import BackendError, GraphError
from passgraph.records import dataclass

if TYPE_CHECKING:
    from collections.abc import Mapping

T = TypeVar("T")
#: A prelude function applied to a value before it is stored, and its further arguments.
Store: TypeAlias = tuple[str | float, ...]


@dataclass(frozen=True)
class Format:
    """A pixel format: a number of channels of ``bits`` bits each.

    If ``steps`` is given, a channel is an unsigned normalized integer: 0 to ``steps`` stands for 0 to 1, and NaN is
    stored as 0.  Else it is a floating-point number.  sRGB formats store encoded values; kernels read and write linear
    ones.
    """

    name: str
    channels: int
    bits: int
    steps: int = 0
    srgb: bool = False
    is_depth: bool = False
    stencil: bool = False

    @property
    def bytes_per_pixel(self) -> int:
        """Return the bytes as specified; a backend may need more (some GL drivers pad 3-channel targets)."""
        return self.channels * self.bits // 8 + (1 if self.stencil else 0)

    @cached_property
    def number(self) -> str:
        """Return the channel type as a NumPy name: ``"f4"``, ``"f2"``, ``"u1"`` …"""
        return f"{'u' if self.steps else 'f'}{self.bits // 8}"

    @property
    def store(self) -> tuple[tuple[Store, ...], tuple[Store, ...]]:
        """Return the operations applied to color and to alpha before they are stored, in order."""
        alpha = (("quantize", float(self.steps)),) if self.steps else format_spelling(self, _STORES, __file__)
        return ((("encode_srgb",), *alpha) if self.srgb else alpha), alpha

    @property
    def decode(self) -> str | None:
        """Return the prelude function applied to color channels when a kernel reads them; None if there is none."""
        return "decode_srgb" if self.srgb else None

    @property
    def blendable(self) -> bool:
        """Return True if draws may blend into it; encoded formats do not qualify, as stored values are blended."""
        return not self.is_depth and not self.srgb

    @property
    def unit(self) -> float:
        """Return the distance between neighboring stored values near 1; 0 for float32, whose own ulp decides."""
        if self.steps:
            return 1 / self.steps
        return 2.0**-11 if self.bits == 16 else 0.0


#: The operation applied to a floating-point number before it is stored (`Format.number`).
_STORES: dict[str, tuple[Store, ...]] = {"f4": (), "f2": (("quantize_half",),)}


def format_spelling(format_: Format, spellings: Mapping[str, T], file: str) -> T:
    """Return a backend's spelling of a format's channel type (`Format.number`).

    Raises
    ------
    BackendError
        If the file has no spelling for it: a new format needs a row there.
    """
    if format_.number not in spellings:
        raise BackendError(
            f"format {format_.name!r}: {file} has no spelling for channel type {format_.number!r}, only "
            f"{', '.join(map(repr, spellings))}. Add a row for them there, or use another format"
        )
    return spellings[format_.number]


#: Suffix of a color format's name → bits and steps of a channel.
_COLOUR = {
    "8": (8, 255),
    "16": (16, 65535),
    "16f": (16, 0),
    "32f": (32, 0),
}
FORMATS: dict[str, Format] = {
    f"{letters}{suffix}": Format(f"{letters}{suffix}", len(letters), *channel)
    for letters in ("r", "rg", "rgb", "rgba")
    for suffix, channel in _COLOUR.items()
}
FORMATS["rgb8_srgb"] = Format("rgb8_srgb", 3, *_COLOUR["8"], srgb=True)
FORMATS["rgba8_srgb"] = Format("rgba8_srgb", 4, *_COLOUR["8"], srgb=True)
FORMATS["depth32f"] = Format("depth32f", 1, 32, is_depth=True)
FORMATS["depth32f_stencil8"] = Format("depth32f_stencil8", 1, 32, is_depth=True, stencil=True)


def format_named(name: str | Format) -> Format:
    """Return the format with this name.

    >>> format_named("rgb32f").bytes_per_pixel * 8
    96
    """
    if isinstance(name, Format):
        return name
    if not among(name, FORMATS):
        hint = near(shown(name), FORMATS)
        raise GraphError(f"there is no format {shown(name)}{hint}; formats are {', '.join(FORMATS)}")
    return FORMATS[name]


@cache
def colour_format(number: str, channels: int) -> Format | None:
    """Return the format with this channel type (`Format.number`) and number of channels; None if there is none.

    >>> colour_format("u1", 4).name, colour_format("f8", 4)
    ('rgba8', None)
    """
    plain = (candidate for candidate in FORMATS.values() if not candidate.srgb and not candidate.is_depth)
    return next(
        (candidate for candidate in plain if (candidate.number, candidate.channels) == (number, channels)), None
    )


def curved(format_: Format, srgb: bool) -> Format | None:
    """Return the sRGB-encoded, or linear, format of the same channel type and count; None if there is none.

    >>> curved(FORMATS["rgba8"], True).name, curved(FORMATS["rgba8_srgb"], False).name, curved(FORMATS["r8"], True)
    ('rgba8_srgb', 'rgba8', None)
    """
    return FORMATS.get(format_.name.removesuffix("_srgb") + ("_srgb" if srgb else ""))


def as_many_channels(one: Format, other: Format) -> bool:
    """Return True if a picture of one format can replace one of the other: only alpha may be missing, and is 1 then.

    >>> as_many_channels(FORMATS["rgb8"], FORMATS["rgba16f"]), as_many_channels(FORMATS["r8"], FORMATS["rgb8"])
    (True, False)
    """
    return min(one.channels, 3) == min(other.channels, 3)


def float_format(channels: int) -> Format:
    """Return the float32 format with this number of channels."""
    return FORMATS[f"{'rgba'[:channels]}32f"]


def padded(format_: Format) -> Format:
    """Return the format in which devices without formats of three channels store one: with an alpha of 1.

    >>> padded(FORMATS["rgb8_srgb"]).name, padded(FORMATS["rg16"]).name
    ('rgba8', 'rg16')
    """
    return (format_.channels == 3 and colour_format(format_.number, 4)) or format_
