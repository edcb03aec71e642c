"""Typed kernels of this package in the disk cache: a program that uses built-in effects parses none of them.

The text of a user's kernel and the names around it are read each time, since they may mean something else than before.
Those of this package change with its files only. So a kernel's key is its name, the values that it captures, and the
size and the time of the last change of every file of the package, as Python's own cache of byte code has it.
"""

from __future__ import annotations

from passgraph import disk_cache
from passgraph.language import ir, lower_cache, types
from passgraph.language.data_pickle import DataPickle
from passgraph.language.source import Span
from passgraph.ranges import Range

_PICKLE = DataPickle(
    (
        *ir.EXPRESSIONS, *ir.STATEMENTS, ir.Parameter, ir.Result, ir.TypedKernel,
        types.Scalar, types.Vector, types.Matrix, types.Array, types.ImageType, types.Struct, Range, Span,
    )
)  # fmt: skip


def recall(name: str) -> ir.TypedKernel | None:
    """Return a kernel of this package by its name; None if it is not cached. Its digest is known then."""
    stamp = disk_cache.package_stamp()
    data = None if stamp is None else disk_cache.recall("kernels", lower_cache.digest(stamp, name))
    if data is None:
        return None
    try:
        digest, program = _PICKLE.read(data)
        assert isinstance(program, ir.TypedKernel) and isinstance(digest, str)
    except Exception:  # a damaged pickle may raise anything
        return None
    lower_cache.DIGESTS[id(program)] = program, digest
    return program


def remember(name: str, program: ir.TypedKernel) -> None:
    """Write a kernel of this package to the cache, unless it holds values of other classes, or files just changed."""
    stamp = disk_cache.package_stamp()
    if stamp is None:
        return
    try:
        digest = lower_cache.kernel_digest(program)
    except (TypeError, RecursionError):
        return
    if data := _PICKLE.written((digest, program)):
        disk_cache.remember("kernels", lower_cache.digest(stamp, name), data)
