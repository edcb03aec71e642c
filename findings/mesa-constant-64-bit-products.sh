#!/usr/bin/env bash
# 1. Most would guess: umulExtended(0xFFFFFFFFu, 2u, high, low) gives a high word of 1 and a low one of 4294967294, whether
#    the compiler computes it or the device.
# 2. What is: where both factors are constants, Mesa's GLSL compiler folds the product to 32 bits, so that the high word is
#    0 (of imulExtended too); where one of them varies, the same call gives 1. Random numbers by multiplication (PCG,
#    Philox) with constant seeds so differ from those with seeds of uniforms.
# 3. Mesa 22.3.6 (Debian 12, libgl1-mesa-dri), llvmpipe through EGL; moderngl 5.12.0. GLSL 4.30, section 8.8, defines both
#    words. Needs that Mesa; says so and stops where the driver is another.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet "moderngl==5.12.0" "glcontext==3.0.0"
cat > products.py <<'PY'
import struct, sys
import moderngl

TEXT = """#version 430
out uvec4 words; uniform uint zero;
void main() {{ uint high, low; int up, down; umulExtended({0}, 2u, high, low); imulExtended(int({1}), 5, up, down);
words = uvec4(high, low, uint(up), uint(down)); }}"""
context = moderngl.create_context(standalone=True, require=430, backend="egl")
version = context.info["GL_VERSION"]
print(version)
if "Mesa 22.3.6" not in version:
    sys.exit("this is not Mesa 22.3.6")


def words(first: str, second: str) -> tuple[int, ...]:
    program = context.program(
        vertex_shader="#version 430\nin vec2 at; void main() { gl_Position = vec4(at, 0.0, 1.0); }",
        fragment_shader=TEXT.format(first, second),
    )
    target = context.framebuffer([context.texture((1, 1), 4, dtype="u4")])
    target.use()
    corners = context.buffer(struct.pack("6f", -1, -1, 3, -1, -1, 3))
    context.vertex_array(program, [(corners, "2f", "at")]).render(moderngl.TRIANGLES)
    return struct.unpack("4I", target.read(components=4, dtype="u4"))


constant = words("0xFFFFFFFFu", "1000000007")
varying = words("(0xFFFFFFFFu + zero)", "(1000000007u + zero)")
print("of constants:", constant)
print("of a uniform:", varying)
product = 1000000007 * 5
right = (1, 0xFFFFFFFE, product >> 32, product & 0xFFFFFFFF)
print("right       :", right)
assert varying == right
assert constant == (0, right[1], 0, right[3])
PY
venv/bin/python products.py
