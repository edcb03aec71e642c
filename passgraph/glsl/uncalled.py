"""Check functions that nothing calls: a driver refuses an error in them, too."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from passgraph.errors import KernelLengthError, UnsupportedGlslError
from passgraph.glsl import syntax as g
from passgraph.glsl.glsl_body import Body
from passgraph.glsl.places import Place
from passgraph.glsl.unit import Unit, holds_pictures
from passgraph.language.function_body import Builder
from passgraph.language.parse import parameter_value
from passgraph.language.types import Type
from passgraph.language.values import Part


def check_uncalled(tree: Iterable[g.Outer], unit: Unit) -> None:
    """Raise KernelError for an error in a function that was not lowered, except in the container's text.

    Each is lowered for arguments of unknown values, and dropped; callers first, since these lower what they call. What
    is not read here, such as cube maps, is no error in it. All together may grow as far as one kernel; what is past
    that is not checked.
    """
    own = [node for node in tree if isinstance(node, g.Function) and node.span.file not in unit.around]
    inlined, builder = set(unit.inlined), Builder("pixel")
    for function in reversed(own):
        if function.body is None or function in inlined:
            continue
        builder = Builder("pixel", emitted=builder.emitted, expressions=builder.expressions)
        try:
            _lower(function, replace(unit, builder=builder, inlined=inlined, notes={}, used=set(), counters={}, work=0))
        except (UnsupportedGlslError, KernelLengthError):
            continue


def _lower(function: g.Function, unit: Unit) -> None:
    """Lower a function for arguments of unknown values."""
    body = Body(unit)
    types = body.signature(function)
    arguments = [_argument(body, one, type_) for one, type_ in zip(function.parameters, types, strict=True)]
    body.inline(function, arguments, function.span)


def _argument(body: Body, parameter: g.Parameter, type_: Type) -> Part | Place:
    """Return an argument of unknown value, or a variable for a parameter that is written to."""
    if parameter.passed != "in" and not holds_pictures(type_):
        return Place(body.new_slot(parameter.name, type_, written=True), (), parameter.span)
    return parameter_value(type_, body.builder.fresh(parameter.name), False, parameter.span)
