"""The webgpu backend on a device of headless Chromium."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.registry import open_backend
from passgraph.backends.webgpu import wgsl
from passgraph.errors import BackendError
from passgraph.verify.conformance import cases, run
from tests.respelling import respelled
from tests.web.browser import CHROMIUM

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")]


def test_pictures_go_there_and_back() -> None:
    turned = pg.kernel(source="def turned(color: Image, by: float) -> vec4: return color[0, 0].bgra * by")
    picture = np.random.default_rng(1).random((5, 7, 4), np.float32)
    with pg.compile(turned(pg.Input("frame"), pg.Value("by")), "webgpu:chromium") as program:
        assert program.backend.device_name.startswith("Chromium (")
        for by in (0.5, 2.0):
            assert np.array_equal(program(frame=picture, by=by)["turned"], picture[..., [2, 1, 0, 3]] * np.float32(by))


def test_an_error_of_the_browser_is_an_error_here() -> None:
    with open_backend("webgpu:chromium") as backend, pytest.raises(RuntimeError, match="unresolved"):
        backend.device.create_shader_module(code="fn main() -> f32 { return nothing; }")  # type: ignore[attr-defined]


def test_an_error_of_the_compiler_names_the_line_of_the_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    respelled(monkeypatch, wgsl.WGSL.spelled["float"], "sqrt", "no_such_function({0})")
    rooted = pg.kernel(source="def rooted(c: Image) -> float:\n    d = c[0, 0].r + 1.0\n    return sqrt(d)")
    with pytest.raises(BackendError, match=r"3: WebGPU refuses kernel rooted: .*no_such_function(.|\n)*return sqrt"):
        pg.compile(rooted(pg.Input("c", "r32f", (4, 4))), backend="webgpu:chromium")


def test_groups_of_the_conformance_suite_pass() -> None:
    chosen = list(cases(("operations", "pictures"), quick=True))[::9]
    report = run("webgpu:chromium", chosen)
    assert len(chosen) > 10
    assert report.passed, [str(verdict) for verdict in report.faults]
