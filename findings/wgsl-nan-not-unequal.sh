#!/usr/bin/env bash
# (1) Most would guess: in a shader, as everywhere with IEEE floats, `x != x` is true for a NaN alone; so code that lacks
#     isnan (WGSL has none) tests for NaN by it.
# (2) What is: in WGSL the test is false for a NaN from a buffer, and so is `x == x`. wgpu translates != into SPIR-V's
#     OpFOrdNotEqual, which is false if an operand is a NaN. WGSL allows that ("implementations may assume that infinities
#     and NaNs are not present", section Differences from IEEE-754). Headless Chromium 156 with SwiftShader does the same.
#     What works is a look at the bits: (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u.
# (3) wgpu 0.32.0 from PyPI on lavapipe of Mesa 22.3.6, 25.0.7 and 26.1.6 (apt-get install
#     mesa-vulkan-drivers).
set -euo pipefail
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT; cd "$folder"
python3 -m venv venv
venv/bin/pip -q install wgpu==0.32.0 numpy==2.2.6
cat > show.py <<'PY'
import numpy as np, wgpu

TEXT = """@group(0) @binding(0) var<storage, read> given: array<f32>;
@group(0) @binding(1) var<storage, read_write> found: array<u32>;
@compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let x = given[id.x];
    let by_bits = (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u;
    found[id.x] = select(0u, 1u, x != x) + select(0u, 2u, x == x) + select(0u, 4u, by_bits);
}"""
adapter = next(a for a in wgpu.gpu.enumerate_adapters_sync() if a.info["backend_type"] == "Vulkan")
device = adapter.request_device_sync()
print(adapter.info["device"], adapter.info["description"])
given = np.array([1.0, np.nan], np.float32)
usage = wgpu.BufferUsage
buffers = [device.create_buffer_with_data(data=given, usage=usage.STORAGE),
           device.create_buffer(size=8, usage=usage.STORAGE | usage.COPY_SRC)]
pipeline = device.create_compute_pipeline(
    layout="auto", compute={"module": device.create_shader_module(code=TEXT), "entry_point": "main"})
entries = [{"binding": k, "resource": {"buffer": b}} for k, b in enumerate(buffers)]
encoder = device.create_command_encoder()
work = encoder.begin_compute_pass()
work.set_pipeline(pipeline)
work.set_bind_group(0, device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries))
work.dispatch_workgroups(2)
work.end()
device.queue.submit([encoder.finish()])
found = np.frombuffer(device.queue.read_buffer(buffers[1]), np.uint32).tolist()
for x, bits in zip(given.tolist(), found):
    print(f"{x}: x != x is {bool(bits & 1)}, x == x is {bool(bits & 2)}, a NaN by its bits: {bool(bits & 4)}")
assert found == [2, 4], found
PY
venv/bin/python show.py 2>/dev/null
