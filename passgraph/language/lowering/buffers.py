"""Texels of images in buffers: loads and stores at computed addresses, with border rules and stored numbers as
arithmetic."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace

from passgraph.formats import Format
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS
from passgraph.language.builtin_name import PIXEL, BuiltinName, size_names
from passgraph.language.lowering.building import Builder, number
from passgraph.language.lowering.windows import Window, windows_of
from passgraph.records import dataclass

#: The first index that exceeds 32 bits.
INT_LIMIT = 1 << 31


@dataclass(frozen=True)
class Buffer:
    """How an image lies in a buffer, counted in what the device indexes: numbers, or whole texels.

    Attributes
    ----------
    size : width and height; None if only a run knows them (builtins ``size.NAME.0`` and ``size.NAME.1``)
    row, pixel : distances from row to row and from texel to texel; no row: builtin ``pitch.NAME``, in texels
    first : index of the top left texel
    places : place of each channel in its texel
    wide : True if indices exceed 32 bits
    stored : format of the numbers; None if loads give floats and stores take them
    """

    size: tuple[int, int] | None = None
    row: int | None = None
    pixel: int = 1
    first: int = 0
    places: tuple[int, ...] = (0, 1, 2, 3)
    wide: bool = False
    stored: Format | None = None


@dataclass(frozen=True)
class TexelsInBuffers:
    """A pass: each texel read becomes a load.

    Attributes
    ----------
    inner : every relative read is known to be inside, so that constant offsets are constant distances in memory
    views : image and border rule → number of the rows that the device keeps for relative reads
    windows : neighboring texels of a row may be loaded together
    """

    buffers: Mapping[str, Buffer]
    inner: bool = False
    views: Mapping[tuple[str, str], int] = field(default_factory=dict)
    windows: bool = False

    def __call__(self, program: s.ScalarProgram) -> s.ScalarProgram:
        if not any(isinstance(i, s.LoadTexel) for i in s.walk(program.body)):
            return program
        texels = _Texels(program, self)
        body = s.rewritten(program.body, texels.lowered)
        return texels.builder.finished((*texels.first, *body))


class _Texels:
    def __init__(self, program: s.ScalarProgram, choices: TexelsInBuffers) -> None:
        self.program, self.buffers, self.inner, self.views = program, choices.buffers, choices.inner, choices.views
        self.builder = Builder(program)
        self.windows = windows_of(program) if choices.windows else {}
        self.first: list[s.Instruction] = []  # instructions before all others
        self.origins: dict[object, s.Operand] = {}  # layout → index of this pixel

    def lowered(self, i: s.Instruction) -> Iterable[s.Instruction]:
        if not isinstance(i, s.LoadTexel):
            return (i,)
        if i.relative and (i.image, i.border) in self.views:
            return (s.LoadView(i.to, i.image, self.views[i.image, i.border], i.x, i.y),)
        window = self.windows.get(next(value.id for value in s.results_of(i)))
        if window is not None:
            if i is window.loads[0]:
                self._window(window)
            return self.builder.taken()
        buffer = self.buffers[i.image]
        if self._is_fixed(i):
            assert isinstance(i.x, s.Lit) and isinstance(i.y, s.Lit) and buffer.row is not None
            distance = int(i.y.value) * buffer.row + int(i.x.value) * buffer.pixel
            self._load(i, i.to, self._origin(i.image, buffer), distance, None)
            return self.builder.taken()
        places, outside = [], []
        for axis in (0, 1):
            place, may_leave = self._place(i, axis, buffer)
            if may_leave:
                size = self._size(i.image, buffer, axis)
                inside = self.builder.bordered(i.border, place, size)
                if BORDERS[i.border].blank:
                    outside.append(self.builder.index("not_equal", inside, place))
                place = inside
            places.append(place)
        blank = outside[0] if outside else None
        if len(outside) == 2:
            blank = self.builder.op("logical_or", "bool", *outside)
        self._load(i, i.to, address(self.builder, i.image, buffer, *places), 0, blank)
        return self.builder.taken()

    def _window(self, window: Window) -> None:
        """Load the texels of a window at once if they are inside, else one by one."""
        b, load, buffer = self.builder, window.loads[0], self.buffers[window.loads[0].image]
        width, height = (self._size(load.image, buffer, axis) for axis in (0, 1))
        low, high, is_blank = window.offsets[0], window.offsets[-1], BORDERS[load.border].blank
        row = b.bordered(load.border, load.y, height)
        outside = b.index("not_equal", row, load.y) if is_blank else None
        least = number(max(0, -low))
        below = b.index("less", window.base, b.index("sub", width, number(max(0, high))))
        inside = b.op("logical_and", "bool", b.index("greater_equal", window.base, least), below)
        b.add(s.Choose(column := b.fresh(s.INDEX), inside, window.base, least))
        first = address(b, load.image, buffer, b.index("add", column, number(low)), row)
        before, singly = b.taken(), []
        for offset in window.offsets:
            at = b.index("add", window.base, number(offset))
            found = b.bordered(load.border, at, width)
            is_outside = b.index("not_equal", found, at) if is_blank else None
            singly.append(b.fresh("float"))
            self._load(load, (singly[-1],), address(b, load.image, buffer, found, row), 0, is_outside)
        apart, places = tuple(b.taken()), tuple(offset - low for offset in window.offsets)
        results = [value for load in window.loads for value in s.results_of(load)]
        shown = tuple(to if outside is None else b.fresh("float") for to in results)
        b.made = before
        b.add(s.LoadWindow(shown, load.image, inside, first, places, apart, tuple(singly)))
        if outside is not None:
            for to, value in zip(results, shown, strict=True):
                b.add(s.Choose(to, outside, s.Lit("float", 0.0), value))

    def _is_fixed(self, load: s.LoadTexel) -> bool:
        """Return True if a read is at a fixed distance in memory: inside, at a constant offset.

        PoCL 6 (LLVM 18) does not see that texels are adjacent where each index is computed from column and row; a blur
        then takes two to nine times as long.
        """
        offsets = [offset.value for offset in (load.x, load.y) if isinstance(offset, s.Lit)]
        is_inside = offsets == [0, 0] or (self.inner and len(offsets) == 2)
        return load.relative and is_inside and self.buffers[load.image].row is not None

    def _origin(self, image: str, buffer: Buffer) -> s.Operand:
        """Return the index of this pixel, which is computed once for all images that lie alike."""
        key = buffer.row, buffer.pixel, buffer.first, buffer.wide
        if key not in self.origins:
            self.origins[key] = own_address(self.builder, image, buffer)
            self.first += self.builder.taken()
        return self.origins[key]

    def _size(self, image: str, buffer: Buffer, axis: int) -> s.Operand:
        return self.builder.builtin(size_names(image)[axis]) if buffer.size is None else number(buffer.size[axis])

    def _place(self, load: s.LoadTexel, axis: int, buffer: Buffer) -> tuple[s.Operand, bool]:
        """Return the column or row of a read, and True if it may be outside."""
        offset = (load.x, load.y)[axis]
        if not load.relative:
            return offset, True
        here = self.builder.builtin(PIXEL[axis])
        if isinstance(offset, s.Lit) and offset.value == 0:
            return here, False
        use = self.program.image(load.image)
        reach = max(map(abs, (use.x, use.y)[axis]))
        if buffer.size is None or reach >= INT_LIMIT - buffer.size[axis]:
            offset = self.builder.near(load.border, offset, self._size(load.image, buffer, axis))
        return self.builder.index("add", here, offset), not self.inner

    def _load(
        self, load: s.LoadTexel, results: tuple[s.Val | None, ...], index: s.Operand, distance: int,
        blank: s.Operand | None,
    ) -> None:  # fmt: skip
        """Load the numbers, convert them to floats, and replace those outside by 0."""
        b, buffer = self.builder, self.buffers[load.image]
        is_raw = buffer.stored is not None and buffer.stored.number != "f4"
        shown = [None if to is None else to if blank is None else b.fresh("float") for to in results]
        loaded = [None if to is None else b.fresh("int") if is_raw else to for to in shown]
        places = tuple(distance + buffer.places[channel] for channel in range(len(loaded)))
        b.add(s.Load(tuple(loaded), load.image, index, places, load.span))
        for to, value, texel in zip(results, shown, loaded, strict=True):
            if to is None or value is None or texel is None:
                continue
            if is_raw:
                assert buffer.stored is not None
                decoded(b, buffer.stored, texel, value)
            if blank is not None:
                b.add(s.Choose(to, blank, s.Lit("float", 0.0), value))


def own_address(b: Builder, image: str, buffer: Buffer) -> s.Operand:
    """Return the index of this pixel."""
    return address(b, image, buffer, *map(b.builtin, PIXEL))


def address(b: Builder, image: str, buffer: Buffer, x: s.Operand, y: s.Operand) -> s.Operand:
    """Return the index of a texel inside."""
    on = s.LONG if buffer.wide else s.INDEX
    if buffer.wide:
        x, y = (number(int(a.value)) if isinstance(a, s.Lit) else b.index("to_long", a) for a in (x, y))
    if buffer.row is None or buffer.row % buffer.pixel == 0:
        # LLVM (18, below PoCL 6) sees best in this form that texels are adjacent: a blur takes a seventh less.
        row = b.builtin(BuiltinName("pitch", image)) if buffer.row is None else number(buffer.row // buffer.pixel)
        index = b.op("mul", on, b.op("add", on, b.op("mul", on, y, row), x), number(buffer.pixel))
    else:
        across = b.op("mul", on, x, number(buffer.pixel))
        index = b.op("add", on, b.op("mul", on, y, number(buffer.row)), across)
    return b.op("add", on, index, number(buffer.first))


def decoded(b: Builder, stored: Format, raw: s.Operand, to: s.Val) -> None:
    """Convert a stored number to a float."""
    if stored.steps:
        whole = b.op("to_float", "int", raw, to=b.fresh("float"))
        b.op("div", "float", whole, s.Lit("float", float(stored.steps)), to=to)
    else:
        b.op("decode", stored.number, raw, to=to)


@dataclass(frozen=True)
class StoresInBuffers:
    """A pass: outputs become stores of their numbers at this pixel."""

    buffers: Sequence[Buffer]

    def __call__(self, program: s.ScalarProgram) -> s.ScalarProgram:
        b = Builder(program)
        operations = {i.to.id: i for i in program.body if isinstance(i, s.Op)}  # outside of branches and loops
        for number_, (output, buffer) in enumerate(zip(program.outputs, self.buffers, strict=True)):
            index = own_address(b, output.name, buffer)
            values = tuple(_encoded(b, operations, buffer.stored, value) for value in output.values)
            b.add(s.Store(number_, index, buffer.places[: len(values)], values))
        return replace(b.finished((*program.body, *b.taken())), outputs=())


def _encoded(b: Builder, operations: Mapping[int, s.Op], stored: Format | None, value: s.Operand) -> s.Operand:
    """Convert a float to the number that stores it.

    A float that was just divided by its steps is stored as steps: compilers do not see that the division is undone, and
    do not vectorize saturating conversions.
    """
    if stored is None or stored.number == "f4":
        return value
    if not stored.steps:
        return b.op("encode", stored.number, value)
    quotient = operations.get(value.id) if isinstance(value, s.Val) else None
    if quotient is not None and (quotient.operation, quotient.on) == ("div", "float"):
        counted, steps = quotient.arguments
        whole = operations.get(counted.id) if isinstance(counted, s.Val) else None
        is_rounded = whole is not None and whole.operation == "round"
        if is_rounded and isinstance(steps, s.Lit) and steps.value == stored.steps:
            return b.op("to_index", "float", counted)
    scaled = b.op("mul", "float", value, s.Lit("float", float(stored.steps)))
    return b.op("encode", stored.number, scaled)
