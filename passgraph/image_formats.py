"""Formats of image files: those that can be read, the capabilities of those that can be written, and metadata."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

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


@dataclass(frozen=True)
class Metadata:
    """Metadata of a picture file, to be written to a picture made from it.

    Attributes
    ----------
    entries : (name, OpenImageIO's type, value): ICC profile, resolution, EXIF, time code ...
    opaque : True if the file has no alpha
    deep : True if it holds 16-bit integers
    """

    entries: tuple[tuple[str, str, Any], ...] = ()
    opaque: bool = False
    deep: bool = False

    def get(self, name: str) -> Any:
        """Return the value of an entry, or None."""
        return next((value for key, _, value in self.entries if key == name), None)

    @property
    def profile(self) -> bytes:
        """Return the ICC profile; empty if there is none."""
        value = self.get("ICCProfile")
        return b"" if value is None else bytes(np.asarray(value, np.uint8))

    @property
    def resolution(self) -> tuple[float, float] | None:
        """Return the dots per inch, across and down; None if not given."""
        per_inch = {"in": 1.0, "inch": 1.0, "cm": 2.54, "m": 0.0254}.get(str(self.get("ResolutionUnit")))
        across, down = self.get("XResolution"), self.get("YResolution")
        return None if per_inch is None or not across or not down else (across * per_inch, down * per_inch)

    def stored_channels(self, pixels: Pixels) -> Pixels:
        """Drop the alpha of (h, w, 4) integers if neither the source nor the picture uses it.

        >>> Metadata(opaque=True).stored_channels(np.full((2, 3, 4), 255, np.uint8)).shape
        (2, 3, 3)
        """
        if not self.opaque or pixels.shape[2] != 4:
            return pixels
        unused = pixels[..., 3].min() == _opaque(pixels.dtype)
        return np.ascontiguousarray(pixels[..., :3]) if unused else pixels


def _opaque(dtype: np.dtype[Any]) -> Any:
    """Return alpha 1 in a dtype."""
    return dtype.type(np.iinfo(dtype).max if dtype.kind == "u" else 1)
