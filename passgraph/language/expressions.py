"""Expressions: from Python's syntax tree to typed expressions."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from passgraph.language import ir, symbols
from passgraph.language.operations import OPERATIONS
from passgraph.language.scope import FunctionSource, ModuleName, number
from passgraph.language.signature import MAX_ARRAY_LENGTH, resolve
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    BOOL,
    FLOAT,
    INT,
    IVEC2,
    VEC2,
    VEC4,
    Array,
    ImageType,
    Matrix,
    Scalar,
    Struct,
    Type,
    Vector,
    component_count,
    element_of,
    with_element,
)
from passgraph.language.typing_rules import apply, binary, unify, widen

if TYPE_CHECKING:
    from passgraph.language.parse import Frame


@dataclass(frozen=True)
class StructValue:
    """A struct taken apart: one value a field."""

    struct: Struct
    fields: dict[str, Part]


@dataclass(frozen=True)
class ImageValue:
    name: str


@dataclass(frozen=True)
class TupleValue:
    members: tuple[Part, ...]


Part: TypeAlias = ir.Expr | StructValue | ImageValue | TupleValue

_BINARY: dict[type[ast.operator], str] = {
    ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div", ast.FloorDiv: "floor_divide",
    ast.Mod: "mod", ast.MatMult: "matmul", ast.BitAnd: "bit_and", ast.BitOr: "bit_or", ast.BitXor: "bit_xor",
    ast.LShift: "shift_left", ast.RShift: "shift_right",
}  # fmt: skip
_COMPARE: dict[type[ast.cmpop], str] = {
    ast.Lt: "less", ast.LtE: "less_equal", ast.Gt: "greater", ast.GtE: "greater_equal",
    ast.Eq: "equal", ast.NotEq: "not_equal",
}  # fmt: skip
_SWIZZLES = ("xyzw", "rgba", "stpq")
#: Whole exponents up to this size become multiplications, which are defined for negative bases too.
_MAX_EXPANDED_POWER = 16

_REFUSED: dict[type[ast.expr], str] = {
    ast.Lambda: "lambda; write a @pg.function", ast.Dict: "dictionaries; use a @pg.struct",
    ast.Set: "sets", ast.ListComp: "comprehensions; write a for loop", ast.SetComp: "comprehensions; write a for loop",
    ast.DictComp: "comprehensions; write a for loop", ast.GeneratorExp: "generators; write a for loop",
    ast.Await: "await", ast.Yield: "yield", ast.YieldFrom: "yield from", ast.JoinedStr: "strings",
    ast.NamedExpr: ":=; assign on a line of its own", ast.Starred: "* arguments",
}  # fmt: skip


def part_type(part: Part) -> str:
    if isinstance(part, StructValue):
        return part.struct.name
    if isinstance(part, ImageValue):
        return "Image"
    if isinstance(part, TupleValue):
        return "tuple"
    return str(part.type)


class Expressions:
    """Parses the expressions of one function body; statements needed on the way go to ``frame.emit``."""

    def __init__(self, frame: Frame) -> None:
        self.frame = frame

    def span(self, node: ast.AST) -> Span:
        return self.frame.source.span(node)

    def value(self, node: ast.expr) -> ir.Expr:
        """An expression that is one value, not a struct, image or tuple."""
        part = self.part(node)
        if isinstance(part, (StructValue, ImageValue, TupleValue)):
            fail(self.span(node), f"a value is expected here, got {part_type(part)}")
        return part

    def condition(self, node: ast.expr) -> ir.Expr:
        value = self.value(node)
        if value.type != BOOL:
            mend = (
                "use any(...) or all(...)" if isinstance(value.type, Vector) else "compare it with something"
            )
            fail(self.span(node), f"a condition must be bool, got {value.type}; {mend}")
        return value

    def part(self, node: ast.expr) -> Part:
        span = self.span(node)
        if isinstance(node, ast.Constant):
            if isinstance(node.value, (bool, int, float)):
                return number(node.value, span)
            fail(span, f"the kernel language has numbers and bools, not {type(node.value).__name__}")
        if isinstance(node, ast.Name):
            return self._name(node)
        if isinstance(node, ast.Attribute):
            return self._attribute(node)
        if isinstance(node, ast.BinOp):
            return self._binary(node)
        if isinstance(node, ast.UnaryOp):
            return self._unary(node)
        if isinstance(node, ast.BoolOp):
            return self._bool(node)
        if isinstance(node, ast.Compare):
            return self._compare(node)
        if isinstance(node, ast.IfExp):
            return self._choice(node)
        if isinstance(node, ast.Call):
            return self._call(node)
        if isinstance(node, ast.Subscript):
            return self._subscript(node)
        if isinstance(node, ast.Tuple):
            return TupleValue(tuple(self.part(part) for part in node.elts))
        if isinstance(node, ast.List):
            return self._array([self.value(part) for part in node.elts], span)
        fail(span, f"the kernel language has no {_REFUSED.get(type(node), type(node).__name__)}")

    # Names and attributes

    def _name(self, node: ast.Name) -> Part:
        local = self.frame.read(node.id, self.span(node))
        if local is not None:
            return local
        return self._outer(node)

    def _outer(self, node: ast.expr) -> Part:
        meaning = resolve(node, self.frame.scope, self.frame.source)
        if isinstance(meaning, (ir.Literal, ir.Table, ir.Construct)):
            return meaning
        if isinstance(meaning, (symbols.Symbol, FunctionSource, str)):
            fail(self.span(node), f"{ast.unparse(node)} is a function; call it")
        fail(self.span(node), f"{ast.unparse(node)} is not a value")

    def _attribute(self, node: ast.Attribute) -> Part:
        span = self.span(node)
        if self._is_outer(node):
            return self._outer(node)
        base = self.part(node.value)
        if isinstance(base, StructValue):
            if node.attr not in base.fields:
                fail(span, f"{base.struct.name} has no field {node.attr!r}; it has {', '.join(base.fields)}")
            return base.fields[node.attr]
        if isinstance(base, ImageValue):
            if node.attr == "size":
                return ir.Size(IVEC2, base.name, span)
            fail(span, f"an Image has [dx, dy], .texel(ivec2), .sample(vec2) and .size, not .{node.attr}")
        if isinstance(base, TupleValue):
            fail(span, "a tuple has no attributes; unpack it first")
        if isinstance(base.type, Vector):
            return swizzle(base, node.attr, span)
        fail(span, f"{base.type} has no attribute {node.attr!r}")

    def _is_outer(self, node: ast.expr) -> bool:
        """Whether a dotted name begins at a module rather than at a local."""
        while isinstance(node, ast.Attribute):
            node = node.value
        if not isinstance(node, ast.Name) or self.frame.knows(node.id):
            return False
        return isinstance(resolve(node, self.frame.scope, self.frame.source), ModuleName)

    # Operators

    def _binary(self, node: ast.BinOp) -> Part:
        span = self.span(node)
        if isinstance(node.op, ast.Mult) and isinstance(node.left, ast.List):
            return self._filled_array(node, span)
        left = self.value(node.left)
        if isinstance(node.op, ast.Pow):
            return self._power(left, node.right, span)
        return binary(_BINARY[type(node.op)], left, self.value(node.right), span)

    def _power(self, base: ir.Expr, node: ast.expr, span: Span) -> ir.Expr:
        exponent = self.value(node)
        literal = exponent
        sign = 1
        if isinstance(literal, ir.Apply) and literal.operation == "neg":
            literal, sign = literal.arguments[0], -1
        if isinstance(literal, ir.Literal) and literal.type is INT:
            n = sign * int(literal.value)
            if abs(n) <= _MAX_EXPANDED_POWER:
                return self._whole_power(base, n, span)
        return apply("pow", [base, exponent], span)

    def _whole_power(self, base: ir.Expr, n: int, span: Span) -> ir.Expr:
        if not isinstance(base.type, (Scalar, Vector)):
            fail(span, f"** does not take {base.type}")
        if n < 0:
            one = ir.Literal(FLOAT, 1.0, span)
            return apply("div", [one, self._whole_power(base, -n, span)], span)
        if n == 0:
            ones = ir.Literal(element_of(base.type), 1 if element_of(base.type) is INT else 1.0, span)
            return (
                ones
                if isinstance(base.type, Scalar)
                else ir.Construct(base.type, (ones,) * base.type.size, span)
            )
        base = self.frame.name_it(base, span)
        result: ir.Expr | None = None
        square = base
        while n:
            if n & 1:
                result = square if result is None else apply("mul", [result, square], span)
            n >>= 1
            if n:
                square = self.frame.name_it(apply("mul", [square, square], span), span)
        assert result is not None
        return result

    def _unary(self, node: ast.UnaryOp) -> ir.Expr:
        span = self.span(node)
        value = self.value(node.operand)
        if isinstance(node.op, ast.UAdd):
            return value
        if isinstance(node.op, ast.Not):
            return apply("logical_not", [value], span)
        if isinstance(node.op, ast.Invert):
            return apply("bit_not", [value], span)
        if isinstance(value, ir.Literal) and value.type is not BOOL:
            return number(-value.value, span)
        if isinstance(value.type, Matrix):
            return binary("mul", ir.Literal(FLOAT, -1.0, span), value, span)
        return apply("neg", [value], span)

    def _bool(self, node: ast.BoolOp) -> ir.Expr:
        operation = "logical_and" if isinstance(node.op, ast.And) else "logical_or"
        result = self.condition(node.values[0])
        for part in node.values[1:]:
            result = apply(operation, [result, self.condition(part)], self.span(node))
        return result

    def _compare(self, node: ast.Compare) -> ir.Expr:
        span = self.span(node)
        result: ir.Expr | None = None
        left = self.value(node.left)
        for operator, right_node in zip(node.ops, node.comparators, strict=True):
            if type(operator) not in _COMPARE:
                fail(span, "the kernel language has no 'is' and no 'in'; compare values with == or !=")
            right = self.value(right_node)
            if left.type == BOOL and right.type == BOOL and isinstance(operator, (ast.Eq, ast.NotEq)):
                one, other = (apply("to_int", [side], span) for side in (left, right))
            else:
                one, other = left, right
            link = apply(_COMPARE[type(operator)], [one, other], span)
            result = link if result is None else apply("logical_and", [result, link], span)
            left = right
        assert result is not None
        return result

    def _choice(self, node: ast.IfExp) -> Part:
        span = self.span(node)
        condition = self.condition(node.test)
        return choose(condition, self.part(node.body), self.part(node.orelse), span)

    # Calls

    def _call(self, node: ast.Call) -> Part:
        span = self.span(node)
        method = self._image_method(node)
        if method is not None:
            return method
        if isinstance(node.func, ast.Name) and self.frame.knows(node.func.id):
            fail(span, f"{node.func.id} is a value here, not a function")
        if not isinstance(node.func, (ast.Name, ast.Attribute)):
            fail(span, "only named functions can be called")
        if isinstance(node.func, ast.Attribute) and not self._is_outer(node.func):
            fail(span, f"values have no methods; got .{node.func.attr}()")
        meaning = resolve(node.func, self.frame.scope, self.frame.source)
        if isinstance(meaning, FunctionSource):
            return self.frame.inline(meaning, self._arguments(node), span)
        if isinstance(meaning, Struct):
            return self._make_struct(meaning, node)
        if node.keywords:
            fail(span, f"{ast.unparse(node.func)} takes no keyword arguments")
        if isinstance(meaning, (Scalar, Vector, Matrix)):
            return construct(meaning, [self.value(a) for a in node.args], span)
        name = meaning.name if isinstance(meaning, symbols.Symbol) else meaning
        if isinstance(name, str):
            return self._builtin(name, node, span)
        fail(span, f"{ast.unparse(node.func)} is not a function of the kernel language")

    def _arguments(self, node: ast.Call) -> tuple[list[Part], dict[str, Part]]:
        for argument in node.args:
            if isinstance(argument, ast.Starred):
                fail(self.span(argument), "the kernel language has no * arguments")
        named: dict[str, Part] = {}
        for keyword in node.keywords:
            if keyword.arg is None:
                fail(self.span(keyword.value), "the kernel language has no ** arguments")
            named[keyword.arg] = self.part(keyword.value)
        return [self.part(a) for a in node.args], named

    def _image_method(self, node: ast.Call) -> Part | None:
        if not isinstance(node.func, ast.Attribute) or self._is_outer(node.func):
            return None
        base = self.part(node.func.value)
        if not isinstance(base, ImageValue):
            return None
        span, method = self.span(node), node.func.attr
        if method not in ("texel", "sample") or len(node.args) != 1 or node.keywords:
            fail(span, "an Image is read by image[dx, dy], image.texel(ivec2) or image.sample(vec2)")
        position = self.value(node.args[0])
        if method == "sample":
            position = widen(position, VEC2, span, "the position of sample()")
            return self.frame.inline_library("sample", [base, position], span)
        position = self.frame.name_it(widen(position, IVEC2, span, "the position of texel()"), span)
        x, y = (ir.Swizzle(INT, position, (i,), span) for i in (0, 1))
        return ir.Texel(VEC4, base.name, x, y, False, span)

    def _builtin(self, name: str, node: ast.Call, span: Span) -> Part:
        if name == "len":
            (array,) = [self.value(a) for a in node.args] or [None]
            if array is None or not isinstance(array.type, (Array, Vector)):
                fail(span, "len() takes an array or a vector")
            return ir.Literal(
                INT, array.type.length if isinstance(array.type, Array) else array.type.size, span
            )
        if name == "range":
            fail(span, "range() belongs in a for statement: for i in range(n)")
        if name == "discard":
            fail(span, "discard() is a statement; write it on a line of its own")
        arguments = [self.value(a) for a in node.args]
        if name in STAGE_VALUES:
            return self.frame.stage_value(name, arguments, span)
        if name in ("min", "max") and len(arguments) > 2:
            result = arguments[0]
            for argument in arguments[1:]:
                result = apply(name, [result, argument], span)
            return result
        if name == "select":
            if len(arguments) != 3:
                fail(span, "select() takes a condition, the value where it holds and the value elsewhere")
            return _select(arguments, span)
        if name == "atan" and len(arguments) == 2:
            name = "atan2"
        if name == "clamp":
            _check_clamp(arguments, span)
        if name in OPERATIONS:
            return apply(name, arguments, span)
        fail(span, f"the kernel language has no {name}()")

    def _make_struct(self, struct: Struct, node: ast.Call) -> StructValue:
        span = self.span(node)
        positional, named = self._arguments(node)
        names = [name for name, _ in struct.fields]
        if len(positional) > len(names):
            fail(span, f"{struct.name} has {len(names)} fields, got {len(positional)} values")
        given = dict(zip(names, positional, strict=False))
        for name, part in named.items():
            if name not in names or name in given:
                fail(span, f"{struct.name} has no field {name!r} left to set; it has {', '.join(names)}")
            given[name] = part
        defaults = dict(struct.defaults)
        fields: dict[str, Part] = {}
        for name, type_ in struct.fields:
            if name in given:
                fields[name] = coerce(given[name], type_, span, f"{struct.name}.{name}")
            elif name in defaults:
                fields[name] = self.frame.default(defaults[name], type_, f"{struct.name}.{name}", span)
            else:
                fail(span, f"{struct.name} needs a value for field {name!r}")
        return StructValue(struct, fields)

    # Subscripts and arrays

    def _subscript(self, node: ast.Subscript) -> Part:
        span = self.span(node)
        base = self.part(node.value)
        if isinstance(base, ImageValue):
            if not (isinstance(node.slice, ast.Tuple) and len(node.slice.elts) == 2):
                fail(span, "an image takes two offsets in texels: image[dx, dy] (image[0, 0] is this pixel)")
            x, y = (
                widen(self.value(part), INT, self.span(part), "a texel offset") for part in node.slice.elts
            )
            if self.frame.stage != "pixel":
                fail(
                    span,
                    f"image[dx, dy] is relative to a pixel of a full-screen pass; in a {self.frame.stage} kernel use .texel()",
                )
            return ir.Texel(VEC4, base.name, x, y, True, span)
        if isinstance(base, TupleValue):
            if isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, int):
                if -len(base.members) <= node.slice.value < len(base.members):
                    return base.members[node.slice.value]
            fail(span, f"a tuple of {len(base.members)} takes a constant index in range")
        if isinstance(base, StructValue):
            fail(span, f"{base.struct.name} is read by field, not by index")
        if isinstance(node.slice, (ast.Slice, ast.Tuple)):
            fail(span, "the kernel language has no slices; use a swizzle such as v.xy")
        index = widen(self.value(node.slice), INT, span, "an index")
        return index_into(base, index, span)

    def _array(self, members: list[ir.Expr], span: Span) -> ir.Expr:
        if not members:
            fail(span, "an array needs at least one element")
        if len(members) > MAX_ARRAY_LENGTH:
            fail(span, f"an array has at most {MAX_ARRAY_LENGTH} elements, got {len(members)}")
        first = members[0]
        for member in members[1:]:
            first, _ = unify(first, member, span, "the elements of an array")
        if not isinstance(first.type, (Scalar, Vector, Matrix)):
            fail(span, f"array elements are scalars, vectors or matrices, got {first.type}")
        typed = tuple(widen(member, first.type, span, "an array element") for member in members)
        return ir.Construct(Array(first.type, len(typed)), typed, span)

    def _filled_array(self, node: ast.BinOp, span: Span) -> ir.Expr:
        assert isinstance(node.left, ast.List)
        count = self.value(node.right)
        if not isinstance(count, ir.Literal) or count.type is not INT or int(count.value) < 1:
            fail(span, "[value] * n needs a whole constant n >= 1")
        if int(count.value) * len(node.left.elts) > MAX_ARRAY_LENGTH:
            fail(
                span,
                f"an array has at most {MAX_ARRAY_LENGTH} elements, got {int(count.value) * len(node.left.elts)}",
            )
        members = [self.frame.name_it(self.value(part), span) for part in node.left.elts]
        return self._array(members * int(count.value), span)


#: Values that a stage provides: name -> (type, the stages that have it).
STAGE_VALUES: dict[str, tuple[Type, tuple[str, ...]]] = {
    "pixel": (IVEC2, ("pixel", "fragment")),
    "uv": (VEC2, ("pixel", "fragment")),
    "output_size": (IVEC2, ("pixel", "fragment")),
    "front_facing": (BOOL, ("fragment",)),
    "fragment_depth": (FLOAT, ("fragment",)),
}


def swizzle(base: ir.Expr, name: str, span: Span) -> ir.Expr:
    assert isinstance(base.type, Vector)
    components = swizzle_components(name, base.type, span)
    type_ = base.type.element if len(components) == 1 else Vector(base.type.element, len(components))
    return ir.Swizzle(type_, base, components, span)


def swizzle_components(name: str, type_: Vector, span: Span) -> tuple[int, ...]:
    for letters in _SWIZZLES:
        if name and all(letter in letters for letter in name):
            components = tuple(letters.index(letter) for letter in name)
            if len(components) > 4:
                fail(span, f"a swizzle has at most 4 letters, got .{name}")
            if max(components) >= type_.size:
                fail(span, f"{type_} has no component {letters[max(components)]!r}")
            return components
    fail(span, f"{type_} has no attribute {name!r}; swizzles use xyzw, rgba or stpq, one set at a time")


def construct(type_: Scalar | Vector | Matrix, arguments: list[ir.Expr], span: Span) -> ir.Expr:
    """``float(x)``, ``vec3(a, b)``, ``mat3(m4)``: GLSL's constructors."""
    for argument in arguments:
        if not isinstance(argument.type, (Scalar, Vector, Matrix)):
            fail(span, f"{type_}() does not take {argument.type}")
    if isinstance(type_, Scalar):
        if len(arguments) != 1 or not isinstance(arguments[0].type, Scalar):
            fail(span, f"{type_}() takes one scalar")
        return convert(arguments[0], type_, span)
    if isinstance(type_, Matrix):
        return _construct_matrix(type_, arguments, span)
    count = sum(component_count(a.type) for a in arguments)
    if len(arguments) == 1 and isinstance(arguments[0].type, Scalar):
        return ir.Construct(type_, (convert(arguments[0], type_.element, span),) * type_.size, span)
    if len(arguments) == 1 and isinstance(arguments[0].type, Vector) and count > type_.size:
        cut = swizzle(arguments[0], "xyzw"[: type_.size], span)
        return convert_elements(cut, type_.element, span)
    if count != type_.size or any(isinstance(a.type, Matrix) for a in arguments):
        fail(span, f"{type_}() takes {type_.size} components, got {count}")
    return ir.Construct(type_, tuple(convert_elements(a, type_.element, span) for a in arguments), span)


def _construct_matrix(type_: Matrix, arguments: list[ir.Expr], span: Span) -> ir.Expr:
    size = type_.size
    zero, one = ir.Literal(FLOAT, 0.0, span), ir.Literal(FLOAT, 1.0, span)
    if len(arguments) == 1 and isinstance(arguments[0].type, Scalar):
        diagonal = convert(arguments[0], FLOAT, span)
        parts = tuple(diagonal if c == r else zero for c in range(size) for r in range(size))
        return ir.Construct(type_, parts, span)
    if len(arguments) == 1 and isinstance(arguments[0].type, Matrix):
        given = arguments[0].type.size
        cells = []
        for c in range(size):
            for r in range(size):
                if c < given and r < given:
                    column = ir.Index(Vector(FLOAT, given), arguments[0], ir.Literal(INT, c, span), span)
                    cells.append(ir.Swizzle(FLOAT, column, (r,), span))
                else:
                    cells.append(one if c == r else zero)
        return ir.Construct(type_, tuple(cells), span)
    count = sum(component_count(a.type) for a in arguments)
    if count != size * size:
        fail(span, f"{type_}() takes {size * size} components (columns first), got {count}")
    return ir.Construct(type_, tuple(convert_elements(a, FLOAT, span) for a in arguments), span)


def convert(value: ir.Expr, type_: Scalar, span: Span) -> ir.Expr:
    """An explicit scalar conversion."""
    if value.type == type_:
        return value
    if type_ is BOOL:
        zero = ir.Literal(INT, 0, span) if value.type is INT else ir.Literal(FLOAT, 0.0, span)
        return apply("not_equal", [value, zero], span)
    if isinstance(value, ir.Literal) and type_ is FLOAT:
        return ir.Literal(FLOAT, float(value.value), span)
    return ir.Apply(type_, "to_float" if type_ is FLOAT else "to_int", (value,), span)


def convert_elements(value: ir.Expr, element: Scalar, span: Span) -> ir.Expr:
    if element_of(value.type) is element:
        return value
    if isinstance(value.type, Scalar):
        return convert(value, element, span)
    assert isinstance(value.type, Vector)
    parts = tuple(
        convert(ir.Swizzle(value.type.element, value, (i,), span), element, span)
        for i in range(value.type.size)
    )
    return ir.Construct(Vector(element, value.type.size), parts, span)


def index_into(base: ir.Expr, index: ir.Expr, span: Span) -> ir.Expr:
    type_ = base.type
    if isinstance(type_, Array):
        count, element = type_.length, type_.element
    elif isinstance(type_, Matrix):
        count, element = type_.size, Vector(FLOAT, type_.size)
    elif isinstance(type_, Vector):
        count, element = type_.size, type_.element
    else:
        fail(span, f"{type_} cannot be indexed")
    if isinstance(index, ir.Literal) and not 0 <= int(index.value) < count:
        fail(span, f"index {index.value} is outside {type_} (0 to {count - 1})")
    return ir.Index(element, base, index, span)


def choose(condition: ir.Expr, then: Part, orelse: Part, span: Span) -> Part:
    """A conditional value, field by field for structs."""
    if isinstance(then, StructValue) and isinstance(orelse, StructValue) and then.struct == orelse.struct:
        fields = {
            name: choose(condition, then.fields[name], orelse.fields[name], span) for name in then.fields
        }
        return StructValue(then.struct, fields)
    if isinstance(then, (StructValue, ImageValue, TupleValue)) or isinstance(
        orelse, (StructValue, ImageValue, TupleValue)
    ):
        fail(
            span,
            f"both sides of a conditional must have one type, got {part_type(then)} and {part_type(orelse)}",
        )
    one, other = unify(then, orelse, span, "both sides of a conditional")
    if isinstance(one.type, (Array, ImageType)):
        fail(span, f"a conditional cannot choose between values of type {one.type}; use if statements")
    return ir.Select(one.type, condition, one, other, span)  # type: ignore[arg-type]


def _select(arguments: list[ir.Expr], span: Span) -> ir.Expr:
    """Component by component: ``select(bvec, a, b)``."""
    condition, then, orelse = arguments
    then, orelse = unify(then, orelse, span, "both sides of select()")
    if condition.type == BOOL:
        return ir.Select(then.type, condition, then, orelse, span)  # type: ignore[arg-type]
    if not (isinstance(condition.type, Vector) and condition.type.element is BOOL):
        fail(span, f"select() takes bool or a bvec first, got {condition.type}")
    if not isinstance(then.type, Vector) or then.type.size != condition.type.size:
        fail(span, f"select() takes {condition.type.size} components on each side, got {then.type}")
    parts = []
    for i in range(then.type.size):
        c = ir.Swizzle(BOOL, condition, (i,), span)
        a, b = (ir.Swizzle(then.type.element, side, (i,), span) for side in (then, orelse))
        parts.append(ir.Select(then.type.element, c, a, b, span))
    return ir.Construct(with_element(then.type, then.type.element), tuple(parts), span)


def coerce(part: Part, type_: Type, span: Span, what: str) -> Part:
    """A value where a declared type is wanted."""
    if isinstance(type_, Struct):
        if isinstance(part, StructValue) and part.struct == type_:
            return part
        fail(span, f"{what} must be {type_}, got {part_type(part)}")
    if isinstance(type_, ImageType):
        if isinstance(part, ImageValue):
            return part
        fail(span, f"{what} must be an Image, got {part_type(part)}")
    if isinstance(part, (StructValue, ImageValue, TupleValue)):
        fail(span, f"{what} must be {type_}, got {part_type(part)}")
    return widen(part, type_, span, what)


def _check_clamp(arguments: list[ir.Expr], span: Span) -> None:
    if len(arguments) == 3:
        low, high = arguments[1], arguments[2]
        if isinstance(low, ir.Literal) and isinstance(high, ir.Literal) and low.value > high.value:
            fail(span, f"clamp() has its bounds the wrong way round: {low.value} > {high.value}")
