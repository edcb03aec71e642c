"""Where a definition is written: found by its name in the sources, wherever they are laid."""

from __future__ import annotations

import ast
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: What a mutated tree is made of; tests and documents are not needed to judge a backend.
PARTS = ("passgraph", "backends", "effects")
#: The head of a function of OpenCL C: it begins a line and has its name before the first parenthesis.
_C_HEAD = re.compile(r"^(?!typedef|return|#|//)\w[^\n(;=]*?(\w+)\(", re.MULTILINE)


@dataclass(frozen=True)
class Place:
    """A definition: characters ``start`` to ``end`` of a file, whose first line is indented by ``margin`` spaces."""

    file: str
    start: int
    end: int
    margin: int

    def text_of(self, old: str) -> str:
        """Lines as they stand there, from lines as they stand in a definition that begins a line."""
        return re.sub(r"\n(?=[^\n])", "\n" + " " * self.margin, old)

    def count(self, source: str, old: str) -> int:
        """How often a text is in the definition."""
        return source[self.start : self.end].count(self.text_of(old))

    def replaced(self, source: str, old: str, new: str) -> str:
        """The file's text with another one in the definition."""
        inside = source[self.start : self.end].replace(self.text_of(old), self.text_of(new))
        return source[: self.start] + inside + source[self.end :]


def places(name: str, old: str) -> list[Place]:
    """Definitions of that name with that text; functions of one name may be told apart by what they say.

    A name is a function's, a method's (``Class.method``), a variable's of a module or class, or the first argument of
    a call that is a statement of a module, such as a row of a table.
    """
    # Most files are passed over unparsed: any line of the text is in its file as it is.
    line = max(old.split("\n"), key=len)
    return [
        place for file, text in sources().items() if line in text
        for place in definitions(file).get(name, ()) if place.count(text, old)
    ]  # fmt: skip


@cache
def sources() -> dict[str, str]:
    """Every source's text, by its path from the root of the repository."""
    found = {}
    for part in PARTS:
        for folder, _, names in os.walk(ROOT / part):  # does not follow the links to other parts
            for name in sorted(names):
                if name.endswith((".py", ".cl")):
                    path = Path(folder) / name
                    found[path.relative_to(ROOT).as_posix()] = path.read_text(encoding="utf-8")
    return found


@cache
def definitions(file: str) -> dict[str, list[Place]]:
    """What a file defines, by name."""
    text = sources()[file]
    lines = [0, *(match.end() for match in re.finditer("\n", text)), len(text)]
    found: dict[str, list[Place]] = {}
    spans = _spans(ast.parse(text), "") if file.endswith(".py") else _c_spans(text)
    for name, first, last, margin in spans:
        found.setdefault(name, []).append(Place(file, lines[first - 1], lines[last], margin))
    return found


def _spans(parent: ast.Module | ast.ClassDef, prefix: str) -> Iterator[tuple[str, int, int, int]]:
    """Name, first and last line, and margin of every definition."""
    for node in parent.body:
        last = node.end_lineno or node.lineno
        if isinstance(node, ast.ClassDef):
            yield from _spans(node, f"{prefix}{node.name}.")
        elif isinstance(node, ast.FunctionDef):
            first = min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
            yield prefix + node.name, first, last, node.col_offset
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                yield prefix + ast.unparse(target), node.lineno, last, node.col_offset
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) and node.value.args:
            named = node.value.args[0]
            if isinstance(named, ast.Constant) and isinstance(named.value, str):
                yield prefix + named.value, node.lineno, last, node.col_offset


def _c_spans(text: str) -> Iterator[tuple[str, int, int, int]]:
    """As above of OpenCL C: a function ends where a brace ends a line that is not indented."""
    lines = text.split("\n")
    for head in _C_HEAD.finditer(text):
        first = text.count("\n", 0, head.start())
        ends = (n for n in range(first, len(lines)) if re.match(r"(\S.*)?\}\s*$", lines[n]))
        yield head[1], first + 1, next(ends, len(lines) - 1) + 1, 0
