"""A source that reads a video file with PyAV (the ``video`` extra)."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph import arguments
from passgraph.color_tags import space_of_codes
from passgraph.errors import InputError, reason
from passgraph.files.chroma import location_of
from passgraph.files.frame import Frame, Stored
from passgraph.files.hdr import HdrMetadata
from passgraph.files.video_pixels import FULL, LIMITED, Conversion
from passgraph.image_formats import NO_TAGS, Metadata
from passgraph.reading import check_regular

if TYPE_CHECKING:
    from av.container import InputContainer
    from av.video.frame import VideoFrame
    from av.video.stream import VideoStream


#: Matrix coefficients of ITU-T H.273, as in libavutil: identity, BT.709, BT.601, and unspecified.
RGB, BT709, BT601, UNSPECIFIED = 0, 1, 6, 2
#: Primaries of BT.709 and BT.601 (625 and 525 lines).
_AS_SRGB = (1, 5, 6)
#: Allowed file formats, by libavformat's names. Others, such as playlists, can open further files and URLs.
_FORMATS = (
    "mov,matroska,avi,mpegts,mpeg,mpegvideo,h264,hevc,ivf,ogg,asf,flv,mxf,nut,yuv4mpegpipe,wav,w64,mp3,flac,aac,ac3,"
    "aiff,caf,au,wv"
)
#: Decoders that read the alpha of VP8 and VP9, a second stream in each Matroska block; libavcodec's own drop it.
_ALPHA_DECODERS = {"vp8": "libvpx", "vp9": "libvpx-vp9"}
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


def open_container(av: Any, path: str | os.PathLike[str], mode: str = "r", **options: Any) -> Any:
    """Open a file with PyAV so that metadata keeps its bytes, including text that is not UTF-8.

    PyAV 19 always decodes and encodes metadata with "surrogateescape". Earlier versions raise UnicodeError by default
    and have a keyword for it, which PyAV 19 removed.
    """
    if hasattr(av.container.Container, "metadata_errors"):
        options["metadata_errors"] = "surrogateescape"
    return av.open(os.fspath(path), mode, **options)


@dataclass
class _Position:
    """How far a file is read: frames, the time of the last one in seconds, and True if its last packet is cut."""

    frames: int = 0
    end: Fraction = Fraction(0)
    is_cut: bool = False


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
    chroma : where samples of subsampled chroma lie, such as "left"
    hdr, is_turned : HDR10's static metadata, and True if frames are turned by 90°, from the first frame on
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
            # QuickTime has the time code in a track of its own, which libavformat copies to the video's metadata.
            timecode = {key: stream.metadata[key] for key in ("timecode",) if key in stream.metadata}
            self.metadata = {**timecode, **container.metadata}
            self._alpha_decoder = _ALPHA_DECODERS.get(self.codec) if stream.metadata.get("alpha_mode") == "1" else None
            if self._alpha_decoder is not None:
                self.has_alpha, self.format = True, "yuva420p"
            matrix, colour_range = stated(self.matrix, self.colour_range, self.format, context.height)
            self.chroma = location_of(stream, self.codec, colour_range == FULL, matrix)
            self.hdr, self.is_turned = HdrMetadata(), False

    @property
    def name(self) -> str:
        return os.fspath(self.path)

    @property
    def count(self) -> int | None:
        if self.frames:
            return int(self.frames)
        return round(float(self.duration * self.rate)) if self.duration and self.rate else None

    @property
    def picture_metadata(self) -> Metadata | None:
        """Return the color tags of pictures made of its frames; None for BT.709 and BT.601, which are taken as sRGB."""
        if {self.primaries, self.transfer} & {UNSPECIFIED} or self.primaries in _AS_SRGB:
            return None
        tags = ("CICP", "int[4]", (self.primaries, self.transfer, 0, 1))
        return Metadata((tags,), deep=self.deep, space=space_of_codes(self.primaries, self.transfer) or NO_TAGS)

    def __iter__(self) -> Iterator[Frame]:
        position, conversion = _Position(), Conversion()
        if self.is_interlaced:
            warnings.warn(f"{self.path}: {INTERLACED}", stacklevel=2)
        with opened(self.path) as container:
            stream = video_stream(self.path, container)
            stream.thread_type = "AUTO"
            for frame in self._decoded(container, stream, position):
                position.frames += 1
                number = position.frames
                unread = Frame.unread(self.path, number)
                name = unread.name
                if isinstance(frame, str):
                    yield replace(unread, read=_refusing(f"{name}: {frame}"))
                    continue
                if frame.pts is not None:
                    position.end = max(position.end, (frame.pts - self.start) * self.time_base)
                if number == 1:
                    self.hdr, self.is_turned = HdrMetadata.of(frame), _is_quarter(_display_matrix(frame))
                metadata = {"pts": frame.pts, "time_base": self.time_base}
                yield replace(unread, read=partial(self._picture, name, frame, conversion), metadata=metadata)
        if position.frames == 0:
            raise InputError(f"{self.path}: has no frame that can be decoded; make or copy the file again")
        self._check_end(position)

    def _decoded(
        self, container: InputContainer, stream: VideoStream, position: _Position
    ) -> Iterator[VideoFrame | str]:
        """Yield frames in order; in place of a damaged frame, the reason."""
        av = import_av(self.path)
        packets = container.demux(stream)
        decoder = None
        if self._alpha_decoder is not None:
            decoder = av.CodecContext.create(self._alpha_decoder, "r")
            decoder.extradata = stream.codec_context.extradata
        while True:
            try:
                packet = next(packets)
            except StopIteration:
                return
            except av.error.FFmpegError as error:
                text = f"{self.path}: cannot be read on ({reason(error)}); frames until then are done"
                raise InputError(text) from error
            if packet.size:  # the one without data flushes the decoder
                position.is_cut = packet.is_corrupt
            try:
                frames = packet.decode() if decoder is None else decoder.decode(packet)
            except av.error.FFmpegError as error:
                yield f"is damaged ({reason(error)})"
                continue
            for frame in frames:
                yield "is damaged (the decoder made up a part of it)" if frame.is_corrupt else frame

    def _check_end(self, position: _Position) -> None:
        """Raise InputError for a truncated file; decoders stop there without an error."""
        mismatch = "it ends in the middle of a packet" if position.is_cut else ""
        has_all = not self._declares_duration or (self.frames and position.frames >= self.frames)
        if self.duration and self.rate and not has_all:
            last = position.end + 1 / self.rate
            if self.duration - last > Fraction(1, 2) / self.rate:
                mismatch = f"it says it lasts {float(self.duration):.2f} s, and its frames end at {float(last):.2f} s"
        if mismatch:
            raise InputError(f"{self.path}: truncated; {mismatch}; the {position.frames} frames until there are done")

    def _picture(self, name: str, frame: VideoFrame, conversion: Conversion) -> Stored:
        matrix, colour_range = stated(frame.colorspace, frame.color_range, frame.format.name, frame.height)
        frame.colorspace, frame.color_range = matrix, colour_range
        try:
            pixels = conversion.pixels(frame, self.deep, self.chroma)
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
    matrix = _display_matrix(frame)
    (a, b), (c, d) = matrix
    is_quarter = _is_quarter(matrix)
    across, down = (c, b) if is_quarter else (a, d)
    picture = picture.swapaxes(0, 1) if is_quarter else picture
    return picture[:: -1 if down < 0 else 1, :: -1 if across < 0 else 1]


def _display_matrix(frame: VideoFrame) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the rows of a frame's display matrix, without its shift."""
    from av.sidedata.sidedata import Type

    side_data: Any = frame.side_data  # its keys are types, though PyAV annotates names
    matrix = side_data.get(Type.DISPLAYMATRIX)
    if matrix is None:
        return (1, 0), (0, 1)
    (a, b, _), (c, d, _), _ = np.frombuffer(matrix, np.int32).reshape(3, 3).tolist()
    return (a, b), (c, d)


def _is_quarter(matrix: tuple[tuple[int, int], tuple[int, int]]) -> bool:
    """Return True if a display matrix exchanges columns and rows."""
    (a, b), (c, d) = matrix
    return abs(b) + abs(c) > abs(a) + abs(d)


def stated(matrix: int, colour_range: int, format: str, height: int) -> tuple[int, int]:
    """Return the matrix and range of YUV pixels, with defaults where the file does not declare them."""
    if matrix == UNSPECIFIED or (matrix == RGB and format.startswith("yuv")):
        matrix = BT709 if height >= 720 else BT601
    if colour_range not in (LIMITED, FULL):
        colour_range = FULL if format.startswith(("yuvj", "gray", "ya8", "ya16")) else LIMITED
    return matrix, colour_range


@contextmanager
def opened(path: Path, what: str = "a video") -> Iterator[Any]:
    """Open a file with PyAV."""
    check_regular(path, what)
    av = import_av(path)
    try:
        container = open_container(av, path, options=OPENING)
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


def _duration(stream: VideoStream) -> Fraction | None:
    """Return the duration of a stream in seconds; None if its header does not declare it."""
    if stream.duration and stream.time_base:
        return stream.duration * stream.time_base
    # Matroska: hours:minutes:seconds, from time 0 on
    try:
        hours, minutes, seconds = stream.metadata["DURATION"].split(":")
        start = max(stream.start_time or 0, 0) * (stream.time_base or 0)
        return (int(hours) * 60 + int(minutes)) * 60 + arguments.parsed_fraction(seconds) - start
    except (KeyError, ValueError):
        return None


def _refusing(message: str) -> Any:
    def read() -> Stored:
        raise InputError(message)

    return read
