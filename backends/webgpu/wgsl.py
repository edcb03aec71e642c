"""Print scalar programs in WGSL, the shading language of WebGPU.

WGSL lets a compiler reorder sums and products, and assume that NaN and infinity do not occur.  Programs must give the
same results on every backend, so results that compilers would combine (:mod:`.combined`) pass through a bitwise *or*
with a zero that compilers cannot know (``pg_nil``).  Comparisons that control more than a choice pass through an int in
the same way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import ClassVar

from passgraph.backends.base import ATTRIBUTES
from passgraph.backends.foreseen import foreseen_values
from passgraph.backends.printing import Listing, Printer, builtin_calls, spelled
from passgraph.backends.webgpu.combined import COMPARISONS, Combined
from passgraph.language import native
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS, border_name, border_program
from passgraph.language.ir import own_pixel

_LIKE_C = spelled({
    "float": {"abs": "abs({0})", "round": "round({0})", "bits_from_float": "bitcast<i32>({0})",
              "min": "select({0}, {1}, {1} < {0})", "max": "select({0}, {1}, {0} < {1})",
              "fma": "fma({0}, {1}, {2})", **builtin_calls(native.WGSL, inversesqrt="inverseSqrt")},
    "int": {
        "add": "({0} + {1})", "sub": "({0} - {1})", "mul": "({0} * {1})", "neg": "(-{0})", "abs": "max({0}, 0 - {0})",
        "min": "min({0}, {1})", "max": "max({0}, {1})",
        "shift_left": "({0} << (bitcast<u32>({1}) & 31u))", "shift_right": "({0} >> (bitcast<u32>({1}) & 31u))",
        "to_float": "f32({0})", "float_from_bits": "bitcast<f32>({0})",
    },
    "bool": {"to_float": "select(0.0, 1.0, {0})", "to_int": "select(0, 1, {0})"},
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
    # Part of the border rules, where b is a size: devices divide floats in vectors.
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
LETTERS = "xyzw"
#: Larger than every picture, and small enough that its float stays an int after multiplication and rounding.
FARTHEST_TEXEL = 1 << 30
#: ``pg_near_mod`` is exact up to here; ``pg_nearer`` reduces every int to this range.
NEAR = 1 << 20
#: Border rule → address mode of a sampler that means the same; there is no mode with a color.
WRAP_MODES = {"clamp": "clamp-to-edge", "repeat": "repeat", "mirror": "mirror-repeat"}
#: Bindings of a group: parameters, a sampler for texels, one that filters for each wrap mode, then images.
PARAMETERS, NEAREST, LINEAR = range(3)
FIRST_IMAGE = LINEAR + len(WRAP_MODES)
#: Bytes before a kernel's own parameters: four zeros, the target's size and the guard band's factor.
HEAD = 32


def vec4_count(components: int) -> int:
    return (components + 3) // 4


class WGSL(Printer):
    """Prints a program of any stage as one shader module.

    ``varyings`` names the scalars passed from vertex to fragment; ``steps`` has, for each image, the number by which
    the device divides its stored integers, or 0.
    """

    types: ClassVar[Mapping[str, str]] = {"bool": "bool", "int": "i32", "float": "f32"}
    spelled: ClassVar[Mapping[str, Mapping[str, str]]] = _LIKE_C

    def __init__(self, program: s.ScalarProgram, varyings: tuple[str, ...] = (), steps: tuple[int, ...] = ()) -> None:
        super().__init__(program)
        self.varyings = varyings
        self.steps = steps
        self.image_numbers = {use.name: k for k, use in enumerate(program.images)}
        self.combined = Combined(program)
        self.foreseen = foreseen_values(program)
        #: Names declared at the top of main, with their declarations.
        self.declarations: dict[str, str] = {}

    # Statements

    def constant(self, type_: str, name: str, expression: str) -> str:
        return f"let {name}: {self.types[type_]} = {expression};"

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
        """Return an expression that compilers can neither evaluate nor combine with others."""
        if type_ == "bool":
            return f"((select(0u, 1u, {text}) | pg_nil) != 0u)"
        name = self.types[type_]
        return f"bitcast<{name}>(bitcast<u32>({text}) | pg_nil)"

    def operation(self, op: s.Op, arguments: list[str]) -> str:
        if all(isinstance(a, s.Lit) for a in op.arguments):
            # WGSL evaluates constants exactly, and rejects overflow.
            arguments[0] = self.hidden(arguments[0], op.on)
        if self.program.stage == "border" and op.operation == "int_mod":
            return f"pg_near_mod({', '.join(arguments)})"
        if op.on == "float":
            return self._float_operation(op, arguments)
        return self._spelled(op, arguments)

    def _float_operation(self, op: s.Op, arguments: list[str]) -> str:
        name = op.operation
        if name in ("mul", "div", "add", "sub", "fma"):
            both = all(self.foreseen.known(a) for a in op.arguments)
            arguments = [self._unforeseen(a, both) for a in op.arguments]
        if name in ("equal", "not_equal") and arguments[0] == arguments[1]:
            return f"{'!' if name == 'equal' else ''}pg_isnan({arguments[0]})"
        if name in ("sub", "div") and self.combined.same(*op.arguments):
            arguments = [arguments[0], f"bitcast<f32>(bitcast<u32>({arguments[1]}) | pg_nil2)"]
        if name in ("min", "max") or name in COMPARISONS:
            return self._comparison(op, arguments)
        text = self._spelled(op, arguments)
        return self.hidden(text) if op.to.id in self.combined.results else text

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
        text = self._spelled(op, compared)
        return text if op.to.id in self.combined.conditions else self.hidden(text, "bool")

    def _spelled(self, op: s.Op, arguments: list[str]) -> str:
        return self.spelled[op.on][op.operation].format(*arguments)

    def _unforeseen(self, operand: s.Operand, among_constants: bool = False) -> str:
        """Return an operand that compilers cannot assume to be 0, see :mod:`passgraph.backends.foreseen`."""
        text = self.operand(operand)
        zero = self.foreseen.may_be_zero(operand) and (isinstance(operand, s.Lit) or not among_constants)
        return self.hidden(text) if zero else text

    # Where values come from

    def uniform(self, block: str, index: str | int) -> str:
        if isinstance(index, int):
            return f"pg.{block}s[{index // 4}].{LETTERS[index % 4]}"
        return f"pg.{block}s[{index} >> 2u][{index} & 3]"

    def builtin(self, name: str) -> str:
        if self.program.stage == "border":
            return name
        head, _, rest = name.partition(".")
        if head == "pixel":
            return f"{self._pixel()}.{LETTERS[int(rest)]}"
        if head == "output_size":
            return f"pg.size.{LETTERS[int(rest)]}"
        if head == "size":
            image, _, axis = rest.rpartition(".")
            return f"{self._size(image)}.{LETTERS[int(axis)]}"
        if head == "vertex":
            attribute, _, component = rest.partition(".")
            return f"in_{attribute}.{LETTERS[int(component)]}" if component else f"in_{attribute}"
        name, axes = own_pixel(name)
        if name.startswith("varying."):
            return self._varying(self.varyings.index(name.removeprefix("varying.")), axes)
        return self._depth(axes) if name == "fragment_depth" else {"front_facing": "pg_front"}[name]

    def texel(self, load: s.LoadTexel) -> None:
        """Read a texel through a sampler, which takes lavapipe two thirds of the time of ``textureLoad``: coordinates
        are texel centers, samplers use nearest filtering and clamp to the edge."""
        image = f"pg_image{self.image_numbers[load.image]}"
        inside: list[str] = []
        sampler = "pg_nearest"
        if load.filtered:
            sampler = f"pg_linear_{load.border}"
            place = f"vec2<f32>({self.operand(load.x)}, {self.operand(load.y)})"
        else:
            found = [self._place(load, axis, offset) for axis, offset in zip("xy", (load.x, load.y), strict=True)]
            place = f"vec2<f32>({found[0][0]}, {found[1][0]})"
            inside = [*found[0][1], *found[1][1]]
        fetch = f"textureSampleLevel({image}, {sampler}, {place}, 0.0)"
        steps = self.steps[self.image_numbers[load.image]] if self.steps else 0
        if steps and not load.filtered:
            # Devices may read fractions with a small error; this divides the stored integer again.
            fetch = f"round({fetch} * {steps}.0) / {steps}.0"
        if inside:
            fetch = f"select(vec4<f32>(), {fetch}, {' && '.join(inside)})"
        first = next(v for v in load.to if v is not None)
        self.line(f"let t{first.id} = {fetch};")
        for value, letter in zip(load.to, LETTERS, strict=False):
            if value is not None:
                self.name(value, f"t{first.id}.{letter}")

    def _place(self, load: s.LoadTexel, axis: str, offset: s.Operand) -> tuple[str, list[str]]:
        """Return one coordinate of a texel's center, and the conditions under which a zero border shows the texel."""
        known = int(offset.value) if isinstance(offset, s.Lit) else None
        here, width = f"pg_here{self.image_numbers[load.image]}.{axis}", f"{self._width(load.image)}.{axis}"
        if load.relative:
            self._here(load.image)
        if load.relative and known == 0:
            return here, []  # the image is as large as the target
        text = self.operand(offset)
        if known is not None:
            known = min(max(known, -FARTHEST_TEXEL), FARTHEST_TEXEL)
        count = f"{self._size(load.image)}.{axis}"
        use, rule = self.program.image(load.image), BORDERS[load.border]
        reach = max(map(abs, use.x if axis == "x" else use.y))
        if rule.period and (not load.relative or reach > NEAR):
            known, text = None, f"pg_nearer({text}, {rule.period.replace('size', count)})"
        elif load.relative and reach > FARTHEST_TEXEL:
            known, text = None, f"clamp({text}, -2 * {count}, 2 * {count})"
        coordinate = f"({self._pixel()}.{axis} + {text})" if load.relative else text
        if not rule.is_nearest:
            return f"(f32({border_name(load.border)}({coordinate}, {count})) + 0.5) * {width}", []
        number = f"f32(min({text}, {FARTHEST_TEXEL}))" if known is None else self.float_literal(known)
        place = f"{here} + {number} * {width}" if load.relative else f"({number} + 0.5) * {width}"
        if not rule.blank:
            return place, []
        if known is None:
            return place, [f"u32({coordinate}) < u32({count})"]
        low, high = (known < 0, known > 0) if load.relative else (known < 0, True)
        return place, [f"{coordinate} >= 0"] * low + [f"{coordinate} < {count}"] * high

    def _declare(self, name: str, expression: str) -> str:
        self.declarations.setdefault(name, f"let {name} = {expression};")
        return name

    def _size(self, image: str) -> str:
        number = self.image_numbers[image]
        return self._declare(f"pg_size{number}", f"vec2<i32>(textureDimensions(pg_image{number}))")

    def _width(self, image: str) -> str:
        """Return the width and height of a texel in texture coordinates."""
        return self._declare(f"pg_texel{self.image_numbers[image]}", f"1.0 / vec2<f32>({self._size(image)})")

    def _here(self, image: str) -> str:
        """Return the center of this pixel in texture coordinates of an image of the target's size."""
        return self._declare(f"pg_here{self.image_numbers[image]}", f"pg_place.xy * {self._width(image)}")

    def _pixel(self) -> str:
        return self._declare("pg_pixel", "vec2<i32>(pg_place.xy)")

    def _varying(self, index: int, axes: str) -> str:
        """Return a scalar varying, at another pixel of the quad through the planes of varying / w and of 1 / w."""
        vector, letter = index // 4, LETTERS[index % 4]
        if not axes:
            return f"pg_varying{vector}.{letter}"
        over_w = self._declare(f"pg_over_w{vector}", f"pg_varying{vector} * pg_place.w")
        moved = f"{self._stepped(over_w, axes)} / {self._stepped('pg_place.w', axes)}"
        return f"{self._declare(f'pg_varying{vector}{axes}', moved)}.{letter}"

    def _depth(self, axes: str) -> str:
        """Clamp the depth as it is stored: a polygon offset may leave 0 to 1."""
        return self._declare(f"pg_depth{axes}", f"clamp({self._stepped('pg_place.z', axes)}, 0.0, 1.0)")

    def _stepped(self, plane: str, axes: str) -> str:
        """Return a plane's value at another pixel of the quad, or at this one."""
        if not axes:
            return plane
        way = self._declare("pg_way", f"vec2<f32>(1 - 2 * ({self._pixel()} & vec2<i32>(1)))")
        return f"({' + '.join([plane, *(f'{way}.{axis} * dpd{axis}({plane})' for axis in axes)])})"

    # Whole modules

    def module(self) -> Listing:
        """Return the complete source; its entry point is ``main``."""
        self.depth = 1
        self.variables()
        self.block(self.program.body)
        self.results()
        self.depth = 0
        self.line("}")
        declared = "".join(f"\n    {text}" for text in ["let pg_nil = pg.zeros.x;", "let pg_nil2 = pg.zeros.y;",
                                                        *self.declarations.values()])  # fmt: skip
        parts = [*self.interface(), self.called(functions()), f"{self._head()}\n{{{declared}"]
        self.front("\n".join(part for part in parts if part))
        return self.listing()

    @property
    def group(self) -> int:
        """Return the number of the bind group; each stage of a draw has its own."""
        return 1 if self.program.stage == "fragment" else 0

    def interface(self) -> list[str]:
        """Declare parameters, samplers, images, tables and outputs."""
        program, group = self.program, f"@group({self.group})"
        lines = [
            "struct Parameters {\n    zeros: vec4<u32>,\n    size: vec2<i32>,\n    guard: f32,",
            f"    @align(16) floats: array<vec4<f32>, {max(1, vec4_count(program.float_count))}>,",
            f"    ints: array<vec4<i32>, {max(1, vec4_count(program.int_count))}>,\n}}",
            f"{group} @binding({PARAMETERS}) var<uniform> pg: Parameters;",
            f"{group} @binding({NEAREST}) var pg_nearest: sampler;",
            *(f"{group} @binding({LINEAR + k}) var pg_linear_{rule}: sampler;" for k, rule in enumerate(WRAP_MODES)),
        ]
        lines += [
            f"{group} @binding({FIRST_IMAGE + k}) var pg_image{k}: texture_2d<f32>;" for k in range(len(program.images))
        ]
        # Not constants: wgpu copies one into a variable at each read by an index, 5 to 10 times as slow on lavapipe.
        for name, type_, values in program.tables:
            items = ", ".join(self.literal(s.Lit(type_, v)) for v in values)
            lines.append(f"var<private> {name} = array<{self.types[type_]}, {len(values)}>({items});")
        if program.stage == "vertex":
            sent = [f"    @location({k}) pg_varying{k}: vec4<f32>," for k in range(vec4_count(len(self.varyings)))]
            lines += ["struct Results {", "    @builtin(position) @invariant position: vec4<f32>,", *sent, "}"]
        elif program.outputs:
            outputs = [f"    @location({k}) pg_out{k}: vec4<f32>," for k in range(len(program.outputs))]
            lines += ["struct Results {", *outputs, "}"]
        return lines

    def _head(self) -> str:
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
            # A varying that is equal at all vertices may become a constant of the fragment shader.
            outputs = program.outputs[1].values if len(program.outputs) > 1 else ()
            sent = [self._unforeseen(v) for v in outputs]
            vectors = [_vec4(sent[4 * k : 4 * k + 4], ("0.0",) * 4) for k in range(vec4_count(len(sent)))]
            self.line(f"return Results({', '.join(['pg_position', *vectors])});")
            return
        if program.keep is not None:
            self.line(f"if (!{self.operand(program.keep)}) {{ discard; }}")
        if program.outputs:
            values = [[self.operand(v) for v in output.values] for output in program.outputs]
            missing = ("0.0", "0.0", "0.0", "1.0")
            self.line(f"return Results({', '.join(_vec4(channels, missing) for channels in values)});")


def _vec4(values: Sequence[str], missing: tuple[str, ...]) -> str:
    return f"vec4<f32>({', '.join([*values, *missing[len(values) :]])})"


@cache
def functions() -> dict[str, str]:
    """Return every helper function by name; border rules without a sampler mode call others."""
    rules = [rule for rule, border in BORDERS.items() if not border.is_nearest]
    return FUNCTIONS | {border_name(rule): _border_function(rule) for rule in rules}


def _border_function(rule: str) -> str:
    """Print a function that maps a column or row index into the picture."""
    program = border_program(rule)
    printer = WGSL(program)
    printer.line(f"fn {border_name(rule)}(i: i32, size: i32) -> i32\n{{")
    printer.indented(program.body)
    printer.line(f"    return {printer.operand(program.outputs[0].values[0])};\n}}")
    return printer.listing().text
