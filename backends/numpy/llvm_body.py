"""A scalar program as one numba intrinsic: its body is built in LLVM directly.

numba compiles the loops around it.  Handing it the body as Python text would work too, but type inference and SSA over
a thousand lines take ten times as long as all of LLVM's optimisations.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from passgraph.backends.numpy.lanes import border
from passgraph.backends.numpy.llvm_names import PLANE_ARGUMENTS, VARYINGS, argument_names, is_varying
from passgraph.backends.numpy.llvm_ops import F32, F64, HELD, I32, I64, TYPES
from passgraph.backends.numpy.program_body import ProgramBody, counter, index_of
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS


def body_intrinsic(program: s.ScalarProgram, apart: bool = False, varyings: tuple[str, ...] = ()) -> Any:
    """A function of one tuple for generated code to call; see :func:`argument_names` for what it holds.

    Returns a tuple of float32: every output's components one after another, then 1 or 0 for ``keep`` if there is one.
    ``apart``: a function of its own, not inlined: where the loop does not vectorise anyway, LLVM takes a fraction of
    the time.  ``varyings``: in the order of the planes that they are interpolated from.
    """
    count = sum(len(output.values) for output in program.outputs) + (program.keep is not None)
    result = types.UniTuple(types.float32, count)

    @intrinsic
    def body(typing_context: Any, values: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            kind = signature.args[0]
            _prefer_loads(context, builder.function)
            if apart:
                results = _call_apart(program, context, builder, kind, arguments[0], varyings)
            else:
                results = Body(program, context, builder, kind, arguments[0], varyings).results()
            return context.make_tuple(builder, result, results)

        return result(values), generate

    return body


def _prefer_loads(context: Any, function: Any) -> None:
    """Vectors are filled by single loads, not by gather instructions: those are slower on AMD's cores (Zen 5: three
    times in a 3x3 neighbourhood) and no faster on others.  A property of the function, so that numba's other users
    keep theirs; llvmlite writes attributes that it does not know as they are, but has no way to ask for one.
    """
    triple, _, features = context.codegen().magic_tuple()
    if triple.startswith("x86_64"):
        set.add(function.attributes, f'"target-features"="{features},+prefer-no-gather"')


def _call_apart(
    program: s.ScalarProgram, context: Any, builder: Any, kind: Any, values: Any, varyings: tuple[str, ...]
) -> list[Any]:
    """Call the body as a function beside the caller; results come back as one LLVM struct."""
    count = sum(len(output.values) for output in program.outputs) + (program.keep is not None)
    made = ir.LiteralStructType([F32] * count)
    function = ir.Function(builder.module, ir.FunctionType(made, [values.type]), f"body_{program.key[:16]}")
    function.linkage = "internal"
    function.attributes.add("noinline")
    inner = ir.IRBuilder(function.append_basic_block("entry"))
    results = Body(program, context, inner, kind, function.args[0], varyings).results()
    packed = ir.Constant(made, ir.Undefined)
    for place, value in enumerate(results):
        packed = inner.insert_value(packed, value, place)
    inner.ret(packed)
    returned = builder.call(function, [values])
    return [builder.extract_value(returned, place) for place in range(count)]


class Body(ProgramBody):
    """One fragment at a time, in a loop that numba compiles."""

    def __init__(
        self,
        program: s.ScalarProgram,
        context: Any,
        builder: Any,
        tuple_type: Any,
        tuple_value: Any,
        varyings: tuple[str, ...],
    ) -> None:
        self.program, self.context, self.builder, self.varyings = program, context, builder, varyings
        builtins = [name for name, _ in program.builtins if not is_varying(name)]
        names = argument_names(program, builtins) + (PLANE_ARGUMENTS if varyings else [])
        self.given = {name: builder.extract_value(tuple_value, i) for i, name in enumerate(names)}
        self.kinds = {name: tuple_type.types[i] for i, name in enumerate(names)}
        self.numbers = {use.name: i for i, use in enumerate(program.images)}
        self.values: dict[int, Any] = {}
        self.slots = {name: cgutils.alloca_once(builder, TYPES[kind]) for name, kind in program.variables}
        self.arrays = {
            name: cgutils.alloca_once(builder, ir.ArrayType(HELD[kind], length))
            for name, kind, length in program.arrays
        }
        self.tables: dict[str, Any] = {}
        self.loops: list[tuple[Any, Any]] = []  # (next trip, behind the loop)

    def results(self) -> list[Any]:
        """Emit everything; the outputs' components, then ``keep`` as 1 or 0."""
        self.block(self.program.body)
        values = [self.operand(value) for output in self.program.outputs for value in output.values]
        if self.program.keep is not None:
            values.append(self.builder.uitofp(self.operand(self.program.keep), F32))
        return values

    def emit(self, i: s.Instruction) -> None:
        b = self.builder
        if isinstance(i, s.LoadTable):
            self.values[i.to.id] = self._table(i)
        elif isinstance(i, s.LoadBuiltin):
            self.values[i.to.id] = self._varying(i.name) if is_varying(i.name) else self.given[i.name]
        elif isinstance(i, s.LoadTexel):
            self._texel(i)
        elif isinstance(i, s.Read):
            self.values[i.to.id] = b.load(self.slots[i.variable], typ=TYPES[i.to.type])
        elif isinstance(i, s.Write):
            b.store(self.operand(i.value), self.slots[i.variable])
        elif isinstance(i, s.ReadAt):
            loaded = b.load(self._array_place(i.array, i.index, i.to.type), typ=HELD[i.to.type])
            self.values[i.to.id] = b.trunc(loaded, TYPES["bool"]) if i.to.type == "bool" else loaded
        elif isinstance(i, s.WriteAt):
            value = self.operand(i.value)
            held = b.zext(value, HELD["bool"]) if i.value.type == "bool" else value
            b.store(held, self._array_place(i.array, i.index, i.value.type))
        elif isinstance(i, s.If):
            self._if(i)
        elif isinstance(i, s.For):
            self._for(i)
        elif isinstance(i, (s.Break, s.Continue)):
            b.branch(self.loops[-1][1] if isinstance(i, s.Break) else self.loops[-1][0])
        else:
            super().emit(i)

    def _varying(self, name: str) -> Any:
        """Perspective-correct: the corners, by how near the fragment is to each (rasterisation rule 5)."""
        b = self.builder
        row = VARYINGS + self.varyings.index(name.removeprefix("varying."))
        first, *more = (self.load("planes", ir.Constant(I64, 3 * row + corner), F64) for corner in range(3))
        parts = [b.fmul(part, self.given[near]) for part, near in zip(more, ("near1", "near2"), strict=True)]
        return b.fptrunc(b.fadd(b.fadd(first, parts[0]), parts[1]), F32)

    # Memory

    def _data(self, name: str) -> Any:
        array = self.context.make_array(self.kinds[name])(self.context, self.builder, self.given[name])
        return array.data

    def load(self, name: str, index: Any, kind: Any) -> Any:
        pointer = self.builder.gep(self._data(name), [index], inbounds=True, source_etype=kind)
        return self.builder.load(pointer, typ=kind)

    def _array_place(self, array: str, index: s.Operand, kind: str) -> Any:
        return self.builder.gep(self.arrays[array], [self.operand(index)], True, source_etype=HELD[kind])

    def _table(self, i: s.LoadTable) -> Any:
        if i.table not in self.tables:
            name = f"table_{self.program.key[:12]}_{i.table}"
            self.tables[i.table] = cgutils.global_constant(self.builder, name, self.table_constant(i.table))
        table = self.tables[i.table]
        index = self.builder.sext(self.operand(i.index), I64)
        element = TYPES[i.to.type]
        pointer = self.builder.gep(table, [ir.Constant(I64, 0), index], inbounds=True)
        return self.builder.load(pointer, typ=element)

    def _texel(self, i: s.LoadTexel) -> None:
        number = self.numbers[i.image]
        channels = ir.Constant(I64, self.program.images[number].channels)
        b = self.builder
        x, y = self.operand(i.x), self.operand(i.y)
        # Half as wide, so that twice as many go into a vector of indices.
        width, height = (b.trunc(self.given[f"im{number}_{axis}"], I32) for axis in "wh")
        inner_x, inner_y = border(b, i.border, x, width), border(b, i.border, y, height)
        outside = None
        if BORDERS[i.border].blank:
            outside = b.or_(b.icmp_signed("!=", inner_x, x), b.icmp_signed("!=", inner_y, y))
        at = b.mul(b.sext(b.add(b.mul(inner_y, width), inner_x), I64), channels)
        for channel, value in enumerate(i.to):
            if value is not None:
                loaded = self.load(f"im{number}", b.add(at, ir.Constant(I64, channel)), F32)
                self.values[value.id] = loaded if outside is None else b.select(outside, ir.Constant(F32, 0.0), loaded)

    # Control

    def _if(self, i: s.If) -> None:
        b = self.builder
        then, orelse, behind = (b.append_basic_block(name) for name in ("then", "else", "behind"))
        b.cbranch(self.operand(i.condition), then, orelse)
        for block, instructions in ((then, i.then), (orelse, i.orelse)):
            b.position_at_end(block)
            self.block(instructions)
            if not b.block.is_terminated:
                b.branch(behind)
        b.position_at_end(behind)

    def _for(self, i: s.For) -> None:
        b = self.builder
        slot = cgutils.alloca_once(b, I32)
        start, stop, step = counter(i)
        b.store(ir.Constant(I32, start), slot)
        check, body, following, behind = (b.append_basic_block(name) for name in ("check", "body", "next", "behind"))
        b.branch(check)
        b.position_at_end(check)
        count = b.load(slot, typ=I32)
        sign = "<" if step > 0 else ">"
        b.cbranch(b.icmp_signed(sign, count, ir.Constant(I32, stop)), body, behind)
        b.position_at_end(body)
        self.values[i.index.id] = index_of(b, i, count)
        self.loops.append((following, behind))
        self.block(i.body)
        self.loops.pop()
        if not b.block.is_terminated:
            b.branch(following)
        b.position_at_end(following)
        b.store(b.add(count, ir.Constant(I32, step)), slot)
        b.branch(check)
        b.position_at_end(behind)
