"""Incomplete videos that play: how they are written, and the frames from which encoding goes on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import accumulate
from math import ceil
from pathlib import Path
from typing import Any

from passgraph.files.video import OPENING, import_av, open_container

#: Options of containers whose incomplete files play. MP4 is written in fragments of a second, and becomes a usual file
#: when it is closed (libavformat's documentation of hybrid_fragmented); without delay_moov its times begin late.
#: Matroska gets clusters of a second. Each packet reaches the file at once.
_FLUSHED = {"flush_packets": "1"}
_FRAGMENTS = {"movflags": "hybrid_fragmented+delay_moov", "frag_duration": "1000000", **_FLUSHED}
_CLUSTERS = {"cluster_time_limit": "1000", **_FLUSHED}
OPTIONS = dict.fromkeys((".mp4", ".mov", ".m4v"), _FRAGMENTS) | dict.fromkeys((".mkv", ".webm"), _CLUSTERS)
#: Encoders with packets that are no frame of their own, so that packets do not count frames.
_HIDDEN_FRAMES = ("vp8", "libvpx")
#: Bitstream filters to the form that encoders give, from that of files (ISO/IEC 14496-15).
_FILTERS = {"h264": "h264_mp4toannexb", "hevc": "hevc_mp4toannexb"}


@dataclass(frozen=True)
class FirstPackets:
    """The packets of an incomplete video to go on from: their times in the file's order, in units of its stream.

    Each is a frame, and together they are the first frames without a gap. There may be none.
    """

    path: Path
    times: tuple[int, ...] = ()

    def __len__(self) -> int:
        return len(self.times)

    def as_encoded(self, delay: Fraction) -> Iterator[Any]:
        """Yield the packets as their encoder gave them, each to be decoded at least ``delay`` seconds before its turn.

        Files lack some decoding times, and an encoder that goes on places its first packets before the last ones of
        another; so all are made anew.
        """
        av = import_av(self.path)
        with open_container(av, self.path, options=OPENING) as container:
            stream = container.streams.video[0]
            name = _FILTERS.get(stream.codec_context.name)
            convert = None if name is None else av.bitstream.BitStreamFilterContext(name, stream)
            shown = sorted(self.times)
            late = max(ordered - time for ordered, time in zip(shown, self.times, strict=True))
            late = max(late, ceil(delay / stream.time_base))
            for ordered, packet in zip(shown, container.demux(stream), strict=False):
                packet.dts = ordered - late
                yield from [packet] if convert is None else convert.filter(packet)


def first_packets(path: Path) -> FirstPackets:
    """Return the packets of an incomplete video up to which no frame is missing; none if it cannot be read on.

    Frames that are predicted from later ones come after those in the file. So the packets end where every later one
    has a later time, and the last of the file are left out.
    """
    none = FirstPackets(path)
    if path.suffix.lower() not in OPTIONS or not path.is_file():
        return none
    av, times = import_av(path), list[int]()
    try:
        with open_container(av, path, options=OPENING) as container:
            stream = container.streams.video[0]
            if stream.codec_context.name in _HIDDEN_FRAMES:
                return none
            for packet in container.demux(stream):
                if not packet.size or packet.pts is None or packet.is_corrupt:
                    break
                times.append(packet.pts)
    except (av.error.FFmpegError, IndexError):  # its end is cut, or it has no video
        pass
    latest = list(accumulate(times, max))
    to_come = list(accumulate(reversed(times), min))[::-1]
    counts = (count for count in range(len(times) - 1, 0, -1) if latest[count - 1] < to_come[count])
    return replace(none, times=tuple(times[: next(counts, 0)]))
