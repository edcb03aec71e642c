"""The session: what it computes of what is asked for, and what it shows of files that change."""

from __future__ import annotations

import queue
import sys
import threading
from base64 import b64decode
from fractions import Fraction
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from time import sleep
from typing import Any

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.backends.registry import BUILT_IN
from passgraph.viewer.compiled import Difference, targets_of
from passgraph.viewer.debugger import OUTSIDE
from passgraph.viewer.display import CHANNELS, Look, shown
from passgraph.viewer.session import POLL_S, Published, Session
from passgraph.viewer.show import GivenSubject
from tests.viewer.subjects import KERNEL, Watched, files


def test_a_number_is_moved_without_compiling(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        first = watched.shows(2, 1, (0, 102, 204))
        assert [control["name"] for control in first.facts["controls"]] == ["gain"]
        program = watched.programs()["a"].program
        watched.session.requests.ask(values={"gain": 0.5})
        watched.shows(2, 1, (0, 51, 102))
        assert watched.programs()["a"].program is program
        assert "--gain 0.5" in watched.session.subject.command({"gain": 0.5})


def test_a_saved_file_is_read_again_and_values_stay(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.session.requests.ask(values={"gain": 2.0})
        watched.shows(0, 0, (102, 102, 102))
        effect.write_text(KERNEL.replace("* gain", "* gain * 0.5"))
        watched.shows(0, 0, (51, 51, 51))


def test_an_error_names_its_line_and_the_last_picture_stays(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.shows(0, 0, (51, 51, 51))
        effect.write_text(KERNEL.replace("* gain", "* gian"))
        state = watched.until(lambda one: one.facts["error"])
        assert "mine.py:11" in state.facts["error"]
        assert "gian" in state.facts["error"]
        assert tuple(watched.session.picture("shown")[0, 0, :3]) == (51, 51, 51)
        effect.write_text(KERNEL)
        assert watched.until(lambda one: one.pictures).facts["error"] == ""


def test_targets_on_the_way_can_be_shown(tmp_path: Path) -> None:
    picture = files(tmp_path)[1]
    with Watched("gaussian-blur", str(picture)) as watched:
        names = [one["name"] for one in watched.until(lambda one: one.pictures).facts["targets"]]
        assert names == ["gaussian_blur_x", "gaussian_blur", "frame"]
        watched.session.requests.ask(target=names[0])
        assert watched.until(lambda one: one.facts["target"] == names[0]).pictures


def test_a_texel_and_the_lines_that_make_it(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.shows(2, 1, (0, 102, 204))
        assert watched.session.shown.values_at(2, 1)["a"] == pytest.approx([0.0, 0.4, 0.8, 1.0])
        assert watched.session.shown.values_at(8, 0) == {}
        found = watched.session.inspect(2, 1)
        assert found["parameters"] == ["gain = 1"]
        assert found["backends"] == ["numpy"]
        (row,) = found["rows"]
        assert (row["line"], row["kind"], row["wrong"]) == (11, "returns", [False])
        assert row["values"] == ["0  0.400000006  0.800000012  1", "="]
        assert found["texels"] == [{"image": "color", "target": "frame", "at": [(2, 1)]}]


def test_what_passes_read_of_an_input_is_shown(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.session.requests.ask(target="frame", values={"gain": 2.0})
        watched.until(lambda one: one.pictures and one.facts["target"] == "frame")
        assert tuple(watched.session.picture("shown")[1, 2, :3]) == (0, 102, 204)
        assert "no kernel" in watched.session.inspect(2, 1)["text"]


def test_the_lines_of_two_backends_stand_side_by_side(tmp_path: Path) -> None:
    effect, picture = files(tmp_path, KERNEL.replace("return", "lit = pg.sin(color[0, 0].rgb)\n    return"))
    with Watched(str(effect), str(picture)) as watched:
        watched.session.requests.ask(compare="both", other="reference")
        watched.until(lambda one: "b" in one.pictures)
        found = watched.session.inspect(2, 1)
    assert found["backends"] == ["numpy", "reference"]
    assert [row["line"] for row in found["rows"]] == [11, 12]
    assert [row["values"][2] for row in found["rows"]] == ["=", "="]
    assert found["verdicts"][:2] == [f"{name}: every line is within its bounds" for name in ("numpy", "reference")]


def test_a_wrong_line_is_found_and_its_pixels_are_marked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BUILT_IN, "mistaken", "tests.viewer.subjects:SineForCosine")
    text = KERNEL.replace("return", "lit = pg.cos(color[0, 0].rgb)\n    return").replace(
        "color[0, 0].rgb * gain", "lit"
    )
    effect, picture = files(tmp_path, text)
    with Watched(str(effect), str(picture)) as watched:
        watched.session.requests.ask(compare="both", other="mistaken")
        watched.until(lambda one: "b" in one.pictures)
        found = watched.session.inspect(2, 1)
        assert [row["wrong"] for row in found["rows"]] == [[False, True], [False, True]]
        assert found["verdicts"][1:] == [
            "mistaken: line 11 is the first outside of its bounds", "numpy and mistaken first differ at line 11"
        ]  # fmt: skip
        watched.session.requests.ask(compare="", backend="mistaken")
        watched.until(lambda one: one.pictures and one.facts["backend"] == "mistaken")
        verdict = watched.session.verdict()
    assert verdict["text"] == "mistaken: 32 of 32 pixels are outside of their bounds, 0 undecided"
    assert (np.asarray(Image.open(BytesIO(b64decode(verdict["mask"])))) == OUTSIDE).all()


def test_the_verdict_marks_no_pixel_of_a_conforming_backend(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.shows(0, 0, (51, 51, 51))
        found = watched.session.verdict()
    assert found["text"].startswith("numpy: 0 of 32 pixels are outside")
    assert not np.asarray(Image.open(BytesIO(b64decode(found["mask"])))).any()


def test_a_pass_shows_its_kernel_and_the_code_of_each_backend(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.shows(0, 0, (51, 51, 51))
        plan = watched.session.profile()
        assert plan["passes"] == ["tint"]
        found = watched.session.code("tint")
        assert watched.session.code("no pass")["code"] == {}
    assert "def tint" in found["text"]
    assert found["target"] == "tint"
    for backend, words in {"numpy": "define", "gl": "void main()", "opencl": "__kernel", "webgpu": "fn main("}.items():
        assert words in found["code"][backend]


def test_a_range_of_frames_is_recorded(tmp_path: Path) -> None:
    """As the program makes them one by one, from the first of the range."""
    effect, _ = files(tmp_path)
    for number in range(1, 5):
        pg.save(tmp_path / f"shot.{number:04}.png", np.full((16, 16, 4), 50 * number, np.uint8))
    with Watched(str(effect), str(tmp_path / "shot.%04d.png")) as watched:
        watched.shows(0, 0, (50, 50, 50))
        watched.session.record(1, 3, Fraction(25), tmp_path / "made.gif")
        with pytest.raises(pg.InputError, match=r"expected one of \.mp4"):
            watched.session.record(1, 3, Fraction(25), tmp_path / "made.py")
        with pytest.raises(pg.InputError, match="from 3 to 1"):
            watched.session.record(3, 1, Fraction(25), tmp_path / "made.gif")
    with Image.open(tmp_path / "made.gif") as made:
        levels = []
        for frame in range(made.n_frames):
            made.seek(frame)
            levels.append(made.convert("RGB").getpixel((8, 8))[0])
    assert levels == [100, 150, 200]


@pytest.mark.parametrize("suffix", ["mp4", "mkv", "webm"])
def test_a_range_of_frames_is_recorded_as_a_video(tmp_path: Path, suffix: str) -> None:
    av = pytest.importorskip("av")
    effect, _ = files(tmp_path)
    for number in range(1, 5):
        pg.save(tmp_path / f"shot.{number:04}.png", np.full((32, 48, 4), 50 * number, np.uint8))
    with Watched(str(effect), str(tmp_path / "shot.%04d.png")) as watched:
        watched.shows(0, 0, (50, 50, 50))
        watched.session.record(1, 3, Fraction(25), tmp_path / f"made.{suffix}")
    with av.open(str(tmp_path / f"made.{suffix}")) as made:
        (stream,) = made.streams.video
        levels = [frame.to_ndarray(format="rgb24")[16, 24].astype(int) for frame in made.decode(stream)]
        assert (stream.average_rate, stream.width, stream.height) == (25, 48, 32)
    assert [level.tolist() for level in levels] == [pytest.approx([gray] * 3, abs=3) for gray in (100, 150, 200)]


def test_time_of_what_moves_is_sought_and_recorded(tmp_path: Path) -> None:
    text = """import passgraph as pg
from passgraph.effects.checked import effect

@pg.kernel
def level(n: int) -> pg.vec4:
    return pg.vec4(pg.vec3(float(n) * 0.1), 1.0)

@effect("moves", takes="nothing")
def moves() -> pg.Target:
    \"\"\"Brighter with time.\"\"\"
    return level(pg.FRAME_INDEX, into=pg.target("level", "rgba32f"))
"""
    effect, _ = files(tmp_path, text)
    with Watched(str(effect), size=(16, 16)) as watched:
        assert watched.shows(0, 0, (0, 0, 0)).facts["moves"]
        watched.session.requests.ask(frame=5)
        assert watched.shows(0, 0, (128, 128, 128)).facts["frame"] == 5
        watched.session.requests.ask(steps=1)
        assert watched.shows(0, 0, (153, 153, 153)).facts["frame"] == 6
        assert watched.session.inspect(0, 0)["parameters"] == ["n = 6"]
        watched.session.record(2, 4, Fraction(25), tmp_path / "made.gif")
    with Image.open(tmp_path / "made.gif") as made:
        assert [made.n_frames, made.convert("RGB").getpixel((8, 8))[0]] == [3, 51]


def test_a_picture_is_compared_with(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.session.compare_with(picture)
        watched.session.requests.ask(compare="difference", other="file", gain=2.0, values={"gain": 2.0})
        state = watched.until(lambda one: "difference" in one.pictures)
        assert state.facts["differs"] == {"largest": pytest.approx(0.8), "at": [2, 1], "pixels": 32}
        pg.save(tmp_path / "small.png", np.zeros((2, 2, 3), np.uint8))
        watched.session.compare_with(tmp_path / "small.png")
        assert "is 2x2, and the target is 8x4" in watched.until(lambda one: one.facts["error"]).facts["error"]


def test_a_map_without_its_package_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.session.compare_with(picture)
        watched.session.requests.ask(compare="flip", other="file")
        error = watched.until(lambda one: one.facts["error"]).facts["error"]
        assert "the FLIP map needs flip-evaluator; run: pip install 'passgraph[flip]'" in error
        watched.session.requests.ask(compare="difference", other="file")
        watched.until(lambda one: "difference" in one.pictures and not one.facts["error"])


def test_differences_that_are_seen_are_mapped(tmp_path: Path) -> None:
    pytest.importorskip("flip_evaluator")
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.session.compare_with(picture)
        watched.session.requests.ask(compare="flip", other="file")
        state = watched.until(lambda one: "flip" in one.pictures)
        assert state.facts["flip"] == pytest.approx(0.0, abs=1e-6)
        watched.session.requests.ask(values={"gain": 3.0})
        state = watched.until(lambda one: one.facts.get("flip", 0.0) > 0.0 and one.pictures["flip"][1] == "image/png")
        assert 0.1 < state.facts["flip"] < 1.0
        held = np.asarray(Image.open(BytesIO(state.pictures["flip"][0])))
        assert held.shape == (4, 8, 3)
        assert held.max() > 128


def test_a_color_is_moved_without_compiling(tmp_path: Path) -> None:
    text = """import passgraph as pg
from passgraph.effects.checked import effect

@pg.kernel
def tint(color: pg.Image, by: pg.vec3) -> pg.vec4:
    return pg.vec4(color[0, 0].rgb * by, 1.0)

@effect("tinted")
def tinted(frame: pg.Target, by: tuple[float, float, float] | pg.Value = (1.0, 1.0, 1.0)) -> pg.Target:
    \"\"\"Colored light.\"\"\"
    return tint(frame, by=by)
"""
    effect, picture = files(tmp_path, text)
    with Watched(str(effect), str(picture)) as watched:
        watched.shows(0, 0, (51, 51, 51))
        program = watched.programs()["a"].program
        watched.session.requests.ask(values={"by": [2.0, 1.0, 0.0]})
        watched.shows(0, 0, (102, 51, 0))
        assert watched.programs()["a"].program is program


def test_two_backends_are_compared(tmp_path: Path) -> None:
    effect, picture = files(tmp_path, KERNEL.replace("* gain", "* gain / 3.0"))
    with Watched(str(effect), str(picture)) as watched:
        watched.session.requests.ask(compare="difference", other="reference", gain=4096.0)
        state = watched.until(lambda one: "difference" in one.pictures)
        assert state.facts["differs"]["largest"] < 1e-6
        watched.session.requests.ask(compare="both")
        assert set(watched.until(lambda one: "b" in one.pictures).pictures) == {"a", "b"}


def test_history_goes_on_by_steps_and_begins_anew(tmp_path: Path) -> None:
    text = """import passgraph as pg
from passgraph.effects.checked import effect

@pg.kernel
def add(color: pg.Image, before: pg.Image) -> pg.vec4:
    return pg.vec4(before[0, 0].rgb + 0.2, 1.0)

@effect("count")
def count(frame: pg.Target) -> pg.Target:
    \"\"\"Brighter with each frame.\"\"\"
    into = pg.target("sum", "rgba32f", like=frame)
    return add(frame, pg.previous(into), into=into)
"""
    effect, picture = files(tmp_path, text)
    with Watched(str(effect), str(picture)) as watched:
        watched.shows(0, 0, (51, 51, 51))
        watched.session.requests.ask(steps=1)
        watched.shows(0, 0, (102, 102, 102))
        effect.write_text(text.replace("0.2", "0.4"))  # history stays when the file is saved
        watched.shows(0, 0, (204, 204, 204))
        watched.session.requests.ask(target="frame")  # and while another target is looked at
        watched.until(lambda one: one.pictures and one.facts["target"] == "frame")
        watched.session.requests.ask(target="sum")
        watched.shows(0, 0, (255, 255, 255))
        watched.session.requests.ask(restarts=1)
        watched.shows(0, 0, (102, 102, 102))


def test_frames_of_a_sequence_are_played_and_sought(tmp_path: Path) -> None:
    effect, _ = files(tmp_path)
    for number in range(1, 4):
        pg.save(tmp_path / f"shot.{number:04}.png", np.full((4, 8, 4), 50 * number, np.uint8))
    with Watched(str(effect), str(tmp_path / "shot.%04d.png")) as watched:
        assert watched.shows(0, 0, (50, 50, 50)).facts["frames"] == 3
        watched.session.requests.ask(frame=2)
        watched.shows(0, 0, (150, 150, 150))
        watched.session.requests.ask(playing=True)
        numbers = []
        while set(numbers) != {0, 1, 2}:
            numbers.append(watched.until(lambda one: one.pictures).facts["frame"])
            watched.session.requests.ready()
        # A frame is sent again where it is sent exactly, and none is left out.
        assert {(after - before) % 3 for before, after in pairwise(numbers)} <= {0, 1}


def test_another_input_takes_the_place_of_the_first(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    other = tmp_path / "other.png"
    pg.save(other, np.full((6, 5, 3), 7, np.uint8))
    with Watched(str(effect), str(picture)) as watched:
        watched.shows(0, 0, (51, 51, 51))
        watched.session.replace_input(other)
        assert watched.shows(0, 0, (7, 7, 7)).facts["size"] == [5, 6]
        with pytest.raises(pg.InputError):
            watched.session.replace_input(tmp_path / "none.png")


def test_an_input_that_is_dropped_while_a_program_is_made_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tint = pg.kernel(source="def tint(color: Image) -> vec4: return color[0, 0]")
    subject = GivenSubject(tint, {"color": np.full((4, 8, 4), 51, np.uint8)}, None)
    other = tmp_path / "other.png"
    pg.save(other, np.full((6, 5, 4), 7, np.uint8))
    draw, waits = GivenSubject._kernel, threading.Event()
    drawn, goes_on = threading.Event(), threading.Event()

    def draw_and_wait(*arguments: Any) -> Any:
        made = draw(*arguments)
        if waits.is_set():
            drawn.set()
            assert goes_on.wait(60)
        return made

    monkeypatch.setattr(GivenSubject, "_kernel", draw_and_wait)
    with Watched(subject=subject) as watched:
        watched.shows(0, 0, (51, 51, 51))
        waits.set()
        watched.session.requests.ask(backend="reference")
        assert drawn.wait(60)
        drop = threading.Thread(target=watched.session.replace_input, args=[other])
        drop.start()
        drop.join(0.5)  # it may wait until the program is made
        goes_on.set()
        watched.until(lambda state: state.pictures and state.facts["size"] == [5, 6])
        assert tuple(watched.session.picture("shown")[0, 0, :3]) == (7, 7, 7)
        drop.join()


def test_a_file_that_is_being_written_is_no_error(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.shows(0, 0, (51, 51, 51))
        effect.write_text("")
        sleep(4 * POLL_S)
        watched.session.requests.ask(values={"gain": 2.0})
        assert watched.until(lambda one: one.pictures or one.facts["error"]).facts["error"] == ""
        watched.shows(0, 0, (102, 102, 102))
        effect.write_text(KERNEL.replace("* gain", "* gain * 0.5"))
        watched.shows(0, 0, (51, 51, 51))


def test_questions_are_answered_of_the_last_good_picture_while_the_file_has_an_error(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.shows(0, 0, (51, 51, 51))
        effect.write_text(KERNEL.replace("* gain", "* gian"))
        watched.until(lambda one: one.facts["error"])
        assert watched.session.inspect(2, 1)["parameters"] == ["gain = 1"]
        watched.session.record(0, 1, Fraction(25), tmp_path / "made.gif")
        watched.session.requests.ask(values={"gain": 2.0})
        state = watched.until(lambda one: one.facts["error"])
        assert [control["name"] for control in state.facts["controls"]] == ["gain"]


def test_a_still_is_exact_in_the_end(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        state = watched.until(lambda one: one.pictures and one.pictures["a"][1] == "image/png")
        held = np.asarray(Image.open(BytesIO(state.pictures["a"][0])))
        assert held[1, 2].tolist() == [0, 102, 204]


def test_a_scene_is_looked_at_from_elsewhere() -> None:
    with Watched("soft-shadow", size=(48, 32)) as watched:
        first = watched.until(lambda one: one.pictures)
        assert first.facts["camera"] is True
        before = watched.session.picture("shown").copy()
        watched.session.requests.ask(orbit=(0.5, 0.1, 1.0))
        watched.until(lambda one: one.pictures and not np.array_equal(watched.session.picture("shown"), before))


def test_an_effect_gets_the_camera_of_the_picture_before(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    effect.write_text("""
import passgraph as pg
from passgraph.effects import effect
@effect("way")
def way(frame: pg.Target) -> pg.Target:
    filled = pg.kernel(source="def filled(c: Image, by: float) -> vec4: return vec4(by, 0.0, 0.0, 1.0)")
    now = pg.Value("camera", pg.Camera, default=pg.Camera((0, 0, 5), (0, 0, 0)))
    way = pg.combine(lambda a, b: 0.2 * abs(a.eye[0] - b.eye[0]), now, pg.Value("previous_camera", pg.Camera))
    return filled(frame, way)
""")
    with Watched(str(effect), str(picture)) as watched:
        watched.shows(0, 0, (0, 0, 0))
        watched.session.requests.ask(orbit=(0.5, 0.0, 1.0))
        watched.shows(0, 0, (round(255.0 * np.sin(0.5)), 0, 0))
        watched.session.requests.ask(orbit=(0.5, 0.0, 1.0))
        watched.shows(0, 0, (0, 0, 0))


# Looks

TEXELS = np.array([[[0.5, 0.25, 2.0, 0.1], [np.nan, 0, 0, 1], [np.inf, 0, 0, 1], [-1, 0.5, 0.5, 1]]], np.float32)


@pytest.mark.parametrize("backend", ["reference", "numpy", "gl", "opencl"])
def test_a_look_shows_what_it_says(backend: str) -> None:
    with pg.compile({"shown": shown(pg.Input("frame"))}, backend, non_finite="keep", results="stored") as program:

        def seen(look: Look) -> list[list[int]]:
            return [[int(c) for c in texel[:3]] for texel in program(frame=TEXELS, **look.values())["shown"][0]]

        magenta, cyan = [255, 0, 255], [0, 255, 255]
        assert seen(Look()) == [[128, 64, 255], magenta, cyan, [0, 128, 128]]
        assert seen(Look("alpha"))[0] == [26, 26, 26]
        assert seen(Look("blue", exposure=-1.0))[0] == [255, 255, 255]
        assert seen(Look("red", low=-1.0, high=1.0))[3] == [0, 0, 0]
        assert seen(Look(srgb=True))[0] == [188, 137, 255]
        assert seen(Look(mark=False))[1] != magenta


def test_false_color_grows_lighter() -> None:
    ramp = np.repeat(np.linspace(0, 1, 64, dtype=np.float32)[None, :, None], 4, 2)
    with pg.compile({"shown": shown(pg.Input("frame"))}, "numpy", results="stored") as program:
        colors = program(frame=ramp, **Look("false color").values())["shown"][0].astype(float)
    lightness = colors[:, :3] @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(lightness) >= -1).all()
    assert lightness[-1] - lightness[0] > 120
    assert len(CHANNELS) == 7


def test_every_content_of_a_target_has_a_name() -> None:
    once = pg.kernel(source="def once(color: Image) -> vec4: return color[0, 0]")
    first = once(pg.Input("frame"), into=pg.target("a", "rgba32f"))
    second = once(first, into=pg.target("a", "rgba32f"))
    assert list(targets_of({"out": second})) == ["a", "a (2)", "frame"]


# pg.view

FRAME = np.full((4, 8, 4), 0.25, np.float32)


@pytest.mark.parametrize("kind", ["effect", "kernel", "targets", "program"])
def test_what_a_script_has_is_shown(kind: str) -> None:
    from passgraph.effects import tone_map

    scaled = pg.kernel(source="def scaled(color: Image, gain: float = 2.0) -> vec4: return color[0, 0] * gain")
    target = scaled(pg.Input("color"), gain=pg.Value("gain", default=2.0))
    with pg.compile(target, "numpy") as program:
        subject = {
            "effect": GivenSubject(tone_map, {"frame": FRAME}, None),
            "kernel": GivenSubject(scaled, {"color": FRAME}, None),
            "targets": GivenSubject(target, {"color": FRAME}, None),
            "program": GivenSubject(program, {"color": FRAME}, None),
        }[kind]
        states: queue.Queue[Published] = queue.Queue()
        session = Session(subject, "numpy", states.put)
        session.start()
        try:
            state = states.get(timeout=60)
            assert state.facts["error"] == ""
            assert state.facts["size"] == [8, 4]
            if kind != "effect":
                session.requests.ask(values={"gain": 4.0})
                while session.picture("shown")[0, 0, 0] != 255:
                    states.get(timeout=60)
        finally:
            session.close()


def test_what_cannot_be_shown_is_told() -> None:
    with pytest.raises(pg.InputError, match=r"pg\.view shows"):
        pg.view(3)


def test_an_input_that_an_effect_does_not_take_is_told() -> None:
    from passgraph.effects import vignette

    with pytest.raises(pg.InputError, match="vignette has no parameter 'frame'; it takes color, "):
        pg.view(vignette, frame=FRAME)


def test_a_value_that_is_put_back_has_its_default_after_a_reload_too(tmp_path: Path) -> None:
    effect, picture = files(tmp_path)
    with Watched(str(effect), str(picture)) as watched:
        watched.session.requests.ask(values={"gain": 2.0})
        watched.shows(0, 0, (102, 102, 102))
        effect.write_text(KERNEL.replace("* gain", "* gain * 0.5"))
        watched.shows(0, 0, (51, 51, 51))
        watched.session.requests.ask(values={})
        watched.shows(0, 0, (26, 26, 26))


def test_color_that_nobody_sees_has_no_part_in_a_blur(tmp_path: Path) -> None:
    """As `apply` does it: opaque blue beside transparent red stays blue."""
    pixels = np.zeros((4, 8, 4), np.uint8)
    pixels[:, :4] = (0, 0, 255, 255)
    pixels[:, 4:] = (255, 0, 0, 0)
    pg.save(tmp_path / "cut.png", pixels)
    with Watched("gaussian-blur", str(tmp_path / "cut.png")) as watched:
        watched.until(lambda one: one.pictures)
        assert watched.session.picture("shown")[:, :4, 0].max() == 0


def test_a_pixel_that_is_nan_on_one_backend_alone_differs() -> None:
    one, other = (pg.Result({"values": np.full((2, 3, 4), 0.5, np.float32)}) for _ in range(2))
    one["values"][1, 2, 0] = np.nan
    other["values"][0, 1, 3] = 0.75
    found = Difference.of(one, other)
    assert found.facts() == {"largest": 0.25, "at": [1, 0], "pixels": 2}
    assert found.picture(1.0)[1, 2].tolist() == [255, 0, 255, 255]
    assert found.picture(1.0)[0, 1].tolist() == [63, 63, 63, 255]
