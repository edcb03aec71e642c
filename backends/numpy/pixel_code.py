"""Generated code of a pixel pass: rows of the output, with the border apart from the interior.

In the interior every relative offset lies inside its image, so clamps leave the inner loop and LLVM vectorises it.
"""

from __future__ import annotations

from collections.abc import Callable

from passgraph.backends.numpy.channels import single_channel
from passgraph.backends.numpy.printer import HEADER, Printer, border_lines, identifier, indented
from passgraph.language import scalar as s
from passgraph.plan.data import PixelStep


def pixel_module(step: PixelStep, channels: tuple[int, ...]) -> str:
    """A module with one function ``rows``; ``channels`` are those of the outputs."""
    program = step.program
    images = [use.name for use in program.images]
    arguments = ["y0", "y1", "width", "height"]
    for index in range(len(images)):
        arguments += [f"im{index}", f"im{index}_w", f"im{index}_h"]
    arguments += [f"out{index}" for index in range(len(channels))] + ["floats", "ints"]
    builtins = {
        "pixel.0": "int32(x)", "pixel.1": "int32(y)",
        "output_size.0": "int32(width)", "output_size.1": "int32(height)",
    }  # fmt: skip
    for index, name in enumerate(images):
        builtins |= {f"size.{name}.0": f"int32(im{index}_w)", f"size.{name}.1": f"int32(im{index}_h)"}
    numbers = {name: index for index, name in enumerate(images)}
    one = single_channel(program, channels)
    inner = one or program
    count = channels[0] if one is not None else 0

    def printer(inside: bool) -> Printer:
        return Printer(inner, builtins, lambda i, p: texel_lines(i, p, numbers, program, inside, count))

    inside, border = printer(True), printer(False)
    loops = _loops(_reach(program), _interior(inside, count), _edge(border, count))
    text = [HEADER, *inside.tables(), "", f"def rows({', '.join(arguments)}):"]
    return "\n".join([*text, *indented([*inside.hoisted(), *loops]), "", "rows = compiled(rows)", ""])


def _interior(printer: Printer, count: int) -> Callable[[str, str], list[str]]:
    """The loop over a stretch of a row; by single numbers where all channels are alike."""

    def loop(first: str, last: str) -> list[str]:
        if count:
            store = f"out0[uint64(row * {count} + j)] = {printer.operand(printer.program.outputs[0].values[0])}"
            return [f"for j in range({first} * {count}, {last} * {count}):", *indented([*printer.body(), store])]
        return [f"for x in range({first}, {last}):", *indented([*printer.body(), *_stores(printer)])]

    return loop


def _edge(printer: Printer, count: int) -> Callable[[str, str], list[str]]:
    def loop(first: str, last: str) -> list[str]:
        if count:
            store = f"out0[uint64((row + x) * {count} + channel)] = {printer.operand(printer.program.outputs[0].values[0])}"
            body = [f"for channel in range({count}):", *indented([*printer.body(), store])]
        else:
            body = [*printer.body(), *_stores(printer)]
        return [f"for x in range({first}, {last}):", *indented(body)]

    return loop


def _reach(program: s.ScalarProgram) -> tuple[int, int, int, int]:
    """How far relative reads go: left, right, up, down, as counts of texels."""
    uses = [use for use in program.images if use.relative]
    left = max([0, *(-use.x[0] for use in uses)])
    right = max([0, *(use.x[1] for use in uses)])
    up = max([0, *(-use.y[0] for use in uses)])
    down = max([0, *(use.y[1] for use in uses)])
    return left, right, up, down


def _loops(
    reach: tuple[int, int, int, int], inside: Callable[[str, str], list[str]], border: Callable[[str, str], list[str]]
) -> list[str]:
    left, right, up, down = reach
    if not any(reach):
        return ["for y in range(y0, y1):", *indented(["row = y * width", *inside("0", "width")])]
    return [
        f"left = min({left}, width)",
        f"right = max(left, width - {right})",
        "for y in range(y0, y1):",
        *indented(
            [
                "row = y * width",
                # Near the top and the bottom the border loop takes the whole row: two pieces around an empty middle.
                f"inner = {up} <= y < height - {down}",
                "first = left if inner else width",
                "last = right if inner else width",
                *inside("first", "last"),
                "for part in range(2):",
                *indented(["begin = 0 if part == 0 else last", "end = first if part == 0 else width", *border("begin", "end")]),
            ]
        ),
    ]


def _stores(printer: Printer) -> list[str]:
    lines = []
    for number, output in enumerate(printer.program.outputs):
        count = len(output.values)
        for channel, value in enumerate(output.values):
            lines.append(f"out{number}[uint64((row + x) * {count} + {channel})] = {printer.operand(value)}")
    return lines


def texel_lines(
    i: s.LoadTexel, printer: Printer, numbers: dict[str, int], program: s.ScalarProgram, inside: bool, alike: int = 0
) -> list[str]:
    """Statements that read a texel.  ``alike``: one channel stands for this many, indexed by ``j`` or ``channel``."""
    number = numbers[i.image]
    channels = program.image(i.image).channels
    array, width, height = f"im{number}", f"im{number}_w", f"im{number}_h"
    tag = identifier(next(printer.operand(v) for v in i.to if v is not None))
    if i.relative and inside:
        across, down = _offset(i.x, printer), _offset(i.y, printer)
        if alike:
            at = [f"row * {channels} + j + ({across} + {down} * width) * {channels}"]
        else:
            at = [f"(row + x + {across} + {down} * width) * {channels} + {channel}" for channel in range(channels)]
        return [f"{printer.operand(v)} = {array}[uint64({a})]" for a, v in zip(at, i.to, strict=False) if v is not None]
    x = f"(x + {_offset(i.x, printer)})" if i.relative else _offset(i.x, printer)
    y = f"(y + {_offset(i.y, printer)})" if i.relative else _offset(i.y, printer)
    lines = [*border_lines(f"{tag}_x", x, width, i.border), *border_lines(f"{tag}_y", y, height, i.border)]
    lines.append(f"{tag}_i = ({tag}_y * {width} + {tag}_x) * {channels}")
    if i.border == "zero":
        lines.append(f"{tag}_in = ({tag}_x == {x}) & ({tag}_y == {y})")
    for channel, v in enumerate(i.to):
        if v is not None:
            read = f"{array}[uint64({tag}_i + {'channel' if alike else channel})]"
            read = f"({read} if {tag}_in else float32(0.0))" if i.border == "zero" else read
            lines.append(f"{printer.operand(v)} = {read}")
    return lines


def _offset(value: s.Operand, printer: Printer) -> str:
    """A texel coordinate or offset as int64."""
    return f"({int(value.value)})" if isinstance(value, s.Lit) else f"int64({printer.operand(value)})"
