"""The exported page and the runtime in a browser: controls, damaged documents, other hosts."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.parameters import Parameter
from passgraph.viewer.subject import Control
from passgraph.web import export_web
from passgraph.web.export import Described
from tests.web.browser import CHROMIUM, opened, read, run

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")

dim = pg.kernel(source="def dim(color: Image, by: float) -> vec4: return color[0, 0] * by")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An effect of 6x4 texels, all of them 0.8."""
    strength = Parameter("by", "float", 0.5, pg.Range(0, 2), "factor")
    control = Control.of(strength)
    assert control is not None
    export_web(
        dim(pg.Input("frame", "rgba8"), pg.Value("by", default=0.5)), tmp_path,
        described=Described("dim", "Darker.", (control,)), frame=np.full((4, 6, 4), 204, np.uint8),
    )  # fmt: skip
    return tmp_path


def test_the_page_runs_and_asks_no_other_host(folder: Path) -> None:
    with opened(folder, "index.html") as page:
        page.wait_for_selector("body[data-shown='1']")
        assert page.locator("h1").inner_text() == "dim"
        assert read(page)[0, 0].tolist() == pytest.approx([0.4] * 4, abs=1e-3)
        page.locator("#value-by").fill("1")
        page.wait_for_selector("body[data-shown='2']")
        assert read(page)[0, 0].tolist() == pytest.approx([0.8] * 4, abs=1e-3)
        page.locator("#target").select_option("frame")
        page.mouse.move(300, 300)
        page.wait_for_function("() => document.getElementById('texel').textContent.startsWith('frame (')")
        assert ": 0.8 0.8 0.8 0.8" in page.locator("#texel").inner_text()
        page.locator("#reset").click()
        page.wait_for_selector("body[data-shown='3']")
        assert page.locator("#value-by").input_value() == "0.5"
        assert (page.asked, page.faults) == ({page.host}, [])


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_is_accessible(folder: Path, scheme: str) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    with opened(folder, "index.html") as page:
        page.emulate_media(color_scheme=scheme)
        assert axe.run(page).response["violations"] == []


def test_what_is_drawn_is_the_picture(folder: Path) -> None:
    """Headless Chromium shows no WebGPU canvas without a display, so a texture stands for it."""
    code = """async () => {
        program.run();
        const { device } = program, size = [6, 4], format = navigator.gpu.getPreferredCanvasFormat();
        const texture = device.createTexture({ size, format, usage: 17 });
        program.draw({ getContext: () => ({ configure() {}, getCurrentTexture: () => texture }) });
        const buffer = device.createBuffer({ size: 1024, usage: 9 }), encoder = device.createCommandEncoder();
        encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow: 256 }, size);
        device.queue.submit([encoder.finish()]);
        await buffer.mapAsync(1);
        return [...new Uint8Array(buffer.getMappedRange()).slice(0, 4)];
    }"""
    with opened(folder) as page:
        # Premultiplied: color 0.4 times alpha 0.4.
        assert page.evaluate(code) == pytest.approx([41, 41, 41, 102], abs=1)


@pytest.mark.slow
def test_a_picture_of_another_size_and_wrong_values(folder: Path) -> None:
    with opened(folder) as page:
        raw = "{ data: new Float32Array(24).fill(0.5), width: 3, height: 2 }"
        page.evaluate(f"() => program.run({{ frame: {raw} }}, {{ by: 2 }})")
        assert read(page).shape == (2, 3, 4)
        assert read(page)[1, 2, 0] == pytest.approx(2 * 128 / 255, abs=1e-3)
        for call, message in {
            "program.run({ other: 1 })": 'there is no input "other"',
            "program.run({}, { strength: 1 })": 'there is no value "strength"',
            "program.run({}, { by: 'much' })": 'value "by": expected a number',
            "program.read('nothing')": 'there is no target "nothing"',
        }.items():
            said = page.evaluate(f"async () => {{ try {{ await {call}; }} catch (error) {{ return String(error); }} }}")
            assert message in said


@pytest.mark.slow
def test_without_webgpu_the_page_says_so(folder: Path) -> None:
    with opened(folder) as page:
        page.add_init_script("Object.defineProperty(navigator, 'gpu', { value: undefined });")
        page.goto(f"http://{page.host}/index.html")
        page.wait_for_selector("body[data-failed]")
        assert "This browser has no WebGPU device" in page.locator("#error").inner_text()


def _damage(path: str, value: Any) -> Callable[[dict[str, Any]], None]:
    def damage(document: dict[str, Any]) -> None:
        *parents, last = path.split(".")
        at: Any = document
        for name in parents:
            at = at[int(name) if isinstance(at, list) else name]
        at[int(last) if isinstance(at, list) else last] = value

    return damage


DAMAGES = {
    'format: expected "passgraph effect"': _damage("format", "other"),
    "version: expected 1": _damage("version", 99),
    "data.file: expected the name of a file beside it": _damage("data.file", "https://example.org/effect.bin"),
    "inputs.frame.picture: expected the name of a file beside it": _damage("inputs.frame.picture", "../secret.png"),
    "effect.bin: expected 4096 bytes": _damage("data.bytes", 4096),
    "resources[0].size: expected a whole number": _damage("resources.0.size", [1e9, 4]),
    "resources[0].texel: expected uint8, float16, float32": _damage("resources.0.texel", "float64"),
    "resources[1].rule: expected the name of an input": _damage("resources.1.rule", {"input": "elsewhere"}),
    "steps[0].kind: expected pixel, draw or copy": _damage("steps.0.kind", "shell"),
    "steps[0].pipeline: expected a whole number": _damage("steps.0.pipeline", 5),
    "steps[0].stages[0].images: expected a whole number": _damage("steps.0.stages.0.images", [-1]),
    "steps[0].stages[0].values: expected a whole number": _damage("steps.0.stages.0.values.0.at", 4096),
    "modules[0], line 1": _damage("modules.0", "no shader"),
    "Export the effect again": _damage("pipelines.0.fragment.targets", [{"format": "r8unorm"}, {"format": "none"}]),
    "steps: expected a list": _damage("steps", None),
}


@pytest.mark.slow
def test_damaged_documents_are_errors_that_name_the_place(folder: Path) -> None:
    whole = json.loads((folder / "effect.json").read_text())
    code = """async () => {
        const { load } = await import("./passgraph.js");
        try { await load("effect.json?" + Math.random()); return "loaded"; } catch (error) { return String(error); }
    }"""
    with opened(folder) as page:
        run(page, {})
        for message, damage in DAMAGES.items():
            damaged = copy.deepcopy(whole)
            damage(damaged)
            (folder / "effect.json").write_text(json.dumps(damaged))
            assert message in page.evaluate(code)
        (folder / "effect.json").write_text('{"format": ')
        assert "effect.json: cannot be read; expected JSON" in page.evaluate(code)
        (folder / "effect.json").unlink()
        assert "effect.json: not found (status 404)" in page.evaluate(code)
        assert page.asked == {page.host}
