"""Where the chroma samples of subsampled video lie, by libavfilter's names: "left", "center", "topleft" and others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from av.video.frame import VideoFrame

#: Decoders of formats whose 4:2:0 chroma lies between four luma samples: JFIF 1.02, H.263, ISO/IEC 11172-2 (MPEG-1),
#: VP8 (RFC 6386), VP3 and Theora.
_CENTERED = ("mjpeg", "h263", "flv", "mpeg1video", "vp3", "theora", "vp6", "vp6f", "vp6a", "vp8", "libvpx")
#: Other decoders that always say where chroma lies, by the stream or its format's default. The rest say nothing unless
#: the container does, and swscale takes that as the center.
_SAYING = ("h264", "hevc", "mpeg2video", "mpeg4")
#: Containers that always do.
_SAYING_CONTAINERS = ("yuv4mpegpipe",)
#: Encoders of formats that say "left" (ISO/IEC 13818-2, 6.1.1.8; 14496-2), and encoders whose streams say it.
_LEFT = ("mpeg2video", "mpeg4")
_STORING = ("libx264", "libx265")
#: H.273: matrix of BT.2020, whose chroma lies on luma samples (BT.2020-2, table 2; BT.2100).
_BT2020 = 9
#: Size of the picture by which the location is measured, the step of its ramps, and the column and row that are read.
_SIDE, _STEP, _AT = 16, 16, 8
#: Blue-difference there, of a ramp across, and red-difference, of a ramp down, by location. At the center, sample 8 of
#: luma is at 3.75 of chroma.
_MEASURED = {
    (64, 60): "left", (60, 60): "center", (64, 64): "topleft", (60, 64): "top", (64, 56): "bottomleft",
    (60, 56): "bottom",
}  # fmt: skip


def is_subsampled(format: Any) -> bool:
    """Return True if a pixel format of PyAV has fewer chroma samples than luma samples."""
    return bool(format.chroma_width(64) < 64 or format.chroma_height(64) < 64)


def default_location(is_full: bool, matrix: int) -> str:
    """Return where readers take chroma to lie if nothing says it, as mpv does, and on luma samples for BT.2020.

    >>> default_location(False, 1), default_location(True, 1), default_location(False, 9)
    ('left', 'center', 'topleft')
    """
    return "topleft" if matrix == _BT2020 else "center" if is_full else "left"


def location_of(frame: VideoFrame, decoder: str, container: str, is_full: bool) -> str:
    """Return where the chroma of a decoded frame lies.

    PyAV does not expose ``AVFrame.chroma_location``, but swscale's frames interface, which `VideoReformatter` calls,
    honors it: ramps in a small frame with the same properties show it.

    Parameters
    ----------
    decoder, container : libav's names
    is_full : True for full range
    """
    if not is_subsampled(frame.format):
        return "center"
    if decoder in _CENTERED:
        return "center"
    found = _measured(frame)
    is_said = decoder in _SAYING or container in _SAYING_CONTAINERS
    return found if is_said or found != "center" else default_location(is_full, int(frame.colorspace))


def _measured(frame: VideoFrame) -> str:
    from av.video.reformatter import Colorspace, Interpolation, VideoReformatter

    # A frame of the same size and format would be returned as it is, in the decoder's memory.
    side = 2 * _SIDE if frame.width == _SIDE else _SIDE
    matrix = Colorspace.ITU709  # any, since swscale refuses unknown ones
    small = VideoReformatter().reformat(
        frame,
        side,
        side,
        "yuv420p",
        interpolation=Interpolation.POINT,
        threads=1,
        src_colorspace=matrix,
        dst_colorspace=matrix,
    )
    ramp = np.arange(side // 2, dtype=np.uint8) * _STEP
    for plane, values in zip(small.planes[1:], (ramp[None, :], ramp[:, None]), strict=True):
        rows = np.zeros((plane.height, plane.line_size), np.uint8)
        rows[:, : plane.width] = values
        plane.update(rows.tobytes())
    wide = VideoReformatter().reformat(small, format="yuv444p", interpolation=Interpolation.BILINEAR, threads=1)
    planes: Any = wide.planes
    blue, red = (int(np.frombuffer(plane, np.uint8).reshape(side, -1)[_AT, _AT]) for plane in planes[1:])
    nearest = min(_MEASURED, key=lambda known: abs(known[0] - blue) + abs(known[1] - red))
    return _MEASURED[nearest]


def location_to_write(encoder: str, source: str | None, is_full: bool, matrix: int) -> str:
    """Return where an encoder's file has its chroma: as the source if the file says it, else where readers take it."""
    if encoder in _CENTERED:
        return "center"
    if encoder in _LEFT:
        return "left"
    if source is not None and encoder in _STORING:
        return source
    return default_location(is_full, matrix)
