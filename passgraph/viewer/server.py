"""Serve the page of a session on the loopback interface; requests need the token and the page's own origin."""

from __future__ import annotations

import asyncio
import json
import os
import secrets
import socket
import tempfile
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, Literal

import uvicorn
from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from passgraph.errors import PassgraphError
from passgraph.notebook import bundle
from passgraph.viewer.display import CHANNELS, Look
from passgraph.viewer.recording import SUFFIXES
from passgraph.viewer.session import Published, Session, Settings
from passgraph.viewer.subject import Subject

#: Largest message of a page, and largest uploaded file, in bytes.
MAX_MESSAGE, MAX_UPLOAD = 1 << 16, 1 << 28
#: Content security policy of the page: it loads nothing from other origins.
CSP = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'"
_PAGE = Path(__file__).parent / "page"
_FILES = {"": "index.html", "page.js": "page.js", "debug.js": "debug.js", "page.css": "page.css"}


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


class Client:
    """An open page.

    Slow requests are computed in threads. Of each kind one runs at a time, and then the latest one received meanwhile.
    """

    def __init__(self, socket: WebSocket) -> None:
        self.socket = socket
        #: True once it has shown the last pictures.
        self.is_ready = True
        self.keys_down: set[int] = set()
        self._pending: dict[str, Callable[[], dict[str, Any]]] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}

    async def send(self, message: Mapping[str, Any]) -> None:
        await self.socket.send_text(json.dumps(message))

    async def refuse(self, text: str) -> None:
        await self.send({"kind": "refused", "text": text})

    def ask(self, kind: str, question: Callable[[], dict[str, Any]]) -> None:
        """Compute the answer in a thread, after a running request of its kind, and send it."""
        self._pending[kind] = question
        task = self._tasks.get(kind)
        if task is None or task.done():
            self._tasks[kind] = asyncio.create_task(self._answer(kind))

    async def _answer(self, kind: str) -> None:
        with suppress(WebSocketDisconnect, RuntimeError):
            while kind in self._pending:
                try:
                    facts = await asyncio.to_thread(self._pending.pop(kind))
                except Exception as error:  # of a user's effect; the page continues
                    await self.refuse(error_text(error))
                else:
                    await self.send({"kind": kind, **facts})

    def close(self) -> None:
        for task in self._tasks.values():
            task.cancel()


def error_text(error: Exception) -> str:
    """Return the text of an error for the page."""
    return str(error) if isinstance(error, PassgraphError) else f"{type(error).__name__}: {error}"


class View:
    """A session with its page."""

    def __init__(self, subject: Subject, backend: str = "", port: int = 0) -> None:
        self.token = secrets.token_urlsafe(18)
        self.socket = socket.create_server(("127.0.0.1", port))
        self.port = int(self.socket.getsockname()[1])
        self.session = Session(subject, backend, self._published)
        self._loop: asyncio.AbstractEventLoop | None = None
        #: The latest state, and the latest one with pictures; states of errors have none.
        self._latest: Published | None = None
        self._latest_drawn: Published | None = None
        self._news = asyncio.Event()
        self._running: uvicorn.Server | None = None
        self._thread: threading.Thread | None = None
        #: Uploaded files in use: another input, a picture to compare with.
        self._put_files: dict[str, Path] = {}
        self._folder = tempfile.TemporaryDirectory(prefix="passgraph-view-")
        base = f"/{self.token}"
        routes = [
            Route(f"{base}/save", self._save),
            Route(f"{base}/record", self._record),
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

    def _published(self, state: Published) -> None:
        """Pass a state from the session's thread to the event loop."""
        loop = self._loop
        if loop is not None:
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(self._take, state)

    def _take(self, state: Published) -> None:
        self._latest = state
        if state.pictures:
            self._latest_drawn = state
        self._wake()

    def _wake(self) -> None:
        """Wake the senders to check for a new state."""
        news, self._news = self._news, asyncio.Event()
        news.set()

    # Routes

    async def _socket(self, socket: WebSocket) -> None:
        await socket.accept()
        client = Client(socket)
        sender = asyncio.create_task(self._send_states(client))
        try:
            while True:
                await self._receive(client, await socket.receive_text())
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            sender.cancel()
            client.close()
            for code in client.keys_down:
                self.session.key(code, False)

    async def _send_states(self, client: Client) -> None:
        """Send the latest state; with pictures only if the client has shown the last ones, so that they never queue."""
        sent = sent_pictures = 0
        with suppress(WebSocketDisconnect, RuntimeError):
            while True:
                news, state = self._news, self._latest
                drawn = self._latest_drawn if client.is_ready else None
                is_due = drawn is not None and drawn.number != sent_pictures
                if state is None or (state.number == sent and not is_due):
                    await news.wait()
                    continue
                sent = state.number
                pictures: Mapping[str, tuple[bytes, str]] = {}
                if drawn is not None and is_due:
                    sent_pictures, pictures, client.is_ready = drawn.number, drawn.pictures, False
                slots = [{"slot": slot, "type": kind, "bytes": len(data)} for slot, (data, kind) in pictures.items()]
                await client.send({"kind": "state", "number": sent, "pictures": slots, **state.facts})
                for data, _ in pictures.values():
                    await client.socket.send_bytes(data)

    async def _receive(self, client: Client, text: str) -> None:
        """Handle a message; an invalid one gets an answer, and changes nothing."""
        try:
            message = json.loads(text)
            kind = message["kind"]
            if kind == "ask":
                self.session.ask(**checked_changes(message["changes"]))
            elif kind == "ready":
                client.is_ready = True
                self.session.ready()
                self._wake()
            elif kind == "key":
                code, down = int(message["code"]), bool(message["down"])
                self.session.key(code, down)
                (client.keys_down.add if down else client.keys_down.discard)(code)
            elif kind == "values":
                x, y = int(message["x"]), int(message["y"])
                await client.send({"kind": "values", "x": x, "y": y, "values": self.session.values_at(x, y)})
            elif kind == "keep":  # the picture on screen now, not when the request runs
                client.ask(kind, partial(self.session.keep, self.session.picture("values")))
            elif kind in _QUESTIONS:
                client.ask(kind, partial(_QUESTIONS[kind], self.session, message))
            else:
                await client.refuse(f"no message is called {str(kind)[:40]!r}")
        except PassgraphError as error:
            await client.refuse(str(error))
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            await client.refuse(f"a message that does not fit: {type(error).__name__}")

    async def _save(self, request: Request) -> Response:
        """Send the shown target as a file: as it looks, or its values."""
        from passgraph.pictures import save

        format = request.query_params.get("as", "png")
        if format not in SAVED:
            return PlainTextResponse(f"expected as={', '.join(SAVED)}", 400)
        suffix, output, bits = SAVED[format]
        return await self._send_file(f".{suffix}", lambda path: save(path, self.session.picture(output), bits=bits))

    async def _record(self, request: Request) -> Response:
        """Send a range of frames of the shown target as a video."""
        query = request.query_params
        try:
            first, last = int(query["first"]), int(query["last"])
            rate, suffix = Fraction(query.get("rate", "30")), f".{query.get('as', 'mp4')}"
            if suffix not in SUFFIXES:
                raise ValueError
        except (KeyError, ValueError, ZeroDivisionError):
            return PlainTextResponse("expected first=, last= (frames from 0), rate= (frames a second) and as=mp4", 400)
        return await self._send_file(suffix, lambda path: self.session.record(first, last, rate, path))

    async def _send_file(self, suffix: str, write: Callable[[Path], None]) -> Response:
        """Write a temporary file, send it, and remove it."""
        path = self._new_path(suffix)
        try:
            await asyncio.to_thread(write, path)
        except Exception as error:  # of a user's effect, or of a backend
            path.unlink(missing_ok=True)
            return PlainTextResponse(error_text(error), 400)
        name = f"{self.session.subject.name}{suffix}"
        return FileResponse(path, filename=name, background=BackgroundTask(path.unlink, missing_ok=True))

    def _new_path(self, suffix: str) -> Path:
        handle, name = tempfile.mkstemp(suffix, dir=self._folder.name)
        os.close(handle)
        return Path(name)

    def _put(self, use: str) -> Callable[[Request], Awaitable[Response]]:
        """Return the handler of an uploaded file: another input, or a picture to compare with."""
        use_file = {"input": self.session.replace_input, "reference": self.session.compare_with}[use]

        async def take(request: Request) -> Response:
            suffix = Path(request.path_params["name"]).suffix.lower()
            if not suffix.isascii() or not suffix[1:].isalnum() or len(suffix) > 8:
                return PlainTextResponse("the file's name needs a suffix such as .png", 400)
            path, size = self._new_path(suffix), 0
            unused: Path | None = path
            try:
                with path.open("wb") as file:
                    async for chunk in request.stream():
                        size += len(chunk)
                        if size > MAX_UPLOAD:
                            return PlainTextResponse(f"the file is larger than {MAX_UPLOAD >> 20} MiB", 413)
                        file.write(chunk)
                await asyncio.to_thread(use_file, path)
                unused, self._put_files[use] = self._put_files.get(use), path
            except Exception as error:  # of a library that reads the file
                return PlainTextResponse(error_text(error), 400)
            finally:
                if unused is not None:
                    unused.unlink(missing_ok=True)
            return JSONResponse({})

        return take


#: Formats to save: the suffix, the target's values or its picture as shown, and bits a channel.
SAVED: Mapping[str, tuple[str, Literal["values", "shown"], int | None]] = {
    "png": ("png", "shown", None),
    "png8": ("png", "values", 8),
    "png16": ("png", "values", 16),
    "exr": ("exr", "values", None),
    "npy": ("npy", "values", None),
}
_QUESTIONS: Mapping[str, Callable[[Session, Mapping[str, Any]], dict[str, Any]]] = {
    "statistics": lambda session, _: session.statistics(),
    "inspect": lambda session, message: session.inspect(int(message["x"]), int(message["y"])),
    "profile": lambda session, _: session.profile(),
    "code": lambda session, message: session.code(str(message["name"])),
    "verdict": lambda session, _: session.verdict(),
}


def checked_changes(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Convert the changes in a page's message to fields of `Settings`; raises ValueError for invalid ones.

    >>> checked_changes({"frame": 3, "look": {"channel": "red"}})
    {'frame': 3, 'look': Look(channel='red', exposure=0.0, low=0.0, high=1.0, srgb=False, mark=True)}
    """
    checked: dict[str, Any] = {}
    for name, value in changes.items():
        default = getattr(Settings(), name) if name in Settings.__dataclass_fields__ else None
        if default is None:
            raise ValueError(name)
        if name == "look":
            fields = {n: type(getattr(Look(), n))(v) for n, v in value.items()}
            checked[name] = Look(**fields)
            if checked[name].channel not in CHANNELS or checked[name].low == checked[name].high:
                raise ValueError(name)
        elif name == "values":
            checked[name] = {str(n): _checked_value(v) for n, v in value.items()}
        elif name == "orbit":
            right, up, distance = (float(number) for number in value)
            checked[name] = (right, up, distance)
        else:
            checked[name] = type(default)(value)
    return checked


def _checked_value(value: Any) -> Any:
    """Return a number, a text, or a short list of numbers; raise ValueError for other values."""
    if isinstance(value, list):
        return [float(number) for number in value[:16]]
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise ValueError(type(value).__name__)


def _file(name: str) -> Callable[[Request], Awaitable[Response]]:
    async def respond(_: Request) -> Response:
        headers = {"Content-Security-Policy": CSP, "Cache-Control": "no-store", "Referrer-Policy": "no-referrer"}
        return FileResponse(_PAGE / name, headers=headers)

    return respond
