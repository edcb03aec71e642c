"""OpenGL functions and constants that this backend uses, called through ctypes.

The table is loaded from the current context, so it works in foreign contexts too.  It caches no state, so engines may
change state behind it.  It leaves no errors for other code's next call.  A call costs about half a microsecond.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable
from typing import Any

from passgraph.backends.gl.capabilities import Capabilities, Where, capabilities_of
from passgraph.errors import BackendError, DeviceMissingError

#: Letters of the signatures: arguments, then ":" and the result.
_TYPES: dict[str, Any] = {
    "u": ctypes.c_uint, "i": ctypes.c_int, "f": ctypes.c_float, "b": ctypes.c_ubyte,
    "p": ctypes.c_void_p, "s": ctypes.c_char_p, "n": ctypes.c_ssize_t,
    "q": ctypes.c_uint64, "d": ctypes.c_double,
}  # fmt: skip

#: Functions of every context.
SIGNATURES = """
    ActiveTexture(u)  AttachShader(uu)  BindBuffer(uu)  BindFramebuffer(uu)  BindRenderbuffer(uu)  BindSampler(uu)
    BindBufferBase(uuu)  BindBufferRange(uuunn)  BindTexture(uu)  BindVertexArray(u)  BlendColor(ffff)
    BlendEquationSeparate(uu)
    BlendFuncSeparate(uuuu)  BlitFramebuffer(iiiiiiiiuu)  BufferData(unpu)
    CheckFramebufferStatus(u:u)  ClearBufferfi(uifi)  ClearBufferfv(uip)  ColorMask(bbbb)
    CompileShader(u)  CreateProgram(:u)  CreateShader(u:u)  CullFace(u)
    DeleteBuffers(ip)  DeleteFramebuffers(ip)  DeleteProgram(u)  DeleteSamplers(ip)  DeleteShader(u)
    DeleteSync(p)  DeleteTextures(ip)  DeleteVertexArrays(ip)  DepthFunc(u)  DepthMask(b)
    Disable(u)  DrawArrays(uii)
    DrawBuffers(ip)  DrawElements(uiup)  Enable(u)  EnableVertexAttribArray(u)
    FenceSync(uu:p)  Finish()  Flush()  FramebufferRenderbuffer(uuuu)  FramebufferTexture2D(uuuui)
    FramebufferTextureLayer(uuuii)  FrontFace(u)  GenBuffers(ip)  GenFramebuffers(ip)  GenSamplers(ip)
    GenTextures(ip)  GenVertexArrays(ip)  GetBooleanv(up)  GetError(:u)  GetFloatv(up)
    GetFramebufferAttachmentParameteriv(uuup)  GetInteger64i_v(uup)  GetInteger64v(up)  GetIntegeri_v(uup)
    GetIntegerv(up)
    GetProgramInfoLog(uipp)  GetProgramiv(uup)  GetRenderbufferParameteriv(uup)  GetShaderInfoLog(uipp)
    GetShaderSource(uipp)  GetShaderiv(uup)
    GetString(u:s)  GetStringi(uu:s)
    GetTexParameteriv(uup)  GetUniformLocation(us:i)  IsBuffer(u:b)  IsEnabled(u:b)
    IsFramebuffer(u:b)  IsProgram(u:b)  IsRenderbuffer(u:b)  IsSampler(u:b)  IsShader(u:b)  IsTexture(u:b)
    IsVertexArray(u:b)  LinkProgram(u)  PixelStorei(ui)  PolygonOffset(ff)
    ReadBuffer(u)  ReadPixels(iiiiuup)  SamplerParameteri(uui)  ShaderSource(uipp)  StencilFunc(uiu)
    StencilFuncSeparate(uuiu)  StencilMask(u)  StencilMaskSeparate(uu)  StencilOp(uuu)  StencilOpSeparate(uuuu)
    TexImage2D(uiiiiiuup)  TexParameteri(uui)  TexSubImage2D(uiiiiiuup)  Uniform1f(if)  Uniform1i(ii)
    Uniform2i(iii)  Uniform1fv(iip)  Uniform1iv(iip)  Uniform4fv(iip)  Uniform4i(iiiii)
    Uniform4iv(iip)  UseProgram(u)  VertexAttribPointer(uiubip)  Viewport(iiii)  WaitSync(puq)
"""
_INDEXED = {"GL_OES_draw_buffers_indexed": "OES", "GL_EXT_draw_buffers_indexed": "EXT"}
#: Functions of some contexts, and where they exist; None elsewhere.  Drivers give addresses even for missing functions.
OPTIONAL = {
    "DepthRange(dd)  DrawBuffer(u)  GetTexImage(uiuup)": Where((3, 3)),
    "ClampColor(uu)  TexImage2DMultisample(uiuiib)": Where((3, 3)),
    "GetMultisamplefv(uup)": Where((3, 3), (3, 1)),
    "GetTextureParameteriv(uup)": Where((4, 5), None, {"GL_ARB_direct_state_access": ""}),
    "DepthRangef(ff)  TexStorage2D(uiuii)": Where(None, (3, 0)),
    "PolygonMode(uu)": Where((3, 3), None, {"GL_NV_polygon_mode": "NV"}),
    "GetTexLevelParameteriv(uiup)": Where((3, 3), (3, 1)),
    "ColorMaski(ubbbb)  Disablei(uu)  Enablei(uu)  IsEnabledi(uu:b)": Where((3, 3), (3, 2), _INDEXED),
    "BlendFuncSeparatei(uuuuu)  BlendEquationSeparatei(uuu)": Where(
        (4, 0), (3, 2), {"GL_ARB_draw_buffers_blend": "ARB", **_INDEXED}
    ),
    "DispatchCompute(uuu)": Where((4, 3), (3, 1), {"GL_ARB_compute_shader": ""}),
    "MemoryBarrier(u)": Where((4, 2), (3, 1), {"GL_ARB_shader_image_load_store": ""}),
    "GetFloati_v(uup)  ViewportIndexedf(uffff)": Where(
        (4, 1), None, {"GL_ARB_viewport_array": "", "GL_OES_viewport_array": "OES", "GL_NV_viewport_array": "NV"}
    ),
    "ClipControl(uu)": Where((4, 5), None, {"GL_ARB_clip_control": "", "GL_EXT_clip_control": "EXT"}),
}

NO_ERROR, OUT_OF_MEMORY = 0, 0x505
ERRORS = {
    0x500: "invalid enum",
    0x501: "invalid value",
    0x502: "invalid operation",
    OUT_OF_MEMORY: "out of memory",
    0x506: "invalid framebuffer operation",
}
FRAMEBUFFER, READ_FRAMEBUFFER, DRAW_FRAMEBUFFER = 0x8D40, 0x8CA8, 0x8CA9
FRAMEBUFFER_COMPLETE, COLOR_ATTACHMENT0 = 0x8CD5, 0x8CE0
DEPTH_ATTACHMENT, DEPTH_STENCIL_ATTACHMENT = 0x8D00, 0x821A
TEXTURE_2D, PROXY_TEXTURE_2D, TEXTURE0, TEXTURE_WIDTH = 0x0DE1, 0x8064, 0x84C0, 0x1000
TEXTURE_2D_MULTISAMPLE, CLIP_DEPTH_MODE, ZERO_TO_ONE = 0x9100, 0x935D, 0x935F
#: Other texture targets that an engine may draw into, and their binding queries: rectangles, multisampled, arrays,
#: volumes, cubes.
OTHER_TEXTURES = {0x84F5: 0x84F6, TEXTURE_2D_MULTISAMPLE: 0x9104, 0x8C1A: 0x8C1D, 0x806F: 0x806A, 0x8513: 0x8514}
RENDERBUFFER = 0x8D41
COLOR, DEPTH, STENCIL, DEPTH_STENCIL = 0x1800, 0x1801, 0x1802, 0x84F9
COLOR_BUFFER_BIT, DEPTH_BUFFER_BIT, STENCIL_BUFFER_BIT = 0x4000, 0x100, 0x400
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, STATIC_DRAW = 0x8892, 0x8893, 0x88E4
PIXEL_PACK_BUFFER, PIXEL_UNPACK_BUFFER = 0x88EB, 0x88EC
FLOAT, UNSIGNED_INT, TRIANGLES, NEAREST, LINEAR = 0x1406, 0x1405, 0x0004, 0x2600, 0x2601
SRGB_DECODE, SKIP_DECODE = 0x8A48, 0x8A4A
FRONT, BACK, FRONT_AND_BACK, FILL, CLOCKWISE = 0x404, 0x405, 0x408, 0x1B02, 0x900
VERTEX_SHADER, FRAGMENT_SHADER, COMPUTE_SHADER = 0x8B31, 0x8B30, 0x91B9
COMPILE_STATUS, LINK_STATUS, INFO_LOG_LENGTH = 0x8B81, 0x8B82, 0x8B84
SHADER_STORAGE_BUFFER, SHADER_STORAGE_BARRIER, STREAM_DRAW = 0x90D2, 0x2000, 0x88E0
VENDOR, RENDERER, VERSION = 0x1F00, 0x1F01, 0x1F02
MAX_TEXTURE_SIZE, MAX_DRAW_BUFFERS, MAX_TEXTURE_UNITS = 0x0D33, 0x8824, 0x8872
MAX_VIEWPORT, MAX_COLOUR_ATTACHMENTS, SUBPIXEL_BITS = 0x0D3A, 0x8CDF, 0x0D50
MAX_FRAGMENT_UNIFORMS, MAX_VERTEX_UNIFORMS, MAX_VARYINGS = 0x8B49, 0x8B4A, 0x8B4B


def _prototype(entry: str) -> tuple[str, Callable[[int], Any]]:
    """Return the name of a function, and the ctypes prototype that makes it from its address."""
    name, _, signature = entry.removesuffix(")").partition("(")
    arguments, _, result = signature.partition(":")
    return name, ctypes.CFUNCTYPE(_TYPES[result] if result else None, *(_TYPES[letter] for letter in arguments))


class Functions:
    """OpenGL functions such as ``gl.Clear(...)``, from a loader of addresses."""

    #: The context's capabilities.
    has: Capabilities

    def __init__(self, address_of: Callable[[str], int], backend: str = "gl") -> None:
        #: The name with which messages begin.
        self.backend = backend
        for entry in SIGNATURES.split():
            name, kind = _prototype(entry)
            address = address_of(f"gl{name}")
            if not address:
                raise DeviceMissingError(
                    f"this OpenGL driver has no gl{name}; passgraph needs OpenGL 3.3 or OpenGL ES 3.0"
                )
            setattr(self, name, kind(address))
        self.has = capabilities_of(self)
        for entries, where in OPTIONAL.items():
            ending = self.has.ending(where)
            for entry in entries.split():
                name, kind = _prototype(entry)
                address = 0 if ending is None else address_of(f"gl{name}{ending}")
                setattr(self, name, kind(address) if address else None)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"gl{name} is not in passgraph.backends.gl.gl_functions.SIGNATURES or OPTIONAL")

    def integer(self, what: int) -> int:
        """Return the first number of a limit (for pairs the width)."""
        values = (ctypes.c_int * 4)()
        self.GetIntegerv(what, values)
        return values[0]

    def attachment(self, point: int, what: int) -> int:
        """Return a property of an attachment of the bound draw framebuffer; 0 if nothing is attached."""
        value = ctypes.c_int(0)
        self.GetFramebufferAttachmentParameteriv(DRAW_FRAMEBUFFER, point, what, ctypes.byref(value))
        return value.value

    def depth_range(self, near: float, far: float) -> None:
        (self.DepthRange or self.DepthRangef)(near, far)

    def draw_buffer(self, buffer: int) -> None:
        """Select the color buffer of framebuffer 0 that is drawn into."""
        if self.DrawBuffer is not None:
            self.DrawBuffer(buffer)
        else:
            self.DrawBuffers(1, (ctypes.c_uint * 1)(buffer))

    def level(self, target: int, level: int, what: int) -> int:
        """Return a property of a level of the bound texture."""
        value = ctypes.c_int(0)
        self.GetTexLevelParameteriv(target, level, what, ctypes.byref(value))
        return value.value

    def texture_parameter(self, target: int, what: int, missing: int) -> int:
        """Return a parameter of the bound texture; ``missing`` if this version lacks it."""
        value = ctypes.c_int(missing)
        self.GetTexParameteriv(target, what, ctypes.byref(value))
        return value.value

    def renderbuffer(self, what: int) -> int:
        """Return a property of the bound renderbuffer."""
        value = ctypes.c_int(0)
        self.GetRenderbufferParameteriv(RENDERBUFFER, what, ctypes.byref(value))
        return value.value

    def text(self, what: int) -> str:
        return (self.GetString(what) or b"").decode(errors="replace")

    def new(self, kind: str) -> int:
        """Return the name of a new object: ``Texture``, ``Buffer``, ``Framebuffer`` or ``VertexArray``."""
        name = ctypes.c_uint(0)
        getattr(self, f"Gen{kind}s")(1, ctypes.byref(name))
        return name.value

    def delete(self, kind: str, name: int) -> None:
        if kind == "Program":
            self.DeleteProgram(name)
        else:
            getattr(self, f"Delete{kind}s")(1, ctypes.byref(ctypes.c_uint(name)))

    def drain(self) -> list[int]:
        """Clear and return pending errors that other code left."""
        errors: list[int] = []
        while len(errors) < 16 and (error := self.GetError()) != NO_ERROR:
            errors.append(error)
        return errors

    def fail_again(self, errors: Iterable[int], shader: int) -> None:
        """Raise errors again that were drained, for the code that queries them; ``shader`` is any shader.  Out of
        memory and stack overflows of compatibility contexts cannot be raised."""
        for error in errors:
            if error == 0x500:
                self.Enable(0)
            elif error == 0x501:
                self.Viewport(0, 0, -1, -1)
            elif error == 0x502:
                self.UseProgram(shader)
            elif error == 0x506:
                empty = self.new("Framebuffer")
                self.BindFramebuffer(READ_FRAMEBUFFER, empty)
                self.ReadPixels(0, 0, 0, 0, 0x1908, 0x1401, None)
                self.BindFramebuffer(READ_FRAMEBUFFER, 0)
                self.delete("Framebuffer", empty)

    def check(self, doing: str, name: str | None = None) -> None:
        """Raise BackendError if a call failed since the last check."""
        error = self.GetError()
        if error != NO_ERROR:
            self.drain()
            what = ERRORS.get(error, hex(error))
            doing = doing if name is None else f"{doing} {name!r}"
            mend = "; use smaller or fewer targets" if error == OUT_OF_MEMORY else ""
            raise BackendError(f"{self.backend}: {what} while {doing}{mend}")
