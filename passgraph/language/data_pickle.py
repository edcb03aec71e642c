"""Pickles of plain data for the disk cache: reading one makes objects of known classes, and runs nothing else."""

from __future__ import annotations

import io
import pickle
from collections.abc import Iterable
from dataclasses import fields
from typing import Any

from passgraph.language import types
from passgraph.language.source import NOWHERE

#: Objects that the compiler compares by identity, by name.
_SINGLE: dict[str, object] = {"nowhere": NOWHERE, **types.NAMED}
_NAMES = {id(one): name for name, one in _SINGLE.items()}


def single(name: str) -> object:
    """Return a singleton by its name."""
    return _SINGLE[name]


class DataPickle:
    """Writes and reads objects of some dataclasses, with numbers, strings and tuples in them.

    >>> numbers = DataPickle([types.Array])
    >>> numbers.read(numbers.written(types.Array(types.FLOAT, 3))) == types.Array(types.FLOAT, 3)
    True
    """

    def __init__(self, classes: Iterable[type[Any]]) -> None:
        #: Class → the fields that make it.
        self.fields = {cls: tuple(field.name for field in fields(cls) if field.init) for cls in classes}
        self.makers: dict[tuple[str, str], Any] = {(cls.__module__, cls.__name__): cls for cls in self.fields}
        self.makers[single.__module__, single.__name__] = single

    def written(self, value: object) -> bytes | None:
        """Return the pickle of a value; None if it holds objects of other classes, or nests too deeply."""
        file = io.BytesIO()
        try:
            _Writer(file, self).dump(value)
        except (pickle.PicklingError, RecursionError):
            return None
        return file.getvalue()

    def read(self, data: bytes) -> Any:
        """Return the value of a pickle. A damaged one may raise anything."""
        return _Reader(data, self).load()


class _Writer(pickle.Pickler):
    """Pickles each object as its class and its fields, or as the name of a singleton."""

    def __init__(self, file: io.BytesIO, data: DataPickle) -> None:
        super().__init__(file, protocol=5)
        self.data = data

    def reducer_override(self, given: object) -> Any:
        if id(given) in _NAMES:
            return single, (_NAMES[id(given)],)
        if given is single or (isinstance(given, type) and given in self.data.fields):
            return NotImplemented
        names = self.data.fields.get(type(given))
        if names is None:
            raise pickle.PicklingError(f"{type(given).__name__} does not belong into a program")
        return type(given), tuple([getattr(given, name) for name in names])


class _Reader(pickle.Unpickler):
    def __init__(self, data: bytes, known: DataPickle) -> None:
        super().__init__(io.BytesIO(data))
        self.known = known

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in self.known.makers:
            raise pickle.UnpicklingError(f"{module}.{name} does not belong into a program")
        return self.known.makers[module, name]
