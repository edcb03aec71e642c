"""Texels that a kernel reads side by side, as comparisons with a shadow map and bilinear samples do.

Where none of them lies beyond an edge they come together, with one load for each pixel of the vector.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from passgraph.language import scalar as s

#: Texels from the first to the last of a window at most.
MAX_SPAN = 16


@dataclass(frozen=True)
class Window:
    """Reads in one row of an image with one channel: ``loads[k]`` at column ``base + offsets[k]``, in order."""

    base: s.Val
    offsets: tuple[int, ...]
    loads: tuple[s.LoadTexel, ...]


def windows_of(program: s.ScalarProgram) -> dict[int, Window]:
    """Windows by the result of each of their reads."""
    single = {use.name for use in program.images if use.channels == 1}
    sums = dict(_sums(program)) if single else {}
    found: dict[int, Window] = {}
    for block in _blocks(program.body) if single else ():
        rows: dict[tuple[str, ...], dict[int, tuple[s.Val, s.LoadTexel]]] = {}
        for i in block:
            if not isinstance(i, s.LoadTexel) or i.relative or i.image not in single or not isinstance(i.x, s.Val):
                continue
            base, offset = sums.get(i.x.id, (i.x, 0))
            rows.setdefault((i.image, i.border, repr(i.y), repr(base)), {})[offset] = base, i
        for row in rows.values():
            offsets = tuple(sorted(row))
            if len(offsets) > 1 and offsets[-1] - offsets[0] < MAX_SPAN and max(map(abs, offsets)) <= MAX_SPAN:
                window = Window(row[offsets[0]][0], offsets, tuple(row[offset][1] for offset in offsets))
                found |= {value.id: window for load in window.loads for value in s.results_of(load)}
    return found


def _sums(program: s.ScalarProgram) -> Iterator[tuple[int, tuple[s.Val, int]]]:
    """Values that are another one and a constant."""
    for i in s.walk(program.body):
        if isinstance(i, s.Op) and i.operation == "add" and i.on == "int":
            x, y = i.arguments
            if isinstance(x, s.Val) and isinstance(y, s.Lit):
                yield i.to.id, (x, int(y.value))


def _blocks(body: tuple[s.Instruction, ...]) -> Iterator[tuple[s.Instruction, ...]]:
    """Instructions that run one after another."""
    yield body
    for i in body:
        if isinstance(i, s.If):
            yield from _blocks(i.then)
            yield from _blocks(i.orelse)
        elif isinstance(i, s.For):
            yield from _blocks(i.body)
