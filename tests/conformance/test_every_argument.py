"""Errors of functions over all float32 arguments, and the float64 values that they are measured against."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.registry import open_backend
from passgraph.commands.entry import run
from passgraph.language.operations import OPERATIONS
from passgraph.verify import every_argument
from passgraph.verify.every_argument import ARGUMENTS, OF_ONE_NUMBER, EveryError, measure_every
from passgraph.verify.function_errors import program_of

RECORDS = json.loads((Path(__file__).parents[2] / "docs" / "every_argument.json").read_text(encoding="utf-8"))
_EXACT: dict[str, Any] = {
    "inversesqrt": lambda x: 1 / mpmath.sqrt(x), "exp2": lambda x: mpmath.mpf(2) ** x,
    "fract": lambda x: min(mpmath.frac(x), 1 - mpmath.mpf(2) ** -24),
    "log2": lambda x: mpmath.log(x, 2),
}  # fmt: skip


def exact(name: str, x: float) -> mpmath.mpf:
    with mpmath.workprec(200):
        return _EXACT.get(name, getattr(mpmath, name, None))(mpmath.mpf(x))


def ulps_apart(value: float, name: str, x: float) -> float:
    """The error of a value in units in the last place of the exact result."""
    truth = exact(name, x)
    unit = np.spacing(np.float32(max(abs(float(truth)), 2.0**-126)))
    with mpmath.workprec(200):
        return float(abs(mpmath.mpf(value) - truth) / mpmath.mpf(float(unit)))


@pytest.fixture(scope="module", params=["numpy", "gl"])
def backend(request: pytest.FixtureRequest) -> Iterator[Backend]:
    with open_backend(request.param) as opened:
        yield opened


class Wrong(ReferenceBackend):
    """Results are a thousandth too large."""

    def download(self, storage: Any) -> Any:
        return super().download(storage) * np.float32(1.001)


@pytest.mark.parametrize("name", OF_ONE_NUMBER)
def test_float64_is_exact_beside_a_unit_of_float32(name: str) -> None:
    """At numbers of all sizes in the domain, by their bits, and in the range in which programs use the function."""
    row, random = OPERATIONS[name], np.random.default_rng(1)
    domain, (low, high) = row.domain_of(0), row.ordinary(0)
    numbers = random.integers(0, 2**32, 4000, dtype=np.uint64).astype(np.uint32).view(np.float32)
    inside = numbers[(numbers >= domain.low) & (numbers <= domain.high) & (np.abs(numbers) >= 2.0**-126)][:200]
    samples = np.concatenate([inside, random.uniform(low, high, 200).astype(np.float32)])
    with np.errstate(all="ignore"):
        values = row.reference(samples.astype(np.float64))
    for x, value in zip(samples.tolist(), values.tolist(), strict=True):
        if np.isfinite(value) and abs(value) < 3e38:
            assert ulps_apart(value, name, x) < 1e-6, x


@pytest.mark.parametrize("name", RECORDS)
def test_recorded_errors_are_those_of_mpmath_and_as_promised(name: str) -> None:
    for device, record in RECORDS[name].items():
        row, x = OPERATIONS[name], record["at"]
        with open_backend(device) as backend:
            output = pg.kernel(source=f"def f(p: Image) -> float: return {name}(p[0, 0].x)")(pg.Input("p", "r32f"))
            with pg.compile(output, backend) as program:
                value = float(program(p=np.full((1, 1, 1), x, np.float32))["f"][0, 0, 0])
        found = ulps_apart(value, name, x)
        assert found == pytest.approx(record["largest"], rel=1e-5)
        unit = float(np.spacing(np.float32(abs(float(exact(name, x))))))
        assert found * unit <= row.ulp * unit + row.absolute
        assert record["outside"] == 0


def test_every_argument_is_measured_once(backend: Backend, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reference with one wrong value is found, wherever it is."""
    monkeypatch.setattr(every_argument, "ARGUMENTS", 1 << 14)
    row = OPERATIONS["exp"]
    for place in (0, 4097, (1 << 14) - 1):
        odd = np.array(place, np.uint32).view(np.float32)

        def reference(x: np.ndarray, odd: np.ndarray = odd) -> np.ndarray:
            return np.where(x == odd, 1.25, np.exp(x))

        monkeypatch.setitem(OPERATIONS, "exp", replace(row, reference=reference))
        monkeypatch.setattr(every_argument, "SMALLEST_NORMAL", 0.0)
        *_, found = measure_every(backend, "exp", side=16)
        assert (found.count, found.worst_at) == (1 << 14, odd)
        assert found.worst == pytest.approx(0.25 / 2.0**-23)


def test_results_outside_of_bounds_are_counted() -> None:
    (_, found) = islice(measure_every(Wrong(), "exp", side=16), 2)
    assert found.count == 512
    assert found.outside == 512
    assert found.outside_at is not None
    assert "512 outside of bounds" in str(found)


@pytest.mark.parametrize("name", ["log2", "inversesqrt", "sin", "exp", "acosh"])
def test_denormals_infinities_and_nan_are_held_to_the_oracles_bounds(name: str, backend: Backend) -> None:
    special = [0.0, -0.0, 1e-40, -1e-40, 2.0**-149, np.inf, -np.inf, np.nan, 1e30, -1e30, 8193.0, 0.5]
    x, row = np.resize(np.array(special, np.float32), 64), OPERATIONS[name]
    with program_of(backend, row, "exact", "r32f") as program:
        results = np.asarray(program(samples=x.reshape(8, 8, 1))["measured"], np.float32).reshape(-1)
    begun = EveryError(name, "exact", "")
    assert every_argument._with_block(begun, row, None, x, results).outside == 0
    if name == "exp":  # bounded everywhere
        wrong = np.where(np.isnan(results), np.float32(-7.0), np.float32(np.nan))
        assert every_argument._with_block(begun, row, None, x, wrong).outside == len(x)


def test_the_command_prints_what_it_has_when_it_is_interrupted(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: Any) -> Iterator[EveryError]:
        yield EveryError("exp", "exact", "3 ULP", 1 << 30, 0.75, 2.5)
        raise KeyboardInterrupt

    monkeypatch.setattr(every_argument, "measure_every", interrupted)
    assert run(["conform", "-b", "numpy", "--every", "exp"]) == 130
    out, err = capsys.readouterr()
    assert out == "exp: at most 0.750 ULP in 25.0% of all arguments, at 2.5; promised: 3 ULP\n"
    assert err.strip() == "passgraph: interrupted"


def test_the_command_fails_for_results_outside_of_bounds(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = {name: EveryError(name, "exact", "3 ULP", ARGUMENTS, 0.75, 2.5) for name in OF_ONE_NUMBER}
    monkeypatch.setattr(every_argument, "measure_every", lambda _, name, __: [found[name]])
    assert run(["conform", "-b", "numpy", "--every", "all"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(OF_ONE_NUMBER)
    found["log"] = replace(found["log"], outside=7, outside_at=1.5)
    assert run(["conform", "-b", "numpy", "--every", "exp", "--every", "log"]) == 1
    assert capsys.readouterr().out.endswith("; 7 outside of bounds, as at 1.5\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--every", "sine"], "numpy measures no function 'sine' of one number in exact math; those are sqrt, fract,"),
        (["--every", "exp", "--functions"], "leave out one"),
        (["--every", "exp", "--quick"], "--every measures functions and runs no cases"),
    ],
)
def test_wrong_options_of_the_command(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["conform", "-b", "numpy", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_a_backend_without_native_math_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["conform", "-b", "reference", "--every", "all", "--math", "native"]) == 2
    assert "reference computes all functions alike in exact and native math" in capsys.readouterr().err
