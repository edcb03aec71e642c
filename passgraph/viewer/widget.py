"""The page in a cell of a notebook: an anywidget, whose comm carries messages, pictures and files."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from passgraph.errors import InputError
from passgraph.notebook import bundle
from passgraph.viewer.messages import MAX_MESSAGE, Client, Pages, Upload, error_text
from passgraph.viewer.subject import Subject

#: Bytes of a file in one message. Jupyter's server takes messages up to 10 MiB.
PART = 1 << 20
#: Seconds between pings of a page, and most pings without an answer: notebooks that are closed do not always say so.
PING_S, MOST_PINGS = 30.0, 3
_PAGE = Path(__file__).parent / "page"


class CellPage(Client):
    """A page in a cell, and the files that it sends or is sent in parts, by number."""

    def __init__(self, view: CellView, name: str) -> None:
        super().__init__(self._post)
        self.view, self.name, self.pings = view, name, 0  # pings since its latest message
        self.uploads: dict[int, Upload] = {}
        self.downloads: dict[int, Path] = {}

    async def _post(self, message: Mapping[str, Any], buffers: Sequence[bytes]) -> None:
        self.view.widget.send({"page": self.name, **message}, list(buffers))

    def close(self) -> None:
        super().close()
        for upload in self.uploads.values():
            upload.discard()
        for path in self.downloads.values():
            path.unlink(missing_ok=True)


class CellView(Pages):
    """A session, and its pages in cells of a notebook; the session runs while there is one.

    Messages are handled and sent in the event loop of the kernel, since comms may be used there only. The session, and
    what takes long, runs in threads.
    """

    def __init__(self, subject: Subject, backend: str = "") -> None:
        from anywidget import AnyWidget

        super().__init__(subject, backend)
        self._loop = self._kernel_loop = asyncio.get_running_loop()
        self._pages: dict[str, CellPage] = {}
        self.widget = AnyWidget(_esm=module_text())
        self.widget.on_msg(self._on_message)

    def close(self) -> None:
        """End the session, and remove the page from its cells."""
        while self._pages:
            self.leave(self._pages.popitem()[1])
        self.session.close()
        self.widget.close()
        self._folder.cleanup()

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """Show the page in a cell of Jupyter, VS Code or Colab."""
        if self.widget.comm is None:
            return bundle("passgraph view: closed")
        return self.widget._repr_mimebundle_(**options)

    def _display_(self) -> object:
        """Show the page in a cell of marimo."""
        return self.widget

    def _on_message(self, _: object, content: Mapping[str, Any], buffers: Sequence[Any]) -> None:
        asyncio.run_coroutine_threadsafe(self._handle(content, buffers), self._kernel_loop)

    async def _handle(self, content: Mapping[str, Any], buffers: Sequence[Any]) -> None:
        name, kind = str(content["page"]), content["kind"]
        page = self._pages.get(name)
        if page is None:
            if kind == "join" and self.widget.comm is not None:
                self._join(name)
            elif kind != "leave":
                self.widget.send({"page": name, "kind": "lost"})
            return
        page.pings = 0
        if kind == "leave":
            self._leave(name)
        elif kind in ("join", "pong"):
            return
        else:
            reply = {"kind": "reply", "id": content.get("id")}
            try:
                facts, parts = await self._answer(page, kind, content, buffers)
            except Exception as error:  # of a user's effect, or of a library that reads the file
                await page.send({**reply, "error": error_text(error)})
            else:
                await page.send({**reply, **facts}, parts)

    def _join(self, name: str) -> None:
        if not self._pages:
            self.session.start()
        self._pages[name] = page = CellPage(self, name)
        self.join(page)
        page.tasks["ping"] = asyncio.create_task(self._ping(page))

    async def _ping(self, page: CellPage) -> None:
        while page.pings < MOST_PINGS:
            page.pings += 1
            await page.send({"kind": "ping"})
            await asyncio.sleep(PING_S)
        self._leave(page.name)

    def _leave(self, name: str) -> None:
        page = self._pages.pop(name)
        self.leave(page)
        if not self._pages:
            self._kernel_loop.run_in_executor(None, self.session.close)
            self.renew()

    async def _answer(
        self, page: CellPage, kind: str, content: Mapping[str, Any], buffers: Sequence[Any]
    ) -> tuple[dict[str, Any], list[bytes]]:
        """Handle messages, or take or give the next part of a file."""
        if kind == "messages":
            for text in content["texts"]:
                if len(text) > MAX_MESSAGE:
                    await page.refuse(f"a message is larger than {MAX_MESSAGE >> 10} KiB")
                else:
                    await self.receive(page, text)
            return {}, []
        if kind == "get":
            path = await self.write(content["what"], content["query"])
            page.downloads[content["id"]] = path
            return {"file": content["id"], "size": path.stat().st_size}, []
        if kind == "part":
            path, at = page.downloads[content["file"]], int(content["at"])
            with path.open("rb") as file:
                file.seek(at)
                data = file.read(PART)
            if at + PART >= path.stat().st_size:
                path.unlink()
                del page.downloads[content["file"]]
            return {}, [data]
        if kind != "put":
            raise InputError(f"no message is called {str(kind)[:40]!r}")
        number = content["id"] if content["upload"] is None else content["upload"]
        upload = page.uploads.pop(number, None) or self.upload(str(content["name"]))
        try:
            upload.write(bytes(buffers[0]))
            if content["isLast"]:
                await self.use(upload, content["use"])
            else:
                page.uploads[number] = upload
        except BaseException:
            upload.discard()
            raise
        return {"upload": number}, []


def module_text() -> str:
    """Return the page as one JavaScript module, since modules of widgets cannot import their neighbors."""
    html = (_PAGE / "index.html").read_text("utf-8")
    body = html[html.index("<body>") + len("<body>") : html.index("<script")]
    css = (_PAGE / "page.css").read_text("utf-8")
    texts = [f"const HTML = {json.dumps(body)}, CSS = {json.dumps(css)}, PART = {PART};"]
    texts += [(_PAGE / name).read_text("utf-8") for name in ("debug.js", "page.js", "widget.js")]
    return re.sub(r"^import .*\n", "", "\n".join(texts), flags=re.MULTILINE)
