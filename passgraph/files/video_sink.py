"""A sink that writes a video file with color tags, and with the sound and subtitles of the source."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from passgraph import arguments
from passgraph.color_tags import Codes, ColorSpace, Recoded
from passgraph.errors import InputError, reason
from passgraph.files.chroma import location_to_write
from passgraph.files.digests import file_state
from passgraph.files.film import LEAST_RATE, Film, partial_path
from passgraph.files.frame import Frame, OutputError, Source, Stored
from passgraph.files.partial_video import OPTIONS, FirstPackets, first_packets
from passgraph.files.sequences import source_metadata
from passgraph.files.stored import with_channels
from passgraph.files.video import BT709, OPENING, RGB, UNSPECIFIED, Video, import_av, open_container, opened, stated
from passgraph.files.video_pixels import FULL, LIMITED, Conversion, is_matrix

if TYPE_CHECKING:
    from passgraph.files.video import Video


def check_sound(path: Path, container: Any, into: Path) -> None:
    """Raise InputError for sound that a container cannot hold; libav would raise only after frames are encoded."""
    with opened(path) as source:
        for stream in source.streams:
            if stream.type in ("audio", "subtitle") and stream.codec_context is not None:
                codec = stream.codec_context.codec
                if not {codec.name, codec.canonical_name} & container.supported_codecs:
                    raise InputError(
                        f"{into}: cannot hold the {stream.type} of {path} as it is ({codec.name}); choose another "
                        "suffix, such as .mkv, or leave it out (--no-sound)"
                    )


class Sound:
    """Packets of a file's sound and subtitles, returned up to a given time.

    The file is opened a second time, so that sound and pictures can be interleaved in any way.

    Parameters
    ----------
    path : the file with the sound
    container : the container to write; streams are added to it
    """

    def __init__(self, path: Path, container: Any) -> None:
        self._av = import_av(path)
        self._container = open_container(self._av, path, options=OPENING)
        self._streams: dict[int, Any] = {}
        for stream in self._container.streams:
            if stream.type in ("audio", "subtitle") and stream.codec_context is not None:
                self._streams[stream.index] = container.add_stream_from_template(stream, opaque=True)
        kept = [self._container.streams[index] for index in self._streams]
        self._packets = iter(self._container.demux(kept)) if kept else iter(())
        self._next: Any = None

    def until(self, seconds: Fraction | None) -> Iterator[Any]:
        """Yield packets up to a time in order, or all that remain; an error in the file ends them."""
        while True:
            if self._next is None:
                try:
                    self._next = next(self._packets, None)
                except self._av.error.FFmpegError:
                    self._packets = iter(())
                if self._next is None:
                    return
            packet = self._next
            if packet.dts is None:  # the end of a stream
                self._next = None
                continue
            if seconds is not None and packet.dts * packet.time_base > seconds:
                return
            self._next = None
            packet.stream = self._streams[packet.stream.index]
            yield packet

    def close(self) -> None:
        self._container.close()


#: Encoders whose streams store matrix and range; containers that store both do so for every encoder.
_SAYING = ("libx26", "libvpx-vp9", "libsvtav1", "libaom", "librav1e", "h264_", "hevc_", "vp9_", "av1_")
_SAYING_CONTAINERS = (".mkv", ".webm")
#: Encoders whose streams store the matrix, and always have limited range (ISO/IEC 13818-2, 6.3.6; SMPTE RDD 36,
#: 5.1.1).
_OF_LIMITED_RANGE = ("mpeg2video", "prores")
#: Encoders with one fixed matrix and range: BT.601 by another of its numbers (JFIF 1.02; RFC 6386, 9.2).
_FIXED = {"mjpeg": (5, FULL), "libvpx": (5, LIMITED)}


class Coding(NamedTuple):
    """Matrix and range of a video's pixels, as in libavutil, and the matrix to store in the file."""

    matrix: int
    colour_range: int
    stored_matrix: int


def coding_of(
    encoder: str, suffix: str, form: Any, source: Video | None, height: int, matrix: int = UNSPECIFIED
) -> Coding:
    """Return the matrix and range that readers assume for an encoder's file with this suffix.

    Parameters
    ----------
    encoder : libavcodec's name
    form : PyAV's pixel format of the frames to encode
    source : a video whose range is kept if the file can store it
    height : lines of a picture
    matrix : the wanted matrix, if the file can store it
    """
    if form.is_rgb:
        return Coding(BT709, FULL, RGB)
    colour_range = FULL if form.name.startswith("yuvj") else 0
    if source is not None and source.has_chroma:
        _, colour_range = stated(source.matrix, source.colour_range, source.format, height)
    if sum(not part.is_alpha for part in form.components) == 1:
        colour_range = FULL  # the only range of gray formats in libswscale
    if encoder in _FIXED:
        matrix, colour_range = _FIXED[encoder]
    elif encoder.startswith(_OF_LIMITED_RANGE):
        colour_range = LIMITED
    elif not encoder.startswith(_SAYING) and suffix not in _SAYING_CONTAINERS:
        matrix, colour_range = UNSPECIFIED, colour_range if form.name.startswith(("gray", "ya", "yuvj")) else LIMITED
    stored_matrix = matrix if is_matrix(matrix) else UNSPECIFIED
    return Coding(*stated(stored_matrix, colour_range, form.name, height), stored_matrix)


#: libavcodec's flag that frames have durations.
_FRAME_DURATION = 1 << 8
#: Encoders whose time base has 16 bits (ISO/IEC 14496-2, vop_time_increment_resolution) or is the frame rate.
_COARSE = ("mpeg4", "mpeg2video", "mpeg1video", "msmpeg4", "wmv2")
#: Most frames that every encoder stores in presentation order.
_IN_ORDER = 2
#: Default options of encoders: nearly no visible loss, and no messages of x265 on stderr.
_DEFAULT_OPTIONS = {
    "libx264": {"crf": "18"},
    "libx265": {"crf": "20", "x265-params": "log-level=error"},
    "libvpx-vp9": {"crf": "24", "b": "0"},
}
#: Default encoders of containers whose own default is outdated.
_CODECS = dict.fromkeys((".avi", ".mkv", ".mp4", ".mov", ".m4v"), "libx264") | {".y4m": "rawvideo"}
#: Pixel formats of YUV4MPEG2 (.y4m), for its encoder, which lists none.
_RAW_FORMATS = ("yuv420p", "yuv422p", "yuv444p", "yuv411p", "gray")
#: Metadata that describes the source file itself, and is not copied.
_OWN_METADATA = ("encoder", "major_brand", "minor_version", "compatible_brands", "duration")
#: The advice in most errors.
_OTHERS = "use another --codec"


class ToVideo(Film):
    """A sink that writes a video file, which appears under its name when it is complete.

    Parameters
    ----------
    path : the suffix chooses the container: .mp4 .mov .mkv .webm .avi ...
    rate : frames a second of sources without times; a video's frames keep theirs
    codec : libavcodec's name of an encoder; by default the source's codec, or the usual one of the container
    options : options of the encoder, such as ``{"crf": "23"}``
    sound : copy the sound and subtitles of a source video, or those of a file until the last frame ends, without
        encoding them again

    color : the color space of the results, as for `passgraph.save`; by default the source's color tags are kept

    The source's range is kept, and its matrix, primaries and transfer without ``color``. Its pixel format is kept if
    the encoder has it; if not, and the source has alpha, a format with alpha is chosen if the encoder has one.
    """

    kind = "a video"

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        rate: Fraction | None = None,
        codec: str | None = None,
        options: Mapping[str, str] | None = None,
        sound: bool | str | os.PathLike[str] = True,
        color: ColorSpace | Recoded | str | None = None,
    ) -> None:
        super().__init__(path, rate)
        self.color = ColorSpace(color, color) if isinstance(color, str) else color
        self.codec, self.options = codec, dict(options or {})
        self.sound = sound if isinstance(sound, bool) else arguments.path(sound, "the sound of a video")
        self._begun = FirstPackets(self.path)  # frames of an interrupted run, to go on from

    def stored_as(self) -> dict[str, Any]:
        sound = file_state(self.sound) if isinstance(self.sound, Path) else self.sound
        libraries = import_av(self.path).library_versions
        return {**super().stored_as(), "codec": self.codec, "options": self.options, "sound": sound, "by": libraries}

    def encoded(self) -> int:
        return len(first_packets(partial_path(self.path)))

    def go_on(self) -> None:
        self._begun = first_packets(partial_path(self.path))

    def begin(self, source: Source) -> None:
        self._av, self._conversion = import_av(self.path), Conversion()
        self._video = source if isinstance(source, Video) else None
        self._codes = self._codes_of(source)
        self._base: Fraction | None = getattr(source, "time_base", None)
        self._sound: Sound | None = None
        self._stream: Any = None
        self._format = ""
        self._last: int | None = None  # pts of the last frame
        self._is_continued = False  # what an interrupted run encoded is written
        self._count = 0
        #: Bytes from which the incomplete file is worth more than what another run left.
        self._shown_from: int | None = None
        options = OPTIONS.get(self.path.suffix.lower(), {})
        if options:
            self._shown_from = max(1, self._begun.path.stat().st_size if self._begun else 0)
        super().begin(source)
        assert self._new_file is not None
        try:
            self._container = open_container(self._av, self._new_file.temporary, "w", options=options)
            self._encoder = self._choose_encoder()
            if self._sound_file is not None:
                check_sound(self._sound_file, self._container, self.path)
        except (self._av.error.FFmpegError, OSError, ValueError) as error:
            self.abandon()
            raise InputError(f"{self.path}: cannot be written as a video ({reason(error)})") from error
        except BaseException:
            self.abandon()
            raise

    def _codes_of(self, source: Source) -> Codes:
        """Return the color tags of the results: those of ``color``, else the source's."""
        if isinstance(source, Video) and not isinstance(self.color, ColorSpace):
            matrix = source.matrix if source.has_chroma else UNSPECIFIED
            return Codes(source.primaries, source.transfer, matrix)
        metadata = source_metadata(source)
        if self.color is not None:
            metadata = metadata.in_space(self.color)
        return ColorSpace("", metadata.space).codes or Codes(UNSPECIFIED, UNSPECIFIED, UNSPECIFIED)

    @property
    def _sound_file(self) -> Path | None:
        """The file whose sound is copied."""
        if isinstance(self.sound, Path):
            return self.sound
        return self._video.path if self._video is not None and self.sound else None

    def _choose_encoder(self) -> Any:
        """Return the requested encoder; else the source's if the container supports it, else the container's."""
        preferred = [self.codec] if self.codec else [self._video.codec] if self._video else []
        default = _CODECS.get(self.path.suffix.lower(), self._container.default_video_codec)
        for name in preferred if self.codec else [*preferred, default]:
            with suppress(self._av.codec.codec.UnknownCodecError):
                encoder = self._av.codec.Codec(name, "w")
                if encoder.type == "video" and (encoder.name == default or name in self._container.supported_codecs):
                    return encoder
        raise InputError(
            f"{self.path}: no encoder {self.codec or default!r} for such a file; others are libx264, libx265, "
            "libvpx-vp9, libsvtav1, prores_ks, ffv1"
        )

    def in_bytes(self, source: Source) -> bool:
        return not (isinstance(source, Video) and source.deep)

    def stores(self, frame: Frame, size: tuple[int, int]) -> np.dtype[Any]:
        if self._size is None:
            self._format = self._pixel_format(*size)
            self._coding = coding = self._coding_of(*size)
            source = self._video.chroma if self._video is not None and self._video.has_chroma else None
            self._chroma = location_to_write(
                self._encoder.name, self.path.suffix.lower(), source, coding.colour_range == FULL, coding.matrix
            )
        self._check_size(frame, size)
        deep = self._video is not None and self._video.deep
        return np.dtype(np.uint16 if deep else np.uint8)

    # Any thread

    def prepare(self, frame: Frame, picture: Stored) -> Any:
        pixels = np.ascontiguousarray(with_channels(picture, 4))
        try:
            coding = self._coding
            return self._conversion.frame(pixels, self._format, coding.matrix, coding.colour_range, self._chroma)
        except self._av.error.FFmpegError as error:
            raise OutputError(f"{self.path}: no pixels can be made in the format {self._format}; {_OTHERS}") from error

    def _coding_of(self, width: int, height: int) -> Coding:
        form = self._av.VideoFormat(self._format, width, height)
        suffix = self.path.suffix.lower()
        return coding_of(self._encoder.name, suffix, form, self._video, height, self._codes.matrix)

    def _pixel_format(self, width: int, height: int) -> str:
        """Return the source's pixel format if the encoder has it, else the nearest; 4:2:0 needs even sides."""
        known = [f.name for f in self._encoder.video_formats or ()] or list(_RAW_FORMATS)
        video = self._video
        deep = video is not None and video.deep
        preferred = [] if video is None else [video.format.replace("yuvj", "yuv") if "mjpeg" not in known else ""]
        if video is not None and video.has_alpha:
            preferred += [] if deep else ["rgba", "argb", "yuva420p", "yuva444p"]
            preferred += ["yuva444p10le"]
        preferred += ["yuv420p10le", "yuv422p10le", "yuv444p10le"] if deep else []
        preferred += ["yuv420p", "yuvj420p", "yuv422p", "yuv444p", "yuvj444p"]
        name: str
        for name in [*preferred, *known]:
            form = self._av.VideoFormat(name, width, height) if name in known else None
            if form is not None and self._fits(form):
                return name
        raise OutputError(f"{self.path}: the encoder {self._encoder.name} takes no {width}x{height} pixels; {_OTHERS}")

    @staticmethod
    def _fits(form: Any) -> bool:
        """Return True if pixels can be converted to a format, and its chroma subsampling divides the picture's size."""
        if form.has_palette:
            return False  # pixels are not quantized to a palette
        width, height = form.width, form.height
        across, down = form.chroma_width(64), form.chroma_height(64)
        return bool(width % (64 // across) == 0 and height % (64 // down) == 0)

    # One thread

    def take(self, frame: Frame, prepared: Any) -> None:
        self._guarded(lambda: self._encode(frame, prepared))

    def _encode(self, frame: Frame, prepared: Any) -> None:
        if self._stream is None:
            self._start()
        prepared.pts, prepared.time_base, prepared.pict_type = self._pts(frame), self._time_base, 0
        prepared.duration = max(1, round(self._length_of(frame) / self._time_base))
        self._end = (prepared.pts + prepared.duration) * self._time_base
        if not self._begun or self._is_continued:
            self._interleave_sound(prepared.pts * self._time_base)
        self._count += 1
        self._mux(self._stream.encode(prepared))
        self._show()

    def _mux(self, packets: Iterable[Any]) -> None:
        for packet in packets:
            if self._begun and not self._is_continued:
                self._is_continued = True
                for begun in self._begun.as_encoded((packet.pts - packet.dts) * packet.time_base):
                    self._interleave_sound(begun.dts * begun.time_base)
                    begun.stream = self._stream
                    self._container.mux(begun)
            self._container.mux(packet)

    def _interleave_sound(self, seconds: Fraction) -> None:
        for packet in self._sound.until(seconds) if self._sound is not None else ():
            self._container.mux(packet)

    def _show(self) -> None:
        """Give the incomplete file a name of its own once it has more than that of an interrupted run."""
        assert self._new_file is not None
        if self._shown_from is None:
            return
        with suppress(FileNotFoundError):  # it is made with its first bytes
            if self._new_file.temporary.stat().st_size >= self._shown_from:
                self._new_file.show_as(partial_path(self.path))
                self._shown_from = None

    def _pts(self, frame: Frame) -> int:
        pts = round(self._start_of(frame) / self._time_base)
        if self._last is not None:
            pts = max(pts, self._last + 1)
        self._last = pts
        return pts

    def _start(self) -> None:
        """Add the streams, once the size is known."""
        assert self._size is not None
        video, rate = self._video, Fraction(self._rate).limit_denominator(1 << 16) or LEAST_RATE
        options = {
            **_DEFAULT_OPTIONS.get(self._encoder.name, {}), "chroma_sample_location": self._chroma, **self.options,
        }  # fmt: skip
        if self._encoder.name == "libvpx" and self._format == "yuva420p":
            options.setdefault("auto-alt-ref", "0")  # the encoder has no frames of this kind with alpha
        if video is not None and not isinstance(self.color, ColorSpace):
            options |= self._hdr_options(video, options)
        stream = self._stream = self._container.add_stream(self._encoder.name, rate=rate, options=options)
        (stream.width, stream.height), stream.pix_fmt = self._size, self._format
        # AVI and YUV4MPEG2 store no times, only frames in order: a finer time base would need empty frames between
        # them, and reordered frames would get wrong times.
        is_timeless = self.path.suffix.lower() in (".avi", ".y4m")
        coarse = self._encoder.name.startswith(_COARSE) or is_timeless
        self._time_base = 1 / rate if self._base is None or coarse else self._base
        context = stream.codec_context
        context.time_base, context.thread_count, context.thread_type = self._time_base, 0, "AUTO"
        if is_timeless:
            context.max_b_frames = 0
        if video is None and self._base is not None:
            # Frames have individual durations; the last one's is kept only if frames are stored in presentation order.
            context.flags, context.max_b_frames = context.flags | _FRAME_DURATION, 0
        context.colorspace, context.color_range = self._coding.stored_matrix, self._coding.colour_range
        context.color_primaries, context.color_trc = self._codes.primaries, self._codes.transfer
        if video is not None:
            if video.aspect:
                context.sample_aspect_ratio = 1 / video.aspect if video.is_turned else video.aspect
            self._container.metadata.update(
                {key: text for key, text in video.metadata.items() if key.lower() not in _OWN_METADATA}
            )
        if self._sound_file is not None:
            self._sound = Sound(self._sound_file, self._container)
        self._container.start_encoding()
        for key in self.options:
            if key in context.options:  # libav removes the options that it knows
                raise OutputError(f"{self.path}: the encoder {self._encoder.name} has no option {key!r}")

    def _hdr_options(self, video: Video, options: Mapping[str, str]) -> dict[str, str]:
        """Return the encoder's parameters with the source's HDR metadata before them, so that given ones win."""
        found = video.hdr.parameters(self._encoder.name)
        if found is None:
            return {}
        name, text = found
        return {name: f"{text}:{options[name]}" if name in options else text}

    def finish(self) -> None:
        self._guarded(self._finish)

    def _finish(self) -> None:
        if self._sound is not None:
            # Sound of the source's own file may go on after the last frame.
            for packet in self._sound.until(self._end if isinstance(self.sound, Path) else None):
                self._container.mux(packet)
            self._sound.close()
        self._flush()
        self._complete_file()
        if self._begun:
            self._begun.path.unlink(missing_ok=True)

    def _flush(self) -> None:
        packets = self._stream.encode()
        if self._count <= _IN_ORDER:
            # x265 computes their decoding times from uninitialized memory.
            for packet in packets:
                packet.dts = packet.pts
        self._mux(packets)
        self._container.close()

    def abandon(self) -> None:
        """Keep what is encoded as a video that plays, beside the name of the whole one."""
        if self._new_file is None:
            return
        with suppress(Exception):  # the file is kept or removed even if closing it fails
            if self._count:
                self._flush()
        with suppress(Exception):
            self._container.close()
        if self._sound is not None:
            self._sound.close()
        partial = partial_path(self.path)
        if self._count and first_packets(self._new_file.temporary):
            with suppress(OSError, InputError):
                self._new_file.show_as(partial)
        if self._new_file.is_shown:
            self.left, self._new_file = partial, None
        else:
            super().abandon()

    def _guarded(self, work: Callable[[], None]) -> None:
        """Call a function and convert libav's errors to `OutputError` with the file's name; the file cannot go on."""
        try:
            work()
        except self._av.error.FFmpegError as error:
            raise OutputError(f"{self.path}: cannot be written ({reason(error)})") from error
