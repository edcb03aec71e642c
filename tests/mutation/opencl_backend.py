"""Mistakes in the opencl backend."""

from __future__ import annotations

from tests.mutation.mutant import Mutant

EDGES = ("coverage/edges", "coverage/spokes", "coverage/quad", "coverage/fan")
SEEN = ("coverage/quad", "coverage/row 0", "draw states/cull none")
PICTURES = ("pictures/rgba32f 7x5", "pictures/rgba32f 70x66", "pictures/rgba32f")

#: Kernels round what they store, so that a store of its own rounds nothing but blends, where a step is allowed.
BLENDED = "a blend may fall on either neighbour in the format"


def _o(function: str, old: str, new: str, *catchers: str, harmless: str = "") -> Mutant:
    return Mutant(function, old, new, "opencl", catchers, harmless)


MUTANTS = (
    _o(
        "DrawPassRunner.__call__",
        "for image in images[:first]]",
        "for image in reversed(images[:first])]",
        "draws/scatter",
    ),
    _o("pg_sub", "as_uint(a) - as_uint(b)", "as_uint(b) - as_uint(a)", "operations/sub of ints"),
    _o("pg_shl", "(as_uint(b) & 31u)", "(as_uint(b) & 15u)", "operations/shift_left"),
    _o(
        "pg_isnan",
        "(as_uint(x) & 0x7FFFFFFFu) > 0x7F800000u",
        "(as_uint(x) & 0x7FFFFFFFu) >= 0x7F800000u",
        "operations/isnan",
    ),
    _o("pg_to_int", "return x >= 2147483648.0f ? 2147483647 : inside;", "return inside;", "operations/to_int"),
    _o(
        "pg_load_half",
        "5192296858534827628530496329220096.0f",
        "2596148429267413814265248164610048.0f",
        "pictures/",
    ),
    _o(
        "pg_store_half",
        "size + 0xFFFu + ((size >> 13) & 1u)",
        "size",
        "draw states/blend into rgba16f",
        harmless=BLENDED,
    ),
    _o(
        "pg_store_half",
        "size + 0xFFFu + ((size >> 13) & 1u)",
        "size + 0x1000u",
        "draw states/blend into rgba16f",
        harmless=BLENDED,
    ),
    _o("pg_store_half", "((bits >> 16) & 0x8000u)", "0u", "pictures/"),
    _o(
        "OpenCLPrinter._bordered", 'f"clamp({position}, 0, {count - 1})"', 'f"clamp({position}, 0, {count})"', *PICTURES
    ),
    _o("OpenCLPrinter.texel", "{x} >= 0 && {x} < {width}", "{x} >= 0 && {x} <= {width}", *PICTURES),
    _o("OpenCLPrinter._moved", "{'+' if number > 0 else '-'}", "{'-' if number > 0 else '+'}", *PICTURES),
    _o(
        "OpenCLPrinter.builtin",
        "return str(self.images[image][1].size[int(axis)])",
        "return str(self.images[image][1].size[1 - int(axis)])",
        "language/parameters",
        "pictures/33x18",
    ),
    _o("SIGNS", '"less": "<"', '"less": "<="', "draw states/stencil less", "draw states/depth less"),
    _o(
        "stencil_update",
        '"increment": f"min({old} + 1, 255)"',
        '"increment": f"({old} + 1)"',
        "draw states/stencil increment",
    ),
    _o("stencil_update", '"invert": f"(~{old})"', '"invert": f"(-{old})"', "draw states/stencil invert"),
    _o("stencil_update", "({old} & {keep}) | ({new}", "({new}", "draws/stencil", "draw states/stencil"),
    _o("CULL", '"back": 1, "front": 2', '"back": 2, "front": 1', "draw states/cull"),
    _o("pg_place", "near1 / total, near2 / total", "near1, near2", "draw states/cull none, lean"),
    _o(
        "_tests",
        "return (reject, write) if discards else",
        'return (f"{reject}\\n{write}", "") if discards else',
        "draws/discard",
    ),
    _o("_tests", 'return ("", text) if discards else (text, "")', 'return (text, "")', "draw states/discard"),
    _o("_write", "if mask[k]:", "if True:", "draw states/mask"),
    _o(
        "_clear",
        "pg_stencils[at] = {step.state.clear_stencil & 255};",
        "pg_stencils[at] = 0;",
        "draw states/clears",
    ),
    _o(
        "_tests",
        'masked = f"((int)pg_stencils[at] & {stencil.read_mask})"',
        'masked = "((int)pg_stencils[at])"',
        "draw states/stencil",
    ),
    _o(
        "pg_edge",
        "(long)d.x * (256 * y + 128 - a.y) - (long)d.y * (256 * x + 128 - a.x)",
        "(long)d.x * (256 * y - a.y) - (long)d.y * (256 * x - a.x)",
        *EDGES,
    ),
    _o(
        "pg_edge",
        "return value - (d.y < 0 || (d.y == 0 && d.x > 0) ? 0 : 1);",
        "return value - (d.y > 0 || (d.y == 0 && d.x < 0) ? 0 : 1);",
        *EDGES,
    ),
    _o("pg_edge", "return value - (d.y < 0 || (d.y == 0 && d.x > 0) ? 0 : 1);", "return value;", *EDGES),
    _o(
        "pg_tiles",
        "low1 = pg_lowered(c, a), low2",
        "low1 = 0, low2",
        "draw states/",
        "coverage/",
    ),
    _o("pg_tiles", "f1 -= dx1, f2 -= dx2) {", "f1 += dx1, f2 -= dx2) {", *SEEN),
    _o("pg_place", "depth = depth < 0.0f ? 0.0f : (1.0f < depth ? 1.0f : depth);", "", "draw states/polygon offset"),
    _o(
        "pg_tiles",
        "for (int x = left; x <= right; ++x) { pg_clear_pixel",
        "for (int x = left; x < right; ++x) { pg_clear_pixel",
        *SEEN,
    ),
    _o(
        "pg_distance",
        "if (plane == 0) { return z + w; }",
        "if (plane == 0) { return w; }",
        "coverage/beyond",
        "coverage/through",
    ),
    _o(
        "pg_clip",
        "share = -e / (d - e), rest = d / (d - e);",
        "share = d / (d - e), rest = -e / (d - e);",
        "coverage/beyond",
        "coverage/through",
    ),
    _o("pg_emit", "x[i] = rint(", "x[i] = floor(", *SEEN, "coverage/"),
    _o("pg_emit", "(0.5f - up * 0.5f)", "(0.5f + up * 0.5f)", *SEEN),
    _o("pg_emit", "(min(min(p, q), r) + 127) >> 8", "(min(min(p, q), r) + 128) >> 8", *EDGES),
    _o(
        "pg_emit",
        "(max(max(p, q), r) - 128) >> 8",
        "(max(max(p, q), r) - 129) >> 8",
        *EDGES,
        harmless="a centre on the right or bottom side of a triangle's box lies on no top or left edge",
    ),
    _o("pg_emit", "(max(max(p, q), r) - 128) >> 8", "(max(max(p, q), r) - 384) >> 8", *EDGES),
    _o("pg_slots", "? 1 : 7;", "? 1 : 1;", "coverage/beyond", "coverage/through", "coverage/one triangle"),
    _o("pg_depth_offset", "* inverse_area * 256.0f;", "* inverse_area;", "draw states/polygon offset"),
    _o("pg_depth_offset", "ldexp(1.0f, exponent - 23)", "ldexp(1.0f, exponent - 22)", "draw states/polygon offset"),
    _o("pg_emit", "cull == 1 + front", "cull == 2 - front", "draw states/cull"),
    _o("pg_send", "into[1] = front ? c : b;", "into[1] = b;", "draw states/cull none", "draw states/cull back"),
    _o("pg_emit_clipped", "b[4 + k], c[4 + k]", "c[4 + k], b[4 + k]", "coverage/beyond", "coverage/through"),
    _o("pg_emit", "int front = area < 0 ? 1 : 0;", "int front = area > 0 ? 1 : 0;", "draw states/cull"),
    _o(
        "pg_touches",
        "int x = d.y > 0 ? low.x : high.x, y = d.x > 0 ? high.y : low.y;",
        "int x = d.y < 0 ? low.x : high.x, y = d.x > 0 ? high.y : low.y;",
        *SEEN,
    ),
    _o(
        "pg_fill",
        "for (int slot = starts[id]; slot < starts[id + 1]; ++slot) {",
        "for (int slot = starts[id + 1] - 1; slot >= starts[id]; --slot) {",
        "draws/the last",
    ),
    _o("pg_scan", "*bin = total;\n", "*bin = here;\n", "draw states/cull none", "coverage/grid"),
    _o(
        "Triangles._tiles",
        "self.cleared = True",
        "self.cleared = False",
        "coverage/",
        harmless="a mesh is drawn in parts only where its lists pass 256 MiB",
    ),
    _o(
        "OpenCLBackend.read",
        "self.cl.enqueue_copy(self.queue, array, buffer, is_blocking=True)",
        "self.cl.enqueue_copy(self.queue, array, buffer, is_blocking=False)",
        "sequences/a long",
        harmless="pyopencl waits for a copy to the host when its event is dropped, which here is at once",
    ),
    _o("Uniforms.update", "if raw != self.held[i]:", "if not self.held[i]:", "sequences/static"),
    _o(
        "OpenCLBackend.make",
        "self.fill(storage.stencil, pixels)",
        "pass",
        "draw states/clears",
        harmless="the first draw into a stencil clears it, in every plan",
    ),
    _o("_around_place", "j % {columns} < {x} ?", "j % {columns} <= {x} ?", "language/a wide"),
    _o("ImageLayout.distance", "y * placement.row", "(y + 1) * placement.row", "language/a wide"),
    _o("cut_of", "x + width - run, y", "x + width - run - 1, y", "language/a wide"),
    _o(
        "inner_block",
        'max([0, *(getattr(use, axis)[1] for use in uses)]) for axis in "xy")',
        '0 for axis in "xy")',
        "language/a wide",
    ),
    _o("OpenCLPrinter.stored", "(int){self.operand(counted)}", "(int)({self.operand(counted)} - 0.5f)", "pictures/"),
    _o(
        "OpenCLPrinter.stored",
        "steps.value == format_.steps",
        "True",
        harmless="formats quantise last, and by their own steps",
    ),
    Mutant(
        "store_expression",
        "_sat_rte(({value})",
        "_sat_rtz(({value})",
        "opencl",
        ("draw states/blend into rgba8", "pictures/"),
    ),
    Mutant(
        "_clear",
        "clear_colour(values, layout.channels, layout.format.srgb)",
        "clear_colour(values, layout.channels, False)",
        "opencl",
        ("draw states/draw into rgba8_srgb",),
    ),
    _o("pg_bin", "number <= (float)BINS", "number < (float)BINS", "plans/a histogram", "plans/counts of"),
    _o("pg_bin", "(float)near == number ? near : 0", "near", "plans/counts of wild"),
    _o("pg_counts", "min(PIECE, WIDTH - x)", "PIECE", "plans/a histogram"),
    _o("pg_counts", "y < HEIGHT; x += PIECE", "y < HEIGHT - 1; x += PIECE", "plans/a histogram"),
    _o("_store", "{k * quarter + channel + 1}", "{channel + 1}", "plans/a histogram"),
    _o("pg_counts", "tables[3][entries[i + 3]] += 1;", "tables[3][entries[i + 2]] += 1;", "plans/a histogram"),
)
