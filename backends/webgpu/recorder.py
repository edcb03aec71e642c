"""Describe a plan for a WebGPU device that is not here, as plain data: pipelines, texels, parameters and needs.

The webgpu backend compiles each step on a `Recorder`.  This stands for a device and returns the descriptors that it is
given.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block
from passgraph.backends.shader_printing import vec4_count
from passgraph.backends.webgpu import devices
from passgraph.backends.webgpu.backend import WebGPUBackend
from passgraph.backends.webgpu.passes import DrawRun, PixelRun
from passgraph.backends.webgpu.programs import Programs, packed, packed_tables
from passgraph.backends.webgpu.textures import Stored, Texture
from passgraph.backends.webgpu.transfers import texels
from passgraph.backends.webgpu.wgsl import FULLSCREEN
from passgraph.backends.webgpu.wgsl import HEAD as CONSTANTS_AT
from passgraph.formats import FORMATS, Format
from passgraph.language.scalar import ScalarProgram, UniformSlot
from passgraph.plan.data import CopyStep, DrawStep, PixelStep, Plan
from passgraph.quantise import numbers_of

#: Default limits of WebGPU, as the specification has them.
DEFAULT_LIMITS = {
    "max-texture-dimension-2d": 8192,
    "max-buffer-size": 268_435_456,
    "max-uniform-buffer-binding-size": 65_536,
    "max-color-attachments": 8,
    "max-color-attachment-bytes-per-sample": 32,
    "max-sampled-textures-per-shader-stage": 16,
    "max-inter-stage-shader-variables": 16,
    "max-storage-buffer-binding-size": 134_217_728,
    "max-compute-workgroup-storage-size": 16_384,
    "max-compute-workgroups-per-dimension": 65_535,
}
#: A plan may use more bytes per pixel in its targets than every device has; the document then says so.
RAISED_LIMITS = {"max-color-attachment-bytes-per-sample": 128}
#: Bytes per pixel that a target costs in WebGPU's limit, where it is not the size of a texel.
_COSTS = {"r8unorm": 1, "rg8unorm": 2, "rgba8unorm": 8}


class Recorder:
    """Stands for a WebGPU device: every object is the descriptor that it was created from."""

    def __init__(self) -> None:
        self.limits = {**DEFAULT_LIMITS, **RAISED_LIMITS}
        #: Optional features that a step may use; the document lists those that steps of this plan use.
        self.features = (devices.BLENDS, devices.STENCIL)
        #: Text of each shader module, in order of creation.
        self.modules: list[str] = []

    def create_shader_module(self, *, code: str) -> int:
        """Return the number of a module; one with the same text is the same module."""
        if code not in self.modules:
            self.modules.append(code)
        return self.modules.index(code)

    def create_sampler(self, **described: Any) -> dict[str, Any]:
        return described

    def create_bind_group_layout(self, *, entries: list[dict[str, Any]]) -> list[dict[str, Any]]:
        return entries

    def create_pipeline_layout(self, *, bind_group_layouts: list[Any]) -> list[Any]:
        return bind_group_layouts

    def create_render_pipeline(self, **described: Any) -> dict[str, Any]:
        return described


class RecordingBackend(WebGPUBackend):
    """The webgpu backend on a `Recorder`.  It compiles passes and runs none."""

    def __init__(self) -> None:
        self.device: Any = Recorder()
        self.device_name = "a browser"
        self.limits = devices.limits_of(self.device, self.device_name)
        self.programs: Any = Programs(self.device)
        self.programs.made = {}  # descriptors cannot be held weakly
        self.draws_norm16 = False
        self.closed = False

    @property
    def modules(self) -> list[str]:
        """Return the texts of the shader modules of all pipelines so far."""
        modules: list[str] = self.device.modules
        return modules

    def fullscreen(self) -> int:
        """Return the number of the module with the vertex shader of pixel passes."""
        number: int = self.device.create_shader_module(code=FULLSCREEN)
        return number

    def texels(self, picture: NDArray[Any], format_: Format, size: tuple[int, int]) -> bytes:
        """Return a picture, of values or of numbers in a format, as its texture stores it."""
        shaped = np.broadcast_to(picture, (size[1], size[0], format_.channels))
        numbers = numbers_of(shaped, format_) if shaped.dtype == np.float32 else shaped
        return texels(Texture(format_, size, self.stored(format_), None, None, None), numbers).tobytes()

    def features(self, plan: Plan) -> list[str]:
        """Return the optional features of a device that steps of a plan use."""
        found = set()
        for step in plan.steps:
            if isinstance(step, DrawStep):
                for blend, format_ in zip(step.state.blend or (), step.output_formats, strict=False):
                    if blend is not None and format_.number == "f4":
                        found.add(devices.BLENDS)
        if any(resource.format.stencil for resource in plan.resources):
            found.add(devices.STENCIL)
        return sorted(found)

    def raised_limits(self, plan: Plan) -> dict[str, int]:
        """Return the limits above WebGPU's defaults that a plan needs, in the words of JavaScript."""
        default = DEFAULT_LIMITS["max-color-attachment-bytes-per-sample"]
        written = [step.output_formats for step in plan.steps if not isinstance(step, CopyStep)]
        most = max((sum(map(_cost, map(self.stored, formats))) for formats in written), default=0)
        return {"maxColorAttachmentBytesPerSample": most} if most > default else {}

    def pixel_pipeline(self, step: PixelStep) -> dict[str, Any]:
        """Return the pipeline of a pixel pass, in the words of JavaScript."""
        described: dict[str, Any] = in_javascript(PixelRun(self, step).pipeline)
        return described

    def draw_pipeline(self, step: DrawStep, depth: Format | None) -> dict[str, Any]:
        """Return the pipeline of a draw, in the words of JavaScript; ``clears`` has the clear color of each target.

        ``lacks_depth`` is true if the draw needs a depth target that the plan does not have.
        """
        run = DrawRun(self, step)
        depth = FORMATS["depth32f"] if run.lacks_depth else depth
        texture = None if depth is None else Texture(depth, step.size, self.stored(depth), None, None, None)
        return {**in_javascript(run.pipeline(texture)), "clears": run.clears, "lacks_depth": run.lacks_depth}


def _cost(stored: Stored) -> int:
    return _COSTS.get(stored.name, stored.format.bytes_per_pixel)


def constants(program: ScalarProgram, block: Block) -> bytes:
    """Return the parameters of a stage as its shader reads them, from :data:`CONSTANTS_AT` on."""
    return packed(program, (1, 1), 1.0, block, packed_tables(program))[CONSTANTS_AT:]


def offset(program: ScalarProgram, slot: UniformSlot) -> int:
    """Return the place of a parameter in the bytes of its stage."""
    block = CONSTANTS_AT if slot.block == "float" else CONSTANTS_AT + 16 * max(1, vec4_count(program.float_count))
    return block + 4 * slot.offset


def in_javascript(described: Any) -> Any:
    """Return a descriptor with names as JavaScript writes them.

    >>> in_javascript({"entry_point": "main", "targets": ({"write_mask": 15},)})
    {'entryPoint': 'main', 'targets': [{'writeMask': 15}]}
    """
    if isinstance(described, dict):
        return {_camel(name): in_javascript(part) for name, part in described.items()}
    return [in_javascript(part) for part in described] if isinstance(described, (list, tuple)) else described


def _camel(name: str) -> str:
    first, *rest = name.split("_")
    return first + "".join(word.capitalize() for word in rest)
