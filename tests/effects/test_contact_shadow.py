"""Contact shadows against rays toward the light, where the picture shows what is in the way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.screen.contact_shadow import contact_shadow, share_of_ways, toward_light
from passgraph.effects.surfaces.views import View
from passgraph.truth import Tracer
from passgraph.truth.surfaces import casting_triangles
from tests.agreement import assert_within_bounds
from tests.effects.engine import EngineView
from tests.effects.scenes import Float64, cube, floor, render, sun

SIZE = (160, 100)
#: Against the light and from above, so that no way to it passes behind the cube.
CAMERA = pg.Camera((0.2, 2.2, 2.4), (0.1, 0.1, 0.2), vertical_fov_rad=0.5, near=0.1, far=50.0)
SUN = sun(50.0, 90.0)
LAMP = pg.Light.point((0.05, 1.6, -1.5))
REACH = 0.6


def scene(camera: pg.Camera = CAMERA) -> pg.Scene:
    return pg.Scene((floor(3.0), cube((0, 0.0, 0), 0.5)), camera, ())


def free_by_rays(view: EngineView, light: pg.Light, reach: float) -> NDArray[np.bool_]:
    """Whether nothing of the scene is within reach on the way to the light."""
    seen = view.surfaces
    origins = seen.positions[view.shown] + 1e-5 * seen.normals[view.shown]
    offsets = np.tile(-np.asarray(light.direction), (len(origins), 1))
    if light.kind != "directional":
        offsets = np.asarray(light.position) - seen.origin - origins
    far = np.linalg.norm(offsets, axis=1)
    lengths = np.full(len(origins), reach) if light.kind == "directional" else np.minimum(far, reach)
    tracer = Tracer(casting_triangles(scene(), seen.origin).corners)
    made = np.ones(view.depth.shape, np.bool_)
    made[view.shown] = ~tracer.blocked(origins, offsets / far[:, None], lengths)
    return made


def grown(mask: NDArray[np.bool_], by: int = 2) -> NDArray[np.bool_]:
    """What is at most so many pixels from it."""
    made = mask.copy()
    for y in range(-by, by + 1):
        for x in range(-by, by + 1):
            made |= np.roll(mask, (y, x), (0, 1))
    return made


def share(view: EngineView, light: pg.Light, **options: object) -> Float64:
    given = {"reach": REACH, "thickness": 0.5, "steps": 64, "darkness": 1.0, "denoised": False, **options}
    made = contact_shadow(pg.Input("frame"), view.distance(), light=light, camera=view.camera, **given)  # type: ignore[arg-type]
    return view.run(made)[..., 0].astype(np.float64)


@pytest.mark.parametrize("light", [SUN, LAMP], ids=["sun", "lamp"])
@pytest.mark.parametrize(
    "camera",
    [CAMERA, replace(CAMERA, orthographic_height=1.8), replace(CAMERA, shift=(0.2, 0.1))],
    ids=["perspective", "parallel", "off-centre"],
)
def test_a_cube_throws_its_shadow(light: pg.Light, camera: pg.Camera) -> None:
    """On the floor beside it, as rays find it over half the reach, and nowhere else."""
    view = EngineView.of(scene(camera), SIZE)
    on_floor = view.surfaces.node == 0
    near, whole = (~free_by_rays(view, light, reach) for reach in (0.4 * REACH, REACH))
    dark = share(view, light) < 0.9
    assert (near & on_floor).sum() > 100
    assert (dark & near & on_floor).sum() > 0.9 * (near & on_floor).sum()
    # ways are followed from texel to texel
    assert (dark & ~grown(whole) & on_floor).sum() < 0.05 * dark.sum()


def test_nothing_beyond_its_reach_darkens() -> None:
    view = EngineView.of(scene(), SIZE)
    shorter, longer = (share(view, SUN, reach=reach) < 0.5 for reach in (0.1, 0.5))
    assert 20 < shorter.sum() < 0.6 * longer.sum()
    assert not (shorter & ~grown(~free_by_rays(view, SUN, 0.1)) & (view.surfaces.node == 0)).any()


def test_behind_what_is_thin_light_passes() -> None:
    """A cube is taken for a sheet: its shadow ends where ways pass farther behind what is seen of it."""
    view = EngineView.of(scene(), SIZE)
    sheet, solid = (share(view, SUN, thickness=thickness) < 0.5 for thickness in (0.03, 1.0))
    assert 0 < sheet.sum() < 0.8 * solid.sum()


@pytest.mark.sampled
@pytest.mark.parametrize("bits", [32, 16])
@pytest.mark.parametrize("elevation_deg", [3.0, 30.0, 85.0])
def test_a_floor_throws_none_on_itself(bits: int, elevation_deg: float) -> None:
    elevation = np.radians(elevation_deg)
    eye = (1.5, 5.0 * np.sin(elevation), 5.0 * np.cos(elevation))
    camera = pg.Camera(eye, (0, 0, 0), up=(0.4, 1, 0), vertical_fov_rad=0.5, near=0.5, far=40.0)
    view = EngineView.of(pg.Scene((floor(15.0),), camera, ()), SIZE, bits=bits)
    for azimuth in (0.0, 130.0, 250.0):
        for light in (sun(15.0, azimuth), sun(70.0, azimuth)):
            assert share(view, light).min() == 1.0


def test_what_faces_away_is_left_as_it_is() -> None:
    view = EngineView.of(scene(), SIZE)
    away = view.surfaces.normals @ -np.asarray(SUN.direction) <= -1e-3
    assert away[view.surfaces.node == 1].sum() > 100
    assert share(view, SUN)[away & (view.surfaces.node == 1)].min() == 1.0


def test_a_light_is_in_the_frame_of_the_camera() -> None:
    camera = pg.Camera((1e6, 2, 3), (1e6, 2, 0))
    assert toward_light(camera, pg.Light.point((1e6 + 1, 2, 3))) == pytest.approx((1.0, 0.0, 0.0, 1.0))
    assert toward_light(camera, sun(90.0)) == pytest.approx((0.0, 1.0, 0.0, 0.0), abs=1e-12)


def test_devices_agree_on_contact_shadows() -> None:
    view = EngineView.of(scene(), (21, 13))
    seen_by = View(pg.Value("camera", pg.Camera, default=view.camera))
    light = pg.Value("light", pg.Light, default=SUN)
    made = share_of_ways(pg.Input("depth"), seen_by, light, REACH, 0.5, 2, False)
    assert_within_bounds(made, depth=view.surfaces.depth[..., None].astype(np.float32))
    assert render(made, size=None, depth=view.surfaces.depth[..., None])[made.name][..., 0].min() < 0.8
