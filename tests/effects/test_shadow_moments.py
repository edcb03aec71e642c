"""Maps of moments: their bounds against distributions worked out by hand, and shadows against geometry."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

import passgraph as pg
from passgraph import Image, exp, float_from_bits, isinf, ivec2, pixel, vec2, vec4
from passgraph.effects import soft_shadow_passes
from passgraph.effects.shadows.moment_maps import block_of, box_kernels, exponential_map, moment_map, pack, variance_map
from passgraph.effects.shadows.shadow_choice import SHADOW_FILTERS, Evsm4, Msm
from passgraph.effects.shadows.shadow_filters import FilterFrame
from passgraph.effects.shadows.shadow_moments import (
    LEAST_SURE,
    MOMENT_BIAS,
    MOMENT_BIAS_16,
    chebyshev,
    four_moments,
    hamburger,
    two_moments,
    unpacked_moments,
    warped_bound,
    warped_moments,
    without_bleed,
)
from passgraph.scene.matrices import translation
from tests.agreement import assert_within_bounds
from tests.effects.scenes import Float64, Picture, cube, floor, floor_places, from_above, sun
from tests.effects.test_shadow_filters import LIGHTS, MOMENT_FILTERS, card, scene, shadows_of

ABOVE = from_above(6.0)
TAPS = 4
#: Results of one row of depths, in this order.
VSM, EVSM4, MSM, POSITIVE = range(4)


@pg.kernel
def bounds_of(depths: Image, receivers: Image, exponent: float) -> vec4:
    """Bounds of a row of depths, 0 to 1: "vsm", "evsm4", "msm", and the positive warp alone."""
    y = pixel().y
    t = 2.0 * receivers.texel(ivec2(0, y)).r - 1.0
    two, warped, four = vec2(0.0), vec4(0.0), vec4(0.0)
    for i in range(TAPS):
        d = 2.0 * depths.texel(ivec2(i, y)).r - 1.0
        two += two_moments(d) / float(TAPS)
        warped += warped_moments(d, exponent) / float(TAPS)
        four += four_moments(d) / float(TAPS)
    return vec4(
        chebyshev(two.x, two.y, t),
        warped_bound(warped, t, t, exponent),
        hamburger(four, t, MOMENT_BIAS),
        chebyshev(warped.x, warped.y, exp(exponent * t)),
    )


def bounds(backend: str, depths: ArrayLike, receiver: float, exponent: float = 40.0) -> Picture:
    """Four bounds for one distribution of TAPS depths."""
    row = np.asarray(depths, np.float32).reshape(1, TAPS)
    made = bounds_of(pg.Input("depths"), pg.Input("receivers"), exponent)
    with pg.compile(made, backend=backend) as program:
        picture = program(depths=row, receivers=np.full((1, TAPS), receiver, np.float32))["bounds_of"]
    return np.asarray(picture[0, 0])


def test_two_casters_behind_each_other_leak_as_theory_says(backend_name: str) -> None:
    """Casters at 0.2 and 0.8, half and half, before a receiver at 0.9: no light arrives."""
    got = bounds(backend_name, [0.2, 0.8, 0.2, 0.8], 0.9)
    # variance 0.09, and 0.4 from the mean: 0.09 / (0.09 + 0.16)
    assert got[VSM] == pytest.approx(0.36, abs=1e-6)
    # the near caster's warp is nothing beside exp(40 * 0.6) of the far one, half of which is mean and
    # deviation; the receiver's is exp(40 * 0.8). Rounding of these exponents, 32 * 2 ** -23, counts twice.
    far = 0.5 * np.exp(40.0 * (0.6 - 0.8))
    expected = far**2 / (far**2 + (1.0 - far) ** 2)
    assert expected == pytest.approx(2.8e-8, rel=0.01)
    assert got[EVSM4] == pytest.approx(expected, rel=2.0 * 32.0 * 2.0**-23 * 4.0)
    # 0.2 and 0.8 are the only distribution with these moments; the bias leaves its weight over squared gaps
    assert 0.0 <= got[MSM] < 1e-3


@pytest.mark.parametrize(("bleed", "left"), [(0.0, 0.36), (0.2, 0.2), (0.36, 0.0), (0.5, 0.0)])
def test_the_bleed_remap_lowers_the_leak(bleed: float, left: float, backend_name: str) -> None:
    remap = pg.kernel(remapped)
    with pg.compile(remap(pg.Input("lit"), bleed), backend=backend_name) as program:
        made = program(lit=np.array([[0.36, 1.0]], np.float32))["remapped"]
    np.testing.assert_allclose(made[0, :, 0], [left, 1.0], atol=1e-6)


def remapped(lit: Image, bleed: float) -> float:
    return without_bleed(lit[0, 0].r, bleed)


@pg.kernel
def summed(depths: Image, exponent: float, normal: bool) -> vec4:
    """Sums of 113 warped depths: whether they are infinite, normalised before or not at all."""
    total = vec4(0.0)
    for _ in range(113):
        total += warped_moments(2.0 * depths[0, 0].r - 1.0, exponent) / (113.0 if normal else 1.0)
    return vec4(1.0 if isinf(total.y) else 0.0, 1.0 if isinf(total.w) else 0.0, total.x, total.y)


@pytest.mark.parametrize(
    ("exponent", "normal", "infinite"), [(42.0, True, False), (42.0, False, True), (45.0, True, True)]
)
def test_float32_ends_at_an_exponent_of_42(exponent: float, normal: bool, infinite: bool, backend_name: str) -> None:
    """exp(2 * 42) is 3.03e36: 112 of them fit below 3.40e38, and none of exp(2 * 45)."""
    made = summed(pg.Input("depths"), exponent, normal)
    with pg.compile(made, backend=backend_name) as program:
        got = program(depths=np.ones((1, 1), np.float32))["summed"][0, 0]
    assert bool(got[0]) is infinite
    assert not got[1]  # the negative warp's exponent stays small


def test_the_positive_warp_alone_is_a_soft_maximum_and_the_lesser_of_both_is_not(backend_name: str) -> None:
    """Three texels of a caster just before the receiver and one of the far background: a quarter is lit."""
    got = bounds(backend_name, [0.4, 0.4, 0.4, 1.0], 0.5)
    assert got[POSITIVE] == 1.0
    near, far = np.exp(-5.0 * -0.2), np.exp(-5.0)
    mean, variance = 0.75 * near + 0.25 * far, 0.75 * 0.25 * (near - far) ** 2
    assert got[EVSM4] == pytest.approx(variance / (variance + (mean - 1.0) ** 2), rel=1e-5)
    assert got[EVSM4] < 0.6
    assert got[MSM] == pytest.approx(0.25, abs=1e-3)


@pytest.mark.parametrize("depth", [0.0, 0.3, 0.5, 0.8])
def test_without_variance_what_lies_behind_is_dark_and_all_else_exactly_lit(depth: float, backend_name: str) -> None:
    at_it, before, behind = (bounds(backend_name, [depth] * TAPS, depth + offset) for offset in (0.0, -0.05, 0.2))
    assert at_it[[VSM, EVSM4]].min() == 1.0
    assert before.min() == 1.0
    # the least variance over the squared gap, 0.4 of -1 … 1; no more is mixed into four moments than 3e-6 of a
    # variance below 1.4
    assert behind[VSM] <= 2.0**-20 / 0.4**2
    assert behind[EVSM4] <= 2.0**-20 / (1.0 - np.exp(-5.0 * 0.4)) ** 2
    assert behind[MSM] <= 2.0 * 1.4 * MOMENT_BIAS / 0.4**2


def test_where_nothing_casts_every_receiver_is_exactly_lit(backend_name: str) -> None:
    """The far plane alone, and receivers before it and on it: 0 / 0 without the early way out."""
    for receiver in (0.0, 0.5, 1.0):
        got = bounds(backend_name, [1.0] * TAPS, receiver)
        assert got[[VSM, EVSM4, POSITIVE]].min() == 1.0
    assert bounds(backend_name, [1.0] * TAPS, 0.9)[MSM] == 1.0


FRAME = FilterFrame(0.0, 0.0, 40.0, 1.0, 2.0, 1.0, 0)  # near 1, far 2


@pg.kernel
def broken_depths(index: Image) -> float:
    """What degenerate triangles leave, by index: NaN, infinities, far too far, too near, and two right ones."""
    i = int(index[0, 0].r)
    bits = [0x7FC00000, 0x7F800000, 0xFF800000, 0x7149F2CA, 0x4059999A, 0x00000000, 0x3F800000, 0x3FC00000]
    return float_from_bits(bits[i])


@pytest.mark.parametrize("made", [variance_map, exponential_map, moment_map], ids=lambda kernel: kernel.name)
def test_depths_that_are_none_are_no_casters(made: pg.PixelKernel, backend_name: str) -> None:
    """Of NaN, inf, -inf, 1e30, 3.4, 0, 1 and 1.5 the last two lie between near and far."""
    row = np.zeros((3, 10), np.float32)
    row[1, 1:9] = np.arange(8)
    target = made(
        broken_depths(pg.Input("index")), FRAME, into=pg.target("m", "rg32f" if made is variance_map else "rgba32f")
    )
    with pg.compile(target, backend=backend_name) as program:
        got = program(index=row)["m"]
    nothing = got[0, 0]  # outermost texels are empty
    np.testing.assert_array_equal(got[1, 1:7], np.tile(nothing, (6, 1)))
    near, middle = got[1, 7], got[1, 8]
    first = {variance_map: (-1.0, 0.0), exponential_map: (np.exp(-40.0), 1.0), moment_map: (-1.0, 0.0)}[made]
    np.testing.assert_allclose([near[0], middle[0]], first, rtol=1e-4, atol=1e-30)


def possible(moments: NDArray[np.floating], bias: float = 0.0) -> NDArray[np.bool_]:
    """Whether four moments are those of some distribution: both pivots of their Hankel matrix above 0."""
    b = np.asarray(moments, np.float64)
    b = b + (np.array(LEAST_SURE) - b) * bias
    variance = b[:, 1] - b[:, 0] ** 2
    skew = b[:, 2] - b[:, 0] * b[:, 1]
    return (variance > 0.0) & ((b[:, 3] - b[:, 1] ** 2) * variance - skew**2 > 0.0)


def two_depths(count: int) -> Float64:
    """Moments of two random depths, -1 to 1, in random shares."""
    random = np.random.default_rng(1)
    a, b, share = random.uniform(-1, 1, count), random.uniform(-1, 1, count), random.uniform(0, 1, count)
    return np.stack([share * a**k + (1 - share) * b**k for k in (1, 2, 3, 4)], axis=1)


def test_rounding_makes_half_of_all_moments_impossible_and_the_bias_none() -> None:
    moments = two_depths(20000)
    plain = moments.astype(np.float32)
    assert 0.45 < (~possible(plain)).mean() < 0.55
    assert possible(plain, MOMENT_BIAS).all()


def test_half_floats_serve_no_moments_and_16_bit_steps_do(backend_name: str) -> None:
    """Both with the bias that 16-bit steps need."""
    moments = two_depths(4096)
    half = moments.astype(np.float16)
    assert 0.15 < (~possible(half, MOMENT_BIAS_16)).mean() < 0.35
    unpack = pg.kernel(read_packed)
    stored = pack(pg.Input("moments"), into=pg.target("stored", "rgba16"))
    with pg.compile(unpack(stored), backend=backend_name) as program:
        back = program(moments=moments.astype(np.float32).reshape(64, 64, 4))["read_packed"].reshape(-1, 4)
    # half a step of each packed moment: (1/3 + √3) for the first, 9/8 for the even, 0.75 (1 + √3) for the third
    step = 0.5 / 65535 + 2.0**-23
    assert (abs(back - moments).max(axis=0) <= step * np.array([2.07, 1.125, 2.05, 1.125])).all()
    assert possible(back, MOMENT_BIAS_16).all()


def read_packed(stored: Image) -> vec4:
    return unpacked_moments(stored[0, 0])


@pytest.mark.parametrize(
    ("light", "options"),
    [
        *(("directional", {"filter": SHADOW_FILTERS[name]()}) for name in MOMENT_FILTERS),
        ("directional", {"filter": Msm(format="rgba16")}),
        ("spot", {"filter": Evsm4()}),
        pytest.param("cube", {"filter": Msm()}, marks=pytest.mark.slow),
    ],
)
@pytest.mark.slow
def test_every_target_is_within_its_bound(light: str, options: dict[str, object]) -> None:
    passes = soft_shadow_passes(scene(LIGHTS[light]), map_size=48, **options)  # type: ignore[arg-type]
    report = assert_within_bounds(passes.picture, (40, 24))
    names = {target.target for target in report.backends[0].targets}
    assert any(name.startswith("moments of light") and name.endswith("blurred y") for name in names)


@pytest.mark.sampled
@pytest.mark.parametrize("radius", [0.5, 0.9, 1.5, 8.9, 9.0, 24.99, 25.0, 60.3, 80.99, 100.5, 128.0])
def test_blocks_side_by_side_are_a_box(radius: float, backend_name: str) -> None:
    """Of any width: each texel by the part of it that lies within."""
    frame = np.random.default_rng(1).random((2, 300, 4), np.float32)
    boxes, by = box_kernels(128, 4), replace(FRAME, radius=radius, block=block_of(radius))
    given = pg.Input("frame", "rgba32f", (300, 2))
    blocks = boxes.block(given, by, 1, 0, into=pg.target("blocks", "rgba32f"))
    with pg.compile(boxes.box(blocks, given, by, 1, 0, into=pg.target("box", "rgba32f")), backend_name) as program:
        found = program(frame=frame)["box"][:, 140:160]
    away = np.arange(-140, 141)
    parts = np.clip(radius + 0.5 - abs(away), 0.0, 1.0) / (2.0 * radius)
    expected = np.stack([np.tensordot(parts, frame[:, x - 140 : x + 141], (0, 1)) for x in range(140, 160)], axis=1)
    # the parts are positive and add up to 1; each sum of n numbers below 1 is off by n / 2 roundings at most
    np.testing.assert_allclose(found, expected, rtol=0, atol=2.0**-24 * (4 * radius**0.5 + 8))


@pytest.mark.sampled
@pytest.mark.parametrize("name", MOMENT_FILTERS)
@pytest.mark.parametrize("softness", [0.05, 0.07])
def test_a_straight_edge_is_the_ramp_of_a_box(name: str, softness: float) -> None:
    """The edge of a card at z = 0.5: light rises linearly over twice the softness, within a texel of the map."""
    light, sheet, map_size, size = sun(45.0), card(1.0), 256, (192, 128)
    of = pg.Scene((floor(), sheet), ABOVE, (light,))
    shadows = shadows_of(of, name, "numpy", size, map_size=map_size, softness=softness, bleed=0.0)[:, :, 0]
    x, z = floor_places(ABOVE, size)
    column = int(np.argmin(abs(x[0] - 1.0)))
    lower = z[:, column] > 0.0
    ramp = np.clip(0.5 + (z[lower, column] - 0.5) / (2.0 * softness), 0.0, 1.0)
    # the casters' width and a softness on either side, over all texels but two on either side
    texel = (2.0 / light.projection_matrix(sheet.bounds)[0, 0] + 2.0 * softness) / (map_size - 4)
    assert 0.2 < ramp[(ramp > 0.0) & (ramp < 1.0)].mean() < 0.8
    assert abs(shadows[lower, column] - ramp).max() <= texel / (2.0 * softness)


@pytest.mark.sampled
@pytest.mark.parametrize("name", MOMENT_FILTERS)
@pytest.mark.parametrize(
    "light",
    [LIGHTS["directional"], pg.Light.spot((-2, 2.5, -1), (0.6, -0.7, 0.35), intensity=20, cone_outer_rad=0.7)],
    ids=["directional", "spot"],
)
def test_without_softness_it_is_the_hard_shadow(name: str, light: pg.Light) -> None:
    """One texel has no variance: all or nothing, unless the caster is so near that rounding cannot tell."""
    of = scene(light)
    # Maps of moments hold the whole scene, whatever of it is seen.
    hard = shadows_of(of, "hard", map_size=256, fit="scene")[:, :, 0]
    got = shadows_of(of, name, map_size=256, softness=0.0)[:, :, 0]
    assert (hard < 1.0).mean() > 0.04
    np.testing.assert_array_equal(got, hard)


@pytest.mark.parametrize("name", MOMENT_FILTERS)
def test_lights_have_one_shadow_each_and_colours_add(name: str) -> None:
    red, blue = sun(45, 0, color=(1, 0, 0)), sun(45, 180, color=(0, 0, 1))
    both = pg.Scene((floor(), cube()), from_above(6.0, 0.0), (red, blue))
    shadows = shadows_of(both, name, map_size=128, ambient=0.1, softness=0.05)
    x, z = floor_places(both.camera)
    floor_light = 0.1 / (0.1 + np.sin(np.pi / 4))
    for side, colour in ((1.0, [floor_light, 1, 1]), (-1.0, [1, 1, floor_light])):
        there = (side * x > 0.7) & (side * x < 1.3) & (abs(z) < 0.35)
        np.testing.assert_allclose(shadows[there][:, :3].mean(axis=0), colour, atol=1e-3)


@pytest.mark.parametrize("name", MOMENT_FILTERS)
def test_a_cube_of_maps_has_no_seams(name: str) -> None:
    """On an empty floor nothing is dark, and a shadow over the faces' edges at 45 degrees is whole."""
    camera = from_above(6.0, 0.0)
    light = pg.Light.point((0.0, 1.0, 0.0), intensity=1.0)
    far = [cube((x, 0, z), 0.2) for x, z in ((2.6, 0), (-2.6, 0), (0, 2.6), (0, -2.6))]
    shadows = shadows_of(pg.Scene((floor(), *far), camera, (light,)), name, map_size=128, softness=0.1)[:, :, 0]
    x, z = floor_places(camera)
    # rays from the light to a floor this near pass over the cubes
    assert shadows[np.hypot(x, z) < 2.2].min() == 1.0
    # a small cube half way below the light's diagonal: its shadow lies where x = z, where faces meet
    block = pg.Node(cube(size=0.3).mesh, pg.Material(), translation((0.5, 0.35, 0.5)), "block")
    shadows = shadows_of(pg.Scene((floor(), block, *far), camera, (light,)), name, map_size=128, softness=0.02)[:, :, 0]
    core = (abs(x - 1.0) < 0.12) & (abs(z - 1.0) < 0.12)
    assert core.sum() > 5
    assert shadows[core].max() < 0.02


@pytest.mark.parametrize("name", MOMENT_FILTERS)
def test_maps_are_blurred_once_a_place_of_the_light(name: str) -> None:
    passes = soft_shadow_passes(scene(LIGHTS["directional"]), filter=SHADOW_FILTERS[name](), map_size=64)
    with pg.compile(passes.picture, backend="null", size=(64, 36)) as program:
        static = [step.name for step in program.plan.steps if step.static]
        assert f"no blur on the screen: filter={SHADOW_FILTERS[name]()} blurs the shadow maps" in program.explain()
    assert static[-3::2] == ["moments of light blurred x", "moments of light blurred y"]
    sharp = soft_shadow_passes(scene(LIGHTS["directional"]), filter=SHADOW_FILTERS[name](), map_size=64, softness=0.0)
    with pg.compile(sharp.picture, backend="null", size=(64, 36)) as program:
        assert not any("blur" in step.name for step in program.plan.steps)


@pytest.mark.parametrize("name", MOMENT_FILTERS)
def test_a_box_on_a_floor_is_dark_at_its_foot(name: str) -> None:
    """Solid bodies lose nothing of the shadow at contact: behind the foot, light at 45 degrees."""
    camera = pg.Camera((0.6, 1.2, 0), (0.6, 0, 0), up=(0, 0, -1), vertical_fov_rad=0.3, near=0.05, far=40.0)
    of = pg.Scene((floor(), cube()), camera, (sun(45.0),))
    shadows = shadows_of(of, name, "numpy", map_size=256, softness=0.05)[:, :, 0]
    x, z = floor_places(camera)
    behind = (x > 0.5) & (x < 0.8) & (abs(z) < 0.3)
    assert behind.sum() > 500
    assert shadows[behind].max() < 0.02


@pytest.mark.sampled
@pytest.mark.parametrize("name", MOMENT_FILTERS)
@pytest.mark.parametrize("elevation", [1.0, 3.0, 5.0])
def test_a_lit_floor_before_a_box_has_no_acne_at_grazing_light(name: str, elevation: float) -> None:
    """On the side of the light, and beside the box by more than the softness, nothing is dark."""
    softness = 0.05
    of = pg.Scene((floor(), cube()), from_above(6.0, 0.0), (sun(elevation),))
    made = shadows_of(of, name, map_size=128, softness=softness)[:, :, 0]
    x, z = floor_places(of.camera)
    # the box is nearer to the eye than the floor: its top hides a part
    lit = (x < -0.65) | (abs(z) > 0.65 + softness)
    assert made[lit].min() == 1.0
    far = (x > 1.2) & (abs(z) < 0.5 - 2.0 * softness)
    if elevation > 1.0:
        assert made[far].max() < 0.02


@pytest.mark.parametrize("name", MOMENT_FILTERS)
def test_the_softness_may_be_a_run_value(name: str) -> None:
    softness = pg.Value("softness", default=0.0)
    passes = soft_shadow_passes(
        scene(LIGHTS["directional"]), filter=SHADOW_FILTERS[name](), softness=softness, map_size=64
    )
    assert passes.shadows is not None
    with pg.compile(passes.shadows, backend="reference", size=(48, 27)) as program:
        hard, soft = program()["shadows"], program(softness=0.2)["shadows"]
    partial = [((p[:, :, 0] > 0.45) & (p[:, :, 0] < 0.95)).mean() for p in (hard, soft)]
    assert partial[1] > 2.0 * partial[0]
