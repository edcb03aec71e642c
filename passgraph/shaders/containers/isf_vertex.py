"""Vertex shaders of ISF files: what they hand to fragments, computed at the picture's corners and interpolated.

The picture is the strip of two triangles that hosts draw: (0, 0), (1, 0), (0, 1), (1, 1).
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from passgraph.errors import InputError

_VARYING = re.compile(r"^\s*varying\s+(?:\w+p\s+)?(\w+)\s+(\w+)\s*(?:\[\s*(\d+)\s*\])?\s*;", re.MULTILINE)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_CORNERS = ("0.0, 0.0", "1.0, 0.0", "0.0, 1.0", "1.0, 1.0")
MAX_VARYINGS = 64


@dataclass(frozen=True)
class Varying:
    """What a vertex shader hands on; ``count`` elements of an array, 0 for one alone."""

    type: str
    name: str
    count: int

    @property
    def places(self) -> list[str]:
        return [f"[{i}]" for i in range(self.count)] if self.count else [""]


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
    return f"{before}{text}\n{behind}#define varying\n", _interpolated(found)


def _interpolated(found: list[Varying]) -> str:
    lines = ["void pg_main() {"]
    for corner, place in enumerate(_CORNERS):
        lines.append(f"  pg_corner = vec2({place}); pg_vertex();")
        for one in found:
            for i, at in enumerate(one.places):
                lines.append(f"  {one.type} pg_{one.name}_{i}_{corner} = pg_v_{one.name}{at};")
    lines += ["  vec2 pg_at = pg_position;", "  if (pg_at.x + pg_at.y < 1.0) {"]
    for name, weights in (("first", (0, 1, 2)), ("second", (3, 2, 1))):
        if name == "second":
            lines += ["  } else {", "    pg_at = 1.0 - pg_at;"]
        here, right, up = weights
        for one in found:
            for i, at in enumerate(one.places):
                a, b, c = (f"pg_{one.name}_{i}_{corner}" for corner in (here, right, up))
                lines.append(f"    {one.name}{at} = {a} + ({b} - {a}) * pg_at.x + ({c} - {a}) * pg_at.y;")
    return "\n".join([*lines, "  }", "  main();", "}"])
