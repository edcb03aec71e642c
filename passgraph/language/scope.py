"""Resolve the names of a kernel: locals, operations, modules, and hints for names of other languages."""

from __future__ import annotations

import ast
import builtins
import dataclasses
import enum
import math
import re
import types as pytypes
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field
from difflib import get_close_matches
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import numbers, shown
from passgraph.cached import cached_property
from passgraph.errors import InputError
from passgraph.language import ir, symbols
from passgraph.language.meanings import INT_MAX, INT_MIN, int_of_bits
from passgraph.language.operations import BUILTINS, FUNCTIONS
from passgraph.language.operations import BUILTINS as OPERATIONS_OF_PYTHON
from passgraph.language.source import Source, Span, fail
from passgraph.language.symbols import UINT_MAX
from passgraph.language.types import (
    BOOL,
    FLOAT,
    INT,
    NAMED,
    UINT,
    Array,
    Matrix,
    Scalar,
    Struct,
    Type,
    Vector,
    element_of,
    flat_type,
)
from passgraph.language.uniform_layout import described, in_order
from passgraph.ranges import Range
from passgraph.records import dataclass

#: All names of the language itself.
OWN = (*NAMED, *symbols.FUNCTIONS, *FUNCTIONS, *BUILTINS.values(), "Const", "Array", "Vertex", "len", "range", "pi")
#: Longest name that is compared with others.
_LONGEST = 40

_SAMPLE, _TEXEL, _SIZE = "image.sample(uv)", "image.texel(p)", "image.size"
#: Functions and values of other languages, each with equivalent kernel text; functions in that text must exist.
FORMS: dict[str, str] = {
    "lerp": "mix(a, b, t)", "frac": "fract(x)", "rsqrt": "inversesqrt(x)", "rcp": "1.0 / x", "recip": "1.0 / x",
    "atan2": "atan(y, x)", "arctan2": "atan(y, x)", "arctan": "atan(x)", "arcsin": "asin(x)", "arccos": "acos(x)",
    "fmod": "x - y * trunc(x / y)", "mul": "a * b", "matrixCompMult": "a * b",
    "matmul": "a @ b", "mad": "fma(a, b, c)", "power": "pow(x, y)", "powf": "pow(x, y)",
    "square": "x * x", "cbrt": "sign(x) * pow(abs(x), 1.0 / 3.0)",
    "hypot": "length(vec2(x, y))", "norm": "length(v)", "magnitude": "length(v)", "normalized": "normalize(v)",
    "exponential": "exp(x)", "maximum": "max(a, b)", "minimum": "min(a, b)", "fmax": "max(a, b)",
    "fmin": "min(a, b)", "clip": "clamp(x, low, high)", "absolute": "abs(x)", "fabs": "abs(x)", "rint": "round(x)",
    "roundEven": "round(x)", "where": "a if test else b", "sum": "dot(v, vec3(1.0))", "deg2rad": "radians(x)",
    "rad2deg": "degrees(x)", "lessThan": "less(v, w)", "lessThanEqual": "less_equal(v, w)",
    "greaterThan": "greater(v, w)", "greaterThanEqual": "greater_equal(v, w)", "notEqual": "not_equal(v, w)",
    "floatBitsToInt": "bits_from_float(x)", "asint": "bits_from_float(x)",
    "floatBitsToUint": "uint(bits_from_float(x))",
    "asuint": "uint(bits_from_float(x))", "as_int": "bits_from_float(x)", "intBitsToFloat": "float_from_bits(n)",
    "uintBitsToFloat": "float_from_bits(int(u))", "asfloat": "float_from_bits(n)", "as_float": "float_from_bits(n)",
    "bitCount": "bit_count(n)", "popcount": "bit_count(n)", "countbits": "bit_count(n)", "findLSB": "find_lsb(n)",
    "findMSB": "find_msb(n)", "firstbitlow": "find_lsb(n)", "firstbithigh": "find_msb(n)",
    "bitfieldReverse": "bitfield_reverse(n)", "reversebits": "bitfield_reverse(n)",
    "bitfieldExtract": "bitfield_extract(n, offset, bits)", "bitfieldInsert": "bitfield_insert(n, other, offset, bits)",
    "f32tof16": "half_bits(x)", "f16tof32": "float_of_half(u)",
    **{f"pack{kind}4x8": f"pack_{kind.lower()}4x8(rgba)" for kind in ("Unorm", "Snorm")},
    **{f"pack{kind}2x16": f"pack_{kind.lower()}2x16(xy)" for kind in ("Unorm", "Snorm", "Half")},
    **{f"unpack{kind}": f"unpack_{kind.lower()}(u)"
       for kind in ("Unorm4x8", "Snorm4x8", "Unorm2x16", "Snorm2x16", "Half2x16")},
    "ddx": "dfdx(x)", "ddy": "dfdy(x)",
    **dict.fromkeys(
        ("texture", "texture2D", "tex2D", "tex2Dlod", "texture2DLod", "textureLod", "sample", "Sample", "SampleLevel"),
        _SAMPLE,
    ),
    **dict.fromkeys(("texelFetch", "imageLoad", "read_imagef", "Load", "load", "fetch", "read", "at"), _TEXEL),
    **dict.fromkeys(("textureSize", "imageSize", "get_image_dim", "GetDimensions", "shape", "resolution"), _SIZE),
    **dict.fromkeys(("width", "get_image_width"), f"{_SIZE}.x"),
    **dict.fromkeys(("height", "get_image_height"), f"{_SIZE}.y"),
    **dict.fromkeys(("gl_FragCoord", "fragCoord", "SV_Position"), "pixel()"),
    **dict.fromkeys(("iResolution", "RENDERSIZE", "gl_NumWorkGroups"), "output_size()"),
    **dict.fromkeys(("get_global_id", "gl_GlobalInvocationID"), "pixel()"),
    **dict.fromkeys(("isf_FragNormCoord", "gl_TexCoord", "texCoord", "vUv", "v_uv"), "uv()"),
    "gl_FrontFacing": "front_facing()",
}  # fmt: skip
#: Types of other languages, each with the kernel's.
TYPES: dict[str, str] = {
    **{f"{kind}{n}": f"vec{n}" for kind in ("float", "half", "double", "dvec", "fvec") for n in (2, 3, 4)},
    **{f"{kind}{n}": f"ivec{n}" for kind in ("int", "short") for n in (2, 3, 4)},
    **{f"{kind}{n}": f"uvec{n}" for kind in ("uint", "ushort") for n in (2, 3, 4)},
    **{f"bool{n}": f"bvec{n}" for n in (2, 3, 4)},
    **{f"{kind}{n}x{n}": f"mat{n}" for kind in ("float", "half", "mat") for n in (2, 3, 4)},
    **{f"Vec{n}": f"vec{n}" for n in (2, 3, 4)},
    **dict.fromkeys(("half", "double", "float16", "float32", "float64", "f32", "number"), "float"),
    **dict.fromkeys(("short", "long", "int32", "int64", "i32"), "int"),
    **dict.fromkeys(("ushort", "uint8", "uint16", "uint32", "u32"), "uint"),
    **dict.fromkeys(("boolean", "bool_"), "bool"),
    **dict.fromkeys(("sampler2D", "Texture2D", "image2d_t", "texture2d", "Texture", "ndarray"), "Image"),
}
#: Names without an equivalent expression, with an explanation.
WORDS: dict[str, str] = {
    "gl_Position": "a vertex kernel returns a struct with position: vec4",
    "gl_FragColor": "a kernel returns its colour",
    "gl_FragDepth": "a fragment kernel cannot change its depth; fragment_depth() reads it",
    "imageStore": "a kernel returns what its pixel becomes, and writes nothing else",
    "write_imagef": "a kernel returns what its pixel becomes, and writes nothing else",
    "print": "a kernel prints nothing; return a second result, or look at a pixel with passgraph inspect",
    "iTime": "a time is a parameter: time: float",
    "TIME": "a time is a parameter: time: float",
    "time": "a time is a parameter: time: float",
    "random": "a kernel has no random numbers; make a hash of pixel(), or take a picture of noise",
    "rand": "a kernel has no random numbers; make a hash of pixel(), or take a picture of noise",
    "enumerate": "count with range: for i in range(len(values)), and values[i] inside",
    "zip": "count with range: for i in range(len(values)), and one[i], other[i] inside",
    **dict.fromkeys(("PI", "M_PI"), "write math.pi (pi in the text of kernels)"),
    "pi": "write math.pi, with: import math",
}


def mending(name: str, names: Iterable[str] = ()) -> str:
    """Return a suggestion for an unknown name, to append to a message; empty if nothing is similar.

    ``known`` are further names that have a meaning.

    >>> mending("lerp"), mending("float4"), mending("smoothstp"), mending("strenght", ["strength"]), mending("zzz")
    ('; write mix(a, b, t)', '; write vec4', "; did you mean 'smoothstep'?", "; did you mean 'strength'?", '')
    """
    if name in WORDS:
        return f"; {WORDS[name]}"
    if name in TYPES:
        return f"; write {TYPES[name]}"
    form = FORMS.get(name)
    if form is not None and _has(form):
        return f"; write {form}"
    if name.endswith("f") and name[:-1] in FUNCTIONS:  # as in C
        return f"; write {_call(name[:-1])}"
    if len(name) > _LONGEST:
        return ""
    matches = get_close_matches(name, dict.fromkeys((*names, *OWN)), n=1, cutoff=0.75)
    return f"; did you mean {matches[0]!r}?" if matches else ""


def own_spelling(name: str) -> str:
    """Return our spelling of another library's function, such as NumPy's ``sin``; empty if there is none.

    >>> own_spelling("sin"), own_spelling("arctan2"), own_spelling("abs"), own_spelling("fft")
    ('; write sin(x), with: from passgraph.language import sin', '; write atan(y, x)', '; write abs(x)', '')
    """
    if name in FUNCTIONS or name in symbols.FUNCTIONS:
        return f"; write {_call(name)}, with: from passgraph.language import {name}"
    if name in NAMED or name in BUILTINS.values():
        return f"; write {name}(x)"
    return mending(name) if name in WORDS or name in TYPES or name in FORMS else ""


def method_spelling(name: str) -> str:
    """Return the function for a method of another language, such as ``.length()``.

    >>> method_spelling("length"), method_spelling("dot"), method_spelling("norm"), method_spelling("zzz")
    ('; write length(v)', '; write dot(v, …)', '; write length(v)', '')
    """
    row = FUNCTIONS.get(name)
    if row is not None:
        return f"; write {name}({', '.join(['v', '…'][: len(row.operands)])})"
    return mending(name) if name in FORMS else f"; write {name}(v)" if name in BUILTINS.values() else ""


def _has(form: str) -> bool:
    return all(called in OWN for called in re.findall(r"(?<![.\w])[a-z_]\w*(?=\()", form))


def _call(name: str) -> str:
    """Return a call of a language function with letters for its arguments."""
    row = FUNCTIONS.get(name)
    return f"{name}({', '.join('xyz'[: len(row.operands)]) if row is not None else 'x'})"


#: Longest table that a kernel may capture: as long as the longest array that it may declare.
MAX_TABLE_ENTRIES = 1024
#: Python's builtins that kernels may call, with their names in the language.
PYTHON_BUILTINS: dict[object, str] = {**OPERATIONS_OF_PYTHON, builtins.len: "len", builtins.range: "range"}

#: Names that kernel text may use without an import.
TEXT_NAMES: dict[str, object] = {
    **{name: marker for marker, name in symbols.TYPE_MARKERS.items()},
    **symbols.FUNCTIONS,
    **FUNCTIONS,
    **{name: function for function, name in PYTHON_BUILTINS.items()},
    "Const": symbols.Const,
    "Array": symbols.Array,
    "Vertex": symbols.Vertex,
    "Annotated": Annotated,
    "Range": Range,
    "tuple": tuple,
    "True": True,
    "False": False,
    "pi": math.pi,
}


@dataclass(frozen=True, eq=False)
class FunctionSource:
    """The text of a function of the kernel language: parsed, inlined, never run.

    ``read`` returns its text and the statement that defines it, when one of them is first needed.
    """

    name: str
    read: Callable[[], tuple[Source, ast.FunctionDef]]
    scope: Scope
    #: Qualified name of the Python function; empty for text.
    module: str = ""
    qualname: str = ""
    doc: str | None = None
    #: For functions of this package, what names them and the values that they capture; empty for others.
    cache_key: str = ""

    @classmethod
    def of_node(cls, source: Source, node: ast.FunctionDef, scope: Scope) -> FunctionSource:
        """Return a function of a text."""
        return cls(node.name, lambda: (source, node), scope, doc=ast.get_docstring(node))

    @property
    def is_lazy(self) -> bool:
        """Return True for functions of this package that the cache can hold: its tests read them all, a program few."""
        return bool(self.cache_key)

    @cached_property
    def _read(self) -> tuple[Source, ast.FunctionDef]:
        return self.read()

    @property
    def source(self) -> Source:
        return self._read[0]

    @property
    def node(self) -> ast.FunctionDef:
        return self._read[1]

    @cached_property
    def assigned(self) -> frozenset[str]:
        """Return every name that the body assigns to: its locals, by Python's rules."""
        return frozenset(_assigned_names(self.node.body))

    def nearby(self) -> list[str]:
        """Return names that the body may use: its parameters, its locals, and names around it."""
        arguments = self.node.args
        parameters = [one.arg for one in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]
        return [*parameters, *self.assigned, *self.scope.listed()]


def _assigned_names(nodes: Iterable[ast.stmt]) -> set[str]:
    names = set()
    for node in nodes:
        for part in ast.walk(node):
            if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store):
                names.add(part.id)
            elif isinstance(part, (ast.Attribute, ast.Subscript)) and isinstance(part.ctx, ast.Store):
                base: ast.expr = part
                while isinstance(base, (ast.Attribute, ast.Subscript)):
                    base = base.value
                if isinstance(base, ast.Name):
                    names.add(base.id)
    return names


@dataclass(frozen=True, eq=False)
class KnownTable:
    """A constant that was made into a table once, however often it is named; ``plain`` is a copy in plain data."""

    value: object
    plain: object
    table: ir.Table
    #: Types that the value was found to fit, as a default.
    fits: set[Type] = field(default_factory=set)


@dataclass(eq=False)
class Scope:
    """Names around a kernel.  ``captured`` records every constant captured by value."""

    names: Callable[[str], object]
    captured: dict[str, object] = field(default_factory=dict)
    #: Meanings of all names looked up, dotted ones too.
    meanings: dict[str, Any] = field(default_factory=dict)
    #: Tables by the identity of their values and of their plain copies; None if values may change between uses.
    tables: dict[int, KnownTable] | None = None
    #: Names that error messages may suggest for a misspelled one.
    listed: Callable[[], Iterable[str]] = tuple
    #: All names of the language that the text uses without importing them, if known.
    lacking: Callable[[], Iterable[str]] = tuple

    def lookup(self, name: str, span: Span) -> object:
        try:
            return self.names(name)
        except KeyError:
            mend = self._importing(name) if name in TEXT_NAMES and name != "pi" else mending(name, self.listed())
            sees = (
                "; a kernel sees its parameters, its own variables, functions marked @pg.function, and numbers of the "
                "module"
            )
            fail(span, f"name {name!r} is not defined here{mend or sees}")

    def _importing(self, name: str) -> str:
        """Return the import that provides a name of the language, and the others that the text lacks."""
        if name == "Annotated":
            return "; import it: from typing import Annotated"
        every = sorted({name, *self.lacking()} - {"pi", "Annotated"})
        return f"; import {'it' if len(every) == 1 else 'them'}: from passgraph.language import {', '.join(every)}"

    def changed_constants(self) -> list[str]:
        """Return captured names whose value differs from the one that the kernel was built with."""
        changed = []
        for name, then in self.captured.items():
            try:
                now = self.names(name.split(".")[0])
                for part in name.split(".")[1:]:
                    now = getattr(now, part)
                if repr(freeze(now)) != repr(then):  # distinguishes -0.0 from 0.0, 1 from True, and NaN is NaN
                    changed.append(name)
            except (KeyError, AttributeError, TypeError):
                changed.append(name)
        return changed


def python_scope(function: Callable[..., Any]) -> Scope:
    """Return the names that Python would find: closure, module, builtins."""
    cells = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))

    def names(name: str) -> object:
        if name in cells:
            try:
                return cells[name].cell_contents
            except ValueError:
                raise KeyError(name) from None
        if name in function.__globals__:
            return function.__globals__[name]
        if hasattr(builtins, name):
            return getattr(builtins, name)
        raise KeyError(name)

    def lacking() -> list[str]:
        import dis  # needed for an error only

        read = {one.argval for one in dis.get_instructions(function) if one.opname == "LOAD_GLOBAL"}
        return [
            name
            for name in TEXT_NAMES.keys() & read
            if name not in function.__globals__ and not hasattr(builtins, name)
        ]

    return Scope(names, listed=lambda: (*cells, *function.__globals__), lacking=lacking)


def text_scope(own: Mapping[str, object], tables: dict[int, KnownTable] | None = None) -> Scope:
    """Return the names of kernel text: its own definitions and the language, nothing of Python.

    ``tables`` are those of the text, whose values cannot change.
    """
    return Scope(lambda name: own[name] if name in own else TEXT_NAMES[name], tables=tables, listed=lambda: own)


def freeze(value: object) -> object:
    """Return a comparable copy of a constant, or raise TypeError if it is not one."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, enum.Enum):
        return freeze(value.value)
    if isinstance(value, (bool, int, float)):
        return value
    if isinstance(value, (tuple, list)):
        return tuple(freeze(v) for v in value)
    if isinstance(value, np.ndarray):
        return freeze(value.tolist())
    raise TypeError(type(value).__name__)


@dataclass(frozen=True, eq=False)
class ModuleName:
    """A module in a dotted name."""

    module: pytypes.ModuleType
    path: str


def meaning_of(value: object, path: str, scope: Scope, span: Span) -> Any:
    """Resolve a name (:func:`classified`); tables are built once if the scope keeps them."""
    known = None if scope.tables is None else scope.tables.get(id(value))
    if known is not None:
        scope.captured[path], scope.meanings[path] = known.plain, known.table
        return dataclasses.replace(known.table, span=span)
    meaning = scope.meanings[path] = classified(value, path, scope, span)
    if scope.tables is not None and isinstance(meaning, ir.Table):
        known = KnownTable(value, scope.captured[path], meaning)
        scope.tables[id(value)] = scope.tables[id(known.plain)] = known
    return meaning


def classified(value: object, path: str, scope: Scope, span: Span) -> Any:
    """Classify the value of a name.

    Returns a :class:`Type`, a :class:`Struct`, a :class:`FunctionSource`, a :class:`~.symbols.Symbol`, a
    module, the name of a Python builtin, one of the generic markers (Const, Array, Vertex), or a constant
    expression.
    """
    if isinstance(value, (symbols.Symbol, FunctionSource, Struct, Range)) or value is Annotated or value is Range:
        return value
    if isinstance(value, pytypes.ModuleType):
        return ModuleName(value, path)
    if isinstance(value, type):
        if value in symbols.TYPE_MARKERS:
            return NAMED[symbols.TYPE_MARKERS[value]]
        if value in (symbols.Const, symbols.Array, symbols.Vertex, tuple):
            return value
        if "__passgraph_struct__" in vars(value):
            return vars(value)["__passgraph_struct__"]()
        if dataclasses.is_dataclass(value):
            fail(span, f"{path} is a plain dataclass; mark it with @pg.struct to use it in kernels")
    attached = getattr(value, "__passgraph_function__", None)
    if isinstance(attached, FunctionSource):
        return attached
    if isinstance(value, pytypes.BuiltinFunctionType | type) and value in PYTHON_BUILTINS:
        return PYTHON_BUILTINS[value]
    if isinstance(value, np.ndarray):
        _check_entries(math.prod(_sides(value.shape)), path, span)  # before they are converted to Python's numbers
    elif isinstance(value, (tuple, list)):
        _check_entries(len(value), path, span)
    try:
        frozen = freeze(value)
    except TypeError:
        mend = own_spelling(path.rpartition(".")[2]) if _is_foreign(value) else ""
        takes = "; they take numbers, tuples and arrays of numbers, @pg.struct classes and @pg.function functions"
        fail(span, f"{path} is {_described(value)}, which kernels cannot use{mend or takes}")
    scope.captured[path] = frozen
    return constant(value, path, span)


def _is_foreign(value: object) -> bool:
    """Return True for a callable that is not a function of the user."""
    if isinstance(value, pytypes.FunctionType):
        return (value.__module__ or "").partition(".")[0] == "numpy"
    return callable(value)


def _described(value: object) -> str:
    if isinstance(value, pytypes.FunctionType):
        return "a Python function; mark it with @pg.function"
    return f"the class {value.__name__}" if isinstance(value, type) else f"a {type(value).__name__}"


def number(value: object, span: Span) -> ir.Literal:
    """Return a literal of the language, with its range checked."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return ir.Literal(BOOL, value, span)
    if isinstance(value, int):
        if not INT_MIN <= value <= UINT_MAX:
            fail(span, f"{shown(value)} does not fit 32 bits; write it as a float, such as 3e9, or make it smaller")
        return ir.Literal(INT, int_of_bits(value), span, bits=value > INT_MAX)
    if isinstance(value, float):
        with np.errstate(over="ignore"):
            single = float(np.float32(value))
        if math.isinf(single) and not math.isinf(value):
            fail(span, f"{value} does not fit float32 (largest is 3.4e38)")
        return ir.Literal(FLOAT, single, span)
    fail(span, f"a {type(value).__name__} is not a number of the kernel language")


def written(node: ast.Constant, span: Span) -> ir.Literal:
    """Return a number from the source; an int beyond 2147483647 is a bit pattern, and must be written as one."""
    value = node.value
    bits = span.text[span.column : span.column + 2].lower() in ("0x", "0o", "0b")
    if isinstance(value, int) and INT_MAX < value <= UINT_MAX and not bits:
        fail(
            span,
            f"{value} is beyond {INT_MAX}, the largest int; write it as a float ({value}.0), or, where its bits are "
            f"meant, as {value:#x} (the int {int_of_bits(value)}, and the uint {value})",
        )
    return number(value, span)


def as_array(value: object) -> NDArray[Any]:
    """Convert to a NumPy array; anything without numbers becomes an array of one object, which every check rejects."""
    try:
        return numbers(value, "a constant")
    except InputError:
        return np.array(None)


def constant(value: object, path: str, span: Span) -> ir.Expr:
    """Return a captured number, vector, matrix or table."""
    marker = symbols.TYPE_MARKERS.get(type(value))
    if marker == "uint":
        return ir.Literal(UINT, int(value), span)  # type: ignore[call-overload]
    if isinstance(value, (bool, int, float, np.generic, enum.Enum)):
        return number(value.value if isinstance(value, enum.Enum) else value, span)
    if marker is not None and isinstance(value, tuple):
        return typed_constant(value, NAMED[marker], path, span)
    array = as_array(value)
    if array.dtype.kind not in "biuf" or array.size == 0:
        fail(span, f"{path} must hold numbers of one type, got {shown(value)}")
    if array.ndim == 0:
        return number(array.item(), span)
    element = {"b": BOOL, "i": INT, "u": INT, "f": FLOAT}[array.dtype.kind]
    return ir.Table(
        _table_type(array.shape, element, path, span), tuple(number(v, span).value for v in array.ravel()), span
    )


def _sides(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the sides of a table of this shape: rows of two to four numbers are vectors."""
    return shape[:-1] if len(shape) > 1 and 2 <= shape[-1] <= 4 else shape


def _check_entries(entries: int, path: str, span: Span) -> None:
    if entries > MAX_TABLE_ENTRIES:
        fail(span, f"{path} has {entries} entries; kernels capture at most {MAX_TABLE_ENTRIES}")


def _table_type(shape: tuple[int, ...], element: Scalar, path: str, span: Span) -> Array:
    """Return the type of a nested array of scalars or vectors."""
    sides = _sides(shape)
    _check_entries(math.prod(sides), path, span)
    entry: Scalar | Vector | Array = Vector(element, shape[-1]) if sides != shape else element
    for side in reversed(sides):
        entry = Array(entry, side)
    assert isinstance(entry, Array)
    return entry


def typed_constant(value: object, type_: Type, path: str, span: Span) -> ir.Expr:
    """Return a host value as a constant of a given type; numbers are converted to the element type."""
    assert isinstance(type_, (Scalar, Vector, Matrix, Array))
    flat = host_numbers(value, type_, path, span)
    element = element_of(type_)
    if isinstance(type_, Scalar):
        return ir.Literal(element, flat[0], span)
    if isinstance(type_, Array):
        return ir.Table(flat_type(type_), tuple(flat), span)
    return ir.Construct(type_, tuple(ir.Literal(element, v, span) for v in flat), span)


def host_numbers(value: object, type_: Type, path: str, span: Span) -> list[ir.Number]:
    """Return a host value's numbers in component order (:func:`in_order`); the error names ``path``."""
    array = as_array(value)
    flat = in_order(array, type_)
    element = element_of(type_)
    if flat is None or array.dtype.kind not in "biuf":
        fail(span, f"{path} must be {type_} ({described(type_)}), got {shown(value)}")
    if element is not FLOAT and array.dtype.kind == "f":
        fail(span, f"{path} must be {type_}, got floats; convert them first")
    if element is UINT:
        return [_uint(int(v), path, span) for v in flat.tolist()]
    convert: Callable[[Any], ir.Number] = {"bool": bool, "int": int, "float": float}[element.name]
    return [number(convert(v), span).value for v in flat.tolist()]


def _uint(value: int, path: str, span: Span) -> int:
    if not 0 <= value <= UINT_MAX:
        fail(span, f"{path} must be uint, from 0 to {UINT_MAX}, got {shown(value)}")
    return value
