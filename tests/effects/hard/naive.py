"""Shadow lookups as they are often written, to be seen failing: small kernels on the targets of `soft_shadow`."""

# mypy: disable-error-code="no-any-return"
from __future__ import annotations

from math import tan
from typing import Any

import numpy as np

import passgraph as pg
from passgraph import Const, Image, dot, floor, ivec2, mat4, uv, vec2, vec3, vec4
from passgraph.effects import soft_shadow_passes
from passgraph.effects.shadows.shadow_filters import vogel_disc
from passgraph.effects.surfaces.views import Casters
from passgraph.scene.matrices import translation
from tests.effects.hard.case import SIZE, Picture
from tests.effects.scenes import render

TAPS = vogel_disc(32)


@pg.function
def view_ray(tan_half: vec2) -> vec3:
    """From the eye through this pixel, at distance 1 along the view axis."""
    return vec3((2.0 * uv().x - 1.0) * tan_half.x, (1.0 - 2.0 * uv().y) * tan_half.y, -1.0)


@pg.function
def in_map(position: vec3, map_from_view: mat4, depth_row: vec4, size: vec2) -> vec3:
    """Place in texels, and linear depth; with no look at the sign of w."""
    clip = map_from_view * vec4(position, 1.0)
    return vec3(
        (0.5 + 0.5 * clip.x / clip.w) * size.x,
        (0.5 - 0.5 * clip.y / clip.w) * size.y,
        dot(depth_row, vec4(position, 1.0)),
    )


@pg.function
def passes_at(map: Image, place: vec2, limit: float) -> float:
    """1 where the map shows nothing before the limit, and beyond its border."""
    size = vec2(map.size)
    outside = place.x < 0.0 or place.y < 0.0 or place.x >= size.x or place.y >= size.y
    return 1.0 if outside or map.texel(ivec2(floor(place))).r >= limit else 0.0


@pg.kernel
def constant_bias(
    depth: Image, normals: Image, map: Image, map_from_view: mat4, depth_row: vec4, tan_half: vec2,
    bias: float, half: Const[int],
) -> float:  # fmt: skip
    """A square of comparisons, all with the same bias."""
    here = in_map(view_ray(tan_half) * depth[0, 0].r, map_from_view, depth_row, vec2(map.size))
    lit = 0.0
    for y in range(-half, half + 1):
        for x in range(-half, half + 1):
            lit += passes_at(map, here.xy + vec2(x, y), here.z - bias)
    return lit / float((2 * half + 1) * (2 * half + 1)) if depth[0, 0].r > 0.0 else 1.0


@pg.kernel
def divided_depth(
    depth: Image, normals: Image, map: Image, map_from_view: mat4, depth_row: vec4, tan_half: vec2,
    scale: float, shift: float, bias: float,
) -> float:  # fmt: skip
    """One comparison of z / w, whatever the sign of w; ``scale`` and ``shift`` are the projection's for z."""
    clip = map_from_view * vec4(view_ray(tan_half) * depth[0, 0].r, 1.0)
    size = vec2(map.size)
    place = vec2(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w) * size
    outside = place.x < 0.0 or place.y < 0.0 or place.x >= size.x or place.y >= size.y
    stored = min(map.texel(ivec2(floor(place))).r, 1e6)
    lit = outside or shift / stored - scale >= clip.z / clip.w - bias
    return 1.0 if lit or depth[0, 0].r <= 0.0 else 0.0


@pg.kernel
def plane_by_differences(
    depth: Image, normals: Image, map: Image, map_from_view: mat4, depth_row: vec4, tan_half: vec2,
    bias: float, half: Const[int],
) -> float:  # fmt: skip
    """Receiver plane depth bias from the pixels beside, unclamped.

    Source: J. Isidoro, "Shadow Mapping: GPU-based Tips and Techniques", GDC 2006.
    """
    size = vec2(map.size)
    pixel = 2.0 * tan_half / vec2(depth.size)
    ray = view_ray(tan_half)
    here = in_map(ray * depth[0, 0].r, map_from_view, depth_row, size)
    right = in_map((ray + vec3(pixel.x, 0.0, 0.0)) * depth[1, 0].r, map_from_view, depth_row, size) - here
    below = in_map((ray - vec3(0.0, pixel.y, 0.0)) * depth[0, 1].r, map_from_view, depth_row, size) - here
    det = right.x * below.y - right.y * below.x
    slope = vec2(below.y * right.z - right.y * below.z, right.x * below.z - below.x * right.z) / det
    lit = 0.0
    for y in range(-half, half + 1):
        for x in range(-half, half + 1):
            away = floor(here.xy + vec2(x, y)) + 0.5 - here.xy
            lit += passes_at(map, here.xy + vec2(x, y), here.z + dot(slope, away) - bias)
    return lit / float((2 * half + 1) * (2 * half + 1)) if depth[0, 0].r > 0.0 else 1.0


@pg.kernel
def closer_soft(
    depth: Image, normals: Image, map: Image, map_from_view: mat4, depth_row: vec4, tan_half: vec2,
    bias: float, radius: float, texel: float, lowest: float, search: float, spared: Const[bool],
) -> float:  # fmt: skip
    """PCSS for a directional light, with casters' depths clamped to no less than ``lowest``.

    ``spared`` is the early out where the search finds no caster; without it their mean depth is 0 of 0, kept from
    being NaN by a divisor of at least 1.
    Source: R. Fernando, "Percentage-Closer Soft Shadows", 2005.
    """
    here = in_map(view_ray(tan_half) * depth[0, 0].r, map_from_view, depth_row, vec2(map.size))
    total = 0.0
    count = 0.0
    for i in range(len(TAPS)):
        at = here.xy + TAPS[i] * (search / texel)
        if passes_at(map, at, here.z - bias) == 0.0:
            total += max(map.texel(ivec2(floor(at))).r, lowest)
            count += 1.0
    reach = radius * (here.z - total / max(count, 1.0)) / texel
    lit = 0.0
    for i in range(len(TAPS)):
        lit += passes_at(map, here.xy + TAPS[i] * reach, here.z - bias)
    share = lit / float(len(TAPS))
    if spared and count == 0.0:
        share = 1.0
    return share if depth[0, 0].r > 0.0 else 1.0


def frame(scene: pg.Scene, size: tuple[int, int] = SIZE, map_size: int = 256) -> dict[str, Any]:
    """What the kernels need to know of the first light: its matrices from the camera's frame, and its texel."""
    camera, light = scene.camera, scene.lights[0]
    view, projection = light.frustum(Casters.in_scene(scene).bounds_for(light))
    light_from_view = view @ translation(camera.eye) @ camera.view_rotation().T
    half = tan(0.5 * camera.vertical_fov_rad)
    return {
        "map_from_view": projection @ light_from_view,
        "depth_row": -light_from_view[2],
        "tan_half": (half * size[0] / size[1], half),
        "texel": 2.0 / (float(projection[0, 0]) * map_size),
    }


def naive(
    kernel: Any, scene: pg.Scene, backend: str, size: tuple[int, int] = SIZE, map_size: int = 256, **values: Any
) -> Picture:
    """Run one of the kernels above on the shadow map and the surfaces of `soft_shadow`, (h, w)."""
    passes = soft_shadow_passes(scene, ambient=0.0, map_size=map_size, softness=0.0, fit="scene")
    known = frame(scene, size, map_size)
    if kernel is not closer_soft:
        del known["texel"]
    made = kernel(
        passes.depth, passes.normals, passes.shadow_maps[0], **known, **values,
        into=pg.target("naive", "r32f", scale=1.0), name="naive",
    )  # fmt: skip
    return render(made, size=size, backend=backend)["naive"][:, :, 0]


def sure(share: Picture, reach: int) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Pixels farther than ``reach`` from any edge of a hard shadow."""
    from scipy.ndimage import maximum_filter, minimum_filter

    side = 2 * reach + 1
    return np.asarray(minimum_filter(share, side) == maximum_filter(share, side))
