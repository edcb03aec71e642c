"""Bytes of a picture file to `(h, w, 4)`, in memory that its header tells beforehand.

Decoders deliver the pixels as the file stores them; they are widened to floats piece by piece, straight into the
result, or kept as they are. So loading holds the result, one copy of the stored pixels (or two), the file, and pieces
of a fixed size.
"""

from __future__ import annotations

import io
import os
import struct
import sys
from collections.abc import Callable, Container, Iterator
from importlib import import_module
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.tiff_numbers import SIGNATURES, TiffNumbers

if TYPE_CHECKING:
    from PIL.ImageFile import ImageFile

Picture = NDArray[np.float32]
Stored = NDArray[Any]  # (h, w, 4) uint8, uint16 or float32

#: What Pillow is let to open. Some of its other formats start programs (EPS runs Ghostscript), none is promised.
PILLOW_FORMATS = ("PNG", "JPEG", "TIFF", "WEBP", "BMP", "GIF", "TGA")
EXPECTED = "PNG, JPEG, TIFF, WebP, BMP, GIF, TGA, OpenEXR or npy"
#: Of the result, four float32.
BYTES_A_PIXEL = 16
#: Bytes a pixel that Pillow's image takes; 4 for all other modes.
_STORED = {"1": 1, "L": 1, "P": 1, "I;16": 2, "I;16L": 2, "I;16B": 2, "I;16N": 2}
#: Bytes a pixel that a decoder holds beside Pillow's image: coefficients of progressive JPEG (three int16), frames and
#: their copies for WebP and GIF, and for TIFF another image, which it is turned into, and a strip as large as it.
_HELD_BESIDE = {"JPEG": 6, "WEBP": 16, "GIF": 8, "TIFF": 8}
_PIXELS_AT_ONCE = 1 << 16
#: Opaque, as the bytes red, green, blue and alpha.
_BLACK = 0xFF000000
#: Formats by Pillow's name, the module for each, and what its files begin with.
_SIGNATURES = (
    ("PNG", "Png", b"\x89PNG\r\n\x1a\n"), ("JPEG", "Jpeg", b"\xff\xd8\xff"),
    ("TIFF", "Tiff", (b"II", b"MM")), ("WEBP", "WebP", b"RIFF"), ("BMP", "Bmp", b"BM"),
    ("GIF", "Gif", (b"GIF87a", b"GIF89a")), ("TGA", "Tga", b""),
)  # fmt: skip


def decode(file: Path, data: bytes, max_bytes: int, *, as_stored: bool = False) -> tuple[Stored, bool]:
    """The picture as float32, and whether it is sRGB-encoded (integers) rather than linear (floats).

    With ``as_stored``, integers stay uint8 or uint16 and count from 0 to their largest.

    Raises
    ------
    InputError : a format or colour space that is not read, or more memory than `max_bytes`.
        Decoders meet broken bytes with errors of other kinds.
    """
    if data.startswith(b"\x76\x2f\x31\x01"):
        return _decode_exr(file, len(data), max_bytes), False
    if data.startswith(b"\x93NUMPY"):
        return _decode_npy(file, data, max_bytes, as_stored)
    if data.startswith((b"#?RADIANCE", b"#?RGBE")):
        raise InputError(f"{file}: Radiance HDR is not read; convert it to OpenEXR")
    if data.startswith(SIGNATURES) and not _is_known_to_pillow(data):
        return _decode_tiff(file, data, max_bytes, as_stored)
    return _decode_with_pillow(file, data, max_bytes, as_stored)


def open_picture(data: bytes, where: str) -> ImageFile:
    """The header of a picture of a promised format; nothing is decoded yet.

    Raises
    ------
    InputError : any other format, whatever the name of the file.

    >>> open_picture(b"%!PS-Adobe-3.0 EPSF-3.0", "wood.png")
    Traceback (most recent call last):
    passgraph.errors.InputError: wood.png: not a picture that can be read, or corrupt; expected PNG, ...
    """
    from PIL import Image as pillow
    from PIL import UnidentifiedImageError

    try:
        return opened(io.BytesIO(data))
    except pillow.DecompressionBombError as error:  # of WebP, where nothing but a setting of the process prevents it
        raise InputError(
            f"{where}: is larger than Pillow reads in this process ({' '.join(str(error).split())}); expected at most "
            "twice PIL.Image.MAX_IMAGE_PIXELS pixels. Raise that, or convert the picture to PNG"
        ) from error
    except (UnidentifiedImageError, struct.error) as error:
        raise InputError(
            f"{where}: not a picture that can be read, or corrupt; expected {EXPECTED},"
            f" got {len(data)} bytes that begin with {data[:8]!r}"
        ) from error


def holds_several(file: Path) -> bool:
    """Whether a TIFF file has pictures behind the first; False of what cannot be read."""
    if file.suffix.lower() not in (".tif", ".tiff") or not file.is_file():
        return False
    try:
        with file.open("rb") as stream, opened(stream, ("TIFF",)) as image:
            return bool(getattr(image, "is_animated", False))
    except Exception:  # decoders meet broken bytes with errors of every kind, told when the picture is read
        return False


def _is_known_to_pillow(data: bytes) -> bool:
    """Whether Pillow reads a TIFF file in full: of planes (tag 284 is 2) it takes 8 of 16 bits (258)."""
    try:
        tags = getattr(open_picture(data, ""), "tag_v2", {})
    except InputError:
        return False
    return tags.get(284) != 2 or max(tags.get(258, (1,))) <= 8


def opened(stream: BinaryIO, formats: Container[str] = PILLOW_FORMATS) -> ImageFile:
    """Open a picture by Pillow's module for its format alone.

    `PIL.Image.open` would hold it to a limit of pixels that is one global for the whole process; `check_size` is ours.
    And it loads the modules of five formats.
    """
    from PIL import Image as pillow
    from PIL import UnidentifiedImageError

    begin = stream.read(16)
    for kind, module, signatures in _SIGNATURES:
        if kind in formats and begin.startswith(signatures):
            import_module(f"PIL.{module}ImagePlugin")
            factory, _ = pillow.OPEN[kind]
            stream.seek(0)
            try:
                return factory(stream, "")
            except (SyntaxError, IndexError, TypeError, struct.error):  # those that `PIL.Image.open` takes so
                continue
    raise UnidentifiedImageError


def check_size(file: Path, width: int, height: int, held: int, max_bytes: int) -> None:
    """Refuse a picture that is empty or takes too much memory.

    ``held`` is what else is in memory while the result is: stored pixels, decoders, the file.
    """
    if width < 1 or height < 1:
        raise InputError(f"{file}: says it is {width}×{height} pixels; expected at least 1×1")
    needed = width * height * BYTES_A_PIXEL + held
    if needed > max_bytes:
        raise InputError(
            f"{file}: says it is {width}×{height} = {width * height} pixels, which take {needed} bytes of memory"
            f" to load; expected at most {max_bytes}; make it smaller, or raise max_bytes if it is meant"
        )


def _decode_with_pillow(file: Path, data: bytes, max_bytes: int, as_stored: bool) -> tuple[Stored, bool]:
    from PIL import Image as pillow

    image = open_picture(data, str(file))
    stored = stored_as(image)
    is_wide = stored.startswith(("RGB;16", "RGBA;16"))
    check_size(file, image.width, image.height, _held(image, is_wide) + len(data), max_bytes)
    _check_mode(file, image, stored, is_wide)
    whole = _loaded_in_place(image) if as_stored and not is_wide else None
    if isinstance(tile := getattr(image, "_tile_size", None), tuple):  # TIFF: else Pillow applies its own limit again
        image.im = pillow.new(image.mode, tile, None).im
    image.load()
    other = _low_bytes(file, data, image) if is_wide else None
    # Asked after decoding: Pillow turns TIFF pictures itself and then removes the tag.
    turn, back = _turns.get(image.getexif().get(0x0112, 1), (_as_it_is, _as_it_is))
    if whole is not None:
        return np.ascontiguousarray(turn(whole)), True
    width, height = image.size
    wide = is_wide or image.mode.startswith("I;16")
    dtype = np.float32 if image.mode == "F" or not as_stored else np.uint16 if wide else np.uint8
    picture: Stored = np.empty((*turn(np.empty((height, width, 0))).shape[:2], 4), dtype)
    upside = back(picture)
    for box in _pieces(width, height):
        values = _piece(_cut(image, box), None if other is None else _cut(other, box))
        _put(upside[box[1] : box[3], box[0] : box[2]], values if as_stored else scaled(values))
    return picture, image.mode != "F"


def _loaded_in_place(image: ImageFile) -> Stored | None:
    """A PNG or JPEG of 8 bits decoded into memory of ours; None where Pillow must have its own.

    Pillow's pixels of RGB and RGBA are four bytes, as the result's are, so that nothing need be copied.  And memory of
    an array's comes from the system in large pages: making small ones ready took as long as decoding.
    """
    from PIL import Image as pillow

    if image.format not in ("PNG", "JPEG") or image.mode not in ("RGB", "RGBA") or "transparency" in image.info:
        return None
    if not image.tile:  # a file without pixels, which Pillow refuses only where there is no memory yet
        return None
    layout, unsaid = ("RGBA", 0) if image.mode == "RGBA" else ("RGBX", _BLACK)
    # Files may end before their last row.
    picture = np.full((image.height, image.width, 1), unsaid, "<u4").view(np.uint8)
    ours = pillow.frombuffer(layout, image.size, picture, "raw", layout, 0, 1).im
    image.im = ours
    image.load()
    return picture if image.im is ours else None  # it may have made memory of its own


def _held(image: ImageFile, is_wide: bool) -> int:
    """Bytes beside the result and the file."""
    stored = image.width * image.height * _STORED.get(image.mode, 4) * (2 if is_wide else 1)
    kind = image.format or ""
    beside = image.width * image.height * _HELD_BESIDE.get(kind, 0)
    if kind == "TIFF":
        # 322, 323: width and height of a tile, which may be larger than the picture
        tags = getattr(image, "tag_v2", {})
        beside += 8 * int(tags.get(322, 0)) * int(tags.get(323, 0))
    return stored + beside


def _check_mode(file: Path, image: ImageFile, stored: str, is_wide: bool) -> None:
    readable = ("1", "L", "LA", "La", "P", "PA", "RGB", "RGBA", "RGBa", "RGBX", "F")
    if image.mode.startswith("I;16") or is_wide or (";16" not in stored and image.mode in readable):
        return
    raise InputError(
        f"{file}: holds {stored or image.mode} pixels; expected gray, palette, RGB or RGBA of 8 or"
        " 16 bits; convert it, for example to an RGB PNG"
    )


def _cut(image: ImageFile, box: tuple[int, int, int, int]) -> Any:
    """As `Image.crop`, of a picture that is loaded, without Pillow's limit of pixels."""
    return image._new(image.im.crop(box))


def _piece(image: Any, low: Any) -> Stored:
    """A part of Pillow's image as it is stored: (h, w) or (h, w, 1 to 4)."""
    key = image.info.get("transparency")
    if image.mode == "F":
        return np.asarray(image, np.float32)
    if low is not None or image.mode.startswith("I;16"):
        high = np.asarray(image).astype(np.uint16)
        values = high if low is None else high << 8 | np.asarray(low)
        return values if key is None else _with_key(np.atleast_3d(values), key)
    # In Pillow, LA and RGB become RGBA with keys and palettes resolved.
    straight = image.convert("LA") if image.mode == "La" else image
    return np.asarray(straight if straight.mode == "RGBA" else straight.convert("RGBA"))


def scaled(values: Stored) -> Picture:
    """Integers as floats in [0, 1]; floats as they are."""
    floats: Picture = values.astype(np.float32, copy=False)
    return floats / np.float32(np.iinfo(values.dtype).max) if values.dtype.kind == "u" else floats


def stored_as(image: ImageFile) -> str:
    """Pillow's name for the layout in the file, such as 'RGB;16B'; '' where it does not say."""
    arguments = image.tile[0].args if image.tile else ""
    first = arguments[0] if isinstance(arguments, tuple) and arguments else arguments
    return first if isinstance(first, str) else ""


def _low_bytes(file: Path, data: bytes, image: ImageFile) -> ImageFile:
    """The low bytes of 16-bit RGB and RGBA, of which Pillow keeps the high ones only.

    Told that the bytes are in the other order, Pillow delivers them; so the file is decoded twice.
    """
    other = open_picture(data, str(file))
    mode, order = stored_as(other).split(";16")
    native = "L" if sys.byteorder == "little" else "B"
    swapped = "B" if (native if order == "N" else order) == "L" else "L"
    layout = f"{mode};16{swapped}"
    other.tile = [
        tile._replace(args=(layout, *tile.args[1:]) if isinstance(tile.args, tuple) else layout) for tile in other.tile
    ]
    other.load()
    return other


def _with_key(values: Stored, key: Any) -> Stored:
    """Adds alpha 0 where all channels equal the transparent colour of a 16-bit PNG, else the largest."""
    alpha = np.any(values != np.asarray(key), axis=-1, keepdims=True)
    return np.concatenate([values, alpha * _opaque(values.dtype)], axis=-1)


def _opaque(dtype: np.dtype[Any]) -> Any:
    """What alpha 1 is in a type."""
    return dtype.type(np.iinfo(dtype).max if dtype.kind == "u" else 1)


def _as_it_is(a: NDArray[Any]) -> NDArray[Any]:
    return a


def _quarter(a: NDArray[Any]) -> NDArray[Any]:
    return a.swapaxes(0, 1)[:, ::-1]


def _three_quarters(a: NDArray[Any]) -> NDArray[Any]:
    return a.swapaxes(0, 1)[::-1]


def _flipped(a: NDArray[Any]) -> NDArray[Any]:
    return a[:, ::-1]


def _half(a: NDArray[Any]) -> NDArray[Any]:
    return a[::-1, ::-1]


def _mirrored(a: NDArray[Any]) -> NDArray[Any]:
    return a[::-1]


def _transposed(a: NDArray[Any]) -> NDArray[Any]:
    return a.swapaxes(0, 1)


def _transversed(a: NDArray[Any]) -> NDArray[Any]:
    return a[::-1, ::-1].swapaxes(0, 1)


Turn = Callable[[NDArray[Any]], NDArray[Any]]
# EXIF 2.32, tag 0x0112: what was done to the camera, undone; and that undone.
_turns: dict[int, tuple[Turn, Turn]] = {
    2: (_flipped, _flipped),
    3: (_half, _half),
    4: (_mirrored, _mirrored),
    5: (_transposed, _transposed),
    6: (_quarter, _three_quarters),
    7: (_transversed, _transversed),
    8: (_three_quarters, _quarter),
}


def _decode_npy(file: Path, data: bytes, max_bytes: int, as_stored: bool) -> tuple[Stored, bool]:
    """An array saved by numpy: (h, w) or (h, w, 1 | 2 | 3 | 4) of floats, uint8 or uint16."""
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, by_columns, dtype = read_header(stream)
    if len(shape) not in (2, 3) or (len(shape) == 3 and shape[2] not in (1, 2, 3, 4)):
        raise InputError(f"{file}: has shape {shape}; expected (h, w) or (h, w, 1 to 4)")
    check_size(file, shape[1], shape[0], len(data), max_bytes)
    kept = {"f": np.float32, "u1": np.uint8, "u2": np.uint16}.get("f" if dtype.kind == "f" else dtype.str[1:])
    if kept is None:
        raise InputError(f"{file}: has dtype {dtype}; expected float, uint8 or uint16")
    flat = np.frombuffer(data, dtype, prod(shape), stream.tell())
    array = flat.reshape(shape, order="F" if by_columns else "C")
    picture: Stored = np.empty((*shape[:2], 4), kept if as_stored else np.float32)
    for left, top, right, bottom in _pieces(shape[1], shape[0]):
        with np.errstate(over="ignore"):  # a float64 beyond float32 becomes infinity, as in a float target
            part = array[top:bottom, left:right].astype(kept)
        _put(picture[top:bottom, left:right], part if as_stored else scaled(part))
    return picture, kept is not np.float32


def _decode_tiff(file: Path, data: bytes, max_bytes: int, as_stored: bool) -> tuple[Stored, bool]:
    """What Pillow does not read of TIFF, such as several channels of floats."""
    tiff = TiffNumbers(file, data)
    check_size(file, tiff.width, tiff.height, tiff.held + len(data), max_bytes)
    turn, back = _turns.get(tiff.orientation, (_as_it_is, _as_it_is))
    values = tiff.decoded()
    picture: Stored = np.empty((*turn(values).shape[:2], 4), values.dtype if as_stored else np.float32)
    _put(back(picture), values if as_stored else scaled(values))
    return picture, values.dtype.kind == "u"


def _decode_exr(file: Path, file_bytes: int, max_bytes: int) -> Picture:
    """The display window of the first part; pixels outside its data window are 0."""
    openexr = import_openexr(file)
    parts = openexr.File(os.fspath(file), header_only=True).parts
    header = parts[0].header
    (left, top), (right, bottom) = _window(header, "displayWindow")
    (x0, y0), (x1, y1) = _window(header, "dataWindow")
    # All channels of all parts are read together, whatever is wanted of them.
    held = file_bytes + sum(_exr_bytes(part.header) for part in parts)
    check_size(file, right - left + 1, bottom - top + 1, held, max_bytes)
    check_size(file, x1 - x0 + 1, y1 - y0 + 1, held, max_bytes)
    names = {channel.name for channel in header["channels"]}
    found = next((order for order in (["R", "G", "B"], ["Y"]) if names.issuperset(order)), None)
    if found is None or any(channel.xSampling != 1 or channel.ySampling != 1 for channel in header["channels"]):
        raise InputError(
            f"{file}: has the channels {', '.join(sorted(names))}; expected R, G, B or Y, with or without A,"
            " none subsampled"
        )
    content = openexr.File(os.fspath(file), separate_channels=True)
    if not content.parts:
        raise InputError(f"{file}: truncated or corrupt (not all rows are there); make or copy the file again")
    channels = content.channels()
    picture: Picture = np.zeros((bottom - top + 1, right - left + 1, 4), np.float32)
    a, b, c, d = max(x0, left), min(x1, right) + 1, max(y0, top), min(y1, bottom) + 1
    if "A" not in names:
        picture[..., 3] = 1.0
    if a < b and c < d:
        shown = picture[c - top : d - top, a - left : b - left]
        for name, to in ((found[0], 0), (found[-1 if len(found) == 1 else 1], 1), (found[-1], 2), ("A", 3)):
            if name in names:
                shown[..., to] = np.asarray(channels[name].pixels)[c - y0 : d - y0, a - x0 : b - x0]
    return picture


def _window(header: Any, name: str) -> Any:
    return tuple(corner.tolist() for corner in header[name])


def _exr_bytes(header: Any) -> int:
    """Bytes of all channels of one part, as they are read."""
    (x0, y0), (x1, y1) = _window(header, "dataWindow")
    # the header alone does not tell HALF (two bytes) from FLOAT and UINT (four)
    pixels: int = max(x1 - x0 + 1, 0) * max(y1 - y0 + 1, 0)
    return 4 * pixels * len(header["channels"])


def _pieces(width: int, height: int) -> Iterator[tuple[int, int, int, int]]:
    """Left, top, right, bottom of parts of at most `_PIXELS_AT_ONCE` that cover a picture."""
    across = min(width, _PIXELS_AT_ONCE)
    down = max(_PIXELS_AT_ONCE // across, 1)
    for top in range(0, height, down):
        for left in range(0, width, across):
            yield left, top, min(left + across, width), min(top + down, height)


def _put(into: Stored, values: Stored) -> None:
    """(h, w) or (h, w, 1 | 2 | 3 | 4) into (h, w, 4)."""
    channels = values[..., None] if values.ndim == 2 else values
    count = channels.shape[2]
    if count == 4:
        into[...] = channels  # five times as fast as by parts
        return
    into[..., :3] = channels[..., : 3 if count > 2 else 1]
    into[..., 3] = channels[..., -1] if count == 2 else _opaque(into.dtype)


def import_openexr(file: Path) -> Any:
    try:
        import OpenEXR
    except ImportError as error:
        raise InputError(f"{file}: OpenEXR is not installed; run: pip install 'passgraph[exr]'") from error
    return OpenEXR
