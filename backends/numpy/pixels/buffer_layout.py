"""Memory layout shared by the host and the machine code of a chain of pixel passes: addresses, rings, strips."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import field, replace
from functools import lru_cache

from passgraph.backends.numpy.machine.workers import ROOM
from passgraph.backends.numpy.pixels.chains import Stage, Work, near_images, reach
from passgraph.backends.numpy.storage import FLOAT
from passgraph.backends.numpy.vector.lane_body import for_lanes
from passgraph.cached import cached_property
from passgraph.formats import Format
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.lowering.channels import before_rounding, selection, single_channel
from passgraph.language.scalar import nameless
from passgraph.plan.window import Halo
from passgraph.records import dataclass

#: Facts about an image that a body reads anywhere: address, width, height, row stride in pixels.
IMAGE = ("", "_w", "_h", "_p")


class Frame:
    """The frame of a stage: indices of its entries.

    Entries: sizes of the target; addresses of uniforms; facts about each image; for each view the addresses of its rows
    at column 0; for each target those of the rows computed together, likewise.
    """

    def __init__(self, stage: StageLayout) -> None:
        self.stage = stage

    @cached_property
    def places(self) -> dict[str, int]:
        names = ["width", "height", "floats", "ints"]
        names += [f"im{image}{end}" for image in range(len(self.stage.program.images)) for end in IMAGE]
        return {name: place for place, name in enumerate(names)}

    @cached_property
    def _views(self) -> list[int]:
        """Return the frame entries where the rows of each view and of the targets begin."""
        places = [len(self.places)]
        for view in self.stage.views:
            places.append(places[-1] + view.rows)
        return places

    def view(self, number: int, row: int = 0) -> int:
        """Return the frame entry of a row of a view, counted from the highest row that is read."""
        return self._views[number] + row

    def target(self, slot: int, row: int = 0) -> int:
        return self._views[-1] + slot * self.stage.rows + row

    @property
    def count(self) -> int:
        return self.target(len(self.stage.channels))


#: Most instructions of a loop iteration that computes several rows or vectors together.
MAX_AT_ONCE = 400
#: Most rows together: more would need too many registers, with four channels per texel even sooner.
MAX_ROWS, MAX_ROWS_OF_PIXELS = 8, 4
#: Least lanes: processors gain nothing from narrower vectors.
LEAST_LANES = 4
#: Most vectors side by side.
MAX_VECTORS = 3
#: Numbers of a row that are decoded together: they stay in the level-1 cache.
SEGMENT = 2048
#: Least columns of a row between its ends.
NARROW = 16
#: Most columns of a slender picture, and the pixels from which on code of its own pays.
SLENDER, MANY = 16, 1 << 14
#: Most reads of an image whose numbers the body decodes itself.
MAX_READS = 3
#: Facts about an image in the context: address, width and height, row stride in pixels, the number of the row that is
#: last in memory, and the address of a copy of that row (see storage.py).
PICTURE = ("", "_w", "_h", "_p", "_last", "_row")


@dataclass(frozen=True)
class View:
    """The texels that relative reads of one image with one border rule may reach: rows around a pixel."""

    image: int
    border: str
    channels: int
    stored: Format
    up: int
    rows: int
    across: bool  # True if reads go left or right
    decodes: bool  # True if the strips hold float32, for the whole row
    strips: int  # offset in scratch memory of copies of its rows with the border applied, in strips

    @property
    def read(self) -> Format:
        """Return the format in which the kernel's body loads the numbers."""
        return FLOAT if self.decodes else self.stored


@dataclass(frozen=True)
class StageLayout:
    """The layout of a stage; ``lanes`` is the width of vectors."""

    chain: tuple[Stage, ...]
    number: int
    lanes: int

    @property
    def stage(self) -> Stage:
        return self.chain[self.number]

    @property
    def last(self) -> bool:
        return self.number == len(self.chain) - 1

    @property
    def channels(self) -> tuple[int, ...]:
        return self.stage.channels

    @cached_property
    def _before_rounding(self) -> s.ScalarProgram:
        return before_rounding(self.stage.step.program)

    @cached_property
    def _single(self) -> s.ScalarProgram | None:
        program = self._before_rounding
        # Single texels are addressed by pixel, not by channel.
        windows = all(use in near_images(program) for use in program.images if use.relative)
        return single_channel(program, self.channels) if windows else None

    @property
    def alike(self) -> int:
        """Return the number of channels that one program computes (see channels.py); 1: whole pixels."""
        return self.channels[0] if self._single is not None else 1

    @cached_property
    def _selection(self) -> s.ScalarProgram | None:
        program = self._single or self._before_rounding
        flat = self._single is not None or {*self.channels, *(use.channels for use in program.images)} == {1}
        windows = len(near_images(program)) == len(program.images)
        if not flat or not windows or len(self.chain) > 1:
            return None
        step = self.stage.step
        return selection(program, step.image_formats, step.output_formats)

    @property
    def selects(self) -> bool:
        """Return True if the body works on stored numbers, see `selection`."""
        return self._selection is not None

    @property
    def program(self) -> s.ScalarProgram:
        return self._selection or self._single or self._before_rounding

    @cached_property
    def lowered(self) -> s.ScalarProgram:
        """Return the program that the body emits."""
        names = [use.name for use in self.program.images]
        return for_lanes(self.program, {(names[v.image], v.border): number for number, v in enumerate(self.views)})

    @cached_property
    def reach(self) -> Halo:
        return reach(self.near)

    @cached_property
    def near(self) -> tuple[s.ImageUse, ...]:
        """Return the images whose relative reads use windows."""
        return near_images(self.program)

    @property
    def images(self) -> tuple[Format, ...]:
        """Return the format of each image; results of earlier stages are float32."""
        formats = self.stage.step.image_formats
        return tuple(FLOAT if number in self.rings else format_ for number, format_ in enumerate(formats))

    @property
    def formats(self) -> tuple[Format, ...]:
        """Return the format that each output is rounded to."""
        return self.stage.step.output_formats

    @property
    def outputs(self) -> tuple[Format, ...]:
        """Return the format in which each output is stored."""
        return self.formats if self.last else (FLOAT,) * len(self.formats)

    @property
    def rings(self) -> dict[int, tuple[int, int]]:
        """Return the images made by earlier stages: stage, and index among its outputs."""
        return {image: (producer, slot) for image, producer, slot in self.stage.rings}

    @property
    def numbers(self) -> int:
        """Return the length of a row in loop steps: pixels, or channels if all channels are computed alike."""
        return self.stage.step.size[0] * self.alike

    @property
    def is_slender(self) -> bool:
        """Return True if rows are so short and many that special code pays; one code serves all other widths."""
        width, height = self.stage.step.size
        return width <= SLENDER and width * height >= MANY

    @cached_property
    def _flat(self) -> bool:
        """Return True if vectors hold consecutive numbers of memory."""
        counts = [*self.channels, *(use.channels for use in self.program.images)]
        return self.alike > 1 or set(counts) == {1}

    @cached_property
    def _fitting(self) -> int:
        """Return how many times the kernel is unrolled in one turn of the loop."""
        straight = not self.program.arrays and not any(isinstance(i, (s.If, s.For)) for i in self.program.body)
        return max(1, MAX_AT_ONCE // max(1, len(self.program.body)) if straight else 1)

    @cached_property
    def rows(self) -> int:
        """Return the rows that the last stage computes together (a power of 2): neighbors share reads above and
        below."""
        _, _, up, down = self.reach
        if not self.last or not up + down:
            return 1
        most = min(MAX_ROWS if self._flat else MAX_ROWS_OF_PIXELS, self._fitting, self.stage.step.size[1])
        return 1 << (most.bit_length() - 1)

    @cached_property
    def vectors(self) -> int:
        """Return the vectors computed together side by side: they share reads left and right."""
        left, right, _, _ = self.reach
        most = min(MAX_VECTORS, ROOM // self.lanes)
        if self.is_slender:
            most = max(1, min(most, self.numbers // self.lanes))
        return min(most, self._fitting) if self._flat and self.rows == 1 and left + right else 1

    @property
    def narrow(self) -> int:
        """Return the largest width of rows that are not divided: most of such a row would be its ends."""
        left, right, _, _ = self.reach
        return left + right + NARROW

    @property
    def strip_pixels(self) -> int:
        """Return the pixels of a strip's row: the most computed together, their reach, and a rounded iteration."""
        left, right, _, _ = self.reach
        return max(self.narrow, self.segment) + left + right + self.turn

    @cached_property
    def segment(self) -> int:
        """Return the pixels of a row decoded together for several reads; 0 if every read decodes."""
        decoding = [view.channels for view in self.views if view.decodes]
        return -(-SEGMENT // (max(decoding) * self.turn)) * self.turn if decoding else 0

    @cached_property
    def views(self) -> tuple[View, ...]:
        """Return the views in the order of the program's reads."""
        views: dict[tuple[int, str], View] = {}
        before = 0
        for (number, rule), reads in self._reads.items():
            use, format_ = self.program.images[number], self.images[number]
            rows, across = use.y[1] - use.y[0] + self.rows, use.x != (0, 0)
            decodes = across and format_.bits < 32 and reads > MAX_READS and not self.selects
            views[number, rule] = View(number, rule, use.channels, format_, -use.y[0], rows, across, decodes, before)
            before += rows * use.channels if across else 0
        return tuple(views.values())

    @property
    def _reads(self) -> dict[tuple[int, str], int]:
        """Return how often the body reads each image through windows, by border rule."""
        numbers = {use.name: number for number, use in enumerate(self.program.images)}
        near = {use.name for use in self.near}
        loads = (i for i in s.texel_loads(self.program.body) if i.relative and i.image in near)
        return Counter((numbers[i.image], i.border) for i in loads)

    @cached_property
    def frame(self) -> Frame:
        return Frame(self)

    @property
    def turn(self) -> int:
        """Return how far one loop iteration advances, in pixels, or in channels if these are computed alike."""
        return self.lanes * self.vectors

    @property
    def counts(self) -> tuple[int, ...]:
        """Return, for each target, how many numbers of memory belong to one step."""
        return (1,) if self.alike > 1 else self.channels

    @property
    def _turn(self) -> tuple[object, ...]:
        """Return the key of one iteration of the loop along a row."""
        return self.alike, self.rows, self.vectors, self.lanes, self.selects, self.channels

    @cached_property
    def shape(self) -> tuple[object, ...]:
        """Return the key of the code around the body."""
        views = [
            (*_number_and_steps(v.stored), v.image, v.border, v.channels, v.up, v.rows, v.across, v.decodes)
            for v in self.views
        ]
        outputs = [_number_and_steps(output) for output in self.outputs]
        around = self.stage.margin, self.stage.rings, len(self.program.images)
        return (*self._turn, *self.reach, *around, tuple(views), tuple(outputs))

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """Return the key of the body of the stage's program."""
        program = nameless(self.program)
        formats = [_number_and_steps(format_) for format_ in (*self.images, *self.formats, *self.outputs)]
        views = [(v.image, v.border, v.rows, v.decodes) for v in self.views]
        builtins = [name for name, _ in program.builtins]
        return "body", program.key, repr((builtins, self._turn, formats, views))

    @property
    def scratch(self) -> int:
        """Return the numbers that all strips need."""
        ends = [(v.strips + v.rows * v.channels) * self.strip_pixels for v in self.views if v.across]
        return max(ends, default=0)


def _number_and_steps(format_: Format) -> tuple[str, int]:
    return format_.number, format_.steps


@dataclass(frozen=True)
class Layout:
    """The memory layout of a whole chain."""

    stages: tuple[StageLayout, ...]

    @classmethod
    def for_chain(cls, chain: Sequence[Stage], lanes: int) -> Layout:
        """``lanes`` are those of float32."""
        return _layout(tuple(replace(stage, step=_Step.from_step(stage.step)) for stage in chain), lanes)

    @property
    def fixed(self) -> list[str]:
        """Return the names of the first context entries, which are equal in each run: piece sizes and addresses of
        bodies."""
        pitches = [f"pitch{stage.number}" for stage in self.stages[:-1]]
        own = [f"body{stage.number}" for stage in self.stages]
        return ["counter", "count", "columns", "tile", "band", "width", "height", "zeros", *pitches, *own]

    @property
    def bound(self) -> list[str]:
        """Return the names of the other context entries, in order."""
        names = []
        for stage in self.stages:
            for image in range(len(stage.program.images)):
                if image not in stage.rings:
                    names += [f"im{stage.number}_{image}{end}" for end in PICTURE]
            names += [f"floats{stage.number}", f"ints{stage.number}"]
        return [*names, *(f"out{slot}{end}" for slot in range(len(self.stages[-1].channels)) for end in ("", "_p"))]

    @property
    def own(self) -> list[str]:
        """Return the names of per-thread entries: rings and strips."""
        rings = [f"ring{stage.number}_{slot}" for stage in self.stages[:-1] for slot in range(len(stage.channels))]
        return [*rings, "scratch"]

    @property
    def scratch(self) -> int:
        return max(stage.scratch for stage in self.stages)

    @property
    def zeros(self) -> int:
        """Return the length of a row of zeros for reads outside, if one is needed."""
        counts = [v.channels for stage in self.stages for v in stage.views if BORDERS[v.border].blank]
        return max(counts, default=0) * self.stages[-1].stage.step.size[0]

    def ring_rows(self, number: int) -> int:
        """Return the number of rows of a stage's results that its ring keeps."""
        return self.stages[number].stage.rows + self.stages[-1].rows - 1

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """Return the key of the code around the bodies; it does not depend on the programs."""
        return ("pixels", *(repr(stage.shape) for stage in self.stages))


@dataclass(frozen=True)
class _Step:
    """The parts of a step that a layout depends on, without the graph behind them."""

    key: str
    builtins: tuple[tuple[BuiltinName, str], ...]
    size: tuple[int, int]
    image_formats: tuple[Format, ...]
    output_formats: tuple[Format, ...]
    program: s.ScalarProgram = field(compare=False)

    @classmethod
    def from_step(cls, step: Work) -> _Step:
        program = step.program
        return cls(program.key, program.builtins, step.size, step.image_formats, step.output_formats, program)


@lru_cache(maxsize=128)  # of some 16 kB each
def _layout(chain: tuple[Stage, ...], lanes: int) -> Layout:
    wide = tuple(StageLayout(chain, number, lanes) for number in range(len(chain)))
    # An iteration wider than a row computes unused results, and the used ones are copied number by number.
    if wide[-1].is_slender:
        while lanes > max(LEAST_LANES, min(stage.numbers for stage in wide)):
            lanes //= 2
    stages = tuple(replace(stage, lanes=lanes) for stage in wide)
    if stages[-1].selects:
        stages = (StageLayout(chain, 0, lanes * 32 // stages[-1].formats[0].bits),)
    return Layout(stages)
