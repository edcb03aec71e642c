"""Digests of kernels and of the facts of a graph: equal where what they are lowered to is."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from passgraph.language import ir
from passgraph.language.facts import Facts, ImageFacts, inner_first
from passgraph.language.scope import freeze

#: Where the name is a variable's, which says nothing of what is computed.
_OF_VARIABLES = (ir.Local, ir.Assign, ir.For)


def digest(*parts: str) -> str:
    """SHA-256 of some texts."""
    return hashlib.sha256("\0".join(parts).encode(errors="surrogatepass")).hexdigest()


def kernel_digest(program: ir.TypedKernel) -> str:
    """Of everything that decides what a kernel computes, and of where its parts stand in the text.

    Raises
    ------
    TypeError
        Where no text tells its constants from others.
    RecursionError
        Where it nests too deeply.
    """
    walk = _Walk()
    for parameter in program.parameters:
        default = freeze(parameter.default) if parameter.const and parameter.has_default else None
        walk.add(parameter.name, walk.type_text(parameter.type), parameter.const, default, parameter.range)
    walk.add(program.name, program.source, program.stage, len(program.body))
    for statement in program.body:
        walk.visit(statement)
    for result in program.results:
        walk.add(result.name, walk.type_text(result.type))
        walk.visit(result.value)
    if program.keep is not None:
        walk.add("keep")
        walk.visit(program.keep)
    return digest(*walk.text)


class _Walk:
    """Every part of a kernel, each once: a value that is used twice is named by its number."""

    def __init__(self) -> None:
        self.text: list[str] = []
        self._numbers: dict[int, int] = {}
        self._names: dict[str, int] = {}
        #: Texts of types and spans by identity: the kernel keeps them.
        self._texts: dict[int, str] = {}

    def add(self, *parts: object) -> None:
        self.text += map(repr, parts)

    def type_text(self, type_: object) -> str:
        """The text of a type, or of a span."""
        if id(type_) not in self._texts:
            self._texts[id(type_)] = repr(type_)
        return self._texts[id(type_)]

    def visit(self, node: Any) -> None:
        number = self._numbers.setdefault(id(node), len(self._numbers))
        if number < len(self._numbers) - 1:
            self.text.append(f"again {number}")
            return
        kind, text = type(node), self.text
        text += [kind.__name__, self.type_text(node.span)]
        for name in ir.SAID[kind]:
            value = getattr(node, name)
            if name == "name" and kind in _OF_VARIABLES:
                text.append(f"variable {self._names.setdefault(value, len(self._names))}")
            else:
                text.append(self.type_text(value) if name == "type" else repr(value))
        for name in ir.PARTS[kind]:
            part = getattr(node, name)
            if isinstance(part, tuple):
                text.append(f"{len(part)} parts")
                for one in part:
                    self.visit(one)
            else:
                self.visit(part)


def facts_digest(facts: Facts) -> str:
    """Of facts with all that is fused; TypeError for values that no text tells apart.

    Facts of what is fused come first, each once and as a digest of its own: text inside text would be quoted again at
    every level, and a producer that is read through two parameters digested twice at each.
    """
    digests: dict[int, str] = {}
    for each in inner_first(facts):
        constants = {name: freeze(value) for name, value in sorted(each.constants.items())}
        images = {name: _with_digests(image, digests) for name, image in sorted(each.images.items())}
        digests[id(each)] = digest(repr(replace(each, constants=constants, images=images)))
    return digests[id(facts)]


def _with_digests(image: ImageFacts, digests: Mapping[int, str]) -> ImageFacts:
    """Facts of an image in which digests stand for what is fused."""
    if image.fused is None:
        return image
    parts: Any = {"program": kernel_digest(image.fused.program), "facts": digests[id(image.fused.facts)]}
    return replace(image, fused=replace(image.fused, **parts))
