"""RTT3: blur shadows along surfaces."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from functools import lru_cache
from typing import Any

import passgraph as pg
from passgraph.effects.surfaces.geometry import ViewFrame, flat_place, pixel_step, plane_terms, spread, unpack_normal
from passgraph.language import Const, Image, ceil, clamp, ivec2, output_size, uv, vec4

#: The weight of a tap falls with its distance from the receiver's plane, to 0 at this fraction of the blur's radius.
OFF_PLANE = 0.5
#: Least blur in pixels: RTT2's edges are jagged at the size of a shadow map's texel.
SMALLEST_RADIUS_PX = 1.0
#: Largest spacing of taps in pixels; wider blurs are limited by it.
WIDEST_SPACING_PX = 4.0


@lru_cache(maxsize=32)
def along_surfaces(radius: int) -> Any:
    """Return a kernel with ``radius`` taps to each side, whose width is given in scene units."""

    @pg.kernel
    def blur(
        shadows: Image,
        normals: Image,
        depth: Image,
        softness: float,
        frame: ViewFrame,
        dx: Const[int],
        dy: Const[int],
    ) -> vec4:
        here = pg.pixel()
        far = depth[0, 0].r
        center = shadows[0, 0]
        if far <= 0.0:
            return center
        n = unpack_normal(normals[0, 0].zw)
        pixel = pixel_step(frame, output_size(), 1.0)  # at distance 1
        pixel_width = pixel.y * spread(frame, far)
        wide = softness / pixel_width
        spacing = clamp(ceil(wide / float(radius)), 1.0, WIDEST_SPACING_PX)
        reach = clamp(wide, SMALLEST_RADIUS_PX, spacing * float(radius)) + 1.0
        stride = int(spacing)
        # a spread tap is the mean of two texels, so that none is skipped up to a spacing of 2; beyond it rows and
        # columns start at different phases
        half = stride // 2
        line = here.x * dy + here.y * dx
        phase = (line + line // stride) % stride - half if stride > 2 else 0
        # the tap's height above the receiver's plane
        terms = plane_terms(frame, n, flat_place(frame, uv()))
        slope = n.x * float(dx) * pixel.x - n.y * float(dy) * pixel.y
        plane = terms.x * spread(frame, far) + terms.y * far
        steep = 1.0 / (OFF_PLANE * max(softness, 2.0 * pixel_width))
        total = center * 1e-3
        weight = 1e-3
        for i in range(-radius, radius + 1):
            step = i * stride + phase
            tap = here + ivec2(step * dx, step * dy)
            neighbor = tap + ivec2(half * dx, half * dy)
            t = (float(step) + 0.5 * float(half)) / reach
            window = max(1.0 - t * t, 0.0)
            z = depth.texel(tap).r
            off = (spread(frame, z) * (terms.x + float(step) * slope) + terms.y * z - plane) * steep
            w = window * window * max(1.0 - off * off, 0.0)
            w = w if z > 0.0 else 0.0
            total += (shadows.texel(tap) + shadows.texel(neighbor)) * (0.5 * w)
            weight += w
        return total / weight

    return blur


def blur_along_surfaces(
    shadows: pg.Target,
    normals: pg.Target,
    depth: pg.Target,
    softness: object,
    frame: object,
    radius_px: int,
) -> pg.Target:
    """Blur a shadow picture with a width in scene units, horizontally, then vertically.

    Parameters
    ----------
    shadows : rgb, the picture to blur
    normals, depth : of `passgraph.effects.surfaces.g_buffer.GBuffer`
    softness : half width in scene units: a float, or a run value
    frame : `passgraph.effects.surfaces.geometry.ViewFrame` of the camera
    radius_px : taps to each side, 1 to 31

    A pixel at distance z blurs over softness / (width of a pixel at z) pixels to each side.  A tap's weight is (1 -
    t²)² for its distance t, times 1 - (h / (OFF_PLANE * softness))² for its height h above the plane through the
    receiver.  Depth is compared relative to the surface, so that slanted floors are blurred and silhouettes are not
    crossed.  The center's own small weight keeps the sum above 0.
    """
    blur = along_surfaces(radius_px)
    across = blur(
        shadows,
        normals,
        depth,
        softness,
        frame,
        1,
        0,
        into=pg.target("shadows_blurred_x", "rgba16f"),
        name="shadow blur x",
    )
    return blur(
        across,
        normals,
        depth,
        softness,
        frame,
        0,
        1,
        into=pg.target("shadows_blurred", "rgba16f"),
        name="shadow blur y",
    )
