"""A name stands for one thing, outside of functions, among parameters and among fields, as GLSL asks for."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from typing import TypeAlias

from passgraph.language.source import Span, fail
from passgraph.shaders.glsl import syntax as g
from passgraph.shaders.glsl.unit import SQUARE

#: The types of a function's parameters as they are compared: by name, with the lengths of arrays.
_Signature: TypeAlias = tuple[tuple[str, tuple[object, ...]], ...]


def check_declared_once(tree: Iterable[g.Outer], around: Collection[str]) -> None:
    """Refuse a name that stands for two things, and a function that is defined twice for the same parameters.

    ``around``: what is called the container's text, whose names the shader may declare anew.
    """
    own = [node for node in tree if node.span.file not in around]
    names: dict[str, tuple[str, Span]] = {}
    functions: dict[tuple[str, _Signature], g.Function] = {}
    for node in own:
        if isinstance(node, g.Function):
            _check_function(node, functions)
        elif not isinstance(node, g.Declaration):
            _check_apart(node.fields)
        for name, span, what in _named(node):
            found = what, span  # what a macro brings may have one place
            first = names.setdefault(name, found)
            known, before = first
            if first is not found and not (known == what == "a function"):
                fail(span, f"{name} is {known} already{_place(before, span)}; give one of the two another name")


def _named(node: g.Outer) -> Iterator[tuple[str, Span, str]]:
    """The names that something outside of functions declares there, and what they are; not those of GLSL's own."""
    if isinstance(node, g.Function):
        yield node.name, node.span, "a function"
    elif isinstance(node, g.Struct):
        yield node.name, node.span, "a struct"
    elif isinstance(node, g.Interface) and node.instance:
        yield node.instance, node.span, "a block"
    else:
        variables = node.fields if isinstance(node, g.Interface) else node.variables
        is_uniform = bool(node.qualifiers & {"uniform", "buffer"})
        for variable in variables:
            if not variable.name.startswith("gl_"):
                yield variable.name, variable.span, "a uniform" if is_uniform else "a variable"


def _check_function(function: g.Function, known: dict[tuple[str, _Signature], g.Function]) -> None:
    """Refuse a second body, another type of result, and a parameter of a name that another one has."""
    if function.body is not None:
        _check_apart(one for one in function.parameters if one.name)
    key = function.name, tuple(_compared(one.type) for one in function.parameters)
    before = known.setdefault(key, function)
    if _compared(before.result) != _compared(function.result):
        place = _place(before.span, function.span)
        fail(function.span, f"{function.name} gives {before.result.name} for these parameters already{place}")
    if before is function or function.body is None:
        return
    if before.body is not None:
        place = _place(before.span, function.span)
        fail(function.span, f"{function.name} is defined for these parameters already{place}; leave out one of the two")
    known[key] = function


def _compared(type_: g.TypeName) -> tuple[str, tuple[object, ...]]:
    """A type by its one name; of lengths, those that are numbers or names are alike where they are written alike."""
    lengths = tuple(
        n.value if isinstance(n, g.Number) else n.name if isinstance(n, g.Name) else n for n in type_.lengths
    )
    return SQUARE.get(type_.name, type_.name), lengths


def _check_apart(names: Iterable[g.Variable | g.Parameter]) -> None:
    """Refuse a name that parameters or fields have twice."""
    known: dict[str, Span] = {}
    for one in names:
        if one.name in known:
            place = _place(known[one.name], one.span)
            fail(one.span, f"{one.name} stands here already{place}; give one of the two another name")
        known[one.name] = one.span


def _place(before: Span, span: Span) -> str:
    """Where the first of two stands."""
    if before.file != span.file:
        return f" ({before.file}:{before.line})"
    return "" if before.line == span.line else f" (line {before.line})"
