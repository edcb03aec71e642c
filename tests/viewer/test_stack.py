"""`passgraph view` of several effects, and with parameters from the command line."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.view import EffectSubject
from passgraph.viewer.subject import Control
from tests.commands.told import Outcome, refused
from tests.viewer.subjects import Watched
from tests.viewer.test_page import CHROMIUM, opened

CHAIN = "sepia, pixelate, sepia"


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    pg.save(tmp_path / "photo.png", np.random.default_rng(3).integers(0, 255, (8, 16, 3), np.uint8))
    return tmp_path / "photo.png"


def control(subject: EffectSubject, name: str) -> Control:
    return next(one for one in subject.load().controls if one.name == name)


def made_by(command: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """The picture of a command that the page shows."""
    monkeypatch.chdir(folder)
    program, *words = shlex.split(command)
    assert program == "passgraph"
    assert Outcome(capsys, *words).status == 0
    return pg.load("out.png")


@pytest.mark.parametrize(
    ("order", "begin"),
    [
        ("sepia, pixelate, sepia-2", "passgraph apply 'sepia, pixelate, sepia' "),
        ("pixelate, -sepia, sepia-2", "passgraph apply 'pixelate, sepia' "),
        ("sepia-2, -pixelate, -sepia", "passgraph apply sepia "),
        ("-sepia, sepia-2, -pixelate", "passgraph apply sepia "),
    ],
)
def test_a_chain_is_reordered_and_switched_and_its_command_makes_the_picture(
    order: str, begin: str, photo: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    subject = EffectSubject(CHAIN, [str(photo)], (16, 8), None)
    assert control(subject, "order").choices == ("sepia", "pixelate", "sepia-2")
    values = {"order": order, "pixelate_size_px": 4, "sepia_2_amount": 0.5}
    loaded = subject.load()
    drawing = loaded.draw({**{one.name: one.default for one in loaded.controls}, **values})
    with pg.compile(drawing.outputs, size=drawing.size) as program:
        shown = next(iter(program(**drawing.run_inputs).values()))[..., :3].clip(0, 1)
    assert subject.command(values).startswith(begin)
    assert "--order" not in subject.command(values)
    # sepia-2 alone, or as the only one of its name, has the parameters of sepia
    assert ("--amount 0.5" in subject.command(values)) == (begin == "passgraph apply sepia ")
    np.testing.assert_allclose(
        made_by(subject.command(values), photo.parent, monkeypatch, capsys)[..., :3], shown, atol=0.005
    )


def test_a_chain_that_is_off_shows_its_picture(photo: Path) -> None:
    subject = EffectSubject("sepia, pixelate", [str(photo)], (16, 8), None)
    with Watched(subject=subject) as view:
        view.session.requests.ask(values={"order": "-sepia, -pixelate"})
        view.shows(3, 2, tuple((pg.load(photo)[2, 3, :3] * 255).round().astype(int).tolist()))
    assert subject.command({"order": "-sepia, -pixelate"}) == ""


def test_parameters_begin_with_those_of_the_command(photo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    subject = EffectSubject("vignette", [str(photo)], (16, 8), None, None, {"strength": 2.5})
    assert (control(subject, "strength").default, control(subject, "vertical_fov_rad").default) == (2.5, 0.8)
    assert subject.command({}).endswith("-o out.png --strength 2.5")
    assert "--strength" not in subject.command({"strength": 1.0})
    assert "--strength" in refused(capsys, "view", "vignette", str(photo), "--no-open", "--strength", "-1")


def test_a_second_picture_is_the_option_that_it_is_in_apply(
    tmp_path: Path, photo: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fade = tmp_path / "fade.glsl"
    fade.write_text("vec4 transition(vec2 uv) { return mix(getFromColor(uv), getToColor(uv), progress); }")
    white = tmp_path / "white.png"
    pg.save(white, np.full((8, 16, 3), 255, np.uint8))
    named = EffectSubject(str(fade), [str(photo)], (16, 8), None, None, {"to": white, "progress": 1.0})
    after = EffectSubject(str(fade), [str(photo), str(white)], (16, 8), None, None, {"progress": 1.0})
    with Watched(subject=after) as view:
        view.shows(3, 2, (255, 255, 255))
    assert named.command({}) == after.command({})
    assert (made_by(named.command({}), tmp_path, monkeypatch, capsys)[..., :3] == 1.0).all()
    told = refused(capsys, "view", str(fade), str(photo), str(white), str(white), "--no-open")
    assert f"{white}: effect fade reads no further picture" in told


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
def test_the_page_has_a_stack(photo: Path, tmp_path: Path) -> None:
    four = tmp_path / "four.fs"
    four.write_text(
        '/*{"INPUTS": [{"NAME": "corners", "TYPE": "color", "DEFAULT": [0.1, 0.2, 0.3, 1.0]}]}*/\n'
        "void main() { gl_FragColor = corners; }"
    )
    with opened("sepia, pixelate", str(photo), "--pixelate-size-px", "3") as page:
        assert page.locator("#value-pixelate_size_px").input_value() == "3"
        names = page.locator(".stack label")
        assert [text.strip() for text in names.all_inner_texts()] == ["sepia", "pixelate"]
        page.get_by_label("pixelate earlier").focus()
        page.keyboard.press("Enter")
        page.wait_for_function("() => document.querySelector('.stack label').innerText.trim() === 'pixelate'")
        page.get_by_label("sepia", exact=True).uncheck()
        page.locator("#undo").click()
        assert page.get_by_label("sepia", exact=True).is_checked()
    with opened(str(four)) as page:
        side = page.locator("aside").bounding_box()
        for box in page.locator("#control-corners input").all():
            place = box.bounding_box()
            assert place["x"] + place["width"] <= side["x"] + side["width"]
            assert place["width"] > 50
