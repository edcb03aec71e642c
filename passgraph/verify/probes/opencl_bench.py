"""Probes on OpenCL, in the context of an open backend."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.verify.probes.probe import Language, NotHereError, Program

_KERNEL = """
{before}
__kernel void probe(__global const uint4 *rows, __global uint *results)
{{
    uint4 words = rows[get_global_id(0)];
    float a = as_float(words.x), b = as_float(words.y), c = as_float(words.z), d = as_float(words.w);
    int i = (int)words.x, j = (int)words.y, k = (int)words.z, l = (int)words.w;
    uint u = words.x, v = words.y;
    {result} r;
    {code}
    results[get_global_id(0)] = as_uint(r);
}}
"""
_IMAGES = """
__kernel void store(__write_only image2d_t image, __global const float4 *values)
{ write_imagef(image, (int2)((int)get_global_id(0), 0), values[get_global_id(0)]); }
__kernel void load(__read_only image2d_t image, __global float4 *values)
{ values[get_global_id(0)] = read_imagef(image, CLK_FILTER_NEAREST | CLK_ADDRESS_NONE | CLK_NORMALIZED_COORDS_FALSE,
                                         (int2)((int)get_global_id(0), 0)); }
__kernel void sample_at(__read_only image2d_t image, sampler_t how, __global float4 *values)
{ values[get_global_id(0)] = read_imagef(image, how, (float2)(values[get_global_id(0)].x, 0.5f)); }
"""


def kernel_text(program: Program) -> str:
    return _KERNEL.format(before=program.before, result=program.result, code=program.code)


class OpenCLBench:
    """A device of an open OpenCL backend."""

    language: Language = "opencl"

    def __init__(self, backend: Any) -> None:
        import pyopencl as cl

        self.cl, self.device = cl, backend.device
        self.context, self.queue = backend.context, backend.queue
        types, orders = cl.channel_type, cl.channel_order
        self.formats = {
            "rgba8": (orders.RGBA, types.UNORM_INT8, np.uint8), "rgba8_srgb": (0x10C1, types.UNORM_INT8, np.uint8),
            "rgba16": (orders.RGBA, types.UNORM_INT16, np.uint16),
            "rgba16f": (orders.RGBA, types.HALF_FLOAT, np.float16),
        }  # fmt: skip

    def compute(self, program: Program, rows: NDArray[np.uint32]) -> NDArray[np.uint32]:
        if program.stage != "compute":
            raise NotHereError("no such stage")
        text = kernel_text(program)
        results = np.zeros(len(rows), np.uint32)
        given, room = self._buffer(rows), self._buffer(results)
        self._run(self._built(text, program.options).probe, len(rows), given, room)
        self.cl.enqueue_copy(self.queue, results, room)
        return results

    def store(self, format: str, values: NDArray[np.float32], times: int = 0) -> NDArray[Any]:
        if times:
            raise NotHereError("OpenCL has no blending")
        numbers = np.zeros((len(values), 4), self.formats[format][2])
        image = self._image(format, numbers, self.cl.mem_flags.WRITE_ONLY)
        self._run(self._built(_IMAGES).store, len(values), image, self._buffer(values))
        self.cl.enqueue_copy(self.queue, numbers, image, origin=(0, 0), region=(len(values), 1))
        return numbers

    def load(self, format: str, numbers: NDArray[Any]) -> NDArray[np.float32]:
        values = np.zeros((len(numbers), 4), np.float32)
        room = self._buffer(values)
        image = self._image(format, numbers, self.cl.mem_flags.READ_ONLY)
        self._run(self._built(_IMAGES).load, len(numbers), image, room)
        self.cl.enqueue_copy(self.queue, values, room)
        return values

    def sample(self, texels: NDArray[np.uint8], at: NDArray[np.float32], linear: bool) -> NDArray[np.float32]:
        values = np.zeros((len(at), 4), np.float32)
        values[:, 0] = at
        room = self._buffer(values)
        mode = self.cl.filter_mode.LINEAR if linear else self.cl.filter_mode.NEAREST
        sampler = self.cl.Sampler(self.context, True, self.cl.addressing_mode.CLAMP_TO_EDGE, mode)
        image = self._image("rgba8", np.repeat(texels[:, None], 4, 1), self.cl.mem_flags.READ_ONLY)
        self._run(self._built(_IMAGES).sample_at, len(at), image, sampler, room)
        self.cl.enqueue_copy(self.queue, values, room)
        return values[:, 0]

    def cover(self, corners: NDArray[np.float32], size: tuple[int, int], samples: int = 1) -> NDArray[np.float32]:
        raise NotHereError("OpenCL draws no triangles")

    def mipmap(self, texels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        raise NotHereError("OpenCL makes no mipmaps")

    def _built(self, text: str, options: tuple[str, ...] = ()) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # compilers talk even when all is well
            return self.cl.Program(self.context, text).build(list(options), [self.device])

    def _run(self, kernel: Any, count: int, *arguments: Any) -> None:
        kernel.set_args(*arguments)
        self.cl.enqueue_nd_range_kernel(self.queue, kernel, (count,), (1,))
        self.queue.finish()

    def _buffer(self, content: NDArray[Any]) -> Any:
        flags = self.cl.mem_flags.READ_WRITE | self.cl.mem_flags.COPY_HOST_PTR
        return self.cl.Buffer(self.context, flags, hostbuf=np.ascontiguousarray(content).copy())

    def _image(self, format: str, numbers: NDArray[Any], flags: Any) -> Any:
        order, type_, dtype = self.formats[format]
        kind = self.cl.mem_object_type.IMAGE2D
        known = {
            (one.channel_order, one.channel_data_type)
            for one in self.cl.get_supported_image_formats(self.context, flags, kind)
        }
        if not self.device.image_support or (order, type_) not in known:
            raise NotHereError(f"no {format} images")
        host = np.ascontiguousarray(numbers.astype(dtype))
        flags |= self.cl.mem_flags.COPY_HOST_PTR
        return self.cl.Image(self.context, flags, self.cl.ImageFormat(order, type_), (len(host), 1), hostbuf=host)
