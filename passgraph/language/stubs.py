"""Write what type checkers and editors read of the table of operations: python -m passgraph.language.stubs

For each module of rows a stub beside it, with a documented function for each name that kernels call; and the names
of the language in passgraph/language/__init__.py.
"""

from __future__ import annotations

import textwrap
from pathlib import Path
from types import ModuleType

from passgraph.language import functions, primitives, symbols, vectors, whole_numbers
from passgraph.language.operations import OPERATIONS, Operation

MODULES = (functions, primitives, vectors, whole_numbers)
PACKAGE = Path(__file__).with_name("__init__.py")
BEGIN, END = "# Names of kernels, written by passgraph.language.stubs.\n", "# End of the names.\n"

_HEAD = """# Written by passgraph.language.stubs from the table of operations.
# mypy: disable-error-code="overload-cannot-match"
from typing import Any, TypeVar, overload

from passgraph.language.symbols import (
    ivec2, ivec3, ivec4, mat2, mat3, mat4, uint, uvec2, uvec3, uvec4, vec2, vec3, vec4,
)

_I = TypeVar("_I", int, uint, ivec2, ivec3, ivec4, uvec2, uvec3, uvec4)
_F = TypeVar("_F", float, vec2, vec3, vec4)
_N = TypeVar("_N", int, float, vec2, vec3, vec4)
_V = TypeVar("_V", vec2, vec3, vec4)
_M = TypeVar("_M", mat2, mat3, mat4)

"""
#: Letters of signatures whose type is one for all that have the letter, and of those that are always the same.
_VARIABLE = {"G": "_F", "N": "_N", "I": "_I", "V": "_V", "M": "_M", "v3": "vec3"}
_FIXED = {"f": "float", "i": "int", "b": "bool", "B": "Any", "S": "Any", "U": "Any"}


def path_of(module: ModuleType) -> Path:
    """Where a module's stub is."""
    return Path(str(module.__file__)).with_suffix(".pyi")


def stub(module: ModuleType) -> str:
    """The text of a module's stub."""
    names = "".join(f'    "{name}",\n' for name in module.__all__)
    return f"{_HEAD}__all__ = [\n{names}]\n\n" + "\n".join(map(_function, module.__all__))


def _function(name: str) -> str:
    """A name with every row that kernels call by it: a stub for each way, the first one with its meaning."""
    rows = [row for row in OPERATIONS.values() if row.call == name]
    ways = [way for row in rows for way in _ways(name, row)]
    signs = [form for row in rows for form in row.written if "(" not in form]
    meaning = "; ".join(dict.fromkeys(row.doc for row in rows)) + "".join(f"; written {form} too" for form in signs)
    body = f':\n    """{meaning}."""\n'
    if len(ways) == 1:
        return f"{ways[0]}{body}"
    return "".join(f"@overload\n{way}{': ...' + chr(10) if at else body}" for at, way in enumerate(ways))


def _ways(name: str, row: Operation) -> list[str]:
    exact = [_VARIABLE.get(one, _FIXED.get(one, "Any")) for one in row.operands]
    result = _VARIABLE.get(row.result, _FIXED.get(row.result, "Any"))
    one = _signature(name, row, exact, result if result in exact or not result.startswith("_") else "Any")
    count = len(exact)
    if count < 2 or not {"G", "N"}.intersection(row.operands):
        return [one]
    # Scalars may stand beside vectors: before the first of these, and behind it.
    spread = [
        _signature(name, row, ["float"] * at + ["_V"] + ["_V | float"] * (count - at - 1), "_V")
        for at in range(count if set(exact) == {result} and result in ("_F", "_N") else 0)
    ]
    return [one, *spread, _signature(name, row, ["Any"] * count, "Any")]


def _signature(name: str, row: Operation, types: list[str], result: str) -> str:
    letters = [
        {"V": "vwn", "v3": "vwn", "M": "mnk", "i": "ijk"}.get(one, "xyzw")[at] for at, one in enumerate(row.operands)
    ]
    parameters = ", ".join(f"{letter}: {type_}" for letter, type_ in zip(letters, types, strict=True))
    return f"def {name}({parameters}, /) -> {result}"


def with_names(text: str) -> str:
    """The text of the package with every name of the language in ``__all__``: type checkers read lists only."""
    before, _, rest = text.partition(BEGIN)
    names = sorted(name for module in (symbols, *MODULES) for name in module.__all__)
    rows = textwrap.wrap(", ".join(f'"{name}"' for name in names) + ",", 115)
    listed = "__all__ = [\n" + "".join(f"    {row}\n" for row in rows) + "]  # fmt: skip\n"
    return before + BEGIN + listed + END + rest.partition(END)[2]


if __name__ == "__main__":
    PACKAGE.write_text(with_names(PACKAGE.read_text(encoding="utf-8")), encoding="utf-8")
    for each in MODULES:
        path_of(each).write_text(stub(each), encoding="utf-8")
