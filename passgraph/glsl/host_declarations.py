"""What a shader declares outside of functions and does not compute: uniforms, blocks of them, and inputs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

from passgraph.glsl import syntax as g
from passgraph.glsl.operators import fitted, type_of_part
from passgraph.glsl.stage_values import STAGE, TEXTURE_COORDINATES, fragment, position, texture_coordinates
from passgraph.glsl.unit import Known, Slot, Uniform, holds_pictures
from passgraph.glsl.walk import sides_written
from passgraph.language import ir
from passgraph.language.assignments import read_variable
from passgraph.language.composites import entry
from passgraph.language.long_arrays import check_local
from passgraph.language.parse import parameter_value
from passgraph.language.signature import check_parts, host_value
from passgraph.language.source import Span, fail
from passgraph.language.types import INT, VEC2, VEC4, Array, Struct, Type, Vector, part_count
from passgraph.language.values import COMPOSITE, ArrayValue, Part, StructValue, constant, swizzle

if TYPE_CHECKING:
    from passgraph.glsl.glsl_body import Body
    from passgraph.language.values import Parts


def declare_uniforms(body: Body, node: g.Declaration) -> None:
    """Declare the uniforms of a statement."""
    for variable in node.variables:
        sides = sides_written(variable.value) or body.unit.open_length(variable)
        type_ = body.type_of(variable.type, variable.type.span, sides)
        if variable.name in body.unit.values and variable.span.file not in body.unit.around:
            _declare_host_value(body, variable, type_)
            continue
        if holds_pictures(type_):
            body.unit.samplers.setdefault(variable.name, variable.type.name)
        uniform = Uniform(variable.name, type_, variable.span)
        if variable.value is not None:
            check_local(type_, f"what {variable.name} is set to", variable.span)
            part = fitted(body.expressions.initial(variable.value, type_), type_, variable.span, variable.name)
            uniform = Uniform(variable.name, type_, variable.span, _host(part, variable.span), True)
        _declare(body, uniform)


def _declare_host_value(body: Body, variable: g.Variable, type_: Type) -> None:
    """Declare a uniform that the host sets: of its type, or a vector of its first components."""
    name, span = variable.name, variable.span
    part = body.expressions.part(body.unit.values[name])
    given = type_of_part(part)
    if isinstance(given, Vector) and isinstance(type_, Vector) and type_.size < given.size:
        part = swizzle(cast("ir.Expr", part), "xyzw"[: type_.size], span)
    elif given != type_:
        fail(span, f"uniform {name} is {given} in this format, got {type_}; give it that type, or another name")
    body.bind(name, Known(fitted(part, type_, span, name), "a value of the host"))


def declare_interface(body: Body, node: g.Interface, names: Counter[str]) -> None:
    """Declare a uniform block: each member becomes a parameter.

    Members of a block with an instance name have a scope of their own (GLSL 3.30, section 4.3.7). Their parameters are
    named like them, or with the instance's name before if several uniforms of the shader, counted in ``names``, have
    the member's.
    """
    if not node.qualifiers & {"uniform", "buffer"}:
        fail(node.span, "blocks hold uniforms here")
    for v in node.fields:
        if holds_pictures(body.type_of(v.type, v.type.span)):
            fail(v.span, f"a block of uniforms cannot hold a sampler, got {v.name}; declare it outside")
    if not node.instance:
        for v in node.fields:
            _declare(body, Uniform(v.name, body.type_of(v.type, v.type.span), v.span))
        return
    members = {v.name: (body.type_of(v.type, v.type.span), v.span) for v in node.fields}
    block = Struct(node.name, tuple((name, type_) for name, (type_, _) in members.items()))
    block_type = body.array_of(block, node.lengths, node.span)
    parts: dict[str, Part] = {}
    for name, (type_, span) in members.items():
        parameter = name if names[name] == 1 else f"{node.instance}_{name}"
        while names[parameter] > (parameter == name):
            parameter = f"{node.instance}_{parameter}"
        names[parameter] += parameter != name
        uniform = Uniform(parameter, body.array_of(type_, node.lengths, span), span)
        body.unit.uniforms[parameter] = uniform
        _count_parts(body, uniform)
        body.unit.used.add(parameter)
        parts[name] = parameter_value(uniform.type, parameter, False, span)
    if isinstance(block_type, Array):
        entries = {name: part.parts if isinstance(part, ArrayValue) else part for name, part in parts.items()}
        value: Part = ArrayValue(block_type, cast("Parts", entries))
    else:
        value = StructValue(block, parts)
    body.bind(node.instance, Known(value, "a block of uniforms"))


def uniform_names(tree: Iterable[g.Outer]) -> Counter[str]:
    """Count the uniforms of each name, including members of blocks; several declarations of one count once."""
    plain, members = set[str](), Counter[str]()
    for node in tree:
        if isinstance(node, g.Interface) and node.instance:
            members.update(variable.name for variable in node.fields)
        elif isinstance(node, g.Interface):
            plain.update(variable.name for variable in node.fields)
        elif isinstance(node, g.Declaration) and "uniform" in node.qualifiers:
            plain.update(variable.name for variable in node.variables)
    return members + Counter(plain)


def _declare(body: Body, uniform: Uniform) -> None:
    declared = body.unit.uniforms.setdefault(uniform.name, uniform)
    if declared is not uniform:
        if declared.type != uniform.type:
            fail(uniform.span, f"uniform {uniform.name} is {declared.type} already")
        return  # already declared, such as by a container
    _count_parts(body, uniform)
    part = parameter_value(uniform.type, uniform.name, False, uniform.span)
    body.bind(uniform.name, Known(part, "a uniform"))


def _count_parts(body: Body, uniform: Uniform) -> None:
    body.unit.parts += part_count(uniform.type)
    check_parts(body.unit.parts, "the uniforms", uniform.span)


def _host(part: Part, span: Span) -> object:
    """Return a known value in the host's representation: structs as objects with attributes, their arrays as lists."""
    if isinstance(part, StructValue):
        return SimpleNamespace(**{name: _host(value, span) for name, value in part.fields.items()})
    if isinstance(part, ArrayValue):
        at = [ir.Literal(INT, i, span) for i in range(part.type.length)]
        return [_host(entry(part, i, span, lambda value, _: value), span) for i in at]
    value = part if isinstance(part, COMPOSITE) else constant(part)
    if isinstance(value, ir.Literal):
        return value.value
    if isinstance(value, (ir.Construct, ir.Table)):
        return host_value(value)
    fail(span, "what a uniform is set to must be known here")


def declare_inputs(body: Body, node: g.Declaration) -> None:
    """Declare inputs from the vertex stage: a container's by name; else a vec2 is the position in the picture."""
    for variable in node.variables:
        name, span, unit = variable.name, variable.span, body.unit
        open_length = (TEXTURE_COORDINATES,) if name == "gl_TexCoord" else ()
        type_ = body.type_of(variable.type, variable.type.span, open_length)
        handed = unit.names.get(name)
        if name == "gl_FragCoord":
            part = fragment(unit, span, "origin_upper_left" in node.layout, "pixel_center_integer" in node.layout)
            if isinstance(handed, Slot):  # depth and w come from a vertex stage, whatever the origin is
                place, rest = cast("ir.Expr", part), cast("ir.Expr", read_variable(handed.variable, span))
                part = ir.Construct(VEC4, (swizzle(place, "xy", span), swizzle(rest, "zw", span)), span)
            body.bind(name, Known(fitted(part, type_, span, name), "an input"))
        elif isinstance(handed, Slot):  # a variable that a container's prelude writes
            if handed.variable.type != type_ and not name.startswith("gl_"):
                fail(span, f"input {name} is {type_} here, and {handed.variable.type} in the vertex shader")
        elif name == "gl_TexCoord" and isinstance(type_, Array) and type_.length <= TEXTURE_COORDINATES:
            part = texture_coordinates(unit, span, type_.length)
            body.bind(name, Known(fitted(part, type_, span, name), "an input"))
        elif name in STAGE:
            part = fitted(STAGE[name](unit, span), type_, span, name)
            body.bind(name, Known(part, "an input"))
        elif unit.has_vertex_stage:
            unit.missing[name] = f"input {name} is no output of the vertex shader"
        elif type_ == VEC2:
            unit.note(
                span, f"input {name} is the position in the picture here, from (0, 0) at the bottom left to (1, 1)"
            )
            body.bind(name, Known(position(unit, span), "an input"))
        else:
            unit.missing[name] = (
                f"input {name} has no value in a pass over a picture; only vec2 ones have, the position"
            )
