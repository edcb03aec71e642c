"""Parse reads of pictures: texels, filtered samples, levels, sizes, and pictures as arguments of functions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias, cast

from passgraph.language import ir
from passgraph.language.facts import PROPERTIES
from passgraph.language.library import LIBRARY
from passgraph.language.source import Span, fail
from passgraph.language.types import FLOAT, INT, IVEC2, VEC2, VEC3, VEC4, Value
from passgraph.language.typing_rules import widen
from passgraph.language.values import ImageValue, Part

#: Inlines a library function: its name, its arguments, the span of the call.
Inline: TypeAlias = Callable[[str, list[Part], Span], Part]


_UV: tuple[str, Value] = ("position", VEC2)
#: Method → its parameters, its library function, and, if the last parameter (a mipmap level) is optional, the function
#: that takes it too.
METHODS: dict[str, tuple[tuple[tuple[str, Value], ...], str, str | None]] = {
    "texel": ((("position", IVEC2), ("level", INT)), "texel", "texel_of"),
    "sample": ((_UV, ("lod", FLOAT)), "sample", "sample_between"),
    "nearest": ((_UV,), "nearest", None),
    "lod": ((_UV,), "lod", None),
    "gather": ((_UV, ("channel", INT)), "gather", None),
    "sample3": ((("position", VEC3),), "sample3", None),
    "size_of": ((("level", INT),), "size_of", None),
    # For the library only.
    "_filtered": ((_UV, ("value", VEC4), ("slack", VEC4)), "_filtered", None),
}


def _reads() -> str:
    """List the ways to read a picture, for messages."""
    ways = ["image[dx, dy]"]
    for name, (parameters, _, deep) in METHODS.items():
        if name.startswith("_"):
            continue
        needed = parameters[:-1] if deep else parameters
        ways.append(f"image.{name}({', '.join(str(type_) for _, type_ in needed)})")
    return ", ".join(ways)


def attribute(image: ImageValue, name: str, span: Span) -> ir.Expr:
    """Return ``image.size``, or a property of the image's handle."""
    if name == "size":
        return ir.Size(IVEC2, image.name, span)
    if name in PROPERTIES:
        return ir.Property(PROPERTIES[name], image.name, name, span)
    # Names from other languages are looked up for errors only.
    from passgraph.language.scope import FORMS, mending

    mend = mending(name) if name in FORMS else ""
    fail(span, f"an Image has .size, .levels and .slices, and is read by {_reads()}, not .{name}{mend}")


def bound(method: str, arguments: Sequence[ir.Expr], named: Mapping[str, ir.Expr], span: Span) -> dict[str, ir.Expr]:
    """Return the arguments of a method by parameter, converted to its type."""
    if method not in METHODS or (method.startswith("_") and span.file != LIBRARY):
        fail(span, f"an Image is read by {_reads()}; it has no .{method}()")
    parameters, _, deep = METHODS[method]
    names = [name for name, _ in parameters]
    needed = names[:-1] if deep else names
    bound_arguments = {**dict(zip(names, arguments, strict=False)), **named}
    is_complete = len(bound_arguments) == len(arguments) + len(named) and set(needed) <= set(bound_arguments) <= set(
        names
    )
    if len(arguments) > len(names) or not is_complete:
        listed = ", ".join(f"{name}: {type_}" for name, type_ in parameters)
        left = f"; {names[-1]} may be left out" if deep else ""
        fail(span, f"an Image is read by .{method}({listed}){left}")
    types = dict(parameters)
    return {name: widen(part, types[name], span, f"the {name} of {method}()") for name, part in bound_arguments.items()}


def read(inline: Inline, image: ImageValue, method: str, arguments: Mapping[str, ir.Expr], span: Span) -> ir.Expr:
    """Call a method of an image with arguments from :func:`bound`; each has a name, as it is used more than once."""
    parameters, function, deep = METHODS[method]
    values = [arguments[name] for name, _ in parameters if name in arguments]
    if deep and len(values) == len(parameters):
        if not is_first(values[-1]):
            return _inlined(inline, deep, [image, ImageValue(image.name + ir.MIPS), *values], span)
        values.pop()
    if method == "texel":
        x, y = (ir.Swizzle(INT, values[0], (i,), span) for i in (0, 1))
        return ir.Texel(VEC4, image.name, x, y, False, span)
    if method == "_filtered":
        u, v = (ir.Swizzle(FLOAT, values[0], (i,), span) for i in (0, 1))
        return ir.Filtered(VEC4, image.name, u, v, values[1], values[2], span)
    return _inlined(inline, function, [image, *values], span)


def is_first(level: ir.Expr) -> bool:
    """Return True if a level is a literal for the picture itself."""
    return isinstance(level, ir.Literal) and level.value <= 0


def _inlined(inline: Inline, name: str, arguments: list[Part], span: Span) -> ir.Expr:
    return cast(ir.Expr, inline(name, arguments, span))
