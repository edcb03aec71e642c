"""Split a shader's text into tokens, each with its line and columns."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

from passgraph.errors import InputError, KernelError
from passgraph.language.source import Span, fail

#: Longest text of a shader, in characters; long published ones have about 100,000.
MAX_CHARACTERS = 500_000
#: Longest word, as GLSL ES requires for names.
MAX_WORD = 1024

Kind: TypeAlias = Literal["name", "number", "sign", "stray", "end"]

_TOKEN = re.compile(
    r"""(?P<space>(?:[ \t\v\f\0]|\\\n)+)
    |(?P<comment>//(?:\\\n|[^\n])*|/\*(?:.*?\*/)?)
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


def token_lines(text: str, file: str) -> Iterator[list[Token]]:
    """Yield the tokens of each line that is not empty; comments and trailing backslashes join lines.

    Raises
    ------
    KernelError
        For text that is too long, and for an unterminated comment.
    """
    if not isinstance(text, str):
        raise InputError(f"the text of a shader must be str, got {type(text).__name__}")
    if len(text) > MAX_CHARACTERS:
        raise KernelError(f"{file}: the shader has {len(text)} characters; at most {MAX_CHARACTERS} are read")
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    row, begin, spaced = 0, 0, False  # the physical line, its start, and True after white space
    tokens: list[Token] = []
    for match in _TOKEN.finditer(text):
        kind, word, start = match.lastgroup, match[0], match.start()
        if kind in ("name", "number", "sign", "stray"):
            column = start - begin
            span = Span(file, row + 1, column, column + len(word), lines[row])
            if len(word) > MAX_WORD:
                fail(span, f"this word has {len(word)} characters; at most {MAX_WORD} are read")
            tokens.append(Token(kind, word, span, spaced))  # type: ignore[arg-type]
            spaced = False
            continue
        if word == "/*":
            column = start - begin
            fail(Span(file, row + 1, column, column + 2, lines[row]), "this comment has no end: */ is missing")
        spaced = True
        ends = word.count("\n")
        if ends:
            row, begin = row + ends, start + word.rindex("\n") + 1
        if kind == "newline" and tokens:
            yield tokens
            tokens = []
    if tokens:
        yield tokens
