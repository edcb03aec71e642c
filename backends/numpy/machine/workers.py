"""Threads that share the rows or tiles of a pass, and aligned memory."""

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

#: Bytes of a cache line, and of the widest vectors: loads across two lines take twice as long.
LINE = 64
#: Readable numbers behind the last one: the last vector of a row is loaded whole.
ROOM = 128
#: Bytes of a page: memory behind an array, in its last page, may be read.
PAGE = 4096


def aligned_zeros(count: int, dtype: DTypeLike = np.float32) -> NDArray[Any]:
    """Return ``count`` zeros, aligned to a cache line."""
    kind = np.dtype(dtype)
    size = count * kind.itemsize
    memory = np.zeros(size + LINE + ROOM * kind.itemsize, np.uint8)
    first = -memory.ctypes.data % LINE
    return memory[first : first + size].view(kind)


def rest_of_page(end: int) -> int:
    """Return the number of bytes from an address to the end of its page; 0 at the start of a page."""
    return -end % PAGE


#: Environment variable with the number of threads; default: one per core that this process may use.
THREADS_VARIABLE = "PASSGRAPH_THREADS"

#: Work for a thread: a function of the thread's number, a lock to acquire for it, and a queue for the outcome.  None
#: ends the thread.
Ended: TypeAlias = "SimpleQueue[BaseException | None]"
Job: TypeAlias = "tuple[Callable[[int], None], int, threading.Lock, Ended] | None"


def thread_count() -> int:
    setting = os.environ.get(THREADS_VARIABLE, "")
    if setting.isascii() and setting.isdigit() and int(setting) > 0:
        return int(setting)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Workers:
    """A pool of threads; the caller works too.

    Threads start with the first work and wait on a queue, which wakes one in a few microseconds: a tenth of the time of
    a pool of futures.
    """

    def __init__(self, count: int | None = None) -> None:
        self.count = count or thread_count()
        self._prepare()

    def _prepare(self) -> None:
        self._jobs: SimpleQueue[Job] = SimpleQueue()
        self._threads: list[threading.Thread] = []
        # Threads refer to the queue only, so a pool that is dropped without being closed ends.
        self._end = weakref.finalize(self, _end, self._jobs, self._threads)

    def after_fork(self) -> None:
        """Forget the threads after a fork, which does not copy them; new ones start with the next work."""
        if self._end.detach() is not None:
            self._prepare()

    def together(self, function: Callable[[int], None], threads: int) -> None:
        """Run ``function(0)`` … in parallel on all threads; return when all are done, and raise an error of any.

        The function itself divides the work.
        """
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
            # Threads that have not woken up are not waited for: no work is left for them.
            begun = [lock for lock in locks if not lock.acquire(blocking=False)]
            errors += [ended.get() for _ in begun]
        for error in errors:
            if error is not None:
                raise error

    def each(self, function: Callable[[int], object], pieces: int) -> None:
        """Run ``function(0)`` … ``function(pieces - 1)`` on the threads, scheduled dynamically."""
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
            except RuntimeError:  # no more threads: no memory for a stack, or a limit
                return
            self._threads.append(thread)

    def close(self) -> None:
        """End the threads; idempotent.  Later work runs on the caller alone."""
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
