"""Exclusive use of a backend: one thread at a time, in the process that opened it."""

from __future__ import annotations

import atexit
import os
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol
from weakref import WeakValueDictionary

from passgraph.errors import BackendError, PassgraphError

#: Seconds that the interpreter waits at exit for another thread's work on a backend.
LAST_RUN_S = 10.0


class Turn:
    """``with backend.turn:`` waits until no other thread uses the backend; it is reentrant.

    Programs hold it during each call, so programs that share a backend run one after the other.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        #: Error text if the backend is unusable, in a process forked from the one that opened it.
        self.lost = ""
        self._lock = threading.RLock()
        self._depth = 0
        self._left: deque[Callable[[], None]] = deque()

    def __enter__(self) -> Turn:
        if self.lost:
            raise BackendError(self.lost)
        self._lock.acquire()
        self._depth += 1
        if self._left and self._depth == 1:
            try:
                self._give_back()
            except BaseException:
                self.__exit__()  # no other code would
                raise
        return self

    def __exit__(self, *_: object) -> None:
        self._depth -= 1
        self._lock.release()

    def later(self, give_back: Callable[[], None]) -> None:
        """Defer a cleanup to the next entry: a finalizer may run in any thread at any time."""
        self._left.append(give_back)

    def _give_back(self) -> None:
        while self._left:
            with suppress(PassgraphError):  # must not fail the code that entered
                self._left.popleft()()

    def end(self) -> None:
        """Handle interpreter exit: running work of daemon threads completes, and no new work starts."""
        self._lock.acquire(timeout=LAST_RUN_S)

    def forked(self, backend: TakesTurns) -> None:
        """Handle a fork in the child process, while it has one thread."""
        if not self._lock.acquire(blocking=False):
            self.lost = (
                f"{self.name}: another thread was using this backend when the process was forked, so its state "
                "may be half done; compile the program again in this process"
            )
            return
        self._lock.release()
        if not backend.after_fork():
            self.lost = _fork_message(self.name)


class TakesTurns(Protocol):
    """A backend."""

    turn: Turn

    def after_fork(self) -> bool:
        """Return True if the backend works in a forked child process."""


def _fork_message(name: str) -> str:
    return (
        f"{name}: this process was forked from one that had opened a driver, and drivers do not survive a fork; "
        "start a new process (multiprocessing.get_context('spawn')), or fork before the first program is compiled"
    )


#: Every backend of this process, for :func:`_after_fork`.
_backends: WeakValueDictionary[int, TakesTurns] = WeakValueDictionary()
#: The process that first opened a driver, by backend.
_processes: dict[str, int] = {}


def open_driver(name: str) -> None:
    """Record that this process opens a driver.

    Raises
    ------
    BackendError
        If the process was forked from one that had: the driver's threads do not exist, and its calls would hang.
    """
    _processes.setdefault(name, os.getpid())
    check_driver(name)


def check_driver(name: str) -> None:
    """Raise that error, without opening anything."""
    if _processes.get(name, os.getpid()) != os.getpid():
        raise BackendError(_fork_message(name))


def turn_of(backend: TakesTurns, name: str) -> Turn:
    """Return the turn of a backend under construction."""
    _backends[id(backend)] = backend
    return Turn(name)


def _after_fork() -> None:
    for backend in list(_backends.values()):
        backend.turn.forked(backend)


@atexit.register
def _at_exit() -> None:
    """Block daemon threads from drivers for good.

    Python ends a thread that returns from a driver's C++ code after the interpreter is gone.  C++ takes that for an
    uncaught exception, and the process aborts.
    """
    for backend in list(_backends.values()):
        backend.turn.end()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
