"""GLSL functions that read pictures, and derivatives, whose sign depends on the direction of rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from passgraph.glsl.operators import as_int, plain
from passgraph.glsl.unit import Native, Unit
from passgraph.language import ir
from passgraph.language.function_body import inlined
from passgraph.language.image_reads import attribute, is_first
from passgraph.language.library import library_function
from passgraph.language.quad_derivatives import derivative
from passgraph.language.source import Span, fail
from passgraph.language.types import BOOL, FLOAT, INT, IVEC2, IVEC3, VEC2, VEC3, VEC4, Type, Vector, component_count
from passgraph.language.typing_rules import apply, widen
from passgraph.language.values import ImageValue, Part, part_type


def _image(parts: list[Part], span: Span) -> ImageValue:
    if not parts or not isinstance(parts[0], ImageValue):
        fail(span, f"a sampler is expected first, got {part_type(parts[0]) if parts else 'nothing'}")
    return parts[0]


def _position(parts: list[Part], type_: Type, span: Span) -> ir.Expr:
    if len(parts) < 2:
        fail(span, "where to read is missing")
    value = plain(parts[1], span, "where to read")
    return widen(value, type_, span, "where to read")


def _size_of(image: ImageValue, span: Span) -> ir.Expr:
    return apply("to_float", [ir.Size(IVEC2, image.name, span)], span)


def _in_picture(unit: Unit, image: ImageValue, value: ir.Expr, span: Span, in_texels: bool = False) -> ir.Expr:
    """Return a position from 0 to 1 in both directions: a line's is in its row 0, a rectangle's in texels."""
    kind = unit.sampler_of(image.name)
    if kind == "sampler1D":
        half = ir.Literal(FLOAT, 0.5, span)
        row = apply("div", [half, ir.Swizzle(FLOAT, _size_of(image, span), (1,), span)], span)
        return ir.Construct(VEC2, (widen(value, FLOAT, span, "where to read"), row), span)
    value = widen(value, VEC2, span, "where to read")
    is_rectangle = in_texels or kind == "sampler2DRect"
    return apply("div", [value, _size_of(image, span)], span) if is_rectangle else value


def _beside(unit: Unit, image: ImageValue, part: Part, type_: Vector, span: Span, what: str) -> ir.Expr:
    """Return an offset or a derivative; those of a line have one component."""
    value = plain(part, span, what)
    if unit.sampler_of(image.name) != "sampler1D":
        return widen(value, type_, span, what)
    element = INT if type_ == IVEC2 else FLOAT
    return ir.Construct(type_, (widen(value, element, span, what), ir.Literal(element, 0, span)), span)


def _inlined(unit: Unit, name: str, arguments: Sequence[Part], span: Span) -> Part:
    return inlined(unit.builder, library_function(name), (list(arguments), {}), span)


#: How a filtered read selects a level → the number of its arguments for that, and their description.
_CHOSEN = {"itself": (0, ""), "level": (1, ", a level"), "derivatives": (2, ", two derivatives")}


def _sampled(
    unit: Unit,
    parts: list[Part],
    span: Span,
    *,
    by: str = "itself",
    projected: bool = False,
    has_offset: bool = False,
    in_texels: bool = False,
) -> Part:
    """Lower a filtered read; ``by`` is how the level is selected, ``has_offset`` if an offset in texels follows.

    ``in_texels`` : True for a position in texels, whatever the sampler is
    """
    image = _image(parts, span)
    count, count_of_level = _CHOSEN[by]
    behind, most = list(parts[2:]), count + has_offset + (by == "itself")
    if not count + has_offset <= len(behind) <= most:
        takes = (
            f"a sampler, a position{count_of_level}{', an offset' * has_offset}{', perhaps a bias' * (by == 'itself')}"
        )
        fail(span, f"this read takes {takes}; got {len(parts)} arguments")
    if not projected and len(parts) > 1 and getattr(parts[1], "type", None) == VEC3:
        # Rows of a volume are counted as stored, since volumes are mostly color tables.
        return _inlined(unit, "sample3", [image, _position(parts, VEC3, span)], span)
    if len(parts) < 2:
        fail(span, "where to read is missing")
    place = _divided(unit, image, parts, span) if projected else plain(parts[1], span, "where to read")
    position = unit.builder.name_it(_in_picture(unit, image, place, span, in_texels), span)
    lod = _lod(unit, image, position, by, [*behind[:count], *behind[count + has_offset :]], span)
    if lod is None and not has_offset:
        return _inlined(unit, unit.turned("sample"), [image, position], span)
    offset: ir.Expr = ir.Construct(IVEC2, (ir.Literal(INT, 0, span),) * 2, span)
    if has_offset:
        offset = _beside(unit, image, behind[count], IVEC2, span, "an offset")
    arguments = [position, lod or ir.Literal(FLOAT, 0.0, span), offset, ir.Literal(BOOL, unit.rows_up, span)]
    return _inlined(unit, "sample_beside", [image, ImageValue(image.name + ir.MIPS), *arguments], span)


def _lod(
    unit: Unit, image: ImageValue, position: ir.Expr, by: str, level_arguments: list[Part], span: Span
) -> ir.Expr | None:
    """Return the level of a read; None for the first."""
    what = {"itself": "a bias", "level": "a level", "derivatives": "a derivative"}[by]
    if by == "derivatives":
        levels = [_beside(unit, image, part, VEC2, span, what) for part in level_arguments]
    else:
        levels = [widen(plain(part, span, what), FLOAT, span, what) for part in level_arguments]
    if (by == "level" and is_first(levels[0])) or (by == "itself" and not levels and image.name not in unit.leveled):
        return None
    unit.note(span, _LEVELS)
    if by == "level":
        return levels[0]
    if by == "derivatives":
        return plain(_inlined(unit, "lod_along", [image, *levels], span), span, "a level")
    if image.name not in unit.leveled:
        return None
    level = plain(_inlined(unit, "lod", [image, position], span), span, "a level")
    return apply("add", [level, *levels], span) if levels else level


#: The note for a shader that needs mipmaps.
_LEVELS = "this may read a smaller level: a picture has some where its handle is one with mipmaps()"


def _divided(unit: Unit, image: ImageValue, parts: list[Part], span: Span) -> ir.Expr:
    """Return the position of a projected read: ``p.xy``, or ``p.x`` of a line, by the last component."""
    at = plain(parts[1], span, "where to read")
    is_line = unit.sampler_of(image.name) == "sampler1D"
    if at.type not in ((VEC2, VEC4) if is_line else (VEC3, VEC4)):
        fail(span, f"a projected read takes a {'vec2' if is_line else 'vec3'} or a vec4, got {at.type}")
    at = unit.builder.name_it(at, span)
    divisor = ir.Swizzle(FLOAT, at, (component_count(at.type) - 1,), span)
    place = ir.Swizzle(FLOAT, at, (0,), span) if is_line else ir.Swizzle(VEC2, at, (0, 1), span)
    return apply("div", [place, divisor], span)


def _texels(unit: Unit, parts: list[Part], span: Span) -> Part:
    """Lower ``pg_texels``: a position in texels, as the sampler takes it."""
    image = _image(parts, span)
    size = unit.builder.name_it(_size_of(image, span), span)
    return apply("mul", [_in_picture(unit, image, _position(parts, VEC2, span), span), size], span)


def _level_of(unit: Unit, part: Part, span: Span) -> ir.Expr | None:
    """Return the integer level of a read; None for the first."""
    level = widen(as_int(plain(part, span, "a level"), span), INT, span, "a level")
    if is_first(level):
        return None
    unit.note(span, _LEVELS)
    return level


def _fetched(unit: Unit, parts: list[Part], span: Span) -> Part:
    image, kind = _image(parts, span), unit.sampler_of(_image(parts, span).name)
    if kind == "sampler3D":
        size = _size(unit, [image], span)
        columns = ir.Swizzle(IVEC2, plain(size, span, "a size"), (0, 1), span)
        return _inlined(unit, "layered", [image, columns, _position(parts, IVEC3, span)], span)
    position = _position(parts, INT if kind == "sampler1D" else IVEC2, span)
    if kind == "sampler1D":
        position = ir.Construct(IVEC2, (position, ir.Literal(INT, 0, span)), span)
    level = _level_of(unit, parts[2], span) if len(parts) > 2 else None
    if level is None:
        return _inlined(unit, unit.turned("texel"), [image, position], span)
    arguments = [image, ImageValue(image.name + ir.MIPS), position, level]
    return _inlined(unit, unit.turned("texel_of"), arguments, span)


def _fetched_beside(unit: Unit, parts: list[Part], span: Span) -> Part:
    kind = unit.sampler_of(_image(parts, span).name)
    levels = 0 if kind == "sampler2DRect" else 1
    if len(parts) != 3 + levels:
        fail(span, f"texelFetchOffset() takes a sampler, a texel{', a level' * levels} and an offset")
    types: dict[str, Type] = {"sampler1D": INT, "sampler3D": IVEC3}
    type_ = types.get(kind, IVEC2)
    offset = widen(plain(parts[-1], span, "an offset"), type_, span, "an offset")
    moved = apply("add", [_position(parts, type_, span), offset], span)
    return _fetched(unit, [parts[0], moved, *parts[2:-1]], span)


def _size(unit: Unit, parts: list[Part], span: Span) -> Part:
    image, kind = _image(parts, span), unit.sampler_of(_image(parts, span).name)
    level = _level_of(unit, parts[1], span) if len(parts) > 1 else None
    size: ir.Expr = ir.Size(IVEC2, image.name, span)
    if level is not None:
        size = plain(_inlined(unit, "size_of", [image, level], span), span, "a size")
    width, height = (ir.Swizzle(INT, size, (i,), span) for i in (0, 1))
    if kind == "sampler3D":  # slices lie below one another
        slices = plain(attribute(image, "slices", span), span, "a count")
        return ir.Construct(IVEC3, (width, apply("quotient", [height, slices], span), slices), span)
    return width if kind == "sampler1D" else size


def _levels(unit: Unit, parts: list[Part], span: Span) -> Part:
    return attribute(_image(parts, span), "levels", span)


def _query_lod(unit: Unit, parts: list[Part], span: Span) -> Part:
    """Lower ``textureQueryLod``: the level that a read would use, and the computed one before clamping."""
    image = _image(parts, span)
    if len(parts) < 2:
        fail(span, "where to read is missing")
    position = _in_picture(unit, image, plain(parts[1], span, "where to read"), span)
    lod = unit.builder.name_it(plain(_inlined(unit, "lod", [image, position], span), span, "a level"), span)
    unit.note(span, _LEVELS)
    chosen = plain(_inlined(unit, "lod_within", [image, lod], span), span, "a level")
    return ir.Construct(VEC2, (chosen, lod), span)


def _reads() -> Iterator[tuple[str, Native]]:
    """Yield filtered reads by all their names in GLSL."""
    older = {"level": ("LodEXT",), "derivatives": ("GradEXT", "GradARB")}
    for projection in ("", "Proj"):
        for by, word in {"itself": "", "level": "Lod", "derivatives": "Grad"}.items():
            plainly = partial(_sampled, by=by, projected=bool(projection))
            yield f"texture{projection}{word}", plainly
            yield f"texture{projection}{word}Offset", partial(plainly, has_offset=True)
            for ending in (word, *older.get(by, ())):
                yield f"texture1D{projection}{ending}", plainly
                yield f"texture2D{projection}{ending}", plainly
        for name in ("texture2DRect", "textureRect"):
            yield f"{name}{projection}", partial(_sampled, projected=bool(projection), in_texels=True)
    yield "texture3D", _sampled


def _here(unit: Unit, parts: list[Part], span: Span) -> Part:
    """Lower ``pg_here`` of containers: the texel at this pixel, which allows fusion with the pass before."""
    zero = ir.Literal(INT, 0, span)
    return ir.Texel(VEC4, _image(parts, span).name, zero, zero, True, span)


READS: dict[str, Native] = {
    "pg_here": _here,
    **dict(_reads()),
    "pg_texels": _texels,
    "texelFetch": _fetched,
    "texelFetch2DRect": _fetched,
    "texelFetchOffset": _fetched_beside,
    **dict.fromkeys(("textureSize", "textureSize1D", "textureSize2D"), _size),
    "textureQueryLevels": _levels,
    "textureQueryLod": _query_lod,
    "textureQueryLOD": _query_lod,
}


def _grown(name: str, axes: str, unit: Unit, parts: list[Part], span: Span) -> Part:
    if len(parts) != 1:
        fail(span, f"{name}() takes 1 argument, got {len(parts)}")
    value = plain(parts[0], span, f"the argument of {name}()")
    change = derivative(name, axes, value, unit.builder, span)
    return apply("neg", [change], span) if axes == "y" and unit.rows_up else change


#: Derivatives. Drivers may compute coarse ones for names without a suffix; here all are fine.
DERIVATIVES: dict[str, Native] = {
    name + ending: partial(_grown, name + ending, axes)
    for name, axes in {"dFdx": "x", "dFdy": "y", "fwidth": "xy"}.items()
    for ending in ("", "Fine", "Coarse")
}
