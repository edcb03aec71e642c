"""The page in a browser, used as a person would: by clicking, typing and saving files."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.viewer.subjects import KERNEL, files

api = pytest.importorskip("playwright.sync_api")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")]


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Any]:
    """The page of an effect of 8x4 texels, once its first picture is shown; no error on its console."""
    effect, picture = files(tmp_path)
    command = [sys.executable, "-m", "passgraph", "view", str(effect), str(picture), "--no-open", "-b", "numpy"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None
        with api.sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
            made, errors = browser.new_page(viewport={"width": 1000, "height": 700}), []
            made.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
            made.on("pageerror", lambda error: errors.append(str(error)))
            made.goto(found[0])
            made.wait_for_selector("body[data-shown]", timeout=60_000)
            yield made
            browser.close()
        process.terminate()
    assert errors == []


def color(page: Any, x: int, y: int) -> list[int]:
    """A pixel of the canvas."""
    code = f"() => [...document.getElementById('picture').getContext('2d').getImageData({x}, {y}, 1, 1).data]"
    return [int(number) for number in page.evaluate(code)][:3]


def until(page: Any, x: int, y: int, wanted: list[int]) -> None:
    for _ in range(600):
        if max(abs(a - b) for a, b in zip(color(page, x, y), wanted, strict=True)) <= 2:
            return
        page.wait_for_timeout(50)
    assert color(page, x, y) == wanted


def test_a_slider_an_edit_and_an_error(page: Any, tmp_path: Path) -> None:
    until(page, 2, 1, [0, 102, 204])
    page.locator("#value-gain").fill("0.5")
    until(page, 2, 1, [0, 51, 102])
    effect = tmp_path / "mine.py"
    effect.write_text(KERNEL.replace("* gain", "* gain * 2.0"))
    until(page, 2, 1, [0, 102, 204])
    effect.write_text(KERNEL.replace("* gain", "* gian"))
    page.wait_for_selector("#error:not([hidden])")
    assert "mine.py:11" in page.locator("#error").inner_text()
    until(page, 2, 1, [0, 102, 204])
    effect.write_text(KERNEL)
    page.wait_for_selector("#error", state="hidden")
    until(page, 2, 1, [0, 51, 102])
    page.locator("#undo").click()
    until(page, 2, 1, [0, 102, 204])


def test_a_click_shows_the_lines_of_a_pixel(page: Any) -> None:
    box = page.locator("#picture").bounding_box()
    page.mouse.click(box["x"] + box["width"] * 2.5 / 8, box["y"] + box["height"] * 1.5 / 4)
    page.wait_for_function("() => document.getElementById('pixel').textContent.includes('returns')")
    assert "(2, 1)" in page.locator("#pixel").inner_text()
    assert "0.4" in page.locator("#texel").inner_text()


def test_backends_are_compared(page: Any) -> None:
    page.locator("#compare").select_option("difference")
    until(page, 0, 0, [0, 0, 0])
    assert "largest difference" in page.locator("#status").inner_text()
    page.locator("#compare").select_option("both")
    until(page, 7, 3, [51, 51, 51])


def test_the_look_fits_the_range_and_is_reset(page: Any) -> None:
    page.locator("#channel").select_option("red")
    until(page, 2, 1, [0, 0, 0])
    page.locator("#low").fill("-1")
    page.locator("#auto").click()
    page.wait_for_function("() => document.getElementById('statistics').textContent.includes('NaN')")
    assert float(page.locator("#low").input_value()) == 0.0
    page.locator("#look-reset").click()
    until(page, 2, 1, [0, 102, 204])


def test_everything_is_reached_by_keys_and_has_a_name(page: Any) -> None:
    page.keyboard.press("Tab")
    reached = set()
    for _ in range(60):
        reached.add(page.evaluate("() => document.activeElement.id"))
        page.keyboard.press("Tab")
    assert {"play", "target", "compare", "value-gain", "channel", "stage"} <= reached
    code = """() => [...document.querySelectorAll("button, input, select, a")].filter((e) => !(e.labels?.length
        || e.ariaLabel || e.textContent.trim() || e.title)).map((e) => e.id)"""
    nameless = page.evaluate(code)
    assert nameless == []
