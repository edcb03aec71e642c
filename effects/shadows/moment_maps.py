"""Convert shadow maps to maps of moments, and blur them once per light."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.effects.quantities import combined
from passgraph.effects.shadows.shadow_choice import Evsm4, MomentFilter, Msm, Vsm
from passgraph.effects.shadows.shadow_filters import FilterFrame
from passgraph.effects.shadows.shadow_moments import (
    four_moments,
    normalised,
    packed_moments,
    two_moments,
    warped_moments,
)
from passgraph.effects.surfaces.views import Float64, LightFrame, MapView, Seen, View
from passgraph.language import Const, Image, ivec2, output_size, pixel, vec2, vec4
from passgraph.records import dataclass
from passgraph.scene.matrices import translation

#: Largest radius of a blur as a fraction of the map's width.
WIDEST = 1.0 / 8.0
#: Bounds of loops that exit early.  Drivers unroll short loops (Mesa up to 32 iterations), and then execute every read:
#: on llvmpipe a narrow blur takes twice the time.
NOT_WRITTEN_OUT = 64


@dataclass(frozen=True, eq=False)
class MomentView(MapView):
    """The view of a map of moments: wider than a depth map by the radius of the blur.

    ``width`` is half that of edges in scene units: a number or a value.
    """

    map_size: int = 1024
    width: object = 0.0

    def frustum(self, light: pg.Light, seen: Seen | None = None) -> tuple[Float64, Float64]:
        """Return the matrices fitted to the casters, widened for the blur of each run."""
        view, projection = super().frustum(light)
        if not isinstance(self.width, float):
            return view, projection
        radius = self._radius(light, projection)
        inner = 1.0 - 2.0 * (radius + 2.0) / self.map_size if radius > 0.0 else 1.0
        return view, np.diag([inner, inner, 1.0, 1.0]) @ projection

    def _radius(self, light: pg.Light, projection: Float64) -> float:
        """Return the radius of the blur in texels of the widened map; ``projection`` is that of the casters."""
        assert isinstance(self.width, float)
        near, far = depths_of(projection)
        share = self.width * float(projection[0, 0])
        if light.kind != "directional":
            share /= 0.5 * (near + far)
        # the casters have size - 2 (radius + 2) texels, and the width is this fraction of half of them
        radius = 0.5 * share * (self.map_size - 4.0) / (1.0 + share)
        return min(radius, WIDEST * self.map_size)

    def clip_from(self, origin: Float64) -> pg.Derived:
        def matrix(light: pg.Light, width: float) -> Float64:
            view, projection = replace(self, width=float(width)).frustum(light)
            return projection @ view @ translation(origin)

        return combined(matrix, self.light, self.width)

    def frame(self, view: View, map_size: int) -> pg.Derived:
        def frame_of(camera: pg.Camera, light: pg.Light, width: float) -> LightFrame:
            return replace(self, width=float(width))._frame(camera, light, None, map_size)

        return combined(frame_of, view.camera, self.light, self.width)

    def filter_frame(self, filter_: MomentFilter) -> pg.Derived:
        """Return the run values of the filter."""
        exponent = filter_.exponent if isinstance(filter_, Evsm4) else 0.0  # the others have no warp

        def frame(light: pg.Light, width: float) -> FilterFrame:
            projection = super(MomentView, self).frustum(light)[1]
            near, far = depths_of(projection)
            radius = replace(self, width=float(width))._radius(light, projection)
            scale = 2.0 / (far - near)
            return FilterFrame(width, filter_.bleed, exponent, near, scale, radius, block_of(radius))

        return combined(frame, self.light, self.width)


def depths_of(projection: Float64) -> tuple[float, float]:
    """Return near and far, scene units."""
    scale, shift = float(projection[2, 2]), float(projection[2, 3])
    if projection[3, 3] == 1.0:
        return (shift + 1.0) / scale, (shift - 1.0) / scale
    return shift / (scale - 1.0), shift / (scale + 1.0)


@pg.function
def depth_at(map: Image, by: FilterFrame) -> float:
    """Return the depth from -1 to 1; outside of the map the outermost texels are repeated, which are empty."""
    p, last = pixel(), output_size() - 1
    border = p.x == 0 or p.y == 0 or p.x == last.x or p.y == last.y
    return 1.0 if border and by.radius > 0.0 else normalised(map[0, 0].r, by)


@pg.kernel
def variance_map(map: Image, by: FilterFrame) -> vec2:
    """Return depth and its square."""
    return two_moments(depth_at(map, by))


@pg.kernel
def exponential_map(map: Image, by: FilterFrame) -> vec4:
    """Return two warps of the depth, and their squares."""
    return warped_moments(depth_at(map, by), by.exponent)


@pg.kernel
def moment_map(map: Image, by: FilterFrame) -> vec4:
    """Return four powers of the depth."""
    return four_moments(depth_at(map, by))


@pg.kernel
def pack(moments: Image) -> vec4:
    """Pack four powers into 16 bits."""
    return packed_moments(moments[0, 0])


def block_of(radius: float) -> int:
    """Return the texels to each side of a block's center: blocks of about √radius texels need the fewest reads."""
    return max(int((radius**0.5 - 1.0) / 2.0), 0)


@dataclass(frozen=True)
class BoxKernels:
    """A box blur in one direction, in two passes: `block` averages a few texels, and `box` averages adjacent blocks.

    It needs about 4 √radius reads per texel, where one pass needs 2 radius.
    """

    block: Any  # (map, by, dx, dy)
    box: Any  # (blocks, map, by, dx, dy)


@lru_cache(maxsize=64)
def box_kernels(reach: int, channels: int) -> BoxKernels:
    """Return box kernels for any half width from half a texel to ``reach`` texels. Two channels or four.

    The outermost texels are weighted by the part that the box covers.
    """
    longest = max(2 * block_of(reach) + 1, NOT_WRITTEN_OUT)
    most = max(int(reach**0.5) + 4, NOT_WRITTEN_OUT)  # blocks to each side: more than √reach if they are barely shorter

    @pg.function
    def block_mean(map: Image, reach: int, dx: int, dy: int) -> vec4:
        share = 1.0 / float(2 * reach + 1)
        total = map[0, 0] * share
        for i in range(1, longest):
            if i > reach:
                break
            total += (map[i * dx, i * dy] + map[-i * dx, -i * dy]) * share
        return total

    @pg.function
    def box_mean(blocks: Image, map: Image, radius: float, reach: int, dx: int, dy: int) -> vec4:
        here = pixel()
        # weights are applied first, so that every partial sum stays below the largest value
        share = 1.0 / (2.0 * radius)
        length = 2 * reach + 1
        of_block = share * float(length)
        total = blocks[0, 0] * of_block
        covered = reach  # texels to each side that are in the sum
        for _ in range(most):
            if float(covered + length) + 0.5 > radius:
                break
            at = ivec2(dx, dy) * (covered + reach + 1)
            total += (blocks.texel(here + at) + blocks.texel(here - at)) * of_block
            covered += length
        for _ in range(longest):
            part = radius - 0.5 - float(covered)
            if part <= 0.0:
                break
            covered += 1
            at = ivec2(dx, dy) * covered
            total += (map.texel(here + at) + map.texel(here - at)) * (share * min(part, 1.0))
        return total

    @pg.kernel
    def block_of_two(map: Image, by: FilterFrame, dx: Const[int], dy: Const[int]) -> vec2:
        return block_mean(map, by.block, dx, dy).xy

    @pg.kernel
    def block_of_four(map: Image, by: FilterFrame, dx: Const[int], dy: Const[int]) -> vec4:
        return block_mean(map, by.block, dx, dy)

    @pg.kernel
    def box_of_two(blocks: Image, map: Image, by: FilterFrame, dx: Const[int], dy: Const[int]) -> vec2:
        return box_mean(blocks, map, max(by.radius, 0.5), by.block, dx, dy).xy

    @pg.kernel
    def box_of_four(blocks: Image, map: Image, by: FilterFrame, dx: Const[int], dy: Const[int]) -> vec4:
        return box_mean(blocks, map, max(by.radius, 0.5), by.block, dx, dy)

    return BoxKernels(block_of_two, box_of_two) if channels == 2 else BoxKernels(block_of_four, box_of_four)


def blurred_moments(
    map: pg.Target, filter_: MomentFilter, by: pg.Derived, blurred: bool, map_size: int, name: str
) -> pg.Target:
    """Compute the moments of a shadow map, blurred by a box.

    Parameters
    ----------
    map : depths, see `passgraph.effects.shadows.shadow_map.shadow_map`
    of : kind of moments
    by : see `MomentView.filter_frame`
    blurred : False if the width is known to be 0
    map_size : texels along each side
    name : name of the light

    Returns
    -------
    rg32f, rgba32f, or with ``Msm(format="rgba16")`` the result of
    `passgraph.effects.shadows.shadow_moments.packed_moments`.
    """
    two = isinstance(filter_, Vsm)
    kernel = variance_map if two else exponential_map if isinstance(filter_, Evsm4) else moment_map
    store = "rg32f" if two else "rgba32f"
    moments = kernel(map, by, into=pg.target(f"moments of {name}", store))
    if blurred:
        boxes = box_kernels(max(int(WIDEST * map_size), 1), 2 if two else 4)
        for axis, step in (("x", (1, 0)), ("y", (0, 1))):
            said = f"moments of {name} blurred {axis}"
            blocks = boxes.block(moments, by, *step, into=pg.target(f"{said}, blocks", store))
            moments = boxes.box(blocks, moments, by, *step, into=pg.target(said, store))
    if isinstance(filter_, Msm) and filter_.format == "rgba16":
        moments = pack(moments, into=pg.target(f"packed moments of {name}", "rgba16"))
    return moments
