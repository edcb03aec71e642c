"""Soft shadows against geometry worked out by hand."""

from __future__ import annotations

from math import radians, tan

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects import soft_shadow, soft_shadow_passes
from passgraph.effects.shadows.shadow_choice import Blur, BlurWidth
from passgraph.scene.matrices import rotation_y, translation
from tests.effects.scenes import (
    SIZE,
    Float64,
    Picture,
    cube,
    floor,
    floor_places,
    from_above,
    moved,
    render,
    sun,
)

ABOVE = from_above(6.0)
BOX_ON_FLOOR = pg.Scene((floor(), cube()), ABOVE, (sun(45.0),))


def shadows_of(scene: pg.Scene, **options: object) -> Picture:
    settings = {"softness": 0.0, "ambient": 0.0, "map_size": 256, **options}
    passes = soft_shadow_passes(scene, **settings)  # type: ignore[arg-type]
    assert passes.shadows is not None
    return render(passes.shadows)["shadows"]


def test_the_shadow_of_a_box_lies_where_geometry_says() -> None:
    """Light at 45 degrees along x: a unit cube's shadow reaches from its side at 0.5 to 1.5."""
    shadows = shadows_of(BOX_ON_FLOOR)[:, :, 0]
    x, z = floor_places(ABOVE)
    pixel = x[0, 1] - x[0, 0]
    texel = 2.0 * 1.2 / 256
    near = pixel + 2.0 * texel
    core = (x > 0.5 + near) & (x < 1.5 - near) & (abs(z) < 0.5 - near)
    outside = (x > 1.5 + near) | (x < -0.5 - near) | (abs(z) > 0.5 + near)
    # seen from above, the cube's top hides a little more than its base
    outside &= (abs(x) > 0.65) | (abs(z) > 0.65)
    assert core.sum() > 150
    assert shadows[core].max() == 0.0
    assert shadows[outside].min() == 1.0
    middle = shadows[SIZE[1] // 2]
    edge = x[0][np.flatnonzero(middle < 0.5)[-1]]
    assert abs(edge - 1.5) <= pixel


def test_result_is_the_lit_scene_times_the_blurred_shadows() -> None:
    passes = soft_shadow_passes(BOX_ON_FLOOR, softness=0.1, map_size=128)
    assert passes.shadows_blurred is not None
    made = render(passes.unshadowed, passes.shadows_blurred, passes.soft_shadow)
    product = made["unshadowed"][:, :, :3] * made["shadows_blurred"][:, :, :3]
    np.testing.assert_allclose(made["soft_shadow"][:, :, :3], product, rtol=2**-10)


def test_fully_lit_places_are_exactly_as_without_shadows() -> None:
    passes = soft_shadow_passes(BOX_ON_FLOOR, softness=0.1, map_size=128)
    made = render(passes.unshadowed, passes.soft_shadow)
    x, z = floor_places(ABOVE)
    far = (x < -1.0) | (x > 2.0) | (abs(z) > 1.0)
    np.testing.assert_array_equal(made["soft_shadow"][far], made["unshadowed"][far])


def test_a_penumbra_is_as_wide_as_asked_for() -> None:
    """(1 - t²)² over a step rises from 0 to 1 within twice the softness."""
    softness = 0.3
    passes = soft_shadow_passes(BOX_ON_FLOOR, softness=softness, ambient=0.0, map_size=256)
    assert passes.shadows_blurred is not None
    row = render(passes.shadows_blurred)["shadows_blurred"][SIZE[1] // 2, :, 0]
    x, _ = floor_places(ABOVE)
    pixel = x[0, 1] - x[0, 0]
    rising = x[0][(x[0] > 1.0) & (row > 0.002) & (row < 0.998)]
    assert rising[0] == pytest.approx(1.5 - softness, abs=2.5 * pixel)
    assert rising[-1] == pytest.approx(1.5 + softness, abs=2.5 * pixel)


@pytest.mark.sampled
@pytest.mark.parametrize("elevation", [0.5, 1.0, 2.0, 5.0, 30.0, 90.0])
@pytest.mark.parametrize("azimuth", [0.0, 33.0])
def test_a_lit_plane_has_no_acne_at_grazing_light(elevation: float, azimuth: float) -> None:
    scene = pg.Scene((floor(),), pg.Camera((2, 3, 5), (0, 0, 0)), (sun(elevation, azimuth),))
    assert shadows_of(scene, map_size=64).min() == 1.0


@pytest.mark.sampled
@pytest.mark.parametrize(
    "light",
    [
        pg.Light.spot((2, 3, 1), (-0.5, -1, -0.3), intensity=20, cone_outer_rad=1.0),
        pg.Light.point((1, 8, 2), intensity=40),
        pg.Light.point((0.5, 0.2, 0.3), intensity=1),
    ],
    ids=["spot", "point", "point near the floor"],
)
def test_a_lit_plane_has_no_acne_in_perspective_maps(light: pg.Light) -> None:
    scene = pg.Scene((floor(),), pg.Camera((2, 3, 5), (0, 0, 0)), (light,))
    assert shadows_of(scene, map_size=64).min() == 1.0


def _card() -> pg.Node:
    corners = [[0, 0, -0.5], [0, 0, 0.5], [0, 1, 0.5], [0, 1, -0.5]]
    mesh = pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]])
    return pg.Node(mesh, pg.Material(double_sided=True), name="card")


@pytest.mark.parametrize("elevation", [10.0, 45.0, 80.0])
@pytest.mark.parametrize(("node", "foot", "gap_texels"), [(cube(), 0.5, 0.0), (_card(), 0.0, 3.0)], ids=["box", "card"])
def test_no_light_shines_through_under_what_stands_on_the_floor(
    node: pg.Node, foot: float, gap_texels: float, elevation: float
) -> None:
    camera = pg.Camera(
        (foot + 0.1, 1.2, 0), (foot + 0.1, 0, 0), up=(0, 0, -1), vertical_fov_rad=0.3, near=0.05, far=40.0
    )
    passes = soft_shadow_passes(
        pg.Scene((floor(), node), camera, (sun(elevation),)), softness=0.0, ambient=0.0, map_size=256
    )
    assert passes.shadows is not None
    made = render(passes.shadows, passes.depth)
    x, z = floor_places(camera)
    on_floor = abs(made["depth"][:, :, 0] - 1.2) < 1e-3
    reach = min(1.0 / tan(radians(elevation)), 0.3) * 0.8
    behind = on_floor & (x > foot) & (x < foot + reach) & (abs(z) < 0.4)
    lit = behind & (made["shadows"][:, :, 0] > 0.01)
    assert behind.sum() > 500
    texel = 2.0 / 256
    assert (x[lit].max(initial=foot) - foot) <= gap_texels * texel


@pytest.mark.parametrize("offset", [(1e6, 2e6, -1e6), (1e7 + 0.3, -1e7, 1e7 - 0.1)])
def test_a_scene_far_from_the_origin_looks_the_same(offset: tuple[float, float, float]) -> None:
    camera = pg.Camera((3, 3, 5), (0, 0.5, 0), vertical_fov_rad=0.6)
    scene = pg.Scene((floor(), cube(), cube((-1.2, 0, 1), 0.6)), camera, (sun(40, 30, radius=0.1),))
    near, far = (
        render(p.picture, p.shadows)  # type: ignore[arg-type]
        for p in (soft_shadow_passes(s, map_size=128) for s in (scene, moved(scene, offset)))
    )
    # float64 keeps 2e-9 units at 1e7; at most a pixel on an edge may fall to the other side
    assert (abs(near["shadows"] - far["shadows"]) > 1e-3).mean() < 1e-3
    assert abs(near["picture"] - far["picture"]).mean() < 1e-4


def _half_lit(**options: object) -> float:
    """Floor area that is neither lit nor dark, in units."""
    scene = pg.Scene((floor(), cube()), from_above(3.0, 1.2), (sun(45, 20),))
    settings = {"softness": 0.0, "ambient": 0.0, "map_size": 256, **options}
    passes = soft_shadow_passes(scene, **settings)  # type: ignore[arg-type]
    assert passes.shadows_blurred is not None
    (share,) = render(passes.shadows_blurred).values()
    area = (2.0 * tan(0.3) * 3.0 / SIZE[1]) ** 2
    return float(((share[:, :, 0] > 0.05) & (share[:, :, 0] < 0.95)).sum() * area)


def test_blurring_the_shadow_map_softens_nothing_and_blurring_the_mask_does() -> None:
    """The same width, 15 texels, before and after the compare."""
    after = _half_lit(softness=0.15)
    assert after > 0.5
    assert _half_lit(map_blur_px=15) < 0.06 * after


def test_settings_of_a_blur_out_of_range_are_refused() -> None:
    with pytest.raises(pg.GraphError, match="Blur: width cannot be 'box'; it is one of world, constant"):
        Blur("box")  # type: ignore[arg-type]
    with pytest.raises(pg.GraphError, match="Blur: radius_px must be 1 to 31, got 0"):
        Blur(radius_px=0)


def test_a_larger_shadow_map_sharpens_edges_and_softens_nothing() -> None:
    areas = [_half_lit(map_size=size) for size in (64, 256, 1024)]
    assert areas[0] > areas[1] > areas[2]


def _dark_mass(distance: float, blur: BlurWidth) -> float:
    """Floor area, weighted by darkness, that is more than half dark."""
    camera = from_above(distance)
    scene = pg.Scene((floor(40.0), cube()), camera, (sun(45, 20),))
    passes = soft_shadow_passes(scene, softness=0.15, ambient=0.0, map_size=256, filter=Blur(blur))
    assert passes.shadows_blurred is not None
    dark = 1.0 - render(passes.shadows_blurred)["shadows_blurred"][:, :, 0]
    area = (2.0 * tan(0.5 * camera.vertical_fov_rad) * distance / SIZE[1]) ** 2
    return float(dark[dark > 0.5].sum() * area)


def test_shadows_keep_their_mass_as_the_camera_recedes() -> None:
    masses = [_dark_mass(distance, "world") for distance in (6.0, 12.0, 24.0)]
    assert max(masses) / min(masses) < 1.2


def test_with_a_constant_blur_shadows_vanish_as_the_camera_recedes() -> None:
    masses = [_dark_mass(distance, "constant") for distance in (6.0, 12.0, 24.0)]
    assert masses[1] < 0.8 * masses[0]
    assert masses[2] < 0.05 * masses[0]


def test_shadows_do_not_leak_over_silhouettes() -> None:
    """The top of a cube before its own shadow on the floor stays lit, whatever the blur."""
    passes = soft_shadow_passes(BOX_ON_FLOOR, softness=0.3, ambient=0.0, map_size=256)
    assert passes.shadows_blurred is not None
    made = render(passes.shadows_blurred, passes.depth)
    top = abs(made["depth"][:, :, 0] - 5.0) < 1e-3
    assert top.sum() > 150
    assert made["shadows_blurred"][top][:, 0].min() > 0.999


@pytest.mark.parametrize("place", [(0.4, 1.5, 0.2), (-0.9, 0.6, 0.9)])
def test_a_point_light_amid_the_scene_has_a_seamless_cube_map(place: tuple[float, float, float]) -> None:
    """Boxes all round: what a ray from the pixel to the light misses is lit, on every face."""
    light = pg.Light.point(place, intensity=1.0)
    boxes = [cube((x, 0, z), 0.5) for x, z in ((1.2, -0.5), (-1.6, 0.3), (0.3, 1.3), (-0.4, -1.2))]
    scene = pg.Scene((floor(), *boxes), from_above(6.0, 0.0), (light,))
    passes = soft_shadow_passes(scene, softness=0.0, ambient=0.0, map_size=128)
    assert len(passes.shadow_maps) == 6
    assert passes.shadows is not None
    made = render(passes.shadows, passes.depth)
    x, z = floor_places(scene.camera)
    points = np.stack([x, np.zeros_like(x), z], axis=-1)
    floor_pixels = abs(made["depth"][:, :, 0] - 6.0) < 1e-3
    sure_dark = np.zeros_like(floor_pixels)
    sure_lit = floor_pixels.copy()
    for low, high in (box.bounds for box in boxes):
        sure_dark |= _blocked(points, np.array(place), low + 0.08, high - 0.08) & floor_pixels
        sure_lit &= ~_blocked(points, np.array(place), low - 0.1, high + 0.1)
    assert sure_dark.sum() > 50
    assert sure_lit.sum() > 500
    assert made["shadows"][sure_lit][:, 0].min() == 1.0
    assert made["shadows"][sure_dark][:, 0].max() == 0.0


def _blocked(points: Float64, light: Float64, low: Float64, high: Float64) -> NDArray[np.bool_]:
    """Whether the segment to the light meets a box (slab test)."""
    along = light - points
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - points) / along, (high - points) / along
    enter = np.minimum(a, b).max(axis=-1)
    leave = np.maximum(a, b).min(axis=-1)
    return np.asarray((enter <= leave) & (leave >= 0) & (enter <= 1))


def test_lights_have_one_shadow_each_and_colours_add() -> None:
    red = sun(45, 0, color=(1, 0, 0))
    blue = sun(45, 180, color=(0, 0, 1))
    both = pg.Scene((floor(), cube()), from_above(6.0, 0.0), (red, blue))
    shadows = shadows_of(both, ambient=0.1)
    x, z = floor_places(both.camera)
    right = (x > 0.7) & (x < 1.3) & (abs(z) < 0.35)
    left = (x < -0.7) & (x > -1.3) & (abs(z) < 0.35)
    floor_light = 0.1 / (0.1 + np.sin(np.pi / 4))
    np.testing.assert_allclose(shadows[right][:, :3].mean(axis=0), [floor_light, 1, 1], atol=1e-3)
    np.testing.assert_allclose(shadows[left][:, :3].mean(axis=0), [1, 1, floor_light], atol=1e-3)


def test_a_node_can_refuse_shadows() -> None:
    scene = pg.Scene((floor(receives=False), cube()), ABOVE, (sun(45.0),))
    x, z = floor_places(ABOVE)
    inside = (x > 0.7) & (x < 1.3) & (abs(z) < 0.3)
    assert shadows_of(scene)[inside].min() == 1.0


def test_cut_out_casters_let_light_through_their_holes() -> None:
    pixels = np.full((8, 8, 4), 255, np.uint8)
    pixels[:, 4:, 3] = 0
    material = pg.Material("half", (1, 1, 1, 1), pg.Texture.make(pixels), alpha_mode="mask", double_sided=True)
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1.0]]) * 0.5
    mesh = pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]], uvs=[[0, 1], [1, 1], [1, 0], [0, 0]])
    sheet = pg.Node(mesh, material, translation((0, 1, 0)), "sheet")
    scene = pg.Scene((floor(), sheet), ABOVE, (sun(45.0),))
    shadows = shadows_of(scene)[:, :, 0]
    x, z = floor_places(ABOVE)
    inside = abs(z) < 0.4
    assert shadows[inside & (x > 0.6) & (x < 0.9)].max() == 0.0
    assert shadows[inside & (x > 1.1) & (x < 1.4)].min() == 1.0


def test_camera_and_light_are_values_of_each_run() -> None:
    picture = soft_shadow(BOX_ON_FLOOR, softness=0.0, ambient=0.0, map_size=128, display=False)
    with pg.compile(picture, backend="reference", size=SIZE) as program:
        as_built = program()["soft_shadow"]
        again = program(camera=ABOVE, light=BOX_ON_FLOOR.lights[0])["soft_shadow"]
        turned = program(light=sun(45.0, 180.0))["soft_shadow"]
        np.testing.assert_array_equal(as_built, again)
        x, z = floor_places(ABOVE)
        right = (x > 0.8) & (x < 1.3) & (abs(z) < 0.3)
        assert as_built[right][:, 0].max() == 0.0
        assert turned[right][:, 0].min() > 0.5


def test_another_kind_of_light_is_refused_at_run_time() -> None:
    with (
        pg.compile(soft_shadow(BOX_ON_FLOOR, map_size=64), backend="null", size=SIZE) as program,
        pytest.raises(pg.InputError, match="was a directional light when the effect was built"),
    ):
        program(light=pg.Light.point((0, 5, 0)))


def test_mirrored_nodes_look_like_unmirrored_ones() -> None:
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0]) @ rotation_y(0.0)
    box = cube()
    mirrored = pg.Node(box.mesh, box.material, mirror)
    one = shadows_of(pg.Scene((floor(), box), ABOVE, (sun(),)))
    other = shadows_of(pg.Scene((floor(), mirrored), ABOVE, (sun(),)))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"softness": -1.0}, "softness must be 0 or more"),
        ({"filter": "vsn"}, "filter must be .*a Pcss or .*got 'vsn'"),
        ({"map_size": 4}, "map_size must be 16 to 8192"),
        ({"hdr_format": "r8"}, "hdr_format cannot be 'r8'"),
    ],
)
def test_parameters_out_of_range_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(pg.GraphError, match=message):
        soft_shadow(BOX_ON_FLOOR, **options)  # type: ignore[arg-type]
