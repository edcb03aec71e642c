"""Normals of the surfaces in a depth picture, if there is no other source of normals."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph.effects.surfaces.geometry import (
    ViewFrame,
    across_plane,
    flat_place,
    linear_on_planes,
    pack_normal,
    pixel_step,
)
from passgraph.effects.surfaces.views import View
from passgraph.language import Image, output_size, uv, vec2, vec4

#: Deviation of a neighbor without a surface: it fits no plane.
NO_SURFACE = 1e30
#: Pixels along a row, or a column, that are searched in the next one where a surface is one pixel wide.
FARTHEST_PX = 3
#: Largest deviation of a pixel from a line that it is on, relative to `linear_on_planes`.
ROUNDING = 4e-6


@pg.function
def rise(frame: ViewFrame, here: float, there: float) -> float:
    """Return the increase of `linear_on_planes` from one depth to another, without cancellation."""
    return (here - there) / (here * there) if frame.perspective else there - here


@pg.function
def line_through(frame: ViewFrame, here: float, next: float, after: float) -> vec2:
    """Return the slope from here to the next pixel, and the deviation at this pixel of the line through the next two.

    Without a surface behind the next pixel, the line is level there.
    """
    slope = rise(frame, here, next) if next > 0.0 else 0.0
    bend = rise(frame, next, after) - slope if after > 0.0 else slope
    return vec2(slope, abs(bend) if next > 0.0 else NO_SURFACE)


@pg.function
def slope_of(ahead: vec2, behind: vec2, rounding: float) -> float:
    """Return the slope of the line that this pixel is on; without any, the surface faces the eye.

    On a plane it is on both lines, and rounding decides nothing.
    """
    return ahead.x if ahead.y <= behind.y + rounding else -behind.x


@pg.kernel
def normals_of_depth(depth: Image, frame: ViewFrame) -> vec4:
    """Compute normals of the surfaces in a depth picture, packed as in the G-buffer.

    Of the neighbors to both sides those count whose line contains this pixel, so that neither an edge nor a crease
    bends the normals next to it: lines are straight in `linear_on_planes`, on every plane.

    Source: Y. Poltavets (Atyuwen), "Accurate Normal Reconstruction from Depth Buffer", 2021. Deviation: the neighbors
    along the two axes are chosen independently.
    """
    far = depth[0, 0].r
    if far <= 0.0:
        return vec4(0.0)
    rounding = ROUNDING * abs(linear_on_planes(frame, far))
    right = slope_of(
        line_through(frame, far, depth[1, 0].r, depth[2, 0].r),
        line_through(frame, far, depth[-1, 0].r, depth[-2, 0].r),
        rounding,
    )
    up = slope_of(
        line_through(frame, far, depth[0, -1].r, depth[0, -2].r),
        line_through(frame, far, depth[0, 1].r, depth[0, 2].r),
        rounding,
    )
    # The tip of a plane may be one pixel wide, where no neighbor tells the slope across: a pixel one row or column away
    # does. With none at all, the surface faces the eye.
    if depth[0, -1].r <= 0.0 and depth[0, 1].r <= 0.0:
        up = NO_SURFACE
        for k in range(1, FARTHEST_PX + 1):
            for corner in range(4):
                dx, dy = k * (1 - 2 * (corner & 1)), (corner & 2) - 1
                there = depth[dx, dy].r
                found = (right * float(dx) - rise(frame, far, there)) * float(dy)
                up = found if there > 0.0 and abs(found) < abs(up) else up
        up = up if up < NO_SURFACE else 0.0
    elif depth[-1, 0].r <= 0.0 and depth[1, 0].r <= 0.0:
        right = NO_SURFACE
        for k in range(1, FARTHEST_PX + 1):
            for corner in range(4):
                dx, dy = (corner & 2) - 1, k * (1 - 2 * (corner & 1))
                there = depth[dx, dy].r
                found = (rise(frame, far, there) + up * float(dy)) * float(dx)
                right = found if there > 0.0 and abs(found) < abs(right) else right
        right = right if right < NO_SURFACE else 0.0
    slope = vec2(right, up) / pixel_step(frame, output_size(), 1.0)
    # packing takes any length
    packed = pack_normal(across_plane(frame, flat_place(frame, uv()), far, slope))
    return vec4(packed, packed)


def depth_normals(depth: pg.Target, camera: pg.Camera | pg.Value, name: str = "normals of depth") -> pg.Target:
    """Return normals, packed as in `passgraph.effects.surfaces.g_buffer.GBuffer`, of a linear depth.

    Parameters
    ----------
    depth : distances along the view axis in scene units, 0 where there is no surface
    camera : the camera of the depth, or its run value
    name : name of the pass and target

    Pixels at the picture's border have no neighbors outside to use.

    Examples
    --------
    >>> import numpy as np
    >>> camera = pg.Value("camera", pg.Camera, default=pg.Camera((0, 0, 0), (0, 0, -1)))
    >>> with pg.compile(depth_normals(pg.Input("depth"), camera), backend="reference", size=(3, 3)) as program:
    ...     toward_eye = program(depth=np.full((3, 3, 1), 2.0))["normals of depth"]
    >>> bool((toward_eye == 0.0).all())  # (0, 0, 1), packed
    True
    """
    into = pg.target(name, "rgba16f", like=depth)
    normals: pg.Target = normals_of_depth(depth.border("zero"), View(camera).frame(), into=into, name=name)
    return normals
