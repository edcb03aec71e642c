"""The effect that the table measures, without passgraph: as GLSL in the same hook, and by a copy through the CPU.

Both draw into the framebuffer that is bound, and set again what engines commonly rely on.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from contextlib import contextmanager
from typing import Any

import numpy as np

import passgraph as pg
from docs.engines.demo import functions, gray_and_soft
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.context import Current
from passgraph.effects.filters.blur import gaussian_weights
from passgraph.hosts.gl_isolation import current_state
from passgraph.hosts.gl_pictures import attached

_VERTEX = """#version 330
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }
"""
_COPY = "c = texelFetch(t, ivec2(gl_FragCoord.xy), 0);"
_GRAY = "vec4 h = texelFetch(t, ivec2(gl_FragCoord.xy), 0); c = vec4(vec3(dot(h.rgb, vec3(.2126, .7152, .0722))), h.a);"
_SWITCHES = (0x0BE2, 0x0B71, 0x0B44, 0x0C11, 0x0B90, 0x8DB9)
_SAMPLES = 0x80A9


def _blur(across: bool) -> str:
    weights = gaussian_weights(3.0, 7)
    step = "ivec2(i, 0)" if across else "ivec2(0, i)"
    array = ", ".join(f"{weights[abs(i)]:.9g}" for i in range(-7, 8))
    return (
        f"const float w[15] = float[]({array}); ivec2 p = ivec2(gl_FragCoord.xy), s = size - 1; c = vec4(0.0);"
        f"for (int i = -7; i <= 7; i++) c += w[i + 7] * texelFetch(t, clamp(p + {step}, ivec2(0), s), 0);"
    )


class _Drawing:
    """Programs and textures of one context, and full-screen draws into what is bound."""

    def __init__(self) -> None:
        self.gl = gl = functions()
        self.vertices = gl.new("VertexArray")
        self.sampler = gl.new("Sampler")
        for parameter in (0x2801, 0x2800):
            gl.SamplerParameteri(self.sampler, parameter, g.NEAREST)
        self.read, self.drawn = gl.new("Framebuffer"), gl.new("Framebuffer")
        self.textures: dict[str, tuple[int, tuple[int, int]]] = {}

    def program(self, body: str) -> tuple[int, int]:
        gl, made = self.gl, self.gl.CreateProgram()
        text = f"#version 330\nuniform sampler2D t; uniform ivec2 size; out vec4 c; void main() {{ {body} }}"
        for kind, source in ((g.VERTEX_SHADER, _VERTEX), (g.FRAGMENT_SHADER, text)):
            shader = gl.CreateShader(kind)
            gl.ShaderSource(shader, 1, ctypes.byref(ctypes.c_char_p(source.encode())), None)
            gl.CompileShader(shader)
            gl.AttachShader(made, shader)
            gl.DeleteShader(shader)
        gl.LinkProgram(made)
        linked = ctypes.c_int(0)
        gl.GetProgramiv(made, g.LINK_STATUS, ctypes.byref(linked))
        assert linked.value, text
        return made, gl.GetUniformLocation(made, b"size")

    def texture(self, name: str, internal: int, size: tuple[int, int]) -> int:
        if self.textures.get(name, (0, ()))[1] != size:
            made = self.gl.new("Texture")
            self.gl.BindTexture(g.TEXTURE_2D, made)
            self.gl.TexImage2D(g.TEXTURE_2D, 0, internal, *size, 0, 0x1908, 0x1401, None)
            self.textures[name] = made, size
        return self.textures[name][0]

    def draw(self, program: tuple[int, int], source: int, size: tuple[int, int]) -> None:
        gl = self.gl
        gl.BindTexture(g.TEXTURE_2D, source)
        gl.UseProgram(program[0])
        gl.Uniform2i(program[1], *size)
        gl.DrawArrays(g.TRIANGLES, 0, 3)

    def into(self, texture: int) -> None:
        self.gl.BindFramebuffer(g.DRAW_FRAMEBUFFER, self.drawn)
        self.gl.FramebufferTexture2D(g.DRAW_FRAMEBUFFER, g.COLOR_ATTACHMENT0, g.TEXTURE_2D, texture, 0)

    @contextmanager
    def kept(self, size: tuple[int, int]) -> Any:
        """The engine's state as it was, behind; the framebuffer that is bound."""
        gl, bound = self.gl, self.gl.integer(0x8CA6)
        sampler_unit, viewport = gl.integer(0x84E0), (ctypes.c_int * 4)()
        gl.GetIntegerv(0xBA2, viewport)
        on = [switch for switch in _SWITCHES if gl.IsEnabled(switch)]
        read, program, vertices = gl.integer(0x8CAA), gl.integer(0x8B8D), gl.integer(0x85B5)
        gl.ActiveTexture(g.TEXTURE0)
        texture, sampler = gl.integer(0x8069), gl.integer(0x8919)
        modes, masks = (ctypes.c_int * 2)(), (ctypes.c_ubyte * 4)()
        gl.GetIntegerv(0xB40, modes)
        gl.GetBooleanv(0xC23, masks)
        for switch in on:
            gl.Disable(switch)
        gl.PolygonMode(g.FRONT_AND_BACK, g.FILL)
        gl.ColorMask(1, 1, 1, 1)
        gl.BindVertexArray(self.vertices)
        gl.BindSampler(0, self.sampler)
        gl.Viewport(0, 0, *size)
        yield bound
        for target, name in ((g.DRAW_FRAMEBUFFER, bound), (g.READ_FRAMEBUFFER, read)):
            gl.BindFramebuffer(target, name)
        gl.UseProgram(program)
        gl.BindVertexArray(vertices)
        gl.BindTexture(g.TEXTURE_2D, texture)
        gl.BindSampler(0, sampler)
        gl.ActiveTexture(sampler_unit)
        gl.Viewport(*viewport)
        gl.PolygonMode(g.FRONT_AND_BACK, modes[0])
        gl.ColorMask(*masks)
        for switch in on:
            gl.Enable(switch)


class ByHand:
    """Three passes in GLSL, as passgraph plans them: gray in 8 bits, across in halves, down into the frame."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.size, self.drawing = size, _Drawing()
        self.gray, self.across, self.down = (self.drawing.program(t) for t in (_GRAY, _blur(True), _blur(False)))

    def __call__(self) -> None:
        drawing, size = self.drawing, self.size
        with drawing.kept(size) as bound:
            source = self._source(bound)
            gray, across = drawing.texture("gray", 0x8058, size), drawing.texture("across", 0x881A, size)
            drawing.into(gray)
            drawing.draw(self.gray, source, size)
            drawing.into(across)
            drawing.draw(self.across, gray, size)
            drawing.gl.BindFramebuffer(g.DRAW_FRAMEBUFFER, bound)
            drawing.draw(self.down, across, size)

    def _source(self, bound: int) -> int:
        """The frame as a texture: itself, or where it is none, a copy."""
        gl, size = self.drawing.gl, self.size
        found = attached(gl, depth=False)
        if found is not None and found.kind == "texture" and not gl.integer(_SAMPLES):
            return found.name
        copied = self.drawing.texture("frame", 0x8058, size)
        self.drawing.into(copied)
        gl.BindFramebuffer(g.READ_FRAMEBUFFER, bound)
        gl.BlitFramebuffer(0, 0, *size, 0, 0, *size, g.COLOR_BUFFER_BIT, g.NEAREST)
        return copied


class ByCopy:
    """The frame read to the CPU, passgraph on it in a context of its own, and the result drawn back."""

    def __init__(self, size: tuple[int, int]) -> None:
        self.size, self.drawing = size, _Drawing()
        self.copy = self.drawing.program(_COPY)
        frame = pg.Input("frame", "rgba8", size)
        self.program = pg.compile({"picture": gray_and_soft(frame)}, backend="gl", results="stored")
        self.held, self.made = (np.empty((*size[::-1], 4), np.uint8) for _ in range(2))
        current = Current()
        system = current.system(current_state(current))
        kinds = (ctypes.c_int,) * 4 + (ctypes.c_uint,) * 2 + (ctypes.c_void_p,)
        self.read_pixels: Callable[..., None] = ctypes.CFUNCTYPE(None, *kinds)(system.address("glReadPixels"))

    def __call__(self) -> None:
        drawing, gl, size = self.drawing, self.drawing.gl, self.size
        with drawing.kept(size) as bound:
            resolved = drawing.texture("frame", 0x8058, size)
            drawing.into(resolved)
            gl.BindFramebuffer(g.READ_FRAMEBUFFER, bound)
            gl.BlitFramebuffer(0, 0, *size, 0, 0, *size, g.COLOR_BUFFER_BIT, g.NEAREST)
            gl.BindFramebuffer(g.READ_FRAMEBUFFER, drawing.drawn)
            self.read_pixels(0, 0, *size, 0x1908, 0x1401, self.held.ctypes.data)
            self.program(frame=self.held[::-1], into={"picture": self.made[::-1]})
            gl.BindTexture(g.TEXTURE_2D, resolved)
            gl.TexSubImage2D(g.TEXTURE_2D, 0, 0, 0, *size, 0x1908, 0x1401, self.made.ctypes.data)
            gl.BindFramebuffer(g.DRAW_FRAMEBUFFER, bound)
            drawing.draw(self.copy, resolved, size)
