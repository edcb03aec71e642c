"""Parse a whole shader's text to a kernel."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from passgraph.errors import KernelError
from passgraph.glsl import syntax as g
from passgraph.glsl.builtins import overloads
from passgraph.glsl.declaration_rules import Signature, check_declarations, signature_of
from passgraph.glsl.glsl_body import Body
from passgraph.glsl.glsl_parser import Parser
from passgraph.glsl.host_declarations import declare_inputs, declare_interface, declare_uniforms, uniform_names
from passgraph.glsl.name_rules import check_names
from passgraph.glsl.operators import type_of_part
from passgraph.glsl.preprocess import preprocessed
from passgraph.glsl.stage_values import DEPTH_RANGE
from passgraph.glsl.uncalled import check_uncalled
from passgraph.glsl.unit import BEFORE, END, Note, Slot, Uniform, Unit, holds_pictures
from passgraph.glsl.walk import assigned_names
from passgraph.language import ir
from passgraph.language.assignments import Place, Variable
from passgraph.language.function_body import KEPT
from passgraph.language.long_arrays import check_reads, check_sizes
from passgraph.language.signature import check_images
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    BOOL,
    FLOAT,
    VEC4,
    Scalar,
    Vector,
    element_of,
)
from passgraph.language.values import Part

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
    written, names = assigned_names(tree, partial(overloads, body.unit)), uniform_names(tree)
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
