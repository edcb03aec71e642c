"""Makes docs/images/view.webp: a person opens `passgraph view`, moves a slider, edits the file, and clicks a pixel.

    python docs/view_clip.py

Needs playwright and Chromium.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from passgraph.backends.webgpu.chromium import executable

ROOT = Path(__file__).parent
EFFECT = '''import passgraph as pg
from passgraph.language import Image, vec4


@pg.kernel
def tint(color: Image, gain: float = 1.0, warm: float = 0.1) -> vec4:
    """Warmer light.

    Parameters
    ----------
    gain : factor of all channels
    warm : more red, less blue
    """
    lit = color[0, 0].rgb * gain
    return vec4(lit.r + warm, lit.g, lit.b - warm, 1.0)
'''


class Clip:
    """Pictures of a page with the time that each is shown."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.pictures: list[Image.Image] = []
        self.durations_ms: list[int] = []

    def take(self, milliseconds: int) -> None:
        picture = Image.open(BytesIO(self.page.screenshot())).convert("RGB")
        self.pictures.append(picture.resize((800, 500), Image.Resampling.LANCZOS))
        self.durations_ms.append(milliseconds)

    def save(self, path: Path) -> None:
        first, *others = self.pictures
        first.save(path, save_all=True, append_images=others, duration=self.durations_ms, loop=0, quality=80, method=6)


def record(page: Any, effect: Path) -> Clip:
    clip = Clip(page)
    clip.take(1500)
    for step in range(1, 7):
        page.locator("#value-gain").fill(str(1.0 + step / 15))
        page.wait_for_timeout(400)
        clip.take(200)
    page.locator("#undo").focus()
    for text, wait in ((EFFECT.replace("lit.g", "lit.q"), 2500), (EFFECT.replace("lit.b - warm", "lit.r"), 1500)):
        effect.write_text(text)
        page.wait_for_timeout(900)
        clip.take(wait)
    box = page.locator("#picture").bounding_box()
    page.mouse.click(box["x"] + box["width"] * 0.45, box["y"] + box["height"] * 0.45)
    page.wait_for_timeout(2500)
    clip.take(3000)
    effect.write_text(EFFECT)
    page.wait_for_timeout(900)
    clip.take(1500)
    return clip


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        effect = Path(folder, "tint.py")
        effect.write_text(EFFECT)
        shutil.copy(ROOT / "images" / "soft-shadow.png", folder)
        command = [sys.executable, "-m", "passgraph", "view", "tint.py", "soft-shadow.png", "--no-open"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=folder) as process:
            assert process.stdout is not None
            found = re.search(r"http://\S+", process.stdout.readline())
            assert found is not None
            with sync_playwright() as playwright:
                browser = playwright.chromium.launch(executable_path=executable(), args=["--no-sandbox"])
                page = browser.new_page(viewport={"width": 1120, "height": 700}, color_scheme="dark")
                page.goto(found[0])
                page.wait_for_selector("body[data-shown]")
                page.wait_for_timeout(1500)
                record(page, effect).save(ROOT / "images" / "view.webp")
                browser.close()
            process.terminate()


if __name__ == "__main__":
    main()
