"""Conformance tells what a divergent picture looks like: each mistake of ports by its name, and no other's."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from passgraph.backends.base import quantised
from passgraph.backends.reference import ReferenceBackend
from passgraph.formats import FORMATS
from passgraph.plan.data import PixelStep
from passgraph.srgb import linear_to_srgb, srgb_to_linear
from passgraph.verify.conformance import cases, judge
from passgraph.verify.conformance.case import Picture, values
from passgraph.verify.conformance.causes import Found, cause
from passgraph.verify.oracle.interval import Interval, rounded

Mistake = Callable[[Picture], Picture]
SIZE = (9, 7)


def within(picture: Picture) -> Interval:
    """A rounding either way."""
    exact = picture.astype(np.float64)
    with np.errstate(over="ignore"):
        return rounded(exact, exact, np.isnan(exact), 2.0)


def told(mistake: Mistake, form: str = "rgba32f", size: tuple[int, int] = SIZE, expected: Any = None) -> str:
    format_ = FORMATS[form]
    if expected is None:
        expected = quantised(np.clip(values(size, format_.channels), 0.0, 1.0), format_)
    got = np.ascontiguousarray(mistake(expected.copy()), np.float32)
    return cause(Found(got, expected, within(expected), format_))


def brighter_edge(picture: Picture) -> Picture:
    picture[0] += 0.25
    return picture


def colours(curve: Callable[[Picture], Picture]) -> Mistake:
    form = FORMATS["rgba8_srgb"]
    return lambda p: quantised(np.concatenate([curve(p[..., :3]), p[..., 3:]], axis=-1), form)


def rounded_down(picture: Picture) -> Picture:
    return np.maximum(picture - np.float32(1 / 255), 0.0)


def one_channel(picture: Picture) -> Picture:
    picture[2:5, 2:5, 3] = 2.0
    return picture


@pytest.mark.parametrize(
    ("says", "form", "mistake"),
    [
        ("All of it is 0: nothing was written", "rgba32f", np.zeros_like),
        ("Upside down it would be within", "rgba8", lambda p: p[::-1]),
        ("Mirrored it would be within", "rgba16f", lambda p: p[:, ::-1]),
        ("Moved by -1 column it would be within", "rg32f", lambda p: np.roll(p, 1, axis=1)),
        ("Moved by +1 column, -1 row it would", "r32f", lambda p: np.roll(p, (-1, 1), axis=(1, 0))),
        ("With red and blue exchanged", "rgba8", lambda p: p[..., [2, 1, 0, 3]]),
        ("With red and blue exchanged", "rgb32f", lambda p: p[..., ::-1]),
        ("As 1 - depth it would be within", "depth32f", lambda p: 1 - p),
        ("As depth / 2 + 1/2 it would", "depth32f", lambda p: p * 2 - 1),
        ("It is encoded as sRGB once too often", "rgba8_srgb", colours(linear_to_srgb)),
        ("It is decoded from sRGB once too often", "rgba8_srgb", colours(srgb_to_linear)),
        ("It is off by one step of r8, rounded down", "r8", rounded_down),
        ("It is off by 1.45e+03 units in the last place", "rgba32f", lambda p: p * np.float32(1 + 2.0**-13.5)),
        ("Only pixels at the edge, 1 wide, are wrong", "rgba32f", brighter_edge),
        ("Only channel 3 is wrong", "rgba32f", one_channel),
        ("", "rgba32f", lambda p: np.where(p > 0.5, p + 0.25, p - 0.25)),
    ],
)  # fmt: skip
def test_a_mistake_is_called_by_its_name(says: str, form: str, mistake: Mistake) -> None:
    made = told(mistake, form)
    assert made.startswith(says) and bool(made) == bool(says), made


def test_rows_and_columns_exchanged_are_told_of_squares() -> None:
    assert told(lambda p: p.transpose(1, 0, 2), size=(6, 6)).startswith("With rows and columns exchanged")


@pytest.mark.parametrize(
    ("says", "right", "wrong"),
    [
        ("Only NaN is missing", np.nan, 0.0),
        ("Only NaN is there too often", 0.5, np.nan),
        ("Only infinity is missing", np.inf, 3e38),
    ],
)
def test_kinds_of_numbers_are_told(says: str, right: float, wrong: float) -> None:
    expected, got = values(SIZE), values(SIZE)
    expected[3, 4, 1], got[3, 4, 1] = right, wrong
    assert cause(Found(got, expected, within(expected), FORMATS["rgba32f"])).startswith(says)


def test_what_the_run_before_made_is_told() -> None:
    now, before = values(SIZE, seed=1), values(SIZE, seed=2)
    found = Found(before, now, within(now), FORMATS["rgba32f"], within(before))
    assert cause(found).startswith("It is what the run before should have made")


@pytest.mark.parametrize("form", ["r8", "rgba16f", "rgb32f", "rgba8_srgb", "depth32f"])
@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, 3.4e38, -1.0])
def test_hard_numbers_and_small_pictures_are_told_of_quietly(form: str, number: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for size in ((1, 1), (1, 3), (2, 2)):
            same = np.full((size[1], size[0], FORMATS[form].channels), number, np.float32)
            assert isinstance(told(lambda p: np.full_like(p, number), form, size), str)
            assert isinstance(told(lambda p: np.full_like(p, 0.5), form, size, same), str)


class UpsideDown(ReferenceBackend):
    name = "upside down"

    def pixel_pass(self, step: PixelStep) -> Any:
        inner = super().pixel_pass(step)

        def run(outputs: Any, images: Any, block: Any) -> None:
            inner(outputs, images, block)
            for output in outputs:
                output.pixels[...] = output.pixels[::-1].copy()

        return run


def test_a_verdict_says_what_was_read_and_what_is_wrong() -> None:
    (case,) = (case for case in cases(["operations"]) if case.name == "add")
    (verdict,) = judge(case, [UpsideDown()])
    text = str(verdict)
    assert "is allowed, given a = (" in text and ", given b = (" in text
    assert text.endswith(". Upside down it would be within its bounds: row 0 is on top")
