"""Run one fragment shader on WebGPU and hold its result against what is allowed: python reproduce.py

Needs numpy and wgpu. Exit status 1: a value is outside of what is allowed.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import wgpu
from case import CASE, SIZE, image, parameters, source, verdict


def main() -> int:
    adapters = [one for one in wgpu.gpu.enumerate_adapters_sync() if one.info["backend_type"] != "OpenGL"]
    adapter = next((one for one in adapters if CASE["device"]["name"] in one.info["device"]), adapters[0])
    device = adapter.request_device_sync(required_features=CASE["features"])
    usage, buffers = wgpu.TextureUsage, wgpu.BufferUsage

    def texture(name: str, size: tuple[int, int], use: int) -> Any:
        return device.create_texture(size=(*size, 1), format=name, usage=use)

    fragment = wgpu.ShaderStage.FRAGMENT
    block = device.create_buffer_with_data(data=parameters("parameters.bin"), usage=buffers.UNIFORM)
    bound: list[tuple[dict[str, Any], Any]] = [
        ({"binding": CASE["parameters"], "buffer": {"type": "uniform"}}, {"buffer": block}),
        ({"binding": CASE["nearest"], "sampler": {"type": "non-filtering"}}, device.create_sampler()),
    ]
    for number, mode in enumerate(CASE["modes"]):
        sampler = device.create_sampler(
            min_filter="linear", mag_filter="linear", address_mode_u=mode, address_mode_v=mode
        )
        bound.append(({"binding": CASE["linear"] + number, "sampler": {"type": "filtering"}}, sampler))
    for number, (name, channels, _) in enumerate(CASE["images"]):
        numbers = image(number, channels)
        height, width = numbers.shape[:2]
        read = texture(name, (width, height), usage.TEXTURE_BINDING | usage.COPY_DST)
        rows = {"offset": 0, "bytes_per_row": numbers[0].nbytes, "rows_per_image": height}
        device.queue.write_texture({"texture": read}, numbers.tobytes(), rows, (width, height, 1))
        entry = {"binding": CASE["first_image"] + number, "texture": {"sample_type": "unfilterable-float"}}
        bound.append((entry, read.create_view()))
    layout = device.create_bind_group_layout(entries=[{**entry, "visibility": fragment} for entry, _ in bound])
    group = device.create_bind_group(
        layout=layout, entries=[{"binding": entry["binding"], "resource": resource} for entry, resource in bound]
    )
    vertex, shader = (device.create_shader_module(code=source(name)) for name in ("corners.wgsl", "pass.wgsl"))
    pipeline = device.create_render_pipeline(
        layout=device.create_pipeline_layout(bind_group_layouts=[layout]),
        vertex={"module": vertex, "entry_point": "main"},
        primitive={"topology": "triangle-list"},
        fragment={
            "module": shader, "entry_point": "main", "targets": [{"format": name} for name, _, _ in CASE["outputs"]]
        },
    )  # fmt: skip
    targets = [texture(name, SIZE, usage.RENDER_ATTACHMENT | usage.COPY_SRC) for name, _, _ in CASE["outputs"]]
    encoder = device.create_command_encoder()
    clear = {"load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 0)}
    drawn = encoder.begin_render_pass(color_attachments=[{"view": target.create_view(), **clear} for target in targets])
    drawn.set_pipeline(pipeline)
    drawn.set_bind_group(0, group)
    drawn.draw(3)
    drawn.end()
    device.queue.submit([encoder.finish()])
    results = []
    for target, (_, channels, type_) in zip(targets, CASE["outputs"], strict=True):
        rows = {"offset": 0, "bytes_per_row": SIZE[0] * channels * np.dtype(type_).itemsize, "rows_per_image": SIZE[1]}
        data = device.queue.read_texture({"texture": target}, rows, (*SIZE, 1))
        results.append(np.frombuffer(data, type_).reshape(SIZE[1], SIZE[0], channels))
    info = adapter.info
    return verdict(f"{info['device']}; {info['description']}; {info['backend_type']}", results)


if __name__ == "__main__":
    sys.exit(main())
