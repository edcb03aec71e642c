"""Kernels as plain data: lines of text, stretches of them, and rows of expressions and statements."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple
from typing import Any

from passgraph.errors import GraphError
from passgraph.language import ir
from passgraph.language.source import NOWHERE, Span
from passgraph.travel.document import number_data
from passgraph.travel.kernel_limits import excess, grown
from passgraph.travel.kernel_rows import ROWS, type_data


def kernel_data(program: ir.TypedKernel, where: str) -> dict[str, Any]:
    """A kernel: lines of its text, stretches of them, rows that refer to rows before them, and what it gives."""
    rows = _Rows(where)
    body = rows.numbered(program.body)
    results = [[one.name, type_data(one.type), *rows.numbered([one.value])] for one in program.results]
    parameters = [
        [p.name, type_data(p.type), p.const, rows.span(p.span), *([] if p.range is None else [list(astuple(p.range))])]
        for p in program.parameters
    ]
    keep = None if program.keep is None else rows.numbered([program.keep])[0]
    source = rows.span(program.source)
    return {"name": program.name, "stage": program.stage, "parameters": parameters, "results": results, "keep": keep,
            "body": body, "source": source, "rows": rows.rows, "spans": rows.spans, "lines": rows.lines}  # fmt: skip


class _Rows:
    def __init__(self, where: str) -> None:
        self.where = where
        self.rows: list[Any] = []
        self.spans: list[Any] = []
        self.lines: list[Any] = []
        self._known: dict[Any, int] = {}
        self._sizes: dict[int, tuple[int, int]] = {}

    def numbered(self, roots: Iterable[Any]) -> list[int]:
        return [self._row(root) for root in roots]

    def _row(self, root: Any) -> int:
        """The number of a row, what it refers to first; a stack of our own, since expressions nest deeply."""
        pending = [root]
        while pending:
            node = pending[-1]
            missing = [part for part in ir.parts_of(node) if id(part) not in self._known]
            if id(node) in self._known or not missing:
                pending.pop()
                self._write(node)
            else:
                pending += reversed(missing)
        return self._known[id(root)]

    def _write(self, node: Any) -> None:
        if id(node) in self._known:
            return
        size = grown(self._sizes[id(part)] for part in ir.parts_of(node))
        if problem := excess(size):
            raise GraphError(f"{self.where}: its kernel is too large to travel: {problem}; make it shorter")
        fields = [self._field(getattr(node, name), kind) for name, kind in ROWS[type(node)].items()]
        self._known[id(node)], self._sizes[id(node)] = len(self.rows), size
        self.rows.append([type(node).__name__.lower(), *fields, self.span(node.span)])

    def _field(self, given: Any, kind: str) -> Any:
        if kind == "row":
            return self._known[id(given)]
        if kind == "rows":
            return [self._known[id(part)] for part in given]
        if kind == "type":
            return type_data(given)
        if kind == "numbers":
            return [number_data(number) for number in given]
        return number_data(given) if kind == "number" else list(given) if kind == "places" else given

    def span(self, span: Span) -> int | None:
        """The number of a stretch of a line; null for what has no text."""
        if span is NOWHERE:
            return None
        if span not in self._known:
            line = (span.file, span.line, span.text)
            if line not in self._known:
                self._known[line] = len(self.lines)
                self.lines.append(list(line))
            self._known[span] = len(self.spans)
            self.spans.append([self._known[line], span.column, span.end_column])
        return self._known[span]
