"""The preprocessor: directives, files, and the tokens of active lines."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from passgraph.errors import KernelError
from passgraph.glsl.conditions import holds
from passgraph.glsl.dialect import Dialect
from passgraph.glsl.macros import PREDEFINED, Expander, Macro
from passgraph.glsl.tokens import MAX_CHARACTERS, Token, token_lines
from passgraph.language.source import Span, fail, place_in

#: Most tokens of a shader after macro expansion.
MAX_TOKENS = 300_000
#: Most nested includes.
MAX_INCLUDE_DEPTH = 32
#: Most includes, counted each time; their characters together are limited as those of a text.
MAX_INCLUDES = 1000
#: Most nested ``#if``.
MAX_CONDITIONS = 100

#: Extensions whose functions, words and rules are read.
EXTENSIONS = (
    "GL_OES_standard_derivatives", "GL_EXT_shader_texture_lod", "GL_ARB_shader_texture_lod", "GL_EXT_draw_buffers",
    "GL_ARB_draw_buffers", "GL_ARB_texture_rectangle", "GL_ARB_texture_gather", "GL_ARB_texture_query_lod",
    "GL_ARB_texture_query_levels", "GL_ARB_derivative_control", "GL_ARB_explicit_attrib_location",
    "GL_ARB_uniform_buffer_object", "GL_ARB_fragment_coord_conventions", "GL_ARB_shader_bit_encoding",
    "GL_ARB_shading_language_packing", "GL_ARB_arrays_of_arrays", "GL_OES_EGL_image_external",
)  # fmt: skip
_BEHAVIORS = ("require", "enable", "warn", "disable")
#: Numbers of ``#version``, and those of GLSL ES, which takes the word es from 3.00 on.
_VERSIONS = (110, 120, 130, 140, 150, 330, 400, 410, 420, 430, 440, 450, 460)
_ES_VERSIONS = (100, 300, 310, 320)

_INCLUDE = re.compile(r"""\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>)""")
#: The hint for includes without a suffix, which are three.js's named shader chunks.
_CHUNK = "; pieces of three.js are not read: write what the shader uses of it in its place"


@dataclass
class _Condition:
    """An open ``#if``."""

    span: Span
    outer: bool  # True if the text around it is active
    active: bool
    taken: bool  # True after an active branch
    last: bool = False  # True after #else


@dataclass
class Preprocessor:
    """Preprocess shader text, piece by piece; macros stay defined for later pieces.

    Attributes
    ----------
    folder : folder for ``#include``; None allows only files in ``included``
    around : file names of the container's texts, whose macros a shader may define again
    included : the text of each included file, by its path in ``folder``; files that are read are added
    version : the number of ``#version``, or 0
    """

    folder: Path | None = None
    around: Collection[str] = ()
    included: dict[str, str] = field(default_factory=dict)
    version: int = 0
    es: bool = False
    extensions: list[str] = field(default_factory=list)
    pragmas: list[tuple[str, Span]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._expander = Expander()
        self._conditions: list[_Condition] = []
        self._files: list[str] = []
        self._once: set[str] = set()
        self._guards: dict[str, str] = {}  # files that are nothing but #ifndef NAME … #endif, with the names
        self._has_macros = False  # True if the shader's text defines one
        self._own_tokens = 0  # of the shader's text, active lines
        self._own: dict[str, tuple[Macro, Span]] = {}  # macros of the shader's text, with where they are defined
        self._count = self._includes = 0
        self._room = MAX_CHARACTERS  # characters of files that may still be included
        self.define("GL_FRAGMENT_PRECISION_HIGH")
        for name in EXTENSIONS:
            self.define(name)
        self.define("__VERSION__", "110")  # the version of a shader without #version

    @property
    def dialect(self) -> Dialect:
        """Return the version of GLSL that the text says, with its extensions."""
        return Dialect(self.version, self.es, frozenset(self.extensions))

    def define(self, name: str, value: str = "1") -> None:
        """Define a macro from text."""
        tokens = [token for line in token_lines(f"{name} {value}", f"<macro {name}>") for token in line]
        self._define(tokens, tokens[0].span if tokens else Span("<macro>", 1, 0, 1))

    def tokens(self, text: str, file: str) -> list[Token]:
        """Return the tokens of a piece of text.

        Raises
        ------
        KernelError
            For invalid directives, ``#error``, and text beyond the limits.
        """
        expanded = []
        for token in self._expander.expand(self._read(text, file)):
            self._count += 1
            if self._count > MAX_TOKENS:
                fail(token.span, f"the shader has more than {MAX_TOKENS} tokens")
            expanded.append(token)
        return expanded

    def _read(self, text: str, file: str) -> Iterator[Token]:
        """Yield the tokens of active lines, and execute directives."""
        within = len(self._conditions)
        for line in token_lines(text, file):
            if line[0].text == "#":
                yield from self._directive(line)
            elif not self._conditions or self._conditions[-1].active:
                self._own_tokens += 0 if file in self.around else len(line)
                _check_numbers(line)
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
            self._has_macros = self._has_macros or not self._is_around(span)
        elif name == "undef":
            self._undefine(rest, span)
        elif name == "include":
            yield from self._include(line)
        elif name == "version":
            self._version(rest, span)
        elif name == "error":
            fail(span, "the shader says: " + span.text[span.end_column :].strip())
        elif name == "extension":
            self._extension(rest, span)
        elif name == "pragma":
            if rest and rest[0].text == "once" and self._files:
                self._once.add(self._files[-1])
            self.pragmas.append((span.text[span.end_column :].strip(), span))
        elif name == "line":
            self._line(rest, span)
        else:
            fail(span, f"there is no directive #{name}")

    def _name(self, tokens: list[Token], span: Span) -> str:
        if not tokens or tokens[0].kind != "name":
            fail(span, "a name is missing here")
        return tokens[0].text

    @staticmethod
    def _check_end(tokens: list[Token], what: str) -> None:
        """Raise KernelError for tokens behind the last one of a directive."""
        if tokens:
            fail(tokens[0].span, f"{what} ends before {tokens[0].text!r}; write a comment: // {tokens[0].text}")

    def _line(self, rest: list[Token], span: Span) -> None:
        """Set the numbers of the next line and of the text for ``__LINE__`` and ``__FILE__``.

        Errors show the position in the file.
        """
        numbers = [token.text for token in self._expander.expand(rest)]
        if '"' in numbers:  # the name of a file, as some tools write it
            return
        if not 1 <= len(numbers) <= 2 or not all(re.fullmatch("[0-9]{1,9}", number) for number in numbers):
            fail(
                span, f"#line takes the number of the next line, and of the text; got {' '.join(numbers) or 'nothing'}"
            )
        line, text = (*map(int, numbers), 0)[:2]
        # Up to GLSL 1.50 the next line has the number after the given one.
        after = 1 if not self.es and self.version < 330 else 0
        self._expander.lines[span.file] = line + after - span.line - 1, text

    def _extension(self, rest: list[Token], span: Span) -> None:
        texts = [token.text for token in rest]
        named = len(texts) == 3 and rest[0].kind == "name" and texts[1] == ":"
        if not named or texts[2] not in _BEHAVIORS or (texts[0] == "all" and texts[2] in ("require", "enable")):
            got = " ".join(texts) or "nothing"
            fail(span, f"#extension takes NAME : {' or '.join(_BEHAVIORS)} (all: warn or disable); got {got}")
        if self.es and self._own_tokens and span.file not in self.around:
            fail(span, "#extension stands before all declarations and statements in GLSL ES; move it to the top")
        self.extensions.append(texts[0])

    def _version(self, rest: list[Token], span: Span) -> None:
        if not rest or not rest[0].text.isdigit() or len(rest[0].text) > 4:
            fail(span, "#version takes a number, such as #version 330")
        version, profile = int(rest[0].text), [token.text for token in rest[1:]]
        is_es = version in _ES_VERSIONS and profile == (["es"] if version > 100 else [])
        if not is_es and (version not in _VERSIONS or profile not in ([], ["core"], ["compatibility"])):
            said = " ".join(token.text for token in rest)
            fail(
                span,
                f"there is no GLSL {said}; versions are {', '.join(map(str, _VERSIONS))}, 100, 300 es, 310 es, 320 es",
            )
        if (self._own_tokens or self._has_macros) and span.file not in self.around:
            fail(span, "#version stands before everything else in a shader; move it to the top")
        self.version, self.es = version, is_es
        self.define("__VERSION__", str(self.version))
        if self.es:
            self.define("GL_ES", "1")

    # Macros

    def _define(self, tokens: list[Token], span: Span) -> None:
        name = self._name(tokens, span)
        self._check_free(name, span)
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
        macro, before = Macro(name, parameters, tuple(body)), self._own.get(name)
        if before is not None and not before[0].same_as(macro):
            fail(span, f"macro {name} has another meaning already{place_in(before[1], span)}; #undef it before")
        if not self._is_around(span):
            self._own[name] = macro, span
        self._expander.macros[name] = macro

    def _is_around(self, span: Span) -> bool:
        """Return True for text that is not the shader's own."""
        return span.file in self.around or span.file.startswith("<macro")

    def _check_free(self, name: str, span: Span) -> None:
        """Raise KernelError for a name that a shader may not define."""
        if name == "defined" or name in PREDEFINED:
            fail(span, f"{name} cannot be a macro" if name == "defined" else f"{name} is defined by GLSL itself")
        if not self._is_around(span) and (name.startswith("GL_") or name == "__VERSION__"):
            fail(span, f"{name} is not for shaders to define; names that begin with GL_ are GLSL's own")

    def _undefine(self, rest: list[Token], span: Span) -> None:
        name = self._name(rest, span)
        self._check_end(rest[1:], f"#undef {name}")
        self._check_free(name, span)
        self._own.pop(name, None)
        self._expander.macros.pop(name, None)

    # Conditions

    def _conditional(self, name: str, rest: list[Token], span: Span) -> None:
        open_ = self._conditions
        if name in ("ifdef", "ifndef"):
            self._check_end(rest[1:], f"#{name}")
        if name in ("else", "endif"):
            self._check_end(rest, f"#{name}")
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
        self._expander.asks_defined = True
        tokens = list(self._expander.expand(rest))
        self._expander.asks_defined = False
        return holds(tokens, span, knows_names=self.es)

    # Files

    def _include(self, line: list[Token]) -> Iterator[Token]:
        span = line[1].span
        match = _INCLUDE.match(span.text)
        if match is None:
            fail(span, '#include takes a name: #include "file.glsl"')
        if self.folder is None and not self.included:
            fail(span, "#include has no folder to read from; give one with folder=...")
        name = match[1] or match[2]
        folder = posixpath.dirname(self._files[-1]) if self._files else ""
        path = posixpath.normpath(posixpath.join(folder, name))
        if path.startswith(("/", "../")):
            fail(span, f"#include may not leave {self.folder}")
        if path in self._once or self._guards.get(path) in self._expander.macros:
            return
        if len(self._files) >= MAX_INCLUDE_DEPTH:
            fail(span, f"files include files deeper than {MAX_INCLUDE_DEPTH}")
        self._includes += 1
        if self._includes > MAX_INCLUDES:
            fail(span, f"more than {MAX_INCLUDES} files are included")
        text = self.included[path] = self._file(path, name, span)
        self._room -= len(text)
        if self._room < 0:
            fail(span, f"the included files have more than {MAX_CHARACTERS} characters together")
        if (guard := _guard(text, path)) is not None:
            self._guards[path] = guard
        self._files.append(path)
        yield from self._read(text, posixpath.basename(path))
        self._files.pop()

    def _file(self, within: str, name: str, span: Span) -> str:
        if within in self.included:
            return self.included[within]
        root = Path() if self.folder is None else self.folder.resolve()
        path = (root / within).resolve()
        if self.folder is not None and not path.is_relative_to(root):
            fail(span, f"#include may not leave {self.folder}")
        try:
            if self.folder is None or not path.is_file():
                where = self.folder or "the included files"
                fail(span, f"there is no file {name!r} in {where}{'' if path.suffix else _CHUNK}")
            with path.open(encoding="utf-8", errors="replace") as file:
                return file.read(self._room + 1)
        except OSError as error:
            raise KernelError(span.point_at(f"cannot read {name!r}: {error.strerror}")) from None


def _check_numbers(line: list[Token]) -> None:
    """Raise KernelError for a word that begins with a number: it is one token, which no macro splits (ES 3.00, 3.1)."""
    for token, following in pairwise(line):
        if token.kind == "number" and following.kind == "name" and not following.spaced:
            fail(token.span, f"{token.text}{following.text} is no number and no name; put a space or a sign between")


def _guard(text: str, file: str) -> str | None:
    """Return the name of a file that is nothing but ``#ifndef NAME … #endif``; None for another."""
    depth, guard = 0, None
    for line in token_lines(text, file):
        words = [token.text for token in line[:3]]
        if guard is None:
            if words[:2] != ["#", "ifndef"] or len(words) < 3:
                return None
            guard, depth = words[2], 1
            continue
        if not depth:  # a line behind the last #endif
            return None
        if words[0] == "#" and len(words) > 1:
            depth += words[1] in ("if", "ifdef", "ifndef")
            depth -= words[1] == "endif"
            if depth == 1 and words[1] in ("else", "elif"):
                return None
    return guard


def preprocessed(
    pieces: list[tuple[str, str]],
    defines: Mapping[str, str],
    folder: Path | None,
    included: Mapping[str, str] | None = None,
    around: Collection[str] = (),
) -> tuple[list[Token], Preprocessor]:
    """Return all tokens of several pieces of text, each with the name of its file."""
    reader = Preprocessor(folder, around, dict(included or {}))
    for name, value in defines.items():
        reader.define(name, value)
    tokens = [token for text, file in pieces for token in reader.tokens(text, file)]
    return tokens, reader
