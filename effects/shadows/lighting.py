"""The lights of a scene: shadow maps, and light with and without shadows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import passgraph as pg
from passgraph.effects.filters.blur import gaussian_blur
from passgraph.effects.quantities import mapped
from passgraph.effects.shadows.moment_maps import MomentView, blurred_moments
from passgraph.effects.shadows.nearest_casters import nearest_casters
from passgraph.effects.shadows.penumbra_search import add_light_with_penumbrae, find_penumbrae
from passgraph.effects.shadows.shadow_choice import (
    Blur,
    DecidedFilter,
    Disc,
    MomentFilter,
    Pcf,
    Penumbra,
    SearchingFilter,
)
from passgraph.effects.shadows.shadow_filters import FilterFrame
from passgraph.effects.shadows.shadow_light import KINDS, add_light, add_shadowed_light, ambient_light
from passgraph.effects.shadows.shadow_map import CasterMesh, caster_meshes, shadow_map
from passgraph.effects.surfaces.g_buffer import GBuffer
from passgraph.effects.surfaces.map_fit import MARGIN_TEXELS, Fit, pieces_of
from passgraph.effects.surfaces.views import Casters, MapView, View


@dataclass
class Lighting:
    """Adds one light after another to both sums."""

    scene: pg.Scene
    view: View
    seen: GBuffer
    lights: Sequence[pg.Value]
    casters: Casters
    map_size: int
    map_blur_px: int
    notes: list[str]
    filter: DecidedFilter
    to_view: bool  # True if maps are fitted to the camera's view
    width: object  # half the width of edges in scene units: a number, a value, or None for 0

    def __post_init__(self) -> None:
        self.maps: list[pg.Target] = []
        self._fit = self._fitted() if self.to_view else None

    def sums(self, ambient: tuple[float, float, float]) -> tuple[pg.Target, pg.Target]:
        """Return the light on white surfaces without and with shadows."""
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
                look = self._view(value, face)
                frame, seen_by = look.frame(self.view, self.map_size), self.view.frame()
                if needed:
                    map_, by = self._map(look, meshes, name)
                    # filters without a search drop the code that reads it
                    nearest = (
                        nearest_casters(map_, self.map_size, name) if isinstance(self.filter, SearchingFilter) else map_
                    )
                    if isinstance(self.filter, Penumbra):
                        free, shadowed = self._with_penumbrae(
                            self.filter, (free, shadowed), map_, nearest, frame, (kind, face), name
                        )
                        continue
                    free, shadowed = add_shadowed_light(self.filter)(
                        free,
                        shadowed,
                        *common,
                        map_,
                        nearest,
                        frame,
                        seen_by,
                        by,
                        kind,
                        face,
                        into=_pair(name),
                        name=name,
                    )
                else:
                    free, shadowed = add_light(
                        free, shadowed, *common, frame, seen_by, kind, into=_pair(name), name=name
                    )
        return free, shadowed

    def _with_penumbrae(
        self, filter: Penumbra, sums: tuple[pg.Target, pg.Target], map_: pg.Target, nearest: pg.Target,
        frame: pg.Derived, which: tuple[int, int], name: str,
    ) -> tuple[pg.Target, pg.Target]:  # fmt: skip
        """Add one light to the free and the shadowed sum; look up soft shadows at half the size.

        ``which``: the kind of the light, and the face of its map.
        """
        common, seen_by, rises = (self.seen.normals, self.seen.depth), self.view.frame(), self.seen.rises
        penumbrae = find_penumbrae(filter.taps)(
            *common, map_, nearest, frame, seen_by, *which,
            into=pg.target(f"penumbrae of {name}", "rg16f", like=self.seen.depth, scale=0.5),
        )  # fmt: skip
        with_light: tuple[pg.Target, pg.Target] = add_light_with_penumbrae(
            *sums, *common, self.seen.depth if rises is None else rises, map_, penumbrae, frame, seen_by,
            *which, rises is not None, into=_pair(name), name=name,
        )  # fmt: skip
        return with_light

    def _view(self, light: pg.Value, face: int) -> MapView:
        if isinstance(self.filter, MomentFilter):
            width = 0.0 if self.width is None else self.width
            return MomentView(light, self.casters, face, None, self.map_size, width)
        return MapView(light, self.casters, face, self._fit)

    def _map(self, look: MapView, meshes: list[CasterMesh], name: str) -> tuple[pg.Target, object]:
        """Return the inputs of a lookup: the map of one light, and the run values of the filter."""
        map_ = shadow_map(look, meshes, self.map_size, f"shadow map of {name}")
        self.maps.append(map_)
        # it does not soften shadows (see soft_shadow); without a radius it is the map itself
        map_ = gaussian_blur(map_, self.map_blur_px / 2.0, self.map_blur_px, name=f"blurred map of {name}")
        if isinstance(look, MomentView) and isinstance(self.filter, MomentFilter):
            by = look.filter_frame(self.filter)
            return blurred_moments(map_, self.filter, by, self.width is not None, self.map_size, name), by
        width = 0.0 if self.width is None or not isinstance(self.filter, Disc) else self.width
        return map_, mapped(width, lambda number: only_width(float(number)))

    def _fitted(self) -> Fit | None:
        """Return the region that maps are fitted to; None if a run value sets a width that may exceed any fit."""
        wide = isinstance(self.filter, Disc) and self.width is not None
        if wide or isinstance(self.filter, MomentFilter) or not self.casters.nodes:
            return None
        receivers = [node for node in self.scene.nodes if node.receives]
        origin = self.casters.origin
        reads = self.filter.size // 2 if isinstance(self.filter, Pcf) else 0
        return Fit(
            self.view.camera, origin, pieces_of(receivers, origin), self.casters.pieces_for, self.map_size,
            square=isinstance(self.filter, Blur), margin_texels=MARGIN_TEXELS + reads,
        )  # fmt: skip

    def _faces(self, light: pg.Light) -> Sequence[int]:
        """Return one map if the light sees all casters in one view, else the six faces of a cube."""
        if light.kind == "point" and light.fitted_frustum(self.casters.bounds_for(light)) is None:
            return range(6)
        return (-1,)


def only_width(width: float) -> FilterFrame:
    """Return the frame of a filter of depths."""
    return FilterFrame(width, 0.0, 0.0, 0.0, 0.0, 0.0, 0)


def _pair(name: str) -> tuple[pg.TargetSpec, pg.TargetSpec]:
    return pg.target(f"{name}, free", "rgb32f"), pg.target(f"{name}, shadowed", "rgb32f")
