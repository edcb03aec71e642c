"""Run one kernel on OpenCL and hold its result against what is allowed: python reproduce.py

Needs numpy and pyopencl. Exit status 1: a value is outside of what is allowed.
"""

from __future__ import annotations

import sys

import numpy as np
import pyopencl as cl
from case import CASE, SIZE, image, parameters, source, verdict


def main() -> int:
    devices = [device for platform in cl.get_platforms() for device in platform.get_devices()]
    device = next((one for one in devices if one.name.strip() == CASE["device"]["name"]), devices[0])
    context = cl.Context([device])
    queue = cl.CommandQueue(context, device)
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR

    def buffer(data: bytes) -> cl.Buffer:
        return cl.Buffer(context, flags, hostbuf=np.frombuffer(data, np.uint8).copy())

    results = [np.zeros((SIZE[1], SIZE[0], channels), type_) for channels, type_ in CASE["formats"]]
    targets = [buffer(result.tobytes()) for result in results]
    images = [buffer(image(number).tobytes()) for number in range(CASE["image_count"])]
    blocks = [buffer(parameters(name)) for name in ("floats.bin", "ints.bin")]
    program = cl.Program(context, source("pass.cl")).build(CASE["options"], [device])
    for name, items, group, cut in CASE["launches"]:
        kernel = cl.Kernel(program, name)
        kernel.set_args(*targets, *images, *blocks, cl.cltypes.make_int4(*cut))
        cl.enqueue_nd_range_kernel(queue, kernel, tuple(items), group and tuple(group))
    for result, target in zip(results, targets, strict=True):
        cl.enqueue_copy(queue, result, target)
    queue.finish()
    return verdict(f"{device.name.strip()}; {device.platform.version}; {device.driver_version}", results)


if __name__ == "__main__":
    sys.exit(main())
