"""`Program.profile`: every pass has a row, what runs as one is one row, and shares are of what was timed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.effects import gaussian_blur
from passgraph.run import profile as profile_module
from passgraph.run.profile import PassTime, Profile, Stopwatch

FRAME = np.random.default_rng(2).random((18, 32, 4), np.float32)
BACKENDS = ("numpy", "gl", "opencl", "webgpu", "reference")


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("options", [pg.Options(), pg.Options(fuse=False)])
def test_every_pass_is_in_one_row(backend: str, options: pg.Options) -> None:
    with pg.compile(gaussian_blur(pg.Input("frame"), radius_px=2), backend, options=options) as program:
        before = program(frame=FRAME)["gaussian_blur"].copy()
        found = program.profile(3, frame=FRAME)
        after = program(frame=FRAME)["gaussian_blur"]
        steps = [name for step in program.plan.steps for name in (*getattr(step, "fused", ()), step.name)]
    np.testing.assert_array_equal(before, after)
    assert [name for row in found.passes for name in row.passes] == steps
    assert (found.backend, found.runs) == (backend, 3)
    assert all(row.seconds > 0 and 0 < row.share <= 1 for row in found.passes)
    assert found.rest + sum(row.seconds for row in found.passes) >= found.seconds * 0.999


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that moves by hand."""
    now = [0.0]
    monkeypatch.setattr(profile_module, "perf_counter", lambda: now[0])
    return now


def test_times_are_medians_and_the_device_is_waited_for(clock: list[float]) -> None:
    made = gaussian_blur(pg.Input("frame"))
    with pg.compile(made, "reference") as program:
        program(frame=FRAME)
        first, second = program.plan.steps
        queue: list[float] = []

        def finish() -> None:
            clock[0] += sum(queue)
            queue.clear()

        watch = Stopwatch(finish)
        for one, other in ((1.0, 3.0), (9.0, 3.0), (2.0, 4.0)):

            def steps(one: float = one, other: float = other) -> None:
                queue.append(0.5)  # inputs come in
                watch.step(first, lambda: queue.append(one))
                watch.step(second, lambda: queue.append(other))

            watch.run(steps)
        found = watch.profile("numpy", program.plan, [first, second])
    assert [row.seconds for row in found.passes] == [2.0, 3.0]
    assert found.seconds == 6.5 and found.rest == 1.5
    assert [row.share for row in found.passes] == [2.0 / 6.5, 3.0 / 6.5]
    assert found.passes[0].pixels_per_second == 32 * 18 / 2.0
    lines = str(found).splitlines()
    assert lines[0].split() == ["pass", "size", "ms", "share", "Mpixel/s"]
    assert lines[1].split() == ["gaussian_blur_x", "32x18", "2000.000", "30.8%", "0.000288"]
    assert lines[3].split()[-2:] == ["1500.000", "23.1%"] and lines[4].startswith("a run on numpy, median of 3 ")


def row_of(*names: str) -> str:
    """The first column of the row of passes that run as one."""
    row = PassTime(" + ".join(names), names, (2, 2), 1.0, 1.0)
    return str(Profile("numpy", 1, 1.0, (row,))).splitlines()[1].partition("  ")[0]


def test_what_runs_as_one_is_named_so() -> None:
    with pg.compile(gaussian_blur(pg.Input("frame")), "numpy") as program:
        (row,) = program.profile(1, frame=FRAME).passes
        assert row.name == "gaussian_blur_x + gaussian_blur_y" and row.passes == ("gaussian_blur_x", "gaussian_blur_y")
    point = pg.kernel(source="def half(c: Image) -> vec4: return c[0, 0] * 0.5")
    many = row_of(*(f"a pass with a long name, {number}" for number in range(9)))
    assert "  " not in many and many.startswith(
        "a pass with a long name, 0 + … + a pass with a long name, 8 (9 as one)"
    )
    fused = point(point(pg.Input("frame"), name="inner"), name="outer")
    with pg.compile(fused, "gl") as program:
        (row,) = program.profile(1, frame=FRAME).passes
        assert row.name == "outer [inner]" and row.passes == ("inner", "outer")


def test_static_passes_are_kept_and_checks_are_timed_one_by_one() -> None:
    point = pg.kernel(source="def half(c: Image) -> vec4: return c[0, 0] * 0.5")
    near = pg.kernel(source="def soft(c: Image, d: Image) -> vec4: return c[1, 0] + d[0, 0]")
    made = near(point(pg.Input("still", static=True)), pg.Input("frame"))
    with pg.compile(made, "numpy") as program:
        first, _ = program.profile(2, still=FRAME, frame=FRAME).passes
        assert first.seconds == 0 and first.pixels_per_second == float("inf")
        assert "kept" in str(program.profile(1, still=FRAME, frame=FRAME)).splitlines()[1]
    with pg.compile(gaussian_blur(pg.Input("frame")), "numpy", check_finite=True) as program:
        assert len(program.profile(1, frame=FRAME).passes) == 2


@pytest.mark.parametrize("runs", [0, 1001, 2.5, "3"])
def test_another_number_of_runs_is_refused(runs: object) -> None:
    with pg.compile(gaussian_blur(pg.Input("frame"))) as program:
        with pytest.raises(pg.GraphError, match="profile: runs must be a whole number from 1 to 1000, got"):
            program.profile(runs, frame=FRAME)  # type: ignore[arg-type]
        with pytest.raises(pg.InputError, match="input 'frame' is missing"):
            program.profile()


def test_commands_show_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    pg.save("in.png", FRAME)
    assert run(["apply", "bloom", "in.png", "-o", "out.png", "--profile"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("out.png: 32x18 by numpy") and lines[1].startswith("pass ")
    assert any(line.startswith("bloom_bright") for line in lines) and lines[-1].startswith(
        "a run on numpy, median of 5"
    )
    assert run(["apply", "bloom", "in.png", "in.png", "-o", "out.%02d.png", "--profile"]) == 2
    assert "--profile times the passes on one picture" in capsys.readouterr().err
