"""Answer the pages of a session: their messages, the states they are sent, their uploads and downloads.

:mod:`.server` (the page on its own) and :mod:`.widget` (the page in a cell of a notebook) carry them.
"""

from __future__ import annotations

import asyncio
import os
import tempfile
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, Literal

from passgraph.arguments import parsed_fraction
from passgraph.errors import InputError, PassgraphError
from passgraph.pictures import save
from passgraph.reading import parsed_json
from passgraph.viewer.display import CHANNELS, Look
from passgraph.viewer.recording import SUFFIXES
from passgraph.viewer.requests import Settings
from passgraph.viewer.session import Published, Session
from passgraph.viewer.subject import Subject
from passgraph.writing import temporary_folder

#: Largest message of a page, and largest uploaded file, in bytes.
MAX_MESSAGE, MAX_UPLOAD = 1 << 16, 1 << 28
#: Sends a message and its pictures to a page.
Send = Callable[[Mapping[str, Any], Sequence[bytes]], Awaitable[None]]


class Client:
    """An open page.

    Slow requests are computed in threads. Of each kind one runs at a time, and then the latest one received meanwhile.
    `send` raises ConnectionError if the page is closed.
    """

    def __init__(self, send: Send) -> None:
        self._send = send
        #: True once it has shown the last pictures.
        self.is_ready = True
        self.keys_down: set[int] = set()
        self._pending: dict[str, Callable[[], dict[str, Any]]] = {}
        self.tasks: dict[str, asyncio.Task[None]] = {}

    async def send(self, message: Mapping[str, Any], pictures: Sequence[bytes] = ()) -> None:
        await self._send(message, pictures)

    async def refuse(self, text: str) -> None:
        await self.send({"kind": "refused", "text": text})

    def ask(self, kind: str, question: Callable[[], dict[str, Any]]) -> None:
        """Compute the answer in a thread, after a running request of its kind, and send it."""
        self._pending[kind] = question
        task = self.tasks.get(kind)
        if task is None or task.done():
            self.tasks[kind] = asyncio.create_task(self._answer(kind))

    async def _answer(self, kind: str) -> None:
        with suppress(ConnectionError):
            while kind in self._pending:
                try:
                    facts = await asyncio.to_thread(self._pending.pop(kind))
                except Exception as error:  # of a user's effect; the page continues
                    await self.refuse(error_text(error))
                else:
                    await self.send({"kind": kind, **facts})

    def close(self) -> None:
        for task in self.tasks.values():
            task.cancel()


def error_text(error: Exception) -> str:
    """Return the text of an error for the page."""
    return str(error) if isinstance(error, PassgraphError) else f"{type(error).__name__}: {error}"


class Upload:
    """A file that a page sends in parts."""

    def __init__(self, name: str, folder: Path) -> None:
        suffix = Path(name).suffix.lower()
        if not suffix.isascii() or not suffix[1:].isalnum() or len(suffix) > 8:
            raise InputError("the file's name needs a suffix such as .png")
        self.path, self._size = new_path(suffix, folder), 0

    def write(self, part: bytes) -> None:
        self._size += len(part)
        if self._size > MAX_UPLOAD:
            raise InputError(f"the file is larger than {MAX_UPLOAD >> 20} MiB")
        with self.path.open("ab") as file:
            file.write(part)

    def discard(self) -> None:
        self.path.unlink(missing_ok=True)


def new_path(suffix: str, folder: Path) -> Path:
    handle, name = tempfile.mkstemp(suffix, dir=folder)
    os.close(handle)
    return Path(name)


class Pages:
    """A session, and the pages that show it. All but `publish` of the session runs in one event loop."""

    def __init__(self, subject: Subject, backend: str = "") -> None:
        self.subject, self.backend = subject, backend
        self._loop: asyncio.AbstractEventLoop | None = None
        self._news = asyncio.Event()
        #: Uploaded files in use: another input, a picture to compare with.
        self._put_files: dict[str, Path] = {}
        self._folder = temporary_folder()
        self.renew()

    def renew(self) -> None:
        """Replace the session by a new one, which has not been started."""
        session = Session(self.subject, self.backend, lambda state: self._published(session, state))
        self.session = session
        #: The latest state, and the latest one with pictures; states of errors have none.
        self._latest: Published | None = None
        self._latest_drawn: Published | None = None

    def _published(self, session: Session, state: Published) -> None:
        """Pass a state from the session's thread to the event loop."""
        loop = self._loop
        if loop is not None:
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(self._take, session, state)

    def _take(self, session: Session, state: Published) -> None:
        if session is not self.session:
            return
        self._latest = state
        if state.pictures:
            self._latest_drawn = state
        self._wake()

    def _wake(self) -> None:
        """Wake the senders to check for a new state."""
        news, self._news = self._news, asyncio.Event()
        news.set()

    def join(self, client: Client) -> None:
        """Send the states to a page from now on."""
        client.tasks["state"] = asyncio.create_task(self._send_states(client))

    def leave(self, client: Client) -> None:
        """Forget a page that has closed."""
        client.close()
        for code in client.keys_down:
            self.session.requests.key(code, False)

    async def _send_states(self, client: Client) -> None:
        """Send the latest state; with pictures only if the client has shown the last ones, so that they never queue."""
        sent = sent_pictures = 0
        with suppress(ConnectionError):
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
                message = {"kind": "state", "number": sent, "pictures": slots, **state.facts}
                await client.send(message, [data for data, _ in pictures.values()])

    async def receive(self, client: Client, text: str) -> None:
        """Handle a message; an invalid one gets an answer, and changes nothing."""
        try:
            message = parsed_json(text)
            kind = message["kind"]
            if kind == "ask":
                self.session.requests.ask(**checked_changes(message["changes"]))
            elif kind == "ready":
                client.is_ready = True
                self.session.requests.ready()
                self._wake()
            elif kind == "key":
                code, down = int(message["code"]), bool(message["down"])
                self.session.requests.key(code, down)
                (client.keys_down.add if down else client.keys_down.discard)(code)
            elif kind == "values":
                x, y = int(message["x"]), int(message["y"])
                await client.send({"kind": "values", "x": x, "y": y, "values": self.session.shown.values_at(x, y)})
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

    async def write(self, what: str, query: Mapping[str, str]) -> Path:
        """Write the shown target ("save") or a range of its frames ("record") to a new file, and return its path."""
        prepare = {"save": self._save, "record": self._record}[what]
        suffix, write = prepare(query)
        path = new_path(suffix, Path(self._folder.name))
        try:
            await asyncio.to_thread(write, path)
        except BaseException:
            path.unlink(missing_ok=True)
            raise
        return path

    def _save(self, query: Mapping[str, str]) -> tuple[str, Callable[[Path], object]]:
        """Return the suffix and the writer of the shown target: as it looks, or its values."""
        format = query.get("as", "png")
        if format not in SAVED:
            raise InputError(f"expected as={', '.join(SAVED)}")
        suffix, output, bits = SAVED[format]
        return f".{suffix}", lambda path: save(path, self.session.picture(output), bits=bits)

    def _record(self, query: Mapping[str, str]) -> tuple[str, Callable[[Path], object]]:
        """Return the suffix and the writer of a range of frames of the shown target, as a video."""
        try:
            first, last = int(query["first"]), int(query["last"])
            rate, suffix = parsed_fraction(str(query.get("rate", "30"))), f".{query.get('as', 'mp4')}"
            if suffix not in SUFFIXES:
                raise ValueError
        except (KeyError, TypeError, ValueError, OverflowError):
            raise InputError("expected first=, last= (frames from 0), rate= (frames a second) and as=mp4") from None
        return suffix, lambda path: self.session.record(first, last, rate, path)

    def upload(self, name: str) -> Upload:
        """Begin an upload."""
        return Upload(name, Path(self._folder.name))

    async def use(self, upload: Upload, use: str) -> None:
        """Use an uploaded file as another input ("input"), or as a picture to compare with ("reference")."""
        use_file = {"input": self.session.replace_input, "reference": self.session.compare_with}[use]
        await asyncio.to_thread(use_file, upload.path)
        earlier, self._put_files[use] = self._put_files.get(use), upload.path
        if earlier is not None:
            earlier.unlink(missing_ok=True)


#: Formats to save: the suffix, the target's values or its picture as shown, and bits a channel.
SAVED: Mapping[str, tuple[str, Literal["values", "shown"], int | None]] = {
    "png": ("png", "shown", None),
    "png8": ("png", "values", 8),
    "png16": ("png", "values", 16),
    "exr": ("exr", "values", None),
    "npy": ("npy", "values", None),
}
_QUESTIONS: Mapping[str, Callable[[Session, Mapping[str, Any]], dict[str, Any]]] = {
    "statistics": lambda session, _: session.shown.statistics(),
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
