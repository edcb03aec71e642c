"""What stands for a parameter in a run: what its handle was given, and the fields of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from passgraph.errors import InputError
from passgraph.graph.values import Derived, Value


def picked(value: object, fields: Sequence[str], key: str) -> object:
    """A field of a field of a value; of a list, that of each entry."""
    for i, field in enumerate(fields):
        # A list has methods, such as count, whose names fields may have; a named tuple is a struct.
        if isinstance(value, (list, tuple)) and not hasattr(value, "_fields"):
            return [picked(one, fields[i:], key) for one in value]
        if not hasattr(value, field):
            raise InputError(f"{key!r} needs a field {field!r}, which {type(value).__name__} lacks")
        value = getattr(value, field)
    return value


def resolve(handle: object, values: dict[Any, object]) -> object:
    """What a handle stands for in this run."""
    if isinstance(handle, Value):
        return values[handle.name]
    assert isinstance(handle, Derived)
    # By identity: a default inside the handle may be an array, which has no hash.
    if id(handle) not in values:
        values[id(handle)] = handle.function(*(values[source.name] for source in handle.sources))
    return values[id(handle)]
