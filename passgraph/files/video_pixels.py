# mypy: disable-error-code="no-any-return"
"""Convert frames of videos to pixels, and pixels to frames in a video's own format."""

from __future__ import annotations

import re
import threading
from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.files.frame import Stored
from passgraph.graph.calls import kernel
from passgraph.graph.run_values import Value
from passgraph.graph.targets import Input, target
from passgraph.language.symbols import Image, vec2, vec3, vec4
from passgraph.language.vectors import dot
from passgraph.records import dataclass
from passgraph.run.compile import compile
from passgraph.run.program import Program

if TYPE_CHECKING:
    from av.video.frame import VideoFrame


#: (height, width) uint8, or uint16 of more than 8 bits, with any stride between rows.
Plane: TypeAlias = NDArray[Any]
#: (height, width, 4) uint8 or uint16.
Pixels: TypeAlias = NDArray[Any]


@dataclass(frozen=True)
class Code:
    """The Y'CbCr encoding of colors as integers.

    Attributes
    ----------
    red, blue : their weights in luma; green has the rest
    full : True for full range (luma from 0 to the largest number), False for limited (16 to 235 of 8 bits)
    bits : bits of a number, 8 to 16
    """

    red: float
    blue: float
    full: bool
    bits: int = 8

    @property
    def most(self) -> int:
        """The largest number."""
        return (1 << self.bits) - 1

    def values(self) -> dict[str, Any]:
        """Return the run values of both programs: weights, and offset and scale of luma and of chroma.

        They are relative to the largest number of the dtype.
        """
        step = 1 << (self.bits - 8)
        zero, luma, chroma = (0, self.most, self.most) if self.full else (16 * step, 219 * step, 224 * step)
        largest = 255 if self.bits == 8 else 65535
        of_red, of_blue = 2 - 2 * self.red, 2 - 2 * self.blue
        green = 1 - self.red - self.blue
        return {
            "zero": (zero / largest, 128 * step / largest),
            "scale": (luma / largest, chroma / largest),
            "most": self.most / largest,
            "weights": (self.red, green, self.blue),
            "by_red": (of_red, of_red * self.red / green),
            "by_blue": (of_blue, of_blue * self.blue / green),
        }


@kernel
def _colours(luma: Image, blue: Image, red: Image, zero: vec2, scale: vec2, by_blue: vec2, by_red: vec2) -> vec4:
    y = (luma[0, 0].r - zero.x) / scale.x
    cb = (blue[0, 0].r - zero.y) / scale.y
    cr = (red[0, 0].r - zero.y) / scale.y
    return vec4(y + by_red.x * cr, y - by_red.y * cr - by_blue.y * cb, y + by_blue.x * cb, 1.0)


@kernel
def _ycbcr_planes(
    pixels: Image, weights: vec3, zero: vec2, scale: vec2, by_blue: vec2, by_red: vec2, most: float
) -> tuple[float, float, float]:
    c = pixels[0, 0].rgb
    y = dot(c, weights)
    cb = (c.b - y) / by_blue.x
    cr = (c.r - y) / by_red.x
    return min(y * scale.x + zero.x, most), min(cb * scale.y + zero.y, most), min(cr * scale.y + zero.y, most)


def pixels_of(planes: Sequence[Plane], code: Code, dtype: type[np.uint8 | np.uint16] = np.uint8) -> Pixels:
    """Convert Y', Cb, Cr and optional alpha planes of one size to pixels, each number rounded to nearest."""
    values = code.values()
    del values["weights"], values["most"]
    pixels: Any = _reader(planes[0].itemsize, np.dtype(dtype).itemsize)(
        luma=planes[0], blue=planes[1], red=planes[2], **values
    )["pixels"]
    if len(planes) == 4:
        pixels[..., 3] = _rescaled(planes[3], code.most, np.iinfo(dtype).max)
    result: Pixels = pixels
    return result


def to_planes(pixels: Pixels, planes: Sequence[Plane], code: Code) -> None:
    """Convert pixels into Y', Cb, Cr and optional alpha planes of their size."""
    _writer(pixels.itemsize, planes[0].itemsize)(
        pixels=pixels, into=dict(zip(_NAMES, planes, strict=False)), **code.values()
    )
    if len(planes) == 4:
        planes[3][...] = _rescaled(pixels[..., 3], np.iinfo(pixels.dtype).max, code.most)


def _rescaled(numbers: NDArray[Any], old_max: int, new_max: int) -> NDArray[Any]:
    """Rescale alpha from 0 to ``old_max`` to 0 to ``new_max``, rounded to nearest."""
    return numbers if old_max == new_max else (numbers.astype(np.uint32) * new_max + old_max // 2) // old_max


_NAMES = ("luma", "blue", "red")
_VALUES: Any = {name: Value(name) for name in ("zero", "scale", "by_blue", "by_red")}


@cache
def _reader(from_bytes: int, to_bytes: int) -> Program:
    """Compile the conversion from planes, once a process for all threads."""
    luma, blue, red = (Input(name, f"r{8 * from_bytes}") for name in _NAMES)
    pixels = _colours(luma, blue, red, **_VALUES, into=target("pixels", f"rgba{8 * to_bytes}", like=luma))
    return compile(pixels, "numpy", results="stored")


@cache
def _writer(from_bytes: int, to_bytes: int) -> Program:
    """Compile the conversion to planes, once a process for all threads."""
    pixels = Input("pixels", f"rgba{8 * from_bytes}")
    into = [target(name, f"r{8 * to_bytes}", like=pixels) for name in _NAMES]
    more: Any = {name: Value(name) for name in ("weights", "most")}
    return compile(_ycbcr_planes(pixels, **more, **_VALUES, into=into), "numpy", results="stored")


#: libavutil's AVColorRange: 16 to 235, and 0 to 255.
LIMITED, FULL = 1, 2
_RANGES = {LIMITED: "tv", FULL: "pc"}
#: Names of planar Y'CbCr formats, with their bits if not 8.
_PLANAR = re.compile(r"yuv(a|j|)4(?:10|11|20|22|40|44)p(|(?:9|10|12|14|16)le)")
#: Y'CbCr formats with interleaved channels, as hardware and v410 have them, by their planar 4:4:4 format.
_INTERLEAVED = {
    interleaved: planar
    for planar, names in {
        "yuv444p": "nv12 nv21 nv16 nv24 nv42 yuyv422 uyvy422 yvyu422 vyu444 vuyx",
        "yuva444p": "vuya ayuv uyva",
        "yuv444p10le": "p010le p210le p410le nv20le y210le v30xle xv30le",
        "yuv444p12le": "p012le p212le p412le y212le xv36le",
        "yuv444p16le": "p016le p216le p416le xv48le",
        "yuva444p16le": "ayuv64le",
    }.items()
    for interleaved in names.split()
}
#: Gray formats of integers, with alpha or without.
_GRAY = re.compile(r"gray|gray(?:9|10|12|14|16)le|ya8|ya16le")


class Matrix(NamedTuple):
    """A Y'CbCr matrix: libavfilter's name, and the weights of red and blue in luma."""

    name: str
    red: float
    blue: float


#: Matrices by their numbers in ITU-T H.273, table 4.
_MATRICES = {
    1: Matrix("bt709", 0.2126, 0.0722),
    4: Matrix("fcc", 0.30, 0.11),
    5: Matrix("bt470bg", 0.299, 0.114),
    6: Matrix("smpte170m", 0.299, 0.114),
    7: Matrix("smpte240m", 0.212, 0.087),
    9: Matrix("bt2020nc", 0.2627, 0.0593),
}


def is_matrix(number: int) -> bool:
    """Return True if colors can be converted with this matrix."""
    return number in _MATRICES


class Conversion(threading.local):
    """Convert frames to (h, w, 4) pixels and back, with the same matrix and range.

    The color conversion is ours. swscale's is darker, by one step of 8 bits unless it takes four times as long, and by
    up to 17 steps of more bits. swscale resamples chroma to the size of luma, and converts all other formats.

    Each thread keeps its converters: creating one, with its tables, costs more than converting a 1080p frame.
    libavfilter converts where it can, since its frames come from a pool. That saves the page faults of new memory for
    each frame. Its rows are padded; without padding, swscale leaves out the last pixels of some rows.
    """

    def __init__(self) -> None:
        from av.video.reformatter import Interpolation, VideoReformatter

        self._converter = VideoReformatter()
        self._quick = Interpolation.BILINEAR
        self._exact = Interpolation.BILINEAR | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT
        self._pools: dict[tuple[object, ...], Any] = {}
        self._reused: VideoFrame | None = None  # the frame before it is converted to the encoder's format

    def pixels(self, frame: VideoFrame, deep: bool, chroma: str = "center") -> Stored:
        """Convert a frame to (h, w, 4) pixels: uint8, or uint16 if ``deep``; ``chroma`` is where its chroma lies."""
        code, wide = _code(frame), _wide(frame.format.name)
        is_upright = all(plane.line_size >= plane.width for plane in frame.planes)
        dtype = np.uint16 if deep else np.uint8
        if code is not None and is_upright and _GRAY.fullmatch(frame.format.name):
            return pixels_of(_gray_planes(frame), code, dtype)
        if code is None or wide is None or not is_upright:
            return self.converted(frame, "rgba64le" if deep else "rgba", f"in_chroma_loc={chroma}").to_ndarray()
        planes = _planes(self.converted(frame, wide, f"in_chroma_loc={chroma}"))
        return pixels_of(planes, code, dtype)

    def frame(self, pixels: Stored, format: str, matrix: int, colour_range: int, chroma: str = "center") -> VideoFrame:
        """Convert contiguous (h, w, 4) pixels to a frame in a pixel format of libavutil, with its chroma at a place."""
        from av import VideoFormat, VideoFrame

        wide = _wide(format)
        if wide is not None and matrix in _MATRICES:
            frame = self._empty(pixels.shape[1], pixels.shape[0], wide, handed_out=wide == format)
            frame.colorspace, frame.color_range = matrix, colour_range
            code = _code(frame)
            assert code is not None
            to_planes(pixels, _planes(frame), code)
        else:
            if pixels.dtype == np.uint8 and VideoFormat(format, 2, 2).components[0].bits > 8:
                pixels = pixels.astype(np.uint16) * np.uint16(257)  # swscale shifts, so that white is 1020 of 1023
            frame = VideoFrame.from_numpy_buffer(pixels, "rgba64le" if pixels.dtype == np.uint16 else "rgba")
            frame.colorspace, frame.color_range = matrix, colour_range
        return self.converted(frame, format, f"out_chroma_loc={chroma}")

    def _empty(self, width: int, height: int, format: str, handed_out: bool) -> VideoFrame:
        """Return an empty frame: a new one if it is ``handed_out`` to the encoder, else one that is reused."""
        from av import VideoFrame

        if handed_out:
            return VideoFrame(width, height, format)
        frame = self._reused
        if frame is None or (frame.width, frame.height, frame.format.name) != (width, height, format):
            frame = self._reused = VideoFrame(width, height, format)
        return frame

    def converted(self, frame: VideoFrame, format: str, chroma: str = "") -> VideoFrame:
        """Convert a frame to another pixel format.

        ``chroma`` is the scale filter's option with the location of chroma. The filter ignores that of its frames, and
        takes the center without an option (libavfilter 11.14).
        """
        if frame.format.name == format:
            return frame
        matrix, colour_range = int(frame.colorspace), int(frame.color_range)
        if matrix not in _MATRICES or colour_range not in _RANGES:
            how = self._exact if _needs_rounding(frame.format.name, format) else self._quick
            return self._converter.reformat(frame, format=format, interpolation=how, threads=1)
        key = frame.width, frame.height, frame.format.name, format, matrix, colour_range, chroma
        if key not in self._pools:
            self._pools = {key: _pool(*key)}  # only the latest is kept, since a video has one size
        graph = self._pools[key]
        frame.pts, pts = 0, frame.pts
        graph.push(frame)
        frame.pts = pts
        converted: VideoFrame = graph.pull()
        converted.pts, converted.colorspace, converted.color_range = pts, matrix, colour_range
        return converted


def _pool(width: int, height: int, source: str, target: str, matrix: int, colour_range: int, chroma: str) -> Any:
    """Build a libavfilter graph that converts the pixel format of frames."""
    from av.filter import Graph

    graph = Graph()
    graph.threads = 1
    input_options = f"video_size={width}x{height}:pix_fmt={source}:time_base=1/1"
    if not source.startswith("rgb"):
        input_options += f":colorspace={matrix}:range={colour_range}"
    flags = "bilinear+accurate_rnd+full_chroma_int" if _needs_rounding(source, target) else "bilinear"
    options = f"interl=-1:flags={flags}:out_color_matrix={_MATRICES[matrix].name}:out_range={_RANGES[colour_range]}"
    options += f":{chroma}" if chroma else ""
    filters = [graph.add("buffer", input_options), graph.add("scale", options)]
    filters += [graph.add("format", f"pix_fmts={target}"), graph.add("buffersink")]
    for upstream, downstream in pairwise(filters):
        upstream.link_to(downstream)
    graph.configure()
    return graph


def _needs_rounding(source: str, target: str) -> bool:
    """Return True if swscale needs the flags for accurate rounding.

    Its fast paths make 8-bit colors darker by a step. It always rounds chroma alone. With 16-bit RGB it rounds without
    the flags, and with them its colors of yuv420p10 are wrong.
    """
    return "rgba64le" not in (source, target) and (_wide(source) is None or _wide(target) is None)


def _wide(format: str) -> str | None:
    """Return the planar 4:4:4 format of a Y'CbCr format; None for formats whose colors swscale converts."""
    if format in _INTERLEAVED:
        return _INTERLEAVED[format]
    match = _PLANAR.fullmatch(format)
    return match and f"yuv{match[1]}444p{match[2]}"


def _code(frame: VideoFrame) -> Code | None:
    matrix, colour_range = _MATRICES.get(int(frame.colorspace)), int(frame.color_range)
    if matrix is None or colour_range not in _RANGES:
        return None
    return Code(matrix.red, matrix.blue, colour_range == FULL, frame.format.components[0].bits)


def _gray_planes(frame: VideoFrame) -> list[Plane]:
    """Return luma, chroma without color, and alpha of a gray frame; swscale takes gray of limited range as full."""
    bits = frame.format.components[0].bits
    dtype = np.dtype(np.uint8 if bits == 8 else np.uint16)
    channels = len(frame.format.components)
    plane: Any = frame.planes[0]
    numbers = np.frombuffer(plane, dtype).reshape(frame.height, -1)[:, : frame.width * channels]
    luma, *alpha = np.moveaxis(numbers.reshape(frame.height, frame.width, channels), 2, 0)
    neutral = np.full(luma.shape, 1 << (bits - 1), dtype)
    return [np.ascontiguousarray(luma), neutral, neutral, *alpha]


def _planes(frame: VideoFrame) -> list[Plane]:
    """Return a frame's planes, all of its size, as arrays of its memory; the arrays keep it alive."""
    planes: tuple[Any, ...] = frame.planes
    dtype = np.uint8 if frame.format.components[0].bits == 8 else np.uint16
    return [np.frombuffer(plane, dtype).reshape(frame.height, -1)[:, : frame.width] for plane in planes]
