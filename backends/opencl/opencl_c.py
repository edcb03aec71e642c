"""Print scalar programs as OpenCL C 1.2."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import ClassVar

from passgraph.backends.opencl.storage import INT_LIMIT, ImageLayout
from passgraph.backends.printing import FLOOR_DIVIDE, INT_MOD, CLike, Listing, builtin_calls, spelled
from passgraph.cached import cached_property
from passgraph.formats import Format, format_spelling
from passgraph.language import native
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS, border_name, border_program, nearer
from passgraph.language.source import NOWHERE, Span

#: Channel type (`Format.number`) → type in buffers.
ELEMENTS = {"u1": "uchar", "u2": "ushort", "f2": "ushort", "f4": "float"}

#: Argument type → operation → expression.  Functions with ``pg_`` are in helpers.cl and below.
SPELLED = spelled({
    "float": {
        "abs": "fabs({0})", "round": "rint({0})", "bits_from_float": "as_int({0})",
        **builtin_calls(native.OPENCL, inversesqrt="rsqrt"), "fma": "pg_fma({0}, {1}, {2})",
    },
    "int": {
        "add": "pg_add({0}, {1})", "sub": "pg_sub({0}, {1})", "mul": "pg_mul({0}, {1})", "neg": "pg_sub(0, {0})",
        "abs": "pg_abs({0})", "shift_left": "pg_shl({0}, {1})", "to_float": "(float)({0})",
        "float_from_bits": "as_float({0})",
    },
    "bool": {"to_float": "({0} ? 1.0f : 0.0f)"},
})  # fmt: skip
FUNCTIONS = {
    "pg_floor_divide": FLOOR_DIVIDE,
    "pg_int_mod": INT_MOD,
}


def package_text(name: str) -> str:
    """Return the text of an OpenCL C file of this package."""
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def element(format_: Format) -> str:
    """Return the type of a channel in a buffer."""
    return format_spelling(format_, ELEMENTS, __file__)


def load_expression(format_: Format, image: str, index: str) -> str:
    """Return the expression that loads one channel as float."""
    if format_.steps:
        return f"((float){image}[{index}] / {format_.steps}.0f)"
    return f"pg_load_half({image}[{index}])" if format_.number == "f2" else f"{image}[{index}]"


def store_expression(format_: Format, value: str) -> str:
    """Return the expression that quantizes a float; a value that the format holds is kept."""
    if format_.steps:
        return f"convert_{element(format_)}_sat_rte(({value}) * {format_.steps}.0f)"
    return f"pg_store_half({value})" if format_.number == "f2" else value


def join(*parts: Listing | str) -> Listing:
    """Concatenate pieces of source; fixed text has no kernel line behind it."""
    texts: list[str] = []
    spans: list[Span] = []
    for part in parts:
        listing = part if isinstance(part, Listing) else Listing(part, (NOWHERE,) * part.count("\n"))
        texts.append(listing.text)
        spans.extend(listing.spans)
    return Listing("".join(texts), tuple(spans))


def prologue(constant_uniforms: bool) -> str:
    """Return the text at the start of every source."""
    space = "__constant" if constant_uniforms else "__global const"
    functions = "".join(
        [*FUNCTIONS.values(), *(border_function(rule) for rule in BORDERS if not BORDERS[rule].is_nearest)]
    )
    return f"#define PG_UNIFORMS {space}\n{package_text('helpers.cl')}{functions}"


class OpenCLPrinter(CLike):
    """Prints the body of one program; the caller prints the enclosing function.

    ``builtins`` maps names to expressions, ``images`` names to buffer parameter and layout.  With ``inner`` every
    relative read is known to be inside, so no border code is printed.
    """

    spelled: ClassVar[Mapping[str, Mapping[str, str]]] = SPELLED
    float_suffix: ClassVar[str] = "f"

    def __init__(
        self,
        program: s.ScalarProgram,
        builtins: Mapping[str, str],
        images: Mapping[str, tuple[str, ImageLayout]] | None = None,
        *,
        inner: bool = False,
        prefix: str = "",
    ) -> None:
        super().__init__(program)
        self.builtins = builtins
        self.images = images or {}
        self.inner = inner
        self.prefix = prefix  # prefix of tables, so that two programs fit into one source
        self.indices = 0
        self.origins: dict[tuple[str, str], str] = {}  # type and index of this pixel in an image → its variable

    def float_from_bits(self, bits: int) -> str:
        return f"as_float({self.int_literal(bits)})"

    def uniform(self, block: str, index: str | int) -> str:
        return f"{block}s[{index}]"

    def table(self, name: str, index: str) -> str:
        return f"{self.prefix}{name}[{index}]"

    def builtin(self, name: str) -> str:
        if name.startswith("size."):
            image, _, axis = name.removeprefix("size.").rpartition(".")
            return str(self.images[image][1].size[int(axis)])
        return self.builtins[name]

    def variables(self) -> None:
        """Declare the variables, and the index of this pixel in each image with fixed offsets."""
        super().variables()
        for load in s.walk(self.program.body):
            if isinstance(load, s.LoadTexel) and self._is_fixed(load):
                place = self._origin(load)
                if place not in self.origins:
                    self.origins[place] = f"p{len(self.origins)}"
                    self.line(f"{place[0]} {self.origins[place]} = {place[1]};")

    def texel(self, load: s.LoadTexel) -> None:
        if self._is_fixed(load):
            self._fixed_texel(load)
            return
        buffer, layout = self.images[load.image]
        x, y = self.operand(load.x), self.operand(load.y)
        if load.relative:
            x, y = (self._moved(load, axis, layout) for axis in (0, 1))
        inside = load.relative and self.inner
        self.indices += 1
        index, here = f"i{self.indices}", f"h{self.indices}"
        width, height = layout.size
        if not inside and BORDERS[load.border].blank:
            self.line(f"bool {here} = {x} >= 0 && {x} < {width} && {y} >= 0 && {y} < {height};")
        if not inside:
            x, y = self._bordered(load.border, x, width), self._bordered(load.border, y, height)
        self.line(f"{layout.index_type} {index} = {layout.place(x, y)};")
        for channel, value in enumerate(load.to):
            if value is None:
                continue
            place = layout.channel(channel)
            texel = load_expression(layout.format, buffer, f"{index} + {place}" if place else index)
            if not inside and BORDERS[load.border].blank:
                texel = f"({here} ? {texel} : 0.0f)"
            self.value(value, texel)

    def _is_fixed(self, load: s.LoadTexel) -> bool:
        """Return True if a read is at a fixed distance in memory: inside, at a constant offset."""
        offsets = [offset.value for offset in (load.x, load.y) if isinstance(offset, s.Lit)]
        return load.relative and (offsets == [0, 0] or (self.inner and len(offsets) == 2))

    def _origin(self, load: s.LoadTexel) -> tuple[str, str]:
        """Return type and expression of this pixel's index in an image."""
        layout = self.images[load.image][1]
        return layout.index_type, layout.place("x", "y")

    def _fixed_texel(self, load: s.LoadTexel) -> None:
        """Read at a number from this pixel's index.

        PoCL 6 (LLVM 18) does not see that texels are adjacent where each index is computed from column and row; a blur
        then takes two to nine times as long.
        """
        buffer, layout = self.images[load.image]
        origin = self.origins[self._origin(load)]
        for channel, value in enumerate(load.to):
            if value is not None:
                assert isinstance(load.x, s.Lit) and isinstance(load.y, s.Lit)
                distance = layout.distance(int(load.x.value), int(load.y.value)) + layout.channel(channel)
                index = f"{origin} {'+' if distance > 0 else '-'} {abs(distance)}" if distance else origin
                self.value(value, load_expression(layout.format, buffer, index))

    def _moved(self, load: s.LoadTexel, axis: int, layout: ImageLayout) -> str:
        """Return the column or row of a relative read; the sum cannot overflow int, and finds the same texel."""
        name, offset, count = "xy"[axis], (load.x, load.y)[axis], layout.size[axis]
        use = self.program.image(load.image)
        far = max(map(abs, (use.x, use.y)[axis])) >= INT_LIMIT - count
        if isinstance(offset, s.Lit):
            number = int(nearer(load.border, int(offset.value), count) if far else offset.value)
            return name if number == 0 else f"({name} {'+' if number > 0 else '-'} {abs(number)})"
        moved = self.operand(offset)
        if far:
            period = BORDERS[load.border].period.replace("size", str(count))
            moved = f"pg_int_mod({moved}, {period})" if period else f"clamp({moved}, -{2 * count}, {2 * count})"
        return f"({name} + {moved})"

    @staticmethod
    def _bordered(border: str, position: str, count: int) -> str:
        if BORDERS[border].is_nearest:
            return f"clamp({position}, 0, {count - 1})"
        return f"{border_name(border)}({position}, {count})"

    def stored(self, format_: Format, value: s.Operand) -> str:
        """Return the expression that stores a result. A value that was just divided by its steps is stored as steps:
        compilers do not see that the division is undone, and do not vectorize saturating conversions."""
        operation = self._operations.get(value.id) if isinstance(value, s.Val) else None
        if operation is not None and (operation.operation, operation.on) == ("div", "float"):
            counted, steps = operation.arguments
            count = self._operations.get(counted.id) if isinstance(counted, s.Val) else None
            rounded = count is not None and count.operation == "round"
            if rounded and isinstance(steps, s.Lit) and steps.value == format_.steps:
                return f"({element(format_)})(int){self.operand(counted)}"
        return store_expression(format_, self.operand(value))

    @cached_property
    def _operations(self) -> dict[int, s.Op]:
        """Map values to the operations that compute them, outside of branches and loops."""
        return {i.to.id: i for i in self.program.body if isinstance(i, s.Op)}

    def open(self, head: str) -> None:
        """Print tables, then the function's head and variables."""
        for name, type_, values in self.program.tables:
            element = "int" if type_ == "bool" else type_
            entries = ", ".join(self.literal(s.Lit(element, value)) for value in values)
            self.line(f"__constant {element} {self.prefix}{name}[{len(values)}] = {{{entries}}};")
        self.line(head)
        self.line("{")
        self.depth += 1

    def close(self) -> Listing:
        self.depth -= 1
        self.line("}")
        return self.listing()


@cache
def border_function(rule: str) -> str:
    """Print a function that maps a column or row index into the picture."""
    program = border_program(rule)
    printer = OpenCLPrinter(program, {"i": "i", "size": "size"})
    printer.open(f"int {border_name(rule)}(int i, int size)")
    printer.block(program.body)
    printer.line(f"return {printer.operand(program.outputs[0].values[0])};")
    return printer.close().text
