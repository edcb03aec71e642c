"""Reads of neighboring texels of a row, at columns that data decide, which a device may load together."""

from __future__ import annotations

from collections.abc import Iterator

from passgraph.language import scalar as s
from passgraph.records import dataclass

#: Most texels from the first to the last of a window.
MAX_SPAN = 16


@dataclass(frozen=True)
class Window:
    """Reads in one row of a single-channel image: ``loads[k]`` at column ``base + offsets[k]``, in order."""

    base: s.Val
    offsets: tuple[int, ...]
    loads: tuple[s.LoadTexel, ...]


def windows_of(program: s.ScalarProgram) -> dict[int, Window]:
    """Return windows by the result of each of their reads."""
    single = {use.name for use in program.images if use.channels == 1}
    sums = dict(_sums(program)) if single else {}
    windows: dict[int, Window] = {}
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
                windows |= {value.id: window for load in window.loads for value in s.results_of(load)}
    return windows


def _sums(program: s.ScalarProgram) -> Iterator[tuple[int, tuple[s.Val, int]]]:
    """Yield values that are the sum of another one and a constant."""
    for i in s.walk(program.body):
        if isinstance(i, s.Op) and i.operation == "add" and i.on == "int":
            x, y = i.arguments
            if isinstance(x, s.Val) and isinstance(y, s.Lit):
                yield i.to.id, (x, int(y.value))


def _blocks(body: tuple[s.Instruction, ...]) -> Iterator[tuple[s.Instruction, ...]]:
    """Yield sequences of instructions that run one after another."""
    yield body
    for i in s.walk(body):
        if isinstance(i, s.If):
            yield from (i.then, i.orelse)
        elif isinstance(i, s.For):
            yield i.body
