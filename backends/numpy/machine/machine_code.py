"""Compile our LLVM text to machine code, cached on disk: a second process compiles nothing."""

from __future__ import annotations

import hashlib
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any
from weakref import WeakValueDictionary, finalize

import llvmlite

from passgraph.disk_cache import recall, remember, text_digest
from passgraph.errors import BackendError
from passgraph.language import borders

#: Lock for writing text and loading code: LLVM's engine and numba's state exist once per process.
_compiling = threading.RLock()
_importing = threading.Lock()
#: One for each thread that uses LLVM with a text; limits their number.
_places = [threading.Lock() for _ in range(16)]


#: llvmlite's own lock, held during a fork: any thread may free LLVM's objects, without our lock.
_forking: list[Any] = []


def _hold() -> None:
    _compiling.acquire()
    for lock in (*_places, _importing):
        lock.acquire()
    library = getattr(sys.modules.get("llvmlite.binding.ffi"), "lib", None)
    if library is not None:
        _forking.append(library._lock)
        library._lock.__enter__()


def _let_go() -> None:
    while _forking:
        _forking.pop().__exit__()
    for lock in (*_places, _importing):
        lock.release()
    _compiling.release()


if hasattr(os, "register_at_fork"):
    # A child must not inherit a lock, or half-loaded module, of a thread that it does not have.
    os.register_at_fork(before=_hold, after_in_parent=_let_go, after_in_child=_let_go)


@cache
def _processor() -> tuple[str, frozenset[str]]:
    """Return LLVM's name of this processor and its instruction sets."""
    name, features = _compiler().host()
    return name, frozenset(feature[1:] for feature in features.split(",") if feature.startswith("+"))


def lanes() -> int:
    """Return the numbers in a vector: a register's width where there are many registers."""
    with _compiling:
        return 16 if "avx512f" in _processor()[1] else 8


class Code:
    """Machine code of one function, possibly still being compiled.

    It is unloaded with this object: users of its address must keep the object, as `function` does.
    """

    def __init__(self, name: str, text: str, loops: int, machine_code: bytes | None) -> None:
        self.name, self._text, self._loops = name, text, loops
        self._object = machine_code
        self._address: int | None = None
        self._making = threading.Lock()

    def make(self, wait: bool = True) -> None:
        """Compile it, or wait for the thread that compiles it; ``wait=False`` leaves it to that thread."""
        if self._object is not None:
            return
        with _place():
            if self._making.acquire(blocking=wait):
                try:
                    if self._object is None:
                        machine_code = _compiler().compiled(self._text, self._loops)
                        remember("code", f"{self.name}.o", machine_code)
                        self._object = machine_code
                finally:
                    self._making.release()

    @property
    def address(self) -> int:
        """Return the function's address; wait until it is compiled and loaded."""
        if self._address is None:
            self.make()
            with _compiling:
                if self._address is None:
                    self._load()
        assert self._address is not None
        return self._address

    def function(self, kind: Callable[[int], Any], *keeps: object) -> Any:
        """Return the function for ctypes; it keeps its code, and the objects in ``keeps``, alive."""
        callable_ = kind(self.address)
        callable_.keeps = (self, *keeps)
        return callable_

    def _load(self) -> None:
        assert self._object is not None
        self._address, unload = _compiler().load_object(self._object, self.name)
        # Not when the interpreter exits: a daemon thread may still be in the function.
        finalize(self, unload).atexit = False
        self._text, self._object = "", b""


def _compiler() -> Any:
    """Import LLVM at first use: it compiles code and loads cached code."""
    try:
        # One at a time: importing a module whose import fails in another thread yields half of it.
        with _importing:
            from passgraph.backends.numpy.machine import compiler
    except (ImportError, OSError) as error:
        raise BackendError(
            "numpy compiles kernels with llvmlite, which cannot be loaded here; its library takes about 300 MB of "
            f"address space: raise the process's limit, else install llvmlite again ({error})"
        ) from error
    return compiler


@contextmanager
def _place() -> Iterator[None]:
    lock = next((lock for lock in _places if lock.acquire(blocking=False)), None)
    if lock is None:
        lock = _places[0]
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


#: Code in use, by key: unloaded with its last program.
_codes: WeakValueDictionary[str, Code] = WeakValueDictionary()
_local = threading.local()


def function_code(parts: tuple[str, ...], emit: Callable[[str], str], *, loops: int = 0) -> Code:
    """Return the function with the LLVM text ``emit(name)``; ``parts`` identify it.

    ``loops``: the level at which LLVM makes vectors of its loops, see `compiler.optimised`.

    Threads share code.  Inside :func:`side_by_side` code may still be compiling.
    """
    with _compiling:
        code = _code(parts, emit, loops)
    batch: _Batch | None = getattr(_local, "batch", None)
    if batch is None:
        code.make()
    else:
        batch.add(code)
    return code


def _code(parts: tuple[str, ...], emit: Callable[[str], str], loops: int) -> Code:
    # Border rules come from the language's own text, in addition to the programs among the parts.
    texts = (text_digest(Path(__file__).parents[1], (".py", ".ll")), text_digest(Path(borders.__file__).parent))
    processor, features = _processor()
    key_parts = (*texts, llvmlite.__version__, processor, *sorted(features), *parts)
    key = hashlib.sha256("\0".join(key_parts).encode()).hexdigest()[:40]
    code = _codes.get(key)
    if code is None:
        name = f"pg_{key}"
        machine_code = recall("code", f"{name}.o")
        code = _codes[key] = Code(name, emit(name) if machine_code is None else "", loops, machine_code)
    return code


@contextmanager
def side_by_side(threads: int) -> Iterator[None]:
    """Compile code requested inside in this number of threads, including this one; all is loaded when it ends."""
    outer, _local.batch = getattr(_local, "batch", None), _Batch(threads)
    batch: _Batch = _local.batch
    try:
        yield
        batch.finish()
    finally:
        _local.batch = outer
        batch.close()


class _Batch:
    """Code that one thread requests, and helper threads that compile ahead of it.

    They start with the first text to compile, as cached code needs none.
    """

    def __init__(self, threads: int) -> None:
        self.others = threads - 1
        self.codes: list[Code] = []
        self.queue: SimpleQueue[Code | None] = SimpleQueue()
        self.started = 0

    def add(self, code: Code) -> None:
        self.codes.append(code)
        if code._object is not None:
            return
        self.queue.put(code)
        if self.started < self.others:
            with suppress(RuntimeError):  # no more threads available: this one compiles all
                threading.Thread(target=_help, args=(self.queue,), name="passgraph_compile", daemon=True).start()
                self.started += 1

    def finish(self) -> None:
        for code in self.codes:
            code.make(wait=False)
        for code in self.codes:
            code.address  # noqa: B018 (waits and loads)

    def close(self) -> None:
        """Drop requests that are no longer needed."""
        with suppress(Empty):
            while True:
                self.queue.get_nowait()
        for _ in range(self.started):
            self.queue.put(None)


def _help(queue: SimpleQueue[Code | None]) -> None:
    while (code := queue.get()) is not None:
        with suppress(Exception):  # the thread that needs it compiles again, and raises
            code.make(wait=False)
        del code
