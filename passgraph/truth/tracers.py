"""What traces rays: two implementations of one interface."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.truth.rays import Float64, Int32, Tracer

TracerName = Literal["auto", "embree", "bvh"]


def open_tracer(corners: Float64, name: TracerName = "auto") -> Tracer:
    """A tracer for triangles.

    Parameters
    ----------
    corners : (n, 3, 3) triangle, corner, coordinate; every triangle has an area
    name : "embree", or "bvh", our own, which numba compiles; "auto" takes Embree where it is installed.  The
        packages of both come with ``passgraph[truth]``

    Raises
    ------
    InputError
        The name is unknown, or its package is missing.

    >>> tracer = open_tracer(np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]]), "bvh")
    >>> tracer.closest(np.array([[0.2, 0.2, 1], [2, 2, 1.0]]), np.array([[0, 0, -1], [0, 0, -1.0]])).tolist()
    [0, -1]
    """
    if name not in ("auto", "embree", "bvh"):
        raise InputError(f"tracer: expected 'auto', 'embree' or 'bvh', got {name!r}")
    corners = np.ascontiguousarray(corners, np.float64)
    installed = find_spec("embreex") is not None
    if name == "embree" and not installed:
        raise InputError("tracer 'embree' needs the package embreex: pip install 'passgraph[truth]', or take 'bvh'")
    if name == "bvh" or not installed:
        if find_spec("numba") is None:
            raise InputError(
                f"tracer {name!r} needs the package {'numba' if name == 'bvh' else 'embreex, or numba'}: "
                "pip install 'passgraph[truth]'"
            )
        from passgraph.truth.bvh import BvhTracer

        return BvhTracer(corners)
    return EmbreeTracer(corners)


class EmbreeTracer:
    """Intel's Embree through embreex: float32, one thread.

    Source: I. Wald et al., "Embree: A Kernel Framework for Efficient CPU Ray Tracing", 2014.
    """

    name = "embree"
    # a few units in the last place of float32, 6e-8 each
    rounding = 2e-6

    def __init__(self, corners: Float64) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        # robust: rays that pass through an edge or a vertex meet one of the triangles there
        self._scene = EmbreeScene(robust=True)
        indices = np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)
        TriangleMesh(scene=self._scene, vertices=corners.reshape(-1, 3).astype(np.float32), indices=indices)

    def closest(self, origins: Float64, directions: Float64) -> Int32:
        """See `Tracer.closest`."""
        found = self._scene.run(origins.astype(np.float32), directions.astype(np.float32))
        return np.asarray(found, np.int32)

    def blocked(self, origins: Float64, directions: Float64, lengths: Float64) -> NDArray[np.bool_]:
        """See `Tracer.blocked`."""
        found = self._scene.run(
            origins.astype(np.float32), directions.astype(np.float32), lengths.astype(np.float32), query="OCCLUDED"
        )
        return np.asarray(found >= 0)
