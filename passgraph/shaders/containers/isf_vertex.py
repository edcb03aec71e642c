"""Vertex shaders of ISF files."""

from __future__ import annotations

import re

from passgraph.errors import InputError
from passgraph.shaders.containers.corners import MAX_VARYINGS, Varying, interpolated

_VARYING = re.compile(r"^\s*varying\s+(?:\w+p\s+)?(\w+)\s+(\w+)\s*(?:\[\s*(\d+)\s*\])?\s*;", re.MULTILINE)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)


def vertex_prelude(text: str, file: str) -> tuple[str, str]:
    """GLSL before the fragment shader, which defines ``pg_vertex``, and behind it, which calls it from ``pg_main``."""
    # Comments go, and lines keep their numbers.
    plain = _COMMENT.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)
    found = [Varying(m[1], m[2], int(m[3] or 0)) for m in _VARYING.finditer(plain)]
    if sum(max(1, one.count) for one in found) > MAX_VARYINGS:
        raise InputError(f"{file}: the vertex shader hands on more than {MAX_VARYINGS} values")
    moved = re.search(r"\bgl_Position\b", plain)
    if moved is not None:
        line = plain.count("\n", 0, moved.start()) + 1
        column = moved.start() - (plain.rfind("\n", 0, moved.start()) + 1)
        shown = text.splitlines()[line - 1].expandtabs(1)
        raise InputError(
            f"{file}:{line}: the vertex shader moves the picture (gl_Position), which is not read here\n"
            f"    {shown}\n    {' ' * column}{'^' * len(moved[0])}"
        )
    renamed = {"main": "pg_vertex", "isf_FragNormCoord": "pg_corner", "varying": ""}
    renamed |= {one.name: f"pg_v_{one.name}" for one in found}
    before = "vec2 pg_corner;\n#define isf_vertShaderInit()\n#define vv_vertShaderInit()\n"
    before += "".join(f"#define {name} {other}\n" for name, other in renamed.items())
    behind = "".join(f"#undef {name}\n" for name in renamed)
    # In the fragment shader they are variables that are set before its main().
    entry = "\n".join(["void pg_main() {", *interpolated(found), "  main();", "}"])
    return f"{before}{text}\n{behind}#define varying\n", entry
