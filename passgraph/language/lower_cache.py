"""Lowered programs in the disk cache, keyed by digests of the kernel and of the facts of its graph."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from passgraph import disk_cache
from passgraph.forking import importing
from passgraph.language import ir, scalar, types
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.data_pickle import DataPickle
from passgraph.language.facts import Facts, ImageFacts, inner_first
from passgraph.language.parameter_name import ParameterName
from passgraph.language.scope import freeze
from passgraph.language.source import PACKAGE, Span
from passgraph.ranges import Range

#: Fields with a variable's name, which does not affect the result.
_OF_VARIABLES = (ir.Local, ir.Assign, ir.For)


def digest(*parts: str) -> str:
    """Return the SHA-256 of texts."""
    return hashlib.sha256("\0".join(parts).encode(errors="surrogatepass")).hexdigest()


#: Digests of kernels that were read from the cache, by the identity of the kernel, which is kept.
DIGESTS: dict[int, tuple[ir.TypedKernel, str]] = {}


def kernel_digest(program: ir.TypedKernel) -> str:
    """Return a digest of everything that affects a kernel's result, and of the source positions of its parts.

    Raises
    ------
    TypeError
        If its constants have no unambiguous text.
    RecursionError
        If it nests too deeply.
    """
    if id(program) in DIGESTS:
        return DIGESTS[id(program)][1]
    walk = _Walk()
    for parameter in program.parameters:
        default = freeze(parameter.default) if parameter.const and parameter.has_default else None
        walk.add(parameter.name, walk.type_text(parameter.type), parameter.const, default, parameter.range)
    walk.add(program.name, program.source, program.stage, len(program.body))
    for statement in program.body:
        walk.visit(statement)
    for result in program.results:
        walk.add(result.name, walk.type_text(result.type))
        walk.visit(result.value)
    if program.keep is not None:
        walk.add("keep")
        walk.visit(program.keep)
    return digest(*walk.text)


class _Walk:
    """Visits every part of a kernel once: a value that is used twice is represented by its number."""

    def __init__(self) -> None:
        self.text: list[str] = []
        self._numbers: dict[int, int] = {}
        self._names: dict[str, int] = {}
        #: Texts of types and spans by identity: the kernel keeps them.
        self._texts: dict[int, str] = {}

    def add(self, *parts: object) -> None:
        self.text += map(repr, parts)

    def type_text(self, type_: object) -> str:
        """Return the text of a type, or of a span."""
        if id(type_) not in self._texts:
            self._texts[id(type_)] = repr(type_)
        return self._texts[id(type_)]

    def visit(self, node: Any) -> None:
        number = self._numbers.setdefault(id(node), len(self._numbers))
        if number < len(self._numbers) - 1:
            self.text.append(f"again {number}")
            return
        kind, text = type(node), self.text
        text += [kind.__name__, self.type_text(node.span)]
        for name in ir.SAID[kind]:
            value = getattr(node, name)
            if name == "name" and kind in _OF_VARIABLES:
                text.append(f"variable {self._names.setdefault(value, len(self._names))}")
            else:
                text.append(self.type_text(value) if name == "type" else repr(value))
        for name in ir.PARTS[kind]:
            part = getattr(node, name)
            if isinstance(part, tuple):
                text.append(f"{len(part)} parts")
                for one in part:
                    self.visit(one)
            else:
                self.visit(part)


def facts_digest(facts: Facts) -> str:
    """Return a digest of facts with everything fused; TypeError for values without a text.

    Facts of fused producers come first, each once and as a digest of its own: otherwise text would be quoted again at
    every level, and a producer read through two parameters would be digested twice at each.
    """
    digests: dict[int, str] = {}
    for each in inner_first(facts):
        constants = {name: freeze(value) for name, value in sorted(each.constants.items())}
        images = {name: _with_digests(image, digests) for name, image in sorted(each.images.items())}
        digests[id(each)] = digest(repr(replace(each, constants=constants, images=images)))
    return digests[id(facts)]


def _with_digests(image: ImageFacts, digests: Mapping[int, str]) -> ImageFacts:
    """Return facts of an image with digests in place of fused producers."""
    if image.fused is None:
        return image
    parts: Any = {"program": kernel_digest(image.fused.program), "facts": digests[id(image.fused.facts)]}
    return replace(image, fused=replace(image.fused, **parts))


#: Shorter programs are lowered faster than they are read, unless the compiler must be imported first: text of users has
#: imported it already.
MIN_INSTRUCTIONS = 16
_PICKLE = DataPickle(
    (
        scalar.Lit, scalar.Val, BuiltinName, ParameterName,
        scalar.Op, scalar.Choose, scalar.LoadUniform, scalar.LoadTable, scalar.LoadBuiltin, scalar.LoadTexel,
        scalar.Read, scalar.Write, scalar.ReadAt, scalar.WriteAt,
        scalar.If, scalar.For, scalar.Break, scalar.Continue,
        scalar.UniformSlot, scalar.ImageUse, scalar.Output, scalar.ScalarProgram,
        types.Vector, types.Matrix, types.Array, Range, Span,
    )
)  # fmt: skip


class LoweredPrograms:
    """The programs that one plan has lowered, by digest: passes of one kernel share one program."""

    def __init__(self) -> None:
        self._digests: dict[int, tuple[ir.TypedKernel, str]] = {}  # by the identity of the kernel, which is kept
        self.found: dict[str, scalar.ScalarProgram] = {}

    def digest(self, program: ir.TypedKernel) -> str:
        if id(program) not in self._digests:
            self._digests[id(program)] = program, kernel_digest(program)
        return self._digests[id(program)][1]


def lower_once(program: ir.TypedKernel, facts: Facts, known: LoweredPrograms | None = None) -> scalar.ScalarProgram:
    """Lower like :func:`~.lower.lower`, from disk if cached; ``known`` holds the programs of one plan."""
    known = LoweredPrograms() if known is None else known
    try:
        name = digest(disk_cache.text_digest(Path(__file__).parent), known.digest(program), facts_digest(facts))
    except (TypeError, RecursionError):
        return _lowered(program, facts)
    if name not in known.found:
        data = disk_cache.recall("programs", name)
        program_ = None if data is None else _read(data)
        if program_ is None:
            program_ = _lowered(program, facts)
            is_worth = program.source.file.startswith(PACKAGE) or scalar.count(program_.body) >= MIN_INSTRUCTIONS
            if is_worth and (data := _PICKLE.written((program_.key, program_))):
                disk_cache.remember("programs", name, data)
        known.found[name] = program_
    return known.found[name]


def _lowered(program: ir.TypedKernel, facts: Facts) -> scalar.ScalarProgram:
    with importing:
        # A program whose kernels are cached does not import the compiler.
        from passgraph.language.lower import lower

        return lower(program, facts)


def _read(data: bytes) -> scalar.ScalarProgram | None:
    try:
        key, program = _PICKLE.read(data)
        assert isinstance(program, scalar.ScalarProgram)
        vars(program)["key"] = key
    except Exception:  # a damaged pickle may raise anything
        return None
    return program
