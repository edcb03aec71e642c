"""Each row of the operations table over intervals: everything that float32 may make of it lies inside, and little else.

Points are drawn from random intervals, computed in float32 as badly as the standards allow (see ``conforming``)
and in float64, and looked up in what the oracle says of the interval.
"""

from __future__ import annotations

import numpy as np
import pytest
from conforming import Perturbed
from numpy.typing import NDArray
from running import lowered

from passgraph.language.operations import OPERATIONS
from passgraph.verify.oracle.decisions import Bounds, Track, explore
from passgraph.verify.oracle.domain import IntervalDomain
from passgraph.verify.oracle.interval import Interval, flushed

SMALLEST_NORMAL = 2.0**-126
#: Row → the expression of the kernel language that it is.
EXPRESSIONS = {
    row.name: row.as_written(*"xyz"[: len(row.operands)], by_name=True) for row in OPERATIONS.values() if row.of_numbers
}
#: Rows that are one operation, or several in any rounding: the others' bounds count on rounding to nearest.
ANY_ROUNDING = {name for name in EXPRESSIONS if OPERATIONS[name].kind == "primitive"} | {
    "sign", "saturate", "fract", "step", "clamp", "smoothstep", "mix", "fma", "radians", "degrees",
}  # fmt: skip
SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, 2.5, -3.75, 1e-40, -1e-39, 1e-30, 1e30, 3e38, -3e38, np.inf, -np.inf, np.nan]

LANES = 3000


def arguments_of(random: np.random.Generator, special: bool) -> tuple[Interval, NDArray[np.float32]]:
    """Intervals from points to several times their size, and a number in each."""
    bits = random.integers(-(2**31), 2**31, LANES).astype(np.int32).view(np.float32)
    kinds = [random.choice(np.float32(SPECIAL), LANES), np.nan_to_num(bits)] * special
    kinds += [np.float32(np.round(random.uniform(-5, 5, LANES) * 8) / 8), np.float32(random.normal(0, 30, LANES))]
    low = np.choose(random.integers(0, len(kinds), LANES), kinds)
    wide = np.abs(low) * random.choice(np.float32([0, 0, 1e-7, 1e-3, 0.5, 3]), LANES)
    high = np.where(np.isfinite(low), low + wide, low).astype(np.float32)
    inside = np.clip(low + (high - low) * random.random(LANES).astype(np.float32), low, high)
    bounds = flushed(Interval(low.astype(np.float64), high.astype(np.float64), np.isnan(low)))
    return bounds, np.where(low == high, low, inside).astype(np.float32)


def arity(name: str) -> int:
    return len(OPERATIONS[name].operands)


def allowed(name: str, arguments: list[Interval]) -> Interval:
    """What the row may give, whatever its decisions."""

    def run(track: Track) -> tuple[list[Interval], None]:
        made = IntervalDomain(track).apply(name, [a.take(track.lanes) for a in arguments])
        assert isinstance(made, Interval)
        return [made.map(lambda x: x.reshape(-1, 1))], None

    with np.errstate(all="ignore"):
        found: Bounds = explore(run, len(arguments[0]), [1])
    return found.outputs[0].map(lambda x: x[:, 0])


def computed(name: str, columns: list[NDArray[np.float32]], seed: int) -> NDArray[np.float32]:
    picture = np.zeros((len(columns[0]), 4), np.float32)
    for i, column in enumerate(columns):
        picture[:, i] = column
    program = lowered("return " + EXPRESSIONS[name])
    run = Perturbed(seed, name in ANY_ROUNDING, program, len(picture), lambda image, x, y: picture)
    return run.outputs()[0][0]


@pytest.mark.sampled
@pytest.mark.parametrize("special", [False, True], ids=["ordinary", "special"])
@pytest.mark.parametrize("name", EXPRESSIONS)
def test_what_float32_makes_of_it_lies_inside(name: str, special: bool) -> None:
    random = np.random.default_rng(2)
    with np.errstate(all="ignore"):
        intervals, columns = zip(*(arguments_of(random, special) for _ in range(arity(name))), strict=True)
        bounds = allowed(name, list(intervals))
        exact = np.asarray(OPERATIONS[name].reference(*(c.astype(np.float64) for c in columns)))
        results = [exact.astype(np.float32), *(computed(name, list(columns), seed) for seed in range(3))]
    for result in results:
        got = result.astype(np.float64)
        fits = np.where(np.isnan(got), bounds.nan, (got >= bounds.lo) & (got <= bounds.hi))
        tiny = (np.abs(got) < SMALLEST_NORMAL) & bounds.has(0.0)  # what the reference has not flushed
        bad = np.flatnonzero(~(fits | tiny))
        first = [(*(float(c[i]) for c in columns), float(got[i]), bounds.lo[i], bounds.hi[i]) for i in bad[:3]]
        assert len(bad) == 0, f"{len(bad)} of {LANES}; arguments, result, lowest, highest: {first}"


#: Where each row has its domain, away from jumps and poles.
TAME = {"sqrt": (0.1, 9), "inversesqrt": (0.1, 9), "log": (1.5, 9), "log2": (1.5, 9), "asin": (-0.9, 0.9),
        "acos": (-0.9, 0.9), "tan": (-1.2, 1.2), "pow": (0.1, 4), "div": (0.5, 4), "saturate": (0.1, 0.9),
        "smoothstep": (0.1, 0.9)}  # fmt: skip


#: Rows bounded by their parts.  A root's 3 ULP, rounded outward to 4, may be 8 of the quotient's, which loses 2.5;
#: a quotient's 2.5 may be 5 of the Hermite polynomial's and is doubled by it at most, which loses 6.
COMPOSED_ULP = {"inversesqrt": 10.5, "smoothstep": 16.0}


@pytest.mark.parametrize("name", sorted(set(EXPRESSIONS) - {"sign", "step", "floor", "ceil", "trunc", "round",
                                                            "float_floor_divide", "mod", "fract"}))  # fmt: skip
def test_a_point_gives_hardly_more_than_the_row_allows(name: str) -> None:
    """The row's ULP to either side, and the outward rounding of both ends; terms that may cancel count by size."""
    random = np.random.default_rng(3)
    domain = OPERATIONS[name].domain_of(0)
    low, high = TAME.get(name, (max(-4.0, domain.low), min(4.0, domain.high)))
    columns = [random.uniform(low, high, 500).astype(np.float32) for _ in range(3)]
    count = arity(name)
    if name == "smoothstep":
        columns[:2] = [np.full(500, 0.0, np.float32), np.full(500, 1.0, np.float32)]
    width = allowed(name, [Interval.as_read(c) for c in columns[:count]]).width
    row = OPERATIONS[name]
    with np.errstate(all="ignore"):
        exact = np.asarray(row.reference(*(c.astype(np.float64) for c in columns[:count])))
    size = np.abs(exact)
    if name == "mix":
        x, y, a = (np.abs(c).astype(np.float64) for c in columns)
        size = np.maximum(size, np.maximum(x * np.maximum(1, np.abs(1 - columns[2])), y * np.maximum(1, a)))
    if name == "fma":
        size = np.maximum(size, np.maximum(np.abs(columns[0].astype(np.float64) * columns[1]), np.abs(columns[2])))
    unit = np.spacing(np.maximum(size, SMALLEST_NORMAL).astype(np.float32)).astype(np.float64)
    ulp = COMPOSED_ULP.get(name, max(row.ulp, 1.0))
    assert (width <= 2 * ((ulp + 1.0) * unit + row.absolute)).all(), (width / unit).max()


@pytest.mark.parametrize(
    ("name", "arguments", "result"),
    [
        ("add", (3, 4), 7), ("mul", (3, 4), 12), ("sub", (5, 5), 0), ("neg", (2,), -2), ("min", (2, 3), 2),
        ("max", (2, 3), 3), ("abs", (-3,), 3), ("floor", (2.5,), 2), ("round", (2.5,), 2), ("sign", (-3,), -1),
        ("step", (1, 2), 1), ("clamp", (5, 0, 2), 2), ("saturate", (2,), 1), ("mix", (3, 7, 0), 3),
        ("mix", (3, 7, 1), 7), ("smoothstep", (0, 1, 2), 1), ("smoothstep", (0, 1, -2), 0), ("sqrt", (0,), 0),
        ("pow", (3, 0), 1), ("fract", (2.25,), 0.25), ("smoothstep", (1, 1, 2), 1), ("smoothstep", (1, 1, 0), 0),
    ],
)  # fmt: skip
def test_what_is_exact_everywhere_stays_exact(name: str, arguments: tuple[float, ...], result: float) -> None:
    made = allowed(name, [Interval.as_read(np.float32([a])) for a in arguments])
    assert (made.lo.item(), made.hi.item(), made.nan.item()) == (result, result, False)


@pytest.mark.parametrize(
    ("name", "arguments", "inside"),
    [
        # A zero times what may be infinite: NaN, and 0 beside it.
        ("mul", [(0, 0), (1, np.inf)], [0.0, np.nan]),
        ("mul", [(0, 0), (-np.inf, np.inf)], [0.0, np.nan]),
        ("add", [(-np.inf, 5), (np.inf, np.inf)], [np.inf, np.nan]),
        ("div", [(-np.inf, np.inf), (np.inf, np.inf)], [0.0, np.nan]),
        ("div", [(1, 1), (-1, 1)], [np.inf, -np.inf, 1.0, -1.0]),
        ("div", [(1, 1), (0, 0)], [np.inf, -np.inf]),
        ("div", [(1e38, 1e38), (2e38, 2e38)], [0.5, 0.0]),  # beyond 2**126 a reciprocal may vanish
        ("sqrt", [(-1e-9, 1)], [np.nan, 1.0, 0.0]),
        ("pow", [(0, 0), (0, 1)], [1.0, 0.0]),
        ("atan2", [(-1e-6, 1e-6), (-1, -1)], [-np.pi, np.pi]),
        ("mix", [(1, 1), (1, 1), (0, 100)], [1.0]),
        ("mix", [(np.inf, np.inf), (0, 0), (1, 1)], [np.nan]),
        ("mix", [(3e38, 3e38), (-3e38, -3e38), (-1, -1)], [np.inf]),
        ("smoothstep", [(1, 1), (0, 0), (0.25, 0.25)], [0.84375]),  # edges in reverse: the own formula
        ("fract", [(-1e-9, -1e-9)], [float(np.nextafter(np.float32(1), np.float32(0)))]),
    ],
)  # fmt: skip
def test_special_values(name: str, arguments: list[tuple[float, float]], inside: list[float]) -> None:
    made = allowed(name, [Interval(np.float64([a]), np.float64([b]), np.zeros(1, np.bool_)) for a, b in arguments])
    for value in inside:
        if np.isnan(value):
            assert made.nan.item()
        else:
            near = np.abs(value) * 2.0**-22
            assert made.lo.item() - near <= value <= made.hi.item() + near


def test_atan2_on_its_cut_is_pi_and_nothing_else() -> None:
    made = allowed("atan2", [Interval.as_read(np.float32([0.0])), Interval.as_read(np.float32([-1.0]))])
    assert np.pi - 1e-5 < made.lo.item() < np.pi < made.hi.item() < np.pi + 1e-5


def test_min_and_max_keep_the_order_of_their_ternaries() -> None:
    """``b if b < a else a``: a NaN in b gives a, one in a stays."""
    nan, two = Interval.as_read(np.float32([np.nan])), Interval.as_read(np.float32([2.0]))
    for name in ("min", "max"):
        kept = allowed(name, [two, nan])
        assert (kept.lo.item(), kept.hi.item(), kept.nan.item()) == (2.0, 2.0, False)
        assert np.isnan(allowed(name, [nan, two]).lo.item())


def test_of_two_numbers_too_small_to_be_normal_min_and_max_may_be_either() -> None:
    """What compares them may see two zeros and hand on the wrong one as it is; beside normal numbers it sees them."""
    small, normal = 2.0**-127, SMALLEST_NORMAL
    below, above = Interval.as_read(np.float32([-small])), Interval.as_read(np.float32([small]))
    zero, one = Interval.as_read(np.float32([0.0])), Interval.as_read(np.float32([1.0]))

    def ends(name: str, *arguments: Interval) -> tuple[float, float]:
        made = allowed(name, list(arguments))
        return made.lo.item(), made.hi.item()

    for name in ("min", "max"):
        assert ends(name, below, above) == ends(name, above, below) == (-small, small)
    assert ends("min", zero, above) == ends("max", above, zero) == (0.0, small)
    assert ends("clamp", below, zero, one) == ends("saturate", below) == (-small, 0.0)
    for size in (normal, 1.0):
        assert ends("min", above, Interval.as_read(np.float32([-size]))) == (-size, -size)
        assert ends("max", below, Interval.as_read(np.float32([size]))) == (size, size)
    # Of a wide interval only what is so small comes through.
    wide = Interval(np.float64([-1.0]), np.float64([1.0]), np.zeros(1, np.bool_))
    assert -normal < ends("max", wide, zero)[0] < 0.0 < ends("min", wide, zero)[1] < normal
