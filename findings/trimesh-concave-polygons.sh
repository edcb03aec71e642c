#!/usr/bin/env bash
# Guess: a loader that returns triangles for an OBJ or OFF polygon covers just the area of the polygon.
# Is: trimesh makes a fan of the first corner for every polygon. A concave polygon of area 10 becomes triangles of area
#     22, without a warning. (Area is the sum over triangles; they overlap outside of the polygon.)
# Seen with: trimesh 5.2.0 (trimesh/exchange/obj.py, trimesh/geometry.py: triangulate_quads), numpy 2.3.5.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check trimesh==5.2.0 numpy==2.3.5
venv/bin/python - <<'PYTHON'
from io import BytesIO

import trimesh

corners = [(4, 4), (2, 1), (0, 4), (0, 0), (4, 0)]
shoelace = abs(sum(a * d - b * c for (a, b), (c, d) in zip(corners, corners[1:] + corners[:1]))) / 2
obj = "".join(f"v {x} {y} 0\n" for x, y in corners) + "f 1 2 3 4 5\n"
off = "OFF\n5 1 0\n" + "".join(f"{x} {y} 0\n" for x, y in corners) + "5 0 1 2 3 4\n"
areas = {
    kind: float(trimesh.load_mesh(BytesIO(text.encode()), file_type=kind).area) for kind, text in (("obj", obj), ("off", off))
}
print("area of the polygon:", shoelace, "of the triangles:", areas)
assert shoelace == 10.0 and areas == {"obj": 22.0, "off": 22.0}, "changed"
PYTHON
