"""The five passes: the printed blur's slips, the range of the mask, every target on every backend."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.shadows.five_pass import five_pass, five_pass_targets, round_spot
from passgraph.effects.shadows.five_pass_blur import BlurKernel, WeightsFrom, blur_mask, tap_weights
from tests.effects.scenes import Picture, cube, floor, floor_places, from_above, render, sun

KERNELS: tuple[BlurKernel, ...] = ("normalised", "faithful")
SPOT = pg.Light.spot((2, 4, 3), (-0.5, -1, -0.8), intensity=22, cone_outer_rad=0.5)
CAMERA = pg.Camera((3, 3, 5), (0, 0.4, 0), vertical_fov_rad=0.7)
#: An edge may fall to the other side of a pixel's or of a texel's centre, and the blur spreads it.
SHARE_ON_EDGES = {"mask": 0.005, "mask_x": 0.03, "mask_blurred": 0.06, "picture": 0.01}


def scene(light: pg.Light = SPOT) -> pg.Scene:
    nodes = (floor(), cube(), cube((-1.2, 0, 1.0), 0.6), cube((1.4, 0.5, 1.2), 0.4))
    return pg.Scene(nodes, CAMERA, (light,))


def blurred(mask: NDArray[np.floating], kernel: BlurKernel, weights: WeightsFrom, backend: str) -> Picture:
    made = blur_mask(pg.Input("mask"), kernel, weights)[1]
    height, width = mask.shape
    picture = mask.astype(np.float32)
    return render(made, size=(width, height), backend=backend, mask=picture)["mask_blurred"][:, :, 0]


@pytest.mark.parametrize("weights", ["host", "kernel"])
@pytest.mark.parametrize(("kernel", "gain", "shift"), [("faithful", 1.0665, 0.408), ("normalised", 1.0, 0.0)])
def test_gain_and_shift(kernel: BlurKernel, gain: float, shift: float, weights: WeightsFrom, backend_name: str) -> None:
    """The taps of the printed kernel have their middle at +0.408 texel: what they show moves by as much to -x, -y."""
    point = np.zeros((41, 41))
    point[20, 20] = 1.0
    made = blurred(point, kernel, weights, backend_name).astype(np.float64)
    assert made.sum() == pytest.approx(gain**2, abs=2e-4)
    places = np.arange(41) - 20
    assert (made.sum(axis=0) @ places) / made.sum() == pytest.approx(-shift, abs=1e-3)
    assert (made.sum(axis=1) @ places) / made.sum() == pytest.approx(-shift, abs=1e-3)
    flat = blurred(np.ones((20, 20)), kernel, weights, backend_name)
    np.testing.assert_allclose(flat, gain**2, atol=2e-4)


def test_weights_are_those_printed() -> None:
    """G(0; 2) = 0.19947, 2·G(1; 3) = 0.25159, and -1 gets 2·G(2; 3) = 0.21297."""
    faithful, symmetric = np.array(tap_weights("faithful")), np.array(tap_weights())
    np.testing.assert_allclose(faithful[:3], [0.19947, 0.25159, 0.21297], atol=1e-5)
    assert len(faithful) == len(symmetric) == 15
    assert faithful.sum() == pytest.approx(1.0665, abs=5e-5)
    offsets = np.array([0, *(s * i for i in range(1, 15, 2) for s in (1, -1))])
    assert faithful @ offsets / faithful.sum() == pytest.approx(0.408, abs=5e-4)
    np.testing.assert_array_equal(symmetric[1::2], symmetric[2::2])
    assert symmetric.sum() == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("kernel", KERNELS)
def test_weights_of_host_and_kernel_agree(kernel: BlurKernel, backend_name: str) -> None:
    noise = np.random.default_rng(5).random((24, 32))
    host, inside = (blurred(noise, kernel, weights, backend_name) for weights in ("host", "kernel"))
    assert abs(host - inside).max() < 2e-6


@lru_cache
def pictures(kernel: BlurKernel, weights: WeightsFrom, directional: bool, backend: str) -> dict[str, Picture]:
    light = sun(40, 30) if directional else SPOT
    made = five_pass_targets(scene(light), kernel=kernel, weights=weights, map_size=128)
    targets = (made.shadow_map, made.mask, made.mask_x, made.mask_blurred, made.picture)
    return render(*targets, size=(64, 36), backend=backend)


@pytest.mark.parametrize(
    ("kernel", "weights", "directional"),
    [("normalised", "host", False), ("faithful", "kernel", False), ("normalised", "host", True)],
)
def test_every_target_agrees_with_the_reference(
    kernel: BlurKernel, weights: WeightsFrom, directional: bool, backend_name: str
) -> None:
    expected = pictures(kernel, weights, directional, "reference")
    for name, picture in pictures(kernel, weights, directional, backend_name).items():
        assert np.isfinite(picture).all(), name
        bound = {"pass 1: shadow map": 2e-5 * 8.0, "picture": 2 / 255}.get(name, 2.0**-9)
        off = (abs(picture - expected[name]) > bound).any(axis=2).mean()
        assert off <= SHARE_ON_EDGES.get(name, 0.002), f"{name}: {off:.2%} of the pixels differ by more than {bound:g}"


def test_the_mask_runs_from_a_tenth_to_one() -> None:
    camera = from_above(6.0)
    made = five_pass_targets(pg.Scene((floor(), cube()), camera, (sun(45.0),)), map_size=256, mask_format="r32f")
    mask = render(made.mask)["mask"][:, :, 0]
    x, z = floor_places(camera)
    core = (x > 0.6) & (x < 1.4) & (abs(z) < 0.4)
    lit = ((x > 1.6) | (x < -0.7)) | (abs(z) > 0.7)
    np.testing.assert_allclose(mask[core], 0.1, atol=1e-6)
    assert mask[lit].min() == pytest.approx(1.0, abs=1e-6)
    # nine comparisons that count 0.1 or 1
    steps = (mask - 0.1) / 0.1
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-4)


@pytest.mark.parametrize("elevation", [1.0, 3.0, 30.0])
def test_a_lit_plane_has_no_acne(elevation: float) -> None:
    nodes = (floor(), cube((0, 0, -3.9), 0.05))
    of = pg.Scene(nodes, pg.Camera((2, 3, 5), (0, 0, 1.5)), (sun(elevation, 90.0),))
    mask = render(five_pass_targets(of, map_size=64).mask)["mask"][20:, :, 0]
    assert mask.min() == 1.0


def test_the_picture_is_light_times_mask_times_spotlight() -> None:
    made = five_pass_targets(pg.Scene((floor(),), from_above(6.0), (SPOT,)), display=False)
    run = render(made.mask_blurred, made.picture)
    white = pg.Texture.make(np.full((1, 1), 255, np.uint8), "linear")
    plain = five_pass(pg.Scene((floor(),), from_above(6.0), (SPOT,)), display=False, spotlight=white)
    full = render(plain)["picture"][:, :, 0]
    x, z = floor_places(from_above(6.0))
    away = np.stack([2 - x, np.full_like(x, 4.0), 3 - z])
    far = np.sqrt((away**2).sum(axis=0))
    expected = 22 * 4.0 / far**3 * run["mask_blurred"][:, :, 0]
    np.testing.assert_allclose(full, expected, rtol=3e-3)
    axis = np.array([-0.5, -1, -0.8]) / np.linalg.norm([-0.5, -1, -0.8])
    angle = np.arccos(np.clip(-(axis @ away.reshape(3, -1)).reshape(x.shape) / far, -1, 1))
    assert run["picture"][angle > 0.5][:, :3].max() == 0.0
    np.testing.assert_allclose(run["picture"][angle < 0.2][:, 0], full[angle < 0.2], rtol=2e-3)


def test_the_spotlight_is_black_at_its_border() -> None:
    pixels = round_spot().pixels[:, :, 0]
    assert max(pixels[0].max(), pixels[-1].max(), pixels[:, 0].max(), pixels[:, -1].max()) == 0
    assert pixels[32, 32] == 255


def test_the_plan_has_five_kinds_of_passes() -> None:
    with pg.compile(five_pass(scene(), map_size=64), backend="null", size=(64, 36)) as program:
        names = [step.name for step in program.plan.steps]
    assert sorted(names) == [
        "pass 1: shadow map", "pass 2: mask", "pass 3: blur x", "pass 4: blur y", "pass 5: lit scene",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kernel": "box"}, "kernel cannot be 'box'"),
        ({"weights": "gpu"}, "weights cannot be 'gpu'"),
        ({"map_size": 4}, "map_size must be 16 to 8192"),
        ({"mask_format": "rgba8"}, "mask_format cannot be 'rgba8'"),
        ({"ambient": -1.0}, "ambient must be 0 or more"),
    ],
)
def test_parameters_out_of_range_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(pg.GraphError, match=message):
        five_pass(scene(), **options)  # type: ignore[arg-type]


def test_scenes_that_it_cannot_light_are_refused() -> None:
    with pytest.raises(pg.GraphError, match="has no light"):
        five_pass(pg.Scene((floor(), cube()), CAMERA))
    with pytest.raises(pg.GraphError, match="one light, and scene 'scene' has 2: 'light', 'sun'; choose"):
        five_pass(scene().with_(lights=(SPOT, sun(name="sun"))))
    with pytest.raises(pg.GraphError, match="casts a shadow"):
        five_pass(pg.Scene((floor(casts=False),), CAMERA, (SPOT,)))
    with pytest.raises(pg.GraphError, match="soft_shadow has cube maps"):
        five_pass(scene(pg.Light.point((0.2, 0.8, 0.7))))
