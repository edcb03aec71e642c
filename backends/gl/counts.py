"""Bins counted (:class:`passgraph.plan.known.Counting`) by a compute shader, where a context has such.

Invocations of a group go through a strip of rows, compute the numbers of bins as the pass that writes them would, and
count in tables of their own or of the group; what these hold is added atomically to one table for each row of the
outputs, which a pass then writes.  Where there are no compute shaders, before OpenGL 4.2 and on OpenGL ES, and where
a table would be too large, the steps' programs count.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from passgraph.backends.base import Block
from passgraph.backends.counting import Strips, Work, strips_of, work_of
from passgraph.backends.gl import functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl.capabilities import Compute
from passgraph.backends.gl.counts_source import Ways
from passgraph.backends.gl.passes import filtered_images, run_pixels, with_filters
from passgraph.backends.gl.programs import LinkedProgram
from passgraph.backends.gl.textures import ALL_PLAIN, Placements, Texture, placements_of
from passgraph.graph.targets import MAX_SIDE
from passgraph.language.scalar import count, trips
from passgraph.plan.data import PixelStep

if TYPE_CHECKING:
    from passgraph.backends.gl.backend import GLBackend

#: Programs up to this length are computed for several texels a trip: llvmpipe takes a fifth less for short ones.
SHORT = 64
#: Bins up to which llvmpipe's invocations have tables of their own: for 2048 it compiles for three seconds.
MOST_OWN = 512
#: Texels of a strip for each entry of its tables, which are emptied and added up; and texels of a strip at least.
FOR_EACH_ENTRY, LEAST = 256, 1 << 15
#: On graphics processors: texels of a strip, of which there are enough for many groups then.
STRIP_GPU = 1 << 13
#: Of the tables together: 16 MiB, which every OpenGL with buffers that shaders write gives them.
MOST_ENTRIES = 1 << 22
#: Uniforms besides the program's parameters: a picture's size, strips, and where images lie.
OWN_NUMBERS = 16


def ways_of(work: Work, has: Compute) -> Ways:
    """How invocations of this device count best."""
    turns = 4 if count(work.program.body) <= SHORT else 1
    if not has.on_processor:
        return Ways(256, turns, own=False)
    # llvmpipe computes eight invocations at once; tables of their own are worth emptying for more than a row.
    own = work.counting.each > 1 and work.counting.bins <= MOST_OWN
    return Ways(8 if own else 16, turns, own)


def cut(work: Work, ways: Ways, size: tuple[int, int], most_trips: int) -> Strips | None:
    """The strips of a picture; None where one row takes more trips of loops than the device makes.

    >>> from passgraph.backends.counting import Counting, in_picture
    >>> work = Work(in_picture(), None, Counting(64, 4096), 1)
    >>> [cut(work, ways, (1280, 720), 65_535).rows for ways in (Ways(256, 4, False), Ways(8, 4, True))]
    [6, 51]
    """
    bins, across = work.counting.bins, -(-size[0] // ways.group)
    texels = max(FOR_EACH_ENTRY * (bins + 1), LEAST) if ways.own else STRIP_GPU
    a_row = across // ways.turns + ways.turns + 1 + across * trips(work.program.body)
    most = (most_trips - 2 * (bins + 1)) // a_row
    return strips_of(work, size, texels, most) if most > 0 else None


class CountRun:
    """What :func:`counted` has found, at work."""

    def __init__(self, backend: GLBackend, steps: Sequence[PixelStep], work: Work) -> None:
        self.backend, self.steps, self.work = backend, steps, work
        assert backend.compute is not None
        self.ways = ways_of(work, backend.compute)
        self.zeros = np.zeros(work.rows * work.counting.bins, np.uint32)
        self.filtered = filtered_images(work.program)
        self.counting(ALL_PLAIN)

    def counting(self, placements: Placements) -> LinkedProgram:
        work = self.work
        return self.backend.programs.counting(work.program, placements, work.counting.bins, self.ways)

    def __call__(
        self, outputs: Sequence[Texture], images: Sequence[Sequence[Texture]], blocks: Sequence[Block]
    ) -> None:
        backend = self.backend
        if not backend.in_run:
            with backend.running():
                return self(outputs, images, blocks)
        read, gl = with_filters(backend, images[0], self.filtered), backend.context.gl
        # What can be refused comes before anything is under way.
        counting = self.counting(placements_of((), read))
        sums = backend.programs.sums(self.steps[-1].program, placements_of(outputs, ()), self.work.counting.quarter)
        gl.BindBuffer(g.SHADER_STORAGE_BUFFER, backend.objects.table())
        gl.BufferData(g.SHADER_STORAGE_BUFFER, self.zeros.nbytes, self.zeros.ctypes.data, g.STREAM_DRAW)
        gl.BindBufferBase(g.SHADER_STORAGE_BUFFER, 0, backend.objects.table())
        self._count(counting, read, blocks[0])
        gl.MemoryBarrier(g.SHADER_STORAGE_BARRIER)
        run_pixels(backend, sums, outputs, (), blocks[-1], self.steps[-1].size)
        gl.BindBufferBase(g.SHADER_STORAGE_BUFFER, 0, 0)
        gl.check("running pass", self.steps[-1].name)

    def _count(self, program: LinkedProgram, images: Sequence[Texture], block: Block) -> None:
        backend, size = self.backend, self.work.size or images[0].size
        gl, bound = backend.context.gl, backend.context.bound
        strips = cut(self.work, self.ways, size, backend.limits.trips)
        assert strips is not None
        fixed.bind_images(gl, bound, images)
        fixed.use(gl, bound, program.name, backend.no_vertices)
        program.send(gl, "pixel", block)
        program.send_size(gl, size)
        program.send_parts(gl, (), images)
        gl.Uniform4i(program.strips, strips.rows, strips.each, strips.together, strips.height)
        gl.DispatchCompute(strips.count, 1, 1)
        # Mesa never lets go of a program that follows one of compute shaders directly.
        fixed.use(gl, bound, 0, backend.no_vertices)


def counted(backend: GLBackend, steps: Sequence[PixelStep]) -> Work | None:
    """What steps count, where this device can."""
    has, limits, work = backend.compute, backend.limits, work_of(steps)
    if has is None or work is None:
        return None
    program = work.program
    # A picture of numbers may be any, up to the largest there is.
    size = work.size or (MAX_SIDE, 1)
    fits = (
        cut(work, ways_of(work, has), size, limits.trips) is not None
        and len(program.images) <= has.images
        and limits.numbers_taken(program.float_count, program.int_count) + OWN_NUMBERS <= has.numbers
        and work.rows * work.counting.bins <= MOST_ENTRIES
    )
    return work if fits else None
