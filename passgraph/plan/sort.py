"""Sorting passes so that each comes after those that it waits for."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from heapq import heapify, heappop, heappush

from passgraph.graph.targets import Pass


def producers_first(waits: Mapping[Pass, Collection[Pass]], rank: Mapping[Pass, int]) -> list[Pass]:
    """Each pass after those that it waits for, and of those that may come next the one of the lowest rank first.

    Passes that wait for each other are left out, and so are those that wait for them.
    """
    followers: dict[Pass, list[Pass]] = {node: [] for node in waits}
    for node, before in waits.items():
        for one in before:
            followers[one].append(node)
    missing = {node: len(before) for node, before in waits.items()}
    ready = [(rank[node], node) for node, count in missing.items() if not count]
    heapify(ready)
    sequence: list[Pass] = []
    while ready:
        _, node = heappop(ready)
        sequence.append(node)
        for follower in followers[node]:
            missing[follower] -= 1
            if not missing[follower]:
                heappush(ready, (rank[follower], follower))
    return sequence
