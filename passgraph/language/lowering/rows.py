"""Operations that occur in lowered programs only, beside those of the table of operations.

``index`` and ``long`` are the types of addresses: their arithmetic never overflows, so that devices may compute it in
any way.  An int may be used as an index, and an index as a long.  The other types name how numbers are stored
(``Format.number``): devices have an own way from and to some of them.
"""

from __future__ import annotations

from collections.abc import Mapping

from passgraph.language.scalar import INDEX, LONG

#: Type of the arguments → operation → number of arguments and type of the result.
LOWERED: Mapping[str, Mapping[str, tuple[int, str]]] = {
    INDEX: {
        **dict.fromkeys(("add", "sub", "mul", "min", "max"), (2, INDEX)),
        "int_mod": (2, INDEX),  # by a positive number
        "neg": (1, INDEX),
        **dict.fromkeys(("not_equal", "less", "greater_equal"), (2, "bool")),
        "to_long": (1, LONG),
    },
    "float": {"to_index": (1, INDEX)},  # of a whole number within 32 bits
    LONG: {"add": (2, LONG), "mul": (2, LONG)},
}
#: The same for stored numbers: "decode" gives the float that an int stores, "encode" the int that stores a float; a
#: float of a format with steps comes multiplied by them, and the nearest int is that of the range.
STORED: Mapping[str, tuple[str, ...]] = {"u1": ("encode",), "u2": ("encode",), "f2": ("decode", "encode")}
#: Types whose values may be used where another is expected.
CONVERTED = {INDEX: {"int"}, LONG: {"int", INDEX}}


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
    count, result = LOWERED.get(on, {}).get(operation, (0, ""))
    return ((on,) * count, result) if count else None
