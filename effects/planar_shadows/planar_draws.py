"""Draws of `passgraph.effects.planar_shadows.planar`: the plane, the objects or their reflection, the shadows."""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.effects.planar_shadows.planar_kernels import darken, flatten, lit_object, lit_plane, place_lit
from passgraph.effects.planar_shadows.planar_matrices import (
    Float64,
    Ground,
    cone,
    homogeneous,
    lights_from,
    mirror,
    projection,
    sees_top,
    side_of,
)
from passgraph.effects.surfaces.batches import batches, merged
from passgraph.effects.surfaces.textures import TextureInputs
from passgraph.effects.surfaces.views import View, view_from_world
from passgraph.scene.matrices import translation

#: Shadows are pulled toward the eye by their slope and two steps of the depth format.
SHADOW_OFFSET = (-1.0, -2.0)


class Draws:
    """What all steps share: the view, the lights, textures."""

    def __init__(self, scene: pg.Scene, ground: Ground, ambient: float) -> None:
        self.ground = ground
        self.view = View(pg.Value("camera", pg.Camera, default=scene.camera))
        self.lights = [
            pg.Value("light" if len(scene.lights) == 1 else f"light{i}", pg.Light, default=light)
            for i, light in enumerate(scene.lights)
        ]
        self.batches = batches(ground.objects) if ground.objects is not None else []
        self.textures = TextureInputs()
        self.white = pg.Input("white", "rgba8", (1, 1), static=True, default=np.ones((1, 1, 4), np.float32))
        self.side = self.view.camera.map(lambda camera: 1.0 if sees_top(camera, ground.height) else -1.0)
        columns = pg.combine(lights_from, self.view.camera, *self.lights)
        self.light_values: dict[str, object] = {
            "lights": columns.map(itemgetter(0)), "colors": columns.map(itemgetter(1)),
            "axes": columns.map(itemgetter(2)), "ambient": (ambient,) * 3,
        }  # fmt: skip

    def plane(self, into: Any, depth: Any, name: str, face: object, **state: Any) -> Any:
        """The plane's node, whatever side the eye is on."""
        node = self.ground.node
        origin = node.bounds.mean(axis=0)
        mesh = merged([node], origin)
        values = {
            **self._placed(origin, np.eye(4)), **self._map(node.material), **self.light_values,
            "face": face, "side": self.side,
        }  # fmt: skip
        return pg.draw(
            mesh, vertex=place_lit, fragment=lit_plane, into=into, depth=depth, name=name, values=values, **state
        )

    def objects(self, into: Any, name: str, mirrored: bool) -> Any:
        """All objects; mirrored ones inside the stencil, with the other winding, from the eye's side only."""
        for batch in self.batches:
            material, blends = batch.material, batch.material.alpha_mode == "blend"
            matrix = mirror(self.ground.height - float(batch.origin[1])) if mirrored else np.eye(4)
            values = {
                **self._placed(batch.origin, matrix), **self._map(material), **self.light_values,
                "keep": self.side if mirrored else 0.0,
                "cutoff": material.alpha_cutoff if material.alpha_mode == "mask" else -1.0,
            }  # fmt: skip
            into = pg.draw(
                batch.mesh, vertex=place_lit, fragment=lit_object, into=into, depth=into.depth,
                stencil=pg.Stencil("equal", 1) if mirrored else None, blend="alpha" if blends else None,
                depth_write=not blends, color_mask=(True, True, True, False), name=name, values=values,
                cull="none" if material.double_sided else "front" if mirrored else "back",
            )  # fmt: skip
        return into

    def shadows(self, into: Any, darkness: float, lift: float) -> Any:
        """Each light has its own bit of the stencil, which the first triangle on a pixel turns over."""
        objects = self.ground.objects
        casting = [node for node in objects.nodes if node.casts] if objects is not None else []
        # solid ones first: where their shadow lies, a translucent one adds nothing
        for translucent in (False, True):
            nodes = [node for node in casting if (node.material.alpha_mode == "blend") == translucent]
            if nodes:
                into = self._shadows_of(nodes, translucent, into, darkness, lift)
        return into

    def _shadows_of(self, nodes: list[pg.Node], translucent: bool, into: Any, darkness: float, lift: float) -> Any:
        origin = np.mean([node.bounds.mean(axis=0) for node in nodes], axis=0)
        mesh = merged(nodes, origin)
        for number, value in enumerate(self.lights):
            bit = 2 << number
            values = {
                **self._flattened(value, origin, lift), "translucent": translucent,
                "darkness": pg.combine(self._darkness_on(origin, darkness), self.view.camera, value),
                "axis": value.map(lambda light: light.direction), "cone": value.map(cone),
            }  # fmt: skip
            into = pg.draw(
                mesh, vertex=flatten, fragment=darken, into=into, depth=into.depth, depth_write=False,
                stencil=pg.Stencil("equal", 1, read_mask=1 | bit, write_mask=bit, passed="invert"),
                depth_compare="less_equal", polygon_offset=SHADOW_OFFSET if lift > 0.0 else (0.0, 0.0),
                blend="multiply", color_mask=(True, True, True, False),
                name=f"6 {'translucent ' if translucent else ''}shadow of {value.name}", values=values,
            )  # fmt: skip
        return into

    def _flattened(self, value: pg.Value, origin: Float64, lift: float) -> dict[str, object]:
        """Matrices and rows of `flatten` for casters relative to ``origin``."""
        level = self.ground.height - float(origin[1])

        def clip(camera: pg.Camera, light: pg.Light, size: tuple[int, int]) -> Float64:
            toward = 1.0 if sees_top(camera, self.ground.height) else -1.0
            flat = projection(homogeneous(light, origin), level + lift * toward)
            made: Float64 = camera.projection_matrix(size[0] / size[1]) @ view_from_world(camera, origin) @ flat
            return made

        def from_light(light: pg.Light) -> Float64:
            made: Float64 = translation(origin - np.asarray(light.position)) @ projection(
                homogeneous(light, origin), level
            )
            return made

        return {
            "clip_from_local": pg.combine(clip, self.view.camera, value, pg.OUTPUT_SIZE),
            "above_row": value.map(lambda light: np.array([0.0, 1.0, 0.0, -level]) * side_of(light, origin, level)),
            "beyond_row": value.map(lambda light: projection(homogeneous(light, origin), level)[3]),
            "spot_from_local": value.map(from_light),
        }

    def _darkness_on(self, origin: Float64, darkness: float) -> Callable[[pg.Camera, pg.Light], float]:
        """None where the eye sees the face that the light does not reach."""
        height = self.ground.height

        def seen(camera: pg.Camera, light: pg.Light) -> float:
            over = sees_top(camera, height) == (side_of(light, origin, height - float(origin[1])) > 0.0)
            return darkness if over else 0.0

        return seen

    def _placed(self, origin: Float64, matrix: Float64) -> dict[str, object]:
        return {
            "clip_from_local": self.view.clip_from(origin).map(lambda seen: seen @ matrix),
            "eye_from_local": self.view.camera.map(lambda camera: camera.relative(translation(origin))),
            "height_row": (0.0, 1.0, 0.0, float(origin[1]) - self.ground.height),
        }

    def _map(self, material: pg.Material) -> dict[str, object]:
        texture = material.base_color_texture
        found = self.white if texture is None else self.textures.of(texture, "base color")
        return {"base_map": found, "has_map": texture is not None}
