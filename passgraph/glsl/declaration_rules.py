"""Rules of declarations: names with one meaning, functions that match their prototypes.

Sources: GLSL 3.30 and ES 3.00, sections 4.3 "Storage Qualifiers" and 6.1 "Function Definitions".
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from typing import TypeAlias

from passgraph.glsl import syntax as g
from passgraph.glsl.dialect import REDECLARED, Dialect
from passgraph.glsl.unit import SQUARE
from passgraph.glsl.walk import is_open
from passgraph.language.source import Span, fail, place_in

#: The types of a function's parameters for comparison: by name, with the lengths of arrays.
Signature: TypeAlias = tuple[tuple[str, tuple[object, ...]], ...]


def check_declarations(tree: Iterable[g.Outer], around: Collection[str], dialect: Dialect) -> None:
    """Raise KernelError for declarations that contradict each other, or a built-in one.

    ``around`` are the file names of the container's text, whose names the shader may redeclare.
    """
    own = [node for node in tree if node.span.file not in around]
    names: dict[str, tuple[str, Span]] = {}
    functions: dict[tuple[str, Signature], g.Function] = {}
    long = {node.name for node in own if isinstance(node, g.Struct) and any(v.type.lengths for v in node.fields)}
    _check_conventions(own)
    for node in own:
        if isinstance(node, g.Function):
            _check_function(node, functions, dialect)
            if not dialect.has_long_results and (node.result.lengths or node.result.name in long):
                fail(node.result.span, f"{dialect.name} has no functions that return arrays, also in structs")
        elif isinstance(node, g.Declaration):
            _check_built_in(node)
        else:
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


def _check_function(function: g.Function, functions: dict[tuple[str, Signature], g.Function], dialect: Dialect) -> None:
    """Raise KernelError for a function that contradicts an earlier one, a built-in one, or itself."""
    if function.body is not None:
        _check_apart(one for one in function.parameters if one.name)
    for parameter in function.parameters:
        if None in parameter.type.lengths:
            fail(parameter.span, f"an array as a parameter has a known length, got {parameter.name}[]; write it")
    if dialect.owns_function(function.name, [one.type.name for one in function.parameters]):
        fail(function.span, f"{function.name} is a function of {dialect.name} already; choose another name")
    key = signature_of(function)
    before = functions.setdefault(key, function)
    _check_prototype(function, before, dialect)
    if _compared(before.result) != _compared(function.result):
        place = place_in(before.span, function.span)
        fail(function.span, f"{function.name} gives {before.result.name} for these parameters already{place}")
    if before is function or function.body is None:
        return
    if before.body is not None:
        place = place_in(before.span, function.span)
        fail(function.span, f"{function.name} is defined for these parameters already{place}; leave out one of the two")
    functions[key] = function


def _check_prototype(function: g.Function, before: g.Function, dialect: Dialect) -> None:
    """Raise KernelError for a function that repeats an earlier declaration otherwise, or where it may not."""
    place = place_in(before.span, function.span)
    for one, other in zip(function.parameters, before.parameters, strict=True):
        if (one.passed, one.is_const) != (other.passed, other.is_const):
            got, expected = (f"{'const ' * p.is_const}{p.passed}" for p in (one, other))
            fail(one.span, f"{function.name} takes this as {expected} already{place}, got {got}; write both alike")
    if function is not before and function.body is None and before.body is None and dialect.declares_once:
        fail(function.span, f"{function.name} is declared already{place}; {dialect.name} has one declaration of each")


def _check_built_in(node: g.Declaration) -> None:
    """Raise KernelError for a built-in variable that is declared again as something else (section 7)."""
    for one in node.variables:
        type_, qualifiers = REDECLARED.get(one.name, ("", frozenset[str]()))
        if type_ and (one.type.name != type_ or not node.qualifiers & qualifiers):
            got = " ".join([*sorted(node.qualifiers), one.type.name])
            what = f"{one.name} is built in as {' or '.join(sorted(qualifiers))} {type_}"
            fail(one.span, f"{what}, got {got}; declare it so, or not at all")


def _check_conventions(own: Iterable[g.Outer]) -> None:
    """Raise KernelError for two conventions of ``gl_FragCoord`` (section 4.3.8.1)."""
    layouts = [
        (node.layout.keys(), one.span)
        for node in own
        if isinstance(node, g.Declaration)
        for one in node.variables
        if one.name == "gl_FragCoord"
    ]
    for layout, span in layouts[1:]:
        if layout != layouts[0][0]:
            got, expected = (" ".join(sorted(keys)) or "no layout" for keys in (layout, layouts[0][0]))
            fail(
                span, f"gl_FragCoord has {expected} already{place_in(layouts[0][1], span)}, got {got}; write both alike"
            )


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
