"""Mistakes in the gl backend."""

from __future__ import annotations

from tests.mutation.mutant import Mutant

PICTURES = ("pictures/rgba32f 7x5", "pictures/rgba32f 70x66", "pictures/rgba32f")
SEEN = ("coverage/quad", "coverage/row 0", "draw states/cull none")


def _g(function: str, old: str, new: str, *catchers: str, harmless: str = "") -> Mutant:
    return Mutant(function, old, new, "gl", catchers, harmless)


MUTANTS = (
    _g(
        "FUNCTIONS",
        "(floatBitsToInt(x) & 0x7fffffff) > 0x7f800000",
        "(floatBitsToInt(x) & 0x7fffffff) >= 0x7f800000",
        "operations/isnan",
    ),
    _g(
        "FUNCTIONS",
        "(floatBitsToInt(x) & 0x7fffffff) == 0x7f800000",
        "floatBitsToInt(x) == 0x7f800000",
        "operations/isinf",
    ),
    _g("FUNCTIONS", "i = x < 2147483648.0 ? i : 2147483647;", "i = x < 2147483648.0 ? i : 0;", "operations/to_int"),
    _g(
        "FUNCTIONS",
        "int i = int(max(x, -2147483648.0));",
        "int i = int(max(floor(x), -2147483648.0));",
        "operations/to_int",
    ),
    _g("FUNCTIONS", "return pg_isnan(x) ? 0 : i;", "return pg_isnan(x) ? 1 : i;", "operations/to_int"),
    _g("GLSL._hidden", 'return f"pg_hidden({text})" if zero else text', "return text", "language/written zeros"),
    _g("_Search.walk", "self.found.add(i.index.id)", "pass", "language/unrolled zeros"),
    _g("_Search.is_nonzero", "return i.table in self.tables", "return True", "language/unrolled zeros"),
    _g("_Search.walk", "self.variables.add(i.variable)", "pass", "language/unrolled zeros"),
    _g(
        "GLSL.operation",
        'if op.on == "float" and op.operation in ("equal", "not_equal") and',
        "if False and",
        "language/identities",
        harmless="llvmpipe keeps x != x; the function is there for compilers that assume no NaN",
    ),
    _g("GLSL._place", '[f"{whole} < {count}"] * high', '[f"{whole} <= {count}"] * high', *PICTURES),
    _g("GLSL._place", '[f"{whole} >= 0"] * low', '[f"{whole} >= -1"] * low', *PICTURES),
    _g("GLSL._place", "uint({whole}) < uint({count})", "uint({whole}) <= uint({count})", *PICTURES),
    _g("GLSL._place", 'f"min({text}, {FARTHEST_TEXEL})"', "text", "pictures/far outside, clamp"),
    _g("GLSL._centre", 'f"({number} + 0.5)"', 'f"({number} - 0.5)"', *PICTURES, "language/"),
    _g("GLSL._place", "{'-' if turned else '+'}", "-", *PICTURES),
    _g("_PARAMETERS", "0x2802: 0x812F", "0x2802: 0x2901", *PICTURES),
    _g(
        "GLSL._place",
        "(known < 0, known > 0) if load.relative",
        "(known < -1, known > 1) if load.relative",
        *PICTURES,
        "language/",
    ),
    _g(
        "varying_place",
        'return f"pg_varying{index // 4}.{LETTERS[index % 4]}"',
        'return f"pg_varying{index // 4}.{LETTERS[index % 3]}"',
        "draw states/cull none",
    ),
    _g("GLSL.results", "-({y}) * pg_guard", "({y}) * pg_guard", *SEEN),
    _g(
        "GLSL.results",
        'f"if (!{self.operand(program.keep)}) {{ discard; }}"',
        'f"if ({self.operand(program.keep)}) {{ discard; }}"',
        "draw states/discard",
    ),
    _g(
        "GLSL.uniform",
        'return f"{name}[{index // 4}].{LETTERS[index % 4]}"',
        'return f"{name}[{index // 4}].{LETTERS[(index + 1) % 4]}"',
        "language/",
    ),
    _g("GLSL.uniform", '"{name}[{index} >> 2][{index} & 3]"', '"{name}[{index} >> 2][({index} + 1) & 3]"', "language/"),
    _g("GLSL.uniform", 'return f"{name}[{index}]"', 'return f"{name}[{index} ^ 1]"', "language/", "sequences/"),
    _g("_COMPARE", "0x200 + k for k, name", "0x200 + (k ^ 2) for k, name", "draw states/depth less"),
    _g("_STENCIL", '"increment": 0x1E02', '"increment": 0x8507', "draws/stencil", "draw states/stencil increment"),
    _g("_STENCIL", '"decrement_wrap": 0x8508', '"decrement_wrap": 0x1E03', "draw states/stencil decrement_wrap"),
    _g("_FACTORS", '"source_alpha": 0x302', '"source_alpha": 0x304', "draw states/blend"),
    _g("_FACTORS", '"one_minus_destination_color": 0x307', '"one_minus_destination_color": 0x306', "draw states/blend"),
    _g("_EQUATIONS", '"reverse_subtract": 0x800B', '"reverse_subtract": 0x800A', "draw states/blend equation reverse"),
    _g("set_draw", "gl.FrontFace(g.CLOCKWISE)", "gl.FrontFace(0x901)", "draw states/cull"),
    _g("set_draw", "gl.DepthMask(int(state.depth_write))", "gl.DepthMask(1)", "draw states/depth less, kept"),
    _g("set_draw", "gl.PolygonOffset(factor, units)", "gl.PolygonOffset(units, factor)", "draw states/polygon offset"),
    _g(
        "_set_stencil",
        "gl.StencilOp(_STENCIL[stencil.fail], _STENCIL[stencil.depth_fail],",
        "gl.StencilOp(_STENCIL[stencil.depth_fail], _STENCIL[stencil.fail],",
        "draw states/stencil",
    ),
    _g(
        "_set_stencil",
        "stencil.reference, stencil.read_mask)",
        "stencil.reference, 0xFF)",
        "draws/stencil",
        "draw states/stencil",
    ),
    _g(
        "_set_stencil",
        "gl.StencilMask(stencil.write_mask)",
        "gl.StencilMask(0xFF)",
        "draws/stencil",
        "draw states/stencil",
    ),
    _g(
        "set_draw",
        "gl.ColorMaski(k, red, green, blue, alpha)",
        "gl.ColorMaski(k, red, green, blue, 1)",
        "draw states/mask",
    ),
    _g("_set_blend", "gl.Enablei(BLEND, k)", "gl.Enablei(BLEND, 0)", "draw states/several"),
    _g("bind_images", "if textures[unit] != image.name:", "if textures[unit] is None:", "sequences/", "effects/"),
    _g("use", "if bound.used != program:", "if bound.used is None:", "sequences/", "effects/"),
    _g("set_common", "if bound.framebuffer != framebuffer:", "if bound.framebuffer is None:", "sequences/", "effects/"),
    _g(
        "set_draw",
        "wanted = (state, depth is None,",
        "wanted = (None, depth is None,",
        "sequences/",
        "effects/soft-shadow",
    ),
    _g("_set_blend", "_FACTORS[source],\n", "_FACTORS[blend.source],\n", "draw states/blend"),
    _g(
        "set_pixel_pass",
        "for switch in (BLEND, CULL_FACE, DEPTH_TEST, STENCIL_TEST):",
        "for switch in (CULL_FACE, DEPTH_TEST, STENCIL_TEST):",
        "sequences/",
        "draw states/several",
        "effects/planar",
    ),
    _g(
        "set_pixel_pass",
        "for switch in (BLEND, CULL_FACE, DEPTH_TEST, STENCIL_TEST):",
        "for switch in (BLEND, CULL_FACE, DEPTH_TEST):",
        "sequences/",
        "draws/a plain",
        harmless="pixel passes have no stencil buffer, and without one every stencil test passes",
    ),
    _g("_set_blend", "gl.Disable(BLEND)\n    different", "different", "draws/a plain"),
    _g("clear_targets", "gl.DepthMask(1)", "pass", "draw states/"),
    _g("clear_targets", "gl.StencilMask(0xFF)", "pass", "draws/a plain"),
    _g(
        "clear_targets",
        "gl.ClearBufferfi(g.DEPTH_STENCIL, 0, depth, stencil)",
        "gl.ClearBufferfi(g.DEPTH_STENCIL, 0, depth, 0)",
        "draw states/clears",
    ),
    _g("_open_colours", "gl.ColorMask(1, 1, 1, 1)", "pass", "draw states/", "sequences/"),
    Mutant("_steps", "np.rint(part, out=part)", "np.floor(part, out=part)", "gl", ("pictures/r8 brought",)),
    _g(
        "stored_clear",
        "clear_colour(value, texture.format.channels, texture.format.srgb)",
        "clear_colour(value, texture.format.channels, False)",
        "draw states/draw into rgba8_srgb",
    ),
    _g("DrawRun.__call__", "program.send_guard(gl, self.guard)", "pass", *SEEN),
    Mutant(
        "GLSL._place",
        "if not rule.is_nearest:",
        "if not rule.is_nearest and not load.relative:",
        "gl",
        ("pictures/rgba32f 7x5", "pictures/rgba32f 70x66", "pictures/rgba32f"),
    ),
    Mutant(
        "_INTERNAL",
        '"u2": (0x822A, 0x822C, 0x8054, 0x805B)',
        '"u2": (0x8229, 0x822B, 0x8051, 0x8058)',
        "gl",
        ("pictures/",),
    ),
    Mutant(
        "DrawRun.__call__",
        "fixed.bind_images(gl, bound, images)\n    fixed.use(gl, bound, program.name, geometry.array)",
        "fixed.bind_images(gl, bound, images[::-1])\n    fixed.use(gl, bound, program.name, geometry.array)",
        "gl",
        ("effects/soft-shadow",),
    ),
)
