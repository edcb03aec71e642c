"""What viewers give to the vertex shader of a plain pair of files: corners of the picture, and identities.

Names are those of three.js (``ShaderMaterial``), glslViewer, and OpenGL's fixed functions. Other inputs are known by
words in their names, as they are in programs of all kinds.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from passgraph.glsl import syntax as g
from passgraph.glsl.unit import Note
from passgraph.language.source import fail
from passgraph.shaders.containers.vertex_stage import Inputs

#: Values of inputs by what they are, with all components that an input may have; the picture faces the eye.
_CORNER = "vec4(pg_corner * 2.0 - 1.0, 0.0, 1.0)"
_UV = "vec4(pg_corner, 0.0, 1.0)"
_NORMAL = "vec4(0.0, 0.0, 1.0, 0.0)"
_WHITE = "vec4(1.0)"
#: Words in names of inputs: the first that fits decides.
_WORDS = (
    (re.compile(r"(?<!ver)tex|uv|^st$|_st$", re.IGNORECASE), _UV, "the position in the picture, from (0, 0) to (1, 1)"),
    (re.compile(r"norm", re.IGNORECASE), _NORMAL, "(0, 0, 1), toward the eye"),
    (re.compile(r"colo", re.IGNORECASE), _WHITE, "white"),
    (
        re.compile(r"pos|vert|corner|coord|point", re.IGNORECASE), _CORNER,
        "a corner of the picture, from (-1, -1) to (1, 1)",
    ),
)  # fmt: skip
_VECTOR = re.compile(r"vec([234])")

_KNOWN: Mapping[str, tuple[str, str]] = {
    "position": ("vec3", f"{_CORNER}.xyz"), "uv": ("vec2", "pg_corner"), "normal": ("vec3", f"{_NORMAL}.xyz"),
    "gl_Vertex": ("vec4", _CORNER), "gl_Normal": ("vec3", f"{_NORMAL}.xyz"), "gl_Color": ("vec4", _WHITE),
    "gl_SecondaryColor": ("vec4", "vec4(0.0, 0.0, 0.0, 1.0)"), "gl_MultiTexCoord0": ("vec4", _UV),
    **{f"gl_MultiTexCoord{i}": ("vec4", "vec4(0.0, 0.0, 0.0, 1.0)") for i in range(1, 8)},
    "gl_VertexID": ("int", "int(pg_corner.x + 2.0 * pg_corner.y)"), "gl_InstanceID": ("int", "0"),
    "gl_ModelViewProjectionMatrix": ("mat4", "mat4(1.0)"), "gl_ModelViewMatrix": ("mat4", "mat4(1.0)"),
    "gl_ProjectionMatrix": ("mat4", "mat4(1.0)"), "gl_NormalMatrix": ("mat3", "mat3(1.0)"),
}  # fmt: skip
_UNIFORMS: Mapping[str, tuple[str, str]] = {
    **dict.fromkeys(
        (
            "modelMatrix", "viewMatrix", "modelViewMatrix", "projectionMatrix", "u_modelMatrix", "u_viewMatrix",
            "u_projectionMatrix", "u_modelViewProjectionMatrix",
        ),
        ("mat4", "mat4(1.0)"),
    ),
    **dict.fromkeys(("normalMatrix", "u_normalMatrix"), ("mat3", "mat3(1.0)")),
    "cameraPosition": ("vec3", "vec3(0.0, 0.0, 1.0)"),
}  # fmt: skip
_FUNCTIONS = {"ftransform": ("vec4", _CORNER)}
_MATRIX = r"(?:u_|gl_)?(?:model|view|modelView|projection|modelViewProjection|ModelView|Projection|ModelViewProjection)"
#: Values that are the corner, perhaps behind matrices that leave it.
_STAYS = re.compile(rf"(?:{_MATRIX}Matrix\*)*(?:vec4\((\w+)(?:\.xyz?)?,(?:0,)?1\)|(\w+)|ftransform\(\))")

_SUFFIX = re.compile(r"(^|[._-])(fragment|frag|fsh|fs)(?=(\.glsl)?$)", re.IGNORECASE)
_VERTEX = {"fragment": "vertex", "frag": "vert", "fsh": "vsh", "fs": "vs"}


def vertex_file(path: Path) -> Path | None:
    """Return the vertex shader that lies beside a fragment shader: of its name, with the other stage in it.

    >>> from tempfile import mkdtemp
    >>> folder = Path(mkdtemp())
    >>> (folder / "wave.vert").touch(), (folder / "vertex.glsl").touch()
    (None, None)
    >>> fragments = (folder / name for name in ("wave.frag", "fragment.glsl", "a.fs"))
    >>> [beside and beside.name for beside in map(vertex_file, fragments)]
    ['wave.vert', 'vertex.glsl', None]
    """
    name = _SUFFIX.sub(lambda match: match[1] + _VERTEX[match[2].lower()], path.name)
    beside = path.with_name(name)
    return beside if name != path.name and beside.is_file() else None


def viewer_inputs(values: Mapping[str, tuple[str, str]], notes: list[Note]) -> Inputs:
    """Return what a viewer gives to a vertex shader, and ``values`` of its own; each guess leaves a note."""

    def at_corner(variable: g.Variable) -> str:
        vector = _VECTOR.fullmatch(variable.type.name)
        for word, value, meaning in _WORDS:
            if vector is not None and not variable.type.lengths and word.search(variable.name):
                notes.append(Note(variable.span, f"input {variable.name} is {meaning} here"))
                return f"{value}.{'xyzw'[: int(vector[1])]}"
        fail(
            variable.span,
            f"input {variable.name} has no value here; a vec2, vec3 or vec4 with position, uv, normal or color in its "
            "name has one",
        )

    return Inputs(at_corner, _keeps_place, _KNOWN, {**_UNIFORMS, **values}, _FUNCTIONS)


def _keeps_place(value: str, inputs: frozenset[str]) -> bool:
    match = _STAYS.fullmatch(value)
    name = None if match is None else match[1] or match[2]
    if name is None:
        return match is not None
    is_corner = name == "gl_Vertex" or next((given for word, given, _ in _WORDS if word.search(name)), "") == _CORNER
    return name in inputs and is_corner
