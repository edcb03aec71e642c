"""``passgraph check`` at the ends of the ranges that parameters say: what only fails there is found, and told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference import ReferenceBackend
from passgraph.commands.check import Tries, range_ends
from passgraph.commands.own_file import graphs_of
from passgraph.verify.oracle.time_limit import TimeLimit
from tests.commands.told import Outcome

HEAD = "from typing import Annotated\nimport passgraph as pg\nfrom passgraph import Image, Range, uint, vec2, vec4\n\n"
#: A mean over so many texels, which divides by 0 where they are none.
MEAN = """
@pg.kernel
def mean(color: Image, radius: Annotated[int, Range(0, 3)] = 2, gain: Annotated[float, Range(0.1, 0.3)] = 0.2) -> vec4:
    total = vec4(0.0)
    for i in range(radius):
        total += pg.clamp(color[i, 0], 0.0, 1.0)
    return total / float(radius) * gain
"""


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def checked(capsys: pytest.CaptureFixture[str], text: str, *arguments: str) -> Outcome:
    Path("own.py").write_text(HEAD + text)
    return Outcome(capsys, "check", "own.py", "-b", "numpy", "--size", "8x6", *arguments)


def test_nan_at_an_end_is_found_with_the_value_that_brings_it(capsys: pytest.CaptureFixture[str]) -> None:
    """The reference divides by 0 too, so that every backend conforms."""
    told = checked(capsys, MEAN)
    assert (told.status, told.err) == (1, "")
    assert "within, 0.00% ambiguous" in told.out  # with the defaults
    assert "mean with radius = 0: pass mean, target mean: NaN, in the reference too, at 100.000% of pixels" in told.out
    assert "with its default there is none. There div (own.py:11) may divide by 0" in told.out
    assert "with radius = 3" not in told.out
    assert "mean: tried radius = 2 (its default), 0, 3; gain = 0.2 (its default), 0.1, 0.3\n" in told.out


def test_nan_that_the_default_makes_too_is_not_the_ends(capsys: pytest.CaptureFixture[str]) -> None:
    value = "vec4(pg.vec3(gain), 0.0 / float(pg.pixel().x - 1))"
    text = f"@pg.kernel\ndef off(gain: Annotated[float, Range(0, 1)] = 0.5) -> vec4:\n    return {value}\n"
    told = checked(capsys, text, "--allow-nan")
    assert told.status == 0, told.out
    assert "off: tried gain = 0.5 (its default), 0, 1\n" in told.out


def test_what_leaves_its_bounds_at_an_end_is_found(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A backend that is wrong where the gain is 1, and right where it is half of it."""

    class Wrong(ReferenceBackend):
        def download(self, storage: Any) -> Any:
            made = super().download(storage)
            return made * np.float32(1.25) if (made == 1.0).all() else made

    monkeypatch.setattr("passgraph.backends.registry.open_backend", lambda _: Wrong())
    text = "@pg.kernel\ndef gained(gain: Annotated[float, Range(0, 1)] = 0.5) -> vec4:\n    return vec4(gain)\n"
    told = checked(capsys, text)
    assert told.status == 1
    assert "gained with gain = 1 on reference: diverges first in pass gained, target gained: outside" in told.out
    assert "gained with gain = 0 " not in told.out
    assert "gained: tried gain = 0.5 (its default), 0, 1\n" in told.out


def test_what_cannot_run_at_an_end_is_told_with_it(capsys: pytest.CaptureFixture[str]) -> None:
    text = """
def checked(gain):
    if gain > 1.5:
        raise pg.InputError("the gain is too much for the table")
    return gain

@pg.kernel
def gained(color: Image, gain: Annotated[float, Range(0, 2)]) -> vec4:
    return pg.clamp(color[0, 0], 0.0, 1.0) * gain

gain, color = pg.Value("gain", default=1.0), pg.Input("color")
other = pg.target("other", "rgba32f")
outputs = gained(color, gain), gained(color, gain.map(checked), into=other, name="other")
"""
    told = checked(capsys, text)
    assert told.status == 1
    assert "outputs with gain = 2: " in told.out
    assert "the gain is too much for the table" in told.out


def test_runs_are_bounded_and_what_is_left_out_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    told = checked(capsys, MEAN, "--ends", "1", "--set", "gain=0.2")
    assert told.status == 1
    assert "mean: tried radius = 2 (its default), 0; not tried: radius = 3 (--ends N: more runs)\n" in told.out
    names = [f"p{i}" for i in range(5)]
    many = ", ".join(f"{name}: Annotated[float, Range(0, 1)] = 0.5" for name in names)
    told = checked(capsys, f"@pg.kernel\ndef many({many}) -> vec4:\n    return vec4({' + '.join(names)})\n")
    assert told.status == 0, told.out
    assert "; p3 = 0.5 (its default), 0, 1; not tried: p4 = 0, p4 = 1 (--ends N: more runs)\n" in told.out


def test_no_end_is_tried_when_the_time_is_over(capsys: pytest.CaptureFixture[str]) -> None:
    Path("two.txt").write_text("def two(color: Image, gain: Annotated[float, Range(0, 2)] = 1.0) -> vec4:\n"
                               "    return color[0, 0] * gain\n")  # fmt: skip
    (graph,) = graphs_of(Path("two.txt"), None).values()
    tries = Tries(8, {}, {}, (4, 3), [], 0.01)
    assert tries.passed("two", graph, TimeLimit(0.0), lambda _: None)
    left = "two: tried nothing more; not tried: gain = 0, gain = 2 (--most-seconds N: more time)\n"
    assert capsys.readouterr().out == left


def test_what_is_set_and_what_nobody_wants_is_not_tried(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["--ends", "0"], ["--set", "radius=1", "--set", "gain=0.2"]):
        told = checked(capsys, MEAN, *arguments)
        assert told.status == 0, told.out
        assert "tried" not in told.out


def test_ends_are_numbers_that_the_parameter_takes() -> None:
    """Each by its type: odd ones, whole ones, all numbers of a vector; none where there is no end, or it is refused."""
    parameters = {
        "odd": "Annotated[int, Range(2, 8, odd=True)] = 5",
        "open": "Annotated[float, Range(0, 2, above=True)] = 1.0",
        "whole": "Annotated[int, Range(0.5, 3.5)] = 2",
        "above": "Annotated[int, Range(0, 4, above=True)] = 2",
        "same": "Annotated[float, Range(0, 1)] = 1.0",
        "half": "Annotated[float, Range(-1)] = 0.0",
        "count": "Annotated[uint, Range(None, 4294967295)] = 7",
        "pair": "Annotated[vec2, Range(-0.1, 0.7)] = vec2(0.0)",
        "plain": "float = 0.5",
    }
    signature = ", ".join(f"{name}: {written}" for name, written in parameters.items())
    Path("own.py").write_text(f"{HEAD}@pg.kernel\ndef all_of({signature}) -> vec4:\n    return vec4(plain)\n")
    (graph,) = graphs_of(Path("own.py")).values()
    found = range_ends(graph, {})
    assert [str(end) for end in found] == [
        "odd = 3", "odd = 7", "open = 2", "whole = 1", "whole = 3", "above = 1", "above = 4", "same = 0", "half = -1",
        "count = 4294967295", "pair = -0.1", "pair = 0.7",
    ]  # fmt: skip
    assert found[-1].value == [0.7, 0.7]
    for end in found:  # none of them is refused by its own range
        with pg.compile(dict(graph), backend="reference", size=(1, 1)) as program:
            program.run(**{end.name: end.value})


def test_ends_of_a_value_are_numbers_that_all_of_its_parameters_take() -> None:
    """Odd ones in one and from an even one on in another; above 0 in one and from -1 on in another."""
    text = """
@pg.kernel
def first(taps: Annotated[int, Range(1, 9, odd=True)], gain: Annotated[float, Range(0, 2, above=True)]) -> vec4:
    return vec4(gain * float(taps))

@pg.kernel
def second(taps: Annotated[int, Range(2, 8)], gain: Annotated[float, Range(-1, 3)]) -> vec4:
    return vec4(gain * float(taps))

taps, gain = pg.Value("taps", default=5), pg.Value("gain", default=1.0)
outputs = first(taps, gain), second(taps, gain)
"""
    Path("own.py").write_text(HEAD + text)
    (graph,) = graphs_of(Path("own.py")).values()
    assert [str(end) for end in range_ends(graph, {})] == ["taps = 3", "taps = 7", "gain = 2"]
