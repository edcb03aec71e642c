"""What is claimed of shadows blurred on the screen, measured: against rays, and against a larger shadow map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

import passgraph as pg
from passgraph.effects import soft_shadow
from passgraph.effects.shadows.shadow_choice import Blur, Hard
from passgraph.language.scalar import For, If, LoadTexel
from passgraph.plan.data import DrawStep, PixelStep
from tests.effects.hard import blurring
from tests.effects.hard.case import SIZE
from tests.effects.test_hard_cases import lines, values


def test_blurring_the_map_does_not_soften_and_blurring_the_mask_does(backend_name: str) -> None:
    case = blurring.blur_before(backend_name)
    truth, before, after = values(case, "width of the edge, units")
    _, sharp, _ = values(case, "the same without any blur")
    pixel = 2.0 * 0.309 * 3.0 / blurring.CLAIM_SIZE[1]
    # a rays' edge is 1.374 times the sun's tangent and the way of the light wide, and that over its slope on the floor
    assert truth == pytest.approx(1.374 * 0.106 * 2.0, rel=0.05)
    assert abs(before - sharp) < pixel
    assert before < 2.0 * pixel
    assert after == pytest.approx(truth, rel=0.15)
    _, before, after = values(case, "RMSE to rays")
    assert after < 0.5 * before


def test_a_larger_map_stays_as_wrong_as_a_hard_shadow(backend_name: str) -> None:
    from tests.effects.hard.case import SIZE, mask, rmse, traced

    scene = blurring.usual()
    truth = traced(scene)
    blurred = rmse(mask(scene, backend_name, map_size=512), truth)
    hard = [rmse(mask(scene, backend_name, SIZE, filter=Hard(), map_size=n), truth) for n in (256, 1024, 2048)]
    assert min(hard) > 1.4 * blurred
    assert hard[-1] > 0.95 * hard[-2]


def texels_in(body: Sequence[object]) -> int:
    """How many texels a program reads; of two branches both count."""
    read = 0
    for step in body:
        if isinstance(step, LoadTexel):
            read += 1
        elif isinstance(step, For):
            read += step.trips * texels_in(step.body)
        elif isinstance(step, If):
            read += texels_in(step.then) + texels_in(step.orelse)
    return read


def texels_moved(scene: pg.Scene, size: tuple[int, int], **options: Any) -> int:
    """Texels that a frame writes, and that its full-screen passes read."""
    moved = 0
    with pg.compile(soft_shadow(scene, **options), backend="null", size=size) as program:
        for step in program.plan.steps:
            if isinstance(step, (PixelStep, DrawStep)):
                each = len(step.writes) + (texels_in(step.program.body) if isinstance(step, PixelStep) else 0)
                moved += step.size[0] * step.size[1] * each
    return moved


def test_a_larger_map_costs_more_than_the_blur() -> None:
    blur = texels_moved(blurring.usual(), SIZE, map_size=512, filter=Blur())
    sizes = (512, 1024, 2048, 4096)
    hard = [texels_moved(blurring.usual(), SIZE, map_size=side, filter=Hard()) for side in sizes]
    assert hard == sorted(hard)
    assert hard[0] < blur < hard[-1]


@pytest.mark.slow
def test_with_a_constant_blur_shadows_vanish_in_the_distance_and_with_ours_they_stay(backend_name: str) -> None:
    case = blurring.dolly(backend_name)
    masses = [values(case, f"shadow mass from {distance:g} units away") for distance in blurring.DOLLY]
    for truth, _, ours in masses:
        assert ours == pytest.approx(truth, rel=0.1)
    constant = [failing for _, failing, _ in masses]
    assert constant == sorted(constant, reverse=True)
    assert constant[2] < 0.5 * masses[2][0]
    assert constant[-1] < 0.05 * masses[-1][0]
    _, constant_spread, our_spread = values(case, "spread of the mass over a dolly from 10 to 12 units, of its mean")
    assert constant_spread > 2.0 * our_spread


def test_any_number_of_lights_is_blurred_once() -> None:
    def passes(count: int) -> dict[str, int]:
        blurred = soft_shadow(blurring.under_lights(count), filter=Blur())
        with pg.compile(blurred, backend="null", size=(64, 36)) as program:
            names = [name for step in program.plan.steps for name in (step.name, *getattr(step, "fused", ()))]
        return {word: sum(word in name for name in names) for word in ("blur", "shadow map")}

    one, eight = passes(1), passes(8)
    assert one["blur"] == eight["blur"] > 0
    assert eight["shadow map"] == 8 * one["shadow map"]


def test_a_light_more_costs_a_part_of_the_first_frame() -> None:
    one, eight = (
        texels_moved(blurring.under_lights(count), blurring.SPEED_SIZE, map_size=512, filter=Blur()) for count in (1, 8)
    )
    assert 0 < (eight - one) / 7 < 0.15 * one


def test_every_object_casts_and_receives(backend_name: str) -> None:
    case = blurring.everything(backend_name)
    for figure in lines(case, "mean share that arrives on"):
        assert figure.remedy == pytest.approx(figure.truth, abs=0.03), figure.what
    # the floor, the pillar, the slab and the cube are all shadowed by something
    shadowed = [figure.truth for figure in lines(case, "mean share that arrives on") if figure.truth is not None]
    assert sum(truth < 0.97 for truth in shadowed) >= 4
    _, floor_only, ours = values(case, "RMSE to rays")
    assert ours < 0.25 * floor_only
