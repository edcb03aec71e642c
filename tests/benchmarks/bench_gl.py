"""What the gl backend costs against hand-written shaders run by moderngl in the same context.

    python tests/benchmarks/bench_gl.py [runs]

Medians of interleaved runs at 1920 x 1080, rgba32f, on the same textures; a run ends when the device has finished it.
The ratio is the median of neighbouring pairs.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl
import numpy as np

import passgraph as pg
from passgraph.backends.gl import GLBackend
from passgraph.backends.gl.textures import Texture
from passgraph.formats import format_named
from passgraph.plan.build import build
from passgraph.plan.data import PixelStep
from passgraph.run.parameters import Uniforms

sys.path.insert(0, str(Path(__file__).parent))
from harness import Ratio, interleaved, ratio_of

SIZE = (1920, 1080)
WEIGHTS = (0.2126, 0.7152, 0.0722)
TAPS = [float(w) for w in np.exp(-(np.arange(-7, 8) ** 2) / (2 * 3.0**2))]

BLACK_AND_WHITE = """
def black_and_white(color: Image, weights: vec3) -> vec4:
    c = color[0, 0]
    y = dot(c.rgb, weights)
    return vec4(y, y, y, c.a)
"""
GAUSSIAN = """
def gaussian(color: Image, weights: Array[float, 15]) -> vec4:
    total = vec4(0.0)
    for i in range(15):
        total = total + color[i - 7, 0] * weights[i]
    return total
"""
BLACK_AND_WHITE_GLSL = """
#version 330 core
uniform sampler2D color; uniform vec3 weights; out vec4 result;
void main() {
    vec4 c = texelFetch(color, ivec2(gl_FragCoord.xy), 0);
    float y = dot(c.rgb, weights);
    result = vec4(y, y, y, c.a);
}
"""
GAUSSIAN_GLSL = """
#version 330 core
uniform sampler2D color; uniform float weights[15]; out vec4 result;
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy), last = textureSize(color, 0) - 1;
    vec4 total = vec4(0.0);
    for (int i = 0; i < 15; i++) {
        total += texelFetch(color, ivec2(clamp(here.x + i - 7, 0, last.x), here.y), 0) * weights[i];
    }
    result = total;
}
"""
FILTERED = """
def filtered(color: Image, weights: vec3) -> vec4:
    return color.sample(uv() * weights.x + weights.yz)
"""
FILTERED_GLSL = """
#version 330 core
uniform sampler2D color; uniform vec3 weights; out vec4 result;
void main() {
    result = texture(color, gl_FragCoord.xy / vec2(textureSize(color, 0)) * weights.x + weights.yz);
}
"""
#: Scale and shift of what is filtered.
MOVED = (0.99, 0.003, 0.004)
FULLSCREEN_GLSL = """
#version 330 core
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
"""


Work = tuple[Callable[[], None], Callable[[], Any]]


def ours(backend: GLBackend, source: str, weights: Any, image: Texture, target: Texture) -> Work:
    """A run, and what reads its result."""
    format_ = format_named("rgba32f")
    into = pg.target("out", format="rgba32f")
    color = pg.Input("color")
    if source is FILTERED:
        color = color.filter("linear", hardware=True)
    output = pg.kernel(source=source)(color, weights, into=into)
    step = build({"out": output}, SIZE, {"color": (format_, SIZE)}, limits=backend.limits).steps[0]
    assert isinstance(step, PixelStep)
    run = backend.pixel_pass(step)
    block = Uniforms(step.program, step, {}).block

    def go() -> None:
        run([target], [image], block)
        backend.finish()

    return go, lambda: backend.download(target)


def by_hand(
    backend: GLBackend, context: moderngl.Context, source: str, weights: Any, image: Texture, target: Texture
) -> Work:
    """The same on the same textures."""
    program = context.program(vertex_shader=FULLSCREEN_GLSL, fragment_shader=source)
    program["weights"] = weights
    read, written = (context.external_texture(texture.name, SIZE, 4, 0, "f4") for texture in (image, target))
    if source is FILTERED_GLSL:  # of the texture itself, which is ours too: so this comes last
        read.filter = (moderngl.LINEAR, moderngl.LINEAR)
    framebuffer, triangle = context.framebuffer([written]), context.vertex_array(program, [])

    def go() -> None:
        with backend.context:
            framebuffer.use()
            read.use(0)
            triangle.render(moderngl.TRIANGLES, vertices=3)
            context.finish()

    return go, lambda: backend.download(target)


def ratios(runs: int = 15) -> list[Ratio]:
    """Generated over hand-written, for each shader."""
    found = []
    picture = np.random.default_rng(1).random((SIZE[1], SIZE[0], 4), np.float32)
    with GLBackend() as backend, backend.context:
        context = moderngl.create_context(context=backend.context.native)
        print(context.info["GL_RENDERER"])
        image, target = (backend.make(format_named("rgba32f"), SIZE) for _ in range(2))
        backend.upload(image, picture)
        # A pass at the speed of memory is short and feels what else runs: take more of it.
        cases = (
            ("black and white", BLACK_AND_WHITE, BLACK_AND_WHITE_GLSL, WEIGHTS, 4 * runs, 1.05),
            ("15-tap Gaussian", GAUSSIAN, GAUSSIAN_GLSL, TAPS, runs, 1.05),
            ("filtered by the device", FILTERED, FILTERED_GLSL, MOVED, 4 * runs, 1.1),
        )
        for name, source, shader, weights, turns, wanted in cases:
            mine, read_mine = ours(backend, source, weights, image, target)
            hand, read_hand = by_hand(backend, context, shader, weights, image, target)
            mine()
            made = read_mine()
            hand()
            difference = float(np.abs(made - read_hand()).max())
            times = interleaved({"gl": mine, "hand": hand}, turns)
            ratio = ratio_of(f"{name}, gl / written by hand", times["gl"], times["hand"], wanted)
            print(
                f"{name}: gl {ratio.ms:.2f} ms, by hand {ratio.other_ms:.2f} ms, ratio {ratio.got:.3f}, "
                f"largest difference {difference:.1e}"
            )
            found.append(ratio)
    return found


if __name__ == "__main__":
    ratios(int(sys.argv[1]) if len(sys.argv) > 1 else 15)
