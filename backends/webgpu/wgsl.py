"""Print scalar programs in WGSL, the shading language of WebGPU.

WGSL lets a compiler reorder sums and products, and assume that NaN and infinity do not occur.  Programs must give the
same results on every backend, so results that compilers would combine (:mod:`.combined`) pass through a bitwise *or*
with a zero that compilers cannot know (``pg_nil``).  Comparisons that control more than a choice pass through an int in
the same way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from passgraph.backends.base import ATTRIBUTES
from passgraph.backends.printing import builtin_calls, spelled
from passgraph.backends.shader_printing import LETTERS, ShaderPrinter, vec4_count
from passgraph.backends.webgpu.combined import COMPARISONS, Combined
from passgraph.language import native
from passgraph.language import scalar as s
from passgraph.language.builtin_name import BuiltinName

_LIKE_C = spelled({
    "float": {"abs": "abs({0})", "round": "round({0})", "bits_from_float": "bitcast<i32>({0})",
              "min": "select({0}, {1}, {1} < {0})", "max": "select({0}, {1}, {0} < {1})",
              **builtin_calls(native.WGSL, inversesqrt="inverseSqrt")},
    "int": {
        "add": "({0} + {1})", "sub": "({0} - {1})", "mul": "({0} * {1})", "neg": "(-{0})", "abs": "max({0}, 0 - {0})",
        "min": "min({0}, {1})", "max": "max({0}, {1})",
        "shift_left": "({0} << (bitcast<u32>({1}) & 31u))", "shift_right": "({0} >> (bitcast<u32>({1}) & 31u))",
        "to_float": "f32({0})", "float_from_bits": "bitcast<f32>({0})",
    },
    "bool": {"to_float": "select(0.0, 1.0, {0})", "to_int": "select(0, 1, {0})"},
    s.INDEX: {
        "int_mod": "pg_near_mod({0}, {1})", "nearer": "pg_nearer({0}, {1})", "below": "(u32({0}) < u32({1}))",
        "to_coordinate": "f32({0})",
    },
})  # fmt: skip

#: Name → definition.  Definitions may call earlier ones.
FUNCTIONS = {
    "pg_isnan": "fn pg_isnan(x: f32) -> bool { return (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u; }",
    "pg_isinf": "fn pg_isinf(x: f32) -> bool { return (bitcast<u32>(x) & 0x7fffffffu) == 0x7f800000u; }",
    # 2147483520 is the largest float below 2³¹.
    "pg_to_int": """
fn pg_to_int(x: f32) -> i32
{
    let i = i32(clamp(x, -2147483648.0, 2147483520.0));
    return select(select(2147483647, i, x < 2147483648.0), 0, pg_isnan(x));
}
""",
    "pg_floor_divide": """
fn pg_floor_divide(a: i32, b: i32) -> i32
{
    if (b == 0) { return 0; }
    if (b == -1) { return 0 - a; }
    let q = a / b;
    let r = a - q * b;
    return select(q, q - 1, r != 0 && (r < 0) != (b < 0));
}
""",
    "pg_int_mod": """
fn pg_int_mod(a: i32, b: i32) -> i32
{
    if (b == 0 || b == -1) { return 0; }
    let r = a - (a / b) * b;
    return select(r, r + b, r != 0 && (r < 0) != (b < 0));
}
""",
    # Of addresses, where b is a size: devices divide floats in vectors.
    "pg_nearer": "fn pg_nearer(a: i32, b: i32) -> i32 { return a - i32(f32(a) * (1.0 / f32(b))) * b; }",
    "pg_near_mod": """
fn pg_near_mod(a: i32, b: i32) -> i32
{
    let q = pg_nearer(a, b);
    let r = select(q, q + b, q < 0);
    return select(r - b, r, r < b);
}
""",
}
#: One triangle that covers the target.
FULLSCREEN = """@vertex
fn main(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32>
{
    return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}
"""
#: Border rule → address mode of a sampler that means the same; there is no mode with a color.
WRAP_MODES = {"clamp": "clamp-to-edge", "repeat": "repeat", "mirror": "mirror-repeat"}
#: Bindings of a group: parameters, a sampler for texels, one that filters for each wrap mode, then images.
PARAMETERS, NEAREST, LINEAR = range(3)
FIRST_IMAGE = LINEAR + len(WRAP_MODES)
#: Bytes before a kernel's own parameters: four zeros, the target's size and the guard band's factor.
HEAD = 32
#: Bytes of a uniform buffer on every device (WebGPU's default of maxUniformBufferBindingSize).
UNIFORM_BYTES = 1 << 16


def uniform_tables(program: s.ScalarProgram) -> list[tuple[str, str, tuple[bool | int | float, ...]]]:
    """Return the constant tables that lie behind a program's parameters in its uniform buffer: large ones first, as
    many as fit.

    A table in a variable is filled for each pixel, and lavapipe compiles one of 1,024 entries in 39 s.
    """
    room = UNIFORM_BYTES - HEAD - 16 * (max(1, vec4_count(program.float_count)) + max(1, vec4_count(program.int_count)))
    found = []
    for table in sorted(program.tables, key=lambda table: -len(table[2])):
        size = 16 * vec4_count(len(table[2]))
        if size <= room:
            found.append(table)
            room -= size
    return found


class WGSL(ShaderPrinter):
    """Prints a program of any stage as one shader module, whose entry point is ``main``.

    ``steps`` has, for each image, the number by which the device divides its stored integers, or 0.
    """

    types: ClassVar[Mapping[str, str]] = {
        "bool": "bool",
        "int": "i32",
        "float": "f32",
        s.INDEX: "i32",
        s.COORDINATE: "f32",
    }
    spelled: ClassVar[Mapping[str, Mapping[str, str]]] = _LIKE_C
    float_, vec2, ivec2, vec4 = "f32", "vec2<f32>", "vec2<i32>", "vec4<f32>"
    fragment, derivative = "pg_place", "dpd"
    helpers, image_ = FUNCTIONS, "pg_image"
    output_size, front_facing = "pg.size", "pg_front"

    def __init__(
        self, program: s.ScalarProgram, varyings: tuple[BuiltinName, ...] = (), steps: tuple[int, ...] = ()
    ) -> None:
        super().__init__(program, varyings)
        self.steps = steps
        self.combined = Combined(program)
        self.declarations = {"pg_nil": "let pg_nil = pg.zeros.x;", "pg_nil2": "let pg_nil2 = pg.zeros.y;"}
        self.in_uniforms = {name: type_ for name, type_, _ in uniform_tables(program)}
        for name, type_, values in program.tables:
            if name not in self.in_uniforms:
                # Not a constant: wgpu copies one into a variable at each read by an index.
                items = ", ".join(self.literal(s.Lit(type_, v)) for v in values)
                self.declarations[name] = f"var {name} = array<{self.types[type_]}, {len(values)}>({items});"

    # Statements

    def constant(self, type_: str, name: str, expression: str) -> str:
        return f"let {name}: {self.types[type_]} = {expression};"

    def declaration(self, type_: str, name: str, expression: str, exact: bool) -> str:
        return f"let {name} = {expression};"

    def variable(self, type_: str, name: str) -> str:
        return f"var {name}: {self.types[type_]};"

    def array(self, type_: str, name: str, length: int) -> str:
        return f"var {name}: array<{self.types[type_]}, {length}>;"

    def choice(self, condition: str, then: str, orelse: str) -> str:
        return f"select({orelse}, {then}, {condition})"

    def loop(self, index: str, start: str, compare: str, stop: str, step: str) -> str:
        return f"for (var {index}: i32 = {start}; {index} {compare} {stop}; {index} += {step}) {{"

    def repetition(self, index: str, count: str) -> str:
        return f"for (var {index}: i32 = 0; {index} < {count}; {index}++) {{"

    # Values

    def float_from_bits(self, bits: int) -> str:
        # WGSL rejects constants that are not finite.
        return f"bitcast<f32>({bits & 0xFFFFFFFF:#x}u | pg_nil)"

    def hidden(self, text: str, type_: str = "float") -> str:
        if type_ == "bool":
            return f"((select(0u, 1u, {text}) | pg_nil) != 0u)"
        name = self.types[type_]
        return f"bitcast<{name}>(bitcast<u32>({text}) | pg_nil)"

    def operation(self, op: s.Op, arguments: list[str]) -> str:
        if op.on in (s.INDEX, s.COORDINATE):
            return super().operation(op, arguments)
        if all(isinstance(a, s.Lit) for a in op.arguments):
            # WGSL evaluates constants exactly, and rejects overflow.
            arguments[0] = self.hidden(arguments[0], op.on)
        if op.on != "float":
            return super().operation(op, arguments)
        if op.operation in ("mul", "div", "add", "sub"):
            arguments = self.unforeseen_operands(op.arguments)
        if op.operation in ("mul", "div"):
            arguments = self._unchosen(op, arguments)
        if op.operation in ("sub", "div") and self.combined.same(*op.arguments):
            arguments = [arguments[0], f"bitcast<f32>(bitcast<u32>({arguments[1]}) | pg_nil2)"]
        same = op.operation in ("equal", "not_equal") and arguments[0] == arguments[1]
        if not same and (op.operation in ("min", "max") or op.operation in COMPARISONS):
            return self._comparison(op, arguments)
        text = super().operation(op, arguments)
        return self.hidden(text) if op.to.id in self.combined.results else text

    def _unchosen(self, op: s.Op, arguments: list[str]) -> list[str]:
        """Hide factors that are chosen to be 0, whose product with infinity or NaN compilers take for 0."""
        finite = [isinstance(a, s.Lit) and math.isfinite(a.value) for a in op.arguments]
        return [
            self.hidden(text) if self.foreseen.may_choose_zero(a) and not other else text
            for a, text, other in zip(op.arguments, arguments, reversed(finite), strict=True)
        ]

    def _comparison(self, op: s.Op, arguments: list[str]) -> str:
        """Compare through a value with unknown range and origin, so that compilers cannot simplify it."""
        first, second = arguments
        hide = 1 if isinstance(op.arguments[0], s.Lit) else 0
        compared = [first, second]
        compared[hide] = f"bitcast<f32>(bitcast<u32>({compared[hide]}) | pg_nil2)"
        if op.operation in ("min", "max"):
            order = ("{1} < {0}" if op.operation == "min" else "{0} < {1}").format(*compared)
            return f"select({first}, {second}, {order})"
        if op.operation == "not_equal":
            # Not "!=", which wgpu makes false for NaN.
            return f"((select(0u, 1u, {compared[0]} == {compared[1]}) | pg_nil) == 0u)"
        text = super().operation(op, compared)
        return text if op.to.id in self.combined.conditions else self.hidden(text, "bool")

    # Where values come from

    def uniform(self, block: str, index: str | int) -> str:
        if isinstance(index, int):
            return f"pg.{block}s[{index // 4}].{LETTERS[index % 4]}"
        return f"pg.{block}s[{index} >> 2u][{index} & 3]"

    def table(self, name: str, index: str) -> str:
        type_ = self.in_uniforms.get(name)
        if type_ is None:
            return super().table(name, index)
        number = f"pg.{name}[{index} >> 2u][{index} & 3]"
        return f"({number} != 0)" if type_ == "bool" else number

    def sample(self, load: s.Sample) -> None:
        """Read a texel through a sampler, which takes lavapipe two thirds of the time of ``textureLoad``."""
        sampler = f"pg_linear_{load.filter}" if load.filter else "pg_nearest"
        place = f"vec2<f32>({self.operand(load.x)}, {self.operand(load.y)})"
        fetch = f"textureSampleLevel({self.texture(load.image)}, {sampler}, {place}, 0.0)"
        steps = self.steps[self.image_numbers[load.image]] if self.steps else 0
        if steps and not load.filter:
            # Devices may read fractions with a small error; this divides the stored integer again.
            fetch = f"round({fetch} * {steps}.0) / {steps}.0"
        self.name_channels(load, fetch)

    def texture_size(self, image: str) -> str:
        return f"vec2<i32>(textureDimensions({self.texture(image)}))"

    # Whole modules

    @property
    def group(self) -> int:
        """Return the number of the bind group; each stage of a draw has its own."""
        return 1 if self.program.stage == "fragment" else 0

    def interface(self) -> list[str]:
        program, group = self.program, f"@group({self.group})"
        lines = [
            "struct Parameters {\n    zeros: vec4<u32>,\n    size: vec2<i32>,\n    guard: f32,",
            f"    @align(16) floats: array<vec4<f32>, {max(1, vec4_count(program.float_count))}>,",
            f"    ints: array<vec4<i32>, {max(1, vec4_count(program.int_count))}>,",
            *(
                f"    {name}: array<vec4<{'f32' if type_ == 'float' else 'i32'}>, {vec4_count(len(values))}>,"
                for name, type_, values in uniform_tables(program)
            ),
            "}",
            f"{group} @binding({PARAMETERS}) var<uniform> pg: Parameters;",
            f"{group} @binding({NEAREST}) var pg_nearest: sampler;",
            *(f"{group} @binding({LINEAR + k}) var pg_linear_{rule}: sampler;" for k, rule in enumerate(WRAP_MODES)),
        ]
        lines += [
            f"{group} @binding({FIRST_IMAGE + k}) var pg_image{k}: texture_2d<f32>;" for k in range(len(program.images))
        ]
        if program.stage == "vertex":
            sent = [f"    @location({k}) pg_varying{k}: vec4<f32>," for k in range(vec4_count(len(self.varyings)))]
            lines += ["struct Results {", "    @builtin(position) @invariant position: vec4<f32>,", *sent, "}"]
        elif program.outputs:
            outputs = [f"    @location({k}) pg_out{k}: vec4<f32>," for k in range(len(program.outputs))]
            lines += ["struct Results {", *outputs, "}"]
        return lines

    def head(self) -> str:
        program = self.program
        returned = " -> Results" if program.stage == "vertex" or program.outputs else ""
        if program.stage == "vertex":
            given = [
                f"@location({k}) in_{attribute}: {'f32' if size == 1 else f'vec{size}<f32>'}"
                for k, (attribute, (_, size)) in enumerate(ATTRIBUTES.items())
                if attribute in program.attributes
            ]
            return f"@vertex\nfn main({', '.join(given)}){returned}"
        given = ["@builtin(position) pg_place: vec4<f32>"]
        if program.stage == "fragment":
            given += ["@builtin(front_facing) pg_front: bool"]
            given += [f"@location({k}) pg_varying{k}: vec4<f32>" for k in range(vec4_count(len(self.varyings)))]
        return f"@fragment\nfn main({', '.join(given)}){returned}"

    def results(self) -> None:
        program = self.program
        if program.stage == "vertex":
            x, y, z, w = (self.operand(v) for v in program.outputs[0].values)
            self.line(f"var pg_position = vec4<f32>({x}, {y}, {z}, {w});")
            # Rule 1 drops triangles with such a vertex; an infinite w alone would be a valid position.
            self.line("let pg_bits = bitcast<vec4<u32>>(pg_position) & vec4<u32>(0x7f800000u);")
            # WebGPU's clip space has depth from 0 to 1, that of kernels from -1 to 1.
            self.line("pg_position.z = (pg_position.z + pg_position.w) * 0.5;")
            self.line("pg_position.x = pg_position.x * pg.guard;\npg_position.y = pg_position.y * pg.guard;")
            self.line("if (any(pg_bits == vec4<u32>(0x7f800000u))) {")
            self.line("    pg_position = bitcast<vec4<f32>>(vec4<u32>(0x7fc00000u | pg_nil));\n}")
            self.line(f"return Results({', '.join(['pg_position', *self.sent()])});")
            return
        if program.keep is not None:
            self.line(f"if (!{self.operand(program.keep)}) {{ discard; }}")
        if program.outputs:
            self.line(f"return Results({', '.join(self.stored(output) for output in program.outputs)});")
