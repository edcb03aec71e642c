"""Where two lit surfaces meet in a hollow edge, neither throws a shadow: rays leave both toward the light."""

from __future__ import annotations

from math import cos, radians, sin
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import soft_shadow_passes
from passgraph.effects.shadows.shadow_choice import SHADOW_FILTERS
from passgraph.scene.matrices import rotation_y, translation
from passgraph.scene.shipped_scene import box
from tests.effects.scenes import floor, render


def before_a_wall(degrees: float, turn: float) -> pg.Scene:
    """A wall on a floor, turned against the texels of the map; the light shines on both."""
    turned, angle = rotation_y(turn), radians(degrees)
    wall = pg.Node(box(1.0), transform=turned @ translation((0, 0, -1.0)) @ np.diag([6.0, 1.5, 1.0, 1.0]))
    x, y, z = turned[:3, :3] @ (0.0, -cos(angle), -sin(angle))
    camera = pg.Camera(tuple(turned[:3, :3] @ (0.0, 2.5, 3.0)), (0, 0.2, 0), vertical_fov_rad=0.5)
    return pg.Scene((floor(4.0), wall), camera, (pg.Light.directional((x, y, z), radius=0.02),))


# On a map of 64 texels, so that a texel is several pixels wide. Where the light runs nearly along the floor, and for
# "blur", which takes the four texels around, at 60 degrees, texels of the wall lie more than one before the floor.
@pytest.mark.parametrize(("shadow_filter", "degrees"), [("hard", 82), ("pcss", 82), ("penumbra", 82), ("blur", 60)])
def test_a_hollow_edge_in_full_light_is_lit(shadow_filter: str, degrees: float) -> None:
    options: dict[str, Any] = {"filter": SHADOW_FILTERS[shadow_filter]()}
    if shadow_filter == "blur":
        options["softness"] = 0.0
    for turn in (0.0, 0.35, 0.785):
        scene = before_a_wall(degrees, turn)
        passes = soft_shadow_passes(scene, ambient=0.0, map_size=64, fit="scene", **options)
        assert passes.shadows_blurred is not None
        share = render(passes.shadows_blurred, size=(96, 64), backend="numpy")
        assert next(iter(share.values()))[:, :, 0].min() == 1.0, f"turned by {turn}"
