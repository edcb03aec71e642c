"""Probes on WebGPU, on the device of an open backend: wgpu's, or a browser's."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.verify.probes.probe import Language, NotHereError, Program

#: Format → WebGPU's name, NumPy's type.
FORMATS = {"rgba8": ("rgba8unorm", np.uint8), "rgba8_srgb": ("rgba8unorm-srgb", np.uint8),
           "rgba16": ("rgba16unorm", np.uint16), "rgba16f": ("rgba16float", np.float16)}  # fmt: skip
_TRIANGLE = """@vertex fn corners(@builtin(vertex_index) n: u32) -> @builtin(position) vec4<f32>
{ return vec4<f32>(vec2<f32>(f32(n & 1u), f32(n >> 1u)) * 4.0 - 1.0, 0.0, 1.0); }
"""
_ROWS = "@group(0) @binding(0) var<storage, read> rows: array<vec4<u32>>;\n"
_WORDS = """let a = bitcast<f32>(words.x); let b = bitcast<f32>(words.y); let c = bitcast<f32>(words.z);
    let d = bitcast<f32>(words.w); let i = bitcast<i32>(words.x); let j = bitcast<i32>(words.y);
    let k = bitcast<i32>(words.z); let l = bitcast<i32>(words.w); let u = words.x; let v = words.y;
"""
_TYPES = {"float": "f32", "int": "i32", "uint": "u32"}
_COLOR = """@fragment fn color(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32>
{ return bitcast<vec4<f32>>(rows[u32(at.x)]); }
"""
_LOAD = """@group(0) @binding(0) var image: texture_2d<f32>;
@fragment fn color(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32>
{ return bitcast<vec4<u32>>(textureLoad(image, vec2<i32>(at.xy), 0)); }
"""
_SAMPLE = """@group(0) @binding(1) var image: texture_2d<f32>; @group(0) @binding(2) var how: sampler;
@fragment fn color(@builtin(position) at: vec4<f32>) -> @location(0) vec4<u32>
{
    let read = textureSampleLevel(image, how, vec2<f32>(bitcast<f32>(rows[u32(at.x)].x), 0.5), 0.0);
    return bitcast<vec4<u32>>(read);
}
"""
_COVER = """@vertex fn corners(@location(0) corner: vec2<f32>) -> @builtin(position) vec4<f32>
{ return vec4<f32>(corner.x / SIZE.x * 2.0 - 1.0, 1.0 - corner.y / SIZE.y * 2.0, 0.0, 1.0); }
@fragment fn color() -> @location(0) vec4<f32> { return vec4<f32>(1.0); }
"""
#: Bytes of the rows of a buffer that a picture is copied to.
_ALIGNED = 256


def _body(program: Program) -> str:
    return f"{_WORDS} var r: {_TYPES[program.result]}; {program.code} let bits = bitcast<u32>(r);"


def compute_text(program: Program) -> str:
    """Return the compute shader that writes the bits of each row's result."""
    return f"""{_ROWS}{program.before}
@group(0) @binding(1) var<storage, read_write> results: array<u32>;
@compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3<u32>)
{{ let words = rows[id.x]; {_body(program)} results[id.x] = bits; }}
"""


class WebGPUBench:
    """The device of an open WebGPU backend."""

    language: Language = "wgsl"

    def __init__(self, backend: Any) -> None:
        self.device, self.wgpu = backend.device, backend.wgpu

    def compute(self, program: Program, rows: NDArray[np.uint32]) -> NDArray[np.uint32]:
        body, before = _body(program), _ROWS + program.before
        if program.stage == "compute":
            return self._computed(compute_text(program), rows)
        if program.stage == "vertex":
            text = f"""{before}
struct Corner {{ @builtin(position) place: vec4<f32>, @location(0) @interpolate(flat) bits: u32 }};
@vertex fn corners(@builtin(vertex_index) n: u32) -> Corner {{
    let words = rows[n]; {body}
    return Corner(vec4<f32>((f32(n) + 0.5) / {len(rows)}.0 * 2.0 - 1.0, 0.0, 0.0, 1.0), bits);
}}
@fragment fn color(corner: Corner) -> @location(0) u32 {{ return corner.bits; }}
"""
            drawn = self._drawn(text, "r32uint", np.uint32, 1, len(rows), [self._rows(rows)], points=True)
            return drawn[:, 0]
        text = f"""{_TRIANGLE}{before}
@fragment fn color(@builtin(position) at: vec4<f32>) -> @location(0) u32
{{ let words = rows[u32(at.x)]; {body} return bits; }}
"""
        return self._drawn(text, "r32uint", np.uint32, 1, len(rows), [self._rows(rows)])[:, 0]

    def _computed(self, text: str, rows: NDArray[np.uint32]) -> NDArray[np.uint32]:
        module, usage = self.device.create_shader_module(code=text), self.wgpu.BufferUsage
        pipeline = self.device.create_compute_pipeline(layout="auto", compute={"module": module, "entry_point": "main"})
        size = 4 * len(rows)
        results = self.device.create_buffer(size=size, usage=usage.STORAGE | usage.COPY_SRC)
        read = self.device.create_buffer(size=size, usage=usage.MAP_READ | usage.COPY_DST)
        encoder = self.device.create_command_encoder()
        computing = encoder.begin_compute_pass()
        computing.set_pipeline(pipeline)
        computing.set_bind_group(0, self._group(pipeline, [self._rows(rows), {"buffer": results}]))
        computing.dispatch_workgroups(len(rows))
        computing.end()
        encoder.copy_buffer_to_buffer(results, 0, read, 0, size)
        return np.frombuffer(self._submitted(encoder, read, size), np.uint32)

    def store(self, format: str, values: NDArray[np.float32], times: int = 0) -> NDArray[Any]:
        name, dtype = self._format(format)
        rows = self._rows(values.view(np.uint32))
        return self._drawn(_TRIANGLE + _ROWS + _COLOR, name, dtype, 4, len(values), [rows], times)

    def load(self, format: str, numbers: NDArray[Any]) -> NDArray[np.float32]:
        view = self._texture(format, numbers)
        return self._drawn(_TRIANGLE + _LOAD, "rgba32uint", np.float32, 4, len(numbers), [view])

    def sample(self, texels: NDArray[np.uint8], at: NDArray[np.float32], linear: bool) -> NDArray[np.float32]:
        rows = np.zeros((len(at), 4), np.float32)
        rows[:, 0] = at
        mode = "linear" if linear else "nearest"
        sampler = self.device.create_sampler(min_filter=mode, mag_filter=mode)
        bound = [self._rows(rows.view(np.uint32)), self._texture("rgba8", np.repeat(texels[:, None], 4, 1)), sampler]
        return self._drawn(_TRIANGLE + _ROWS + _SAMPLE, "rgba32uint", np.float32, 4, len(at), bound)[:, 0]

    def cover(self, corners: NDArray[np.float32], size: tuple[int, int], samples: int = 1) -> NDArray[np.float32]:
        usage = self.wgpu.BufferUsage
        buffer = self.device.create_buffer(size=corners.nbytes, usage=usage.VERTEX | usage.COPY_DST)
        self.device.queue.write_buffer(buffer, 0, corners)
        module = self.device.create_shader_module(
            code=_COVER.replace("SIZE.x", f"{size[0]}.0").replace("SIZE.y", f"{size[1]}.0")
        )
        corner = {"format": "float32x2", "offset": 0, "shader_location": 0}
        pipeline = self.device.create_render_pipeline(
            layout="auto",
            vertex={
                "module": module, "entry_point": "corners",
                "buffers": [{"array_stride": 8, "step_mode": "vertex", "attributes": [corner]}],
            },
            primitive={"topology": "triangle-list"},
            multisample={"count": samples},
            fragment={"module": module, "entry_point": "color", "targets": [{"format": "rgba8unorm"}]},
        )  # fmt: skip
        target = self._target("rgba8unorm", size)
        attached: dict[str, Any] = {"view": target.create_view(), **self._clear()}
        if samples > 1:
            many = self._target("rgba8unorm", size, samples)
            attached = {"view": many.create_view(), "resolve_target": target.create_view(), **self._clear()}
        encoder = self.device.create_command_encoder()
        drawn = encoder.begin_render_pass(color_attachments=[attached])
        drawn.set_pipeline(pipeline)
        drawn.set_vertex_buffer(0, buffer)
        drawn.draw(corners.size // 2)
        drawn.end()
        pixels = self._read(encoder, target, size, np.uint8, 4)
        return pixels.reshape(size[1], size[0], 4)[..., 0].astype(np.float32) / np.float32(255)

    def mipmap(self, texels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        raise NotHereError("WebGPU makes no mipmaps")

    def _format(self, format: str) -> tuple[str, Any]:
        if format == "rgba16" and "texture-format16bit-norm" not in self.device.features:
            raise NotHereError("no rgba16 textures")
        return FORMATS[format]

    @staticmethod
    def _clear() -> dict[str, Any]:
        return {"load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 0)}

    def _rows(self, rows: NDArray[np.uint32]) -> dict[str, Any]:
        usage = self.wgpu.BufferUsage
        buffer = self.device.create_buffer(size=rows.nbytes, usage=usage.STORAGE | usage.COPY_DST)
        self.device.queue.write_buffer(buffer, 0, np.ascontiguousarray(rows))
        return {"buffer": buffer}

    def _texture(self, format: str, numbers: NDArray[Any]) -> Any:
        name, dtype = self._format(format)
        content, usage = np.ascontiguousarray(numbers.astype(dtype)), self.wgpu.TextureUsage
        size = len(content), 1, 1
        made = self.device.create_texture(size=size, format=name, usage=usage.TEXTURE_BINDING | usage.COPY_DST)
        self.device.queue.write_texture({"texture": made}, content, {"bytes_per_row": content.nbytes}, size)
        return made.create_view()

    def _target(self, name: str, size: tuple[int, int], samples: int = 1) -> Any:
        usage = self.wgpu.TextureUsage
        uses = usage.RENDER_ATTACHMENT | (usage.COPY_SRC if samples == 1 else 0)
        return self.device.create_texture(size=(*size, 1), format=name, usage=uses, sample_count=samples)

    def _group(self, pipeline: Any, bound: list[Any]) -> Any:
        entries = [{"binding": k, "resource": resource} for k, resource in enumerate(bound)]
        return self.device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)

    def _drawn(
        self, text: str, name: str, dtype: Any, channels: int, width: int, bound: list[Any], times: int = 0,
        points: bool = False,
    ) -> NDArray[Any]:  # fmt: skip
        """Draw over a target of one row, and return its numbers; with ``times``, add so often."""
        module = self.device.create_shader_module(code=text)
        added = {"src_factor": "src-alpha", "dst_factor": "one", "operation": "add"}
        blended = {"blend": {"color": added, "alpha": added}} if times else {}
        pipeline = self.device.create_render_pipeline(
            layout="auto",
            vertex={"module": module, "entry_point": "corners"},
            primitive={"topology": "point-list" if points else "triangle-list"},
            fragment={"module": module, "entry_point": "color", "targets": [{"format": name, **blended}]},
        )
        target = self._target(name, (width, 1))
        encoder = self.device.create_command_encoder()
        drawn = encoder.begin_render_pass(color_attachments=[{"view": target.create_view(), **self._clear()}])
        drawn.set_pipeline(pipeline)
        drawn.set_bind_group(0, self._group(pipeline, bound))
        for _ in range(max(1, times)):
            drawn.draw(width if points else 3)
        drawn.end()
        return self._read(encoder, target, (width, 1), dtype, channels)

    def _read(self, encoder: Any, target: Any, size: tuple[int, int], dtype: Any, channels: int) -> NDArray[Any]:
        bytes_ = size[0] * channels * np.dtype(dtype).itemsize
        row, usage = -(-bytes_ // _ALIGNED) * _ALIGNED, self.wgpu.BufferUsage
        buffer = self.device.create_buffer(size=row * size[1], usage=usage.MAP_READ | usage.COPY_DST)
        place = {"buffer": buffer, "bytes_per_row": row, "rows_per_image": size[1]}
        encoder.copy_texture_to_buffer({"texture": target}, place, (*size, 1))
        raw = np.frombuffer(self._submitted(encoder, buffer, row * size[1]), np.uint8).reshape(size[1], row)
        numbers: NDArray[Any] = np.ascontiguousarray(raw[:, :bytes_]).view(dtype).reshape(-1, channels)
        return numbers

    def _submitted(self, encoder: Any, buffer: Any, size: int) -> bytes:
        self.device.queue.submit([encoder.finish()])
        buffer.map_sync("READ", 0, size)
        return bytes(buffer.read_mapped(0, size, copy=True))
