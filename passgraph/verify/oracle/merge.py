"""Allowed contents of a draw's targets, fragment by fragment (rules 6 and 7 of docs/rasterization.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block
from passgraph.backends.reference.draw_pass import COMPARE, OPERATIONS, filled
from passgraph.backends.reference.interpreter import Interpreter, StageValues
from passgraph.backends.reference.stage import Storage
from passgraph.formats import Format
from passgraph.graph.draw_state import Blend, Geometry, Stencil
from passgraph.plan.blending import blend_kernel
from passgraph.plan.data import DrawStep
from passgraph.verify.oracle import interval as iv
from passgraph.verify.oracle.decisions import Track
from passgraph.verify.oracle.domain import IntervalDomain
from passgraph.verify.oracle.interval import Bounded, Float64, Interval, Lanes
from passgraph.verify.oracle.stored_bounds import stored

Ints = NDArray[np.int64]

#: The smallest normal half float; smaller ones have the same spacing.
SMALLEST_HALF = 2.0**-14
#: Where OpenGL may stop when a blended half overflows: it leaves the rounding of that conversion open.
LARGEST_HALF = 65504.0


@dataclass(frozen=True, eq=False)
class DrawCall:
    """The inputs of one draw: its targets, the pictures that both stages read, vertices and parameters."""

    outputs: Sequence[Storage]
    depth: Storage | None
    images: Sequence[Storage]
    geometry: Geometry
    vertex: Block
    fragment: Block


@dataclass
class Layer:
    """A color target: bounds of each pixel, (pixels, channels)."""

    format: Format
    values: Interval
    blend: Blend | None
    mask: Lanes


@dataclass
class State:
    """The targets of a draw; pixels are numbered row by row."""

    step: DrawStep
    colours: list[Layer]
    depth: Interval | None  # (pixels,)
    stencil: tuple[Ints, Ints] | None  # lowest and highest value of each pixel
    turned: Lanes  # pixels that depend on an uncertain decision
    unpromised: Lanes  # pixels outside the documented domain of one of the kernel's operations

    @property
    def ambiguous(self) -> Lanes:
        return np.asarray(self.turned | self.unpromised)

    @classmethod
    def before(cls, step: DrawStep, outputs: Sequence[Storage], depth: Storage | None) -> State:
        """Return the cleared targets, or their content before the draw."""
        state = step.state
        count = step.size[0] * step.size[1]
        blends = state.blend or (None,) * len(outputs)
        masks = state.color_mask or ((True,) * 4,) * len(outputs)
        colours = []
        for output, clear, blend, mask in zip(outputs, step.clears, blends, masks, strict=True):
            channels = output.format.channels
            if clear is None:
                values = _exactly(output.flat)
            else:
                colour = np.broadcast_to(np.asarray(clear, np.float32), (1, channels))
                values = stored(output.format, Interval.as_read(colour)).take(np.zeros(count, np.int64))
            colours.append(Layer(output.format, values, blend, np.asarray(mask[:channels])))
        depths, stencils = None, None
        if depth is not None:
            start = depth.pixels.reshape(-1) if step.depth_clear is None else np.full(count, step.depth_clear)
            depths = _exactly(start.astype(np.float32))
            if depth.stencil is not None:
                stencil = depth.stencil.reshape(-1).astype(np.int64)
                stencil = stencil if step.depth_clear is None else np.full(count, state.clear_stencil, np.int64)
                stencils = stencil.copy(), stencil.copy()
        return cls(step, colours, depths, stencils, *(np.zeros(count, np.bool_) for _ in range(2)))

    def forget(self) -> None:
        """Make every pixel unbounded."""
        for layer in self.colours:
            layer.values = Interval.anything(layer.values.lo.shape)
        if self.depth is not None:
            self.depth = Interval.anything(self.depth.lo.shape)
        if self.stencil is not None:
            self.stencil = np.zeros_like(self.stencil[0]), np.full_like(self.stencil[1], 255)
        self.turned[:] = True

    def may_pass(self, at: Ints, depth: Interval) -> Ints:
        """Return the fragments that may pass the depth and stencil tests; others may still change the stencil."""
        if self.depth is None or self.stencil is not None:
            return np.arange(len(at))
        can_pass, _ = iv.compared(self.step.state.depth_compare, depth, self.depth.take(at))
        return np.flatnonzero(can_pass)

    def add(
        self, at: Ints, depth: Interval, surely: Lanes, perhaps: Lanes, colours: Sequence[Interval], turned: Lanes,
        unpromised: Lanes,
    ) -> None:  # fmt: skip
        """Add at most one fragment per pixel; ``turned`` depend on a decision, ``unpromised`` are outside an
        operation's domain."""
        surely = surely & perhaps
        if self.depth is not None:
            surely, perhaps = self._tests(at, depth, surely, perhaps, self.depth)
        if not any(layer.blend for layer in self.colours):
            self.turned[at[surely]] = self.unpromised[at[surely]] = False
        self.turned[at[perhaps & turned]] = True
        self.unpromised[at[perhaps & unpromised]] = True
        for layer, colour in zip(self.colours, colours, strict=False):
            self._write(layer, at, colour, surely, perhaps)

    def _tests(self, at: Ints, depth: Interval, surely: Lanes, perhaps: Lanes, stored: Interval) -> tuple[Lanes, Lanes]:
        state = self.step.state
        can_pass, can_fail = iv.compared(state.depth_compare, depth, stored.take(at))
        if state.stencil is not None and self.stencil is not None:
            allowed, refused = self._stencil_test(state.stencil, at, surely, perhaps, can_pass, can_fail)
            can_pass, can_fail = can_pass & allowed, can_fail | refused
        perhaps = perhaps & can_pass
        surely = surely & ~can_fail
        if state.depth_write:
            _put(stored, at, depth, surely, perhaps)
        return surely, perhaps

    def _stencil_test(
        self, stencil: Stencil, at: Ints, surely: Lanes, perhaps: Lanes, nearer: Lanes, farther: Lanes
    ) -> tuple[Lanes, Lanes]:
        """Return which fragments may pass and may fail; the stencil gets the range of its possible values."""
        assert self.stencil is not None
        low, high = self.stencil[0][at], self.stencil[1][at]
        results = []
        allowed, refused = np.zeros(len(at), np.bool_), np.zeros(len(at), np.bool_)
        reference = np.int64(stencil.reference & stencil.read_mask)
        for old in (low, high):
            passes = COMPARE[stencil.compare](reference, old & stencil.read_mask)
            allowed, refused = allowed | passes, refused | ~passes
        uncertain = low != high
        allowed, refused = allowed | uncertain, refused | uncertain
        for old in (low, high):
            outcomes = (
                (stencil.fail, refused),
                (stencil.depth_fail, allowed & farther),
                (stencil.passed, allowed & nearer),
            )
            for name, possible in outcomes:
                new = (old & ~stencil.write_mask) | (OPERATIONS[name](old, stencil.reference) & stencil.write_mask)
                results.append((new, possible & perhaps))
        new_low = np.where(surely, 255, low)
        new_high = np.where(surely, 0, high)
        for new, possible in results:
            new_low = np.where(possible, np.minimum(new_low, new), new_low)
            new_high = np.where(possible, np.maximum(new_high, new), new_high)
        # Operations that wrap or invert do not preserve the order of several values.
        mixed = uncertain & perhaps
        self.stencil[0][at], self.stencil[1][at] = np.where(mixed, 0, new_low), np.where(mixed, 255, new_high)
        return allowed, refused

    def _write(self, layer: Layer, at: Ints, colour: Interval, surely: Lanes, perhaps: Lanes) -> None:
        old = layer.values.take(at)
        new = stored(layer.format, colour) if layer.blend is None else blended(layer.format, layer.blend, colour, old)
        new = iv.where(layer.mask, new, old)
        open_ = perhaps & ~surely
        both = iv.hull(old, new)
        apart = (both.width > np.maximum(old.width, new.width)).any(axis=1) | (old.nan != new.nan).any(axis=1)
        self.turned[at] |= open_ & apart
        _put(layer.values, at, new, surely, perhaps)


def _exactly(pixels: NDArray[np.float32]) -> Interval:
    """Return stored values as exact bounds, in arrays of its own."""
    exact = pixels.astype(np.float64)
    return Interval(exact, exact.copy(), np.isnan(exact))


def _put(stored: Interval, at: Ints, new: Interval, surely: Lanes, perhaps: Lanes) -> None:
    """Store new values where fragments certainly exist, and the hull with old ones where they may exist."""
    old = stored.take(at)
    shape = (-1,) + (1,) * (old.ndim - 1)
    value = iv.where(surely.reshape(shape), new, iv.where(perhaps.reshape(shape), iv.hull(old, new), old))
    stored.lo[at], stored.hi[at], stored.nan[at] = value.lo, value.hi, value.nan


def blended(format_: Format, blend: Blend, source: Interval, old: Interval) -> Interval:
    """Return the blended value of both (n, channels): the blend's kernel, widened by what hardware may do otherwise."""
    program = blend_kernel(blend, format_)
    # Blending has no decisions, so there is one path.
    domain = IntervalDomain(Track(np.empty((len(source), 0), np.int8), np.arange(len(source))))
    given = converted(format_, source)
    around = StageValues[Bounded]({"source": given.map(filled), "destination": old.map(filled)})
    (result,) = Interpreter(program, domain, around).run()[0].values()
    assert isinstance(result, Interval)
    mixed = result.map(lambda x: np.broadcast_to(x.reshape(len(x), source.shape[1]), source.shape))
    if not format_.unit:
        return stored(format_, mixed)
    # Both products may be off by half a step. For normalized formats their sum is off by a step; halves are rounded
    # again.
    slack = format_.unit * (0.5 if format_.steps else np.maximum(mixed.magnitude, SMALLEST_HALF))
    low, high = mixed.lo - slack, mixed.hi + slack
    if not format_.steps:  # overflow may stop at the largest number
        low, high = np.minimum(low, LARGEST_HALF), np.maximum(high, -LARGEST_HALF)
    return stored(format_, Interval(low, high, mixed.nan))


def converted(format_: Format, source: Interval) -> Interval:
    """Return a source before it blends: hardware may convert it to the precision of a target below float32.

    Bits are rounded to the nearest. Halves are rounded to either neighbor: OpenGL leaves that open, and NVIDIA cuts.
    """
    if not format_.unit:
        return source
    if format_.steps:
        low, high = (np.rint(ends * format_.steps) / format_.steps for ends in (source.lo, source.hi))
        return Interval(np.minimum(source.lo, low), np.maximum(source.hi, high), source.nan)
    return Interval(_half_beside(source.lo, up=False), _half_beside(source.hi, up=True), source.nan)


def _half_beside(values: Float64, up: bool) -> Float64:
    """Return the nearest half float at or above each value, or at or below it; values out of range stay."""
    _, exponent = np.frexp(np.maximum(np.abs(values), SMALLEST_HALF))
    step = np.exp2(exponent - 11.0)
    rounded = (np.ceil if up else np.floor)(values / step) * step
    return np.where(np.isfinite(values), rounded, values)
