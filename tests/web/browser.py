"""An exported folder in headless Chromium, with WebGPU on its software adapter."""

from __future__ import annotations

import base64
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from passgraph.backends.webgpu.chromium import FLAGS, executable
from tests.conftest import expected_devices

api = pytest.importorskip("playwright.sync_api")
CHROMIUM = executable()
#: Ten lines that use the runtime as a library.
LIBRARY = """<!doctype html><html lang="en"><title>library</title><link rel="icon" href="data:,">
<script type="module">
import { load } from "./passgraph.js";
try {
  globalThis.program = await load("effect.json", undefined, { keep: true });
} catch (error) { globalThis.failed = String(error); }
document.body.dataset.ready = "";
</script><body></body></html>
"""


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: Any) -> None:
        pass


@contextmanager
def opened(folder: Path, page_name: str = "library.html", flags: Sequence[str] = ()) -> Iterator[Any]:
    """A page of the folder; ``page.asked`` lists the hosts that it asked, ``page.faults`` what went wrong on it."""
    (folder / "library.html").write_text(LIBRARY)
    (folder / "blank.html").write_text('<!doctype html><link rel="icon" href="data:,">')
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        with api.sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=CHROMIUM, args=["--no-sandbox", "--disable-dev-shm-usage", *FLAGS, *flags]
            )
            page = browser.new_page(viewport={"width": 1000, "height": 700})
            page.asked, page.faults = set(), []
            page.on("request", lambda request: page.asked.add(request.url.split("/")[2]))
            page.on("console", lambda message: page.faults.append(message.text) if message.type == "error" else None)
            page.on("pageerror", lambda error: page.faults.append(str(error)))
            page.host = f"127.0.0.1:{server.server_port}"
            page.goto(f"http://{page.host}/blank.html")
            # Chromium offers no adapter while its GPU process begins anew, as it does on a busy machine.
            try:
                page.wait_for_function("() => navigator.gpu.requestAdapter().then(Boolean)", timeout=60_000)
            except api.TimeoutError:
                if "chromium" in expected_devices():
                    raise
                pytest.skip("Chromium has no WebGPU adapter here")
            page.goto(f"http://{page.host}/{page_name}")
            page.wait_for_selector(
                "body[data-ready], body[data-shown], body[data-failed]", state="attached", timeout=120_000
            )
            yield page
            browser.close()
    finally:
        server.shutdown()
        server.server_close()


def run(page: Any, values: dict[str, Any]) -> None:
    """Run the program of the page once."""
    page.evaluate("values => program.run({}, values)", values)


def read(page: Any, name: str | None = None) -> NDArray[np.float32]:
    """A target of the last run, (height, width, channels)."""
    code = """async (name) => {
        const { data, width, height, channels } = await program.read(name ?? undefined);
        const bytes = new Uint8Array(data.buffer);
        let text = "";
        for (let i = 0; i < bytes.length; i += 4096) text += String.fromCharCode(...bytes.subarray(i, i + 4096));
        return [btoa(text), height, width, channels];
    }"""
    text, *shape = page.evaluate(code, name)
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(shape).copy()
