"""What kernels that differ in their numbers only have in common, as text that tells it from every other."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from passgraph.language import ir
from passgraph.language.literals import is_own
from passgraph.language.scope import freeze
from passgraph.language.source import Span
from passgraph.language.types import FLOAT

#: Where the name is a variable's, which says nothing of what is computed.
_OF_VARIABLES = (ir.Local, ir.Assign, ir.For)


@dataclass(frozen=True)
class Shape:
    """A kernel's own numbers, and the rest.

    Attributes
    ----------
    told : of everything else that decides what it computes
    literals : its own float literals, each once, in the order in which they are met
    spans : where the parts stand in the text, in the order in which they are met
    """

    told: str
    literals: tuple[float, ...]
    spans: tuple[Span, ...]


def shape_of(program: ir.TypedKernel) -> Shape:
    """The shape of a kernel.

    Raises
    ------
    TypeError
        Where no text tells its constants from others.
    RecursionError
        Where it nests too deeply.
    """
    found = _Walk()
    for parameter in program.parameters:
        default = freeze(parameter.default) if parameter.const and parameter.has_default else None
        found.say(parameter.name, _typed(parameter.type), parameter.const, default, parameter.range)
    found.say(program.stage, len(program.body))
    for statement in program.body:
        found.node(statement)
    for result in program.results:
        found.say(result.name, _typed(result.type))
        found.node(result.value)
    if program.keep is not None:
        found.say("keep")
        found.node(program.keep)
    told = hashlib.sha256("\0".join(found.text).encode(errors="surrogatepass")).hexdigest()
    return Shape(told, tuple(found.literals), (program.source, *found.spans))


class _Walk:
    """Every part of a kernel, each once: a value that is used twice is named by its number."""

    def __init__(self) -> None:
        self.text: list[str] = []
        self.literals: dict[float, int] = {}
        self.spans: list[Span] = []
        self.met: dict[int, int] = {}
        self.names: dict[str, int] = {}

    def say(self, *told: object) -> None:
        self.text += map(repr, told)

    def node(self, node: Any) -> None:
        number = self.met.setdefault(id(node), len(self.met))
        if number < len(self.met) - 1:
            self.text.append(f"again {number}")
            return
        kind, text = type(node), self.text
        self.spans.append(node.span)
        text.append(kind.__name__)
        if kind is ir.Literal and node.type is FLOAT and is_own(node.value):
            text.append(f"#{self.literals.setdefault(float(node.value), len(self.literals))}")
            return
        for name in ir.SAID[kind]:
            said = getattr(node, name)
            if name == "name" and kind in _OF_VARIABLES:
                text.append(f"variable {self.names.setdefault(said, len(self.names))}")
            else:
                text.append(_typed(said) if name == "type" else repr(said))
        for name in ir.PARTS[kind]:
            part = getattr(node, name)
            if isinstance(part, tuple):
                text.append(f"{len(part)} parts")
                for one in part:
                    self.node(one)
            else:
                self.node(part)


@lru_cache(maxsize=256)
def _typed(type_: object) -> str:
    return repr(type_)
