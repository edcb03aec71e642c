"""gl-transitions: a transition between two pictures, by its progress (gl-transitions.com, specification 1)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from passgraph.glsl import parse
from passgraph.graph.calls import PixelKernel
from passgraph.graph.targets import Target, TargetSpec
from passgraph.language.types import FLOAT
from passgraph.shaders.containers.effect import ShaderEffect, ShaderParameter, name_of, uniforms_of
from passgraph.shaders.containers.shader_images import handle_or_black

_BEFORE = """
uniform sampler2D pg_from;
uniform sampler2D pg_to;
uniform float progress;
float ratio = pg_output_size.x / pg_output_size.y;
vec4 getFromColor(vec2 uv) { return texture2D(pg_from, uv); }
vec4 getToColor(vec2 uv) { return texture2D(pg_to, uv); }
"""
_BEHIND = "void pg_main() { gl_FragColor = transition(pg_position); }"
#: A default in a comment after the declaration, ``uniform float size; // = 0.1``, perhaps with a further comment.
_DEFAULT = re.compile(r"^(\s*uniform\s[^;/]*);(\s*)//(\s*=[^;\n]*)(?:;[ \t]*(?://.*)?)?$", re.MULTILINE)
#: A default in a comment inside the declaration, ``uniform int steps /* = 50 */;``.
_DEFAULT_WITHIN = re.compile(r"^(\s*uniform\s[^;/]*)/\*(\s*=(?:(?!\*/)[^;\n])*)\*/([ \t]*;)", re.MULTILINE)
_PICTURES = {"from": "pg_from", "to": "pg_to"}


def is_transition(text: str) -> bool:
    """Return True if a text has the function of a gl-transition."""
    return re.search(r"\bvec4\s+transition\s*\(", text) is not None


def _default(declaration: str, value: str) -> str:
    """Return a default in GLSL; for bools, files also write 1 or 0."""
    if re.search(r"\bbool\b", declaration) is None:
        return value
    return re.sub(r"^\s*=\s*([01])\s*$", lambda m: f"= {('false', 'true')[int(m[1])]}", value)


def read_transition(text: str, path: Path) -> ShaderEffect:
    """Read a gl-transition as an effect.

    Raises
    ------
    KernelError
        For an unsupported shader, with file, line and caret.
    """
    # The default moves into the declaration; the text before it keeps its columns.
    source = _DEFAULT.sub(lambda m: f"{m[1]} {m[2]}  {_default(m[1], m[3])};", text)
    source = _DEFAULT_WITHIN.sub(lambda m: f"{m[1]}  {_default(m[1], m[2])}  {m[3]}", source)
    shader = parse(source, name=name_of(path), file=str(path), entry="pg_main", prelude=_BEFORE, postlude=_BEHIND)
    kernel: PixelKernel[Target] = PixelKernel.of_shader(shader)
    images, parameters = uniforms_of(shader)
    uniforms = _PICTURES | {name: name for name in images if name not in _PICTURES.values()}
    parameters["progress"] = ShaderParameter("progress", FLOAT, 0.5, 0.0, 1.0, "how far the first is the second")

    def build(pictures: Mapping[str, Target], values: Mapping[str, Any], into: TargetSpec) -> Target:
        given: dict[str, Any] = {own: handle_or_black(pictures.get(name)) for name, own in uniforms.items()}
        given |= values
        return kernel.called({parameter.name: given[parameter.name] for parameter in kernel.parameters}, into)

    author = re.search(r"^\s*//\s*[Aa]uthors?\s*:\s*(.+)$", text, re.MULTILINE)
    credit = author[1].strip() if author else ""
    summary = f"{path.stem}: a transition between two pictures"
    return ShaderEffect(
        name_of(path), "gl-transition", summary, credit, tuple(uniforms), parameters, shader.notes,
        str(path), build,
    )  # fmt: skip
