"""Find float operations that compilers combine as if numbers were real and finite, which WGSL allows.

Mesa's compiler, used by lavapipe and Mesa's GPU drivers, turns ``-a + (a + b)`` into ``b``, ``a * b + a * c`` into ``a
* (b + c)``, ``x * (1 - t) + y * t`` into ``x + t * (y - x)``, and ``a * 2.0 * 3.0`` into ``a * 6.0``.  It moves
constants in sums: ``(a + 2.0) + b``, ``(a + b) + 2.0``.  It drops operations that would give NaN: ``a - a``, ``a / a``.
The operations found here are printed so that they stay separate.
"""

from __future__ import annotations

from collections import defaultdict

from passgraph.language import scalar as s

COMPARISONS = {"less", "less_equal", "greater", "greater_equal", "equal", "not_equal"}
_SUMS, _PRODUCTS = {"add", "sub"}, {"mul", "div"}
#: Operations whose results compilers combine with any operation that reads them.
_COMBINED = {*_SUMS, *_PRODUCTS, "neg", "sqrt", "to_float"}


class Combined:
    """The operations of a program that must be kept separate.

    Attributes
    ----------
    results : values of float operations that compilers would combine with the operations that read them
    conditions : comparisons used only to choose between values other than those compared
    """

    def __init__(self, program: s.ScalarProgram) -> None:
        self.producers: dict[int, s.Op] = {}
        self.numbers: dict[int, object] = {}  # equal for values that a compiler recognizes as equal
        self.results: set[int] = set()
        chosen_by: defaultdict[int, list[s.Choose]] = defaultdict(list)
        used_otherwise = {value.id for value in _results(program) if isinstance(value, s.Val)}
        for i in s.walk(program.body):
            self._number(i)
            if isinstance(i, s.Op):
                self._operation(i)
                used_otherwise.update(a.id for a in i.arguments if isinstance(a, s.Val))
            elif isinstance(i, s.Choose):
                if isinstance(i.condition, s.Val):
                    chosen_by[i.condition.id].append(i)
                self._handed_on(i.then, i.orelse)
                used_otherwise.update(a.id for a in (i.then, i.orelse) if isinstance(a, s.Val))
            elif isinstance(i, (s.Write, s.WriteAt)):
                self._handed_on(i.value)
                used_otherwise.update(a.id for a in (i.value,) if isinstance(a, s.Val))
            elif isinstance(i, s.If) and isinstance(i.condition, s.Val):
                used_otherwise.add(i.condition.id)
        self.conditions = {
            value
            for value, choices in chosen_by.items()
            if value not in used_otherwise and not any(self._compares(value, i) for i in choices)
        }

    def same(self, first: s.Operand, second: s.Operand) -> bool:
        """Return True if a compiler may recognize both as the same value."""
        if isinstance(first, s.Lit) or isinstance(second, s.Lit):
            return False
        one, other = (self.numbers.get(v.id) for v in (first, second))
        return one == other or (one is None and other is None)

    def _number(self, i: s.Instruction) -> None:
        """Number equal computations and loads alike; values of variables are unknown."""
        if isinstance(i, s.Op):
            self.producers[i.to.id] = i
            numbers = tuple([self._number_of(a) for a in i.arguments])
            if i.operation in ("min", "max") and numbers[0] == numbers[1] and isinstance(i.arguments[0], s.Val):
                # Compilers see through the least or greatest of one value; variables stay unknown.
                if i.arguments[0].id in self.numbers:
                    self.numbers[i.to.id] = self.numbers[i.arguments[0].id]
            else:
                self.numbers[i.to.id] = i.operation, i.on, numbers
        elif isinstance(i, s.LoadUniform):
            self.numbers[i.to.id] = i.block, self._number_of(i.index)
        elif isinstance(i, s.LoadBuiltin):
            self.numbers[i.to.id] = i.name
        elif isinstance(i, s.LoadTexel):
            place = i.image, i.relative, i.border, i.filtered, self._number_of(i.x), self._number_of(i.y)
            self.numbers |= {value.id: (*place, channel) for channel, value in enumerate(i.to) if value is not None}

    def _number_of(self, operand: s.Operand) -> object:
        if isinstance(operand, s.Lit):
            return repr(operand)
        number = self.numbers.get(operand.id)
        return operand.id if number is None else hash(number)

    def _operation(self, i: s.Op) -> None:
        if i.on != "float":
            return
        for place, argument in enumerate(i.arguments):
            producer = self._producer(argument)
            if producer is not None and self._combines(producer, i, place):
                self.results.add(producer.to.id)

    def _combines(self, producer: s.Op, by: s.Op, place: int) -> bool:
        """Return True if compilers combine the result of ``producer`` with the operation that reads it."""
        name, reader = producer.operation, by.operation
        if reader in ("isnan", "isinf", "bits_from_float", "min", "max") or reader in COMPARISONS:
            return False
        if name == "to_float":
            return reader in ("to_int", "round", "floor", "ceil", "trunc")
        if reader in _SUMS:
            if name == "mul":
                other = self._producer(by.arguments[1 - place])
                return other is not None and other.operation == "mul" and self._share(producer, other)
            if name == "add":
                return reader == "sub" or _has_literal(producer) or _has_literal(by)
            return name in ("sub", "neg", "floor")
        if reader in _PRODUCTS:
            if name == "sub":
                return isinstance(producer.arguments[0], s.Lit)
            return name in ("sqrt", "div") or (name == "mul" and (reader == "div" or _has_literal(producer)))
        return reader == "sqrt" and name in _PRODUCTS

    def _share(self, one: s.Op, other: s.Op) -> bool:
        numbers = {self._number_of(a) for a in one.arguments}
        return any(self._number_of(a) in numbers for a in other.arguments)

    def _handed_on(self, *operands: s.Operand) -> None:
        """Mark operands whose values variables and choices pass on to other operations."""
        for operand in operands:
            producer = self._producer(operand)
            if producer is not None and producer.to.type == "float" and producer.operation in _COMBINED:
                self.results.add(producer.to.id)

    def _producer(self, operand: s.Operand) -> s.Op | None:
        return self.producers.get(operand.id) if isinstance(operand, s.Val) else None

    def _compares(self, value: int, i: s.Choose) -> bool:
        """Return True if a choice is between the compared values: compilers turn it into a minimum or an absolute
        value."""
        producer = self.producers.get(value)
        if producer is None or producer.on != "float":
            return True
        numbers = {self._number_of(a) for a in producer.arguments}
        branches = [self._producer(a) for a in (i.then, i.orelse)]
        read = [i.then, i.orelse, *(a for branch in branches if branch is not None for a in branch.arguments)]
        return any(self._number_of(a) in numbers for a in read)


def _has_literal(op: s.Op) -> bool:
    return any(isinstance(a, s.Lit) for a in op.arguments)


def _results(program: s.ScalarProgram) -> list[s.Operand]:
    found = [value for output in program.outputs for value in output.values]
    return found if program.keep is None else [*found, program.keep]
