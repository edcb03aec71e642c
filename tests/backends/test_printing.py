"""What the printers of all languages have in common; no device is needed."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import ClassVar

import pytest

from passgraph.backends.gl.glsl import GLSL
from passgraph.backends.opencl.opencl_c import OpenCLPrinter
from passgraph.backends.printing import Printer
from passgraph.backends.webgpu.wgsl import WGSL
from passgraph.graph.calls import kernel
from passgraph.language import native
from passgraph.language import scalar as s
from passgraph.language.lower import lower
from passgraph.language.lowering import lowered
from passgraph.language.lowering.rows import LOWERED, STORED
from passgraph.language.lowering.textures import TexelsInTextures, Texture
from passgraph.language.operations import OPERATIONS

LOWERED_ROWS = {(on, name) for rows in (LOWERED, STORED) for on, names in rows.items() for name in names}


@pytest.mark.parametrize(
    ("printer", "functions"),
    [(GLSL, (*native.GLSL, "fma")), (OpenCLPrinter, (*native.OPENCL, "fma")), (WGSL, native.WGSL)],
)
def test_every_primitive_is_spelled_and_the_devices_own_functions(
    printer: type[Printer], functions: Collection[str]
) -> None:
    """To mend: the operation's spelling belongs into the ``SPELLED`` of the language, or of all that are like C."""
    wanted = {(kind, row.name) for row in OPERATIONS.values() for kind in row.types}
    wanted |= {("float", name) for name in functions}
    spelled = {(kind, name) for kind, names in printer.spelled.items() for name in names}
    assert spelled - LOWERED_ROWS == wanted


class Unlike(Printer):
    """A language whose declarations, choices and loops are not C's."""

    types: ClassVar[Mapping[str, str]] = {"bool": "bool", "int": "i32", "float": "f32"}
    spelled: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "float": {"add": "({0} + {1})", "less": "({0} < {1})"},
        "int": {"add": "({0} + {1})", "mul": "({0} * {1})", "less": "({0} < {1})", "to_float": "f32({0})"},
    }

    def constant(self, type_: str, name: str, expression: str) -> str:
        return f"let {name}: {self.types[type_]} = {expression};"

    def variable(self, type_: str, name: str) -> str:
        return f"var {name}: {self.types[type_]};"

    def array(self, type_: str, name: str, length: int) -> str:
        return f"var {name}: array<{self.types[type_]}, {length}>;"

    def choice(self, condition: str, then: str, orelse: str) -> str:
        return f"select({orelse}, {then}, {condition})"

    def loop(self, index: str, start: str, compare: str, stop: str, step: str) -> str:
        return f"for (var {index} = {start}; {index} {compare} {stop}; {index} += {step}) {{"

    def repetition(self, index: str, count: str) -> str:
        return f"repeat {index} {count} {{"

    def float_from_bits(self, bits: int) -> str:
        return f"bitcast({bits})"

    def uniform(self, block: str, index: str | int) -> str:
        return f"{block}s[{index}]"

    def builtin(self, name: str) -> str:
        return name

    def sample(self, load: s.Sample) -> None:
        for value in load.to:
            if value is not None:
                self.value(value, f"load({load.image})")


def printed(source: str) -> list[str]:
    printer = Unlike(lowered(lower(kernel(source=source).program), [TexelsInTextures({"c": Texture()})]))
    printer.variables()
    printer.block(printer.program.body)
    return printer.listing().text.splitlines()


def test_a_language_that_is_not_like_c_says_how_it_declares_chooses_and_loops() -> None:
    text = printed("""
def one(c: Image, n: int) -> float:
    total = 0.0
    for i in range(100):
        if n < i:
            break
        total += c[0, 0].x if c[0, 0].x < 0.5 else float(i)
    return total
""")
    assert text == [
        "var m0: f32;",
        "m0 = 0.0;",
        "for (var v1 = 0; v1 < 100; v1 += 1) {",
        "    let v2: f32 = m0;",
        "    let v4: bool = (ints[0] < v1);",
        "    if (v4) {",
        "        m0 = v2;",
        "        break;",
        "    }",
        "    let v5: f32 = load(c);",
        "    let v9: bool = (v5 < 0.5);",
        "    let v10: f32 = f32(v1);",
        "    let v11: f32 = select(v10, v5, v9);",
        "    let v12: f32 = (v11 + v2);",
        "    m0 = v12;",
        "}",
        "let v13: f32 = m0;",
    ]


def test_trips_are_counted_where_the_index_would_leave_32_bits() -> None:
    text = printed("""
def one(c: Image) -> float:
    total = 0.0
    for i in range(2147483000, 2147483647, 7):
        total += float(i)
    return total
""")
    assert text[2:4] == ["repeat v1t 93 {", "    let v1: i32 = (2147483000 + (v1t * 7));"]
