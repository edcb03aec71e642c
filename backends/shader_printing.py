"""Print scalar programs as shaders: what GLSL and WGSL have in common.

Texels are read through samplers, at their centers in texture coordinates (exact in float32 for pictures up to 2²¹
texels a side): filters are nearest, and textures clamp to their edge.  Border rules that samplers lack are functions.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from functools import cache
from typing import ClassVar

from passgraph.backends.foreseen import foreseen_values
from passgraph.backends.printing import Listing, Printer
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS, border_name, border_program
from passgraph.language.builtin_name import BuiltinName

LETTERS = "xyzw"
#: Larger than every picture, and small enough that its float stays an int after multiplication and rounding.  Larger
#: offsets are reduced first: adding the pixel's position could overflow 32 bits.
FARTHEST_TEXEL = 1 << 30
#: ``pg_near_mod`` is exact up to here: the float quotient is off by less than one.  ``pg_nearer`` reduces every int to
#: less than b + 1024 from 0, at the same place in a period of b.
NEAR = 1 << 20


def vec4_count(components: int) -> int:
    return (components + 3) // 4


class ShaderPrinter(Printer):
    """Prints a program of any stage as one shader; ``varyings`` names the scalars passed from vertex to fragment."""

    #: Names of types.
    float_: ClassVar[str]
    uint: ClassVar[str]
    vec2: ClassVar[str]
    ivec2: ClassVar[str]
    vec4: ClassVar[str]
    #: Of a fragment: its center in the target, depth and 1 / w.
    fragment: ClassVar[str]
    #: The derivative along x or y, without that letter.
    derivative: ClassVar[str]
    #: Head of a border rule's function, and definitions of the helper functions by name, which may call earlier ones.
    border_head: ClassVar[str]
    helpers: ClassVar[Mapping[str, str]]
    #: Builtins → expression.
    output_size: ClassVar[str]
    front_facing: ClassVar[str]

    def __init__(self, program: s.ScalarProgram, varyings: tuple[BuiltinName, ...] = ()) -> None:
        super().__init__(program)
        self.varyings = varyings
        self.image_numbers = {use.name: k for k, use in enumerate(program.images)}
        self.foreseen = foreseen_values(program)
        #: Names declared at the top of main, in order, with their declarations.
        self.declarations: dict[str, str] = {}

    # Syntax of the language

    @abstractmethod
    def declaration(self, type_: str, name: str, expression: str, exact: bool) -> str:
        """Declare a name; ``exact`` keeps the order of its arithmetic where compilers may change it."""

    @abstractmethod
    def texture_size(self, image: str) -> str:
        """Return the width and height of an image's texture, ints."""

    @abstractmethod
    def hidden(self, text: str) -> str:
        """Return a float that compilers can neither evaluate nor combine with others."""

    @abstractmethod
    def interface(self) -> list[str]:
        """Declare uniforms, images, tables, inputs and outputs."""

    @abstractmethod
    def head(self) -> str:
        """Return the head of the main function, up to its brace."""

    @abstractmethod
    def results(self) -> None:
        """Print the statements at the end of the main function."""

    # Operands

    def declare(self, type_: str, name: str, expression: str, exact: bool = False) -> str:
        self.declarations.setdefault(name, self.declaration(type_, name, expression, exact))
        return name

    def unforeseen(self, operand: s.Operand, among_constants: bool = False) -> str:
        """Return an operand that compilers cannot assume to be 0: see :mod:`passgraph.backends.foreseen`.

        Among constants only a literal zero is hidden: compilers fold constants correctly.
        """
        text = self.operand(operand)
        zero = self.foreseen.may_be_zero(operand) and (isinstance(operand, s.Lit) or not among_constants)
        return self.hidden(text) if zero else text

    def unforeseen_operands(self, operands: Sequence[s.Operand]) -> list[str]:
        all_known = all(map(self.foreseen.known, operands))
        return [self.unforeseen(a, all_known) for a in operands]

    def sent(self) -> list[str]:
        """Return the vectors of varyings that a vertex program sends; the last is filled with 0.

        A varying that is equal at all vertices may become a constant of the fragment shader.
        """
        outputs = self.program.outputs[1].values if len(self.program.outputs) > 1 else ()
        sent = [self.unforeseen(v) for v in outputs]
        return [self.vector(sent[4 * k : 4 * k + 4], ("0.0",) * 4) for k in range(vec4_count(len(sent)))]

    def stored(self, output: s.Output) -> str:
        """Return the vector that a pixel writes; missing channels are 0, 0, 1."""
        return self.vector([self.operand(v) for v in output.values], ("0.0", "0.0", "0.0", "1.0"))

    def vector(self, values: Sequence[str], missing: tuple[str, ...]) -> str:
        return f"{self.vec4}({', '.join([*values, *missing[len(values) :]])})"

    def operation(self, op: s.Op, arguments: list[str]) -> str:
        if self.program.stage == "border" and op.operation == "int_mod":
            return f"pg_near_mod({', '.join(arguments)})"
        # Compilers that assume no NaN fold x != x; they do not fold bit operations.
        if op.on == "float" and op.operation in ("equal", "not_equal") and arguments[0] == arguments[1]:
            return f"{'!' if op.operation == 'equal' else ''}pg_isnan({arguments[0]})"
        return super().operation(op, arguments)

    # Builtins

    def builtin(self, name: BuiltinName) -> str:
        if self.program.stage == "border":
            return name.kind
        component = "" if name.component is None else f".{LETTERS[name.component]}"
        if name.kind == "pixel":
            return self.pixel() + component
        if name.kind == "output_size":
            return self.output_size + component
        if name.kind == "size":
            return self.size(name.of) + component
        if name.kind == "vertex":
            return f"in_{name.of}{component}"
        if name.kind == "varying":
            return self._varying(self.varyings.index(name.at("")), name.axes)
        return (
            self._depth(name.axes) if name.kind == "fragment_depth" else {"front_facing": self.front_facing}[name.kind]
        )

    def pixel(self) -> str:
        return self.declare(self.ivec2, "pg_pixel", f"{self.ivec2}({self.fragment}.xy)")

    def _varying(self, index: int, axes: str) -> str:
        """Return a scalar varying, at another pixel of the quad through the planes of varying / w and of 1 / w.

        Only derivatives of these planes are used, and those are equal at all pixels: drivers may compute coarse
        derivatives, and form quads in their own way.
        """
        vector, letter = index // 4, LETTERS[index % 4]
        if not axes:
            return f"pg_varying{vector}.{letter}"
        inverse_w = f"{self.fragment}.w"
        over_w = self.declare(self.vec4, f"pg_over_w{vector}", f"pg_varying{vector} * {inverse_w}", exact=True)
        moved = f"{self._stepped(over_w, axes)} / {self._stepped(inverse_w, axes)}"
        return f"{self.declare(self.vec4, f'pg_varying{vector}{axes}', moved, exact=True)}.{letter}"

    def _depth(self, axes: str) -> str:
        """Clamp the depth as it is stored: a polygon offset may leave 0 to 1, and drivers leave clamping to shaders."""
        clamped = f"clamp({self._stepped(f'{self.fragment}.z', axes)}, 0.0, 1.0)"
        return self.declare(self.float_, f"pg_depth{axes}", clamped, exact=True)

    def _stepped(self, plane: str, axes: str) -> str:
        """Return a plane's value at another pixel of the quad, or at this one."""
        if not axes:
            return plane
        way = self.declare(self.vec2, "pg_way", f"{self.vec2}(1 - 2 * ({self.pixel()} & {self.ivec2}(1)))")
        return f"({' + '.join([plane, *(f'{way}.{axis} * {self.derivative}{axis}({plane})' for axis in axes)])})"

    # Texels

    def size(self, image: str) -> str:
        return self.declare(self.ivec2, f"pg_size{self.image_numbers[image]}", self.texture_size(image))

    def width(self, image: str) -> str:
        """Return the width and height of a texel in texture coordinates."""
        name = f"pg_texel{self.image_numbers[image]}"
        return self.declare(self.vec2, name, f"1.0 / {self.vec2}({self.size(image)})")

    def here_in(self, image: str) -> str:
        """Return the center of this pixel in texture coordinates of an image of the target's size."""
        name = f"pg_here{self.image_numbers[image]}"
        return self.declare(self.vec2, name, f"{self.fragment}.xy * {self.width(image)}")

    def center(self, image: str, axis: str, number: str) -> str:
        """Return the center of a column or row in texture coordinates."""
        return f"({number} + 0.5) * {self.width(image)}.{axis}"

    def is_turned(self, image: str, axis: str) -> bool:
        """Return True if texture coordinates count from the other end of an image."""
        return False

    def within(self, image: str, axis: str, place: str) -> str:
        """Clamp a texture coordinate to the image, if its sampler does not."""
        return place

    def place(self, load: s.LoadTexel) -> tuple[str, list[str]]:
        """Return a texel's center, and the conditions under which a zero border shows the texel."""
        (x, in_x), (y, in_y) = (self._place(load, axis, at) for axis, at in zip("xy", (load.x, load.y), strict=True))
        return f"{self.vec2}({x}, {y})", [*in_x, *in_y]

    def _place(self, load: s.LoadTexel, axis: str, offset: s.Operand) -> tuple[str, list[str]]:
        image, known = load.image, int(offset.value) if isinstance(offset, s.Lit) else None
        if load.relative and known == 0:
            return f"{self.here_in(image)}.{axis}", []  # the image is as large as the target
        text, count = self.operand(offset), f"{self.size(image)}.{axis}"
        use, rule = self.program.image(image), BORDERS[load.border]
        reach = max(map(abs, use.x if axis == "x" else use.y))
        if rule.period and (not load.relative or reach > NEAR):
            known, text = None, f"pg_nearer({text}, {rule.period.replace('size', count)})"
        elif load.relative and reach > FARTHEST_TEXEL:
            known, text = None, f"clamp({text}, -2 * {count}, 2 * {count})"
        coordinate = f"({self.pixel()}.{axis} + {text})" if load.relative else text
        if not rule.is_nearest:
            return self.center(image, axis, f"{self.float_}({border_name(load.border)}({coordinate}, {count}))"), []
        turned = self.is_turned(image, axis)
        if known is None:
            # Drivers convert the coordinate to int before they clamp it; too large a number wraps to the other edge.
            nearer = f"max({text}, -{FARTHEST_TEXEL})" if turned else f"min({text}, {FARTHEST_TEXEL})"
            number = f"{self.float_}({nearer})"
        else:
            number = self.float_literal(min(max(known, -FARTHEST_TEXEL), FARTHEST_TEXEL))
        if load.relative:
            place = f"{self.here_in(image)}.{axis} {'-' if turned else '+'} {number} * {self.width(image)}.{axis}"
        else:
            place = self.center(image, axis, number)
        place = self.within(image, axis, place)
        if not rule.blank:
            return place, []
        if known is None:
            # as unsigned, negative numbers exceed all counts
            return place, [f"{self.uint}({coordinate}) < {self.uint}({count})"]
        low, high = (known < 0, known > 0) if load.relative else (known < 0, True)
        return place, [f"{coordinate} >= 0"] * low + [f"{coordinate} < {count}"] * high

    def name_channels(self, load: s.LoadTexel, fetch: str) -> None:
        """Fetch a texel, and name the channels that the program reads."""
        first = next(v for v in load.to if v is not None)
        self.line(self.declaration(self.vec4, f"t{first.id}", fetch, exact=False))
        for value, letter in zip(load.to, LETTERS, strict=False):
            if value is not None:
                self.name(value, f"t{first.id}.{letter}")

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
        parts = [*self.interface(), self.called(self.functions()), f"{self.head()}\n{{{declared}"]
        self.front("\n".join(part for part in parts if part))
        return self.listing()

    @classmethod
    @cache
    def functions(cls) -> dict[str, str]:
        """Return every helper function by name; border rules that samplers have need no function."""
        rules = [rule for rule, border in BORDERS.items() if not border.is_nearest]
        return {**cls.helpers, **{border_name(rule): cls(border_program(rule)).border_function(rule) for rule in rules}}

    def border_function(self, rule: str) -> str:
        """Print a function that maps a column or row index into the picture."""
        self.line(f"{self.border_head.format(border_name(rule))}\n{{")
        self.indented(self.program.body)
        self.line(f"    return {self.operand(self.program.outputs[0].values[0])};\n}}")
        return self.listing().text
