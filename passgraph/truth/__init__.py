"""Ground truth of shadows: the visible share of each light, by ray tracing.

Embree traces; its package comes with ``passgraph[truth]``.

>>> import passgraph as pg
>>> from passgraph.truth import visible_share
>>> truth = visible_share(pg.Scene.shipped(), (32, 18), samples=16)
>>> truth.share.shape, bool(truth.share.min() == 0.0), bool(truth.share.max() == 1.0)
((18, 32), True, True)
"""

from __future__ import annotations

from passgraph.truth.rays import Tracer
from passgraph.truth.share import VisibleShare, visible_share, visible_shares
from passgraph.truth.surfaces import Surfaces, first_surfaces

__all__ = [
    "Surfaces", "Tracer", "VisibleShare", "first_surfaces", "visible_share", "visible_shares",
]  # fmt: skip
