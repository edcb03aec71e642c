"""Formats of render targets: one table.

A kernel quantises what it stores (prelude functions named in ``store``), so storing itself is exact on every
backend and a value read back is the value that the reference computes.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass

from passgraph.arguments import among, shown
from passgraph.errors import GraphError


@dataclass(frozen=True, slots=True)
class Format:
    """One way to store a pixel.

    ``kind`` is ``"float"``, ``"half"``, ``"unorm8"``, ``"unorm16"`` or ``"depth"``.  sRGB formats hold
    encoded values: kernels read and write linear ones.
    """

    name: str
    channels: int
    kind: str
    srgb: bool = False
    stencil: bool = False

    @property
    def bytes_per_pixel(self) -> int:
        """As specified; a backend may need more (3-channel targets are padded on some GL drivers)."""
        each = {"float": 4, "half": 2, "unorm8": 1, "unorm16": 2, "depth": 4}[self.kind]
        return self.channels * each + (1 if self.stencil else 0)

    @property
    def is_depth(self) -> bool:
        return self.kind == "depth"

    @property
    def store(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Prelude functions that colour channels and alpha pass through before they are stored."""
        quantize = {
            "half": ("quantize_half",),
            "unorm8": ("quantize_unorm8",),
            "unorm16": ("quantize_unorm16",),
        }
        alpha = quantize.get(self.kind, ())
        return (("encode_srgb", *alpha) if self.srgb else alpha), alpha

    @property
    def decode(self) -> str | None:
        """Prelude function that colour channels pass through when a kernel reads them."""
        return "decode_srgb" if self.srgb else None

    @property
    def blendable(self) -> bool:
        """Whether draws may blend into it: blending happens on stored values, so encoded ones are refused."""
        return not self.is_depth and not self.srgb

    @property
    def unit(self) -> float:
        """The distance between neighbouring stored values near 1; 0 for float32, whose own ulp decides."""
        return {"half": 2.0**-11, "unorm8": 1 / 255, "unorm16": 1 / 65535}.get(self.kind, 0.0)


_COLOUR = {
    "8": "unorm8",
    "16": "unorm16",
    "16f": "half",
    "32f": "float",
}
FORMATS: dict[str, Format] = {
    f"{letters}{suffix}": Format(f"{letters}{suffix}", len(letters), kind)
    for letters in ("r", "rg", "rgb", "rgba")
    for suffix, kind in _COLOUR.items()
}
FORMATS["rgb8_srgb"] = Format("rgb8_srgb", 3, "unorm8", srgb=True)
FORMATS["rgba8_srgb"] = Format("rgba8_srgb", 4, "unorm8", srgb=True)
FORMATS["depth32f"] = Format("depth32f", 1, "depth")
FORMATS["depth32f_stencil8"] = Format("depth32f_stencil8", 1, "depth", stencil=True)


def format_named(name: str | Format) -> Format:
    """The format of this name.

    >>> format_named("rgb32f").bytes_per_pixel * 8
    96
    """
    if isinstance(name, Format):
        return name
    if not among(name, FORMATS):
        near = difflib.get_close_matches(shown(name), FORMATS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else "."
        raise GraphError(f"there is no format {shown(name)}{hint} Formats are {', '.join(FORMATS)}")
    return FORMATS[name]
