"""Which types GLSL takes for which, without being asked."""

from __future__ import annotations

from passgraph.language.types import FLOAT, INT, ImageType, Scalar, Type, Vector, with_element
from passgraph.language.values import ImageValue, Part, TupleValue, type_of


def type_of_part(part: Part) -> Type | None:
    return None if isinstance(part, TupleValue) else type_of(part)


def cost_of(part: Part, type_: Type, passed: str) -> int | None:
    """0 for the type itself, 1 where ints become floats, None where a parameter does not take a value."""
    given = type_of_part(part)
    if given == type_ or (isinstance(type_, ImageType) and isinstance(part, ImageValue)):
        return 0
    if passed == "in" and isinstance(given, (Scalar, Vector)) and isinstance(type_, (Scalar, Vector)):
        same_shape = isinstance(given, Scalar) == isinstance(type_, Scalar)
        element = given if isinstance(given, Scalar) else given.element
        if same_shape and element is INT and with_element(given, FLOAT) == type_:
            return 1
    return None
