"""Lowered programs from disk: what one process computed, the next reads.

A program hangs on the text of its kernel and of the functions in it, on what their names stand for, on the facts of the
graph and on this package's own text; all of it goes into the name of its file.
"""

from __future__ import annotations

import hashlib
import io
import pickle
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from passgraph import disk_cache
from passgraph.language import ir, scalar, types
from passgraph.language.facts import Facts, ImageFacts, inner_first
from passgraph.language.lower import lower
from passgraph.language.scope import freeze
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
    cls: tuple(field.name for field in fields(cls))
    for cls in (
        scalar.Lit, scalar.Val, scalar.Op, scalar.Choose, scalar.LoadUniform, scalar.LoadTable, scalar.LoadBuiltin,
        scalar.LoadTexel, scalar.Read, scalar.Write, scalar.ReadAt, scalar.WriteAt,
        scalar.If, scalar.For, scalar.Break, scalar.Continue,
        scalar.UniformSlot, scalar.ImageUse, scalar.Output, scalar.ScalarProgram,
        types.Vector, types.Matrix, types.Array, Range, Span,
    )
}  # fmt: skip
_MAKERS: dict[tuple[str, str], Any] = {(cls.__module__, cls.__name__): cls for cls in _FIELDS}
_MAKERS[_single.__module__, _single.__name__] = _single


def lower_once(
    program: ir.TypedKernel, facts: Facts, known: dict[str, scalar.ScalarProgram] | None = None
) -> scalar.ScalarProgram:
    """As :func:`~.lower.lower`, from disk where it is there; ``known`` holds those of one plan, by name."""
    known = {} if known is None else known
    try:
        parts = (disk_cache.text_digest(Path(__file__).parent), _told(program), facts_told(facts))
    except TypeError:
        return lower(program, facts)
    name = hashlib.sha256("\0".join(parts).encode()).hexdigest()
    if name not in known:
        known[name] = _from_disk(program, facts, name)
    return known[name]


def _from_disk(program: ir.TypedKernel, facts: Facts, name: str) -> scalar.ScalarProgram:
    data = disk_cache.recall("programs", name)
    found = None if data is None else _read(data)
    if found is None:
        found = lower(program, facts)
        data = _written(found) if scalar.count(found.body) >= MIN_INSTRUCTIONS else None
        if data is not None:
            disk_cache.remember("programs", name, data)
    return found


def _told(program: ir.TypedKernel) -> str:
    if not program.digest:
        raise TypeError(f"{program.name} has no text")
    return program.digest


def facts_told(facts: Facts) -> str:
    """A digest of every field; TypeError for values that no text tells apart.

    Facts of what is fused come first, each once and as a digest of its own: text inside text would be quoted again
    at every level, and a producer that is read through two parameters told twice at each.
    """
    told: dict[int, str] = {}
    for each in inner_first(facts):
        told[id(each)] = _digest(each, told)
    return told[id(facts)]


def _digest(facts: Facts, told: Mapping[int, str]) -> str:
    constants = {name: freeze(value) for name, value in sorted(facts.constants.items())}
    images = {name: _image_told(image, told) for name, image in sorted(facts.images.items())}
    return hashlib.sha256(repr(replace(facts, constants=constants, images=images)).encode()).hexdigest()


def _image_told(image: ImageFacts, told: Mapping[int, str]) -> ImageFacts:
    if image.fused is None:
        return image
    parts: Any = {"program": _told(image.fused.program), "facts": told[id(image.fused.facts)]}
    return replace(image, fused=replace(image.fused, **parts))


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
