"""Parse a whole shader's text to a kernel."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

from passgraph.errors import KernelError
from passgraph.glsl import syntax as g
from passgraph.glsl.builtins import overloads
from passgraph.glsl.declaration_rules import Signature, check_declarations, signature_of
from passgraph.glsl.glsl_body import Body
from passgraph.glsl.glsl_parser import Parser
from passgraph.glsl.name_rules import check_names
from passgraph.glsl.operators import fitted, type_of_part
from passgraph.glsl.preprocess import preprocessed
from passgraph.glsl.stage_values import DEPTH_RANGE, STAGE, TEXTURE_COORDINATES, fragment, position, texture_coordinates
from passgraph.glsl.uncalled import check_uncalled
from passgraph.glsl.unit import BEFORE, END, Known, Note, Slot, Uniform, Unit, holds_pictures
from passgraph.glsl.walk import assigned_names, sides_written
from passgraph.language import ir
from passgraph.language.assignments import Place, Variable, read_variable
from passgraph.language.composites import entry
from passgraph.language.function_body import KEPT
from passgraph.language.long_arrays import check_local, check_reads, check_sizes
from passgraph.language.parse import parameter_value
from passgraph.language.signature import check_images, check_parts, host_value
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    BOOL,
    FLOAT,
    INT,
    VEC2,
    VEC4,
    Array,
    Scalar,
    Struct,
    Type,
    Vector,
    element_of,
    part_count,
)
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


def _uniform_names(tree: Iterable[g.Outer]) -> Counter[str]:
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


#: File names in errors in the texts of a container.
PRELUDE, POSTLUDE = "<prelude>", "<postlude>"


@dataclass(frozen=True)
class ShaderText:
    """The texts and settings that a fragment shader is parsed from.

    Attributes
    ----------
    text : GLSL ES 1.00 or 3.00, or desktop GLSL from 1.20 on, at most 500,000 characters
    name : the kernel's name
    file : the file name in errors
    entry : the function to run; it is void and writes outputs, or returns the only output
    prelude, postlude : GLSL before and after the text, such as a container's declarations; uniforms there become
        parameters if they are used
    prelude_file : the file name in errors in the prelude
    defines : macros by name
    values : values of the host by name, each a GLSL expression of the prelude's names; the text may use such a name
        for something else, or declare a uniform of it
    rows_up : True if the shader counts rows of pictures from the bottom, as in OpenGL; False for the top
    included : the text of each included file, by its path
    has_vertex_stage : True if the prelude runs a vertex shader, whose outputs are the inputs of the text
    """

    text: str
    name: str = "shader"
    file: str = "<shader>"
    entry: str = "main"
    prelude: str = ""
    prelude_file: str = PRELUDE
    postlude: str = ""
    defines: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, str] = field(default_factory=dict)
    rows_up: bool = True
    included: Mapping[str, str] = field(default_factory=dict)
    has_vertex_stage: bool = False


@dataclass(frozen=True)
class Shader:
    """A parsed shader.

    Attributes
    ----------
    program : its typed representation, as of any kernel
    uniforms : its parameters with their declarations
    notes : parts that depend on the driver, each with its line
    source : the texts that it was parsed from, with included files
    version : the number of ``#version``; 0 without one
    extensions : names of ``#extension``
    token_count : number of parsed tokens, after macro expansion
    leveled : returns its representation for pictures with mipmaps, whose levels derivatives select
    """

    program: ir.TypedKernel
    uniforms: tuple[Uniform, ...]
    notes: tuple[Note, ...]
    source: ShaderText
    version: int = 0
    extensions: tuple[str, ...] = ()
    token_count: int = 0
    leveled: Callable[[frozenset[str]], ir.TypedKernel] = field(kw_only=True, repr=False, compare=False)


def parse(text: str, *, folder: str | Path | None = None, levels: Collection[str] = (), **settings: Any) -> Shader:
    """Parse a fragment shader to a kernel.

    Parameters
    ----------
    text : the shader's text
    folder : folder for ``#include``
    levels : pictures with mipmaps (handles with ``mipmaps()``), whose level ``texture`` selects by derivatives
    settings : the other attributes of :class:`ShaderText`

    Raises
    ------
    KernelError
        For invalid or unsupported GLSL, with file, line, the source line and a caret.

    Examples
    --------
    >>> shader = parse("uniform sampler2D t; void main() { gl_FragColor = 1.0 - texture2D(t, pg_position); }")
    >>> [f"{p.name}: {p.type}" for p in shader.program.parameters]
    ['t: Image']
    """
    return parse_shader(ShaderText(text, **settings), None if folder is None else Path(folder), frozenset(levels))


def parse_shader(source: ShaderText, folder: Path | None = None, levels: frozenset[str] = frozenset()) -> Shader:
    """Parse like :func:`parse`; without a folder, only files in ``source`` are included."""
    file = source.file
    around = frozenset([source.prelude_file, POSTLUDE])
    unit = Unit(source.rows_up, levels, around, source.has_vertex_stage)
    unit.values = {name: _expression(text, source.prelude_file) for name, text in source.values.items()}
    pieces = [(source.prelude, source.prelude_file), (source.text, file), (source.postlude, POSTLUDE)]
    try:
        tokens, reader = preprocessed(pieces, source.defines, folder, source.included, around)
        for token in [t for t in tokens if t.text in ("lowp", "mediump")][:1]:
            unit.note(token.span, f"{token.text} has 32 bits here, and fewer on some devices")
        unit.dialect = reader.dialect
        unit.tree = tuple(Parser(tokens, file, unit.dialect).shader())
        program, uniforms = _program(unit.tree, unit, source)
    except RecursionError:
        raise KernelError(f"{file}: the shader nests too deeply") from None
    notes = tuple(sorted(unit.notes.values(), key=lambda note: (note.span.file, note.span.line)))
    read = replace(source, included=reader.included)

    @cache
    def leveled(names: frozenset[str]) -> ir.TypedKernel:
        return parse_shader(read, None, names).program

    return Shader(
        program, uniforms, notes, read, reader.version, tuple(reader.extensions), len(tokens), leveled=leveled
    )


def _expression(text: str, file: str) -> g.Expr:
    tokens, _ = preprocessed([(text, file)], {}, None)
    return Parser(tokens, file).expression()


def _program(tree: tuple[g.Outer, ...], unit: Unit, source: ShaderText) -> tuple[ir.TypedKernel, tuple[Uniform, ...]]:
    """Return the typed kernel, and its parameters with their declarations."""
    check_declarations(tree, unit.around, unit.dialect)
    name, entry = source.name, source.entry
    body = Body(unit, name)
    unit.builder.calls.append(tree)  # the declarations outside of functions are the outermost call
    unit.builder.emit(ir.Assign(KEPT, ir.Literal(BOOL, True)))
    first: dict[tuple[str, Signature], int] = {}
    for place, node in enumerate(tree):
        if isinstance(node, g.Function):
            unit.functions.setdefault(node.name, []).append(node)
            unit.defined_at[node] = place
            unit.declared_at[node] = first.setdefault(signature_of(node), place)
    outputs = _declared(tree, body)
    main = next((f for f in unit.functions.get(entry, []) if f.body is not None and not f.parameters), None)
    if main is None:
        raise KernelError(f"{source.file}: there is no function {entry}() without parameters, where a shader begins")
    value = body.inline(main, [], main.span)
    check_names(tree, unit)
    check_uncalled(tree, unit)
    declared_outputs = _outputs(body, value, outputs, main.span)
    unit.builder.keep_or_clear(Variable(FLOAT, "", dict(declared_outputs)), main.span)
    results = _results(declared_outputs, main.span)
    uniforms = _parameters(unit)
    parameters = tuple(ir.Parameter(u.name, u.type, False, u.default, u.has_default, u.span) for u in uniforms)
    check_images(name, parameters, main.span)
    check_sizes(parameters)
    statements = unit.builder.body()
    check_reads(parameters, *statements)
    return ir.TypedKernel(name, "pixel", parameters, statements, results, None, main.span), uniforms


def _declared(tree: tuple[g.Outer, ...], body: Body) -> list[tuple[str, Slot]]:
    """Execute the declarations outside of functions; return the declared outputs, in the order of their locations."""
    outputs: list[tuple[int, str, Slot]] = []
    body.place = BEFORE
    for name in ("gl_FragColor", *(f"gl_FragData[{i}]" for i in range(8))):
        slot = body.new_slot(name, VEC4, written=True)
        body.builder.clear(slot.variable)
        body.bind(name, slot)
    body.bind(DEPTH_RANGE.name, DEPTH_RANGE)
    depth = body.new_slot("gl_FragDepth", FLOAT, written=True)
    body.builder.clear(depth.variable)
    body.bind("gl_FragDepth", depth)  # ignored, since a pass over a picture has no depth
    written, names = assigned_names(tree, partial(overloads, body.unit)), _uniform_names(tree)
    for body.place, node in enumerate(tree):
        if isinstance(node, g.Struct):
            body.declare_struct(node)
        elif isinstance(node, g.Interface):
            declare_interface(body, node, names)
        elif isinstance(node, g.Declaration):
            if "uniform" in node.qualifiers:
                declare_uniforms(body, node)
            elif node.qualifiers & {"in", "varying", "attribute"}:
                declare_inputs(body, node)
            else:
                body.declare(node, None if "out" in node.qualifiers else written)
                if "out" in node.qualifiers:
                    for variable in node.variables:
                        output = body.unit.names[variable.name]
                        assert isinstance(output, Slot)
                        output.written = True
                        outputs.append((node.layout.get("location", 0), variable.name, output))
    body.place = END
    return [(name, slot) for _, name, slot in sorted(outputs, key=lambda output: output[0])]


def _outputs(
    body: Body, value: Part | None, declared: list[tuple[str, Slot]], span: Span
) -> list[tuple[str, Variable]]:
    """Return the result variables: the entry's value, declared outputs, or the built-in outputs that are used."""
    unit = body.unit
    if value is not None:
        type_ = type_of_part(value)
        assert type_ is not None
        slot = body.new_slot("value", type_, written=True)
        unit.store_at(slot, Place(slot.variable, type_), value, span, "the value")
        return [("", slot.variable)]
    slots = declared or [
        (name, slot)
        for name, slot in unit.names.items()
        if name.startswith(("gl_FragColor", "gl_FragData")) and name in unit.used and isinstance(slot, Slot)
    ]
    if not slots:
        fail(span, "the shader writes nothing: gl_FragColor, or a variable declared out vec4 name")
    return [(name if len(slots) > 1 else "", slot.variable) for name, slot in slots]


def _results(outputs: list[tuple[str, Variable]], span: Span) -> tuple[ir.Result, ...]:
    results = []
    for name, variable in outputs:
        type_ = variable.type
        if not isinstance(type_, (Scalar, Vector)) or element_of(type_) is not FLOAT:
            fail(span, f"an output is a float or a vector of floats, as targets hold; {name or 'it'} is {type_}")
        plain = name.replace("[", "").replace("]", "")
        results.append(ir.Result(plain, type_, ir.Local(type_, variable.name, span)))
    return tuple(results)


def _parameters(unit: Unit) -> tuple[Uniform, ...]:
    """Return samplers first, then other uniforms in the order of the text; those of a prelude only if they are used."""
    used_uniforms = [u for u in unit.uniforms.values() if u.span.file not in unit.around or u.name in unit.used]
    return tuple(sorted(used_uniforms, key=lambda u: not holds_pictures(u.type)))
