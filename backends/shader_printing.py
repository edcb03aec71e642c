"""Print scalar programs as shaders: what GLSL and WGSL have in common.

Texels are read through samplers (:mod:`passgraph.language.lowering.textures`).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

from passgraph.backends.foreseen import foreseen_values
from passgraph.backends.printing import Listing, Printer
from passgraph.language import scalar as s
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.lowering import lowered
from passgraph.language.lowering.textures import TexelsInTextures, Texture

LETTERS = "xyzw"


def vec4_count(components: int) -> int:
    return (components + 3) // 4


class ShaderPrinter(Printer):
    """Prints a program of any stage as one shader; ``varyings`` names the scalars passed from vertex to fragment."""

    #: Names of types.
    float_: ClassVar[str]
    vec2: ClassVar[str]
    ivec2: ClassVar[str]
    vec4: ClassVar[str]
    #: Of a fragment: its center in the target, depth and 1 / w.
    fragment: ClassVar[str]
    #: The derivative along x or y, without that letter.
    derivative: ClassVar[str]
    #: The names of images, without their number.
    image_: str
    #: Definitions of the helper functions by name, which may call earlier ones.
    helpers: ClassVar[Mapping[str, str]]
    #: Builtins → expression.
    output_size: ClassVar[str]
    front_facing: ClassVar[str]

    def __init__(
        self,
        program: s.ScalarProgram,
        varyings: tuple[BuiltinName, ...] = (),
        textures: Mapping[str, Texture] | None = None,
    ) -> None:
        lies = textures or {use.name: Texture() for use in program.images}
        super().__init__(lowered(program, [TexelsInTextures(lies)]))
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
        # Compilers that assume no NaN fold x != x; they do not fold bit operations.
        if op.on == "float" and op.operation in ("equal", "not_equal") and arguments[0] == arguments[1]:
            return f"{'!' if op.operation == 'equal' else ''}pg_isnan({arguments[0]})"
        return super().operation(op, arguments)

    # Builtins

    def builtin(self, name: BuiltinName) -> str:
        component = "" if name.component is None else f".{LETTERS[name.component]}"
        if name.kind == "pixel":
            return self.pixel() + component
        if name.kind == "output_size":
            return self.output_size + component
        if name.kind in ("size", "texel", "here"):
            return {"size": self.size, "texel": self.width, "here": self.here_in}[name.kind](name.of) + component
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

    def texture(self, image: str) -> str:
        """Return the name of an image's texture."""
        return f"{self.image_}{self.image_numbers[image]}"

    def name_channels(self, load: s.Sample, fetch: str) -> None:
        """Fetch a texel, and name the channels that the program reads."""
        first = next(iter(s.results_of(load)))
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
        parts = [*self.interface(), self.called(self.helpers), f"{self.head()}\n{{{declared}"]
        self.front("\n".join(part for part in parts if part))
        return self.listing()
