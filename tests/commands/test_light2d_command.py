"""Flat worlds and dirt on the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.effects.light2d import Light2D, Mover, Wall, Window, World2D

WORLD: dict[str, Any] = {
    "window": [0, 0, 8, 4],
    "ambient": [0.1, 0.1, 0.1],
    "walls": [{"box": [3, 1, 4, 2]}, {"polygon": [[5, 1], [6, 1], [5.5, 2]]}, {"path": [[1, 3], [2, 3.5]]}],
    "lights": [{"at": [1, 1], "radius": 6, "size": 0.2, "color": [1, 0.5, 0.25]}, {"at": [7, 3], "radius": 3}],
    "movers": [{"at": [2, 2], "half": [0.2, 0.1], "angle_deg": 180}],
}


def written(folder: Path, world: object) -> Path:
    path = folder / "world.json"
    path.write_text(json.dumps(world), encoding="utf-8")
    return path


def test_a_file_says_what_is_in_a_world(tmp_path: Path) -> None:
    world = World2D.load(written(tmp_path, WORLD))
    assert world.window == Window(0, 0, 8, 4)
    assert world.ambient == (0.1, 0.1, 0.1)
    assert world.walls[0] == Wall.box(3, 1, 4, 2)
    assert [wall.closed for wall in world.walls] == [True, True, False]
    assert world.lights == (Light2D((1, 1), (1, 0.5, 0.25), 6, 0.2), Light2D((7, 3), radius=3))
    assert world.movers == (Mover((2, 2), (0.2, 0.1), np.pi),)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"window": [0, 0, 1]}, "window: expected 4 numbers in a list"),
        ({"window": [1, 0, 0, 1]}, "needs left < right"),
        ({"wall": []}, "unknown 'wall'; there are ambient, floor, lights, movers, walls, window"),
        ({"walls": {}}, "walls must be a list of at most 4096, got dict"),
        ({"walls": [{}]}, r"walls\[0\]: needs one of box, polygon, path, got none"),
        ({"walls": [{"box": [0, 0, "a", 1]}]}, r"walls\[0\].box\[2\]: expected a number .* got 'a'"),
        ({"walls": [{"box": [0, 0, 0, 1]}]}, r"walls\[0\].box: needs left < right"),
        ({"walls": [{"path": [[0, 0]]}]}, r"walls\[0\].path: expected a list of 2 to 65536 points"),
        ({"walls": [{"path": [[0, 0], [1, 1]]}] * 4097}, "walls must be a list of at most 4096, got 4097"),
        ({"walls": [{"path": [[0, 0]] * 20000}] * 4}, "more than 65536 corners together"),
        ({"lights": [{"radius": 1}]}, r"lights\[0\]: at is missing"),
        ({"lights": [{"at": [0, 0], "radius": 0}]}, r"lights\[0\]: .*radius must be above 0"),
        ({"lights": [{"at": [0, 0], "color": [1, -1, 1]}]}, r"lights\[0\].color: must be 0 or more"),
        ({"lights": [{"at": [0, 10**400]}]}, r"lights\[0\].at\[1\]: expected a number"),
        ({"lights": [{"at": [0, True]}]}, r"lights\[0\].at\[1\]: expected a number"),
        ({"movers": [{"at": [0, 0], "half": [0, 1]}]}, r"movers\[0\].half: must be above 0"),
        ({"floor": 3}, "floor: expected 3 numbers"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(pg.InputError, match=message):
        World2D.load(written(tmp_path, {**WORLD, **change}))


@pytest.mark.parametrize("text", ["", "{", "[" * 200_000, '{"window": [0, 0, NaN, 1]}', "[1]"])
def test_what_is_no_world_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "world.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(pg.InputError, match=r"world\.json: "):
        World2D.load(path)
    path.write_bytes(b" " * ((4 << 20) + 1))
    with pytest.raises(pg.InputError, match="expected at most"):
        World2D.load(path)


def test_render_draws_a_world(tmp_path: Path, backend_name: str, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = written(tmp_path, WORLD), tmp_path / "out.npy"
    arguments = ["render", str(path), "-e", "light2d", "--size", "64x32", "-b", backend_name, "-o", str(out)]
    assert run([*arguments, "--no-display", "--rims", "0"]) == 0
    assert "64x32" in capsys.readouterr().out
    picture = np.load(out)
    # beside the lamp, in the shadow of the box, and inside it
    assert picture[24, 10, 0] > 0.4
    np.testing.assert_allclose(picture[20, 28, :3] / 0.1, World2D(Window(0, 0, 1, 1)).floor, rtol=0.13)
    assert picture[24, 10, 0] > 1.7 * picture[24, 10, 1]


def test_render_has_a_world_of_its_own(tmp_path: Path) -> None:
    out = tmp_path / "out.png"
    assert run(["render", "-e", "light2d", "--size", "64x36", "--lens", "map", "-o", str(out)]) == 0
    assert pg.load(out).shape == (36, 64, 4)


def test_apply_takes_dirt_of_ones_own(tmp_path: Path) -> None:
    frame, dirt, out = (str(tmp_path / name) for name in ("frame.npy", "dirt.npy", "out.npy"))
    np.save(frame, np.full((8, 12, 4), 0.5, np.float32))
    np.save(dirt, np.full((4, 6, 4), 0.25, np.float32))
    assert run(["apply", "dirty-lens", frame, "-o", out, "--dirt", dirt, "--strength", "2"]) == 0
    np.testing.assert_allclose(np.load(out)[:, :, :3], 0.5 * (1 + 2 * 0.25), atol=1e-3)
    assert run(["apply", "dirty-lens", frame, "-o", out]) == 0
    assert np.load(out)[:, :, :3].min() >= 0.5
