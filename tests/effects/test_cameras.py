"""Effects on scenes under cameras that are not centred perspectives: orthographic, off-centre, without a far plane."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import tan

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import ambient_occlusion, contact, five_pass, planar, soft_shadow
from passgraph.effects.shadows.shadow_choice import Blur, Msm, Pcss
from tests.agreement import assert_within_bounds
from tests.effects.scenes import Picture, cube, floor, render, sun

SIZE = (120, 80)
NEAR = pg.Camera((3, 3, 5), (0, 0.3, 0), vertical_fov_rad=0.5, near=0.5, far=40.0)
LAMP = pg.Light.spot((-2.0, 4.0, 1.5), (2.0, -4.0, -1.5), intensity=20.0, radius=0.2, cone_outer_rad=0.6)
CHECKS = pg.Texture.make(np.kron(np.eye(2), np.full((8, 8), 255)).astype(np.uint8))

EFFECTS: dict[str, Callable[[pg.Scene], pg.Target]] = {
    "penumbra": lambda scene: soft_shadow(scene, map_size=512),
    "blur": lambda scene: soft_shadow(scene, filter=Blur(), softness=0.1, map_size=512),
    "pcss": lambda scene: soft_shadow(scene, filter=Pcss(), map_size=512),
    "msm": lambda scene: soft_shadow(scene, filter=Msm(), map_size=512),
    "five pass": lambda scene: five_pass(scene.with_(lights=(LAMP,))),
    "gtao": lambda scene: ambient_occlusion(scene, radius=0.6, slices=4, steps=8),
    "ssao": lambda scene: ambient_occlusion(scene, radius=0.6, method="ssao", taps=32),
    "half": lambda scene: ambient_occlusion(scene, radius=0.6, half_resolution=True),
    "contact": lambda scene: contact(scene),
    "planar": lambda scene: planar(scene, fog="none"),
    "fog": lambda scene: planar(scene, fog="linear", fog_start=3.0, fog_end=12.0),
}


def scene(camera: pg.Camera = NEAR) -> pg.Scene:
    ground = replace(floor(), material=pg.Material("checks", (1, 1, 1, 1), CHECKS))
    return pg.Scene((ground, cube((0, 0, 0))), camera, (sun(50.0, 30.0, radius=0.1),))


def shown(of: str, camera: pg.Camera, size: tuple[int, int] = SIZE) -> Picture:
    target = EFFECTS[of](scene())
    return render(target, size=size, backend="numpy", camera=camera)[target.name][..., :3]


def mean_apart(one: Picture, other: Picture) -> float:
    return float(abs(one - other).mean())


# fog counts from the eye, which stands elsewhere
@pytest.mark.sampled
@pytest.mark.parametrize("of", sorted({*EFFECTS} - {"fog"}))
def test_parallel_rays_see_what_a_far_eye_sees(of: str) -> None:
    """From three hundred times as far away, under an angle that keeps the picture as large."""
    height, times = 3.2, 300.0
    parallel = replace(NEAR, orthographic_height=height)
    away = -NEAR.forward * times
    eye = tuple((np.asarray(NEAR.target) + away).tolist())
    far = pg.Camera(eye, NEAR.target, vertical_fov_rad=2.0 * np.arctan(0.5 * height / times), near=280.0, far=320.0)
    one, other = shown(of, parallel), shown(of, far)
    assert other.std() > 0.05
    assert mean_apart(one, other) < 0.006
    assert (abs(one - other).max(axis=2) > 0.1).mean() < 0.02


@pytest.mark.sampled
@pytest.mark.parametrize("of", EFFECTS)
def test_an_off_centre_picture_is_a_part_of_a_wide_one(of: str) -> None:
    half = tan(0.5 * NEAR.vertical_fov_rad)
    part = pg.Camera.from_matrices(
        NEAR.view_matrix(),
        pg.scene.matrices.perspective(half * 0.75, half * 0.5, 0.5, 40.0, (-half * 0.75, half * 0.5)),
    )
    whole = shown(of, NEAR, (2 * SIZE[0], 2 * SIZE[1]))[: SIZE[1], : SIZE[0]]
    made = shown(of, part)
    # what lies beyond the part's border is unknown to searches and blurs on the screen
    inner = slice(16, -16), slice(16, -16)
    assert whole[inner].std() > 0.05
    assert mean_apart(made[inner], whole[inner]) < 0.004
    assert (abs(made - whole).max(axis=2)[inner] > 0.1).mean() < 0.01


@pytest.mark.sampled
@pytest.mark.parametrize("of", EFFECTS)
def test_no_far_plane_is_needed(of: str) -> None:
    endless = shown(of, replace(NEAR, far=np.inf))
    assert np.isfinite(endless).all()
    assert (abs(endless - shown(of, NEAR)).max(axis=2) > 0.02).mean() < 0.002


@pytest.mark.parametrize(
    "effect",
    [
        lambda scene: soft_shadow(scene, filter=Blur(radius_px=2), softness=0.1, map_size=32),
        pytest.param(
            lambda scene: ambient_occlusion(scene, radius=0.6, slices=1, steps=2, half_resolution=True),
            marks=pytest.mark.slow,
        ),
    ],
    ids=["blur", "gtao"],
)
@pytest.mark.slow
def test_devices_agree_under_parallel_rays(effect: Callable[[pg.Scene], pg.Target]) -> None:
    bare = pg.Scene((floor(), cube()), replace(NEAR, orthographic_height=3.2), (sun(50.0, 30.0),))
    assert_within_bounds(effect(bare), (9, 6))
