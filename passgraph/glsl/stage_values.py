"""Built-in values of fragment shaders: of the pixel, of its place in the picture, and of OpenGL's initial state."""

from __future__ import annotations

from functools import partial

from passgraph.glsl.unit import NativeValue, Unit
from passgraph.language import ir
from passgraph.language.source import Span
from passgraph.language.types import BOOL, FLOAT, INT, IVEC2, VEC2, VEC4, Array, Struct
from passgraph.language.typing_rules import apply
from passgraph.language.values import Part, StructValue


def fragment(unit: Unit, span: Span, from_top: bool = False, whole: bool = False) -> Part:
    """Return ``gl_FragCoord``: the center of this pixel, as the shader counts rows, or with rows ``from_top``.

    Centers have halves, or are ``whole`` (GLSL 3.30, section 4.3.8.1).
    """
    half, one = ir.Literal(FLOAT, 0.5, span), ir.Literal(FLOAT, 1.0, span)
    place = [apply("to_float", [one], span) for one in pixel_place(unit, span, from_top)]
    centre = place if whole else [apply("add", [one, half], span) for one in place]
    return ir.Construct(VEC4, (*centre, half, one), span)


def pixel_place(unit: Unit, span: Span, from_top: bool = False) -> tuple[ir.Expr, ir.Expr]:
    """Return column and row of this pixel, as the shader counts them, or with rows ``from_top``."""
    pixel, size = ir.Builtin(IVEC2, "pixel", span), ir.Builtin(IVEC2, "output_size", span)
    x, y = (ir.Swizzle(INT, pixel, (i,), span) for i in (0, 1))
    if from_top or not unit.rows_up:
        return x, y
    rows = apply("sub", [ir.Swizzle(INT, size, (1,), span), ir.Literal(INT, 1, span)], span)
    return x, apply("sub", [rows, y], span)


def output_size(unit: Unit, span: Span) -> Part:
    """Return width and height of the target, in pixels, as vec2."""
    return apply("to_float", [ir.Builtin(IVEC2, "output_size", span)], span)


def position(unit: Unit, span: Span) -> Part:
    """Return this pixel's center in the picture, from (0, 0) at the bottom left to (1, 1) at the top right."""
    fragment_position = fragment(unit, span)
    assert isinstance(fragment_position, ir.Construct)
    centre = ir.Construct(VEC2, fragment_position.arguments[:2], span)
    return apply("div", [centre, output_size(unit, span)], span)  # type: ignore[list-item]


#: Limits that GLSL ES 3.00 guarantees (section 7.3).
LIMITS = {
    "gl_MaxVertexAttribs": 16, "gl_MaxVertexUniformVectors": 256, "gl_MaxVertexOutputVectors": 16,
    "gl_MaxFragmentInputVectors": 15, "gl_MaxVaryingVectors": 8, "gl_MaxVertexTextureImageUnits": 16,
    "gl_MaxCombinedTextureImageUnits": 32, "gl_MaxTextureImageUnits": 16, "gl_MaxFragmentUniformVectors": 224,
    "gl_MaxDrawBuffers": 8, "gl_MinProgramTexelOffset": -8, "gl_MaxProgramTexelOffset": 7,
}  # fmt: skip


def _limit(number: int, unit: Unit, span: Span) -> Part:
    return ir.Literal(INT, number, span)


#: The type of ``gl_DepthRange``.
DEPTH_RANGE = Struct("gl_DepthRangeParameters", (("near", FLOAT), ("far", FLOAT), ("diff", FLOAT)))
#: Sets of texture coordinates; OpenGL 2.1 guarantees 2, and drivers have 8.
TEXTURE_COORDINATES = 8


def _depth_range(unit: Unit, span: Span) -> Part:
    """Return ``gl_DepthRange`` as it is unless a program sets another (OpenGL 2.1, section 2.11.1)."""
    ends = {"near": 0.0, "far": 1.0, "diff": 1.0}
    return StructValue(DEPTH_RANGE, {name: ir.Literal(FLOAT, end, span) for name, end in ends.items()})


def _vec4(numbers: tuple[float, float, float, float], unit: Unit, span: Span) -> ir.Expr:
    return ir.Construct(VEC4, tuple(ir.Literal(FLOAT, number, span) for number in numbers), span)


def texture_coordinates(unit: Unit, span: Span, count: int = TEXTURE_COORDINATES) -> Part:
    """Return ``gl_TexCoord``: the position in the picture, then coordinates as they are if a program sets none."""
    unit.note(span, "gl_TexCoord[0] is the position in the picture here, from (0, 0) at the bottom left to (1, 1)")
    zero, one = ir.Literal(FLOAT, 0.0, span), ir.Literal(FLOAT, 1.0, span)
    first = ir.Construct(VEC4, (position(unit, span), zero, one), span)  # type: ignore[arg-type]
    others = [_vec4((0.0, 0.0, 0.0, 1.0), unit, span)] * (count - 1)
    return ir.Construct(Array(VEC4, count), (first, *others), span)


#: Built-in values of fragment shaders, and two for preludes of containers. Colors of vertices are those of OpenGL's
#: initial state (OpenGL 2.1, table 6.5), without fog.
STAGE: dict[str, NativeValue] = {
    "gl_DepthRange": _depth_range,
    "gl_TexCoord": texture_coordinates,
    "gl_Color": partial(_vec4, (1.0, 1.0, 1.0, 1.0)),
    "gl_SecondaryColor": partial(_vec4, (0.0, 0.0, 0.0, 1.0)),
    "gl_FogFragCoord": lambda unit, span: ir.Literal(FLOAT, 0.0, span),
    "gl_FragCoord": fragment,
    "gl_FrontFacing": lambda unit, span: ir.Literal(BOOL, True, span),
    "gl_PointCoord": position,
    **{name: partial(_limit, number) for name, number in LIMITS.items()},
    "pg_position": position,
    "pg_output_size": output_size,
}
