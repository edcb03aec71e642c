"""Plain data of strangers, read part by part: every part is checked, and all that is read is counted.

Data may be anything that JSON can say, and what Python can hold beside it: lists within themselves, one list in a
thousand places.  Nothing here goes into a part before its kind and its number of parts are known.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

from passgraph.arguments import shown
from passgraph.errors import InputError, PassgraphError

#: Parts of a document that are looked at, those that stand in several places counted at each; a graph of ours has some
#: ten thousand, and reading as many as this takes a second or two.
MOST_PARTS = 1_000_000
#: Characters of one text: as long as a line of kernel text may be.
MOST_CHARACTERS = 10_000
#: Lists within lists, where numbers stand in rows: arrays of matrices.
MOST_NESTED = 4


def described(value: object) -> str:
    """A part of a document as messages show it; nothing inside it is looked at."""
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    if isinstance(value, Mapping):
        return f"an object of {len(value)} entries"
    if isinstance(value, str) and len(value) > MOST_CHARACTERS:
        return f"a text of {len(value)} characters"
    return shown(value) if value is None or isinstance(value, (bool, int, float, str)) else type(value).__name__


class Document:
    """One document being read."""

    def __init__(self) -> None:
        self.read = 0

    def count(self, parts: int, where: str) -> None:
        self.read += parts
        if self.read > MOST_PARTS:
            raise InputError(f"graph data, {where}: the document has more than {MOST_PARTS} parts; split the graph")

    def wrong(self, where: str, expected: str, got: object) -> NoReturn:
        raise InputError(
            f"graph data, {where}: must be {expected}, got {described(got)}; give what pg.to_data made, unchanged"
        )

    @contextmanager
    def at(self, where: str) -> Iterator[None]:
        """Errors of what is made from the data get the place in it."""
        try:
            yield
        except InputError as error:
            if str(error).startswith("graph data, "):
                raise
            raise InputError(f"graph data, {where}: {error}") from None
        except PassgraphError as error:
            raise InputError(f"graph data, {where}: {error}") from None

    def record(self, value: object, where: str, *names: str) -> Mapping[str, Any]:
        """An object with entries of these names, all and no others."""
        if not isinstance(value, Mapping):
            self.wrong(where, f"an object with {', '.join(names) or 'no entries'}", value)
        self.count(1 + len(value), where)
        missing = [name for name in names if name not in value]
        if missing:
            self.wrong(where, f"an object with {', '.join(names)}; {missing[0]!r} is missing", value)
        if len(value) > len(names):
            surplus = next(name for name in value if name not in names)
            self.wrong(
                where, f"an object with {', '.join(names) or 'no entries'} only; there is {shown(surplus)}", value
            )
        return value

    def items(self, value: object, where: str, most: int = MOST_PARTS, exactly: int | None = None) -> Sequence[Any]:
        """A list, of at most (or exactly) so many."""
        if not isinstance(value, (list, tuple)):
            self.wrong(where, "a list", value)
        if exactly is not None and len(value) != exactly:
            self.wrong(where, f"a list of {exactly}", value)
        if len(value) > most:
            self.wrong(where, f"a list of at most {most}", value)
        self.count(1 + len(value), where)
        return value

    def text(self, value: object, where: str, most: int = MOST_CHARACTERS) -> str:
        if not isinstance(value, str) or len(value) > most:
            self.wrong(where, f"a text of at most {most} characters", value)
        self.count(1 + len(value) // 64, where)
        return value

    def identifier(self, value: object, where: str) -> str:
        """A name that generated code may hold."""
        name = self.text(value, where)
        if not name.isidentifier():
            self.wrong(where, "a name as Python has them (letters, digits, _)", value)
        return name

    def flag(self, value: object, where: str) -> bool:
        if not isinstance(value, bool):
            self.wrong(where, "true or false", value)
        return value

    def whole(self, value: object, where: str, low: int, high: int) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            self.wrong(where, f"a whole number from {low} to {high}" if high >= low else "there", value)
        return value

    def index(self, value: object, where: str, known: Sequence[Any], what: str) -> Any:
        """What stands earlier in the document, by its number."""
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < len(known):
            self.wrong(where, f"the number of one of the {len(known)} {what} before it", value)
        return known[value]

    def number(self, value: object, where: str) -> bool | int | float:
        """A number; what JSON has no number for is written by its bits."""
        if isinstance(value, Mapping):
            bits = self.record(value, where, "float")["float"]
            try:
                made: float = struct.unpack(">d", bytes.fromhex(bits))[0]
            except (TypeError, ValueError, struct.error):
                self.wrong(f"{where}.float", "the 16 hexadecimal digits of a float64", bits)
            return made
        if not isinstance(value, (bool, int, float)):
            self.wrong(where, "a number", value)
        if isinstance(value, int) and value.bit_length() > 64:
            self.wrong(where, "a whole number of at most 64 bits", value)
        return value

    def numbers(self, value: object, where: str, nested: int = MOST_NESTED) -> Any:
        """A number, or numbers in rows, as tuples."""
        if not isinstance(value, (list, tuple)):
            return self.number(value, where)
        if not nested:
            self.wrong(where, f"numbers in at most {MOST_NESTED} lists within lists", value)
        self.count(1 + len(value), where)
        return tuple(self.numbers(part, f"{where}[{i}]", nested - 1) for i, part in enumerate(value))


def number_data(value: Any) -> Any:
    """A number as JSON says it exactly: NaN and infinities by the bits of a float64.

    >>> number_data(0.5), number_data(float("-inf"))
    (0.5, {'float': 'fff0000000000000'})
    """
    if isinstance(value, float) and not math.isfinite(value):
        return {"float": struct.pack(">d", value).hex()}
    return value
