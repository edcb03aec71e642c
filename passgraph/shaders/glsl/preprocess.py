"""The preprocessor: directives, and text that conditions leave in or out."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from passgraph.errors import KernelError
from passgraph.language.source import Span, fail
from passgraph.shaders.glsl.conditions import holds
from passgraph.shaders.glsl.macros import Expander, Macro
from passgraph.shaders.glsl.tokens import MAX_CHARACTERS, Token, token_lines

#: Tokens of a shader once macros are expanded.
MAX_TOKENS = 300_000
#: Files that include files.
MAX_INCLUDE_DEPTH = 32
#: Files that are included, one counted as often as it is; their characters together are as many as a text may have.
MAX_INCLUDES = 1000
#: ``#if`` within ``#if``.
MAX_CONDITIONS = 100

_INCLUDE = re.compile(r"""\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)""")
#: Names without an ending are three.js's, which has pieces of shaders by name.
_CHUNK = "; pieces of three.js are not read: write what the shader uses of it in its place"


@dataclass
class _Condition:
    """One ``#if`` that is open."""

    span: Span
    outer: bool  # whether the text around it is read
    active: bool
    taken: bool  # whether a branch was
    last: bool = False  # whether its #else was


@dataclass
class Preprocessor:
    """Reads shader text, one piece after another; macros last from piece to piece.

    Attributes
    ----------
    folder : where ``#include`` may read; None: it is an error
    version : what ``#version`` said, or 0
    included : the text of each file that was included
    """

    folder: Path | None = None
    version: int = 0
    es: bool = False
    extensions: list[str] = field(default_factory=list)
    pragmas: list[tuple[str, Span]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._expander = Expander()
        self._conditions: list[_Condition] = []
        self._files: list[Path] = []
        self._once: set[Path] = set()
        self._count = self._includes = 0
        self._room = MAX_CHARACTERS  # of files that may still be included
        self.define("GL_FRAGMENT_PRECISION_HIGH")
        self.define("__VERSION__", "110")  # what a shader without #version is

    def define(self, name: str, value: str = "1") -> None:
        """A macro from outside, as text."""
        tokens = [token for line in token_lines(f"{name} {value}", f"<macro {name}>") for token in line]
        self._define(tokens, tokens[0].span if tokens else Span("<macro>", 1, 0, 1))

    def tokens(self, text: str, file: str) -> list[Token]:
        """The tokens of one piece of text.

        Raises
        ------
        KernelError
            For directives that cannot be read, ``#error``, and text that grows beyond the limits.
        """
        found = []
        for token in self._expander.expand(self._read(text, file)):
            self._count += 1
            if self._count > MAX_TOKENS:
                fail(token.span, f"the shader has more than {MAX_TOKENS} tokens")
            found.append(token)
        return found

    def _read(self, text: str, file: str) -> Iterator[Token]:
        """Tokens of the lines that conditions leave in; directives are obeyed on the way."""
        within = len(self._conditions)
        for line in token_lines(text, file):
            if line[0].text == "#":
                yield from self._directive(line)
            elif not self._conditions or self._conditions[-1].active:
                yield from line
        if len(self._conditions) > within:
            fail(self._conditions[-1].span, "this condition has no #endif")

    def _directive(self, line: list[Token]) -> Iterator[Token]:
        if len(line) == 1:
            return
        name, rest, span = line[1].text, line[2:], line[1].span
        if name in ("if", "ifdef", "ifndef", "elif", "else", "endif"):
            self._conditional(name, rest, span)
        elif self._conditions and not self._conditions[-1].active:
            return
        elif name == "define":
            self._define(rest, span)
        elif name == "undef":
            self._expander.macros.pop(self._name(rest, span), None)
        elif name == "include":
            yield from self._include(line)
        elif name == "version":
            self._version(rest, span)
        elif name == "error":
            fail(span, "the shader says: " + span.text[span.end_column :].strip())
        elif name == "extension":
            self.extensions.append(rest[0].text if rest else "")
        elif name == "pragma":
            if rest and rest[0].text == "once" and self._files:
                self._once.add(self._files[-1])
            self.pragmas.append((span.text[span.end_column :].strip(), span))
        elif name != "line":  # what #line says is not where the text stands
            fail(span, f"there is no directive #{name}")

    def _name(self, tokens: list[Token], span: Span) -> str:
        if not tokens or tokens[0].kind != "name":
            fail(span, "a name is missing here")
        return tokens[0].text

    def _version(self, rest: list[Token], span: Span) -> None:
        if not rest or not rest[0].text.isdigit() or len(rest[0].text) > 4:
            fail(span, "#version takes a number, such as #version 330")
        self.version = int(rest[0].text)
        self.es = self.version == 100 or any(token.text == "es" for token in rest[1:])
        self.define("__VERSION__", str(self.version))
        if self.es:
            self.define("GL_ES", "1")

    # Macros

    def _define(self, tokens: list[Token], span: Span) -> None:
        name = self._name(tokens, span)
        if name == "defined":
            fail(span, "defined cannot be a macro")
        body, parameters = tokens[1:], None
        if body and body[0].text == "(" and not body[0].spaced:
            texts = [token.text for token in body]
            if ")" not in texts:
                fail(span, f"the parameters of macro {name} have no closing parenthesis")
            close = texts.index(")")
            parameters = tuple(texts[1:close:2])
            wrong = any(t != "," for t in texts[2:close:2]) or any(not p.isidentifier() for p in parameters)
            if wrong or len(set(parameters)) != len(parameters) or (close > 1 and close % 2):
                fail(span, f"the parameters of macro {name} are names with commas between")
            body = body[close + 1 :]
        self._expander.macros[name] = Macro(name, parameters, tuple(body))

    # Conditions

    def _conditional(self, name: str, rest: list[Token], span: Span) -> None:
        open_ = self._conditions
        if name in ("if", "ifdef", "ifndef"):
            if len(open_) >= MAX_CONDITIONS:
                fail(span, f"conditions nest deeper than {MAX_CONDITIONS}")
            outer = not open_ or open_[-1].active
            value = outer and self._decided(name, rest, span)
            open_.append(_Condition(span, outer, value, value))
            return
        if not open_:
            fail(span, f"#{name} without #if")
        here = open_[-1]
        if name == "endif":
            open_.pop()
        elif here.last:
            fail(span, f"#{name} after #else")
        elif name == "else":
            here.active, here.last = here.outer and not here.taken, True
        else:
            here.active = here.outer and not here.taken and self._decided("if", rest, span)
            here.taken = here.taken or here.active

    def _decided(self, name: str, rest: list[Token], span: Span) -> bool:
        if name != "if":
            return (self._name(rest, span) in self._expander.macros) == (name == "ifdef")
        known: list[Token] = []
        i = 0
        while i < len(rest):
            token = rest[i]
            if token.text == "defined":
                parenthesis = i + 1 < len(rest) and rest[i + 1].text == "("
                i += 2 if parenthesis else 1
                is_there = self._name(rest[i:], token.span) in self._expander.macros
                if parenthesis:
                    i += 1
                    if i >= len(rest) or rest[i].text != ")":
                        fail(token.span, "this parenthesis is not closed")
                token = Token("number", str(int(is_there)), token.span)
            known.append(token)
            i += 1
        return holds(list(self._expander.expand(known)), span)

    # Files

    def _include(self, line: list[Token]) -> Iterator[Token]:
        span = line[1].span
        match = _INCLUDE.match(span.text)
        if match is None:
            fail(span, '#include takes a name: #include "file.glsl"')
        if self.folder is None:
            fail(span, "#include has no folder to read from; give one with folder=...")
        root = self.folder.resolve()
        beside = self._files[-1].parent if self._files else root
        path = (beside / (match[1] or match[2])).resolve()
        if not path.is_relative_to(root):
            fail(span, f"#include may not leave {self.folder}")
        if path in self._once:
            return
        if len(self._files) >= MAX_INCLUDE_DEPTH:
            fail(span, f"files include files deeper than {MAX_INCLUDE_DEPTH}")
        text = self._file(path, match[1] or match[2], span)
        self._files.append(path)
        yield from self._read(text, path.name)
        self._files.pop()

    def _file(self, path: Path, name: str, span: Span) -> str:
        self._includes += 1
        if self._includes > MAX_INCLUDES:
            fail(span, f"more than {MAX_INCLUDES} files are included")
        try:
            if not path.is_file():
                fail(span, f"there is no file {name!r} in {self.folder}{'' if path.suffix else _CHUNK}")
            with path.open(encoding="utf-8", errors="replace") as file:
                text = file.read(self._room + 1)
        except OSError as error:
            raise KernelError(span.point_at(f"cannot read {name!r}: {error.strerror}")) from None
        self._room -= len(text)
        if self._room < 0:
            fail(span, f"the included files have more than {MAX_CHARACTERS} characters together")
        return text


def preprocessed(
    pieces: list[tuple[str, str]], defines: Mapping[str, str], folder: Path | None
) -> tuple[list[Token], Preprocessor]:
    """All tokens of several pieces of text, each with the name of its file."""
    reader = Preprocessor(folder)
    for name, value in defines.items():
        reader.define(name, value)
    tokens = [token for text, file in pieces for token in reader.tokens(text, file)]
    return tokens, reader
