"""Reads of pictures, and where a fragment lies.

Shaders count rows from the bottom up, pictures here from the top down: what a shader calls (0, 0) is the bottom left
corner.  The turn lies in these reads and in ``gl_FragCoord`` alone, so that pictures look upright to a shader.  Players
of video count from the top; their shaders are read without a turn.
"""

from __future__ import annotations

from functools import partial

from passgraph.language import ir
from passgraph.language.frame import inlined
from passgraph.language.library import library_function
from passgraph.language.source import Span, fail
from passgraph.language.types import BOOL, FLOAT, INT, IVEC2, VEC2, VEC3, VEC4, Type
from passgraph.language.typing_rules import apply, widen
from passgraph.language.values import ImageValue, Part, part_type
from passgraph.shaders.glsl.operators import plain
from passgraph.shaders.glsl.unit import Native, NativeValue, Unit


def _image(parts: list[Part], span: Span) -> ImageValue:
    if not parts or not isinstance(parts[0], ImageValue):
        fail(span, f"a sampler is expected first, got {part_type(parts[0]) if parts else 'nothing'}")
    return parts[0]


def _position(parts: list[Part], type_: Type, span: Span) -> ir.Expr:
    if len(parts) < 2:
        fail(span, "where to read is missing")
    value = plain(parts[1], span, "where to read")
    return widen(value, type_, span, "where to read")


def _inlined(unit: Unit, name: str, arguments: list[Part], span: Span) -> Part:
    return inlined(unit.builder, library_function(name), (arguments, {}), span)


def _texture(unit: Unit, parts: list[Part], span: Span, *, last: str = "") -> Part:
    """A filtered read; ``last`` names what the third argument is."""
    image = _image(parts, span)
    if len(parts) > 3:
        fail(span, f"a read of a picture takes at most 3 arguments, got {len(parts)}")
    if len(parts) == 3:
        unit.note(span, f"shaders read the first level of a picture: the {last or 'bias'} does not count")
    if len(parts) > 1 and getattr(parts[1], "type", None) == VEC3:
        # Rows of a volume are counted as they are stored, as those of a colour table are.
        return _inlined(unit, "sample3", [image, _position(parts, VEC3, span)], span)
    return _inlined(unit, unit.turned("sample"), [image, _position(parts, VEC2, span)], span)


def _graded(unit: Unit, parts: list[Part], span: Span) -> Part:
    """A filtered read whose derivatives would choose a level."""
    if len(parts) != 4:
        fail(span, f"it takes a sampler, a position and two derivatives, got {len(parts)} arguments")
    return _texture(unit, parts[:3], span, last="pair of derivatives")


def _projected(unit: Unit, parts: list[Part], span: Span) -> Part:
    """A read at ``p.xy / p.z`` or ``p.xy / p.w``."""
    image = _image(parts, span)
    at = plain(parts[1], span, "where to read") if len(parts) > 1 else None
    if at is None or at.type not in (VEC3, VEC4):
        fail(span, "a projected read takes a vec3 or a vec4")
    at = unit.builder.name_it(at, span)
    divisor = ir.Swizzle(FLOAT, at, (2 if at.type == VEC3 else 3,), span)
    position = apply("div", [ir.Swizzle(VEC2, at, (0, 1), span), divisor], span)
    return _texture(unit, [image, position, *parts[2:]], span)


def _of_texels(unit: Unit, parts: list[Part], span: Span) -> Part:
    """A filtered read at texels, as of rectangle textures."""
    image = _image(parts, span)
    size = apply("to_float", [ir.Size(IVEC2, image.name, span)], span)
    position = apply("div", [_position(parts, VEC2, span), size], span)
    return _inlined(unit, unit.turned("sample"), [image, position], span)


def _offset(unit: Unit, parts: list[Part], span: Span) -> Part:
    """A filtered read so many texels farther."""
    image = _image(parts, span)
    if len(parts) < 3:
        fail(span, "the offset is missing")
    size = apply("to_float", [ir.Size(IVEC2, image.name, span)], span)
    offset = widen(plain(parts[-1], span, "an offset"), IVEC2, span, "an offset")
    moved = apply("div", [apply("to_float", [offset], span), size], span)
    return _texture(unit, [image, apply("add", [_position(parts, VEC2, span), moved], span)], span)


def _fetched(unit: Unit, parts: list[Part], span: Span) -> Part:
    return _inlined(unit, unit.turned("texel"), [_image(parts, span), _position(parts, IVEC2, span)], span)


def _fetched_beside(unit: Unit, parts: list[Part], span: Span) -> Part:
    if len(parts) != 4:
        fail(span, "texelFetchOffset() takes a sampler, a texel, a level and an offset")
    offset = widen(plain(parts[3], span, "an offset"), IVEC2, span, "an offset")
    moved = apply("add", [_position(parts, IVEC2, span), offset], span)
    return _fetched(unit, [parts[0], moved], span)


def _size(unit: Unit, parts: list[Part], span: Span) -> Part:
    return ir.Size(IVEC2, _image(parts, span).name, span)


def _levels(unit: Unit, parts: list[Part], span: Span) -> Part:
    _image(parts, span)
    return ir.Literal(INT, 1, span)


READS: dict[str, Native] = {
    **dict.fromkeys(("texture", "texture2D", "texture3D"), _texture),
    **dict.fromkeys(("textureLod", "texture2DLod", "texture2DLodEXT"), partial(_texture, last="level")),
    **dict.fromkeys(("textureGrad", "texture2DGradEXT", "texture2DGradARB"), _graded),
    **dict.fromkeys(("textureProj", "texture2DProj"), _projected),
    **dict.fromkeys(("texture2DRect", "textureRect"), _of_texels),
    **dict.fromkeys(("textureOffset", "textureLodOffset"), _offset),
    "texelFetch": _fetched,
    "texelFetch2DRect": _fetched,
    "texelFetchOffset": _fetched_beside,
    **dict.fromkeys(("textureSize", "textureSize2D"), _size),
    "textureQueryLevels": _levels,
}  # fmt: skip


def _fragment(unit: Unit, span: Span) -> Part:
    """``gl_FragCoord``: the centre of this pixel, rows counted from the bottom."""
    half, one = ir.Literal(FLOAT, 0.5, span), ir.Literal(FLOAT, 1.0, span)
    parts = [apply("add", [apply("to_float", [place], span), half], span) for place in pixel_place(unit, span)]
    return ir.Construct(VEC4, (*parts, half, one), span)


def pixel_place(unit: Unit, span: Span) -> tuple[ir.Expr, ir.Expr]:
    """Column and row of this pixel as the shader counts them."""
    pixel, size = ir.Builtin(IVEC2, "pixel", span), ir.Builtin(IVEC2, "output_size", span)
    x, y = (ir.Swizzle(INT, pixel, (i,), span) for i in (0, 1))
    if not unit.rows_up:
        return x, y
    rows = apply("sub", [ir.Swizzle(INT, size, (1,), span), ir.Literal(INT, 1, span)], span)
    return x, apply("sub", [rows, y], span)


def output_size(unit: Unit, span: Span) -> Part:
    """Width and height of the target, in pixels, as vec2."""
    return apply("to_float", [ir.Builtin(IVEC2, "output_size", span)], span)


def aspect(unit: Unit, span: Span) -> Part:
    """Width of the target by its height."""
    size = unit.builder.name_it(plain(output_size(unit, span), span, "a size"), span)
    return apply("div", [ir.Swizzle(FLOAT, size, (0,), span), ir.Swizzle(FLOAT, size, (1,), span)], span)


def position(unit: Unit, span: Span) -> Part:
    """Where this pixel's centre lies in the picture, (0, 0) at the bottom left and (1, 1) at the top right."""
    whole = _fragment(unit, span)
    assert isinstance(whole, ir.Construct)
    centre = ir.Construct(VEC2, whole.arguments[:2], span)
    return apply("div", [centre, output_size(unit, span)], span)  # type: ignore[list-item]


#: Values that every fragment shader knows, and two for preludes of containers.
STAGE: dict[str, NativeValue] = {
    "gl_FragCoord": _fragment,
    "gl_FrontFacing": lambda unit, span: ir.Literal(BOOL, True, span),
    "gl_PointCoord": position,
    "pg_position": position,
    "pg_output_size": output_size,
}
