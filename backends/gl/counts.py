"""Count bins (`passgraph.plan.data.CountStep`) with a compute shader, if the context has them.

The invocations of a group walk through a row and count in a shared table; a pass then writes the tables' content.  The
step's own program counts instead on OpenGL before 4.2, on OpenGL ES before 3.1, and if the tables would be too large.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from passgraph.backends.base import Block
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl.passes import run_pixels
from passgraph.backends.gl.textures import Texture, placements_of
from passgraph.plan.data import CountStep

if TYPE_CHECKING:
    from passgraph.backends.gl.backend import GLBackend

#: Size limit of all tables: 16 MiB, which every OpenGL with shader storage buffers supports.
MOST_ENTRIES = 1 << 22


class CountRun:
    """The counting pass, compiled."""

    def __init__(self, backend: GLBackend, step: CountStep) -> None:
        self.backend, self.step = backend, step

    def __call__(self, outputs: Sequence[Texture], images: Sequence[Texture], block: Block) -> None:
        backend = self.backend
        if not backend.in_run:
            with backend.running():
                return self(outputs, images, block)
        gl = backend.context.gl
        # Anything that can fail comes before work begins.
        program = backend.programs.counting(self.step, placements_of((), images), backend.count_group)
        sums = backend.programs.sums(self.step, placements_of(outputs, ()))
        gl.BindBuffer(g.SHADER_STORAGE_BUFFER, backend.objects.table())
        gl.BufferData(g.SHADER_STORAGE_BUFFER, 4 * self.step.size[1] * self.step.bins, None, g.STREAM_DRAW)
        gl.BindBufferBase(g.SHADER_STORAGE_BUFFER, 0, backend.objects.table())
        fixed.bind_images(gl, backend.context.bound, images)
        fixed.use(gl, backend.context.bound, program.name, backend.no_vertices)
        program.send_size(gl, images[0].size)
        program.send_parts(gl, (), images)
        gl.DispatchCompute(self.step.size[1], 1, 1)
        # Mesa never frees a program that directly follows a compute program.
        fixed.use(gl, backend.context.bound, 0, backend.no_vertices)
        gl.MemoryBarrier(g.SHADER_STORAGE_BARRIER)
        run_pixels(backend, sums, outputs, (), block, self.step.size)
        gl.BindBufferBase(g.SHADER_STORAGE_BUFFER, 0, 0)
        gl.check("running pass", self.step.name)


def counts(backend: GLBackend, step: CountStep) -> bool:
    """Return True if this device can count with a compute shader."""
    return backend.count_group > 0 and step.size[1] * step.bins <= MOST_ENTRIES
