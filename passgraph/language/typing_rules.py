"""Types of operations, and implicit conversions (integers to float, never back)."""

from __future__ import annotations

from passgraph.language import ir
from passgraph.language.meanings import uint_of_bits
from passgraph.language.operations import OPERATIONS, Operation, signed
from passgraph.language.source import Span, fail
from passgraph.language.symbols import UINT_MAX
from passgraph.language.types import (
    BOOL,
    FLOAT,
    INT,
    UINT,
    Array,
    Matrix,
    Scalar,
    Type,
    Value,
    Vector,
    component_count,
    element_of,
    with_element,
)

_LETTERS = {"G": FLOAT, "S": INT, "U": UINT, "B": BOOL, "f": FLOAT, "i": INT, "b": BOOL, "V": FLOAT, "v3": FLOAT}


def widen(value: ir.Expr, type_: Type, span: Span, what: str) -> ir.Expr:
    """Convert ``value`` to ``type_``: unchanged, an integer to float, or a literal int to uint.

    Anything else is an error that names the remedy.
    """
    if value.type == type_:
        return value
    if isinstance(value.type, Array) and isinstance(type_, Array):
        wider = _widen_array(value, type_, span, what)
        if wider is not None:
            return wider
    if isinstance(value.type, (Scalar, Vector)) and isinstance(type_, (Scalar, Vector)):
        from_element, to_element = _element(value.type), _element(type_)
        if with_element(value.type, to_element) == type_:
            if to_element is FLOAT and from_element in (INT, UINT):
                if isinstance(value, ir.Literal):
                    return ir.Literal(FLOAT, float(value.value), value.span)
                return ir.Apply(type_, "to_float" if from_element is INT else "float_from_uint", (value,), span)
            if to_element is UINT and isinstance(value, ir.Literal) and from_element is INT:
                return _as_uint(value, what)
            if to_element in (INT, UINT) and from_element is FLOAT:
                mend = f"narrowing is never silent: write {type_}(...)"
                fail(span, f"{what} must be {type_}, got {value.type}; {mend}")
            if {from_element, to_element} == {INT, UINT}:
                mend = f"int and uint do not mix by themselves: write {type_}(...), which keeps the bits"
                fail(span, f"{what} must be {type_}, got {value.type}; {mend}")
    fail(span, f"{what} must be {type_}, got {value.type}")


def _as_uint(value: ir.Literal, what: str) -> ir.Literal:
    """Convert a literal int where a uint is expected."""
    number = int(value.value)
    if number < 0 and not value.bits:
        fail(value.span, f"{what} must be uint, from 0 to {UINT_MAX}, got {number}; write uint({number}) for its bits")
    return ir.Literal(UINT, uint_of_bits(number), value.span)


def _widen_array(value: ir.Expr, type_: Array, span: Span, what: str) -> ir.Expr | None:
    """Convert a literal or captured array of ints where floats or uints are expected."""
    array, element_type = value.type, element_of(type_)
    if not isinstance(array, Array) or array.length != type_.length or element_of(array) is not INT:
        return None
    if element_type not in (FLOAT, UINT) or component_count(array) != component_count(type_):
        return None
    if isinstance(value, ir.Table) and element_type is UINT:
        return ir.Table(type_, value.values, span) if min(value.values) >= 0 else None
    if isinstance(value, ir.Table):
        return ir.Table(type_, tuple(float(v) for v in value.values), span)
    if isinstance(value, ir.Construct):
        return ir.Construct(type_, tuple(widen(a, type_.element, span, what) for a in value.arguments), span)
    return None


def _element(type_: Value) -> Scalar:
    return FLOAT if isinstance(type_, Matrix) else type_.element if isinstance(type_, Vector) else type_


def apply(name: str, arguments: list[ir.Expr], span: Span) -> ir.Expr:
    """Return an operation on typed arguments, with its result type; the error shows the signature."""
    row = OPERATIONS[name]
    if row.unsigned and _shared_element(row, arguments) is UINT:
        return apply(row.unsigned, arguments, span)
    if name == "matmul":
        return _matmul(arguments, span)
    patterns, shown = row.operands, row.spoken
    if len(arguments) != len(patterns):
        plural = "" if len(patterns) == 1 else "s"
        fail(span, f"{shown} takes {len(patterns)} argument{plural}, got {len(arguments)} ({row.doc})")
    for argument in arguments:
        if not isinstance(argument.type, (Scalar, Vector, Matrix)):
            fail(span, f"{shown} does not take {argument.type}")
    size = _common_size(row, arguments, span)
    element = _number_element(row, arguments, span)
    typed: list[ir.Expr] = []
    for letter, argument in zip(patterns, arguments, strict=True):
        target = element if letter in "NI" else _LETTERS.get(letter, FLOAT)
        typed.append(_fit(argument, letter, target, size, shown, span))
    return ir.Apply(_result_type(row.result, size, element, typed), name, tuple(typed), span)


def _common_size(row: Operation, arguments: list[ir.Expr], span: Span) -> int:
    """Return the size of the vectors among the arguments; 0 if all are scalars."""
    size = 0
    for letter, argument in zip(row.operands, arguments, strict=True):
        if not isinstance(argument.type, Vector) or letter in "fib":
            continue
        if size and argument.type.size != size and row.result != "M":
            fail(span, f"{row.spoken} mixes vectors of {size} and {argument.type.size} components")
        size = argument.type.size
        if letter == "v3" and size != 3:
            fail(span, f"{row.spoken} is for vec3, got {argument.type}")
    return size


def _number_element(row: Operation, arguments: list[ir.Expr], span: Span) -> Scalar:
    """Return the element type shared by all ``N`` and ``I`` arguments."""
    if "N" in row.operands and not row.converts and BOOL in _elements(row, arguments):
        fail(span, f"{row.spoken} takes numbers, got bool; write int(...) or float(...)")
    return _shared_element(row, arguments)


def _elements(row: Operation, arguments: list[ir.Expr]) -> list[Scalar]:
    """Return the element types of arguments that may be of several."""
    pairs = zip(row.operands, arguments, strict=False)
    return [_element(a.type) for letter, a in pairs if letter in "NI" and isinstance(a.type, (Scalar, Vector))]


def _shared_element(row: Operation, arguments: list[ir.Expr]) -> Scalar:
    """Return uint if one argument is uint and none float; int if all are, or only integers are allowed; else float."""
    elements = _elements(row, arguments)
    if elements and all(e is BOOL for e in elements) and row.converts:
        return BOOL
    if UINT in elements and ("N" not in row.operands or FLOAT not in elements):
        return UINT
    return INT if "I" in row.operands or (elements and all(e is INT for e in elements)) else FLOAT


def _fit(argument: ir.Expr, letter: str, element: Scalar, size: int, shown: str, span: Span) -> ir.Expr:
    type_ = argument.type
    if letter in ("M", "Q"):
        if not isinstance(type_, Matrix):
            fail(span, f"{shown} takes a matrix, got {type_}")
        if letter == "Q" and type_.columns != type_.rows:
            fail(span, f"{shown} takes a square matrix, got {type_}")
        return argument
    if isinstance(type_, Matrix):
        fail(span, f"{shown} does not take {type_}")
    assert isinstance(type_, (Scalar, Vector))
    if letter in "fib" and not isinstance(type_, Scalar):
        fail(span, f"{shown} takes a scalar {element} here, got {type_}")
    if letter in ("V", "v3") and not isinstance(type_, Vector):
        fail(span, f"{shown} takes vectors, got {type_}")
    return widen(argument, with_element(type_, element), span, f"an argument of {shown}")


def _result_type(letter: str, size: int, element: Scalar, arguments: list[ir.Expr]) -> Value:
    if letter in ("M", "Q"):
        first = arguments[0].type
        if isinstance(first, Matrix):
            return Matrix(first.rows, first.columns)  # transposed; square matrices stay square
        assert isinstance(first, Vector)
        last = arguments[-1].type
        assert isinstance(last, Vector)
        return Matrix(last.size, first.size)
    scalar = element if letter in "NI" else _LETTERS[letter]
    if letter in "fib" or not size:
        return scalar
    return Vector(scalar, size)


def _matmul(arguments: list[ir.Expr], span: Span) -> ir.Expr:
    left, right = arguments
    a, b = left.type, right.type
    result: Value
    if isinstance(a, Matrix) and isinstance(b, Matrix) and a.columns == b.rows:
        result = Matrix(b.columns, a.rows)
    elif isinstance(a, Matrix) and b == Vector(FLOAT, a.columns):
        result = a.column
    elif isinstance(b, Matrix) and a == b.column:
        result = Vector(FLOAT, b.columns)
    else:
        fail(span, f"cannot multiply {a} by {b}; {_factors(a, b)}")
    return ir.Apply(result, "matmul", (left, right), span)


def _factors(a: Type, b: Type) -> str:
    """Describe the type that fits a matrix in a product."""
    if isinstance(a, Matrix):
        n = a.columns
        return f"{a} has {n} columns and takes a vec{n} or a matrix of {n} rows behind it"
    assert isinstance(b, Matrix)
    return f"{b} has {b.rows} rows and takes a vec{b.rows} before it"


def binary(sign: str, left: ir.Expr, right: ir.Expr, span: Span) -> ir.Expr:
    """Return an operator applied to typed operands: the row for floats if one is a float, else the one for ints."""
    matrices = isinstance(left.type, Matrix) or isinstance(right.type, Matrix)
    if sign == "@":
        if matrices:
            return _matmul([left, right], span)
        fail(span, f"@ multiplies matrices, got {left.type} @ {right.type}")
    if matrices:
        return _matrix_arithmetic(sign, left, right, span)
    rows = [row for row in signed(sign, 2) if row.operands[0] != "M"]
    floats = any(isinstance(e.type, (Scalar, Vector)) and _element(e.type) is FLOAT for e in (left, right))
    fitting = (row for row in rows if row.operands[0] == ("G" if floats else "I"))
    return apply(next(fitting, rows[0]).name, [left, right], span)


def _matrix_arithmetic(sign: str, left: ir.Expr, right: ir.Expr, span: Span) -> ir.Expr:
    """Return ``*`` of matrices and vectors as the product; with scalars, and for + and -, it goes by column."""
    if sign == "*" and not isinstance(left.type, Scalar) and not isinstance(right.type, Scalar):
        return _matmul([left, right], span)
    if sign not in ("+", "-", "*", "/"):
        fail(span, f"{sign} does not take matrices")
    matrix = left.type if isinstance(left.type, Matrix) else right.type
    assert isinstance(matrix, Matrix)
    if isinstance(left.type, Matrix) and isinstance(right.type, Matrix) and left.type != right.type:
        fail(span, f"{sign} mixes {left.type} and {right.type}")
    if isinstance(left.type, Vector) or isinstance(right.type, Vector):
        fail(span, f"{sign} does not take {left.type} and {right.type}")

    def part(value: ir.Expr, i: int) -> ir.Expr:
        number = ir.Literal(INT, i, span)
        return ir.Index(matrix.column, value, number, span) if isinstance(value.type, Matrix) else value

    columns = tuple(binary(sign, part(left, i), part(right, i), span) for i in range(matrix.columns))
    return ir.Construct(matrix, columns, span)


def _widens(value: ir.Expr, type_: Type) -> bool:
    """Return True if a value converts implicitly to another type."""
    if not isinstance(value.type, (Scalar, Vector)) or _element(value.type) not in (INT, UINT):
        return False
    written = isinstance(value, ir.Literal) and value.type is INT and type_ is UINT
    return written or with_element(value.type, FLOAT) == type_


def unify(left: ir.Expr, right: ir.Expr, span: Span, what: str) -> tuple[ir.Expr, ir.Expr]:
    """Convert both sides of a choice to one type."""
    if left.type == right.type:
        return left, right
    for a, b, flip in ((left, right, False), (right, left, True)):
        if _widens(a, b.type):
            widened = widen(a, b.type, span, what)
            return (b, widened) if flip else (widened, b)
    fail(span, f"{what} must have one type, got {left.type} and {right.type}")
