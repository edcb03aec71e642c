"""Mistakes in the webgpu backend."""

from __future__ import annotations

from tests.mutation.mutant import Mutant

PICTURES = ("pictures/rgba32f 7x5", "pictures/rgba32f 70x66", "pictures/rgba32f")
SEEN = ("coverage/quad", "coverage/row 0", "draw states/cull none")


def _w(function: str, old: str, new: str, *catchers: str, harmless: str = "") -> Mutant:
    return Mutant(function, old, new, "webgpu", catchers, harmless)


MUTANTS = (
    _w("FUNCTIONS", "& 0x7fffffffu) > 0x7f800000u", "& 0x7fffffffu) >= 0x7f800000u", "operations/isnan"),
    _w("FUNCTIONS", "(bitcast<u32>(x) & 0x7fffffffu) == 0x7f", "bitcast<u32>(x) == 0x7f", "operations/isinf"),
    _w("FUNCTIONS", "select(2147483647, i, x < 2147483648.0)", "i", "operations/to_int"),
    _w("FUNCTIONS", ", 0, pg_isnan(x));", ", 1, pg_isnan(x));", "operations/to_int"),
    _w("FUNCTIONS", "select(q, q - 1, r != 0", "select(q, q + 1, r != 0", "operations/floor_divide"),
    _w("FUNCTIONS", "select(r, r + b, r != 0", "select(r, r, r != 0", "operations/int_mod"),
    _w("FUNCTIONS", "let r = select(q, q + b, q < 0);", "let r = q;", "language/a wide neighbourhood, repeat"),
    _w("_LIKE_C", '"round({0})"', '"floor({0} + 0.5)"', "operations/round"),
    _w(
        "_LIKE_C",
        '"({0} >> (bitcast<u32>({1}) & 31u))"',
        '"({0} >> (bitcast<u32>({1}) & 15u))"',
        "operations/shift_right",
    ),
    _w("_LIKE_C", '"max({0}, 0 - {0})"', '"{0}"', "operations/abs of ints", "operations/abs"),
    _w(
        "WGSL._comparison",
        'compared[hide] = f"bitcast<f32>(bitcast<u32>({compared[hide]}) | pg_nil2)"',
        "pass",
        harmless="lavapipe keeps the choice; others make a minimum of it, which NaN tells apart",
    ),
    _w(
        "WGSL._comparison",
        "== {compared[1]}) | pg_nil) == 0u)",
        "== {compared[1]}) | pg_nil) != 0u)",
        "operations/not_equal",
    ),
    _w(
        "WGSL._comparison",
        'return text if op.to.id in self.combined.conditions else self.hidden(text, "bool")',
        "return text",
        harmless="lavapipe keeps the comparison; others turn it around where it is negated, which NaN tells apart",
    ),
    _w(
        "ShaderPrinter.operation",
        "{'!' if op.operation == 'equal' else ''}pg_isnan",
        "!pg_isnan",
        "language/identities",
    ),
    _w(
        "ShaderPrinter.unforeseen",
        "return self.hidden(text) if zero else text",
        "return text",
        "language/written zeros",
    ),
    _w("Foreseen.may_choose_zero", "operand.id in self.choices", "False", "language/written zeros"),
    _w(
        "WGSL.operation",
        "return self.hidden(text) if op.to.id in self.combined.results else text",
        "return text",
        "language/combined",
    ),
    _w("Combined._combines", 'if name == "add":', 'if name == "add" and False:', "language/combined"),
    _w("Combined._combines", 'name in ("sub", "neg", "floor")', 'name in ("floor",)', "language/combined"),
    _w("Combined.same", "return one == other or", "return False and", "language/combined"),
    _w(
        "WGSL.texel",
        'fetch = f"round({fetch} * {steps}.0) / {steps}.0"',
        "pass",
        harmless="the bounds allow a unit in the last place; tests/cross/test_passes.py compares the bits",
    ),
    _w(
        "ShaderPrinter._place",
        "{self.uint}({coordinate}) < {self.uint}",
        "{self.uint}({coordinate}) <= {self.uint}",
        *PICTURES,
    ),
    _w("ShaderPrinter.center", "({number} + 0.5) *", "({number} - 0.5) *", *PICTURES),
    _w("ShaderPrinter._place", "{'-' if turned else '+'}", "-", *PICTURES),
    _w("ShaderPrinter._varying", "self._stepped(inverse_w, axes)", "inverse_w", "derivatives/"),
    _w("ShaderPrinter._stepped", "1 - 2 *", "2 * ", "derivatives/"),
    _w("WGSL.results", "(pg_position.z + pg_position.w) * 0.5", "pg_position.z", "draw states/depth less"),
    _w(
        "WGSL.results",
        "if (!{self.operand(program.keep)})",
        "if ({self.operand(program.keep)})",
        "draws/discard",
        "draw states/discard",
    ),
    _w(
        "Stage.send",
        "self.backend.flush()",
        "pass",
        "sequences/",
        "plans/",
        harmless="passes run once in a run of a program; tests/backends/test_webgpu.py runs one twice",
    ),
    _w("guard_band", "side), 1)", "side), 2)", harmless="no target of the suite is so large"),
    _w(
        "_component",
        'if equation in ("min", "max"):',
        "if False:",
        "draw states/blend equation min",
        "draw states/blend",
    ),
    _w("depth_stencil", '"depth_bias": int(units)', '"depth_bias": 0', "draw states/polygon offset"),
    _w(
        "depth_stencil",
        '"depth_bias_slope_scale": factor',
        '"depth_bias_slope_scale": 0.0',
        "draw states/polygon offset",
    ),
    _w("depth_stencil", "_operation(stencil.depth_fail)", "_operation(stencil.fail)", "draw states/stencil"),
    _w(
        "depth_stencil",
        '"stencil_write_mask": stencil.write_mask',
        '"stencil_write_mask": 255',
        "draw states/stencil",
        "draws/",
    ),
    _w("primitive", '"front_face": "ccw"', '"front_face": "cw"', "draw states/cull back"),
    _w(
        "Mesh.bind",
        "encoded.set_vertex_buffer(slot,",
        "encoded.set_vertex_buffer(len(used) - 1 - slot,",
        "draws/every attribute",
    ),
    _w("DrawRun.__call__", "self.vertex.group(images[:count])", "self.vertex.group(images[-count:])", "draws/scatter"),
    _w("DrawRun._depth", "step.state.clear_stencil", "0", "draw states/stencil", "draws/"),
    _w("texels", "padded[..., :3] = given", "padded[..., 2::-1] = given", "pictures/rgb32f", "pictures/rgb8"),
    _w("receive", "numbers[..., : format_.channels]", "numbers[..., ::-1][..., : format_.channels]", *PICTURES),
    _w(
        "WebGPUBackend.copy",
        "self.as_depth(source)",
        "pass",
        "sequences/",
        harmless="see test_depth_is_kept_when_it_is_uploaded_copied_and_drawn_over",
    ),
    _w("packed", "head[4:6] = size", "head[4:6] = size[::-1]", "language/", "pictures/"),
)
