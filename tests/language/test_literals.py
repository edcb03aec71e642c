"""Kernels that differ in their numbers only: lowered once, each as if it had been lowered by itself."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import passgraph as pg
from passgraph.errors import PassgraphError
from passgraph.graph.calls import PixelKernel
from passgraph.language import ir, lower_cache
from passgraph.language import scalar as s
from passgraph.language.facts import Facts, Fused, ImageFacts
from passgraph.language.literals import is_own
from passgraph.language.lower import lower
from passgraph.language.lower_cache import Programs, lower_once
from passgraph.verify.fuzz.kernels import kernel_texts

STORED = Facts(stores=(((("quantize_half",),), (("quantize", 0.0, 255.0),)),))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    return tmp_path / "programs"


@pytest.fixture
def lowered(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the kernels that are lowered, in order."""
    names: list[str] = []

    def noted(program: ir.TypedKernel, *more: Any) -> s.ScalarProgram:
        names.append(program.name)
        return lower(program, *more)

    monkeypatch.setattr(lower_cache, "lower", noted)
    return names


def told(program: s.ScalarProgram) -> tuple[object, ...]:
    """All that is known of a program, where it stands in the text too."""
    spans = [getattr(i, "span", None) for i in s.walk(program.body)]
    return program.name, program.key, repr(program), program.sources, program.calls, spans


def kernel(text: str) -> PixelKernel:
    return pg.kernel(source=text)


#: Texts with places for two numbers that are no one else's.
ALIKE = {
    "sums": "def k(c: Image) -> vec4: return c[0, 0] * {0} + {1}",
    "one number twice": "def k(c: Image) -> vec4: return (c[0, 0] * {0} + {1}) * {0}",
    "branches": """
def k(c: Image) -> vec4:
    total = c[0, 0]
    other = total.y
    if total.x > {0}:
        other = c[1, 0].x * {1}
        total = c.texel(ivec2(3, 4)) * {0}
    elif c[0, 1].x < {1}:
        total = c[2, 0] + {1}
    return total * other
""",
    "loops": """
def k(c: Image) -> vec4:
    total = vec4({0})
    for i in range(40):
        if total.x > {1}:
            break
        total = total * {0} + c[i % 3, 0]
    return total
""",
    "mixed": "def k(c: Image) -> vec4: return mix(c[0, 0], vec4({1}), {0}) * max({0}, {1}) + vec4({0}) / {1}",
    "functions": """
def weight(x: float) -> float:
    return exp(-x * {0}) * {0}

def k(c: Image) -> vec4:
    return vec4(weight(c[0, 0].x), weight(c[0, 0].y), c[0, 0].z - {1}, mix(c[0, 0].w, {0}, c[0, 0].x))
""",
    "arrays": """
def k(c: Image) -> vec4:
    a = [{0}, {1}, 0.5, 1.0]
    a[int(c[0, 0].x) & 3] = {1}
    return vec4(a[int(c[0, 0].y) & 3], a[0] * c[0, 0].x, a[1] * c[0, 0].y, {0} if c[0, 0].z > 0.5 else {1})
""",
}
NUMBERS = [(0.3123, 0.7177), (1.9071, 0.1333), (-0.3123, 1.1e18), (0.0033, 0.0071)]


@pytest.mark.parametrize("facts", [Facts(), STORED, Facts(simplify=False)], ids=["plain", "stored", "not simplified"])
@pytest.mark.parametrize("name", ALIKE)
def test_kernels_that_differ_in_numbers_are_lowered_once(name: str, facts: Facts, lowered: list[str]) -> None:
    known = Programs()
    for numbers in NUMBERS:
        program = kernel(ALIKE[name].format(*numbers)).program
        assert told(lower_once(program, facts, known)) == told(lower(program, facts))
    assert len(lowered) == 1


#: What becomes of these hangs on their numbers.
ASKED = {
    "trips": """
def k(c: Image) -> vec4:
    t = c[0, 0]
    for i in range(int({0} * 10.0)):
        t = t * {1}
    return t
""",
    "offsets": "def k(c: Image) -> vec4: return c[int(clamp(c[0, 0].x, 0.0, {0})), 0] * {1}",
    "powers": "def k(c: Image) -> vec4: return pow(c[0, 0], vec4({0})) * {1}",
    "chosen": "def k(c: Image) -> vec4: return c[0, 0] * {0} if {1} > 0.5 else c[0, 0] - {0}",
}


@pytest.mark.parametrize("name", ASKED)
def test_where_a_number_decides_each_kernel_is_lowered_by_itself(name: str, lowered: list[str]) -> None:
    known = Programs()
    for numbers in NUMBERS[:2]:
        program = kernel(ASKED[name].format(*numbers)).program
        assert told(lower_once(program, STORED, known)) == told(lower(program, STORED))
    assert len(lowered) == 3
    # What was found out stays for the next process.
    for numbers in NUMBERS[:2]:
        program = kernel(ASKED[name].format(*numbers)).program
        assert told(lower_once(program, STORED)) == told(lower(program, STORED))
    assert len(lowered) == 3


def test_numbers_that_follow_from_others_may_be_those_that_there_are_rules_for(lowered: list[str]) -> None:
    """Multiplied by 1, what is multiplied goes; so it is lowered by itself, and the next one is not."""
    known, text = Programs(), "def k(c: Image) -> vec4: return c[0, 0] * (1.0 + max({0} + {1}, -5.0)) / {0}"
    for numbers in ((0.3123, 0.7177), (0.3123, 0.6877), (-0.6877, -0.3123), (1.9071, 0.1333)):
        program = kernel(text.format(*numbers)).program
        assert told(lower_once(program, STORED, known)) == told(lower(program, STORED))
    assert lowered == ["k"] * 3


def test_what_is_refused_names_the_own_line_of_each(lowered: list[str]) -> None:
    known = Programs()
    for one, other in NUMBERS[:2]:
        program = kernel(f"def k(c: Image) -> vec4:\n    return c[int(c[0, 0].x * {one}), 0] * {other}").program
        with pytest.raises(PassgraphError) as want:
            lower(program, STORED)
        with pytest.raises(PassgraphError, match=re.escape(str(want.value))):
            lower_once(program, STORED, known)


VARIABLES = """
def kNAME(c: Image) -> vec4:
    NAME = c[0, 0]
    m = NAME
    if m.x > 0.0:
        NAME = m * 0.3123
        m = c.texel(ivec2(0, 0))
    return NAME + m
"""


def test_names_of_variables_say_nothing(lowered: list[str]) -> None:
    known = Programs()
    for name in ("a", "z"):
        program = kernel(VARIABLES.replace("NAME", name)).program
        assert told(lower_once(program, STORED, known)) == told(lower(program, STORED))
    assert len(lowered) == 1


BASE = """
def k(c: Image, d: Image, n: Const[float] = 0.3123, m: Const[int] = 2) -> vec4:
    t = {}
    return t * 1.0137
"""


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("c[0, 0] * 0.31", "c[0, 0] + 0.31"), ("c[0, 0] * 0.31", "0.31 * c[0, 0]"), ("c[0, 0]", "d[0, 0]"),
        ("c[0, 0]", "c[0, 1]"), ("c[0, 0].xyzw", "c[0, 0].xyzz"), ("c[0, 0] * 0.31", "c[0, 0] * 1.0137"),
        ("c[0, 0] * 0.31", "c[0, 0] * 0.5"), ("c[0, 0] * 0.5", "c[0, 0] * 0.25"), ("c[0, 0] + 0.0", "c[0, 0] + -0.0"),
        ("c[0, 0] * 0.31 + d[0, 0] * 0.41", "c[0, 0] * 0.31 + d[0, 0] * 0.31"), ("c[0, 0] * n", "c[0, 0] * float(m)"),
        ("vec4(c[0, 0].xy, d[0, 0].xy)", "vec4(d[0, 0].xy, c[0, 0].xy)"), ("c.texel(ivec2(0, 0))", "c[0, 0]"),
    ],
)  # fmt: skip
def test_kernels_that_differ_otherwise_are_told_apart(one: str, other: str, lowered: list[str]) -> None:
    known = Programs()
    programs = [kernel(BASE.format(text)).program for text in (one, other)]
    for program in programs:
        assert told(lower_once(program, STORED, known)) == told(lower(program, STORED))
    assert len(lowered) == 2


def test_defaults_of_constants_are_told_apart(lowered: list[str]) -> None:
    known = Programs()
    for default in (0.3123, 0.3124):
        program = kernel(f"def k(c: Image, n: Const[float] = {default}) -> vec4: return c[0, 0] * n").program
        assert told(lower_once(program, Facts(), known)) == told(lower(program, Facts()))
    assert len(lowered) == 2


def chained(numbers: tuple[float, float], more: float) -> tuple[PixelKernel, Facts]:
    """A kernel with two others fused into it, one into the other."""
    inner = kernel(f"def a(c: Image) -> vec4: return c[0, 0] * {numbers[0]} + {more}").program
    between = kernel(f"def b(c: Image) -> vec4: return c[0, 0].yzwx * {numbers[1]}").program
    first = Facts(stores=STORED.stores)
    second = Facts(images={"c": ImageFacts(fused=Fused(inner, first, "p0/", 0))}, stores=STORED.stores)
    facts = Facts(images={"c": ImageFacts(fused=Fused(between, second, "p1/", 0))}, stores=STORED.stores)
    return kernel(f"def k(c: Image) -> vec4: return c[0, 0] - {numbers[0]}"), facts


def test_numbers_of_what_is_fused_have_places_too(lowered: list[str]) -> None:
    known = Programs()
    for numbers in NUMBERS:
        last, facts = chained(numbers, 0.9173)
        assert told(lower_once(last.program, facts, known)) == told(lower(last.program, facts))
    assert len(lowered) == 1
    last, facts = chained((0.5113, 0.6111), 0.5113)  # a number that two of them have
    assert told(lower_once(last.program, facts, known)) == told(lower(last.program, facts))
    assert len(lowered) == 2


def test_one_kernel_in_many_passes_is_one_program(lowered: list[str]) -> None:
    known, program = Programs(), kernel(ALIKE["sums"].format(0.31, 0.32)).program
    assert lower_once(program, STORED, known) is lower_once(program, STORED, known)


def test_numbers_apart_make_the_program() -> None:
    program = kernel(ALIKE["loops"].format(0.31, 0.32)).program
    found = lower_once(program, STORED).apart
    assert found is not None and found.literals == pytest.approx((0.31, 0.32))
    held = {x for i in s.walk(found.program.body) for x in s.operands_of(i)}
    assert {s.place(0), s.place(1)} <= held
    assert "#0" in repr(s.place(0)) and found.program.key != lower(program, STORED).key


def test_a_place_is_no_number() -> None:
    unknown = s.Place(0)
    assert unknown not in (0, 1, 0.0, float("nan"))
    for compute in (float, lambda x: x + 1, lambda x: x < 1, lambda x: -x, lambda x: x * 2.0):
        with pytest.raises(TypeError):
            compute(unknown)


@pytest.mark.parametrize("value", [0.0, -0.0, 1.0, -2.0, 0.75, 100.0, float("inf"), float("nan"), 2.0**-140])
def test_short_numbers_are_everybodys(value: float) -> None:
    assert not is_own(value)
    assert is_own(0.1) and is_own(-1e30)


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(kernel_texts(), st.lists(st.floats(0.1, 2.0), min_size=1, max_size=5))
def test_kernels_by_chance_are_what_they_are_by_themselves(text: str, numbers: list[float]) -> None:
    known = Programs()

    def another(found: re.Match[str]) -> str:
        return found[0] if len(found[0]) < 4 else f"{numbers[found.start() % len(numbers)]:.5f}"

    for each in (text, re.sub(r"(?<![\w.])\d+\.\d+(?![\w.])", another, text)):
        try:
            program = kernel(each).program
            want = lower(program, STORED)
        except PassgraphError:
            continue
        assert told(lower_once(program, STORED, known)) == told(want)
