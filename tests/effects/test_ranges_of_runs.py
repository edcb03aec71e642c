"""A run value given to an effect is held to the range of the effect's parameter, in every run and every copy."""

from __future__ import annotations

import json
from typing import Annotated, Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import bilateral, vignette
from passgraph.effects.checked import checked
from passgraph.language import Image, vec4

FRAME = np.full((4, 6, 4), 0.5, np.float32)


@pg.kernel
def scaled(color: Image, factor: float) -> vec4:
    return color[0, 0] * factor


@checked
def dimmed(color: pg.Target, share: Annotated[float, pg.Range(0, 1)] | pg.Value | pg.Derived) -> pg.Target:
    made: pg.Target = scaled(color, share, into=pg.target("dimmed", "rgba32f"))
    return made


@checked
def tinted(color: pg.Target, tint: Annotated[tuple[float, ...], pg.Range(0, 2)] | pg.Value) -> pg.Target:
    text = "def tinted(color: Image, tint: vec3) -> vec4: return vec4(color[0, 0].rgb * tint, 1.0)"
    made: pg.Target = pg.kernel(source=text)(color, tint, into=pg.target("tinted", "rgba32f"))
    return made


def refused(program: Any, words: str, **values: object) -> None:
    with program, pytest.raises(pg.InputError) as error:
        program(frame=FRAME, **values)
    assert str(error.value) == words


def test_a_number_outside_of_the_range_is_refused_at_each_run() -> None:
    with pg.compile(dimmed(pg.Input("frame"), pg.Value("share", default=0.5))) as program:
        assert program(frame=FRAME)["dimmed"].max() == 0.25
        assert program(frame=FRAME, share=1.0)["dimmed"].max() == 0.5
        for wrong in (1.5, -0.1, float("nan"), np.float32(2.0)):
            with pytest.raises(pg.InputError, match="dimmed: share must be 0 to 1, got"):
                program(frame=FRAME, share=wrong)
        assert program(frame=FRAME, share=0.0)["dimmed"].max() == 0.0


def test_a_default_is_held_to_the_range_too() -> None:
    made = dimmed(pg.Input("frame"), pg.Value("share", default=3.0))
    refused(pg.compile(made), "dimmed: share must be 0 to 1, got 3.0")


def test_each_component_is_held_to_the_range() -> None:
    made = tinted(pg.Input("frame"), pg.Value("tint", tuple))
    refused(pg.compile(made), "tinted: tint must be 0 to 2, got (1.0, 1.0, 3.0)", tint=(1.0, 1.0, 3.0))


def test_what_a_function_computes_is_held_to_the_range_not_what_it_reads() -> None:
    made = dimmed(pg.Input("frame"), pg.Value("percent").map(lambda percent: percent / 100.0))
    with pg.compile(made) as program:
        assert program(frame=FRAME, percent=50.0)["dimmed"].max() == 0.25
    refused(pg.compile(made), "dimmed: share must be 0 to 1, got 1.5", percent=150.0)


def test_a_handle_in_two_effects_is_held_to_both_and_outside_of_them_to_none() -> None:
    share = pg.Value("share")
    both = dimmed(tinted(pg.Input("frame"), pg.Value("tint", tuple)), share)
    made = scaled(both, pg.Value("tint", tuple).map(lambda tint: tint[0]), into=pg.target("made", "rgba32f"))
    refused(pg.compile(made), "dimmed: share must be 0 to 1, got 2.0", tint=(1.0, 1.0, 1.0), share=2.0)
    with pg.compile(scaled(pg.Input("frame"), share, into=pg.target("free", "rgba32f"))) as program:
        assert program(frame=FRAME, share=2.0)["free"].max() == 1.0
    assert share.limits == ()


def test_ranges_are_in_serialized_graphs() -> None:
    data = json.loads(json.dumps(pg.to_data(dimmed(pg.Input("frame"), pg.Value("share")))))
    assert pg.to_data(pg.from_data(data)) == data
    refused(pg.compile(pg.from_data(data)), "dimmed: share must be 0 to 1, got 2.0", share=2.0)
    with pytest.raises(pg.InputError, match="dimmed: share must be 0 to 1, got"):
        pg.to_data(dimmed(pg.Input("frame"), pg.Value("share")), share=2.0)


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ([["a", {"low": 2.0, "high": 1.0, "unit": "", "above": False, "odd": False}]], "low must be below high"),
        (
            [["a", {"low": "0", "high": 1.0, "unit": "", "above": False, "odd": False}]],
            r"limits\[0\]: must be a number",
        ),
        ([["a", {"low": 0.0}]], r"limits\[0\]: must be an object"),
        ([[1, 2]], r"values\[0\].limits\[0\]"),
        ([["a"]], "a list of 2"),
        (None, "must be a list"),
    ],
)
def test_limits_of_documents_are_read_with_care(limit: object, words: str) -> None:
    data = pg.to_data(dimmed(pg.Input("frame"), pg.Value("share")))
    data["values"][0]["limits"] = limit
    with pytest.raises(pg.InputError, match=words):
        pg.from_data(data)


def test_shipped_effects_refuse_what_they_refuse_as_plain_numbers() -> None:
    frame = pg.Input("frame")
    for made, value, words in (
        (bilateral(frame, 2, pg.Value("x"), 0.4), 0.0, "bilateral: sigma_px must be 0.1 to 100, got 0.0"),
        (vignette(frame, pg.Value("x")), 9.0, "vignette: vertical_fov_rad must be 0.001 to 3.1"),
    ):
        with pg.compile(made) as program, pytest.raises(pg.InputError, match=words):
            program(frame=FRAME, x=value)
