"""What no other method beats in both time and error."""

from __future__ import annotations

from collections.abc import Sequence


def front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Indices of the points that none is better than in one coordinate and no worse in the other, by the first.

    >>> front([(1.0, 9.0), (2.0, 9.0), (3.0, 4.0), (4.0, 5.0), (9.0, 1.0)])
    [0, 2, 4]
    """
    order = sorted(range(len(points)), key=lambda i: points[i])
    kept: list[int] = []
    for i in order:
        if not kept or points[i][1] < points[kept[-1]][1]:
            kept.append(i)
    return kept
