"""Probes on OpenGL, with moderngl in a context of its own."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.verify.probes.probe import Language, NotHereError, Program

#: Format → channels of its texture, moderngl's name of their type, OpenGL's internal format, NumPy's type.
FORMATS = {"rgba8": ("f1", 0x8058, np.uint8), "rgba8_srgb": ("f1", 0x8C43, np.uint8),
           "rgba16": ("nu2", 0x805B, np.uint16), "rgba16f": ("f2", 0x881A, np.float16)}  # fmt: skip
_FRAMEBUFFER_SRGB = 0x8DB9
_TRIANGLE = "void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }\n"
_WORDS = """
float a = uintBitsToFloat(words.x), b = uintBitsToFloat(words.y), c = uintBitsToFloat(words.z);
float d = uintBitsToFloat(words.w);
int i = int(words.x), j = int(words.y), k = int(words.z), l = int(words.w); uint u = words.x, v = words.y;
"""
_BITS = {"float": "floatBitsToUint(r)", "int": "uint(r)", "uint": "r"}
_COLOR = """uniform usampler2D rows; out vec4 color;
void main() { color = uintBitsToFloat(texelFetch(rows, ivec2(gl_FragCoord.xy), 0)); }
"""
_LOAD = """uniform sampler2D image; out vec4 color;
void main() { color = texelFetch(image, ivec2(gl_FragCoord.xy), 0); }
"""
_SAMPLE = """uniform sampler2D image; uniform usampler2D rows; out vec4 color;
void main() {
    float at = uintBitsToFloat(texelFetch(rows, ivec2(gl_FragCoord.xy), 0)).x;
    color = textureLod(image, vec2(at, 0.5), 0.0);
}
"""
_CORNERS = """in vec2 corner; uniform vec2 size;
void main() { gl_Position = vec4(corner / size * 2.0 - 1.0, 0.0, 1.0); }
"""
_WHITE = "out vec4 color; void main() { color = vec4(1.0); }\n"


_READ = "uvec4 words = texelFetch(rows, ivec2({}, 0), 0);"


def _body(program: Program) -> str:
    return f"{_WORDS}{program.qualifier} {program.result} r; {program.code} bits = {_BITS[program.result]};"


def fragment_text(program: Program, header: str = "") -> str:
    """Return the fragment shader that writes the bits of each row's result."""
    header = header or f"#version {max(program.version, 330)} core\n"
    read = _READ.format("gl_FragCoord.x")
    main = f"void main() {{ {read} {_body(program)} }}\n"
    return f"{header}{program.before}\nuniform usampler2D rows; out uint bits;\n{main}"


def piglit_text(program: Program) -> str:
    """Return the fragment shader that draws green where the result of a uniform's words is the expected one."""
    main = f"void main() {{ uint bits; {_body(program)} color = vec4(bits != expected, bits == expected, 0.0, 1.0); }}"
    return f"{program.before}\nuniform uvec4 words; uniform uint expected; out vec4 color;\n{main}\n"


class GLBench:
    """A context of device ``index``."""

    language: Language = "glsl"

    def __init__(self, index: int = 0) -> None:
        import moderngl

        egl: dict[str, Any] = {"backend": "egl", "device_index": index} if sys.platform == "linux" else {}
        self.context = moderngl.create_context(standalone=True, **egl)
        self.moderngl = moderngl
        self.header = f"#version {min(self.context.version_code, 450)} core\n"

    def compute(self, program: Program, rows: NDArray[np.uint32]) -> NDArray[np.uint32]:
        if self.context.version_code < program.version:
            raise NotHereError(f"no GLSL {program.version / 100:.2f}")
        count, header, body = len(rows), self.header + program.before + "\n", _body(program)
        if program.stage == "vertex":
            index = _READ.format("gl_VertexID")
            text = f"{header}uniform usampler2D rows; flat out uint bits;\nvoid main() {{ {index} {body} }}\n"
            made = self.context.program(vertex_shader=text, varyings=("bits",))
            self._texture(4, "u4", None, rows).use(0)
            buffer = self.context.buffer(reserve=4 * count)
            self.context.vertex_array(made, []).transform(buffer, self.moderngl.POINTS, vertices=count)
            return np.frombuffer(buffer.read(), np.uint32)
        if program.stage == "compute":
            return self._computed(header, body, rows)
        text = fragment_text(program, self.header)
        self._texture(4, "u4", None, rows).use(0)
        return self._drawn(text, self._texture(1, "u4", None, count))[:, 0]

    def _computed(self, header: str, body: str, rows: NDArray[np.uint32]) -> NDArray[np.uint32]:
        if self.context.version_code < 430:
            raise NotHereError("no compute shaders")
        text = (
            f"{header}layout(local_size_x = 1) in; layout(std430, binding = 0) buffer In {{ uvec4 rows[]; }};\n"
            "layout(std430, binding = 1) buffer Out { uint results[]; };\n"
            f"void main() {{ uvec4 words = rows[gl_GlobalInvocationID.x]; uint bits; {body}"
            " results[gl_GlobalInvocationID.x] = bits; }\n"
        )
        given, buffer = self.context.buffer(rows.tobytes()), self.context.buffer(reserve=4 * len(rows))
        given.bind_to_storage_buffer(0)
        buffer.bind_to_storage_buffer(1)
        self.context.compute_shader(text).run(len(rows))
        self.context.memory_barrier()
        return np.frombuffer(buffer.read(), np.uint32)

    def store(self, format: str, values: NDArray[np.float32], times: int = 0) -> NDArray[Any]:
        target = self._stored(format, len(values))
        self._texture(4, "u4", None, values.view(np.uint32)).use(0)
        if times:
            self.context.enable(self.moderngl.BLEND)
            self.context.blend_func = self.moderngl.SRC_ALPHA, self.moderngl.ONE
        if format == "rgba8_srgb":
            self.context.enable_direct(_FRAMEBUFFER_SRGB)
        try:
            return self._drawn(self.header + _COLOR, target, max(1, times))
        finally:
            self.context.disable(self.moderngl.BLEND)
            self.context.disable_direct(_FRAMEBUFFER_SRGB)

    def load(self, format: str, numbers: NDArray[Any]) -> NDArray[np.float32]:
        self._stored(format, numbers).use(0)
        return self._drawn(self.header + _LOAD, self._texture(4, "f4", None, len(numbers)))

    def sample(self, texels: NDArray[np.uint8], at: NDArray[np.float32], linear: bool) -> NDArray[np.float32]:
        image = self._stored("rgba8", np.repeat(texels[:, None], 4, 1))
        kind = self.moderngl.LINEAR if linear else self.moderngl.NEAREST
        image.filter = kind, kind
        image.use(0)
        rows = np.zeros((len(at), 4), np.float32)
        rows[:, 0] = at
        self._texture(4, "u4", None, rows.view(np.uint32)).use(1)
        return self._drawn(self.header + _SAMPLE, self._texture(4, "f4", None, len(at)), image=0, rows=1)[:, 0]

    def cover(self, corners: NDArray[np.float32], size: tuple[int, int], samples: int = 1) -> NDArray[np.float32]:
        if samples > self.context.max_samples:
            raise NotHereError(f"no {samples} samples")
        program = self.context.program(vertex_shader=self.header + _CORNERS, fragment_shader=self.header + _WHITE)
        program["size"] = size
        array = self.context.vertex_array(program, [(self.context.buffer(corners.tobytes()), "2f", "corner")])
        whole = self.context.framebuffer([self.context.texture(size, 4, dtype="f1")])
        if samples == 1:
            drawn = whole
        else:
            drawn = self.context.framebuffer([self.context.renderbuffer(size, 4, samples=samples, dtype="f1")])
        drawn.use()
        drawn.clear()
        array.render(self.moderngl.TRIANGLES)
        if samples > 1:
            self.context.copy_framebuffer(whole, drawn)
        pixels = np.frombuffer(whole.read(components=4, alignment=1), np.uint8)
        return pixels.reshape(size[1], size[0], 4)[..., 0].astype(np.float32) / np.float32(255)

    def mipmap(self, texels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        height, width = texels.shape
        pixels = np.repeat(texels[..., None], 4, 2)
        texture = self.context.texture((width, height), 4, pixels.tobytes(), alignment=1, dtype="f1")
        texture.build_mipmaps(0, 1)
        shape = max(1, height // 2), max(1, width // 2), 4
        return np.frombuffer(texture.read(level=1, alignment=1), np.uint8).reshape(shape)[..., 0]

    def compiles(self, text: str) -> bool:
        """Return True if the driver compiles a fragment shader."""
        try:
            self.context.program(vertex_shader=self.header + _TRIANGLE, fragment_shader=self.header + text)
        except self.moderngl.Error:
            return False
        return True

    def draw(self, text: str, size: tuple[int, int]) -> NDArray[np.float32]:
        """Return what a fragment shader writes to a float32 picture, row 0 at y = 0."""
        target = self.context.texture(size, 4, dtype="f4")
        return self._drawn(self.header + text, target).reshape(size[1], size[0], 4)

    def _stored(self, format: str, content: NDArray[Any] | int) -> Any:
        type_, internal, dtype = FORMATS[format]
        return self._texture(4, type_, internal, content if isinstance(content, int) else content.astype(dtype))

    def _texture(self, channels: int, type_: str, internal: int | None, content: NDArray[Any] | int) -> Any:
        """Return a texture of one row, with its content or of a width."""
        width, data = (content, None) if isinstance(content, int) else (len(content), content.tobytes())
        texture = self.context.texture((width, 1), channels, data, alignment=1, dtype=type_, internal_format=internal)
        texture.filter = self.moderngl.NEAREST, self.moderngl.NEAREST
        texture.repeat_x = texture.repeat_y = False
        return texture

    def _drawn(self, text: str, target: Any, times: int = 1, **units: int) -> NDArray[Any]:
        """Draw a triangle over a target, and return its numbers, a pixel a row."""
        program = self.context.program(vertex_shader=self.header + _TRIANGLE, fragment_shader=text)
        for name, unit in units.items():
            program[name] = unit
        framebuffer = self.context.framebuffer([target])
        framebuffer.use()
        framebuffer.clear()
        array = self.context.vertex_array(program, [])
        for _ in range(times):
            array.render(self.moderngl.TRIANGLES, vertices=3)
        dtype = {"f1": np.uint8, "nu2": np.uint16, "f2": np.float16, "f4": np.float32, "u4": np.uint32}[target.dtype]
        return np.frombuffer(target.read(alignment=1), dtype).reshape(-1, target.components)
