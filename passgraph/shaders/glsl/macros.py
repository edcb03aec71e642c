"""Macros and their expansion.

Every token remembers the macros that it came out of, and none of these is expanded in it again (Prosser's algorithm),
so expansion ends.  Steps are counted, since it may still grow without measure.  What a macro's body brings points at
the place of its use; what came in as an argument keeps its own place.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from passgraph.cached import cached_property
from passgraph.language.source import Span, fail
from passgraph.shaders.glsl.tokens import Token, token_lines

#: Tokens that all macros of a shader may bring.
MAX_EXPANDED = 200_000
#: Macros within macros.
MAX_MACRO_DEPTH = 100


@dataclass(frozen=True)
class Macro:
    """``parameters`` is None where the macro takes no parentheses."""

    name: str
    parameters: tuple[str, ...] | None
    body: tuple[Token, ...]

    @cached_property
    def joins(self) -> bool:
        """Whether words are glued together in it."""
        return any(token.text == "##" for token in self.body)


class Expander:
    """Expands macros in a stream of tokens."""

    def __init__(self) -> None:
        self.macros: dict[str, Macro] = {}
        self.expanded = 0
        self._depth = 0  # of arguments within arguments

    def expand(self, tokens: Iterable[Token]) -> Iterator[Token]:
        """The tokens with every macro replaced; ``tokens`` are asked for one by one."""
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
        """What stands between the parentheses, by parameter, and what the closing one came out of."""
        assert macro.parameters is not None
        given: list[list[Token]] = [[]]
        depth = 1
        while True:
            token = pending.pop() if pending else next(source, None)
            if token is None:
                fail(name.span, f"the call of macro {name.text} has no closing parenthesis")
            depth += {"(": 1, ")": -1}.get(token.text, 0)
            if not depth:
                break
            if token.text == "," and depth == 1:
                given.append([])
            else:
                given[-1].append(token)
        if given == [[]] and not macro.parameters:
            given = []
        if len(given) != len(macro.parameters):
            fail(name.span, f"macro {name.text} takes {len(macro.parameters)} arguments, got {len(given)}")
        return dict(zip(macro.parameters, given, strict=True)), token.hidden

    def _body(
        self, macro: Macro, arguments: Mapping[str, list[Token]], use: Token, hidden: frozenset[str]
    ) -> list[Token]:
        """A macro's body in place of its use."""
        if len(hidden) >= MAX_MACRO_DEPTH:
            fail(use.span, f"macros nest deeper than {MAX_MACRO_DEPTH}")
        hidden = hidden | {macro.name}
        if not arguments and not macro.joins:
            self._count(len(macro.body) + 1, use.span)
            return [Token(token.kind, token.text, use.span, token.spaced, hidden) for token in macro.body]
        body, made, ready = macro.body, [], {}  # type: tuple[Token, ...], list[Token], dict[str, list[Token]]
        i = 0
        while i < len(body):
            token = body[i]
            joined = made and i and body[i - 1].text == "##"
            if token.text == "##" and made and i + 1 < len(body):
                i += 1
                continue
            part = [replace(token, span=use.span)]
            if token.text in arguments and token.kind == "name":
                beside = joined or (i + 1 < len(body) and body[i + 1].text == "##")
                if beside:
                    part = arguments[token.text]
                else:
                    if token.text not in ready:
                        ready[token.text] = self._expanded(arguments[token.text], use.span)
                    part = ready[token.text]
            if joined and part:
                made[-1:] = [_glued(made[-1], part[0], use.span)]
                part = part[1:]
            made += part
            self._count(len(part) + 1, use.span)
            i += 1
        both = {frozenset[str](): hidden}  # most tokens came out of nothing, or out of the same macros
        for token in made:
            if token.hidden not in both:
                both[token.hidden] = token.hidden | hidden
        return [Token(t.kind, t.text, t.span, t.spaced, both[t.hidden]) for t in made]

    def _expanded(self, argument: list[Token], span: Span) -> list[Token]:
        """An argument whose own macros are expanded."""
        if self._depth >= MAX_MACRO_DEPTH:
            fail(span, f"macros nest deeper than {MAX_MACRO_DEPTH}")
        self._depth += 1
        found = list(self.expand(argument))
        self._depth -= 1
        return found

    def _count(self, tokens: int, span: Span) -> None:
        self.expanded += tokens
        if self.expanded > MAX_EXPANDED:
            fail(span, f"macros bring more than {MAX_EXPANDED} tokens")


def _glued(left: Token, right: Token, span: Span) -> Token:
    """``left ## right``: one token."""
    lines = list(token_lines(left.text + right.text, span.file))
    if len(lines) != 1 or len(lines[0]) != 1:
        fail(span, f"{left.text} ## {right.text} is not one word")
    return replace(lines[0][0], span=span, spaced=left.spaced, hidden=left.hidden & right.hidden)
