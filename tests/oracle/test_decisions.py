"""Decisions: every way that rounding may turn them is among the paths, sums of many are bounded, the rest is given up.

Small kernels are run many times, with every rounding drawn anew (see ``conforming``): whatever comes out must be
allowed, and where few decisions meet, both sides of each must come out, so that nothing more is allowed than need be.
"""

from __future__ import annotations

import numpy as np
import pytest
from conforming import Conforming

import passgraph as pg
from passgraph.errors import PassgraphError
from passgraph.verify.compare import compare
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.pass_bounds import Passes

#: Bodies over p, the texel; a third of the texels lies on steps of 1/8, where decisions straddle.
FLOW = {
    "one if": "return vec4(1.0) if p.x / 3.0 * 3.0 < p.y else vec4(2.0)",
    "nested ifs": """
        r = 0.0
        if p.x * 1.1 / 1.1 < 0.5:
            r = 1.0 if p.y / 0.3 * 0.3 >= 0.25 else 2.0
        elif p.z / 0.7 * 0.7 > 0.5:
            r = 3.0
        return vec4(r)""",
    "break and continue": """
        r = 0.0
        for i in range(6):
            t = float(i) / 8.0 / 0.9 * 0.9
            if t == 0.25:
                continue
            if t > p.x:
                break
            r += 1.0 + t
        return vec4(r)""",
    "floors": "return floor(p * 8.0 / 3.0 * 3.0) + fract(p * 4.0 / 3.0 * 3.0)",
    "an index": """
        a = [1.0, 5.0, 2.0, 8.0, 3.0]
        return vec4(a[0 + int(p.x * 4.0 / 3.0 * 3.0)])""",
    "a sign and a step": "return sign(p / 0.3 * 0.3 - 0.5) + step(vec4(0.25), p / 0.7 * 0.7)",
    "bilinear": "return c.sample(uv() * 0.83 + p.xy * 0.01)",
    "a sum of many": """
        r = vec4(0.0)
        for i in range(24):
            r += c.sample(uv() + vec2(float(i) / 33.0 - 0.25, float(i) / 61.0))
        return r""",
    "no sum": """
        r = 1.0
        for i in range(20):
            if p.x * float(i + 1) / 3.0 * 3.0 > 0.5 * float(i):
                r = r * 1.5
            else:
                r = 2.0 - r
        return vec4(r)""",
}

#: How often a kernel is rounded anew.
SEEDS = (6, pytest.param(40, marks=pytest.mark.slow))


def picture() -> np.ndarray:
    random = np.random.default_rng(9)
    made = random.random((12, 20, 4)).astype(np.float32)
    made[:, ::3] = np.rint(made[:, ::3] * 8) / 8
    return made


def kernel(body: str) -> pg.PixelKernel:
    text = "\n".join("    " + line for line in [line[8:] if line[:8].isspace() else line for line in body.split("\n")])
    return pg.kernel(source=f"def k(c: Image) -> vec4:\n    p = c[0, 0]\n{text}\n", name="k")


@pytest.mark.sampled
@pytest.mark.parametrize("ways", SEEDS)
@pytest.mark.parametrize("name", FLOW)
def test_every_way_that_rounding_turns_is_allowed(name: str, ways: int) -> None:
    given = {"c": picture()}
    graph = kernel(FLOW[name])(pg.Input("c"))
    report = compare(graph, ["reference", *(Conforming(seed, directed=seed % 2 == 1) for seed in range(ways))], **given)
    for backend in report.backends:
        assert backend.within_bounds, backend.failed or str(backend.first_divergence)
    differing = max(b.targets[0].max_error for b in report.backends)
    if name not in ("bilinear", "a sum of many"):
        assert differing > 0.1, "no decision fell the other way: the test is void"


def allowed(body: str, given: np.ndarray) -> Allowed:
    graph = {"out": kernel(body)(pg.Input("c"))}
    _, found = Passes(graph, None, [{"c": given}]).allowed()
    (only,) = found.values()
    return only


def test_both_sides_of_a_decision_and_no_more() -> None:
    """0.375 / 0.3 * 0.3 may be 0.375 or lie beside it; a quarter never reaches it."""
    given = np.full((1, 2, 4), 0.25, np.float32)
    given[0, 0] = 0.375
    found = allowed("return vec4(1.0) if p.x / 0.3 * 0.3 < 0.375 else vec4(5.0)", given)
    assert found.ambiguous.tolist() == [[True, False]]
    assert (found.values.lo[0, 0, 0], found.values.hi[0, 0, 0]) == (1.0, 5.0)
    assert (found.values.lo[0, 1, 0], found.values.hi[0, 1, 0]) == (1.0, 1.0)


def test_a_jump_that_leads_to_no_other_result_is_not_ambiguous() -> None:
    """Filtering at texel centres: which texel is the lower one may turn, the filtered colour hardly moves."""
    given = picture()
    found = allowed("return c.sample(uv())", given)
    assert found.names["floor"] > 100
    assert not found.ambiguous.any()
    # The position is off by a few ULP of 20, the largest coordinate, times the steepest neighbours (below 1), on
    # either side and on both axes.
    assert found.values.width.max() < 2 * 2 * 8 * 20 * 2.0**-23


@pytest.mark.slow
def test_a_mean_of_many_filtered_texels_is_bounded() -> None:
    """At texel centres each read turns on rounding, by less than a unit in the last place; all together by some."""
    given = picture()
    given[..., 3] = 1.0
    body = """
        total, weights = vec4(0.0), 0.0
        for i in range(-8, 9):
            weight = float((9 - abs(i)) * (9 - abs(i)))
            total += weight * c.sample(uv() + vec2(i, 0) / vec2(c.size))
            weights += weight
        return total / weights"""
    found = allowed(body, given)
    assert not found.ambiguous.any()
    # 17 reads of two decisions each, half a unit in the last place for each, and the sums' own on either side.
    assert found.values.width[..., 3].max() < 2 * (17 * 2 + 3 * 17) * 2.0**-24
    report = compare(kernel(body)(pg.Input("c")), [Conforming(seed) for seed in range(4)], c=given)
    assert report.passed, report.backends[0].targets[0]


def test_an_index_that_may_be_any_leaves_nothing_known() -> None:
    """1e9 / 3 has dozens of whole numbers within 2.5 ULP."""
    given = np.full((1, 1, 4), 1e9, np.float32)
    for body in ("return vec4(float(int(p.x / 3.0) % 7))", "return vec4(1.0) if int(p.x / 3.0) % 7 < 3 else vec4(2.0)"):
        found = allowed(body, given)
        assert found.ambiguous.all()
        assert (found.values.lo == -np.inf).all()
        assert (found.values.hi == np.inf).all()


def test_a_texel_that_may_be_any_is_one_of_the_picture() -> None:
    given = picture() * np.float32(0.5) + np.float32(0.25)
    given[0, 0, 0] = 1e9
    found = allowed("return c.texel(ivec2(int(p.x * 1000.0 / 7.0 - p.x * 142.857), 0)).yzwx", given)
    assert found.ambiguous[0, 0]
    assert not found.ambiguous[1:].any()
    assert 0.25 <= found.values.lo[0, 0, 0] < found.values.hi[0, 0, 0] <= 0.75


def test_decisions_of_a_lane_do_not_hang_on_its_neighbours() -> None:
    """Equal edges in one lane open a decision that other lanes must not count."""
    given = np.zeros((1, 3, 4), np.float32)
    given[0, :, 0] = (0.3, 0.5, 0.7)  # x
    given[0, :, 1] = (0.3, 0.5, 0.2)  # low edge
    given[0, :, 2] = (0.3, 0.9, 0.9)  # high edge
    body = "return vec4(smoothstep(p.y / 0.7 * 0.7, p.z / 0.7 * 0.7, p.x / 0.3 * 0.3))"
    found = allowed(body, given)
    assert found.values.lo[0, 0, 0] == 0.0
    assert found.values.hi[0, 0, 0] >= 1.0
    # Three arguments off by 3.5 ULP each over a width of 0.7, times the largest slope, 1.5, on either side, and
    # the row's own 16 ULP on either side.
    assert found.values.width[0, 1:].max() < (2 * 3 * 3.5 * 1.5 / 0.7 + 2 * 16) * 2.0**-24
    assert found.values.without(np.float32([[[s] * 4 for s in (0.0, 0.0, 0.8017493)]])).sum() == 0


@pytest.mark.parametrize("ways", SEEDS)
def test_what_is_no_sum_is_given_up_not_accused(ways: int) -> None:
    """Twenty decisions that multiply: more paths than are tried, so nothing is said of those lanes."""
    given = np.full((1, 4, 4), 0.5, np.float32)
    body = """
        r = 1.0
        for i in range(20):
            r = r * 3.0 + 1.0 if p.x / 3.0 * 3.0 * float(i + 1) >= 0.5 * float(i + 1) else 0.5 - r * r
        return vec4(r)"""
    found = allowed(body, given)
    assert found.ambiguous.all()
    try:
        report = compare(kernel(body)(pg.Input("c")), [Conforming(seed) for seed in range(ways)], c=given)
    except PassgraphError as error:
        pytest.fail(str(error))
    assert report.within_bounds


@pytest.mark.parametrize("comparison", [">", ">="])
def test_the_best_of_many_ties_may_be_any_of_them(comparison: str) -> None:
    """Ten equal distances, each rounded by itself: any of the ten values may come out, in whatever order they tie."""
    given = picture()
    given[..., 0] = 0.5
    body = f"""
        nearest, value = -1.0, 0.0
        for i in range(10):
            distance = sqrt(c[i, 0].x * 0.3)
            if distance {comparison} nearest:
                nearest, value = distance, c[i, 0].y
        return vec4(value)"""
    found = allowed(body, given)
    columns = np.minimum(
        np.arange(given.shape[1])[:, None] + np.arange(10), given.shape[1] - 1
    )  # the border is an edge
    candidates = given[:, columns, 1]
    assert (found.values.lo[..., 0] <= candidates.min(axis=2)).all()
    assert (found.values.hi[..., 0] >= candidates.max(axis=2)).all()
