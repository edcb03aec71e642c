"""SMAA against its own shaders on OpenGL, and against edges of many samples."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import passgraph as pg
from passgraph.effects import smaa
from passgraph.effects.antialias.smaa_areas import areas
from passgraph.srgb import linear_to_srgb, srgb_to_linear
from tests.conftest import DEVICES, require
from tests.effects.smaa_original import FOLDER, Original
from tests.offscreen import offscreen

Picture = NDArray[np.float32]
FRAME = pg.Input("frame")
INTO = pg.target("smaa", "rgba32f")
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)
STEP = 1.01 / 255.0
#: Threshold, steps, diagonal steps, corner.
PRESETS: dict[str, tuple[float, int, int, float]] = {
    "low": (0.15, 4, 0, 1.0), "medium": (0.1, 8, 0, 1.0), "high": (0.1, 16, 8, 0.25), "ultra": (0.05, 32, 16, 0.25),
}  # fmt: skip


def shown(graph: Any, backend: str, **given: Any) -> Picture:
    with pg.compile(graph, backend=backend, non_finite="keep") as program:
        return np.array(program(**given)["smaa"])


def of_two(inside: Any) -> Picture:
    made = np.where(inside[..., None], np.float32(0.9), np.float32(0.1)) * np.ones(4, np.float32)
    made[..., 3] = 1.0
    return np.asarray(made, np.float32)


def pictures() -> dict[str, Picture]:
    """Shapes with edges at all angles, corners, and noise of two values and of all."""
    y, x = np.mgrid[:53, :71]
    random = np.random.default_rng(0)
    coarse = random.random((14, 18)) < 0.5
    return {
        "disc": of_two(np.hypot(x - 31.0, y - 26.0) < 22.3),
        "lines": of_two(((x + 3 * y) % 17 < 6) | ((5 * x - y) % 43 < 9)),
        "blocks": of_two(np.kron(coarse, np.ones((4, 4), np.bool_))[:53, :71]),
        "dots": of_two(random.random((53, 71)) < 0.5),
        "noise": random.random((53, 71, 4)).astype(np.float32),
        "one row": of_two(random.random((1, 40)) < 0.5),
        "one pixel": np.full((1, 1, 4), 0.5, np.float32),
    }


@pytest.fixture(scope="module")
def originals() -> Iterator[dict[str, Original]]:
    require("gl")
    with offscreen() as context:
        yield {name: Original(context, *preset) for name, preset in PRESETS.items()}


@pytest.mark.sampled
@pytest.mark.gl
@pytest.mark.parametrize("picture", pictures())
@pytest.mark.parametrize("preset", PRESETS)
def test_it_draws_what_its_shaders_draw(preset: str, picture: str, originals: dict[str, Original]) -> None:
    """Within a step of the 8 bits in which shares are kept; where two shares are a step apart, either may win."""
    frame = pictures()[picture]
    with originals[preset].context:
        expected = originals[preset](frame)
    made = shown(smaa(FRAME, *PRESETS[preset], into=INTO), "numpy", frame=frame)
    apart = (np.abs(made - expected) > STEP).any(axis=2)
    assert apart.sum() <= (3 if picture == "noise" else 0)
    if picture not in ("one row", "one pixel"):
        assert np.abs(expected - frame).max() > 0.1


@every_backend
@pytest.mark.parametrize("preset", ["medium", "high"])
@pytest.mark.slow
def test_every_backend_draws_the_same(preset: str, backend_name: str) -> None:
    """Edges and areas are of few bits: a step of them, and no more, hangs on rounding."""
    for name in ("lines", "dots", "one row", "one pixel"):
        frame = pictures()[name]
        expected, made = (
            shown(smaa(FRAME, *PRESETS[preset], into=INTO), backend, frame=frame) for backend in ("numpy", backend_name)
        )
        np.testing.assert_allclose(made, expected, rtol=0.0, atol=STEP)


def test_areas_are_those_of_the_published_table() -> None:
    with Image.open(FOLDER / "smaa_area.png") as file:
        published = np.asarray(file)[..., :2].astype(np.int64)
    assert np.abs(areas().astype(np.int64) - published).max() <= 1


@pytest.mark.parametrize("preset", ["medium", "high"])
def test_edges_come_near_those_of_many_samples(preset: str) -> None:
    """Shapes sampled 16 by 16 times a pixel; without antialiasing the error is half as large again and more."""

    def drawn(samples: int) -> Picture:
        at = (np.arange(64 * samples) + 0.5) / samples
        x, y = np.meshgrid(at, at)
        inside = (np.hypot(x - 20.2, y - 21.7) < 15.3) | ((0.3 * x + y > 52.0) & (x - 0.2 * y > 12.0))
        share = inside.reshape(64, samples, 64, samples).mean(axis=(1, 3))
        return (0.1 + 0.8 * share[..., None] * np.ones(4)).astype(np.float32)

    frame, truth = drawn(1), drawn(16)
    made = shown(smaa(FRAME, *PRESETS[preset], into=INTO), "numpy", frame=frame)
    error, without = (float(np.sqrt(np.mean((one - truth) ** 2))) for one in (made, frame))
    assert error < 0.65 * without


@every_backend
def test_what_has_no_edges_keeps_every_bit(backend_name: str) -> None:
    y, x = np.mgrid[:23, :31]
    ramp = (0.01 * x + 0.02 * y)[..., None] * np.array([1.0, 2.0, -3.0, 0.5]) - 0.1
    frame = np.asarray(ramp, np.float32)
    np.testing.assert_array_equal(shown(smaa(FRAME, into=INTO), backend_name, frame=frame), frame)


@every_backend
def test_light_has_the_edges_of_what_displays_show(backend_name: str) -> None:
    """In linear light a dark step is small; it is smoothed as the same step in encoded colors."""
    inside = pictures()["lines"][..., :1] > 0.5
    encoded = np.where(inside, np.float32(0.3), np.float32(0.05)) * np.ones(4, np.float32)
    light = np.asarray(srgb_to_linear(encoded), np.float32)
    plain = shown(smaa(FRAME, into=INTO), backend_name, frame=encoded)
    made = shown(smaa(FRAME, linear=True, into=INTO), backend_name, frame=light)
    np.testing.assert_array_equal((made != light).any(axis=2), (plain != encoded).any(axis=2))
    assert np.abs(np.asarray(linear_to_srgb(made[..., :3])) - encoded[..., :3]).max() > 0.05


@every_backend
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_bad_light_reaches_its_neighbors_at_most(value: float, backend_name: str) -> None:
    frame = pictures()["disc"]
    frame[20, 30, :3] = value
    bad = ~np.isfinite(shown(smaa(FRAME, into=INTO), backend_name, frame=frame)).all(axis=2)
    assert bad[20, 30]
    assert bad.sum() <= 5
    assert not bad[:19].any()
    assert not bad[22:].any()


def test_alpha_is_smoothed_with_its_color() -> None:
    frame = pictures()["lines"]
    frame[...] = frame[..., :1]
    made = shown(smaa(FRAME, into=INTO), "numpy", frame=frame)
    np.testing.assert_array_equal(made[..., 3], made[..., 0])
