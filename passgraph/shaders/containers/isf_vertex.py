"""Vertex shaders of ISF files."""

from __future__ import annotations

import re

from passgraph.errors import InputError
from passgraph.shaders.containers.corners import MAX_VARYINGS, WITHIN, Varying, interpolated

_VARYING = re.compile(r"^\s*varying\s+(?:\w+p\s+)?(\w+)\s+(\w+)\s*(?:\[\s*(\d+)\s*\])?\s*;", re.MULTILINE)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)


def vertex_prelude(text: str, file: str) -> tuple[str, str]:
    """GLSL before the fragment shader, which defines ``pg_vertex``, and behind it, which calls it from ``pg_main``."""
    # Comments go, and lines keep their numbers.
    plain = _COMMENT.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)
    found = [Varying(m[1], m[2], int(m[3] or 0)) for m in _VARYING.finditer(plain)]
    if sum(max(1, one.count) for one in found) > MAX_VARYINGS:
        raise InputError(f"{file}: the vertex shader hands on more than {MAX_VARYINGS} values")
    moved = re.search(r"\bgl_Position\b", plain) is not None
    renamed = {"main": "pg_vertex", "isf_FragNormCoord": "pg_corner", "vv_FragNormCoord": "pg_corner", "varying": ""}
    renamed |= {"gl_Position": "pg_v_gl_Position"} | {one.name: f"pg_v_{one.name}" for one in found}
    begun = "pg_v_gl_Position = vec4(pg_corner * 2.0 - 1.0, 0.0, 1.0)"
    before = f"vec2 pg_corner; vec4 pg_v_gl_Position;\n{WITHIN}\n"
    before += "".join(f"#define {name}_vertShaderInit() {begun}\n" for name in ("isf", "vv"))
    before += "".join(f"#define {name} {other}\n" for name, other in renamed.items())
    behind = "".join(f"#undef {name}\n" for name in renamed)
    if moved:  # pixels show the place that has moved to them
        found.append(Varying("vec2", "pg_here", 0))
        behind += "vec2 pg_here;\n#define pg_v_pg_here pg_corner\n#define isf_FragNormCoord pg_here\n"
        behind += "#define vv_FragNormCoord pg_here\n"
    # In the fragment shader they are variables that are set before its main().
    entry = "\n".join(["void pg_main() {", *interpolated(found, moved), "  main();", "}"])
    return f"{before}{text}\n{behind}#define varying\n", entry
