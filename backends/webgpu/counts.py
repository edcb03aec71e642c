"""Count bins (`passgraph.plan.data.CountStep`) with a compute shader.

The invocations of a group walk through a row and count in a shared table; a pass then writes the tables' content. The
step's own program counts instead if the tables would be too large.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from passgraph.backends.base import Block
from passgraph.backends.printing import Listing
from passgraph.backends.webgpu.textures import Texture
from passgraph.backends.webgpu.wgsl import FULLSCREEN
from passgraph.language.source import NOWHERE
from passgraph.plan.data import CountStep

if TYPE_CHECKING:
    from passgraph.backends.webgpu.backend import WebGPUBackend

#: Invocations that count a row together.
GROUP = 64
_COUNT = """const bins = BINSu;
@group(0) @binding(0) var numbers: texture_2d<f32>;
@group(0) @binding(1) var<storage, read_write> counts: array<u32>;
var<workgroup> table: array<atomic<u32>, BINS>;
@compute @workgroup_size(GROUP)
fn main(@builtin(local_invocation_id) local: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>)
{
    let size = textureDimensions(numbers);
    for (var i = local.x; i < bins; i += GROUPu) { atomicStore(&table[i], 0u); }
    workgroupBarrier();
    let width = select(0u, size.x, group.x < size.y);
    for (var x = local.x; x < width; x += GROUPu) {
        let number = textureLoad(numbers, vec2<u32>(x, group.x), 0).r;
        let inside = number >= 1.0 && number <= f32(bins);
        let entry = u32(select(0.0, number, inside));
        if (inside && f32(entry) == number) { atomicAdd(&table[entry - 1u], 1u); }
    }
    workgroupBarrier();
    for (var i = local.x; i < bins; i += GROUPu) { counts[group.x * bins + i] = atomicLoad(&table[i]); }
}
"""
_WRITE = """@group(0) @binding(0) var<storage, read> counts: array<u32>;
@fragment
fn main(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32>
{
    let i = u32(place.y) * BINSu + 4u * u32(place.x);
    return vec4<f32>(vec4<u32>(counts[i], counts[i + 1u], counts[i + 2u], counts[i + 3u]));
}
"""


class CountRun:
    """The counting pass, compiled."""

    def __init__(self, backend: WebGPUBackend, step: CountStep) -> None:
        self.backend, self.step = backend, step
        bins, device, programs = step.bins, backend.device, backend.programs
        self.rows = step.size[1]
        self.buffer = backend.buffer(4 * self.rows * bins, "STORAGE", f"the tables of pass {step.name!r}")
        backend.free_with(self, self.buffer)
        read = {"binding": 0, "visibility": 4, "texture": {"sample_type": "unfilterable-float"}}
        counted = {"binding": 1, "visibility": 4, "buffer": {"type": "storage"}}
        written = {"binding": 0, "visibility": 2, "buffer": {"type": "read-only-storage"}}
        entries = [read, counted], [written]
        self.layouts = [
            programs.once(("count layout", number), partial(device.create_bind_group_layout, entries=group))
            for number, group in enumerate(entries)
        ]
        text = _COUNT.replace("BINS", str(bins)).replace("GROUP", str(GROUP))
        self.counting = programs.once(("count", bins), lambda: self._counting(text))
        self.writing = programs.once(("counts", bins), lambda: self._writing(str(bins)))
        resource = {"buffer": self.buffer, "offset": 0, "size": self.buffer.size}
        self.written = device.create_bind_group(layout=self.layouts[1], entries=[{"binding": 0, "resource": resource}])
        self.resource = resource

    def _counting(self, text: str) -> Any:
        device, module = self.backend.device, self.backend.programs.module(Listing(text, (NOWHERE,)), "count")
        layout = device.create_pipeline_layout(bind_group_layouts=[self.layouts[0]])
        return device.create_compute_pipeline(layout=layout, compute={"module": module, "entry_point": "main"})

    def _writing(self, bins: str) -> Any:
        device, programs = self.backend.device, self.backend.programs
        module = programs.module(Listing(_WRITE.replace("BINS", bins), (NOWHERE,)), "counts")
        return programs.pipeline(
            "counts",
            layout=device.create_pipeline_layout(bind_group_layouts=[self.layouts[1]]),
            vertex={"module": programs.module(Listing(FULLSCREEN, (NOWHERE,)), "fullscreen"), "entry_point": "main"},
            primitive={"topology": "triangle-list"},
            fragment={"module": module, "entry_point": "main", "targets": [{"format": "rgba32float"}]},
        )

    def __call__(self, outputs: Sequence[Texture], images: Sequence[Texture], block: Block) -> None:
        backend = self.backend
        with backend.reported(f"running pass {self.step.name!r}"):
            numbers = {"binding": 0, "resource": images[0].read_view}
            entries = [numbers, {"binding": 1, "resource": self.resource}]
            counted = backend.device.create_bind_group(layout=self.layouts[0], entries=entries)
            encoded = backend.encoder().begin_compute_pass()
            encoded.set_pipeline(self.counting)
            encoded.set_bind_group(0, counted)
            encoded.dispatch_workgroups(self.rows)
            encoded.end()
            backend.draw_triangle(self.writing, self.written, outputs)
            backend.encoded()


def counts(backend: WebGPUBackend, step: CountStep) -> bool:
    """Return True if the device can hold the tables."""
    limits, rows = backend.device.limits, step.size[1]
    return bool(
        rows <= limits["max-compute-workgroups-per-dimension"]
        and 4 * rows * step.bins <= limits["max-storage-buffer-binding-size"]
        and 4 * step.bins <= limits["max-compute-workgroup-storage-size"]
    )
