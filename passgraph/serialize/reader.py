"""Reader of untrusted plain data: every part is checked, and counted against a limit.

Data may be any JSON, or Python lists that contain themselves or occur in many places. The type and the length of a part
are checked before its contents are read.
"""

from __future__ import annotations

import base64
import binascii
import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import numbers, shown
from passgraph.errors import GraphError, InputError, PassgraphError
from passgraph.graph.draw_state import ATTRIBUTE_TYPES, FrozenGeometry
from passgraph.graph.targets import MAX_SIDE
from passgraph.language.long_arrays import number_of
from passgraph.language.symbols import TYPE_MARKERS, Array, Image
from passgraph.language.types import Array as ArrayType
from passgraph.language.types import component_count

#: Types of run values, by name.
VALUE_TYPES: dict[str, object] = {
    **{name: marker for marker, name in TYPE_MARKERS.items() if marker is not Image},
    "tuple": tuple,
    "Array": Array,
}


#: Most parts of a document that are read, counted each time they occur. A typical graph has some ten thousand; reading
#: this many takes a second or two.
MOST_PARTS = 1_000_000
#: Most characters of a text, as of a line of kernel text.
MOST_CHARACTERS = 10_000
#: Most levels of nested lists of numbers, as in arrays of matrices.
MOST_NESTED = 4


def described(value: object) -> str:
    """Describe a part of a document for a message, without reading its contents."""
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    if isinstance(value, Mapping):
        return f"an object of {len(value)} entries"
    if isinstance(value, str) and len(value) > MOST_CHARACTERS:
        return f"a text of {len(value)} characters"
    return shown(value) if value is None or isinstance(value, (bool, int, float, str)) else type(value).__name__


class Document:
    """A document being read."""

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
        """Add the position in the document to errors raised while objects are built from it."""
        try:
            yield
        except InputError as error:
            if str(error).startswith("graph data, "):
                raise
            raise InputError(f"graph data, {where}: {error}") from None
        except PassgraphError as error:
            raise InputError(f"graph data, {where}: {error}") from None

    def record(self, value: object, where: str, *names: str) -> Mapping[str, Any]:
        """Return an object with exactly these entries."""
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

    def entries(self, value: object, where: str) -> Mapping[str, Any]:
        """Return an object with entries of any names."""
        if not isinstance(value, Mapping):
            self.wrong(where, "an object", value)
        self.count(1 + len(value), where)
        for name in value:
            self.text(name, where)
        return value

    def items(self, value: object, where: str, most: int = MOST_PARTS, exactly: int | None = None) -> Sequence[Any]:
        """Return a list of at most (or exactly) this many items."""
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

    def flag(self, value: object, where: str) -> bool:
        if not isinstance(value, bool):
            self.wrong(where, "true or false", value)
        return value

    def integer(self, value: object, where: str, low: int, high: int) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            self.wrong(where, f"a whole number from {low} to {high}" if high >= low else "there", value)
        return value

    def index(self, value: object, where: str, known: Sequence[Any], what: str) -> Any:
        """Return an earlier object of the document, by its number."""
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < len(known):
            self.wrong(where, f"the number of one of the {len(known)} {what} before it", value)
        return known[value]

    def number(self, value: object, where: str) -> bool | int | float:
        """Return a number; NaN and infinities are encoded by their bits."""
        if isinstance(value, Mapping):
            bits = self.record(value, where, "float")["float"]
            try:
                unpacked: float = struct.unpack(">d", bytes.fromhex(bits))[0]
            except (TypeError, ValueError, struct.error):
                self.wrong(f"{where}.float", "the 16 hexadecimal digits of a float64", bits)
            return unpacked
        if not isinstance(value, (bool, int, float)):
            self.wrong(where, "a number", value)
        if isinstance(value, int) and value.bit_length() > 64:
            self.wrong(where, "a whole number of at most 64 bits", value)
        return value

    def numbers(self, value: object, where: str, nested: int = MOST_NESTED) -> Any:
        """Return a number, or nested lists of numbers as tuples."""
        if not isinstance(value, (list, tuple)):
            return self.number(value, where)
        if not nested:
            self.wrong(where, f"numbers in at most {MOST_NESTED} lists within lists", value)
        self.count(1 + len(value), where)
        rows = tuple(self.numbers(part, f"{where}[{i}]", nested - 1) for i, part in enumerate(value))
        if len({len(row) if isinstance(row, tuple) else None for row in rows}) > 1:
            self.wrong(where, "a number, or rows of one length", value)
        return rows


def number_data(value: Any) -> Any:
    """Encode a number exactly for JSON: NaN and infinities by the bits of a float64.

    >>> number_data(0.5), number_data(float("-inf"))
    (0.5, {'float': 'fff0000000000000'})
    """
    if isinstance(value, float) and not math.isfinite(value):
        return {"float": struct.pack(">d", value).hex()}
    return value


#: Most bytes of all pictures and meshes in a document.
MOST_ARRAY_BYTES = 256 << 20
#: Dtypes of arrays, by NumPy's names.
_NUMBERS = ("b1", "u1", "u2", "u4", "u8", "i1", "i2", "i4", "i8", "f2", "f4", "f8")


def array_data(given: object, where: str) -> dict[str, Any]:
    """Encode an array of numbers: its dtype by NumPy's name, its shape, and its little-endian bytes.

    >>> array_data(np.ones((1, 2), np.uint8), "a picture")
    {'type': 'u1', 'shape': [1, 2], 'base64': 'AQE='}
    """
    array = numbers(given, where, error=GraphError)
    array = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
    text = base64.b64encode(array.tobytes()).decode("ascii")
    return {"type": array.dtype.str[1:], "shape": list(array.shape), "base64": text}


class Arrays:
    """The arrays of a document being read; they are read-only."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.bytes = 0

    def picture(self, data: object, where: str) -> NDArray[Any]:
        array = self._array(data, where, _NUMBERS, MAX_SIDE)
        if array.ndim < 2:
            self.document.wrong(f"{where}.shape", "height, width and channels", list(array.shape))
        return array

    def long(self, data: object, type_: ArrayType, where: str) -> NDArray[Any]:
        """Return the components of a long array, flat."""
        kind, count = number_of(type_), component_count(type_)
        array = self._array(data, where, (np.dtype(kind).str[1:],), count)
        if array.shape != (count,):
            self.document.wrong(f"{where}.shape", f"the {count} numbers of {type_}", list(array.shape))
        return array

    def mesh(self, data: object, where: str) -> FrozenGeometry:
        """Return a mesh's arrays by attribute; the draw checks that they form a mesh."""
        record = self.document.record(data, where, *ATTRIBUTE_TYPES)
        arrays: dict[str, Any] = {}
        for name, type_ in ATTRIBUTE_TYPES.items():
            if record[name] is not None:
                types = (np.dtype(type_).str[1:],)
                arrays[name] = self._array(record[name], f"{where}.{name}", types, MOST_ARRAY_BYTES)
        if "positions" not in arrays or "triangles" not in arrays:
            self.document.wrong(where, "a mesh with positions and triangles", data)
        return FrozenGeometry(**arrays)

    def _array(self, data: object, where: str, types: tuple[str, ...], most: int) -> NDArray[Any]:
        document = self.document
        record = document.record(data, where, "type", "shape", "base64")
        if not isinstance(record["type"], str) or record["type"] not in types:
            document.wrong(f"{where}.type", f"one of {', '.join(types)}", record["type"])
        sides = document.items(record["shape"], f"{where}.shape", 3)
        shape = tuple(document.integer(side, f"{where}.shape", 1, most) for side in sides)
        type_ = np.dtype(record["type"]).newbyteorder("<")
        expected = math.prod(shape) * type_.itemsize
        self.bytes += expected
        if self.bytes > MOST_ARRAY_BYTES:
            document.wrong(f"{where}.shape", f"at most {MOST_ARRAY_BYTES} bytes of arrays in a document", list(shape))
        text, what = record["base64"], f"the {expected} bytes of the array in base64"
        if not isinstance(text, str) or len(text) != 4 * -(-expected // 3):
            document.wrong(f"{where}.base64", what, text)
        try:
            bytes_ = base64.b64decode(text, validate=True)
        except (binascii.Error, ValueError):
            bytes_ = b""
        if len(bytes_) != expected:
            document.wrong(f"{where}.base64", what, text)
        if type_.kind == "b":
            bytes_ = bytes(map(bool, bytes_))  # NumPy assumes that the byte of a bool is 0 or 1
        return np.frombuffer(bytes_, type_).reshape(shape)
