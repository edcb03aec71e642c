"""The visible share of a light, pixel by pixel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, cos, sqrt

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.scene.camera import Camera
from passgraph.scene.lights import Light
from passgraph.scene.scene import Scene
from passgraph.truth.rays import Float64, Tracer, strata, toward
from passgraph.truth.surfaces import Surfaces, casting_triangles, first_surfaces

Float32 = NDArray[np.float32]
#: Independent sets of samples; their scatter gives the reported error.
SETS = 4
#: Rays in memory at a time; each takes about 150 bytes with its origin, direction and samples.
RAYS = 1 << 18
MOST_SAMPLES = 1 << 16
#: Sine of the elevation up to which a light counts as in the surface's own plane: the uncertainty of float32 meshes.
HORIZON = 1e-6


@dataclass(frozen=True, eq=False)
class VisibleShare:
    """The visible share of one light at each pixel.

    Attributes
    ----------
    share : (h, w) float32, 0 hidden to 1 in full view; 1 where ``valid`` is False
    error : (h, w) float32 standard error of ``share``, from the scatter of four independent sets of samples: accurate
        on average over pixels, 0 where all four agree
    valid : (h, w) bool, True where a share is defined: on a surface that receives shadows and faces the light's center,
        and inside the cone of a spot light
    samples : rays per pixel
    """

    share: Float32
    error: Float32
    valid: NDArray[np.bool_]
    samples: int

    @property
    def noise(self) -> float:
        """Return the root mean square of the error over the valid pixels."""
        return sqrt(float(np.mean(self.error[self.valid].astype(np.float64) ** 2))) if self.valid.any() else 0.0


def visible_share(
    scene: Scene,
    size: tuple[int, int],
    *,
    camera: Camera | None = None,
    light: Light | None = None,
    samples: int = 64,
    seed: int = 0,
    progress: Callable[[float], object] | None = None,
) -> VisibleShare:
    """Trace the visible share of one light at each pixel: rays from the first surface to points spread over the light.

    Parameters
    ----------
    scene : the scene; translucent surfaces are neither visible nor cast shadows
    size : width and height in pixels
    camera, light : default: the scene's camera and its first light
    samples : rays per pixel, 1 to 65,536; rounded up to four times a square, and 1 for a light without extent
    seed : seed of the sample positions; the same seed gives the same picture
    progress : called from time to time with the finished share, 0 to 1

    Returns
    -------
    See `VisibleShare`.  Rays below the horizon of the pixel's own triangle count as hidden.

    Raises
    ------
    InputError
        If the scene has no light and none is given, a number is out of range, or a caster has holes from a texture.

    Examples
    --------
    >>> truth = visible_share(Scene.shipped(), (32, 18), samples=16)
    >>> truth.samples, 0.0 < truth.noise < 0.05
    (16, True)
    """
    lights = None if light is None else (light,)
    return visible_shares(scene, size, camera=camera, lights=lights, samples=samples, seed=seed, progress=progress)[0]


def visible_shares(
    scene: Scene,
    size: tuple[int, int],
    *,
    camera: Camera | None = None,
    lights: Sequence[Light] | None = None,
    samples: int = 64,
    seed: int = 0,
    progress: Callable[[float], object] | None = None,
) -> tuple[VisibleShare, ...]:
    """Return `visible_share` of several lights; default: all lights of the scene."""
    lights = scene.lights if lights is None else tuple(lights)
    if not lights:
        raise InputError(f"scene {scene.name!r}: no light to trace to; give one")
    if not 1 <= samples <= MOST_SAMPLES:
        raise InputError(f"samples: expected 1 to {MOST_SAMPLES}, got {samples!r}")
    surfaces = first_surfaces(scene, size, camera)
    casters = casting_triangles(scene, surfaces.origin)
    rays = Tracer(casters.corners) if len(casters.corners) else None
    receives = np.array([node.receives for node in scene.nodes] + [False])
    shares = []
    for number, light in enumerate(lights):

        def step(done: float, number: int = number) -> None:
            if progress is not None:
                progress((number + done) / len(lights))

        valid = receives[surfaces.node] & _shines_on(light, surfaces)
        shares.append(_trace(light, surfaces, valid, rays, casters.extent if rays else 0.0, samples, seed, step))
    return tuple(shares)


def _shines_on(light: Light, surfaces: Surfaces) -> NDArray[np.bool_]:
    """Return where the light's center is above the surface's horizon, and the surface in a spot's cone."""
    if light.kind == "directional":
        return np.asarray(surfaces.normals @ light.direction < -HORIZON)
    with np.errstate(invalid="ignore"):
        offset = np.subtract(light.position, surfaces.origin) - surfaces.positions
        far = np.linalg.norm(offset, axis=-1)
        above = np.einsum("ijk,ijk->ij", surfaces.normals, offset) > HORIZON * far
        if light.kind == "spot":
            above &= -offset @ np.array(light.direction) > cos(light.cone_outer_rad) * far
    return np.asarray(above)


def _trace(
    light: Light, surfaces: Surfaces, valid: NDArray[np.bool_], rays: Tracer | None, extent: float,
    samples: int, seed: int, step: Callable[[float], object],
) -> VisibleShare:  # fmt: skip
    sets, side = (SETS, ceil(sqrt(samples / SETS))) if light.radius > 0.0 else (1, 1)
    share, error = np.ones(valid.shape, np.float32), np.zeros(valid.shape, np.float32)
    rows, columns = np.nonzero(valid)
    batch = max(RAYS // (sets * side * side), 1)
    for start in range(0, len(rows) if rays else 0, batch):
        at = rows[start : start + batch], columns[start : start + batch]
        assert rays is not None
        means = _shares(light, surfaces, at, rays, extent, (sets, side), np.random.default_rng((seed, start)))
        share[at] = means.mean(axis=1)
        if sets > 1:
            error[at] = means.std(axis=1, ddof=1) / sqrt(sets)
        step(min((start + batch) / len(rows), 1.0))
    return VisibleShare(share, error, valid, sets * side * side)


def _shares(
    light: Light, surfaces: Surfaces, at: tuple[NDArray[np.intp], NDArray[np.intp]], rays: Tracer, extent: float,
    shape: tuple[int, int], rng: np.random.Generator,
) -> Float64:  # fmt: skip
    """Return the visible shares at some pixels by each set of samples, (n, sets)."""
    sets, side = shape
    positions, normals = surfaces.positions[at], surfaces.normals[at]
    count = len(positions)
    squares = strata(rng, count * sets, side) if light.radius > 0.0 else np.full((count, 1, 2), 0.5)
    # start off the surface by more than the tracer's rounding, so that it does not hide itself; end short of the light
    # by as much, since the light may lie on a surface
    lift = 4.0 * rays.rounding * max(extent, float(np.abs(positions).max()))
    starts = positions + lift * normals
    directions, lengths = toward(light, surfaces.origin, starts, squares.reshape(count, -1, 2))
    above = np.einsum("nmk,nk->nm", directions, normals) > 0.0
    index = np.nonzero(above)
    hidden = rays.blocked(starts[index[0]], directions[index], lengths[index] - lift)
    above[index] = ~hidden
    return np.asarray(above.reshape(count, sets, -1).mean(axis=2), np.float64)
