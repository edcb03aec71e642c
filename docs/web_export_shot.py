"""Makes docs/images/web-export.webp: the page of an exported effect, in headless Chromium.

    python docs/web_export_shot.py

Without a display, Chromium shows no canvas of WebGPU.  So the page draws into a texture, which is copied to a canvas.
"""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path

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


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "out"
        photo = DOCS / "images" / "soft-shadow.png"
        assert run(["export", "halftone", str(photo), "--web", str(folder), "--cell-px", "9"]) == 0
        with opened(folder) as page:
            page.add_init_script(SHIM)
            page.set_viewport_size({"width": 1180, "height": 700})
            page.goto(f"http://{page.host}/index.html")
            page.wait_for_selector("body[data-shown]", timeout=120_000)
            page.mouse.move(420, 330)
            page.wait_for_function("() => document.getElementById('texel').textContent.includes('(')")
            page.wait_for_selector("body[data-copied]")
            page.wait_for_timeout(1500)
            shot = page.screenshot()
    Image.open(io.BytesIO(shot)).save(DOCS / "images" / "web-export.webp", quality=88)


if __name__ == "__main__":
    main()
