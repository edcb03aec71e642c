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
from passgraph.language.types import BOOL, FLOAT, INT, IVEC2, VEC2, VEC3, VEC4, Type
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


def _inlined(unit: Unit, name: str, arguments: Sequence[Part], span: Span) -> Part:
    return inlined(unit.builder, library_function(name), (list(arguments), {}), span)


#: How a filtered read selects a level → the number of its arguments for that, and their description.
_CHOSEN = {"itself": (0, ""), "level": (1, ", a level"), "derivatives": (2, ", two derivatives")}


def _sampled(
    unit: Unit, parts: list[Part], span: Span, *, by: str = "itself", projected: bool = False, has_offset: bool = False
) -> Part:
    """Lower a filtered read; ``by`` is how the level is selected, ``has_offset`` if an offset in texels follows."""
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
    position = _divided(unit, parts, span) if projected else _position(parts, VEC2, span)
    position = unit.builder.name_it(position, span)
    lod = _lod(unit, image, position, by, [*behind[:count], *behind[count + has_offset :]], span)
    if lod is None and not has_offset:
        return _inlined(unit, unit.turned("sample"), [image, position], span)
    offset: ir.Expr = ir.Construct(IVEC2, (ir.Literal(INT, 0, span),) * 2, span)
    if has_offset:
        offset = widen(plain(behind[count], span, "an offset"), IVEC2, span, "an offset")
    arguments = [position, lod or ir.Literal(FLOAT, 0.0, span), offset, ir.Literal(BOOL, unit.rows_up, span)]
    return _inlined(unit, "sample_beside", [image, ImageValue(image.name + ir.MIPS), *arguments], span)


def _lod(
    unit: Unit, image: ImageValue, position: ir.Expr, by: str, level_arguments: list[Part], span: Span
) -> ir.Expr | None:
    """Return the level of a read; None for the first."""
    level_type = VEC2 if by == "derivatives" else FLOAT
    what = {"itself": "a bias", "level": "a level", "derivatives": "a derivative"}[by]
    levels = [widen(plain(part, span, what), level_type, span, what) for part in level_arguments]
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


def _divided(unit: Unit, parts: list[Part], span: Span) -> ir.Expr:
    """Return the position of a projected read, ``p.xy / p.z`` or ``p.xy / p.w``."""
    at = plain(parts[1], span, "where to read") if len(parts) > 1 else None
    if at is None or at.type not in (VEC3, VEC4):
        fail(span, "a projected read takes a vec3 or a vec4")
    at = unit.builder.name_it(at, span)
    divisor = ir.Swizzle(FLOAT, at, (2 if at.type == VEC3 else 3,), span)
    return apply("div", [ir.Swizzle(VEC2, at, (0, 1), span), divisor], span)


def _of_texels(unit: Unit, parts: list[Part], span: Span) -> Part:
    """Lower a filtered read at a position in texels, as of rectangle textures."""
    image = _image(parts, span)
    size = apply("to_float", [ir.Size(IVEC2, image.name, span)], span)
    position = apply("div", [_position(parts, VEC2, span), size], span)
    return _inlined(unit, unit.turned("sample"), [image, position], span)


def _level_of(unit: Unit, part: Part, span: Span) -> ir.Expr | None:
    """Return the integer level of a read; None for the first."""
    level = widen(as_int(plain(part, span, "a level"), span), INT, span, "a level")
    if is_first(level):
        return None
    unit.note(span, _LEVELS)
    return level


def _fetched(unit: Unit, parts: list[Part], span: Span) -> Part:
    image, position = _image(parts, span), _position(parts, IVEC2, span)
    level = _level_of(unit, parts[2], span) if len(parts) > 2 else None
    if level is None:
        return _inlined(unit, unit.turned("texel"), [image, position], span)
    arguments = [image, ImageValue(image.name + ir.MIPS), position, level]
    return _inlined(unit, unit.turned("texel_of"), arguments, span)


def _fetched_beside(unit: Unit, parts: list[Part], span: Span) -> Part:
    if len(parts) != 4:
        fail(span, "texelFetchOffset() takes a sampler, a texel, a level and an offset")
    offset = widen(plain(parts[3], span, "an offset"), IVEC2, span, "an offset")
    moved = apply("add", [_position(parts, IVEC2, span), offset], span)
    return _fetched(unit, [parts[0], moved, parts[2]], span)


def _size(unit: Unit, parts: list[Part], span: Span) -> Part:
    image = _image(parts, span)
    level = _level_of(unit, parts[1], span) if len(parts) > 1 else None
    return ir.Size(IVEC2, image.name, span) if level is None else _inlined(unit, "size_of", [image, level], span)


def _levels(unit: Unit, parts: list[Part], span: Span) -> Part:
    return attribute(_image(parts, span), "levels", span)


def _query_lod(unit: Unit, parts: list[Part], span: Span) -> Part:
    """Lower ``textureQueryLod``: the level that a read would use, and the computed one before clamping."""
    image = _image(parts, span)
    lod = unit.builder.name_it(
        plain(_inlined(unit, "lod", [image, _position(parts, VEC2, span)], span), span, "a level"), span
    )
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
                yield f"texture2D{projection}{ending}", plainly
    yield "texture3D", _sampled


def _here(unit: Unit, parts: list[Part], span: Span) -> Part:
    """Lower ``pg_here`` of containers: the texel at this pixel, which allows fusion with the pass before."""
    zero = ir.Literal(INT, 0, span)
    return ir.Texel(VEC4, _image(parts, span).name, zero, zero, True, span)


READS: dict[str, Native] = {
    "pg_here": _here,
    **dict(_reads()),
    **dict.fromkeys(("texture2DRect", "textureRect"), _of_texels),
    "texelFetch": _fetched,
    "texelFetch2DRect": _fetched,
    "texelFetchOffset": _fetched_beside,
    **dict.fromkeys(("textureSize", "textureSize2D"), _size),
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
