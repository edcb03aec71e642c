"""Typed kernels of this package in the disk cache: a program that uses built-in effects parses none of them.

The text of a user's kernel and the names around it are read each time, since they may mean something else than before.
Those of this package change with its files only. So a kernel's key is its name, the values that it captures, and the
size and the time of the last change of every file of the package, as Python's own cache of byte code has it.
"""

from __future__ import annotations

import os
import pickle
import platform
from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from io import BytesIO
from time import time
from typing import Any

import numpy as np

from passgraph import disk_cache
from passgraph.language import ir, lower_cache, types
from passgraph.language.source import PACKAGE, Span
from passgraph.ranges import Range

#: Files that changed later may differ from what this process has imported.
_IMPORTED = time()
#: What a file may contain besides numbers, texts and tuples: classes, with the fields that make them.
_FIELDS: dict[type[Any], tuple[str, ...]] = {
    cls: tuple(field.name for field in fields(cls) if field.init)
    for cls in (
        *ir.EXPRESSIONS, *ir.STATEMENTS, ir.Parameter, ir.Result, ir.TypedKernel,
        types.Scalar, types.Vector, types.Matrix, types.Array, types.ImageType, types.Struct, Range, Span,
    )
}  # fmt: skip
_MAKERS: dict[tuple[str, str], Any] = {(cls.__module__, cls.__name__): cls for cls in _FIELDS}
_MAKERS[lower_cache.single.__module__, lower_cache.single.__name__] = lower_cache.single


def recall(name: str) -> ir.TypedKernel | None:
    """Return a kernel of this package by its name; None if it is not cached. Its digest is known then."""
    stamp = _stamp()
    data = None if stamp is None else disk_cache.recall("kernels", lower_cache.digest(stamp, name))
    if data is None:
        return None
    try:
        digest, program = _Reader(BytesIO(data)).load()
        assert isinstance(program, ir.TypedKernel) and isinstance(digest, str)
    except Exception:  # a damaged pickle may raise anything
        return None
    lower_cache.DIGESTS[id(program)] = program, digest
    return program


def remember(name: str, program: ir.TypedKernel) -> None:
    """Write a kernel of this package to the cache, unless it holds values of other classes, or files just changed."""
    stamp = _stamp()
    if stamp is None:
        return
    file = BytesIO()
    try:
        _Writer(file, protocol=5).dump((lower_cache.kernel_digest(program), program))
    except (pickle.PicklingError, TypeError, RecursionError):
        return
    disk_cache.remember("kernels", lower_cache.digest(stamp, name), file.getvalue())


@cache
def _stamp() -> str | None:
    """Return a digest of what the package's kernels depend on; None if a file changed after it was imported."""
    files = sorted(_files(PACKAGE))
    if any(changed > _IMPORTED for *_, changed in files):
        return None
    return lower_cache.digest(PACKAGE, platform.python_version(), np.__version__, repr(files))


def _files(folder: str) -> Iterator[tuple[str, int, float]]:
    """Yield the path, size in bytes and time of the last change of each Python file in a folder."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(".py"):
                status = entry.stat()
                yield entry.path, status.st_size, status.st_mtime
            elif "." not in entry.name and entry.name != "__pycache__" and entry.is_dir():
                yield from _files(entry.path)


class _Writer(pickle.Pickler):
    """Pickles each object as its class and its fields, or as the name of a singleton; PicklingError for others."""

    def reducer_override(self, given: object) -> Any:
        if id(given) in lower_cache.SINGLE_NAMES:  # types are compared by identity
            return lower_cache.single, (lower_cache.SINGLE_NAMES[id(given)],)
        if given is lower_cache.single or (isinstance(given, type) and given in _FIELDS):
            return NotImplemented
        names = _FIELDS.get(type(given))
        if names is None:
            raise pickle.PicklingError(f"{type(given).__name__} does not belong into a kernel")
        return type(given), tuple([getattr(given, name) for name in names])


class _Reader(pickle.Unpickler):
    """Unpickles these classes only: reading a file never runs anything else."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _MAKERS:
            raise pickle.UnpicklingError(f"{module}.{name} does not belong into a kernel")
        return _MAKERS[module, name]
