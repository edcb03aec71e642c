"""Mistakes in the numpy backend."""

from __future__ import annotations

from tests.mutation.mutant import Mutant

EDGES = ("coverage/edges", "coverage/spokes", "coverage/quad", "coverage/fan")
SEEN = ("coverage/quad", "coverage/row 0", "draw states/cull none")
PICTURES = ("pictures/rgba32f 7x5", "pictures/rgba32f 70x66", "pictures/rgba32f")


def _n(file: str, old: str, new: str, *catchers: str, harmless: str = "") -> Mutant:
    return Mutant(f"backends/numpy/{file}.py", old, new, "numpy", catchers, harmless)


MUTANTS = (
    _n("llvm_ops", "b.fsub(x, y", "b.fsub(y, x", "operations/sub"),
    _n(
        "llvm_ops",
        '"min": lambda b, x, y: b.select(b.fcmp_ordered("<", y, x), y, x)',
        '"min": lambda b, x, y: b.select(b.fcmp_ordered("<", x, y), x, y)',
        "operations/min",
    ),
    _n("llvm_ops", 'b.fcmp_ordered("<=", x, y)', 'b.fcmp_ordered("<", x, y)', "operations/less_equal"),
    _n("llvm_ops", 'b.fcmp_unordered("!=", x, y)', 'b.fcmp_ordered("!=", x, y)', "operations/not_equal"),
    _n("llvm_ops", "llvm.roundeven.f32", "llvm.round.f32", "operations/round"),
    _n("llvm_ops", '"floor": call("llvm.floor.f32", F32)', '"floor": call("llvm.trunc.f32", F32)', "operations/floor"),
    _n(
        "llvm_ops",
        '"isnan": lambda b, x: b.fcmp_unordered("uno", x, x)',
        '"isnan": lambda b, x: b.fcmp_ordered("ord", x, x)',
        "operations/isnan",
    ),
    _n("llvm_ops", "_int(2**31 - 1), made)", "_int(2**31 - 2), made)", "operations/to_int"),
    _n("llvm_ops", 'b.select(b.fcmp_unordered("uno", x, x), _int(0), made)', "made", "operations/to_int"),
    _n("llvm_ops", "b.uitofp(x, F32)", "b.sitofp(x, F32)", "operations/to_float of bools"),
    _n("llvm_ops", "b.select(down, b.sub(quotient, _int(1)), quotient)", "quotient", "operations/floor_divide"),
    _n("llvm_ops", "b.select(up, b.add(rest, y), rest)", "rest", "operations/int_mod"),
    _n("llvm_ops", "b.ashr(x, _shift(b, y))", "b.lshr(x, _shift(b, y))", "operations/shift_right"),
    _n("llvm_ops", "return b.and_(y, _int(31))", "return y", "operations/shift"),
    _n(
        "llvm_ops",
        '"less": lambda b, x, y: b.icmp_signed("<", x, y)',
        '"less": lambda b, x, y: b.icmp_unsigned("<", x, y)',
        "operations/less",
    ),
    _n("llvm_body", "last = b.sub(size, one)", "last = size", *PICTURES),
    _n("llvm_body", "back = b.sub(b.sub(twice, one), m)", "back = b.sub(twice, m)", *PICTURES),
    _n("llvm_body", "b.add(rest, size), rest)", "rest, rest)", *PICTURES),
    _n(
        "llvm_body",
        'b.fmul(b.fadd(start, b.fmul(step, self.given["dx"])), self.given["w"])',
        'b.fadd(start, b.fmul(step, self.given["dx"]))',
        "draw states/cull none, lean",
        "coverage/through the eye",
    ),
    _n("llvm_body", 'sign = "<" if i.step > 0 else ">"', 'sign = "<=" if i.step > 0 else ">"', "language/"),
    _n(
        "llvm_body",
        "b.select(self.operand(i.condition), self.operand(i.then), self.operand(i.orelse))",
        "b.select(self.operand(i.condition), self.operand(i.orelse), self.operand(i.then))",
        "operations/smoothstep",
    ),
    _n(
        "llvm_body",
        "self.loops[-1][1] if isinstance(i, s.Break) else self.loops[-1][0]",
        "self.loops[-1][0] if isinstance(i, s.Break) else self.loops[-1][1]",
        "language/",
    ),
    _n("channels", "if read != channel:", "if False:", "language/"),
    _n("channels", '("output_size.", "size.", "pixel.1")', '("output_size.", "size.", "pixel.")', "language/"),
    _n(
        "merge_code",
        '"less": "{0} < {1}"',
        '"less": "{0} <= {1}"',
        "draw states/depth less",
        "draw states/stencil less",
    ),
    _n(
        "merge_code",
        '"greater_equal": "{0} >= {1}"',
        '"greater_equal": "{0} > {1}"',
        "draw states/stencil greater_equal",
    ),
    _n("raster_code", "last = TILE - 1", "last = TILE - 2", *SEEN),
    _n(
        "raster_code",
        "float32(min(max(z_row + z_step * dx, 0.0), 1.0))",
        "float32(z_row + z_step * dx)",
        "draw states/polygon offset",
    ),
    _n(
        "raster_code",
        "*indented(merge_lines(step, tests, write_depth, [])),",
        "*indented(merge_lines(step, tests, [], [])),",
        "draw states/discard",
    ),
    _n(
        "raster_setup",
        "made[at, 3] = 1 if area < 0 else 0",
        "made[at, 3] = 0 if area < 0 else 1",
        "draw states/several targets",
    ),
    _n(
        "merge_code",
        '"increment": "min(held + 1, 255)"',
        '"increment": "(held + 1) & 255"',
        "draw states/stencil increment",
    ),
    _n(
        "merge_code",
        '"decrement_wrap": "(held - 1) & 255"',
        '"decrement_wrap": "max(held - 1, 0)"',
        "draw states/stencil decrement_wrap",
    ),
    _n(
        "merge_code",
        '"invert": "held ^ 255"',
        '"invert": "held ^ 127"',
        "draw states/stencil invert",
        "draw states/clears",
    ),
    _n("merge_code", 'f"(held & {stencil.read_mask})"', '"held"', "draws/stencil", "draw states/stencil"),
    _n(
        "merge_code",
        "uint8((held & {keep}) | (changed & {change}))",
        "uint8(changed)",
        "draws/stencil",
        "draw states/stencil",
    ),
    _n(
        "merge_code",
        "({texts['passed']} if depth_passes else {texts['depth_fail']})",
        "({texts['depth_fail']} if depth_passes else {texts['passed']})",
        "draw states/stencil zero on passed",
    ),
    _n("merge_code", "if mask[channel]:", "if True:", "draw states/mask"),
    _n("merge_code", "alpha = channel == 3", "alpha = channel == 4", "draw states/blend factor"),
    _n(
        "merge_code",
        'clamped = format_.kind.startswith("unorm")',
        "clamped = False",
        "draw states/several",
        "draw states/blend into",
    ),
    _n(
        "merge_code",
        'destination_alpha = f"b{number}_d3" if count == 4 else "float32(1.0)"',
        'destination_alpha = f"b{number}_d3" if count == 4 else "float32(0.0)"',
        "draws/blend",
    ),
    _n(
        "merge_code",
        "return f\"{value} * (float32(1.0) - {names[factor.removeprefix('one_minus_')]})\"",
        "return f\"{value} * {names[factor.removeprefix('one_minus_')]}\"",
        "draw states/blend",
    ),
    _n(
        "merge_code",
        '"reverse_subtract": f"{scaled_d} - {scaled_s}"',
        '"reverse_subtract": f"{scaled_s} - {scaled_d}"',
        "draw states/blend equation reverse",
    ),
    _n(
        "merge_code",
        "scaled_s = _times(s, source_factor,",
        "scaled_s = _times(s, destination_factor,",
        "draw states/blend",
    ),
    _n(
        "raster_setup",
        "left, right = (min(x0, x1, x2) + 127) >> 8",
        "left, right = (min(x0, x1, x2) + 128) >> 8",
        *EDGES,
    ),
    _n("raster_setup", "(max(y0, y1, y2) - 128) >> 8", "(max(y0, y1, y2) - 384) >> 8", *EDGES),
    _n("raster_setup", "(0.5 - y / w * 0.5)", "(0.5 + y / w * 0.5)", *SEEN),
    _n(
        "raster_setup",
        "(area < 0 and cull == 2) or (area > 0 and cull == 1)",
        "(area < 0 and cull == 1) or (area > 0 and cull == 2)",
        "draw states/cull",
    ),
    _n("raster_setup", "np.rint((x / w", "np.floor((x / w", *SEEN, "coverage/", "draw states/cull"),
    _n("raster_setup", "return z + w", "return z + 0.5 * w", "coverage/beyond", "coverage/through"),
    _n("raster_setup", "* np.float32(t)", "* np.float32(1.0 - t)", "coverage/through", "coverage/beyond"),
    _n(
        "raster_setup",
        "lerp(clip, varyings, here, there, d_here / (d_here - d_there), free)",
        "lerp(clip, varyings, there, here, d_there / (d_there - d_here), free)",
        "coverage/",
        harmless="the same point; its rounding (float64) lies 2^40 below the grid that corners are rounded to",
    ),
    _n(
        "raster_setup",
        "(0 if dy < 0 or (dy == 0 and dx > 0) else 1)",
        "(0 if dy > 0 or (dy == 0 and dx < 0) else 1)",
        *EDGES,
    ),
    _n("raster_setup", "(0 if dy < 0 or (dy == 0 and dx > 0) else 1)", "0", *EDGES),
    _n(
        "raster_triangle",
        "px, py = left * 256 + 128 - x0, top * 256 + 128 - y0",
        "px, py = left * 256 - x0, top * 256 - y0",
        *EDGES,
    ),
    _n(
        "raster_triangle",
        "np.floor(np.log2(deepest)) - 23.0",
        "np.floor(np.log2(deepest)) - 22.0",
        "draw states/polygon offset",
    ),
    _n(
        "raster_triangle",
        "factor * max(abs(step_x), abs(step_y))",
        "factor * (abs(step_x) + abs(step_y))",
        "draw states/polygon offset",
    ),
    _n("raster_triangle", "np.int64(np.ceil(-value / step))", "np.int64(np.floor(-value / step))", *EDGES),
    _n("raster_triangle", "return 0.5 - x0 / 256.0, 0.5 - y0 / 256.0", "return -x0 / 256.0, -y0 / 256.0", *SEEN),
    _n("intrinsics", 'call("llvm.roundeven.f32", F32)', 'call("llvm.floor.f32", F32)', "draw states/blend into"),
    _n("intrinsics", "size + int32(0xFFF) + int32((size >> int32(13)) & int32(1))", "size", "draw states/blend into"),
    _n("workers", "errors += [ended.get() for _ in begun]", "errors += []", "language/a wide", "coverage/"),
    _n("raster", "depth.stencil.fill(self.step.state.clear_stencil)", "depth.stencil.fill(0)", "draw states/clears"),
    _n(
        "raster_paint",
        "clear_colour(clear, channels, storage.format.srgb)",
        "clear_colour(clear, channels, False)",
        "draw states/draw into rgba8_srgb",
    ),
)
