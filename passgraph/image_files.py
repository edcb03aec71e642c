"""Read image files with OpenImageIO: pixels as stored, layers, alpha association and metadata.

`passgraph.pictures` is the public interface.
"""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from passgraph.color_tags import LINEAR, SRGB, space_of_codes
from passgraph.errors import InputError
from passgraph.gain_map import HDR, GainMapFile, base_picture, declares_gain_map, gain_map_of
from passgraph.image_formats import EXPECTED, NO_TAGS, READABLE, Metadata, Pixels
from passgraph.image_layers import Part, find_channels
from passgraph.misread import mending_of
from passgraph.writing import temporary_folder

if TYPE_CHECKING:
    import OpenImageIO as oiio

#: Most memory that loading a picture may take by default: some 200 million pixels.
MAX_BYTES = 1 << 32
#: Bits of TIFF's tag NewSubfileType (TIFF 6.0, page 36).
_REDUCED, _MASK = 1, 4
#: What is said of a stack.
FIRST_OF_SEVERAL = "holds several pictures; the first is read. Read the others with tifffile, and pass arrays"
#: GIF, JPEG 2000 and JPEG XL, by what files begin with: OpenImageIO decodes them when it opens them. That takes up to
#: four times the size of the pixels.
_DECODED_WHEN_OPENED = (b"GIF8", b"\0\0\0\x0c", b"\xff\x4f\xff\x51", b"\xff\x0a")
#: JPEG XL with and without its container, and the number of bytes by which OpenImageIO recognizes it.
_JPEG_XL, _RECOGNIZED_BYTES = (b"\0\0\0\x0cJXL ", b"\xff\x0a"), 128
#: Cameras write extra bytes between the markers of JPEG; the picture is complete nevertheless.
_EXTRA_BYTES = "extraneous bytes"
_CRYPTOMATTE_NAME = re.compile(r"cryptomatte/[0-9a-f]+/name")
_JPEG = b"\xff\xd8\xff"
#: First bytes of files of the common formats.
_SIGNATURES = (
    b"\x89PNG",
    b"\xff\xd8\xff",
    b"II*\0",
    b"MM\0*",
    b"II+\0",
    b"MM\0+",
    b"\x76\x2f\x31\x01",
    b"RIFF",
    b"GIF8",
)
#: Formats whose files hold color multiplied by alpha, unless a file says otherwise.
_ASSOCIATED = ("openexr", "tiff", "iff", "rla")
#: Bytes per pixel that a reader allocates in addition to its result: whole decoded pictures, strips, coefficients of
#: progressive JPEG (three int16 and their copies).
_HELD_BY_READER = {"jpeg": 12, "webp": 16, "gif": 12, "tiff": 12, "jpegxl": 48, "jpeg2000": 36, "psd": 16}
_TYPES = {"uint8": np.uint8, "uint16": np.uint16, "half": np.float16, "float": np.float32, "double": np.float32}
#: Metadata about the source file, not the picture.
_OF_THE_FILE = (
    "oiio:", "jpeg:", "png:", "tiff:", "openexr:", "dpx:", "webp:", "bmp:", "gif:", "targa:", "pnm:", "psd:", "dds:",
    "hdrgm:", "Container:", "compression", "planarconfig", "thumbnail", "ICCProfile:", "screenWindow", "colorInteropID",
    "Exif:ColorSpace", "Exif:YCbCrPositioning", "textureformat", "wrapmodes", "worldto", "name", "view", "chunkCount",
)  # fmt: skip
#: Formats whose files state a color space other than by a profile.
_STATING = ("png", "dpx")
#: Size and orientation (EXIF 2.32) are not copied: pixels are stored upright, at a size of their own.
_SIZE_AND_ORIENTATION = (
    "Orientation", "Exif:PixelXDimension", "Exif:PixelYDimension", "Exif:ImageWidth", "Exif:ImageLength"
)  # fmt: skip


class Window(NamedTuple):
    """A rectangle of pixels, in the coordinates of an OpenEXR file."""

    x: int
    y: int
    width: int
    height: int

    def joined(self, other: Window) -> Window:
        """Return the smallest window around two.

        >>> Window(0, 0, 4, 4).joined(Window(-1, 1, 2, 5))
        Window(x=-1, y=0, width=5, height=6)
        """
        x, y = min(self.x, other.x), min(self.y, other.y)
        right, bottom = (
            max(self.x + self.width, other.x + other.width),
            max(self.y + self.height, other.y + other.height),
        )
        return Window(x, y, right - x, bottom - y)


@contextmanager
def name_of(file: Path, data: bytes | None = None) -> Iterator[str]:
    """Yield a name under which OpenImageIO, which reads UTF-8 names and no memory, can open a file or bytes."""
    text = os.fspath(file)
    if data is None and text.isascii():
        yield text
        return
    try:
        text.encode()
        writable = data is None
    except UnicodeEncodeError:
        writable = False
    if writable:
        yield text
        return
    with temporary_folder() as folder:
        # No suffix: OpenImageIO detects the format from the content.
        other = os.path.join(folder, "picture")
        if data is None:
            os.symlink(os.path.abspath(text), other)
        else:
            Path(other).write_bytes(data)
        yield other


def error_of(source: Any) -> str:
    """Return and clear the pending error of OpenImageIO, or of one of its readers; empty if there is none.

    Errors quote names in the file, which may be no UTF-8.
    """
    try:
        return str(source.geterror())
    except UnicodeDecodeError as error:
        return error.object.decode(errors="replace")


class ImageFile:
    """An open picture file, or one layer of it. The header is read; the pixels are not.

    Attributes
    ----------
    width, height : pixels as stored, before orientation is applied; for OpenEXR those of the window
    window : what is read of OpenEXR: the display window, with ``overscan`` the data window too
    dtype : uint8, uint16, float16 or float32
    channels : number of channels that are read: 1 (gray), 2, 3 or 4
    has_alpha : the last of them is alpha; two channels without it are data, such as motion
    held : bytes that reading needs in addition to the result
    orientation : EXIF orientation, 1 for upright
    count : pictures in the file
    input, subimage, spec, order : OpenImageIO's reader, the part of the file, its specification, and the channels that
        are read

    Raises
    ------
    InputError : unknown format, broken header, unsupported types or channels, or no such layer.
    """

    def __init__(
        self, file: Path, name: str, layer: str | None = None, max_bytes: int = MAX_BYTES, *, overscan: bool = False
    ) -> None:
        import OpenImageIO as oiio

        self._file, self._oiio = file, oiio
        hint = oiio.ImageSpec()
        hint.attribute("oiio:UnassociatedAlpha", 1)
        try:
            with _SIZE_LIMIT.limited_to(_megabytes(name, max_bytes)):
                opened = oiio.ImageInput.open(name, hint)
                problem = error_of(oiio)
        except UnicodeDecodeError as error:
            raise self.corrupt(error) from error
        if opened is None or opened.format_name() not in READABLE:
            raise self._unreadable(name, problem)
        self.input, self.format = opened, opened.format_name()
        try:
            self._choose_channels(layer)
        except UnicodeDecodeError as error:
            raise self.corrupt(error) from error
        spec = self.spec
        if spec.deep or spec.depth > 1:
            raise InputError(f"{file}: holds {'deep samples' if spec.deep else 'a volume'}; expected a flat picture")
        self._mending = mending = mending_of(file, name, opened)
        if mending.order is not None:
            self.order = mending.order
        if mending.has_alpha is not None:
            self.has_alpha = mending.has_alpha
        if not self.order:
            raise self.corrupt("it has no channels")
        self.channels = len(self.order)
        self.dtype = self._dtype() if mending.dtype is None else mending.dtype
        self._windowed = self.format == "openexr"
        data = Window(spec.x, spec.y, spec.width, spec.height)
        display = Window(spec.full_x, spec.full_y, spec.full_width, spec.full_height)
        self.window = data if not self._windowed else display.joined(data) if overscan else display
        self.width, self.height = self.window.width, self.window.height
        self.orientation = int(_attribute(spec, "Orientation", 1))
        first, last = min(self.order), max(self.order)
        stored_bytes = spec.width * spec.height * (last - first + 1) * self.dtype.itemsize
        tile = 8 * spec.tile_width * spec.tile_height * spec.nchannels
        by_reader = max(_HELD_BY_READER.get(self.format, 0), mending.held)
        self.held = stored_bytes + spec.width * spec.height * by_reader + tile

    def _dtype(self) -> np.dtype[Any]:
        stored = {str(self.spec.channelformat(channel)) for channel in self.order}
        kinds = [_TYPES.get(kind) for kind in sorted(stored)]
        if None in kinds:
            named = ", ".join(sorted(stored))
            raise InputError(
                f"{self._file}: holds {named}; expected 8 or 16 bits without sign, or floats; convert it, for example "
                "to an RGB PNG or a float TIFF"
            )
        return np.dtype(np.result_type(*kinds))

    @property
    def data_size(self) -> tuple[int, int]:
        """Return the width and height of the stored pixels; an OpenEXR data window may exceed the display window."""
        return self.spec.width, self.spec.height

    @property
    def has_second(self) -> bool:
        """Return True if a second picture follows that is neither a smaller copy nor a mask of the first (TIFF)."""
        found = self.input.seek_subimage(1, 0)
        found = found and not _attribute(self.input.spec(), "tiff:subfiletype", 0) & (_REDUCED | _MASK)
        self.input.seek_subimage(self.subimage, 0)
        error_of(self.input)
        return found

    @property
    def is_associated(self) -> bool:
        """Return True if color is stored multiplied by alpha."""
        if self._mending.associated is not None:
            return self._mending.associated and self.has_alpha
        said = _attribute(self.spec, "oiio:UnassociatedAlpha", 0)
        return self.format in _ASSOCIATED and not said and self.has_alpha

    @property
    def encoding(self) -> str:
        """Return the color space named by the file or its format; "" if none is named."""
        return str(_attribute(self.spec, "oiio:ColorSpace", ""))

    def metadata(self) -> Metadata:
        entries = tuple(
            (entry.name, str(entry.type), entry.value)
            for entry in self.spec.extra_attribs
            if not entry.name.startswith(_OF_THE_FILE) and entry.name not in _SIZE_AND_ORIENTATION
        )
        is_numbers = self.channels == 4 and not self.has_alpha
        found = Metadata(
            entries, not self.has_alpha, self.dtype == np.uint16, self._stated_space(), self.is_associated, is_numbers,
            self.dtype == np.float16,
            gray=self.channels - self.has_alpha == 1,
        )  # fmt: skip
        # ICC.1:2022, section 7.2.6: the color space of the data; the result is RGB.
        if found.profile and found.profile[16:20] != b"RGB ":
            return replace(found, entries=tuple(entry for entry in entries if entry[0] != "ICCProfile"))
        return found

    def _stated_space(self) -> str:
        """Return the color space in the file's own words; "" for what OpenImageIO assumes of its format."""
        if self.format == "openexr":
            return str(_attribute(self.spec, "colorInteropID", ""))
        if (codes := _attribute(self.spec, "CICP", None)) is not None:
            found = space_of_codes(*codes[:2]) or NO_TAGS
        else:
            found = self.encoding if self.format in _STATING else ""
        return "" if found == SRGB else found

    def read(self) -> Pixels:
        """Return (height, width, channels) as stored, in the display window; pixels outside the data window are 0."""
        if self._mending.decode is not None:
            return self._mending.decode()[..., self.order]
        return self._read_as(self.dtype)

    def _read_as(self, dtype: np.dtype[Any]) -> Pixels:
        spec, first, last = self.spec, min(self.order), max(self.order)
        kind = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}[dtype.name]
        pixels: Any = self.input.read_image(self.subimage, 0, first, last + 1, kind)
        problem = error_of(self.input) or error_of(self._oiio)
        if pixels is None or (problem and _EXTRA_BYTES not in problem):
            raise self.corrupt(problem)
        pixels = pixels.reshape(spec.height, spec.width, last - first + 1)
        order = [channel - first for channel in self.order]
        if order != list(range(pixels.shape[2])):
            pixels = pixels[..., order]
        if self._mending.adjust is not None:
            pixels = self._mending.adjust(pixels)
        return _in_window(self.window, Window(spec.x, spec.y, spec.width, spec.height), pixels)

    def read_part(self, part: tuple[int, int, int, int], channels: range, kind: str) -> Pixels:
        """Return rows and columns of the data window, in the file's coordinates, of channels side by side (OpenEXR)."""
        spec = self.spec
        y0, y1 = _whole_blocks(part[:2], spec.y, spec.height, spec.tile_height or 1)
        x0, x1 = _whole_blocks(part[2:], spec.x, spec.width, spec.tile_width or spec.width)
        first, last = channels.start, channels.stop
        if spec.tile_width:
            read: Any = self.input.read_tiles(self.subimage, 0, x0, x1, y0, y1, 0, 1, first, last, kind)
        else:
            read = self.input.read_scanlines(self.subimage, 0, y0, y1, 0, first, last, kind)
        problem = error_of(self.input)
        if read is None or problem:
            raise self.corrupt(problem)
        stored: Pixels = read.reshape(y1 - y0, x1 - x0, last - first)
        return stored[part[0] - y0 : part[1] - y0, part[2] - x0 : part[3] - x0]

    def close(self) -> None:
        self.input.close()

    def _choose_channels(self, layer: str | None) -> None:
        specs, has_layers = list[Any](), self.format == "openexr"
        # Of other formats' parts, such as pages, the first is read.
        while (has_layers or not specs) and self.input.seek_subimage(len(specs), 0):
            specs.append(self.input.spec())
            if len(specs) == 1 and (problem := error_of(self.input)) and _EXTRA_BYTES not in problem:
                raise self.corrupt(problem)
        error_of(self.input)  # there is no further part
        found = find_channels(self._file, [_part(spec) for spec in specs], layer, has_layers=has_layers)
        self.input.seek_subimage(found.part, 0)
        self.subimage, self.spec = found.part, specs[found.part]
        self.order, self.has_alpha = found.order, found.has_alpha
        if _attribute(self.spec, "textureformat", "") == "CubeFace Environment":
            # Of mip-mapped cubes OpenImageIO (3.2.2, exrinput.cpp) calls one of six faces the display window.
            self.spec.full_x, self.spec.full_y = self.spec.x, self.spec.y
            self.spec.full_width, self.spec.full_height = self.spec.width, self.spec.height

    def _unreadable(self, name: str, problem: str) -> InputError:
        if "MB limit" in problem:
            problem, _, _ = problem.partition("Possible")
            return InputError(f"{self._file}: {_one_line(problem)} make it smaller, or raise max_bytes if it is meant")
        with open(name, "rb") as stream:
            head = stream.read(8)
        if head.startswith(_SIGNATURES):
            return self.corrupt(problem)
        size = os.stat(name).st_size
        reason = f" ({_one_line(problem)})" if problem else ""
        return InputError(
            f"{self._file}: not a picture that can be read, or corrupt{reason}; expected {EXPECTED},"
            f" got {size} bytes that begin with {head!r}"
        )

    def corrupt(self, reason: object) -> InputError:
        text = _one_line(reason) or "no pixels"
        if "Subsampled channels" in text:
            return InputError(
                f"{self._file}: has channels with fewer samples than pixels, such as luminance and chroma; expected "
                "one sample a pixel; save it as RGB"
            )
        if "not configured" in text:
            return InputError(
                f"{self._file}: is compressed in a way that is not read ({text}); save it with ZIP or LZW"
            )
        return InputError(f"{self._file}: truncated or corrupt ({text}); make or copy the file again")


def _megabytes(name: str, max_bytes: int) -> int | None:
    """Return the most megabytes of pixels for a file that is decoded when it is opened; None for other files."""
    with open(name, "rb") as stream:
        decoded = stream.read(4).startswith(_DECODED_WHEN_OPENED)
    return -(-max_bytes // (4 << 20)) if decoded else None


class _SizeLimit:
    """OpenImageIO's limit for the size of pictures, one for the process; threads with equal limits share it."""

    _NAME = "limits:imagesize_MB"

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._openings = 0
        self._limit: int | None = None

    @contextmanager
    def limited_to(self, megabytes: int | None) -> Iterator[None]:
        """Open files with a limit; None for OpenImageIO's own."""
        import OpenImageIO as oiio

        with self._changed:
            self._changed.wait_for(lambda: not self._openings or self._limit == megabytes)
            if not self._openings:
                self._limit, self._own = megabytes, oiio.get_int_attribute(self._NAME)
                oiio.attribute(self._NAME, self._own if megabytes is None else megabytes)
            self._openings += 1
        try:
            yield
        finally:
            with self._changed:
                self._openings -= 1
                if not self._openings:
                    oiio.attribute(self._NAME, self._own)
                    self._changed.notify_all()


_SIZE_LIMIT = _SizeLimit()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_SIZE_LIMIT.__init__)  # type: ignore[misc]


class HdrRendition(ImageFile):
    """The HDR rendition of a JPEG file with a gain map: linear light as float32, where 1 is white of the base picture.

    Its metadata states the ``hdrHeadroom``: the brightest white, relative to that of the base picture.
    """

    def __init__(self, file: Path, name: str, parts: GainMapFile, max_bytes: int) -> None:
        super().__init__(file, name, None, max_bytes)
        self._parts, self._max_bytes = parts, max_bytes
        with opened_image(file, parts.gains, max_bytes=max_bytes) as gains:
            columns, rows, held = gains.width, gains.height, gains.held
        if rows * columns > max(self.width * self.height, 1):
            raise self.corrupt(f"a gain map of {columns}×{rows} pixels for {self.width}×{self.height}")
        # The base picture, the map in bands, and both converted to floats.
        self.dtype, self.held = np.dtype(np.float32), self.held + 2 * held + 32 * self.width * self.height
        self.order = [0, 0, 0] if self.channels == 1 else self.order
        self.channels = 3

    def read(self) -> Pixels:
        """Return linear light (height, width, 3)."""
        base = self._read_as(np.dtype(np.uint8))
        with opened_image(self._file, self._parts.gains, max_bytes=self._max_bytes) as gains:
            return self._parts.gain.applied(base, gains.read())

    def metadata(self) -> Metadata:
        """Return the metadata of the base picture, but for its color encoding; and ``hdrHeadroom``."""
        metadata = super().metadata()
        kept = tuple(entry for entry in metadata.entries if entry[0] != "ICCProfile")
        # A profile's primaries have no name here.
        space = "" if metadata.profile else LINEAR
        entries = (*kept, ("hdrHeadroom", "float", 2.0**self._parts.gain.headroom))
        return replace(metadata, entries=entries, space=space)


def _as_decoded(file: Path, data: bytes | None, layer: str | None) -> tuple[bytes | None, GainMapFile | None]:
    """Return the bytes for OpenImageIO in place of a file's content, None for as they are; and the parts of ``:hdr``.

    Tiny JPEG XL files are lengthened, since OpenImageIO 3.2 does not recognize them; zeros behind a picture are
    ignored. Of a JPEG with a gain map it gets the base picture alone: it would return the HDR rendition, as half floats
    that it calls sRGB, and no option turns that off (3.2.2, jpeginput.cpp).
    """
    with file.open("rb") if data is None else BytesIO(data) as stream:
        head = stream.read(_RECOGNIZED_BYTES)
        if head.startswith(_JPEG_XL) and len(head) < _RECOGNIZED_BYTES:
            return head.ljust(_RECOGNIZED_BYTES, b"\0"), None
        stream.seek(0)
        if not head.startswith(_JPEG) or not declares_gain_map(stream):
            return data, None
        stream.seek(0)
        content = stream.read()
    if layer != HDR:
        return base_picture(content), None
    try:
        parts = gain_map_of(content)
    except ValueError as error:
        raise InputError(f"{file}:{HDR}: {error}; read {file} without :{HDR}") from error
    return parts.base, parts


@contextmanager
def opened_image(
    file: Path,
    data: bytes | None = None,
    layer: str | None = None,
    max_bytes: int = MAX_BYTES,
    *,
    overscan: bool = False,
) -> Iterator[ImageFile]:
    """Open an `ImageFile`, closed at the end; ``data`` is the file's content if it is not on disk."""
    content, parts = _as_decoded(file, data, layer)
    with name_of(file, content) as name:
        image = (
            ImageFile(file, name, layer, max_bytes, overscan=overscan)
            if parts is None
            else HdrRendition(file, name, parts, max_bytes)
        )
        try:
            yield image
        finally:
            image.close()


def straight(pixels: Pixels) -> Pixels:
    """Divide the color of (h, w, 2 or 4) by alpha; color stays where alpha is 0.

    Integers keep their dtype, floats become float32: half floats would overflow and round where alpha is small.

    >>> straight(np.array([[[0.25, 0.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.0]]], np.float16)).tolist()
    [[[0.5, 0.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.0]]]
    """
    alpha = pixels[..., -1:].astype(np.float32)
    if pixels.dtype.kind == "u":
        alpha /= np.float32(np.iinfo(pixels.dtype).max)
    result = pixels.astype(np.float32)
    with np.errstate(all="ignore"):  # infinite colors and alpha follow IEEE 754
        result[..., :-1] /= np.where(alpha == 0, np.float32(1), alpha)
        if pixels.dtype.kind == "u":
            return np.rint(np.clip(result, 0, np.iinfo(pixels.dtype).max)).astype(pixels.dtype)
    return result


def associated(pixels: Pixels, *, additive: bool = False) -> Pixels:
    """Multiply the color of (h, w, 2 or 4) floats by alpha.

    Color is 0 where alpha is 0. If ``additive`` it stays there: it is light that is added, such as a flame's.

    >>> associated(np.array([[[0.5, 0.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.0]]], np.float32)).tolist()
    [[[0.25, 0.0, 0.0, 0.5], [0.0, 0.0, 0.0, 0.0]]]
    """
    result = pixels.copy()
    colors, alpha = pixels[..., :-1], pixels[..., -1:]
    with np.errstate(all="ignore"):
        result[..., :-1] = np.where(alpha == 0, colors if additive else 0, colors * alpha)  # 0 × infinity too
    return result


Turn = Callable[[Pixels], Pixels]
#: EXIF 2.32, tag 0x0112: the operations that undo the camera's orientation.
_TURNS: dict[int, Turn] = {
    2: lambda a: a[:, ::-1],
    3: lambda a: a[::-1, ::-1],
    4: lambda a: a[::-1],
    5: lambda a: a.swapaxes(0, 1),
    6: lambda a: a.swapaxes(0, 1)[:, ::-1],
    7: lambda a: a[::-1, ::-1].swapaxes(0, 1),
    8: lambda a: a.swapaxes(0, 1)[::-1],
}


def upright(pixels: Pixels, orientation: int) -> Pixels:
    """Return a view of the pixels in display orientation, given their EXIF orientation."""
    return _TURNS[orientation](pixels) if orientation in _TURNS else pixels


def _in_window(window: Window, data: Window, pixels: Pixels) -> Pixels:
    """Crop or pad the data window's pixels to another window."""
    if window == data:
        return pixels
    found = np.zeros((window.height, window.width, pixels.shape[2]), pixels.dtype)
    paste(found, (window.y, window.x), pixels, (data.y, data.x))
    return found


def _whole_blocks(span: tuple[int, int], begin: int, length: int, block: int) -> tuple[int, int]:
    """Return a span widened to whole blocks, which begin at ``begin``.

    >>> _whole_blocks((5, 9), 1, 20, 4), _whole_blocks((18, 19), 1, 20, 4)
    ((5, 9), (17, 21))
    """
    first, last = (span[0] - begin) // block * block, -(-(span[1] - begin) // block) * block
    return begin + first, begin + min(last, length)


def paste(target: Pixels, target_at: tuple[int, int], source: Pixels, source_at: tuple[int, int]) -> int:
    """Copy the pixels that two parts of a picture share, and return how many; parts begin at a row and a column.

    >>> row = np.zeros((1, 4), int)
    >>> paste(row, (0, 2), np.ones((3, 3), int), (-1, 0)), row.tolist()
    (1, [[1, 0, 0, 0]])
    """
    (top, left), (y, x) = target_at, source_at
    y0, y1 = max(top, y), min(top + target.shape[0], y + source.shape[0])
    x0, x1 = max(left, x), min(left + target.shape[1], x + source.shape[1])
    if y0 >= y1 or x0 >= x1:
        return 0
    target[y0 - top : y1 - top, x0 - left : x1 - left] = source[y0 - y : y1 - y, x0 - x : x1 - x]
    return int((y1 - y0) * (x1 - x0))


def _part(spec: oiio.ImageSpec) -> Part:
    """Return a part's names; Cryptomatte's, in attributes cryptomatte/NUMBER/name, are of layers without color."""
    cryptomattes = [str(entry.value) for entry in spec.extra_attribs if _CRYPTOMATTE_NAME.fullmatch(entry.name)]
    layers = {name.rpartition(".")[0] for name in spec.channelnames}
    # Two digits are added to the name: the rank of the objects.
    ranked = {layer for layer in layers if layer[:-2] in cryptomattes}
    name, view = (str(_attribute(spec, key, "")) for key in ("oiio:subimagename", "view"))
    return Part(name, spec.channelnames, view, {*cryptomattes, *ranked})


def _attribute(spec: oiio.ImageSpec, name: str, default: Any) -> Any:
    value = spec.getattribute(name)
    return default if value is None else value


def _one_line(reason: object) -> str:
    return " ".join(str(reason).split())
