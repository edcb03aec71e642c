"""Passes of published GLSL effects on OpenGL, as their hosts draw them: over a whole target, by one triangle strip.

Texts are read from a folder that holds npm packages and repositories; `SOURCES` says how to make it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.float32]
#: How to make the folder, in a shell.
SOURCES = """npm install --prefix FOLDER three@0.187.0 postprocessing@6.39.6 glfx@0.0.4
for r in GPUOpen-Effects/FidelityFX-FSR GPUOpen-Effects/FidelityFX-CAS BrutPitt/glslSmartDeNoise libretro/glsl-shaders
do git clone --depth 1 https://github.com/$r FOLDER/${r#*/}; done"""
VERTEX = "out vec2 vUv;\nvoid main() { vUv = position.xy * 0.5 + 0.5; gl_Position = vec4(position, 1.0); }\n"
_VERTEX_HEAD = "#define varying out\nin vec3 position;\n"
_FRAGMENT_HEAD = """#define varying in
#define texture2D texture
out vec4 pc_fragColor;
#define gl_FragColor pc_fragColor
"""
#: What three.js puts before a shader; the weights are the effect's.
LUMINANCE = "float luminance(const in vec3 rgb) {{ return dot(rgb, vec3({}, {}, {})); }}\n"
REC709 = LUMINANCE.format(0.2126, 0.7152, 0.0722)
#: What the frame of ``postprocessing`` puts around an effect.
_EFFECT_HEAD = "uniform sampler2D inputBuffer; uniform vec2 texelSize, resolution; uniform float aspect, time;\n"
_EFFECT_MAIN = """
void main() { vec2 uv = vUv; mainUv(uv); mainImage(texture2D(inputBuffer, uv), uv, gl_FragColor); }"""
_WEB = "#version 100\nprecision highp float;\n"


@dataclass(frozen=True)
class Pass:
    """A fragment shader over a whole target.

    Attributes
    ----------
    fragment, vertex : GLSL, after the head of the version
    reads : "frame", or the number of an earlier pass, by the name of its sampler
    values : other uniforms
    size : the target's, in pixels
    kind : moderngl's type of the target
    version : 100 is WebGL's
    """

    fragment: str
    reads: Mapping[str, str | int]
    size: tuple[int, int]
    values: Mapping[str, Any] = field(default_factory=dict)
    vertex: str = VERTEX
    kind: str = "f4"
    version: int = 330

    def sources(self) -> tuple[str, str]:
        """Return both shaders with their heads."""
        if self.version == 100:
            names = re.findall(r"varying vec2 (\w+);", self.fragment)
            vertex = f"{_WEB}attribute vec3 position; varying vec2 {names[0]};\nvoid main() {{ {names[0]} = "
            return vertex + "position.xy * 0.5 + 0.5; gl_Position = vec4(position, 1.0); }", _WEB + self.fragment
        head = f"#version {self.version}\n"
        return head + _VERTEX_HEAD + self.vertex, head + _FRAGMENT_HEAD + self.fragment


class Drawn:
    """Passes in an OpenGL context, over one picture that stays on the device."""

    def __init__(self, context: moderngl.Context, passes: list[Pass], frame: Picture) -> None:
        self.context = context
        height, width = frame.shape[:2]
        upward = np.ascontiguousarray(frame[::-1], np.float32)
        pictures: dict[str | int, moderngl.Texture] = {
            "frame": _smooth(context.texture((width, height), 4, upward.tobytes(), dtype="f4"))
        }
        corners = context.buffer(np.array([-1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0], np.float32).tobytes())
        self.steps = []
        for number, one in enumerate(passes):
            vertex, fragment = one.sources()
            program = context.program(vertex, fragment)
            for name, value in one.values.items():
                if name in program:
                    program[name] = value
            read = []
            for unit, (name, source) in enumerate(one.reads.items()):
                if name in program:
                    program[name] = unit
                    read.append((unit, pictures[source]))
            pictures[number] = self.last = _smooth(context.texture(one.size, 4, dtype=one.kind))
            quad = context.vertex_array(program, [(corners, "3f", "position")])
            self.steps.append((context.framebuffer([self.last]), read, quad))

    def draw(self) -> None:
        """Draw every pass once, and wait for the last."""
        with self.context:
            for target, read, quad in self.steps:
                target.use()
                for unit, texture in read:
                    texture.use(unit)
                quad.render(moderngl.TRIANGLE_STRIP)
            self.context.finish()

    def read(self) -> Picture:
        """Return the last pass's picture, row 0 on top."""
        with self.context:
            raw, (width, height) = self.last.read(), self.last.size
        values = np.frombuffer(raw, np.float32 if self.last.dtype == "f4" else np.uint8).reshape(height, width, 4)
        return (values[::-1] / np.float32(1.0 if self.last.dtype == "f4" else 255.0)).astype(np.float32)


def _smooth(texture: moderngl.Texture) -> moderngl.Texture:
    """Return it, filtered and clamped as render targets of three.js are."""
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture


@dataclass(frozen=True)
class Texts:
    """Published shaders in a folder."""

    folder: Path

    def three(self, name: str, luminance: str = REC709) -> str:
        """Return a fragment shader of three.js's examples, with the chunks that it includes."""
        modules = self.folder / "node_modules" / "three"
        text = (modules / "examples" / "jsm" / "shaders" / f"{name}.js").read_text(encoding="utf-8")
        found = re.search(r"fragmentShader: /\* glsl \*/`(.*?)`", text, re.DOTALL)
        assert found, name

        def chunk(match: re.Match[str]) -> str:
            file = modules / "src" / "renderers" / "shaders" / "ShaderChunk" / f"{match[1]}.glsl.js"
            return file.read_text(encoding="utf-8").split("`")[1]

        return luminance + re.sub(r"#include <(\w+)>", chunk, found[1])

    def material(self, name: str) -> str:
        """Return one of the texts of ``postprocessing``, by the name of its variable."""
        file = self.folder / "node_modules" / "postprocessing" / "build" / "index.js"
        found = re.search(rf"^var {name} = (?:`([^`]*)`|\"([^\"]*)\");", file.read_text(encoding="utf-8"), re.MULTILINE)
        assert found, name
        text = (found[1] or found[2]).replace("\\n", "\n")
        return re.sub(r"#include <(colorspace_fragment|dithering\w*|common)>", "", text)

    def effect(self, name: str, defines: str = "", support: str = "", luminance: str = REC709) -> tuple[str, str]:
        """Return the vertex and the fragment shader around an effect of ``postprocessing``."""
        text = self.material(name)
        moved = "" if "void mainUv" in text else "void mainUv(inout vec2 uv) {}\n"
        image = "" if "void mainImage" in text else "void mainImage(vec4 c, vec2 uv, out vec4 color) { color = c; }\n"
        vertex = VERTEX
        if support:
            main = (
                "\nvoid main() { vUv = position.xy * 0.5 + 0.5; mainSupport(vUv); gl_Position = vec4(position, 1.0); }"
            )
            vertex = defines + _EFFECT_HEAD + "varying vec2 vUv;\n" + self.material(support) + main
        # a word of WebGL's that OpenGL reserves
        text = re.sub(r"\bactive\b", "is_active", text)
        head = defines + luminance + _EFFECT_HEAD + "varying vec2 vUv;\n" + moved + image
        return vertex, head + text + _EFFECT_MAIN

    def glfx(self, name: str) -> str:
        """Return a fragment shader of glfx, which is for WebGL."""
        text = (self.folder / "node_modules" / "glfx" / "glfx.js").read_text(encoding="utf-8")
        found = re.search(rf'a\.{name}=a\.{name}\|\|new h\(null,"(.*?)"\);', text, re.DOTALL)
        shared = re.search(r'\bs="(float random.*?)"', text)
        assert found and shared, name
        return found[1].replace('"+s+"', shared[1]).replace("\\n", "\n")

    def file(self, path: str) -> str:
        """Return a file of a repository, without its includes: moderngl follows even those in comments."""
        return re.sub(r".*#include.*", "", (self.folder / path).read_text(encoding="utf-8"))
