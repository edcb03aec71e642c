"""Lowered programs from disk: what one process computed, the next reads.

A program hangs on the text of its kernel and of the functions in it, on what their names stand for, on the facts of the
graph and on this package's own text; all of it goes into the name of its file.
"""

from __future__ import annotations

import hashlib
import io
import pickle
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, cast

from passgraph import disk_cache
from passgraph.cached import cached_property
from passgraph.errors import PassgraphError
from passgraph.language import ir, scalar, types
from passgraph.language.emitter import Derived, fold
from passgraph.language.facts import Facts, ImageFacts, inner_first
from passgraph.language.literals import filling, instruction_of, is_own, outputs_of, place_of
from passgraph.language.lower import lower
from passgraph.language.scope import freeze
from passgraph.language.shape import Shape, shape_of
from passgraph.language.source import NOWHERE, Span
from passgraph.ranges import Range

#: Shorter programs take less time to lower than to read.
MIN_INSTRUCTIONS = 16
#: In the place of a program whose numbers are asked for.
_ASKED = b"asked"
#: What there is once only, by name.
_SINGLE: dict[str, object] = {"nowhere": NOWHERE, **types.NAMED}
_NAMES = {id(single): name for name, single in _SINGLE.items()}


def _single(name: str) -> object:
    return _SINGLE[name]


#: What a file may hold besides numbers, strings and tuples, with its fields.
_FIELDS: dict[type[Any], tuple[str, ...]] = {
    cls: tuple(field.name for field in fields(cls) if field.init)
    for cls in (
        scalar.Place, scalar.Lit, scalar.Val,
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
    """What one plan has lowered so far."""

    def __init__(self) -> None:
        #: Of each kernel, by its identity, with the kernel itself.
        self._shapes: dict[int, tuple[ir.TypedKernel, Shape]] = {}
        #: What kernels that differ in their numbers only have in common, by name; None where they have nothing.
        self.common: dict[str, _Common | None] = {}
        #: Programs by the names of these and the identities of the shapes that fill them.
        self.filled: dict[tuple[object, ...], scalar.ScalarProgram] = {}
        #: Shapes of which the plan has one kernel only: places for its numbers would serve nobody, and where what
        #: becomes of it hangs on one of them it would be lowered twice.
        self._alone: set[str] = set()

    def expect(self, programs: Iterable[ir.TypedKernel]) -> None:
        """The kernels of a plan, before the first is lowered."""
        numbers: defaultdict[str, set[tuple[float, ...]]] = defaultdict(set)
        for program in programs:
            with suppress(TypeError, RecursionError):  # it is lowered by itself
                shape = self.shape(program)
                numbers[shape.told].add(shape.literals)
        self._alone = {told for told, met in numbers.items() if len(met) == 1}

    def are_alone(self, shapes: Iterable[Shape]) -> bool:
        """Whether no other kernel of the plan differs from these in its numbers only."""
        return all(shape.told in self._alone for shape in shapes)

    def shape(self, program: ir.TypedKernel) -> Shape:
        if id(program) not in self._shapes:
            self._shapes[id(program)] = program, shape_of(program)
        return self._shapes[id(program)][1]


class _Told:
    """Kernels and facts as text, but for numbers."""

    def __init__(self, programs: Programs) -> None:
        self.programs = programs
        self.literals: dict[float, int] = {}  # and the place of each
        self.shapes: list[Shape] = []

    def kernel(self, program: ir.TypedKernel) -> str:
        shape = self.programs.shape(program)
        self.shapes.append(shape)
        places = [self.literals.setdefault(value, len(self.literals)) for value in shape.literals]
        return f"{shape.told} {places}"

    def facts(self, facts: Facts) -> str:
        """A digest of every field; TypeError for values that no text tells apart.

        Facts of what is fused come first, each once and as a digest of its own: text inside text would be quoted again
        at every level, and a producer that is read through two parameters told twice at each.
        """
        told: dict[int, str] = {}
        for each in inner_first(facts):
            constants = {name: freeze(value) for name, value in sorted(each.constants.items())}
            images = {name: self._image(image, told) for name, image in sorted(each.images.items())}
            told[id(each)] = _digest(repr(replace(each, constants=constants, images=images)))
        return told[id(facts)]

    def _image(self, image: ImageFacts, told: Mapping[int, str]) -> ImageFacts:
        if image.fused is None:
            return image
        parts: Any = {"program": self.kernel(image.fused.program), "facts": told[id(image.fused.facts)]}
        return replace(image, fused=replace(image.fused, **parts))


def _digest(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def facts_told(facts: Facts) -> str:
    """A digest of facts with all that is fused; TypeError for values that no text tells apart."""
    told = _Told(Programs())
    return _digest(told.facts(facts), repr(list(told.literals)))


@dataclass(frozen=True)
class _Common:
    """A program with places for numbers, and where it stands in the text of the kernel that it was made of."""

    program: scalar.ScalarProgram
    #: By the numbers of the kernel's parts.
    spans: dict[int, Span]
    #: How the numbers behind the kernel's own come about.
    derived: tuple[tuple[str, tuple[scalar.Lit, ...]], ...]

    @cached_property
    def _places(self) -> dict[int, int]:
        """Of each span by its identity, its number."""
        return {id(span): number for number, span in self.spans.items()}

    @cached_property
    def _changing(self) -> list[int]:
        """Instructions that numbers or places decide."""

        def known(x: scalar.Operand) -> scalar.Operand:
            return x if place_of(x) is None else scalar.Lit("float", 0.0)

        def elsewhere(span: Span) -> Span:
            return NOWHERE if id(span) in self._places else span

        return [n for n, i in enumerate(self.program.body) if instruction_of(i, known, elsewhere) is not i]

    def _stands_at(self, spans: Sequence[Span]) -> bool:
        """Whether a kernel with parts there is of the same text at the same place: mostly, the kernel itself."""
        return all(spans[number] == span for number, span in self.spans.items())

    def numbers(self, literals: tuple[float, ...]) -> tuple[float, ...] | None:
        """All numbers, by the kernel's own; None where one is of those that there are rules for."""
        found = list(literals)
        for operation, arguments in self.derived:
            of = filling(found)
            made = fold(operation, "float", tuple([cast(scalar.Lit, of(x)) for x in arguments])).value
            if not is_own(made):
                return None
            found.append(made)
        return tuple(found)

    def filled(self, name: str, literals: tuple[float, ...], spans: Sequence[Span]) -> scalar.ScalarProgram:
        """The program of a kernel with these numbers, which stands there."""
        if not literals and self._stands_at(spans):
            made = replace(self.program, name=name)
            object.__setattr__(made, "apart", scalar.Apart(self.program, ()))
            return made
        numbers, places, body = filling(literals), self._places, list(self.program.body)

        def at(span: Span) -> Span:
            number = places.get(id(span))
            return span if number is None else spans[number]

        for n in self._changing:
            body[n] = instruction_of(body[n], numbers, at)
        sources = tuple([at(span) for span in self.program.sources])
        outputs = outputs_of(self.program, numbers)
        made = replace(self.program, name=name, body=tuple(body), outputs=outputs, sources=sources)
        object.__setattr__(made, "apart", scalar.Apart(self.program, literals))
        return made


def lower_once(program: ir.TypedKernel, facts: Facts, known: Programs | None = None) -> scalar.ScalarProgram:
    """As :func:`~.lower.lower`, from disk where it is there; ``known`` holds those of one plan.

    Kernels of a plan that differ in their numbers only are lowered once, with places for the numbers; where what
    becomes of a kernel hangs on a number, as the length of a loop may, each is lowered by itself.
    """
    known = Programs() if known is None else known
    try:
        told = _Told(known)
        name = _digest(disk_cache.text_digest(Path(__file__).parent), told.kernel(program), told.facts(facts))
    except (TypeError, RecursionError):
        return lower(program, facts)
    made = name, *map(id, told.shapes)
    if made not in known.filled:
        spans = tuple([span for shape in told.shapes for span in shape.spans])
        literals = tuple(told.literals)
        common = None if known.are_alone(told.shapes) else _common(program, facts, name, literals, spans, known)
        numbers = None if common is None else common.numbers(literals)
        if common is None or numbers is None:
            numbers = ()
            common = _common(program, facts, _digest(name, repr(literals)), numbers, spans, known)
            assert common is not None
        known.filled[made] = common.filled(program.name, numbers, spans)
    return known.filled[made]


def _common(
    program: ir.TypedKernel,
    facts: Facts,
    name: str,
    literals: tuple[float, ...],
    spans: tuple[Span, ...],
    known: Programs,
) -> _Common | None:
    """A program with places for these numbers; None where they are asked for."""
    if name not in known.common:
        data = disk_cache.recall("programs", name)
        if data == _ASKED:
            found = None
        elif data is None or (found := _read(data)) is None:
            found = _made(program, facts, name, literals, spans)
        known.common[name] = found
    return known.common[name]


def _made(
    program: ir.TypedKernel, facts: Facts, name: str, literals: tuple[float, ...], spans: tuple[Span, ...]
) -> _Common | None:
    try:
        derived = Derived(len(literals))
        lowered = lower(program, facts, {value: scalar.place(number) for number, value in enumerate(literals)}, derived)
    except (TypeError, PassgraphError):
        if not literals:
            raise
        disk_cache.remember("programs", name, _ASKED)
        return None
    numbers = {id(span): number for number, span in reversed(list(enumerate(spans)))}
    stands = {id(span): span for span in lowered.sources}
    stands |= {id(i.span): i.span for i in scalar.walk(lowered.body) if isinstance(i, (scalar.Op, scalar.LoadTexel))}
    used = {numbers[key]: span for key, span in stands.items() if key in numbers}
    found = _Common(lowered, used, tuple(derived.steps))
    data = _written(found) if scalar.count(lowered.body) >= MIN_INSTRUCTIONS else None
    if data is not None:
        disk_cache.remember("programs", name, data)
    return found


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


def _written(common: _Common) -> bytes | None:
    file = io.BytesIO()
    try:
        _Writer(file, protocol=5).dump((common.program.key, common.program, common.spans, common.derived))
    except RecursionError:  # branches in branches in branches
        return None
    return file.getvalue()


def _read(data: bytes) -> _Common | None:
    try:
        key, program, spans, derived = _Reader(io.BytesIO(data)).load()
        assert isinstance(program, scalar.ScalarProgram) and isinstance(spans, dict) and isinstance(derived, tuple)
        vars(program)["key"] = key
    except Exception:  # a damaged pickle may raise anything
        return None
    return _Common(program, spans, derived)
