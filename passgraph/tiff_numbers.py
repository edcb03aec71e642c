"""TIFF pictures that Pillow does not read in full, by tifffile: floats with several channels, planes of 16 bits."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError

#: What TIFF files begin with, BigTIFF too.
SIGNATURES = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
#: The tags of the specification (TIFF 6.0): values of PhotometricInterpretation that are numbers as they are, and of
#: ExtraSamples the one for colours that are multiplied by alpha.
_PLAIN = (1, 2)
_PREMULTIPLIED = 1
_MEND = "convert it, for example to an RGB PNG or a float TIFF"


class TiffNumbers:
    """The first picture of a TIFF file, whose header is read.

    Attributes
    ----------
    width, height, channels : as it is stored
    held : bytes that decoding holds
    orientation : EXIF's, 1 where nothing is to be turned

    Raises
    ------
    InputError : for numbers, channels and colours that are not read, and where tifffile is not installed.
        Broken bytes meet errors of other kinds.
    """

    def __init__(self, file: Path, data: bytes) -> None:
        try:
            import tifffile
        except ImportError as error:
            raise InputError(
                f"{file}: a TIFF of floats, or stored in a rare way, is read by tifffile, which is not installed; "
                "run: pip install 'passgraph[tiles]'"
            ) from error
        self._file = file
        page: Any = tifffile.TiffFile(io.BytesIO(data)).pages.first
        self._page = page
        self.width, self.height, self.channels = page.imagewidth, page.imagelength, page.samplesperpixel
        if page.dtype is None or not (page.dtype.kind == "f" or page.dtype in (np.uint8, np.uint16)):
            held = f"{page.bitspersample} bits" if page.dtype is None else str(page.dtype)
            raise InputError(f"{file}: holds {held}; expected 8 or 16 bits, or floats; {_MEND}")
        if page.photometric not in _PLAIN or page.imagedepth != 1:
            kind = getattr(page.photometric, "name", page.photometric)
            raise InputError(f"{file}: holds {kind} pixels; expected gray or RGB; {_MEND}")
        if self.channels not in (1, 2, 3, 4):
            raise InputError(f"{file}: has {self.channels} channels; expected 1 to 4; {_MEND}")
        # Its own numbers as they are decoded and as floats.
        self.held = self.width * self.height * self.channels * (2 * page.dtype.itemsize + 4)
        self.orientation = int(page.tags.valueof(274, 1))

    def decoded(self) -> NDArray[Any]:
        """(h, w, channels) float32, uint8 or uint16."""
        page = self._page
        try:
            made: NDArray[Any] = page.asarray(maxworkers=1)
        except ValueError as error:
            if "imagecodecs" in str(error):
                raise InputError(f"{self._file}: {error}; install it with: pip install imagecodecs") from error
            raise
        if page.planarconfig == 2 and self.channels > 1:
            made = np.moveaxis(made, 0, -1)
        made = made.reshape(self.height, self.width, self.channels)
        if made.dtype.kind == "f":
            with np.errstate(over="ignore"):  # a float64 beyond float32 becomes infinity, as in a float target
                made = made.astype(np.float32)
            if self.channels in (2, 4) and tuple(page.extrasamples)[:1] == (_PREMULTIPLIED,):
                alpha = made[..., -1:]
                made[..., :-1] /= np.where(alpha > 0, alpha, 1)
        return made
