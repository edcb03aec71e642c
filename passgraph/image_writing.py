"""Write image files with OpenImageIO, so that a file is complete or an error is raised.

OpenImageIO 3.2.2 does not report all failed writes: its `IOFile::close` ignores the result of `fclose`, so `close()`
returns True although the last block is missing (src/libutil/filesystem.cpp).  libjpeg's default error handler ends the
process (`error_exit` in jerror.c).  So no file system that can be full is between the library and its bytes: it encodes
into memory, and Python copies the result to the file, where each error is raised.

The encoded file takes memory: at most 1.3 times the pixels as they are stored.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
import struct
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from passgraph.errors import InputError
from passgraph.image_files import error_of, opened_image
from passgraph.image_formats import Metadata, Pixels, WritableFormat
from passgraph.writing import temporary_folder

if TYPE_CHECKING:
    import OpenImageIO as oiio

#: Most bytes of an encoded file: per byte of the pixels (noise takes up to 1.3 as half TIFF), and besides metadata.
_MOST_ENCODED, _MOST_HEADER = 2, 1 << 20
#: Errors of the system that OpenImageIO has as text only.
_SYSTEM_ERRORS = (
    errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EMFILE, errno.ENFILE, errno.EIO, errno.EROFS, errno.EACCES
)  # fmt: skip
#: Formats that store exactly the pixels that are written, with these settings.
_EXACT = ("png", "tiff", "openexr", "bmp", "targa", "pnm", "dpx", "webp")
#: Types of metadata that OpenImageIO 3.2.2 drops when Python sets them, without an error, and what holds their numbers.
_STORED_AS = {"int8": "int", "int16": "int", "uint16": "int", "half": "float", "double": "float"}
_BASE_TYPE = re.compile(r"(\w+)(.*)", re.DOTALL)
#: Last bytes of formats whose readers accept files without them (PNG 1.2, section 3.4; ITU-T T.81, B.1.1.3).
_ENDS = {"png": b"IEND\xaeB`\x82", "jpeg": b"\xff\xd9"}


def write_image(
    file: Path, to: Path, pixels: Pixels, kind: WritableFormat, metadata: Metadata, layer: str | None = None
) -> None:
    """Write pixels with a dtype and channel count that the format supports; ``file`` is the name in messages.

    ``layer`` is the channels' layer in OpenEXR.

    Raises
    ------
    InputError : the format cannot store them.
    OSError : the path exists or cannot be written.
    """
    with to.open("xb") as stream, encoded_image(file, pixels, kind, metadata, layer) as content:
        shutil.copyfileobj(content, stream, 1 << 20)


@contextmanager
def encoded_image(
    file: Path, pixels: Pixels, kind: WritableFormat, metadata: Metadata, layer: str | None = None
) -> Iterator[BinaryIO]:
    """Yield the encoded file as a stream; parameters and errors are those of `write_image`."""
    height, width = pixels.shape[:2]
    if max(width, height) > kind.largest:
        raise InputError(f"{file}: {kind.name} cannot hold {width}×{height} pixels; save as .png or .exr")
    spec = image_spec(pixels.shape, pixels.dtype, metadata, kind.writer)
    if layer is not None:
        spec.channelnames = tuple(f"{layer}.{name}" for name in spec.channelnames)
    if not kind.associated:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    for name, value in kind.attributes:
        spec.attribute(name, value)
    header = _MOST_HEADER + sum(np.asarray(value).nbytes for _, _, value in metadata.attributes_for(kind.writer))
    with _scratch_file(_MOST_ENCODED * pixels.nbytes + header) as (path, is_memory):
        _encode(file, path, spec, pixels, kind)
        if kind.writer == "bmp" and pixels.shape[2] == 4:
            path.write_bytes(_with_alpha_mask(path.read_bytes()))
        if not is_memory:
            _check_complete(file, path, pixels, kind)
        with path.open("rb") as stream:
            yield stream


def image_spec(shape: tuple[int, ...], dtype: np.dtype[Any], metadata: Metadata, writer: str) -> oiio.ImageSpec:
    """Return OpenImageIO's specification of a (height, width, channels) picture."""
    import OpenImageIO as oiio

    height, width, channels = shape
    names = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}
    spec = oiio.ImageSpec(width, height, channels, names[dtype.name])
    if channels == 2:
        spec.channelnames, spec.alpha_channel = ("Y", "A"), 1
    for name, type_, value in metadata.attributes_for(writer):
        base, count = _BASE_TYPE.fullmatch(type_).groups()  # type: ignore[union-attr]
        spec.attribute(name, _STORED_AS.get(base, base) + count, value)
    return spec


def _encode(file: Path, path: Path, spec: oiio.ImageSpec, pixels: Pixels, kind: WritableFormat) -> None:
    import OpenImageIO as oiio

    output = created_output(kind.writer)
    done = output is not None and output.open(os.fspath(path), spec)
    done = done and output.write_image(np.ascontiguousarray(pixels))
    problem = error_of(oiio if output is None else output)
    if output is not None:
        done = output.close() and done
        problem = problem or error_of(output)
    if not done:
        check_system_error(problem, file)
        reason = f"{kind.name} cannot hold {'×'.join(map(str, pixels.shape))} {pixels.dtype} ({_one_line(problem)})"
        raise InputError(f"{file}: {reason}; save as .png or .exr")


def _with_alpha_mask(bmp: bytes) -> bytes:
    """Return a BMP of OpenImageIO with masks, one for alpha.

    OpenImageIO writes alpha into the byte that BITMAPINFOHEADER calls unused; BITMAPV4HEADER has masks ([MS-WMF],
    2.2.2.3 and 2.2.2.4).
    """
    bit_fields, srgb, longer = 3, 0x73524742, 108 - 40
    size, start = (int.from_bytes(bmp[place : place + 4], "little") + longer for place in (2, 10))
    masks = struct.pack("<5I", 0xFF0000, 0xFF00, 0xFF, 0xFF000000, srgb)
    info = struct.pack("<I", 108) + bmp[18:30] + struct.pack("<I", bit_fields) + bmp[34:54] + masks
    return bmp[:2] + struct.pack("<III", size, 0, start) + info.ljust(108, b"\0") + bmp[54:]


def check_system_error(problem: str, file: Path) -> None:
    """Raise OSError if OpenImageIO's message contains the text of one."""
    for number in _SYSTEM_ERRORS:
        if os.strerror(number) in problem:
            raise OSError(number, os.strerror(number), os.fspath(file))


def _one_line(text: str) -> str:
    return " ".join(text.split())


# Memory


@contextmanager
def _scratch_file(most: int) -> Iterator[tuple[Path, bool]]:
    """Yield an empty file that holds up to ``most`` bytes, and True if it is memory; Linux has files in memory.

    Raises OSError where the process may not write that many bytes to a file (``ulimit -f``): the limit holds for files
    in memory too, and writing beyond it would fail inside the library.
    """
    handle = -1
    if sys.platform == "linux":
        with suppress(AttributeError, OSError):  # C libraries without the call; sandboxes that forbid it
            handle = os.memfd_create("passgraph", os.MFD_CLOEXEC)
    memory = Path(f"/proc/self/fd/{handle}")
    if handle >= 0 and memory.exists():
        try:
            os.ftruncate(handle, most)
            os.ftruncate(handle, 0)
            yield memory, True
        finally:
            os.close(handle)
        return
    with temporary_folder() as folder:
        if shutil.disk_usage(folder).free < most:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), folder)
        path = Path(folder) / "picture"
        path.touch()
        os.truncate(path, most)
        yield path, False


def _check_complete(file: Path, path: Path, pixels: Pixels, kind: WritableFormat) -> None:
    """Raise OSError if a file on disk does not hold the pixels; formats with loss must only be readable."""
    try:
        with opened_image(path) as image:
            stored = image.read()
    except InputError as error:
        raise OSError(errno.EIO, "the file is not complete on the disk", os.fspath(file)) from error
    end = _ENDS.get(kind.writer, b"")
    with path.open("rb") as stream:
        stream.seek(-len(end), os.SEEK_END)
        is_complete = stream.read() == end if end else True
    if kind.writer in _EXACT:
        is_complete = is_complete and stored.tobytes() == pixels.tobytes()
    if not is_complete:
        raise OSError(errno.EIO, "the file is not complete on the disk", os.fspath(file))


# Threads

#: Held while OpenImageIO's attribute is changed.
_creating = threading.Lock()


def _in_child() -> None:
    global _creating
    _creating = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_in_child)


def created_output(writer: str) -> Any:
    """Return OpenImageIO's writer of a format; None if it has none.

    OpenEXR compresses in the caller's thread, so that forked children can write too: OpenEXR 3.5 has one pool of
    threads in a process; a forked child has the pool and none of its threads, and would wait forever. OpenImageIO sets
    the number of threads when it makes an `OpenEXROutput` (`set_exr_threads` in src/openexr.imageio/exroutput.cpp), and
    -1 is none.
    """
    import OpenImageIO as oiio

    if writer != "openexr":
        return oiio.ImageOutput.create(writer)
    with _creating:
        threads = oiio.get_int_attribute("exr_threads")
        oiio.attribute("exr_threads", -1)
        try:
            return oiio.ImageOutput.create(writer)
        finally:
            oiio.attribute("exr_threads", threads)
