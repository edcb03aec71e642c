"""What an engine may have left set: every one of these would change a picture of ours, or be changed by a pass."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from passgraph.backends.gl import gl_functions as g
from tests.host.application import BYTES, RGBA, Application

_SIGNATURES = {
    "BindBufferBase": "uuu", "BindBufferRange": "uuunn",
    "BlendColor": "ffff", "BlendEquationSeparatei": "uuu", "BlendFuncSeparatei": "uuuuu",
    "ClearColor": "ffff", "ClearDepth": "d", "ClearStencil": "i", "ClipControl": "uu", "DepthRangeIndexed": "udd",
    "LineWidth": "f", "LogicOp": "u", "PrimitiveRestartIndex": "u", "ProvokingVertex": "u", "SampleCoverage": "fb",
    "SampleMaski": "uu", "ScissorIndexed": "uiiii", "TexBuffer": "uuu", "ViewportIndexedf": "uffff", "Hint": "uu",
    "AlphaFunc": "uf", "ShadeModel": "u",
    "PatchParameteri": "ui", "PointSize": "f", "MinSampleShading": "f", "BindProgramPipeline": "u",
}  # fmt: skip
_TYPES = {
    "u": ctypes.c_uint,
    "i": ctypes.c_int,
    "n": ctypes.c_ssize_t,
    "f": ctypes.c_float,
    "d": ctypes.c_double,
    "b": ctypes.c_ubyte,
}


class More:
    """Functions that passgraph does not call."""

    def __init__(self, app: Application) -> None:
        for name, signature in _SIGNATURES.items():
            kind = ctypes.CFUNCTYPE(None, *(_TYPES[letter] for letter in signature))
            setattr(self, name, kind(app.native.load_opengl_function(f"gl{name}")))

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


def use_program(app: Application, vertex: bytes, fragment: bytes) -> None:
    """A program of the engine's, and vertices: its uniforms and arrays are not ours to use."""
    gl, shaders = app.gl, []
    for kind, text in ((g.VERTEX_SHADER, vertex), (g.FRAGMENT_SHADER, fragment)):
        shader, source = gl.CreateShader(kind), ctypes.c_char_p(text)
        gl.ShaderSource(shader, 1, ctypes.byref(source), None)
        gl.CompileShader(shader)
        shaders.append(shader)
    name = gl.CreateProgram()
    for shader in shaders:
        gl.AttachShader(name, shader)
    gl.LinkProgram(name)
    gl.UseProgram(name)


def _vertices(app: Application) -> None:
    gl = app.gl
    gl.BindVertexArray(gl.new("VertexArray"))
    gl.BindBuffer(g.ELEMENT_ARRAY_BUFFER, gl.new("Buffer"))
    gl.BindBuffer(g.ARRAY_BUFFER, gl.new("Buffer"))
    gl.EnableVertexAttribArray(0)
    gl.VertexAttribPointer(0, 4, g.FLOAT, 0, 16, None)


def _pixel_buffers(app: Application) -> None:
    for target in (g.PIXEL_PACK_BUFFER, g.PIXEL_UNPACK_BUFFER):
        app.gl.BindBuffer(target, app.gl.new("Buffer"))
        app.gl.BufferData(target, 64, None, g.STATIC_DRAW)


def _pixel_store(app: Application) -> None:
    for number, value in {
        0xCF0: 1, 0xCF2: 3, 0xCF3: 1, 0xCF4: 2, 0xCF5: 8, 0xD00: 1, 0xD02: 5, 0xD03: 2, 0xD04: 1, 0xD05: 2,
    }.items():  # fmt: skip
        app.gl.PixelStorei(number, value)


def _textures(app: Application) -> None:
    gl = app.gl
    for unit in range(16):
        gl.ActiveTexture(g.TEXTURE0 + unit)
        gl.BindTexture(g.TEXTURE_2D, app.texture(0x8058, RGBA, BYTES, None, (4, 4)))
        gl.ActiveTexture(g.TEXTURE0 + unit)
    layers = app.gl.new("Texture")
    gl.BindTexture(0x8C1A, layers)
    gl.ActiveTexture(g.TEXTURE0 + 7)


def _samplers(app: Application) -> None:
    """Linear, mirrored, from a blank border: what a pass would show if it used them."""
    for unit in range(16):
        name = app.gl.new("Sampler")
        for number, value in {0x2801: 0x2601, 0x2800: 0x2601, 0x2802: 0x8370, 0x2803: 0x812D}.items():
            app.gl.SamplerParameteri(name, number, value)
        app.gl.BindSampler(unit, name)


def _framebuffers(app: Application) -> None:
    """Another one to read from than to draw into."""
    reading = app.of_texture(app.texture(0x8058, RGBA, BYTES, None, (8, 8)))
    drawing = app.of_texture(app.texture(0x8058, RGBA, BYTES, None, (16, 16)))
    app.gl.BindFramebuffer(g.READ_FRAMEBUFFER, reading)
    app.gl.BindFramebuffer(g.DRAW_FRAMEBUFFER, drawing)
    app.gl.DrawBuffers(1, (ctypes.c_uint * 1)(0))


def _stencil(app: Application) -> None:
    gl = app.gl
    gl.Enable(0xB90)
    for face, mask in ((g.FRONT, 0xFFFFFF0F), (g.BACK, 0x80000001)):
        gl.StencilFuncSeparate(face, 0x200, 3, mask)
        gl.StencilOpSeparate(face, 0x150A, 0x8507, 0)
        gl.StencilMaskSeparate(face, mask)


def _on(*switches: int) -> Callable[[Application, More], None]:
    def set_them(app: Application, more: More) -> None:
        for switch in switches:
            app.gl.Enable(switch)

    return set_them


def _blending(app: Application, more: More) -> None:
    app.gl.Enable(0xBE2)
    app.gl.BlendFuncSeparate(0x306, 0x8003, 0, 0x8001)
    app.gl.BlendEquationSeparate(0x8007, 0x800B)
    more.BlendColor(0.1, 0.2, 0.3, 0.4)


def _blending_apart(app: Application, more: More) -> None:
    app.gl.Disablei(0xBE2, 1)
    for buffer in range(8):
        more.BlendFuncSeparatei(buffer, 0x302 + buffer % 3, 0x303, 1, buffer % 2)
        more.BlendEquationSeparatei(buffer, 0x8006, 0x800A + buffer % 2)


def _masks_apart(app: Application, more: More) -> None:
    for buffer in range(8):
        app.gl.ColorMaski(buffer, buffer & 1, buffer >> 1 & 1, buffer >> 2 & 1, 1)


def _viewports(app: Application, more: More) -> None:
    for k in range(16):
        more.ViewportIndexedf(k, 1.5 * k, 2.25, 3.0 + k, 4.5)
        more.DepthRangeIndexed(k, 0.25, 0.01 * k)
        more.ScissorIndexed(k, k, 1, 2, 3)


def _uniform_buffers(app: Application, more: More) -> None:
    for k in range(4):
        more.BindBufferBase(0x8A11, k, app.gl.new("Buffer"))


def _storage_buffers(app: Application, more: More) -> None:
    """The first in part, and another one behind it."""
    for k in (1, 0):
        more.BindBufferBase(g.SHADER_STORAGE_BUFFER, k, app.gl.new("Buffer"))
    app.gl.BufferData(g.SHADER_STORAGE_BUFFER, 1024, None, g.STATIC_DRAW)
    more.BindBufferRange(g.SHADER_STORAGE_BUFFER, 0, app.gl.integer(0x90D3), 256, 512)
    app.gl.BindBuffer(g.SHADER_STORAGE_BUFFER, app.gl.new("Buffer"))


#: What is left set → how.  Each stays when the next is set.
STATES: dict[str, Callable[[Application, More], Any]] = {
    "scissor": lambda app, more: (app.gl.Enable(0xC11), more.ScissorIndexed(0, 1, 1, 1, 1)),
    "scissor of one viewport": lambda app, more: app.gl.Enablei(0xC11, 3),
    "viewports": _viewports,
    "blending": _blending,
    "blending apart": _blending_apart,
    "colour masks": lambda app, more: app.gl.ColorMask(0, 1, 0, 1),
    "colour masks apart": _masks_apart,
    "depth test": lambda app, more: (app.gl.Enable(0xB71), app.gl.DepthFunc(0x200)),
    "depth mask": lambda app, more: app.gl.DepthMask(0),
    "stencil": lambda app, more: _stencil(app),
    "culling": lambda app, more: (app.gl.Enable(0xB44), app.gl.CullFace(0x408)),
    "front faces": lambda app, more: app.gl.FrontFace(0x900),
    "lines": lambda app, more: (app.gl.PolygonMode(0x408, 0x1B01), more.LineWidth(3.0)),
    "points": lambda app, more: (app.gl.PolygonMode(0x408, 0x1B00), more.PointSize(5.0)),
    "polygon offset": lambda app, more: (app.gl.PolygonOffset(4.0, 1000.0), _on(0x8037, 0x2A01, 0x2A02)(app, more)),
    "no rasteriser": _on(0x8C89),
    "logic operation": lambda app, more: (app.gl.Enable(0xBF2), more.LogicOp(0x150A)),
    "dithering": lambda app, more: app.gl.Disable(0xBD0),
    "smoothing": _on(0xB41, 0xB20),
    "sample mask": lambda app, more: (app.gl.Enable(0x8E51), more.SampleMaski(0, 0)),
    "sample coverage": lambda app, more: (app.gl.Enable(0x80A0), more.SampleCoverage(0.0, 1)),
    "alpha to coverage": _on(0x809E, 0x809F),
    "sampled shading": lambda app, more: (app.gl.Enable(0x8C36), more.MinSampleShading(1.0)),
    "sRGB": _on(0x8DB9),
    "depth clamp": _on(0x864F),
    "clip distances": _on(*range(0x3000, 0x3008)),
    "primitive restart": lambda app, more: (_on(0x8F9D, 0x8D69)(app, more), more.PrimitiveRestartIndex(1)),
    "clip control": lambda app, more: more.ClipControl(0x8CA2, 0x935F),
    "provoking vertex": lambda app, more: more.ProvokingVertex(0x8E4D),
    "clear values": lambda app, more: (
        more.ClearColor(0.5, 0.25, 1.0, 0.0), more.ClearDepth(0.25), more.ClearStencil(7),
    ),
    "uniform buffers": _uniform_buffers,
    "storage buffers": _storage_buffers,
    "textures": lambda app, more: _textures(app),
    "samplers": lambda app, more: _samplers(app),
    "a program": lambda app, more: use_program(
        app,
        b"#version 330\nin vec4 a; uniform mat4 m; void main() { gl_Position = m * a; }",
        b"#version 330\nuniform sampler2D s; out vec4 o; void main() { o = texture(s, vec2(0)); }",
    ),
    "vertices": lambda app, more: _vertices(app),
    "framebuffers": lambda app, more: _framebuffers(app),
    "seamless cubes and point size": _on(0x884F, 0x8642),
    "pixel store": lambda app, more: _pixel_store(app),
    "pixel buffers": lambda app, more: _pixel_buffers(app),
}  # fmt: skip


def _sides_apart(app: Application, more: More) -> None:
    app.gl.PolygonMode(g.FRONT, 0x1B01)
    app.gl.PolygonMode(g.BACK, 0x1B00)


#: What contexts of the compatibility profile have besides.
OLD_STATES: dict[str, Callable[[Application, More], Any]] = {
    "alpha test": lambda app, more: (app.gl.Enable(0xBC0), more.AlphaFunc(0x200, 0.5)),
    "clamped colours": lambda app, more: [app.gl.ClampColor(target, 1) for target in (0x891A, 0x891B, 0x891C)],
    "sides of polygons": _sides_apart,
    "fog, lighting, textures": lambda app, more: (_on(0xB60, 0xB50, 0xDE1)(app, more), more.ShadeModel(0x1D00)),
}


def make_hostile(app: Application) -> None:
    """All of them."""
    more = More(app)
    for change in STATES.values():
        change(app, more)
        app.gl.drain()
