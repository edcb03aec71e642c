"""Print scalar programs as OpenCL C 1.2."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from typing import ClassVar

from passgraph.backends.opencl.storage import ImageLayout
from passgraph.backends.printing import FLOOR_DIVIDE, INT_MOD, CLike, Listing, builtin_calls, spelled
from passgraph.formats import Format, format_spelling
from passgraph.language import native
from passgraph.language import scalar as s
from passgraph.language.builtin_name import BuiltinName, size_names
from passgraph.language.lowering import Pass, lowered
from passgraph.language.lowering.buffers import StoresInBuffers, TexelsInBuffers
from passgraph.language.source import NOWHERE, Span

#: Channel type (`Format.number`) → type in buffers.
ELEMENTS = {"u1": "uchar", "u2": "ushort", "f2": "ushort", "f4": "float"}

#: Argument type → operation → expression.  Functions with ``pg_`` are in helpers.cl and below.
SPELLED = spelled({
    "float": {
        "abs": "fabs({0})", "round": "rint({0})", "bits_from_float": "as_int({0})", "to_index": "(int){0}",
        **builtin_calls(native.OPENCL, inversesqrt="rsqrt"), "fma": "pg_fma({0}, {1}, {2})",
    },
    "int": {
        "add": "pg_add({0}, {1})", "sub": "pg_sub({0}, {1})", "mul": "pg_mul({0}, {1})", "neg": "pg_sub(0, {0})",
        "abs": "pg_abs({0})", "shift_left": "pg_shl({0}, {1})", "to_float": "(float)({0})",
        "float_from_bits": "as_float({0})",
    },
    "bool": {"to_float": "({0} ? 1.0f : 0.0f)"},
    s.INDEX: {"int_mod": "pg_int_mod({0}, {1})", "to_long": "(long){0}"},
    s.LONG: {"add": "({0} + {1})", "mul": "({0} * {1})"},
    "u1": {"encode": "convert_uchar_sat_rte({0})"},
    "u2": {"encode": "convert_ushort_sat_rte({0})"},
    "f2": {"decode": "pg_load_half({0})", "encode": "pg_store_half({0})"},
})  # fmt: skip


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
    return f"#define PG_UNIFORMS {space}\n{package_text('helpers.cl')}{FLOOR_DIVIDE}{INT_MOD}"


class OpenCLPrinter(CLike):
    """Prints the body of one program; the caller prints the enclosing function.

    ``builtins`` maps names to expressions, ``images`` names to buffer parameter and layout.  With ``inner`` every
    relative read is known to be inside.  With ``outputs`` results are stored there, at this pixel.
    """

    spelled: ClassVar[Mapping[str, Mapping[str, str]]] = SPELLED
    types: ClassVar[Mapping[str, str]] = {**CLike.types, s.LONG: "long"}
    float_suffix: ClassVar[str] = "f"

    def __init__(
        self,
        program: s.ScalarProgram,
        builtins: Mapping[BuiltinName, str],
        images: Mapping[str, tuple[str, ImageLayout]] | None = None,
        *,
        inner: bool = False,
        outputs: Sequence[ImageLayout] = (),
        prefix: str = "",
    ) -> None:
        images = images or {}
        passes: list[Pass] = [TexelsInBuffers({name: layout.buffer for name, (_, layout) in images.items()}, inner)]
        if outputs:
            passes.append(StoresInBuffers([layout.buffer for layout in outputs]))
        super().__init__(lowered(program, passes))
        self.builtins = dict(builtins)
        for name, (_, layout) in images.items():
            self.builtins |= dict(zip(size_names(name), map(str, layout.size), strict=True))
        self.buffers = {name: buffer for name, (buffer, _) in images.items()}
        self.prefix = prefix  # prefix of tables, so that two programs fit into one source

    def float_from_bits(self, bits: int) -> str:
        return f"as_float({self.int_literal(bits)})"

    def uniform(self, block: str, index: str | int) -> str:
        return f"{block}s[{index}]"

    def table(self, name: str, index: str) -> str:
        return f"{self.prefix}{name}[{index}]"

    def builtin(self, name: BuiltinName) -> str:
        return self.builtins[name]

    def load(self, load: s.Load) -> None:
        index = self.operand(load.index)
        for value, place in zip(load.to, load.places, strict=True):
            if value is not None:
                self.value(value, f"{self.buffers[load.image]}[{_moved(index, place)}]")

    def store(self, store: s.Store) -> None:
        index = self.operand(store.index)
        for value, place in zip(store.values, store.places, strict=True):
            self.line(f"out{store.output}[{_moved(index, place)}] = {self.operand(value)};")

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


def _moved(index: str, distance: int) -> str:
    """Return an index plus a number."""
    return f"{index} {'-' if distance < 0 else '+'} {abs(distance)}" if distance else index
