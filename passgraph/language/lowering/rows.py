"""Operations that occur in lowered programs only, beside those of the table of operations.

``index`` and ``long`` are the types of addresses: their arithmetic never overflows, so that devices may compute it in
any way.  ``coordinate`` is that of texture coordinates.  An int may be used as an index, an index as a long, a float as
a coordinate.  The other types name how numbers are stored (``Format.number``): devices convert those in own ways.
"""

from __future__ import annotations

from collections.abc import Mapping

from passgraph.language.scalar import COORDINATE, INDEX, LONG

#: Type of the arguments → operation → number of arguments and type of the result.
LOWERED: Mapping[str, Mapping[str, tuple[int, str]]] = {
    INDEX: {
        **dict.fromkeys(("add", "sub", "mul", "min", "max"), (2, INDEX)),
        "int_mod": (2, INDEX),  # by a positive number
        "nearer": (2, INDEX),  # an int less than b + 1024 from 0, at the same place in a period of b
        "neg": (1, INDEX),
        **dict.fromkeys(("not_equal", "less", "greater_equal"), (2, "bool")),
        "below": (2, "bool"),  # 0 <= a < b, for a positive b
        "to_long": (1, LONG),
        "to_coordinate": (1, COORDINATE),
    },
    LONG: {"add": (2, LONG), "mul": (2, LONG)},
    COORDINATE: {
        **dict.fromkeys(("add", "sub", "mul"), (2, COORDINATE)),
        "clamp": (3, COORDINATE),
        **dict.fromkeys(("floor", "fract"), (1, COORDINATE)),
        "to_index": (1, INDEX),
    },
    "float": {
        "to_index": (1, INDEX),  # of a whole number within 32 bits
        "mix": (3, "float"),  # a + (b - a) * c, rounded in any way
    },
}
#: The same for stored numbers: "decode" gives the float that an int stores, "encode" the int that stores a float; a
#: float of a format with steps comes multiplied by them, and the nearest int is that of the range.
STORED: Mapping[str, tuple[str, ...]] = {"u1": ("encode",), "u2": ("encode",), "f2": ("decode", "encode")}
#: Types whose values may be used where another is expected.
CONVERTED = {INDEX: {"int"}, LONG: {"int", INDEX}, COORDINATE: {"float"}}


def fits(type_: str, expected: str) -> bool:
    """Return True if a value may be used as another type.

    >>> fits("int", "index"), fits("index", "int")
    (True, False)
    """
    return type_ == expected or type_ in CONVERTED.get(expected, ())


def signature(operation: str, on: str) -> tuple[tuple[str, ...], str] | None:
    """Return the types of the arguments and of the result of a lowered operation; None for others.

    >>> signature("not_equal", "index"), signature("encode", "u1")
    ((('index', 'index'), 'bool'), (('float',), 'int'))
    """
    if operation in STORED.get(on, ()):
        return (("int",), "float") if operation == "decode" else (("float",), "int")
    if operation == "mix":
        return ("float", "float", COORDINATE), "float"
    count, result = LOWERED.get(on, {}).get(operation, (0, ""))
    return ((on,) * count, result) if count else None
