"""Bins counted (:class:`passgraph.plan.known.Counting`) by a compute shader, where a context has such.

The invocations of a group go through a row and count in a table that they share; a pass then writes what the tables
hold.  Where there are no compute shaders, before OpenGL 4.2 and on OpenGL ES, and where the tables would be too large,
the step's program counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from passgraph.backends.base import Block
from passgraph.backends.gl import functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl.passes import run_pixels
from passgraph.backends.gl.textures import Texture, placements_of
from passgraph.plan.data import PixelStep

if TYPE_CHECKING:
    from passgraph.backends.gl.backend import GLBackend

#: Of the tables together: 16 MiB, which every OpenGL with buffers that shaders write gives them.
MOST_ENTRIES = 1 << 22


class CountRun:
    """The counting pass at work."""

    def __init__(self, backend: GLBackend, step: PixelStep) -> None:
        assert step.known is not None
        self.backend, self.step, self.counting = backend, step, step.known
        self.table_bytes = 4 * step.size[1] * self.counting.bins

    def __call__(self, outputs: Sequence[Texture], images: Sequence[Texture], block: Block) -> None:
        backend = self.backend
        if not backend.in_run:
            with backend.running():
                return self(outputs, images, block)
        gl = backend.context.gl
        # What can be refused comes before anything is under way.
        program = backend.programs.counting(placements_of((), images), self.counting.bins, backend.count_group)
        sums = backend.programs.sums(self.step.program, placements_of(outputs, ()), self.counting.quarter)
        gl.BindBuffer(g.SHADER_STORAGE_BUFFER, backend.objects.table())
        gl.BufferData(g.SHADER_STORAGE_BUFFER, self.table_bytes, None, g.STREAM_DRAW)
        gl.BindBufferBase(g.SHADER_STORAGE_BUFFER, 0, backend.objects.table())
        fixed.bind_images(gl, backend.context.bound, images)
        fixed.use(gl, backend.context.bound, program.name, backend.no_vertices)
        program.send_size(gl, images[0].size)
        program.send_parts(gl, (), images)
        gl.DispatchCompute(self.step.size[1], 1, 1)
        # Mesa never lets go of a program that follows one of compute shaders directly.
        fixed.use(gl, backend.context.bound, 0, backend.no_vertices)
        gl.MemoryBarrier(g.SHADER_STORAGE_BARRIER)
        run_pixels(backend, sums, outputs, (), block, self.step.size)
        gl.BindBufferBase(g.SHADER_STORAGE_BUFFER, 0, 0)
        gl.check("running pass", self.step.name)


def counts(backend: GLBackend, step: PixelStep) -> bool:
    """Whether a step counts bins, and this device has the means and the room."""
    histogram = step.known if backend.count_group else None
    return histogram is not None and step.size[1] * histogram.bins <= MOST_ENTRIES
