"""Kernel source: its origin, and positions for errors."""

from __future__ import annotations

import ast
import inspect
import linecache
import os
import re
import textwrap
import unicodedata
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, NoReturn

from passgraph.cached import cached_property
from passgraph.errors import KernelError, PassgraphError
from passgraph.records import dataclass

#: Folder of this package, with its own kernels.
PACKAGE = f"{Path(__file__).parents[1]}{os.sep}"
#: Longest untrusted kernel text, in characters; the longest kernel of this package has about 5,000.
MAX_SOURCE_CHARACTERS = 200_000
#: Longest line of kernel text, in characters.
MAX_LINE_CHARACTERS = 10_000
#: Deepest nesting of statements and expressions; ``a + b + c + …`` nests once for each term.
MAX_NESTING = 200
#: Longer source lines are abbreviated around the caret.
_SHOWN_CHARACTERS = 160
#: Fields with nested statements.
_BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")


@dataclass(frozen=True, slots=True)
class Span:
    """A part of one source line; ``line`` counts from 1, columns count characters from 0."""

    file: str
    line: int
    column: int
    end_column: int
    text: str = ""

    def point_at(self, message: str) -> str:
        """Return the message with file, line, the source line and a caret below it."""
        column, end, text = self.column, self.end_column, self.text.rstrip()
        if len(text) > _SHOWN_CHARACTERS:
            start = max(0, column - _SHOWN_CHARACTERS // 2)
            text = text[start : start + _SHOWN_CHARACTERS]
            column, end = column - start, min(end - start, len(text))
        before = "".join(map(_blank, text[:column].ljust(column)))
        under = "".join(_blank(c).replace(" ", "^") for c in text[column:end])
        return f"{self.file}:{self.line}: {message}\n    {text}\n    {before}{under or '^'}"


def _blank(character: str) -> str:
    """Return spaces as wide as a character in a terminal; a tab stays a tab."""
    if character == "\t" or character.isascii():
        return character if character == "\t" else " "
    if unicodedata.combining(character):
        return ""
    return "  " if unicodedata.east_asian_width(character) in "WF" else " "


def place_in(before: Span, span: Span) -> str:
    """Format the location of an earlier span, for an error at ``span``: empty if it is on the same line."""
    if before.file != span.file:
        return f" ({before.file}:{before.line})"
    return "" if before.line == span.line else f" (line {before.line})"


NOWHERE = Span("<passgraph>", 0, 0, 1)


def fail(span: Span, message: str, kind: type[KernelError] = KernelError) -> NoReturn:
    raise kind(span.point_at(message))


#: Python warns of unknown escapes, and only a process-wide filter could silence that; docstrings have some.
_ESCAPE = re.compile(r"\\(.)", re.DOTALL)
_ESCAPES = "\n\r\\'\"abfnrtvxNuU01234567"


def _known_escape(match: re.Match[str]) -> str:
    return match[0] if match[1] in _ESCAPES else f"\\{match[0]}"


@dataclass(frozen=True)
class Source:
    """A piece of kernel text and its position."""

    file: str
    text: str  # dedented
    first_line: int = 1
    indent: int = 0  # columns removed by dedenting

    @cached_property
    def lines(self) -> list[str]:
        # Only the line ends of Python's own parser; str.splitlines has more.
        return self.text.replace("\r\n", "\n").replace("\r", "\n").split("\n")

    def _line(self, number: int) -> str:
        return self.lines[number - 1] if 0 < number <= len(self.lines) else ""

    def span(self, node: ast.AST) -> Span:
        """Return the span of a node: its start, and its end on that line. Cached by node."""
        attached: Span | None = getattr(node, "passgraph_span", None)
        if attached is None:
            attached = node.passgraph_span = self._span(node)  # type: ignore[attr-defined]
        return attached

    def _span(self, node: ast.AST) -> Span:
        line = getattr(node, "lineno", 1)
        column = getattr(node, "col_offset", 0)
        end = getattr(node, "end_col_offset", column + 1) or column + 1
        text = self._line(line)
        if not text.isascii():
            # Columns of ast count UTF-8 bytes; a caret counts characters.
            raw = text.encode()
            column, end = (len(raw[:c].decode(errors="ignore")) for c in (column, end))
        if (getattr(node, "end_lineno", line) or line) > line:
            end = len(text.rstrip())
        return Span(self.file, self.first_line + line - 1, column, end, text)

    def parse(self) -> ast.Module:
        """Return the syntax tree.

        Raises
        ------
        KernelError
            For text that is not Python, and for nesting that would exhaust the stack.
        """
        try:
            tree = ast.parse(_ESCAPE.sub(_known_escape, self.text))
        except SyntaxError as error:
            line = error.lineno or 1
            column = max(0, (error.offset or 1) - 1)
            span = Span(self.file, self.first_line + line - 1, column, column + 1, self._line(line))
            raise KernelError(span.point_at(f"this is not Python: {error.msg}")) from None
        except (ValueError, RecursionError, MemoryError) as error:
            raise KernelError(
                f"{self.file}: kernel text cannot be parsed: {str(error) or 'nested too deeply'}"
            ) from None
        self._check_nesting(tree)
        return tree

    def _check_nesting(self, tree: ast.AST) -> None:
        level, depth = [tree], 0
        while level:
            if depth > MAX_NESTING:
                for node in reversed(level):
                    if hasattr(node, "lineno"):
                        fail(self.span(node), f"this nests deeper than {MAX_NESTING}; give parts of it names")
            level, depth = [child for node in level for child in _children(node)], depth + 1


def _children(node: ast.AST) -> list[ast.AST]:
    """Return the children like :func:`ast.iter_child_nodes`, in half the time."""
    children: list[ast.AST] = []
    for name in node._fields:
        value = getattr(node, name, None)
        if isinstance(value, list):
            children += [child for child in value if isinstance(child, ast.AST)]
        elif isinstance(value, ast.AST):
            children.append(value)
    return children


def _dedented(lines: list[str]) -> tuple[str, int]:
    """Return text without the indent of its first line; comments and strings may be indented less."""
    indent = lines[0][: len(lines[0]) - len(lines[0].lstrip())]
    return "".join(line[len(indent) :] if line.startswith(indent) else line for line in lines), len(indent)


def source_of(function: Callable[..., object] | type) -> Source:
    """Return the text of a function or class, from its file, a notebook cell or the REPL.

    Raises
    ------
    KernelError
        If Python kept no source (``exec``, ``python -c`` before 3.13); pass the text instead.
    """
    name = getattr(function, "__qualname__", str(function))
    try:
        file = inspect.getsourcefile(function) or "<unknown>"
        linecache.checkcache(file)
        lines, first = inspect.getsourcelines(function)
    except (OSError, TypeError, IndexError, SyntaxError):
        raise KernelError(
            f"the source of {name} cannot be found (defined by exec or on the command line?); "
            "put it in a file or a notebook cell, or pass the text: pg.kernel(source=...)"
        ) from None
    text, indent = _dedented(lines)
    return Source(file, text, max(1, first), indent)


def source_of_class(cls: type, file: str, names: dict[str, Any], line: int) -> Source:
    """Return the text of a class statement of which ``line`` of ``file`` is a part; ``names``: its globals.

    Python 3.11 finds classes by name and only in modules with a file; the running line also finds those of notebook
    cells, and the right one of two with one name.
    """
    linecache.checkcache(file)
    lines = linecache.getlines(file, names)
    for node in _classes("".join(lines)):
        if node.name != cls.__name__:
            continue
        first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
        if first <= line <= (node.end_lineno or node.lineno):
            text, indent = _dedented(lines[first - 1 : node.end_lineno])
            return Source(file, text, first, indent)
    return source_of(cls)


@lru_cache(maxsize=1)
def _classes(text: str) -> list[ast.ClassDef]:
    """Return the class statements of a text, outer ones first; cached, as structs of a module parse the same text."""
    try:
        level: list[ast.AST] = [ast.parse(text)]
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    classes: list[ast.ClassDef] = []
    while level:
        classes += [node for node in level if isinstance(node, ast.ClassDef)]
        level = [child for node in level for name in _BLOCKS for child in getattr(node, name, ())]
    return classes


def source_from_text(text: str, name: str = "<kernel text>") -> Source:
    """Return untrusted kernel text as source, within limits that keep parsing fast."""
    if not isinstance(text, str):
        raise PassgraphError(f"kernel source must be str, got {type(text).__name__}")
    return check_length(Source(name, textwrap.dedent(text)))


def check_length(source: Source) -> Source:
    """Return the same source after checking the limits for untrusted text."""
    name, text, limit = source.file, source.text, MAX_LINE_CHARACTERS
    if len(text) > MAX_SOURCE_CHARACTERS:
        raise KernelError(f"{name}: kernel text has {len(text)} characters; at most {MAX_SOURCE_CHARACTERS} are read")
    for number, line in enumerate(source.lines, source.first_line):
        if len(line) > limit:
            raise KernelError(f"{name}:{number}: this line has {len(line)} characters; at most {limit} are read")
    return source
