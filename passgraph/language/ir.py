"""The typed intermediate representation: the meaning of a kernel before optimization.

A tree of expressions over scalars, vectors, matrices and arrays, with functions inlined, structs split into fields and
one exit at the end.  The reference backend interprets it directly; :mod:`.lower` turns it into the scalar program that
other backends print.  Spans do not take part in equality.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import field, fields, replace
from typing import Any, TypeAlias, get_args, overload
from typing import Literal as OneOf

from passgraph.language.builtin_name import BuiltinName
from passgraph.language.source import NOWHERE, Span
from passgraph.language.types import Array, Scalar, Type, Value, image_names
from passgraph.ranges import Range
from passgraph.records import dataclass

Number: TypeAlias = bool | int | float
#: Suffix of an image's name for the picture of its smaller levels, see :mod:`passgraph.plan.mipmaps`.
MIPS = ".mips"


@dataclass(frozen=True, slots=True)
class Literal:
    """A number in the source or a captured constant."""

    type: Scalar
    value: Number
    span: Span = field(default=NOWHERE, compare=False, repr=False)
    #: True if a negative int was written as bits, 0xFFFFFFFF for -1: it is a uint where one is expected.
    bits: bool = field(default=False, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Table:
    """A captured constant array; ``values`` are flat, in component order."""

    type: Array
    values: tuple[Number, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Uniform:
    """A parameter, or a field of a struct parameter (``light.color``); ``const`` ones are baked."""

    type: Value | Array
    name: str
    const: bool = False
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Builtin:
    """A stage input: ``pixel``, ``output_size``, the ``normal`` of ``vertex`` or ``varying`` …; see `BuiltinName`."""

    type: Value
    name: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)
    of: str = ""
    axes: str = ""

    @property
    def key(self) -> BuiltinName:
        return BuiltinName(self.name, self.of, axes=self.axes)


@dataclass(frozen=True, slots=True)
class Local:
    """A variable of the kernel."""

    type: Value | Array
    name: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Apply:
    """A call of an operation of the table."""

    type: Value
    operation: str
    arguments: tuple[Expr, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Select:
    """``a if condition else b``; both sides are pure, so evaluating both is allowed."""

    type: Value
    condition: Expr
    then: Expr
    orelse: Expr
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Swizzle:
    """Components of a value, in any order."""

    type: Value
    value: Expr
    components: tuple[int, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Construct:
    """A vector, matrix (by columns) or array from components listed in order; parts are flattened."""

    type: Value | Array
    arguments: tuple[Expr, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Index:
    """An element of a vector, column of a matrix or entry of an array; the index is clamped into range."""

    type: Value
    value: Expr
    index: Expr
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Insert:
    """``value`` with the element at ``index`` replaced; an index out of range changes nothing."""

    type: Value | Array
    value: Expr
    index: Expr
    element: Expr
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Texel:
    """A texel as vec4, at an offset from this pixel or at an absolute position; the border rule applies."""

    type: Value
    image: str
    x: Expr
    y: Expr
    relative: bool
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Filtered:
    """``value``, or the result of a device's own filter for the image at a position: within ``slack`` of it."""

    type: Value
    image: str
    x: Expr
    y: Expr
    value: Expr
    slack: Expr
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Property:
    """A property of an image's handle, see :data:`.facts.PROPERTIES`: known when the graph is compiled."""

    type: Value
    image: str
    name: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Size:
    """Width and height of an image, as ivec2."""

    type: Value
    image: str
    span: Span = field(default=NOWHERE, compare=False, repr=False)


Expr: TypeAlias = (
    Literal
    | Table
    | Uniform
    | Builtin
    | Local
    | Apply
    | Select
    | Swizzle
    | Construct
    | Index
    | Insert
    | Texel
    | Filtered
    | Property
    | Size
)


@dataclass(frozen=True, slots=True)
class Assign:
    """Assigns a value to a variable."""

    name: str
    value: Expr
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class If:
    """Executes one of two blocks."""

    condition: Expr
    then: tuple[Stmt, ...]
    orelse: tuple[Stmt, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class For:
    """``for name in range(start, stop, step)``; a step of 0 makes no iterations.

    Bounds need not be constants; the most iterations that they allow are known when the graph is compiled.
    """

    name: str
    start: Expr
    stop: Expr
    step: Expr
    body: tuple[Stmt, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Break:
    """Leaves the innermost loop."""

    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Continue:
    """Continues with the next iteration of the innermost loop."""

    span: Span = field(default=NOWHERE, compare=False, repr=False)


Stmt: TypeAlias = Assign | If | For | Break | Continue

#: The classes of expressions, and those of statements.
EXPRESSIONS: tuple[type[Expr], ...] = get_args(Expr)
STATEMENTS: tuple[type[Stmt], ...] = get_args(Stmt)
#: Class of a node → its fields with one or more nodes.
PARTS: dict[type[Any], tuple[str, ...]] = {
    cls: tuple(f.name for f in fields(cls) if f.type in ("Expr", "tuple[Expr, ...]", "tuple[Stmt, ...]"))
    for cls in (*EXPRESSIONS, *STATEMENTS)
}
#: Class of a node → its other fields, except its span.
SAID: dict[type[Any], tuple[str, ...]] = {
    cls: tuple(f.name for f in fields(cls) if f.compare and f.name not in parts) for cls, parts in PARTS.items()
}


@overload
def parts_of(node: Expr) -> tuple[Expr, ...]: ...
@overload
def parts_of(node: Stmt | Expr) -> tuple[Stmt | Expr, ...]: ...
def parts_of(node: Stmt | Expr) -> tuple[Stmt | Expr, ...]:
    """Return the child expressions and statements of a node, in the order of its fields."""
    values = (getattr(node, name) for name in PARTS[type(node)])
    return tuple(part for value in values for part in (value if isinstance(value, tuple) else (value,)))


def with_parts(expression: Expr, change: Callable[[Expr], Expr]) -> Expr:
    """Return the same expression with changed children; itself if it has none."""
    changed: dict[str, Any] = {}
    for name in PARTS[type(expression)]:
        part_or_parts = getattr(expression, name)
        changed[name] = (
            tuple(change(part) for part in part_or_parts) if isinstance(part_or_parts, tuple) else change(part_or_parts)
        )
    return replace(expression, **changed) if changed else expression


Stage: TypeAlias = OneOf["pixel", "vertex", "fragment", "blend", "border", "function"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of the signature, before structs are split."""

    name: str
    type: Type
    const: bool = False
    default: object = None
    has_default: bool = False
    span: Span = field(default=NOWHERE, compare=False, repr=False)
    #: Range of each of its numbers.
    range: Range | None = None


@dataclass(frozen=True, slots=True)
class Result:
    """An output of a kernel: for pixel and fragment kernels a target, for vertex kernels a varying."""

    name: str
    type: Value
    value: Expr


@dataclass(frozen=True, slots=True)
class TypedKernel:
    """A whole kernel in the intermediate representation."""

    name: str
    stage: Stage
    parameters: tuple[Parameter, ...]
    body: tuple[Stmt, ...]
    results: tuple[Result, ...]
    keep: Expr | None = None  # false where a fragment is discarded; None if nothing discards
    source: Span = field(default=NOWHERE, compare=False, repr=False)

    @property
    def images(self) -> tuple[str, ...]:
        """Return the names of all images that it may read: parameters, and those in fields and entries of
        parameters."""
        return tuple(name for p in self.parameters for name in image_names(p.type, p.name))

    @property
    def pictures(self) -> tuple[str, ...]:
        """Return its images, and the names of their smaller levels."""
        return (*self.images, *(name + MIPS for name in self.images))


def expressions(*roots: Stmt | Expr) -> Iterator[Expr]:
    """Yield every expression inside statements and expressions, each once."""
    pending = list(roots)
    while pending:
        part = pending.pop()
        if isinstance(part, EXPRESSIONS):
            yield part
        pending += parts_of(part)


def walk(statements: Iterable[Stmt]) -> Iterator[Stmt]:
    """Yield every statement, including those inside branches and loops."""
    for statement in statements:
        yield statement
        if isinstance(statement, If):
            yield from walk((*statement.then, *statement.orelse))
        elif isinstance(statement, For):
            yield from walk(statement.body)


def assignments(statements: Iterable[Stmt]) -> Iterator[Assign]:
    """Yield every assignment, including those inside branches and loops."""
    return (statement for statement in walk(statements) if isinstance(statement, Assign))


def jumps(statements: Iterable[Stmt], kinds: type | tuple[type, ...] = (Break, Continue)) -> bool:
    """Return True if a jump of the loop with these statements is inside (not one of a nested loop)."""
    return any(isinstance(s, kinds) or (isinstance(s, If) and jumps((*s.then, *s.orelse), kinds)) for s in statements)
