"""The suite can fail: mistakes planted in a backend are found, by the case that is there for them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.stage import Storage
from passgraph.errors import UnsupportedError
from passgraph.formats import FORMATS
from passgraph.plan.data import DrawStep, PixelStep
from passgraph.verify.conformance import Case, SuiteReport, cases, judge, run
from passgraph.verify.conformance.judging import are_decided
from passgraph.verify.conformance.kept_results import json_of
from passgraph.verify.conformance.page import html_of
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.interval import Interval

Mistake = Callable[[Any, list[Storage], Any], None]


class Mistaken(ReferenceBackend):
    """The reference, and behind each pass a mistake: ``spoil(step, outputs, depth)``."""

    name = "mistaken"

    def __init__(self, spoil: Mistake | None = None, state: Callable[[Any], Any] = lambda state: state) -> None:
        super().__init__()
        self.spoil, self.state = spoil, state

    def pixel_pass(self, step: PixelStep) -> Any:
        inner = super().pixel_pass(step)

        def run(outputs: Any, images: Any, block: Any) -> None:
            inner(outputs, images, block)
            if self.spoil is not None:
                self.spoil(step, outputs, None)

        return run

    def draw_pass(self, step: DrawStep) -> Any:
        inner = super().draw_pass(replace(step, state=self.state(step.state)))

        def run(outputs: Any, depth: Any, *rest: Any) -> None:
            inner(outputs, depth, *rest)
            if self.spoil is not None:
                self.spoil(step, outputs, depth)

        return run


def named(name: str) -> Case:
    return next(case for case in cases() if case.id == name)


def brighter(step: Any, outputs: list[Storage], depth: Any) -> None:
    for output in outputs:
        output.pixels[...] *= np.float32(1.0 + 2.0**-20)


def shifted(step: Any, outputs: list[Storage], depth: Any) -> None:
    for output in outputs:
        output.pixels[...] = np.roll(output.pixels, 1, axis=1)


def one_pixel(step: Any, outputs: list[Storage], depth: Any) -> None:
    for output in outputs:
        output.pixels[output.pixels.shape[0] // 2, output.pixels.shape[1] // 3, 0] += np.float32(0.25)


def nearer(step: Any, outputs: list[Storage], depth: Any) -> None:
    if depth is not None:
        depth.pixels[...] = np.where(depth.pixels < 1, depth.pixels * np.float32(0.999), depth.pixels)


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("case", "mistake"),
    [
        ("operations/exp", brighter),
        ("operations/add", one_pixel),
        ("pictures/rgba32f 70x66 mirror", shifted),
        ("pictures/rgba8 9x1 zero", one_pixel),
        ("draw states/cull none, lean", brighter),
        ("draw states/depth less, written", nearer),
        ("draw states/draw into rgba16f", shifted),
        ("coverage/fan, every pixel once", one_pixel),
        ("sequences/a running sum in rgba32f", brighter),
        ("effects/gaussian-blur", one_pixel),
        ("effects/soft-shadow map_size=32 shadow_filter=hard taps=8 radius_px=3", shifted),
    ],
)
def test_a_planted_mistake_is_found(case: str, mistake: Mistake) -> None:
    made = named(case)
    (right,) = judge(made, [Mistaken()])
    assert right.outcome == "passed", str(right)
    (wrong,) = judge(made, [Mistaken(mistake)])
    assert wrong.outcome == "diverged"
    assert wrong.divergence is not None
    assert f"{case} on mistaken: diverged: " in str(wrong)


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("case", "state"),
    [
        ("draw states/cull back, place", lambda state: replace(state, cull="none")),
        ("draw states/depth less_equal, written", lambda state: replace(state, depth_compare="greater")),
        ("draw states/depth less, kept", lambda state: replace(state, depth_write=True)),
        ("draw states/stencil increment_wrap on depth_fail", lambda state: replace(state, stencil=None)),
        ("draw states/blend factor destination_alpha", lambda state: replace(state, blend=())),
        ("draw states/mask r-b-", lambda state: replace(state, color_mask=())),
        ("draw states/polygon offset 1.5, 0", lambda state: replace(state, polygon_offset=(0.0, 0.0))),
        ("draw states/clears", lambda state: replace(state, clear_stencil=0)),
    ],
)
def test_a_state_left_out_is_found(case: str, state: Callable[[Any], Any]) -> None:
    (wrong,) = judge(named(case), [Mistaken(state=state)])
    assert wrong.outcome == "diverged", str(wrong)


class Forgetful(ReferenceBackend):
    """Runs each pass once only: wrong where it depends on what changes."""

    name = "forgetful"

    def pixel_pass(self, step: PixelStep) -> Any:
        inner, done = super().pixel_pass(step), []

        def run(*arguments: Any) -> None:
            if not done:
                inner(*arguments)
            done.append(True)

        return run


@pytest.mark.parametrize("name", ["a running sum in rgba32f", "static inputs change", "last frame's picture"])
def test_a_stale_pass_is_found_in_a_later_frame(name: str) -> None:
    (wrong,) = judge(named(f"sequences/{name}"), [Forgetful()])
    assert wrong.outcome == "diverged"
    assert str(wrong.divergence).startswith("frame 1, pass ")


class Leaky(ReferenceBackend):
    """Right by itself, and wrong where a picture's memory held another one before: nothing is as in a fresh one."""

    name = "leaky"
    optimises = True

    def make(self, format: Any, size: tuple[int, int]) -> Storage:
        made = super().make(format, size)
        made.writers = set()  # type: ignore[attr-defined]
        return made

    def pixel_pass(self, step: PixelStep) -> Any:
        inner = super().pixel_pass(step)

        def run(outputs: Any, images: Any, block: Any) -> None:
            inner(outputs, images, block)
            for output in outputs:
                output.writers.add(step.name)
                if len(output.writers) > 1:
                    output.pixels[0, 0, 0] += 1

        return run


def test_what_is_known_to_the_bit_is_checked_with_memories_shared() -> None:
    (wrong,) = judge(named("sequences/memories shared along a chain"), [Leaky()])
    assert wrong.outcome == "diverged"
    assert "output out, all optimisations on" in str(wrong)


def picture(text: str, **options: Any) -> Case:
    kernel = pg.kernel(source=text)
    frame = {"color": np.full((4, 4, 4), 0.5, np.float32)}
    return Case("own", "case", lambda: {"out": kernel(pg.Input("color"))}, (4, 4), (frame,), **options)


def test_a_case_that_hangs_on_rounding_is_vacuous() -> None:
    text = "def cut(color: Image) -> vec4: return vec4(1.0) if color[0, 0].r * 0.1 * 20.0 > 1.0 else vec4(0.0)"
    (verdict,) = judge(picture(text), [Mistaken()])
    assert verdict.outcome == "vacuous"
    assert "100.00% of the pixels are ambiguous, above 5.00%" in verdict.reason
    assert judge(picture(text, most_ambiguous=1.0, least_told=0.0), [Mistaken()])[0].outcome == "passed"


def test_a_case_whose_bounds_say_nothing_is_vacuous() -> None:
    text = "def outside(color: Image) -> vec4: return sqrt(color[0, 0] - 1.0)"
    (verdict,) = judge(picture(text, most_ambiguous=1.0), [Mistaken()])
    assert verdict.outcome == "vacuous"
    assert "of 0.0% of the values something is known, below 90.0%" in verdict.reason


def test_a_sure_nan_is_told_and_a_possible_one_is_not() -> None:
    numbers = np.array([[[1.0, np.nan, 0.0]]])
    bounds = Allowed(
        Interval(numbers, numbers, np.array([[[False, True, True]]])), *[np.zeros((1, 1), np.bool_)] * 2, Counter()
    )
    assert are_decided(bounds, FORMATS["rgb32f"]).tolist() == [[[True, True, False]]]


def test_what_a_backend_raises_fails_the_case() -> None:
    def broken(step: Any, outputs: Any, depth: Any) -> None:
        raise RuntimeError("the driver gave up")

    (verdict,) = judge(named("operations/add"), [Mistaken(broken)])
    assert verdict.outcome == "failed"
    assert verdict.reason.endswith("RuntimeError: the driver gave up")


class Limited(Mistaken):
    """A device without 16-bit fractions, that says so."""

    limits = replace(ReferenceBackend.limits, not_kept={"u2": "wide fractions"})


def test_what_a_device_lacks_is_unsupported_and_no_fault() -> None:
    lacking, other = named("pictures/r16 7x5 clamp"), named("operations/add")
    report = run(Limited(), [lacking, other])
    assert [verdict.outcome for verdict in report.verdicts] == ["unsupported", "passed"]
    assert "is r16; " in report.verdicts[0].reason and "takes wide fractions" in report.verdicts[0].reason
    assert report.passed and report.groups[0].passed == 0
    assert json.loads(json_of(report))["cases"][0]["outcome"] == "unsupported"
    assert not run(Limited(), [lacking]).passed  # nothing was tried


def test_a_backend_may_refuse_a_step_itself() -> None:
    def refuse(step: Any, outputs: Any, depth: Any) -> None:
        raise UnsupportedError("mistaken: this device lacks what it takes")

    (verdict,) = judge(named("operations/add"), [Mistaken(refuse)])
    assert (verdict.outcome, verdict.reason) == ("unsupported", "mistaken: this device lacks what it takes")


def test_a_graph_that_cannot_be_made_fails_the_case() -> None:
    def broken() -> dict[str, pg.Target]:
        raise pg.GraphError("no such pass")

    (verdict,) = judge(Case("own", "case", broken, (4, 4)), [Mistaken()])
    assert verdict.outcome == "failed"
    assert verdict.reason.endswith("no such pass")


# The suite and its report


def mixed_report() -> SuiteReport:
    """One that passed, one that diverged, one that raised."""
    names = ["sequences/a running sum in rgba32f", "draw states/cull none, place", "draw states/draw into r8"]

    def spoil(step: Any, outputs: list[Storage], depth: Any) -> None:
        if step.name == "over":
            one_pixel(step, outputs, depth)
        if outputs and outputs[0].format.name == "r8":
            raise RuntimeError("<b>bold</b>")

    return run(Mistaken(spoil), [named(name) for name in names])


def test_a_run_goes_on_behind_what_fails() -> None:
    seen = []
    chosen = [named("operations/add"), named("sequences/a running sum in rgba32f")]
    report = run(Mistaken(one_pixel), chosen, progress=lambda number, case, state: seen.append((number, state)))
    assert [verdict.outcome for verdict in report.verdicts] == ["diverged", "diverged"]
    assert [number for number, _ in seen] == [0, 0, 1, 1]
    assert [state == "start" for _, state in seen] == [True, False, True, False]
    assert not report.passed
    assert not SuiteReport("none", ()).passed


def test_groups_are_summed_up() -> None:
    report = mixed_report()
    assert [(g.group, g.cases, g.passed) for g in report.groups] == [("sequences", 1, 1), ("draw states", 2, 0)]
    assert [report.count(name) for name in ("passed", "diverged", "vacuous", "failed")] == [1, 1, 0, 1]  # type: ignore[arg-type]


def test_an_unknown_group_is_refused() -> None:
    with pytest.raises(pg.InputError, match="there is no group 'pixels' of cases; there are operations, "):
        next(cases(["operations", "pixels"]))


class _Tags(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attributes)))


def test_the_page_shows_pictures_of_divergences_and_needs_no_other_file() -> None:
    text = html_of(mixed_report())
    page = _Tags()
    page.feed(text)
    pictures = [attributes["src"] for tag, attributes in page.found if tag == "img"]
    assert len(pictures) == 3
    assert all(source is not None and source.startswith("data:image/png;base64,") for source in pictures)
    assert not {"link", "script", "b>bold"} & {tag for tag, _ in page.found}
    assert "&lt;b&gt;bold&lt;/b&gt;" in text
    assert "worst at column 27, row 30" in text


def test_json_has_every_case() -> None:
    document = json.loads(json_of(mixed_report()))
    assert [case["outcome"] for case in document["cases"]] == ["passed", "diverged", "failed"]
    assert document["cases"][1]["divergence"]["column"] == 27
    assert document["passed"] is False


def test_frames_bring_their_own_inputs() -> None:
    """Pictures and values of each frame reach that frame."""
    text = "def add(a: Image, by: float) -> vec4: return a[0, 0] + by"
    kernel = pg.kernel(source=text)
    frames = tuple({"a": np.full((2, 2, 4), k, np.float32), "by": float(k)} for k in range(3))

    def graph() -> dict[str, pg.Target]:
        return {"out": kernel(pg.Input("a"), pg.Value("by", float))}

    case = Case("own", "frames", graph, (2, 2), frames, exact={"out": 4.0})
    (verdict,) = judge(case, [Mistaken()])
    assert verdict.outcome == "passed", str(verdict)
    assert len(verdict.targets) == 3
    (wrong,) = judge(replace(case, exact={"out": 3.0}), [Mistaken()])
    assert wrong.outcome == "diverged"
