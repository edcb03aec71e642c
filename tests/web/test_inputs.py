"""Pictures that a visitor of an exported page gives: by the file picker, by drop, as a video, by the camera."""

from __future__ import annotations

import base64
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.web import export_web
from tests.web.browser import CHROMIUM, opened, read

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")]

#: 64x48: red over green on the left, blue over gray on the right; no two mirrored or turned pictures are the same.
PICTURE = np.zeros((48, 64, 3), np.uint8)
PICTURE[:24, :32], PICTURE[24:, :32] = (200, 30, 40), (20, 180, 60)
PICTURE[:24, 32:], PICTURE[24:, 32:] = (30, 60, 210), (128, 128, 128)
CENTERS = [(12, 16), (36, 16), (12, 48), (36, 48)]
#: Eight bits of a lossy video in limited range.
OF_VIDEO = 8 / 255

same = pg.kernel(source="def same(color: Image) -> vec4: return color[0, 0]")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "page").mkdir()
    export_web(same(pg.Input("frame", "rgba8")), tmp_path / "page", size=(6, 4))
    return tmp_path / "page"


def given(page: Any, give: Callable[[], object]) -> NDArray[np.float32]:
    """What the page shows of the picture after it is given; it begins with one of 6x4."""
    page.wait_for_selector("body[data-shown]")
    assert read(page).shape == (4, 6, 4)
    give()
    page.wait_for_function("() => globalThis.program.size[0] === 64", timeout=30_000)
    shown = page.evaluate("() => Number(document.body.dataset.shown)")
    page.wait_for_function(f"() => Number(document.body.dataset.shown) >= {shown}")
    assert (page.faults, page.locator("#error").is_hidden()) == ([], True)
    return read(page)


def assert_is_the_picture(got: NDArray[np.float32], within: float) -> None:
    assert got.shape == (48, 64, 4)
    for y, x in CENTERS:
        assert got[y, x, :3] == pytest.approx(PICTURE[y, x] / 255, abs=within)
        assert got[y, x, 3] == 1


def png(path: Path) -> Path:
    pg.save(path, PICTURE)
    return path


def video(path: Path) -> Path:
    """Two seconds of the picture, in VP8 and sRGB."""
    av = pytest.importorskip("av")
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libvpx", rate=10, width=64, height=48, pix_fmt="yuv420p")
        context = stream.codec_context
        context.bit_rate, context.color_primaries, context.color_trc, context.colorspace = 2_000_000, 1, 13, 5
        for _ in range(20):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(PICTURE)))
        container.mux(stream.encode(None))
    return path


def y4m() -> bytes:
    """Ten frames of the picture, uncompressed, BT.601 in limited range."""
    luma, blue, red = np.array([[65.481, 128.553, 24.966], [-37.797, -74.203, 112], [112, -93.786, -18.214]])
    planes = [PICTURE @ luma / 255 + 16, *(PICTURE[::2, ::2] @ row / 255 + 128 for row in (blue, red))]
    frame = b"FRAME\n" + b"".join(plane.round().astype(np.uint8).tobytes() for plane in planes)
    return b"YUV4MPEG2 W64 H48 F10:1 Ip A1:1 C420jpeg\n" + frame * 10


def test_a_file_that_is_picked(folder: Path, tmp_path: Path) -> None:
    with opened(folder, "index.html") as page:

        def pick() -> None:
            with page.expect_file_chooser() as chooser:
                page.locator("#open").click()
            chooser.value.set_files(png(tmp_path / "a.png"))

        assert_is_the_picture(given(page, pick), 1e-6)


def drop(page: Any, file: Path, type_: str) -> None:
    """Drop a file on the stage as a browser does, after dragging it over."""
    transfer = page.evaluate_handle(
        """([text, name, type]) => {
            const transfer = new DataTransfer(), bytes = Uint8Array.from(atob(text), (one) => one.charCodeAt(0));
            transfer.items.add(new File([bytes], name, { type }));
            return transfer;
        }""",
        [base64.b64encode(file.read_bytes()).decode(), file.name, type_],
    )
    page.dispatch_event("#stage", "dragover", {"dataTransfer": transfer})
    assert page.locator("#drop").is_visible()
    page.dispatch_event("#stage", "drop", {"dataTransfer": transfer})
    assert page.locator("#drop").is_hidden()


def test_a_picture_that_is_dropped(folder: Path, tmp_path: Path) -> None:
    with opened(folder, "index.html") as page:
        assert_is_the_picture(given(page, lambda: drop(page, png(tmp_path / "a.png"), "image/png")), 1e-6)


@pytest.mark.parametrize("how", ["picked", "dropped"])
def test_a_video(how: str, folder: Path, tmp_path: Path) -> None:
    film = video(tmp_path / "film.webm")
    with opened(folder, "index.html") as page:

        def give() -> None:
            page.locator("#file").set_input_files(film) if how == "picked" else drop(page, film, "video/webm")

        assert_is_the_picture(given(page, give), OF_VIDEO)
        frame = page.evaluate("() => globalThis.program.frame")
        page.wait_for_function(f"() => globalThis.program.frame > {frame + 2}")  # it plays on
        page.locator("#play").click()
        page.wait_for_timeout(300)
        frame = page.evaluate("() => globalThis.program.frame")
        page.wait_for_timeout(300)
        assert page.evaluate("() => globalThis.program.frame") == frame


def test_the_camera(folder: Path, tmp_path: Path) -> None:
    """Chromium plays a file in place of a camera."""
    (tmp_path / "camera.y4m").write_bytes(y4m())
    flags = ["--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream",
             f"--use-file-for-fake-video-capture={tmp_path / 'camera.y4m'}"]  # fmt: skip
    with opened(folder, "index.html", flags) as page:
        assert_is_the_picture(given(page, page.locator("#camera").click), OF_VIDEO)
        assert page.locator("#camera").get_attribute("aria-pressed") == "true"
        page.locator("#camera").click()
        page.wait_for_function("() => globalThis.program.size[0] === 6")
        assert page.locator("#camera").get_attribute("aria-pressed") == "false"


def test_without_a_camera_the_page_says_so_and_goes_on(folder: Path, tmp_path: Path) -> None:
    with opened(folder, "index.html") as page:
        page.wait_for_selector("body[data-shown]")
        page.locator("#camera").click()
        page.wait_for_function("() => !document.getElementById('error').hidden")
        assert "The camera cannot be used" in page.locator("#error").inner_text()
        page.locator("#file").set_input_files(png(tmp_path / "a.png"))
        page.wait_for_function("() => globalThis.program.size[0] === 64")
        assert page.locator("#error").is_hidden()


def test_a_file_that_is_no_picture_is_an_error_and_the_picture_stays(folder: Path, tmp_path: Path) -> None:
    with opened(folder, "index.html") as page:
        page.wait_for_selector("body[data-shown]")
        for name in ("broken.png", "broken.webm"):
            (tmp_path / name).write_bytes(b"no picture")
            page.locator("#file").set_input_files(tmp_path / name)
            page.wait_for_function(f"() => document.getElementById('error').textContent.startsWith('{name}: ')")
            assert page.evaluate("() => globalThis.program.size[0]") == 6


def test_files_are_let_go(folder: Path, tmp_path: Path) -> None:
    """A page holds the memory of a file as long as an object URL names it."""
    (tmp_path / "broken.webm").write_bytes(b"no video")
    film = video(tmp_path / "film.webm")
    with opened(folder, "index.html") as page:
        page.evaluate(
            """() => {
                globalThis.named = [];
                const { createObjectURL, revokeObjectURL } = URL;
                URL.createObjectURL = (blob) => { const url = createObjectURL(blob); named.push(url); return url; };
                URL.revokeObjectURL = (url) => { revokeObjectURL(url); named.splice(named.indexOf(url), 1); };
            }"""
        )
        given(page, lambda: page.locator("#file").set_input_files(film))
        assert page.evaluate("named.length") == 1
        page.locator("#file").set_input_files(tmp_path / "broken.webm")
        page.wait_for_function("() => !document.getElementById('error').hidden")
        assert page.evaluate("named.length") == 1
        with page.expect_download() as saved:
            page.locator("#save").click()
        np.testing.assert_allclose(pg.load(saved.value.path())[12, 16, :3], PICTURE[12, 16] / 255, atol=OF_VIDEO)
        assert page.evaluate("named.length") == 1
        page.locator("#file").set_input_files(png(tmp_path / "a.png"))
        page.wait_for_function("() => named.length === 0")
