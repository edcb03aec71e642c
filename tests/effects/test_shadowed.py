"""Shadows of meshes on an engine's depth, against rays and against shadows in a scene that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.screen.shadowed import shadowed
from passgraph.effects.shadows.shadow_choice import Blur, Hard, Msm
from passgraph.effects.shadows.soft_shadow import soft_shadow_passes
from passgraph.effects.surfaces.engine_depth import distances
from passgraph.truth import visible_share
from tests.agreement import assert_within_bounds
from tests.effects.engine import EngineView
from tests.effects.scenes import cube, floor, render, sun

SIZE = (160, 100)
CAMERA = pg.Camera((2.4, 2.6, 3.2), (0.3, 0.2, 0), vertical_fov_rad=0.55, near=0.1, far=50.0)
CAMERAS = [CAMERA, replace(CAMERA, orthographic_height=2.4), replace(CAMERA, shift=(0.2, -0.1), far=np.inf)]
SUN = sun(50.0, 20.0, radius=0.1)
LAMP = pg.Light.spot((-1.5, 3.0, 0.6), (1.5, -3.0, -0.6), intensity=9.0, radius=0.2, cone_outer_rad=0.7)


def scene(camera: pg.Camera = CAMERA, light: pg.Light = SUN) -> pg.Scene:
    return pg.Scene((floor(3.0), cube((0, 0.0, 0), 0.8)), camera, (light,))


def casters(whole: pg.Scene) -> pg.Scene:
    """Without what they stand on."""
    return pg.Scene(whole.nodes[1:], whole.camera, whole.lights)


@pytest.mark.sampled
@pytest.mark.parametrize("light", [SUN, LAMP], ids=["sun", "spot"])
@pytest.mark.parametrize("camera", CAMERAS, ids=["perspective", "parallel", "off-centre, endless"])
def test_the_share_of_light_is_what_rays_find(camera: pg.Camera, light: pg.Light) -> None:
    whole = scene(camera, light)
    view = EngineView.of(whole, SIZE, reversed_z=True)
    made = shadowed(pg.Input("frame"), view.distance(), casters(whole), ambient=0.0)
    got = view.run(made)[..., 0]
    truth = visible_share(whole, SIZE, samples=64)
    lit = view.shown & truth.valid
    off = (got - truth.share)[lit]
    assert truth.share[lit].min() == 0.0
    assert np.sqrt((off**2).mean()) < 0.06
    assert abs(off.mean()) < 0.01


@pytest.mark.parametrize("chosen", [None, Blur(), Hard(), Msm()], ids=str)
def test_it_is_the_soft_shadow_of_a_known_scene(chosen: Blur | Hard | Msm | None) -> None:
    """An engine's picture under the same light, times the share, is the scene with its shadows."""
    whole = scene()
    softness = None if chosen is None else 0.05
    known = soft_shadow_passes(whole, filter=chosen, softness=softness, fit="scene", display=False)
    seen = render(known.unshadowed, known.soft_shadow, known.depth, size=SIZE, backend="numpy")
    holds = CAMERA.hardware_depth()
    made = shadowed(
        pg.Input("frame"), distances(pg.Input("depth"), holds), whole, filter=chosen, softness=softness
    )  # fmt: skip
    held = holds.depth(seen["depth"]).astype(np.float32)
    got = render(made, size=None, backend="numpy", frame=seen["unshadowed"], depth=held)["shadowed"]
    apart = abs(got - seen["soft_shadow"])[..., :3]
    assert abs(seen["unshadowed"] - seen["soft_shadow"]).max() > 0.3
    assert apart.mean() < 0.003
    assert (apart.max(axis=2) > 0.1).mean() < 0.01


def test_a_floor_of_casters_shadows_what_lies_below_it() -> None:
    """In a scene that is known a floor under all else shadows nothing, and is left out of maps."""
    plate = pg.Node(floor(0.5).mesh, pg.Material("plate", double_sided=True), np.eye(4), "plate")
    seen = pg.Scene((pg.Node(floor(3.0).mesh, transform=_lowered(0.5)),), CAMERA, ())
    view = EngineView.of(seen, SIZE)
    overhead = sun(90.0)
    made = shadowed(pg.Input("frame"), view.distance(), pg.Scene((plate,), CAMERA, (overhead,)), ambient=0.0)
    assert view.run(made)[..., 0].min() == 0.0


def _lowered(by: float) -> np.ndarray:
    made = np.eye(4)
    made[1, 3] = -by
    return made


def test_devices_agree_on_shadows_of_meshes() -> None:
    whole = scene()
    view = EngineView.of(whole, (12, 8))
    made = shadowed(pg.Input("frame"), pg.Input("depth"), casters(whole), filter=Hard(), map_size=32)
    frame = np.ones((8, 12, 4), np.float32)
    assert_within_bounds(made, frame=frame, depth=view.surfaces.depth[..., None].astype(np.float32))


@pytest.mark.parametrize(
    ("made", "text"),
    [
        (
            pg.Scene((cube(casts=False),), CAMERA, (SUN,)),
            "casters: scene .* has no mesh that casts a shadow; give it one",
        ),
        (pg.Scene((cube(),), CAMERA, ()), "casters: scene .* has no light; give it one"),
    ],
    ids=["no mesh", "no light"],
)
def test_without_casters_or_lights_it_says_so(made: pg.Scene, text: str) -> None:
    with pytest.raises(pg.GraphError, match=text):
        shadowed(pg.Input("frame"), pg.Input("depth"), made)
