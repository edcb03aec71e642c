"""Shaders that never read their picture: as large as it all the same, in every frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.commands.entry import run

FILES = {
    "hook.glsl": "//!HOOK MAIN\n//!BIND HOOKED\n//!WIDTH HOOKED.w 2 *\nvec4 hook() { return vec4(0.5); }",
    "isf.fs": '/*{"INPUTS": [{"NAME": "inputImage", "TYPE": "image"}], "PASSES": [{"TARGET": "a", "WIDTH": "$WIDTH/2"},'
    ' {}]}*/\nvoid main() { gl_FragColor = PASSINDEX == 0 ? vec4(0.5) : IMG_NORM_PIXEL(a, vec2(0.5)); }',
    "transition.glsl": "vec4 transition(vec2 uv) { return vec4(progress); }",
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_a_shader_that_never_reads_its_picture_is_as_large_as_that(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(FILES[name])
    effect = pg.load_shader(tmp_path / name)
    graph = effect(pg.Input("frame"), into=pg.target("out", "rgba32f", scale=1.0), **given(name))
    with pg.compile(graph) as program:
        for width, height in ((7, 5), (1, 1)):
            seen = program(frame=np.zeros((height, width, 4), np.float32))["out"]
            assert seen.shape == (height, width * (2 if name == "hook.glsl" else 1), 4)
            np.testing.assert_allclose(seen, 0.5, atol=3e-3)


@pytest.mark.parametrize("name", ["isf.fs", "transition.glsl"])
def test_its_earlier_frames_are_read_by_the_target_that_was_given(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(FILES[name])
    into = pg.target("out", "rgba32f", scale=1.0)
    drawn = pg.load_shader(tmp_path / name)(pg.Input("frame"), into=into, **given(name))
    add = pg.kernel(source="def add(now: Image, before: Image) -> vec4: return now[0, 0] + before[0, 0]")
    with pg.compile(add(drawn, pg.previous(into), into=pg.target("sum", "rgba32f"))) as program:
        sums = [program(frame=np.zeros((2, 3, 4), np.float32))["sum"] for _ in range(2)]
    np.testing.assert_allclose([one[1, 2, 0] for one in sums], [0.5, 1.0], atol=6e-3)


def given(name: str) -> dict[str, float]:
    return {"progress": 0.5} if name == "transition.glsl" else {}


def test_frames_of_a_folder_have_their_size(tmp_path: Path) -> None:
    (tmp_path / "isf.fs").write_text(FILES["isf.fs"])
    for folder in ("in", "out"):
        (tmp_path / folder).mkdir()
    for number in range(2):
        Image.new("RGB", (9, 4)).save(tmp_path / "in" / f"{number}.png")
    assert run(["apply", str(tmp_path / "isf.fs"), str(tmp_path / "in"), "-o", str(tmp_path / "out")]) == 0
    shown = [Image.open(tmp_path / "out" / f"{number}.png") for number in range(2)]
    assert [(one.size, one.convert("RGB").getpixel((8, 3))) for one in shown] == [((9, 4), (128, 128, 128))] * 2
