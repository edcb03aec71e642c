"""Generated code of a pixel pass: loops over rows of the output, with the border apart from the interior.

In the interior every relative offset lies inside its image, so clamps leave the inner loop and LLVM vectorises it.
"""

from __future__ import annotations

from collections.abc import Callable

from passgraph.backends.numpy.channels import single_channel
from passgraph.backends.numpy.jit import HEADER, indented
from passgraph.backends.numpy.llvm_names import argument_names
from passgraph.language import scalar as s
from passgraph.plan.data import PixelStep


def pixel_module(step: PixelStep, channels: tuple[int, ...]) -> tuple[str, dict[str, object]]:
    """Text of a module with one function ``rows``, and the names to put into it; ``channels`` are the outputs'."""
    program = step.program
    one = single_channel(program, channels)
    inner, count = (one, channels[0]) if one is not None else (program, 0)
    arguments = ["y0", "y1", "width", "height"]
    for index in range(len(program.images)):
        arguments += [f"im{index}", f"im{index}_w", f"im{index}_h"]
    arguments += [f"out{index}" for index in range(len(channels))] + ["floats", "ints"]
    tuple_text = ", ".join(argument_names(inner, [builtin(name, program) for name, _ in inner.builtins]))
    interior, edge = _interior(inner, tuple_text, count), _edge(inner, tuple_text, count)
    lines = _loops(_reach(program), interior, edge)
    text = [
        HEADER,
        f"inside = body_intrinsic(PROGRAM, True, {count})",
        f"border = body_intrinsic(PROGRAM, False, {count})",
        f"def rows({', '.join(arguments)}):",
        *indented(lines),
        "rows = compiled(rows)",
        "",
    ]
    return "\n".join(text), {"PROGRAM": inner}


def builtin(name: str, program: s.ScalarProgram) -> str:
    """What a builtin of a pixel pass is in generated code."""
    known = {
        "pixel.0": "int32(x)", "pixel.1": "int32(y)",
        "output_size.0": "int32(width)", "output_size.1": "int32(height)",
    }  # fmt: skip
    if name in known:
        return known[name]
    image, _, axis = name.removeprefix("size.").rpartition(".")
    index = [use.name for use in program.images].index(image)
    return f"int32(im{index}_{'wh'[int(axis)]})"


def _interior(program: s.ScalarProgram, given: str, count: int) -> Callable[[str, str], list[str]]:
    """The loop over a stretch of a row; by single numbers where all channels are alike."""

    def loop(first: str, last: str) -> list[str]:
        if count:
            body = [f"r = inside(({given},))", f"out0[uint64(row * {count} + j)] = r[0]"]
            return ["x = 0", f"for j in range({first} * {count}, {last} * {count}):", *indented(body)]
        body = ["j = 0", f"r = inside(({given},))", *_stores(program)]
        return [f"for x in range({first}, {last}):", *indented(body)]

    return loop


def _edge(program: s.ScalarProgram, given: str, count: int) -> Callable[[str, str], list[str]]:
    def loop(first: str, last: str) -> list[str]:
        if count:
            call = [f"r = border(({given},))", f"out0[uint64((row + x) * {count} + j)] = r[0]"]
            body = [f"for j in range({count}):", *indented(call)]
        else:
            body = ["j = 0", f"r = border(({given},))", *_stores(program)]
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
    reach: tuple[int, int, int, int],
    inside: Callable[[str, str], list[str]],
    border: Callable[[str, str], list[str]],
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
                *indented(
                    [
                        "begin = 0 if part == 0 else last",
                        "end = first if part == 0 else width",
                        *border("begin", "end"),
                    ]
                ),
            ]
        ),
    ]


def _stores(program: s.ScalarProgram) -> list[str]:
    lines, place = [], 0
    for number, output in enumerate(program.outputs):
        count = len(output.values)
        for channel in range(count):
            lines.append(f"out{number}[uint64((row + x) * {count} + {channel})] = r[{place}]")
            place += 1
    return lines
