"""The numbers and pictures of a glTF file: buffers, accessors (sparse ones too) and images.

Source: Khronos, glTF 2.0 specification, sections 3.6 (binary data) and 3.8.3 (images).
"""

from __future__ import annotations

import binascii
from base64 import b64decode
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.scene.files import FolderReader
from passgraph.scene.notes import Notes

TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


@dataclass(frozen=True)
class GltfData:
    """A glTF file and what lies beside it.

    Attributes
    ----------
    file : for messages
    header : its JSON
    binary : the BIN chunk of a .glb file, else empty
    folder : reads files that it names
    notes : what could not be had
    """

    file: Path
    header: dict[str, Any]
    binary: bytes
    folder: FolderReader
    notes: Notes
    _buffers: dict[int, bytes] = field(default_factory=dict)

    def entry(self, key: str, index: Any) -> dict[str, Any]:
        """One object of a list of the header; raises `InputError` where it is not there."""
        table = self.header.get(key, [])
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(table):
            raise InputError(f"{self.file}: names entry {index!r} of {key}, which is not there")
        entry = table[index]
        if not isinstance(entry, dict):
            raise InputError(f"{self.file}: entry {index} of {key} is not an object")
        return entry

    def array(self, index: Any) -> NDArray[Any]:
        """(count, components) of an accessor; normalised integers as float64 in [-1, 1] or [0, 1]."""
        accessor = self.entry("accessors", index)
        dtype, width, count = _layout(accessor, f"{self.file}: accessor {index}")
        if "bufferView" in accessor:  # its length is checked before anything is allocated
            values = self._rows(accessor["bufferView"], accessor.get("byteOffset", 0), dtype, count, width, index)
        else:
            values = np.zeros((count, width), dtype)
        if "sparse" in accessor:
            values = self._sparse(values.copy(), accessor["sparse"], index)
        if accessor.get("normalized") and dtype.kind in "iu":
            return np.maximum(values.astype(np.float64) / np.iinfo(dtype).max, -1.0)
        return values

    def _sparse(self, values: NDArray[Any], sparse: dict[str, Any], index: Any) -> NDArray[Any]:
        """Section 3.6.2.3: some rows of an accessor replaced."""
        count, where, given = sparse["count"], sparse["indices"], sparse["values"]
        places = self._rows(
            where["bufferView"], where.get("byteOffset", 0), np.dtype(TYPES[where["componentType"]]), count, 1, index
        )[:, 0]
        if count and int(places.max()) >= len(values):
            raise InputError(
                f"{self.file}: accessor {index}: a sparse row is {places.max()}, and there are {len(values)}"
            )
        width = values.shape[1]
        rows = self._rows(given["bufferView"], given.get("byteOffset", 0), values.dtype, count, width, index)
        values[places.astype(np.int64)] = rows
        return values

    def _rows(self, view: Any, offset: int, dtype: np.dtype[Any], count: int, width: int, index: Any) -> NDArray[Any]:
        data, stride = self._view(view)
        row = dtype.itemsize * width
        stride = stride or row
        needed = offset + stride * (count - 1) + row if count else 0
        if offset < 0 or count < 0 or stride < row or needed > len(data):
            raise InputError(
                f"{self.file}: accessor {index} needs {needed} bytes of buffer view {view}, which has {len(data)}; "
                "the file is corrupt or truncated"
            )
        return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))

    def _view(self, index: Any) -> tuple[memoryview, int]:
        view = self.entry("bufferViews", index)
        data = self._buffer(view.get("buffer"))
        start, length = view.get("byteOffset", 0), view.get("byteLength", 0)
        if not 0 <= start <= start + length <= len(data):
            raise InputError(
                f"{self.file}: buffer view {index} ends at byte {start + length} of a buffer of {len(data)}; "
                "the file is corrupt or truncated"
            )
        return memoryview(data)[start : start + length], view.get("byteStride", 0)

    def _buffer(self, index: Any) -> bytes:
        if index not in self._buffers:
            uri = self.entry("buffers", index).get("uri")
            if uri is None:
                self._buffers[index] = self.binary
            else:
                self._buffers[index] = self._fetched(str(uri))
        return self._buffers[index]

    def _fetched(self, uri: str) -> bytes:
        if uri.startswith("data:"):
            try:
                return bytes_of(uri)
            except ValueError as error:
                raise InputError(f"{self.file}: a buffer's data: address cannot be read ({error})") from None
        data = self.folder.read(uri)
        if data is None:
            if self.folder.refused:
                raise InputError(f"{self.file}: {self.folder.refused[0]}")
            raise InputError(f"{self.file}: its file {self.folder.missing[0]} is missing beside it")
        return data

    def picture(self, index: Any, what: str) -> bytes | None:
        """The bytes of an image, or None with a note: a surface can be drawn without one."""
        image = self.entry("images", index)
        uri = image.get("uri")
        if uri is None:
            return bytes(self._view(image.get("bufferView"))[0])
        if not str(uri).startswith("data:"):
            return self.folder.read(str(uri))
        try:
            return bytes_of(str(uri))
        except ValueError as error:
            self.notes.add(f"its data: address cannot be read ({error}); left out", what)
            return None


def _layout(accessor: dict[str, Any], where: str) -> tuple[np.dtype[Any], int, int]:
    kind, component = accessor.get("type"), accessor.get("componentType")
    if kind not in WIDTHS or component not in TYPES:
        raise InputError(f"{where} has the unknown type {kind!r} of components {component!r}")
    return np.dtype(TYPES[component]), WIDTHS[kind], accessor.get("count", 0)


def bytes_of(uri: str) -> bytes:
    """What a ``data:`` address holds (RFC 2397).

    >>> bytes_of("data:image/png;base64,aGk="), bytes_of("data:,hi%21")
    (b'hi', b'hi!')
    """
    head, comma, body = uri[5:].partition(",")
    if not comma:
        raise ValueError("it has no comma")
    if not head.endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        return b64decode(unquote_to_bytes(body), validate=True)
    except binascii.Error as error:
        raise ValueError(f"{error}") from None
