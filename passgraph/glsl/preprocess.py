"""The preprocessor: directives, conditions of ``#if``, macros and their expansion."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from passgraph.cached import cached_property
from passgraph.errors import KernelError
from passgraph.glsl.tokens import MAX_CHARACTERS, Token, token_lines
from passgraph.language.source import Span, fail

#: Most nested parentheses and signs.
MAX_DEPTH = 40

_BINARY: tuple[dict[str, Callable[[int, int], int]], ...] = (
    {"||": lambda a, b: int(bool(a) or bool(b))},
    {"&&": lambda a, b: int(bool(a) and bool(b))},
    {"|": lambda a, b: a | b},
    {"^": lambda a, b: a ^ b},
    {"&": lambda a, b: a & b},
    {"==": lambda a, b: int(a == b), "!=": lambda a, b: int(a != b)},
    {"<": lambda a, b: int(a < b), ">": lambda a, b: int(a > b), "<=": lambda a, b: int(a <= b),
     ">=": lambda a, b: int(a >= b)},
    {"<<": lambda a, b: a << (b & 63), ">>": lambda a, b: a >> (b & 63)},
    {"+": lambda a, b: a + b, "-": lambda a, b: a - b},
    {"*": lambda a, b: a * b, "/": lambda a, b: _quotient(a, b), "%": lambda a, b: a - b * _quotient(a, b)},
)  # fmt: skip
_UNARY: dict[str, Callable[[int], int]] = {
    "!": lambda a: int(not a),
    "-": lambda a: -a,
    "+": lambda a: a,
    "~": lambda a: ~a,
}


def _quotient(a: int, b: int) -> int:
    """Divide, rounding toward zero; x / 0 is 0, since both sides of ``defined(A) && 1 / A`` are evaluated."""
    if not b:
        return 0
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def holds(tokens: Sequence[Token], span: Span) -> bool:
    """Return the value of a condition with macros expanded; remaining names are 0."""
    reader = _Reader(tokens, span)
    value = reader.binary(0)
    if reader.position < len(tokens):
        fail(tokens[reader.position].span, f"{tokens[reader.position].text!r} is not expected in a condition")
    return value != 0


class _Reader:
    def __init__(self, tokens: Sequence[Token], span: Span) -> None:
        self.tokens, self.span, self.position, self.depth = tokens, span, 0, 0

    def _text(self) -> str:
        return self.tokens[self.position].text if self.position < len(self.tokens) else ""

    def binary(self, level: int) -> int:
        if level == len(_BINARY):
            return self._unary()
        value = self.binary(level + 1)
        while (sign := self._text()) in _BINARY[level]:
            self.position += 1
            value = _wrapped(_BINARY[level][sign](value, self.binary(level + 1)))
        return value

    def _unary(self) -> int:
        if self.position == len(self.tokens):
            fail(self.span, "the condition ends too early")
        token = self.tokens[self.position]
        self.position += 1
        self.depth += 1
        if self.depth > MAX_DEPTH:
            fail(token.span, f"the condition nests deeper than {MAX_DEPTH}")
        if token.text in _UNARY:
            value = _wrapped(_UNARY[token.text](self._unary()))
        elif token.text == "(":
            value = self.binary(0)
            if self._text() != ")":
                fail(token.span, "this parenthesis is not closed")
            self.position += 1
        elif token.kind == "name":
            value = 0
        else:
            value = _number(token)
        self.depth -= 1
        return value


def _number(token: Token) -> int:
    digits = token.text.rstrip("uU")
    if token.kind != "number" or not (digits.isdigit() or digits[:2] in ("0x", "0X")) or len(digits) > 24:
        fail(token.span, f"{token.text!r} is not a whole number")
    octal = digits.isdigit() and digits.startswith("0") and all(d in "01234567" for d in digits)
    return _wrapped(int(digits, 8 if octal else 10 if digits.isdigit() else 16))


def _wrapped(value: int) -> int:
    return (value + 2**63) % 2**64 - 2**63


#: Most tokens from all macros of a shader.
MAX_EXPANDED = 200_000
#: Most nested macros.
MAX_MACRO_DEPTH = 100


@dataclass(frozen=True)
class Macro:
    """A macro; ``parameters`` is None for one without parentheses."""

    name: str
    parameters: tuple[str, ...] | None
    body: tuple[Token, ...]

    @cached_property
    def joins(self) -> bool:
        """True if its body has ``##``."""
        return any(token.text == "##" for token in self.body)


class Expander:
    """Expand macros in a stream of tokens."""

    def __init__(self) -> None:
        self.macros: dict[str, Macro] = {}
        self.expanded = 0
        self._depth = 0  # of nested arguments

    def expand(self, tokens: Iterable[Token]) -> Iterator[Token]:
        """Yield the tokens with macros replaced; ``tokens`` are read lazily."""
        source, pending = iter(tokens), []  # type: Iterator[Token], list[Token]
        while (token := pending.pop() if pending else next(source, None)) is not None:
            macro = self.macros.get(token.text) if token.kind == "name" else None
            if macro is None or token.text in token.hidden:
                yield token
            elif macro.parameters is None:
                pending += self._body(macro, {}, token, token.hidden)[::-1]
            else:
                following = pending.pop() if pending else next(source, None)
                if following is None or following.text != "(":
                    if following is not None:
                        pending.append(following)
                    yield token
                else:
                    arguments, hidden = self._arguments(macro, token, source, pending)
                    pending += self._body(macro, arguments, token, token.hidden & hidden)[::-1]

    def _arguments(
        self, macro: Macro, name: Token, source: Iterator[Token], pending: list[Token]
    ) -> tuple[dict[str, list[Token]], frozenset[str]]:
        """Return the macro's arguments by parameter, and the macros that the closing parenthesis came from."""
        assert macro.parameters is not None
        arguments: list[list[Token]] = [[]]
        depth = 1
        while True:
            token = pending.pop() if pending else next(source, None)
            if token is None:
                fail(name.span, f"the call of macro {name.text} has no closing parenthesis")
            depth += {"(": 1, ")": -1}.get(token.text, 0)
            if not depth:
                break
            if token.text == "," and depth == 1:
                arguments.append([])
            else:
                arguments[-1].append(token)
        if arguments == [[]] and not macro.parameters:
            arguments = []
        if len(arguments) != len(macro.parameters):
            fail(name.span, f"macro {name.text} takes {len(macro.parameters)} arguments, got {len(arguments)}")
        return dict(zip(macro.parameters, arguments, strict=True)), token.hidden

    def _body(
        self, macro: Macro, arguments: Mapping[str, list[Token]], use: Token, hidden: frozenset[str]
    ) -> list[Token]:
        """Return a macro's body with its parameters replaced."""
        if len(hidden) >= MAX_MACRO_DEPTH:
            fail(use.span, f"macros nest deeper than {MAX_MACRO_DEPTH}")
        hidden = hidden | {macro.name}
        if not arguments and not macro.joins:
            self._count(len(macro.body) + 1, use.span)
            return [Token(token.kind, token.text, use.span, token.spaced, hidden) for token in macro.body]
        body, tokens, ready = macro.body, [], {}  # type: tuple[Token, ...], list[Token], dict[str, list[Token]]
        i = 0
        while i < len(body):
            token = body[i]
            joined = tokens and i and body[i - 1].text == "##"
            if token.text == "##" and tokens and i + 1 < len(body):
                i += 1
                continue
            part = [replace(token, span=use.span)]
            if token.text in arguments and token.kind == "name":
                is_pasted = joined or (i + 1 < len(body) and body[i + 1].text == "##")
                if is_pasted:
                    part = arguments[token.text]
                else:
                    if token.text not in ready:
                        ready[token.text] = self._expanded(arguments[token.text], use.span)
                    part = ready[token.text]
            if joined and part:
                tokens[-1:] = [_glued(tokens[-1], part[0], use.span)]
                part = part[1:]
            tokens += part
            self._count(len(part) + 1, use.span)
            i += 1
        both = {frozenset[str](): hidden}  # a cache, since most tokens come from no macro, or from the same ones
        for token in tokens:
            if token.hidden not in both:
                both[token.hidden] = token.hidden | hidden
        return [Token(t.kind, t.text, t.span, t.spaced, both[t.hidden]) for t in tokens]

    def _expanded(self, argument: list[Token], span: Span) -> list[Token]:
        """Return an argument with its own macros expanded."""
        if self._depth >= MAX_MACRO_DEPTH:
            fail(span, f"macros nest deeper than {MAX_MACRO_DEPTH}")
        self._depth += 1
        expanded = list(self.expand(argument))
        self._depth -= 1
        return expanded

    def _count(self, tokens: int, span: Span) -> None:
        self.expanded += tokens
        if self.expanded > MAX_EXPANDED:
            fail(span, f"macros bring more than {MAX_EXPANDED} tokens")


def _glued(left: Token, right: Token, span: Span) -> Token:
    """Join ``left ## right`` to one token."""
    lines = list(token_lines(left.text + right.text, span.file))
    if len(lines) != 1 or len(lines[0]) != 1:
        fail(span, f"{left.text} ## {right.text} is not one word")
    return replace(lines[0][0], span=span, spaced=left.spaced, hidden=left.hidden & right.hidden)


#: Most tokens of a shader after macro expansion.
MAX_TOKENS = 300_000
#: Most nested includes.
MAX_INCLUDE_DEPTH = 32
#: Most includes, counted each time; their characters together are limited as those of a text.
MAX_INCLUDES = 1000
#: Most nested ``#if``.
MAX_CONDITIONS = 100

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
    included : the text of each included file, by its path in ``folder``; files that are read are added
    version : the number of ``#version``, or 0
    """

    folder: Path | None = None
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
        self._count = self._includes = 0
        self._room = MAX_CHARACTERS  # characters of files that may still be included
        self.define("GL_FRAGMENT_PRECISION_HIGH")
        self.define("__VERSION__", "110")  # the version of a shader without #version

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
        elif name != "line":  # #line is ignored: errors show the position in the file
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
        decided: list[Token] = []
        i = 0
        while i < len(rest):
            token = rest[i]
            if token.text == "defined":
                parenthesis = i + 1 < len(rest) and rest[i + 1].text == "("
                i += 2 if parenthesis else 1
                is_there = self._name(rest[i : i + 1], token.span) in self._expander.macros
                if parenthesis:
                    i += 1
                    if i >= len(rest) or rest[i].text != ")":
                        fail(token.span, "this parenthesis is not closed")
                token = Token("number", str(int(is_there)), token.span)
            decided.append(token)
            i += 1
        return holds(list(self._expander.expand(decided)), span)

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
        if path in self._once:
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


def preprocessed(
    pieces: list[tuple[str, str]],
    defines: Mapping[str, str],
    folder: Path | None,
    included: Mapping[str, str] | None = None,
) -> tuple[list[Token], Preprocessor]:
    """Return all tokens of several pieces of text, each with the name of its file."""
    reader = Preprocessor(folder, dict(included or {}))
    for name, value in defines.items():
        reader.define(name, value)
    tokens = [token for text, file in pieces for token in reader.tokens(text, file)]
    return tokens, reader
