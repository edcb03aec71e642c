"""Ground truth for benchmarks: the compared pixels, and the visible share of the light at each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from passgraph.scene import Light, Scene
from passgraph.truth import Surfaces, first_surfaces, visible_share

Float32 = NDArray[np.float32]
Mask = NDArray[np.bool_]
#: Range of shares that counts as penumbra.
PENUMBRA = (0.01, 0.99)
#: Relative difference of depths beyond which rays and the rasterizer see different surfaces.
SAME_SURFACE = 0.01


@dataclass(frozen=True, eq=False)
class Truth:
    """Ray-traced ground truth of one scene and light.

    Attributes
    ----------
    share : (h, w) visible share of the light, 0 to 1
    counts : (h, w) True where pixels are compared: on surfaces that receive shadows, with the whole light above their
        plane; elsewhere shading decides, not shadows
    depth : (h, w) float64 along the view axis, scene units
    noise : standard error of ``share``, root mean square over the valid pixels
    samples : rays per pixel
    """

    share: Float32
    counts: Mask
    depth: NDArray[np.float64]
    noise: float
    samples: int

    @property
    def penumbra(self) -> Mask:
        return self.counts & (self.share > PENUMBRA[0]) & (self.share < PENUMBRA[1])

    def same_surface(self, depth: Float32) -> Mask:
        """Return where a rasterized depth picture shows the surface that the rays hit."""
        return np.asarray(np.abs(depth - self.depth) <= SAME_SURFACE * self.depth)


def truth_of(scene: Scene, size: tuple[int, int], samples: int) -> Truth:
    """Trace the scene's first light with this many rays per pixel."""
    traced = visible_share(scene, size, samples=samples)
    surfaces = first_surfaces(scene, size)
    counts = traced.valid & whole_light_above(scene.lights[0], surfaces)
    return Truth(traced.share, counts, surfaces.depth, traced.noise, traced.samples)


def whole_light_above(light: Light, surfaces: Surfaces) -> Mask:
    """Return where the whole light is above the plane of the surface's triangle."""
    if light.kind == "directional":
        sine = light.radius / np.hypot(1.0, light.radius)
        return np.asarray(-(surfaces.normals @ np.array(light.direction)) > sine)
    with np.errstate(invalid="ignore"):
        offset = np.subtract(light.position, surfaces.origin) - surfaces.positions
        return np.asarray(np.einsum("ijk,ijk->ij", surfaces.normals, offset) > light.radius)
