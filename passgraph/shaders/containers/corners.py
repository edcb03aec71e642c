"""What a vertex shader hands to fragments: computed at the picture's corners and interpolated.

The picture is the strip of two triangles that hosts draw: (0, 0), (1, 0), (0, 1), (1, 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

_CORNERS = ("0.0, 0.0", "1.0, 0.0", "0.0, 1.0", "1.0, 1.0")
#: Values that one vertex shader may hand on, elements of arrays counted one by one.
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


def interpolated(found: Sequence[Varying], at: str = "pg_position") -> list[str]:
    """GLSL that runs ``pg_vertex()``, which reads ``pg_corner`` and writes ``pg_v_name``, and sets each ``name`` to
    what it is where ``at`` says."""
    lines = []
    for corner, place in enumerate(_CORNERS):
        lines.append(f"  pg_corner = vec2({place}); pg_vertex();")
        for one in found:
            for i, element in enumerate(one.places):
                lines.append(f"  {one.type} pg_{one.name}_{i}_{corner} = pg_v_{one.name}{element};")
    lines += [f"  vec2 pg_at = {at};", "  if (pg_at.x + pg_at.y < 1.0) {"]
    for name, weights in (("first", (0, 1, 2)), ("second", (3, 2, 1))):
        if name == "second":
            lines += ["  } else {", "    pg_at = 1.0 - pg_at;"]
        here, right, up = weights
        for one in found:
            for i, element in enumerate(one.places):
                a, b, c = (f"pg_{one.name}_{i}_{corner}" for corner in (here, right, up))
                lines.append(f"    {one.name}{element} = {a} + ({b} - {a}) * pg_at.x + ({c} - {a}) * pg_at.y;")
    return [*lines, "  }"]
