"""Pictures on disk: read into `(h, w, 4) float32`, written whole or not at all.

Row 0 is the top row. Values of 8- and 16-bit files are scaled to [0, 1] and kept as stored, which for
nearly every such file means sRGB-encoded; `linear=True` decodes them on reading and encodes them on writing.
OpenEXR, float TIFF and float npy hold linear light and pass unchanged. Embedded colour profiles are ignored.
"""

from __future__ import annotations

import io
import os
import secrets
import stat
import struct
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import InputError

if TYPE_CHECKING:
    from PIL.ImageFile import ImageFile

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

# Keep what was rendered: no chroma subsampling, and WebP without loss, also under transparent pixels.
_options: dict[str, dict[str, Any]] = {
    "JPEG": {"quality": 95, "subsampling": 0},
    "WEBP": {"lossless": True, "exact": True},
}

# A limit beyond this is none: no machine holds such a picture.
MOST_PIXELS = 1 << 48
# Pillow's limit on pixels is one global of the module.
_pillow_limit = threading.Lock()


def load(path: str | os.PathLike[str], *, max_pixels: int = 1 << 28, linear: bool = False) -> NDArray[np.float32]:
    """Read a picture file; what it is, is told by its content and not by its name.

    Parameters
    ----------
    path : PNG, JPEG, TIFF, WebP, OpenEXR, npy, or another format that Pillow reads.
        EXIF orientation is applied. Of several frames or parts the first is read.
    max_pixels : a larger picture is refused before it is decoded.
    linear : decode the colours (not alpha) of integer formats from sRGB to linear light.

    Returns
    -------
    (h, w, 4) float32, row 0 on top: red, green, blue and straight alpha (1 where the file has none).
    Gray is repeated in red, green and blue. In [0, 1] for 8- and 16-bit files, unlimited for float ones.

    Raises
    ------
    InputError : the file is missing, not a file, unreadable, empty, truncated, corrupt, too large,
        or in a colour space that has no single meaning as RGB (CMYK, Lab).

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(f"{folder}/gray.png", np.full((2, 3), 0.2))
    ...     load(f"{folder}/gray.png").shape
    (2, 3, 4)
    """
    file = arguments.path(path, "the picture to load")
    max_pixels = arguments.whole(max_pixels, f"{file}: max_pixels", 1, MOST_PIXELS, InputError)
    arguments.flag(linear, f"{file}: linear", InputError)
    data = _read(file, max_pixels)
    try:
        if data.startswith(b"\x76\x2f\x31\x01"):
            picture, encoded = _decode_exr(file, max_pixels), False
        elif data.startswith(b"\x93NUMPY"):
            picture, encoded = _decode_npy(file, data, max_pixels)
        elif data.startswith((b"#?RADIANCE", b"#?RGBE")):
            raise InputError(f"{file}: Radiance HDR is not read; convert it to OpenEXR")
        else:
            picture, encoded = _decode_with_pillow(file, data, max_pixels)
    except InputError:
        raise
    except MemoryError as error:
        raise InputError(f"{file}: not enough memory to decode it; make the picture smaller") from error
    except Exception as error:  # decoders meet broken bytes with errors of every kind
        message = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{file}: truncated or corrupt ({message}); make or copy the file again") from error
    picture = _to_rgba(picture)
    if linear and encoded:
        picture[..., :3] = srgb_to_linear(picture[..., :3])
    return picture


def save(path: str | os.PathLike[str], picture: object, *, linear: bool = False) -> None:
    """Write a picture file; an older file of that name stays until the new one is complete.

    Parameters
    ----------
    path : the suffix chooses the format: .png .jpg .jpeg .tif .tiff .webp (8-bit), .exr .npy (float32).
    picture : (h, w) or (h, w, 1 | 2 | 3 | 4), row 0 on top: gray, gray and alpha, RGB, RGBA.
        Floats are clipped to [0, 1] and rounded half to even for 8-bit formats and written unchanged to
        float formats. uint8 goes to 8-bit formats as it is and to float formats divided by 255.
    linear : encode the colours of floats from linear light to sRGB for 8-bit formats.

    Raises
    ------
    InputError : unknown suffix, no such folder, a place that cannot be written, a shape or dtype that is no
        picture, zero size, NaN in an 8-bit format, transparency in a JPEG.

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
    if kind == "EXR":
        values = _as_float32(file, pixels)
        openexr = _import_openexr(file)
        _write(file, lambda temporary: _encode_exr(openexr, temporary, values))
    elif kind == "NPY":
        buffer = io.BytesIO()
        np.save(buffer, _as_float32(file, pixels), allow_pickle=False)
        _write(file, lambda temporary: _write_new(temporary, buffer.getvalue()))
    else:
        encoded = _encode_with_pillow(file, _as_uint8(file, pixels, linear), kind)
        _write(file, lambda temporary: _write_new(temporary, encoded))


def srgb_to_linear(encoded: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear light of sRGB-encoded values in [0, 1] (IEC 61966-2-1:1999, section 5.2).

    >>> srgb_to_linear(np.array([0.0, 0.5, 1.0], np.float32)).round(4).tolist() == np.float32(
    ...     [0.0, 0.214, 1.0]).tolist()
    True
    """
    low = encoded / np.float32(12.92)
    high = ((np.maximum(encoded, 0) + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    return np.where(encoded <= np.float32(0.04045), low, high).astype(np.float32)


def linear_to_srgb(light: NDArray[np.float32]) -> NDArray[np.float32]:
    """sRGB-encoded values of linear light in [0, 1] (IEC 61966-2-1:1999, section 5.3).

    >>> float(linear_to_srgb(np.float32([0.214]))[0].round(2)) == float(np.float32(0.5))
    True
    """
    low = light * np.float32(12.92)
    high = np.maximum(light, 0) ** np.float32(1 / 2.4) * np.float32(1.055) - np.float32(0.055)
    return np.where(light <= np.float32(0.0031308), low, high).astype(np.float32)


# Reading


def _read(file: Path, max_pixels: int) -> bytes:
    """The bytes of a regular file of a sane size."""
    # 16 bytes are the largest pixel (four float32); a MiB is left for metadata.
    most = max_pixels * 16 + (1 << 20)
    try:
        status = file.stat()
        if stat.S_ISDIR(status.st_mode):
            raise InputError(f"{file}: is a directory; expected a picture file")
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{file}: is a device or a pipe; expected a picture file")
        if status.st_size > most:
            raise InputError(
                f"{file}: has {status.st_size} bytes; expected at most {most}, enough for"
                f" {max_pixels} pixels; raise max_pixels if it is meant"
            )
        data = file.read_bytes()
    except FileNotFoundError as error:
        raise InputError(f"{file}: no such file; check the path (the folder here is {Path.cwd()})") from error
    except (OSError, ValueError) as error:  # ValueError: a null byte in the path
        raise InputError(f"{file}: cannot be read ({_reason(error)}); check its permissions") from error
    if not data:
        raise InputError(f"{file}: is empty (0 bytes); expected a picture file")
    return data


def _check_size(file: Path, width: int, height: int, max_pixels: int) -> None:
    if width < 1 or height < 1:
        raise InputError(f"{file}: says it is {width}×{height} pixels; expected at least 1×1")
    if width * height > max_pixels:
        raise InputError(
            f"{file}: says it is {width}×{height} = {width * height} pixels; expected at most {max_pixels};"
            " raise max_pixels if it is meant"
        )


def _decode_with_pillow(file: Path, data: bytes, max_pixels: int) -> tuple[NDArray[np.float32], bool]:
    """Channels as stored, and whether they are sRGB-encoded (integers) rather than linear (floats)."""
    image = _open_with_pillow(file, data)
    _check_size(file, image.width, image.height, max_pixels)
    stored = _stored_as(image)
    picture: NDArray[np.float32]
    if image.mode == "F":
        picture = np.array(image, np.float32)
    elif image.mode.startswith("I;16"):
        picture = np.asarray(image).astype(np.float32) / np.float32(65535)
        if "transparency" in image.info:
            picture = _with_key(picture[..., None], np.asarray(image)[..., None], image.info["transparency"])
    elif stored.startswith(("RGB;16", "RGBA;16")):
        picture = _decode_16_bit(file, data, image)
    elif ";16" in stored or image.mode not in (
        "1",
        "L",
        "LA",
        "La",
        "P",
        "PA",
        "RGB",
        "RGBA",
        "RGBa",
        "RGBX",
    ):
        raise InputError(
            f"{file}: holds {stored or image.mode} pixels; expected gray, palette, RGB or RGBA of 8 or"
            " 16 bits; convert it, for example to an RGB PNG"
        )
    else:
        # In Pillow, LA and RGB become RGBA with keys and palettes resolved.
        straight = image.convert("LA") if image.mode == "La" else image
        picture = np.asarray(straight.convert("RGBA")).astype(np.float32) / np.float32(255)
    return _upright(picture, image), image.mode != "F"


def _open_with_pillow(file: Path, data: bytes) -> ImageFile:
    """The header only; `load` compares the size in it with `max_pixels`."""
    from PIL import Image as pillow
    from PIL import UnidentifiedImageError

    with _pillow_limit:
        limit = pillow.MAX_IMAGE_PIXELS
        pillow.MAX_IMAGE_PIXELS = None
        try:
            return pillow.open(io.BytesIO(data))
        except UnidentifiedImageError as error:
            raise InputError(
                f"{file}: not a picture that can be read, or corrupt; expected PNG, JPEG, TIFF, WebP,"
                f" OpenEXR or npy, got {len(data)} bytes that begin with {data[:8]!r}"
            ) from error
        finally:
            pillow.MAX_IMAGE_PIXELS = limit


def _stored_as(image: ImageFile) -> str:
    """Pillow's name for the layout in the file, such as 'RGB;16B'; '' where it does not say."""
    arguments = image.tile[0].args if image.tile else ""
    first = arguments[0] if isinstance(arguments, tuple) and arguments else arguments
    return first if isinstance(first, str) else ""


def _decode_16_bit(file: Path, data: bytes, image: ImageFile) -> NDArray[np.float32]:
    """16-bit RGB and RGBA, of which Pillow keeps the high bytes only.

    Told that the bytes are in the other order, Pillow delivers the low bytes; so the file is decoded twice.
    """
    mode, order = _stored_as(image).split(";16")
    native = "L" if sys.byteorder == "little" else "B"
    swapped = "B" if (native if order == "N" else order) == "L" else "L"
    other = _open_with_pillow(file, data)
    layout = f"{mode};16{swapped}"
    other.tile = [
        tile._replace(args=(layout, *tile.args[1:]) if isinstance(tile.args, tuple) else layout) for tile in other.tile
    ]
    values = np.asarray(image).astype(np.uint16) << 8 | np.asarray(other)
    scaled = values.astype(np.float32) / np.float32(65535)
    key = image.info.get("transparency")
    return scaled if key is None else _with_key(scaled, values, key)


def _with_key(scaled: NDArray[np.float32], values: NDArray[Any], key: Any) -> NDArray[np.float32]:
    """Adds alpha 0 where all channels equal the transparent colour of a PNG, else 1."""
    alpha = np.any(values != np.asarray(key), axis=-1, keepdims=True)
    return np.concatenate([scaled, alpha.astype(np.float32)], axis=-1)


# EXIF 2.32, tag 0x0112: what was done to the camera, undone.
_turns: dict[int, Callable[[NDArray[np.float32]], NDArray[np.float32]]] = {
    2: lambda a: a[:, ::-1],
    3: lambda a: a[::-1, ::-1],
    4: lambda a: a[::-1],
    5: lambda a: a.swapaxes(0, 1),
    6: lambda a: a.swapaxes(0, 1)[:, ::-1],
    7: lambda a: a[::-1, ::-1].swapaxes(0, 1),
    8: lambda a: a.swapaxes(0, 1)[::-1],
}


def _upright(picture: NDArray[np.float32], image: ImageFile) -> NDArray[np.float32]:
    # Asked after decoding: Pillow turns TIFF pictures itself and then removes the tag.
    turn = _turns.get(image.getexif().get(0x0112, 1))
    return picture if turn is None else turn(picture)


def _decode_npy(file: Path, data: bytes, max_pixels: int) -> tuple[NDArray[np.float32], bool]:
    """An array saved by numpy: (h, w) or (h, w, 1 | 2 | 3 | 4) of floats, uint8 or uint16."""
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read_header(stream)
    if len(shape) not in (2, 3) or (len(shape) == 3 and shape[2] not in (1, 2, 3, 4)):
        raise InputError(f"{file}: has shape {shape}; expected (h, w) or (h, w, 1 to 4)")
    _check_size(file, shape[1], shape[0], max_pixels)
    scale = {"f": 1, "u1": 255, "u2": 65535}.get("f" if dtype.kind == "f" else dtype.str[1:])
    if scale is None:
        raise InputError(f"{file}: has dtype {dtype}; expected float, uint8 or uint16")
    array = np.load(io.BytesIO(data), allow_pickle=False).astype(np.float32)
    return array / np.float32(scale), scale != 1


def _decode_exr(file: Path, max_pixels: int) -> NDArray[np.float32]:
    """The display window of the first part; pixels outside its data window are 0."""
    openexr = _import_openexr(file)
    header = openexr.File(os.fspath(file), header_only=True).header()
    (left, top), (right, bottom) = (corner.tolist() for corner in header["displayWindow"])
    (x0, y0), (x1, y1) = (corner.tolist() for corner in header["dataWindow"])
    _check_size(file, right - left + 1, bottom - top + 1, max_pixels)
    _check_size(file, x1 - x0 + 1, y1 - y0 + 1, max_pixels)
    names = {channel.name for channel in header["channels"]}
    found = next((order for order in (["R", "G", "B"], ["Y"]) if names.issuperset(order)), None)
    if found is None or any(channel.xSampling != 1 or channel.ySampling != 1 for channel in header["channels"]):
        raise InputError(
            f"{file}: has the channels {', '.join(sorted(names))}; expected R, G, B or Y, with or without A,"
            " none subsampled"
        )
    order = [*found, "A"] if "A" in names else found
    content = openexr.File(os.fspath(file), separate_channels=True)
    if not content.parts:
        raise InputError(f"{file}: truncated or corrupt (not all rows are there); make or copy the file again")
    channels = content.channels()
    stored = np.stack([np.asarray(channels[name].pixels, np.float32) for name in order], axis=-1)
    if (left, top, right, bottom) == (x0, y0, x1, y1):
        return stored
    picture = np.zeros((bottom - top + 1, right - left + 1, len(order)), np.float32)
    a, b, c, d = max(x0, left), min(x1, right) + 1, max(y0, top), min(y1, bottom) + 1
    if a < b and c < d:
        picture[c - top : d - top, a - left : b - left] = stored[c - y0 : d - y0, a - x0 : b - x0]
    return picture


def _to_rgba(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, w) or (h, w, 1 | 2 | 3 | 4) to a new contiguous (h, w, 4)."""
    channels = picture[..., None] if picture.ndim == 2 else picture
    rgba = np.ones((*channels.shape[:2], 4), np.float32)
    count = channels.shape[2]
    rgba[..., :3] = channels[..., : 3 if count > 2 else 1]
    if count in (2, 4):
        rgba[..., 3] = channels[..., -1]
    return rgba


# Writing


def _checked(file: Path, picture: object) -> NDArray[Any]:
    """The picture as (h, w, 1 | 2 | 3 | 4) of floats or uint8."""
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
    if pixels.dtype.kind != "f" and pixels.dtype != np.uint8:
        raise InputError(f"{file}: a picture of dtype {pixels.dtype}; expected float in [0, 1] or uint8")
    return pixels


def _as_float32(file: Path, pixels: NDArray[Any]) -> NDArray[np.float32]:
    if pixels.dtype == np.uint8:
        return pixels.astype(np.float32) / np.float32(255)
    with np.errstate(over="ignore"):  # a float64 beyond float32 becomes infinity, as in a float target
        return np.ascontiguousarray(pixels, np.float32)


def _as_uint8(file: Path, pixels: NDArray[Any], linear: bool) -> NDArray[np.uint8]:
    if pixels.dtype == np.uint8:
        if linear:
            raise InputError(f"{file}: uint8 with linear=True; expected floats (8 bits of linear light band)")
        return np.ascontiguousarray(pixels)
    missing = np.isnan(pixels)
    if missing.any():
        row, column, channel = (int(i) for i in np.argwhere(missing)[0])
        raise InputError(
            f"{file}: {int(missing.sum())} of {pixels.size} values are NaN, the first in row {row},"
            f" column {column}, channel {channel}; save as .exr or .npy to look at them"
        )
    clipped = np.clip(pixels, 0, 1).astype(np.float32)
    if linear:
        colours = 3 if pixels.shape[2] > 2 else 1
        clipped[..., :colours] = linear_to_srgb(clipped[..., :colours])
    encoded: NDArray[np.uint8] = np.rint(clipped * np.float32(255)).astype(np.uint8)
    return encoded


def _encode_with_pillow(file: Path, pixels: NDArray[np.uint8], kind: str) -> bytes:
    from PIL import Image as pillow

    channels = pixels.shape[2]
    if kind == "JPEG" and channels in (2, 4):
        if pixels[..., -1].min() < 255:
            raise InputError(f"{file}: JPEG has no transparency; save as .png, or pass picture[..., :{channels - 1}]")
        pixels = np.ascontiguousarray(pixels[..., :-1])
    buffer = io.BytesIO()
    image = pillow.fromarray(pixels[..., 0] if pixels.shape[2] == 1 else pixels)
    if kind == "WEBP" and channels < 3:
        image = image.convert("RGB" if channels == 1 else "RGBA")
    try:
        image.save(buffer, kind, **_options.get(kind, {}))
    except (OSError, ValueError, struct.error, MemoryError) as error:
        size = f"{image.width}×{image.height}"
        raise InputError(
            f"{file}: {kind} cannot hold {size} pixels ({_reason(error)}); save as .png or .exr"
        ) from error
    return buffer.getvalue()


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
        # Through a symbolic link, so that the link stays one.
        target = Path(os.path.realpath(file))
        if target.is_dir():
            raise InputError(f"{file}: is a directory; expected the name of a file")
        if not target.parent.is_dir():
            raise InputError(f"{file}: the folder {target.parent} does not exist; make it first")
        temporary = target.with_name(f".passgraph-{secrets.token_hex(6)}{target.suffix}")
        try:
            write_to(temporary)
            os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)
    except (OSError, ValueError, RuntimeError) as error:  # RuntimeError: OpenEXR
        raise InputError(
            f"{file}: cannot be written ({_reason(error)}); check the folder's permissions and free space"
        ) from error


def _reason(error: BaseException) -> str:
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(text.split())


def _import_openexr(file: Path) -> Any:
    try:
        import OpenEXR
    except ImportError as error:
        raise InputError(f"{file}: OpenEXR is not installed; run: pip install 'passgraph[exr]'") from error
    return OpenEXR
