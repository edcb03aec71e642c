"""Light that reaches each pixel, with and without shadows: one pointwise kernel per light; they fuse."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal

import passgraph as pg
from passgraph.effects.shadows.shadow_choice import DecidedFilter
from passgraph.effects.shadows.shadow_filters import FilterFrame
from passgraph.effects.shadows.shadow_lookup import lookup
from passgraph.effects.surfaces.geometry import ViewFrame, facing, spread, unpack_normal, view_position
from passgraph.effects.surfaces.views import LightFrame
from passgraph.language import Const, Image, dot, length, smoothstep, uv, vec3, vec4

KINDS: tuple[Literal["directional", "point", "spot"], ...] = ("directional", "point", "spot")
#: Vertices are rounded to 1/256 pixel on the screen too, which moves a position by as much.
SCREEN_ROUNDING = 1.0 / 256.0
#: Irradiance of the ambient light from below, relative to that from above.
GROUND_SHARE = 0.6


@pg.function
def light_at(light: LightFrame, position: vec3, normal: vec3, kind: int) -> vec4:
    """Return diffuse light (rgb) without shadows, scene-linear, on a white surface; alpha is unused."""
    if kind == 0:
        return vec4(light.color * facing(normal, light.place), 1.0)
    offset = light.place - position
    far = max(length(offset), 1e-6)
    toward = offset / far
    strength = facing(normal, toward) / (far * far)
    if kind == 2:
        strength = strength * smoothstep(light.cone.x, light.cone.y, -dot(toward, light.axis))
    return vec4(light.color * strength, 1.0)


@pg.function
def on_face(direction: vec3, face: int) -> bool:
    """Return True if a world direction belongs to this face of a cube map (+x, -x, +y, -y, +z, -z), and no other."""
    x, y, z = abs(direction.x), abs(direction.y), abs(direction.z)
    mine = 4 if direction.z > 0.0 else 5
    if y >= x and y >= z:
        mine = 2 if direction.y > 0.0 else 3
    if x >= y and x >= z:
        mine = 0 if direction.x > 0.0 else 1
    return mine == face


@pg.kernel
def ambient_light(normals: Image, ambient: vec3, up: vec3) -> tuple[vec3, vec3]:
    """Return ambient light twice: without shadows, and with them."""
    share = 0.5 + 0.5 * dot(unpack_normal(normals[0, 0].xy), up)
    light = ambient * (GROUND_SHARE + (1.0 - GROUND_SHARE) * share)
    return light, light


@pg.kernel
def add_light(
    free: Image,
    shadowed: Image,
    normals: Image,
    depth: Image,
    light: LightFrame,
    frame: ViewFrame,
    kind: Const[int],
) -> tuple[vec3, vec3]:
    """Add one light without shadows to both sums."""
    position = view_position(frame, uv(), depth[0, 0].r)
    more = light_at(light, position, unpack_normal(normals[0, 0].xy), kind).rgb
    return free[0, 0].rgb + more, shadowed[0, 0].rgb + more


@lru_cache(maxsize=64)
def add_shadowed_light(filter_: DecidedFilter) -> Any:
    """Return a kernel that adds one light with its shadow map (or one face of its cube map) to both sums."""
    share_lit = lookup(filter_)

    @pg.kernel
    def add_shadowed(
        free: Image, shadowed: Image, normals: Image, depth: Image, map: Image, nearest: Image,
        light: LightFrame, frame: ViewFrame, by: FilterFrame, kind: Const[int], face: Const[int],
    ) -> tuple[vec3, vec3]:  # fmt: skip
        far = depth[0, 0].r
        position = view_position(frame, uv(), far)
        packed = normals[0, 0]
        more = light_at(light, position, unpack_normal(packed.xy), kind).rgb
        if face >= 0 and not on_face(light.world * (position - light.place), face):
            more = vec3(0.0)
        lift = spread(frame, far) * frame.half_height * SCREEN_ROUNDING / float(depth.size.y)
        share = share_lit(map, nearest, light, position, unpack_normal(packed.zw), lift, by, kind, face)
        return free[0, 0].rgb + more, shadowed[0, 0].rgb + more * share

    return add_shadowed


@pg.function
def share_of(shadowed: float, free: float) -> float:
    """Return the remaining fraction; 1 where there is no light to remove."""
    return shadowed / free if free > 1e-12 else 1.0


@pg.function
def is_lit(base: vec4) -> bool:
    """Return False for the base color of an unlit surface (`passgraph.effects.surfaces.g_buffer.UNLIT`)."""
    return base.a > -0.5


@pg.struct
class Parts:
    """A pixel of RTT1 and RTT2."""

    lit: vec3
    share: vec4


@pg.function
def parts(free: Image, shadowed: Image, color: Image, depth: Image) -> Parts:
    """Return the textured scene without shadows, and white objects with shadows only."""
    base = color[0, 0]
    light = free[0, 0].rgb
    dim = shadowed[0, 0].rgb
    share = vec3(share_of(dim.r, light.r), share_of(dim.g, light.g), share_of(dim.b, light.b))
    here = depth[0, 0].r > 0.0
    lit = base.rgb * light if here and is_lit(base) else base.rgb
    return Parts(lit, vec4(share if here and base.a > 0.5 else vec3(1.0), 1.0))


@pg.kernel
def split(free: Image, shadowed: Image, color: Image, depth: Image, background_alpha: float) -> tuple[vec4, vec4]:
    """Write RTT1, the textured scene without shadows, and RTT2, white objects with shadows only."""
    lighting = parts(free, shadowed, color, depth)
    return vec4(lighting.lit, 1.0 if depth[0, 0].r > 0.0 else background_alpha), lighting.share


@pg.kernel
def split_rgb(free: Image, shadowed: Image, color: Image, depth: Image) -> tuple[vec3, vec4]:
    """`split` for 96-bit targets."""
    lighting = parts(free, shadowed, color, depth)
    return lighting.lit, lighting.share


@pg.kernel
def lit(free: Image, color: Image, depth: Image, background_alpha: float) -> vec4:
    """Write the textured scene if nothing casts a shadow."""
    base = color[0, 0]
    light = free[0, 0].rgb if is_lit(base) else vec3(1.0)
    return vec4(base.rgb * light, 1.0) if depth[0, 0].r > 0.0 else vec4(base.rgb, background_alpha)


@pg.kernel
def lit_rgb(free: Image, color: Image, depth: Image) -> vec3:
    """`lit` for 96-bit targets."""
    base = color[0, 0]
    return base.rgb * free[0, 0].rgb if depth[0, 0].r > 0.0 and is_lit(base) else base.rgb


@pg.kernel
def multiply(unshadowed: Image, shadows: Image) -> vec4:
    """Compute RTT4 = RTT1 × RTT3."""
    lit = unshadowed[0, 0]
    return vec4(lit.rgb * shadows[0, 0].rgb, lit.a)


@pg.kernel
def multiply_rgb(unshadowed: Image, shadows: Image) -> vec3:
    """`multiply` for 96-bit targets."""
    return unshadowed[0, 0].rgb * shadows[0, 0].rgb
