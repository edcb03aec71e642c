"""One bad pixel stays where it is: NaN and infinity in a picture, infinite depth in every effect that reads depth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.effect_table import EFFECTS

HEIGHT, WIDTH = 32, 48
RANDOM = np.random.default_rng(1)
FRAME = np.float32(0.1) + np.float32(0.8) * RANDOM.random((HEIGHT, WIDTH, 4), np.float32)
FRAME[..., 3] = 1
DEPTH = (3 + np.linspace(0, 2, WIDTH) + 0.2 * RANDOM.random((HEIGHT, WIDTH))).astype(np.float32)[..., None]
OF_PICTURES = [name for name, effect in EFFECTS.items() if effect.takes.startswith("picture")]
WITH_DEPTH = [name for name in OF_PICTURES if EFFECTS[name].takes == "picture+depth"]
#: Most pixels that one bad pixel makes bad, of effects that mix it with its neighbors by what they are.
REACH = {
    "gaussian-blur": 19 * 19, "depth-aware-blur": 15 * 15, "chromatic-aberration": 12, "dirty-lens": 4,
    "unsharp": 11 * 11, "sobel": 9, "cas": 5, "morphology": 9, "lens-distortion": 4, "pixelate": 64, "resize": 6 * 6,
    "fsr1": 10 * 10, "smaa": 5, "tilt-shift": 49 * 49, "radial-blur": 32, "crt": 32 * 24,
}  # fmt: skip


def results(name: str, frame: NDArray[Any], depth: NDArray[Any], **options: Any) -> NDArray[np.float32]:
    effect = EFFECTS[name]
    given: Mapping[str, Any] = {"frame": frame}
    targets = [pg.Input("frame", "rgba32f", (WIDTH, HEIGHT))]
    if effect.takes == "picture+depth":
        targets.append(pg.Input("depth", "r32f", (WIDTH, HEIGHT)))
        given = {"frame": frame, "depth": depth}
    with pg.compile(effect.build(*targets, **options), "numpy", non_finite="keep") as program:
        (picture,) = program(**given).values()
    return np.asarray(picture)


@pytest.mark.sampled
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", OF_PICTURES)
def test_a_bad_pixel_spreads_no_farther_than_the_effect_mixes(name: str, value: float) -> None:
    frame = FRAME.copy()
    frame[15, 20, :3] = value
    bad = ~np.isfinite(results(name, frame, DEPTH)).all(axis=-1)
    assert bad.sum() <= REACH.get(name, 1)


@pytest.mark.sampled
@pytest.mark.parametrize("value", [np.inf, np.nan, -1.0])
@pytest.mark.parametrize("name", WITH_DEPTH)
def test_depth_that_is_no_distance_is_sky(name: str, value: float) -> None:
    """Depth 0 says that nothing is drawn; other tools say infinity."""
    options = {"sky": True} if name == "fog" else {}
    away = DEPTH > 4
    zero = np.where(away, np.float32(0), DEPTH)
    other = np.where(away, np.float32(value), DEPTH)
    expected = results(name, FRAME, zero, **options)
    assert np.isfinite(expected).all()
    assert np.array_equal(results(name, FRAME, other, **options), expected)


def test_infinite_depth_needs_no_option_and_an_infinite_picture_does() -> None:
    """What one pass turns into sky needs no refusal; what any other pass reads does."""
    fog = EFFECTS["fog"].build(
        pg.Input("frame", "rgba32f", (WIDTH, HEIGHT)), pg.Input("depth", "r32f", (WIDTH, HEIGHT))
    )
    depth = np.where(DEPTH > 4, np.float32(np.inf), DEPTH)
    with pg.compile(fog, "numpy") as program:
        assert np.isfinite(np.asarray(program(frame=FRAME, depth=depth))).all()
        frame = FRAME.copy()
        frame[0, 0, 0] = np.inf
        with pytest.raises(pg.InputError, match="input 'frame': 1 of"):
            program(frame=frame, depth=depth)


def test_fxaa_of_linear_light_leaves_infinity_where_it_is() -> None:
    from passgraph.effects.antialias.fxaa import fxaa

    frame = FRAME.copy()
    frame[15, 20, :3] = np.inf
    made = fxaa(pg.Input("frame", "rgba32f", (WIDTH, HEIGHT)), linear=True, into=pg.target("out", "rgba32f"))
    with pg.compile(made, "numpy", non_finite="keep") as program:
        assert not np.isnan(program(frame=frame)["out"]).any()
