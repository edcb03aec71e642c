"""LUT files in one process: edits are seen, and what OpenColorIO does with them is what the page says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import PyOpenColorIO as ocio
import pytest

import passgraph as pg
from passgraph.effects import color_transform
from passgraph.errors import GraphError

FRAME = pg.Input("frame")
CORNERS = [(r, g, b) for b in (0, 1) for g in (0, 1) for r in (0, 1)]


def cube(path: Path, gain: float) -> Path:
    rows = [f"{r * gain} {g * gain} {b * gain}" for r, g, b in CORNERS]
    path.write_text("LUT_3D_SIZE 2\n" + "\n".join(rows) + "\n")
    return path


def white(**named: Any) -> float:
    """What white becomes."""
    with pg.compile(color_transform(FRAME, **named)) as program:
        return float(program(frame=np.ones((1, 1, 4), np.float32))["color_transform"][0, 0, 0])


def test_an_edited_file_is_read_again(tmp_path: Path) -> None:
    """Also edits within one tick of the file system's clock, of one length."""
    file = tmp_path / "look.cube"
    for gain in (0.5, 0.2, 0.8):
        cube(file, gain)
        assert white(file=str(file)) == pytest.approx(gain)


def test_an_edited_file_of_a_config_is_read_again(tmp_path: Path) -> None:
    config = ocio.Config()
    look = ocio.FileTransform(str(cube(tmp_path / "look.cube", 0.5)))
    config.addColorSpace(ocio.ColorSpace(name="light"))
    config.addColorSpace(ocio.ColorSpace(name="graded", fromReference=look))
    config.setRole(ocio.ROLE_SCENE_LINEAR, "light")
    (tmp_path / "config.ocio").write_text(config.serialize())
    named = {"dst": "graded", "config": str(tmp_path / "config.ocio")}
    assert white(**named) == pytest.approx(0.5)
    cube(tmp_path / "look.cube", 0.25)
    assert white(**named) == pytest.approx(0.25)


def test_unchanged_files_stay_in_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file, cleared = cube(tmp_path / "look.cube", 0.5), list[bool]()
    white(file=str(file))
    monkeypatch.setattr(ocio, "ClearAllCaches", lambda: cleared.append(True))
    for _ in range(2):
        white(file=str(file))
    assert cleared == []
    cube(file, 0.25)
    white(file=str(file))
    assert cleared == [True]


def test_a_title_above_a_shaper_and_a_cube_is_named_in_the_error(tmp_path: Path) -> None:
    """Only there: OpenColorIO reads a title above one table, and both tables without it."""
    one, three = "LUT_1D_SIZE 2\n", "LUT_3D_SIZE 2\n"
    ramp, corners = "0 0 0\n1 1 1\n", "\n".join(f"{r} {g} {b}" for r, g, b in CORNERS)
    file = tmp_path / "a.cube"
    for text in (one + three + ramp + corners, 'TITLE "x"\n' + three + corners, 'TITLE "x"\n' + one + ramp):
        file.write_text(text)
        assert white(file=str(file)) == 1.0
    file.write_text('TITLE "x"\n' + one + three + ramp + corners)
    with pytest.raises(GraphError, match=r"only without a title: delete TITLE in .*a\.cube"):
        color_transform(FRAME, file=str(file))
    file.write_text('TITLE "x"\n' + three + "0 0 0\n")
    with pytest.raises(GraphError) as error:
        color_transform(FRAME, file=str(file))
    assert "delete TITLE" not in str(error.value)


@pytest.mark.parametrize("table", ["LUT_1D_SIZE 3\n0 0 0\n0.9 0.9 0.9\n1 1 1\n", "LUT_3D_SIZE 2\n"])
def test_nearest_is_linear(tmp_path: Path, table: str) -> None:
    """As the page says: the value between entries is not one of them, in OpenColorIO and here."""
    products = "\n".join(f"{r * g} {g * b} {b * r}" for r, g, b in CORNERS)
    (tmp_path / "a.cube").write_text(table + products * ("3D" in table))
    picture = np.array([[[0.3, 0.6, 0.9, 1.0]]], np.float32)
    expected = [0.18, 0.54, 0.27] if "3D" in table else [0.54, 0.92, 0.98]
    transform = ocio.FileTransform(str(tmp_path / "a.cube"), interpolation=ocio.INTERP_NEAREST)
    theirs = picture.copy()
    processor = ocio.Config.CreateRaw().getProcessor(transform)
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGBA(theirs)
    with pg.compile(color_transform(FRAME, file=str(tmp_path / "a.cube"), interpolation="nearest")) as program:
        ours = program(frame=picture)["color_transform"]
    for found in (theirs, ours):
        np.testing.assert_allclose(found[0, 0, :3], expected, atol=1e-6)
