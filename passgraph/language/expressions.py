"""Convert expressions from Python's syntax tree to typed expressions."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, cast

from passgraph.language import image_reads, ir, symbols
from passgraph.language.composites import array_of, each_image, entry, of_constant
from passgraph.language.operations import OPERATIONS, called, signed
from passgraph.language.quad_derivatives import DERIVATIVES, STAGES, derivative
from passgraph.language.scope import FunctionSource, ModuleName, number, written
from passgraph.language.signature import resolve
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    BOOL,
    FLOAT,
    INT,
    IVEC2,
    MAX_ARRAY_LENGTH,
    UINT,
    VEC2,
    VEC4,
    Array,
    Matrix,
    Scalar,
    Struct,
    Type,
    Vector,
    element_of,
    is_plain,
)
from passgraph.language.typing_rules import apply, binary, unify, widen
from passgraph.language.values import (
    COMPOSITE,
    ArrayValue,
    ImageChoice,
    ImageValue,
    Namer,
    Part,
    StructValue,
    TupleValue,
    check_clamp,
    choose,
    coerce,
    construct,
    decided,
    index_into,
    of_bools,
    part_type,
    select,
    swizzle,
)

if TYPE_CHECKING:
    from passgraph.language.function_body import Frame


#: Integer exponents up to this size are expanded to products.
_MAX_EXPANDED = 16


def written_power(base: ir.Expr, exponent: ir.Expr, span: Span, name: Namer) -> ir.Expr:
    """Return ``base ** exponent``; ``name`` puts values used twice into a variable."""
    literal, sign = exponent, 1
    if isinstance(literal, ir.Apply) and literal.operation == "neg":
        literal, sign = literal.arguments[0], -1
    if isinstance(literal, ir.Literal) and literal.type is INT:
        n = sign * int(literal.value)
        if abs(n) <= _MAX_EXPANDED:
            return _whole_power(base, n, span, name)
    return apply("pow", [base, exponent], span)


def _whole_power(base: ir.Expr, n: int, span: Span, name: Namer) -> ir.Expr:
    if not isinstance(base.type, (Scalar, Vector)) or element_of(base.type) is BOOL:
        fail(span, f"** does not take {base.type}")
    if n < 0:
        one = ir.Literal(FLOAT, 1.0, span)
        return apply("div", [one, _whole_power(base, -n, span, name)], span)
    if n == 0:
        ones = ir.Literal(element_of(base.type), 1.0 if element_of(base.type) is FLOAT else 1, span)
        return ones if isinstance(base.type, Scalar) else ir.Construct(base.type, (ones,) * base.type.size, span)
    base = name(base, span)
    result: ir.Expr | None = None
    square = base
    while n:
        if n & 1:
            result = square if result is None else apply("mul", [result, square], span)
        n >>= 1
        if n:
            square = name(apply("mul", [square, square], span), span)
    assert result is not None
    return result


def _operators() -> dict[type[ast.AST], str]:
    """Return Python's operators and their signs, as rows of the table spell them."""
    operators: dict[type[ast.AST], str] = {}
    for row in OPERATIONS.values():
        for sign, form in row.signs.items():
            node: ast.expr = ast.parse(form, mode="eval").body
            operator = node.ops[0] if isinstance(node, ast.Compare) else node.op  # type: ignore[attr-defined]
            operators[type(operator)] = sign
    return operators


_SIGNS = _operators()


def _row(operator: ast.AST, operands: int) -> str:
    """Return the row of an operator with a single row."""
    return signed(_SIGNS[type(operator)], operands)[0].name


_REFUSED: dict[type[ast.expr], str] = {
    ast.Lambda: "lambda; write a @pg.function", ast.Dict: "dictionaries; use a @pg.struct",
    ast.Set: "sets", ast.ListComp: "comprehensions; write a for loop",
    ast.SetComp: "comprehensions; write a for loop", ast.DictComp: "comprehensions; write a for loop",
    ast.GeneratorExp: "generators; write a for loop", ast.Await: "await", ast.Yield: "yield",
    ast.YieldFrom: "yield from", ast.JoinedStr: "strings", ast.NamedExpr: ":=; assign on a line of its own",
    ast.Starred: "* arguments",
}  # fmt: skip


class Expressions:
    """Parses the expressions of one function body; statements needed on the way go to ``frame.emit``."""

    def __init__(self, frame: Frame) -> None:
        self.frame = frame

    def span(self, node: ast.AST) -> Span:
        return self.frame.source.span(node)

    def value(self, node: ast.expr) -> ir.Expr:
        """An expression that is one value, not a struct, image or tuple."""
        part = self.part(node)
        if isinstance(part, ArrayValue) and is_plain(part.type):
            return cast(ir.Expr, self.frame.alone(part, self.span(node)).parts)
        if isinstance(part, COMPOSITE):
            fail(self.span(node), f"a value is expected here, got {part_type(part)}")
        return part

    def condition(self, node: ast.expr) -> ir.Expr:
        value = self.value(node)
        if value.type != BOOL:
            mend = "use any(...) or all(...)" if isinstance(value.type, Vector) else "compare it with something"
            fail(self.span(node), f"a condition must be bool, got {value.type}; {mend}")
        return value

    def part(self, node: ast.expr) -> Part:
        span = self.span(node)
        self.frame.builder.count_expression(span)
        if isinstance(node, ast.Constant):
            if isinstance(node.value, (bool, int, float)):
                return written(node, span)
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
            return self._array([self.part(part) for part in node.elts], span)
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
            return of_constant(meaning)
        if isinstance(meaning, (symbols.Symbol, FunctionSource, str)):
            fail(self.span(node), f"{ast.unparse(node)} is a function; call it")
        fail(self.span(node), f"{ast.unparse(node)} is not a value")

    def _attribute(self, node: ast.Attribute) -> Part:
        span = self.span(node)
        if self._is_outer(node):
            return self._outer(node)
        base = self.part(node.value)
        if isinstance(base, ImageChoice):
            return self._read_each_image(base, node)
        if isinstance(base, StructValue):
            if node.attr not in base.fields:
                fail(span, f"{base.struct.name} has no field {node.attr!r}; it has {', '.join(base.fields)}")
            return base.fields[node.attr]
        if isinstance(base, ImageValue):
            return image_reads.attribute(base, node.attr, span)
        if isinstance(base, TupleValue):
            fail(span, "a tuple has no attributes; unpack it first")
        if not isinstance(base, ArrayValue) and isinstance(base.type, Vector):
            return swizzle(base, node.attr, span)
        fail(span, f"{base.type} has no attribute {node.attr!r}")

    def _is_outer(self, node: ast.expr) -> bool:
        """Return True if a dotted name begins at a module rather than at a local."""
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
            return written_power(left, self.value(node.right), span, self.frame.name_it)
        return self._arithmetic(_SIGNS[type(node.op)], left, self.value(node.right), span)

    def _arithmetic(self, sign: str, left: ir.Expr, right: ir.Expr, span: Span) -> ir.Expr:
        if isinstance(left.type, Matrix) or isinstance(right.type, Matrix):
            # Sums of matrices and products with scalars go by column and use both sides once for each.
            left, right = (self.frame.name_it(side, span) for side in (left, right))
        return binary(sign, left, right, span)

    def _unary(self, node: ast.UnaryOp) -> ir.Expr:
        span = self.span(node)
        written_int = isinstance(node.operand, ast.Constant) and type(node.operand.value) is int
        if isinstance(node.op, ast.USub) and written_int:
            return number(-node.operand.value, span)  # type: ignore[attr-defined]  # -2147483648 is an int
        value = self.value(node.operand)
        if isinstance(node.op, ast.UAdd):
            return value
        if isinstance(node.op, ast.USub) and isinstance(value, ir.Literal) and value.type in (INT, FLOAT):
            return number(-value.value, span)
        if isinstance(node.op, ast.USub) and isinstance(value.type, Matrix):
            return self._arithmetic("*", ir.Literal(FLOAT, -1.0, span), value, span)
        return apply(_row(node.op, 1), [value], span)

    def _bool(self, node: ast.BoolOp) -> ir.Expr:
        result = decided(self.condition(node.values[0]))
        for part in node.values[1:]:
            if isinstance(result, ir.Literal) and result.value == isinstance(node.op, ast.Or):
                return result
            with self._conditionally(part):
                result = apply(_row(node.op, 2), [result, self.condition(part)], self.span(node))
        return result

    def _compare(self, node: ast.Compare) -> ir.Expr:
        span = self.span(node)
        result: ir.Expr | None = None
        left = self.value(node.left)
        for operator, right_node in zip(node.ops, node.comparators, strict=True):
            if type(operator) not in _SIGNS:
                fail(span, "the kernel language has no 'is' and no 'in'; compare values with == or !=")
            with nullcontext() if right_node is node.comparators[0] else self._conditionally(right_node):
                right = self.value(right_node)
            if len(node.ops) > 1:  # the middle of a < b < c is used twice
                right = self.frame.name_it(right, span)
            if left.type == BOOL and right.type == BOOL and isinstance(operator, (ast.Eq, ast.NotEq)):
                one, other = (apply("to_int", [side], span) for side in (left, right))
            else:
                one, other = left, right
            link = apply(_row(operator, 2), [one, other], span)
            result = link if result is None else apply("logical_and", [result, link], span)
            left = right
        assert result is not None
        return result

    def _choice(self, node: ast.IfExp) -> Part:
        span = self.span(node)
        condition = decided(self.condition(node.test))
        if isinstance(condition, ir.Literal):
            return self._chosen(*((node.body, node.orelse) if condition.value else (node.orelse, node.body)))
        with self._conditionally(node):
            then, orelse = self.part(node.body), self.part(node.orelse)
        if isinstance(then, StructValue):
            condition = self.frame.name_it(condition, span)
        return choose(condition, then, orelse, span)

    def _chosen(self, node: ast.expr, other: ast.expr) -> Part:
        """Return the side that a constant selects.  The other is not read, except for the type of integer literals."""
        switched, span = self.part(node), self.span(node)
        if isinstance(switched, COMPOSITE) or switched.type not in (INT, UINT):
            return switched
        unused = self.frame.builder.tried(lambda: self.value(other))
        return switched if unused is None else unify(switched, unused, span, "both sides of a conditional")[0]

    @contextmanager
    def _conditionally(self, node: ast.expr) -> Iterator[None]:
        """Parse operands that Python evaluates only if needed: here they always are, so they may not discard."""
        before = self.frame.builder.discards
        yield
        if self.frame.builder.discards > before:
            fail(
                self.span(node),
                "a function that calls discard() is called where Python may leave it out; call it in an assignment "
                "of its own, under an if",
            )

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
            from passgraph.language.scope import method_spelling

            fail(span, f"values have no methods; got .{node.func.attr}(){method_spelling(node.func.attr)}")
        meaning = resolve(node.func, self.frame.scope, self.frame.source)
        if isinstance(meaning, FunctionSource):
            return self.frame.inline(meaning, self._arguments(node), span)
        if isinstance(meaning, Struct):
            return self._make_struct(meaning, node)
        if node.keywords:
            fail(span, f"{ast.unparse(node.func)} takes no keyword arguments")
        if isinstance(meaning, (Scalar, Vector, Matrix)):
            return construct(meaning, [self.value(a) for a in node.args], span, self.frame.name_it)
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
        if isinstance(base, ImageChoice):
            return self._read_each_image(base, node)
        if not isinstance(base, ImageValue):
            return None
        span, method = self.span(node), node.func.attr
        if method == "lod" and self.frame.stage not in STAGES:
            fail(span, f"image.lod() takes derivatives, which a {self.frame.stage} kernel has not")
        if any(keyword.arg is None for keyword in node.keywords):
            fail(span, "the kernel language has no ** arguments")
        named = {str(keyword.arg): self.value(keyword.value) for keyword in node.keywords}
        values = image_reads.bound(method, [self.value(argument) for argument in node.args], named, span)
        values = {name: self.frame.name_it(value, span) for name, value in values.items()}
        return image_reads.read(self.frame.inline_library, base, method, values, span)

    def _read_each_image(self, choice: ImageChoice, node: ast.Call | ast.Attribute | ast.Subscript) -> Part:
        """Read an image selected by an index: as a named read of each, with arguments computed once."""
        frame, named_arguments = self.frame, dict[str, Part]()

        def named(argument: ast.expr) -> ast.expr:
            name = frame.builder.fresh("$argument")
            named_arguments[name] = frame.name_part(self.part(argument), self.span(argument))
            return ast.copy_location(ast.Name(name, ast.Load()), argument)

        def read(candidate: ImageValue) -> Part:
            frame.parts[image] = candidate
            return self.part(written)

        image = frame.builder.fresh("$image")
        written = _on_name(node, image, named)
        frame.parts |= named_arguments
        result = each_image(frame.builder, choice, read, self.span(node))
        for name in (image, *named_arguments):
            del frame.parts[name]
        return result

    def _builtin(self, name: str, node: ast.Call, span: Span) -> Part:
        if name == "len":
            parts = [self.part(a) for a in node.args]
            type_ = getattr(parts[0], "type", None) if len(parts) == 1 else None
            if not isinstance(type_, (Array, Vector)):
                fail(span, "len() takes one array or vector")
            return ir.Literal(INT, type_.length if isinstance(type_, Array) else type_.size, span)
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
            return select(arguments, span, self.frame.name_it)
        if name in DERIVATIVES:
            if len(arguments) != 1:
                fail(span, f"{name}() takes 1 argument, got {len(arguments)}")
            return derivative(name, DERIVATIVES[name], arguments[0], self.frame.builder, span)
        if name == "clamp":
            check_clamp(arguments, span)
        if name == "mix" and len(arguments) == 3 and of_bools(arguments[2]):
            return select([arguments[2], arguments[1], arguments[0]], span, self.frame.name_it)
        written = self.frame.inline_written(name, arguments, span)
        if written is not None:
            return written
        return apply(called(name, len(arguments)), arguments, span)

    def _make_struct(self, struct: Struct, node: ast.Call) -> StructValue:
        span = self.span(node)
        positional, named = self._arguments(node)
        names = [name for name, _ in struct.fields]
        if len(positional) > len(names):
            fail(span, f"{struct.name} has {len(names)} fields, got {len(positional)} values")
        parts = dict(zip(names, positional, strict=False))
        for name, part in named.items():
            if name not in names or name in parts:
                fail(span, f"{struct.name} has no field {name!r} left to set; it has {', '.join(names)}")
            parts[name] = part
        defaults = dict(struct.defaults)
        fields: dict[str, Part] = {}
        for name, type_ in struct.fields:
            if name in parts:
                fields[name] = coerce(parts[name], type_, span, f"{struct.name}.{name}")
            elif name in defaults:
                fields[name] = self.frame.default(defaults[name], type_, f"{struct.name}.{name}", span)
            else:
                fail(span, f"{struct.name} needs a value for field {name!r}")
        return StructValue(struct, fields)

    # Subscripts and arrays

    def _subscript(self, node: ast.Subscript) -> Part:
        span = self.span(node)
        base = self.part(node.value)
        if isinstance(base, ImageChoice):
            return self._read_each_image(base, node)
        if isinstance(base, ImageValue):
            if not (isinstance(node.slice, ast.Tuple) and len(node.slice.elts) == 2):
                fail(span, "an image takes two offsets in texels: image[dx, dy] (image[0, 0] is this pixel)")
            x, y = (widen(self.value(part), INT, self.span(part), "a texel offset") for part in node.slice.elts)
            if self.frame.stage != "pixel":
                fail(
                    span,
                    "image[dx, dy] is relative to a pixel of a full-screen pass; "
                    f"in a {self.frame.stage} kernel use .texel()",
                )
            return ir.Texel(VEC4, base.name, x, y, True, span)
        if isinstance(base, TupleValue):
            return self._member(base, node.slice, span)
        if isinstance(base, StructValue):
            fail(span, f"{base.struct.name} is read by field, not by index")
        if isinstance(node.slice, (ast.Slice, ast.Tuple)):
            fail(span, "the kernel language has no slices; use a swizzle such as v.xy")
        index = widen(self.value(node.slice), INT, span, "an index")
        if isinstance(base, ArrayValue):
            return entry(base, index, span, self.frame.name_it)
        return index_into(base, index, span)

    def _member(self, base: TupleValue, index: ast.expr, span: Span) -> Part:
        position = self.value(index)
        count = len(base.members)
        if isinstance(position, ir.Literal) and position.type is INT and -count <= position.value < count:
            return base.members[int(position.value)]
        fail(span, f"a tuple of {count} takes a constant index in range")

    def _array(self, members: list[Part], span: Span) -> Part:
        if not members:
            fail(span, "an array needs at least one element")
        return array_of(members, span, self.frame.builder)

    def _filled_array(self, node: ast.BinOp, span: Span) -> Part:
        assert isinstance(node.left, ast.List)
        count = self.value(node.right)
        if not isinstance(count, ir.Literal) or count.type is not INT or int(count.value) < 1:
            fail(span, "[value] * n needs a whole constant n >= 1")
        total = int(count.value) * len(node.left.elts)
        if total > MAX_ARRAY_LENGTH:
            fail(span, f"an array has at most {MAX_ARRAY_LENGTH} elements, got {total}")
        members = [self.frame.name_part(self.part(part), span) for part in node.left.elts]
        return self._array(members * int(count.value), span)


def _on_name(
    node: ast.Call | ast.Attribute | ast.Subscript, name: str, named: Callable[[ast.expr], ast.expr]
) -> ast.expr:
    """Return a read of an image by name in place of its original expression, with other arguments."""
    base = node.func if isinstance(node, ast.Call) else node
    assert isinstance(base, (ast.Attribute, ast.Subscript))
    image = ast.copy_location(ast.Name(name, ast.Load()), base.value)
    read: ast.expr
    if isinstance(base, ast.Subscript):
        place = base.slice
        if isinstance(place, ast.Tuple):
            place = ast.copy_location(ast.Tuple([named(part) for part in place.elts], ast.Load()), place)
        read = ast.Subscript(image, place, ast.Load())
    else:
        read = ast.copy_location(ast.Attribute(image, base.attr, ast.Load()), base)
    if isinstance(node, ast.Call):
        keywords = [ast.keyword(one.arg, named(one.value)) for one in node.keywords]
        read = ast.Call(read, [named(argument) for argument in node.args], keywords)
    return ast.copy_location(read, node)


#: Builtin values of stages: name -> (type, the stages that have it).
STAGE_VALUES: dict[str, tuple[Type, tuple[str, ...]]] = {
    "pixel": (IVEC2, ("pixel", "fragment")),
    "uv": (VEC2, ("pixel", "fragment")),
    "output_size": (IVEC2, ("pixel", "vertex", "fragment")),
    "front_facing": (BOOL, ("fragment",)),
    "fragment_depth": (FLOAT, ("fragment",)),
}
