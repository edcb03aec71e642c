"""Plain fragment shaders, perhaps with a vertex shader, and the uniforms that viewers such as glslViewer set
(patriciogonzalezvivo/glslViewer)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from passgraph.errors import InputError
from passgraph.glsl import Shader, parse
from passgraph.glsl.preprocess import preprocessed
from passgraph.glsl.shader import PRELUDE as PRELUDE_FILE
from passgraph.glsl.unit import Note
from passgraph.graph.calls import PixelKernel
from passgraph.graph.targets import Target, TargetSpec
from passgraph.language.source import Span
from passgraph.language.types import Matrix
from passgraph.shaders.containers.clock import PRELUDE, SECONDS, clock_parameters, clock_uniforms
from passgraph.shaders.containers.effect import (
    ShaderEffect,
    ShaderParameter,
    name_of,
    shader_text,
    uniforms_of,
    without_comments,
)
from passgraph.shaders.containers.shader_images import handle_or_black
from passgraph.shaders.containers.vertex_stage import vertex_stage
from passgraph.shaders.containers.viewer_inputs import vertex_file, viewer_inputs

#: Uniforms of viewers: their types, their values, and what notes say of them.
_VALUES: Mapping[str, tuple[tuple[str, ...], str, str]] = {
    "u_resolution": (("vec2", "vec3"), "vec3(pg_output_size, 1.0)", "the size of the result in pixels"),
    "u_time": (("float",), SECONDS, "the time of the frame: time and time_step are its parameters"),
    "u_delta": (("float",), "pg_step", "the seconds from frame to frame: the parameter time_step"),
    "u_frame": (("int",), "pg_frame", "the number of the frame"),
    "u_date": (("vec4",), "pg_date", "the date: the parameter date"),
}
_DECLARED = re.compile(r"\buniform\s+(?:(?:low|medium|high)p\s+)?(\w+)\s+(u_\w+)\s*;")
_SIZE_OF = re.compile(r"(u_\w+)Resolution")


def read_plain(text: str, path: Path) -> ShaderEffect:
    """Read a plain fragment shader: its samplers are pictures, and its other uniforms parameters, but for those that
    viewers set. A vertex shader that lies beside it runs at the corners of the picture.

    Raises
    ------
    InputError
        For several outputs.
    KernelError
        For an unsupported shader, with file, line and caret.
    """
    found = list(_viewer_values(text, path))
    values = {name: value for name, value, _ in found}
    vertex = vertex_file(path)
    prelude, guesses = PRELUDE.replace("\n", " "), list[Note]()
    if vertex is not None:
        prelude += _vertex_prelude(shader_text(vertex, "a vertex shader"), vertex, guesses)
    shader = parse(
        text, name=name_of(path), file=str(path), folder=path.parent, prelude=prelude, values=values,
        prelude_file=PRELUDE_FILE if vertex is None else str(vertex), has_vertex_stage=vertex is not None,
    )  # fmt: skip
    kernel = PixelKernel[Target].of_shader(shader)
    if len(shader.program.results) > 1:
        raise InputError(
            f"{path}: has {len(shader.program.results)} outputs, and an effect makes one picture; leave one output, or "
            "write all of them with pg.kernel(glsl=...), which takes as many targets: into=(pg.target(...), ...)"
        )
    images, parameters = uniforms_of(shader)
    if vertex is not None:
        parameters |= dict(_matrices(shader, parameters, guesses))
    used = [name for name in parameters if name in ("pg_start", "pg_step", "pg_date", "pg_frame")]
    own = {name: parameter for name, parameter in parameters.items() if name not in used}
    notes = (*shader.notes, *(note for _, _, note in found), *guesses)
    notes = tuple(sorted(notes, key=lambda note: (note.span.file != str(path), note.span.line)))

    def build(pictures: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec) -> Target:
        given: dict[str, Any] = {name: handle_or_black(pictures.get(name)) for name in images}
        given |= {name: value for name, value in values.items() if name in own}
        given |= {name: value for name, value in clock_uniforms(values, own).items() if name in used}
        return kernel.called(given, into)

    summary = f"{path.stem}: a fragment shader"
    return ShaderEffect(
        name_of(path), "GLSL", summary, "", tuple(images), clock_parameters(used, own) | own, notes, str(path), build
    )


def _vertex_prelude(text: str, path: Path, notes: list[Note]) -> str:
    """Return GLSL, on one line with the first of the text, that runs a vertex shader."""
    tokens, reader = preprocessed([(text, str(path))], {}, path.parent)
    found = list(_viewer_values(text, path))
    types = {match[2]: match[1] for match in _DECLARED.finditer(without_comments(text))}
    values = {name: (types[name], f"{types[name]}({value})") for name, value, _ in found}
    notes += [note for _, _, note in found]
    inputs = viewer_inputs(values, notes)
    return vertex_stage(tokens, str(path), inputs, reader.dialect).text


def _matrices(
    shader: Shader, parameters: Mapping[str, ShaderParameter], notes: list[Note]
) -> Iterator[tuple[str, ShaderParameter]]:
    """Yield the square matrices without a value as identities, which leave the picture where it is."""
    for uniform in shader.uniforms:
        type_ = uniform.type
        if isinstance(type_, Matrix) and type_.columns == type_.rows and not uniform.has_default:
            identity = tuple(float(c == r) for c in range(type_.columns) for r in range(type_.rows))
            notes.append(Note(uniform.span, f"{uniform.name} is the identity unless it is set, so nothing moves"))
            yield uniform.name, replace(parameters[uniform.name], default=identity)


def _viewer_values(text: str, path: Path) -> Iterator[tuple[str, str, Note]]:
    """Yield the uniforms of a text that viewers set: name, value as GLSL, and a note."""
    plain = without_comments(text)
    lines = text.split("\n")
    declared = {match[2]: match for match in _DECLARED.finditer(plain)}
    for name, match in declared.items():
        size_of = _SIZE_OF.fullmatch(name)
        if size_of is not None and match[1] == "vec2" and declared.get(size_of[1], ("", ""))[1] == "sampler2D":
            value, meaning = f"vec2(textureSize({size_of[1]}, 0))", f"the size of {size_of[1]}"
        elif name in _VALUES and match[1] in _VALUES[name][0]:
            _, value, meaning = _VALUES[name]
        else:
            continue
        row, start = plain.count("\n", 0, match.start(2)), match.start(2)
        column = start - (plain.rfind("\n", 0, start) + 1)
        span = Span(str(path), row + 1, column, column + len(name), lines[row])
        yield name, value, Note(span, f"{name} is {meaning}, as in glslViewer")
