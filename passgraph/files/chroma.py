"""Where the chroma samples of subsampled video lie, by libavfilter's names: "left", "center", "topleft" and others."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from av.video.stream import VideoStream

#: Formats whose 4:2:0 chroma lies between four luma samples: JFIF 1.02, H.263, ISO/IEC 11172-2 (MPEG-1), VP8 (RFC
#: 6386), VP3 and Theora.
_CENTERED = ("mjpeg", "h263", "flv", "mpeg1video", "vp3", "theora", "vp6", "vp6f", "vp6a", "vp8", "libvpx")
#: Encoders of formats that say "left" (ISO/IEC 13818-2, 6.1.1.8; 14496-2), encoders whose streams say where chroma
#: lies, and containers that say it for other encoders.
_LEFT = ("mpeg2video", "mpeg4")
_STORING, _STORING_CONTAINERS = ("libx264", "libx265"), (".mkv", ".webm")
#: Encoders of AV1, whose streams say "left" or "topleft", if they say it.
_AV1 = ("libsvtav1", "libaom-av1", "librav1e")
#: H.273: matrix of BT.2020, whose chroma lies on luma samples (BT.2020-2, table 2; BT.2100).
_BT2020 = 9
#: Matroska's elements ChromaSitingHorz and ChromaSitingVert with one byte each (RFC 9559, 5.1.4.1.28.20), and its
#: values: 1 at the left or the top, 2 between.
_ACROSS, _DOWN = b"\x55\xb7\x81", b"\x55\xb8\x81"
_SITING = {(1, 2): "left", (2, 2): "center", (1, 1): "topleft", (2, 1): "top"}


def default_location(is_full: bool, matrix: int) -> str:
    """Return where readers take chroma to lie if nothing says it, as mpv does, and on luma samples for BT.2020.

    >>> default_location(False, 1), default_location(True, 1), default_location(False, 9)
    ('left', 'center', 'topleft')
    """
    return "topleft" if matrix == _BT2020 else "center" if is_full else "left"


def location_of(stream: VideoStream, decoder: str, is_full: bool, matrix: int) -> str:
    """Return where the chroma of a stream lies: as the file says it, or its format, or where readers take it.

    Parameters
    ----------
    decoder : libavcodec's name
    is_full : True for full range
    matrix : of H.273
    """
    if decoder in _CENTERED:
        return "center"
    if stream.container.format.name == "yuv4mpegpipe":
        is_full = True  # without a tag it is C420jpeg, by the format's definition in MJPEG tools
    return _said(stream) or default_location(is_full, matrix)


def _said(stream: VideoStream) -> str | None:
    """Return what the stream or its container says; None if nothing.

    PyAV 18.1 does not expose libavcodec's ``chroma_sample_location``, but the header of a Matroska file with the
    parameters of the stream has it.
    """
    import av

    header = BytesIO()
    try:
        with av.open(header, "w", format="matroska", options={"allow_raw_vfw": "1"}) as container:
            container.add_stream_from_template(stream, opaque=True).metadata.clear()  # it may be no text
            container.start_encoding()
            data = header.getvalue()
    except (av.error.FFmpegError, ValueError):
        return None  # no stream of such a file
    across, down = data.find(_ACROSS), data.find(_DOWN)
    return None if across < 0 or down < 0 else _SITING.get((data[across + 3], data[down + 3]))


def location_to_write(encoder: str, suffix: str, source: str | None, is_full: bool, matrix: int) -> str:
    """Return where an encoder's file has its chroma: as the source if the file says it, else where readers take it."""
    if encoder in _CENTERED:
        return "center"
    if encoder in _LEFT:
        return "left"
    is_stored = encoder in _STORING or suffix in _STORING_CONTAINERS
    if source is not None and is_stored and (encoder not in _AV1 or source in ("left", "topleft")):
        return source
    return default_location(is_full, matrix)
