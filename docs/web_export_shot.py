"""Makes docs/images/web-export.webp and web-orbit.webp: pages of exported effects, in headless Chromium.

    python docs/web_export_shot.py

Without a display, Chromium shows no canvas of WebGPU.  So the page draws into a texture, which is copied to a canvas.
"""

from __future__ import annotations

import io
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import cos, pi, sin
from pathlib import Path
from typing import Any

from PIL import Image

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent))

from passgraph.commands.entry import run
from tests.web.browser import opened

#: Stands for the context of a canvas.
SHIM = """
const original = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  if (kind !== "webgpu") return original.call(this, kind, ...rest);
  const canvas = this;
  return { configure({ device, format }) { Object.assign(this, { device, format }); }, getCurrentTexture() {
    const { device, format } = this, { width, height } = canvas, bytesPerRow = 256 * Math.ceil(width / 64);
    const texture = device.createTexture({ size: [width, height], format, usage: 17 });
    setTimeout(async () => {
      const encoder = device.createCommandEncoder();
      const buffer = device.createBuffer({ size: bytesPerRow * height, usage: 9 });
      encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow }, [width, height]);
      device.queue.submit([encoder.finish()]);
      await buffer.mapAsync(1);
      const bytes = new Uint8ClampedArray(buffer.getMappedRange().slice(0));
      const shown = original.call(canvas, "2d");
      shown.putImageData(new ImageData(bytes, bytesPerRow / 4, height), 0, 0);
      document.body.dataset.copied = "";
    });
    return texture;
  } };
};
"""


@contextmanager
def exported(effect: Sequence[str], size: tuple[int, int]) -> Iterator[Any]:
    """Export an effect, and yield its page in a window of this size."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "out"
        assert run(["export", *effect, "--web", str(folder)]) == 0
        with opened(folder) as page:
            page.add_init_script(SHIM)
            page.set_viewport_size({"width": size[0], "height": size[1]})
            page.goto(f"http://{page.host}/index.html")
            yield page


def shoot_page() -> None:
    """Save the page of an effect with its controls."""
    photo = DOCS / "images" / "soft-shadow.png"
    with exported(["halftone", str(photo), "--cell-px", "9"], (1180, 700)) as page:
        page.wait_for_selector("body[data-shown]", timeout=120_000)
        page.mouse.move(420, 330)
        page.wait_for_function("() => document.getElementById('texel').textContent.includes('(')")
        page.wait_for_selector("body[data-copied]")
        page.wait_for_timeout(1500)
        shot = page.screenshot()
    Image.open(io.BytesIO(shot)).save(DOCS / "images" / "web-export.webp", quality=88)


def shoot_orbit() -> None:
    """Save an animation of a page while the mouse drags the camera once to the right and back."""
    frames = []
    with exported(["soft-shadow", "--orbit", "--size", "560x315"], (890, 401)) as page:
        page.wait_for_selector("body[data-copied]", timeout=120_000)
        page.mouse.move(280, 200)
        page.mouse.down()
        for number in range(18):
            turn = 2 * pi * number / 18
            page.mouse.move(280 - 160 * sin(turn), 200 + 60 * (1 - cos(turn)))
            page.wait_for_timeout(3000)
            frames.append(Image.open(io.BytesIO(page.screenshot())))
        page.mouse.up()
    first, *others = frames
    first.save(
        DOCS / "images" / "web-orbit.webp",
        save_all=True,
        append_images=others,
        duration=120,
        loop=0,
        quality=50,
        method=6,
    )


if __name__ == "__main__":
    shoot_page()
    shoot_orbit()
