"""Comparing backends: what agrees passes, what was planted is found, and the first pass to blame is named."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

import passgraph as pg
from passgraph import Image, vec4
from passgraph.backends.base import Backend
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.stage import ReferencePixelPass
from passgraph.errors import BackendError, DeviceMissingError
from passgraph.graph.targets import Target
from passgraph.plan.build import build
from passgraph.plan.data import PixelStep
from passgraph.verify.compare import Report, _bound_share, compare, distance
from passgraph.verify.oracle.pass_bounds import OPTIONS, Passes
from passgraph.verify.report import other_bits
from tests.agreement import assert_within_bounds

halve = pg.kernel(source="def halve(color: Image) -> vec4: return color[0, 0] * 0.5")
blur = pg.kernel(
    source="def blur(color: Image) -> vec4: return (color[-1, 0] + color[0, 0] + color[1, 0]) * (1.0 / 3.0)"
)
cut = pg.kernel(source="def cut(color: Image) -> vec4: return vec4(1.0) if color[0, 0].r < 0.5 else vec4(0.0)")
curve = pg.kernel(source="def curve(color: Image) -> vec4: return pow(color[0, 0], vec4(2.2)) + sin(color[0, 0] * 9.0)")
cancel = pg.kernel(source="def cancel(color: Image) -> vec4: return (color[0, 0] * 1000.1 + 4096.3) - 4096.3")
fill = pg.kernel(source="def fill(level: float) -> vec4: return vec4(level)")
frame = pg.Input("frame")


def picture(seed: int = 0, height: int = 24, width: int = 40) -> np.ndarray:
    return np.random.default_rng(seed).random((height, width, 4)).astype(np.float32)


class Skewed(ReferenceBackend):
    """The reference with a mistake in one pass: every value a little too large, or one pixel far off."""

    name = "skewed"

    def __init__(self, wrong: str, factor: float = 1.0, pixel: tuple[int, int] | None = None) -> None:
        super().__init__()
        self.wrong, self.factor, self.pixel = wrong, factor, pixel

    def pixel_pass(self, step: PixelStep) -> ReferencePixelPass:
        run = super().pixel_pass(step)
        if step.name != self.wrong:
            return run

        def skewed(outputs, images, block):  # type: ignore[no-untyped-def]
            run(outputs, images, block)
            if self.pixel is None:
                outputs[0].pixels[...] *= np.float32(self.factor)
            else:
                outputs[0].pixels[self.pixel[1], self.pixel[0]] += 0.25

        return skewed  # type: ignore[return-value]


def chain(fmt: str = "rgba32f") -> Target:
    target = frame
    for name in ("first", "second", "third"):
        target = blur(target, into=pg.target(name, fmt))
    return target


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("kernel", "fmt"),
    [
        *((kernel, "rgba32f") for kernel in (blur, curve, cut, cancel)),
        *((curve, fmt) for fmt in ("rgba16f", "rgba8", "rgba16", "rgba8_srgb")),
    ],
)
def test_every_backend_is_within_bounds(kernel: pg.PixelKernel, fmt: str) -> None:
    """What kernels of other kinds store in other formats is for the conformance suite."""
    assert_within_bounds(kernel(frame, into=pg.target("out", fmt)), frame=picture())


def test_the_reference_agrees_with_itself() -> None:
    report = compare(chain(), ["reference"], frame=picture())
    assert [target.max_error for target in report.backends[0].targets] == [0.0, 0.0, 0.0]
    assert [target.differing for target in report.backends[0].targets] == [0.0, 0.0, 0.0]
    assert [target.bound_share for target in report.backends[0].targets] == [0.0, 0.0, 0.0]


def test_an_error_is_told_as_a_share_of_what_is_allowed_there() -> None:
    """Half of the way from the reference to the upper bound, and a little beyond that bound."""
    passes = Passes({"third": chain()}, None, [{"frame": picture()}])
    expected, allowed = passes.allowed()
    (key,) = [key for key in expected if passes.plan.resources[key[2]].name == "second"]
    width = float(np.median(allowed[key].values.hi - expected[key]))
    assert width > 0.0
    for share in (0.5, 1.5):
        got = expected[key].astype(np.float64) + share * (allowed[key].values.hi - expected[key])
        assert _bound_share(got, expected[key], allowed[key].values) == pytest.approx(share)
    assert _bound_share(expected[key], expected[key], allowed[key].values) == 0.0


def test_a_wrong_pass_is_named_and_those_behind_it_are_not_blamed() -> None:
    report = compare(chain(), [Skewed("second", 1.0 + 1e-5)], frame=picture())
    (backend,) = report.backends
    assert not report.within_bounds
    assert [target.within_bounds for target in backend.targets] == [True, False, True]
    assert backend.first_divergence is not None
    assert backend.first_divergence.step == "second"
    assert backend.targets[2].max_error == 0.0
    assert backend.targets[2].accumulated_max > 0.0


def test_errors_that_add_up_are_reported_beside_the_verdict() -> None:
    """A pass behind the wrong one is judged on the reference's pictures, and measured on the backend's own too."""
    first, _, third = compare(chain(), [Skewed("second", 1.0 + 1e-4)], frame=picture()).backends[0].targets
    assert first.accumulated_max == 0.0
    assert third.within_bounds
    assert 1e-5 < third.accumulated_max < 2e-4


@pytest.mark.parametrize("fmt", ["rgba32f", "rgba16f", "rgba8"])
def test_one_wrong_pixel_is_found_where_it_is(fmt: str) -> None:
    report = compare(chain(fmt), [Skewed("second", pixel=(7, 3))], frame=picture() * np.float32(0.5))
    worst = report.backends[0].first_divergence
    assert worst is not None
    assert (worst.step, worst.worst) == ("second", (7, 3))
    assert worst.worst_got - worst.worst_expected == pytest.approx(0.25, abs=1e-3)
    assert "pass second, target second: outside its bounds" in str(worst)
    assert "column 7, row 3" in str(worst)


def test_a_decision_may_fall_the_other_way_where_rounding_turns_it_and_nowhere_else() -> None:
    """Columns 5 and 6 hold 0.3 / 0.6, which OpenGL and OpenCL may compute as a little less than a half."""
    near = pg.kernel(source="def near(c: Image) -> vec4: return vec4(1.0) if c[0, 0].r / 0.6 < 0.5 else vec4(0.0)")
    frame_ = np.full((10, 20, 4), 0.9, np.float32)
    frame_[:, 5:7] = 0.3

    def turned(column: int) -> Report:
        class Turned(ReferenceBackend):
            name = "turned"

            def pixel_pass(self, step: PixelStep) -> ReferencePixelPass:
                run = super().pixel_pass(step)

                def other(outputs, images, block):  # type: ignore[no-untyped-def]
                    run(outputs, images, block)
                    outputs[0].pixels[:, column] = 1.0 - outputs[0].pixels[:, column]

                return other  # type: ignore[return-value]

        return compare(near(frame, name="near"), [Turned()], frame=frame_)

    (target,) = turned(5).backends[0].targets
    assert target.within_bounds
    assert target.ambiguous == pytest.approx(2 / 20)
    assert not target.decided
    assert target.decisions == (("less", 20),)
    assert [(str(cause), count) for cause, count in target.places] == [("less (<kernel text>:1)", 20)]
    assert not turned(4).within_bounds


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("color[0, 0] * 2.0", "color[0, 0] * 2.00001"),
        ("floor(color[0, 0] * 8.0)", "round(color[0, 0] * 8.0)"),
        ("max(color[0, 0], vec4(0.5))", "min(color[0, 0], vec4(0.5))"),
        ("color[1, 0]", "color[0, 1]"),
        ("exp2(color[0, 0])", "exp(color[0, 0])"),
        ("color.sample(uv())", "color.sample(uv() + vec2(0.001, 0.0))"),
        ("color[0, 0] - 0.5", "0.5 - color[0, 0]"),
    ],
)
def test_a_planted_operation_is_caught(right: str, wrong: str) -> None:
    """Were bounds vacuous, another operation in its place would pass."""
    texts = [f"def op(color: Image) -> vec4: return {text}" for text in (right, wrong)]
    meant, planted = (pg.kernel(source=text) for text in texts)

    class Planted(ReferenceBackend):
        name = "planted"

        def pixel_pass(self, step: PixelStep) -> ReferencePixelPass:
            other = build({"x": planted(step.source.images["color"])}, step.size, options=OPTIONS).steps[0]
            assert isinstance(other, PixelStep)
            return super().pixel_pass(replace(step, program=other.program, source=other.source, facts=other.facts))

    known = pg.Input("frame", "rgba32f", (40, 24))
    assert compare(meant(known), ["reference"], frame=picture()).within_bounds
    assert not compare(meant(known), [Planted()], frame=picture()).within_bounds


def test_missing_and_failing_backends_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    class Failing(ReferenceBackend):
        name = "failing"

        def pixel_pass(self, step: PixelStep) -> ReferencePixelPass:
            raise BackendError("the compiler gave up")

    def gone(name: str) -> Backend:
        raise DeviceMissingError("no driver; run: apt-get install driver")

    monkeypatch.setattr("passgraph.verify.compare.open_backend", gone)
    report = compare(chain(), ["gl", Failing()], frame=picture())
    assert [(b.name, b.missing, b.failed) for b in report.backends] == [
        ("gl", "no driver; run: apt-get install driver", ""),
        ("failing", "", "the compiler gave up"),
    ]
    assert not report.within_bounds
    assert not Report((report.backends[0],), report.plan).within_bounds


def test_missing_inputs_are_named() -> None:
    with pytest.raises(pg.InputError, match="input 'frame' is missing"):
        compare(chain(), ["reference"])


def test_an_open_backend_stays_open() -> None:
    @contextmanager
    def watched() -> Iterator[Skewed]:
        backend = Skewed("none")
        backend.close = lambda: pytest.fail("closed")  # type: ignore[method-assign]
        yield backend

    with watched() as backend:
        assert compare(chain(), [backend], frame=picture()).within_bounds


# Bounds


def test_distance_knows_what_is_not_finite() -> None:
    a = np.array([[[1.0], [np.nan], [np.inf], [np.nan], [np.inf]]], np.float32)
    b = np.array([[[1.5], [np.nan], [np.inf], [1.0], [-np.inf]]], np.float32)
    assert distance(a, b).ravel().tolist() == [0.5, 0.0, 0.0, np.inf, np.inf]


def test_cancellation_widens_the_bound_and_plain_copies_do_not() -> None:
    wide = compare(cancel(frame), ["reference"], frame=picture()).backends[0].targets[0].median_width
    tight = compare(halve(frame), ["reference"], frame=picture()).backends[0].targets[0].median_width
    assert tight == 0.0  # halving is exact
    assert 2.0**-11 <= wide <= 4 * 2.0**-11  # a few units of numbers about 4096


@pg.struct
class Corner:
    position: vec4
    uv: pg.vec2


@pg.vertex
def place(vertex: pg.Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0), vertex.uv)


@pg.fragment
def paint(corner: Corner, texture: Image) -> vec4:
    return texture.sample(corner.uv)


def test_draws_agree_on_every_backend() -> None:
    positions = np.array([[-0.9, -0.8, 0.1], [0.9, -0.7, 0.5], [0.1, 0.9, 0.9]], np.float32)
    mesh = pg.Mesh.make(positions, np.array([[0, 1, 2]]), uvs=np.array([[0, 0], [1, 0], [0.5, 1]], np.float32))
    color = pg.draw(
        mesh, vertex=place, fragment=paint, texture=frame, into=pg.target("color", "rgba16f", scale=1.0),
        depth=pg.target("depth", "depth32f", scale=1.0),
    )  # fmt: skip
    out = blur(color, into=pg.target("out", "rgba16f"))
    report = assert_within_bounds({"out": out, "depth": color.depth}, frame=picture(), size=(64, 48))
    for backend in report.backends:
        assert [target.step for target in backend.targets] == ["color", "color", "out"]


class WrongDraw(ReferenceBackend):
    """The reference with a mistake behind each draw."""

    name = "wrong draw"

    def __init__(self, mistake: str) -> None:
        super().__init__()
        self.mistake = mistake

    def draw_pass(self, step):  # type: ignore[no-untyped-def]
        run = super().draw_pass(step)

        def wrong(outputs, depth, images, geometry, vertex, fragment):  # type: ignore[no-untyped-def]
            run(outputs, depth, images, geometry, vertex, fragment)
            if self.mistake == "half a percent brighter":
                outputs[0].pixels[...] *= np.float32(1.005)
            elif self.mistake == "one pixel to the right":
                outputs[0].pixels[...] = np.roll(outputs[0].pixels, 1, axis=1)
            else:
                depth.pixels[depth.pixels < 1] += np.float32(2.0**-10)

        return wrong


@pytest.mark.parametrize("mistake", ["half a percent brighter", "one pixel to the right", "depth off by 2**-10"])
def test_a_mistake_in_a_draw_is_caught(mistake: str) -> None:
    positions = np.array([[-0.9, -0.8, 0.1], [0.9, -0.7, 0.5], [0.1, 0.9, 0.9]], np.float32)
    mesh = pg.Mesh.make(positions, np.array([[0, 1, 2]]), uvs=np.array([[0, 0], [1, 0], [0.5, 1]], np.float32))
    color = pg.draw(
        mesh, vertex=place, fragment=paint, texture=frame, into=pg.target("color", "rgba32f", scale=1.0),
        depth=pg.target("depth", "depth32f", scale=1.0),
    )  # fmt: skip
    with WrongDraw(mistake) as backend:
        report = compare({"color": color, "depth": color.depth}, [backend], frame=picture(), size=(64, 48))
    assert not report.within_bounds


# Beside the bounds


def test_backends_of_the_same_bits_are_told_as_such() -> None:
    report = compare(chain(), ["reference", Skewed("none")], frame=picture())
    assert report.bit_for_bit
    assert report.difference is None
    assert report.equality == "bit for bit the same on reference and skewed"
    assert report.passed
    assert compare(chain(), ["reference"], frame=picture()).equality == ""


def test_the_first_pass_of_other_bits_is_named_for_whatever_pair() -> None:
    """The third differs earlier than the second, in one pixel; behind that all differs."""
    second, first = Skewed("third", 1.001), Skewed("second", pixel=(7, 3))
    second.name, first.name = "later", "earlier"  # type: ignore[misc]
    report = compare(chain(), ["reference", second, first], frame=picture())
    assert not report.bit_for_bit
    found = report.difference
    assert found is not None
    assert (found.step, found.target, found.backends) == ("second", "second", ("reference", "earlier"))
    assert (found.pixels, found.pixel) == (1, (7, 3))
    assert found.values[1][0] - found.values[0][0] == pytest.approx(0.25)
    assert report.equality.startswith(
        "not bit for bit the same: first in pass second, target second: reference and earlier differ at 1 pixel "
        "(0.104%), such as column 7, row 3: ("
    )


def test_zeros_of_other_signs_are_other_bits_and_nan_is_as_nan() -> None:
    one = np.array([[[0.0, np.nan], [1.0, np.inf]]], np.float32)
    other = np.array([[[-0.0, -np.nan], [1.0, np.inf]]], np.float32)
    assert other_bits(one, one.copy()).tolist() == [[False, False]]
    assert other_bits(one, other).tolist() == [[True, False]]


class Special(ReferenceBackend):
    """The reference with one value in one pixel of every pass."""

    name = "special"

    def __init__(self, value: float) -> None:
        super().__init__()
        self.value = value

    def pixel_pass(self, step: PixelStep) -> ReferencePixelPass:
        run = super().pixel_pass(step)

        def special(outputs, images, block):  # type: ignore[no-untyped-def]
            run(outputs, images, block)
            outputs[0].pixels[3, 7, 1] = self.value

        return special  # type: ignore[return-value]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_another_kind_of_value_within_bounds_does_not_pass(value: float) -> None:
    root = pg.kernel(source="def root(c: Image) -> vec4: return sqrt(c[0, 0] * 0.1 - c[0, 0] / 10.0)")
    given = {"frame": np.full((24, 40, 4), 0.5, np.float32), "most_ambiguous": 1.0}
    report = compare(root(frame, name="root"), [Special(value), Special(0.25)], **given)
    wrong, right = report.backends
    assert wrong.within_bounds and right.within_bounds and right.passed
    assert not wrong.passed and not report.passed
    found = wrong.targets[0].other_kind
    assert found is not None
    assert (found.pixel, found.share) == ((7, 3), pytest.approx(1 / 960))
    assert [cause.operation for cause in found.causes] == ["sqrt"]
    assert "mend the kernel there, such as: sqrt(max(x, 0.0))" in wrong.faults[0]


def test_where_the_reference_has_nan_a_number_does_not_pass() -> None:
    root = pg.kernel(source="def root(c: Image) -> vec4: return sqrt(c[0, 0])")
    given = {"frame": np.full((24, 40, 4), -0.5, np.float32), "most_ambiguous": 1.0}
    same, other = compare(root(frame), ["reference", Special(0.5)], **given).backends
    assert same.passed
    assert not other.passed
    assert other.within_bounds


@pg.fragment
def rooted(corner: Corner) -> vec4:
    return vec4(pg.sqrt(corner.uv.x * 0.1 - corner.uv.x / 10.0))


def test_the_kind_of_a_draw_is_looked_at_too() -> None:
    """A fragment's root, with the line of its kernel."""
    positions = np.array([[-1, -1, 0.5], [3, -1, 0.5], [-1, 3, 0.5]], np.float32)
    mesh = pg.Mesh.make(positions, np.array([[0, 1, 2]]), uvs=np.full((3, 2), 0.5, np.float32))

    class SpecialDraw(WrongDraw):
        def draw_pass(self, step):  # type: ignore[no-untyped-def]
            run = ReferenceBackend.draw_pass(self, step)

            def special(outputs, *rest):  # type: ignore[no-untyped-def]
                run(outputs, *rest)
                outputs[0].pixels[3, 7, 1] = np.nan

            return special

    made = pg.draw(mesh, vertex=place, fragment=rooted, into=pg.target("made", "rgba32f", scale=1.0))
    with SpecialDraw("nan") as backend:
        report = compare(made, [backend], size=(40, 24), most_ambiguous=1.0)
    found = report.backends[0].targets[0].other_kind
    assert found is not None
    assert found.pixel == (7, 3)
    assert [(cause.operation, cause.span.text.strip()) for cause in found.causes] == [
        ("sqrt", "return vec4(pg.sqrt(corner.uv.x * 0.1 - corner.uv.x / 10.0))")
    ]


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan"), "half"])
def test_a_share_is_from_0_to_1(share: object) -> None:
    with pytest.raises(pg.InputError, match="most_ambiguous of compare must be a number from 0 to 1, got"):
        compare(chain(), ["reference"], most_ambiguous=share, frame=picture())  # type: ignore[arg-type]
