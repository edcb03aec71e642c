"""Arrays in documents: pictures and meshes, by their bytes."""

from __future__ import annotations

import base64
import binascii
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import numbers
from passgraph.errors import GraphError
from passgraph.graph.geometry import ATTRIBUTE_TYPES, FrozenGeometry
from passgraph.graph.targets import MAX_SIDE
from passgraph.language.buffers import number_of
from passgraph.language.types import Array as ArrayType
from passgraph.language.types import component_count
from passgraph.travel.document import Document

#: Bytes of the pictures and meshes that a document may hold, all together.
MOST_ARRAY_BYTES = 256 << 20
#: Numbers that pictures may be made of, as NumPy names them.
_NUMBERS = ("b1", "u1", "u2", "u4", "u8", "i1", "i2", "i4", "i8", "f2", "f4", "f8")


def array_data(given: object, where: str) -> dict[str, Any]:
    """An array of numbers: what they are as NumPy names it, its shape, and its bytes, the least of a number first.

    >>> array_data(np.ones((1, 2), np.uint8), "a picture")
    {'type': 'u1', 'shape': [1, 2], 'base64': 'AQE='}
    """
    array = numbers(given, where, error=GraphError)
    array = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
    text = base64.b64encode(array.tobytes()).decode("ascii")
    return {"type": array.dtype.str[1:], "shape": list(array.shape), "base64": text}


class Arrays:
    """The arrays of one document being read; they cannot be written to."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.bytes = 0

    def picture(self, given: object, where: str) -> NDArray[Any]:
        array = self._array(given, where, _NUMBERS, MAX_SIDE)
        if array.ndim < 2:
            self.document.wrong(f"{where}.shape", "height, width and channels", list(array.shape))
        return array

    def long(self, given: object, type_: ArrayType, where: str) -> NDArray[Any]:
        """The components of a long array, flat."""
        kind, count = number_of(type_), component_count(type_)
        array = self._array(given, where, (np.dtype(kind).str[1:],), count)
        if array.shape != (count,):
            self.document.wrong(f"{where}.shape", f"the {count} numbers of {type_}", list(array.shape))
        return array

    def mesh(self, given: object, where: str) -> FrozenGeometry:
        """Arrays by attribute; whether they are a mesh is for the draw to say."""
        record = self.document.record(given, where, *ATTRIBUTE_TYPES)
        arrays: dict[str, Any] = {}
        for name, type_ in ATTRIBUTE_TYPES.items():
            if record[name] is not None:
                types = (np.dtype(type_).str[1:],)
                arrays[name] = self._array(record[name], f"{where}.{name}", types, MOST_ARRAY_BYTES)
        if "positions" not in arrays or "triangles" not in arrays:
            self.document.wrong(where, "a mesh with positions and triangles", given)
        return FrozenGeometry(**arrays)

    def _array(self, given: object, where: str, types: tuple[str, ...], most: int) -> NDArray[Any]:
        document = self.document
        record = document.record(given, where, "type", "shape", "base64")
        if not isinstance(record["type"], str) or record["type"] not in types:
            document.wrong(f"{where}.type", f"one of {', '.join(types)}", record["type"])
        sides = document.items(record["shape"], f"{where}.shape", 3)
        shape = tuple(document.whole(side, f"{where}.shape", 1, most) for side in sides)
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
            bytes_ = bytes(map(bool, bytes_))  # NumPy trusts that a bool is 0 or 1
        return np.frombuffer(bytes_, type_).reshape(shape)
