"""What a shader gets from outside: uniforms, which become parameters, and inputs of the stage."""

from __future__ import annotations

from typing import TYPE_CHECKING

from passgraph.language import ir
from passgraph.language.buffers import check_local
from passgraph.language.folding import constant
from passgraph.language.parse import parameter_value
from passgraph.language.signature import host_value
from passgraph.language.source import Span, fail
from passgraph.language.types import VEC2, Struct
from passgraph.language.values import COMPOSITE, Part, StructValue
from passgraph.shaders.glsl import syntax as g
from passgraph.shaders.glsl.images import position
from passgraph.shaders.glsl.typing import fitted
from passgraph.shaders.glsl.unit import Known, Slot, Uniform

if TYPE_CHECKING:
    from passgraph.shaders.glsl.body import Body


def declare_uniforms(body: Body, node: g.Declaration) -> None:
    """Uniforms of one statement."""
    for variable in node.variables:
        type_ = body.type_of(variable.type, variable.type.span, variable.value)
        uniform = Uniform(variable.name, type_, variable.span)
        if variable.value is not None:
            check_local(type_, f"what {variable.name} is set to", variable.span)
            part = fitted(body.expressions.initial(variable.value, type_), type_, variable.span, variable.name)
            uniform = Uniform(variable.name, type_, variable.span, _host(part, variable.span), True)
        _declare(body, uniform)


def declare_interface(body: Body, node: g.Interface) -> None:
    """A block of uniforms: each member is a parameter, by its own name."""
    if not node.qualifiers & {"uniform", "buffer"}:
        fail(node.span, "blocks hold uniforms here")
    uniforms = [Uniform(v.name, body.type_of(v.type, v.type.span), v.span) for v in node.fields]
    if not node.instance:
        for uniform in uniforms:
            _declare(body, uniform)
        return
    struct = Struct(node.name, tuple((u.name, u.type) for u in uniforms))
    body.unit.used.update(u.name for u in uniforms)
    for uniform in uniforms:
        body.unit.uniforms.setdefault(uniform.name, uniform)
    parts = {u.name: parameter_value(u.type, u.name, False, u.span) for u in uniforms}
    body.bind(node.instance, Known(StructValue(struct, parts), "a block of uniforms"))


def _declare(body: Body, uniform: Uniform) -> None:
    known = body.unit.uniforms.setdefault(uniform.name, uniform)
    if known is not uniform:
        if known.type != uniform.type:
            fail(uniform.span, f"uniform {uniform.name} is {known.type} already")
        return  # declared again, as by a container
    part = parameter_value(uniform.type, uniform.name, False, uniform.span)
    body.bind(uniform.name, Known(part, "a uniform"))


def _host(part: Part, span: Span) -> object:
    """A known value as the host writes it."""
    value = part if isinstance(part, COMPOSITE) else constant(part)
    if isinstance(value, ir.Literal):
        return value.value
    if isinstance(value, (ir.Construct, ir.Table)):
        return host_value(value)
    fail(span, "what a uniform is set to must be known here")


def declare_inputs(body: Body, node: g.Declaration) -> None:
    """Inputs from the vertex stage: a container's by name, else a vec2 is where the pixel lies in the picture."""
    for variable in node.variables:
        name, span, unit = variable.name, variable.span, body.unit
        type_ = body.type_of(variable.type, variable.type.span)
        if isinstance(unit.names.get(name), Slot):
            continue  # a variable of a container's prelude, which writes it
        if name in unit.values:
            part = fitted(unit.values[name](unit, span), type_, span, name)
            body.bind(name, Known(part, "an input"))
        elif type_ == VEC2:
            unit.note(
                span, f"input {name} is the position in the picture here, from (0, 0) at the bottom left to (1, 1)"
            )
            body.bind(name, Known(position(unit, span), "an input"))
        else:
            unit.missing[name] = (
                f"input {name} has no value in a pass over a picture; only vec2 ones have, the position"
            )
