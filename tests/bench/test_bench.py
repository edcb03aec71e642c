"""Methods side by side: what is measured is what is said."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from math import hypot, isnan, pi
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.bench import timing
from passgraph.bench.bench_scenes import BOX_HEIGHT, BOX_LIGHT, SCENES, scene_named
from passgraph.bench.metrics import front
from passgraph.bench.timing import frame_times, nudged
from passgraph.bench.truth import Truth, truth_of
from passgraph.run.profile import PassTime, Profile
from passgraph.truth import first_surfaces

SIZE = (96, 54)


def flat_truth(share: np.ndarray) -> Truth:
    everywhere = np.ones(share.shape, bool)
    return Truth(share.astype(np.float32), everywhere, np.ones(share.shape), 0.0, 1)


def test_errors_are_those_of_known_pictures() -> None:
    for package in ("skimage", "flip_evaluator"):
        pytest.importorskip(package)
    from passgraph.bench.metrics import compared

    share = np.zeros((32, 40), np.float32)
    share[:, 20:] = 1.0
    share[:, 18:22] = 0.5
    truth = flat_truth(share)
    same = compared(share, truth, truth.counts)
    assert (same.rmse, same.penumbra_rmse, same.ssim, same.flip, same.false_lit, same.false_dark) == (0, 0, 1, 0, 0, 0)
    off = share.copy()
    off[:, :4] = 0.2  # a tenth of the picture falsely lit
    off[:, 36:] = 0.7  # and a tenth falsely dark
    off[:, 18:22] = 0.4
    got = compared(off, truth, truth.counts)
    assert got.rmse == pytest.approx(hypot(0.2, 0.3, 0.1) / 10**0.5, rel=1e-6)
    assert got.penumbra_rmse == pytest.approx(0.1, rel=1e-6)
    assert (got.false_lit, got.false_dark) == (0.1, 0.1)
    assert got.ssim < 0.99
    assert got.flip > 0.02
    # what does not count changes nothing
    counts = truth.counts.copy()
    counts[:, :4] = counts[:, 36:] = counts[:, 18:22] = False
    assert compared(off, truth, counts).rmse == 0.0
    assert isnan(compared(off, truth, counts).penumbra_rmse)


def test_the_front_is_what_nothing_beats() -> None:
    rng = np.random.default_rng(3)
    points = [tuple(p) for p in rng.random((60, 2)).tolist()]
    kept = front(points)  # type: ignore[arg-type]
    for i, (x, y) in enumerate(points):
        beaten = any(a <= x and b <= y and (a, b) != (x, y) for a, b in points)
        assert (i in kept) == (not beaten)
    assert kept == sorted(kept, key=lambda i: points[i][0])


@pytest.mark.sampled
@pytest.mark.parametrize("name", [name for name, scene in SCENES.items() if not scene.needs])
def test_every_shipped_scene_has_penumbrae(name: str) -> None:
    truth = truth_of(scene_named(name), (192, 108), 16)
    assert truth.penumbra.sum() > 100
    assert truth.counts.mean() > 0.3


def test_the_box_has_its_analytic_truth() -> None:
    """Floor behind the middle of the box's upper edge sees a disc cut by a chord: a circular segment."""
    scene, size = scene_named("box"), (160, 90)
    truth, seen = truth_of(scene, size, 256), first_surfaces(scene, size)
    x, _, z = np.moveaxis(seen.positions + seen.origin, 2, 0)
    # light at 45 degrees: the edge at (0.5, 1) throws the light's middle to 1.5; its image there is BOX_LIGHT times
    # the distance wide along the light's own axis, which the floor sees stretched by sqrt(2)
    along = BOX_LIGHT * (BOX_HEIGHT * 2**0.5)
    # across the direction of the light, a floor point lies so far from the plane through the edge
    offset = (x - 1.5) / 2**0.5 / along
    middle = truth.counts & (seen.node == 0) & (abs(z) < 0.2) & (abs(offset) < 0.9)
    expected = 0.5 + (offset * np.sqrt(1 - np.clip(offset, -1, 1) ** 2) + np.arcsin(np.clip(offset, -1, 1))) / pi
    assert middle.sum() > 40
    # the distance to the edge changes over the penumbra by BOX_LIGHT of itself
    assert abs(truth.share - expected)[middle].max() < BOX_LIGHT / 2


def test_frames_are_timed(backend_name: str) -> None:
    from passgraph.backends.registry import open_backend
    from passgraph.bench.methods import METHODS

    scene = scene_named("box")
    made = METHODS["hard"].make(scene, 64)
    with open_backend(backend_name) as device:
        with pg.compile(made.picture, backend=device, size=SIZE) as program:
            times = frame_times({"one": program, "again": program}, scene.lights[0], 3)
        assert min(times["one"].wall, times["again"].wall) > 0.0


def test_a_time_is_the_median_ratio_to_the_first_call(monkeypatch: pytest.MonkeyPatch) -> None:
    """The machine is twice as slow in every other round, which changes no ratio; processor time goes at half pace."""
    now = [0.0]
    monkeypatch.setattr(timing.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(timing.time, "process_time", lambda: now[0] / 2.0)

    def takes(seconds: float) -> Callable[[int], None]:
        def call(frame: int) -> None:
            now[0] += seconds * (1 + frame % 2)

        return call

    times = timing.times_in_turn({"first": takes(1.0), "longer": takes(3.0)}, 5)
    assert times["first"].wall == pytest.approx(1000.0)  # three of five rounds are quick ones
    assert times["longer"].wall == pytest.approx(3.0 * times["first"].wall)
    assert times["longer"].cpu == pytest.approx(times["longer"].wall / 2.0)


def test_the_light_moves_by_next_to_nothing() -> None:
    light = scene_named("box").lights[0]
    assert nudged(light, 0) == light
    assert 0.0 < np.linalg.norm(np.subtract(nudged(light, 1).direction, light.direction)) < 2e-4


def test_a_scene_is_measured_and_reported(tmp_path: Path) -> None:
    for package in ("skimage", "matplotlib"):
        pytest.importorskip(package)
    from passgraph.bench.bench_report import write_report
    from passgraph.bench.measure import Settings, measure

    settings = Settings((64, 36), (64,), ("hard", "pcss-8", "five-pass"), ("numpy",), 1, 256)
    result = measure("sphere", settings)
    assert [row.method for row in result.rows] == ["hard", "pcss-8", "five-pass"]
    # the map is drawn anew although the light is a static value: a light that moves does so
    assert result.rows[0].passes.passes[0].name == "shadow map of light"
    assert min(each.seconds for each in result.rows[0].passes.passes) > 0.0
    write_report([result], settings, tmp_path)
    assert (tmp_path / "sphere-numpy.png").stat().st_size > 5000
    assert {p.name for p in (tmp_path / "pictures").iterdir()} >= {"sphere-truth.png", "sphere-hard.png"}
    table = list(csv.DictReader(io.StringIO((tmp_path / "results.csv").read_text())))
    made = json.loads((tmp_path / "results.json").read_text())
    assert float(table[0]["rmse"]) == pytest.approx(made["scenes"][0]["rows"][0]["rmse"], rel=1e-4)
    page = (tmp_path / "report.html").read_text()
    assert "sphere-numpy.png" in page and "pictures/sphere-pcss-8.png" in page


def test_draws_of_one_name_are_summed() -> None:
    from passgraph.bench.bench_report import milliseconds

    passes = [PassTime(name, (name,), (8, 8), s, 0.25) for name, s in (("draw", 0.25), ("draw", 0.5), ("shade", 1.0))]
    assert milliseconds(Profile("numpy", 1, 1.75, tuple(passes))) == {"draw": 750.0, "shade": 1000.0}


@pytest.mark.parametrize(("name", "message"), [("nowhere", "there is no bench scene"), ("no.obj", "no.obj")])
def test_unknown_scenes_are_refused(name: str, message: str) -> None:
    with pytest.raises(pg.InputError, match=message):
        scene_named(name)


def test_values_that_are_not_finite_in_one_picture_alone_are_no_small_difference() -> None:
    pytest.importorskip("skimage")
    from passgraph.bench.versions import difference

    true = np.full((4, 4, 3), 0.5, np.float32)
    true[0, 0] = np.nan
    made = true.copy()
    assert difference(made, true).rmse == 0.0  # where both hold NaN nothing differs
    made[1, 1, 0] = np.inf
    assert isnan(difference(made, true).rmse)
    assert difference(made, true).largest == np.inf
