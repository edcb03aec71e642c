"""Formats of image files: those that can be read, the capabilities of those that can be written, and metadata."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.color_tags import LINEAR, ColorSpace, Recoded, gamut_named
from passgraph.records import dataclass

Pixels = NDArray[Any]  # (h, w, channels) uint8, uint16, float16 or float32

#: Formats that are read, by OpenImageIO's names, with the suffixes by which their files are found in a folder.  Its
#: "null" reader is left out: it invents pixels from a file's name.
READABLE: Mapping[str, tuple[str, ...]] = {
    "png": (".png", ".apng"), "jpeg": (".jpg", ".jpeg"), "tiff": (".tif", ".tiff"), "openexr": (".exr",),
    "webp": (".webp",), "bmp": (".bmp",), "gif": (".gif",), "targa": (".tga",), "hdr": (".hdr",),
    "pnm": (".ppm", ".pgm", ".pbm", ".pnm", ".pfm"), "dpx": (".dpx",), "cineon": (".cin",), "jpegxl": (".jxl",),
    "jpeg2000": (".jp2", ".j2k"), "psd": (".psd",), "dds": (".dds",), "fits": (".fits",), "ico": (".ico",),
    "iff": (".iff",), "rla": (".rla",), "sgi": (".sgi",), "softimage": (".pic",),
}  # fmt: skip
#: NumPy's format is read by NumPy.
READ_SUFFIXES = (".npy", *chain.from_iterable(READABLE.values()))
EXPECTED = (
    "PNG, JPEG, TIFF, OpenEXR, WebP, BMP, GIF, TGA, HDR, PNM, PFM, DPX, Cineon, JPEG XL, JPEG 2000, PSD, DDS, FITS, "
    "ICO, IFF, RLA, SGI, Softimage PIC or npy"
)


@dataclass(frozen=True)
class WritableFormat:
    """A file format's capabilities for writing.

    Attributes
    ----------
    name : for messages
    writer : OpenImageIO's name of the format
    dtypes : supported channel types
    channels : supported numbers of channels
    associated : color is stored multiplied by alpha
    attributes : OpenImageIO's settings for writing
    largest : largest width or height in pixels
    """

    name: str
    writer: str
    dtypes: tuple[str, ...]
    channels: tuple[int, ...] = (1, 2, 3, 4)
    associated: bool = False
    attributes: tuple[tuple[str, Any], ...] = ()
    largest: int = 1 << 30

    @property
    def is_float(self) -> bool:
        return self.dtypes[0].startswith("float")


# Settings keep the rendered values: no chroma subsampling, lossless WebP. PNG's zlib level 4 makes files a tenth
# larger than level 6 in a third of the time.
_FAITHFUL_JPEG = (("compression", "jpeg:95"), ("jpeg:subsampling", "4:4:4"))
_INTEGERS = ("uint8", "uint16")
_JPEG = WritableFormat("JPEG", "jpeg", ("uint8",), (1, 3), attributes=_FAITHFUL_JPEG, largest=65500)
_TIFF = WritableFormat("TIFF", "tiff", (*_INTEGERS, "float32", "float16"), attributes=(("compression", "zip"),))
_LOSSLESS = (("compression", "lossless"),)
#: By suffix. The first dtype is the default one.
WRITABLE = {
    ".png": WritableFormat("PNG", "png", _INTEGERS, attributes=(("png:compressionLevel", 4),)),
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    ".tif": _TIFF,
    ".tiff": _TIFF,
    ".webp": WritableFormat("WebP", "webp", ("uint8",), (3, 4), attributes=_LOSSLESS, largest=16383),
    ".exr": WritableFormat(
        "OpenEXR", "openexr", ("float32", "float16"), associated=True, attributes=(("compression", "zip"),)
    ),
    ".npy": WritableFormat("npy", "", ("float32",)),
    ".hdr": WritableFormat("HDR", "hdr", ("float32",), (3,)),
    ".pfm": WritableFormat("PFM", "pnm", ("float32",), (1, 3)),
    ".pgm": WritableFormat("PGM", "pnm", _INTEGERS, (1,)),
    ".ppm": WritableFormat("PPM", "pnm", _INTEGERS, (3,)),
    ".pnm": WritableFormat("PNM", "pnm", _INTEGERS, (1, 3)),
    ".bmp": WritableFormat("BMP", "bmp", ("uint8",), (1, 3, 4)),
    ".tga": WritableFormat("TGA", "targa", ("uint8",), (1, 3, 4)),
    ".dpx": WritableFormat("DPX", "dpx", ("uint16", "uint8"), (1, 3, 4)),
    ".jxl": WritableFormat("JPEG XL", "jpegxl", (*_INTEGERS, "float32"), (1, 3, 4)),
}


#: Entries that describe colors. Those of OpenEXR that name transforms hold for the source's colors only.
COLOR_ENTRIES = (
    "ICCProfile", "CICP", "colorInteropID", "chromaticities", "adoptedNeutral", "whiteLuminance",
    "renderingTransform", "lookModTransform", "acesImageContainerFlag",
)  # fmt: skip
#: The writers that store them, by OpenImageIO's names; an ICC profile is left to each writer.
_STORED_BY = dict.fromkeys(COLOR_ENTRIES[2:], ("openexr",)) | {"CICP": ("png",)}
#: OpenImageIO's attribute by which its writers choose color tags. PNG's writes sRGB, gAMA and cHRM without it, even
#: beside other tags (3.2.2); a name that it does not know writes none.
_COLOR_SPACE, NO_TAGS = "oiio:ColorSpace", "unknown"


@dataclass(frozen=True)
class Metadata:
    """Metadata of a picture file, to be written to a picture made from it.

    Attributes
    ----------
    entries : (name, OpenImageIO's type, value): ICC profile, resolution, EXIF, time code ...
    opaque : True if the file has no alpha
    gray : True if it has one channel beside alpha
    deep : True if it holds 16-bit integers
    half : True if it holds floats of 16 bits
    space : the color space that the file states, by its Color Interop ID or as OpenImageIO names it; "" if none
    additive : True if color where alpha is 0 is light that is added: color is stored multiplied by alpha
    numbers : True if pixels are four numbers, not color with alpha
    """

    entries: tuple[tuple[str, str, Any], ...] = ()
    opaque: bool = False
    deep: bool = False
    space: str = ""
    additive: bool = False
    numbers: bool = False
    half: bool = False
    gray: bool = False

    def get(self, name: str) -> Any:
        """Return the value of an entry, or None."""
        return next((value for key, _, value in self.entries if key == name), None)

    @property
    def profile(self) -> bytes:
        """Return the ICC profile; empty if there is none."""
        value = self.get("ICCProfile")
        return b"" if value is None else bytes(np.asarray(value, np.uint8))

    @property
    def gamut(self) -> str:
        """Return the name of the gamut in IDs: "rec709" if the file states nothing, "" for one without a name."""
        if self.space or self.profile:
            return ColorSpace("", self.space).gamut
        chromaticities = self.get("chromaticities")
        return "rec709" if chromaticities is None else gamut_named(chromaticities)

    def in_space(self, space: ColorSpace | Recoded) -> Metadata:
        """Return the metadata of a result in another color space, with the tags of that space only.

        >>> source = Metadata((("Make", "string", "a camera"), ("ICCProfile", "uint8[4]", (1, 2, 3, 4))))
        >>> result = source.in_space(ColorSpace("ACEScg", "lin_ap1_scene"))
        >>> result.entries, result.space
        ((('Make', 'string', 'a camera'),), 'lin_ap1_scene')
        """
        if isinstance(space, Recoded):
            # Frames of HDR video are decoded as sRGB too, which makes no light.
            space = space.of("" if ColorSpace("", self.space).transfer in ("pq", "hlg") else self.gamut)
        kept = tuple(entry for entry in self.entries if entry[0] not in COLOR_ENTRIES)
        return replace(self, entries=kept, space=space.interop or NO_TAGS)

    def attributes_for(self, writer: str) -> Iterator[tuple[str, str, Any]]:
        """Yield the entries for a writer of OpenImageIO, color tags among them: the one place that decides on these."""
        for entry in self.entries:
            if writer in _STORED_BY.get(entry[0], (writer,)):
                yield entry
        space = ColorSpace("", self.space)
        if writer == "openexr":
            if self.space not in ("", NO_TAGS):
                yield "colorInteropID", "string", self.space
            if space.chromaticities is not None and self.get("chromaticities") is None:
                yield "chromaticities", "float[8]", space.chromaticities
        elif writer == "png":
            yield from self._png_attributes(space)
        elif writer == "dpx" and self.space:
            yield _COLOR_SPACE, "string", self.space

    def _png_attributes(self, space: ColorSpace) -> Iterator[tuple[str, str, Any]]:
        """Yield PNG's color tags: sRGB, gAMA and cHRM, or gAMA, or cICP; none of these beside a profile."""
        is_profiled = bool(self.profile)
        if not is_profiled and (space.is_srgb or not self.space):
            return  # the writer's own choice
        if not is_profiled and space.has_gamma:
            yield _COLOR_SPACE, "string", self.space
            return
        yield _COLOR_SPACE, "string", NO_TAGS
        codes = None if is_profiled else space.codes
        if codes is not None and self.get("CICP") is None:
            yield "CICP", "int[4]", (codes.primaries, codes.transfer, 0, 1)

    @property
    def resolution(self) -> tuple[float, float] | None:
        """Return the dots per inch, across and down; None if not given."""
        per_inch = {"in": 1.0, "inch": 1.0, "cm": 2.54, "m": 0.0254}.get(str(self.get("ResolutionUnit")))
        across, down = self.get("XResolution"), self.get("YResolution")
        return None if per_inch is None or not across or not down else (across * per_inch, down * per_inch)

    def stored_channels(self, pixels: Pixels) -> Pixels:
        """Drop the alpha of (h, w, 4) if neither the source nor the picture uses it, and repeated gray of a gray one.

        >>> Metadata(opaque=True).stored_channels(np.full((2, 3, 4), 255, np.uint8)).shape
        (2, 3, 3)
        >>> Metadata(opaque=True, gray=True).stored_channels(np.full((2, 3, 4), 255, np.uint8)).shape
        (2, 3, 1)
        """
        if pixels.shape[2] == 4 and self.opaque and is_opaque(pixels[..., 3]):
            pixels = pixels[..., :3]
        if pixels.shape[2] > 2 and self.gray and is_gray(pixels):
            pixels = pixels[..., [0, *range(3, pixels.shape[2])]]
        return np.ascontiguousarray(pixels)


def unstated(kind: WritableFormat, space: ColorSpace) -> str:
    """Return why a file of a format does not state a color space; "" if it does, or is read as that without tags.

    >>> unstated(WRITABLE[".jpg"], ColorSpace("Rec.2100-PQ - Display", "pq_rec2020_display"))
    'JPEG files state no color space Rec.2100-PQ - Display; readers take them as sRGB; save as .png or .exr'
    >>> unstated(WRITABLE[".png"], ColorSpace("Rec.2100-PQ - Display", "pq_rec2020_display"))
    ''
    """
    if kind.name in ("npy", "PFM"):
        return ""  # numbers without a color space
    if kind.writer == "openexr":
        stated, taken = bool(space.interop), "linear Rec. 709"
    elif kind.writer == "hdr":
        stated, taken = space.interop == LINEAR, "linear Rec. 709"
    else:
        stated, taken = space.is_srgb, "sRGB"
        stated |= kind.writer == "png" and (space.has_gamma or space.codes is not None)
        stated |= kind.writer == "dpx" and space.interop in (LINEAR, "KodakLog")
    if stated:
        return ""
    mend = "; save as .png or .exr" if space.codes is not None else "; save as .exr" if space.interop else ""
    return f"{kind.name} files state no color space {space.name}; readers take them as {taken}{mend}"


def is_opaque(alpha: Pixels) -> bool:
    """Return True if alpha is 1 everywhere; of floats, if it is in 16 bits: the weights of a blur sum to 1 nearly.

    >>> is_opaque(np.float32([1, 0.9999999])), is_opaque(np.uint8([255, 254]))
    (True, False)
    """
    least = np.iinfo(alpha.dtype).max if alpha.dtype.kind == "u" else 1 - 0.5 / 65535
    return bool(alpha.min() >= least)


def is_gray(pixels: Pixels) -> bool:
    """Return True if red, green and blue have the same numbers everywhere, NaN included.

    >>> is_gray(np.float32([[[0.5, 0.5, 0.5, 1.0]]])), is_gray(np.uint8([[[1, 1, 2]]]))
    (True, False)
    """
    first = pixels[..., :1]
    return np.array_equal(
        pixels[..., 1:3], np.broadcast_to(first, (*first.shape[:2], 2)), equal_nan=pixels.dtype.kind == "f"
    )
