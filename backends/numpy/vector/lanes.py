"""An LLVM builder whose values are scalars or vectors with one number per lane.

A uniform value stays a scalar as long as it meets only scalars; it is broadcast when it meets a vector.  So the
emitters of operations (operations.py) serve both, and uniform computations cost no more than scalar ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache, partial
from typing import Any

import numpy as np

from passgraph.backends.numpy.machine import llvm
from passgraph.formats import Format
from passgraph.language import scalar as s
from passgraph.language.borders import border_program, computed

F32, F64, I32, I64, BOOL = llvm.FloatType(), llvm.DoubleType(), llvm.IntType(32), llvm.IntType(64), llvm.IntType(1)
I8 = llvm.IntType(8)
TYPES = {"float": F32, "int": I32, "bool": BOOL, s.INDEX: I32}
#: Types of array entries; bits would be packed.
HELD = TYPES | {"bool": I32}


def constant(value: s.Lit) -> Any:
    if value.type == "float":
        number = float(np.float32(value.value))
        # LLVM's text has no spelling of NaN and needs the bits of infinities, so all go by their bits.
        if math.isnan(number) or math.isinf(number):
            bits = int(np.float32(number).view(np.int32))
            return llvm.Constant(I32, bits).bitcast(F32)
        return llvm.Constant(F32, number)
    return llvm.Constant(TYPES[value.type], int(value.value))


def call(name: str, result: Any) -> Callable[..., Any]:
    """Return an LLVM intrinsic on float32; vector units have an instruction for each one used here."""

    def emit(b: Any, *arguments: Any) -> Any:
        kind = llvm.FunctionType(result, [F32] * len(arguments))
        function = b.module.globals.get(name) or llvm.Function(b.module, kind, name)
        return b.call(function, list(arguments))

    return emit


fabs = call("llvm.fabs.f32", F32)


def _floor_divide(b: Any, x: Any, y: Any) -> Any:
    quotient, rest, zero = _divide(b, x, y)
    down = b.and_(b.icmp_signed("!=", rest, _int(0)), b.icmp_signed("<", b.xor(rest, y), _int(0)))
    return b.select(zero, _int(0), b.select(down, b.sub(quotient, _int(1)), quotient))


def _int_mod(b: Any, x: Any, y: Any) -> Any:
    _, rest, zero = _divide(b, x, y)
    up = b.and_(b.icmp_signed("!=", rest, _int(0)), b.icmp_signed("<", b.xor(rest, y), _int(0)))
    return b.select(zero, _int(0), b.select(up, b.add(rest, y), rest))


def _divide(b: Any, x: Any, y: Any) -> tuple[Any, Any, Any]:
    """Return quotient toward zero, remainder, and True for a zero divisor; avoids the two divisions that trap."""
    zero, minus = b.icmp_signed("==", y, _int(0)), b.icmp_signed("==", y, _int(-1))
    safe = b.select(b.or_(zero, minus), _int(1), y)
    quotient = b.select(minus, b.sub(_int(0), x), b.sdiv(x, safe))
    return quotient, b.sub(x, b.mul(quotient, y)), zero


def _int(value: int) -> Any:
    return llvm.Constant(I32, value)


def _shift(b: Any, y: Any) -> Any:
    return b.and_(y, _int(31))


def _saturated(b: Any, x: Any) -> Any:
    """Convert to int toward zero, saturating, NaN to 0.

    LLVM's own intrinsic is scalarized on x86; this stays in vectors.
    """
    low, high = llvm.Constant(F32, -(2.0**31)), llvm.Constant(F32, 2.0**31)
    below = llvm.Constant(F32, 2.0**31 - 128.0)  # the last float32 before 2**31
    ranged = b.select(b.fcmp_ordered(">", x, low), x, low)
    integer = b.fptosi(b.select(b.fcmp_ordered("<", ranged, below), ranged, below), I32)
    integer = b.select(b.fcmp_ordered(">=", x, high), _int(2**31 - 1), integer)
    return b.select(b.fcmp_unordered("uno", x, x), _int(0), integer)


_FLOAT: dict[str, Callable[..., Any]] = {
    "add": lambda b, x, y: b.fadd(x, y), "sub": lambda b, x, y: b.fsub(x, y), "mul": lambda b, x, y: b.fmul(x, y),
    "div": lambda b, x, y: b.fdiv(x, y), "neg": lambda b, x: b.fneg(x), "abs": fabs,
    "min": lambda b, x, y: b.select(b.fcmp_ordered("<", y, x), y, x),
    "max": lambda b, x, y: b.select(b.fcmp_ordered("<", x, y), y, x),
    "floor": call("llvm.floor.f32", F32), "ceil": call("llvm.ceil.f32", F32), "trunc": call("llvm.trunc.f32", F32),
    "round": call("llvm.roundeven.f32", F32), "sqrt": call("llvm.sqrt.f32", F32),
    "fma": call("llvm.fmuladd.f32", F32),  # two instructions where the processor has no single one
    "less": lambda b, x, y: b.fcmp_ordered("<", x, y), "less_equal": lambda b, x, y: b.fcmp_ordered("<=", x, y),
    "greater": lambda b, x, y: b.fcmp_ordered(">", x, y), "greater_equal": lambda b, x, y: b.fcmp_ordered(">=", x, y),
    "equal": lambda b, x, y: b.fcmp_ordered("==", x, y), "not_equal": lambda b, x, y: b.fcmp_unordered("!=", x, y),
    "isnan": lambda b, x: b.fcmp_unordered("uno", x, x),
    "isinf": lambda b, x: b.fcmp_ordered("==", fabs(b, x), constant(s.Lit("float", math.inf))),
    "bits_from_float": lambda b, x: b.bitcast(x, I32),
    "to_int": _saturated,
}  # fmt: skip
_INT: dict[str, Callable[..., Any]] = {
    "add": lambda b, x, y: b.add(x, y), "sub": lambda b, x, y: b.sub(x, y), "mul": lambda b, x, y: b.mul(x, y),
    "neg": lambda b, x: b.sub(_int(0), x),
    "abs": lambda b, x: b.select(b.icmp_signed("<", x, _int(0)), b.sub(_int(0), x), x),
    "floor_divide": _floor_divide, "int_mod": _int_mod,
    "min": lambda b, x, y: b.select(b.icmp_signed("<", y, x), y, x),
    "max": lambda b, x, y: b.select(b.icmp_signed("<", x, y), y, x),
    "less": lambda b, x, y: b.icmp_signed("<", x, y), "less_equal": lambda b, x, y: b.icmp_signed("<=", x, y),
    "greater": lambda b, x, y: b.icmp_signed(">", x, y), "greater_equal": lambda b, x, y: b.icmp_signed(">=", x, y),
    "equal": lambda b, x, y: b.icmp_signed("==", x, y), "not_equal": lambda b, x, y: b.icmp_signed("!=", x, y),
    "bit_and": lambda b, x, y: b.and_(x, y), "bit_or": lambda b, x, y: b.or_(x, y),
    "bit_xor": lambda b, x, y: b.xor(x, y),
    "bit_not": lambda b, x: b.not_(x),
    "shift_left": lambda b, x, y: b.shl(x, _shift(b, y)), "shift_right": lambda b, x, y: b.ashr(x, _shift(b, y)),
    "float_from_bits": lambda b, x: b.bitcast(x, F32), "to_float": lambda b, x: b.sitofp(x, F32),
}  # fmt: skip
_BOOL: dict[str, Callable[..., Any]] = {
    "logical_and": lambda b, x, y: b.and_(x, y),
    "logical_or": lambda b, x, y: b.or_(x, y),
    "logical_not": lambda b, x: b.not_(x),
    "to_float": lambda b, x: b.uitofp(x, F32),
    "to_int": lambda b, x: b.zext(x, I32),
}


class Written(llvm.Constant):
    """A constant with given text; ``numbers`` are those of each lane, if known separately."""

    def __init__(self, kind: Any, text: str, numbers: Sequence[Any] = ()) -> None:
        llvm.Value.__init__(self, kind, text)
        self.constant = numbers


def same(kind: Any, value: Any) -> Written:
    """Return a number in every lane."""
    return Written(kind, f"splat ({value})")


def zeros(kind: Any) -> Written:
    return Written(kind, "zeroinitializer")


def blank(kind: Any) -> Written:
    """Return a vector (or struct) whose used lanes will all be inserted."""
    return Written(kind, "poison")


def lanes_of(numbers: Sequence[int], bits: int = 32) -> Written:
    """Return integers, lane by lane."""
    return _numbers(tuple(numbers), bits)


@lru_cache(maxsize=512)
def _numbers(numbers: tuple[int, ...], bits: int) -> Written:
    kind = llvm.IntType(bits)
    parts = [llvm.Constant(kind, number) for number in numbers]
    text = f"<{', '.join(map(str, parts))}>" if any(numbers) else "zeroinitializer"
    return Written(llvm.VectorType(kind, len(numbers)), text, parts)


_LETTERS = {"half": "f16", "float": "f32", "double": "f64"} | {f"i{bits}": f"i{bits}" for bits in (1, 8, 16, 32, 64)}
_ALIKE = ("fadd", "fsub", "fmul", "fdiv", "add", "sub", "mul", "sdiv", "srem", "shl", "ashr", "lshr",
          "and_", "or_", "xor")  # fmt: skip
_CASTS = ("sext", "zext", "trunc", "fptrunc", "fpext", "sitofp", "uitofp", "fptosi", "bitcast")
_COMPARES = ("icmp_signed", "icmp_unsigned", "fcmp_ordered", "fcmp_unordered")


def is_vector(value: Any) -> bool:
    return isinstance(value.type, llvm.VectorType)


class Lanes:
    """Wraps a builder; ``lanes`` is the width of vectors."""

    def __init__(self, builder: Any, lanes: int) -> None:
        self.plain, self.lanes = builder, lanes
        self.reads = 0  # scattered texel reads so far
        #: Broadcast values: those of the function's start, and those computed in a block.
        self._spread: dict[Any, Any] = {}
        #: Floats decoded from integers, with these and their format: storing them there again changes nothing.
        self.undecoded: dict[Any, tuple[Any, Format]] = {}

    def __getattr__(self, name: str) -> Any:
        """Return arithmetic, casts and comparisons for both kinds of value; other attributes are the builder's own."""
        method = getattr(self.plain, name)
        operation: Callable[..., Any] = method
        if name in _ALIKE:
            operation = partial(self._binary, method)
        elif name in _CASTS:
            operation = partial(self._cast, method)
        elif name in _COMPARES:
            operation = partial(self._compare, method)
        else:
            return method
        setattr(self, name, operation)
        return operation

    @contextmanager
    def goto_entry_block(self) -> Iterator[None]:
        """Emit at the start of the function inside the ``with``."""
        if self.plain.block is self.plain.function.entry_basic_block:
            yield  # if nested: behind the code of the outer one
        else:
            with self.plain.goto_entry_block():
                yield

    def _binary(self, method: Any, x: Any, y: Any, **options: Any) -> Any:
        return method(*self.alike(x, y), **options)

    def _cast(self, method: Any, value: Any, kind: Any) -> Any:
        type_ = self.vector(kind) if is_vector(value) else kind
        return value if value.type == type_ else method(value, type_)

    def _compare(self, method: Any, sign: str, x: Any, y: Any) -> Any:
        return method(sign, *self.alike(x, y))

    def select(self, condition: Any, then: Any, orelse: Any) -> Any:
        if is_vector(condition):
            return self.plain.select(condition, self.spread(then), self.spread(orelse))
        return self.plain.select(condition, *self.alike(then, orelse))

    def call(self, function: Any, arguments: list[Any]) -> Any:
        """Call an intrinsic; its name differs for vectors."""
        if not any(map(is_vector, arguments)):
            return self.plain.call(function, arguments)
        kinds = [function.ftype.return_type, *function.ftype.args]
        stem = function.name.removesuffix("." + ".".join(_LETTERS[str(k)] for k in _parts(function.name, kinds)))
        suffix = ".".join(f"v{self.lanes}{_LETTERS[str(k)]}" for k in _parts(function.name, kinds))
        intrinsic = self.intrinsic(f"{stem}.{suffix}", self.vector(kinds[0]), [self.vector(k) for k in kinds[1:]])
        return self.plain.call(intrinsic, [self.spread(a) for a in arguments])

    def intrinsic(self, name: str, result: Any, arguments: list[Any]) -> Any:
        """Return the declaration of an LLVM intrinsic in this module."""
        module = self.plain.module
        return module.globals.get(name) or llvm.Function(module, llvm.FunctionType(result, arguments), name)

    def vector(self, kind: Any) -> Any:
        return llvm.VectorType(kind, self.lanes)

    def alike(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Return both as vectors if one is; an integer constant takes the width of the other."""
        kind_x, kind_y = (v.type.element if is_vector(v) else v.type for v in (x, y))
        if kind_x != kind_y and isinstance(kind_x, llvm.IntType):
            if isinstance(x, llvm.Constant):
                x = llvm.Constant(kind_y, x.constant)
            elif isinstance(y, llvm.Constant):
                y = llvm.Constant(kind_x, y.constant)
        return (self.spread(x), self.spread(y)) if is_vector(x) or is_vector(y) else (x, y)

    def spread(self, value: Any) -> Any:
        """Broadcast a number to every lane."""
        if is_vector(value):
            return value
        kind = self.vector(value.type)
        if type(value) is llvm.Constant:
            return same(kind, value)
        entry, here = self.plain.function.entry_basic_block, self.plain.block
        if getattr(value, "parent", None) is not entry or here is entry:
            if (value, here) not in self._spread:
                self._spread[value, here] = self._in_every_lane(value, kind)
            return self._spread[value, here]
        # Once for all loops.
        if value not in self._spread:
            with self.goto_entry_block():
                self._spread[value] = self._in_every_lane(value, kind)
        return self._spread[value]

    def _in_every_lane(self, value: Any, kind: Any) -> Any:
        nothing = blank(kind)
        first = self.plain.insert_element(nothing, value, llvm.Constant(I32, 0))
        return self.plain.shuffle_vector(first, nothing, lanes_of([0] * self.lanes))

    def counting(self, kind: Any) -> Any:
        """Return 0, 1, 2 … lane by lane."""
        return lanes_of(range(self.lanes), kind.width)

    def any(self, mask: Any) -> Any:
        """Return True if some lane is set."""
        if not is_vector(mask):
            return mask
        bits = llvm.IntType(self.lanes)
        return self.plain.icmp_unsigned("!=", self.plain.bitcast(mask, bits), llvm.Constant(bits, 0))

    def all(self, mask: Any) -> Any:
        """Return True if every lane is set."""
        bits = llvm.IntType(self.lanes)
        return self.plain.icmp_unsigned("==", self.plain.bitcast(mask, bits), llvm.Constant(bits, -1))

    # Memory

    def load_at(self, pointer: Any, index: Any, kind: Any, mask: Any = None, steady: bool = False) -> Any:
        """Load ``pointer[index]``: one load, or one per lane; lanes outside ``mask`` are not read.

        ``steady``: the memory is not written meanwhile, so LLVM may load once for many uses.
        """
        if not is_vector(index):
            place = self.plain.gep(pointer, [index], True, source_etype=kind)
            return self.plain.load(place, typ=kind, align=_size(kind), steady=steady)
        vector, pointers = self.vector(kind), self.vector(llvm.PointerType())
        places = self.plain.gep(pointer, [index], True, source_etype=kind)
        name = f"llvm.masked.gather.v{self.lanes}{_LETTERS[str(kind)]}.v{self.lanes}p0"
        gather = self.intrinsic(name, vector, [pointers, I32, self.vector(BOOL), vector])
        which = self.spread(llvm.Constant(BOOL, 1) if mask is None else mask)
        return self.plain.call(
            gather, [places, llvm.Constant(I32, _size(kind)), which, self.spread(llvm.Constant(kind, 0))]
        )

    def store_masked(self, values: Any, place: Any, mask: Any, align: int) -> None:
        """Store consecutive numbers from ``place`` on where the mask is set."""
        name = f"llvm.masked.store.v{values.type.count}{_LETTERS[str(values.type.element)]}.p0"
        arguments = [values.type, llvm.PointerType(), I32, mask.type]
        store = self.intrinsic(name, llvm.VoidType(), arguments)
        self.plain.call(store, [values, place, llvm.Constant(I32, align), mask])

    def store_at(self, pointer: Any, index: Any, value: Any, kind: Any, mask: Any) -> None:
        """Store ``pointer[index] = value`` in the lanes of the mask."""
        vector, pointers = self.vector(kind), self.vector(llvm.PointerType())
        places = self.plain.gep(pointer, [index], True, source_etype=kind)
        name = f"llvm.masked.scatter.v{self.lanes}{_LETTERS[str(kind)]}.v{self.lanes}p0"
        scatter = self.intrinsic(name, llvm.VoidType(), [vector, pointers, I32, self.vector(BOOL)])
        self.plain.call(scatter, [self.spread(value), places, llvm.Constant(I32, _size(kind)), mask])

    def interleaved(self, parts: list[Any]) -> Any:
        """Interleave vectors (or masks): x0 y0 z0 w0 x1 y1 …."""
        b, n, count = self.plain, self.lanes, len(parts)
        if count == 1:
            return parts[0]
        padded_count = 1 << (count - 1).bit_length()
        rows = [*parts, *[blank(parts[0].type)] * (padded_count - count)]
        while len(rows) > 1:
            length = rows[0].type.count
            order = lanes_of(range(2 * length))
            rows = [b.shuffle_vector(x, y, order) for x, y in zip(rows[::2], rows[1::2], strict=True)]
        woven = [part * n + lane for lane in range(n) for part in range(count)]
        return b.shuffle_vector(rows[0], blank(rows[0].type), lanes_of(woven))


def _parts(name: str, kinds: list[Any]) -> list[Any]:
    """Return the type suffixes of an intrinsic's name: all types, or one if they are equal."""
    return kinds[:2] if name.endswith(".".join(_LETTERS[str(k)] for k in kinds[:2])) else kinds[:1]


def _size(kind: Any) -> int:
    return {"i8": 1, "i16": 2, "half": 2, "float": 4, "i32": 4, "double": 8, "i64": 8}[str(kind)]


@contextmanager
def counting(b: Lanes, start: Any, stop: Any, step: Any) -> Iterator[Any]:
    """Emit a loop; the code inside runs for each index."""
    with b.goto_entry_block():
        slot = b.alloca(start.type)
    check, body, behind = (b.append_basic_block(name) for name in ("check", "body", "behind"))
    b.store(start, slot)
    b.branch(check)
    b.position_at_end(check)
    index = b.load(slot, typ=start.type)
    b.cbranch(b.icmp_signed("<", index, stop), body, behind)
    b.position_at_end(body)
    yield index
    b.store(b.add(index, step), slot)
    b.branch(check)
    b.position_at_end(behind)


def floor_modulo(b: Any, value: Any, size: Any) -> Any:
    """Return the remainder in [0, size).  Vectors have no integer division; a float64 quotient is off by at most
    one."""
    if not is_vector(value):
        rest = b.srem(value, size)
        return b.select(b.icmp_signed("<", rest, llvm.Constant(I32, 0)), b.add(rest, size), rest)
    kind = llvm.DoubleType()
    inverse = b.fdiv(llvm.Constant(kind, 1.0), b.sitofp(size, kind))
    quotient = b.fptosi(b.fmul(b.sitofp(value, kind), inverse), I32)
    rest = b.sub(value, b.mul(quotient, size))
    rest = b.select(b.icmp_signed("<", rest, llvm.Constant(I32, 0)), b.add(rest, size), rest)
    return b.select(b.icmp_signed(">=", rest, size), b.sub(rest, size), rest)


def border(b: Any, rule: str, coordinate: Any, size: Any) -> Any:
    """Map a coordinate into range; without vectors a plain builder works too."""
    inputs = {"i": coordinate, "size": size}
    return computed(border_program(rule), inputs, lambda name, *given: _INDEX[name](b, *given), _int)


def _at_least(b: Any, value: Any, low: Any) -> Any:
    return b.select(b.icmp_signed("<", value, low), low, value)


def _at_most(b: Any, value: Any, high: Any) -> Any:
    return b.select(b.icmp_signed(">", value, high), high, value)


#: Operations on addresses, for scalars and vectors.
_INDEX: dict[str, Callable[..., Any]] = {
    "add": lambda b, x, y: b.add(x, y), "sub": lambda b, x, y: b.sub(x, y), "mul": lambda b, x, y: b.mul(x, y),
    "neg": lambda b, x: b.sub(_int(0), x), "min": _at_most, "max": _at_least, "int_mod": floor_modulo,
    "not_equal": lambda b, x, y: b.icmp_signed("!=", x, y), "less": lambda b, x, y: b.icmp_signed("<", x, y),
    "greater_equal": lambda b, x, y: b.icmp_signed(">=", x, y),
}  # fmt: skip
_ROWS = {"float": _FLOAT, "int": _INT, "bool": _BOOL, s.INDEX: _INDEX}


def emit_operation(builder: Any, name: str, on: str, arguments: list[Any]) -> Any:
    """Return the value of a primitive operation."""
    return _ROWS[on][name](builder, *arguments)
