"""Lowered programs from disk: what one process computed, the next reads.

A program hangs on the text of its kernel and of the functions in it, on what their names stand for, on the facts of the
graph and on this package's own text; all of it goes into the name of its file.
"""

from __future__ import annotations

import io
import pickle
from dataclasses import fields
from pathlib import Path
from typing import Any

from passgraph import disk_cache
from passgraph.language import ir, scalar, types
from passgraph.language.facts import Facts
from passgraph.language.kernel_digest import digest, facts_digest, kernel_digest
from passgraph.language.lower import lower
from passgraph.language.source import NOWHERE, Span
from passgraph.ranges import Range

#: Shorter programs take less time to lower than to read.
MIN_INSTRUCTIONS = 16
#: What there is once only, by name.
_SINGLE: dict[str, object] = {"nowhere": NOWHERE, **types.NAMED}
_NAMES = {id(single): name for name, single in _SINGLE.items()}


def _single(name: str) -> object:
    return _SINGLE[name]


#: What a file may hold besides numbers, strings and tuples, with its fields.
_FIELDS: dict[type[Any], tuple[str, ...]] = {
    cls: tuple(field.name for field in fields(cls) if field.init)
    for cls in (
        scalar.Lit, scalar.Val,
        scalar.Op, scalar.Choose, scalar.LoadUniform, scalar.LoadTable, scalar.LoadBuiltin, scalar.LoadTexel,
        scalar.Read, scalar.Write, scalar.ReadAt, scalar.WriteAt,
        scalar.If, scalar.For, scalar.Break, scalar.Continue,
        scalar.UniformSlot, scalar.ImageUse, scalar.Output, scalar.ScalarProgram,
        types.Vector, types.Matrix, types.Array, Range, Span,
    )
}  # fmt: skip
_MAKERS: dict[tuple[str, str], Any] = {(cls.__module__, cls.__name__): cls for cls in _FIELDS}
_MAKERS[_single.__module__, _single.__name__] = _single


class Programs:
    """What one plan has lowered so far, by digest: many passes of one kernel share one program."""

    def __init__(self) -> None:
        self._digests: dict[int, tuple[ir.TypedKernel, str]] = {}  # by the identity of the kernel, which is kept
        self.found: dict[str, scalar.ScalarProgram] = {}

    def digest(self, program: ir.TypedKernel) -> str:
        if id(program) not in self._digests:
            self._digests[id(program)] = program, kernel_digest(program)
        return self._digests[id(program)][1]


def lower_once(program: ir.TypedKernel, facts: Facts, known: Programs | None = None) -> scalar.ScalarProgram:
    """As :func:`~.lower.lower`, from disk where it is there; ``known`` holds those of one plan."""
    known = Programs() if known is None else known
    try:
        name = digest(disk_cache.text_digest(Path(__file__).parent), known.digest(program), facts_digest(facts))
    except (TypeError, RecursionError):
        return lower(program, facts)
    if name not in known.found:
        data = disk_cache.recall("programs", name)
        found = None if data is None else _read(data)
        if found is None:
            found = lower(program, facts)
            if scalar.count(found.body) >= MIN_INSTRUCTIONS and (data := _written(found)) is not None:
                disk_cache.remember("programs", name, data)
        known.found[name] = found
    return known.found[name]


class _Writer(pickle.Pickler):
    """Each object as its class and its fields, or as the name of what there is once."""

    def reducer_override(self, given: object) -> Any:
        if id(given) in _NAMES:
            return _single, (_NAMES[id(given)],)
        names = _FIELDS.get(type(given))
        return NotImplemented if names is None else (type(given), tuple([getattr(given, name) for name in names]))


class _Reader(pickle.Unpickler):
    """Makes these objects only: reading a file never runs anything else."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _MAKERS:
            raise pickle.UnpicklingError(f"{module}.{name} does not belong into a program")
        return _MAKERS[module, name]


def _written(program: scalar.ScalarProgram) -> bytes | None:
    file = io.BytesIO()
    try:
        _Writer(file, protocol=5).dump((program.key, program))
    except RecursionError:  # branches in branches in branches
        return None
    return file.getvalue()


def _read(data: bytes) -> scalar.ScalarProgram | None:
    try:
        key, program = _Reader(io.BytesIO(data)).load()
        assert isinstance(program, scalar.ScalarProgram)
        vars(program)["key"] = key
    except Exception:  # a damaged pickle may raise anything
        return None
    return program
