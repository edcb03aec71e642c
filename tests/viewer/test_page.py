"""The page in a browser, used as a person would: by clicking, typing and saving files."""

from __future__ import annotations

import os
import random
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from passgraph.backends.webgpu.chromium import executable
from tests.viewer.subjects import KERNEL, files
from tests.viewer.test_signals import KEYS

api = pytest.importorskip("playwright.sync_api")
CHROMIUM = executable()
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")


@contextmanager
def opened(*words: str, backend: str = "numpy") -> Iterator[Any]:
    """The page of `passgraph view` once its first picture is shown; no error on its console."""
    command = [sys.executable, "-m", "passgraph", "view", *words, "--no-open", "-b", backend]
    errors: list[str] = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"http://\S+", process.stdout.readline())
            assert found is not None
            with api.sync_playwright() as playwright:
                browser = playwright.chromium.launch(
                    executable_path=CHROMIUM, args=["--no-sandbox", "--disable-dev-shm-usage"]
                )
                page = browser.new_page(viewport={"width": 1000, "height": 700})
                page.server_pid = process.pid
                page.on("console", lambda message: errors.append(message.text) if is_fault(message) else None)
                page.on("pageerror", lambda error: errors.append(str(error)))
                page.goto(found[0])
                page.wait_for_selector("body[data-shown]", timeout=60_000)
                yield page
                browser.close()
        finally:
            process.terminate()
    assert errors == []


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Any]:
    """The page of an effect of 8x4 texels."""
    effect, picture = files(tmp_path)
    with opened(str(effect), str(picture)) as shown:
        yield shown


def is_fault(message: Any) -> bool:
    """Return True for an error of the page; what the server refuses (400) is said on the page, and by the browser."""
    return bool(message.type == "error" and "status of 400" not in message.text)


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


@pytest.mark.slow
def test_a_click_shows_the_lines_of_a_pixel(page: Any) -> None:
    box = page.locator("#picture").bounding_box()
    page.mouse.click(box["x"] + box["width"] * 2.5 / 8, box["y"] + box["height"] * 1.5 / 4)
    row = page.locator("#pixel tbody tr")
    row.wait_for()
    assert row.locator("td").all_inner_texts()[2:] == ["returns ", "0  0.400000006  0.800000012  1", "="]
    assert "(2, 1)" in page.locator("#pixel").inner_text()
    assert "numpy: every line is within its bounds" in page.locator("#pixel li").all_inner_texts()
    assert "0.4" in page.locator("#texel").inner_text()
    page.locator("#pixel button", has_text="color: 1 texel of frame").click()
    page.wait_for_function("() => document.getElementById('target').value === 'frame'")
    page.locator("#pixel-close").click()
    assert page.locator("#pixel-panel").is_hidden()


@pytest.mark.slow
def test_a_pass_is_chosen_in_the_plan_by_keys(page: Any) -> None:
    page.locator("#plan-panel summary").click()
    page.locator("#profile").click()
    page.locator("#plan [data-pass=tint]").focus()
    page.keyboard.press("Enter")
    page.locator("#code").select_option("gl")
    assert "void main()" in page.locator("#pass pre").inner_text()
    page.locator("#code").select_option("kernel")
    assert "def tint" in page.locator("#pass pre").inner_text()


@pytest.mark.slow
def test_the_verdict_lies_over_the_picture_until_it_changes(page: Any) -> None:
    page.locator("#compare").select_option("verdict")
    page.wait_for_selector("#mask:not([hidden])", state="attached")
    assert "0 of 32 pixels are outside" in page.locator("#mask").get_attribute("alt")
    page.locator("#value-gain").fill("0.5")
    assert page.locator("#mask").is_hidden()
    assert page.locator("#compare").input_value() == ""


@pytest.mark.slow
def test_a_picture_is_compared_with(page: Any, tmp_path: Path) -> None:
    page.locator("#compare").select_option("difference")
    with page.expect_file_chooser() as chooser:
        page.locator("#other").select_option("file")
    chooser.value.set_files(tmp_path / "picture.png")
    page.locator("#value-gain").fill("2")
    page.wait_for_function("() => document.getElementById('status').textContent.includes('difference 0.800')")


@pytest.mark.slow
def test_two_sets_of_parameters_are_compared(page: Any) -> None:
    page.locator("#compare").select_option("difference")
    page.locator("#other").select_option("kept")
    page.wait_for_function("() => document.getElementById('status').textContent.includes('difference 0.00')")
    page.locator("#value-gain").fill("0.5")
    page.wait_for_function("() => document.getElementById('status').textContent.includes('difference 0.400')")


@pytest.mark.slow
def test_pictures_and_videos_are_saved(page: Any, tmp_path: Path) -> None:

    page.locator("#save-as").select_option("png16")
    with page.expect_download() as saved:
        page.locator("#save").click()
    with Image.open(saved.value.path()) as picture:
        assert picture.size == (8, 4)
    page.locator("#record-panel summary").click()
    page.locator("#record-last").fill("2")
    page.locator("#record-as").select_option("gif")
    with page.expect_download() as saved:
        page.locator("#record").click()
    with Image.open(saved.value.path()) as made:
        assert (made.size, made.convert("RGB").getpixel((2, 1))) == ((8, 4), (0, 102, 204))


@pytest.mark.slow
def test_results_in_linear_light_are_shown_encoded(tmp_path: Path) -> None:
    """As `apply` writes them into a PNG: an even gray stays as it is."""
    Image.new("RGB", (8, 4), (128, 128, 128)).save(tmp_path / "gray.png")
    with opened("cas", str(tmp_path / "gray.png")) as page:
        until(page, 2, 1, [128, 128, 128])
        assert page.locator("#srgb").is_checked()
        page.locator("#srgb").uncheck()
        until(page, 2, 1, [55, 55, 55])


@pytest.mark.slow
def test_a_drag_moves_the_mouse_of_a_shadertoy_and_time_is_sought(tmp_path: Path) -> None:
    shader = tmp_path / "mouse.glsl"
    shader.write_text(
        "void mainImage(out vec4 c, in vec2 p) { c = vec4(iMouse.xy / iResolution.xy, mod(float(iFrame), 2.0), 1.0); }"
    )
    with opened(str(shader), "--size", "16x8") as page:
        until(page, 0, 0, [0, 0, 0])
        page.locator("#seek").fill("7")
        until(page, 0, 0, [0, 0, 255])
        box = page.locator("#picture").bounding_box()
        at = [
            (box["x"] + box["width"] * x / 16, box["y"] + box["height"] * y / 8) for x, y in ((4.5, 4.5), (12.5, 2.5))
        ]
        page.mouse.move(*at[0])
        page.mouse.down()
        page.mouse.move(*at[1], steps=4)
        until(page, 0, 0, [199, 175, 255])
        page.mouse.up()
        page.locator("#undo").click()
        until(page, 0, 0, [0, 0, 255])


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_contrast(page: Any, scheme: str) -> None:
    """4.5 to 1, as WCAG 2 asks of text, for each color of text on each ground of the page."""
    page.emulate_media(color_scheme=scheme)
    code = """() => Object.fromEntries(["--bg", "--panel", "--text", "--dim", "--accent", "--wrong", "--mark"].map(
        (name) => [name, getComputedStyle(document.documentElement).getPropertyValue(name).trim()]))"""
    colors = {name: _luminance(text) for name, text in page.evaluate(code).items()}
    pairs = [(text, ground) for text in ("--text", "--dim", "--accent", "--wrong") for ground in ("--bg", "--panel")]
    for text, ground in [*pairs, ("--text", "--mark"), ("--wrong", "--mark")]:
        lighter, darker = sorted((colors[text], colors[ground]), reverse=True)
        assert (lighter + 0.05) / (darker + 0.05) >= 4.5, (text, ground)


def _luminance(text: str) -> float:
    """Relative luminance of #rgb or #rrggbb, as WCAG 2 defines it."""
    digits = text[1:] if len(text) == 7 else "".join(2 * digit for digit in text[1:])
    parts = [int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4)]
    red, green, blue = (x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def drop(stage: Any, path: Path) -> None:
    """Drop a file on the picture."""
    code = """(stage, [bytes, name]) => {
        const data = new DataTransfer();
        data.items.add(new File([new Uint8Array(bytes)], name));
        stage.dispatchEvent(new DragEvent("drop", { dataTransfer: data, cancelable: true }));
    }"""
    stage.evaluate(code, [list(path.read_bytes()), path.name])


@pytest.mark.slow
def test_a_picture_is_dropped_on_the_page(page: Any, tmp_path: Path) -> None:
    Image.new("RGB", (5, 6), (7, 8, 9)).save(tmp_path / "other.png")
    drop(page.locator("#stage"), tmp_path / "other.png")
    until(page, 4, 5, [7, 8, 9])
    assert page.locator("#status").inner_text().startswith("tint 5×6")
    drop(page.locator("#stage"), tmp_path / "mine.py")
    page.wait_for_function("() => document.getElementById('status').textContent.includes('.py')")
    drop(page.locator("#stage"), tmp_path / "picture.png")
    until(page, 2, 1, [0, 102, 204])


@pytest.mark.slow
def test_random_use_leaves_the_page_working(page: Any, tmp_path: Path) -> None:
    """Clicks, drags, choices, drops and saves in random order.

    PASSGRAPH_VIEW_MINUTES makes it longer than half a minute, PASSGRAPH_VIEW_SEED gives another order.
    """
    dice, effect = random.Random(int(os.environ.get("PASSGRAPH_VIEW_SEED", "29"))), tmp_path / "mine.py"
    texts = [KERNEL, KERNEL.replace("* gain", "* gian")]
    Image.new("RGB", (5, 6), (7, 8, 9)).save(tmp_path / "other.png")
    began = time.monotonic()
    end = began + 60.0 * float(os.environ.get("PASSGRAPH_VIEW_MINUTES", "0.5"))
    page.on("dialog", lambda dialog: dialog.dismiss())
    page.evaluate("() => document.querySelectorAll('details').forEach((panel) => { panel.open = true; })")
    used = []
    while time.monotonic() < end:
        what = dice.randrange(7)
        if what == 0:
            effect.write_text(dice.choice([*texts, KERNEL.replace("* gain", f"* gain * {dice.random()}")]))
        elif what == 1:
            select = dice.choice(page.query_selector_all("select:visible"))
            values = select.evaluate("(e) => [...e.options].map((option) => option.value).filter((v) => v !== 'file')")
            if values:
                while_there(select, partial(select.select_option, dice.choice(values), timeout=5000))
        elif what == 2:
            button = dice.choice(page.query_selector_all("main button:visible:enabled, header button:visible:enabled"))
            while_there(button, partial(button.click, timeout=5000, force=True))
        elif what == 3:
            page.locator("#value-gain").fill(str(round(dice.uniform(0, 4), 2)))
        elif what == 4:
            drop(page.locator("#stage"), tmp_path / dice.choice(["other.png", "picture.png", "mine.py"]))
        else:
            box = page.locator("#stage").bounding_box()
            x, y = (box[at] + box[size] * dice.random() for at, size in (("x", "width"), ("y", "height")))
            page.mouse.move(x, y)
            page.mouse.wheel(0, dice.randint(-200, 200)) if what == 5 else page.mouse.click(x, y)
        page.wait_for_timeout(20)
        if len(used) < 20 * (time.monotonic() - began) / (end - began):
            used.append(resources(page.server_pid))
            print(used[-1])
    effect.write_text(KERNEL)
    for name, value in {"compare": "", "target": "tint", "backend": "numpy", "channel": "color"}.items():
        page.locator(f"#{name}").select_option(value)
    if page.locator("#play").get_attribute("aria-pressed") == "true":
        page.locator("#play").click()
    page.locator("#look-reset").click()
    page.locator("#reset").click()
    drop(page.locator("#stage"), tmp_path / "picture.png")
    until(page, 2, 1, [0, 102, 204])


def while_there(element: Any, act: Callable[[], object]) -> None:
    """Act on an element that an answer of the session may remove meanwhile."""
    try:
        act()
    except api.Error:
        if element.is_visible():
            raise


def resources(pid: int) -> dict[str, int]:
    """What the server holds: memory in MiB, threads, open files."""
    status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    held = {"memory": int(status["VmRSS"].split()[0]) >> 10, "threads": int(status["Threads"])}
    return {**held, "files": len(list(Path(f"/proc/{pid}/fd").iterdir()))}


@pytest.mark.slow
def test_backends_are_compared(page: Any) -> None:
    for choice in ("backend", "other"):
        names = page.locator(f"#{choice} option").all_inner_texts()
        assert names[:4] == ["reference", "numpy", "gl", "opencl"]
        assert "null" not in names
    page.locator("#compare").select_option("difference")
    until(page, 0, 0, [0, 0, 0])
    assert "largest difference" in page.locator("#status").inner_text()
    page.locator("#compare").select_option("both")
    until(page, 7, 3, [51, 51, 51])


@pytest.mark.slow
def test_the_look_fits_the_range_and_is_reset(page: Any) -> None:
    page.locator("#channel").select_option("red")
    until(page, 2, 1, [0, 0, 0])
    page.locator("#low").fill("-1")
    page.locator("#auto").click()
    page.wait_for_function("() => Number(document.getElementById('low').value) === 0")
    page.locator("#look-reset").click()
    until(page, 2, 1, [0, 102, 204])


@pytest.mark.slow
def test_the_picture_is_used_by_keys(page: Any) -> None:
    page.locator("#stage").focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_function("() => document.getElementById('texel').textContent.startsWith('(3, 1)')")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Enter")
    page.locator("#pixel tbody tr").wait_for()
    assert "(2, 1)" in page.locator("#pixel").inner_text()
    page.keyboard.press("Escape")
    assert page.locator("#pixel-panel").is_hidden()
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")  # it fits
    look = "() => document.getElementById('picture').style.transform"
    seen = [page.evaluate(look)]
    for key in ("+", "Alt+ArrowRight", "-", "f"):
        page.keyboard.press(key)
        seen.append(page.evaluate(look))
    assert [seen.count(one) for one in seen] == [2, 1, 1, 1, 2]
    page.keyboard.press("Shift+ArrowDown")
    page.wait_for_function("() => document.getElementById('texel').textContent.startsWith('(2, 3)')")


def test_keys_go_to_a_shader_that_reads_them_while_the_picture_has_the_focus(tmp_path: Path) -> None:
    shader = tmp_path / "keys.glsl"
    shader.write_text(KEYS)
    down, up = [255, 0, 0], [0, 0, 0]
    with opened(str(shader), "--size", "256x3") as page:
        play = page.locator("#play")
        assert "reads the keyboard" in page.locator("#keys").inner_text()
        page.keyboard.down("a")
        page.keyboard.up("a")
        page.locator("#stage").click(position={"x": 5, "y": 5})
        page.keyboard.down("a")
        page.keyboard.down(" ")
        until(page, 65, 2, down)
        until(page, 32, 2, down)
        assert play.get_attribute("aria-pressed") == "false"
        page.keyboard.up("a")
        until(page, 65, 2, up)
        until(page, 65, 0, down)  # toggled, once: the first press was not in the picture
        page.keyboard.press("Escape")
        until(page, 32, 2, up)
        page.keyboard.up(" ")
        page.keyboard.press(" ")
        assert play.get_attribute("aria-pressed") == "true"
        until(page, 32, 2, up)


@pytest.mark.slow
def test_an_input_is_replaced_by_keys(page: Any, tmp_path: Path) -> None:
    Image.new("RGB", (5, 6), (7, 8, 9)).save(tmp_path / "other.png")
    page.locator("#input-open").focus()
    with page.expect_file_chooser() as chooser:
        page.evaluate("0")  # Chromium answers once it hands choosers to the test; one opened before is lost
        page.keyboard.press("Enter")
    chooser.value.set_files(tmp_path / "other.png")
    until(page, 4, 5, [7, 8, 9])


@pytest.mark.slow
def test_a_map_of_seen_differences_is_shown(page: Any) -> None:
    pytest.importorskip("flip_evaluator")
    page.locator("#compare").select_option("flip")
    page.wait_for_function("() => document.getElementById('status').textContent.includes('mean FLIP 0.00')")


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(page: Any, scheme: str) -> None:
    """axe-core's rules, contrast among them, with every panel open."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page.emulate_media(color_scheme=scheme)
    page.evaluate("() => document.querySelectorAll('details').forEach((panel) => { panel.open = true; })")
    page.locator("#profile").click()
    page.locator("#plan [data-pass=tint]").focus()
    page.keyboard.press("Enter")
    page.locator("#pass pre").wait_for()
    page.locator("#stage").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    page.locator("#pixel tbody tr").wait_for()
    page.locator("#compare").select_option("difference")
    page.wait_for_function("() => document.getElementById('status').textContent.includes('largest difference')")
    found = axe.run(page)
    assert "color-contrast" in {rule["id"] for rule in found.response["passes"]}
    assert found.violations_count == 0, found.generate_report()


@pytest.mark.slow
def test_everything_is_reached_by_keys_and_has_a_name(page: Any) -> None:
    page.keyboard.press("Tab")
    reached = set()
    for _ in range(60):
        reached.add(page.evaluate("() => document.activeElement.id"))
        page.keyboard.press("Tab")
    assert {"play", "target", "compare", "value-gain", "channel", "stage"} <= reached
    code = """() => [...document.querySelectorAll("button, input, select, a")].filter((e) => !e.hidden && !(
        e.labels?.length || e.ariaLabel || e.textContent.trim() || e.title)).map((e) => e.id)"""
    nameless = page.evaluate(code)
    assert nameless == []
