"""Annotations and signatures: from Python's syntax to typed parameters."""

from __future__ import annotations

import ast
import math
from typing import Annotated, Any

from passgraph.arguments import shown
from passgraph.errors import InputError
from passgraph.language import ir, symbols
from passgraph.language import parameter_limits as limits_of
from passgraph.language.long_arrays import check_local, check_sizes
from passgraph.language.scope import (
    MAX_TABLE_ENTRIES,
    FunctionSource,
    ModuleName,
    Scope,
    meaning_of,
    number,
    typed_constant,
    written,
)
from passgraph.language.source import Source, Span, fail
from passgraph.language.types import (
    BOOL,
    INT,
    MAX_ARRAY_LENGTH,
    NAMED,
    UINT,
    Array,
    ImageType,
    Matrix,
    Scalar,
    Struct,
    TupleType,
    Type,
    Vector,
    component_count,
    image_count,
    image_names,
    innermost,
    longest,
    part_count,
    sides_of,
)
from passgraph.language.uniform_layout import in_range
from passgraph.records import dataclass

#: Attributes of a vertex, with the value for meshes without the attribute.
VERTEX_FIELDS: dict[str, tuple[Type, tuple[float, ...]]] = {
    "position": (NAMED["vec3"], (0, 0, 0)),
    "normal": (NAMED["vec3"], (0, 0, 1)),
    "uv": (NAMED["vec2"], (0, 0)),
    "color": (NAMED["vec4"], (1, 1, 1, 1)),
    "tangent": (NAMED["vec4"], (1, 0, 0, 1)),
    "instance": (NAMED["float"], (0,)),
}
VERTEX = Struct("Vertex", tuple((name, type_) for name, (type_, _) in VERTEX_FIELDS.items()))

#: Longest array that a kernel may have as a parameter.
MAX_BUFFER_LENGTH = 1 << 24
#: Most numbers of a constant: a table of as many entries as a kernel may capture, each a vec4.
MAX_CONSTANT_NUMBERS = 4 * MAX_TABLE_ENTRIES
#: Most images of a kernel, including those in structs and arrays; devices support fewer in one pass.
MAX_IMAGES = 128
#: Most fields of a struct, including nested ones.
MAX_STRUCT_FIELDS = 256
#: Most plain parts of all parameters of a kernel: each field of a struct is a part.
MAX_PARAMETER_PARTS = 1 << 15
#: Deepest nesting of structs.
MAX_STRUCT_DEPTH = 32


@dataclass(frozen=True)
class Signature:
    parameters: tuple[ir.Parameter, ...]
    result: Type


def resolve(node: ast.expr, scope: Scope, source: Source) -> object:
    """Return the meaning of a (dotted) name."""
    span = source.span(node)
    if isinstance(node, ast.Name):
        return meaning_of(scope.lookup(node.id, span), node.id, scope, span)
    if isinstance(node, ast.Attribute):
        base = resolve(node.value, scope, source)
        if isinstance(base, ModuleName):
            if not hasattr(base.module, node.attr):
                from passgraph.language.scope import mending

                mend = mending(node.attr, (name for name in vars(base.module) if not name.startswith("_")))
                fail(span, f"module {base.module.__name__} has no {node.attr!r}{mend}")
            return meaning_of(getattr(base.module, node.attr), f"{base.path}.{node.attr}", scope, span)
    fail(span, "a name is expected here")


def annotation_type(node: ast.expr, scope: Scope, source: Source) -> tuple[Type, bool]:
    """Return the type that an annotation names, and True if it is Const."""
    span = source.span(node)
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return annotation_type(_unquoted(node, source), scope, source)
    if isinstance(node, ast.Subscript):
        generic = resolve(node.value, scope, source)
        if generic is symbols.Const:
            type_, _ = annotation_type(node.slice, scope, source)
            return type_, True
        if generic is symbols.Array:
            return _array_type(node, scope, source), False
        if generic is tuple:
            members = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            types = tuple(annotation_type(m, scope, source)[0] for m in members)
            if any(image_names(t, "") for t in types):
                fail(span, "a tuple cannot hold an Image")
            return TupleType(types), False
        if generic is Annotated:
            fail(span, "a range is of a kernel's parameter as a whole: name: Annotated[float, pg.Range(0, 1)]")
        fail(span, "only Const[T], Array[T, n] and tuple[...] take brackets")
    if isinstance(node, ast.Constant) and node.value is None:
        fail(span, "a kernel must return something; write -> vec4, -> tuple[vec4, float] or a @pg.struct")
    meaning = resolve(node, scope, source)
    if meaning is symbols.Vertex:
        return VERTEX, False
    if isinstance(meaning, (Scalar, Vector, Matrix, ImageType, Struct)):
        return meaning, False
    type_names = ", ".join(NAMED)
    fail(
        span,
        f"{ast.unparse(node)} is not a type of the kernel language; it has {type_names}, Array, structs",
    )


def _unquoted(node: ast.expr, source: Source) -> ast.expr:
    """Return an annotation, which may be written as a string."""
    if not (isinstance(node, ast.Constant) and isinstance(node.value, str)):
        return node
    try:
        inner = ast.parse(node.value, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        fail(source.span(node), f"annotation {node.value!r} is not a type")
    for part in ast.walk(inner):
        ast.copy_location(part, node)
    return inner


def _array_type(node: ast.Subscript, scope: Scope, source: Source) -> Array:
    span = source.span(node)
    if not (isinstance(node.slice, ast.Tuple) and len(node.slice.elts) == 2):
        fail(span, "an array is written Array[element, length], for example Array[float, 15]")
    element, _ = annotation_type(node.slice.elts[0], scope, source)
    if isinstance(element, TupleType):
        fail(span, "an array cannot hold tuples; use a @pg.struct")
    length_node = node.slice.elts[1]
    if isinstance(length_node, ast.Subscript) and ast.unparse(length_node.value).split(".")[-1] == "Literal":
        length_node = length_node.slice  # type checkers need it so
    if isinstance(length_node, ast.Constant):
        length: object = length_node.value
    else:
        meaning = resolve(length_node, scope, source)
        length = meaning.value if isinstance(meaning, ir.Literal) else None
    if not isinstance(length, int) or isinstance(length, bool) or not 1 <= length <= MAX_BUFFER_LENGTH:
        fail(
            span,
            f"array length must be a whole number from 1 to {MAX_BUFFER_LENGTH}, got {ast.unparse(length_node)}",
        )
    return checked_array(Array(element, length), span)


def checked_array(array: Array, span: Span) -> Array:
    """Return an array type, with its limits checked."""
    most = MAX_ARRAY_LENGTH if image_count(array) else MAX_BUFFER_LENGTH
    if longest(array) > most:
        fail(span, f"{array} has {longest(array)} elements, those of arrays in it counted; at most {most}")
    return array


def read_signature(function: FunctionSource) -> Signature:
    """Return the typed parameters and result of a function; every parameter needs an annotation."""
    node, source, scope = function.node, function.source, function.scope
    arguments = node.args
    if arguments.vararg or arguments.kwarg:
        fail(
            source.span(node),
            f"{function.name} takes *args or **kwargs; kernels have a fixed list of parameters",
        )
    positional = [*arguments.posonlyargs, *arguments.args]
    defaults: list[ast.expr | None] = [None] * (len(positional) - len(arguments.defaults))
    defaults += arguments.defaults
    pairs = list(zip(positional, defaults, strict=True))
    pairs += list(zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True))
    names, parameters_, parts = set[str](), list[ir.Parameter](), 0
    for argument, default in pairs:
        if argument.arg in names:  # Python refuses it too, but text is parsed only
            fail(source.span(argument), f"{function.name} has two parameters {argument.arg!r}; rename one of them")
        names.add(argument.arg)
        parameters_.append(_parameter(argument, default, function))
        parts += part_count(parameters_[-1].type)
        check_parts(parts, f"the parameters of {function.name}", parameters_[-1].span)
    parameters = tuple(parameters_)
    check_images(function.name, parameters, source.span(node))
    check_sizes(parameters)
    if node.returns is None:
        fail(source.span(node), f"{function.name} needs a return type, for example -> vec4")
    result, const = annotation_type(node.returns, scope, source)
    if const or image_names(result, ""):
        fail(source.span(node.returns), f"{function.name} cannot return {'Const' if const else 'an Image'}")
    check_local(result, f"the result of {function.name}", source.span(node.returns))
    return Signature(parameters, result)


def check_images(name: str, parameters: tuple[ir.Parameter, ...], span: Span) -> None:
    """Raise an error for more images than a kernel may read."""
    count = sum(image_count(parameter.type) for parameter in parameters)
    if count > MAX_IMAGES:
        fail(span, f"{name} takes {count} images, those in structs and arrays too; at most {MAX_IMAGES}")


def _parameter(argument: ast.arg, default: ast.expr | None, function: FunctionSource) -> ir.Parameter:
    source, scope = function.source, function.scope
    span = source.span(argument)
    if argument.annotation is None:
        fail(span, f"parameter {argument.arg!r} needs a type, for example {argument.arg}: float")
    annotation = _unquoted(argument.annotation, source)
    plain, limits = limits_of.taken_apart(annotation, lambda node: resolve(node, scope, source), source)
    type_, const = annotation_type(plain, scope, source)
    if limits is not None:
        limits_of.check_type(limits, type_, argument.arg, span)
    if isinstance(type_, TupleType):
        fail(span, "a parameter cannot be a tuple; use a vector, an Array or a @pg.struct")
    if const and not isinstance(type_, (Scalar, Vector)):
        fail(span, f"Const parameters are scalars or vectors, got {type_}")
    if default is None:
        return ir.Parameter(argument.arg, type_, const, span=span, range=limits)
    value = default_value(default, type_, argument.arg, source, scope)
    if limits is not None:
        try:
            in_range(value, type_, limits, f"default of {argument.arg}")
        except InputError as error:
            fail(source.span(default), str(error))
    return ir.Parameter(argument.arg, type_, const, value, True, span, limits)


def default_value(node: ast.expr, type_: Type, name: str, source: Source, scope: Scope) -> object:
    """Return a default as plain data: numbers and tuples of them."""
    span = source.span(node)
    if not isinstance(innermost(type_), (Scalar, Vector, Matrix)):
        fail(span, f"parameter {name!r} of type {type_} cannot have a default")
    value = literal_value(node, source, scope, max(component_count(type_), MAX_CONSTANT_NUMBERS))
    known = None if scope.tables is None else scope.tables.get(id(value))
    if known is None or type_ not in known.fits:
        typed_constant(value, type_, f"default of {name}", span)
        if known is not None:
            known.fits.add(type_)
    return value


def literal_value(node: ast.expr, source: Source, scope: Scope, most: int = MAX_CONSTANT_NUMBERS) -> object:
    """Return numbers, tuples and captured constants, evaluated without running Python.

    Raises
    ------
    KernelError
        For anything else, and for more than ``most`` numbers, counted before tables in tables are repeated.
    """
    return _literal(node, source, scope, most)[0]


def _literal(node: ast.expr, source: Source, scope: Scope, most: int) -> tuple[object, int]:
    """Return :func:`literal_value` and the count of its numbers."""
    if isinstance(node, (ast.Tuple, ast.List)):
        return _several(node.elts, source, scope, most)
    if isinstance(node, ast.Call) and not node.keywords:
        maker = resolve(node.func, scope, source)
        if isinstance(maker, (Scalar, Vector, Matrix)):
            parts, count = _several(node.args, source, scope, most)
            return _construct(maker, parts, count, source.span(node)), component_count(maker)
    if isinstance(node, (ast.Name, ast.Attribute)):
        meaning = resolve(node, scope, source)
        if isinstance(meaning, ir.Table):
            return scope.captured[ast.unparse(node)], component_count(meaning.type)
        if isinstance(meaning, ir.Construct):
            return host_value(meaning), component_count(meaning.type)
        if isinstance(meaning, ir.Literal):
            return meaning.value, 1
    return _number(node, source, scope), 1


def _several(nodes: list[ast.expr], source: Source, scope: Scope, most: int) -> tuple[tuple[object, ...], int]:
    """Return several values, and the count of all their numbers; an empty tuple counts like a number."""
    parts, count = [], 0
    for node in nodes:
        value, numbers = _literal(node, source, scope, most)
        parts.append(value)
        count += max(numbers, 1)
        if count > most:
            fail(
                source.span(node), f"with this, a constant has more than {most} numbers, those of tables in it counted"
            )
    return tuple(parts), count


def _number(node: ast.expr, source: Source, scope: Scope) -> object:
    """Return a number as written, with a sign, or as a sum, difference, product or quotient of numbers."""
    span = source.span(node)
    if isinstance(node, ast.Constant):
        return _plain(node.value, written(node, span))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
        value = node.operand.value
        if isinstance(value, int) and not isinstance(value, bool):
            return _plain(-value, number(-value, span))  # -2147483648 is an int
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        inner = literal_value(node.operand, source, scope)
        if isinstance(inner, (int, float)):
            return -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.Div, ast.Add, ast.Sub)):
        left, right = literal_value(node.left, source, scope), literal_value(node.right, source, scope)
        if isinstance(left, (int, float)) and isinstance(right, (int, float)):
            return _fold(node.op, left, right, span)
    fail(span, "a constant is expected here: a number, a tuple of numbers or a captured constant")


def host_value(constant: ir.Construct | ir.Table) -> object:
    """Return a captured vector, matrix or table in host notation."""
    if isinstance(constant, ir.Table):
        return _rows(constant.values, (*sides_of(constant.type), component_count(innermost(constant.type))))
    flat = [part.value for part in constant.arguments if isinstance(part, ir.Literal)]
    return next(cls for cls, name in symbols.TYPE_MARKERS.items() if name == str(constant.type))(*flat)  # type: ignore[operator]


def _rows(values: tuple[ir.Number, ...], sides: tuple[int, ...]) -> object:
    """Return flat numbers as nested rows; the last side may be 1, for a scalar."""
    if len(sides) == 1:
        return values if sides[0] > 1 else values[0]
    each = len(values) // sides[0]
    return tuple(_rows(values[i : i + each], sides[1:]) for i in range(0, len(values), each))


def _fold(operator: ast.operator, left: float, right: float, span: Span) -> float:
    if isinstance(operator, ast.Div):
        if right == 0:
            fail(span, "division by zero in a constant")
        result = left / right
    elif isinstance(operator, ast.Mult):
        result = left * right
    else:
        result = left + right if isinstance(operator, ast.Add) else left - right
    number(result, span)
    return result


def _plain(value: Any, checked: ir.Literal) -> Any:
    """Return integers as written: the meaning of 0xFFFFFFFF depends on the type that it becomes."""
    return value if type(value) is int else checked.value


def _construct(maker: Scalar | Vector | Matrix, parts: tuple[object, ...], numbers: int, span: Span) -> object:
    count = component_count(maker)
    if numbers not in (1, count):
        fail(span, f"{maker} takes {'one number' if count == 1 else f'{count} numbers, got {numbers}'}")
    flat: list[object] = []
    for part in parts:
        flat.extend(part if isinstance(part, tuple) else [part])
    if isinstance(maker, Scalar):
        return _converted(flat[0], maker, span)
    return next(cls for cls, name in symbols.TYPE_MARKERS.items() if name == str(maker))(*flat)  # type: ignore[operator]


def _converted(value: object, type_: Scalar, span: Span) -> ir.Number:
    """Convert a number to a scalar type; floats are truncated for integer types."""
    if not isinstance(value, (int, float)) or (type_ in (INT, UINT) and not math.isfinite(value)):
        fail(span, f"{type_} takes a number, got {shown(value)}")
    if type_ is UINT and not 0 <= value <= symbols.UINT_MAX:
        fail(span, f"a uint is a whole number from 0 to {symbols.UINT_MAX}, got {shown(value)}")
    kinds: dict[Scalar, type[Any]] = {BOOL: bool, INT: int, UINT: symbols.uint}
    number: ir.Number = kinds.get(type_, float)(value)
    return number


def check_parts(count: int, what: str, span: Span) -> None:
    """Raise KernelError for parameters with more parts than a kernel may have, before they are split into parts."""
    if count > MAX_PARAMETER_PARTS:
        fail(span, f"{what} have {count} fields or more, nested ones too; at most {MAX_PARAMETER_PARTS}")


def read_struct(node: ast.ClassDef, source: Source, scope: Scope) -> Struct:
    """Return a struct from its class statement: annotated fields, optional defaults, nothing else."""
    fields: list[tuple[str, Type]] = []
    names = set[str]()
    defaults: list[tuple[str, object]] = []
    if node.bases or node.keywords:
        fail(source.span(node), f"struct {node.name} has a base class; structs stand alone")
    for statement in node.body:
        if isinstance(statement, ast.Pass) or (
            isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
        ):
            continue
        span = source.span(statement)
        if not (isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name)):
            fail(span, f"struct {node.name} holds typed fields only, for example: normal: vec3")
        type_, const = annotation_type(statement.annotation, scope, source)
        if const or isinstance(type_, TupleType):
            fail(span, f"a struct field cannot be {'Const' if const else type_}")
        if statement.target.id in names:
            fail(span, f"struct {node.name} has two fields {statement.target.id!r}")
        names.add(statement.target.id)
        fields.append((statement.target.id, type_))
        if statement.value is not None:
            defaults.append(
                (
                    statement.target.id,
                    default_value(statement.value, type_, statement.target.id, source, scope),
                )
            )
    if not fields:
        fail(source.span(node), f"struct {node.name} has no fields")
    return checked_struct(Struct(node.name, tuple(fields), tuple(defaults)), source.span(node))


def checked_struct(struct: Struct, span: Span) -> Struct:
    """Return a struct, with its limits checked."""
    if struct.parts > MAX_STRUCT_FIELDS:
        fail(span, f"struct {struct.name} has {struct.parts} fields, nested ones too; at most {MAX_STRUCT_FIELDS}")
    if struct.depth > MAX_STRUCT_DEPTH:
        fail(span, f"struct {struct.name} holds structs {struct.depth} deep; at most {MAX_STRUCT_DEPTH}")
    return struct
