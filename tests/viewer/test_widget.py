"""The page as a widget: in Chromium, on a host that carries the messages of its comm between the page and a kernel.

The host is a kernel's event loop in a thread, and a page that gives the widget's module a model, as a notebook does.
"""

from __future__ import annotations

import asyncio
import base64
import json
import queue
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from time import monotonic
from typing import Any, TypeVar

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.backends.webgpu.chromium import executable
from tests.viewer.test_page import drop

pytest.importorskip("anywidget")
comm = pytest.importorskip("comm")
api = pytest.importorskip("playwright.sync_api")
widget = pytest.importorskip("passgraph.viewer.widget")
pytestmark = pytest.mark.skipif(executable() is None, reason="Chromium is not installed")

T = TypeVar("T")
#: A document with its own styles, ids and keys, which shows each widget in an element, as a notebook does in a cell.
NOTEBOOK = """<!doctype html><link rel="icon" href="data:,"><title>notebook</title>
<style>button { color: rgb(1, 2, 3) }</style><h1 id="name">notebook</h1><button id="own">own</button>
<script>
const keys = [], models = {}, ends = {};
document.addEventListener("keydown", (event) => keys.push(event.key));
const bytesOf = (text) => new DataView(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
const textOf = (bytes) => btoa(Array.from(new Uint8Array(bytes), (byte) => String.fromCharCode(byte)).join(""));
async function showWidget(id, esm, name) {
  const url = URL.createObjectURL(new Blob([esm], { type: "text/javascript" }));
  const { default: { render } } = await import(url);
  const el = document.body.appendChild(document.createElement("div")), heard = new Set();
  el.id = name;
  (models[id] ??= []).push(heard);
  const model = {
    on: (kind, callback) => { if (kind === "msg:custom") heard.add(callback); },
    off: (kind, callback) => heard.delete(callback),
    send: (content, callbacks, buffers = []) => toKernel(id, content, buffers.map(textOf)),
  };
  ends[name] = await render({ model, el });
}
function fromKernel(id, content, buffers) {
  for (const heard of models[id]) for (const callback of heard) callback(content, buffers.map(bytesOf));
}
</script>"""


class Comm(comm.base_comm.BaseComm):  # type: ignore[misc]
    """A comm whose messages are put into a queue."""

    sent: queue.SimpleQueue[tuple[str, dict[str, Any], list[bytes]]]

    def publish_msg(self, msg_type: str, data: Any = None, metadata: Any = None, buffers: Any = None, **_: Any) -> None:
        if msg_type == "comm_msg" and data["method"] == "custom":
            # JSON, as notebooks send it.
            self.sent.put((self.comm_id, json.loads(json.dumps(data["content"])), [bytes(b) for b in buffers or ()]))


class Notebook:
    """A kernel's event loop in a thread, and a page of Chromium whose cells show widgets."""

    def __init__(self, page: Any) -> None:
        self.page, self.loop = page, asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_forever)
        self.thread.start()
        self.views: list[Any] = []
        page.expose_function("toKernel", self._to_kernel)
        page.set_content(NOTEBOOK)

    def in_kernel(self, function: Callable[[], T]) -> T:
        async def call() -> T:
            return function()

        return asyncio.run_coroutine_threadsafe(call(), self.loop).result(60)

    def _to_kernel(self, id_: str, content: Any, buffers: list[str]) -> None:
        message = {"content": {"data": {"method": "custom", "content": content}}}
        message["buffers"] = [memoryview(base64.b64decode(text)) for text in buffers]  # type: ignore[assignment]
        known = comm.get_comm_manager().get_comm(id_)
        if known is not None:
            self.loop.call_soon_threadsafe(known.handle_msg, message)

    def pump(self) -> None:
        """Bring the page what the kernel has sent."""
        self.page.wait_for_timeout(10)
        while not Comm.sent.empty():
            id_, content, buffers = Comm.sent.get()
            self.page.evaluate(
                "([id, content, buffers]) => models[id] && fromKernel(id, content, buffers)",
                [id_, content, [base64.b64encode(buffer).decode() for buffer in buffers]],
            )

    def until(self, fits: Callable[[], Any]) -> None:
        end = monotonic() + 60
        while not fits():
            assert monotonic() < end
            self.pump()

    def view(self, shown: Any, **inputs: Any) -> Any:
        made = self.in_kernel(lambda: pg.view(shown, backend="numpy", **inputs))
        self.views.append(made)
        return made

    def show(self, view: Any, name: str) -> None:
        """Show a view in a cell, and wait for its picture."""
        data, _ = view._repr_mimebundle_()
        id_ = data["application/vnd.jupyter.widget-view+json"]["model_id"]
        self.page.evaluate("(given) => showWidget(...given)", [id_, view.widget._esm, name])
        self.until(self.page.locator(f"#{name} [data-shown]").count)

    def cell(self, name: str) -> Any:
        return self.page.locator(f"#{name}")

    def until_color(self, name: str, x: int, y: int, wanted: list[int]) -> None:
        code = f"(e) => [...e.getContext('2d').getImageData({x}, {y}, 1, 1).data].slice(0, 3)"
        canvas = self.cell(name).locator("#picture")
        self.until(lambda: max(abs(a - b) for a, b in zip(canvas.evaluate(code), wanted, strict=True)) <= 2)

    def leave(self, name: str) -> None:
        """Remove a cell, as a notebook does that runs it again or is closed."""
        self.page.evaluate("(name) => { ends[name](); document.getElementById(name).remove(); }", name)

    def sessions(self) -> int:
        return sum(thread.name == "passgraph_view" for thread in threading.enumerate())


@pytest.fixture
def notebook(monkeypatch: pytest.MonkeyPatch) -> Iterator[Notebook]:
    """A notebook; no error on its console, and no thread of a session once its views are closed."""
    monkeypatch.setattr(comm, "create_comm", Comm)
    monkeypatch.setattr(Comm, "sent", queue.SimpleQueue(), raising=False)
    monkeypatch.setattr("passgraph.viewer.show.in_notebook", lambda: True)
    errors: list[str] = []
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=executable(), args=["--no-sandbox", "--disable-dev-shm-usage"]
        )
        page = browser.new_page(viewport={"width": 1000, "height": 1400})
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        made = Notebook(page)
        try:
            yield made
        finally:
            for view in made.views:
                made.in_kernel(view.close)
            sessions = made.sessions()
            made.loop.call_soon_threadsafe(made.loop.stop)
            made.thread.join()
            made.loop.close()
            browser.close()
    assert errors == []
    assert sessions == 0


@pg.kernel
def tint(color: pg.Image, gain: float = 1.0) -> pg.vec4:
    return pg.vec4(color[0, 0].rgb * gain, 1.0)


def picture() -> Any:
    pixels = np.full((4, 8, 4), 51, np.uint8)
    pixels[..., 3] = 255
    pixels[1, 2] = (0, 102, 204, 255)
    return pixels


def test_a_slider_and_a_pixel(notebook: Notebook) -> None:
    notebook.show(notebook.view(tint, color=picture()), "a")
    notebook.until_color("a", 2, 1, [0, 102, 204])
    notebook.cell("a").locator("#value-gain").fill("0.5")
    notebook.until_color("a", 2, 1, [0, 51, 102])
    box = notebook.cell("a").locator("#picture").bounding_box()
    notebook.page.mouse.click(box["x"] + box["width"] * 2.5 / 8, box["y"] + box["height"] * 1.5 / 4)
    row = notebook.cell("a").locator("#pixel tbody tr")
    notebook.until(row.count)
    assert row.locator("td").all_inner_texts()[3:] == ["0  0.200000003  0.400000006  1", "="]


@pytest.mark.slow
def test_two_widgets_and_the_notebook_are_apart(notebook: Notebook) -> None:
    for name in "ab":
        notebook.show(notebook.view(tint, color=picture()), name)
        notebook.until_color(name, 2, 1, [0, 102, 204])
    notebook.cell("a").locator("#value-gain").fill("0.5")
    notebook.until_color("a", 2, 1, [0, 51, 102])
    notebook.until_color("b", 2, 1, [0, 102, 204])
    # Shortcuts and styles of one are none of the other's, nor of the notebook's.
    play = "#play[aria-pressed=true]"
    notebook.cell("b").locator("#stage").focus()
    notebook.page.keyboard.press(" ")
    assert [notebook.cell(name).locator(play).count() for name in "ab"] == [0, 1]
    notebook.page.locator("#own").focus()
    notebook.page.keyboard.press("f")
    assert notebook.page.evaluate("keys") == ["f"]
    colors = "(e) => getComputedStyle(e).color"
    assert notebook.page.locator("#own").evaluate(colors) == "rgb(1, 2, 3)"
    assert notebook.cell("a").locator("#play").evaluate(colors) != "rgb(1, 2, 3)"
    assert notebook.page.evaluate("document.getElementById('name').textContent") == "notebook"


@pytest.mark.slow
def test_a_wheel_scrolls_the_notebook_until_the_picture_is_clicked(notebook: Notebook) -> None:
    notebook.show(notebook.view(tint, color=picture()), "a")
    canvas, stage = notebook.cell("a").locator("#picture"), notebook.cell("a").locator("#stage")
    look = "(e) => e.style.transform"
    before = canvas.evaluate(look)
    stage.hover()
    notebook.page.mouse.wheel(0, -100)
    notebook.pump()
    assert canvas.evaluate(look) == before
    stage.focus()
    notebook.page.mouse.wheel(0, -100)
    notebook.until(lambda: canvas.evaluate(look) != before)


def test_files_are_sent_in_parts(notebook: Notebook, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A dropped picture and a saved one, each of several parts; an error of what is compared is shown."""
    noise = np.random.default_rng(0).integers(0, 256, (30, 40, 3), np.uint8)
    monkeypatch.setattr(widget, "PART", 1000)
    Image.fromarray(noise).save(tmp_path / "noise.png")
    assert (tmp_path / "noise.png").stat().st_size > widget.PART
    notebook.show(notebook.view(tint, color=picture()), "a")
    cell = notebook.cell("a")
    drop(cell.locator("#stage"), tmp_path / "noise.png")
    notebook.until_color("a", 39, 29, noise[29, 39].tolist())
    cell.locator("#save-as").select_option("npy")
    saved: list[Any] = []
    notebook.page.on("download", lambda download: saved.append(download))
    cell.locator("#save").click()
    notebook.until(lambda: saved)
    assert saved[0].suggested_filename == "tint.npy"
    assert np.array_equal(np.round(255 * np.load(saved[0].path())[..., :3]), noise)
    cell.locator("#compare").select_option("difference")
    with notebook.page.expect_file_chooser() as chooser:
        cell.locator("#other").select_option("file")
    pg.save(tmp_path / "small.png", picture())
    chooser.value.set_files(tmp_path / "small.png")
    notebook.until(cell.locator("#error:not([hidden])").count)
    assert "is 8x4, and the target is 40x30; resize it" in cell.locator("#error").inner_text()
    drop(cell.locator("#stage"), tmp_path / "small.png")
    notebook.until(cell.locator("#error[hidden]").count)
    cell.locator("#record-panel summary").click()
    cell.locator("#record-last").fill("2")
    cell.locator("#record-as").select_option("gif")
    cell.locator("#record").click()
    notebook.until(lambda: len(saved) > 1)
    with Image.open(saved[1].path()) as made:
        assert made.convert("RGB").getpixel((2, 1)) == (0, 102, 204)


@pytest.mark.slow
def test_files_that_cannot_be_are_refused(notebook: Notebook, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    view = notebook.view(tint, color=picture())
    notebook.show(view, "a")
    notebook.until(notebook.cell("a").locator("#statistics:not(:empty)").count)  # the last state of this picture
    status, folder = notebook.cell("a").locator("#status"), Path(view._folder.name)
    for name, reason in {
        "none": "needs a suffix",
        "text.png": "not a picture",
        "large.png": "larger than 0 MiB",
    }.items():
        if name == "large.png":
            monkeypatch.setattr("passgraph.viewer.messages.MAX_UPLOAD", 3)
        (tmp_path / name).write_text("no picture")
        drop(notebook.cell("a").locator("#stage"), tmp_path / name)
        notebook.until(lambda reason=reason: reason in status.inner_text())  # type: ignore[misc]
        assert not [*folder.iterdir()]
    notebook.until_color("a", 2, 1, [0, 102, 204])


def test_a_session_runs_while_a_cell_shows_it(notebook: Notebook) -> None:
    """A cell that is run again, or whose notebook is closed, ends it; a view that is shown again has a new one."""
    view = notebook.view(tint, color=picture())
    assert notebook.sessions() == 0
    for name in "ab":
        notebook.show(view, name)
        notebook.until_color(name, 2, 1, [0, 102, 204])
    assert notebook.sessions() == 1
    notebook.leave("a")
    notebook.cell("b").locator("#value-gain").fill("0.5")
    notebook.until_color("b", 2, 1, [0, 51, 102])
    notebook.leave("b")
    notebook.until(lambda: notebook.sessions() == 0)
    notebook.show(view, "c")
    notebook.until_color("c", 2, 1, [0, 102, 204])
    notebook.in_kernel(view.close)
    assert notebook.sessions() == 0
    assert "closed" in view._repr_mimebundle_()["text/plain"]


@pytest.mark.slow
def test_a_page_that_vanishes_ends_its_session_and_one_that_returns_goes_on(
    notebook: Notebook, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(widget, "PING_S", 0.05)
    notebook.show(notebook.view(tint, color=picture()), "a")
    notebook.cell("a").locator("#value-gain").fill("0.5")
    notebook.until_color("a", 2, 1, [0, 51, 102])
    for _ in range(widget.MOST_PINGS + 3):  # it answers
        notebook.page.wait_for_timeout(60)
        notebook.pump()
    assert notebook.sessions() == 1
    end = monotonic() + 60
    while notebook.sessions():  # nothing reaches the page
        assert monotonic() < end
    monkeypatch.setattr(widget, "PING_S", 60.0)
    notebook.cell("a").locator("#value-gain").fill("0.25")
    notebook.until_color("a", 2, 1, [0, 26, 51])
    assert notebook.sessions() == 1


def test_pictures_never_queue_and_the_kernel_stays_free(notebook: Notebook, monkeypatch: pytest.MonkeyPatch) -> None:
    view, goes_on = notebook.view(tint, color=picture()), threading.Event()
    notebook.show(view, "a")
    notebook.until_color("a", 2, 1, [0, 102, 204])
    post = {"page": next(iter(view._pages)), "kind": "messages", "id": 0}

    def tell(message: Any) -> None:
        content = {**post, "texts": [message if isinstance(message, str) else json.dumps(message)]}
        notebook._to_kernel(view.widget.model_id, content, [])

    def answers(kind: str) -> list[Any]:
        """What the kernel sends to the page until an answer of a kind, which the page does not get."""
        seen = []
        while True:
            seen.append(Comm.sent.get(timeout=60))
            if seen[-1][1]["kind"] == kind:
                return seen

    monkeypatch.setattr(view.session, "verdict", lambda: {"text": str(goes_on.wait(60))})
    tell({"kind": "verdict"})
    drawn = 0
    for gain in (0.5, 0.25, 0.75):
        tell({"kind": "ask", "changes": {"values": {"gain": gain}}})
        while view.session.shown.values_at(2, 1)["a"][1] != pytest.approx(0.4 * gain, abs=1e-6):
            pass
        tell({"kind": "values", "x": 2, "y": 1})
        drawn += sum(bool(buffers) for _, _, buffers in answers("values"))
    assert drawn <= 1
    goes_on.set()
    answers("verdict")
    before = view.session.requests.settings
    for text in ("x" * (1 << 17), "", "[]", '{"kind": "ask", "changes": {"subject": 1}}', '{"kind": "shutdown"}'):
        tell(text)
        answers("refused")
    assert view.session.requests.settings == before


def test_messages_do_not_queue_at_a_busy_kernel(notebook: Notebook, monkeypatch: pytest.MonkeyPatch) -> None:
    """While one is under way the latest values wait for its answer, and are sent together."""
    is_busy, waiting, handle = threading.Event(), list[Any](), widget.CellView._on_message

    def take(view: Any, *message: Any) -> None:
        if is_busy.is_set():
            waiting.append(message)
        else:
            handle(view, *message)

    monkeypatch.setattr(widget.CellView, "_on_message", take)
    view = notebook.view(tint, color=picture())
    notebook.show(view, "a")
    notebook.until(notebook.cell("a").locator("#statistics:not(:empty)").count)
    notebook.pump()
    is_busy.set()
    code = """(slider) => { for (let k = 0; k <= 50; k++) { slider.value = k / 100;
        slider.dispatchEvent(new Event("input")); } }"""
    notebook.cell("a").locator("#value-gain").evaluate(code)
    notebook.page.wait_for_timeout(200)
    assert len([text for _, content, _ in waiting for text in content.get("texts", ()) if '"ask"' in text]) == 1
    is_busy.clear()
    for message in waiting:
        handle(view, *message)
    notebook.until_color("a", 2, 1, [0, 51, 102])
