"""Read picture files right that OpenImageIO 3.2.2 misreads without an error.

`mending_of` looks at an opened file. The table is short on purpose: what OpenImageIO reads right stays with it.

=================================  =============================================================  =================
file                               what OpenImageIO does                                          what is done here
=================================  =============================================================  =================
BMP of 16 and 32 bits              ignores the masks; takes the unused byte of BI_RGB as alpha    read by the masks
DPX of 10 bits with alpha          leaves the last sample of a row unwritten, if it begins a word  read from the file
FITS with BZERO or BSCALE          returns stored numbers, not the physical ones                  scaled
FITS of four planes                takes the fourth as alpha; the format knows no alpha           three are read
TGA: gray and alpha                calls them red and green                                       gray and alpha
TGA: kind of alpha                 ignores "no alpha" of the extension area                       as that says
TIFF of float64                    leaves tiles, and rows read one by one, unwritten              read by tifffile
TIFF: palette and alpha            takes alpha as further indices                                 an error
TIFF: white is zero                inverts 8-bit alpha, and no 16-bit color                       color is inverted
TIFF: inks other than CMYK         reads the first three as red, green and blue                   an error
=================================  =============================================================  =================
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.image_formats import Pixels
from passgraph.records import dataclass

Decode = Callable[[], Pixels]


@dataclass(frozen=True)
class Mending:
    """What is right of an opened file, where OpenImageIO is wrong; None for what is not.

    Attributes
    ----------
    order : channels that are read, among those of ``decode`` or else of OpenImageIO
    has_alpha : the last of them is alpha
    associated : color is stored multiplied by alpha
    dtype : of the pixels
    decode : return (height, width, channels), in place of OpenImageIO
    adjust : change pixels that OpenImageIO read
    held : bytes that ``decode`` needs for each pixel besides its result
    """

    order: list[int] | None = None
    has_alpha: bool | None = None
    associated: bool | None = None
    dtype: np.dtype[Any] | None = None
    decode: Decode | None = None
    adjust: Callable[[Pixels], Pixels] | None = None
    held: int = 0


def mending_of(file: Path, name: str, reader: Any) -> Mending:
    """Return what is to be read otherwise than OpenImageIO says; ``name`` is the path that its reader has open.

    Raises
    ------
    InputError : the file holds what nothing here reads right.
    """
    find = _MENDINGS.get(reader.format_name())
    return Mending() if find is None else find(file, name, reader)


def _attribute(reader: Any, name: str, default: Any) -> Any:
    value = reader.spec().getattribute(name)
    return default if value is None else value


def _corrupt(file: Path, what: str) -> InputError:
    return InputError(f"{file}: truncated or corrupt ({what}); make or copy the file again")


# BMP: [MS-WMF] 2.2.2, BITMAPINFOHEADER to BITMAPV5HEADER.

_BI_RGB, _BI_BITFIELDS, _BI_ALPHABITFIELDS = 0, 3, 6
#: Masks of red, green, blue and alpha without BITFIELDS: the remaining bits are not used.
_DEFAULT_MASKS = {16: (0x7C00, 0x3E0, 0x1F, 0), 32: (0xFF0000, 0xFF00, 0xFF, 0)}
#: Bytes of the smallest header that holds masks of red, green and blue; and of alpha.
_WITH_MASKS, _WITH_ALPHA_MASK = 52, 56


def _bmp(file: Path, name: str, reader: Any) -> Mending:
    with open(name, "rb") as stream:
        head = stream.read(14 + 40 + 16)
    if len(head) < 54:
        return Mending()
    start, size, width, height, _, bits, compression = struct.unpack("<IIiiHHI", head[10:34])
    if bits not in _DEFAULT_MASKS or size < 40 or compression not in (_BI_RGB, _BI_BITFIELDS, _BI_ALPHABITFIELDS):
        return Mending()
    masks = _DEFAULT_MASKS[bits]
    if compression != _BI_RGB:
        if len(head) < 70:
            raise _corrupt(file, "ends in its header")
        red, green, blue, alpha = struct.unpack("<IIII", head[54:70])
        has_alpha_mask = size >= _WITH_ALPHA_MASK or compression == _BI_ALPHABITFIELDS
        masks = red, green, blue, alpha if has_alpha_mask else 0
    used = [mask for mask in masks if mask]
    if (
        not all(masks[:3])
        or sum(used) >> bits
        or sum(used) != np.bitwise_or.reduce(used)
        or not all(map(_is_run, used))
    ):
        raise _corrupt(file, f"has masks {', '.join(map(hex, masks))}")
    dtype = np.dtype(np.uint8 if max(mask.bit_count() for mask in used) <= 8 else np.uint16)

    def decode() -> Pixels:
        across, down = abs(width), abs(height)
        pitch = (across * bits + 31) // 32 * 4
        with open(name, "rb") as stream:
            stream.seek(start)
            data = stream.read(pitch * down)
        if len(data) < pitch * down:
            raise _corrupt(file, "ends before its picture does")
        words = np.frombuffer(data, f"<u{bits // 8}").reshape(down, -1)[:, :across]
        values = [_scaled(words, mask, dtype) for mask in used]
        return np.stack(values if height < 0 else [plane[::-1] for plane in values], axis=-1)

    return Mending(list(range(len(used))), len(used) == 4, False, dtype, decode, held=16)


def _is_run(mask: int) -> bool:
    """Return True if the bits of a mask are next to each other."""
    lowest = mask & -mask
    return not mask // lowest & (mask // lowest + 1)


def _scaled(words: NDArray[Any], mask: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return the values under a mask, scaled to the range of a dtype and rounded."""
    lowest = mask & -mask
    most, full = mask // lowest, int(np.iinfo(dtype).max)
    values = (words & words.dtype.type(mask)) // words.dtype.type(lowest)
    scaled: NDArray[Any] = values if most == full else np.rint(values * (full / most))
    return scaled.astype(dtype)


# DPX: SMPTE ST 268-1:2014, table 2.

_DPX_HEADER, _RGBA, _FILLED = 820, 51, {1: 22, 2: 20}


def _dpx(file: Path, name: str, reader: Any) -> Mending:
    """Three samples of 10 bits fill a word; the fourth of every third pixel may be the first of a row's last word."""
    width, height = reader.spec().width, reader.spec().height
    with open(name, "rb") as stream:
        head = stream.read(_DPX_HEADER)
    if len(head) < _DPX_HEADER or width % 3 != 1 or (head[800], head[803]) != (_RGBA, 10):
        return Mending()
    order = ">" if head.startswith(b"SDPX") else "<"
    packing, encoding, start, padding = struct.unpack(f"{order}HHII", head[804:816])
    if packing not in _FILLED or encoding:
        return Mending()
    pitch = (4 * width + 2) // 3 * 4
    step = pitch + (0 if padding == 0xFFFFFFFF else padding)

    def with_last_samples(pixels: Pixels) -> Pixels:
        if Path(name).stat().st_size < start + step * (height - 1) + pitch:
            raise _corrupt(file, "ends before its picture does")
        words = np.ndarray((height,), f"{order}u4", np.memmap(name, np.uint8, "r"), start + pitch - 4, (step,))
        samples = words >> _FILLED[packing] & 1023
        pixels[:, -1, 3] = samples << 6 | samples >> 4
        return pixels

    return Mending(adjust=with_last_samples)


# FITS: FITS standard 4.0, sections 4.4.1 and 4.4.2.5: physical value = BZERO + BSCALE × stored value.

_FITS_COLORS = 3
_BLOCK, _CARD = 2880, 80


def _fits(file: Path, name: str, reader: Any) -> Mending:
    planes = reader.spec().nchannels
    order = list(range(min(planes, _FITS_COLORS)))
    cards = _fits_cards(name)
    try:
        # OpenImageIO gives them as float32, without the exponent that is written with D.
        zero, scale = (float(cards.get(key, default).replace("D", "E")) for key, default in _FITS_SCALE)
    except ValueError as error:
        raise _corrupt(file, f"BZERO or BSCALE: {error}") from None
    if (zero, scale) == (0.0, 1.0):
        return Mending(order, False)
    kind = str(reader.spec().format)
    if kind == "int16" and (zero, scale) == (32768.0, 1.0):  # the format's way to store uint16

        def unsigned() -> Pixels:
            # Adding 2 to the power of 15 changes the highest bit.
            pixels: Pixels = _read(file, reader, "int16").view(np.uint16) ^ np.uint16(1 << 15)
            return pixels

        return Mending(order, False, False, np.dtype(np.uint16), unsigned)

    def physical() -> Pixels:
        stored = _read(file, reader, kind)  # in the stored type: integers are scaled when they are read as floats
        return (zero + scale * stored.astype(np.float64)).astype(np.float32)

    return Mending(order, False, False, np.dtype(np.float32), physical, held=20 * planes)


_FITS_SCALE = (("BZERO", "0"), ("BSCALE", "1"))


def _fits_cards(name: str) -> dict[str, str]:
    """Return the values of BZERO and BSCALE in a FITS file's first header."""
    found = dict[str, str]()
    with open(name, "rb") as stream:
        while block := stream.read(_BLOCK):
            for place in range(0, len(block), _CARD):
                key, _, value = block[place : place + _CARD].decode("latin-1").partition("=")
                if key.rstrip() == "END":
                    return found
                if key.strip() in dict(_FITS_SCALE):
                    found[key.strip()] = value.partition("/")[0].strip().upper()
    return found


def _read(file: Path, reader: Any, kind: str) -> Pixels:
    spec = reader.spec()
    pixels: Any = reader.read_image(0, 0, 0, spec.nchannels, kind)
    if pixels is None or reader.has_error:
        raise _corrupt(file, " ".join(str(reader.geterror()).split()))
    stored: Pixels = pixels.reshape(spec.height, spec.width, spec.nchannels)
    return stored


# TGA: Truevision TGA File Format Specification 2.0, fields 5.6 and 24.

_FOOTER = b"TRUEVISION-XFILE."
_NO_ALPHA, _ALPHA, _ASSOCIATED_ALPHA = (0, 1), (2, 3), 4


def _targa(file: Path, name: str, reader: Any) -> Mending:
    channels = reader.spec().nchannels
    if channels not in (2, 4):
        return Mending()
    kind = _kind_of_targa_alpha(name)
    if kind in _NO_ALPHA:
        return Mending(list(range(channels - 1)), False)
    order = list(range(channels))
    with open(name, "rb") as stream:
        declared = stream.read(18)[17] & 15
    # Many writers give no number of alpha's bits; all zero it is not used.
    adjust = None if declared or kind is not None else _opaque_if_zero
    return Mending(order, True, kind == _ASSOCIATED_ALPHA, adjust=adjust)


def _kind_of_targa_alpha(name: str) -> int | None:
    """Return the attributes type of a TGA file's extension area; None without one."""
    with open(name, "rb") as stream:
        size = stream.seek(0, 2)
        stream.seek(max(size - 26, 0))
        footer = stream.read(26)
        if len(footer) < 26 or not footer[8:].startswith(_FOOTER):
            return None
        extension = int.from_bytes(footer[:4], "little")
        if not extension or extension + 495 > size:
            return None
        stream.seek(extension + 494)
        return stream.read(1)[0]


def _opaque_if_zero(pixels: Pixels) -> Pixels:
    if not pixels[..., -1].any():
        pixels = pixels.copy()
        pixels[..., -1] = np.iinfo(pixels.dtype).max
    return pixels


# TIFF: TIFF 6.0; tag 277 is SamplesPerPixel.

_WHITE_IS_ZERO, _PALETTE, _SAMPLES = 0, 3, 277
_PALETTE_BITS = (1, 2, 4, 8, 16)


def _tiff(file: Path, name: str, reader: Any) -> Mending:
    kind = _attribute(reader, "tiff:PhotometricInterpretation", 1)
    dtype = str(reader.spec().format)
    if _attribute(reader, "tiff:ColorSpace", "") == "color separated":
        raise InputError(f"{file}: holds inks other than CMYK; expected gray, RGB or CMYK; convert it to RGB")
    if kind == _PALETTE:
        _check_palette(file, name, reader)
    if dtype == "double":
        return Mending(dtype=np.dtype(np.float32), decode=lambda: _by_tifffile(file, name), held=64)
    if kind == _WHITE_IS_ZERO and dtype in ("uint8", "uint16"):
        # OpenImageIO inverts all samples of 8 bits, alpha too, and none of 16 bits.
        wrong = slice(1, None) if dtype == "uint8" else slice(0, 1)
        return Mending(adjust=lambda pixels: _inverted(pixels, wrong))
    return Mending()


def _inverted(pixels: Pixels, channels: slice) -> Pixels:
    result = pixels.copy()
    result[..., channels] = np.iinfo(pixels.dtype).max - pixels[..., channels]
    return result


def _check_palette(file: Path, name: str, reader: Any) -> None:
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

    with open(name, "rb") as stream:
        head = stream.read(8)
        directory = ImageFileDirectory_v2(head + stream.read(8) if head[2] == 43 else head)  # 43: BigTIFF
        stream.seek(directory.next)
        directory.load(stream)
    bits = _attribute(reader, "tiff:BitsPerSample", _attribute(reader, "oiio:BitsPerSample", 8))
    if directory.get(_SAMPLES, 1) != 1 or bits not in _PALETTE_BITS:
        raise InputError(
            f"{file}: is a palette with alpha, or of {bits} bits; expected a palette of 1, 2, 4, 8 or 16 bits without "
            "alpha; convert it to RGBA"
        )


def _by_tifffile(file: Path, name: str) -> Pixels:
    """Return float64 as float32."""
    try:
        tifffile = import_module("tifffile")
    except ImportError:
        raise InputError(
            f"{file}: holds float64; tifffile reads it: pip install 'passgraph[tiles]'; or save it as float32"
        ) from None
    try:
        with tifffile.TiffFile(name) as tiff:
            page = tiff.pages[0]
            samples = page.asarray()
            height, width, is_planar = page.imagelength, page.imagewidth, page.planarconfig == 2
    except Exception as error:  # damaged files raise errors of any type
        if "imagecodecs" in str(error):
            raise InputError(f"{file}: {error}; install it with: pip install imagecodecs") from error
        raise _corrupt(file, " ".join(str(error).split())) from error
    samples = np.moveaxis(samples, 0, -1) if is_planar and samples.ndim == 3 else samples
    with np.errstate(over="ignore"):  # a number beyond float32 becomes infinity, as in a float target
        pixels: Pixels = samples.reshape(height, width, -1).astype(np.float32)
    return pixels


_MENDINGS: dict[str, Callable[[Path, str, Any], Mending]] = {
    "bmp": _bmp, "dpx": _dpx, "fits": _fits, "targa": _targa, "tiff": _tiff
}  # fmt: skip
