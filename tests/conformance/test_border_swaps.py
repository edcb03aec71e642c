"""A backend with another border rule than a pass asks for is told so, by conform and by fuzz."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference import ReferenceBackend
from passgraph.language.border_rules import BORDERS
from passgraph.plan.data import PixelStep
from passgraph.verify.conformance import Case, judge
from passgraph.verify.conformance.case import values
from passgraph.verify.conformance.judging import explain
from passgraph.verify.fuzz import search
from passgraph.verify.oracle.pass_bounds import Passes

SIZE = (9, 7)
TEXT = "def wide(c: Image, d: Image) -> vec4: return c[3, 2] * 0.5 + d.sample(uv() * 1.5).rrra * 0.25"


def graph(of_c: str, of_d: str) -> Mapping[str, pg.Target]:
    read = pg.Input("c").border(of_c), pg.Input("d").border(of_d)
    return {"out": pg.kernel(source=TEXT)(*read, into=pg.target("out", "rgba32f"))}


class Swapped(ReferenceBackend):
    """Runs each pass as that of the same graph under other border rules."""

    name = "swapped"

    def __init__(self, of_c: str, of_d: str, off: float = 0.0) -> None:
        super().__init__()
        (self.other,) = Passes(graph(of_c, of_d), SIZE, [pictures()]).plan.steps
        self.off = off

    def pixel_pass(self, step: PixelStep) -> Any:
        assert isinstance(self.other, PixelStep)
        return super().pixel_pass(replace(step, facts=self.other.facts))

    def download(self, storage: Any) -> Any:
        return super().download(storage) + np.float32(self.off)


def pictures() -> dict[str, Any]:
    return {"c": values(SIZE, seed=1), "d": values(SIZE, seed=2)}


@pytest.mark.parametrize("rule", [name for name in BORDERS if name != "mirror"])
def test_another_rule_of_an_image_is_named(rule: str) -> None:
    case = Case("own", "borders", lambda: graph("mirror", "zero"), SIZE, (pictures(),), least_told=0.0)
    (verdict,) = judge(case, [Swapped(rule, "zero")])
    assert verdict.outcome == "diverged"
    assert f"It is as if the border of c were {rule}, where mirror is asked for" in str(verdict)


def test_the_image_is_the_one_that_is_read_so() -> None:
    passes = Passes(graph("clamp", "zero"), SIZE, [pictures()])
    assert (
        explain(passes, Swapped("clamp", "repeat"))
        == "It is as if the border of d were repeat, where zero is asked for"
    )
    assert explain(passes, Swapped("clamp", "zero")) == ""


def test_another_mistake_is_no_border() -> None:
    assert "border" not in explain(Passes(graph("clamp", "zero"), SIZE, [pictures()]), Swapped("clamp", "zero", 0.25))
    assert "border" not in explain(Passes(graph("clamp", "zero"), SIZE, [pictures()]), Swapped("repeat", "zero", 0.25))


# What fuzz makes of a failure


def test_a_shrunk_kernel_keeps_no_dead_line() -> None:
    text = """def k(c: Image, x: float) -> vec4:
    a = c[0, 0]
    unused = a * 2.0
    twice = unused + a
    if x > 0.5:
        unused = a
    return a * 3.0
"""
    case = {"kind": "kernel", "text": text}
    seen: list[str] = []

    def verdict(case: Any) -> str:
        seen.append(case["text"])
        lines = case["text"].splitlines()
        whole = text.splitlines()[0] in lines and "    a = c[0, 0]" in lines and "    return a * 3.0" in lines
        return "wrong" if whole and ("twice" not in case["text"] or "    unused = a * 2.0" in lines) else ""

    shorter = search.without_dead_lines(search.Failure(case, "wrong at first"), verdict)
    assert shorter.case["text"] == "def k(c: Image, x: float) -> vec4:\n    a = c[0, 0]\n    return a * 3.0\n"
    assert shorter.why == "wrong"
    variant = search.Failure({**case, "kind": "variant", "other": text}, "wrong")
    assert search.without_dead_lines(variant, verdict) is variant
