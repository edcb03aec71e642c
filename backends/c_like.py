"""What GLSL and OpenCL C write alike, as C does: declarations, choices, loops, most operations, arithmetic on ints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from passgraph.backends.printing import INT_MIN_TEXT, Printer

#: No step overflows, and ``%`` never sees a negative operand (undefined in GLSL 3.30).
FLOOR_DIVIDE = f"""
int pg_floor_divide(int a, int b)
{{
    if (b == 0) {{ return 0; }}
    if (b == -1) {{ return a == {INT_MIN_TEXT} ? a : -a; }}
    int q = a / b;
    int r = a - q * b;
    return r != 0 && (r < 0) != (b < 0) ? q - 1 : q;
}}
"""
INT_MOD = """
int pg_int_mod(int a, int b)
{
    if (b == 0 || b == -1) { return 0; }
    int r = a - (a / b) * b;
    return r != 0 && (r < 0) != (b < 0) ? r + b : r;
}
"""

_NUMBERS = {
    "min": "({1} < {0} ? {1} : {0})", "max": "({0} < {1} ? {1} : {0})",
    "less": "({0} < {1})", "less_equal": "({0} <= {1})", "greater": "({0} > {1})", "greater_equal": "({0} >= {1})",
    "equal": "({0} == {1})", "not_equal": "({0} != {1})",
}  # fmt: skip
#: Operations that a language calls alike, by the type of their arguments.
SPELLED: dict[str, dict[str, str]] = {
    "float": {
        **_NUMBERS,
        "add": "({0} + {1})", "sub": "({0} - {1})", "mul": "({0} * {1})", "div": "({0} / {1})", "neg": "(-{0})",
        "floor": "floor({0})", "ceil": "ceil({0})", "trunc": "trunc({0})", "sqrt": "sqrt({0})",
        "isnan": "pg_isnan({0})", "isinf": "pg_isinf({0})", "to_int": "pg_to_int({0})",
    },
    "int": {
        **_NUMBERS,
        "floor_divide": "pg_floor_divide({0}, {1})", "int_mod": "pg_int_mod({0}, {1})",
        "bit_and": "({0} & {1})", "bit_or": "({0} | {1})", "bit_xor": "({0} ^ {1})", "bit_not": "(~{0})",
        "shift_right": "({0} >> ({1} & 31))",
    },
    "bool": {
        "logical_and": "({0} && {1})", "logical_or": "({0} || {1})", "logical_not": "(!{0})",
        "to_int": "({0} ? 1 : 0)",
    },
}  # fmt: skip


def spelled(own: Mapping[str, Mapping[str, str]]) -> dict[str, dict[str, str]]:
    """:data:`SPELLED` with a language's own spellings."""
    return {kind: {**SPELLED[kind], **own[kind]} for kind in SPELLED}


class CLike(Printer):
    """A language with C's statements."""

    types: ClassVar[Mapping[str, str]] = {"bool": "bool", "int": "int", "float": "float"}

    def declared(self, type_: str) -> str:
        """What stands before the name of a value: its type and how it is kept."""
        return self.types[type_]

    def constant(self, type_: str, name: str, expression: str) -> str:
        return f"{self.declared(type_)} {name} = {expression};"

    def variable(self, type_: str, name: str) -> str:
        zero = {"bool": "false", "int": "0", "float": "0.0" + self.float_suffix}[type_]
        return f"{self.declared(type_)} {name} = {zero};"

    def array(self, type_: str, name: str, length: int) -> str:
        return f"{self.declared(type_)} {name}[{length}];"

    def choice(self, condition: str, then: str, orelse: str) -> str:
        return f"({condition} ? {then} : {orelse})"

    def loop(self, index: str, start: str, compare: str, stop: str, step: str) -> str:
        return f"for (int {index} = {start}; {index} {compare} {stop}; {index} += {step}) {{"

    def repetition(self, index: str, count: str) -> str:
        return f"for (int {index} = 0; {index} < {count}; ++{index}) {{"
