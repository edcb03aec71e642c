"""Color spaces as files state them: Color Interop IDs, codes of ITU-T H.273, and chromaticities.

A Color Interop ID, such as "srgb_p3d65_scene", names a transfer function, a gamut and an image state (ASWF Color
Interop Forum, "Color Space Encodings for Texture Assets and CG Rendering"; OpenColorIO 2.5 and OpenImageIO 3.1 know
them). A few begin with a namespace, such as "ocio:acescct_ap1_scene".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from passgraph.records import dataclass

#: What files without tags hold: integers, and floats.
SRGB, LINEAR = "srgb_rec709_scene", "lin_rec709_scene"
#: H.273: nothing is stated.
UNSPECIFIED = 2
#: Gamut → x and y of red, green, blue and white, as OpenEXR's ``chromaticities``.
_CHROMATICITIES = {
    "rec709": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290),
    "p3d65": (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290),
    "rec2020": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
    "adobergb": (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.3290),
    "ap0": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767),
    "ap1": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767),
}
#: Chromaticities in files have two to four digits.
_NEAR = 1e-3
#: H.273, tables 2, 3 and 4. Gamma 2.4 is the display of BT.709 video (BT.1886).
_PRIMARIES = {"rec709": 1, "p3d65": 12, "rec2020": 9}
_TRANSFERS = {"lin": 8, "srgb": 13, "g22": 4, "g24": 1, "pq": 16, "hlg": 18, "g26": 17}
_MATRICES = {"rec709": 1, "p3d65": 1, "rec2020": 9}
#: Transfer functions of Rec. 709 colors that PNG states by gAMA, which older readers know too.
_GAMMAS = ("lin", "g18", "g22", "g24")


class Codes(NamedTuple):
    """The numbers of a color space in ITU-T H.273, for video and PNG's cICP."""

    primaries: int
    transfer: int
    matrix: int


@dataclass(frozen=True)
class ColorSpace:
    """The color space of a result.

    Attributes
    ----------
    name : for messages
    interop : its Color Interop ID; "" if it has none, so that files state nothing

    >>> ColorSpace("ACEScg", "lin_ap1_scene").chromaticities[:2]
    (0.713, 0.293)
    >>> ColorSpace("Rec.2100-PQ - Display", "pq_rec2020_display").codes
    Codes(primaries=9, transfer=16, matrix=9)
    """

    name: str
    interop: str = ""

    @property
    def transfer(self) -> str:
        return self.interop.split("_")[0]

    @property
    def gamut(self) -> str:
        """Return the gamut's name in the ID; "" if it has none."""
        parts = self.interop.split("_")
        return parts[1] if len(parts) == 3 else ""

    @property
    def is_srgb(self) -> bool:
        """Return True for what readers take a file of integers without tags as."""
        return (self.transfer, self.gamut) == ("srgb", "rec709")

    @property
    def codes(self) -> Codes | None:
        """Return the codes of H.273; None if they cannot express it."""
        if self.gamut not in _PRIMARIES or self.transfer not in _TRANSFERS:
            return None
        return Codes(_PRIMARIES[self.gamut], _TRANSFERS[self.transfer], _MATRICES[self.gamut])

    @property
    def has_gamma(self) -> bool:
        """Return True if PNG's gAMA states it: colors in Rec. 709, as a power of light."""
        return self.gamut == "rec709" and self.transfer in _GAMMAS

    @property
    def chromaticities(self) -> tuple[float, ...] | None:
        """Return OpenEXR's chromaticities of linear light in a known gamut; else None."""
        return _CHROMATICITIES.get(self.gamut) if self.transfer == "lin" else None


@dataclass(frozen=True)
class Recoded:
    """The color space of a result whose gamut is its source's: sRGB codes decoded to light, or encoded again.

    >>> Recoded("lin").of("p3d65").interop, Recoded("srgb").of("rec709").is_srgb
    ('lin_p3d65_scene', True)
    """

    transfer: str

    def of(self, gamut: str) -> ColorSpace:
        """Return the result's color space, given its source's gamut; "" for one without a name."""
        name = {"lin": "linear light", "srgb": "sRGB codes"}[self.transfer]
        return ColorSpace(f"{name} in the gamut of its source", f"{self.transfer}_{gamut}_scene" if gamut else "")


def space_of_codes(primaries: int, transfer: int) -> str:
    """Return the ID of the color space with codes of H.273; "" for one without an ID.

    >>> space_of_codes(9, 16), space_of_codes(12, 13), space_of_codes(1, 1)
    ('pq_rec2020_display', 'srgb_p3d65_scene', '')
    """
    gamuts = {number: gamut for gamut, number in _PRIMARIES.items()}
    name = {8: "lin", 13: "srgb", 16: "pq", 18: "hlg"}.get(transfer)
    if name is None or primaries not in gamuts:
        return ""
    return f"{name}_{gamuts[primaries]}_{'display' if name in ('pq', 'hlg') else 'scene'}"


def gamut_named(chromaticities: Sequence[float]) -> str:
    """Return the name of a gamut in IDs; "" for one without a name.

    >>> gamut_named([0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329])
    'rec709'
    """
    for name, known in _CHROMATICITIES.items():
        if all(abs(a - b) < _NEAR for a, b in zip(known, chromaticities, strict=True)):
            return name
    return ""
