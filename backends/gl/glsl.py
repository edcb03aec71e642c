"""Print scalar programs as GLSL 3.30, and as GLSL ES 3.00 or newer (:mod:`passgraph.backends.gl.dialect`).

In our own pictures row 0 in memory is the top row, so ``gl_FragCoord`` counts rows as kernels do.  For a draw the
vertex shader flips clip space, so that rows count alike.  For pictures with another row order
(:mod:`passgraph.backends.gl.textures`) pixel and texel positions are flipped.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from passgraph.backends.base import ATTRIBUTES
from passgraph.backends.gl.dialect import GLSL_330, Dialect
from passgraph.backends.gl.textures import ALL_PLAIN, Placement, Placements
from passgraph.backends.printing import FLOOR_DIVIDE, INT_MOD, CLike, builtin_calls, spelled
from passgraph.backends.shader_printing import LETTERS, ShaderPrinter, vec4_count
from passgraph.language import native
from passgraph.language import scalar as s
from passgraph.language.builtin_name import OUTPUT_SIZE, BuiltinName
from passgraph.language.lowering.textures import Texture
from passgraph.records import dataclass

#: The negation of a bool.
NEGATED = "({0} ^^ true)"
#: Argument type → operation → expression.
SPELLED = spelled({
    "float": {
        "abs": "abs({0})", "round": "roundEven({0})", "bits_from_float": "floatBitsToInt({0})",
        **builtin_calls(native.GLSL, atan2="atan"), "fma": "FMA({0}, {1}, {2})",
        "mix": "mix({0}, {1}, {2})",
    },
    "int": {
        "add": "({0} + {1})", "sub": "({0} - {1})", "mul": "({0} * {1})", "neg": "(-{0})", "abs": "pg_abs({0})",
        "shift_left": "({0} << ({1} & 31))", "to_float": "float({0})", "float_from_bits": "intBitsToFloat({0})",
    },
    # Not "!": NVIDIA's compiler turns !(a < b) into a >= b, which differs for NaN.
    "bool": {"to_float": "({0} ? 1.0 : 0.0)", "logical_not": NEGATED},
    s.INDEX: {
        "int_mod": "pg_near_mod({0}, {1})", "nearer": "pg_nearer({0}, {1})", "below": "(uint({0}) < uint({1}))",
        "to_coordinate": "float({0})",
    },
    s.COORDINATE: {"floor": "floor({0})", "fract": "fract({0})", "to_index": "int({0})"},
})  # fmt: skip

#: Name → definition.  Definitions may call earlier ones.
FUNCTIONS = {
    "pg_isnan": "bool pg_isnan(float x) { return (floatBitsToInt(x) & 0x7fffffff) > 0x7f800000; }",
    "pg_isinf": "bool pg_isinf(float x) { return (floatBitsToInt(x) & 0x7fffffff) == 0x7f800000; }",
    # The uniform is never set, so it is 0; compilers cannot know that.
    "pg_hidden": """
uniform int pg_nil;
float pg_hidden(float x) { return intBitsToFloat(floatBitsToInt(x) | pg_nil); }
""",
    # Not the built-in: NVIDIA's compiler assumes its result is never negative, which is wrong for the lowest int.
    "pg_abs": "int pg_abs(int a) { return max(a, int(0u - uint(a))); }",
    "pg_to_int": """
int pg_to_int(float x)
{
    int i = int(max(x, -2147483648.0));
    i = x < 2147483648.0 ? i : 2147483647;
    return pg_isnan(x) ? 0 : i;
}
""",
    "pg_floor_divide": FLOOR_DIVIDE,
    "pg_int_mod": INT_MOD,
    # Of addresses, where b is a size: devices divide ints one by one, but floats in vectors.
    "pg_nearer": """
int pg_nearer(int a, int b)
{
    return a - int(float(a) * (1.0 / float(b))) * b;
}
""",
    "pg_near_mod": """
int pg_near_mod(int a, int b)
{
    int r = pg_nearer(a, b);
    r = r < 0 ? r + b : r;
    return r < b ? r : r - b;
}
""",
}

#: Blocks up to this length are arrays of scalars, which llvmpipe reads faster (a 15-tap blur takes 8 % less).  Longer
#: ones are arrays of vectors, as drivers may use four components for each scalar.
LONGEST_SCALAR_BLOCK = 256


@dataclass(frozen=True)
class Names:
    """Uniform names of one stage: both stages of a draw are linked together, so each needs its own names."""

    floats: str
    ints: str
    image: str


NAMES = {
    "pixel": Names("pg_floats", "pg_ints", "pg_image"),
    "vertex": Names("pg_vertex_floats", "pg_vertex_ints", "pg_vertex_image"),
    "fragment": Names("pg_floats", "pg_ints", "pg_image"),
}


def in_vectors(components: int) -> bool:
    """Return True if a block of this length is an array of vectors."""
    return components > LONGEST_SCALAR_BLOCK


def region_name(image: str, number: int) -> str:
    """Return the name of the uniform with the part of its texture that an image occupies."""
    return f"{image}{number}_region"


class GLSL(ShaderPrinter, CLike):
    """Prints a program of any stage as one shader."""

    spelled: ClassVar[Mapping[str, Mapping[str, str]]] = SPELLED
    float_, vec2, ivec2, vec4 = "float", "vec2", "ivec2", "vec4"
    fragment, derivative = "gl_FragCoord", "dFd"
    helpers = FUNCTIONS
    output_size, front_facing = "pg_output_size", "gl_FrontFacing"
    #: The center of this pixel in the target.
    center_here: ClassVar[str] = "gl_FragCoord.xy"

    def __init__(
        self,
        program: s.ScalarProgram,
        varyings: tuple[BuiltinName, ...] = (),
        placements: Placements = ALL_PLAIN,
        dialect: Dialect = GLSL_330,
    ) -> None:
        lies = {use.name: placements.placement(number) for number, use in enumerate(program.images)}
        super().__init__(program, varyings, {name: Texture(p.bottom_up, p.is_part) for name, p in lies.items()})
        self.placements = placements
        self.dialect = dialect
        self.own = NAMES[program.stage]
        self.image_ = self.own.image

    # Hooks

    def float_from_bits(self, bits: int) -> str:
        return f"intBitsToFloat({self.int_literal(bits)})"

    def declared(self, type_: str) -> str:
        # Comparisons too: an imprecise !(a < b) may become a >= b, which differs for NaN.
        return f"PRECISE {self.types[type_]}" if type_ in ("bool", "float") else self.types[type_]

    def declaration(self, type_: str, name: str, expression: str, exact: bool) -> str:
        return f"{'PRECISE ' * exact}{type_} {name} = {expression};"

    def hidden(self, text: str) -> str:
        return f"pg_hidden({text})"

    def uniform(self, block: str, index: str | int) -> str:
        name = self.own.floats if block == "float" else self.own.ints
        if not in_vectors(self.program.float_count if block == "float" else self.program.int_count):
            return f"{name}[{index}]"
        if isinstance(index, int):
            return f"{name}[{index // 4}].{LETTERS[index % 4]}"
        return f"{name}[{index} >> 2][{index} & 3]"

    def operation(self, op: s.Op, arguments: list[str]) -> str:
        if op.on == "float" and op.operation in ("min", "max"):
            return self._chosen(op.operation, *arguments)
        if op.on == "float" and op.operation in ("mul", "div", "fma"):
            arguments[:2] = self.unforeseen_operands(op.arguments[:2])
        return super().operation(op, arguments)

    def _chosen(self, operation: str, first: str, second: str) -> str:
        """Return the smaller or larger of two floats, and the first where they are not ordered.

        Compilers turn ``a < b ? b : a`` into a maximum, whose result for NaN and a number is the number: without
        ``precise`` always, with it inside loops (Mesa 22).  They leave ``mix`` with a bool as it is.
        """
        is_second = f"{second} < {first}" if operation == "min" else f"{first} < {second}"
        chosen = f"mix({first}, {second}, {is_second})"
        return chosen if self.dialect.is_precise else f"(pg_isnan({first}) ? {first} : {chosen})"

    def sample(self, load: s.Sample) -> None:
        """Read a texel by ``textureLod``, which takes llvmpipe two thirds of the time of ``texelFetch``."""
        image, x, y = self.texture(load.image), self.operand(load.x), self.operand(load.y)
        if {load.x.type, load.y.type} <= {"int", s.INDEX}:
            self.name_channels(load, f"texelFetch({image}, ivec2({x}, {y}), 0)")
        else:
            self.name_channels(load, f"textureLod({image}, vec2({x}, {y}), 0.0)")

    def builtin(self, name: BuiltinName) -> str:
        if name.kind not in ("low", "high", "region") or name.component is None:
            return super().builtin(name)
        place = self._region(name.of) if name.kind == "region" else self._edges(name.of)[name.kind == "high"]
        return f"{place}.{LETTERS[name.component]}"

    def here_in(self, image: str) -> str:
        lies, output = self._placement(image), self.placements.output
        same_direction = lies.bottom_up == output.bottom_up
        if same_direction and not lies.is_part and not output.is_part:
            return self.declare("vec2", "pg_here", f"{self.center_here} * {self.width(image)}")
        place = self.center_here
        if output.is_part:
            place = f"({place} - vec2(pg_output_origin))"
        if not same_direction:
            place = f"vec2({place}.x, float({self.size(image)}.y) - {place}.y)"
        if lies.is_part:
            place = f"({place} + vec2({self._region(image)}.xy))"
        return self.declare("vec2", f"pg_here{self.image_numbers[image]}", f"{place} * {self.width(image)}")

    def _placement(self, image: str) -> Placement:
        return self.placements.placement(self.image_numbers[image])

    def width(self, image: str) -> str:
        count = self.texture_size(image) if self._placement(image).is_part else self.size(image)
        return self.declare("vec2", f"pg_texel{self.image_numbers[image]}", f"1.0 / vec2({count})")

    def pixel(self) -> str:
        place, lies = f"ivec2({self.center_here})", self.placements.output
        if lies.is_part:
            place = f"({place} - pg_output_origin)"
        if lies.bottom_up:
            place = f"ivec2({place}.x, pg_output_size.y - 1 - {place}.y)"
        return self.declare("ivec2", "pg_pixel", place)

    def size(self, image: str) -> str:
        size = f"{self._region(image)}.zw" if self._placement(image).is_part else self.texture_size(image)
        return self.declare("ivec2", f"pg_size{self.image_numbers[image]}", size)

    def texture_size(self, image: str) -> str:
        return f"textureSize({self.texture(image)}, 0)"

    def _region(self, image: str) -> str:
        """Return the uniform with the origin and size of a part of a texture."""
        return region_name(self.own.image, self.image_numbers[image])

    def _edges(self, image: str) -> tuple[str, str]:
        """Return the centers of the first and the last texel of a part."""
        number, region, width = self.image_numbers[image], self._region(image), self.width(image)
        low = self.declare("vec2", f"pg_low{number}", f"(vec2({region}.xy) + 0.5) * {width}")
        return low, self.declare("vec2", f"pg_high{number}", f"(vec2({region}.xy + {region}.zw) - 0.5) * {width}")

    # Whole shaders

    def head(self) -> str:
        return "void main()"

    def interface(self) -> list[str]:
        program, lines = self.program, [self.dialect.header]
        for name, count, scalar, vector in (
            (self.own.floats, program.float_count, "float", "vec4"),
            (self.own.ints, program.int_count, "int", "ivec4"),
        ):
            if count:
                entry = f"{vector} {name}[{vec4_count(count)}]" if in_vectors(count) else f"{scalar} {name}[{count}]"
                lines.append(f"uniform {entry};")
        output = self.placements.output
        if output.bottom_up or any(name in OUTPUT_SIZE for name, _ in program.builtins):
            lines.append("uniform ivec2 pg_output_size;")
        if output.is_part:
            lines.append("uniform ivec2 pg_output_origin;")
        parts = [k for k in range(len(program.images)) if self.placements.placement(k).is_part]
        lines += [f"uniform ivec4 {region_name(self.own.image, k)};" for k in parts]
        lines += [f"uniform sampler2D {self.own.image}{k};" for k in range(len(program.images))]
        for name, type_, values in program.tables:
            items = ", ".join(self.literal(s.Lit(type_, v)) for v in values)
            lines.append(f"const {type_} {name}[{len(values)}] = {type_}[{len(values)}]({items});")
        direction = "out" if program.stage == "vertex" else "in"
        lines += [f"{direction} vec4 pg_varying{k};" for k in range(vec4_count(len(self.varyings)))]
        if program.stage == "vertex":
            lines.append("uniform float pg_guard;")
            for k, (attribute, (_, size)) in enumerate(ATTRIBUTES.items()):
                if attribute in program.attributes:
                    type_ = "float" if size == 1 else f"vec{size}"
                    lines.append(f"layout(location = {k}) in {type_} in_{attribute};")
        else:
            lines += [f"layout(location = {k}) out vec4 pg_out{k};" for k in range(len(program.outputs))]
        return lines

    def results(self) -> None:
        program = self.program
        if program.stage == "vertex":
            x, y, z, w = (self.operand(v) for v in program.outputs[0].values)
            self.line(f"gl_Position = vec4({x} * pg_guard, -({y}) * pg_guard, {z}, {w});")
            # Rule 1 drops triangles with such a vertex; an infinite w alone would be a valid position.
            self.line("bvec4 pg_lost = equal(floatBitsToInt(gl_Position) & 0x7f800000, ivec4(0x7f800000));")
            self.line("if (any(pg_lost)) { gl_Position = vec4(intBitsToFloat(0x7fc00000)); }")
            for k, varying in enumerate(self.sent()):
                self.line(f"pg_varying{k} = {varying};")
            return
        if program.keep is not None:
            self.line(f"if {NEGATED.format(self.operand(program.keep))} {{ discard; }}")
        for k, output in enumerate(program.outputs):
            self.line(f"pg_out{k} = {self.stored(output)};")
