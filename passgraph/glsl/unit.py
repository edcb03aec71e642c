"""State of a shader being lowered to the typed representation, shared by its functions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias, TypeVar

from passgraph.errors import UnsupportedGlslError
from passgraph.glsl import syntax as g
from passgraph.glsl.dialect import Dialect
from passgraph.glsl.elsewhere import elsewhere
from passgraph.glsl.operators import fitted
from passgraph.glsl.walk import largest_indices
from passgraph.language import ir
from passgraph.language.assignments import Place, Variable
from passgraph.language.function_body import Builder
from passgraph.language.signature import MAX_BUFFER_LENGTH, checked_array
from passgraph.language.source import Span, fail
from passgraph.language.types import IMAGE, NAMED, Array, ImageType, Struct, TupleType, Type, image_names
from passgraph.language.value_ranges import Range
from passgraph.language.values import Part


@dataclass(frozen=True)
class Uniform:
    """A uniform of the text; ``default`` is its initial value there."""

    name: str
    type: Type
    span: Span
    default: object = None
    has_default: bool = False


#: Samplers of pictures, which are read as floats. A volume is a picture of its slices.
_PICTURES = frozenset(["sampler2D", "sampler2DRect", "samplerExternalOES", "sampler3D", "sampler1D"])
SQUARE = {f"mat{n}x{n}": f"mat{n}" for n in (2, 3, 4)}
_NEVER = 1 << 62
#: The place behind all declarations; built-in functions are before all.
END, BEFORE = 1 << 62, -1
T = TypeVar("T")


@dataclass(eq=False)
class Slot:
    """A variable of the shader; ``born`` is the count of names at its declaration."""

    variable: Variable
    born: int
    written: bool = False
    is_open: bool = False  # an array whose length may be declared later


@dataclass(frozen=True, eq=False)
class Known:
    """A name of a value that cannot be assigned: a constant, a uniform, an input."""

    part: Part
    what: str


#: What a name means: a value, or a struct.
Binding: TypeAlias = Slot | Known | Struct


@dataclass(frozen=True)
class Note:
    """A part of the shader that depends on the driver."""

    span: Span
    text: str

    def __str__(self) -> str:
        return self.span.point_at(self.text)


#: A built-in GLSL function on typed values.
Native: TypeAlias = Callable[["Unit", list[Part], Span], Part]
#: A built-in value.
NativeValue: TypeAlias = Callable[["Unit", Span], Part]


@dataclass(eq=False)
class Unit:
    """State shared by all functions of a shader."""

    rows_up: bool = True  # True if the shader counts rows from the bottom
    leveled: frozenset[str] = frozenset()  # pictures with mipmaps, whose levels derivatives select
    around: frozenset[str] = (
        frozenset()
    )  # file names of the container's text, whose uniforms become parameters only if they are used
    has_vertex_stage: bool = False  # True if variables of the prelude are the only inputs
    dialect: Dialect = field(default_factory=Dialect)
    tree: tuple[g.Outer, ...] = ()
    builder: Builder = field(default_factory=lambda: Builder("pixel"))
    functions: dict[str, list[g.Function]] = field(default_factory=dict)
    #: The place of each function among the declarations of the shader; and where its first declaration is.
    defined_at: dict[g.Function, int] = field(default_factory=dict)
    declared_at: dict[g.Function, int] = field(default_factory=dict)
    signatures: dict[g.Function, tuple[Type, ...]] = field(default_factory=dict)  # types of parameters
    names: dict[str, Binding] = field(default_factory=dict)
    #: The declarations of each name outside of functions, with their places; a container may declare a name twice.
    bound_at: dict[str, list[tuple[int, Binding]]] = field(default_factory=dict)
    uniforms: dict[str, Uniform] = field(default_factory=dict)
    samplers: dict[str, str] = field(default_factory=dict)  # types of uniforms that are samplers, or arrays of them
    parts: int = 0  # plain parts of all uniforms
    values: Mapping[str, g.Expr] = field(default_factory=dict)  # of the host, where a name has no other meaning
    missing: dict[str, str] = field(default_factory=dict)  # names that are not available, with the reasons
    used: set[str] = field(default_factory=set)  # global names that functions read
    notes: dict[tuple[str, int, str], Note] = field(default_factory=dict)
    inlined: set[g.Function] = field(default_factory=set)  # functions with a call that was lowered
    leaving: dict[g.Statement, bool] = field(default_factory=dict)  # statements that may leave their function
    work: int = 0  # estimated instructions of open loops
    trips: int = 1  # of the enclosing loops together, with the most for open ones
    known_trips: int = 1  # of the enclosing loops with known trip counts
    undecided: int = 0  # number of enclosing open loops
    #: Ranges of the enclosing loops' counters, by their names in the representation and their components.
    counters: dict[tuple[str, int], Range] = field(default_factory=dict)
    #: The oldest variable written since the last reset, by the count of names at its declaration.
    oldest_write: int = _NEVER

    @cached_property
    def largest_indices(self) -> dict[str, int]:
        """Return the largest literal index of each name, anywhere in the shader."""
        return largest_indices(self.tree)

    def open_length(self, variable: g.Variable) -> tuple[int, ...]:
        """Return the length of an array that is declared with ``[]`` and no value: enough for its literal indices.

        GLSL ES has no such arrays (ES 3.00, section 4.1.9; GLSL 3.30, section 4.1.9).
        """
        known = self.largest_indices.get(variable.name)
        return () if known is None or self.dialect.es or variable.value is not None else (known + 1,)

    def sampler_of(self, image: str) -> str:
        """Return the type of the sampler that reads a picture; empty for one in a struct."""
        return self.samplers.get(image.partition(".")[0], "")

    def turned(self, read: str) -> str:
        """Return the library function that reads with the shader's direction of rows."""
        return f"{read}_upward" if self.rows_up else read

    def note(self, span: Span, text: str) -> None:
        """Add a note, once for each line and kind."""
        self.notes.setdefault((span.file, span.line, text), Note(span, text))

    def captured(self, compute: Callable[[], T], span: Span) -> tuple[tuple[ir.Stmt, ...], T]:
        """Run a computation and return the statements that it emits, as a block, and its value."""
        results: list[T] = []
        return self.builder.captured(lambda: results.append(compute()), span), results[0]

    def ordered(self, computations: Sequence[Callable[[], Part]], span: Span) -> list[Part]:
        """Evaluate computations in order; earlier values are kept if a later computation changes variables."""
        parts: list[Part] = []
        for compute in computations:
            before, born, start = self.oldest_write, self.builder.count, len(self.builder.blocks[-1])
            self.oldest_write = _NEVER
            part = compute()
            if parts and self.oldest_write <= born:
                block = self.builder.blocks[-1]
                emitted = block[start:]
                del block[start:]
                parts = [self.builder.name_part(earlier, span, keep_locals=False) for earlier in parts]
                block += emitted
            self.oldest_write = min(before, self.oldest_write)
            parts.append(part)
        return parts

    def slot(self, variable: Variable, *, written: bool = True) -> Slot:
        return Slot(variable, self.builder.count, written)

    def store_at(self, slot: Slot, place: Place, part: Part, span: Span, what: str) -> None:
        """Assign to a variable, to a field of it, or to an entry of its arrays."""
        slot.written = True
        self.oldest_write = min(self.oldest_write, slot.born)
        self.builder.store_at(place, fitted(part, place.type, span, what), span, what)

    # Types

    def plain_type(self, name: str, span: Span) -> Type:
        """Return a built-in type."""
        if name in _PICTURES:
            return IMAGE
        type_ = NAMED.get(SQUARE.get(name, name))
        if type_ is None or isinstance(type_, ImageType):
            fail(span, elsewhere(name) or f"{name} is not a type that values have", UnsupportedGlslError)
        return type_

    def array_type(self, element: Type, length: ir.Number | None, span: Span) -> Type:
        """Return an array type of a length."""
        assert not isinstance(element, TupleType)
        if not isinstance(length, int) or isinstance(length, bool) or not 1 <= length <= MAX_BUFFER_LENGTH:
            fail(span, f"the length of an array is a known whole number from 1 to {MAX_BUFFER_LENGTH}")
        return checked_array(Array(element, length), span)


def holds_pictures(type_: Type) -> bool:
    """Return True if a type is, or contains, a picture."""
    return bool(image_names(type_, ""))
