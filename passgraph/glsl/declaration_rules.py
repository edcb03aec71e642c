"""Rules of declarations: names with one meaning, functions that match their prototypes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from typing import TypeAlias

from passgraph.glsl import syntax as g
from passgraph.glsl.unit import SQUARE
from passgraph.glsl.walk import is_open
from passgraph.language.source import Span, fail, place_in

#: The types of a function's parameters for comparison: by name, with the lengths of arrays.
Signature: TypeAlias = tuple[tuple[str, tuple[object, ...]], ...]


def check_declared_once(tree: Iterable[g.Outer], around: Collection[str]) -> None:
    """Raise KernelError for a name with two meanings, and for a function defined twice with the same parameters.

    ``around`` are the file names of the container's text, whose names the shader may redeclare.
    """
    own = [node for node in tree if node.span.file not in around]
    names: dict[str, tuple[str, Span]] = {}
    functions: dict[tuple[str, Signature], g.Function] = {}
    for node in own:
        if isinstance(node, g.Function):
            _check_function(node, functions)
        elif not isinstance(node, g.Declaration):
            _check_apart(node.fields)
        for name, span, what in _named(node):
            declaration = what, span  # tokens of a macro may have the same position
            first = names.setdefault(name, declaration)
            first_kind, before = first
            if first is not declaration and not (first_kind == what == "a function"):
                fail(span, f"{name} is {first_kind} already{place_in(before, span)}; give one of the two another name")


def _named(node: g.Outer) -> Iterator[tuple[str, Span, str]]:
    """Yield the names that a declaration outside of functions introduces, with their kinds, without built-in names."""
    if isinstance(node, g.Function):
        yield node.name, node.span, "a function"
    elif isinstance(node, g.Struct):
        yield node.name, node.span, "a struct"
    elif isinstance(node, g.Interface) and node.instance:
        yield node.name, node.span, "a block"
        yield node.instance, node.span, "a block"
    else:
        if isinstance(node, g.Interface):
            yield node.name, node.span, "a block"
        variables = node.fields if isinstance(node, g.Interface) else node.variables
        is_uniform = bool(node.qualifiers & {"uniform", "buffer"})
        for variable in variables:
            if not variable.name.startswith("gl_") and not is_open(variable):
                yield variable.name, variable.span, "a uniform" if is_uniform else "a variable"


def _check_function(function: g.Function, functions: dict[tuple[str, Signature], g.Function]) -> None:
    """Raise KernelError for a second body, another return type, and a duplicate parameter name."""
    if function.body is not None:
        _check_apart(one for one in function.parameters if one.name)
    key = signature_of(function)
    before = functions.setdefault(key, function)
    if _compared(before.result) != _compared(function.result):
        place = place_in(before.span, function.span)
        fail(function.span, f"{function.name} gives {before.result.name} for these parameters already{place}")
    if before is function or function.body is None:
        return
    if before.body is not None:
        place = place_in(before.span, function.span)
        fail(function.span, f"{function.name} is defined for these parameters already{place}; leave out one of the two")
    functions[key] = function


def signature_of(function: g.Function) -> tuple[str, Signature]:
    return function.name, tuple(_compared(one.type) for one in function.parameters)


def _compared(type_: g.TypeName) -> tuple[str, tuple[object, ...]]:
    """Return a type's canonical name and its array lengths; numbers and names compare as written."""
    lengths = tuple(
        n.value if isinstance(n, g.Number) else n.name if isinstance(n, g.Name) else n for n in type_.lengths
    )
    return SQUARE.get(type_.name, type_.name), lengths


def _check_apart(names: Iterable[g.Variable | g.Parameter]) -> None:
    """Raise KernelError for duplicate names of parameters or fields."""
    known: dict[str, Span] = {}
    for one in names:
        if one.name in known:
            place = place_in(known[one.name], one.span)
            fail(one.span, f"{one.name} stands here already{place}; give one of the two another name")
        known[one.name] = one.span
