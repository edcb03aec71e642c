"""Threads that share the rows or tiles of a pass, and aligned memory for them."""

from __future__ import annotations

import itertools
import os
import threading
import weakref
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray

#: Bytes of a cache line, and of the widest vectors: loads that straddle two lines take twice as long.
LINE = 64
#: Numbers behind the last one that may be read: the last vector of a row loads whole ones.
ROOM = 128
#: Bytes that the processor protects together: what lies behind an array in its last page may be read.
PAGE = 4096


def aligned_zeros(count: int, dtype: DTypeLike = np.float32) -> NDArray[Any]:
    """``count`` zeros from the start of a cache line."""
    kind = np.dtype(dtype)
    size = count * kind.itemsize
    memory = np.zeros(size + LINE + ROOM * kind.itemsize, np.uint8)
    first = -memory.ctypes.data % LINE
    return memory[first : first + size].view(kind)


def rest_of_page(end: int) -> int:
    """Bytes from an address to the end of its page; none where a page begins there."""
    return -end % PAGE


#: Environment variable with the number of threads; default: one a core that this process may use.
THREADS_VARIABLE = "PASSGRAPH_THREADS"

#: What a thread is asked to do: a function of the thread's number, a lock that whoever does it takes, and where to say
#: how it ended.  None ends the thread.
Ended: TypeAlias = "SimpleQueue[BaseException | None]"
Job: TypeAlias = "tuple[Callable[[int], None], int, threading.Lock, Ended] | None"


def thread_count() -> int:
    setting = os.environ.get(THREADS_VARIABLE, "")
    if setting.isascii() and setting.isdigit() and int(setting) > 0:
        return int(setting)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Workers:
    """Threads that wait for work; the caller is one of them.

    They start with the first work and wait on a queue, which wakes one in a few microseconds: a tenth of what a pool
    of futures takes.
    """

    def __init__(self, count: int | None = None) -> None:
        self.count = count or thread_count()
        self._prepare()

    def _prepare(self) -> None:
        self._jobs: SimpleQueue[Job] = SimpleQueue()
        self._threads: list[threading.Thread] = []
        # Threads know the queue only, so that a pool that nobody closed ends when nobody has it any more.
        self._end = weakref.finalize(self, _end, self._jobs, self._threads)

    def after_fork(self) -> None:
        """Forget the threads in a forked child, where they do not exist; new ones start with the next work."""
        if self._end.detach() is not None:
            self._prepare()

    def together(self, function: Callable[[int], None], threads: int) -> None:
        """``function(0)`` … side by side, in as many threads as there are; returns when all are done, raises what one
        raised.  The function shares out the work itself."""
        helpers = min(self.count, threads) - 1 if self._end.alive else 0
        if helpers <= 0:
            function(0)
            return
        if not self._threads:
            self._start()
        ended: Ended = SimpleQueue()
        locks = [threading.Lock() for _ in range(helpers)]
        for number, lock in enumerate(locks, 1):
            self._jobs.put((function, number, lock, ended))
        errors: list[BaseException | None] = []
        try:
            function(0)
        finally:
            # Threads that have not woken yet are not waited for: there is nothing left for them to do.
            begun = [lock for lock in locks if not lock.acquire(blocking=False)]
            errors += [ended.get() for _ in begun]
        for error in errors:
            if error is not None:
                raise error

    def each(self, function: Callable[[int], object], pieces: int) -> None:
        """``function(0)`` … ``function(pieces - 1)``, dynamically: whoever is free takes the next."""
        numbers = itertools.count()

        def take(_: int) -> None:
            while (piece := next(numbers)) < pieces:
                function(piece)

        self.together(take, pieces)

    def _start(self) -> None:
        for number in range(1, self.count):
            thread = threading.Thread(target=_work, args=(self._jobs,), name=f"passgraph_{number}", daemon=True)
            try:
                thread.start()
            except RuntimeError:  # the system gives no more: there is no memory for a stack, or a limit
                return
            self._threads.append(thread)

    def close(self) -> None:
        """End the threads; idempotent.  Work given afterwards is done by the caller alone."""
        self._end()

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _work(jobs: SimpleQueue[Job]) -> None:
    while (job := jobs.get()) is not None:
        function, number, lock, ended = job
        if lock.acquire(blocking=False):
            error = None
            try:
                function(number)
            except BaseException as raised:  # the caller raises it
                error = raised
            ended.put(error)
            del error
        del job, function  # keep nothing alive while waiting


def _end(jobs: SimpleQueue[Job], threads: list[threading.Thread]) -> None:
    for _ in threads:
        jobs.put(None)
    for thread in threads:
        if thread is not threading.current_thread():
            thread.join()
