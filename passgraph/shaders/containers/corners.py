"""Varyings of a vertex shader: computed at the picture's corners and interpolated.

The picture is the strip of two triangles that hosts draw: (0, 0), (1, 0), (0, 1), (1, 1). Each pixel finds its triangle
itself, so that a vertex shader that moves the picture needs no mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

_CORNERS = ("0.0, 0.0", "1.0, 0.0", "0.0, 1.0", "1.0, 1.0")
#: Most varyings of a vertex shader, with array elements counted individually.
MAX_VARYINGS = 64


@dataclass(frozen=True)
class Varying:
    """A varying of a vertex shader; ``count`` elements of an array, 0 for a single value."""

    type: str
    name: str
    count: int

    @property
    def places(self) -> list[str]:
        return [f"[{i}]" for i in range(self.count)] if self.count else [""]


#: GLSL that computes a pixel's barycentric coordinates in a triangle, and returns false outside of it. Triangles behind
#: the eye need no clipping (Olano and Greer, "Triangle Scan Conversion using 2D Homogeneous Coordinates", 1997). Pixels
#: on an edge belong to it only for left and first-row edges, so that neighbors share none. ``pg_zw`` becomes what
#: ``gl_FragCoord`` has in the triangle: depth and 1 / w.
WITHIN = """vec2 pg_zw;
bool pg_within(vec4 a, vec4 b, vec4 c, out vec3 share) {
  vec3 at = vec3(pg_position * 2.0 - 1.0, 1.0);
  vec3 first = cross(b.xyw, c.xyw), second = cross(c.xyw, a.xyw), third = cross(a.xyw, b.xyw);
  float whole = dot(a.xyw, first);
  share = vec3(dot(first, at), dot(second, at), dot(third, at)) / whole;
  vec3 right = vec3(first.x, second.x, third.x) / whole, on = vec3(first.y, second.y, third.y) / whole;
  bool inside = whole != 0.0 && share.x + share.y + share.z > 0.0;
  for (int i = 0; i < 3; i++)
    inside = inside && (share[i] > 0.0 || (share[i] == 0.0 && (right[i] > 0.0 || (right[i] == 0.0 && on[i] > 0.0))));
  share /= share.x + share.y + share.z;
  float z = dot(vec3(a.z, b.z, c.z), share), w = dot(vec3(a.w, b.w, c.w), share);
  pg_zw = vec2(0.5 * z / w + 0.5, 1.0 / w);
  return inside && abs(z) <= w;
}"""
#: Corners of both triangles; the second is drawn over the first.
_TRIANGLES = ((0, 1, 2), (3, 2, 1))


def interpolated(varyings: Sequence[Varying], moved: bool) -> list[str]:
    """Return GLSL that runs ``pg_vertex()`` at the corners, and sets each ``name`` to its value at this pixel.

    ``pg_vertex()`` reads ``pg_corner`` and writes ``pg_v_name``. If the corners are ``moved``, to ``pg_v_gl_Position``
    in clip space, pixels outside of the two triangles are discarded.
    """
    lines = []
    for corner, place in enumerate(_CORNERS):
        lines.append(f"  pg_corner = vec2({place}); pg_vertex();")
        lines += [f"  vec4 pg_moved_{corner} = pg_v_gl_Position;"] if moved else []
        for one in varyings:
            for i, element in enumerate(one.places):
                lines.append(f"  {one.type} pg_{one.name}_{i}_{corner} = pg_v_{one.name}{element};")
    lines += ["  vec3 pg_share;"]
    first, second = (
        f"pg_within({', '.join(f'pg_moved_{corner}' for corner in triangle)}, pg_share)" for triangle in _TRIANGLES
    )
    if moved:
        lines += [f"  if ({second}) {{", *_mixed(varyings, _TRIANGLES[1])]
        lines += [f"  }} else if ({first}) {{", *_mixed(varyings, _TRIANGLES[0]), "  } else discard;"]
        return lines
    lines += [
        "  pg_share.yz = pg_position;",
        "  if (pg_share.y + pg_share.z < 1.0) {",
        *_mixed(varyings, _TRIANGLES[0]),
    ]
    return [*lines, "  } else {", "    pg_share.yz = 1.0 - pg_share.yz;", *_mixed(varyings, _TRIANGLES[1]), "  }"]


def _mixed(varyings: Sequence[Varying], triangle: tuple[int, int, int]) -> list[str]:
    """Interpolate the varyings by the shares of a triangle's second and third corner."""
    lines = []
    for one in varyings:
        for i, element in enumerate(one.places):
            a, b, c = (f"pg_{one.name}_{i}_{corner}" for corner in triangle)
            lines.append(f"    {one.name}{element} = {a} + ({b} - {a}) * pg_share.y + ({c} - {a}) * pg_share.z;")
    return lines
