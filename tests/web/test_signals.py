"""Exported shaders that read the keyboard and sound: as the live view gives them, in Chromium."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from passgraph.commands.entry import run as passgraph
from tests.commands.told import Outcome, refused
from tests.files.test_audio import READS, sound
from tests.viewer.test_signals import KEYS
from tests.web.browser import CHROMIUM, opened, read

in_chromium = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
#: Two tones, Hz; the page may analyze at its device's rate, so that bins lie at a share of it.
TONES = 2000.0, 6000.0


@pytest.fixture
def song(tmp_path: Path) -> Path:
    time = np.arange(44100) / 44100
    wave = 0.4 * np.sin(2 * np.pi * TONES[0] * time) + 0.4 * np.sin(2 * np.pi * TONES[1] * time)
    return sound(tmp_path / "two tones.WAV", wave)


def exported(folder: Path, shader: str, *more: str) -> Path:
    (folder / "signal.glsl").write_text(shader)
    page = folder / "page"
    assert passgraph(["export", str(folder / "signal.glsl"), *more, "--web", str(page), "--size", "512x4"]) == 0
    return page


def after(page: Any, condition: str) -> None:
    """Wait for a condition on the data of the picture."""
    read = f"program.read('signal').then(({{ data }}) => {condition}).catch(() => false)"  # no frame after a reset
    page.wait_for_function(f"() => {read}", timeout=60_000)


@in_chromium
def test_keys_go_to_the_shader_while_the_picture_has_the_focus(tmp_path: Path) -> None:
    with opened(exported(tmp_path, KEYS), "index.html") as page:
        assert page.locator("#keys").is_visible() and not page.locator("#input").is_visible()

        def keys() -> list[float]:
            return [round(float(one)) for one in read(page)[::-1, 65, 0][:3]]

        page.keyboard.press("a")
        assert keys() == [0, 0, 0]
        page.locator("#play").click()  # a frame for each key
        page.locator("#stage").focus()
        page.evaluate("() => program.reset()")
        page.keyboard.down("a")
        after(page, "data.some((one, i) => i % 4 === 0 && one > 0.5)")
        page.wait_for_timeout(500)
        assert keys() == [1, 0, 1], "down and toggled; pressed in one frame only"
        page.keyboard.up("a")
        page.wait_for_timeout(500)
        assert keys() == [0, 0, 1]
        page.keyboard.press("Escape")
        assert page.evaluate("() => document.activeElement.id") != "stage"
        assert page.faults == []


@in_chromium
@pytest.mark.parametrize("way", ["input", "--audio", "opened"])
def test_the_page_plays_a_sound_and_the_shader_has_its_spectrum(way: str, tmp_path: Path, song: Path) -> None:
    given = {"input": [str(song)], "--audio": ["--audio", str(song)], "opened": []}[way]
    folder = exported(tmp_path, READS, *given)
    assert json.loads((folder / "effect.json").read_text())["signals"] == ["audio"]
    if given:
        assert (folder / "sound.wav").read_bytes() == song.read_bytes()
    from playwright import sync_api

    with opened(folder, "index.html", ["--autoplay-policy=user-gesture-required"]) as page:
        assert not read(page)[..., 0].any()
        if given:
            page.locator("#hear").click()
        else:
            assert not page.locator("#hear").is_visible()
            page.locator("#sound-file").set_input_files(song)
        after(page, "data.some((one, i) => i % 4 === 0 && one > 0.7)")
        rate = page.evaluate("() => new AudioContext().sampleRate")
        at = [round(tone / rate * 2048) for tone in TONES]
        # The sound may pause where it begins again, and its spectrum follows it slowly.
        heard = np.zeros(512)
        for _ in range(600):
            with suppress(sync_api.Error):  # no frame after a reset
                heard = read(page)[-1, :, 0]
            if all(heard[one - 1 : one + 2].max() > 0.7 for one in at):
                break
            page.wait_for_timeout(100)
        for one in at:
            assert heard[one - 1 : one + 2].max() > 0.7
            assert heard[one + 60] < heard[one - 1 : one + 2].max() - 0.2
        page.locator("#hear").click()
        after(page, "data.every((one, i) => i % 4 || one === 0)")
        assert (page.asked, page.faults) == ({page.host}, [])


def test_the_command_says_what_the_page_has(tmp_path: Path, song: Path, capsys: pytest.CaptureFixture[str]) -> None:
    exported(tmp_path, READS, str(song))
    assert f"- the page has audio for the shader, and plays {song}" in capsys.readouterr().out
    exported(tmp_path, KEYS)
    assert "- the page has keyboard for the shader\n" in capsys.readouterr().out
    shader, text = str(tmp_path / "signal.glsl"), tmp_path / "no.wav"
    text.write_text("no sound")
    assert "reads no sound" in refused(capsys, "export", shader, "--web", str(tmp_path / "a"), "--audio", str(song))
    (tmp_path / "signal.glsl").write_text(READS)
    assert "a page plays sound" in refused(capsys, "export", shader, str(song), "--program", str(tmp_path / "b"))
    assert Outcome(capsys, "export", shader, str(text), "--web", str(tmp_path / "c")).status != 0
    assert not (tmp_path / "c").exists()
