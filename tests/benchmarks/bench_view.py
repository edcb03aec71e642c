"""`passgraph view` in Chromium: pictures a second of what moves, and how long after a save the new picture is shown.

    python tests/benchmarks/bench_view.py [WIDTHxHEIGHT] [SECONDS]

The effect moves with time and takes about ten milliseconds of numpy at 1280x720; what it took is printed. A save is
measured from its last byte to the frame of the page that has the new color. Needs playwright and Chromium.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

from playwright.sync_api import sync_playwright

from passgraph.backends.webgpu.chromium import executable

SAVES = 9
EFFECT = '''
import passgraph as pg
from passgraph.effects.checked import effect

@pg.kernel
def waves(n: int) -> pg.vec4:
    p = pg.vec2(pg.pixel()) * 0.01
    total = pg.vec3(0.0)
    for k in range({turns}):
        t = float(k) + 0.05 * float(n)
        total = total + 0.5 + 0.5 * pg.sin(pg.vec3(p.x + t, p.y - t, p.x * p.y + t))
    return pg.vec4(total / {turns}.0 * 0.5, 1.0) + pg.vec4({red}, 0.0, 0.0, 0.0)

@effect("waves", takes="nothing")
def moving() -> pg.Target:
    """Colors that move."""
    return waves({number}, into=pg.target("waves", "rgba8"))
'''
#: Notes when pictures are shown, and the first one whose corner is redder than before.
WATCH = """() => {
    window.shown = [];
    window.wanted = null;
    new MutationObserver(() => {
        window.shown.push(performance.now());
        if (window.wanted === null) return; // reading the canvas back takes time
        const red = document.getElementById("picture").getContext("2d").getImageData(0, 0, 1, 1).data[0];
        if (Math.abs(red - window.wanted) > 40) return;
        window.at = Date.now();
        window.wanted = null;
    }).observe(document.body, { attributes: true });
}"""


def text(number: str, red: float = 0.0) -> str:
    return EFFECT.format(turns=3, red=red, number=number)


def frame_rate(page: Any, seconds: float) -> float:
    page.locator("#play").click()
    page.wait_for_timeout(1500)
    page.evaluate("() => { window.shown = []; }")
    page.wait_for_timeout(1000 * seconds)
    shown = page.evaluate("() => window.shown")
    print(page.locator("#status").inner_text())
    page.locator("#play").click()
    return 1000.0 * (len(shown) - 1) / (shown[-1] - shown[0])


def latencies(page: Any, effect: Path) -> list[float]:
    """Milliseconds from each save to its picture."""
    found = []
    for save in range(SAVES + 1):
        red = (save % 2) * 0.5
        page.evaluate("(red) => { window.at = null; window.wanted = red; }", 255 * red + 64)
        page.wait_for_timeout(300)
        effect.write_text(text("0", red))
        saved = time.time()
        page.wait_for_function("() => window.at !== null")
        found.append(page.evaluate("() => window.at") - 1000.0 * saved)
    return found[1:]


def main() -> None:
    size, seconds = (*sys.argv[1:2], "1280x720")[0], float((*sys.argv[2:], "5")[0])
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        effect = Path(folder, "waves.py")
        effect.write_text(text("pg.FRAME_INDEX"))
        command = [sys.executable, "-m", "passgraph", "view", str(effect), "--size", size, "-b", "numpy", "--no-open"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                assert process.stdout is not None
                found = re.search(r"http://\S+", process.stdout.readline())
                assert found is not None
                browser = playwright.chromium.launch(executable_path=executable(), args=["--no-sandbox"])
                page = browser.new_page(viewport={"width": 1400, "height": 900})
                page.goto(found[0])
                page.wait_for_selector("body[data-shown]")
                page.evaluate(WATCH)
                print(f"{frame_rate(page, seconds):.1f} pictures a second at {size}")
                saves = latencies(page, effect)
                print(f"a save is seen after {median(saves):.0f} ms (median of {SAVES}, most {max(saves):.0f} ms)")
                browser.close()
            finally:
                process.terminate()


if __name__ == "__main__":
    main()
