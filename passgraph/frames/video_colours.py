"""How colours go into a video, so that those come out again who reads it: not every file says how they are coded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from passgraph.frames.video import BT709, RGB, UNSPECIFIED, stated
from passgraph.frames.video_pixels import FULL, LIMITED, is_matrix

if TYPE_CHECKING:
    from passgraph.frames.video import Video

#: Encoders whose streams say matrix and range; in containers that say both, those of others are told too.
_SAYING = ("libx26", "libvpx-vp9", "libsvtav1", "libaom", "librav1e", "h264_", "hevc_", "vp9_", "av1_")
_SAYING_CONTAINERS = (".mkv", ".webm")
#: Encoders whose streams say the matrix, and are of limited range whatever containers say (ISO/IEC 13818-2, 6.3.6;
#: SMPTE RDD 36, 5.1.1).
_OF_LIMITED_RANGE = ("mpeg2video", "prores")
#: Those whose decoders know one matrix and range: BT.601 by another of its numbers (JFIF 1.02; RFC 6386, 9.2).
_FIXED = {"mjpeg": (5, FULL), "libvpx": (5, LIMITED)}


class Coding(NamedTuple):
    """Matrix and range of a video's pixels, by their numbers in libavutil, and the matrix that the file says."""

    matrix: int
    colour_range: int
    said: int


def coding_of(encoder: str, suffix: str, form: Any, source: Video | None, height: int) -> Coding:
    """What readers will take colours for that an encoder writes into a file with this suffix.

    Parameters
    ----------
    encoder : by libavcodec's name
    form : the pixel format that it is given, PyAV's
    source : a video whose coding is kept where it can be said
    height : lines of a picture
    """
    if form.is_rgb:
        return Coding(BT709, FULL, RGB)
    matrix, colour_range = UNSPECIFIED, FULL if form.name.startswith("yuvj") else 0
    if source is not None and source.has_chroma:
        matrix, colour_range = source.matrix, stated(source.matrix, source.colour_range, source.format, height)[1]
    if sum(not part.is_alpha for part in form.components) == 1:
        colour_range = FULL  # of grey alone libswscale makes and reads nothing else
    if encoder in _FIXED:
        matrix, colour_range = _FIXED[encoder]
    elif encoder.startswith(_OF_LIMITED_RANGE):
        colour_range = LIMITED
    elif not encoder.startswith(_SAYING) and suffix not in _SAYING_CONTAINERS:
        matrix, colour_range = UNSPECIFIED, colour_range if form.name.startswith(("gray", "ya", "yuvj")) else LIMITED
    said = matrix if is_matrix(matrix) else UNSPECIFIED
    return Coding(*stated(said, colour_range, form.name, height), said)
