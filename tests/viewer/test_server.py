"""The page's server: who may see it, what it serves, and what it does with messages that do not fit."""

from __future__ import annotations

import asyncio
import http.client
import json
import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from time import monotonic, sleep
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.view import EffectSubject
from passgraph.pictures import load_stored
from passgraph.viewer.messages import MAX_MESSAGE, checked_changes
from passgraph.viewer.show import in_notebook
from tests.picture_files import names_in
from tests.viewer.subjects import KERNEL, files

pytest.importorskip("uvicorn")
View = pytest.importorskip("passgraph.viewer.server").View
client = pytest.importorskip("websockets.sync.client")


class Served:
    """A view of a small effect in a thread of its own."""

    def __init__(self, folder: Path) -> None:
        effect, picture = files(folder)
        self.view = View(EffectSubject(str(effect), [str(picture)], (8, 4), None), "numpy")
        self.view.start()

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *_: object) -> None:
        self.view.close()
        assert self.view._thread is not None
        assert not self.view._thread.is_alive()

    def get(self, path: str, *, method: str = "GET", body: bytes | None = None, **headers: str) -> tuple[int, bytes]:
        with closing(http.client.HTTPConnection("127.0.0.1", self.view.port, timeout=60)) as connection:
            connection.putrequest(method, path, skip_host="Host" in headers)
            for name, value in headers.items():
                connection.putheader(name, value)
            if body is not None:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            answer = connection.getresponse()
            return answer.status, answer.read()

    @property
    def base(self) -> str:
        return f"/{self.view.token}/"

    def socket(self, **options: Any) -> Any:
        return client.connect(f"ws://127.0.0.1:{self.view.port}{self.base}socket", **options)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with Served(tmp_path_factory.mktemp("view")) as made:
        yield made


def answer_of(socket: Any, kind: str, *, pictures: int | None = None) -> dict[str, Any]:
    """The next message of a kind; a state may not have another number of pictures than expected."""
    end = monotonic() + 60
    while monotonic() < end:
        data = socket.recv(timeout=60)
        if isinstance(data, str) and (message := json.loads(data))["kind"] == kind:
            assert pictures in (None, len(message.get("pictures", ())))
            return dict(message)
    raise TimeoutError(kind)


def test_the_page_and_its_files_are_served_to_who_has_the_token(served: Served) -> None:
    for name in ("", "page.js", "page.css"):
        assert served.get(served.base + name)[0] == 200
    assert served.get("/")[0] == 404
    assert served.get("/wrong-token/")[0] == 404


@pytest.mark.parametrize(
    "path",
    ["../server.py", "..%2fserver.py", "%2e%2e/session.py", "page/../../server.py", "//etc/passwd", "index.html"],
)
def test_no_other_file_can_be_read(served: Served, path: str) -> None:
    assert served.get(served.base + path)[0] == 404


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1:1", "localhost"])
def test_other_names_of_this_machine_are_refused(served: Served, host: str) -> None:
    assert served.get(served.base, Host=host)[0] == 403


def test_other_origins_are_refused(served: Served) -> None:
    assert served.get(served.base, Origin="http://evil.example")[0] == 403
    assert served.get(served.base, Origin="null")[0] == 403
    assert served.get(served.base, Origin=f"http://127.0.0.1:{served.view.port}")[0] == 200
    with pytest.raises(Exception, match="403"), served.socket(origin="http://evil.example"):
        pass


def test_a_socket_gets_the_picture_and_answers(served: Served) -> None:
    with served.socket() as socket:
        state = answer_of(socket, "state")
        assert state["size"] == [8, 4]
        assert state["pictures"][0]["slot"] == "a"
        assert socket.recv(timeout=60)[:2] in (b"\xff\xd8", b"\x89P")
        socket.send(json.dumps({"kind": "values", "x": 2, "y": 1}))
        assert answer_of(socket, "values")["values"]["a"] == pytest.approx([0.0, 0.4, 0.8, 1.0])


def test_keys_of_a_page_that_closes_are_released(served: Served) -> None:
    def is_down() -> bool:
        return bool(served.view.session.requests.keyboard.picture()[2, 65, 0])

    with served.socket() as socket:
        for code in (300, 65):
            socket.send(json.dumps({"kind": "key", "code": code, "down": True}))
        assert "a key has a code from 0 to 255, got 300" in answer_of(socket, "refused")["text"]
        socket.send(json.dumps({"kind": "values", "x": 2, "y": 1}))
        answer_of(socket, "values")
        assert is_down()
    end = monotonic() + 60
    while is_down():
        assert monotonic() < end


def test_pictures_wait_until_the_last_ones_are_shown(served: Served) -> None:
    with served.socket() as socket:
        assert answer_of(socket, "state")["pictures"]
        for gain in (0.5, 0.25):
            socket.send(json.dumps({"kind": "ask", "changes": {"values": {"gain": gain}}}))
            while answer_of(socket, "state", pictures=0)["number"] <= 1:
                pass
        socket.send(json.dumps({"kind": "ready"}))
        while not answer_of(socket, "state")["pictures"]:
            pass
        socket.send(json.dumps({"kind": "values", "x": 2, "y": 1}))
        assert answer_of(socket, "values")["values"]["a"] == pytest.approx([0.0, 0.1, 0.2, 1.0])
        socket.send(json.dumps({"kind": "ask", "changes": {"values": {}}}))


def test_a_page_that_is_opened_during_an_error_has_the_last_good_picture(tmp_path: Path) -> None:
    with Served(tmp_path) as served, served.socket() as first:
        assert answer_of(first, "state")["pictures"]
        (tmp_path / "mine.py").write_text(KERNEL.replace("* gain", "* gian"))
        while not answer_of(first, "state")["error"]:
            pass
        with served.socket() as second:
            state = answer_of(second, "state")
            assert "gian" in state["error"]
            assert state["pictures"][0]["slot"] == "a"


def test_a_question_that_takes_long_holds_nothing_up(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    goes_on = threading.Event()
    monkeypatch.setattr(served.view.session, "verdict", lambda: {"text": str(goes_on.wait(60))})
    with served.socket() as socket:
        socket.send(json.dumps({"kind": "verdict"}))
        socket.send(json.dumps({"kind": "values", "x": 0, "y": 0}))
        assert answer_of(socket, "values")
        goes_on.set()
        assert answer_of(socket, "verdict")["text"] == "True"


def test_the_picture_of_the_moment_is_kept(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    goes_on, to_thread = threading.Event(), asyncio.to_thread

    async def late(function: Any, *arguments: Any) -> Any:
        await to_thread(goes_on.wait, 60)
        return await to_thread(function, *arguments)

    monkeypatch.setattr(asyncio, "to_thread", late)
    with served.socket() as socket:
        answer_of(socket, "state")
        socket.send(json.dumps({"kind": "keep"}))
        socket.send(json.dumps({"kind": "ask", "changes": {"values": {"gain": 0.5}}}))
        while served.view.session.shown.values_at(2, 1)["a"] != pytest.approx([0.0, 0.2, 0.4, 1.0]):
            pass
        goes_on.set()
        assert answer_of(socket, "keep")
        assert served.view.session.programs.reference is not None
        assert served.view.session.programs.reference[1, 2] == pytest.approx([0.0, 0.4, 0.8, 1.0])
        socket.send(json.dumps({"kind": "ask", "changes": {"values": {}}}))


def test_a_question_that_fails_ends_no_connection(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> dict[str, Any]:
        raise RuntimeError("out of luck")

    monkeypatch.setattr(served.view.session, "profile", fail)
    with served.socket() as socket:
        socket.send(json.dumps({"kind": "profile"}))
        assert answer_of(socket, "refused")["text"] == "RuntimeError: out of luck"
        socket.send(json.dumps({"kind": "values", "x": 0, "y": 0}))
        assert answer_of(socket, "values")


LOOK = '{"kind": "ask", "changes": {"look": {"channel": "purple"}}}'
VALUES = '{"kind": "ask", "changes": {"values": {"a": {}}}}'
SUBJECT = '{"kind": "ask", "changes": {"subject": 1}}'


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        "[" * 60_000,
        '{"kind": ' + "9" * 5000 + "}",
        '{"kind": "shutdown"}',
        '{"kind": "values", "x": "?"}',
        SUBJECT,
        LOOK,
        VALUES,
    ],
)
def test_messages_that_do_not_fit_are_refused_and_the_session_goes_on(served: Served, text: str) -> None:
    with served.socket() as socket:
        socket.send(text)
        assert answer_of(socket, "refused")["text"]
        socket.send(json.dumps({"kind": "values", "x": 0, "y": 0}))
        assert answer_of(socket, "values")


def test_a_message_that_is_too_large_ends_its_connection_only(served: Served) -> None:
    from websockets.exceptions import ConnectionClosed

    with served.socket() as socket:
        socket.send("x" * (MAX_MESSAGE + 1))
        with pytest.raises(ConnectionClosed, match="1009"):
            answer_of(socket, "none")
    assert served.get(served.base)[0] == 200


def test_what_is_shown_can_be_saved(served: Served, tmp_path: Path) -> None:
    with served.socket() as socket:
        answer_of(socket, "state")
    for kind in ("png", "png8", "png16", "exr", "npy"):
        status, data = served.get(f"{served.base}save?as={kind}")
        assert status == 200
        path = tmp_path / f"saved.{kind.rstrip('0123456789')}"
        path.write_bytes(data)
        assert pg.load(path)[1, 2, :3] == pytest.approx([0.0, 0.4, 0.8], abs=2e-3)
        if kind == "png16":
            assert load_stored(path).dtype == np.uint16
    assert served.get(f"{served.base}save?as=py")[0] == 400


@pytest.mark.parametrize(
    "query", ["", "first=0&last=x", "first=2&last=1", "first=0&last=1&rate=0", "first=0&last=1&as=py",
              "first=0&last=1&as=../../x.gif", "first=0&last=1&rate=1/0", "first=0&last=999999999",
              "first=0&last=1&rate=1e9999999", "first=0&last=1&rate=1e-9999999", "first=0&last=1&rate=1/1000000",
              f"first={'9' * 4000}&last={'9' * 4000}", f"first=0&last={'9' * 5000}"]
)  # fmt: skip
def test_recordings_that_cannot_be_are_refused(served: Served, query: str) -> None:
    with served.socket() as socket:
        answer_of(socket, "state")
    status, text = served.get(f"{served.base}record?{query}")
    assert (status, b"record: " in text or b"expected first=" in text) == (400, True)


def test_a_recording_ends_with_its_view(tmp_path: Path) -> None:
    with Served(tmp_path) as served:
        with served.socket() as socket:
            answer_of(socket, "state")
        answers: list[bytes] = []
        query = f"{served.base}record?first=0&last=99999&as=gif"
        asked = threading.Thread(target=lambda: answers.append(served.get(query)[1]))
        asked.start()
        while not list(Path(served.view._folder.name).iterdir()):
            sleep(0.01)
        served.view.session.close()
        asked.join(60)
    assert answers == [b"record: the view was closed"]


def test_a_killed_view_leaves_no_uploads(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    (tmp_path / "temporary").mkdir()
    command = [sys.executable, "-m", "passgraph", "view", effect, picture, "--no-open", "-b", "numpy", "--port", "0"]
    environment = {**os.environ, "TMPDIR": os.fspath(tmp_path / "temporary")}

    def view(put: bool) -> list[str]:
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            found = re.search(r"http://([^/]+)(/[^/]+/)", process.stdout.readline())
            assert found is not None
            with closing(http.client.HTTPConnection(found[1], timeout=60)) as connection:
                connection.request("PUT", f"{found[2]}input/in.png", picture.read_bytes() if put else b"no picture")
                assert connection.getresponse().status == (200 if put else 400)
            names = [path.name for path in (tmp_path / "temporary").rglob("*.png")]
            process.kill() if put else process.terminate()
        return names

    assert len(view(put=True)) == 1
    assert len(list((tmp_path / "temporary").rglob("*.png"))) == 1
    assert view(put=False) == []
    assert not list((tmp_path / "temporary").iterdir())


def test_a_recording_is_served(served: Served) -> None:
    with served.socket() as socket:
        answer_of(socket, "state")
    status, data = served.get(f"{served.base}record?first=0&last=1&rate=25&as=gif")
    assert (status, data[:3]) == (200, b"GIF")


def test_a_picture_to_compare_with_is_taken(served: Served, tmp_path: Path) -> None:
    pg.save(tmp_path / "in.png", np.full((3, 2, 3), 9, np.uint8))
    data = (tmp_path / "in.png").read_bytes()
    assert served.get(f"{served.base}reference/in.png", method="PUT", body=data)[0] == 200
    assert served.get(f"{served.base}reference/in.png", method="PUT", body=b"no picture")[0] == 400


def test_a_dropped_file_becomes_the_input(served: Served, tmp_path: Path) -> None:
    pg.save(tmp_path / "in.png", np.full((3, 2, 3), 9, np.uint8))
    data = (tmp_path / "in.png").read_bytes()
    assert served.get(f"{served.base}input/in.png", method="PUT", body=data)[0] == 200
    with served.socket() as socket:
        while answer_of(socket, "state").get("size") != [2, 3]:
            socket.send(json.dumps({"kind": "ready"}))
    assert served.get(f"{served.base}input/in.png", method="PUT", body=b"no picture")[0] == 400
    assert served.get(f"{served.base}input/no-suffix", method="PUT", body=data)[0] == 400


def test_files_of_the_page_are_kept_as_long_as_they_are_read(tmp_path: Path) -> None:
    with Served(tmp_path) as served:
        folder = Path(served.view._folder.name)
        with served.socket() as socket:
            answer_of(socket, "state")
        for place in ("input", "reference"):
            for _ in range(2):
                body = (tmp_path / "picture.png").read_bytes()
                assert served.get(f"{served.base}{place}/in.png", method="PUT", body=body)[0] == 200
            kept = served.view._put_files[place]
            assert served.get(f"{served.base}{place}/in.png", method="PUT", body=b"no picture")[0] == 400
            assert kept.read_bytes() == body
        assert served.get(f"{served.base}save?as=npy")[0] == 200
        assert served.get(f"{served.base}record?first=0&last=1&rate=25&as=gif")[0] == 200
        end = monotonic() + 60  # a file that was sent is removed just after
        while {*names_in(folder)} != {path.name for path in served.view._put_files.values()}:
            assert monotonic() < end
    assert not folder.exists()


@pytest.mark.parametrize("port", [0, 1])
def test_a_cell_shows_the_page_in_a_frame_without_anywidget_or_with_a_port(
    monkeypatch: pytest.MonkeyPatch, port: int
) -> None:
    monkeypatch.setitem(sys.modules, "ipykernel", sys)
    if port:
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
    else:
        monkeypatch.setitem(sys.modules, "anywidget", None)
    tint = pg.kernel(source="def tint(color: Image) -> vec4: return color[0, 0]")
    view = pg.view(tint, color=np.zeros((4, 8, 4), np.float32), backend="numpy", port=port)
    assert isinstance(view, View)
    try:
        shown = view._repr_mimebundle_()
        assert port in (0, view.port)
        assert f'<iframe src="{view.url}"' in shown["text/html"]
        assert view.url in shown["text/plain"]
        with closing(http.client.HTTPConnection("127.0.0.1", view.port, timeout=60)) as connection:
            connection.request("GET", f"/{view.token}/")
            assert connection.getresponse().status == 200
    finally:
        view.close()


@pytest.mark.parametrize("is_cell", [True, False])
def test_cells_of_marimo_are_a_notebook_and_its_scripts_are_none(
    monkeypatch: pytest.MonkeyPatch, is_cell: bool
) -> None:
    monkeypatch.delitem(sys.modules, "ipykernel", raising=False)
    monkeypatch.setitem(sys.modules, "marimo", SimpleNamespace(running_in_notebook=lambda: is_cell))
    assert in_notebook() is is_cell


@pytest.mark.parametrize("extra", ["notebook", "view"])
def test_the_missing_package_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch, extra: str) -> None:
    monkeypatch.setattr("passgraph.viewer.show.in_notebook", lambda: extra == "notebook")
    for name in ("anywidget", "passgraph.viewer.server"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(pg.InputError, match=rf"pip install 'passgraph\[{extra}\]'"):
        pg.view(pg.kernel(source="def tint(color: Image) -> vec4: return color[0, 0]"))


def test_changes_are_checked() -> None:
    assert checked_changes({"orbit": [1, 2, 3], "playing": 1}) == {"orbit": (1.0, 2.0, 3.0), "playing": True}
    with pytest.raises(ValueError, match="no_such"):
        checked_changes({"no_such": 1})
