"""Hard cases of shadows: the failing variant fails, the remedy holds, on every backend; docs/hard-cases.md shows them.

Scenes, variants and measurements are in ``tests/effects/hard``.
"""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.shadows.shadow_choice import SHADOW_FILTERS
from tests.conftest import DEVICES
from tests.effects.hard import bias, blurring, lights, moments, penumbrae, precision, refusals
from tests.effects.hard.case import Case, Figure, mask

pytestmark = pytest.mark.slow


def lines(case: Case, start: str) -> list[Figure]:
    """Figures whose name starts so, at least one."""
    found = [figure for figure in case.figures if figure.what.startswith(start)]
    assert found, f"{case.key} has no figure {start!r}"
    return found


def values(case: Case, what: str) -> tuple[float, float, float]:
    """Truth, failing and remedy of one figure; NaN where there is none."""
    figure = case.figure(what)
    return tuple(np.nan if v is None else v for v in (figure.truth, figure.failing, figure.remedy))  # type: ignore[return-value]


# Comparisons


def test_a_plane_at_grazing_light_shadows_itself_under_a_constant_bias_only(backend_name: str) -> None:
    case = bias.grazing_light(backend_name)
    for degrees in bias.GRAZING_DEG:
        one, wide = (
            values(case, f"share of a bare floor that is darkened, {n}×{n} texels, {degrees:g}°") for n in (1, 7)
        )
        # acne covers a large part of the floor, and a wider filter covers more
        assert one[1] > 0.3
        assert wide[1] > 1.5 * one[1]
        assert one[2] == wide[2] == 0.0


def test_a_plane_from_differences_is_wrong_along_silhouettes_and_ours_nowhere(backend_name: str) -> None:
    _, failing, remedy = values(bias.creases(backend_name), "share of pixels wrong by more than 1/4")
    assert failing > 0.01
    assert remedy == 0.0


def test_nothing_floats(backend_name: str) -> None:
    case = bias.contacts(backend_name)
    # a pixel of that view is a fifth of a texel wide
    pixel = 0.25
    gaps = {thing: values(case, f"gap of light behind a {thing}, texels") for thing in bias.THINGS}
    assert gaps["board, 1 cm thick"][1] > 2.0
    assert gaps["card without thickness"][1] > 4.0
    for thing, (truth, _, remedy) in gaps.items():
        # the slack of 1.5 texels on either side of a card that has no other
        assert remedy - truth <= (3.0 if thing == "card without thickness" else pixel)


# Digits


def test_far_from_the_origin_world_positions_in_float32_break_and_ours_do_not(backend_name: str) -> None:
    case = precision.far_from_origin(backend_name)
    for _, failing, remedy in (values(case, figure.what) for figure in case.figures):
        assert failing > 0.05
        # float64 keeps 2e-9 units at 1e7: at most a pixel on an edge may fall to the other side
        assert remedy < 1e-3


def test_a_depth_buffer_has_three_values_where_linear_depth_has_a_thousand(backend_name: str) -> None:
    case = precision.distant_depths(backend_name)
    asked, failing, remedy = values(case, "distinct values in 1000 pixels")
    assert failing <= 4
    assert remedy == asked == 1000
    # steps of 1/1000 unit, each off by a few of float32's 6e-5
    assert values(case, "largest error, units")[2] == pytest.approx(1e-3, abs=4 * 6.1e-5)


def test_a_lift_is_lost_in_the_distance_and_a_polygon_offset_is_not(backend_name: str) -> None:
    shown = [values(precision.coplanar(backend_name), f.what) for f in precision.coplanar(backend_name).figures]
    assert shown[0][1] == 0.0
    assert shown[-1][1] > 0.5
    assert [remedy for _, _, remedy in shown] == [0.0] * len(precision.DISTANCES)


def test_centred_sums_keep_what_plain_ones_lose() -> None:
    for figure in precision.summed_area("numpy").figures:
        assert figure.failing is not None
        assert figure.remedy is not None
        assert figure.failing > 1e-3
        assert figure.remedy < 2e-3 * figure.failing


# Penumbrae


def test_pcss_has_the_right_width_under_one_caster_and_a_wrong_one_under_two(backend_name: str) -> None:
    case = penumbrae.stacked(backend_name)
    for height in (0.4, 1.6):
        truth, hard, pcss = values(case, f"penumbra's width, one sheet at {height:g}")
        # a disc of radius R seen over an edge at distance g: 0.1 to 0.9 within 1.374 R g
        assert truth == pytest.approx(1.374 * penumbrae.SUN_TANGENT * height, rel=0.05)
        assert pcss == pytest.approx(truth, rel=0.1)
        assert hard < 0.5 * truth
    truth, _, pcss = values(case, "penumbra's width, both, one over the other")
    assert pcss > 1.5 * truth
    alone, both = (
        values(case, f"RMSE to rays, {name}")[2] for name in ("one sheet at 1.6", "both, one over the other")
    )
    assert both > 3.0 * alone


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_penumbra_leaks_no_more_light_below_several_casters_than_pcss(backend_name: str) -> None:
    case = penumbrae.overlapping(backend_name)
    for name in penumbrae.STACKS:
        # a thin side of the shelf hides its boards from the map: pcss and penumbra miss the same ones
        slack = 1.2 if name == "shelf" else 1.0
        _, pcss, ours = values(case, f"share of the umbra that shows more than 0.1 of the light, {name}")
        assert ours <= slack * pcss
        _, pcss, ours = values(case, f"RMSE to rays, {name}")
        assert ours <= slack * pcss


def test_a_clamped_depth_narrows_the_penumbra(backend_name: str) -> None:
    case = penumbrae.clamped_depth(backend_name)
    truth, clamped, ours = values(case, "penumbra's width")
    # 0.4 of 1.6 units is left of the caster's distance
    assert clamped == pytest.approx(truth / 4.0, rel=0.15)
    assert ours == pytest.approx(truth, rel=0.1)
    # the clamp alone does it
    assert values(case, "the same kernel without the clamp")[2] == pytest.approx(truth, rel=0.1)


def test_without_extent_every_filter_is_exactly_hard(backend_name: str) -> None:
    for figure in penumbrae.zero_area(backend_name).figures:
        assert figure.remedy == 0.0


def test_without_casters_there_is_no_haze(backend_name: str) -> None:
    case = penumbrae.no_blockers(backend_name)
    _, failing, remedy = values(case, "share of fully lit pixels that are darkened")
    assert failing > 0.05
    # pixels beside a penumbra, which sampled rays call fully lit
    assert remedy < 0.01
    assert values(case, "least light on a bare floor")[2] == 1.0


# Blurs


def test_a_constant_blur_has_a_halo_about_a_pillar(backend_name: str) -> None:
    case = blurring.pillar(backend_name)
    _, failing, remedy = values(case, "least light on the pillar's lit side")
    assert failing < 0.6
    assert remedy > 0.85
    _, failing, remedy = values(case, "most light in the umbra behind it")
    assert failing > 0.3
    assert remedy < 0.06
    _, failing, remedy = values(case, "RMSE to rays")
    assert remedy < 0.7 * failing


# Moments


def test_moments_leak_less_the_more_they_say(backend_name: str) -> None:
    case = moments.leaks(backend_name)
    assert values(case, "most light in the umbra, vsm, no bleed remap")[1] > 0.5
    weak, strong, four = (
        values(case, f"most light in the umbra, {name}")[2]
        for name in ("evsm4, exponent 5", "evsm4, exponent 40", "msm")
    )
    assert weak < 0.2
    # half floats of the mask hold 1/2048 near 1, and none below the bleed of 0.02
    assert strong <= 2**-11
    assert four <= 0.02


# Lights


def test_nothing_is_projected_backward(backend_name: str) -> None:
    case = lights.wide_spots(backend_name)
    for figure in lines(case, "share of what lies behind"):
        assert figure.failing is not None
        assert figure.failing > 0.5
        assert figure.remedy == 0.0
    # at 60 degrees the map holds the whole cone; beyond 80 its border is lit
    assert values(case, "mean error before it, 60°")[2] < 0.01
    assert values(case, "mean error before it, 89.9°")[2] < 0.05


@pytest.mark.parametrize("name", list(lights.odd_lights()))
@pytest.mark.parametrize("shadow_filter", ["blur", "hard"])
def test_a_light_in_an_odd_place_spoils_nothing(name: str, shadow_filter: str, backend_name: str) -> None:
    scene = lights.under(lights.odd_lights()[name])
    share = mask(scene, backend_name, (64, 40), filter=SHADOW_FILTERS[shadow_filter](), softness=0.05, map_size=128)
    assert np.isfinite(share).all()
    assert share.min() >= 0.0
    assert share.max() <= 1.0


def test_lights_in_odd_places_shadow_what_rays_say(backend_name: str) -> None:
    for figure in lights.odd_places(backend_name).figures:
        assert figure.remedy is not None
        assert figure.remedy < 0.01, figure.what


# Refusals


@pytest.mark.parametrize("name", list(refusals.REFUSED))
def test_what_has_no_picture_is_refused_with_what_is_wrong(name: str) -> None:
    attempt, words = refusals.REFUSED[name]
    with pytest.raises(pg.PassgraphError) as raised:
        attempt()
    assert words in str(raised.value)


def test_what_has_no_area_changes_nothing(backend_name: str) -> None:
    for figure in refusals.refusals(backend_name).figures:
        assert figure.remedy == figure.truth, figure.what
