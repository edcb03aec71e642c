"""What a device gets for a draw, to repeat it without passgraph."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np

from passgraph.backends.base import ATTRIBUTES, Block, SentPass, vertex_attribute
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl.dialect import Dialect
from passgraph.backends.gl.glsl import GLSL, NAMES, in_vectors
from passgraph.backends.gl.textures import ALL_PLAIN, Texture, placements_of
from passgraph.backends.shader_printing import vec4_count
from passgraph.graph.draw_state import DrawState, Geometry
from passgraph.plan.data import DrawStep

#: Letters of the arguments of each function.
_LETTERS = {
    entry.partition("(")[0]: entry.partition("(")[2].removesuffix(")").partition(":")[0]
    for entries in (g.SIGNATURES, *g.OPTIONAL)
    for entry in entries.split()
}


class _Calls:
    """Functions of OpenGL that keep their names and numbers instead of calling the driver."""

    def __init__(self, gl: Any) -> None:
        self._gl, self.has = gl, gl.has
        #: Name, letters of the arguments as in `gl_functions`, arguments; arrays are lists.
        self.made: list[tuple[str, str, list[Any]]] = []

    def __getattr__(self, name: str) -> Callable[..., None] | None:
        if getattr(self._gl, name) is None:
            return None
        return lambda *arguments: self.made.append((name, _LETTERS[name], list(arguments)))

    def ClearBufferfv(self, buffer: int, number: int, values: Any) -> None:
        found = list(values) if isinstance(values, ctypes.Array) else list((ctypes.c_float * 4).from_address(values))
        self.made.append(("ClearBufferfv", _LETTERS["ClearBufferfv"], [buffer, number, found]))


class Prepared(Protocol):
    """A draw that is ready to run: see `passgraph.backends.gl.passes.DrawRun`."""

    step: DrawStep
    guard: int
    state: DrawState

    def clear(self, gl: Any, bound: fixed.Bound, outputs: Sequence[Texture], depth: Texture | None) -> None: ...


def sent_draw(
    gl: Any, dialect: Dialect, run: Prepared, outputs: Sequence[Texture], depth: Texture | None,
    images: Sequence[Texture], mesh: Geometry, vertex: Block, fragment: Block,
) -> SentPass | None:  # fmt: skip
    """Return what a draw sends; None for pictures of a host, and where it draws over what cannot be read back as it is
    stored: three channels in four, or a stencil."""
    step, state = run.step, fixed.Bound()
    is_kept = step.depth_clear is None
    unread = [texture for texture, clear in zip(outputs, step.clears, strict=True) if clear is None and texture.padded]
    stencils = [texture for texture in images if texture.format.stencil]
    if gl.has.is_es or unread or stencils or placements_of(outputs, images) is not ALL_PLAIN:
        return None
    if depth is not None and depth.format.stencil and is_kept:
        return None
    calls = _Calls(gl)
    state.framebuffer = 0
    recorded: Any = calls
    fixed.set_common(recorded, state, 0)
    run.clear(recorded, state, outputs, depth)
    fixed.set_guard_band(recorded, state, step.size, run.guard)
    fixed.set_draw(recorded, state, run.state, outputs, depth)
    texts = [GLSL(program, step.varyings, ALL_PLAIN, dialect).shader().text for program in step.programs]
    sources = {"draw.vert": texts[0], "draw.frag": texts[1] if len(texts) > 1 else dialect.no_colour}
    buffers = {"triangles.bin": np.ascontiguousarray(mesh.triangles, np.uint32).tobytes()}
    attributes, uniforms, samplers = [], [], []
    for name in step.vertex.attributes:
        values = vertex_attribute(mesh, name)
        attributes.append((list(ATTRIBUTES).index(name), values.shape[1], f"{name}.bin"))
        buffers[f"{name}.bin"] = values.tobytes()
    for program, block in zip(step.programs, (vertex, fragment), strict=False):
        names = NAMES[program.stage]
        samplers += [f"{names.image}{k}" for k in range(len(program.images))]
        parts = (names.floats, "f", program.float_count, block.floats), (names.ints, "i", program.int_count, block.ints)
        for name, letter, count, numbers in parts:
            if count:
                width = 4 if in_vectors(count) else 1
                data = numbers.tobytes()
                uniforms.append((name, f"Uniform{width}{letter}v", vec4_count(count) if width == 4 else count))
                buffers[f"{name}.bin"] = data.ljust(16 * vec4_count(count), b"\0") if width == 4 else data
    described = [_described(texture) for texture in (*outputs, *images)]
    sent: dict[str, Any] = {
        "outputs": described[: len(outputs)], "images": described[len(outputs) :], "samplers": samplers,
        "depth": None if depth is None else _described(depth), "calls": calls.made, "attributes": attributes,
        "uniforms": uniforms, "guard": 1 / run.guard,
        "kept": [clear is None for clear in step.clears], "keeps_depth": depth is not None and is_kept,
    }  # fmt: skip
    return SentPass("moderngl", sources, buffers, sent, tuple([one[-1] for one in sent["images"]]), "draw")


def _described(texture: Texture) -> tuple[int, int, int, int, str]:
    """Return the constants of a texture, its channels, and NumPy's name of their type."""
    stored = texture.gl_format
    type_ = "float32" if texture.format.is_depth else str(stored.dtype)
    return stored.internal, stored.external, stored.type, stored.stored.channels, type_
