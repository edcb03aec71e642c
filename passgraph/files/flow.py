"""The frame pipeline of a run: load frames ahead, compute them in order, store the results, and record failures."""

from __future__ import annotations

import errno
import itertools
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import field
from time import perf_counter
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np

from passgraph import arguments
from passgraph.errors import InputError, PassgraphError
from passgraph.files.film import Film
from passgraph.files.frame import Frame, Outcome, OutputError, Sink, Source, Stored, Summary
from passgraph.files.frame_range import FrameRange
from passgraph.files.made import Keys, Made, unread
from passgraph.files.stored import as_program_input, stored
from passgraph.graph.run_values import FRAME_INDEX
from passgraph.proxies import reduced, sampled
from passgraph.records import dataclass
from passgraph.run.program import Program

Item = TypeVar("Item")


class Ahead(Generic[Item]):
    """Iterate over ``(item, future of function(item))``, with at most ``depth`` items submitted ahead of the consumer.

    This bounds the memory that the items take. Without a pool each item is computed when it is reached.
    """

    def __init__(
        self, pool: Executor | None, function: Callable[[Item], Any], items: Iterable[Item], depth: int
    ) -> None:
        self._pool, self._function, self._items, self._depth = pool, function, items, depth
        self._begun: deque[tuple[Item, Future[Any]]] = deque()

    def __iter__(self) -> Iterator[tuple[Item, Future[Any]]]:
        for item in self._items:
            self._begun.append((item, self._begin(item)))
            if self._pool is None or len(self._begun) > self._depth:
                yield self._begun.popleft()
        while self._begun:
            yield self._begun.popleft()

    def cancel(self) -> Iterator[tuple[Item, Future[Any]]]:
        """Cancel the futures that have not started; yield the others in order."""
        begun = [(item, future) for item, future in self._begun if not future.cancel()]
        self._begun.clear()
        yield from begun

    def _begin(self, item: Item) -> Future[Any]:
        if self._pool is not None:
            return self._pool.submit(self._function, item)
        future: Future[Any] = Future()
        try:
            future.set_result(self._function(item))
        except Exception as error:
            future.set_exception(error)
        return future


Values: TypeAlias = "Mapping[str, Any] | Callable[[int], Mapping[str, Any]]"
Watch: TypeAlias = Callable[[Outcome], None]
#: Errors of a full or read-only disk, which end the run: every later frame would fail too.
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)


@dataclass
class Run:
    """A run of a program over frames: its sources, its sink, and the outcomes so far."""

    program: Program
    sources: dict[str, Source]
    sink: Sink
    values: Values | None
    output: str | None
    linear: bool
    resume: bool
    same_size: bool
    watch: Watch | None
    select: FrameRange | None = None
    proxy: int = 1
    written: int = 0
    kept: int = 0
    remade: int = 0
    failed: list[Outcome] = field(default_factory=list)
    stopped: str = ""
    size: tuple[int, int] | None = None
    ran: int = 0
    is_full: bool = False
    sizes: dict[str, tuple[int, int]] = field(default_factory=dict)
    first: int = 0  # number of the first frame
    made: Made = field(default_factory=Made)
    done: int = 0  # frames that an incomplete film has already
    last_key: str = ""

    def all(self, jobs: int) -> Summary:
        start = perf_counter()
        with closing(self.made):
            if self.resume and isinstance(self.sink, Film) and (frames := self._frames_of_film(self.sink)):
                return Summary(kept=frames)
            self.sink.begin(next(iter(self.sources.values())))
            with ExitStack() as stack:
                pool = stack.enter_context(ThreadPoolExecutor(jobs, "passgraph_frames")) if jobs > 1 else None
                loading = Ahead(pool, self._load, self._frames_to_load(), jobs)
                storing = Ahead(pool, self._prepare, self._computed(loading), jobs)
                try:
                    self._take_all(storing)
                except BaseException:
                    self._cancel_rest(loading, storing)
                    self.sink.abandon()
                    raise
                self._cancel_rest(loading, storing)
            self._end()
        seconds = perf_counter() - start
        return Summary(self.written, self.kept, tuple(self.failed), self.stopped, self.size, seconds, self.remade)

    def _new_keys(self) -> Keys | None:
        """Return the keys of the frames from the first on; None for a program that is no data."""
        values = self.values or {}
        settings = {
            "sink": self.sink.stored_as(), "output": self.output, "linear": self.linear,
            "values": "" if callable(values) else values, "proxy": self.proxy,
        }  # fmt: skip
        follows = self.program.has_history or self.sink.is_one_file
        try:
            return Keys(self.program, settings, follows=follows)
        except PassgraphError:
            return None

    def _frames_of_film(self, film: Film) -> int:
        """Return the number of frames if the film is complete and this run would make the same; else 0.

        Of an incomplete one, ``done`` is set to the frames that the film goes on from.
        """
        if frames := self.made.frames(film.path):
            keys = self._keys_ahead(frames)
            if len(keys) == frames and self.made.holds(film.path, keys[-1], frames):
                return frames
        if encoded := film.encoded():
            keys = self._keys_ahead(encoded)[:encoded]
            if keys and keys == self.made.film_keys(film.path)[:encoded]:
                self.done = encoded
                film.go_on()
        return 0

    def _keys_ahead(self, frames: int) -> list[str]:
        """Return the keys of a number of frames from the first on, and of one more if there are more; [] if unknown."""
        keys, found, began = self._new_keys(), list[str](), False
        numbers = frames if self.select is None else max(frames, self.select.last)
        try:
            for together in _in_step(self.sources, lambda source: unread(source, numbers)):
                first = next(iter(together.values()))
                self.first, began = self.first if began else first.number, True
                if keys is None or len(found) > frames or (self.select and first.number > self.select.last):
                    break
                if self.select is None or first.number in self.select or self.program.has_history:
                    key = keys.next(together, self._changing(first.number))
                    found += [key] if self.select is None or first.number in self.select else []
        except PassgraphError:  # the run itself raises it where it gets there
            return []
        return found

    def _changing(self, number: int) -> dict[str, Any]:
        """Return the values of a frame's run that are not the same for all."""
        values = self._values(number)
        if callable(self.values):
            return values
        return {FRAME_INDEX.name: values[FRAME_INDEX.name]} if self.program.has_frame_index else {}

    # The stages that follow are in the order in which a frame passes through them.

    def _frames_to_load(self) -> Iterator[_Loading]:
        """Yield the frames of all sources in step.

        With ``resume``, a frame whose output exists is skipped unless the program has history.
        """
        began, keys, index = False, self._new_keys(), 0
        try:
            for frames in _in_step(self.sources):
                first = next(iter(frames.values()))
                self.first, began = self.first if began else first.number, True
                is_wanted = self.select is None or first.number in self.select
                if self.select is not None and first.number > self.select.last:
                    return
                if not is_wanted and not self.program.has_history:
                    continue
                values: dict[str, Any] | Exception
                try:
                    values, changing = self._values(first.number), self._changing(first.number)
                except Exception as error:  # that of one frame: raised where it is computed
                    values, changing = error, {}
                key = "" if keys is None else keys.next(frames, changing)
                is_there, resumed = self._is_there(first, index, key) if is_wanted else (False, True)
                index += is_wanted
                skipped = resumed and not self.program.has_history
                yield _Loading(first, frames, values, key, is_there, resumed, skipped, is_wanted)
        except InputError as error:
            if not began:
                raise
            self.stopped = str(error)

    def _is_there(self, frame: Frame, index: int, key: str) -> tuple[bool, bool]:
        """Return whether an output of a frame exists, and whether ``resume`` keeps it: if this run would make it."""
        if not self.resume:
            return False, False
        if isinstance(self.sink, Film):
            return self.sink.path.exists(), index < self.done
        file = self.sink.file(frame)
        if file is None:
            return False, self.sink.holds(frame)
        return file.exists(), bool(key) and self.made.holds(file, key)

    def _load(self, item: _Loading) -> dict[str, Stored]:
        if item.skipped:
            return {}
        inputs = self.program.inputs
        # A source of Numbers feeds no input.
        frames = {name: frame for name, frame in item.frames.items() if name in inputs}
        return {
            name: as_program_input(self._proxy_of(name, frame.pixels(linear=self.linear)), inputs[name], self.linear)
            for name, frame in frames.items()
        }

    def _proxy_of(self, name: str, picture: Stored) -> Stored:
        """Return a picture, of a proxy the means of its pixels; of further pictures, which may be data, some pixels."""
        return (reduced if name == next(iter(self.sources)) else sampled)(picture, self.proxy)

    def _computed(self, loading: Ahead[_Loading]) -> Iterator[_Storing]:
        for item, future in loading:
            result: Stored | Exception | None
            dtype: np.dtype[Any] | None = None
            try:
                result = None if item.skipped else self._run(item, future.result())
                dtype = self.sink.stores(item.frame, _size(result)) if result is not None else None
            except (PassgraphError, MemoryError) as error:
                if isinstance(error, OutputError) or not (self.ran or isinstance(error, (InputError, MemoryError))):
                    raise  # a program that does not fit would fail for every frame
                result = error
            yield _Storing(item, result, dtype)

    def _run(self, item: _Loading, pictures: dict[str, Stored]) -> Stored | None:
        self._check_sizes(item, {name: _size(picture) for name, picture in pictures.items()})
        run_values = item.checked_values() | pictures
        if item.resumed:
            self.program.run(**run_values)
            result = None
        else:
            results = self.program(**run_values)
            result = results[next(iter(results)) if self.output is None else self.output]
        self.ran += 1
        return result

    def _values(self, number: int) -> dict[str, Any]:
        """Return the values of a frame's run, without its pictures."""
        values: object = self.values(number) if callable(self.values) else self.values or {}
        if not isinstance(values, Mapping) or not all(isinstance(name, str) for name in values):
            raise InputError(f"frames: values must give a mapping by name, got {arguments.shown(values)}")
        for name in self.sources:
            if name in values:
                raise InputError(f"frames: {name!r} is among the values and has a source too; leave out one of them")
        if not self.program.has_frame_index:
            return dict(values)
        # Computed from the frame's number, since skipped frames count and a remote worker runs single frames.
        return {FRAME_INDEX.name: number - self.first, **values}

    def _check_sizes(self, item: _Loading, sizes: dict[str, tuple[int, int]]) -> None:
        first = next(iter(sizes), "")
        for name, size in sizes.items():
            before = self.sizes.setdefault(name, size) if self.program.has_history else size
            if before != size:
                raise InputError(
                    f"{item.frames[name].name}: is {_text(size)} pixels, and frames before it are {_text(before)}; an "
                    "effect that reads last frame's picture needs one size; run the sizes apart"
                )
            if self.same_size and size != sizes[first]:
                raise InputError(
                    f"{item.frames[name].name}: is {_text(size)} pixels, and {item.frame.name} is {_text(sizes[first])}"
                )

    def _prepare(self, item: _Storing) -> Any:
        if item.result is None:
            return None
        if isinstance(item.result, Exception):
            raise item.result
        assert item.dtype is not None
        frame = item.loading.frame
        return self.sink.prepare(frame, stored(item.result, item.dtype, frame.name))

    def _take_all(self, storing: Ahead[_Storing]) -> None:
        for item, future in storing:
            try:
                prepared = future.result()
                if item.result is None and item.loading.is_wanted:
                    self.sink.keep(item.loading.frame)
                if item.result is not None:
                    self.sink.take(item.loading.frame, prepared)
            except (PassgraphError, MemoryError, OSError) as error:
                if _is_full(error):
                    self.stopped, self.is_full = f"the disk is full: {error}", True
                    return
                if isinstance(error, (OSError, OutputError)):
                    raise
                self._failed(item.loading.frame, error)
            else:
                self._done(item)

    def _done(self, item: _Storing) -> None:
        loading, frame = item.loading, item.loading.frame
        if not loading.is_wanted:
            return
        if item.result is None:
            self.kept += 1
            self._notify(Outcome(frame.number, frame.name, "kept"))
            return
        assert not isinstance(item.result, Exception)
        self.written, self.size = self.written + 1, _size(item.result)
        self.remade += loading.is_there
        if not loading.key:
            pass
        elif isinstance(self.sink, Film):
            self.made.add_frame(self.sink.path, self.written + self.kept, loading.key)
            self.last_key = loading.key
        elif (file := self.sink.file(frame)) is not None:
            self.made.add(file, loading.key)
        self._notify(Outcome(frame.number, frame.name, "written"))

    def _failed(self, frame: Frame, error: Exception) -> None:
        reason = str(error) or type(error).__name__
        self.failed.append(Outcome(frame.number, frame.name, "failed", reason))
        self._notify(self.failed[-1])

    def _notify(self, outcome: Outcome) -> None:
        if self.watch is not None:
            self.watch(outcome)

    # Ends

    def _cancel_rest(self, loading: Ahead[_Loading], storing: Ahead[_Storing]) -> None:
        """Cancel or wait for the remaining work; count frames that were written completely."""
        for _, loaded in loading.cancel():
            loaded.exception()
        for item, future in storing.cancel():
            if future.exception() is None and self.sink.whole_when_prepared:
                self._done(item)

    def _end(self) -> None:
        """Finish the output, or abandon it if the disk is full or no frame was stored.

        The output of a source that stopped early holds the frames before the stop.
        """
        if not self.is_full and (self.written or (self.kept and not self.done)):
            try:
                self.sink.finish()
                if isinstance(self.sink, Film) and self.last_key and not (self.failed or self.stopped):
                    self.made.add(self.sink.path, self.last_key, self.written + self.kept)
                return
            except (PassgraphError, OSError) as error:
                if not _is_full(error):
                    self.sink.abandon()
                    raise
                self.stopped = f"the disk is full: {error}"
        self.sink.abandon()
        if self.sink.is_one_file:
            self.written = 0
        if isinstance(self.sink, Film) and self.sink.left:
            self.stopped += f"{'; ' if self.stopped else ''}{self.sink.left} has what was encoded"


@dataclass(frozen=True, eq=False)
class _Loading:
    """A frame of each source, with its run values or the error of making them, and its key.

    ``is_there``: some output of it exists; ``resumed``: it is kept, or ``is_wanted`` is False; ``skipped``: it need not
    be computed either.
    """

    frame: Frame
    frames: dict[str, Frame]
    values: dict[str, Any] | Exception
    key: str
    is_there: bool
    resumed: bool
    skipped: bool
    is_wanted: bool

    def checked_values(self) -> dict[str, Any]:
        if isinstance(self.values, Exception):
            raise self.values
        return self.values


@dataclass(frozen=True, eq=False)
class _Storing:
    """A frame, its result or error (None if its output exists), and the dtype to store it in."""

    loading: _Loading
    result: Stored | Exception | None
    dtype: np.dtype[Any] | None


def _in_step(
    sources: dict[str, Source], iterate: Callable[[Source], Iterator[Frame]] = iter
) -> Iterator[dict[str, Frame]]:
    """Yield a frame of each source at a time; all sources but the endless ones must end together."""
    iterators = {name: iterate(source) for name, source in sources.items()}
    ending = [name for name, source in sources.items() if not getattr(source, "endless", False)]
    if not ending:
        raise InputError("none of the sources ends; give one that is no still picture")
    for count in itertools.count():
        frames = {name: frame for name in ending if (frame := next(iterators[name], None)) is not None}
        if not frames:
            return
        if len(frames) < len(ending):
            short = next(name for name in ending if name not in frames)
            longer = next(iter(frames))
            raise InputError(
                f"{sources[short].name}: ends after {count} frames, and {sources[longer].name} has more; "
                f"give {short!r} one for each"
            )
        yield {name: frames[name] if name in frames else next(iterators[name]) for name in sources}


def _size(picture: Stored) -> tuple[int, int]:
    return picture.shape[1], picture.shape[0]


def _text(size: tuple[int, int]) -> str:
    return f"{size[0]}x{size[1]}"


def _is_full(error: BaseException | None) -> bool:
    """Return True if an error, or one of its causes, comes from a full or read-only disk."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in _FULL:
            return True
        error = error.__cause__
    return False
