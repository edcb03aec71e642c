"""Sound and subtitles of a video, copied into another as they are."""

from __future__ import annotations

import os
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

from passgraph.errors import InputError
from passgraph.frames.video import OPENING, import_av, opened


def check_sound(path: Path, container: Any, into: Path) -> None:
    """Refuse sound that a container cannot hold: libav would find out when frames are made already."""
    with opened(path) as given:
        for stream in given.streams:
            if stream.type in ("audio", "subtitle") and stream.codec_context is not None:
                codec = stream.codec_context.codec
                if not {codec.name, codec.canonical_name} & container.supported_codecs:
                    raise InputError(
                        f"{into}: cannot hold the {stream.type} of {path} as it is ({codec.name}); choose another "
                        "suffix, such as .mkv, or leave it out (--no-sound)"
                    )


class Sound:
    """Packets of a file's sound, given out until a time; the file is read a second time for them.

    So sound and pictures need not wait for each other, however they lie in the file.

    Parameters
    ----------
    path : the file with the sound
    container : the one that it goes to, to which streams are added
    """

    def __init__(self, path: Path, container: Any) -> None:
        self._av = import_av(path)
        self._container = self._av.open(os.fspath(path), metadata_errors="replace", options=OPENING)
        self._streams: dict[int, Any] = {}
        for stream in self._container.streams:
            if stream.type in ("audio", "subtitle") and stream.codec_context is not None:
                self._streams[stream.index] = container.add_stream_from_template(stream, opaque=True)
        kept = [self._container.streams[index] for index in self._streams]
        self._packets = iter(self._container.demux(kept)) if kept else iter(())
        self._next: Any = None

    def until(self, seconds: Fraction | None) -> Iterator[Any]:
        """Packets until a time in order, or all that are left; a file that breaks off ends them."""
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
