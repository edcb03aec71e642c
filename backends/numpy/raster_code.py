"""Generated code of a draw whose fragments depend on one another, with the draw's state baked in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.numpy.jit import HEADER, indented
from passgraph.backends.numpy.llvm_names import (
    EDGE1,
    EDGE2,
    NEARNESS,
    PLANE_ARGUMENTS,
    TILE,
    argument_names,
    is_varying,
)
from passgraph.backends.numpy.merge_code import COMPARE, merge_lines, stencil_compare
from passgraph.backends.numpy.numba_code import NumbaCode
from passgraph.backends.numpy.raster_shade import plane_rows
from passgraph.language.scalar import ScalarProgram, walk
from passgraph.plan.data import DrawStep

#: A longer fragment kernel is compiled apart from the loop over pixels, where it would take LLVM seconds.
MAX_INLINED_INSTRUCTIONS = 100
#: What each call passes on.
_PIECE = ("tile_x", "tile_y", "begin", "end")


def _arguments(step: DrawStep) -> dict[str, str]:
    """What is the same for all tiles, each with its kind; ``planes``, ``values`` and ``edges`` are a thread's own."""
    kinds = {"lists": "i32[1]", "made": "i32[2]", "wx": "i32[1]", "wy": "i32[1]", "wz": "f64[1]", "iw": "f64[1]",
             "vary": "f32[2]", "width": "i64", "height": "i64"}  # fmt: skip
    for index in range(len(step.fragment.images) if step.fragment is not None else 0):
        kinds |= {f"im{index}": "f32[1]", f"im{index}_w": "i64", f"im{index}_h": "i64"}
    kinds |= {f"out{index}": "f32[1]" for index in range(len(step.outputs))}
    kinds |= {"depth": "f32[1]", "stencil": "u8[1]", "floats": "f32[1]", "ints": "i32[1]"}
    return kinds | {"planes": "f64[2]", "values": "f64[1]", "edges": "i64[1]"}


def thread_scratch(step: DrawStep) -> list[NDArray[Any]]:
    """The last arguments of :func:`tile_code`, for one thread."""
    rows = plane_rows(step)
    return [np.empty((rows, 3)), np.empty(min(rows, NEARNESS)), np.empty(9, np.int64)]


def tile_code(step: DrawStep) -> NumbaCode:
    """A function that draws one tile's triangles in order."""
    text = _tile_text(step)
    programs = {} if step.fragment is None else {"PROGRAM": step.fragment}

    def find() -> Callable[..., Any]:
        names: dict[str, Any] = dict(programs)
        exec(compile(text, f"<tiles of {step.name}>", "exec"), names)
        found: Callable[..., Any] = names["tile"]
        return found

    parts = ("tile", text, *(program.key for program in programs.values()))
    return NumbaCode(parts, len(_PIECE), list(_arguments(step).values()), find)


def _tile_text(step: DrawStep) -> str:
    """A module with ``tile(...)``."""
    text = [HEADER, "from passgraph.backends.numpy.raster_triangle import edges_at, row_values, span, triangle"]
    if step.fragment is not None:
        apart = sum(1 for _ in walk(step.fragment.body)) > MAX_INLINED_INSTRUCTIONS
        text.append(f"body = body_intrinsic(PROGRAM, apart={apart}, varyings={step.varyings!r})")
    text += [
        f"def tile({', '.join([*_PIECE, *_arguments(step)])}):",
        *indented(_triangle_loop(step, _pixel_lines(step))),
    ]
    return "\n".join([*text, ""])


def _fragment_call(step: DrawStep) -> list[str]:
    """The kernel on one fragment; results in ``r``.  It takes its varyings from the triangle's corners."""
    program = step.fragment
    if program is None:
        return []
    stage = {"front_facing": "front", "fragment_depth": "z"}
    names = [stage.get(name) or _builtin(name, program) for name, _ in program.builtins if not is_varying(name)]
    given = argument_names(program, names)
    lines = []
    if step.varyings:
        lines += [
            *(f"edge{k} = values[{row}] + planes[{row}, 1] * dx" for k, row in ((1, EDGE1), (2, EDGE2))),
            *(f"near{k} = edge{k} * planes[{NEARNESS}, {k}]" for k in (1, 2)),
            # Nothing here is negative: the sum keeps its digits, however near to the eye one corner is.
            f"share = 1.0 / (planes[{NEARNESS}, 0] - edge1 - edge2 + near1 + near2)",
            "near1, near2 = near1 * share, near2 * share",
        ]
        given += PLANE_ARGUMENTS
    return [*lines, f"r = body(({', '.join(given)},))"]


def _builtin(name: str, program: ScalarProgram) -> str:
    """What a builtin of a fragment is in generated code."""
    known = {
        "pixel.0": "int32(x)", "pixel.1": "int32(y)",
        "output_size.0": "int32(width)", "output_size.1": "int32(height)",
    }  # fmt: skip
    if name in known:
        return known[name]
    image, _, axis = name.removeprefix("size.").rpartition(".")
    index = [use.name for use in program.images].index(image)
    return f"int32(im{index}_{'wh'[int(axis)]})"


def _triangle_loop(step: DrawStep, pixel: list[str]) -> list[str]:
    """Triangles of the tile, rows of the triangle, the span of each row."""
    factor, units = step.state.polygon_offset
    last = TILE - 1
    return [
        f"x_low, y_low = tile_x * {TILE}, tile_y * {TILE}",
        "for n in range(begin, end):",
        *indented(
            [
                "t = lists[n]",
                "front = made[t, 3] != 0",
                "left, top = max(int64(made[t, 4]), x_low), max(int64(made[t, 5]), y_low)",
                f"right, bottom = min(int64(made[t, 6]), x_low + {last}), min(int64(made[t, 7]), y_low + {last})",
                f"to_x, to_y = triangle(t, made, wx, wy, wz, iw, vary, {factor!r}, {units!r}, planes)",
                "edges_at(t, made, wx, wy, left, top, edges)",
                "for y in range(top, bottom + 1):",
                *indented(
                    [
                        "down = y - top",
                        "first, last = span(edges[0] + edges[6] * down, edges[1] + edges[7] * down, "
                        "edges[2] + edges[8] * down, edges[3], edges[4], edges[5], left, right)",
                        "if first > last:",
                        "    continue",
                        "row_values(planes, to_x, to_y + y, values)",
                        "z_row, z_step = values[0], planes[0, 1]",
                        "row = y * width",
                        "for x in range(first, last + 1):",
                        *indented(pixel),
                    ]
                ),
            ]
        ),
    ]


def _pixel_lines(step: DrawStep) -> list[str]:
    """One fragment: depth, tests, kernel, merge."""
    lines = ["dx = float(x)", "z = float32(min(max(z_row + z_step * dx, 0.0), 1.0))", "i = row + x"]
    program, stencil = step.fragment, step.state.stencil
    kernel = _fragment_call(step)
    has_depth = step.depth is not None
    passes = COMPARE[step.state.depth_compare].format("z", "depth[uint64(i)]") if has_depth else "True"
    tests = [f"depth_passes = {passes}"]
    tests += stencil_compare(stencil) if stencil is not None else ["stencil_passes = True"]
    write_depth = ["depth[uint64(i)] = z"] if has_depth and step.state.depth_write else []
    if program is not None and program.keep is not None:
        place = sum(len(output.values) for output in program.outputs)
        body = [
            *kernel,
            f"if r[{place}] != float32(0.0):",
            *indented(merge_lines(step, tests, write_depth, [])),
        ]
        return [*lines, *([f"if {passes}:", *indented(body)] if stencil is None else body)]
    if program is None and stencil is None and write_depth and step.state.depth_compare in ("less", "less_equal"):
        # Storing always lets LLVM vectorise the span; a tile belongs to one thread.
        return [*lines, f"depth[uint64(i)] = z if {passes} else depth[uint64(i)]"]
    return [*lines, *merge_lines(step, tests, write_depth, kernel)]
