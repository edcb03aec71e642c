"""Graphs in files: the same bits without the code that made them, and what is no graph."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.effects import soft_shadow
from passgraph.errors import GraphError, InputError
from passgraph.serialize import graph_file
from tests.conftest import require

dim = pg.kernel(source="def dim(color: Image, by: float) -> vec4: return color[0, 0] * by")
SIZE = (48, 32)


@pytest.mark.parametrize("backend", ["numpy", "gl"])
def test_a_scene_seen_by_one_camera_has_the_same_bits(backend: str, tmp_path: Path) -> None:
    require(backend)
    scene = pg.Scene.shipped()
    picture = soft_shadow(scene, ambient=0.2)
    constants = {"camera": scene.camera, "light": scene.lights[0], "output_size": SIZE}
    pg.save_graph(tmp_path / "shadow.json", picture, **constants)
    results = []
    for outputs in (picture, pg.load_graph(tmp_path / "shadow.json")):
        with pg.compile(outputs, backend=backend, size=SIZE) as program:
            results.append(next(iter(program().values())))
    assert results[0].std() > 0.05
    assert np.array_equal(*results)


def test_the_command_writes_a_graph_whose_values_move(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "sepia.json"
    assert run(["export", "sepia", "--graph", str(file)]) == 0
    assert "1 passes; run it with" in capsys.readouterr().out
    frame = np.full((2, 2, 4), 200, np.uint8)
    with pg.compile(pg.load_graph(file)) as program:
        assert np.array_equal(program(frame=frame, amount=0.0)["sepia"], frame / np.float32(255))
        assert program(frame=frame)["sepia"][0, 0, 0] > program(frame=frame)["sepia"][0, 0, 2]


def test_the_command_makes_the_values_of_a_scene_constants(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "shadow.json"
    assert run(["export", "soft-shadow", "--graph", str(file), "--size", "48x32"]) == 0
    assert "constant in this file:" in capsys.readouterr().out
    with pg.compile(pg.load_graph(file), size=SIZE) as program:
        assert next(iter(program().values())).shape == (32, 48, 4)


def test_a_command_without_a_place_to_write_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", "sepia"]) == 2
    assert "--web DIR for a page, or --graph FILE.json" in capsys.readouterr().err


def test_an_earlier_file_stays_where_a_graph_cannot_be_written(tmp_path: Path) -> None:
    file = tmp_path / "dim.json"
    pg.save_graph(file, dim(pg.Input("frame"), 0.5))
    before = file.read_bytes()
    stops = pg.Value("stops")
    with pytest.raises(GraphError, match="give stops as constants"):
        pg.save_graph(file, dim(pg.Input("frame"), stops.map(lambda one: 2.0**one)))
    assert (file.read_bytes(), [path.name for path in tmp_path.iterdir()]) == (before, ["dim.json"])


def test_a_graph_is_not_written_over_a_file_of_another_kind(tmp_path: Path) -> None:
    (tmp_path / "frame.png").write_bytes(b"kept")
    with pytest.raises(InputError, match=r"expected a name that ends in \.json"):
        pg.save_graph(tmp_path / "frame.png", dim(pg.Input("frame"), 0.5))
    assert (tmp_path / "frame.png").read_bytes() == b"kept"


def test_constants_are_those_of_the_graph() -> None:
    by = pg.Value("by")
    picture = dim(pg.Input("frame"), by)
    assert pg.to_data(picture, by=0.25)["passes"][0]["values"] == {"by": 0.25}
    with pytest.raises(InputError, match="no run value 'light' in this graph; it has by"):
        pg.to_data(picture, light=1.0)
    with pytest.raises(InputError, match="parameter 'by' must be float"):
        pg.to_data(picture, by="half")


def test_a_constant_of_another_class_is_an_error() -> None:
    scene = pg.Scene.shipped()
    with pytest.raises(InputError, match="value 'camera' must be a Camera, got int"):
        pg.to_data(soft_shadow(scene), camera=1, light=scene.lights[0], output_size=SIZE)


def test_what_is_no_graph_is_an_error_that_names_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "g.json"
    with pytest.raises(InputError, match=r"g\.json: cannot be read"):
        pg.load_graph(file)
    with pytest.raises(InputError, match="cannot be read"):
        pg.load_graph(tmp_path)
    for content, message in ((b"\xff\xfe{", "JSON"), (b"[" * 100_000, "JSON"), (b"[]", "graph data"), (b"{}", "graph")):
        file.write_bytes(content)
        with pytest.raises(InputError, match=rf"g\.json: .*{message}"):
            pg.load_graph(file)
    monkeypatch.setattr(graph_file, "MAX_BYTES", 64)
    file.write_bytes(b" " * 65)
    with pytest.raises(InputError, match="larger than"):
        pg.load_graph(file)
