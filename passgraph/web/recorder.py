"""Print the steps of a plan as WebGPU pipelines without a device.

The webgpu backend compiles each step on a `Recorder`.  This stands for a device and returns the descriptors that it is
given, as plain data.
"""

from __future__ import annotations

from typing import Any

from passgraph.backends.webgpu import devices
from passgraph.backends.webgpu.backend import WebGPUBackend
from passgraph.backends.webgpu.passes import DrawRun, PixelRun
from passgraph.backends.webgpu.programs import Programs
from passgraph.backends.webgpu.textures import Texture
from passgraph.formats import FORMATS, Format
from passgraph.plan.data import DrawStep, PixelStep

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
