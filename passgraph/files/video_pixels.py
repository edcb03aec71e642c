# mypy: disable-error-code="no-any-return"
"""Frames of videos as pixels, and pixels as frames in a video's own format."""

from __future__ import annotations

import re
import threading
from collections.abc import Sequence
from dataclasses import dataclass
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
    """How whole numbers stand for colors.

    Attributes
    ----------
    red, blue : what luma weighs them; green has the rest
    full : luma from 0 to the largest number, and not from 16 to 235 (of 8 bits)
    bits : of a number, 8 to 16
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
        """What both programs are given: zero and scale of luma and of chroma, where the type's largest number is 1."""
        step = 1 << (self.bits - 8)
        zero, luma, chroma = (0, self.most, self.most) if self.full else (16 * step, 219 * step, 224 * step)
        one = 255 if self.bits == 8 else 65535
        of_red, of_blue = 2 - 2 * self.red, 2 - 2 * self.blue
        green = 1 - self.red - self.blue
        return {
            "zero": (zero / one, 128 * step / one),
            "scale": (luma / one, chroma / one),
            "most": self.most / one,
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
    """Y', Cb, Cr and perhaps alpha, all of one size, as pixels: each number the nearest to its color."""
    values = code.values()
    del values["weights"], values["most"]
    pixels: Any = _reader(planes[0].itemsize, np.dtype(dtype).itemsize)(
        luma=planes[0], blue=planes[1], red=planes[2], **values
    )["pixels"]
    if len(planes) == 4:
        pixels[..., 3] = _rescaled(planes[3], code.most, np.iinfo(dtype).max)
    made: Pixels = pixels
    return made


def to_planes(pixels: Pixels, planes: Sequence[Plane], code: Code) -> None:
    """Pixels into Y', Cb, Cr and perhaps alpha, of their size."""
    _writer(pixels.itemsize, planes[0].itemsize)(
        pixels=pixels, into=dict(zip(_NAMES, planes, strict=False)), **code.values()
    )
    if len(planes) == 4:
        planes[3][...] = _rescaled(pixels[..., 3], np.iinfo(pixels.dtype).max, code.most)


def _rescaled(numbers: NDArray[Any], most: int, wanted: int) -> NDArray[Any]:
    """Alpha from 0 to ``most`` as the nearest from 0 to ``wanted``."""
    return numbers if most == wanted else (numbers.astype(np.uint32) * wanted + most // 2) // most


_NAMES = ("luma", "blue", "red")
_VALUES: Any = {name: Value(name) for name in ("zero", "scale", "by_blue", "by_red")}


@cache
def _reader(from_bytes: int, to_bytes: int) -> Program:
    """Compiled once a process, for all threads."""
    luma, blue, red = (Input(name, f"r{8 * from_bytes}") for name in _NAMES)
    made = _colours(luma, blue, red, **_VALUES, into=target("pixels", f"rgba{8 * to_bytes}", like=luma))
    return compile(made, "numpy", results="stored")


@cache
def _writer(from_bytes: int, to_bytes: int) -> Program:
    pixels = Input("pixels", f"rgba{8 * from_bytes}")
    into = [target(name, f"r{8 * to_bytes}", like=pixels) for name in _NAMES]
    more: Any = {name: Value(name) for name in ("weights", "most")}
    return compile(_ycbcr_planes(pixels, **more, **_VALUES, into=into), "numpy", results="stored")


#: Numbers of libavutil's AVColorRange: 16 to 235, and 0 to 255.
LIMITED, FULL = 1, 2
_RANGES = {LIMITED: "tv", FULL: "pc"}
#: Y'CbCr in planes, of 8 bits or as many as the name ends with.
_PLANAR = re.compile(r"yuv(a|j|)4(?:10|11|20|22|40|44)p(|(?:9|10|12|14|16)le)")


class Matrix(NamedTuple):
    """What libavfilter calls it, and what luma weighs red and blue."""

    name: str
    red: float
    blue: float


#: By their numbers in ITU-T H.273, table 4.
_MATRICES = {
    1: Matrix("bt709", 0.2126, 0.0722), 4: Matrix("fcc", 0.30, 0.11), 5: Matrix("bt470bg", 0.299, 0.114),
    6: Matrix("smpte170m", 0.299, 0.114), 7: Matrix("smpte240m", 0.212, 0.087), 9: Matrix("bt2020nc", 0.2627, 0.0593),
}  # fmt: skip


def is_matrix(number: int) -> bool:
    """Whether colours are converted by this matrix."""
    return number in _MATRICES


class Conversion(threading.local):
    """Frames to (h, w, 4) pixels and back, of the same matrix and range.

    Colors are ours, since swscale makes them darker: of 8 bits by a step of 255, or it takes four times as long, and of
    more bits by up to 17 of their steps.  It makes chroma as wide as luma, and does all of the rest.  Each thread
    keeps what converts, with its tables: a new one costs a 1080p frame more than its pixels do.  Where libavfilter can
    do it, it does, since its frames come from a pool: no memory that the system has to make ready, page by page, for
    each frame, and rows with room behind them, without which swscale leaves out the last pixels of some.
    """

    def __init__(self) -> None:
        from av.video.reformatter import Interpolation, VideoReformatter

        self._converter = VideoReformatter()
        self._quick = Interpolation.BILINEAR
        self._exact = Interpolation.BILINEAR | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT
        self._pools: dict[tuple[object, ...], Any] = {}
        self._kept: VideoFrame | None = None  # what goes on to the encoder in another format

    def pixels(self, frame: VideoFrame, deep: bool) -> Stored:
        """(h, w, 4) uint8, or uint16 where it is ``deep``."""
        code, wide = _code(frame), _wide(frame.format.name)
        is_upright = all(plane.line_size >= plane.width for plane in frame.planes)
        if code is None or wide is None or not is_upright:
            return self.converted(frame, "rgba64le" if deep else "rgba").to_ndarray()
        return pixels_of(_planes(self.converted(frame, wide)), code, np.uint16 if deep else np.uint8)

    def frame(self, pixels: Stored, format: str, matrix: int, colour_range: int) -> VideoFrame:
        """A frame in a pixel format by libavutil's name, of contiguous (h, w, 4) pixels."""
        from av import VideoFrame

        wide = _wide(format)
        if wide is not None and matrix in _MATRICES:
            made = self._empty(pixels.shape[1], pixels.shape[0], wide, handed_out=wide == format)
            made.colorspace, made.color_range = matrix, colour_range
            code = _code(made)
            assert code is not None
            to_planes(pixels, _planes(made), code)
        else:
            made = VideoFrame.from_numpy_buffer(pixels, "rgba64le" if pixels.dtype == np.uint16 else "rgba")
            made.colorspace, made.color_range = matrix, colour_range
        return self.converted(made, format)

    def _empty(self, width: int, height: int, format: str, handed_out: bool) -> VideoFrame:
        from av import VideoFrame

        if handed_out:
            return VideoFrame(width, height, format)
        kept = self._kept
        if kept is None or (kept.width, kept.height, kept.format.name) != (width, height, format):
            kept = self._kept = VideoFrame(width, height, format)
        return kept

    def converted(self, frame: VideoFrame, format: str) -> VideoFrame:
        """A frame in another pixel format."""
        if frame.format.name == format:
            return frame
        matrix, colour_range = int(frame.colorspace), int(frame.color_range)
        if matrix not in _MATRICES or colour_range not in _RANGES:
            how = self._exact if _needs_rounding(frame.format.name, format) else self._quick
            return self._converter.reformat(frame, format=format, interpolation=how, threads=1)
        key = frame.width, frame.height, frame.format.name, format, matrix, colour_range
        if key not in self._pools:
            self._pools = {key: _pool(*key)}  # one at a time: a video has one size
        graph = self._pools[key]
        frame.pts, pts = 0, frame.pts
        graph.push(frame)
        frame.pts = pts
        made: VideoFrame = graph.pull()
        made.pts, made.colorspace, made.color_range = pts, matrix, colour_range
        return made


def _pool(width: int, height: int, source: str, target: str, matrix: int, colour_range: int) -> Any:
    """A graph of libavfilter's that converts frames."""
    from av.filter import Graph

    graph = Graph()
    graph.threads = 1
    given = f"video_size={width}x{height}:pix_fmt={source}:time_base=1/1"
    if not source.startswith("rgb"):
        given += f":colorspace={matrix}:range={colour_range}"
    flags = "bilinear+accurate_rnd+full_chroma_int" if _needs_rounding(source, target) else "bilinear"
    options = f"interl=-1:flags={flags}:out_color_matrix={_MATRICES[matrix].name}:out_range={_RANGES[colour_range]}"
    parts = [graph.add("buffer", given), graph.add("scale", options)]
    parts += [graph.add("format", f"pix_fmts={target}"), graph.add("buffersink")]
    for one, other in pairwise(parts):
        one.link_to(other)
    graph.configure()
    return graph


def _needs_rounding(source: str, target: str) -> bool:
    """Whether swscale is to be told to round.

    Where it makes colours of 8 bits its quick ways make them darker by a step of 255.  Chroma alone it rounds, and with
    16 bits on the way it does so by itself, and is wrong about the colours of yuv420p10 where it is told.
    """
    return "rgba64le" not in (source, target) and (_wide(source) is None or _wide(target) is None)


def _wide(format: str) -> str | None:
    """The format with chroma as wide as luma, where ours are the colors."""
    found = _PLANAR.fullmatch(format)
    return found and f"yuv{found[1]}444p{found[2]}"


def _code(frame: VideoFrame) -> Code | None:
    matrix, colour_range = _MATRICES.get(int(frame.colorspace)), int(frame.color_range)
    if matrix is None or colour_range not in _RANGES:
        return None
    return Code(matrix.red, matrix.blue, colour_range == FULL, frame.format.components[0].bits)


def _planes(frame: VideoFrame) -> list[Plane]:
    """A frame's own memory, of planes that are all of its size; the arrays keep it alive."""
    planes: tuple[Any, ...] = frame.planes
    dtype = np.uint8 if frame.format.components[0].bits == 8 else np.uint16
    return [np.frombuffer(plane, dtype).reshape(frame.height, -1)[:, : frame.width] for plane in planes]
