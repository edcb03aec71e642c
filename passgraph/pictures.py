"""Pictures on disk: read into `(h, w, 4) float32`, written whole or not at all.

Row 0 is the top row. Values of 8- and 16-bit files are scaled to [0, 1] and kept as stored, which for
nearly every such file means sRGB-encoded; `linear=True` decodes them on reading and encodes them on writing.
OpenEXR, float TIFF and float npy hold linear light and pass unchanged. Embedded colour profiles change no number; they
go from one file to another with `like`.
"""

from __future__ import annotations

import io
import os
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.picture_decoders import decode, import_openexr, scaled
from passgraph.picture_notes import Notes, notes_of
from passgraph.pictures_16 import png_of, tiff_of
from passgraph.quantise import check_no_nan, quantised
from passgraph.reading import read_bytes
from passgraph.srgb import linear_to_srgb, srgb_to_linear
from passgraph.writing import NewFile

type_of_suffix = {
    ".png": "PNG",
    ".jpg": "JPEG",
    ".jpeg": "JPEG",
    ".tif": "TIFF",
    ".tiff": "TIFF",
    ".webp": "WEBP",
    ".exr": "EXR",
    ".npy": "NPY",
}

# Keep what was rendered: no chroma subsampling, and WebP without loss, also under transparent pixels. Of PNG, zlib's
# level 4 makes files a tenth larger than its own choice, 6, in a third of the time.
_options: dict[str, dict[str, Any]] = {
    "PNG": {"compress_level": 4},
    "JPEG": {"quality": 95, "subsampling": 0},
    "WEBP": {"lossless": True, "exact": True},
}

#: Most memory that loading a picture may take where the caller says nothing: some 200 million pixels.
MAX_BYTES = 1 << 32
#: A limit beyond this is none: no machine has such a memory.
MOST_BYTES = 1 << 52
#: Pixels that are decoded from sRGB at a time, so that what is held beside the picture stays small.
_PIXELS_AT_ONCE = 1 << 18
#: Of pictures that come from no file.
_NOTHING = Notes()


def load(path: str | os.PathLike[str], *, max_bytes: int = MAX_BYTES, linear: bool = False) -> NDArray[np.float32]:
    """Read a picture file; what it is, is told by its content and not by its name.

    Parameters
    ----------
    path : PNG, JPEG, TIFF, WebP, BMP, GIF, TGA, OpenEXR or npy.
        EXIF orientation is applied. Of several frames or parts the first is read.
    max_bytes : most memory that loading may take, told from the picture's header before any is asked for:
        16 bytes a pixel for the result, what its decoder holds (1 to 16 bytes a pixel), and the file itself.
    linear : decode the colours (not alpha) of integer formats from sRGB to linear light.

    Returns
    -------
    (h, w, 4) float32, row 0 on top: red, green, blue and straight alpha (1 where the file has none).
    Gray is repeated in red, green and blue. In [0, 1] for 8- and 16-bit files, unlimited for float ones.

    Raises
    ------
    InputError : the file is missing, not a file, unreadable, empty, truncated, corrupt, too large,
        of another format, or in a colour space that has no single meaning as RGB (CMYK, Lab).

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(f"{folder}/gray.png", np.full((2, 3), 0.2))
    ...     load(f"{folder}/gray.png").shape
    (2, 3, 4)
    """
    file = arguments.path(path, "the picture to load")
    max_bytes = arguments.whole(max_bytes, f"{file}: max_bytes", 1, MOST_BYTES, InputError)
    arguments.flag(linear, f"{file}: linear", InputError)
    picture, encoded = _decoded(file, _read(file, max_bytes), max_bytes, as_stored=False)
    if linear and encoded:
        pixels = picture.reshape(-1, 4)
        for first in range(0, len(pixels), _PIXELS_AT_ONCE):
            part = pixels[first : first + _PIXELS_AT_ONCE, :3]
            part[...] = srgb_to_linear(part)
    return picture


def load_stored(path: Path, data: bytes | None = None) -> NDArray[Any]:
    """As `load`, in the file's own type: (h, w, 4) uint8, uint16 (both sRGB-encoded) or float32.

    ``data`` is the content where it is not read from the file; ``path`` then only says whose it is.
    """
    return _decoded(path, _read(path, MAX_BYTES) if data is None else data, MAX_BYTES, as_stored=True)[0]


def _read(file: Path, max_bytes: int) -> bytes:
    data = read_bytes(file, "a picture file", max_bytes, "make it smaller, or raise max_bytes if it is meant")
    if not data:
        raise InputError(f"{file}: is empty (0 bytes); expected a picture file")
    return data


def _decoded(file: Path, data: bytes, max_bytes: int, *, as_stored: bool) -> tuple[NDArray[Any], bool]:
    try:
        return decode(file, data, max_bytes, as_stored=as_stored)
    except InputError:
        raise
    except MemoryError as error:
        raise InputError(f"{file}: not enough memory to decode it; make the picture smaller") from error
    except Exception as error:  # decoders meet broken bytes with errors of every kind
        message = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{file}: truncated or corrupt ({message}); make or copy the file again") from error


def save(
    path: str | os.PathLike[str],
    picture: object,
    *,
    linear: bool = False,
    like: str | os.PathLike[str] | Notes | None = None,
) -> None:
    """Write a picture file; an older file of that name stays until the new one is complete.

    Parameters
    ----------
    path : the suffix chooses the format: .png .jpg .jpeg .tif .tiff .webp (8-bit), .exr .npy (float32).
        uint16 is stored in 16 bits by .png and .tif.
    picture : (h, w) or (h, w, 1 | 2 | 3 | 4), row 0 on top: gray, gray and alpha, RGB, RGBA.
        Floats are clipped to [0, 1] and rounded half to even for 8-bit formats and written unchanged to
        float formats. uint8 and uint16 are stored as they are, by float formats divided by 255 and 65535.
    linear : encode the colours of floats from linear light to sRGB for 8-bit formats.
    like : a picture file whose colour profile (ICC), resolution and EXIF go along, where both formats hold them; of
        EXIF neither size and turn nor the small copy of the picture.  Where it has no transparency, and the picture
        is opaque, no alpha is stored.  Where it has 16 bits a channel, floats are stored in 16 bits by .png and .tif;
        other 8-bit formats warn.

    Raises
    ------
    InputError : unknown suffix, no such folder, a place that cannot be written, a shape or dtype that is no
        picture, zero size, NaN in an 8-bit format, transparency or uint16 in a JPEG, uint16 in a WebP.

    Examples
    --------
    >>> save("picture.bmp", np.zeros((2, 2)))
    Traceback (most recent call last):
    passgraph.errors.InputError: picture.bmp: unknown suffix '.bmp'; expected one of .png .jpg .jpeg .tif ...
    """
    file = arguments.path(path, "where a picture is saved")
    arguments.flag(linear, f"{file}: linear", InputError)
    kind = type_of_suffix.get(file.suffix.lower())
    if kind is None:
        expected = " ".join(type_of_suffix)
        raise InputError(f"{file}: unknown suffix '{file.suffix}'; expected one of {expected}")
    pixels = _checked(file, picture)
    notes = _notes(like)
    if notes.deep and pixels.dtype.kind == "f":
        if kind in ("PNG", "TIFF"):
            pixels, linear = _as_whole(file, pixels, linear, np.uint16), False
        elif kind in ("JPEG", "WEBP"):
            warnings.warn(f"{file}: {fewer_bits(kind)}", stacklevel=2)
    if kind == "EXR":
        values = _as_float32(file, pixels)
        openexr = import_openexr(file)
        _write(file, lambda temporary: _encode_exr(openexr, temporary, values))
    elif kind == "NPY":
        buffer = io.BytesIO()
        np.save(buffer, _as_float32(file, pixels), allow_pickle=False)
        _write(file, lambda temporary: _write_new(temporary, buffer.getvalue()))
    elif pixels.dtype == np.uint16:
        check_holds_16(file)
        if linear:
            raise InputError(f"{file}: uint16 with linear=True; expected floats")
        wide = _encoded_wide(file, notes.channels(pixels), kind, notes)
        _write(file, lambda temporary: _write_new(temporary, wide))
    else:
        encoded = encode_with_pillow(file, notes.channels(_as_whole(file, pixels, linear, np.uint8)), kind, notes)
        _write(file, lambda temporary: _write_new(temporary, encoded))


# Writing


def check_holds_16(file: Path) -> None:
    """Raise InputError where a file of this name does not hold 16 bits a channel."""
    if type_of_suffix.get(file.suffix.lower()) not in ("PNG", "TIFF"):
        floats = file.suffix.lower() in (".exr", ".npy")
        held = "floats, which need no bits to be named" if floats else "8 bits a channel"
        raise InputError(f"{file}: holds {held}; 16 bits go into .png and .tif")


def _encoded_wide(file: Path, pixels: NDArray[Any], kind: str, notes: Notes) -> bytes:
    try:
        return png_of(pixels, notes) if kind == "PNG" else tiff_of(pixels, notes)
    except (ValueError, struct.error, MemoryError) as error:
        raise InputError(f"{file}: {kind} cannot hold these pixels ({_reason(error)}); save as .exr") from error


def _checked(file: Path, picture: object) -> NDArray[Any]:
    """The picture as (h, w, 1 | 2 | 3 | 4) of floats, uint8 or uint16."""
    if type(picture) is not np.ndarray:
        picture = arguments.numbers(picture, f"{file}: a picture", "be an array (h, w) or (h, w, 1 to 4) of numbers")
    pixels = np.asarray(picture)
    if pixels.ndim == 2:
        pixels = pixels[..., None]
    if pixels.ndim != 3 or pixels.shape[2] not in (1, 2, 3, 4):
        shape = np.shape(pixels)
        raise InputError(f"{file}: a picture of shape {shape}; expected (h, w) or (h, w, 1 to 4)")
    if 0 in pixels.shape:
        raise InputError(f"{file}: a picture of {pixels.shape[1]}×{pixels.shape[0]} pixels; expected at least 1×1")
    if pixels.dtype.kind != "f" and pixels.dtype not in (np.uint8, np.uint16):
        raise InputError(f"{file}: a picture of dtype {pixels.dtype}; expected float in [0, 1], uint8 or uint16")
    return pixels


def _as_float32(file: Path, pixels: NDArray[Any]) -> NDArray[np.float32]:
    if pixels.dtype.kind == "u":
        return scaled(pixels)
    with np.errstate(over="ignore"):  # a float64 beyond float32 becomes infinity, as in a float target
        return np.ascontiguousarray(pixels, np.float32)


def _notes(like: str | os.PathLike[str] | Notes | None) -> Notes:
    if like is None or isinstance(like, Notes):
        return like or _NOTHING
    return notes_of(arguments.path(like, "the picture that another is like"))


def fewer_bits(kind: str) -> str:
    """What is said where a picture of 16 bits goes into a format without them."""
    return f"{kind} holds 8 bits a channel, and what it is made of has 16; to keep them, save as .png or .tif"


def _as_whole(file: Path, pixels: NDArray[Any], linear: bool, dtype: type[np.uint8 | np.uint16]) -> NDArray[Any]:
    if pixels.dtype == np.uint8:
        if linear:
            raise InputError(f"{file}: uint8 with linear=True; expected floats (8 bits of linear light band)")
        return np.ascontiguousarray(pixels)
    if linear:
        check_no_nan(pixels, str(file))
        pixels = np.clip(pixels, 0, 1).astype(np.float32)
        colours = 3 if pixels.shape[2] > 2 else 1
        pixels[..., :colours] = linear_to_srgb(pixels[..., :colours])
    encoded: NDArray[Any] = quantised(pixels, np.dtype(dtype), str(file))
    return encoded


def encode_with_pillow(file: Path, pixels: NDArray[np.uint8], kind: str, notes: Notes = _NOTHING) -> bytes:
    """The bytes of a file: PNG, JPEG, TIFF or WEBP; ``file`` says whose they are."""
    from PIL import Image as pillow

    channels = pixels.shape[2]
    if kind == "JPEG" and channels in (2, 4):
        if pixels[..., -1].min() < 255:
            raise InputError(f"{file}: JPEG has no transparency; save as .png, or pass picture[..., :{channels - 1}]")
        pixels = pixels if channels == 4 else np.ascontiguousarray(pixels[..., :-1])
    buffer = _Named(kind)
    if kind == "JPEG" and channels == 4:
        # Pixels of which Pillow leaves out the fourth number by itself.
        image = pillow.frombuffer("RGBX", pixels.shape[1::-1], pixels, "raw", "RGBX", 0, 1)
    else:
        image = pillow.fromarray(pixels[..., 0] if pixels.shape[2] == 1 else pixels)
    if kind == "WEBP" and channels < 3:
        image = image.convert("RGB" if channels == 1 else "RGBA")
    try:
        image.save(buffer, **_options.get(kind, {}), **notes.options(kind))
    except (OSError, ValueError, struct.error, MemoryError) as error:
        size = f"{image.width}×{image.height}"
        raise InputError(
            f"{file}: {kind} cannot hold {size} pixels ({_reason(error)}); save as .png or .exr"
        ) from error
    return buffer.getvalue()


class _Named(io.BytesIO):
    """Bytes of a file with the suffix of its kind: by that Pillow loads what writes it, by a kind five formats."""

    def __init__(self, kind: str) -> None:
        super().__init__()
        self.name = f"picture.{kind.lower()}"


def _encode_exr(openexr: Any, temporary: Path, values: NDArray[np.float32]) -> None:
    names = {1: "Y", 2: "YA", 3: "RGB", 4: "RGBA"}[values.shape[2]]
    channels = {name: np.ascontiguousarray(values[..., i]) for i, name in enumerate(names)}
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    openexr.File(header, channels).write(os.fspath(temporary))


def _write_new(temporary: Path, data: bytes) -> None:
    with temporary.open("xb") as stream:
        stream.write(data)


def _write(file: Path, write_to: Callable[[Path], None]) -> None:
    """Calls `write_to` with a new name in the same folder, then gives that file its name in one step."""
    try:
        with NewFile(file) as made:
            write_to(made.temporary)
            made.complete()
    except (OSError, ValueError, RuntimeError) as error:  # RuntimeError: OpenEXR
        raise InputError(
            f"{file}: cannot be written ({_reason(error)}); check the folder's permissions and free space"
        ) from error


def _reason(error: BaseException) -> str:
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(text.split())
