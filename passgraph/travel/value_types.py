"""Types of run values that travel: numbers, vectors and matrices, never objects of a class."""

from __future__ import annotations

from passgraph.language.symbols import TYPE_MARKERS, Array, Image

#: What a run value may be, by name.
VALUE_TYPES: dict[str, object] = {
    **{name: marker for marker, name in TYPE_MARKERS.items() if marker is not Image},
    "tuple": tuple,
    "Array": Array,
}
