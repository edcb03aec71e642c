"""Bounds from the inputs on: what every backend computes lies within, and so does the exact result."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import gaussian_blur, median, tone_map, unsharp
from passgraph.verify.error_bars import Bounds, bounds
from tests.commands.told import Outcome, refused

FRAME = np.random.default_rng(3).random((24, 31, 4), np.float32)
GRAPHS = {"blur": gaussian_blur, "unsharp": unsharp, "tone map": tone_map, "median": median}


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize("backend", ["numpy", "reference", "opencl", "gl"])
def test_every_backend_is_within_them(name: str, backend: str) -> None:
    try:
        program = pg.compile(GRAPHS[name](pg.Input("frame")), backend)
    except pg.DeviceMissingError as error:
        pytest.skip(str(error))
    with program:
        ((result_name, bars),) = bounds(program, frame=FRAME).items()
        result = program(frame=FRAME)[result_name]
    assert (bars.low <= result).all()
    assert (result <= bars.high).all()
    assert np.isfinite(bars.width).all()
    assert np.median(bars.width) < 1e-5


def test_rounding_of_several_passes_adds_up_to_what_exact_arithmetic_allows() -> None:
    """A third of a third: the exact value, by fractions, lies within; the second pass alone would exclude it."""
    third = pg.kernel(source="def third(color: Image) -> vec4: return color[0, 0] / 3.0 + 1000.0")
    back = pg.kernel(source="def back(color: Image) -> vec4: return color[0, 0] - 1000.0")
    shifted = third(pg.Input("frame"), into=pg.target("shifted", "rgba32f"))
    with pg.compile(back(shifted)) as program:
        bars = bounds(program, frame=FRAME)["back"]
    for at in np.ndindex(3, 5, 4):
        exact = Fraction(float(FRAME[at])) / 3
        assert Fraction(bars.low[at]) <= exact <= Fraction(bars.high[at])
    assert bars.width.max() > 1e-5


def test_stored_formats_widen_them() -> None:
    soft = gaussian_blur(pg.Input("frame"), 1.0, into=pg.target("soft", "rgba8"))
    with pg.compile(soft) as program:
        bars = bounds(program, frame=FRAME)["soft"]
    steps = np.rint(bars.width * 255)
    assert set(np.unique(steps)) <= {0.0, 1.0}
    assert np.allclose(steps / 255, bars.width, atol=1e-6)


def test_a_file_has_the_result_and_its_bounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    low = np.full((2, 3, 3), 0.1)  # no float32
    bars = Bounds(low, low + 1e-12, np.zeros((2, 3), bool))
    bars.save("bars.exr", np.full((2, 3, 3), 0.5, np.float32))
    read: dict[str, Any] = {name: pg.load(f"bars.exr:{name}")[..., :3] for name in ("low", "high", "width")}
    assert (pg.load("bars.exr")[..., :3] == 0.5).all()
    assert (read["low"].astype(np.float64) <= bars.low).all()
    assert (read["high"].astype(np.float64) >= bars.high).all()
    with pytest.raises(pg.InputError, match=r"bounds are layers of an OpenEXR file"):
        bars.save("bars.png", low)


def test_what_has_no_accumulated_bounds_is_refused() -> None:
    spec = pg.target("kept", "rgba32f")
    mix = pg.kernel(source="def mix_(a: Image, b: Image, by: float) -> vec4: return mix(a[0, 0], b[0, 0], by)")
    kept = mix(pg.Input("frame"), pg.previous(spec), 0.5, into=spec)
    with pg.compile(kept) as program, pytest.raises(pg.GraphError, match="reads last run"):
        bounds(program, frame=FRAME)
    with pg.compile(gaussian_blur(pg.Input("frame"))) as program, pytest.raises(pg.GraphError, match="program must be"):
        bounds("blur", frame=FRAME)  # type: ignore[arg-type]
    frame, other = (pg.Input(name, "rgba32f", (31, 24)) for name in ("frame", "other"))
    with pg.compile(mix(frame, other, 0.5)) as program:
        program.set("mix_", "by", 0.25)
        with pytest.raises(pg.GraphError, match="make them pg"):
            bounds(program, frame=FRAME, other=FRAME)


def test_check_writes_an_error_map(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    size = "--size", "24x16"
    outcome = Outcome(capsys, "check", "unsharp", "-b", "numpy", *size, "--ends", "0", "--error-map", "bars.exr")
    assert outcome.status == 0, outcome.out + outcome.err
    assert "bars.exr: unsharp with its bounds, at most " in outcome.out
    result, low, high = (pg.load(f"bars.exr{layer}", raw=True) for layer in ("", ":low", ":high"))
    assert (low <= result).all()
    assert (result <= high).all()
    assert "give one that ends in .exr" in refused(capsys, "check", "unsharp", "--error-map", "bars.png")
