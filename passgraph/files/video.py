"""A source that reads a video file with PyAV (the ``video`` extra)."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias

import numpy as np

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.files.frame import Frame, Stored
from passgraph.files.video_pixels import FULL, LIMITED, Conversion
from passgraph.reading import check_regular

if TYPE_CHECKING:
    from av.container import InputContainer
    from av.video.frame import VideoFrame
    from av.video.stream import VideoStream


#: Most parts that are checked; a file with more counts as complete.
MOST_PARTS = 1 << 20
#: Elements of Matroska that contain other elements: a segment and a cluster.
_SEGMENT, _CLUSTER = 0x18538067, 0x1F43B675
_ASF = bytes.fromhex("3026b2758e66cf11a6d900aa0062ce6c")
#: A function from the start of a part to the end that its header declares; None if it declares none, or is no part.
_Step: TypeAlias = Callable[[BinaryIO, int], "int | None"]


def promised_end(path: Path) -> int | None:
    """Return the declared end, in bytes, of the part in which a file is truncated; None if it seems complete.

    >>> promised_end(Path(__file__)) is None
    True
    """
    length = path.stat().st_size
    with path.open("rb") as stream:
        step, at = _container(stream.read(16))
        for _ in range(MOST_PARTS):
            if step is None or at >= length:
                return None
            end = step(stream, at)
            if end is None or end > length:
                return end
            at = end
    return None


def _container(start: bytes) -> tuple[_Step | None, int]:
    """Return the function that steps over the parts of a container, and the position of the first part."""
    if start[4:8] in (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip"):
        return _box, 0
    if start[:4] == b"\x1aE\xdf\xa3":
        return _element, 0
    if start[:4] == b"RIFF" and start[8:12] == b"AVI ":
        return _riff, 0
    if start == _ASF:
        return _object, 0
    # FLV: the header holds its own size; each tag is followed by four bytes with its size.
    return (_tag, int.from_bytes(start[5:9], "big") + 4) if start[:3] == b"FLV" else (None, 0)


def _read(stream: BinaryIO, at: int, count: int) -> bytes:
    stream.seek(at)
    return stream.read(count)


def _box(stream: BinaryIO, at: int) -> int | None:
    head = _read(stream, at, 16)
    size = int.from_bytes(head[:4], "big")
    if len(head) < 8 or not head[4:8].isalnum():
        return None  # not a box: data appended after the boxes
    if size == 1:
        size = int.from_bytes(head[8:16], "big")
    return at + size if size >= 8 else None  # 0: the box ends with the file


def _riff(stream: BinaryIO, at: int) -> int | None:
    head = _read(stream, at, 8)
    size = int.from_bytes(head[4:8], "little")
    return at + 8 + size + size % 2 if head[:4] == b"RIFF" and 0 < size < 0xFFFFFFFF else None


def _object(stream: BinaryIO, at: int) -> int | None:
    head = _read(stream, at, 24)
    size = int.from_bytes(head[16:24], "little")
    return at + size if len(head) == 24 and size >= 24 else None


def _tag(stream: BinaryIO, at: int) -> int | None:
    head = _read(stream, at, 4)
    return at + 11 + int.from_bytes(head[1:4], "big") + 4 if head[:1] in (b"\x08", b"\x09", b"\x12") else None


def _element(stream: BinaryIO, at: int) -> int | None:
    head = _read(stream, at, 12)
    first = _width(head[0], 4)
    if first is None or len(head) <= first:
        return None
    second = _width(head[first], 8)
    if second is None:
        return None
    name, start = int.from_bytes(head[:first], "big"), at + first + second
    size = int.from_bytes(head[first : first + second], "big") & ((1 << 7 * second) - 1)
    if size == (1 << 7 * second) - 1:  # unknown size: continue with the elements inside
        return start if name in (_SEGMENT, _CLUSTER) else None
    return start + size


def _width(byte: int, most: int) -> int | None:
    """Return the length in bytes of an EBML number: the leading zero bits of its first byte, plus one."""
    width = 9 - byte.bit_length()
    return width if width <= most else None


#: Matrix coefficients of ITU-T H.273, as in libavutil: identity, BT.709, BT.601, and unspecified.
RGB, BT709, BT601, UNSPECIFIED = 0, 1, 6, 2
#: Allowed file formats, by libavformat's names. Others, such as playlists, can open further files and URLs.
_FORMATS = (
    "mov,matroska,avi,mpegts,mpeg,mpegvideo,h264,hevc,ivf,ogg,asf,flv,mxf,nut,wav,w64,mp3,flac,aac,ac3,aiff,caf,au,wv"
)
#: Options for opening a video or a sound: only these formats, and no protocol but local files.
OPENING = {"format_whitelist": _FORMATS, "protocol_whitelist": "file"}
#: libavcodec's field order of progressive video (1); larger numbers are interlaced.
PROGRESSIVE = 1
#: The warning about an interlaced video.
INTERLACED = (
    "is interlaced; the two fields of each frame are taken as one picture, and what is written is marked progressive; "
    "deinterlace it first (ffmpeg -i INPUT -vf bwdif=mode=send_frame OUTPUT)"
)


def import_av(file: Path) -> Any:
    try:
        import av
    except ImportError as error:
        raise InputError(f"{file}: PyAV is not installed; run: pip install 'passgraph[video]'") from error
    return av


class Video:
    """A source that reads a file's first video stream: (h, w, 4) uint8, or uint16 if it has more than 8 bits.

    Colors are converted with the file's matrix and range. The defaults are BT.709 from 720 lines on, BT.601 below, and
    limited range. The display matrix of a frame is applied: rotation and mirroring.

    Attributes
    ----------
    path : the file
    size : (width, height) of its pictures
    rate : frames a second on average, or None
    time_base : the unit of ``pts`` in a frame's metadata, in seconds
    matrix, colour_range, primaries, transfer : color tags of the file, as in libavutil; `ToVideo` keeps them
    is_interlaced : True if a frame is two fields; they are read as one picture, with a warning
    deep, has_alpha, has_chroma : True if it has more than 8 bits, alpha, and colors as Y'CbCr

    Raises
    ------
    InputError : the file is missing, no video, or PyAV is not installed.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = arguments.path(path, "a video")
        with opened(self.path) as container:
            stream = video_stream(self.path, container)
            context = stream.codec_context
            self.size = (context.width, context.height)
            self.rate = stream.average_rate or stream.guessed_rate
            self.time_base = stream.time_base or Fraction(1, 90000)
            self.codec = context.name
            self.format = context.pix_fmt or "yuv420p"
            self.aspect = stream.sample_aspect_ratio
            self.matrix, self.colour_range = context.colorspace, context.color_range
            self.primaries, self.transfer = context.color_primaries, context.color_trc
            self.is_interlaced = context.field_order > PROGRESSIVE
            parts = context.format.components if context.format else ()
            self.deep = any(part.bits > 8 for part in parts)
            self.has_alpha = any(part.is_alpha for part in parts)
            is_rgb = context.format is not None and context.format.is_rgb
            self.has_chroma = not is_rgb and sum(not part.is_alpha for part in parts) != 1
            self.frames, self.duration = stream.frames, _duration(stream)
            # ASF declares the duration of its longest stream, which may be the sound.
            self._declares_duration = container.format.name != "asf"
            self.start = stream.start_time or 0
            self.metadata = dict(container.metadata)

    @property
    def name(self) -> str:
        return os.fspath(self.path)

    @property
    def count(self) -> int | None:
        if self.frames:
            return int(self.frames)
        return round(float(self.duration * self.rate)) if self.duration and self.rate else None

    def __iter__(self) -> Iterator[Frame]:
        number, end, conversion = 0, Fraction(0), Conversion()
        if self.is_interlaced:
            warnings.warn(f"{self.path}: {INTERLACED}", stacklevel=2)
        with opened(self.path) as container:
            stream = video_stream(self.path, container)
            stream.thread_type = "AUTO"
            for frame in self._decoded(container, stream):
                number += 1
                name = f"{self.path}, frame {number}"
                if isinstance(frame, str):
                    yield Frame(number, name, _refusing(f"{name}: {frame}"))
                    continue
                if frame.pts is not None:
                    end = max(end, (frame.pts - self.start) * self.time_base)
                metadata = {"pts": frame.pts, "time_base": self.time_base}
                yield Frame(number, name, partial(self._picture, name, frame, conversion), metadata)
        if number == 0:
            raise InputError(f"{self.path}: has no frame that can be decoded; make or copy the file again")
        self._check_end(number, end)

    def _decoded(self, container: InputContainer, stream: VideoStream) -> Iterator[VideoFrame | str]:
        """Yield frames in order; in place of a damaged frame, the reason."""
        av = import_av(self.path)
        packets = container.demux(stream)
        while True:
            try:
                packet = next(packets)
            except StopIteration:
                return
            except av.error.FFmpegError as error:
                text = f"{self.path}: cannot be read on ({reason(error)}); frames until then are done"
                raise InputError(text) from error
            try:
                frames = packet.decode()
            except av.error.FFmpegError as error:
                yield f"is damaged ({reason(error)})"
                continue
            for frame in frames:
                yield "is damaged (the decoder made up a part of it)" if frame.is_corrupt else frame

    def _check_end(self, number: int, end: Fraction) -> None:
        """Raise InputError for a truncated file: it ends before its declared duration or size.

        Decoders stop there without an error.
        """
        mismatch = ""
        has_all = not self._declares_duration or (self.frames and number >= self.frames)
        if self.duration and self.rate and not has_all:
            last = end + 1 / self.rate
            if self.duration - last > Fraction(1, 2) / self.rate:
                mismatch = f"it says it lasts {float(self.duration):.2f} s, and its frames end at {float(last):.2f} s"
        if not mismatch and (promised := promised_end(self.path)) is not None:
            mismatch = f"it says it goes on to byte {promised}, and it has {self.path.stat().st_size}"
        if mismatch:
            raise InputError(f"{self.path}: truncated; {mismatch}; the {number} frames until there are done")

    def _picture(self, name: str, frame: VideoFrame, conversion: Conversion) -> Stored:
        matrix, colour_range = stated(frame.colorspace, frame.color_range, frame.format.name, frame.height)
        frame.colorspace, frame.color_range = matrix, colour_range
        try:
            pixels = conversion.pixels(frame, self.deep)
        except import_av(self.path).error.FFmpegError as error:
            raise InputError(
                f"{name}: its colours cannot be read ({reason(error)}): pixel format {frame.format.name}, matrix "
                f"{matrix} of H.273; convert the video to BT.709 first"
            ) from error
        return np.ascontiguousarray(_upright(pixels, frame))


def _upright(picture: Stored, frame: VideoFrame) -> Stored:
    """Rotate and mirror a picture by the display matrix of its frame.

    The matrix maps a pixel's column and row to those on screen: x' = a x + c y and y' = b x + d y (ISO/IEC 14496-12,
    section 6.2.2). Rotations are rounded to quarter turns.
    """
    from av.sidedata.sidedata import Type

    side_data: Any = frame.side_data  # its keys are types, though PyAV annotates names
    matrix = side_data.get(Type.DISPLAYMATRIX)
    if matrix is None:
        return picture
    (a, b, _), (c, d, _), _ = np.frombuffer(matrix, np.int32).reshape(3, 3).tolist()
    is_quarter = abs(b) + abs(c) > abs(a) + abs(d)
    across, down = (c, b) if is_quarter else (a, d)
    picture = picture.swapaxes(0, 1) if is_quarter else picture
    return picture[:: -1 if down < 0 else 1, :: -1 if across < 0 else 1]


def stated(matrix: int, colour_range: int, format: str, height: int) -> tuple[int, int]:
    """Return the matrix and range of YUV pixels, with defaults where the file does not declare them."""
    if matrix == UNSPECIFIED or (matrix == RGB and format.startswith("yuv")):
        matrix = BT709 if height >= 720 else BT601
    if colour_range not in (LIMITED, FULL):
        colour_range = FULL if format.startswith("yuvj") else LIMITED
    return matrix, colour_range


@contextmanager
def opened(path: Path, what: str = "a video") -> Iterator[Any]:
    """Open a file with PyAV."""
    check_regular(path, what)
    av = import_av(path)
    try:
        container = av.open(os.fspath(path), metadata_errors="replace", options=OPENING)
    except (av.error.FFmpegError, OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as {what} ({reason(error)}); make or copy the file again") from error
    with container:
        yield container


def video_stream(path: Path, container: Any) -> Any:
    """Return the first video stream that is not a cover picture."""
    for stream in container.streams.video:
        if not stream.disposition & stream.disposition.attached_pic and stream.codec_context is not None:
            return stream
    raise InputError(f"{path}: has no video stream that can be decoded; expected a video")


def reason(error: BaseException) -> str:
    text = getattr(error, "strerror", None) or str(error)
    return " ".join(text.split())


def _duration(stream: VideoStream) -> Fraction | None:
    """Return the duration of a stream in seconds; None if its header does not declare it."""
    if stream.duration and stream.time_base:
        return stream.duration * stream.time_base
    # Matroska: hours:minutes:seconds, from time 0 on
    try:
        hours, minutes, seconds = stream.metadata["DURATION"].split(":")
        start = max(stream.start_time or 0, 0) * (stream.time_base or 0)
        return (int(hours) * 60 + int(minutes)) * 60 + Fraction(seconds) - start
    except (KeyError, ValueError):
        return None


def _refusing(message: str) -> Any:
    def read() -> Stored:
        raise InputError(message)

    return read
