"""Print scalar programs as GLSL 3.30, and as GLSL ES 3.00 or newer (:mod:`passgraph.backends.gl.dialect`).

In our own pictures row 0 in memory is the top row, so ``gl_FragCoord`` counts rows as kernels do.  For a draw the
vertex shader flips clip space, so that rows count alike.  For pictures with another row order
(:mod:`passgraph.backends.gl.textures`) pixel and texel positions are flipped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

from passgraph.backends.base import ATTRIBUTES
from passgraph.backends.foreseen import foreseen_values
from passgraph.backends.gl.dialect import GLSL_330, Dialect
from passgraph.backends.gl.textures import ALL_PLAIN, Placement, Placements
from passgraph.backends.printing import FLOOR_DIVIDE, INT_MOD, CLike, Listing, builtin_calls, spelled
from passgraph.language import native
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS, border_name, border_program
from passgraph.language.ir import own_pixel

#: The negation of a bool.
NEGATED = "({0} ^^ true)"
#: Argument type → operation → expression.
SPELLED = spelled({
    "float": {
        "abs": "abs({0})", "round": "roundEven({0})", "bits_from_float": "floatBitsToInt({0})",
        **builtin_calls(native.GLSL, atan2="atan"), "fma": "FMA({0}, {1}, {2})",
    },
    "int": {
        "add": "({0} + {1})", "sub": "({0} - {1})", "mul": "({0} * {1})", "neg": "(-{0})", "abs": "pg_abs({0})",
        "shift_left": "({0} << ({1} & 31))", "to_float": "float({0})", "float_from_bits": "intBitsToFloat({0})",
    },
    # Not "!": NVIDIA's compiler turns !(a < b) into a >= b, which differs for NaN.
    "bool": {"to_float": "({0} ? 1.0 : 0.0)", "logical_not": NEGATED},
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
    # Part of the border rules, where b is a size: devices divide ints one by one, but floats in vectors.
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


LETTERS = "xyzw"
#: Larger than every picture, and small enough that its float stays an int after multiplication and rounding.  Larger
#: offsets are reduced first: adding the pixel's position could overflow 32 bits.
FARTHEST_TEXEL = 1 << 30
#: ``pg_near_mod`` is exact up to here: the float quotient is off by less than one.  ``pg_nearer`` reduces every int to
#: less than b + 1024 from 0, at the same place in a period of b.
NEAR = 1 << 20
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
    "border": Names("", "", ""),
    "pixel": Names("pg_floats", "pg_ints", "pg_image"),
    "vertex": Names("pg_vertex_floats", "pg_vertex_ints", "pg_vertex_image"),
    "fragment": Names("pg_floats", "pg_ints", "pg_image"),
}


def vec4_count(components: int) -> int:
    return (components + 3) // 4


def in_vectors(components: int) -> bool:
    """Return True if a block of this length is an array of vectors."""
    return components > LONGEST_SCALAR_BLOCK


def region_name(image: str, number: int) -> str:
    """Return the name of the uniform with the part of its texture that an image occupies."""
    return f"{image}{number}_region"


class GLSL(CLike):
    """Prints a program of any stage as one shader; ``varyings`` names the scalars passed from vertex to fragment."""

    spelled: ClassVar[Mapping[str, Mapping[str, str]]] = SPELLED
    #: The center of this pixel in the target.
    place: ClassVar[str] = "gl_FragCoord.xy"

    def __init__(
        self,
        program: s.ScalarProgram,
        varyings: tuple[str, ...] = (),
        placements: Placements = ALL_PLAIN,
        dialect: Dialect = GLSL_330,
    ) -> None:
        super().__init__(program)
        self.placements = placements
        self.dialect = dialect
        self.varyings = varyings
        self.own = NAMES[program.stage]
        self.image_numbers = {use.name: k for k, use in enumerate(program.images)}
        self.foreseen = foreseen_values(program)
        #: Names declared at the top of main, in order, with their expressions.
        self.declarations: dict[str, str] = {}

    # Hooks

    def float_from_bits(self, bits: int) -> str:
        return f"intBitsToFloat({self.int_literal(bits)})"

    def declared(self, type_: str) -> str:
        # Comparisons too: an imprecise !(a < b) may become a >= b, which differs for NaN.
        return self.types[type_] if type_ == "int" else f"PRECISE {self.types[type_]}"

    def uniform(self, block: str, index: str | int) -> str:
        name = self.own.floats if block == "float" else self.own.ints
        if not in_vectors(self.program.float_count if block == "float" else self.program.int_count):
            return f"{name}[{index}]"
        if isinstance(index, int):
            return f"{name}[{index // 4}].{LETTERS[index % 4]}"
        return f"{name}[{index} >> 2][{index} & 3]"

    def builtin(self, name: str) -> str:
        if self.program.stage == "border":
            return name
        head, _, rest = name.partition(".")
        if head == "pixel":
            return f"{self._pixel()}.{LETTERS[int(rest)]}"
        if head == "output_size":
            return f"pg_output_size.{LETTERS[int(rest)]}"
        if head == "size":
            image, _, axis = rest.rpartition(".")
            return f"{self._size(image)}.{LETTERS[int(axis)]}"
        if head == "vertex":
            attribute, _, component = rest.partition(".")
            return f"in_{attribute}.{LETTERS[int(component)]}" if component else f"in_{attribute}"
        name, axes = own_pixel(name)
        if name.startswith("varying."):
            return self._varying(self.varyings.index(name.removeprefix("varying.")), axes)
        return self._depth(axes) if name == "fragment_depth" else {"front_facing": "gl_FrontFacing"}[name]

    def operation(self, op: s.Op, arguments: list[str]) -> str:
        if self.program.stage == "border" and op.operation == "int_mod":
            return f"pg_near_mod({', '.join(arguments)})"
        # Compilers that assume no NaN fold x != x; they do not fold bit operations.
        if op.on == "float" and op.operation in ("equal", "not_equal") and arguments[0] == arguments[1]:
            return f"{'!' if op.operation == 'equal' else ''}pg_isnan({arguments[0]})"
        if op.on == "float" and op.operation in ("min", "max"):
            return self._chosen(op.operation, *arguments)
        if op.on == "float" and op.operation in ("mul", "div", "fma"):
            both = all(self.foreseen.known(a) for a in op.arguments[:2])
            arguments[:2] = [self._hidden(a, both) for a in op.arguments[:2]]
        return super().operation(op, arguments)

    def _chosen(self, operation: str, first: str, second: str) -> str:
        """Return the smaller or larger of two floats, and the first where they are not ordered.

        Compilers turn ``a < b ? b : a`` into a maximum, whose result for NaN and a number is the number: without
        ``precise`` always, with it inside loops (Mesa 22).  They leave ``mix`` with a bool as it is.
        """
        is_second = f"{second} < {first}" if operation == "min" else f"{first} < {second}"
        chosen = f"mix({first}, {second}, {is_second})"
        return chosen if self.dialect.is_precise else f"(pg_isnan({first}) ? {first} : {chosen})"

    def _hidden(self, operand: s.Operand, among_constants: bool = False) -> str:
        """Return an operand that compilers cannot assume to be 0: see :mod:`passgraph.backends.foreseen`.

        Among constants only a literal zero is hidden: compilers fold constants correctly.
        """
        text = self.operand(operand)
        zero = self.foreseen.may_be_zero(operand) and (isinstance(operand, s.Lit) or not among_constants)
        return f"pg_hidden({text})" if zero else text

    def texel(self, load: s.LoadTexel) -> None:
        """Read a texel by ``textureLod``, which takes llvmpipe two thirds of the time of ``texelFetch``.

        Coordinates are centers of texels (exact in float32 for pictures up to 2²¹ texels a side), filters are nearest,
        and textures clamp to their edge.
        """
        image = f"{self.own.image}{self.image_numbers[load.image]}"
        if load.filtered and self._placement(load.image).is_part and load.border != "clamp":
            self._name_channels(load, self._mixed(load, image))
            return
        if load.filtered:
            self._name_channels(load, f"textureLod({image}, {self._filtered_place(load)}, 0.0)")
            return
        places: list[str] = []
        inside: list[str] = []
        for axis, offset in zip("xy", (load.x, load.y), strict=True):
            place, check = self._place(load, axis, offset)
            places.append(place)
            inside += check
        fetch = f"textureLod({image}, vec2({places[0]}, {places[1]}), 0.0)"
        if inside:
            fetch = f"({' && '.join(inside)}) ? {fetch} : vec4(0.0)"
        self._name_channels(load, fetch)

    def _name_channels(self, load: s.LoadTexel, fetch: str) -> None:
        first = next(v for v in load.to if v is not None)
        self.line(f"vec4 t{first.id} = {fetch};")
        for value, letter in zip(load.to, LETTERS, strict=False):
            if value is not None:
                self.name(value, f"t{first.id}.{letter}")

    def _mixed(self, load: s.LoadTexel, image: str) -> str:
        """Print a bilinear sample of a part of a texture by four texels: samplers wrap at the edges of textures."""
        name, size = f"p{next(v for v in load.to if v is not None).id}", self._size(load.image)
        lies, rule, region = self._placement(load.image), BORDERS[load.border], self._region(load.image)
        place = f"vec2({self.operand(load.x)}, {self.operand(load.y)}) * vec2({size}) - 0.5"
        self.line(f"vec2 {name} = clamp({place}, -{FARTHEST_TEXEL}.0, {FARTHEST_TEXEL}.0);")
        self.line(f"ivec2 {name}_corner = ivec2(floor({name}));")

        def texel(right: int, down: int) -> str:
            found, inside = [], []
            for axis, step in zip("xy", (right, down), strict=True):
                at, count = f"({name}_corner.{axis} + {step})", f"{size}.{axis}"
                inside.append(f"uint({at}) < uint({count})")
                if rule.is_nearest:
                    found.append(f"clamp({at}, 0, {count} - 1)")
                else:
                    near = f"pg_nearer({at}, {rule.period.replace('size', count)})"
                    found.append(f"{border_name(load.border)}({near}, {count})")
            row = f"{size}.y - 1 - {found[1]}" if lies.bottom_up else found[1]
            fetch = f"texelFetch({image}, {region}.xy + ivec2({found[0]}, {row}), 0)"
            return f"({' && '.join(inside)} ? {fetch} : vec4(0.0))" if rule.blank else fetch

        rows = [f"mix({texel(0, down)}, {texel(1, down)}, fract({name}.x))" for down in (0, 1)]
        return f"mix({rows[0]}, {rows[1]}, fract({name}.y))"

    def _filtered_place(self, load: s.LoadTexel) -> str:
        """Convert a position in [0, 1] to texture coordinates, clamped to the outermost texel centers of a part."""
        place, lies = f"vec2({self.operand(load.x)}, {self.operand(load.y)})", self._placement(load.image)
        if lies.bottom_up:
            place = f"(vec2(0.0, 1.0) + vec2(1.0, -1.0) * {place})"
        if lies.is_part:
            place = f"({place} * vec2({self._size(load.image)}) + vec2({self._region(load.image)}.xy))"
            place = "clamp({} * {}, {}, {})".format(place, self._width(load.image), *self._edges(load.image))
        return place

    def _place(self, load: s.LoadTexel, axis: str, offset: s.Operand) -> tuple[str, list[str]]:
        """Return one coordinate of a texel's center, and the conditions under which a zero border shows the texel."""
        constant_offset = int(offset.value) if isinstance(offset, s.Lit) else None
        if load.relative and constant_offset == 0:
            return f"{self._here(load.image)}.{axis}", []  # the image is as large as the target
        text = self.operand(offset)
        if constant_offset is not None:
            constant_offset = min(max(constant_offset, -FARTHEST_TEXEL), FARTHEST_TEXEL)
        count = f"{self._size(load.image)}.{axis}"
        use, rule = self.program.image(load.image), BORDERS[load.border]
        reach = max(map(abs, use.x if axis == "x" else use.y))
        if rule.period and (not load.relative or reach > NEAR):
            constant_offset, text = None, f"pg_nearer({text}, {rule.period.replace('size', count)})"
        elif load.relative and reach > FARTHEST_TEXEL:
            constant_offset, text = None, f"clamp({text}, -2 * {count}, 2 * {count})"
        coordinate = f"{self._pixel()}.{axis} + {text}" if load.relative else text
        if not rule.is_nearest:
            return self._centre(load.image, axis, f"float({border_name(load.border)}({coordinate}, {count}))"), []
        # Drivers convert the coordinate to int before they clamp it; too large a number wraps to the other edge.
        turned = axis == "y" and self._placement(load.image).bottom_up
        nearer = f"max({text}, -{FARTHEST_TEXEL})" if turned else f"min({text}, {FARTHEST_TEXEL})"
        number = f"float({nearer})" if constant_offset is None else self.float_literal(constant_offset)
        if load.relative:
            place = (
                f"{self._here(load.image)}.{axis} {'-' if turned else '+'} {number} * {self._width(load.image)}.{axis}"
            )
        else:
            place = self._centre(load.image, axis, number)
        if self._placement(load.image).is_part:
            place = "clamp({}, {}.{axis}, {}.{axis})".format(place, *self._edges(load.image), axis=axis)
        if not rule.blank:
            return place, []
        if constant_offset is None:
            # as unsigned, negative numbers exceed all counts
            return place, [f"uint({coordinate}) < uint({count})"]
        low, high = (constant_offset < 0, constant_offset > 0) if load.relative else (constant_offset < 0, True)
        return place, [f"{coordinate} >= 0"] * low + [f"{coordinate} < {count}"] * high

    def _centre(self, image: str, axis: str, number: str) -> str:
        """Return the center of a column or row in texture coordinates."""
        lies = self._placement(image)
        inside = f"({number} + 0.5)"
        if axis == "y" and lies.bottom_up:
            inside = f"(float({self._size(image)}.y) - {inside})"
        if lies.is_part:
            inside = f"({inside} + float({self._region(image)}.{axis}))"
        return f"{inside} * {self._width(image)}.{axis}"

    def _here(self, image: str) -> str:
        """Return the center of this pixel in texture coordinates of an image of the target's size."""
        lies, output = self._placement(image), self.placements.output
        same_direction = lies.bottom_up == output.bottom_up
        if same_direction and not lies.is_part and not output.is_part:
            self.declarations.setdefault("pg_here", f"vec2 pg_here = {self.place} * {self._width(image)};")
            return "pg_here"
        name = f"pg_here{self.image_numbers[image]}"
        place = self.place
        if output.is_part:
            place = f"({place} - vec2(pg_output_origin))"
        if not same_direction:
            place = f"vec2({place}.x, float({self._size(image)}.y) - {place}.y)"
        if lies.is_part:
            place = f"({place} + vec2({self._region(image)}.xy))"
        self.declarations.setdefault(name, f"vec2 {name} = {place} * {self._width(image)};")
        return name

    def _placement(self, image: str) -> Placement:
        return self.placements.placement(self.image_numbers[image])

    def _width(self, image: str) -> str:
        """Return the width and height of a texel in texture coordinates."""
        number = self.image_numbers[image]
        name = f"pg_texel{number}"
        count = f"textureSize({self.own.image}{number}, 0)" if self._placement(image).is_part else self._size(image)
        self.declarations.setdefault(name, f"vec2 {name} = 1.0 / vec2({count});")
        return name

    def _pixel(self) -> str:
        place, lies = f"ivec2({self.place})", self.placements.output
        if lies.is_part:
            place = f"({place} - pg_output_origin)"
        if lies.bottom_up:
            place = f"ivec2({place}.x, pg_output_size.y - 1 - {place}.y)"
        self.declarations.setdefault("pg_pixel", f"ivec2 pg_pixel = {place};")
        return "pg_pixel"

    def _varying(self, index: int, axes: str) -> str:
        """Return a scalar varying, at another pixel of the quad through the planes of varying / w and of 1 / w.

        Only derivatives of these planes are used, and those are equal at all pixels: drivers may compute coarse
        derivatives, and form quads in their own way.
        """
        if not axes:
            return varying_place(index)
        vector = index // 4
        over_w, step = f"pg_over_w{vector}", self._stepped("gl_FragCoord.w", axes)
        self.declarations.setdefault(over_w, f"PRECISE vec4 {over_w} = pg_varying{vector} * gl_FragCoord.w;")
        moved = f"pg_varying{vector}{axes}"
        declaration = f"PRECISE vec4 {moved} = {self._stepped(over_w, axes)} / {step};"
        self.declarations.setdefault(moved, declaration)
        return f"{moved}.{LETTERS[index % 4]}"

    def _depth(self, axes: str) -> str:
        """Clamp the depth as it is stored: a polygon offset may leave 0 to 1, and drivers leave clamping to shaders."""
        name = f"pg_depth{axes}"
        declaration = f"PRECISE float {name} = clamp({self._stepped('gl_FragCoord.z', axes)}, 0.0, 1.0);"
        self.declarations.setdefault(name, declaration)
        return name

    def _stepped(self, plane: str, axes: str) -> str:
        """Return a plane's value at another pixel of the quad, or at this one."""
        if not axes:
            return plane
        ways = f"vec2 pg_way = vec2(1 - 2 * ({self._pixel()} & 1));"
        self.declarations.setdefault("pg_way", ways)
        return f"({' + '.join([plane, *(f'pg_way.{axis} * dFd{axis}({plane})' for axis in axes)])})"

    def _size(self, image: str) -> str:
        number = self.image_numbers[image]
        name = f"pg_size{number}"
        size = (
            f"{self._region(image)}.zw"
            if self._placement(image).is_part
            else f"textureSize({self.own.image}{number}, 0)"
        )
        self.declarations.setdefault(name, f"ivec2 {name} = {size};")
        return name

    def _region(self, image: str) -> str:
        """Return the uniform with the origin and size of a part of a texture."""
        return region_name(self.own.image, self.image_numbers[image])

    def _edges(self, image: str) -> tuple[str, str]:
        """Return the centers of the first and the last texel of a part."""
        number, region, width = self.image_numbers[image], self._region(image), self._width(image)
        low, high = f"pg_low{number}", f"pg_high{number}"
        self.declarations.setdefault(low, f"vec2 {low} = (vec2({region}.xy) + 0.5) * {width};")
        self.declarations.setdefault(high, f"vec2 {high} = (vec2({region}.xy + {region}.zw) - 0.5) * {width};")
        return low, high

    # Whole shaders

    def shader(self) -> Listing:
        """Return the complete source."""
        self.depth = 1
        self.variables()
        self.block(self.program.body)
        self.results()
        self.depth = 0
        self.line("}")
        declared = "".join(f"\n    {text}" for text in self.declarations.values())
        parts = [self.dialect.header, *self.interface(), self.called(functions()), f"void main()\n{{{declared}"]
        self.front("\n".join(part for part in parts if part))
        return self.listing()

    def interface(self) -> list[str]:
        """Declare uniforms, tables, inputs and outputs."""
        program, lines = self.program, []
        for name, count, scalar, vector in (
            (self.own.floats, program.float_count, "float", "vec4"),
            (self.own.ints, program.int_count, "int", "ivec4"),
        ):
            if count:
                entry = f"{vector} {name}[{vec4_count(count)}]" if in_vectors(count) else f"{scalar} {name}[{count}]"
                lines.append(f"uniform {entry};")
        output = self.placements.output
        if output.bottom_up or any(name.startswith("output_size") for name, _ in program.builtins):
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
            # A varying that is equal at all vertices may become a constant of the fragment shader.
            sent = [self._hidden(v) for v in (program.outputs[1].values if len(program.outputs) > 1 else ())]
            for k in range(vec4_count(len(sent))):
                self.line(f"pg_varying{k} = {_vec4(sent[4 * k : 4 * k + 4], ('0.0',) * 4)};")
            return
        if program.keep is not None:
            self.line(f"if {NEGATED.format(self.operand(program.keep))} {{ discard; }}")
        for k, output in enumerate(program.outputs):
            values = [self.operand(v) for v in output.values]
            self.line(f"pg_out{k} = {_vec4(values, ('0.0', '0.0', '0.0', '1.0'))};")


def _vec4(values: Sequence[str], missing: tuple[str, ...]) -> str:
    return f"vec4({', '.join([*values, *missing[len(values) :]])})"


def varying_place(index: int) -> str:
    """Return the interpolated component that carries a scalar varying."""
    return f"pg_varying{index // 4}.{LETTERS[index % 4]}"


@cache
def functions() -> dict[str, str]:
    """Return every helper function by name; border rules that hardware has need no other functions."""
    rules = [rule for rule, border in BORDERS.items() if not border.is_nearest]
    return FUNCTIONS | {border_name(rule): _border_function(rule) for rule in rules}


def _border_function(rule: str) -> str:
    """Print a function that maps a column or row index into the picture."""
    program = border_program(rule)
    printer = GLSL(program)
    printer.line(f"int {border_name(rule)}(int i, int size)\n{{")
    printer.indented(program.body)
    printer.line(f"    return {printer.operand(program.outputs[0].values[0])};\n}}")
    return printer.listing().text
