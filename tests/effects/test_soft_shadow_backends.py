"""Every target of the soft shadow, on every device, against the float64 reference."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import soft_shadow_passes
from passgraph.effects.shadow_choice import Blur
from tests.effects.scenes import Picture, cube, floor, render, sun

SIZE = (64, 36)
LIGHTS = {
    "directional": (sun(40, 30, radius=0.1),),
    "spot": (pg.Light.spot((2, 4, 3), (-0.5, -1, -0.8), intensity=22, radius=0.2, cone_outer_rad=0.5),),
    "cube": (pg.Light.point((0.2, 1.2, 1.0), (1, 0.9, 0.7), 1.5, radius=0.1),),
    "two": (sun(40, 30, radius=0.1, color=(1, 0.3, 0.3)), sun(50, 200, radius=0.1, color=(0.3, 0.3, 1))),
}
#: An edge may fall to the other side of a pixel's or of a texel's centre.
SHARE_ON_EDGES = 0.005


def scene(lights: str) -> pg.Scene:
    nodes = (floor(), cube(), cube((-1.2, 0, 1.0), 0.6), cube((1.4, 0, 1.2), 0.4))
    return pg.Scene(nodes, pg.Camera((3, 3, 5), (0, 0.4, 0), vertical_fov_rad=0.7), LIGHTS[lights])


@lru_cache
def pictures(lights: str, backend: str) -> dict[str, Picture]:
    passes = soft_shadow_passes(scene(lights), filter=Blur(), map_size=128)
    assert passes.shadows is not None
    assert passes.shadows_blurred is not None
    targets = (
        passes.depth,
        passes.unshadowed,
        passes.shadows,
        passes.shadows_blurred,
        passes.soft_shadow,
        passes.picture,
    )
    return render(*targets, size=SIZE, backend=backend)


@pytest.mark.parametrize("lights", list(LIGHTS))
def test_every_target_agrees_with_the_reference(lights: str, backend_name: str) -> None:
    expected, got = pictures(lights, "reference"), pictures(lights, backend_name)
    for name, picture in got.items():
        assert np.isfinite(picture).all(), name
        # two steps of the coarsest format on the way: float16 near 1, 8 bits for the picture
        bound = {"depth": 2e-3, "picture": 2 / 255}.get(name, 2.0**-9)
        off = (abs(picture - expected[name]) > bound).any(axis=2).mean()
        assert off <= SHARE_ON_EDGES, f"{name}: {off:.2%} of the pixels differ by more than {bound:g}"
