"""Split a shader's text into tokens, each with its line and columns."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate
from typing import Literal, TypeAlias

from passgraph.errors import InputError, KernelError
from passgraph.language.source import Span, fail

#: Longest text of a shader, in characters; long published ones have about 100,000.
MAX_CHARACTERS = 500_000
#: Longest word, as GLSL ES requires for names.
MAX_WORD = 1024

Kind: TypeAlias = Literal["name", "number", "sign", "stray", "end"]

_TOKEN = re.compile(
    r"""(?P<space>[ \t\v\f\0]+)
    |(?P<comment>//[^\n]*|/\*(?:.*?\*/)?)
    |(?P<newline>\n)
    |(?P<number>0[xX][0-9a-fA-F]+[uU]?|[0-9]+[uU]
        |(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+)(?:[eE][+-]?[0-9]+)?(?:lf|LF|[fF])?)
    |(?P<name>[A-Za-z_][A-Za-z_0-9]*)
    |(?P<sign><<=|>>=|\+\+|--|&&|\|\||\^\^|<=|>=|==|!=|\+=|-=|\*=|/=|%=|&=|\|=|\^=|<<|>>|\#\#
        |[-+*/%<>=!&|^~?:;,.(){}\[\]\#])
    |(?P<stray>.)""",
    re.VERBOSE | re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class Token:
    """A token; ``spaced`` is True after white space, ``hidden`` are the macros that it was expanded from."""

    kind: Kind
    text: str
    span: Span
    spaced: bool = False
    hidden: frozenset[str] = frozenset()


class _Places:
    """Positions in a text from which each backslash with a newline was removed, as places in the text's own lines."""

    def __init__(self, text: str, file: str) -> None:
        self.file, self.lines = file, text.split("\n")
        self.joined = text.replace("\\\n", "")
        #: The removed pairs, by their positions in the joined text, and the position of each line in the text.
        self._removed = [match.start() - 2 * i for i, match in enumerate(re.finditer(r"\\\n", text))]
        self._starts = list(accumulate((len(line) + 1 for line in self.lines), initial=0))

    def span(self, start: int, length: int) -> Span:
        """Return the place of a word; one that goes on in the next line is shown up to the end of its first."""
        position = start + 2 * bisect_right(self._removed, start)
        row = bisect_right(self._starts, position) - 1
        column, line = position - self._starts[row], self.lines[row]
        return Span(self.file, row + 1, column, min(column + length, max(len(line), column + 1)), line)


def token_lines(text: str, file: str) -> Iterator[list[Token]]:
    """Yield the tokens of each line that is not empty; comments join lines, and trailing backslashes words too.

    Raises
    ------
    KernelError
        For text that is too long, and for an unterminated comment.
    """
    if not isinstance(text, str):
        raise InputError(f"the text of a shader must be str, got {type(text).__name__}")
    if len(text) > MAX_CHARACTERS:
        raise KernelError(f"{file}: the shader has {len(text)} characters; at most {MAX_CHARACTERS} are read")
    places = _Places(text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n"), file)
    spaced = False  # True after white space
    tokens: list[Token] = []
    for match in _TOKEN.finditer(places.joined):
        kind, word = match.lastgroup, match[0]
        if kind in ("name", "number", "sign", "stray"):
            span = places.span(match.start(), len(word))
            if len(word) > MAX_WORD:
                fail(span, f"this word has {len(word)} characters; at most {MAX_WORD} are read")
            tokens.append(Token(kind, word, span, spaced))  # type: ignore[arg-type]
            spaced = False
            continue
        if word == "/*":
            fail(places.span(match.start(), 2), "this comment has no end: */ is missing")
        spaced = True
        if kind == "newline" and tokens:
            yield tokens
            tokens = []
    if tokens:
        yield tokens
