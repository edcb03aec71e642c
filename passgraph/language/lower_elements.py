"""Elements of vectors, matrices and arrays on their way into the scalar program: where they lie, and which is meant.

A parameter lies in a block of parameters, a constant table and a long array in memory of their own: they are read by
address.  All else exists as values, among which a computed index chooses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeGuard, cast

from passgraph.language import ir, lower_buffers
from passgraph.language import scalar as s
from passgraph.language.buffers import is_buffer, layout_of
from passgraph.language.limits import bounds
from passgraph.language.scope import host_numbers
from passgraph.language.source import fail
from passgraph.language.types import UINT, Array, component_count, element_of, held_as

if TYPE_CHECKING:
    from passgraph.language.lower import Lowering


class Elements:
    """Those that one kernel reads and replaces."""

    def __init__(self, lowering: Lowering) -> None:
        self.lowering, self.emitter = lowering, lowering.emitter
        self.limits = {parameter.name: parameter.range for parameter in lowering.program.parameters}

    def parameter(self, expression: ir.Uniform, which: range | None = None) -> list[s.Operand]:
        """Those components of a parameter, or all: nothing is loaded for the others."""
        which = range(component_count(expression.type)) if which is None else which
        if expression.name in self.lowering.arguments:
            return [self.lowering.arguments[expression.name][i] for i in which]
        element = element_of(expression.type).name
        if expression.const:
            value = self._constant(expression)
            return [s.known(expression.type, value[i]) for i in which]
        slot = self._slot(expression)
        return [self._slot_entry(slot, s.Lit("int", slot.offset + i), element) for i in which]

    def _slot(self, uniform: ir.Uniform) -> s.UniformSlot:
        name = self.lowering.prefix + uniform.name
        return self.lowering.shared.slot(name, uniform.type, self.limits.get(uniform.name))

    def _slot_entry(self, slot: s.UniformSlot, index: s.Operand, element: str) -> s.Operand:
        value = self.emitter.uniform(slot.block, index)
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
        """The element at an index, which is clamped into range."""
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
                return [s.known(base_type, v) for v in numbers]
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
        """Whether an array lies in memory; others exist as values only."""
        if isinstance(array, ir.Uniform) and isinstance(array.type, Array):
            return array.name not in self.lowering.arguments
        return isinstance(array, ir.Table)

    def _indexed_load(self, array: ir.Uniform | ir.Table, index: s.Operand, width: int) -> list[s.Operand]:
        """A uniform array or constant table is read by address instead of chosen from."""
        e, type_ = self.emitter, array.type
        low, high = s.Lit("int", 0), s.Lit("int", component_count(type_) // width - 1)
        clamped = e.op("min", e.op("max", index, low), high)
        base = e.op("mul", clamped, s.Lit("int", width))
        element = element_of(type_).name
        if isinstance(array, ir.Table):
            held, values = held_as(type_), self._held_values(array)
            name = e.table_name(held, values)
            addresses = (e.op("add", base, s.Lit("int", i)) for i in range(width))
            return [e.table(name, held, values, address) for address in addresses]
        slot = self._slot(array)
        return [self._slot_entry(slot, e.op("add", base, s.Lit("int", slot.offset + i)), element) for i in range(width)]

    def _buffer_entry(self, array: ir.Uniform, index: s.Operand) -> list[s.Operand]:
        """An entry of a long array; which one is meant may be known."""
        name, type_ = self.lowering.prefix + array.name, cast(Array, array.type)
        self.lowering.shared.buffers[name] = type_
        self.lowering.shared.uses.setdefault(name, s.ImageUse(name, layout_of(type_).channels))
        return lower_buffers.entry(self.emitter, array, name, index)

    def _held_values(self, table: ir.Table) -> tuple[ir.Number, ...]:
        """The values of a constant table as programs hold them; the same tuple at each use."""
        if element_of(table.type) is not UINT:
            return table.values
        held = self.emitter.held_tables
        if id(table.values) not in held:
            held[id(table.values)] = tuple(s.known(table.type, v).value for v in table.values)
        return held[id(table.values)]

    def insert(self, expression: ir.Insert) -> list[s.Operand]:
        """A value with one element replaced."""
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
