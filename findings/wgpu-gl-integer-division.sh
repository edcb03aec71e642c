#!/usr/bin/env bash
# (1) Most would guess: WGSL's integers behave alike on each API under wgpu, since the specification leaves nothing open:
#     -7 % 3 is -1, i / 0 is i, i % 0 is 0, and i32(3e9) is 2147483520.
# (2) What is: wgpu's OpenGL layer prints `/`, `%` and int() as they are into GLSL, where all of these are undefined. With
#     Mesa's llvmpipe -7 % 3 is 0 (both are taken as unsigned), 7 / 0 is 0, 7 % 0 is -1 and i32(3e9) is -2147483648. On Vulkan
#     of the same Mesa and processor wgpu gives what WGSL says. Hashes and wrapped indices with % so differ by API.
# (3) wgpu 0.32.0 from PyPI, WGPU_BACKEND_TYPE=OpenGL, Mesa 22.3.6 (apt-get install libegl1 libgl1-mesa-dri libgles2
#     mesa-vulkan-drivers). WGSL, sections Arithmetic Expressions and Floating Point Conversion.
set -euo pipefail
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT; cd "$folder"
python3 -m venv venv
venv/bin/pip -q install wgpu==0.32.0 numpy==2.2.6
cat > show.py <<'PY'
import numpy as np, wgpu

TEXT = """struct Given { i: i32, j: i32, x: f32, y: f32 };
@group(0) @binding(0) var<storage, read> given: array<Given>;
@group(0) @binding(1) var<storage, read_write> found: array<i32>;
@compute @workgroup_size(1) fn main() {
    found[0] = given[0].i % given[0].j;
    found[1] = given[1].i / given[1].j;
    found[2] = given[1].i % given[1].j;
    found[3] = i32(given[0].x);
}"""
given = np.zeros(2, [("i", np.int32), ("j", np.int32), ("x", np.float32), ("y", np.float32)])
given[0], given[1] = (-7, 3, 3e9, 0), (7, 0, 0, 0)


def on(api):
    adapter = next(a for a in wgpu.gpu.enumerate_adapters_sync() if a.info["backend_type"] == api)
    device, usage = adapter.request_device_sync(), wgpu.BufferUsage
    buffers = [device.create_buffer_with_data(data=given.view(np.uint8), usage=usage.STORAGE),
               device.create_buffer(size=16, usage=usage.STORAGE | usage.COPY_SRC)]
    pipeline = device.create_compute_pipeline(
        layout="auto", compute={"module": device.create_shader_module(code=TEXT), "entry_point": "main"})
    entries = [{"binding": k, "resource": {"buffer": b}} for k, b in enumerate(buffers)]
    encoder = device.create_command_encoder()
    work = encoder.begin_compute_pass()
    work.set_pipeline(pipeline)
    work.set_bind_group(0, device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries))
    work.dispatch_workgroups(1)
    work.end()
    device.queue.submit([encoder.finish()])
    found = np.frombuffer(device.queue.read_buffer(buffers[1]), np.int32).tolist()
    print(f"{api} ({adapter.info['description']}): -7 % 3, 7 / 0, 7 % 0, i32(3e9) = {found}")
    return found


right = [-1, 7, 0, 2147483520]
assert on("Vulkan") == right
assert on("OpenGL") == [0, 0, -1, -2147483648]
PY
venv/bin/python show.py 2>/dev/null
