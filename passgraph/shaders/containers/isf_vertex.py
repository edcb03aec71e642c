"""Vertex shaders of ISF files."""

from __future__ import annotations

import re

from passgraph.errors import InputError
from passgraph.shaders.containers.corners import MAX_VARYINGS, Varying, interpolated

_VARYING = re.compile(r"^\s*varying\s+(?:\w+p\s+)?(\w+)\s+(\w+)\s*(?:\[\s*(\d+)\s*\])?\s*;", re.MULTILINE)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)


def vertex_prelude(text: str, file: str) -> tuple[str, str]:
    """GLSL before the fragment shader, which defines ``pg_vertex``, and behind it, which calls it from ``pg_main``."""
    found = [Varying(m[1], m[2], int(m[3] or 0)) for m in _VARYING.finditer(_COMMENT.sub("", text))]
    if sum(max(1, one.count) for one in found) > MAX_VARYINGS:
        raise InputError(f"{file}: the vertex shader hands on more than {MAX_VARYINGS} values")
    if re.search(r"\bgl_Position\b", _COMMENT.sub("", text)):
        raise InputError(f"{file}: the vertex shader moves the picture (gl_Position), which is not read here")
    renamed = {"main": "pg_vertex", "isf_FragNormCoord": "pg_corner", "varying": ""}
    renamed |= {one.name: f"pg_v_{one.name}" for one in found}
    before = "vec2 pg_corner;\n#define isf_vertShaderInit()\n#define vv_vertShaderInit()\n"
    before += "".join(f"#define {name} {other}\n" for name, other in renamed.items())
    behind = "".join(f"#undef {name}\n" for name in renamed)
    # In the fragment shader they are variables that are set before its main().
    entry = "\n".join(["void pg_main() {", *interpolated(found), "  main();", "}"])
    return f"{before}{text}\n{behind}#define varying\n", entry
