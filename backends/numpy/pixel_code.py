"""Generated code of a pixel pass: rows of the output, with the border apart from the interior.

In the interior every relative offset lies inside its image, so clamps leave the inner loop and LLVM vectorises it.
"""

from __future__ import annotations

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
    inside = Printer(program, builtins, lambda i, p: texel_lines(i, p, numbers, program, True))
    border = Printer(program, builtins, lambda i, p: texel_lines(i, p, numbers, program, False))
    reach = _reach(program)
    store = _stores(program, inside)
    loops = _loops(reach, [*inside.body(), *store], [*border.body(), *store])
    text = [HEADER, *inside.tables(), "", f"def rows({', '.join(arguments)}):"]
    return "\n".join([*text, *indented([*inside.hoisted(), *loops]), "", "rows = compiled(rows)", ""])


def _reach(program: s.ScalarProgram) -> tuple[int, int, int, int]:
    """How far relative reads go: left, right, up, down, as counts of texels."""
    uses = [use for use in program.images if use.relative]
    left = max([0, *(-use.x[0] for use in uses)])
    right = max([0, *(use.x[1] for use in uses)])
    up = max([0, *(-use.y[0] for use in uses)])
    down = max([0, *(use.y[1] for use in uses)])
    return left, right, up, down


def _loops(reach: tuple[int, int, int, int], inside: list[str], border: list[str]) -> list[str]:
    left, right, up, down = reach
    if not any(reach):
        return ["for y in range(y0, y1):", *indented(["row = y * width", "for x in range(0, width):", *indented(inside)])]
    return [
        f"left = min({left}, width)",
        f"right = max(left, width - {right})",
        "for y in range(y0, y1):",
        *indented(
            [
                "row = y * width",
                # Wholly inside only where the row itself is; else the border loop takes the whole row.
                f"inner = {up} <= y < height - {down}",
                "first = left if inner else width",
                "last = right if inner else width",
                "for x in range(0, first):",
                *indented(border),
                "for x in range(first, last):",
                *indented(inside),
                "for x in range(last, width):",
                *indented(border),
            ]
        ),
    ]


def _stores(program: s.ScalarProgram, printer: Printer) -> list[str]:
    lines = []
    for number, output in enumerate(program.outputs):
        count = len(output.values)
        for channel, value in enumerate(output.values):
            lines.append(f"out{number}[uint64((row + x) * {count} + {channel})] = {printer.operand(value)}")
    return lines


def texel_lines(i: s.LoadTexel, printer: Printer, numbers: dict[str, int], program: s.ScalarProgram, inside: bool) -> list[str]:
    number = numbers[i.image]
    channels = program.image(i.image).channels
    array, width, height = f"im{number}", f"im{number}_w", f"im{number}_h"
    tag = identifier(next(printer.operand(v) for v in i.to if v is not None))
    if i.relative and inside:
        at = f"(row + {_sum('x', i.x, printer)} + {_offset_rows(i.y, printer)}) * {channels}"
        return [
            f"{printer.operand(v)} = {array}[uint64({at} + {channel})]" for channel, v in enumerate(i.to) if v is not None
        ]
    x = f"(x + int64({printer.operand(i.x)}))" if i.relative else f"int64({printer.operand(i.x)})"
    y = f"(y + int64({printer.operand(i.y)}))" if i.relative else f"int64({printer.operand(i.y)})"
    lines = [*border_lines(f"{tag}_x", x, width, i.border), *border_lines(f"{tag}_y", y, height, i.border)]
    at = f"({tag}_y * {width} + {tag}_x) * {channels}"
    lines.append(f"{tag}_i = {at}")
    if i.border == "zero":
        lines.append(f"{tag}_in = ({tag}_x == {x}) & ({tag}_y == {y})")
    for channel, v in enumerate(i.to):
        if v is not None:
            read = f"{array}[uint64({tag}_i + {channel})]"
            read = f"({read} if {tag}_in else float32(0.0))" if i.border == "zero" else read
            lines.append(f"{printer.operand(v)} = {read}")
    return lines


def _sum(base: str, offset: s.Operand, printer: Printer) -> str:
    if isinstance(offset, s.Lit):
        return f"{base} + {int(offset.value)}"
    return f"{base} + int64({printer.operand(offset)})"


def _offset_rows(offset: s.Operand, printer: Printer) -> str:
    if isinstance(offset, s.Lit):
        return f"({int(offset.value)}) * width"
    return f"int64({printer.operand(offset)}) * width"
