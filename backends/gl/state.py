"""Fixed-function state of passes, and the state in force during a run: set only when it changes."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.gl_functions import Functions
from passgraph.backends.gl.textures import Texture
from passgraph.errors import UnsupportedError
from passgraph.formats import Format
from passgraph.graph.draw_state import COMPARE, Blend, DrawState
from passgraph.records import dataclass


class Bound:
    """Names of bound objects and the state in force; None if unknown.

    It is valid only with exclusive use of the context: :class:`passgraph.backends.gl.context.Context` resets it on
    entry, and a run enters once.
    """

    __slots__ = (
        "framebuffer", "samplers", "state", "switched_off", "textures", "unit", "used", "vertex_array", "viewport",
    )  # fmt: skip

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        #: True if everything that passes never use is switched off.
        self.switched_off = False
        #: The tests, blending and masks in force: see :mod:`passgraph.backends.gl.state`.
        self.state: object = None
        self.framebuffer: int | None = None
        self.viewport: tuple[int, ...] | None = None
        self.used: int | None = None
        self.vertex_array: int | None = None
        #: By unit; units beyond its length may have a foreign sampler object.
        self.textures: list[int | None] = []
        self.samplers: list[int | None] = []
        self.unit: int | None = None


_COMPARE = {name: 0x200 + k for k, name in enumerate(COMPARE)}
_STENCIL = {
    "keep": 0x1E00, "zero": 0, "replace": 0x1E01, "increment": 0x1E02, "increment_wrap": 0x8507,
    "decrement": 0x1E03, "decrement_wrap": 0x8508, "invert": 0x150A,
}  # fmt: skip
_FACTORS = {
    "zero": 0, "one": 1, "source_color": 0x300, "one_minus_source_color": 0x301, "source_alpha": 0x302,
    "one_minus_source_alpha": 0x303, "destination_alpha": 0x304, "one_minus_destination_alpha": 0x305,
    "destination_color": 0x306, "one_minus_destination_color": 0x307,
}  # fmt: skip
_EQUATIONS = {"add": 0x8006, "min": 0x8007, "max": 0x8008, "subtract": 0x800A, "reverse_subtract": 0x800B}
_CULL = {"back": g.BACK, "front": g.FRONT}

BLEND, CULL_FACE, DEPTH_TEST, STENCIL_TEST, SCISSOR_TEST = 0xBE2, 0xB44, 0xB71, 0xB90, 0xC11
POLYGON_OFFSET_FILL = 0x8037
#: Triangles are clipped at 8 times the target's size, not at its edges: clipping rounds the end of an edge to a
#: subpixel, which changes the covered pixels.  Powers of two, because dividing by them is exact.
GUARD_BANDS = (8, 4, 2)
#: :attr:`Bound.state` of a pixel pass.
PIXEL_PASS = "pixel pass"
#: Pixel store parameters for unpacking and packing.
_ROW_LENGTHS, _ROW_ALIGNMENTS = (0xCF2, 0xD02), (0xCF5, 0xD05)
_PIXEL_SKIPS = (0xCF3, 0xCF4, 0xD03, 0xD04)  # skipped rows, skipped pixels
#: Byte swapping, which OpenGL ES lacks.
SWAPPED_BYTES = (0xCF0, 0xD00)


@dataclass(frozen=True)
class Rows:
    """Row layout of a picture in host memory: pixels from row to row (0: the width), and the alignment of rows in
    bytes."""

    length: int = 0
    alignment: int = 1


_ROWS_AT_FIRST = Rows(0, 4)


def guard_band(gl: Functions, size: tuple[int, int], limit: int) -> int:
    """Return how many times larger than the target the viewport of a draw can be: 8, 4, 2 or 1."""
    is_exact = gl.ViewportIndexedf is not None or not (size[0] % 2 or size[1] % 2)
    return next((times for times in GUARD_BANDS if is_exact and max(size) * times <= limit), 1)


def set_guard_band(
    gl: Functions, bound: Bound, size: tuple[int, int], times: int, origin: tuple[int, int] = (0, 0)
) -> None:
    """Set a larger viewport around the target, which begins at ``origin``; the vertex shader scales clip coordinates
    down to match."""
    viewport = (*origin, *size, times)
    if bound.viewport == viewport:
        return
    bound.viewport = viewport
    left, top = (first - (times - 1) * side / 2 for first, side in zip(origin, size, strict=True))
    width, height = (times * side for side in size)
    if left.is_integer() and top.is_integer():
        gl.Viewport(int(left), int(top), width, height)
    else:
        gl.ViewportIndexedf(0, left, top, width, height)


def set_common(gl: Functions, bound: Bound, framebuffer: int) -> None:
    """Set the framebuffer, and the state that pixel passes, draws and clears share."""
    if not bound.switched_off:
        for switch in gl.has.off:
            gl.Disable(switch)
        if gl.PolygonMode is not None:
            gl.PolygonMode(g.FRONT_AND_BACK, g.FILL)
        bound.switched_off = True
    if bound.framebuffer != framebuffer:
        gl.BindFramebuffer(g.FRAMEBUFFER, framebuffer)
        bound.framebuffer = framebuffer


def set_pixel_pass(
    gl: Functions, bound: Bound, framebuffer: int, size: tuple[int, int], origin: tuple[int, int] = (0, 0)
) -> None:
    """Disable tests and blending, write every channel; ``origin`` is the lower left pixel of the target's part."""
    set_common(gl, bound, framebuffer)
    set_guard_band(gl, bound, size, 1, origin)
    if bound.state is not PIXEL_PASS:
        for switch in (BLEND, CULL_FACE, DEPTH_TEST, STENCIL_TEST):
            gl.Disable(switch)
        _open_colours(gl)
        bound.state = PIXEL_PASS


def _open_colours(gl: Functions) -> None:
    gl.ColorMask(1, 1, 1, 1)


@contextmanager
def transfer(gl: Functions, rows: Rows) -> Iterator[None]:
    """Set up one transfer between host memory and a texture on unit 0: no pixel buffers, no skips, no byte swapping.
    Afterwards the row layout is OpenGL's default again."""
    gl.BindBuffer(g.PIXEL_PACK_BUFFER, 0)
    gl.BindBuffer(g.PIXEL_UNPACK_BUFFER, 0)
    for what in _PIXEL_SKIPS if gl.has.is_es else (*_PIXEL_SKIPS, *SWAPPED_BYTES):
        gl.PixelStorei(what, 0)
    _set_rows(gl, rows)
    gl.ActiveTexture(g.TEXTURE0)
    try:
        yield
    finally:
        gl.BindTexture(g.TEXTURE_2D, 0)
        _set_rows(gl, _ROWS_AT_FIRST)


def _set_rows(gl: Functions, rows: Rows) -> None:
    for what in _ROW_LENGTHS:
        gl.PixelStorei(what, rows.length)
    for what in _ROW_ALIGNMENTS:
        gl.PixelStorei(what, rows.alignment)


def bind_images(gl: Functions, bound: Bound, images: Sequence[Texture]) -> None:
    """Bind textures from unit 0 on; sampler objects override the parameters of foreign textures only."""
    textures, samplers = bound.textures, bound.samplers
    for unit, image in enumerate(images):
        if unit == len(textures):
            textures.append(None)
            samplers.append(None)
        if samplers[unit] != image.sampler:
            gl.BindSampler(unit, image.sampler)
            samplers[unit] = image.sampler
        if textures[unit] != image.name:
            if bound.unit != unit:
                gl.ActiveTexture(g.TEXTURE0 + unit)
                bound.unit = unit
            gl.BindTexture(g.TEXTURE_2D, image.name)
            textures[unit] = image.name


def use(gl: Functions, bound: Bound, program: int, vertex_array: int) -> None:
    """Use a program and a vertex array for the next draw."""
    if bound.used != program:
        gl.UseProgram(program)
        bound.used = program
    if bound.vertex_array != vertex_array:
        gl.BindVertexArray(vertex_array)
        bound.vertex_array = vertex_array


def set_draw(gl: Functions, bound: Bound, state: DrawState, outputs: Sequence[Texture], depth: Texture | None) -> None:
    """Set everything in a DrawState, after :func:`set_common` and the clears."""
    draw_state = (state, depth is None, *(texture.padded for texture in outputs))
    if bound.state == draw_state:
        return
    bound.state = draw_state
    # The vertex shader flips pictures, so front faces are clockwise here.
    gl.FrontFace(g.CLOCKWISE)
    _switch(gl, CULL_FACE, state.cull != "none")
    if state.cull != "none":
        gl.CullFace(_CULL[state.cull])
    _switch(gl, DEPTH_TEST, depth is not None)
    gl.DepthFunc(_COMPARE[state.depth_compare])
    gl.DepthMask(int(state.depth_write))
    factor, units = state.polygon_offset
    _switch(gl, POLYGON_OFFSET_FILL, (factor, units) != (0.0, 0.0))
    gl.PolygonOffset(factor, units)
    _set_stencil(gl, state)
    _set_blend(gl, state.blend)
    apart = gl.ColorMaski is not None
    for k, texture in enumerate(outputs):
        mask = state.color_mask[k] if state.color_mask else (True,) * 4
        # Alpha of a three-channel target must stay 1, the value of a missing alpha on reads; without blending shaders
        # write 1.
        keeps_alpha = texture.padded and (apart or any(state.blend))
        red, green, blue, alpha = (int(on) for on in (*mask[:3], mask[3] and not keeps_alpha))
        if apart:
            gl.ColorMaski(k, red, green, blue, alpha)
        else:
            gl.ColorMask(red, green, blue, alpha)


def _set_stencil(gl: Functions, state: DrawState) -> None:
    stencil = state.stencil
    _switch(gl, STENCIL_TEST, stencil is not None)
    if stencil is not None:
        gl.StencilFunc(_COMPARE[stencil.compare], stencil.reference, stencil.read_mask)
        gl.StencilOp(_STENCIL[stencil.fail], _STENCIL[stencil.depth_fail], _STENCIL[stencil.passed])
        gl.StencilMask(stencil.write_mask)


def check_targets(gl: Functions, state: DrawState, formats: Sequence[Format], where: str) -> None:
    """Raise an error if this driver cannot mask and blend targets as the draw requires.

    Raises
    ------
    UnsupportedError
        With the draw, and the feature that the driver lacks.
    """
    blends = state.blend or (None,) * len(formats)
    some = {b for b in blends if b is not None}
    if len(some) > 1 and gl.BlendFuncSeparatei is None:
        raise UnsupportedError(
            f"{gl.backend}: {where} blends its targets in different ways, which takes OpenGL 4.0, OpenGL ES 3.2 or "
            "GL_ARB_draw_buffers_blend, and this driver has none; use one blend for all, or several draws"
        )
    unlike = len(set(state.color_mask)) > 1
    if some:
        unlike = unlike or None in blends or len({f.channels == 3 for f in formats}) > 1
    if unlike and gl.ColorMaski is None:
        raise UnsupportedError(
            f"{gl.backend}: {where} masks or blends some of its targets and not the others (those of three channels "
            "count as masked), which takes OpenGL ES 3.2 or GL_EXT_draw_buffers_indexed, and this driver has neither; "
            "treat all alike, or use several draws"
        )
    for blend, format_ in zip(blends, formats, strict=True):
        if blend is not None and not gl.has.blends(format_.number):
            raise UnsupportedError(
                f"{gl.backend}: {where} blends into {format_.name}, which takes GL_EXT_float_blend, and this driver "
                f"lacks it; give the target a format of 16 or 8 bits, such as {format_.name.replace('32', '16')}"
            )


def _set_blend(gl: Functions, blends: tuple[Blend | None, ...]) -> None:
    gl.Disable(BLEND)
    different = len({b for b in blends if b is not None}) > 1
    for k, blend in enumerate(blends):
        if blend is None:
            continue
        if gl.Enablei is not None:
            gl.Enablei(BLEND, k)
        else:
            gl.Enable(BLEND)
        source, destination, equation = blend.alpha_terms
        factors = (
            _FACTORS[blend.source],
            _FACTORS[blend.destination],
            _FACTORS[source],
            _FACTORS[destination],
        )
        equations = (_EQUATIONS[blend.equation], _EQUATIONS[equation])
        if different:
            gl.BlendFuncSeparatei(k, *factors)
            gl.BlendEquationSeparatei(k, *equations)
        else:
            gl.BlendFuncSeparate(*factors)
            gl.BlendEquationSeparate(*equations)


def _switch(gl: Functions, what: int, on: bool) -> None:
    if on:
        gl.Enable(what)
    else:
        gl.Disable(what)


def clear_targets(
    gl: Functions, bound: Bound, colours: list[tuple[int, Any]], depth: float | None, stencil: int | None
) -> None:
    """Clear color attachments (number, four floats), depth and stencil, with all masks open."""
    if not colours and depth is None:
        return
    bound.state = None
    _open_colours(gl)
    for number, value in colours:
        gl.ClearBufferfv(g.COLOR, number, value.ctypes.data)
    if depth is None:
        return
    gl.DepthMask(1)
    gl.StencilMask(0xFF)
    if stencil is None:
        gl.ClearBufferfv(g.DEPTH, 0, (ctypes.c_float * 1)(depth))
    else:
        gl.ClearBufferfi(g.DEPTH_STENCIL, 0, depth, stencil)
