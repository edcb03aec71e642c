"""Draws: vertex kernel, clipping, coverage, tests, fragment kernel, output."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block, quantised, vertex_builtins
from passgraph.backends.reference.interpreter import Interpreter, NumberDomain, Numbers, StageValues
from passgraph.backends.reference.rasterizer import (
    Fragments,
    ScreenTriangles,
    Vertices,
    clip_triangles,
    cover,
    to_window,
)
from passgraph.backends.reference.stage import (
    LANES,
    BoundStage,
    Builtins,
    Float32,
    Stage,
    Storage,
    constant,
    on_quads,
    stored,
)
from passgraph.formats import Format
from passgraph.graph.draw_state import Blend, DrawState, Geometry, Stencil
from passgraph.language.builtin_name import WHOLE_PIXEL, WHOLE_SIZE, BuiltinName
from passgraph.language.types import component_count, shape_of
from passgraph.plan.blending import blend_kernel
from passgraph.plan.data import DrawStep

Ints = NDArray[np.int64]
Lanes = NDArray[np.bool_]
Bytes = NDArray[np.int64]

COMPARE: dict[str, Callable[..., Lanes]] = {
    "never": lambda a, b: np.zeros(np.shape(b), np.bool_),
    "less": np.less,
    "equal": np.equal,
    "less_equal": np.less_equal,
    "greater": np.greater,
    "not_equal": np.not_equal,
    "greater_equal": np.greater_equal,
    "always": lambda a, b: np.ones(np.shape(b), np.bool_),
}

#: Stencil operation → new value of a stored byte.
OPERATIONS: dict[str, Callable[[Bytes, int], Bytes]] = {
    "keep": lambda old, reference: old,
    "zero": lambda old, reference: np.zeros_like(old),
    "replace": lambda old, reference: np.full_like(old, reference),
    "increment": lambda old, reference: np.minimum(old + 1, 255),
    "increment_wrap": lambda old, reference: (old + 1) & 0xFF,
    "decrement": lambda old, reference: np.maximum(old - 1, 0),
    "decrement_wrap": lambda old, reference: (old - 1) & 0xFF,
    "invert": lambda old, reference: ~old & 0xFF,
}


def layers(pixel: Ints) -> Iterator[Ints]:
    """Yield fragment numbers: the first of every pixel, then the second of every pixel that has one, and so on."""
    order = np.argsort(pixel, kind="stable")
    ordered = pixel[order]
    starts = np.ones(len(pixel), np.bool_)
    starts[1:] = ordered[1:] != ordered[:-1]
    place = np.arange(len(pixel))
    depth = place - np.maximum.accumulate(np.where(starts, place, 0))
    by_depth = order[np.argsort(depth, kind="stable")]
    counts = np.bincount(depth) if len(depth) else np.zeros(0, np.int64)
    yield from np.split(by_depth, np.cumsum(counts)[:-1]) if len(counts) else ()


def last_of_each(pixel: Ints) -> Ints:
    """Return the last fragment of every pixel, as ascending fragment numbers."""
    _, first_from_behind = np.unique(pixel[::-1], return_index=True)
    return np.sort(len(pixel) - 1 - first_from_behind)


def passing(storage: Storage | None, state: DrawState, pixel: Ints, depth: Float32) -> Lanes:
    """Return the fragments that pass both tests; update depth and stencil of ``storage``."""
    if storage is None:
        return np.ones(len(pixel), np.bool_)
    depths = storage.pixels.reshape(-1)
    stencils = None if storage.stencil is None else storage.stencil.reshape(-1)
    stencil = state.stencil if stencils is not None else None
    compare = COMPARE[state.depth_compare]
    if stencil is None and not state.depth_write:
        return compare(depth, depths[pixel])
    passed = np.zeros(len(pixel), np.bool_)
    for layer in layers(pixel):
        at = pixel[layer]
        nearer = compare(depth[layer], depths[at])
        if stencil is not None and stencils is not None:
            allowed = _stencil_test(stencil, stencils, at, nearer)
            nearer = nearer & allowed
        passed[layer] = nearer
        if state.depth_write:
            depths[at[nearer]] = depth[layer[nearer]]
    return passed


def allows(stencil: Stencil, stored: Bytes) -> Lanes:
    """Return True where the stencil test passes for these stored bytes."""
    return COMPARE[stencil.compare](np.int64(stencil.reference & stencil.read_mask), stored & stencil.read_mask)


def _stencil_test(stencil: Stencil, stencils: NDArray[np.uint8], at: Ints, nearer: Lanes) -> Lanes:
    old = stencils[at].astype(np.int64)
    allowed = allows(stencil, old)
    fail, depth_fail, both = (
        OPERATIONS[operation](old, stencil.reference)
        for operation in (stencil.fail, stencil.depth_fail, stencil.passed)
    )
    new = np.where(allowed, np.where(nearer, both, depth_fail), fail)
    stencils[at] = (old & ~stencil.write_mask) | (new & stencil.write_mask)
    return allowed


Float64 = NDArray[np.float64]


def write(storage: Storage, pixel: Ints, colours: Float64, mask: tuple[bool, ...], blend: Blend | None) -> None:
    """Write colors (n, channels) of fragments in submission order; without a blend, one per pixel."""
    if blend is None:
        _put(storage, pixel, stored(storage.format, colours), mask)
        return
    for layer in layers(pixel):
        new = blended(blend, storage.format, colours[layer], storage.flat[pixel[layer]].astype(np.float64))
        _put(storage, pixel[layer], quantised(new, storage.format), mask)


def _put(storage: Storage, pixel: Ints, values: NDArray[np.float32], mask: tuple[bool, ...]) -> None:
    for channel in range(storage.format.channels):
        if mask[channel]:
            storage.flat[pixel, channel] = values[:, channel]


def blended(blend: Blend, format_: Format, source: Float64, destination: Float64) -> Float64:
    """Blend two arrays (n, channels); the result is not quantized."""
    program = blend_kernel(blend, format_)
    around = StageValues({"source": filled(source), "destination": filled(destination)})
    results, _ = Interpreter(program, NumberDomain(), around).run()
    (result,) = results.values()
    return np.broadcast_to(result.reshape(len(result), source.shape[1]), source.shape)


def filled(values: NDArray[Any]) -> NDArray[Any]:
    """Return (n, channels) with four channels; missing ones have no effect on results."""
    return np.pad(values, ((0, 0), (0, 4 - values.shape[1])))


ALL_CHANNELS = (True, True, True, True)


class ReferenceDrawPass:
    """A draw, interpreted and rasterized by docs/rasterization.md."""

    def __init__(self, step: DrawStep) -> None:
        self.step = step
        source = step.source
        self.vertex = Stage(source.vertex.program, step.vertex, step.vertex_facts)
        self.fragment: Stage | None = None
        if source.fragment is not None and step.fragment is not None:
            self.fragment = Stage(source.fragment.program, step.fragment, step.fragment_facts)
        self.varyings: dict[BuiltinName, tuple[slice, tuple[int, ...]]] = {}
        column = 4
        for result in source.vertex.program.results:
            width = component_count(result.type)
            self.varyings[BuiltinName("varying", result.name)] = slice(column, column + width), shape_of(result.type)
            column += width

    def __call__(
        self,
        outputs: Sequence[Storage],
        depth: Storage | None,
        images: Sequence[Storage],
        geometry: Geometry,
        vertex: Block,
        fragment: Block,
    ) -> None:
        self._clear(outputs, depth)
        names = [name for name, _ in self.step.images]
        bound = None if self.fragment is None else self.fragment.bind(fragment, names, images)
        with np.errstate(all="ignore"):
            vertices = self._vertices(self.vertex.bind(vertex, names, images), geometry)
            indices = np.asarray(geometry.triangles, np.int64).reshape(-1, 3)
            clipped, triangles, sources = clip_triangles(vertices, indices)
            screen = to_window(clipped, triangles, self.step.size, self.step.state)
            screen = replace(screen, source=sources[screen.source])
            for fragments in self._fragments(screen):
                self._merge(Covered(fragments, screen, clipped, self), bound, outputs, depth)

    def _clear(self, outputs: Sequence[Storage], depth: Storage | None) -> None:
        for output, clear in zip(outputs, self.step.clears, strict=True):
            if clear is not None:
                colour = np.broadcast_to(np.asarray(clear, np.float64), (1, output.format.channels))
                output.pixels[...] = stored(output.format, colour)
        if depth is not None and self.step.depth_clear is not None:
            depth.pixels[...] = self.step.depth_clear
            if depth.stencil is not None:
                depth.stencil[...] = self.step.state.clear_stencil

    def _vertices(self, bound: BoundStage, geometry: Geometry) -> Vertices:
        """Run the vertex kernel over all vertices; positions and varyings are float32 on every backend."""
        attributes = vertex_builtins(geometry)
        count = len(geometry.positions)
        parts = [np.empty((0, max(columns.stop for columns, _ in self.varyings.values())))]
        for first in range(0, count, LANES):
            last = min(first + LANES, count)
            lanes = {name: constant(values[first:last].astype(np.float64)) for name, values in attributes.items()}
            lanes[WHOLE_SIZE] = constant(np.array([self.step.size], np.int64))
            results, _ = bound.run(last - first, lanes)
            named = zip(bound.program.results, results, strict=True)
            position = next(values for result, values in named if result.name == "position")
            rows = [position, *(values.reshape(last - first, -1) for values in results)]
            parts.append(np.concatenate(rows, axis=1).astype(np.float32).astype(np.float64))
        return Vertices(np.concatenate(parts))

    def _fragments(self, screen: ScreenTriangles) -> Iterator[Fragments]:
        return cover(screen, self.step.size)

    def _tested(self, covered: Covered, depth: Storage | None) -> NDArray[np.bool_]:
        """Return the fragments that pass stencil and depth tests, and update both."""
        return passing(depth, self.step.state, covered.pixel, covered.depth)

    def _merge(
        self, covered: Covered, bound: BoundStage | None, outputs: Sequence[Storage], depth: Storage | None
    ) -> None:
        """Run one batch of fragments through kernel, tests and output.

        The kernel runs first only if it may discard; else only for fragments that are visible.
        """
        state = self.step.state
        colours: list[Float64] | None = None
        if bound is not None and bound.program.keep is not None:
            colours, keep = covered.shade(bound)
            surviving = np.flatnonzero(keep)
            covered, colours = covered.take(surviving), [c[surviving] for c in colours]
        passed = np.flatnonzero(self._tested(covered, depth))
        if bound is None or not outputs:
            return
        blends = state.blend or (None,) * len(outputs)
        masks = state.color_mask or (ALL_CHANNELS,) * len(outputs)
        last = last_of_each(covered.pixel[passed])
        if not any(blends):
            passed, last = passed[last], np.arange(len(last))
        covered = covered.take(passed)
        colours = covered.shade(bound)[0] if colours is None else [c[passed] for c in colours]
        for output, values, mask, blend in zip(outputs, colours, masks, blends, strict=True):
            chosen = last if blend is None else slice(None)
            write(output, covered.pixel[chosen], values[chosen], mask, blend)


class Covered:
    """Covered fragments with the values that the rules derive from their position in the triangle."""

    def __init__(
        self, fragments: Fragments, screen: ScreenTriangles, vertices: Vertices, draw: ReferenceDrawPass
    ) -> None:
        self.fragments, self.screen, self.vertices, self.draw = fragments, screen, vertices, draw
        self.width, self.height = draw.step.size
        self.pixel = fragments.y * self.width + fragments.x
        weights, owner = fragments.weights, fragments.triangle
        depth = (weights * screen.depth[owner]).sum(axis=1) + screen.offset[owner]
        self.depth: Float32 = np.clip(depth, 0.0, 1.0).astype(np.float32)
        over_w = weights * screen.inverse_w[owner]
        self.perspective = over_w / over_w.sum(axis=1, keepdims=True)

    def take(self, chosen: Ints | slice) -> Covered:
        return Covered(self.fragments[chosen], self.screen, self.vertices, self.draw)

    def shade(self, bound: BoundStage) -> tuple[list[Float64], NDArray[np.bool_]]:
        """Return the fragment kernel's results (n, channels), and the mask of fragments that it keeps."""
        count = len(self.fragments)
        colours = [np.empty((count, component_count(r.type))) for r in bound.program.results]
        keep = np.ones(count, np.bool_)
        for first in range(0, count, LANES):
            part = slice(first, min(first + LANES, count))
            results, surviving = bound.run(part.stop - first, self.take(part).builtins())
            for colour, values in zip(colours, results, strict=True):
                colour[part] = values.reshape(part.stop - first, -1)
            if surviving is not None:
                keep[part] = surviving
        return colours, keep

    def builtins(self) -> Builtins:
        fragments = self.fragments
        own = {
            WHOLE_PIXEL: lambda: np.stack([fragments.x, fragments.y], axis=1),
            WHOLE_SIZE: constant(np.array([[self.width, self.height]], np.int64)),
            BuiltinName("front_facing"): lambda: self.screen.front[fragments.triangle],
        }
        return own | on_quads(self._of_triangle)

    def _of_triangle(self, axes: str = "") -> Builtins:
        """Return the builtins of the triangles at a pixel of each quad."""
        if axes:
            neighbors = self.fragments.beside(axes, self.screen)
            return Covered(neighbors, self.screen, self.vertices, self.draw)._of_triangle()
        varyings = {name: self._varying(columns, shape) for name, (columns, shape) in self.draw.varyings.items()}
        return {BuiltinName("fragment_depth"): lambda: self.depth.astype(np.float64), **varyings}

    def _varying(self, columns: slice, shape: tuple[int, ...]) -> Callable[[], Numbers]:
        def interpolate() -> Numbers:
            corners = self.vertices.rows[:, columns][self.screen.corners[self.fragments.triangle]]
            values: Numbers = np.einsum("nk,nkc->nc", self.perspective, corners)
            return values.reshape(len(values), *shape)

        return interpolate
