"""Read PLY files: triangles, polygons and strips, in text and both byte orders.

trimesh (5.2) reads no binary file whose polygons differ in their number of corners, no strips, no header whose lines
end with CR alone, and no colors named ``diffuse_red``.

Source: G. Turk, "The PLY Polygon File Format", 1994.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.scene.matrices import Float64
from passgraph.scene.polygons import Polygons

_KINDS = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_CORNERS = ("vertex_indices", "vertex_index")
_COORDINATES = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))


@dataclass(frozen=True)
class _Property:
    name: str
    kind: str
    length_kind: str | None  # of a list


@dataclass(frozen=True)
class _Lists:
    """A list property: the lengths of the rows, and their values one after the other."""

    lengths: NDArray[np.int64]
    values: NDArray[Any]


@dataclass(frozen=True)
class _Body:
    """The values after the header: bytes with a byte order, or the numbers of a text."""

    units: NDArray[Any]
    order: str | None

    def dtype(self, kind: str) -> np.dtype[Any]:
        """Return the type of a unit or of a value that is made of units."""
        return self.units.dtype if self.order is None else np.dtype(self.order + kind)

    def size(self, kind: str) -> int:
        return 1 if self.order is None else np.dtype(kind).itemsize

    def view(self, at: int, kind: str, rows: int, stride: int, columns: int = 1) -> NDArray[Any]:
        """Return (rows, columns) of values from unit ``at`` on, ``stride`` units from row to row."""
        size, step = self.size(kind), self.units.itemsize
        if rows and at + stride * (rows - 1) + size * columns > len(self.units):
            raise ValueError("it ends early")
        shape, strides = (rows, columns), (stride * step, size * step)
        return self._typed(np.ndarray(shape, self.dtype(kind), self.units.data, at * step, strides), kind)

    def gathered(self, places: NDArray[np.int64], kind: str, columns: int) -> NDArray[Any]:
        """Return rows of values that begin at ``places``, (n, columns)."""
        size = self.size(kind)
        units = self.units[places[:, None] + np.arange(size * columns)]
        return self._typed(units if self.order is None else units.view(self.dtype(kind)), kind)

    def _typed(self, values: NDArray[Any], kind: str) -> NDArray[Any]:
        """Return numbers of a text in their type: the type of a color says what its largest value is."""
        return values.astype(kind) if self.order is None else values


def read_ply(data: bytes) -> Polygons:
    """Return the surface of a PLY file; raise ValueError if it is damaged."""
    elements, body, picture = _header(data)
    tables, at = dict[str, dict[str, Any]](), 0
    for name, count, properties in elements:
        tables[name], at = _table(body, at, count, properties)
    vertex, face, strip = (tables.get(name, {}) for name in ("vertex", "face", "tristrips"))
    positions = _columns(vertex, ("x", "y", "z"))
    if positions is None:
        raise ValueError("its vertices have no x, y and z")
    lists = next((face[name] for name in _CORNERS if isinstance(face.get(name), _Lists)), None)
    empty = np.zeros(0, np.int64)
    lengths, corners = (empty, empty) if lists is None else (lists.lengths, lists.values.astype(np.int64))
    strips = next((strip[name] for name in _CORNERS if isinstance(strip.get(name), _Lists)), None)
    if strips is not None:
        more = _strip_triangles(strips)
        corners, lengths = np.concatenate([corners, more.reshape(-1)]), np.append(lengths, np.full(len(more), 3))
    wedges = face.get("texcoord")
    whole = isinstance(wedges, _Lists) and strips is None and np.array_equal(wedges.lengths, 2 * lengths)
    uvs = next((found for names in _COORDINATES if (found := _columns(vertex, names)) is not None), None)
    return Polygons(
        positions,
        corners,
        lengths,
        _columns(vertex, ("nx", "ny", "nz")),
        _colors(vertex),
        None if strips is not None else _colors(face),
        uvs,
        wedges.values.astype(np.float64).reshape(-1, 2) if isinstance(wedges, _Lists) and whole else None,
        picture,
    )


def _header(data: bytes) -> tuple[list[tuple[str, int, list[_Property]]], _Body, str | None]:
    """Return the elements, the values after the header, and the name of a picture."""
    mark = data.find(b"end_header")
    if data[:3] != b"ply" or mark < 0:
        raise ValueError("it has no header from 'ply' to 'end_header'")
    end = mark + len(b"end_header")
    end += 2 if data[end : end + 2] == b"\r\n" else 1
    elements, form, picture = list[tuple[str, int, list[_Property]]](), "", None
    for line in data[:mark].decode("utf-8", "replace").splitlines():
        match line.split():
            case ["format", form, *_]:
                pass
            case ["comment", "TextureFile", _, *_]:
                picture = line.split("TextureFile", 1)[1].strip()
            case ["element", name, count]:
                elements.append((name, int(count), []))
            case ["property", "list", length_kind, kind, name] if elements:
                elements[-1][2].append(_Property(name, _kind(kind), _kind(length_kind)))
            case ["property", kind, name] if elements:
                elements[-1][2].append(_Property(name, _kind(kind), None))
            case _:
                pass
    orders = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
    if form not in orders:
        raise ValueError(f"its format is {form!r}; expected {', '.join(orders)}")
    if orders[form] is None:
        return elements, _Body(np.array(data[end:].split(), np.float64), None), picture
    return elements, _Body(np.frombuffer(data, np.uint8, offset=end), orders[form]), picture


def _kind(name: str) -> str:
    if name not in _KINDS:
        raise ValueError(f"it has values of the type {name!r}; expected {', '.join(_KINDS)}")
    return _KINDS[name]


def _table(body: _Body, at: int, count: int, properties: list[_Property]) -> tuple[dict[str, Any], int]:
    """Return the columns of an element from unit ``at`` on, and where the next element begins."""
    if not count or not properties:
        return {}, at
    lengths = _first_lengths(body, at, properties)
    places, stride, uniform = list[int](), 0, True
    for item, length in zip(properties, lengths, strict=True):
        places.append(at + stride)
        stride += body.size(item.kind) * length + (body.size(item.length_kind) if item.length_kind else 0)
    for item, place, length in zip(properties, places, lengths, strict=True):
        if item.length_kind is not None:
            uniform &= at + stride * count <= len(body.units)
            uniform = uniform and bool((body.view(place, item.length_kind, count, stride) == length).all())
    if not uniform:
        return _ragged(body, at, count, properties)
    columns = dict[str, Any]()
    for item, place, length in zip(properties, places, lengths, strict=True):
        if item.length_kind is None:
            columns[item.name] = body.view(place, item.kind, count, stride)[:, 0]
        else:
            values = body.view(place + body.size(item.length_kind), item.kind, count, stride, length)
            columns[item.name] = _Lists(np.full(count, length, np.int64), values.reshape(-1))
    return columns, at + stride * count


def _length(body: _Body, at: int, kind: str) -> int:
    length = int(body.view(at, kind, 1, 0)[0, 0])
    if length < 0:
        raise ValueError(f"a list has {length} values")
    return length


def _first_lengths(body: _Body, at: int, properties: list[_Property]) -> list[int]:
    """Return how many values each property has in the first row."""
    lengths = list[int]()
    for item in properties:
        lengths.append(1 if item.length_kind is None else _length(body, at, item.length_kind))
        at += body.size(item.kind) * lengths[-1] + (body.size(item.length_kind) if item.length_kind else 0)
    return lengths


def _ragged(body: _Body, at: int, count: int, properties: list[_Property]) -> tuple[dict[str, Any], int]:
    """Return the columns of an element whose lists differ in length."""
    places = [np.zeros(count, np.int64) for _ in properties]
    lengths = [np.ones(count, np.int64) for _ in properties]
    for row in range(count):
        for number, item in enumerate(properties):
            if item.length_kind is not None:
                lengths[number][row] = _length(body, at, item.length_kind)
                at += body.size(item.length_kind)
            places[number][row] = at
            at += body.size(item.kind) * int(lengths[number][row])
    if at > len(body.units):
        raise ValueError("it ends early")
    columns = dict[str, Any]()
    for item, place, length in zip(properties, places, lengths, strict=True):
        if item.length_kind is None:
            columns[item.name] = body.gathered(place, item.kind, 1)[:, 0]
            continue
        starts = np.cumsum(length) - length
        values = np.zeros(int(length.sum()), np.dtype(item.kind))
        for size in np.unique(length[length > 0]):
            rows = length == size
            values[starts[rows][:, None] + np.arange(size)] = body.gathered(place[rows], item.kind, int(size))
        columns[item.name] = _Lists(length, values)
    return columns, at


def _columns(table: dict[str, Any], names: tuple[str, ...]) -> Float64 | None:
    found = [table.get(name) for name in names]
    if not all(isinstance(column, np.ndarray) for column in found):
        return None
    return np.stack([np.asarray(column, np.float64) for column in found], axis=1)


def _colors(table: dict[str, Any]) -> NDArray[Any] | None:
    """Return colors as they are stored: integers up to their type's largest, or floats in [0, 1]."""
    for before in ("", "diffuse_"):
        names = [f"{before}{name}" for name in ("red", "green", "blue", "alpha")]
        found = [table[name] for name in names if isinstance(table.get(name), np.ndarray)]
        if len(found) >= 3:
            return np.stack(found, axis=1)
    return None


def _strip_triangles(strips: _Lists) -> NDArray[np.int64]:
    """Return the triangles, (m, 3), of strips; -1 begins a new strip, and every second triangle is reversed."""
    corners = strips.values.astype(np.int64)
    ends = np.isin(np.arange(len(corners)), np.cumsum(strips.lengths)[:-1])
    breaks = corners < 0
    part = np.cumsum(ends | breaks)
    # the number of each corner in its own strip
    number = np.arange(len(corners))
    first = np.maximum.accumulate(np.where(breaks, number + 1, np.where(ends, number, 0)))
    a, b, c = corners[:-2], corners[1:-1], corners[2:]
    joined = (part[:-2] == part[2:]) & (a >= 0) & (b >= 0) & (c >= 0)
    odd = (number - first)[:-2] % 2 == 1
    rows: NDArray[np.int64] = np.stack([a, np.where(odd, c, b), np.where(odd, b, c)], axis=1)[joined]
    is_whole: NDArray[np.bool_] = (rows != np.roll(rows, 1, axis=1)).all(axis=1)
    return rows[is_whole]
