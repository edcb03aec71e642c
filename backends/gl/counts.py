"""Bins of rows, counted (:class:`passgraph.plan.known.Counting`) by compute shaders, where a context has them.

A group of invocations goes through a row; each texel adds atomically to the entry of its bin in the group's table.
Where there are none, before OpenGL 4.3 and on OpenGL ES (whose shaders write textures of another kind than ours), and
for what a host has adopted or lays out otherwise, the step's program counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from passgraph.backends.base import Block
from passgraph.backends.gl import functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl.passes import PixelRun
from passgraph.backends.gl.placement import ALL_PLAIN, placements_of
from passgraph.backends.gl.textures import Texture
from passgraph.plan.data import PixelStep
from passgraph.plan.known import Counting

if TYPE_CHECKING:
    from passgraph.backends.gl.backend import GLBackend

#: Invocations that go through a row together: half a warp, for more of which llvmpipe takes a fifth longer.
GROUP = 16

SHADER = """#version 430 core
layout(local_size_x = GROUP) in;
layout(rgba32f, binding = 0) writeonly uniform image2D pg_counts[4];
uniform sampler2D pg_image0;
const int bins = 4 * QUARTER;
shared uint table[bins + 1];
void main()
{
    int me = int(gl_LocalInvocationID.x), y = int(gl_WorkGroupID.x);
    ivec2 size = textureSize(pg_image0, 0);
    vec2 width = 1.0 / vec2(size);
    for (int i = me; i <= bins; i += GROUP) { table[i] = 0u; }
    barrier();
    for (int x = me; x < size.x && y < size.y; x += GROUP) {
        float number = textureLod(pg_image0, (vec2(x, y) + 0.5) * width, 0.0).x;
        bool inside = number >= 1.0 && number <= float(bins);
        int entry = int(inside ? number : 0.0);
        if (entry > 0 && float(entry) == number) { atomicAdd(table[entry], 1u); }
    }
    barrier();
    for (int at = me; at < bins / 4; at += GROUP) {
        int first = 4 * at + 1, picture = 4 * at / QUARTER;
        vec4 four = vec4(table[first], table[first + 1], table[first + 2], table[first + 3]);
        ivec2 place = ivec2(at - picture * (QUARTER / 4), y);
        WRITES
    }
}
"""


def shader_text(known: Counting) -> str:
    """The whole compute shader."""
    # By constant numbers: images of an array may be chosen by nothing else.
    writes = "\n        ".join(f"if (picture == {k}) {{ imageStore(pg_counts[{k}], place, four); }}" for k in range(4))
    replaced = {"GROUP": str(GROUP), "QUARTER": str(known.quarter), "WRITES": writes}
    text = SHADER
    for word, by in replaced.items():
        text = text.replace(word, by)
    return text


class CountRun:
    """The pass at work."""

    def __init__(self, backend: GLBackend, step: PixelStep) -> None:
        assert step.known is not None
        self.backend, self.step = backend, step
        self.counting = backend.programs.compute(shader_text(step.known), step.program)

    @cached_property
    def plain(self) -> PixelRun:
        """The step's program, made once a host's picture needs it: drivers take many times as long to compile it."""
        return PixelRun(self.backend, self.step)

    def __call__(self, outputs: Sequence[Texture], images: Sequence[Texture], block: Block) -> None:
        backend = self.backend
        if not backend.in_run:
            with backend.running():
                return self(outputs, images, block)
        of_host = any(output.surface is not None for output in outputs)
        if of_host or placements_of(outputs, images) is not ALL_PLAIN:
            return self.plain(outputs, images, block)
        gl, bound = backend.context.gl, backend.context.bound
        fixed.bind_images(gl, bound, images)
        fixed.use(gl, bound, self.counting.name, backend.no_vertices)
        for unit, output in enumerate(outputs):
            gl.BindImageTexture(unit, output.name, 0, 0, 0, g.WRITE_ONLY, g.RGBA32F)
        gl.DispatchCompute(self.step.size[1], 1, 1)
        gl.MemoryBarrier(g.ALL_BARRIERS)
        for unit in range(len(outputs)):
            gl.BindImageTexture(unit, 0, 0, 0, 0, g.WRITE_ONLY, g.RGBA32F)
        gl.check("running pass", self.step.name)
