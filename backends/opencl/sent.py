"""What a device gets for a pixel pass, to repeat it without passgraph."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from passgraph.backends.base import Block, SentPass
from passgraph.backends.opencl.programs import Programs
from passgraph.backends.opencl.storage import Storage


def sent_pass(
    programs: Programs, runner: Any, outputs: Sequence[Storage], images: Sequence[Storage], block: Block
) -> SentPass | None:
    """Return what a pass over these storages sends; None for storages of a host.

    ``runner`` : the `PixelPassRunner` of the pass, which has run over them
    """
    if any(not storage.layout.is_tight or storage.is_borrowed for storage in (*outputs, *images)):
        return None
    # The text of the program that these kernels belong to.
    own = runner.launches[0].kernel.program.int_ptr
    text = next(text for text, program in programs.built.items() if program.int_ptr == own)
    source, options = programs.sent(text, any(launch.group != (1, 1) for launch in runner.launches))
    launches = [
        (launch.kernel.function_name, launch.items, launch.group, [int(number) for number in launch.cut.tolist()])
        for launch in runner.launches
    ]
    sizes = [4 * size for size in runner.uniforms.sizes]
    parts = (block.floats.tobytes(), block.ints.tobytes())
    buffers = {
        name: part.ljust(size, b"\0") for name, part, size in zip(("floats.bin", "ints.bin"), parts, sizes, strict=True)
    }
    formats = [(storage.format.channels, storage.format.number) for storage in outputs]
    calls = {"options": options, "launches": launches, "formats": formats, "image_count": len(images)}
    return SentPass("pyopencl", {"pass.cl": source}, buffers, calls, tuple([image.format.number for image in images]))
