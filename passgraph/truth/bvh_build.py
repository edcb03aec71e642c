"""A hierarchy of boxes round triangles."""

# mypy: disable-error-code="untyped-decorator"
from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
Tree = tuple[Float64, Int32, Int32, Int32]
#: Triangles in a leaf, at most, unless no plane separates their centres.
LEAF = 4
BINS = 16


@njit(cache=True, nogil=True)
def _area(low: Float64, high: Float64) -> float:
    d = high - low
    return float(d[0] * d[1] + d[1] * d[2] + d[2] * d[0])


@njit(cache=True, nogil=True)
def _split(lows: Float64, highs: Float64, centres: Float64, order: Int32, first: int, end: int) -> int:
    """Partition order[first:end] at the cheapest of 3 × 15 planes; where the second half starts, or ``first``."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(first, end):
        for k in range(3):
            low[k] = min(low[k], centres[order[i], k])
            high[k] = max(high[k], centres[order[i], k])
    best, best_axis, best_bin = np.inf, -1, 0
    counts = np.zeros(BINS, np.int64)
    bin_low, bin_high = np.empty((BINS, 3)), np.empty((BINS, 3))
    costs = np.empty(BINS)
    for axis in range(3):
        wide = high[axis] - low[axis]
        if wide <= 0.0:
            continue
        counts[:] = 0
        bin_low[:] = np.inf
        bin_high[:] = -np.inf
        for i in range(first, end):
            t = order[i]
            b = min(int((centres[t, axis] - low[axis]) / wide * BINS), BINS - 1)
            counts[b] += 1
            for k in range(3):
                bin_low[b, k] = min(bin_low[b, k], lows[t, k])
                bin_high[b, k] = max(bin_high[b, k], highs[t, k])
        box_low, box_high, n = np.full(3, np.inf), np.full(3, -np.inf), 0
        for b in range(BINS - 1):
            box_low, box_high, n = np.minimum(box_low, bin_low[b]), np.maximum(box_high, bin_high[b]), n + counts[b]
            costs[b] = n * _area(box_low, box_high) if n > 0 else np.inf
        box_low, box_high, n = np.full(3, np.inf), np.full(3, -np.inf), 0
        for b in range(BINS - 1, 0, -1):
            box_low, box_high, n = np.minimum(box_low, bin_low[b]), np.maximum(box_high, bin_high[b]), n + counts[b]
            cost = costs[b - 1] + n * _area(box_low, box_high) if n > 0 else np.inf
            if cost < best:
                best, best_axis, best_bin = cost, axis, b
    if best_axis < 0:
        return first
    wide = high[best_axis] - low[best_axis]
    middle = first
    for i in range(first, end):
        t = order[i]
        if min(int((centres[t, best_axis] - low[best_axis]) / wide * BINS), BINS - 1) < best_bin:
            order[i], order[middle] = order[middle], t
            middle += 1
    return middle


@njit(cache=True, nogil=True)
def build(corners: Float64) -> Tree:
    """The tree: boxes (m, 6), first child or first triangle (m,), triangles of a leaf or 0 (m,), triangle order (n,).

    The second child follows the first. Source: I. Wald, "On fast Construction of SAH-based Bounding Volume
    Hierarchies", 2007.
    """
    count = len(corners)
    lows, highs = np.empty((count, 3)), np.empty((count, 3))
    for t in range(count):
        for k in range(3):
            lows[t, k] = min(corners[t, 0, k], corners[t, 1, k], corners[t, 2, k])
            highs[t, k] = max(corners[t, 0, k], corners[t, 1, k], corners[t, 2, k])
    centres = 0.5 * (lows + highs)
    order = np.arange(count).astype(np.int32)
    boxes = np.empty((2 * count + 1, 6))
    child, counts = np.zeros(2 * count + 1, np.int32), np.zeros(2 * count + 1, np.int32)
    pending = [(0, 0, count)]
    used = 1
    while len(pending) > 0:
        node, first, end = pending.pop()
        boxes[node, :3] = np.inf
        boxes[node, 3:] = -np.inf
        for i in range(first, end):
            for k in range(3):
                boxes[node, k] = min(boxes[node, k], lows[order[i], k])
                boxes[node, 3 + k] = max(boxes[node, 3 + k], highs[order[i], k])
        middle = first
        if end - first > LEAF:
            middle = _split(lows, highs, centres, order, first, end)
        if middle in (first, end):
            child[node], counts[node] = first, end - first
            continue
        child[node] = used
        pending.append((used, first, middle))
        pending.append((used + 1, middle, end))
        used += 2
    return boxes[:used].copy(), child[:used].copy(), counts[:used].copy(), order
