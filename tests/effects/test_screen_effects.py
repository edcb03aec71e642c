"""What every effect on an engine's picture and depth keeps to, in unkind pictures too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import contact_shadow, fog, occluded, shadowed, ssgi, ssr
from passgraph.effects.surfaces.engine_depth import distances
from tests.effects.engine import EngineView
from tests.effects.scenes import Picture, cube, floor, render, sun

CAMERA = pg.Camera((2.4, 1.6, 3.2), (0.3, 0.3, 0), vertical_fov_rad=0.7, near=0.1, far=50.0)
PARALLEL = replace(CAMERA, orthographic_height=2.0)
SCENE = pg.Scene((floor(3.0), cube((0, 0.0, 0), 0.8)), CAMERA, (sun(50.0, 20.0, radius=0.1),))
EFFECTS: dict[str, Callable[[pg.Target, pg.Target, Any], pg.Target]] = {
    "occluded": lambda color, depth, camera: occluded(color, depth, camera=camera),
    "half": lambda color, depth, camera: occluded(color, depth, camera=camera, half_resolution=True),
    "ssao": lambda color, depth, camera: occluded(color, depth, camera=camera, method="ssao"),
    "contact shadow": lambda color, depth, camera: contact_shadow(color, depth, camera=camera),
    "fog": lambda color, depth, camera: fog(color, depth, camera=camera, falloff=0.3),
    "ssgi": lambda color, depth, camera: ssgi(color, depth, camera=camera),
    "ssr": lambda color, depth, camera: ssr(color, depth, camera=camera, reflectance=0.6),
    "shadowed": lambda color, depth, camera: shadowed(color, depth, SCENE, camera=camera, map_size=128),
}  # fmt: skip
every_effect = pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))


def frame_of(size: tuple[int, int]) -> Picture:
    return np.random.default_rng(4).random((size[1], size[0], 4), np.float32)


def applied(effect: Callable[..., pg.Target], view: EngineView) -> Picture:
    frame = frame_of((view.depth.shape[1], view.depth.shape[0]))
    return view.run(effect(pg.Input("frame"), view.distance(), view.camera), frame)


@pytest.mark.sampled
@every_effect
def test_it_changes_surfaces_and_neither_sky_nor_alpha(effect: Callable[..., pg.Target]) -> None:
    view = EngineView.of(SCENE, (61, 43))
    made, frame = applied(effect, view), frame_of((61, 43))
    assert 0 < (~view.shown).sum() < view.shown.sum()
    assert np.array_equal(made[~view.shown], frame[~view.shown])
    assert np.array_equal(made[..., 3], frame[..., 3])
    assert (abs(made - frame)[view.shown] > 0.05).any()


@pytest.mark.sampled
@every_effect
@pytest.mark.parametrize("far", [50.0, np.inf])
def test_how_the_buffer_holds_distances_does_not_matter(effect: Callable[..., pg.Target], far: float) -> None:
    scene = SCENE.with_(camera=replace(CAMERA, far=far))
    plain, reversed_z = (applied(effect, EngineView.of(scene, (61, 43), reversed_z=way)) for way in (False, True))
    # float32 holds 1 - 1e-3 to 6e-8 of it, and 1e-3 to 6e-11
    assert abs(plain - reversed_z).mean() < 1e-3
    assert (abs(plain - reversed_z).max(axis=2) > 0.02).mean() < 0.01


@every_effect
def test_16_bits_show_nearly_the_same(effect: Callable[..., pg.Target]) -> None:
    scene = SCENE.with_(camera=replace(CAMERA, near=0.5, far=20.0))
    fine, coarse = (applied(effect, EngineView.of(scene, (61, 43), bits=bits)) for bits in (32, 16))
    assert abs(fine - coarse).mean() < 5e-3


@pytest.mark.sampled
@every_effect
@pytest.mark.parametrize(
    ("size", "camera"), [((1, 1), CAMERA), ((1, 7), PARALLEL), ((5, 1), CAMERA), ((3, 2), PARALLEL)]
)
def test_pictures_of_a_few_pixels_are_finite(
    effect: Callable[..., pg.Target], size: tuple[int, int], camera: pg.Camera
) -> None:
    made = applied(effect, EngineView.of(SCENE.with_(camera=camera), size))
    assert np.isfinite(made).all()
    assert made.min() >= 0.0


@pytest.mark.sampled
@every_effect
@pytest.mark.parametrize("camera", [CAMERA, PARALLEL], ids=["perspective", "parallel"])
def test_a_depth_of_noise_makes_no_nan(effect: Callable[..., pg.Target], camera: pg.Camera) -> None:
    """From the near plane to the far one, with holes, and with what is no number."""
    size, holds = (37, 23), camera.hardware_depth(reversed_z=True)
    depth = np.random.default_rng(2).random((size[1], size[0])).astype(np.float32) ** 8
    depth[::5, ::3] = 0.0
    depth[1::7, ::4] = np.nan
    depth[::6, 1::5] = 1.0
    made = effect(pg.Input("frame"), distances(pg.Input("depth"), holds), camera)
    with pg.compile(made, backend="numpy", non_finite="keep") as program:
        shown = program(frame=frame_of(size), depth=depth)[made.name]
        assert np.isfinite(shown).all()
        assert shown.min() >= 0.0


def test_they_stand_in_one_graph() -> None:
    """Each takes the picture of the one before, and one of them comes twice."""
    view = EngineView.of(SCENE, (31, 21))
    color, depth = pg.Input("frame"), view.distance()
    made = contact_shadow(occluded(color, depth, camera=CAMERA), depth, camera=CAMERA)
    made = fog(shadowed(made, depth, SCENE, map_size=64), depth, camera=CAMERA)
    made = occluded(made, depth, camera=CAMERA, half_resolution=True, name="again")
    assert 0.0 < view.run(made)[view.shown].mean() < 1.0


@pytest.mark.sampled
@every_effect
def test_a_run_may_bring_another_camera(effect: Callable[..., pg.Target]) -> None:
    other = replace(CAMERA, eye=(1.0, 2.0, 3.5))
    view = EngineView.of(SCENE.with_(camera=other), (31, 21))
    given = {"frame": frame_of((31, 21)), "depth": view.depth}
    expected = effect(pg.Input("frame"), view.distance(), other)
    made = effect(pg.Input("frame"), view.distance(), pg.Value("camera", pg.Camera))
    shown = render(made, size=None, backend="numpy", camera=other, **given)[made.name]
    assert np.array_equal(shown, render(expected, size=None, backend="numpy", **given)[expected.name])
