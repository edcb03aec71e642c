"""Scenes as an engine shows them: a picture and a depth buffer, by rays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.surfaces.engine_depth import distances
from passgraph.truth import Surfaces, first_surfaces
from tests.effects.scenes import Picture, render


@dataclass(frozen=True, eq=False)
class EngineView:
    """What an engine hands over of one picture.

    Attributes
    ----------
    surfaces : the truth behind it
    holds : what its depth buffer means
    depth : (h, w) the buffer, float32 or uint16
    """

    surfaces: Surfaces
    camera: pg.Camera
    holds: pg.HardwareDepth
    depth: NDArray[np.float32] | NDArray[np.uint16]

    @classmethod
    def of(cls, scene: pg.Scene, size: tuple[int, int], reversed_z: bool = False, bits: int = 32) -> EngineView:
        """A scene through its own camera."""
        seen = first_surfaces(scene, size)
        holds = scene.camera.hardware_depth(reversed_z)
        held = holds.depth(seen.depth)
        depth = held.astype(np.float32) if bits == 32 else np.rint(held * 65535.0).astype(np.uint16)
        return cls(seen, scene.camera, holds, depth)

    @property
    def shown(self) -> NDArray[np.bool_]:
        """Where there is a surface."""
        return np.asarray(self.surfaces.depth > 0.0)

    def distance(self) -> pg.Target:
        """The depth that effects take, made of an input "depth"."""
        stored = "r16" if self.depth.dtype == np.uint16 else "r32f"
        return distances(pg.Input("depth", stored, self.depth.shape[::-1]), self.holds)

    def run(self, made: pg.Target, frame: Picture | None = None, backend: str = "numpy") -> Picture:
        """An effect of inputs "frame" (left out, white) and "depth"."""
        given = {"frame": np.ones((*self.depth.shape, 4), np.float32) if frame is None else frame, "depth": self.depth}
        return render(made, size=None, backend=backend, **given)[made.name]
