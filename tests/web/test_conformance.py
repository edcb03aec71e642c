"""Cases of the conformance suite in Chromium, each pass held against its bounds on the browser's own pictures."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import sepia
from passgraph.graph.targets import named_outputs
from passgraph.verify.conformance import Case, cases
from passgraph.verify.oracle.pass_bounds import OPTIONS, Passes
from passgraph.web import export_web
from tests.web.browser import CHROMIUM, LIBRARY, opened, run
from tests.web.test_agreement import within, written_in

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")

#: What every run has of them: draws of several meshes, a size that is not the input's, an input that no pass reads.
ALWAYS = (
    "draw states/depth less, written",
    "draw states/several targets",
    "language/uints",
    "pictures/33x18 resized to 7x5",
)
#: Cases that a browser is not held to, and why.
LEFT_OUT = {
    "draw states/blend into rgba16": "blending into rgba16 takes WebGPU's texture-formats-tier1",
    "draws/blend from beyond [0, 1] into rgba16": "blending into rgba16 takes WebGPU's texture-formats-tier1",
    "plans/drawn over while still needed": "what it was before it is drawn over cannot be read afterwards",
    "language/stored in r16f": "SwiftShader stores infinity as NaN in halves; WGSL promises neither",
}
CASES = [case for case in cases(quick=True) if case.group != "effects" and len(case.frames) == 1]


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Any]]:
    """A folder, and a page that opens what is exported there."""
    root = tmp_path_factory.mktemp("exports")
    export_web(sepia(pg.Input("frame")), root, size=(4, 4))
    with opened(root) as page:
        yield root, page


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, id=case.id, marks=() if case.id in ALWAYS else pytest.mark.slow) for case in CASES],
)
def test_every_pass_is_within_its_bounds(case: Case, browser: tuple[Path, Any]) -> None:
    if case.id in LEFT_OUT:
        pytest.skip(LEFT_OUT[case.id])
    root, page = browser
    name, frame = f"case{CASES.index(case)}", dict(case.frames[0])
    outputs = named_outputs(case.graph())
    passes = Passes(outputs, case.size, [frame])
    export_web(outputs, root / name, size=case.size, options=OPTIONS, **frame)
    (root / name / "library.html").write_text(LIBRARY)
    page.goto(f"http://{page.host}/{name}/library.html")
    page.wait_for_selector("body[data-ready]", state="attached", timeout=120_000)
    assert page.evaluate("globalThis.failed") is None
    run(page, {})
    got = written_in(page, passes)
    within(passes, got, 1.0 if case.exact else case.most_ambiguous)
    results = {resource: picture for (_, _, resource), picture in got.items()}
    for output, known in case.exact.items():
        exact = known() if callable(known) else known
        result = results[passes.plan.outputs[output]]
        assert np.array_equal(result, np.broadcast_to(exact, result.shape), equal_nan=True), output
