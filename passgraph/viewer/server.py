"""Serve the page of a session on the loopback interface; requests need the token and the page's own origin."""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from passgraph.notebook import bundle
from passgraph.viewer.messages import MAX_MESSAGE, Client, Pages, Upload, error_text
from passgraph.viewer.subject import Subject

#: Content security policy of the page: it loads nothing from other origins.
CSP = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'"
_PAGE = Path(__file__).parent / "page"
_FILES = {"": "index.html", **{name: name for name in ("socket.js", "page.js", "debug.js", "page.css")}}


class Guard:
    """Middleware that rejects requests with another host name (DNS rebinding) or from another origin."""

    def __init__(self, app: ASGIApp, port: int) -> None:
        self.app = app
        self.hosts = {f"{name}:{port}" for name in ("127.0.0.1", "localhost")}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] in ("http", "websocket"):
            headers = Headers(scope=scope)
            origin = headers.get("origin")
            is_own = origin is None or origin.removeprefix("http://") in self.hosts
            if headers.get("host", "") not in self.hosts or not is_own:
                if scope["type"] == "websocket":
                    await send({"type": "websocket.close", "code": 1008})
                else:
                    await PlainTextResponse("forbidden", 403)(scope, receive, send)
                return
        await self.app(scope, receive, send)


class View(Pages):
    """A session, and its pages in the browser."""

    def __init__(self, subject: Subject, backend: str = "", port: int = 0) -> None:
        super().__init__(subject, backend)
        self.token = secrets.token_urlsafe(18)
        self.socket = socket.create_server(("127.0.0.1", port))
        self.port = int(self.socket.getsockname()[1])
        self._running: uvicorn.Server | None = None
        self._thread: threading.Thread | None = None
        base = f"/{self.token}"
        routes = [
            *(Route(f"{base}/{what}", self._write_file(what)) for what in ("save", "record")),
            Route(f"{base}/input/{{name}}", self._put("input"), methods=["PUT"]),
            Route(f"{base}/reference/{{name}}", self._put("reference"), methods=["PUT"]),
            WebSocketRoute(f"{base}/socket", self._socket),
            *(Route(f"{base}/{path}", _file(name)) for path, name in _FILES.items()),
        ]
        self.app = Guard(Starlette(routes=routes, lifespan=self._lifespan), self.port)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/{self.token}/"

    def serve(self) -> None:
        """Serve until the process is interrupted."""
        self._server().run(sockets=[self.socket])

    def start(self) -> None:
        """Serve in a background thread, until `close`."""
        self._running = self._server()
        self._thread = threading.Thread(target=self._running.run, kwargs={"sockets": [self.socket]}, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread of `start`, and release the port."""
        if self._running is not None and self._thread is not None:
            self._running.should_exit = True
            self._thread.join(10.0)
        self.socket.close()
        self._folder.cleanup()

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """Show the page in a notebook's cell."""
        frame = f'<iframe src="{self.url}" width="100%" height="640" title="passgraph view"></iframe>'
        return bundle(f"passgraph view: {self.url}", frame)

    def _server(self) -> uvicorn.Server:
        config = uvicorn.Config(
            self.app,
            log_level="warning",
            ws="websockets-sansio",
            ws_max_size=MAX_MESSAGE,
            ws_ping_interval=None,
            timeout_graceful_shutdown=1,
        )
        return uvicorn.Server(config)

    @asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        self._loop = asyncio.get_running_loop()
        self.session.start()
        try:
            yield
        finally:
            await asyncio.to_thread(self.session.close)
            self._folder.cleanup()

    # Routes

    async def _socket(self, socket: WebSocket) -> None:
        async def send(message: Mapping[str, Any], pictures: Sequence[bytes]) -> None:
            try:
                await socket.send_text(json.dumps(message))
                for picture in pictures:
                    await socket.send_bytes(picture)
            except (WebSocketDisconnect, RuntimeError):
                raise ConnectionError("the page has closed") from None

        await socket.accept()
        client = Client(send)
        self.join(client)
        try:
            while True:
                await self.receive(client, await socket.receive_text())
        except (WebSocketDisconnect, ConnectionError, RuntimeError):
            pass
        finally:
            self.leave(client)

    def _write_file(self, what: str) -> Callable[[Request], Awaitable[Response]]:
        """Return the handler that writes a temporary file, sends it, and removes it."""

        async def give(request: Request) -> Response:
            try:
                path = await self.write(what, request.query_params)
            except Exception as error:  # of a user's effect, or of a backend
                return PlainTextResponse(error_text(error), 400)
            name = f"{self.session.subject.name}{path.suffix}"
            return FileResponse(path, filename=name, background=BackgroundTask(path.unlink, missing_ok=True))

        return give

    def _put(self, use: str) -> Callable[[Request], Awaitable[Response]]:
        """Return the handler of an uploaded file."""

        async def take(request: Request) -> Response:
            upload: Upload | None = None
            try:
                upload = self.upload(request.path_params["name"])
                async for part in request.stream():
                    upload.write(part)
                await self.use(upload, use)
            except Exception as error:  # of a library that reads the file
                if upload is not None:
                    upload.discard()
                return PlainTextResponse(error_text(error), 400)
            return JSONResponse({})

        return take


def _file(name: str) -> Callable[[Request], Awaitable[Response]]:
    async def respond(_: Request) -> Response:
        headers = {"Content-Security-Policy": CSP, "Cache-Control": "no-store", "Referrer-Policy": "no-referrer"}
        return FileResponse(_PAGE / name, headers=headers)

    return respond
