"""Generated code of a draw: the vertex stage, and tiles of fragments with the draw's state baked in."""

from __future__ import annotations

from passgraph.backends.numpy.jit import HEADER, indented
from passgraph.backends.numpy.llvm_names import argument_names
from passgraph.backends.numpy.merge_code import merge_lines, stencil_compare
from passgraph.backends.numpy.pixel_code import builtin
from passgraph.backends.numpy.raster_setup import TILE
from passgraph.language.scalar import walk
from passgraph.plan.data import DrawStep

#: A longer fragment kernel is compiled apart from the loop over pixels, where it would take LLVM seconds.
MAX_INLINED_INSTRUCTIONS = 100
_COMPARE = {
    "never": "False", "less": "{0} < {1}", "equal": "{0} == {1}", "less_equal": "{0} <= {1}", "greater": "{0} > {1}",
    "not_equal": "{0} != {1}", "greater_equal": "{0} >= {1}", "always": "True",
}  # fmt: skip

_SPAN = """\
for edge in range(3):
    value = e0 if edge == 0 else (e1 if edge == 1 else e2)
    step = s0 if edge == 0 else (s1 if edge == 1 else s2)
    if step == 0:
        if value < 0:
            last = first - 1
    elif step > 0:
        if value < 0:
            first = max(first, left + int64(np.ceil(-value / step)))
    else:
        if value < 0:
            last = first - 1
        else:
            last = min(last, left + int64(np.floor(value / -step)))"""


def attributes_of(step: DrawStep) -> list[str]:
    """Mesh attributes that the vertex program reads, in the order of the arguments of ``vertices``."""
    return sorted({name.split(".")[1] for name, _ in step.vertex.builtins if name.startswith("vertex.")})


def vertex_module(step: DrawStep) -> tuple[str, dict[str, object]]:
    """A module with ``vertices(first, last, attributes…, floats, ints, clip, varyings)``."""
    program = step.vertex
    names = attributes_of(step)
    builtins = [f"a_{name.split('.')[1]}[v, {name.split('.')[2]}]" for name, _ in program.builtins]
    given = ", ".join(argument_names(program, builtins))
    stores = [f"clip[v, {c}] = r[{c}]" for c in range(4)]
    stores += [f"varyings[v, {c}] = r[{c + 4}]" for c in range(len(step.varyings))]
    arguments = ", ".join(["first", "last", *(f"a_{n}" for n in names), "floats", "ints", "clip", "varyings"])
    lines = [
        "x = y = row = width = j = 0",
        "for v in range(first, last):",
        *indented([f"r = body(({given},))", *stores]),
    ]
    text = [HEADER, "body = body_intrinsic(PROGRAM, False)", f"def vertices({arguments}):", *indented(lines)]
    return "\n".join([*text, "vertices = compiled(vertices)", ""]), {"PROGRAM": program}


def tile_module(step: DrawStep) -> tuple[str, dict[str, object]]:
    """A module with ``tile(...)``, which draws one tile's triangles in order."""
    images = len(step.fragment.images) if step.fragment is not None else 0
    arguments = [
        "tile_x",
        "tile_y",
        "begin",
        "end",
        "lists",
        "made",
        "wx",
        "wy",
        "wz",
        "iw",
        "vary",
        "width",
        "height",
    ]
    for index in range(images):
        arguments += [f"im{index}", f"im{index}_w", f"im{index}_h"]
    arguments += [f"out{index}" for index in range(len(step.outputs))]
    arguments += ["depth", "stencil", "floats", "ints"]
    text = [HEADER]
    if step.fragment is not None:
        apart = sum(1 for _ in walk(step.fragment.body)) > MAX_INLINED_INSTRUCTIONS
        text.append(f"body = body_intrinsic(PROGRAM, False, apart={apart})")
    text += [
        f"def tile({', '.join(arguments)}):",
        *indented(["j = 0", *_triangle_loop(step, _pixel_lines(step))]),
    ]
    programs: dict[str, object] = {} if step.fragment is None else {"PROGRAM": step.fragment}
    return "\n".join([*text, "tile = compiled(tile)", ""]), programs


def _fragment_call(step: DrawStep) -> list[str]:
    """The kernel on one fragment; results in ``r``."""
    program = step.fragment
    if program is None:
        return []
    varyings = {f"varying.{name}": f"float32((q{i} + q{i}x * dx) * w)" for i, name in enumerate(step.varyings)}
    stage = {"front_facing": "front", "fragment_depth": "z"}
    names = [varyings.get(name) or stage.get(name) or builtin(name, program) for name, _ in program.builtins]
    lines = ["w = 1.0 / (i_row + ipx * dx)"] if step.varyings else []
    return [*lines, f"r = body(({', '.join(argument_names(program, names))},))"]


def _triangle_loop(step: DrawStep, pixel: list[str]) -> list[str]:
    """Triangles of the tile, rows of the triangle, the span of each row."""
    varyings = range(len(step.varyings))
    planes = (
        [_plane("zp", "wz[a]", "wz[b]", "wz[c]"), _plane("ip", "iw[a]", "iw[b]", "iw[c]")]
        if step.varyings
        else [_plane("zp", "wz[a]", "wz[b]", "wz[c]")]
    )
    for i in varyings:
        planes.append(_plane(f"p{i}", *(f"vary[{v}, {i}] * iw[{v}]" for v in "abc")))
    rows = ["z_row = zp + zpx * ox + zpy * (oy + y)"]
    if step.varyings:
        rows.append("i_row = ip + ipx * ox + ipy * (oy + y)")
        rows += [f"q{i} = p{i} + p{i}x * ox + p{i}y * (oy + y)" for i in varyings]
        rows += [f"q{i}x = p{i}x" for i in varyings]
    return [
        f"x_low, y_low = tile_x * {TILE}, tile_y * {TILE}",
        "for n in range(begin, end):",
        *indented(
            [
                "t = lists[n]",
                "a, b, c = made[t, 0], made[t, 1], made[t, 2]",
                "front = made[t, 3] != 0",
                "x0, y0 = int64(wx[a]), int64(wy[a])",
                "x1, y1 = int64(wx[b]) - x0, int64(wy[b]) - y0",
                "x2, y2 = int64(wx[c]) - x0, int64(wy[c]) - y0",
                "left, top = max(int64(made[t, 4]), x_low), max(int64(made[t, 5]), y_low)",
                f"right = min(int64(made[t, 6]), x_low + {TILE - 1})",
                f"bottom = min(int64(made[t, 7]), y_low + {TILE - 1})",
                "scale = 256.0 / float(x1 * y2 - x2 * y1)",
                # The plane's origin is the first corner; ox and oy lead from it to a pixel's centre.
                "ox, oy = 0.5 - x0 / 256.0, 0.5 - y0 / 256.0",
                *(line for plane in planes for line in plane),
                *_offset(step),
                # Edge a→b, b→c, c→a: positive inside; minus one where the edge is neither top nor left.
                "s0, s1, s2 = -y1 * 256, -(y2 - y1) * 256, y2 * 256",
                "r0, r1, r2 = x1 * 256, (x2 - x1) * 256, -x2 * 256",
                "px, py = left * 256 + 128 - x0, top * 256 + 128 - y0",
                "g0 = x1 * py - y1 * px - (0 if y1 < 0 or (y1 == 0 and x1 > 0) else 1)",
                "g1 = (x2 - x1) * (py - y1) - (y2 - y1) * (px - x1) "
                "- (0 if y2 - y1 < 0 or (y2 == y1 and x2 > x1) else 1)",
                "g2 = -x2 * (py - y2) + y2 * (px - x2) - (0 if -y2 < 0 or (y2 == 0 and -x2 > 0) else 1)",
                "for y in range(top, bottom + 1):",
                *indented(
                    [
                        "down = y - top",
                        "e0, e1, e2 = g0 + r0 * down, g1 + r1 * down, g2 + r2 * down",
                        "first, last = left, right",
                        *_SPAN.splitlines(),
                        "if first > last:",
                        "    continue",
                        *rows,
                        "row = y * width",
                        "for x in range(first, last + 1):",
                        *indented(pixel),
                    ]
                ),
            ]
        ),
    ]


def _plane(name: str, a: str, b: str, c: str) -> list[str]:
    """Value at the first corner and its change along x and y, in float64."""
    return [
        f"{name} = float({a})",
        f"d1, d2 = {b} - {name}, {c} - {name}",
        f"{name}x = (d1 * y2 - d2 * y1) * scale",
        f"{name}y = (d2 * x1 - d1 * x2) * scale",
    ]


def _offset(step: DrawStep) -> list[str]:
    factor, units = step.state.polygon_offset
    if factor == 0 and units == 0:
        return []
    return [
        "deepest = max(abs(wz[a]), abs(wz[b]), abs(wz[c]))",
        "smallest = 2.0 ** (np.floor(np.log2(deepest)) - 23.0) if deepest > 0.0 else 0.0",
        f"zp = zp + {factor!r} * max(abs(zpx), abs(zpy)) + {units!r} * smallest",
    ]


def _pixel_lines(step: DrawStep) -> list[str]:
    """One fragment: depth, tests, kernel, merge."""
    lines = ["dx = float(x)", "z = float32(min(max(z_row + zpx * dx, 0.0), 1.0))", "i = row + x"]
    program, stencil = step.fragment, step.state.stencil
    kernel = _fragment_call(step)
    has_depth = step.depth is not None
    passes = _COMPARE[step.state.depth_compare].format("z", "depth[uint64(i)]") if has_depth else "True"
    tests = [f"depth_passes = {passes}"]
    tests += stencil_compare(stencil, _COMPARE) if stencil is not None else ["stencil_passes = True"]
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
