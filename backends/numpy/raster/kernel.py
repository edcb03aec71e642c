"""A fragment kernel in vectors, and what it and the rest of its draw find in memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from passgraph.backends.numpy.machine import ir
from passgraph.backends.numpy.machine.builder import IRBuilder
from passgraph.backends.numpy.machine.native import lanes
from passgraph.backends.numpy.raster.layout import is_of_triangle
from passgraph.backends.numpy.vector.lane_body import LaneBody
from passgraph.backends.numpy.vector.lanes import Lanes
from passgraph.backends.numpy.vector.operations import F32, I32, I64
from passgraph.backends.numpy.vector.stored import element, rounded, store
from passgraph.formats import Format
from passgraph.language.scalar import ScalarProgram
from passgraph.plan.data import DrawStep

#: Endings of an image's sizes: width and height, and pixels from row to row.
SIZES = ("_w", "_h", "_p")


def kernel_parts(step: DrawStep) -> tuple[str, ...]:
    """What tells the code of a draw's fragments from every other, apart from the draw's state."""
    cleared = [clear is not None for clear in step.clears]
    program = step.fragment
    kernel = () if program is None else (program.key, repr([name for name, _ in program.builtins]))
    held = [(format_.number, format_.steps) for format_ in (*_image_formats(step), *step.output_formats)]
    return *kernel, repr(cleared), repr(held), repr(step.varyings), str(lanes())


def context_names(step: DrawStep) -> list[str]:
    """Entries of the context, in order: each an address or a size."""
    names = ["floats", "ints", "clears", "depth", "stencil", "width", "height"]
    return [
        *names,
        *image_names(step.fragment),
        *(f"out{number}{end}" for number in range(len(step.outputs)) for end in ("", "_p")),
    ]


def image_names(program: ScalarProgram | None) -> list[str]:
    """Entries of a context for a program's images."""
    count = 0 if program is None else len(program.images)
    return [f"im{number}{end}" for number in range(count) for end in ("", *SIZES)]


def found_in(b: Lanes, context: Any, names: Sequence[str]) -> dict[str, Any]:
    """A context's entries: pointers, or sizes as int32."""
    found = {}
    for place, name in enumerate(names):
        entry = b.load_at(context, ir.Constant(I64, place), I64, steady=True)
        size = name in ("width", "height") or name.endswith(SIZES)
        found[name] = b.trunc(entry, I32) if size else b.inttoptr(entry, ir.PointerType())
    return found


def image_sizes(program: ScalarProgram | None, memory: Mapping[str, Any]) -> dict[str, Any]:
    """Builtins that say how large images are."""
    uses = enumerate(() if program is None else program.images)
    return {f"size.{use.name}.{axis}": memory[f"im{number}_{'wh'[axis]}"] for number, use in uses for axis in range(2)}


def _image_formats(step: DrawStep) -> tuple[Format, ...]:
    return step.image_formats[len(step.vertex.images) :]


class Fragments:
    """A function of so many pointers, of which the first is the context, and whole numbers, on its way into LLVM."""

    def __init__(self, step: DrawStep, name: str, pointers: int, numbers: int) -> None:
        self.step, self.program = step, step.fragment
        self.module = ir.Module(name)
        kind = ir.FunctionType(ir.VoidType(), [ir.PointerType()] * pointers + [I64] * numbers)
        self.function = ir.Function(self.module, kind, name)
        self.builder = Lanes(IRBuilder(self.function), lanes())
        self.memory: dict[str, Any] = {}
        builtins = [] if self.program is None else [name for name, _ in self.program.builtins]
        #: Builtins that depend on the triangle.
        self.interpolated = [name for name in builtins if is_of_triangle(name)]
        #: Of each target.
        self.channels = [] if self.program is None else [len(output.values) for output in self.program.outputs]

    def found_in(self, context: Any) -> dict[str, Any]:
        """The context's entries: pointers, or sizes as int32."""
        return found_in(self.builder, context, context_names(self.step))

    def places(self, x: Any, y: Any) -> dict[str, Any]:
        """Builtins that depend on the place alone."""
        place = {"pixel.0": x, "pixel.1": y}
        size = {"output_size.0": self.memory["width"], "output_size.1": self.memory["height"]}
        return {**place, **size, **image_sizes(self.program, self.memory)}

    def run(self, given: dict[str, Any], mask: Any) -> tuple[list[Any], Any]:
        """Run the kernel in the lanes of the mask: components of all outputs, and which of those lanes it keeps."""
        b, program = self.builder, self.program
        if program is None:
            return [], mask
        body = LaneBody(program, b, given, self.memory, mask, _image_formats(self.step))
        results = [b.spread(value) for value in body.results()]
        return results, mask if program.keep is None else b.and_(mask, body.operand(program.keep))

    def clears(self, number: int) -> list[Any]:
        """What each channel of a target is cleared to."""
        b, begin = self.builder, sum(self.channels[:number])
        places = [ir.Constant(I64, begin + channel) for channel in range(self.channels[number])]
        return [b.spread(b.load_at(self.memory["clears"], place, F32, steady=True)) for place in places]

    def pixel(self, name: str, column: Any, row: Any, numbers: int, kind: Any) -> Any:
        """Where a pixel of a picture as large as the targets lies."""
        b = self.builder
        pitch = self.memory.get(f"{name}_p", self.memory["width"])
        first = b.add(b.mul(b.sext(row, I64), b.sext(pitch, I64)), b.sext(column, I64))
        return b.gep(self.memory[name], [b.mul(first, ir.Constant(I64, numbers))], True, source_etype=kind)

    def stored(self, number: int, column: Any, row: Any, parts: Sequence[Any], mask: Any) -> None:
        """Components of target ``number`` for pixels of a row, in the lanes of the mask."""
        b, held = self.builder, self.step.output_formats[number]
        place = self.pixel(f"out{number}", column, row, len(parts), element(held))
        store(b, [rounded(b, part, held) for part in parts], place, held, mask)
