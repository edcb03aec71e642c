"""The scalar program, which backends print.

Straight-line instructions on ``bool``, ``int`` and ``float`` values, each assigned once, with structured ``If`` and
``For`` around them.  Branches and loops pass values through named variables (:class:`Read`, :class:`Write`).  It uses
only primitive rows of the operations table, so a printer is a loop over a few instruction kinds.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import field, replace
from typing import TypeAlias

from passgraph.cached import cached_property
from passgraph.language.builtin_name import BuiltinName, size_names
from passgraph.language.meanings import int_of_bits
from passgraph.language.parameter_name import ParameterName
from passgraph.language.source import NOWHERE, Span
from passgraph.language.types import UINT, Type, element_of, held_as
from passgraph.ranges import Range
from passgraph.records import dataclass

#: Part of every key: raise it when the meaning of a program or of an emitter changes.
FORMAT_VERSION = 3


#: Types of values in lowered programs besides bool, int and float: ints of addresses, whose arithmetic never overflows,
#: in 32 and in 64 bits, and floats of texture coordinates, which devices may round in any way.
INDEX, LONG, COORDINATE = "index", "long", "coordinate"


@dataclass(frozen=True, slots=True)
class Lit:
    """A known number."""

    type: str
    value: bool | int | float

    def __repr__(self) -> str:
        return f"{self.type}:{float(self.value).hex() if self.type == 'float' else self.value}"


@dataclass(frozen=True, slots=True)
class Val:
    """The result of an instruction, by its number."""

    type: str
    id: int

    def __repr__(self) -> str:
        return f"%{self.id}"


Operand: TypeAlias = Lit | Val


def literal(type_: Type, value: bool | int | float) -> Lit:
    """Return a component of a type as programs store it."""
    return Lit(held_as(type_), int_of_bits(int(value)) if element_of(type_) is UINT else value)


@dataclass(frozen=True, slots=True)
class Op:
    """A primitive operation; ``on`` is the scalar type of its arguments."""

    to: Val
    operation: str
    on: str
    arguments: tuple[Operand, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Choose:
    """``then if condition else orelse``, both sides already computed."""

    to: Val
    condition: Operand
    then: Operand
    orelse: Operand


@dataclass(frozen=True, slots=True)
class LoadUniform:
    """Entry ``index`` of the block of floats (``"float"``) or ints (``"int"``, bools too) of a pass."""

    to: Val
    block: str
    index: Operand


@dataclass(frozen=True, slots=True)
class LoadTable:
    """Entry ``index`` of a constant table."""

    to: Val
    table: str
    index: Operand


@dataclass(frozen=True, slots=True)
class LoadBuiltin:
    """Loads a component of a builtin: ``pixel``, ``output_size``, ``size`` of an image, ``normal`` of the vertex …"""

    to: Val
    name: BuiltinName


@dataclass(frozen=True, slots=True)
class LoadTexel:
    """Loads the first ``len(to)`` channels of one texel; None for an unused channel."""

    to: tuple[Val | None, ...]
    image: str
    x: Operand
    y: Operand
    relative: bool
    border: str
    #: True if the position is two floats from 0 to 1, and the device interpolates four texels itself.
    filtered: bool = False
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Load:
    """Loads numbers of an image from a buffer: number ``to[k]`` is at ``index + places[k]``; None for an unused one.

    Only in lowered programs (:mod:`passgraph.language.lowering`).
    """

    to: tuple[Val | None, ...]
    image: str
    index: Operand
    places: tuple[int, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class LoadView:
    """Loads channels of the texel at an offset from this pixel, in rows that hold what the border rule finds outside.

    Only in lowered programs; ``view`` is the number of the image with its rule.
    """

    to: tuple[Val | None, ...]
    image: str
    view: int
    x: Operand
    y: Operand


@dataclass(frozen=True, slots=True)
class LoadWindow:
    """Loads numbers ``first + places[k]`` together if all of them are inside at each pixel that is at work.

    Else executes ``apart``, whose results are ``singly``.  Only in lowered programs.
    """

    to: tuple[Val, ...]
    image: str
    inside: Operand
    first: Operand
    places: tuple[int, ...]
    apart: tuple[Instruction, ...]
    singly: tuple[Val, ...]


@dataclass(frozen=True, slots=True)
class Sample:
    """Loads channels of a texel from a texture, at coordinates from 0 to 1, or at an int column and row.

    ``filter`` is empty, or the border rule with which the device interpolates four texels.  Only in lowered programs.
    """

    to: tuple[Val | None, ...]
    image: str
    x: Operand
    y: Operand
    filter: str = ""
    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Store:
    """Writes the numbers of an output into its buffer: ``values[k]`` at ``index + places[k]``; in lowered programs."""

    output: int
    index: Operand
    places: tuple[int, ...]
    values: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class Read:
    """Read a variable."""

    to: Val
    variable: str


@dataclass(frozen=True, slots=True)
class Write:
    """Assigns a value to a variable."""

    variable: str
    value: Operand


@dataclass(frozen=True, slots=True)
class ReadAt:
    """Read an array at an index inside its range."""

    to: Val
    array: str
    index: Operand


@dataclass(frozen=True, slots=True)
class WriteAt:
    """Assigns a value to an array element at an index inside its range."""

    array: str
    index: Operand
    value: Operand


@dataclass(frozen=True, slots=True)
class If:
    """Executes one of two blocks."""

    condition: Operand
    then: tuple[Instruction, ...]
    orelse: tuple[Instruction, ...]


@dataclass(frozen=True, slots=True)
class For:
    """A loop with known bounds: ``range(start, stop, step)``, with only 32-bit ints."""

    index: Val
    start: int
    stop: int
    step: int
    body: tuple[Instruction, ...]

    @property
    def trips(self) -> int:
        return len(range(self.start, self.stop, self.step))

    @property
    def wraps(self) -> bool:
        """Return True if the index would overflow 32 bits after the last iteration, so that comparing it never ends the
        loop."""
        return not -(2**31) <= self.start + self.trips * self.step < 2**31


@dataclass(frozen=True, slots=True)
class Break:
    """Leaves the innermost loop."""


@dataclass(frozen=True, slots=True)
class Continue:
    """Continues with the next iteration of the innermost loop."""


Instruction: TypeAlias = (
    Op
    | Choose
    | LoadUniform
    | LoadTable
    | LoadBuiltin
    | LoadTexel
    | Load
    | LoadView
    | LoadWindow
    | Sample
    | Store
    | Read
    | Write
    | ReadAt
    | WriteAt
    | If
    | For
    | Break
    | Continue
)


@dataclass(frozen=True, slots=True)
class UniformSlot:
    """The position of a parameter in its block: ``count`` entries from ``offset``, in component order."""

    name: ParameterName
    type: object  # a Scalar, Vector, Matrix or Array of passgraph.language.types
    block: str
    offset: int
    count: int
    range: Range | None = None  # range of each entry


@dataclass(frozen=True, slots=True)
class ImageUse:
    """The reads of an image in a pass: range of relative offsets (x and y, inclusive), True if it reads elsewhere."""

    name: str
    channels: int
    x: tuple[int, int] = (0, 0)
    y: tuple[int, int] = (0, 0)
    relative: bool = False
    absolute: bool = False

    def reaching(self, x: tuple[int, int], y: tuple[int, int]) -> ImageUse:
        """Return the same use extended by these relative offsets."""
        if self.relative:
            x = min(self.x[0], x[0]), max(self.x[1], x[1])
            y = min(self.y[0], y[0]), max(self.y[1], y[1])
        return replace(self, x=x, y=y, relative=True)

    @property
    def pointwise(self) -> bool:
        """Return True if it reads this pixel only."""
        return not self.absolute and self.x == (0, 0) and self.y == (0, 0)


@dataclass(frozen=True, slots=True)
class Output:
    """A result: a target's channels, or a varying's components.

    ``unrounded`` are the values before rounding to the target's format, the last operation: a backend may round while
    storing instead.
    """

    name: str
    values: tuple[Operand, ...]
    unrounded: tuple[Operand, ...]


@dataclass(frozen=True)
class ScalarProgram:
    """The scalar program of one stage of a pass."""

    name: str
    stage: str
    body: tuple[Instruction, ...]
    outputs: tuple[Output, ...]
    keep: Operand | None
    variables: tuple[tuple[str, str], ...]  # name, scalar type
    uniforms: tuple[UniformSlot, ...]
    tables: tuple[tuple[str, str, tuple[bool | int | float, ...]], ...]  # name, scalar type, values
    images: tuple[ImageUse, ...]
    builtins: tuple[tuple[BuiltinName, str], ...]  # name, scalar type
    sources: tuple[Span, ...] = field(default=(), compare=False, repr=False)
    arrays: tuple[tuple[str, str, int], ...] = ()  # name, scalar type, length
    #: Images that store long array parameters (:mod:`.long_arrays`): name, parameter, Array of types.
    buffers: tuple[tuple[str, ParameterName, object], ...] = ()

    @cached_property
    def key(self) -> str:
        """Return the SHA-256 of everything that affects the program's results; names of kernels and files do not."""
        parts = (FORMAT_VERSION, self.stage, self.body, self.outputs, self.keep, self.variables, self.arrays)
        slots = [(s.block, s.offset, s.count) for s in self.uniforms]
        text = repr((*parts, slots, [(n, t, [float(v).hex() for v in vs]) for n, t, vs in self.tables], self.images))
        return hashlib.sha256(text.encode()).hexdigest()

    @cached_property
    def varying_images(self) -> frozenset[str]:
        """The images whose relative reads are at offsets that depend on the pixel's values."""
        alike: set[int] = set()
        apart: set[str] = set()
        for i in walk(self.body):
            is_alike = all(isinstance(operand, Lit) or operand.id in alike for operand in operands_of(i))
            if isinstance(i, For):
                alike.add(i.index.id)
            elif isinstance(i, LoadTexel):
                if i.relative and not is_alike:
                    apart.add(i.image)
            elif is_alike and isinstance(i, (Op, Choose, LoadUniform, LoadTable)):
                alike.update(value.id for value in results_of(i))
        return frozenset(apart)

    @property
    def float_count(self) -> int:
        return sum(s.count for s in self.uniforms if s.block == "float")

    @property
    def int_count(self) -> int:
        return sum(s.count for s in self.uniforms if s.block == "int")

    @property
    def attributes(self) -> tuple[str, ...]:
        """Return the mesh attributes that a vertex program reads, by name, sorted."""
        return tuple(sorted({name.of for name, _ in self.builtins if name.kind == "vertex"}))

    def image(self, name: str) -> ImageUse:
        return next(use for use in self.images if use.name == name)

    def reads_size(self, image: str) -> bool:
        return any(name.kind == "size" and name.of == image for name, _ in self.builtins)


def walk(body: Iterable[Instruction]) -> Iterator[Instruction]:
    """Yield every instruction, including those inside branches and loops."""
    for instruction in body:
        yield instruction
        if isinstance(instruction, If):
            yield from walk(instruction.then)
            yield from walk(instruction.orelse)
        elif isinstance(instruction, For):
            yield from walk(instruction.body)
        elif isinstance(instruction, LoadWindow):
            yield from walk(instruction.apart)


def texel_loads(body: Iterable[Instruction], image: str | None = None) -> Iterator[LoadTexel]:
    """Yield every read of a texel, or those of one image."""
    return (i for i in walk(body) if isinstance(i, LoadTexel) and image in (None, i.image))


def filtered_images(program: ScalarProgram) -> dict[int, str]:
    """Return the border rules of the images that the device filters, by their numbers."""
    rules = {i.image: i.border for i in texel_loads(program.body) if i.filtered}
    return {number: rules[use.name] for number, use in enumerate(program.images) if use.name in rules}


def count(body: Iterable[Instruction]) -> int:
    """Count the instructions, nested ones included."""
    return sum(1 for _ in walk(body))


def rewritten(
    body: Iterable[Instruction], change: Callable[[Instruction], Iterable[Instruction]]
) -> tuple[Instruction, ...]:
    """Replace each instruction, except those around others, by those that ``change`` returns."""
    made: list[Instruction] = []
    for i in body:
        if isinstance(i, If):
            made.append(replace(i, then=rewritten(i.then, change), orelse=rewritten(i.orelse, change)))
        elif isinstance(i, For):
            made.append(replace(i, body=rewritten(i.body, change)))
        elif isinstance(i, LoadWindow):
            made.append(replace(i, apart=rewritten(i.apart, change)))
        else:
            made += change(i)
    return tuple(made)


def work(body: Iterable[Instruction]) -> int:
    """Return the most instructions of one pixel: the longer of two branches, and every iteration of a loop."""
    total = 0
    for i in body:
        if isinstance(i, For):
            total += i.trips * work(i.body)
        elif isinstance(i, If):
            total += max(work(i.then), work(i.orelse))
        else:
            total += 1
    return total


def trips(body: Iterable[Instruction], certain: bool = False) -> int:
    """Return the most loop iterations of one pixel, nested loops multiplied.

    ``certain``: only iterations that every pixel makes, whatever its data; one for a loop that it may leave.
    """
    total = 0
    for i in body:
        if isinstance(i, For):
            total += (1 if certain and breaks(i.body) else i.trips) * (1 + trips(i.body, certain))
        elif isinstance(i, If):
            total += (min if certain else max)(trips(i.then, certain), trips(i.orelse, certain))
    return total


def breaks(body: Iterable[Instruction], jumps: type | tuple[type, ...] = Break) -> bool:
    """Return True if the loop with this body may be left early, or if another of its ``jumps`` is inside."""
    return any(isinstance(i, jumps) or (isinstance(i, If) and breaks((*i.then, *i.orelse), jumps)) for i in body)


def is_straight(program: ScalarProgram) -> bool:
    """Return True if all instructions run once, in sequence, and their results are never assigned again."""
    return not program.variables and not program.arrays and not any(isinstance(i, (If, For)) for i in program.body)


def results_of(instruction: Instruction) -> tuple[Val, ...]:
    """Return the values that an instruction defines."""
    if isinstance(instruction, (Op, Choose, LoadUniform, LoadTable, LoadBuiltin, Read, ReadAt)):
        return (instruction.to,)
    if isinstance(instruction, (LoadTexel, Load, LoadView, LoadWindow, Sample)):
        return tuple(v for v in instruction.to if v is not None)
    return ()


def operands_of(instruction: Instruction) -> tuple[Operand, ...]:
    """Return the values that an instruction itself uses (without the bodies of branches and loops)."""
    if isinstance(instruction, Op):
        return instruction.arguments
    if isinstance(instruction, Choose):
        return (instruction.condition, instruction.then, instruction.orelse)
    if isinstance(instruction, (LoadUniform, LoadTable, ReadAt, Load)):
        return (instruction.index,)
    if isinstance(instruction, Store):
        return (instruction.index, *instruction.values)
    if isinstance(instruction, WriteAt):
        return (instruction.index, instruction.value)
    if isinstance(instruction, (LoadTexel, LoadView, Sample)):
        return (instruction.x, instruction.y)
    if isinstance(instruction, LoadWindow):
        return (instruction.inside, instruction.first)
    if isinstance(instruction, Write):
        return (instruction.value,)
    if isinstance(instruction, If):
        return (instruction.condition,)
    return ()


def nameless(program: ScalarProgram) -> ScalarProgram:
    """Return the same program with images renamed ``image0``, ``image1`` …, so that its key is independent of names.

    Names of images in kernels do not affect the computation.
    """
    names = {use.name: f"image{number}" for number, use in enumerate(program.images)}
    sizes = {
        old: now for name, new in names.items() for old, now in zip(size_names(name), size_names(new), strict=True)
    }

    def renamed(i: Instruction) -> tuple[Instruction]:
        if isinstance(i, LoadTexel):
            return (replace(i, image=names[i.image]),)
        return (replace(i, name=sizes.get(i.name, i.name)) if isinstance(i, LoadBuiltin) else i,)

    return replace(
        program,
        body=rewritten(program.body, renamed),
        images=tuple(replace(use, name=names[use.name]) for use in program.images),
        builtins=tuple((sizes.get(name, name), kind) for name, kind in program.builtins),
    )
