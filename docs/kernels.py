"""Writes the table of operations into docs/kernels.md: python docs/kernels.py"""

from __future__ import annotations

import ast
import math
import sys
from pathlib import Path

root = Path(__file__).resolve().parent.parent
if str(root) not in sys.path:
    sys.path.insert(0, str(root))

from passgraph.language.library import written_function
from passgraph.language.operations import OPERATIONS, Operation
from passgraph.language.symbols import WRITTEN

PAGE = root / "docs" / "kernels.md"
BEGIN, END = "<!-- operations: written by docs/kernels.py -->", "<!-- end of operations -->"

_HEADINGS = {"primitive": "Primitives", "prelude": "Functions of numbers", "expanded": "Vectors and matrices"}


def filled(page: str) -> str:
    """The page with the table as it is, between its marks."""
    before, _, rest = page.partition(BEGIN)
    return f"{before}{BEGIN}\n\n{markdown()}\n{END}{rest.partition(END)[2]}"


def markdown() -> str:
    """Every row of the table by kind: how it is written, its signature, its meaning, its bound."""
    parts = []
    for kind, heading in _HEADINGS.items():
        rows = [row for row in OPERATIONS.values() if row.kind == kind]
        lines = [f"### {heading}", "", "| written | signature | meaning | error, ULP |", "|---|---|---|---|"]
        parts.append("\n".join(lines + [_line(row) for row in rows]))
    parts.append("\n".join(["### Several results, and packing", "", *_library_lines()]))
    return "\n\n".join(parts) + "\n"


def _library_lines() -> list[str]:
    """The functions that are written in the language: those of a float stand for those of vectors too."""
    lines = ["| written | result | meaning |", "|---|---|---|"]
    for symbol in WRITTEN:
        node = written_function(symbol.name, []).node  # type: ignore[union-attr]
        parameters = ", ".join(f"{a.arg}: {ast.unparse(a.annotation)}" for a in node.args.args if a.annotation)
        doc = " ".join((ast.get_docstring(node) or "").split())
        vectors = "" if node.name == symbol.name else "; of vectors by component"
        result = ast.unparse(node.returns) if node.returns else ""
        lines.append(f"| `{symbol.name}({parameters})` | `{result}` | {doc.rstrip('.')}{vectors} |")
    return lines


def _line(row: Operation) -> str:
    written = ", ".join(row.written) or f"{row.name}(…)"
    cells = (f"`{written}`", f"`{row.signature.replace('->', '→')}`", row.doc, _bound(row))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _bound(row: Operation) -> str:
    text = "exact" if row.ulp == 0 else f"{row.ulp:g}"
    if row.absolute:
        exponent = round(math.log2(row.absolute))
        text += f" + 2^{exponent}"
    return text + (" of the largest term" if row.of_terms else "")


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
