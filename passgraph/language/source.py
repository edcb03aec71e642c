"""Where kernel source comes from, and how an error points into it."""

from __future__ import annotations

import ast
import inspect
import linecache
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

from passgraph.errors import KernelError, PassgraphError


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of one source line; ``line`` counts from 1, columns from 0."""

    file: str
    line: int
    column: int
    end_column: int
    text: str = ""

    def point_at(self, message: str) -> str:
        """The message with file, line, the source line and a caret below it."""
        caret = " " * self.column + "^" * max(1, self.end_column - self.column)
        return f"{self.file}:{self.line}: {message}\n    {self.text.rstrip()}\n    {caret}"


NOWHERE = Span("<passgraph>", 0, 0, 1)


def fail(span: Span, message: str) -> NoReturn:
    raise KernelError(span.point_at(message))


@dataclass(frozen=True)
class Source:
    """One piece of kernel text and where it begins."""

    file: str
    text: str  # dedented
    first_line: int = 1
    indent: int = 0  # columns that dedenting took away

    def span(self, node: ast.AST) -> Span:
        line = getattr(node, "lineno", 1)
        column = getattr(node, "col_offset", 0)
        end = getattr(node, "end_col_offset", column + 1) or column + 1
        lines = self.text.splitlines()
        text = lines[line - 1] if 0 < line <= len(lines) else ""
        if (getattr(node, "end_lineno", line) or line) > line:
            end = len(text.rstrip())
        # Columns of ast count UTF-8 bytes; a caret counts characters.
        raw = text.encode()
        column, end = len(raw[:column].decode(errors="ignore")), len(raw[:end].decode(errors="ignore"))
        return Span(self.file, self.first_line + line - 1, column, end, text)

    def parse(self) -> ast.Module:
        try:
            return ast.parse(self.text)
        except SyntaxError as error:
            line = error.lineno or 1
            column = max(0, (error.offset or 1) - 1)
            lines = self.text.splitlines()
            text = lines[line - 1] if 0 < line <= len(lines) else ""
            span = Span(self.file, self.first_line + line - 1, column, column + 1, text)
            raise KernelError(span.point_at(f"this is not Python: {error.msg}")) from None
        except (ValueError, RecursionError, MemoryError) as error:
            raise KernelError(f"{self.file}: kernel text cannot be parsed: {error}") from None


def source_of(function: Callable[..., object] | type) -> Source:
    """The text of a function or class, from its file, a notebook cell or the REPL.

    Raises
    ------
    KernelError
        When Python kept no source (``exec``, ``python -c`` before 3.13); the mend is to give the text.
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
    text = "".join(lines)
    dedented = textwrap.dedent(text)
    indent = len(lines[0]) - len(lines[0].lstrip())
    return Source(file, dedented, max(1, first), indent)


#: Longest kernel text taken from a stranger, in characters; the longest kernel of our own has about 5,000.
MAX_SOURCE_CHARACTERS = 200_000


def source_from_text(text: str, name: str = "<kernel text>") -> Source:
    if not isinstance(text, str):
        raise PassgraphError(f"kernel source must be str, got {type(text).__name__}")
    if len(text) > MAX_SOURCE_CHARACTERS:
        raise KernelError(f"{name}: kernel text has {len(text)} characters; at most {MAX_SOURCE_CHARACTERS} are read")
    return Source(name, textwrap.dedent(text))
