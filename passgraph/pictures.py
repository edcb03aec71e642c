"""Load and save pictures: `(h, w, 4) float32` from and to image files, written atomically.

Row 0 is the top row. Values of 8- and 16-bit files are scaled to [0, 1] and not decoded; nearly all such files are
sRGB-encoded. `linear=True` decodes them when loading and encodes them when saving. OpenEXR, HDR, PFM, float TIFF and
float npy hold linear light and are not converted. Embedded color profiles do not change values; `like` copies them from
one file to another. Alpha is straight in arrays, whether or not the file stores it associated.
"""

from __future__ import annotations

import io
import os
import re
import warnings
from collections.abc import Callable
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.color_tags import ColorSpace, Recoded
from passgraph.errors import InputError, reason
from passgraph.exr_layers import KeptLayers
from passgraph.image_files import FIRST_OF_SEVERAL, MAX_BYTES, associated, opened_image, straight, upright
from passgraph.image_formats import WRITABLE, Metadata, WritableFormat, is_opaque, unstated
from passgraph.image_writing import encoded_image, write_image
from passgraph.quantise import check_no_nan, integers_of, opaque
from passgraph.reading import check_regular, read_bytes
from passgraph.srgb import linear_to_srgb, srgb_to_linear
from passgraph.writing import NewFile, unwritable

Picture = NDArray[np.float32]
Stored = NDArray[Any]  # (h, w, 4) uint8, uint16 or float32

#: Larger limits count as no limit.
MOST_BYTES = 1 << 52
#: Bytes of a result pixel: four float32.
BYTES_PER_PIXEL = 16
#: Pixels converted at a time, so that temporaries stay small.
_PIXELS_AT_ONCE = 1 << 16
#: `shot.exr:diffuse`: a layer of a file; `photo.jpg:hdr`: the HDR rendition of one with a gain map.
_LAYER = re.compile(r"(.+\.(?:exr|jpe?g)):([^/\\]+)", re.IGNORECASE | re.DOTALL)
#: Encodings other than sRGB, by OpenImageIO's names.
_LOG = ("kodaklog", "cineon", "adx10")


def load(
    path: str | os.PathLike[str],
    *,
    layer: str | None = None,
    max_bytes: int = MAX_BYTES,
    linear: bool = False,
    raw: bool = False,
    overscan: bool = False,
) -> Picture:
    """Load a picture file. The format is detected from its content, not from its name.

    Parameters
    ----------
    path : PNG, JPEG, TIFF, OpenEXR, WebP, BMP, GIF, TGA, HDR, PNM, PFM, DPX, Cineon, JPEG XL, JPEG 2000, PSD, DDS or
        npy. EXIF orientation is applied. Of several pictures in a file the first is read, of a TIFF stack with a
        UserWarning. ``shot.exr:diffuse`` reads a
        layer of an OpenEXR file; ``photo.jpg:hdr`` the HDR rendition of a JPEG with a gain map (Ultra HDR), in linear
        light, where 1 is white of the picture that is read without ``:hdr``.
    layer : a layer, part or channel of an OpenEXR file, such as ``"diffuse"``, ``"N"`` or ``"Z"``; or ``"hdr"``.
    max_bytes : memory limit, checked against the header before anything is allocated: 16 bytes per pixel for the
        result, the decoder's memory (1 to 48 bytes per pixel), and the file itself.
    linear : decode the colors (not alpha) of integer formats to linear light: by the transfer function that the file
        states, if that is linear, sRGB or a power; else from sRGB.
    raw : do not divide associated colors by alpha. Layers without color, such as Cryptomatte's, are never divided.
    overscan : read the pixels that an OpenEXR file has outside its display window too: the picture is as large as the
        smallest window around both.

    Returns
    -------
    (h, w, 4) float32, row 0 on top: red, green, blue and straight alpha (1 if the file has none).
    Gray is repeated in red, green and blue. Two channels without alpha, also of npy, are red and green. Values are in
    [0, 1] for 8- and 16-bit files, unbounded for float ones.
    Associated colors (OpenEXR, some TIFF) are divided by alpha; where alpha is 0 they stay.

    Raises
    ------
    InputError : the file is missing, not a file, unreadable, empty, truncated, corrupt, too large, of another
        format, of integers without a scale (signed or 32 bits), or without the layer.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(f"{folder}/gray.png", np.full((2, 3), 0.2))
    ...     load(f"{folder}/gray.png").shape
    (2, 3, 4)
    """
    file, named_layer = split_layer(arguments.path(path, "the picture to load"))
    if layer is not None:
        arguments.string(layer, f"{file}: layer")
    max_bytes = arguments.whole_number(max_bytes, f"{file}: max_bytes", 1, MOST_BYTES, InputError)
    arguments.flag(linear, f"{file}: linear", InputError)
    arguments.flag(raw, f"{file}: raw", InputError)
    arguments.flag(overscan, f"{file}: overscan", InputError)
    picture, encoding = _load(file, None, layer or named_layer, max_bytes, as_stored=False, raw=raw, overscan=overscan)
    if holds_several(file):
        warnings.warn(f"{file}: {FIRST_OF_SEVERAL}", stacklevel=2)
    if linear and encoding is not None:
        _decode(picture, _light_of(file, encoding))
    return picture


def _decode(picture: Picture, light_of: Callable[[Picture], Picture]) -> None:
    """Decode the colors of (h, w, 4) in place."""
    pixels = picture.reshape(-1, 4)
    for first in range(0, len(pixels), _PIXELS_AT_ONCE):
        part = pixels[first : first + _PIXELS_AT_ONCE, :3]
        part[...] = light_of(part)


def _light_of(file: Path, encoding: str) -> Callable[[Picture], Picture]:
    """Return the function to linear light of an encoding, by its Color Interop ID or OpenImageIO's name.

    >>> _light_of(Path("a.png"), "g20_rec709_scene")(np.float32([0.5])).tolist()
    [0.25]
    """
    transfer, gamut, _ = f"{encoding.lower()}__".split("_", 2)
    if transfer == "lin":
        return lambda codes: codes
    if power := re.fullmatch("g([0-9]{2})", transfer):
        gamma = np.float32(int(power[1]) / 10)
        return lambda codes: codes**gamma
    if encoding.lower() in _LOG or (gamut and transfer != "srgb"):
        raise InputError(
            f"{file}: is encoded as {encoding}, not sRGB; load it without linear=True (--as-stored), or name its color "
            "space: --from-space"
        )
    return srgb_to_linear


def load_stored(path: Path, data: bytes | None = None, *, linear: bool = False, overscan: bool = False) -> Stored:
    """Load a picture in the file's own type: (h, w, 4) uint8, uint16 or float32.

    Parameters
    ----------
    path : a file, or only its name in messages
    data : the content if it is not on disk
    linear : integers will be decoded from sRGB. Those of another encoding are returned as float32, in linear light.
    overscan : as for `load`
    """
    file, layer = split_layer(path)
    picture, encoding = _load(file, data, layer, MAX_BYTES, as_stored=True, overscan=overscan)
    if not linear or encoding is None or (light_of := _light_of(file, encoding)) is srgb_to_linear:
        return picture
    light = scaled(picture)
    _decode(light, light_of)
    return light


def split_layer(path: Path) -> tuple[Path, str | None]:
    """Split ``file.exr:layer`` into file and layer; an existing file of that whole name takes precedence.

    >>> split_layer(Path("shot.exr:diffuse"))[1]
    'diffuse'
    """
    found = _LAYER.fullmatch(os.fspath(path))
    return (path, None) if found is None or os.path.lexists(path) else (Path(found[1]), found[2])


def is_exr(path: Path) -> bool:
    """Return True for the name of an OpenEXR file, or of a layer of one."""
    return split_layer(path)[0].suffix.lower() == ".exr"


def in_layer(file: Path, layer: str | None) -> Path:
    """Return the path of a file's layer, the inverse of `split_layer`.

    >>> in_layer(Path("shot.exr"), "diffuse").name
    'shot.exr:diffuse'
    """
    return file if layer is None else file.with_name(f"{file.name}:{layer}")


def metadata_of(path: Path, data: bytes | None = None) -> Metadata:
    """Return the metadata of a picture file; empty metadata if it has none or cannot be read.

    ``data`` is the content if it is not on disk.
    """
    file, layer = split_layer(path)
    try:
        if data is None:
            check_regular(file, "a picture file")
        with opened_image(file, data, layer) as image:
            return image.metadata()
    except InputError:
        return Metadata()


def is_deep(path: Path) -> bool:
    """Return True if the header of a picture file declares 16-bit integers; False if it cannot be read."""
    return metadata_of(path).deep


def holds_several(file: Path) -> bool:
    """Return True if a TIFF file has more than one picture; False for files that cannot be read."""
    if file.suffix.lower() not in (".tif", ".tiff") or not file.is_file():
        return False
    try:
        with opened_image(file) as image:
            return image.has_second
    except InputError:
        return False


def check_size(file: Path, width: int, height: int, other_bytes: int, max_bytes: int) -> None:
    """Raise InputError for a picture that is empty or needs too much memory.

    ``other_bytes`` are needed in addition to the result: stored pixels, the decoder's memory, the file.
    """
    if width < 1 or height < 1:
        raise InputError(f"{file}: says it is {width}×{height} pixels; expected at least 1×1")
    needed = width * height * BYTES_PER_PIXEL + other_bytes
    if needed > max_bytes:
        raise InputError(
            f"{file}: says it is {width}×{height} = {width * height} pixels, which take {needed} bytes of memory"
            f" to load; expected at most {max_bytes}; make it smaller, or raise max_bytes if it is meant"
        )


def scaled(values: Stored) -> Picture:
    """Scale integers to floats in [0, 1]; return floats as float32."""
    floats: Picture = values.astype(np.float32, copy=False)
    return floats / np.float32(np.iinfo(values.dtype).max) if values.dtype.kind == "u" else floats


def _load(
    file: Path, data: bytes | None, layer: str | None, max_bytes: int, *, as_stored: bool, raw: bool = False,
    overscan: bool = False,
) -> tuple[Stored, str | None]:  # fmt: skip
    """Return the picture and the encoding: of integers a name or "" if not given, of floats None."""
    if data is None:
        size = check_regular(file, "a picture file")
        if size > max_bytes:
            raise InputError(
                f"{file}: has {size} bytes; expected at most {max_bytes}; make it smaller, or raise max_bytes"
            )
        head = read_head(file)
    else:
        size, head = len(data), data[:6]
    if not head:
        raise InputError(f"{file}: is empty (0 bytes); expected a picture file")
    try:
        if head == b"\x93NUMPY":
            content = read_bytes(file, "a picture file", max_bytes) if data is None else data
            picture, is_float = _decode_npy(file, content, max_bytes, as_stored)
            return picture, None if is_float else ""
        with opened_image(file, data, layer, max_bytes, overscan=overscan) as image:
            check_size(file, image.width, image.height, image.held + size, max_bytes)
            check_size(file, *image.data_size, image.held + size, max_bytes)
            pixels = image.read()
            if image.is_associated and not raw:
                pixels = straight(pixels)
            rgba = _as_rgba(upright(pixels, image.orientation), image.has_alpha, as_stored)
            return rgba, None if pixels.dtype.kind == "f" else image.encoding
    except MemoryError as error:
        raise InputError(f"{file}: not enough memory to decode it; make the picture smaller") from error


def read_head(file: Path) -> bytes:
    """Return the first bytes of a file."""
    try:
        with file.open("rb") as stream:
            return stream.read(6)
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: cannot be read ({reason(error)}); check its permissions") from error


def _as_rgba(pixels: Stored, has_alpha: bool, as_stored: bool) -> Stored:
    """Convert (h, w, 1 to 4) to (h, w, 4), in the stored type or as float32.

    One channel, beside alpha, is gray. Two are red and green.
    """
    height, width, channels = pixels.shape
    colors = channels - has_alpha
    if as_stored and channels == 4 and pixels.dtype.kind == "u":
        return np.ascontiguousarray(pixels)
    integer = as_stored and pixels.dtype.kind == "u"
    picture = np.empty((height, width, 4), pixels.dtype if integer else np.float32)
    rows = max(_PIXELS_AT_ONCE // width, 1)
    for top in range(0, height, rows):
        part = pixels[top : top + rows]
        values = part if integer else scaled(part)
        into = picture[top : top + rows]
        for channel in range(3):  # one channel at a time takes a quarter of the time of three at once
            source = channel if colors > 1 else 0
            into[..., channel] = values[..., source] if source < colors else 0
        into[..., 3] = values[..., 3] if channels == 4 else values[..., 1] if has_alpha else opaque(picture.dtype)
    return picture


def _decode_npy(file: Path, data: bytes, max_bytes: int, as_stored: bool) -> tuple[Stored, bool]:
    """Return an array (h, w) or (h, w, 1 to 4) saved by NumPy; and True if it holds floats."""
    stream = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, by_columns, dtype = read_header(stream)
    except Exception as error:  # NumPy parses the header as Python text and raises errors of many kinds
        raise InputError(f"{file}: truncated or corrupt ({reason(error)}); make or copy the file again") from error
    if len(shape) not in (2, 3) or (len(shape) == 3 and shape[2] not in (1, 2, 3, 4)):
        raise InputError(f"{file}: has shape {shape}; expected (h, w) or (h, w, 1 to 4)")
    check_size(file, shape[1], shape[0], len(data), max_bytes)
    if dtype.kind != "f" and dtype.str[1:] not in ("u1", "u2"):
        raise InputError(f"{file}: has dtype {dtype}; expected float, uint8 or uint16")
    try:
        flat = np.frombuffer(data, dtype, prod(shape), stream.tell())
    except ValueError as error:
        raise InputError(f"{file}: truncated or corrupt ({error}); make or copy the file again") from error
    array = flat.reshape(shape, order="F" if by_columns else "C")
    array = array[..., None] if array.ndim == 2 else array
    with np.errstate(over="ignore"):  # a float64 beyond float32 becomes infinity, as in a float target
        native = array.astype(np.float32 if dtype.kind == "f" else dtype.newbyteorder("="), copy=False)
    return _as_rgba(native, native.shape[2] == 4, as_stored), dtype.kind == "f"


def save(
    path: str | os.PathLike[str],
    picture: object,
    *,
    linear: bool = False,
    like: str | os.PathLike[str] | Metadata | None = None,
    bits: int | None = None,
    color: ColorSpace | Recoded | str | None = None,
    raw: bool = False,
    layers_of: str | os.PathLike[str] | None = None,
) -> None:
    """Save a picture file atomically: an existing file stays until the new one is complete on the disk.

    The encoded file is held in memory; it has at most 1.3 times the bytes of the stored pixels.

    Parameters
    ----------
    path : the suffix chooses the format: 8-bit .png .jpg .jpeg .tif .tiff .webp .bmp .tga .pgm .ppm .pnm .jxl, 16-bit
        .dpx, float .exr .hdr .pfm .npy. ``out.exr:comp`` stores the picture as a layer, in the channels ``comp.R`` ...
    picture : (h, w) or (h, w, 1 | 2 | 3 | 4), row 0 on top: gray, gray and alpha, RGB, RGBA, with straight alpha.
        Floats are clipped to [0, 1] and rounded half to even for integer formats and written unchanged to float
        formats. uint8 and uint16 are stored as they are; float formats store them divided by 255 and 65535.
    linear : encode the colors of floats from linear light to sRGB for integer formats.
    like : a picture file to copy metadata from, as far as the format supports it: color tags, resolution,
        EXIF, time code; not size, orientation and thumbnail. If that file has no alpha and the picture is opaque, none
        is stored; if it is gray and the picture too, gray is stored. If that file has 16 bits, floats are stored in 16
        bits if the format supports it; else a warning is given. Between OpenEXR files color stays where alpha is 0: it
        is light that is added.
    bits : 8 or 16 for integers; 16 or 32 for floats, also in TIFF and JPEG XL (32). The default is the array's own for
        uint8, uint16 and float16, if the format supports it; in OpenEXR 16 if ``like`` is of half floats.
    color : the color space of the picture, for color tags: a Color Interop ID such as ``"lin_ap1_scene"``, or "" for
        no tags. By default the tags of ``like``, which are wrong for a picture that was converted. A warning is given
        for a format that cannot state it.
    raw : store numbers as they are: OpenEXR does not get color times alpha. With ``load(raw=True)`` every bit is kept.
    layers_of : an OpenEXR file that the picture was made of, ``shot.exr`` or ``shot.exr:diffuse``. The new file is a
        copy of it, in which the picture replaces the color, or the layer ``comp`` of ``out.exr:comp``, or is added as
        that. Other layers and parts, data window and attributes stay, bit for bit. ``like`` is this file if it is left
        out. The picture must have the size of the file's display window, with overscan or without. If it has another
        size, it is stored without the layers, with a warning.

    Raises
    ------
    InputError : unknown suffix, missing folder, unwritable path, unsupported shape or dtype, zero size, NaN in an
        integer format, transparency in a format without alpha, unsupported ``bits``.

    Examples
    --------
    >>> save("picture.abc", np.zeros((2, 2)))
    Traceback (most recent call last):
    passgraph.errors.InputError: picture.abc: unknown suffix '.abc'; expected one of .png .jpg .jpeg .tif ...
    """
    file, into = split_layer(arguments.path(path, "where a picture is saved"))
    arguments.flag(linear, f"{file}: linear", InputError)
    arguments.flag(raw, f"{file}: raw", InputError)
    kind = format_of_suffix(file)
    pixels = _checked(file, picture)
    kept = _kept_layers(file, kind, layers_of, into)
    metadata = _metadata(layers_of if like is None else like, kind, linear)
    if color is not None:
        metadata = metadata.in_space(_space(file, kind, color))
    asked_bits = bits
    if bits is None and metadata.deep and pixels.dtype.kind == "f" and not kind.is_float:
        if "uint16" in kind.dtypes:
            bits = 16
        else:
            warnings.warn(f"{file}: {fewer_bits(kind)}", stacklevel=2)
    if bits is None and metadata.half and kind.writer == "openexr":
        bits = 16
    dtype = _stored_dtype(file, pixels, kind, bits)
    is_multiplied = kind.associated and not raw and not metadata.numbers and pixels.shape[2] in (2, 4)
    # Straight color of half floats may be beyond their range, where alpha is small.
    values = _converted(file, pixels, np.dtype(np.float32) if is_multiplied or kept else dtype, linear)
    values = _fitting_channels(file, metadata.stored_channels(values), kind)
    if kind.name == "npy":
        _write(file, lambda temporary: _write_npy(temporary, values))
        return
    if is_multiplied and values.shape[2] in (2, 4):
        values = associated(values, additive=metadata.additive)
    place = None if kept is None else kept.place_of(values)
    if kept is not None and place is not None:
        converted = color is not None
        _write(
            file,
            lambda temporary: kept.write(file, temporary, values, place, asked_bits, metadata, converted=converted),
        )
        return
    if kept is not None:
        size = f"{values.shape[1]}×{values.shape[0]}"
        warnings.warn(
            f"{file}: is {size} pixels, and {kept.source} is not; its other layers are left out", stacklevel=2
        )
    with np.errstate(over="ignore"):  # values beyond the type's range become infinite, as in a float target
        values = values.astype(dtype, copy=False)
    _write(file, lambda temporary: write_image(file, temporary, values, kind, metadata, into))


def fits_layers(picture: Stored, layers_of: Path) -> bool:
    """Return True if a picture has a size with which it can be among the layers of an OpenEXR file."""
    source, layer = split_layer(layers_of)
    return KeptLayers(source, layer).place_of(picture) is not None


def _kept_layers(
    file: Path, kind: WritableFormat, layers_of: str | os.PathLike[str] | None, into: str | None
) -> KeptLayers | None:
    """Return what a picture is written into; None for a file of its own."""
    if kind.writer != "openexr" and (into is not None or layers_of is not None):
        raise InputError(f"{file}: {kind.name} has no layers; save as .exr")
    if layers_of is None:
        return None
    source, layer = split_layer(arguments.path(layers_of, f"{file}: layers_of"))
    if not is_exr(source):
        raise InputError(f"{file}: layers_of must be an OpenEXR file (.exr), got {source}; leave it out")
    check_regular(source, "a picture file")
    return KeptLayers(source, layer, into)


#: Display color of NaN: rare in pictures.
NAN_COLOR = (1.0, 0.0, 1.0)


def viewable(picture: Picture) -> tuple[Picture, str]:
    """Return gray or RGB in [0, 1], and a description of the mapping.

    Colors within [0, 1] are shown unchanged.  Other colors, and single channels such as depth, are scaled from their
    smallest to their largest value.  Alpha is ignored, since data in it would hide the picture; NaN is magenta.

    >>> viewable(np.array([[[2.0], [4.0]]], np.float32))[1]
    'black is 2, white is 4'
    """
    channels = picture.shape[2]
    colours = picture[:, :, : 1 if channels == 1 else 3]
    if channels == 2:
        colours = np.concatenate([colours, np.zeros_like(colours[:, :, :1])], axis=2)
    finite = colours[np.isfinite(colours)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    shown = "as stored"
    if low < 0.0 or high > 1.0 or channels == 1:
        shown = f"black is {low:.6g}, white is {high:.6g}"
        colours = ((colours.astype(np.float64) - low) / max(high - low, 1e-30)).astype(np.float32)
    missing = np.isnan(colours).any(axis=2)
    view = np.clip(np.nan_to_num(colours, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0).astype(np.float32)
    if missing.any():
        view = np.broadcast_to(view, (*view.shape[:2], 3)).copy()
        view[missing] = NAN_COLOR
        shown += f", {int(missing.sum())} pixels are NaN (magenta)"
    return view, shown


def encode_png(file: Path, pixels: Stored, metadata: Metadata | None = None) -> bytes:
    """Return uint8 or uint16 pixels as PNG bytes; ``file`` is the name in messages."""
    try:
        with encoded_image(file, pixels, WRITABLE[".png"], metadata or Metadata()) as content:
            return content.read()
    except OSError as error:
        raise unwritable(file, error) from error


def format_of_suffix(file: Path) -> WritableFormat:
    """Return the format for a file name's suffix."""
    kind = WRITABLE.get(file.suffix.lower())
    if kind is None:
        raise InputError(f"{file}: unknown suffix '{file.suffix}'; expected one of {' '.join(WRITABLE)}")
    return kind


def check_holds_bits(file: Path, bits: int) -> np.dtype[Any]:
    """Return the dtype for a file name's suffix and a number of bits per channel.

    Raises
    ------
    InputError : the format does not support that many bits.
    """
    kind = format_of_suffix(file)
    found = [np.dtype(name) for name in kind.dtypes if np.dtype(name).itemsize * 8 == bits]
    if not found:
        bit_depths = " or ".join(
            dict.fromkeys(f"{np.dtype(name).itemsize * 8}-bit {np.dtype(name).name}" for name in kind.dtypes)
        )
        raise InputError(
            f"{file}: {kind.name} holds {bit_depths}, not {bits} bits; choose another suffix or other bits"
        )
    return found[0]


def fewer_bits(kind: WritableFormat) -> str:
    """Return the warning for saving a 16-bit picture in an 8-bit format."""
    return f"{kind.name} holds 8 bits a channel, and the source has 16; to keep them, save as .png or .tif"


def _metadata(like: str | os.PathLike[str] | Metadata | None, kind: WritableFormat, linear: bool) -> Metadata:
    """Return the metadata of ``like``, with the color tags that a picture made of that file has in a format.

    A file's color tags say what its pixels are as stored. They do not hold for light that is encoded, and may not hold
    for floats that were made of codes, which may be decoded.
    """
    if like is None or isinstance(like, Metadata):
        return like or Metadata()
    found = metadata_of(arguments.path(like, "the picture to copy metadata from"))
    was_light = ColorSpace("", found.space).transfer == "lin" or found.get("chromaticities") is not None
    if was_light and linear and not kind.is_float:
        return found.in_space(Recoded("srgb"))
    return found.in_space(ColorSpace("")) if found.space and kind.is_float and not was_light else found


def _space(file: Path, kind: WritableFormat, color: ColorSpace | Recoded | str) -> ColorSpace | Recoded:
    """Return a color space by its ID, with a warning if the format cannot state it; the command warns about others."""
    if isinstance(color, (ColorSpace, Recoded)):
        return color
    space = ColorSpace(color, arguments.string(color, f"{file}: color"))
    if color and (loss := unstated(kind, space)):
        warnings.warn(f"{file}: {loss}", stacklevel=3)
    return space


def _stored_dtype(file: Path, pixels: Stored, kind: WritableFormat, bits: int | None) -> np.dtype[Any]:
    if bits is not None:
        return check_holds_bits(file, arguments.whole_number(bits, f"{file}: bits", 8, 32, InputError))
    if pixels.dtype.name in kind.dtypes and pixels.dtype != np.float32:
        return pixels.dtype
    if pixels.dtype == np.uint16 and not kind.is_float:
        check_holds_bits(file, 16)
    return np.dtype(kind.dtypes[0])


def _converted(file: Path, pixels: Stored, dtype: np.dtype[Any], linear: bool) -> Stored:
    """Convert pixels to the dtype to store."""
    if linear and dtype.kind == "u":
        if pixels.dtype.kind == "u":
            raise InputError(
                f"{file}: {pixels.dtype} with linear=True; expected floats (integers of linear light band)"
            )
        check_no_nan(pixels, str(file))
        pixels = np.clip(pixels, 0, 1).astype(np.float32)
        colors = 3 if pixels.shape[2] > 2 else 1
        pixels[..., :colors] = linear_to_srgb(pixels[..., :colors])
    if pixels.dtype == dtype:
        return np.ascontiguousarray(pixels)
    if dtype.kind == "u":
        return integers_of(scaled(pixels) if pixels.dtype.kind == "u" else pixels, dtype, str(file))
    with np.errstate(over="ignore"):  # values beyond the type's range become infinite, as in a float target
        return scaled(pixels).astype(dtype) if pixels.dtype.kind == "u" else pixels.astype(dtype)


def _fitting_channels(file: Path, pixels: Stored, kind: WritableFormat) -> Stored:
    """Adapt the number of channels to the format: repeat gray, drop opaque alpha."""
    channels = pixels.shape[2]
    if channels in kind.channels:
        return pixels
    if channels in (2, 4) and not {2, 4} & set(kind.channels):
        if not is_opaque(pixels[..., -1]):
            raise InputError(
                f"{file}: {kind.name} has no transparency; save as .png, or pass picture[..., :{channels - 1}]"
            )
        return _fitting_channels(file, np.ascontiguousarray(pixels[..., :-1]), kind)
    if channels > 2 and (pixels == pixels[..., :1]).all():
        return np.ascontiguousarray(pixels[..., :1])
    if channels > 2:
        raise InputError(f"{file}: {kind.name} holds gray, got {channels} channels; save as .ppm or .png")
    return np.ascontiguousarray(pixels[..., [0, 0, 0, *range(1, channels)]])


def _checked(file: Path, picture: object) -> NDArray[Any]:
    """Return the picture as (h, w, 1 | 2 | 3 | 4) of floats, uint8 or uint16."""
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


def _write_npy(temporary: Path, values: Stored) -> None:
    """Write a C-contiguous array; `numpy.save` (2.4) ignores that the last bytes of a file cannot be written."""
    with temporary.open("xb") as stream:
        np.lib.format.write_array_header_1_0(stream, np.lib.format.header_data_from_array_1_0(values))
        stream.write(values.data)


def _write(file: Path, write_to: Callable[[Path], None]) -> None:
    """Write a file under a temporary name in the same folder, then rename it in one step."""
    with NewFile(file) as new_file:
        write_to(new_file.temporary)
        new_file.complete()
