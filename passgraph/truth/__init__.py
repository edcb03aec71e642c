"""What shadows should look like: the visible share of each light, by tracing rays.

Two tracers answer the same questions: Embree, and one of our own that numba compiles.  Both packages come with
``passgraph[truth]``.

>>> import passgraph as pg
>>> from passgraph.truth import visible_share
>>> truth = visible_share(pg.Scene.shipped(), (32, 18), samples=16, tracer="bvh")
>>> truth.share.shape, bool(truth.share.min() == 0.0), bool(truth.share.max() == 1.0)
((18, 32), True, True)
"""

from __future__ import annotations

from passgraph.truth.rays import Tracer
from passgraph.truth.share import VisibleShare, visible_share, visible_shares
from passgraph.truth.surfaces import Surfaces, first_surfaces
from passgraph.truth.tracers import TracerName, open_tracer

__all__ = [
    "Surfaces", "Tracer", "TracerName", "VisibleShare", "first_surfaces", "open_tracer", "visible_share",
    "visible_shares",
]  # fmt: skip
