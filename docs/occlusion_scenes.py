"""Legs before a wall: ambient occlusion on the screen beside the contact effect, for tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.ambient.ambient_occlusion import ambient_occlusion_passes
from passgraph.effects.ambient.contact import contact_passes
from passgraph.scene import Material, Mesh, Node
from passgraph.scene.matrices import translation
from passgraph.scene.shipped_scene import box, cylinder

#: Legs of the table: radius and height in scene units, and where they stand (x, z).
LEG_RADIUS, LEG_HEIGHT = 0.06, 1.0
LEGS = ((-0.7, -0.45), (0.7, -0.45), (-0.7, 0.45), (0.7, 0.45))
#: How far things take light, scene units; the wall is many times farther behind the legs.
RADIUS = 0.4
WALL_Z = -3.0
WHITE = Material("white", (0.8, 0.8, 0.8, 1.0))


def legs_scene(wall_z: float = WALL_Z, top: bool = True) -> pg.Scene:
    """A table on a white floor before a white wall; ``top=False`` leaves its legs."""
    wide = np.array([[-6, 0, 6], [6, 0, 6], [6, 0, -6], [-6, 0, -6.0]])
    upright = np.array([[-6, 0, wall_z], [6, 0, wall_z], [6, 4, wall_z], [-6, 4, wall_z]])
    nodes = [
        Node(Mesh.make(wide, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 1.0, 0.0], (4, 1))), WHITE, name="floor"),
        Node(Mesh.make(upright, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 0.0, 1.0], (4, 1))), WHITE, name="wall"),
    ]
    leg = cylinder(LEG_RADIUS, LEG_HEIGHT)
    nodes += [Node(leg, WHITE, translation((x, 0.0, z)), "leg") for x, z in LEGS]
    if top:
        flat = np.diag([1.7, 0.06, 1.2, 1.0])
        nodes.append(Node(box(1.0), WHITE, translation((0.0, LEG_HEIGHT, 0.0)) @ flat, "top"))
    camera = pg.Camera((0.9, 1.3, 5.0), (0.0, 0.55, 0.0), vertical_fov_rad=0.45, near=0.5, far=40.0)
    light = pg.Light.directional((0.25, -1.0, -0.45), intensity=0.5, radius=0.05)
    return pg.Scene(tuple(nodes), camera, (light,), "legs before a wall")


@dataclass(frozen=True)
class Comparison:
    """(h, w, 3) float32 each: what the four leave of a white surface's light; 1 where they take nothing."""

    ssao_unchecked: NDArray[np.float32]
    ssao: NDArray[np.float32]
    gtao: NDArray[np.float32]
    contact: NDArray[np.float32]

    def side_by_side(self) -> NDArray[np.float32]:
        """Two rows of two: ssao without and with its range check; gtao, contact."""
        above = np.concatenate([self.ssao_unchecked, self.ssao], axis=1)
        below = np.concatenate([self.gtao, self.contact], axis=1)
        return np.concatenate([above, below])


def compared(scene: pg.Scene, size: tuple[int, int], backend: str = "numpy", **values: object) -> Comparison:
    """The same scene under four effects; ``values`` of the run, such as ``camera``."""
    kinds = {
        "ssao_unchecked": {"method": "ssao", "range_check": False, "taps": 32},
        "ssao": {"method": "ssao", "taps": 32},
        "gtao": {"method": "gtao", "steps": 8},
    }
    shown = {}
    for name, options in kinds.items():
        made = ambient_occlusion_passes(scene, radius=RADIUS, **options).occlusion.visibility  # type: ignore[arg-type]
        with pg.compile(made, backend=backend, size=size) as program:
            shown[name] = np.repeat(program(**values)["visibility"][:, :, :1], 3, axis=2)
    share = contact_passes(scene, threshold=RADIUS, darkness=1.0).share
    with pg.compile(share, backend=backend, size=size) as program:
        shown["contact"] = program(**values)[share.name][:, :, :3]
    return Comparison(**shown)
