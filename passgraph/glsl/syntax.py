"""The syntax tree of a shader, as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from passgraph.language.source import Span


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    span: Span
    depth: int  # levels of nested expressions, including this one


@dataclass(frozen=True, slots=True, eq=False)
class Number(Node):
    """A literal: a number or ``true``."""

    type: Literal["int", "uint", "float", "bool"]
    value: bool | int | float


@dataclass(frozen=True, slots=True, eq=False)
class Name(Node):
    name: str


@dataclass(frozen=True, slots=True, eq=False)
class Unary(Node):
    """``-a +a !a ~a``."""

    sign: str
    operand: Expr


@dataclass(frozen=True, slots=True, eq=False)
class Step(Node):
    """``++a``, ``a++``, ``--a``, ``a--``."""

    sign: Literal["+", "-"]
    before: bool
    target: Expr


@dataclass(frozen=True, slots=True, eq=False)
class Binary(Node):
    sign: str
    left: Expr
    right: Expr


@dataclass(frozen=True, slots=True, eq=False)
class Choice(Node):
    """``a ? b : c``."""

    condition: Expr
    then: Expr
    orelse: Expr


@dataclass(frozen=True, slots=True, eq=False)
class Assignment(Node):
    """An assignment: ``a = b``, or ``a += b`` with the sign ``+``."""

    sign: str
    target: Expr
    value: Expr


@dataclass(frozen=True, slots=True, eq=False)
class Call(Node):
    """A call of a function, or of the constructor of a type."""

    name: str
    arguments: tuple[Expr, ...]
    type: TypeName | None = None  # the type of a constructor


@dataclass(frozen=True, slots=True, eq=False)
class Member(Node):
    """A field or a swizzle; ``a.length()`` is the member ``length()``."""

    base: Expr
    name: str


@dataclass(frozen=True, slots=True, eq=False)
class Subscript(Node):
    base: Expr
    index: Expr


@dataclass(frozen=True, slots=True, eq=False)
class Sequence(Node):
    """``a, b``; its value is the last one's."""

    parts: tuple[Expr, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Braces(Node):
    """``{a, b}`` as the initial value of a declaration."""

    parts: tuple[Expr, ...]


Expr: TypeAlias = (
    Number | Name | Unary | Step | Binary | Choice | Assignment | Call | Member | Subscript | Sequence | Braces
)


@dataclass(frozen=True, slots=True, eq=False)
class TypeName:
    """A type as written; a length None is ``[]``."""

    span: Span
    name: str
    lengths: tuple[Expr | None, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Variable:
    """A variable of a declaration."""

    span: Span
    name: str
    type: TypeName
    value: Expr | None


@dataclass(frozen=True, slots=True, eq=False)
class Declaration:
    """A declaration of variables; ``layout`` has the names of ``layout(…)`` with their numbers."""

    span: Span
    qualifiers: frozenset[str]
    variables: tuple[Variable, ...]
    layout: dict[str, int]


@dataclass(frozen=True, slots=True, eq=False)
class Struct:
    span: Span
    name: str
    fields: tuple[Variable, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Interface:
    """``uniform Name { … } instance[lengths];``."""

    span: Span
    qualifiers: frozenset[str]
    name: str
    fields: tuple[Variable, ...]
    instance: str
    lengths: tuple[Expr | None, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Parameter:
    span: Span
    name: str
    type: TypeName
    passed: Literal["in", "out", "inout"]
    is_const: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Function:
    """A function; ``body`` is None for a prototype."""

    span: Span
    name: str
    result: TypeName
    parameters: tuple[Parameter, ...]
    body: Block | None


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    span: Span
    statements: tuple[Statement, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Evaluate:
    """An expression statement."""

    span: Span
    value: Expr


@dataclass(frozen=True, slots=True, eq=False)
class If:
    span: Span
    condition: Expr
    then: Statement
    orelse: Statement | None


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """``for``, ``while`` or, if ``late``, ``do … while``."""

    span: Span
    start: Statement | None
    condition: Expr | None
    update: Expr | None
    body: Statement
    late: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """The statements from a label to the next; the label None is ``default``."""

    span: Span
    value: Expr | None
    statements: tuple[Statement, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Switch:
    span: Span
    value: Expr
    cases: tuple[Case, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Return:
    span: Span
    value: Expr | None


@dataclass(frozen=True, slots=True, eq=False)
class Jump:
    span: Span
    kind: Literal["break", "continue", "discard"]


Statement: TypeAlias = Declaration | Struct | Block | Evaluate | If | Loop | Switch | Return | Jump
Outer: TypeAlias = Declaration | Struct | Interface | Function
