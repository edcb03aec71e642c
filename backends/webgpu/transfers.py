"""Transfer pictures between the caller's memory and textures; the host does the rounding."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.driver import shaped
from passgraph.backends.printing import Listing
from passgraph.backends.webgpu.textures import Texture
from passgraph.backends.webgpu.wgsl import FULLSCREEN
from passgraph.language.source import NOWHERE
from passgraph.quantise import convert, converted, transfer_format

if TYPE_CHECKING:
    from passgraph.backends.webgpu.backend import WebGPUBackend

#: Alignment in bytes of rows in buffers.
ROW_ALIGNMENT = 256


def send(backend: WebGPUBackend, texture: Texture, numbers: NDArray[Any]) -> None:
    """Upload numbers in a texture's format."""
    given, (width, height) = texels(texture, numbers), texture.size
    backend.flush()
    layout = {"bytes_per_row": width * texture.stored.format.bytes_per_pixel}
    backend.device.queue.write_texture({"texture": texture.texture}, given, layout, (width, height, 1))


def texels(texture: Texture, numbers: NDArray[Any]) -> NDArray[Any]:
    """Return numbers of a format as a texture stores them."""
    return np.ascontiguousarray(converted(shaped(numbers, texture), texture.format, texture.stored.format))


def receive(backend: WebGPUBackend, texture: Texture, into: NDArray[Any]) -> None:
    """Download a texture into an array: as values for float32, else unconverted."""
    room, stored, (width, height) = shaped(into, texture), texture.stored.format, texture.size
    pixel = stored.bytes_per_pixel
    row = -(-width * pixel // ROW_ALIGNMENT) * ROW_ALIGNMENT
    buffer = backend.staging(row * height)
    source = {"texture": texture.texture}
    backend.encoder().copy_texture_to_buffer(source, {"buffer": buffer, "bytes_per_row": row}, (width, height, 1))
    backend.flush()
    buffer.map_sync("READ", 0, row * height)
    try:
        raw = np.frombuffer(buffer.read_mapped(0, row * height, copy=False), np.uint8).reshape(height, row)
        numbers = raw[:, : width * pixel].view(stored.number).reshape(height, width, stored.channels)
        convert(numbers, stored, room, transfer_format(into, texture.format))
        del raw, numbers
    finally:
        buffer.unmap()


#: Copies values to depth or back, which transfer commands cannot do in all formats.
_MOVE = """@group(0) @binding(0) var values: texture_2d<f32>;
@fragment
fn main(@builtin(position) place: vec4<f32>) -> RESULT
{
    return textureLoad(values, vec2<i32>(place.xy), 0).r;
}
"""
_RESULTS = {True: "@builtin(frag_depth) f32", False: "@location(0) f32"}


def copy_pass(
    backend: WebGPUBackend, source: Texture, key: tuple[str, ...], code: str, targets: list[dict[str, Any]],
    **state: Any,
) -> tuple[Any, Any]:  # fmt: skip
    """Return the pipeline and the bind group of a full-screen pass that reads one texture.

    ``key`` names the pipeline in the backend's cache; ``code`` is its fragment shader, with the texture at binding 0.
    """
    device, programs = backend.device, backend.programs
    entry = {"binding": 0, "visibility": 2, "texture": {"sample_type": "unfilterable-float"}}
    layout = programs.once("one texture", lambda: device.create_bind_group_layout(entries=[entry]))
    shown = programs.module(Listing(code, (NOWHERE,)), key[0])
    corners = programs.module(Listing(FULLSCREEN, (NOWHERE,)), "fullscreen")
    pipeline = programs.once(
        key,
        lambda: device.create_render_pipeline(
            layout=device.create_pipeline_layout(bind_group_layouts=[layout]),
            vertex={"module": corners, "entry_point": "main"},
            primitive={"topology": "triangle-list"},
            fragment={"module": shown, "entry_point": "main", "targets": targets},
            **state,
        ),
    )
    return pipeline, device.create_bind_group(layout=layout, entries=[{"binding": 0, "resource": source.read_view}])


def move_depth(backend: WebGPUBackend, source: Texture, destination: Texture) -> None:
    """Move values from 0 to 1 between a depth texture and a float32 texture; a stencil becomes 0."""
    to_depth, name = destination.format.is_depth, destination.stored.name
    written = {"format": name, "depth_write_enabled": True, "depth_compare": "always"} if to_depth else None
    code, targets = _MOVE.replace("RESULT", _RESULTS[to_depth]), [] if to_depth else [{"format": name}]
    pipeline, group = copy_pass(backend, source, ("move depth", name), code, targets, depth_stencil=written)
    color = {"view": destination.view, "load_op": "load", "store_op": "store"}
    depth: dict[str, Any] = {
        "view": destination.view, "depth_load_op": "clear", "depth_store_op": "store", "depth_clear_value": 0.0,
    }  # fmt: skip
    if destination.format.stencil:
        depth |= {"stencil_load_op": "clear", "stencil_store_op": "store", "stencil_clear_value": 0}
    attached = {"color_attachments": [], "depth_stencil_attachment": depth} if to_depth else {
        "color_attachments": [color]}  # fmt: skip
    encoded = backend.encoder().begin_render_pass(**attached)
    encoded.set_pipeline(pipeline)
    encoded.set_bind_group(0, group)
    encoded.draw(3)
    encoded.end()
