"""The page of a session: served on the loopback interface, to who has the token, and to no other origin."""

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
from passgraph.viewer.session import Asked, Published, Session
from passgraph.viewer.subject import Subject

#: Largest message of a page, and largest file that may be dropped on it, bytes.
MAX_MESSAGE, MAX_UPLOAD = 1 << 16, 1 << 28
#: What a page may be: nothing from elsewhere.
CSP = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'"
_PAGE = Path(__file__).parent / "page"
_FILES = {"": "index.html", "page.js": "page.js", "debug.js": "debug.js", "page.css": "page.css"}


class Guard:
    """Lets requests pass that name this machine, so that no other name is pointed here, and come from this origin."""

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
    """One page that is open.

    Questions that take long are answered beside its other messages: of each kind one at a time, and then the last one
    that was asked meanwhile.
    """

    def __init__(self, socket: WebSocket) -> None:
        self.socket = socket
        #: Whether it has shown the last pictures.
        self.is_ready = True
        self._asked: dict[str, Callable[[], dict[str, Any]]] = {}
        self._answering: dict[str, asyncio.Task[None]] = {}

    async def send(self, message: Mapping[str, Any]) -> None:
        await self.socket.send_text(json.dumps(message))

    async def refuse(self, text: str) -> None:
        await self.send({"kind": "refused", "text": text})

    def ask(self, kind: str, question: Callable[[], dict[str, Any]]) -> None:
        """Answer a question in a thread, after the one of its kind that is being answered."""
        self._asked[kind] = question
        task = self._answering.get(kind)
        if task is None or task.done():
            self._answering[kind] = asyncio.create_task(self._answer(kind))

    async def _answer(self, kind: str) -> None:
        with suppress(WebSocketDisconnect, RuntimeError):
            while kind in self._asked:
                try:
                    found = await asyncio.to_thread(self._asked.pop(kind))
                except Exception as error:  # whatever a user's effect does, the page goes on
                    await self.refuse(told(error))
                else:
                    await self.send({"kind": kind, **found})

    def close(self) -> None:
        for task in self._answering.values():
            task.cancel()


def told(error: Exception) -> str:
    """The text of an error for the page."""
    return str(error) if isinstance(error, PassgraphError) else f"{type(error).__name__}: {error}"


class View:
    """A session with its page."""

    def __init__(self, subject: Subject, backend: str = "", port: int = 0) -> None:
        self.token = secrets.token_urlsafe(18)
        self.socket = socket.create_server(("127.0.0.1", port))
        self.port = int(self.socket.getsockname()[1])
        self.session = Session(subject, backend, self._published)
        self._loop: asyncio.AbstractEventLoop | None = None
        #: The newest state, and the newest one with pictures: states of errors have none.
        self._latest: Published | None = None
        self._drawn: Published | None = None
        self._news = asyncio.Event()
        self._running: uvicorn.Server | None = None
        self._thread: threading.Thread | None = None
        #: Files of the page that are read: another input, a picture to compare with.
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
        """Serve in a thread of its own, until `close`."""
        self._running = self._server()
        self._thread = threading.Thread(target=self._running.run, kwargs={"sockets": [self.socket]}, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End what `start` began, and let go of the port."""
        if self._running is not None and self._thread is not None:
            self._running.should_exit = True
            self._thread.join(10.0)
        self.socket.close()
        self._folder.cleanup()

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """The page in a notebook's cell."""
        frame = f'<iframe src="{self.url}" width="100%" height="640" title="passgraph view"></iframe>'
        return bundle(f"passgraph view: {self.url}", frame)

    def _server(self) -> uvicorn.Server:
        config = uvicorn.Config(
            self.app, log_level="warning", ws="websockets-sansio", ws_max_size=MAX_MESSAGE, ws_ping_interval=None,
            timeout_graceful_shutdown=1,
        )  # fmt: skip
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
        """In the session's thread."""
        loop = self._loop
        if loop is not None:
            with suppress(RuntimeError):  # it has ended
                loop.call_soon_threadsafe(self._take, state)

    def _take(self, state: Published) -> None:
        self._latest = state
        if state.pictures:
            self._drawn = state
        self._wake()

    def _wake(self) -> None:
        """Let senders look for what is new."""
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

    async def _send_states(self, client: Client) -> None:
        """The newest state, with pictures if the client has shown the last ones: they never queue."""
        seen = drawn = 0
        with suppress(WebSocketDisconnect, RuntimeError):
            while True:
                news, state = self._news, self._latest
                newest = self._drawn if client.is_ready else None
                is_due = newest is not None and newest.number != drawn
                if state is None or (state.number == seen and not is_due):
                    await news.wait()
                    continue
                seen = state.number
                pictures: Mapping[str, tuple[bytes, str]] = {}
                if newest is not None and is_due:
                    drawn, pictures, client.is_ready = newest.number, newest.pictures, False
                slots = [{"slot": slot, "type": kind, "bytes": len(data)} for slot, (data, kind) in pictures.items()]
                await client.send({"kind": "state", "number": seen, "pictures": slots, **state.facts})
                for data, _ in pictures.values():
                    await client.socket.send_bytes(data)

    async def _receive(self, client: Client, text: str) -> None:
        """Do what a message says; one that does not fit is answered, and changes nothing."""
        try:
            message = json.loads(text)
            kind = message["kind"]
            if kind == "ask":
                self.session.ask(**checked_changes(message["changes"]))
            elif kind == "ready":
                client.is_ready = True
                self.session.ready()
                self._wake()
            elif kind == "values":
                x, y = int(message["x"]), int(message["y"])
                await client.send({"kind": "values", "x": x, "y": y, "values": self.session.values_at(x, y)})
            elif kind == "keep":  # what is shown now, not when its turn comes
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
        """The target that is shown as a file: as it looks, or its values."""
        from passgraph.pictures import save

        chosen = request.query_params.get("as", "png")
        if chosen not in SAVED:
            return PlainTextResponse(f"expected as={', '.join(SAVED)}", 400)
        suffix, output, bits = SAVED[chosen]
        return await self._made_file(f".{suffix}", lambda path: save(path, self.session.picture(output), bits=bits))

    async def _record(self, request: Request) -> Response:
        """The target that is shown as a video of some frames."""
        asked = request.query_params
        try:
            first, last = int(asked["first"]), int(asked["last"])
            rate, suffix = Fraction(asked.get("rate", "30")), f".{asked.get('as', 'mp4')}"
            if suffix not in SUFFIXES:
                raise ValueError
        except (KeyError, ValueError, ZeroDivisionError):
            return PlainTextResponse("expected first=, last= (frames from 0), rate= (frames a second) and as=mp4", 400)
        return await self._made_file(suffix, lambda path: self.session.record(first, last, rate, path))

    async def _made_file(self, suffix: str, write: Callable[[Path], None]) -> Response:
        """A file of its own that is removed once it is sent."""
        path = self._new_path(suffix)
        try:
            await asyncio.to_thread(write, path)
        except Exception as error:  # of a user's effect, or of a backend
            path.unlink(missing_ok=True)
            return PlainTextResponse(told(error), 400)
        name = f"{self.session.subject.name}{suffix}"
        return FileResponse(path, filename=name, background=BackgroundTask(path.unlink, missing_ok=True))

    def _new_path(self, suffix: str) -> Path:
        handle, name = tempfile.mkstemp(suffix, dir=self._folder.name)
        os.close(handle)
        return Path(name)

    def _put(self, use: str) -> Callable[[Request], Awaitable[Response]]:
        """Takes a file of the page: another input, or a picture to compare with."""
        place = {"input": self.session.replace_input, "reference": self.session.compare_with}[use]

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
                await asyncio.to_thread(place, path)
                unused, self._put_files[use] = self._put_files.get(use), path
            except Exception as error:  # of a library that reads the file
                return PlainTextResponse(told(error), 400)
            finally:
                if unused is not None:
                    unused.unlink(missing_ok=True)
            return JSONResponse({})

        return take


#: What the page saves: the suffix, what of the target, and bits a channel where they are chosen.
SAVED: Mapping[str, tuple[str, Literal["values", "shown"], int | None]] = {
    "png": ("png", "shown", None), "png8": ("png", "values", 8), "png16": ("png", "values", 16),
    "exr": ("exr", "values", None), "npy": ("npy", "values", None),
}  # fmt: skip
_QUESTIONS: Mapping[str, Callable[[Session, Mapping[str, Any]], dict[str, Any]]] = {
    "statistics": lambda session, _: session.statistics(),
    "inspect": lambda session, message: session.inspect(int(message["x"]), int(message["y"])),
    "profile": lambda session, _: session.profile(),
    "code": lambda session, message: session.code(str(message["name"])),
    "verdict": lambda session, _: session.verdict(),
}


def checked_changes(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a page asks for as fields of `Asked`; raises ValueError for what is none.

    >>> checked_changes({"frame": 3, "look": {"channel": "red"}})
    {'frame': 3, 'look': Look(channel='red', exposure=0.0, low=0.0, high=1.0, srgb=False, mark=True)}
    """
    made: dict[str, Any] = {}
    for name, value in changes.items():
        plain = getattr(Asked(), name) if name in Asked.__dataclass_fields__ else None
        if plain is None:
            raise ValueError(name)
        if name == "look":
            fields = {n: type(getattr(Look(), n))(v) for n, v in value.items()}
            made[name] = Look(**fields)
            if made[name].channel not in CHANNELS or made[name].low == made[name].high:
                raise ValueError(name)
        elif name == "values":
            made[name] = {str(n): _plain(v) for n, v in value.items()}
        elif name == "orbit":
            right, up, distance = (float(number) for number in value)
            made[name] = (right, up, distance)
        else:
            made[name] = type(plain)(value)
    return made


def _plain(value: Any) -> Any:
    """A number, a word, or a short list of numbers."""
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
