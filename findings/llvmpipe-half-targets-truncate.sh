#!/usr/bin/env bash
# (1) Most would guess: a color written to a half-float target is rounded to the nearest half, as packHalf2x16 and NumPy do,
#     and what is too large becomes infinite.
# (2) What is: llvmpipe (OpenGL) and lavapipe (Vulkan) cut the mantissa, so that each store loses up to one step and sums in
#     rgba16f darken; and 65520 and 1e9 become 65504. The same shader's packHalf2x16 rounds to nearest and gives infinity.
#     Both are allowed (OpenGL 4.6, 2.3.4.2), but not expected in one driver; so test pictures made on it are darker.
# (3) Mesa 22.3.6, 25.0.7 and 26.1.6 (llvmpipe) through EGL; moderngl 5.12.0. SwiftShader rounds to nearest.
set -euo pipefail
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT; cd "$folder"
python3 -m venv venv
venv/bin/pip -q install moderngl==5.12.0 glcontext==3.0.0 numpy==2.2.6
cat > show.py <<'PY'
import sys
import moderngl, numpy as np

context = moderngl.create_context(standalone=True, backend="egl", require=420)
print(context.info["GL_RENDERER"], context.info["GL_VERSION"])
if "llvmpipe" not in context.info["GL_RENDERER"]:
    sys.exit("this is not llvmpipe")
program = context.program(
    vertex_shader="#version 420\nvoid main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }",
    fragment_shader="""#version 420
uniform float x; layout(location = 0) out vec4 color; layout(location = 1) out uint bits;
void main() { color = vec4(x); bits = packHalf2x16(vec2(x, 0.0)); }""")
targets = [context.texture((1, 1), 4, dtype="f2"), context.texture((1, 1), 1, dtype="u4")]
context.framebuffer(targets).use()
found = []
for x in (1.0 + 1.9 * 2.0**-11, 65520.0, 1e9):
    program["x"] = x
    context.vertex_array(program, []).render(moderngl.TRIANGLES, vertices=3)
    stored = float(np.frombuffer(targets[0].read(), np.float16)[0])
    packed = float(np.frombuffer(targets[1].read(), np.uint16)[:1].view(np.float16)[0])
    with np.errstate(over="ignore"):
        nearest = float(np.float16(np.float32(x)))
    print(f"{x:.7g}: stored {stored:.7g}, packHalf2x16 {packed:.7g}, NumPy {nearest:.7g}")
    found.append((stored, packed == nearest))
assert found == [(1.0, True), (65504.0, True), (65504.0, True)], found
PY
venv/bin/python show.py
