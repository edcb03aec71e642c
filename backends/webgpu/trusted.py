"""Shader modules without wgpu's loop counters.

wgpu adds a counter to every loop, so that shaders of web pages end.  Loops of kernels have known bounds, and compilers
do not unroll loops with a second counter: lavapipe then compiles for minutes instead of seconds.
"""

from __future__ import annotations

from typing import Any

#: Keep only the bounds checks of arrays (WGPUShaderRuntimeChecks_BoundsChecks).
_BOUNDS_CHECKS = 1


def trusted_module(device: Any, code: str) -> Any | None:
    """Return a module of WGSL that has already been validated; None if this version of wgpu has no call for it."""
    try:
        internal = device._internal  # a device of a browser has none, and needs no wgpu
        from wgpu.backends.wgpu_native import GPUShaderModule, ffi, lib

        create = lib.wgpuDeviceCreateShaderModuleTrusted
        text = code.encode()
        held = ffi.new("char[]", text)
        source = ffi.new("WGPUShaderSourceWGSL *")
        source.chain.sType = lib.WGPUSType_ShaderSourceWGSL
        source.code.data, source.code.length = held, len(text)
        descriptor = ffi.new("WGPUShaderModuleDescriptor *")
        descriptor.nextInChain = ffi.cast("WGPUChainedStruct *", source)
        module = create(internal, descriptor, _BOUNDS_CHECKS)
    except (ImportError, AttributeError, TypeError):
        return None
    return None if module == ffi.NULL else GPUShaderModule("", module, device)
