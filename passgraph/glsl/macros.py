"""Macros and their expansion."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from passgraph.cached import cached_property
from passgraph.glsl.tokens import Token, token_lines
from passgraph.language.source import Span, fail

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

    def same_as(self, other: Macro) -> bool:
        """Return True if another definition is the same, token by token, with white space at the same places."""
        mine, its = ([(t.text, t.spaced and i > 0) for i, t in enumerate(m.body)] for m in (self, other))
        return self.parameters == other.parameters and mine == its

    @cached_property
    def joins(self) -> bool:
        """True if its body has ``##``."""
        return any(token.text == "##" for token in self.body)


#: Macros that the preprocessor itself defines: the line, and the number of the text, 0 unless ``#line`` says another.
PREDEFINED = ("__LINE__", "__FILE__")


class Expander:
    """Expand macros in a stream of tokens."""

    def __init__(self) -> None:
        self.macros: dict[str, Macro] = {name: Macro(name, None, ()) for name in PREDEFINED}
        #: What ``#line`` adds to the numbers of lines, and its number of the text, by file.
        self.lines: dict[str, tuple[int, int]] = {}
        self.expanded = 0
        self.asks_defined = False  # True in conditions, where names after ``defined`` are not expanded
        self._depth = 0  # of nested arguments
        self._line = 0  # of the last token read from the text: where macros are replaced

    def expand(self, tokens: Iterable[Token]) -> Iterator[Token]:
        """Yield the tokens with macros replaced; ``tokens`` are read lazily."""
        source, pending = iter(tokens), []  # type: Iterator[Token], list[Token]
        while (token := self._next(source, pending)) is not None:
            if self.asks_defined and token.text == "defined":
                yield self._defined(token, source, pending)
                continue
            macro = self.macros.get(token.text) if token.kind == "name" else None
            if macro is None or token.text in token.hidden:
                yield token
            elif macro.parameters is None:
                pending += self._body(macro, {}, token, token.hidden)[::-1]
            else:
                following = self._next(source, pending)
                if following is None or following.text != "(":
                    if following is not None:
                        pending.append(following)
                    yield token
                else:
                    arguments, hidden = self._arguments(macro, token, source, pending)
                    pending += self._body(macro, arguments, token, token.hidden & hidden)[::-1]

    def _next(self, source: Iterator[Token], pending: list[Token]) -> Token | None:
        """Return the next token: of a replaced macro, or of the text."""
        if pending:
            return pending.pop()
        token = next(source, None)
        if token is not None and not self._depth:
            self._line = token.span.line
        return token

    def _defined(self, word: Token, source: Iterator[Token], pending: list[Token]) -> Token:
        """Return the number of ``defined NAME`` or ``defined(NAME)``; macros may bring the word."""

        name = self._next(source, pending)
        is_closed = name is None or name.text != "("
        name = name if is_closed else self._next(source, pending)
        if name is None or name.kind != "name":
            fail(word.span, "defined takes the name of a macro")
        if not is_closed and ((end := self._next(source, pending)) is None or end.text != ")"):
            fail(word.span, "this parenthesis is not closed")
        return Token("number", str(int(name.text in self.macros)), word.span)

    def _arguments(
        self, macro: Macro, name: Token, source: Iterator[Token], pending: list[Token]
    ) -> tuple[dict[str, list[Token]], frozenset[str]]:
        """Return the macro's arguments by parameter, and the macros that the closing parenthesis came from."""
        assert macro.parameters is not None
        arguments: list[list[Token]] = [[]]
        depth = 1
        while True:
            token = self._next(source, pending)
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
        if macro.name in PREDEFINED:
            added, number = self.lines.get(use.span.file, (0, 0))
            # In another macro it is the line where that one is replaced, with all its arguments.
            line = self._line if hidden else use.span.line
            text = str(line + added if macro.name == "__LINE__" else number)
            return [Token("number", text, use.span, use.spaced, hidden)]
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
