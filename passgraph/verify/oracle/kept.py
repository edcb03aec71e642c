"""Cache of bounds: of a graph in memory, of conformance cases on disk for later processes.

The cache key is derived from everything that determines the bounds: a step's kernels as parsed, all bits of its inputs
and of what it draws over, and the source text of the oracle.
"""

from __future__ import annotations

import hashlib
import io
import json
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph import disk_cache, language
from passgraph.backends import base, reference
from passgraph.backends.base import Block, vertex_builtins
from passgraph.backends.reference.draw_pass import ReferenceDrawPass
from passgraph.backends.reference.stage import Stage, Storage
from passgraph.language.lower_cache import facts_digest
from passgraph.language.scope import freeze
from passgraph.plan.data import PixelStep
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.interval import Interval
from passgraph.verify.oracle.merge import DrawCall

Ints = NDArray[np.int64]

#: Part of the disk cache, see :mod:`passgraph.disk_cache`.
PART = "bounds"
#: Size limit of an entry in bytes before compression; the suite's pictures are small.
MOST_BYTES = 64 * 1024**2
#: Compression level; higher ones gain little and take three times as long.
PACKING = 1
#: Files of the package that determine bounds, in addition to the packages of the language, the reference and the
#: oracle.
_BESIDE = (
    "arguments.py", "cached.py", "formats.py", "quantise.py", "ranges.py", "records.py", "srgb.py",
    "graph/draw_state.py", "plan/blending.py",
)  # fmt: skip
#: Arrays of one target.
_ARRAYS = ("lo", "hi", "nan", "ambiguous", "unpromised")


@dataclass(frozen=True, eq=False)
class Found:
    """The allowed results of a step: for each target, and for a stencil the lowest and highest value of each pixel."""

    allowed: list[Allowed]
    stencil: tuple[Ints, Ints] | None = None


class Kept:
    """A cache of the bounds of steps.

    Parameters
    ----------
    on_disk
        True keeps them after the process ends.
    case
        Name them on disk after this case and their order instead of their content, so that a source tree with a
        mutation is judged by the bounds of the unmodified tree.
    """

    def __init__(self, on_disk: bool = False, case: str = "") -> None:
        self.on_disk, self.case = on_disk, case
        self._held: dict[str, Found] = {}
        self._asked = 0

    def found(self, deciding: Iterable[object], find: Callable[[], Found]) -> Found:
        """Return the result cached under the digest of ``deciding``, else call ``find`` and cache its result.

        Nothing is cached if ``deciding`` has no digest.
        """
        if self.case:
            self._asked += 1
            name = hashlib.sha256(f"{self.case}\0{self._asked}".encode(errors="surrogatepass")).hexdigest()
        else:
            name = _name(deciding)
        if name in self._held:
            return self._held[name]
        data = disk_cache.recall(PART, name) if self.on_disk and name else None
        result = None if data is None else _read(data)
        if result is None:
            result = find()
            # Results cut off by a time limit must not serve a caller with more time.
            if self.on_disk and name and not any(one.untried for one in result.allowed):
                data = _written(result)
                if data is not None:
                    disk_cache.remember(PART, name, data)
        if name:
            self._held[name] = result
        return result


def texts() -> tuple[Path, ...]:
    """Return the folders and files whose text determines bounds."""
    root = Path(disk_cache.__file__).parent
    packages = (Path(__file__), Path(reference.__file__), Path(language.__file__))
    beside = (root / name for name in _BESIDE)
    return *(package.parent for package in packages), *beside, Path(base.__file__)


@cache
def texts_digest() -> str:
    """Return a digest of the code that computes bounds, and of NumPy's version."""
    versions = (np.__version__, *(disk_cache.text_digest(path) for path in texts()))
    return hashlib.sha256("\0".join(versions).encode()).hexdigest()


def decides_pixels(
    step: PixelStep, stage: Stage, outputs: Sequence[Storage], images: Sequence[Storage], block: Block,
    carried: Mapping[int, Interval],
) -> Iterator[object]:  # fmt: skip
    """Yield everything that determines the allowed results of a full-screen pass."""
    yield "pixels"
    yield step.size
    yield [output.format for output in outputs]
    yield from _decides_stage(stage, block)
    yield from _decides_images(step.images, images, carried)


def decides_draw(
    draw_pass: ReferenceDrawPass,
    call: DrawCall,
    corner_px: float,
    carried: Mapping[int, Interval],
    stencils: Mapping[int, tuple[Ints, Ints]],
) -> Iterator[object]:
    """Yield everything that determines the allowed results of a draw."""
    step, depth = draw_pass.step, call.depth
    yield "draw"
    yield step.size, step.state, step.clears, step.depth_clear, corner_px
    for stage, block in ((draw_pass.vertex, call.vertex), (draw_pass.fragment, call.fragment)):
        if stage is None:
            yield "none"
        else:
            yield from _decides_stage(stage, block)
    yield from _decides_images(step.images, call.images, carried)
    for output, clear in zip(call.outputs, step.clears, strict=True):
        yield output.format
        if clear is None:
            yield output.pixels
    if depth is not None:
        yield depth.format
        if step.depth_clear is None:
            yield from (depth.pixels, depth.stencil, carried.get(id(depth)), stencils.get(id(depth)))
    yield call.geometry.triangles
    yield len(call.geometry.positions)
    yield vertex_builtins(call.geometry)


def _decides_stage(stage: Stage, block: Block) -> Iterator[object]:
    """Yield a kernel as parsed, independent of its file and its names; and the layout and values of its parameters."""
    program = stage.program
    yield [(p.name, p.type, freeze(p.default) if p.const and p.has_default else None) for p in program.parameters]
    yield program.stage, program.body, program.results, program.keep
    yield facts_digest(stage.facts)
    yield [(slot.name, slot.block, slot.offset, slot.count) for slot in stage.slots.values()], sorted(stage.long)
    yield from (block.floats, block.ints)


def _decides_images(
    names: Sequence[tuple[str, int]], images: Sequence[Storage], carried: Mapping[int, Interval]
) -> Iterator[object]:
    for (name, _), image in zip(names, images, strict=True):
        yield name, image.format
        yield image.pixels
        yield carried.get(id(image))


def _name(deciding: Iterable[object]) -> str:
    """Return a digest of the bits of arrays and the representation of other objects; empty if some object has no unique
    text."""
    try:
        return _digest((texts_digest(), *deciding))
    except (TypeError, RecursionError):
        return ""


def _digest(deciding: Iterable[object]) -> str:
    digest = hashlib.sha256()

    def add(part: object) -> None:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype.str}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part).data)
        elif isinstance(part, Interval):
            add((part.lo, part.hi, part.nan))
        elif isinstance(part, Mapping):
            add(tuple(item for name in sorted(part, key=str) for item in (name, part[name])))
        elif isinstance(part, tuple) and any(isinstance(one, np.ndarray) for one in part):
            digest.update(f"({len(part)} ".encode())
            for one in part:
                add(one)
        else:
            text = repr(part).encode(errors="surrogatepass")
            digest.update(f"{len(text)} ".encode())
            digest.update(text)

    for part in deciding:
        add(part)
    return digest.hexdigest()


def _written(found: Found) -> bytes | None:
    """Return the arrays in NumPy's format without pickle; None if too large."""
    arrays: dict[str, NDArray[Any]] = {}
    for number, one in enumerate(found.allowed):
        arrays_of_one = (one.values.lo, one.values.hi, one.values.nan, one.ambiguous, one.unpromised)
        arrays |= {f"{number} {name}": array for name, array in zip(_ARRAYS, arrays_of_one, strict=True)}
        arrays[f"{number} names"] = np.frombuffer(json.dumps(one.names).encode(), np.uint8)
    if found.stencil is not None:
        arrays["lowest"], arrays["highest"] = found.stencil
    if sum(array.nbytes for array in arrays.values()) > MOST_BYTES:
        return None
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays)
    return zlib.compress(file.getvalue(), PACKING)


def _read(data: bytes) -> Found | None:
    try:
        with np.load(io.BytesIO(zlib.decompress(data)), allow_pickle=False) as file:
            arrays = dict(file)
    except (ValueError, zlib.error):
        return None
    allowed: list[Allowed] = []
    while f"{len(allowed)} names" in arrays:
        lo, hi, nan, ambiguous, unpromised = (arrays[f"{len(allowed)} {name}"] for name in _ARRAYS)
        names = json.loads(arrays[f"{len(allowed)} names"].tobytes())
        allowed.append(Allowed(Interval(lo, hi, nan), ambiguous, unpromised, Counter(names)))
    return Found(allowed, (arrays["lowest"], arrays["highest"]) if "lowest" in arrays else None)
