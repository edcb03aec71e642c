"""What made each output: a record beside the outputs, by which a run goes on only from what it would make itself.

The record is a file of JSON lines in the outputs' folder. A line has the key of an output, a digest of all that its
pixels depend on, with the file's size and modification time; of a film also the key of each frame that was encoded.
Lines are only appended, so that several processes can fill one folder.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from passgraph.files.animation import Animation
from passgraph.files.digests import digest
from passgraph.files.frame import Frame, Source
from passgraph.files.pipe import Pipe
from passgraph.files.sequences import Held
from passgraph.files.video import Video
from passgraph.run.program import Program
from passgraph.version import __version__
from passgraph.writing import NewFile

#: Name of a folder's record.
NAME = ".passgraph-made.jsonl"
#: Lines that may be out of date before a record is written anew.
_MOST_OLD = 1000


@dataclass(frozen=True)
class File:
    """A complete output: its key, its size in bytes, its modification time, and the frames of a film."""

    key: str
    size: int
    modified: int
    frames: int = 1


@dataclass
class Outputs:
    """The outputs that a record names: complete files, and the keys of each film's frames, by name."""

    files: dict[str, File] = field(default_factory=dict)
    films: dict[str, list[str]] = field(default_factory=dict)
    lines: int = 0

    def take(self, line: bytes) -> None:
        """Take a line of a record; one that is cut or not understood means nothing."""
        self.lines += 1
        try:
            entry = json.loads(line)
            name, key, frames = str(entry["file"]), str(entry["key"]), int(entry.get("frames", 1))
            if "bytes" in entry:
                self.files[name] = File(key, int(entry["bytes"]), int(entry["modified"]), frames)
                self.films.pop(name, None)
            else:
                known = self.films.setdefault(name, [])
                if len(known) >= frames - 1 >= 0:
                    known[frames - 1 :] = [key]
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            return

    def text(self) -> str:
        """Return the lines with the same content."""
        entries = [_of_file(name, file) for name, file in self.files.items()]
        for name, keys in self.films.items():
            entries += [_of_frame(name, number, key) for number, key in enumerate(keys, 1)]
        return "".join(entries)


def _of_file(name: str, file: File) -> str:
    entry = {"file": name, "key": file.key, "frames": file.frames, "bytes": file.size, "modified": file.modified}
    return json.dumps(entry) + "\n"


def _of_frame(name: str, number: int, key: str) -> str:
    return json.dumps({"file": name, "key": key, "frames": number}) + "\n"


class Made:
    """The records of the folders that a run writes into. A record that cannot be read or written means nothing."""

    def __init__(self) -> None:
        self._outputs: dict[Path, Outputs] = {}
        self._streams: dict[Path, IO[bytes]] = {}

    def holds(self, path: Path, key: str, frames: int = 1) -> bool:
        """Return True if a file is complete, as it was written, and was made by what has this key."""
        file = self._of(path).files.get(path.name)
        return file is not None and file == _file(path, key, frames)

    def frames(self, path: Path) -> int:
        """Return the number of frames of a complete film; 0 if it is not known."""
        file = self._of(path).files.get(path.name)
        return 0 if file is None else file.frames

    def film_keys(self, path: Path) -> list[str]:
        """Return the keys of the frames of an incomplete film, in order."""
        return list(self._of(path).films.get(path.name, ()))

    def add(self, path: Path, key: str, frames: int = 1) -> None:
        """Record a complete file."""
        file = _file(path, key, frames)
        if file is not None:
            self._append(path, _of_file(path.name, file))

    def add_frame(self, path: Path, number: int, key: str) -> None:
        """Record a frame of a film, by its number from 1; those after it are no longer named."""
        self._append(path, _of_frame(path.name, number, key))

    def close(self) -> None:
        for stream in self._streams.values():
            with suppress(OSError):
                stream.close()
        self._streams.clear()

    def _of(self, path: Path) -> Outputs:
        folder = path.parent
        if folder not in self._outputs:
            outputs = self._outputs[folder] = Outputs()
            with suppress(OSError), (folder / NAME).open("rb") as stream:
                for line in stream:
                    outputs.take(line)
        return self._outputs[folder]

    def _append(self, path: Path, line: str) -> None:
        outputs = self._of(path)
        outputs.take(line.encode())
        # The frame is written: a record without it only means that it is computed again.
        with suppress(OSError):
            stream = self._stream(path.parent, outputs)
            stream.write(line.encode())
            stream.flush()

    def _stream(self, folder: Path, outputs: Outputs) -> IO[bytes]:
        if folder not in self._streams:
            record = folder / NAME
            kept = len(outputs.files) + sum(map(len, outputs.films.values()))
            if outputs.lines > 2 * kept + _MOST_OLD:
                with NewFile(record) as new_file:
                    new_file.temporary.write_text(outputs.text(), encoding="utf-8")
                    new_file.complete()
            stream = self._streams[folder] = record.open("ab")
            if stream.tell():
                stream.write(b"\n")  # after a line that was cut
        return self._streams[folder]


def _file(path: Path, key: str, frames: int) -> File | None:
    """Describe a file as it is on the disk; None if it does not exist."""
    try:
        status = path.stat()
    except OSError:
        return None
    return File(key, status.st_size, status.st_mtime_ns, frames)


class Keys:
    """The keys of a run's frames: digests of graph, settings, inputs, values and version.

    ``follows`` is True if a frame depends on those before it: its key then holds theirs.
    """

    def __init__(self, program: Program, settings: Mapping[str, Any], *, follows: bool) -> None:
        compiled = {name: value for name, value in program.settings().items() if name != "memory"}
        overrides = [[*place, value] for place, value in sorted(program._overrides.items())]
        self._base = digest([__version__, program.to_data(), compiled, settings, overrides])
        self._follows = follows
        self._last = ""

    def next(self, frames: Mapping[str, Frame], values: object) -> str:
        """Return the key of the next frame, which is made of a frame of each source and of run values."""
        states = {name: frame.name if frame.state is None else frame.state() for name, frame in frames.items()}
        key = digest([self._base, self._last, states, values])
        if self._follows:
            self._last = key
        return key


def unread(source: Source, count: int) -> Iterator[Frame]:
    """Yield the frames of a source for their keys, without decoding it: of a film ``count``, of a stream none."""
    if isinstance(source, Pipe):
        return iter(())
    if isinstance(source, (Animation, Video)):
        return (Frame.unread(source.path, number) for number in range(1, count + 1))
    if isinstance(source, Held):
        return source.held(unread(source.source, count), lambda _: None)
    inner = getattr(source, "source", None)  # of one that converts pixels
    return iter(source) if inner is None else unread(inner, count)
