"""WebGPU through wgpu-py: Vulkan, Metal and Direct3D 12, kernels as WGSL, draws by the hardware's rasterizer.

Read in this order: ``backend`` (one device, storages, runs), ``passes``, ``wgsl`` (the printer), ``textures``,
``transfers``, ``devices``.
"""

from __future__ import annotations

from passgraph.backends.webgpu.backend import WebGPUBackend

__all__ = ["WebGPUBackend"]
