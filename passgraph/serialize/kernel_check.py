"""What a kernel from elsewhere must keep to: all that the parser promises of those that it makes of text.

Expressions are checked as they are read, from the leaves up, so that each knows that its parts are right.  Statements
are checked together: a variable has one type, and a value wherever it is read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from passgraph.errors import PassgraphError
from passgraph.language import ir
from passgraph.language.expressions import STAGE_VALUES
from passgraph.language.facts import PROPERTIES
from passgraph.language.long_arrays import check_reads, check_sizes, is_buffer
from passgraph.language.meanings import INT_MAX, INT_MIN
from passgraph.language.operations import OPERATIONS
from passgraph.language.signature import VERTEX, check_images
from passgraph.language.source import NOWHERE
from passgraph.language.statements import MAX_BLOCKS
from passgraph.language.symbols import UINT_MAX
from passgraph.language.types import (
    BOOL,
    FLOAT,
    INT,
    IVEC2,
    MAX_ARRAY_LENGTH,
    UINT,
    VEC4,
    Array,
    Matrix,
    Scalar,
    Struct,
    Type,
    Vector,
    component_count,
    element_of,
    image_names,
    is_plain,
    plain_parts,
)
from passgraph.language.typing_rules import apply
from passgraph.language.uniform_layout import FLOAT_END
from passgraph.language.values import index_into

_HELD: dict[str, type[Any]] = {"bool": bool, "int": int, "uint": int, "float": float}


class Unfit(Exception):
    """What is expected of a row, in words; who knows the place makes an error of it."""


def held(value: Any, type_: Scalar) -> ir.Number:
    """A number as the language holds it; whole numbers may stand for floats, as JSON writers make no difference."""
    kind = _HELD[type_.name]
    given = float(value) if kind is float and type(value) is int else value
    if type(given) is not kind:
        raise Unfit(f"of {type_}")
    low, high = (0, UINT_MAX) if type_ is UINT else (INT_MIN, INT_MAX)
    if kind is int and not low <= given <= high:
        raise Unfit(f"{'a uint' if type_ is UINT else 'an int'} of 32 bits")
    if kind is float and math.isfinite(given) and abs(given) >= FLOAT_END:
        raise Unfit("within float32 (3.4e38)")
    made: ir.Number = given
    return made


def as_unfit(check: Callable[..., object], *given: Any) -> None:
    """A check of the parser's, whose error becomes what is expected."""
    try:
        check(*given)
    except PassgraphError as error:
        told = str(error).splitlines()[0].removeprefix(f"{NOWHERE.file}:{NOWHERE.line}: ")
        raise Unfit(f"within the language's limits: {told}") from None


def check_arrays(parameters: tuple[ir.Parameter, ...], *roots: ir.Stmt | ir.Expr) -> None:
    """Long arrays are read by index alone."""
    as_unfit(check_reads, parameters, *roots)


def handed_in(stage: ir.Stage, type_: Type) -> bool:
    """Whether a parameter is what the stage hands in: the mesh's vertex, or what the vertex kernel sends."""
    return isinstance(type_, Struct) and (stage == "fragment" or (stage == "vertex" and type_.name == VERTEX.name))


class Signature:
    """What the expressions of a kernel may read: its parameters, taken apart, and what its stage hands in."""

    def __init__(self, stage: ir.Stage, parameters: tuple[ir.Parameter, ...]) -> None:
        self.stage = stage
        as_unfit(check_images, "a kernel", parameters, NOWHERE)
        as_unfit(check_sizes, parameters)
        self.images = {name for p in parameters for name in image_names(p.type, p.name)}
        self.uniforms: dict[str, tuple[Type, bool]] = {}
        stages = {name: type_ for name, (type_, stages) in STAGE_VALUES.items() if stage in stages and name != "uv"}
        self.builtins: dict[str, Type] = stages
        for parameter in parameters:
            type_ = parameter.type
            if isinstance(type_, Struct) and handed_in(stage, type_):
                if stage == "fragment":
                    self._hand_in("varying", parameter, parameters[0], type_)
                else:
                    self._hand_in("vertex", parameter, parameter, VERTEX)
            else:
                self._take(parameter.name, type_, parameter.const)

    def _hand_in(self, prefix: str, parameter: ir.Parameter, expected: ir.Parameter, struct: Struct) -> None:
        plain = all(isinstance(type_, (Scalar, Vector)) for _, type_ in struct.fields)
        if parameter is not expected or parameter.type != struct or not plain:
            raise Unfit("a struct as the mesh or the vertex kernel hands it in, and as the first parameter")
        self.builtins |= {f"{prefix}.{name}": type_ for name, type_ in struct.fields}

    def _take(self, name: str, type_: Type, const: bool) -> None:
        self.uniforms |= {path: (part, const) for path, part in plain_parts(type_, name) if is_plain(part)}

    def check(self, node: Any) -> None:
        """An expression whose parts are right, and no statements."""
        for part in ir.parts_of(node):
            if isinstance(part, ir.STATEMENTS):
                raise Unfit("an expression of expressions, not of statements")
        if not is_plain(node.type):
            raise Unfit("of a plain type")
        if is_buffer(node.type) and not isinstance(node, ir.Uniform):
            raise Unfit(f"an array of at most {MAX_ARRAY_LENGTH} elements; longer ones are parameters")
        _CHECKS[type(node)](self, node)


def _literal(_: Signature, node: ir.Literal) -> None:
    if str(node.type) not in _HELD:
        raise Unfit("a scalar")


def _table(_: Signature, node: ir.Table) -> None:
    if len(node.values) != component_count(node.type):
        raise Unfit("an array of as many numbers as its type has")


def _uniform(signature: Signature, node: ir.Uniform) -> None:
    if signature.uniforms.get(node.name) != (node.type, node.const):
        raise Unfit("a parameter of the kernel, of its type")


def _builtin(signature: Signature, node: ir.Builtin) -> None:
    name, axes = ir.own_pixel(node.name)
    beside = axes in ir.OTHER_PIXELS and ir.of_triangle(name)
    if signature.builtins.get(name) != node.type or node.name != (ir.other_pixel(name, axes) if beside else name):
        raise Unfit(f"one of {', '.join(signature.builtins)}, of its type")


def _apply(_: Signature, node: ir.Apply) -> None:
    row = OPERATIONS.get(node.operation)
    if row is None or len(node.arguments) != len(row.operands):
        raise Unfit("an operation of the language, with as many arguments as it takes")
    try:
        made = apply(node.operation, list(node.arguments), NOWHERE)
    except PassgraphError as error:
        raise Unfit(str(error).splitlines()[0].partition(": ")[2]) from None
    given = zip(made.arguments, node.arguments, strict=True) if isinstance(made, ir.Apply) else ()
    same = isinstance(made, ir.Apply) and made.operation == node.operation
    if not same or made.type != node.type or not all(one is other for one, other in given):
        raise Unfit(f"{node.operation} on what it takes, giving {made.type}")


def _select(_: Signature, node: ir.Select) -> None:
    if node.condition.type != BOOL or not node.then.type == node.orelse.type == node.type or _is_array(node):
        raise Unfit("a choice by a bool between two values of its type, which is no array")


def _swizzle(_: Signature, node: ir.Swizzle) -> None:
    base, count = node.value.type, len(node.components)
    if not isinstance(base, Vector) or not 1 <= count <= 4 or any(i >= base.size for i in node.components):
        raise Unfit("1 to 4 components of a vector")
    if node.type != (base.element if count == 1 else Vector(base.element, count)):
        raise Unfit("of the type that its components make")


def _construct(_: Signature, node: ir.Construct) -> None:
    element, kinds = (
        element_of(node.type),
        (Scalar, Vector) if isinstance(node.type, Vector) else (Scalar, Vector, Matrix),
    )
    fit = all(isinstance(a.type, kinds) and element_of(a.type) == element for a in node.arguments)
    if isinstance(node.type, Scalar) or not fit:
        raise Unfit(f"a vector, matrix or array made of components of {element}")
    if sum(component_count(a.type) for a in node.arguments) != component_count(node.type):
        raise Unfit(f"{node.type} of {component_count(node.type)} components")


def _index(_: Signature, node: ir.Index) -> None:
    _check_indexed(node.value, node.index)
    entry = index_into(node.value, ir.Local(INT, ""), NOWHERE)
    if entry.type != node.type:
        raise Unfit(f"of type {entry.type}")


def _insert(_: Signature, node: ir.Insert) -> None:
    _check_indexed(node.value, node.index)
    entry = index_into(node.value, ir.Local(INT, ""), NOWHERE)
    if node.type != node.value.type or node.element.type != entry.type:
        raise Unfit(f"{node.value.type} with an entry of type {entry.type}")


def _check_indexed(value: ir.Expr, index: ir.Expr) -> None:
    if isinstance(value.type, Scalar) or index.type != INT:
        raise Unfit("an int into a vector, matrix or array")


def _texel(signature: Signature, node: ir.Texel) -> None:
    if (
        node.image.removesuffix(ir.MIPS) not in signature.images
        or not node.x.type == node.y.type == INT
        or node.type != VEC4
    ):
        raise Unfit("a vec4 from an image parameter, at two ints")
    if node.relative and (signature.stage != "pixel" or node.image not in signature.images):
        raise Unfit("a texel at an absolute place")


def _filtered(signature: Signature, node: ir.Filtered) -> None:
    plain = node.x.type == node.y.type == FLOAT and node.type == node.value.type == node.slack.type == VEC4
    if node.image not in signature.images or not plain:
        raise Unfit("a vec4 from an image parameter, at two floats, and two of type vec4")


def _property(signature: Signature, node: ir.Property) -> None:
    if node.image not in signature.images or PROPERTIES.get(node.name) != node.type:
        raise Unfit(f"one of {', '.join(PROPERTIES)} of an image parameter, of its type")


def _size(signature: Signature, node: ir.Size) -> None:
    if node.image not in signature.images or node.type != IVEC2:
        raise Unfit("the ivec2 of an image parameter")


def _is_array(node: ir.Expr) -> bool:
    return isinstance(node.type, Array)


_CHECKS: Mapping[type[Any], Callable[[Signature, Any], None]] = {
    ir.Literal: _literal, ir.Table: _table, ir.Uniform: _uniform, ir.Builtin: _builtin, ir.Local: lambda *_: None,
    ir.Apply: _apply, ir.Select: _select, ir.Swizzle: _swizzle, ir.Construct: _construct, ir.Index: _index,
    ir.Insert: _insert, ir.Texel: _texel, ir.Size: _size, ir.Property: _property, ir.Filtered: _filtered,
}  # fmt: skip


class Variables:
    """Variables of a kernel, statement by statement: one type each, and a value before they are read."""

    def __init__(self) -> None:
        self.types: dict[str, Type] = {}
        self._indices: set[str] = set()

    def block(
        self, statements: tuple[Any, ...], known: set[str], in_loop: bool, depth: int = 0
    ) -> tuple[set[str], bool]:
        """The variables that have a value after it, and whether nothing after it runs."""
        if depth > MAX_BLOCKS:
            raise Unfit(f"blocks at most {MAX_BLOCKS} deep")
        left = False
        for statement in statements:
            if not isinstance(statement, ir.STATEMENTS):
                raise Unfit("blocks of statements")
            if isinstance(statement, ir.Assign):
                self._assign(statement, known)
            elif isinstance(statement, ir.If):
                known, leaves = self._if(statement, known, in_loop, depth + 1)
                left = left or leaves
            elif isinstance(statement, ir.For):
                self._for(statement, known, depth + 1)
            elif in_loop:
                left = True
            else:
                raise Unfit("break and continue inside loops")
        return known, left

    def _assign(self, statement: ir.Assign, known: set[str]) -> None:
        self.read(statement.value, known)
        if self.types.setdefault(statement.name, statement.value.type) != statement.value.type:
            raise Unfit(f"one type for variable {statement.name!r}")
        if statement.name in self._indices:
            raise Unfit(f"nothing assigned to {statement.name!r}, the index of a loop")
        known.add(statement.name)

    def _if(self, statement: ir.If, known: set[str], in_loop: bool, depth: int) -> tuple[set[str], bool]:
        self.read(statement.condition, known)
        if statement.condition.type != BOOL:
            raise Unfit("a bool as the condition of a branch")
        then, then_left = self.block(statement.then, set(known), in_loop, depth)
        orelse, else_left = self.block(statement.orelse, set(known), in_loop, depth)
        if then_left or else_left:
            return (
                then | orelse if then_left and else_left else orelse if then_left else then
            ), then_left and else_left
        return then & orelse, False

    def _for(self, statement: ir.For, known: set[str], depth: int) -> None:
        for bound in (statement.start, statement.stop, statement.step):
            self.read(bound, known)
            if bound.type != INT:
                raise Unfit("ints as the bounds of a loop")
        if statement.name in self.types:
            raise Unfit(f"a name of its own for the index {statement.name!r} of a loop")
        self.types[statement.name] = INT
        self._indices.add(statement.name)
        self.block(statement.body, known | {statement.name}, True, depth)

    def read(self, expression: ir.Expr, known: set[str]) -> None:
        pending: list[Any] = [expression]
        seen: set[int] = set()
        while pending:
            node = pending.pop()
            if id(node) in seen:
                continue
            seen.add(id(node))
            if isinstance(node, ir.Local) and (node.name not in known or self.types[node.name] != node.type):
                raise Unfit(f"variable {node.name!r} with a value of type {node.type} before it is read")
            pending += ir.parts_of(node)
