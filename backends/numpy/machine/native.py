"""Machine code from LLVM text of our own, kept on disk: a second process needs no compiler."""

from __future__ import annotations

import hashlib
import os
import threading
from collections.abc import Callable
from functools import cache
from pathlib import Path

import llvmlite

from passgraph.backends.numpy.machine.linked import MARK, linked, loaded
from passgraph.backends.numpy.machine.processor import told_by_linux
from passgraph.disk_cache import recall, remember, text_digest
from passgraph.language import borders

#: Held by whoever compiles or loads: LLVM's engine and what numba knows are one for the process, made once.
_compiling = threading.RLock()
if hasattr(os, "register_at_fork"):
    # A child must not begin with a lock, or half a module, of a thread that it does not have.
    os.register_at_fork(
        before=_compiling.acquire, after_in_parent=_compiling.release, after_in_child=_compiling.release
    )


@cache
def _processor() -> tuple[str, frozenset[str]]:
    """What tells this processor from others, and what it can do, without LLVM where the system says it."""
    told = told_by_linux()
    if told is None:
        from passgraph.backends.numpy.machine.compiler import host

        name, features = host()
        told = name, frozenset(feature[1:] for feature in features.split(",") if feature.startswith("+"))
    return told


def lanes() -> int:
    """Numbers in one vector: a register's worth where there are many registers."""
    with _compiling:
        return 16 if "avx512f" in _processor()[1] else 8


_loaded: dict[str, int] = {}


def function_address(parts: tuple[str, ...], emit: Callable[[str], str], *, loops: int = 0) -> int:
    """Where the function is that ``emit(name)`` gives the LLVM text of; ``parts`` tell it from every other.

    ``loops``: the level at which LLVM makes vectors of its loops, see `compiler.optimised`.

    Threads take turns: what one is compiling, another that asks for it finds made.
    """
    with _compiling:
        return _address(parts, emit, loops)


def _address(parts: tuple[str, ...], emit: Callable[[str], str], loops: int) -> int:
    name, features = _processor()
    # Border rules come from the language's own text, beside the programs among the parts.
    texts = (text_digest(Path(__file__).parents[1], (".py", ".ll")), text_digest(Path(borders.__file__).parent))
    told = (*texts, llvmlite.__version__, name, *sorted(features), *parts)
    key = hashlib.sha256("\0".join(told).encode()).hexdigest()[:40]
    if key not in _loaded:
        name = f"pg_{key}"
        code = recall("code", f"{name}.o")
        if code is None:
            from passgraph.backends.numpy.machine.compiler import compiled

            made = compiled(emit(name), loops)
            code = linked(made, name) or made
            remember("code", f"{name}.o", code)
        _loaded[key] = _load(code, name)
    return _loaded[key]


def _load(code: bytes, name: str) -> int:
    if code.startswith(MARK):
        return loaded(code)
    from passgraph.backends.numpy.machine.compiler import load_object

    return load_object(code, name)
