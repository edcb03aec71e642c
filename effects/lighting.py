"""All lights of a scene: their shadow maps, and the light that they bring with and without shadows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import passgraph as pg
from passgraph.effects.blur import gaussian_blur
from passgraph.effects.g_buffer import GBuffer
from passgraph.effects.shadow_filters import ShadowFilter
from passgraph.effects.shadow_light import KINDS, add_filtered_light, add_light, add_shadowed_light, ambient_light
from passgraph.effects.shadow_map import caster_meshes, shadow_map
from passgraph.effects.textures import TextureInputs
from passgraph.effects.views import Casters, MapView, View


@dataclass
class Lighting:
    """Adds one light after another to the two sums."""

    scene: pg.Scene
    view: View
    seen: GBuffer
    lights: Sequence[pg.Value]
    textures: TextureInputs
    map_size: int
    map_blur_px: int
    notes: list[str]
    shadow_filter: ShadowFilter = "blur"
    pcf_size: int = 5
    taps: int = 32
    width: object = 0.0

    def __post_init__(self) -> None:
        self.casters = Casters.of(self.scene)
        self.maps: list[pg.Target] = []

    def sums(self, ambient: tuple[float, float, float]) -> tuple[pg.Target, pg.Target]:
        """Light on white surfaces without and with shadows."""
        free, shadowed = ambient_light(
            self.seen.normals, ambient, self.view.up(), into=_pair("ambient"), name="ambient light"
        )
        receives = any(node.receives for node in self.scene.nodes)
        if not self.lights:
            self.notes.append("no shadows: the scene has no light")
        elif not self.casters.nodes:
            self.notes.append("no shadows: nothing in the scene casts one")
        elif not receives:
            self.notes.append("no shadows: nothing in the scene receives one")
        needed = bool(self.casters.nodes) and receives
        meshes = caster_meshes(self.casters) if needed and self.lights else []
        for value in self.lights:
            light = value.default
            assert isinstance(light, pg.Light)
            kind, common = KINDS.index(light.kind), (self.seen.normals, self.seen.depth)
            for face in self._faces(light) if needed else (-1,):
                name = value.name if face < 0 else f"{value.name} face {face}"
                look = MapView(value, self.casters, face)
                frame = look.frame(self.view, self.map_size)
                if not needed:
                    free, shadowed = add_light(
                        free,
                        shadowed,
                        *common,
                        frame,
                        self.view.tan_half(),
                        kind,
                        into=_pair(name),
                        name=name,
                    )
                    continue
                seen = shadow_map(look, meshes, self.textures, self.map_size, f"shadow map of {name}")
                self.maps.append(seen)
                # does not soften shadows (see soft_shadow); without a radius it is the map itself
                seen = gaussian_blur(seen, self.map_blur_px / 2.0, self.map_blur_px, name=f"blurred map of {name}")
                before, after = (free, shadowed, *common, seen, frame, self.view.tan_half()), (kind, face)
                how: dict[str, Any] = {"into": _pair(name), "name": name}
                if self.shadow_filter == "blur":
                    free, shadowed = add_shadowed_light(*before, *after, **how)
                else:
                    add = add_filtered_light(self.shadow_filter, self.pcf_size, self.taps)
                    free, shadowed = add(*before, self.width, *after, **how)
        return free, shadowed

    def _faces(self, light: pg.Light) -> Sequence[int]:
        """One map where the light sees all casters in one view, else the six faces of a cube."""
        if light.kind == "point" and light.fitted_frustum(self.casters.bounds_for(light)) is None:
            return range(6)
        return (-1,)


def _pair(name: str) -> tuple[pg.TargetSpec, pg.TargetSpec]:
    return pg.target(f"{name}, free", "rgb32f"), pg.target(f"{name}, shadowed", "rgb32f")
