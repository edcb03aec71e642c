"""Exports without a browser: what a folder holds, what is an error."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.effects import gaussian_blur
from passgraph.effects.effect_table import EFFECTS
from passgraph.errors import InputError
from passgraph.web import export_web

dim = pg.kernel(source="def dim(color: Image, by: float) -> vec4: return color[0, 0] * by")


def document(folder: Path) -> Any:
    return json.loads((folder / "effect.json").read_text())


def test_a_value_that_python_computes_is_an_error_that_names_it(tmp_path: Path) -> None:
    stops = pg.Value("stops", default=0.0)
    with pytest.raises(InputError, match=r"'by' is computed by a Python function from the value 'stops'"):
        export_web(dim(pg.Input("frame"), stops.map(lambda one: 2.0**one)), tmp_path)
    written = export_web(dim(pg.Input("frame"), stops.map(lambda one: 2.0**one)), tmp_path, stops=1.0)
    assert (written.values, written.constants) == ((), ("stops",))


def test_a_folder_with_other_files_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("")
    with pytest.raises(InputError, match=r"has other files, such as 'mine.txt'"):
        export_web(dim(pg.Input("frame"), 0.5), tmp_path)


def test_an_unknown_value_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no input or value 'light'"):
        export_web(dim(pg.Input("frame"), 0.5), tmp_path, light=1.0)


def test_sizes_are_rules(tmp_path: Path) -> None:
    half = dim(pg.Input("frame"), 0.5, into=pg.target("full"))
    small = pg.kernel(source="def small(color: Image) -> vec4: return color.sample(uv())")(
        half, into=pg.target("small", scale=0.5)
    )
    assert export_web(small, tmp_path, size=(31, 20)).resizable
    rules = {one["name"]: one["rule"] for one in document(tmp_path)["resources"]}
    assert rules["full"] == {"input": "frame"}
    assert rules["small"] == {"of": {"output": True}, "scale": [0.5, 0.5]}


def test_the_page_asks_no_other_host() -> None:
    folder = Path(export_web.__code__.co_filename).parent / "page"
    for path in folder.iterdir():
        assert re.findall(r"https?:", path.read_text()) == [], path.name
    assert "default-src 'none'" in (folder / "index.html").read_text()


def test_every_export_is_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "other"):
        export_web(gaussian_blur(pg.Input("frame")), tmp_path / name, size=(64, 48))
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "other" / path.name).read_bytes(), path.name


@pytest.mark.parametrize(("math", "native"), [("exact", False), ("native", True)])
def test_the_command_takes_the_functions_of_the_browsers_device(math: str, native: bool, tmp_path: Path) -> None:
    folder = tmp_path / "page"
    assert run(["export", "vignette", "--web", str(folder), "--math", math]) == 0
    code = (folder / "effect.json").read_text()
    assert bool(re.search(r"\b(pow|exp2|cos)\(", code)) == native


def test_the_command_says_what_the_page_sets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", "vignette", "--web", str(tmp_path / "out"), "--size", "64x48", "--strength", "0.25"]) == 0
    said = capsys.readouterr().out
    assert "the page sets strength" in said
    assert "constant in this export: vertical_fov_rad" in said
    [strength] = document(tmp_path / "out")["parameters"]
    assert (strength["default"], strength["low"]) == (0.25, 0.0)


def test_the_command_exports_kernels_and_shaders(tmp_path: Path) -> None:
    kernel = tmp_path / "dim.txt"
    kernel.write_text("def dim(color: Image, by: float = 0.5, times: int = 2) -> vec4: return color[0, 0] * by * times")
    assert run(["export", str(kernel), "--web", str(tmp_path / "kernel")]) == 0
    assert [(one["name"], one["kind"]) for one in document(tmp_path / "kernel")["parameters"]] == [
        ("by", "float"),
        ("times", "int"),
    ]
    shader = Path(__file__).resolve().parents[2] / "docs" / "shaders" / "reaction-diffusion.fs"
    assert run(["export", str(shader), "--web", str(tmp_path / "shader")]) == 0
    feed = next(one for one in document(tmp_path / "shader")["parameters"] if one["name"] == "feed")
    assert feed["high"] == pytest.approx(0.06)


@pytest.mark.parametrize(("name", "decoded"), [("color-grade", "rgba8_srgb"), ("sepia", "rgba8")])
def test_photographs_are_decoded_for_effects_in_linear_light(name: str, decoded: str, tmp_path: Path) -> None:
    assert run(["export", name, "--web", str(tmp_path / "out"), "--size", "32x24"]) == 0
    [frame] = (one for one in document(tmp_path / "out")["resources"] if one["name"] == "frame")
    assert frame["format"] == decoded


def test_an_effect_that_takes_no_such_input_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", "vignette", "a.png", "b.png", "--web", str(tmp_path / "out")]) == 2
    assert "takes 1 INPUT, got 2" in capsys.readouterr().err


def test_a_color_is_one_control_of_three_numbers(tmp_path: Path) -> None:
    assert run(["export", "fog", "--web", str(tmp_path / "out"), "--size", "32x24"]) == 0
    color = next(one for one in document(tmp_path / "out")["parameters"] if one["kind"] == "color")
    assert len(color["default"]) == 3


@pytest.mark.slow
@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_is_exported(name: str, tmp_path: Path) -> None:
    assert run(["export", name, "--web", str(tmp_path / "out"), "--size", "96x64"]) == 0
