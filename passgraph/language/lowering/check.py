"""Check that a scalar program keeps the rules of the representation: what each instruction may use, and of which type.

Passes and printers rely on them, and would print something else without notice where one is broken.
"""

from __future__ import annotations

from collections.abc import Iterable

from passgraph.language import native
from passgraph.language import scalar as s
from passgraph.language.lowering.rows import fits, signature
from passgraph.language.operations import OPERATIONS

#: Rows of floats that are no primitives, and that devices may have themselves.
_NATIVE = {"fma", *native.GLSL, *native.WGSL, *native.OPENCL}
#: Letter of a signature → type of a scalar; the other letters stand for the type of the arguments.
_LETTERS = {"B": "bool", "b": "bool", "I": "int", "i": "int", "S": "int", "U": "int", "G": "float", "f": "float"}


class Malformed(Exception):
    """A program that breaks the rules; a defect of the pass before."""


def check(program: s.ScalarProgram, when: str) -> None:
    """Raise `Malformed` if a program breaks a rule; ``when`` says after which pass."""
    _Check(program, when).run()


class _Check:
    def __init__(self, program: s.ScalarProgram, when: str) -> None:
        self.program, self.when = program, when
        self.defined: set[int] = set()  # anywhere so far: each value has one instruction
        self.known: dict[int, str] = {}  # values in scope, with their types
        self.variables = dict(program.variables)
        self.arrays = {name: type_ for name, type_, _ in program.arrays}
        self.tables = {name: type_ for name, type_, _ in program.tables}
        self.images = {use.name: use for use in program.images}
        self.builtins = {name for name, _ in program.builtins}

    def run(self) -> None:
        self.block(self.program.body, 0)
        for output in self.program.outputs:
            for value in (*output.values, *output.unrounded):
                self.use(value, "float", f"output {output.name}")
        if self.program.keep is not None:
            self.use(self.program.keep, "bool", "keep")

    def block(self, body: Iterable[s.Instruction], loops: int) -> None:
        for i in body:
            if isinstance(i, (s.If, s.For, s.LoadWindow)):
                self.nested(i, loops)
            elif isinstance(i, (s.Break, s.Continue)):
                self.expect(loops > 0, i, "leaves a loop", "outside of every loop", "inside of one")
            else:
                self.single(i)
            for value in s.results_of(i):
                self.define(value, i)

    def nested(self, i: s.If | s.For | s.LoadWindow, loops: int) -> None:
        outside = self.known
        if isinstance(i, s.If):
            self.use(i.condition, "bool", i)
        elif isinstance(i, s.LoadWindow):
            self.use(i.inside, "bool", i)
            self.use(i.first, s.LONG, i)
            self.channels(i, 1)
        else:
            self.expect(i.step != 0, i, "counts", f"a step of {i.step}", "another one")
            loops += 1
        for block in _blocks(i):
            self.known = dict(outside)
            if isinstance(i, s.For):
                self.define(i.index, i)
            self.block(block, loops)
            if isinstance(i, s.LoadWindow):
                for value in i.singly:
                    self.use(value, "float", i)
        self.known = outside

    def single(self, i: s.Instruction) -> None:
        if isinstance(i, s.Op):
            self.operation(i)
        elif isinstance(i, s.Choose):
            self.use(i.condition, "bool", i)
            for value in (i.then, i.orelse):
                self.use(value, i.to.type, i)
        elif isinstance(i, s.LoadUniform):
            self.expect(i.block in ("float", "int"), i, "reads a block", i.block, "float or int")
            self.use(i.index, "int", i)
        elif isinstance(i, s.LoadTable):
            self.declared(i.table, self.tables, i, i.to.type)
            self.use(i.index, "int", i)
        elif isinstance(i, s.LoadBuiltin):
            self.expect(
                i.name in self.builtins, i, "reads a builtin", i.name, f"one of {sorted(map(str, self.builtins))}"
            )
        elif isinstance(i, s.LoadTexel):
            for place in (i.x, i.y):
                self.use(place, "float" if i.filtered else "int", i)
            self.channels(i, len(i.to))
        elif isinstance(i, s.Sample):
            whole = {i.x.type, i.y.type} <= {"int", s.INDEX}
            for place in (i.x, i.y):
                self.use(place, s.INDEX if whole else s.COORDINATE, i)
            self.channels(i, len(i.to))
        elif isinstance(i, s.LoadView):
            for place in (i.x, i.y):
                self.use(place, "int", i)
            self.channels(i, len(i.to))
        elif isinstance(i, s.Load):
            self.use(i.index, s.LONG, i)
            self.expect(len(i.places) >= len(i.to), i, "loads numbers", f"{len(i.places)} places", f"{len(i.to)}")
            self.channels(i, len(i.to))
        elif isinstance(i, s.Store):
            self.use(i.index, s.LONG, i)
            self.expect(len(i.places) >= len(i.values), i, "stores", f"{len(i.places)} places", f"{len(i.values)}")
            for value in i.values:
                self.use(value, value.type, i)
        else:
            self.variable(i)

    def variable(self, i: s.Instruction) -> None:
        if isinstance(i, s.Read):
            self.declared(i.variable, self.variables, i, i.to.type)
        elif isinstance(i, s.Write):
            self.declared(i.variable, self.variables, i, i.value.type)
            self.use(i.value, i.value.type, i)
        elif isinstance(i, s.ReadAt):
            self.declared(i.array, self.arrays, i, i.to.type)
            self.use(i.index, "int", i)
        elif isinstance(i, s.WriteAt):
            self.declared(i.array, self.arrays, i, i.value.type)
            self.use(i.index, "int", i)
            self.use(i.value, i.value.type, i)

    def operation(self, i: s.Op) -> None:
        expected = signature(i.operation, i.on)
        if expected is None:
            expected = self.primitive(i)
        arguments, result = expected
        self.expect(len(i.arguments) == len(arguments), i, "takes arguments", len(i.arguments), len(arguments))
        for value, type_ in zip(i.arguments, arguments, strict=True):
            self.use(value, type_, i)
        self.expect(i.to.type == result, i, "gives", i.to.type, result)

    def primitive(self, i: s.Op) -> tuple[tuple[str, ...], str]:
        row = OPERATIONS.get(i.operation)
        known = row is not None and (i.on in row.types or (i.on == "float" and i.operation in _NATIVE))
        self.expect(known, i, "is an operation", f"{i.operation} on {i.on}", "a row of a table")
        assert row is not None
        result = _LETTERS.get(row.result, i.on) if row.result not in row.operands else i.on
        return (i.on,) * len(row.operands), result

    def channels(self, i: s.LoadTexel | s.Load | s.LoadView | s.LoadWindow | s.Sample, count: int) -> None:
        use = self.images.get(i.image)
        self.expect(use is not None, i, "reads an image", i.image, f"one of {sorted(self.images)}")
        assert use is not None
        self.expect(count <= use.channels, i, "reads channels", count, f"at most {use.channels}")

    def declared(self, name: str, names: dict[str, str], i: s.Instruction, type_: str) -> None:
        self.expect(name in names, i, "uses", name, f"one of {sorted(names)}")
        self.expect(names[name] == type_, i, f"uses {name} as", type_, names[name])

    def define(self, value: s.Val, i: s.Instruction) -> None:
        self.expect(value.id not in self.defined, i, f"defines {value}", "a value with a definition", "a new one")
        self.defined.add(value.id)
        self.known[value.id] = value.type

    def use(self, operand: s.Operand, expected: str, i: s.Instruction | str) -> None:
        if isinstance(operand, s.Val):
            type_ = self.known.get(operand.id)
            self.expect(
                type_ is not None, i, f"uses {operand}", "no definition before it", "one in its block or around"
            )
            self.expect(type_ == operand.type, i, f"uses {operand} as", operand.type, type_)
        self.expect(fits(operand.type, expected), i, f"uses {operand}", operand.type, expected)

    def expect(self, holds: bool, i: s.Instruction | str, does: str, got: object, expected: object) -> None:
        if not holds:
            text = i if isinstance(i, str) else repr(i)[:200]
            raise Malformed(
                f"{self.program.name}, {self.when}: {text} {does}: got {got}, expected {expected}; this is a fault of "
                "passgraph: please report it with the text of the kernel"
            )


def _blocks(i: s.If | s.For | s.LoadWindow) -> tuple[tuple[s.Instruction, ...], ...]:
    if isinstance(i, s.If):
        return i.then, i.orelse
    return (i.body,) if isinstance(i, s.For) else (i.apart,)
