"""What bounds take: it grows with the pixels and no faster, is reported, and ends where the user says.

Kernels are those whose pixels take many ways: branches inside of branches, loops that a pixel leaves when its own
numbers say so.  Work is counted in numbers that operations were applied to, which nothing else on the machine moves.
"""

from __future__ import annotations

import itertools
from functools import cache
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference.draw_pass import ReferenceDrawPass
from passgraph.backends.reference.stage import ReferencePixelPass
from passgraph.verify.compare import compare
from passgraph.verify.oracle import decisions, domain, time_limit
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.domain import IntervalDomain
from passgraph.verify.oracle.interval import Bounded
from passgraph.verify.oracle.pass_bounds import Passes
from passgraph.verify.oracle.time_limit import BATCH, TimeLimit, batches
from tests.corners import placed

#: Of loops in tests that are no slow ones.
TRIPS = 28
#: Eight branches inside of each other, each on a number that rounding may put on either side.
NESTED = "\n".join(f"{'    ' * (depth + 1)}x = x / 0.3 * 0.3\n{'    ' * (depth + 1)}if x > c.b:" for depth in range(8))
KERNELS = {
    "nested": f"""
def nested(color: Image) -> vec4:
    c = color[0, 0]
    x = c.b
{NESTED}
                                    x = x + c.g
    return vec4(x)
""",
    "mandelbrot": """
def mandelbrot(color: Image) -> vec4:
    p = (vec2(pixel()) + 0.5) / vec2(output_size())
    c = vec2(p.x * 3.0 - 2.1, p.y * 2.4 - 1.2) + color[0, 0].xy * 0.0
    z = vec2(0.0)
    n = 0.0
    for i in range(TRIPS):
        z = vec2(z.x * z.x - z.y * z.y, 2.0 * z.x * z.y) + c
        if dot(z, z) > 4.0:
            break
        n = n + 1.0
    return vec4(n / 64.0, z, 1.0)
""",
    "march": """
def field(p: vec3) -> float:
    ball = length(p - vec3(0.0, 0.1, 0.0)) - 0.6
    return min(min(ball, length(p - vec3(0.7, -0.2, 0.4)) - 0.35), p.y + 0.6)

def march(color: Image) -> vec4:
    p = (vec2(pixel()) + 0.5) / vec2(output_size()) * 2.0 - 1.0 + color[0, 0].xy * 0.0
    d = normalize(vec3(p.x * 1.5, 0.0 - p.y, 1.6))
    t = 0.0
    for i in range(TRIPS):
        s = field(vec3(0.0, 0.2, -2.5) + d * t)
        if s < 0.001:
            break
        t = t + s
        if t > 20.0:
            break
    return vec4(t)
""",
}


def bounds(name: str, width: int, height: int, limit: TimeLimit | None = None, trips: int = TRIPS) -> Allowed:
    y, x = np.mgrid[:height, :width]
    colour = np.stack([np.sin(x * 9 / width), np.cos(y * 11 / height), x * y % 8 / 8, x * 0.0], axis=2)
    kernel = pg.kernel(source=KERNELS[name].replace("TRIPS", str(trips)), name=name)
    run = Passes({"out": kernel(pg.Input("color"))}, None, [{"color": colour.astype(np.float32)}], limit)
    (only,) = run.allowed()[1].values()
    return only


@cache
def bounds_of_branches() -> Allowed:
    """Of a picture of several batches, in all the time that it takes."""
    return bounds("nested", 96, 64)


def assert_same(these: Allowed, those: Allowed, *, lanes: Any = ...) -> None:
    """The same bounds, of all lanes or of some."""
    for part in ("lo", "hi", "nan"):
        np.testing.assert_array_equal(getattr(these.values, part)[lanes], getattr(those.values, part)[lanes])


@pytest.fixture
def applied(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Numbers that operations were applied to so far."""
    count, plain = [0], IntervalDomain.apply

    def counted(self: IntervalDomain, operation: str, arguments: list[Bounded]) -> Bounded:
        count[0] += max(len(argument) for argument in arguments)
        return plain(self, operation, arguments)

    monkeypatch.setattr(IntervalDomain, "apply", counted)
    return count


@pytest.mark.parametrize(
    ("sizes", "trips"),
    [
        (((32, 24), (64, 48)), TRIPS),
        pytest.param(((96, 64), (192, 128), (384, 256)), 64, marks=pytest.mark.slow),
    ],
    ids=["small", "large"],
)
@pytest.mark.parametrize("name", KERNELS)
def test_work_grows_with_the_pixels(
    name: str, sizes: tuple[tuple[int, int], ...], trips: int, applied: list[int]
) -> None:
    each = []
    for width, height in sizes:
        applied[0] = 0
        bounds(name, width, height, trips=trips)
        each.append(applied[0] / (width * height))
    assert max(each) < 1.2 * min(each)


@pytest.mark.parametrize("name", KERNELS)
def test_lanes_that_still_go_round_by_themselves_change_no_bound(
    name: str, applied: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """And those that have left a loop cost nothing."""
    alone, by_itself = bounds(name, 40, 24), applied[0]
    monkeypatch.setattr(domain, "WORTH_MOVING", np.inf)
    together, in_all = bounds(name, 40, 24), applied[0] - by_itself
    assert name != "march" or by_itself < 0.8 * in_all
    assert_same(alone, together)
    np.testing.assert_array_equal(alone.ambiguous, together.ambiguous)
    assert alone.names == together.names
    assert name == "nested" or alone.ambiguous.any()


def test_bounds_do_not_hang_on_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = bounds_of_branches()
    monkeypatch.setattr(decisions, "batches", lambda count: np.array_split(np.arange(count), -(-count // 300)))
    monkeypatch.setattr(decisions, "BATCH", 300)
    in_small_ones = bounds("nested", 96, 64)
    assert_same(whole, in_small_ones)


def test_ways_of_one_lane_are_tried_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """How many ways are tried of a lane hangs on those that were, which must not hang on where a batch ends."""
    monkeypatch.setattr(decisions, "BATCH", 100)
    random = np.random.default_rng(3)
    lanes = np.repeat(np.arange(60), random.integers(1, 30, 60))
    lanes = np.concatenate([lanes, np.full(150, 60), [61]])  # one has more than a batch takes
    frontier = decisions.Frontier(lanes, np.zeros((len(lanes), 2), np.int8), np.arange(len(lanes)))
    parts = list(frontier.parts())
    assert np.array_equal(np.concatenate([part.origins for part in parts]), np.arange(len(lanes)))
    assert all(before.lanes[-1] != after.lanes[0] for before, after in itertools.pairwise(parts))
    assert all(len(part) <= 100 or len(set(part.lanes)) == 1 for part in parts)
    assert len(parts) < 2 * len(lanes) / 100 + 2


@pytest.mark.parametrize("count", [0, 1, BATCH, BATCH + 1, 100_000])
def test_every_lane_is_in_one_batch(count: int) -> None:
    every = np.concatenate([np.zeros(0, np.int64), *batches(count)])
    assert np.array_equal(np.sort(every), np.arange(count))


class Clock:
    """A second goes by each time it is asked."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        self.now += 1.0
        return self.now


def test_what_the_time_does_not_suffice_for_is_said_and_is_no_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time_limit, "BATCH", 2048)
    found = bounds("nested", 96, 64, TimeLimit(4.0, clock=Clock()))
    left = ~np.isfinite(found.values.lo[..., 0])
    assert found.untried == left.sum() > 0
    assert (found.ambiguous >= left).all()
    assert not left.all()
    assert_same(found, bounds_of_branches(), lanes=~left)


def test_no_time_at_all_decides_nothing() -> None:
    kernel = pg.kernel(source="def one(color: Image) -> vec4: return color[0, 0]")
    given = {"color": np.ones((3, 5, 4), np.float32)}
    report = compare(kernel(pg.Input("color")), ["reference"], most_seconds=0.0, most_ambiguous=1.0, **given)
    target = report.backends[0].targets[0]
    assert (target.untried, target.within_bounds, report.passed) == (15, True, False)
    assert "time was up before the bounds of 15 pixels were found" in report.backends[0].faults[0]
    with pytest.raises(pg.InputError, match=r"most_seconds of compare must be a finite number, 0 or more, got -1"):
        compare(kernel(pg.Input("color")), ["reference"], most_seconds=-1, **given)


def test_fragments_have_their_share_of_the_time() -> None:
    text = placed("""
def paint(corner: Corner) -> vec4:
    return vec4(1.0)
""")
    corners = [[-1, -1, 0.5], [3, -1, 0.5], [-1, 3, 0.5]]
    mesh = pg.Mesh.make(positions=corners, triangles=[[0, 1, 2]])
    place, paint = (pg.vertex(source=text, name="place"), pg.fragment(source=text, name="paint"))
    drawn = pg.draw(mesh, vertex=place, fragment=paint, into=pg.target("color", "rgba8"))
    report = compare(drawn, ["reference"], size=(6, 4), most_seconds=0.0)
    assert report.backends[0].targets[0].untried == 24
    assert not report.passed
    assert compare(drawn, ["reference"], size=(6, 4)).passed


def test_vertices_have_their_share_of_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a corner in one quarter of the picture nothing is known, so that nothing is known of the other three."""
    text = """
class Corner:
    position: vec4

def place(vertex: Vertex) -> Corner:
    return Corner(vec4(vertex.position * 0.5 - 0.5, 1.0))

def paint(corner: Corner) -> vec4:
    return vec4(1.0)
"""
    corners = np.random.default_rng(5).uniform(-1.0, 1.0, (3 * 5000, 3)).astype(np.float32)
    mesh = pg.Mesh.make(positions=corners, triangles=np.arange(3 * 5000).reshape(-1, 3))
    place, paint = (pg.vertex(source=text, name="place"), pg.fragment(source=text, name="paint"))
    drawn = pg.draw(mesh, vertex=place, fragment=paint, into=pg.target("color", "rgba8"))

    def allowed(limit: TimeLimit) -> Allowed:
        (only,) = Passes({"out": drawn}, (6, 4), [{}], limit).allowed()[1].values()
        return only

    done: list[str] = []
    whole = allowed(TimeLimit(report=lambda name, *_: done.append(name)))
    assert done[0] == "color, vertices"
    assert np.isfinite(whole.values.lo).all()
    assert (whole.values.hi[:, 3:] == 0).all()
    monkeypatch.setattr(time_limit, "BATCH", 1000)
    left = allowed(TimeLimit(5.0, clock=Clock()))
    assert (left.untried, left.ambiguous.all(), left.unpromised.any()) == (24, True, False)
    assert np.isneginf(left.values.lo).all()


def test_progress_is_reported_by_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time_limit, "BATCH", 3072)
    done: list[tuple[str, int, int]] = []
    bounds("nested", 96, 64, TimeLimit(report=lambda *what: done.append(what)))
    assert done == [("nested", 0, 6144), ("nested", 3072, 6144)]
    said: list[str] = []
    kernel = pg.kernel(source="def one(color: Image) -> vec4: return color[0, 0]")
    compare(kernel(pg.Input("color")), ["reference"], progress=said.append, color=np.ones((3, 5, 4), np.float32))
    assert "bounds of one: 0%" in said


def slowed(monkeypatch: pytest.MonkeyPatch, kind: type) -> list[float]:
    """The time now, which goes on by 6 s with each of the reference's own runs of a kind of pass."""
    now, plain = [0.0], kind.__call__

    def slow(self: Any, *given: Any) -> None:
        now[0] += 6.0
        plain(self, *given)

    monkeypatch.setattr(kind, "__call__", slow)
    return now


DOUBLED = pg.kernel(source="def doubled(color: Image) -> vec4: return color[0, 0] * 2.0")


@pytest.mark.parametrize(("limit", "untried"), [(20.0, [0, 0]), (10.0, [0, 24]), (5.0, [24, 24])])
def test_the_reference_s_own_runs_count(monkeypatch: pytest.MonkeyPatch, limit: float, untried: list[int]) -> None:
    """They are made to their ends, and leave so much less for bounds."""
    now = slowed(monkeypatch, ReferencePixelPass)
    time = TimeLimit(limit, clock=lambda: now[0])
    chain = DOUBLED(DOUBLED(pg.Input("color")), into=pg.target("second", "rgba32f"))
    passes = Passes({"made": chain}, None, [{"color": np.ones((4, 6, 4), np.float32)}], time)
    pictures, allowed = passes.allowed()
    assert [one.untried for one in allowed.values()] == untried
    assert [picture[0, 0, 0] for picture in pictures.values()] == [2.0, 4.0]
    assert time.left_s == limit - 12.0


def test_the_reference_s_own_draws_count(monkeypatch: pytest.MonkeyPatch) -> None:
    now = slowed(monkeypatch, ReferenceDrawPass)
    text = placed("\ndef paint(corner: Corner) -> vec4:\n    return vec4(1.0)\n")
    mesh = pg.Mesh.make(positions=[[-1, -1, 0.5], [3, -1, 0.5], [-1, 3, 0.5]], triangles=[[0, 1, 2]])
    place, paint = (pg.vertex(source=text, name="place"), pg.fragment(source=text, name="paint"))
    drawn = pg.draw(mesh, vertex=place, fragment=paint, into=pg.target("color", "rgba8"))
    for limit, untried in ((10.0, [0, 0]), (5.0, [0, 24])):
        time = TimeLimit(limit, clock=lambda: now[0])
        passes = Passes({"made": DOUBLED(drawn)}, (6, 4), [{}], time)
        assert [one.untried for one in passes.allowed()[1].values()] == untried
