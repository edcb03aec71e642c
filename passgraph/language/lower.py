"""Lower the typed representation to the scalar program."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, TypeAlias, TypeGuard, cast

import numpy as np

from passgraph.cached import cached_property
from passgraph.errors import KernelError, KernelLengthError
from passgraph.formats import Store
from passgraph.language import ir, lower_arrays
from passgraph.language import scalar as s
from passgraph.language.builtin_name import BuiltinName, size_names
from passgraph.language.emitter import Emitter, eliminate_dead
from passgraph.language.evaluate import computed
from passgraph.language.expand import EXPANSIONS, Steps, whole_power
from passgraph.language.facts import Facts, Fused, ImageFacts, Shared, inner_first
from passgraph.language.library import prelude_function
from passgraph.language.long_arrays import is_buffer, layout_of
from passgraph.language.lower_arrays import Arrays
from passgraph.language.lower_loops import Loops, leaves, most_work, names_assigned
from passgraph.language.operations import OPERATIONS
from passgraph.language.parameter_limits import bounds
from passgraph.language.parameter_name import ParameterName, image_of
from passgraph.language.parse import parse_kernel
from passgraph.language.scope import host_numbers
from passgraph.language.source import NOWHERE, Span, fail
from passgraph.language.types import UINT, Array, Scalar, Type, component_count, element_of, held_as, parts_by_path


class Elements:
    """The array elements that one kernel reads and replaces."""

    def __init__(self, lowering: Lowering) -> None:
        self.lowering, self.emitter = lowering, lowering.emitter
        self.limits = {parameter.name: parameter.range for parameter in lowering.program.parameters}

    def parameter(self, expression: ir.Uniform, which: range | None = None) -> list[s.Operand]:
        """Load components of a parameter, or all; others are not loaded."""
        which = range(component_count(expression.type)) if which is None else which
        if expression.name in self.lowering.arguments:
            return [self.lowering.arguments[expression.name][i] for i in which]
        element = element_of(expression.type).name
        if expression.const:
            value = self._constant(expression)
            return [s.literal(expression.type, value[i]) for i in which]
        slot = self._slot(expression)
        return [self._slot_entry(slot, s.Lit("int", slot.offset + i), element) for i in which]

    def _slot(self, uniform: ir.Uniform) -> s.UniformSlot:
        return self.lowering.shared.slot(self._declared_name(uniform), uniform.type, self.limits.get(uniform.name))

    @cached_property
    def _declared(self) -> dict[str, tuple[ParameterName, Type]]:
        """Return the name and type of each plain part of the parameters, by its dotted name."""
        return {
            ".".join((parameter.name, *path)): (ParameterName(parameter.name, path, self.lowering.producer), part)
            for parameter in self.lowering.program.parameters
            for path, part in parts_by_path(parameter.type)
        }

    def _declared_name(self, uniform: ir.Uniform) -> ParameterName:
        """Return the name of a parameter; KernelError if it is read as another type than hosts pack."""
        name, declared = self._declared.get(uniform.name, (None, None))
        if name is None or declared != uniform.type:
            fail(
                uniform.span,
                f"parameter {uniform.name} is declared as {declared} and read as {uniform.type}; "
                "this is a fault of passgraph: please report it with the text of the kernel",
            )
        return name

    def _slot_entry(self, slot: s.UniformSlot, index: s.Operand, element: str) -> s.Operand:
        value = self.emitter.uniform(slot, index)
        if slot.range is not None and isinstance(value, s.Val) and element in ("int", "float"):
            self.emitter.ranges[value.id] = bounds(slot.range, cast(Array, slot.type))
        return self.emitter.op("not_equal", value, s.Lit("int", 0)) if element == "bool" else value

    def _constant(self, expression: ir.Uniform) -> list[ir.Number]:
        program, constants = self.lowering.program, self.lowering.facts.constants
        parameter = next(p for p in program.parameters if p.name == expression.name)
        if expression.name not in constants and not parameter.has_default:
            fail(parameter.span, f"Const parameter {expression.name!r} of {program.name} has no value")
        value = constants.get(expression.name, parameter.default)
        return host_numbers(value, expression.type, f"{program.name}({expression.name})", parameter.span)

    def index(self, expression: ir.Index) -> list[s.Operand]:
        """Return the element at an index, which is clamped into range."""
        index = self.lowering.value(expression.index)[0]
        width = component_count(expression.type)
        base_type = expression.value.type
        if isinstance(expression.value, ir.Local) and expression.value.name in self.lowering.arrays:
            return self.lowering.arrays.entry(expression.value.name, index)
        if isinstance(expression.value, ir.Uniform) and is_buffer(base_type):
            return self._buffer_entry(expression.value, index)
        if isinstance(index, s.Lit):
            i = min(max(int(index.value), 0), component_count(base_type) // width - 1)
            if isinstance(expression.value, ir.Table):
                numbers = expression.value.values[i * width : (i + 1) * width]
                return [s.literal(base_type, v) for v in numbers]
            if isinstance(expression.value, ir.Uniform):
                return self.parameter(expression.value, range(i * width, (i + 1) * width))
            return self.lowering.value(expression.value)[i * width : (i + 1) * width]
        if self._is_addressable(expression.value):
            return self._indexed_load(expression.value, index, width)
        parts = self.lowering.value(expression.value)
        count = len(parts) // width
        result = parts[:width]
        for i in range(1, count):
            here = self.emitter.op("greater_equal", index, s.Lit("int", i))
            entry = parts[i * width : (i + 1) * width]
            result = [self.emitter.choose(here, a, b) for a, b in zip(entry, result, strict=True)]
        return result

    def _is_addressable(self, array: ir.Expr) -> TypeGuard[ir.Uniform | ir.Table]:
        """Return True if an array is in memory; others exist as values only."""
        if isinstance(array, ir.Uniform) and isinstance(array.type, Array):
            return array.name not in self.lowering.arguments
        return isinstance(array, ir.Table)

    def _indexed_load(self, array: ir.Uniform | ir.Table, index: s.Operand, width: int) -> list[s.Operand]:
        """Read a uniform array or constant table by address instead of by selection."""
        e, type_ = self.emitter, array.type
        low, high = s.Lit("int", 0), s.Lit("int", component_count(type_) // width - 1)
        clamped = e.op("min", e.op("max", index, low), high)
        base = e.op("mul", clamped, s.Lit("int", width))
        element = element_of(type_).name
        if isinstance(array, ir.Table):
            stored_type, values = held_as(type_), self._held_values(array)
            name = e.table_name(stored_type, values)
            addresses = (e.op("add", base, s.Lit("int", i)) for i in range(width))
            return [e.table(name, stored_type, values, address) for address in addresses]
        slot = self._slot(array)
        return [self._slot_entry(slot, e.op("add", base, s.Lit("int", slot.offset + i)), element) for i in range(width)]

    def _buffer_entry(self, array: ir.Uniform, index: s.Operand) -> list[s.Operand]:
        """Return an entry of a long array; its index may be known."""
        parameter, type_ = self._declared_name(array), cast(Array, array.type)
        name = str(parameter)
        self.lowering.shared.buffers[name] = parameter, type_
        self.lowering.shared.uses.setdefault(name, s.ImageUse(name, layout_of(type_).channels))
        return lower_arrays.entry(self.emitter, array, name, index)

    def _held_values(self, table: ir.Table) -> tuple[ir.Number, ...]:
        """Return the values of a constant table as programs store them; the same tuple at each use."""
        if element_of(table.type) is not UINT:
            return table.values
        tables = self.emitter.held_tables
        if id(table.values) not in tables:
            tables[id(table.values)] = tuple(s.literal(table.type, v).value for v in table.values)
        return tables[id(table.values)]

    def insert(self, expression: ir.Insert) -> list[s.Operand]:
        """Return a value with one element replaced."""
        parts = list(self.lowering.value(expression.value))
        index = self.lowering.value(expression.index)[0]
        element = self.lowering.value(expression.element)
        width = len(element)
        for i in range(len(parts) // width):
            if isinstance(index, s.Lit):
                if i == index.value:
                    parts[i * width : (i + 1) * width] = element
                continue
            here = self.emitter.op("equal", index, s.Lit("int", i))
            for k in range(width):
                parts[i * width + k] = self.emitter.choose(here, element[k], parts[i * width + k])
        return parts


#: Most instructions of a program; drivers' compilers take a minute for twice as many, and gigabytes.
MAX_INSTRUCTIONS = 20_000
#: Most numbers of all constant tables with computed indices; each has at most 1,024 entries.
MAX_TABLE_NUMBERS = 16_384


def lower(program: ir.TypedKernel, facts: Facts | None = None) -> s.ScalarProgram:
    """Return the scalar program of a kernel under given facts.

    Raises
    ------
    KernelError
        If a loop bound is unknown, a texel offset is unbounded, or a loop is too long.
    """
    facts = facts or Facts()
    try:
        return _lower(program, facts)
    except RecursionError:
        message = f"{program.name} nests too deeply (calls, branches and expressions together)"
        raise KernelError(program.source.point_at(message)) from None


def _lower(program: ir.TypedKernel, facts: Facts) -> s.ScalarProgram:
    try:
        return _lowered(program, facts)
    except KernelLengthError:
        if not any(image.decode for each in inner_first(facts) for image in each.images.values()):
            raise
    return _lowered(program, facts, by_table=True)


def _lowered(program: ir.TypedKernel, facts: Facts, by_table: bool = False) -> s.ScalarProgram:
    shared = Shared(Emitter(facts.simplify), by_table)
    lowering = Lowering(program, facts, shared)
    lowering.run()
    emitter = shared.emitter
    outputs = tuple(lowering.outputs())
    keep = lowering.value(program.keep)[0] if program.keep is not None else None
    if isinstance(keep, s.Lit) and keep.value:
        keep = None
    roots = [v for o in outputs for v in (*o.values, *o.unrounded)] + ([keep] if keep is not None else [])
    body = eliminate_dead(emitter.blocks[0], roots)
    program_text = shared.finish(program, body, outputs, keep)
    if not shared.fused:  # programs that pass on their own also pass fused
        _check_size(program_text, program.source, most_work(program, facts))
    return program_text


def _check_size(program: s.ScalarProgram, span: Span, most: int) -> None:
    """Raise an error for programs that take a driver too long to compile or run."""
    length, steps = s.count(program.body), s.work(program.body)
    numbers = sum(len(values) for _, _, values in program.tables)
    if length > MAX_INSTRUCTIONS:
        message = f"{program.name} has {length} instructions, loops unrolled; at most {MAX_INSTRUCTIONS}"
        raise KernelLengthError(span.point_at(message))
    if steps > most:
        fail(span, f"{program.name} takes {steps} instructions a pixel, loops run; at most {most}")
    if numbers > MAX_TABLE_NUMBERS:
        fail(span, f"the constant tables of {program.name} hold {numbers} numbers; at most {MAX_TABLE_NUMBERS}")


#: The instructions of a branch, and its variables after it.
Branch: TypeAlias = tuple[list[s.Instruction], dict[str, list[s.Operand]]]


class Lowering:
    """Lowers one kernel (or one fused producer, or one prelude function) into the emitter."""

    def __init__(
        self,
        program: ir.TypedKernel,
        facts: Facts,
        shared: Shared,
        producer: int | None = None,
        arguments: dict[str, list[s.Operand]] | None = None,
    ) -> None:
        self.program, self.facts, self.shared, self.producer = program, facts, shared, producer
        self.emitter = shared.emitter
        self.arguments = arguments or {}
        self.locals: dict[str, list[s.Operand]] = {}
        self.arrays = Arrays(shared.emitter, program)
        self.loops, self.elements = Loops(self), Elements(self)

    def run(self) -> None:
        # Producers come first: values computed inside a branch or loop would not exist after it.  They are kept in an
        # explicit stack, as a chain may exceed Python's recursion limit.
        pending = self._producers()
        while pending:
            producers = Lowering(pending[-1].program, pending[-1].facts, self.shared, pending[-1].producer)._producers()
            if producers:
                pending += producers
            else:
                self._produce(pending.pop())
        if not self.arguments:
            self.emitter.begin_kernel(self.facts.contracts)
        self.block(self.program.body)

    def _producers(self) -> list[Fused]:
        """Return the fused kernels that have not been computed yet, the last one first."""
        fused = [self._facts(image).fused for image in self.program.images]
        missing = {f.producer: f for f in fused if f is not None and f.producer not in self.shared.fused}
        return list(missing.values())[::-1]

    def _facts(self, image: str) -> ImageFacts:
        return self.facts.images.get(image, ImageFacts())

    def _produce(self, fused: Fused) -> None:
        if fused.producer in self.shared.fused:  # done for another reader, since it was put on the stack
            return
        producer = Lowering(fused.program, fused.facts, self.shared, fused.producer)
        self.emitter.begin_kernel(fused.facts.contracts)
        producer.block(producer.program.body)
        self.shared.fused[fused.producer] = [list(o.values) for o in producer.outputs()]
        self.shared.sources.append(fused.program.source)

    def outputs(self) -> list[s.Output]:
        outputs = []
        for i, result in enumerate(self.program.results):
            pairs = [(value, value) for value in self.value(result.value)]
            if i < len(self.facts.stores):
                colour, alpha = self.facts.stores[i]
                pairs = [self._stored(value, alpha if c == 3 else colour) for c, (value, _) in enumerate(pairs)]
            values, unrounded = zip(*pairs, strict=True)
            outputs.append(s.Output(result.name, values, unrounded))
        return outputs

    def _stored(self, value: s.Operand, functions: tuple[Store, ...]) -> tuple[s.Operand, s.Operand]:
        """Return a channel as stored, and before the last function, which rounds."""
        unrounded = value
        for function, *numbers in functions:
            unrounded = value
            value = self.prelude(str(function), [value, *(s.Lit("float", float(number)) for number in numbers)])
        return value, unrounded

    # Statements

    def block(self, statements: tuple[ir.Stmt, ...]) -> None:
        """Lower statements up to the first after which nothing can run."""
        for statement in statements:
            if statement.span is not NOWHERE and not self.arguments:
                self.emitter.span = statement.span
            if isinstance(statement, ir.Assign):
                self._assign(statement)
            elif isinstance(statement, ir.If):
                self._if(statement)
            elif isinstance(statement, ir.For):
                self.loops.lower(statement)
            else:
                self._jump(statement)
            if leaves(self.emitter.blocks[-1]):
                return

    def _assign(self, statement: ir.Assign) -> None:
        name, value, arrays = statement.name, statement.value, self.arrays
        if name not in arrays:
            self.locals[name] = self.value(value)
        elif isinstance(value, ir.Insert) and isinstance(value.value, ir.Local) and value.value.name == name:
            index = self.value(value.index)[0]
            arrays.store(name, index, self.value(value.element))
        elif isinstance(value, ir.Local) and value.name in arrays:
            arrays.copy(name, value.name, statement.span)
        else:
            arrays.fill(name, self.value(value), statement.span)

    def _jump(self, statement: ir.Break | ir.Continue) -> None:
        """Lower break or continue: variables carried by the loop are written first."""
        for (name, i), variable in self.loops.around[-1].items():
            self.emitter.push(s.Write(variable, self.locals[name][i]))
        self.emitter.push(s.Break() if isinstance(statement, ir.Break) else s.Continue())

    def _branch(self, statements: tuple[ir.Stmt, ...]) -> Branch:
        before = dict(self.locals)
        self.emitter.begin()
        self.block(statements)
        after, self.locals = self.locals, before
        return self.emitter.end(), after

    def _if(self, statement: ir.If) -> None:
        e = self.emitter
        condition = self.value(statement.condition)[0]
        if isinstance(condition, s.Lit) and e.simplify:
            self.block(statement.then if condition.value else statement.orelse)
            return
        then, after_then = self._branch(statement.then)
        orelse, after_else = self._branch(statement.orelse)
        assigned = names_assigned((*statement.then, *statement.orelse))
        # Code behind a jump in both branches assigned nothing.
        reached = after_then.keys() | after_else.keys()
        names = [name for name in assigned if name in reached and name not in self.arrays]
        if e.simplify and e.selectable(then) and e.selectable(orelse):
            for instruction in (*then, *orelse):
                e.push(instruction)
            for name in names:
                a, b = _merged_local(name, after_then, after_else)
                self.locals[name] = [e.choose(condition, x, y) for x, y in zip(a, b, strict=True)]
            return
        self._push_if(condition, (then, after_then), (orelse, after_else), names)

    def _push_if(self, condition: s.Operand, one: Branch, other: Branch, names: list[str]) -> None:
        """Emit an ``if`` that stays, and set the variables after it."""
        e, (then, after_then), (orelse, after_else) = self.emitter, one, other
        left_then, left_else = leaves(then), leaves(orelse)
        merged: dict[str, list[s.Operand]] = {}
        reads: list[tuple[str, int, str]] = []
        for name in names:
            a, b = _merged_local(name, after_then, after_else)
            if left_then or left_else:
                # The branch that left the loop carries no values; the other's values are in its block.
                a, b = (b, b) if left_then else (a, a)
            merged[name] = list(a)
            outside = {repr(v) for v in self.locals.get(name, [])}
            for i, (x, y) in enumerate(zip(a, b, strict=True)):
                if repr(x) == repr(y) and (isinstance(x, s.Lit) or repr(x) in outside):
                    continue
                variable = e.variable(x.type)
                if not left_then:
                    then.append(s.Write(variable, x))
                if not left_else:
                    orelse.append(s.Write(variable, y))
                reads.append((name, i, variable))
        e.push(s.If(condition, tuple(then), tuple(orelse)))
        for name, i, variable in reads:
            merged[name][i] = e.read(variable)
        self.locals.update(merged)

    # Expressions

    def value(self, expression: ir.Expr) -> list[s.Operand]:
        """Return the components of an expression."""
        self.emitter.step()
        return _VALUES[type(expression)](self, expression)

    def _literal(self, expression: ir.Literal) -> list[s.Operand]:
        return [s.literal(expression.type, expression.value)]

    def _local(self, expression: ir.Local) -> list[s.Operand]:
        name = expression.name
        return self.arrays.values(name) if name in self.arrays else self.locals[name]

    def _table(self, expression: ir.Table) -> list[s.Operand]:
        return [s.literal(expression.type, v) for v in expression.values]

    def _select(self, expression: ir.Select) -> list[s.Operand]:
        condition = self.value(expression.condition)[0]
        then, orelse = self.value(expression.then), self.value(expression.orelse)
        return [self.emitter.choose(condition, a, b) for a, b in zip(then, orelse, strict=True)]

    def _swizzle(self, expression: ir.Swizzle) -> list[s.Operand]:
        parts = self.value(expression.value)
        return [parts[i] for i in expression.components]

    def _construct(self, expression: ir.Construct) -> list[s.Operand]:
        return [part for argument in expression.arguments for part in self.value(argument)]

    def _size(self, expression: ir.Size) -> list[s.Operand]:
        known_size = self._facts(expression.image).size
        if known_size is not None:
            return [s.Lit("int", count) for count in known_size]
        self._use(expression.image)
        return [self.emitter.builtin(name, "int") for name in size_names(image_of(self.producer, expression.image))]

    def _property(self, expression: ir.Property) -> list[s.Operand]:
        value = self._facts(expression.image).property(expression.name)
        return [s.Lit("bool" if isinstance(value, bool) else "int", value)]

    def _builtin(self, expression: ir.Builtin) -> list[s.Operand]:
        type_ = expression.type
        if expression.name == "output_size" and self.facts.size is not None:
            return [s.Lit("int", count) for count in self.facts.size]
        if isinstance(type_, Scalar):
            return [self.emitter.builtin(expression.key, type_.name)]
        names = [expression.key.part(i) for i in range(component_count(type_))]
        values = [self.emitter.builtin(name, element_of(type_).name) for name in names]
        if expression.name == "pixel" and self.facts.size is not None:
            for value, count in zip(values, self.facts.size, strict=True):
                assert isinstance(value, s.Val)
                self.emitter.places[value.id] = (0, count - 1)
        return values

    def _apply(self, expression: ir.Apply) -> list[s.Operand]:
        row = OPERATIONS[expression.operation]
        arguments = [self.value(a) for a in expression.arguments]
        if row.kind == "expanded":
            return EXPANSIONS[row.name](self.emitter, arguments, [a.type for a in expression.arguments])
        size = max(len(a) for a in arguments)
        spread = [a * size if len(a) == 1 else a for a in arguments]
        results = []
        for parts in zip(*spread, strict=True):
            if row.kind == "prelude":
                results.append(self._function(row.name, list(parts), expression.span))
            else:
                results.append(self.emitter.op(row.name, *parts, span=expression.span))
        return results

    def _function(self, name: str, arguments: list[s.Operand], span: Span) -> s.Operand:
        """Call the device's own function if the pass uses it, else inline the prelude's."""
        is_native = name in self.facts.native and arguments[0].type == "float"
        if not is_native or all(isinstance(a, s.Lit) for a in arguments):
            return self.prelude(name, arguments)
        power = whole_power(self.emitter, *arguments) if name == "pow" else None
        return power if power is not None else self.emitter.op(name, *arguments, span=span)

    def prelude(self, name: str, arguments: list[s.Operand]) -> s.Operand:
        """Inline a scalar function of the prelude."""
        if arguments[0].type == "int" and name in _OF_NUMBERS:
            name += "_int"
        if name == "pow":
            power = whole_power(self.emitter, *arguments)
            if power is not None:
                return power
        e = self.emitter
        steps = _prelude_steps(name) if e.simplify and not isinstance(arguments[0], s.Lit) else None
        if steps is not None:
            return steps.repeated(e, arguments)
        return _inlined(_prelude_program(name), arguments, self.shared, self.facts.simplify)

    # Images

    def _use(self, image: str) -> None:
        """Record that an image is read; its footprint is computed after dead code elimination."""
        name = image_of(self.producer, image)
        self.shared.uses.setdefault(name, s.ImageUse(name, self._facts(image).channels))

    def _texel(self, expression: ir.Texel) -> list[s.Operand]:
        facts = self._facts(expression.image)
        if facts.fused is not None:
            return self._fused(facts.fused, facts.decode)
        x, y = self.value(expression.x)[0], self.value(expression.y)[0]
        if expression.relative:
            ranges = self.emitter.range_of(x), self.emitter.range_of(y)
            if ranges[0] is None or ranges[1] is None:
                fail(
                    expression.span,
                    "a texel offset must be a constant or bounded by a loop, so that the footprint is known; "
                    "for offsets computed from data use image.texel(pixel() + offset)",
                )
        self._use(expression.image)
        name = image_of(self.producer, expression.image)
        texel = self.emitter.texel(name, x, y, expression.relative, facts.border, facts.channels, expression.span)
        if facts.decode is not None:
            texel = [self._decoded(facts.decode, c) if i < min(3, facts.channels) else c for i, c in enumerate(texel)]
        return texel

    def _decoded(self, function: str, value: s.Operand) -> s.Operand:
        """Return a decoded channel, which has 8 bits wherever texels are decoded."""
        if not self.shared.by_table:
            return self.prelude(function, [value])
        e, entries = self.emitter, _decoded_steps(function)
        step = e.op("to_int", e.op("add", e.op("mul", value, s.Lit("float", 255.0)), s.Lit("float", 0.5)))
        inside = e.op("min", e.op("max", step, s.Lit("int", 0)), s.Lit("int", 255))
        return e.table(e.table_name("float", entries), "float", entries, inside)

    def _filtered(self, expression: ir.Filtered) -> list[s.Operand]:
        facts, name = self._facts(expression.image), image_of(self.producer, expression.image)
        if not facts.by_device or facts.fused is not None:
            return self.value(expression.value)
        self._use(expression.image)
        x, y = self.value(expression.x)[0], self.value(expression.y)[0]
        return self.emitter.texel(name, x, y, False, facts.border, facts.channels, expression.span, filtered=True)

    def _fused(self, fused: Fused, decode: str | None) -> list[s.Operand]:
        """Return the producer's results for this pixel, quantized by its format, padded to four."""
        values = self.shared.fused[fused.producer][fused.output]
        if decode is not None:
            values = [self._decoded(decode, c) if i < 3 else c for i, c in enumerate(values)]
        missing = [s.Lit("float", v) for v in (0.0, 0.0, 0.0, 1.0)]
        return [*values, *missing[len(values) :]]


#: Methods that lower each kind of expression.
_VALUES: dict[type[ir.Expr], Callable[[Lowering, Any], list[s.Operand]]] = {
    ir.Literal: Lowering._literal, ir.Local: Lowering._local, ir.Table: Lowering._table,
    ir.Uniform: lambda here, uniform: here.elements.parameter(uniform), ir.Builtin: Lowering._builtin,
    ir.Apply: Lowering._apply, ir.Select: Lowering._select, ir.Swizzle: Lowering._swizzle,
    ir.Construct: Lowering._construct, ir.Index: lambda here, index: here.elements.index(index),
    ir.Insert: lambda here, insert: here.elements.insert(insert), ir.Texel: Lowering._texel, ir.Size: Lowering._size,
    ir.Property: Lowering._property, ir.Filtered: Lowering._filtered,
}  # fmt: skip


#: Prelude functions that have a variant for ints.
_OF_NUMBERS = frozenset(row.name for row in OPERATIONS.values() if row.kind == "prelude" and "N" in row.operands)


@cache
def _prelude_program(name: str) -> ir.TypedKernel:
    return parse_kernel(prelude_function(name), "function")


@cache
def _decoded_steps(function: str) -> tuple[float, ...]:
    """Return the results of a prelude function for the 256 steps of a channel, bit for bit."""
    shared = Shared(Emitter())
    result = _inlined(_prelude_program(function), [shared.emitter.builtin(BuiltinName("step"), "float")], shared)
    steps = np.arange(256, dtype=np.float32) / np.float32(255)
    return tuple(computed(shared.emitter.blocks[0], {"step": steps}, result).tolist())


def _inlined(
    program: ir.TypedKernel, arguments: Sequence[s.Operand], shared: Shared, simplify: bool = True
) -> s.Operand:
    """Return the result of a prelude function."""
    bound = {p.name: [a] for p, a in zip(program.parameters, arguments, strict=True)}
    inner = Lowering(program, Facts(simplify=simplify), shared, arguments=bound)
    inner.run()
    return inner.value(program.results[0].value)[0]


@cache
def _prelude_steps(name: str) -> Steps | None:
    """Return the steps of a prelude function; None if it branches, loops or reads memory."""
    program, shared = _prelude_program(name), Shared(Emitter())
    result = _inlined(program, [shared.emitter.fresh(held_as(p.type)) for p in program.parameters], shared)
    body = tuple(i for i in shared.emitter.blocks[0] if isinstance(i, (s.Op, s.Choose)))
    straight = all(isinstance(statement, ir.Assign) for statement in program.body)
    return Steps(body, result) if straight and len(body) == len(shared.emitter.blocks[0]) else None


def _merged_local(
    name: str, then: dict[str, list[s.Operand]], orelse: dict[str, list[s.Operand]]
) -> tuple[list[s.Operand], list[s.Operand]]:
    """Return a local after both branches; if only one assigns it, the other returned, and zeros replace it."""
    a, b = then.get(name), orelse.get(name)
    some = a if a is not None else b
    zeros: list[s.Operand] = [s.Lit(v.type, {"float": 0.0, "int": 0, "bool": False}[v.type]) for v in some or []]
    return (zeros if a is None else a), (zeros if b is None else b)


__all__ = ["Facts", "Fused", "ImageFacts", "lower"]
