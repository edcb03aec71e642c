"""SMAA's own shaders on OpenGL, as npm's ``postprocessing`` 6.39.6 ships them (originals/, under its license there).

Their files are unaltered; what three.js puts before a shader is here.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray
from PIL import Image

Picture = NDArray[np.float32]
FOLDER = Path(__file__).resolve().parent / "originals"
VERTEX = "#version 330\n#define varying out\nin vec3 position;\n"
FRAGMENT = """#version 330
#define varying in
#define texture2D texture
out vec4 pc_fragColor;
#define gl_FragColor pc_fragColor
"""
#: SMAA.hlsl's weights in place of three.js's own.
COMMON = "float luminance(const in vec3 rgb) { return dot(rgb, vec3(0.2126, 0.7152, 0.0722)); }"
#: What the effect's frame passes to an effect of the library.
BLEND = (
    "uniform vec2 texelSize; uniform sampler2D inputBuffer; varying vec2 vUv;\n",
    "\nvoid main() { vUv = position.xy * 0.5 + 0.5; mainSupport(vUv); gl_Position = vec4(position.xy, 1.0, 1.0); }",
    "\nvoid main() { mainImage(texture2D(inputBuffer, vUv), vUv, gl_FragColor); }",
)
#: The distance to the left is negative here, so that corners are found at the left end alone; SMAA.hlsl 2.8 takes the
#: absolute value of both.
SIGNED = ("d=round(resolution.xx*d+-vPixCoord.xx)", "d=round(resolution.yy*d-vPixCoord.yy)")


def text(name: str) -> str:
    return (FOLDER / name).read_text()


class Original:
    """The three passes for pictures in floats; edges and weights have 8 bits."""

    def __init__(
        self, context: moderngl.Context, threshold: float, steps: int, diagonal_steps: int = 0, corner: float = 1.0
    ) -> None:
        self.context = context
        weights = text("smaa_weights.frag")
        for signed in SIGNED:
            assert signed in weights
            weights = weights.replace(signed, signed.replace("round(", "abs(round(") + ")")
        defines = {
            "EDGE_DETECTION_MODE": 1, "PREDICATION_MODE": 0, "EDGE_THRESHOLD": threshold,
            "LOCAL_CONTRAST_ADAPTATION_FACTOR": 2.0, "MAX_SEARCH_STEPS_INT": steps,
            "MAX_SEARCH_STEPS_FLOAT": float(steps), "MAX_SEARCH_STEPS_DIAG_INT": diagonal_steps,
            "CORNER_ROUNDING_NORM": corner, "AREATEX_MAX_DISTANCE": 16.0, "AREATEX_MAX_DISTANCE_DIAG": 20.0,
            "AREATEX_PIXEL_SIZE": "(1.0 / vec2(160.0, 80.0))", "AREATEX_SUBTEX_SIZE": "1.0",
            "SEARCHTEX_SIZE": "vec2(66.0, 33.0)", "SEARCHTEX_PACKED_SIZE": "vec2(64.0, 16.0)",
        }  # fmt: skip
        if diagonal_steps == 0:
            defines["DISABLE_DIAG_DETECTION"] = ""
        if corner == 1.0:
            defines["DISABLE_CORNER_DETECTION"] = ""
        said = "".join(f"#define {name} {value}\n" for name, value in defines.items())
        edges = text("smaa_edges.frag").replace("#include <common>", COMMON)
        frame, vertex_main, fragment_main = BLEND
        self.passes = [
            self._program(text("smaa_edges.vert"), edges, said),
            self._program(text("smaa_weights.vert"), weights, said),
            self._program(
                frame + text("smaa_blend.vert") + vertex_main, frame + text("smaa_blend.frag") + fragment_main, said
            ),
        ]
        self.area, self.search = (self._texture(f"smaa_{name}.png") for name in ("area", "search"))
        self.area.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self.search.filter = (moderngl.NEAREST, moderngl.NEAREST)

    def _program(self, vertex: str, fragment: str, defines: str) -> tuple[Any, Any]:
        program = self.context.program(VERTEX + defines + vertex, FRAGMENT + defines + fragment)
        corners = np.array([-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0], np.float32)
        corner = self.context.buffer(corners.tobytes())
        return program, self.context.vertex_array(program, [(corner, "3f", "position")])

    def _texture(self, name: str) -> moderngl.Texture:
        with Image.open(FOLDER / name) as file:
            numbers = np.asarray(file)
        if name == "smaa_search.png":
            numbers = np.ascontiguousarray(numbers[::-1])  # flipY
        made = self.context.texture(numbers.shape[1::-1], 1 if numbers.ndim == 2 else 3, numbers.tobytes(), alignment=1)
        made.repeat_x = made.repeat_y = False
        return made

    def _run(self, step: int, into: moderngl.Texture, size: tuple[int, int], **textures: moderngl.Texture) -> None:
        program, quad = self.passes[step]
        sizes = {"texelSize": (1.0 / size[0], 1.0 / size[1]), "resolution": size}
        for name, value in sizes.items():
            if name in program:
                program[name] = value
        for unit, (name, texture) in enumerate(textures.items()):
            if name in program:
                program[name] = unit
                texture.use(unit)
        framebuffer = self.context.framebuffer([into])
        framebuffer.use()
        framebuffer.clear()
        quad.render(moderngl.TRIANGLE_STRIP)

    def draw(
        self, color: moderngl.Texture, edges: moderngl.Texture, weights: moderngl.Texture, result: moderngl.Texture
    ) -> None:
        """Draw the three passes."""
        size = color.size
        for texture in (color, edges, weights):
            texture.repeat_x = texture.repeat_y = False
            texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        self._run(0, edges, size, inputBuffer=color)
        self._run(1, weights, size, inputBuffer=edges, areaTexture=self.area, searchTexture=self.search)
        self._run(2, result, size, inputBuffer=color, weightMap=weights)

    def __call__(self, frame: Picture) -> Picture:
        """Of a picture (h, w, 4), row 0 on top and at the texture's begin."""
        size = frame.shape[1], frame.shape[0]
        color, result = (self.context.texture(size, 4, dtype="f4") for _ in range(2))
        color.write(np.ascontiguousarray(frame, np.float32).tobytes())
        edges, weights = (self.context.texture(size, 4) for _ in range(2))
        self.draw(color, edges, weights, result)
        self.edges, self.weights = edges, weights
        return np.frombuffer(result.read(), np.float32).reshape(frame.shape)
