#!/usr/bin/env bash
# (1) Most would guess: mix(a, b, 1.0) is b, as the specification's x * (1 - a) + y * a says, and a crossfade ends in its
#     second picture.
# (2) What is: Mesa computes x + (y - x) * a, whose rounding depends on x: mix(1e8, 1.0, 1.0) is 0. A fade from highlights
#     of 60000 (the range of half floats) to 0.001 ends in 0. The written formula gives b exactly.
# (3) Mesa 22.3.6, 25.0.7 and 26.1.6 (llvmpipe and softpipe), through EGL; moderngl 5.12.0. GLSL 4.60, section 8.3 states the
#     formula, and section 4.7.1 that functions given by one inherit its precision. WGSL allows both forms.
set -euo pipefail
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT; cd "$folder"
python3 -m venv venv
venv/bin/pip -q install moderngl==5.12.0 glcontext==3.0.0 numpy==2.2.6
cat > show.py <<'PY'
import sys
import moderngl, numpy as np

context = moderngl.create_context(standalone=True, backend="egl")
print(context.info["GL_RENDERER"], context.info["GL_VERSION"])
if "Mesa" not in context.info["GL_VERSION"]:
    sys.exit("this is not Mesa")
program = context.program(
    vertex_shader="#version 330\nvoid main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
    fragment_shader="""#version 330
uniform vec3 g; out vec4 color;
void main() { color = vec4(mix(g.x, g.y, g.z), g.x * (1.0 - g.z) + g.y * g.z, 0.0, 1.0); }""")
target = context.texture((1, 1), 4, dtype="f4")
context.framebuffer([target]).use()
found = []
for first, second in ((1e8, 1.0), (60000.0, 0.001)):
    program["g"] = first, second, 1.0
    context.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
    mixed, written = np.frombuffer(target.read(), np.float32)[:2].tolist()
    print(f"mix({first:g}, {second:g}, 1.0) = {mixed:g}; as the formula: {written:g}")
    found.append((mixed, np.float32(written) == np.float32(second)))
assert found == [(0.0, True), (0.0, True)], found
PY
venv/bin/python show.py
