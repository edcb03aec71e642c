"""Parameters of a kernel in buffers of the device."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.backends.base import Block

if TYPE_CHECKING:
    from passgraph.backends.opencl.backend import OpenCLBackend

#: Writes under way, beyond which the host waits for the oldest: some seconds of frames.
MOST_WRITING = 256


class Uniforms:
    """The parameters of one stage on the device, written again only when they change."""

    def __init__(self, backend: OpenCLBackend, floats: int, ints: int, what: str) -> None:
        self.backend = backend
        self.sizes = max(1, floats), max(1, ints)
        self.buffers = tuple(backend.allocate(4 * n, f"the parameters of {what}") for n in self.sizes)
        for buffer in self.buffers:
            backend.free_with(self, buffer)
        self.held: list[bytes] = [b"", b""]
        #: Writes that may still be going on: dropping one waits for it.
        self.writing: deque[Any] = deque()

    def update(self, block: Block) -> None:
        for i, array in enumerate((block.floats, block.ints)):
            raw = array.tobytes()
            if raw != self.held[i]:
                self._forget_finished()
                self.writing.append(self.backend.write(self.buffers[i], np.frombuffer(raw, np.uint8)))
                self.held[i] = raw

    def _forget_finished(self) -> None:
        done = self.backend.cl.command_execution_status.COMPLETE
        while self.writing and (len(self.writing) >= MOST_WRITING or self.writing[0].command_execution_status <= done):
            self.writing.popleft()

    def fits_constant(self) -> bool:
        """Whether every block fits into the device's constant memory."""
        return 4 * max(self.sizes) <= int(self.backend.device.max_constant_buffer_size)
