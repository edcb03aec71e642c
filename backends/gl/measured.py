"""Properties that OpenGL leaves to the driver and that change results, measured in the context."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl import transfers
from passgraph.formats import FORMATS
from passgraph.graph.draw_state import DrawState

if TYPE_CHECKING:
    from passgraph.backends.gl.backend import GLBackend

#: Units of the measured offset; the depth, and the change of depth per unit (rule 5 of docs/rasterization.md).
UNITS, DEPTH, STEP = 1024.0, 0.5, 2.0**-24


def measure_offset_unit(backend: GLBackend) -> float:
    """Return the depth that the driver adds for one unit of polygon offset, relative to rule 5.

    OpenGL calls a unit the smallest resolvable difference of a depth buffer, and leaves its size to the driver. Mesa
    uses the spacing of float32, NVIDIA twice that. Depth is ``depth32f``. Needs a current context outside of a run.
    """
    gl, bound = backend.context.gl, backend.context.bound
    depth = backend.new_texture(FORMATS["depth32f"], (1, 1))
    program = backend.programs.from_text("polygon offset", "void main() { }")
    state = DrawState(depth_compare="always", polygon_offset=(0.0, UNITS))
    fixed.set_common(gl, bound, backend.objects.framebuffer((), depth))
    fixed.set_guard_band(gl, bound, depth.size, 1)
    fixed.set_draw(gl, bound, state, (), depth)
    fixed.use(gl, bound, program.name, backend.no_vertices)
    gl.DrawArrays(g.TRIANGLES, 0, 3)
    backend.unbind()
    written = np.empty((1, 1, 1), np.float32)
    transfers.receive(backend, depth, written)
    backend.objects.forget(depth)
    unit = (float(written[0, 0, 0]) - DEPTH) / (UNITS * STEP)
    return unit if math.isfinite(unit) and unit > 0 else 1.0
