"""Keys and sound in the view: rows of the keyboard by frames, keys of the page, sound by its time."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.commands.view import EffectSubject
from passgraph.files.audio import Audio
from passgraph.viewer.keyboard import Keyboard
from tests.files.test_audio import READS, sound, tune
from tests.viewer.subjects import Watched

#: Shows the keyboard, its rows from below, and how often a frame was drawn.
KEYS = """#iChannel0 "keyboard"
void mainImage(out vec4 c, in vec2 f) {
    c = vec4(texelFetch(iChannel0, ivec2(f), 0).x, float(iFrame) / 255.0, 0.0, 1.0);
}"""


def rows(picture: NDArray[np.uint8], code: int) -> list[bool]:
    """A key as a shader reads it: down, pressed, toggled."""
    assert set(np.unique(picture[..., 0])) <= {0, 255}
    return [bool(on) for on in picture[::-1, code, 0]]


def test_rows_follow_the_keys() -> None:
    """As on Shadertoy: a key that repeats is pressed once, and toggled at each press."""
    keyboard, seen = Keyboard(), []
    for down in (True, True, None, False, None, True, None):
        if down is None:
            keyboard.end_frame()
        else:
            keyboard.change(65, down)
        seen.append(rows(keyboard.picture(), 65))
    first, held = [True, True, True], [True, False, True]
    assert seen == [first, first, held, [False, False, True], [False, False, True], [True, True, False],
                    [True, False, False]]  # fmt: skip
    assert not keyboard.picture()[:, np.arange(256) != 65].any()
    for code in (-1, 256):
        with pytest.raises(pg.InputError, match=f"a key has a code from 0 to 255, got {code}"):
            keyboard.change(code, True)


def test_a_shader_reads_keys_while_time_stands(tmp_path: Path) -> None:
    shader = tmp_path / "keys.glsl"
    shader.write_text(KEYS)
    with Watched(str(shader), size=(256, 3)) as view:
        assert view.shows(65, 2, (0, 0, 0)).facts["keyboard"]
        view.session.requests.key(65, True)
        view.shows(65, 2, (255, 0, 0))
        picture = view.session.picture("shown")
        assert rows(picture, 65) == [True, True, True] and not picture[:, 66, 0].any()
        view.session.requests.key(65, False)
        view.shows(65, 2, (0, 0, 0))
        assert rows(view.session.picture("shown"), 65) == [False, False, True]
        assert view.session.view().run_inputs["keyboard"][0, 65, 0] == 255


def test_a_press_between_frames_is_not_lost_and_time_goes_on(tmp_path: Path) -> None:
    """While it plays a press waits for the next frame, which has it in the second row alone."""
    shader = tmp_path / "keys.glsl"
    shader.write_text(KEYS)
    with Watched(str(shader), size=(256, 3)) as view:
        view.shows(65, 2, (0, 0, 0))
        view.session.requests.ask(playing=True)
        view.shows(65, 2, (0, 0, 0))
        view.session.requests.key(65, True)
        view.session.requests.key(65, False)
        view.session.requests.ready()
        state = view.until(lambda state: state.facts["frame"] == 1)
        assert rows(view.session.picture("shown"), 65) == [False, True, True]
        view.session.requests.ready()
        view.until(lambda after: after.number > state.number and after.facts["frame"] == 2)
        assert rows(view.session.picture("shown"), 65) == [False, False, True]


def test_sound_follows_the_time(tmp_path: Path) -> None:
    reads, song = tmp_path / "reads.glsl", sound(tmp_path / "tune.wav", tune())
    reads.write_text(READS.replace("0.0, 1.0)", "0.0 * iTime, 1.0)"))
    audio, other = Audio(song), Audio(sound(tmp_path / "other.wav", tune()[::-1]))
    assert EffectSubject(str(reads), (), (512, 1), None, song).command({}) == EffectSubject(
        str(reads), [str(song)], (512, 1), None
    ).command({})
    with Watched(subject=EffectSubject(str(reads), [str(song)], (512, 1), None)) as view:
        assert view.until(lambda state: state.pictures).facts["moves"]
        for settings, picture in (
            ({"frame": 20}, audio.picture(20, 1 / 30)),
            ({"values": {"time": 0.5, "time_step": 0.01}}, audio.picture(20, 0.01, 0.5)),
        ):
            view.session.requests.ask(**settings)
            view.shows(46, 0, (int(picture[1, 46, 0]), int(picture[0, 46, 0]), 0))
            assert np.array_equal(view.session.picture("shown")[0, :, :2], picture[::-1, :, 0].T)
        assert "--audio" in view.session.subject.command({})
        view.session.record(10, 30, Fraction(10), tmp_path / "made.gif")
        with Image.open(tmp_path / "made.gif") as made:
            for number in (0, 10, 20):  # whose colors are quantized
                made.seek(number)
                spectra = [audio.picture(at, 0.01, 0.5)[1, :, 0].astype(float) for at in (10, 20, 30)]
                errors = [np.abs(np.asarray(made.convert("RGB"))[0, :, 0] - spectrum).mean() for spectrum in spectra]
                assert errors.index(min(errors)) == number // 10
        view.session.replace_input(other.path)
        picture = other.picture(20, 0.01, 0.5)
        view.shows(46, 0, (int(picture[1, 46, 0]), int(picture[0, 46, 0]), 0))


@pytest.mark.parametrize("text", [READS, KEYS, KEYS.replace('#iChannel0 "keyboard"', "")])
def test_what_has_no_sound_and_no_keys_is_recorded(tmp_path: Path, text: str) -> None:
    """Inputs that nobody gives are black; the last text reads a picture that is the frame."""
    shader, frame = tmp_path / "shader.glsl", tmp_path / "frame.png"
    shader.write_text(text)
    pg.save(frame, np.zeros((2, 256, 4), np.uint8))
    words = [] if "#" in text else [str(frame)]
    with Watched(str(shader), *words, size=(256, 2)) as view:
        view.until(lambda state: state.pictures)
        view.session.record(0, 1, Fraction(10), tmp_path / "made.gif")
    with Image.open(tmp_path / "made.gif") as made:
        assert made.convert("RGB").getpixel((9, 0))[0] == 0


def test_sound_for_what_reads_none_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shader = tmp_path / "keys.glsl"
    shader.write_text(KEYS)
    assert run(["view", str(shader), "--audio", "song.mp3", "--no-open"]) == 2
    assert "--audio song.mp3: effect keys reads no sound; leave it out" in capsys.readouterr().err
