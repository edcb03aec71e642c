"""A hard case: what goes wrong, what the library does about it, and both measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.srgb import linear_to_srgb
from passgraph.truth import VisibleShare, first_surfaces, visible_share
from tests.effects.scenes import render

Picture = NDArray[np.float32]
SIZE = (240, 150)


@dataclass(frozen=True)
class Figure:
    """One line of a case's table; what has no number is None."""

    what: str
    truth: float | None
    failing: float | None
    remedy: float | None
    digits: int = 3


@dataclass(frozen=True)
class Case:
    """One row of the document.

    Attributes
    ----------
    key : names the picture file
    title : the situation
    wrong, remedy : a sentence or two each
    labels : what stands over the columns of the table: truth, failing, remedy
    figures : the table
    strip : labelled pictures, (h, w) or (h, w, 3), 0 to 1, shown as they are
    notes : a list below the table
    """

    key: str
    title: str
    wrong: str
    remedy: str
    labels: tuple[str, str, str]
    figures: tuple[Figure, ...]
    strip: tuple[tuple[str, Picture], ...] = ()
    notes: tuple[str, ...] = ()

    def figure(self, what: str) -> Figure:
        """The line with this name."""
        return next(figure for figure in self.figures if figure.what == what)


def mask(scene: pg.Scene, backend: str, size: tuple[int, int] = SIZE, **options: object) -> Picture:
    """The share of the light that arrives according to `soft_shadow`, (h, w)."""
    from passgraph.effects import soft_shadow_passes

    passes = soft_shadow_passes(scene, **{"ambient": 0.0, "map_size": 256, **options})  # type: ignore[arg-type]
    assert passes.shadows_blurred is not None
    return next(iter(render(passes.shadows_blurred, size=size, backend=backend).values()))[:, :, 0]


def traced(scene: pg.Scene, size: tuple[int, int] = SIZE, samples: int = 144) -> VisibleShare:
    """The same by rays, within a percent or two."""
    return visible_share(scene, size, samples=samples)


def rmse(got: Picture, truth: VisibleShare) -> float:
    """Root of the mean squared difference where a share means something."""
    return float(np.sqrt(np.mean((got - truth.share)[truth.valid].astype(np.float64) ** 2)))


def mean_off(got: Picture, truth: VisibleShare) -> float:
    """Mean of the magnitudes of the differences where a share means something."""
    return float(np.mean(abs(got - truth.share)[truth.valid]))


def width_of(share: Picture, places: NDArray[np.float64]) -> float:
    """Distance over which a rising edge goes from 0.1 to 0.9; ``share`` along increasing places."""
    crossings = []
    for level in (0.1, 0.9):
        above = int(np.argmax(share >= level))
        a, b = share[above - 1], share[above]
        crossings.append(places[above - 1] + (level - a) / max(b - a, 1e-9) * (places[above] - places[above - 1]))
    return float(crossings[1] - crossings[0])


def shown(scene: pg.Scene, share: Picture) -> Picture:
    """A share of the light as a picture of grey surfaces, (h, w, 3): what casts stands out from what does not.

    Shading is the same for every share, from traced surfaces, so that strips differ in their shadows alone.
    """
    seen = first_surfaces(scene, (share.shape[1], share.shape[0]))
    light = scene.lights[0]
    toward = -np.broadcast_to(light.direction, seen.normals.shape)
    if light.kind != "directional":
        offset = np.subtract(light.position, seen.origin) - seen.positions
        toward = offset / np.linalg.norm(offset, axis=2, keepdims=True)
    facing = np.clip(np.nan_to_num(np.einsum("ijk,ijk->ij", seen.normals, toward)), 0.0, 1.0)
    white = np.array([node.material.base_color[:3] for node in scene.nodes])[seen.node]
    # half of the light from above keeps facets apart that no light reaches
    sky = 0.16 + 0.06 * seen.normals[..., 1] + 0.05 * seen.normals[..., 0]
    lit = white * (sky + 0.75 * np.sqrt(facing) * share)[..., None]
    return linear_to_srgb(np.clip(np.where((seen.node >= 0)[..., None], lit, 0.75), 0.0, 1.0)).astype(np.float32)
