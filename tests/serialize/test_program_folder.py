"""`passgraph export --program` and `load_program`: the same bits without the code; untrusted files."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.effects import soft_shadow, vignette
from passgraph.files import program_folder
from passgraph.files.program_folder import FILE, MOST_BYTES, export_program
from passgraph.serialize.reader import MOST_PARTS

FRAME = np.random.default_rng(3).random((6, 8, 4), np.float32)
KERNEL = '''import passgraph as pg
from passgraph import Image, vec4

@pg.kernel
def glow(color: Image, by: float = 0.5) -> vec4:
    """Brighter."""
    return color[0, 0] * (1.0 + by) + color[1, 0] * 0.25
'''


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    dim = pg.kernel(source="def dim(color: Image, by: float) -> vec4: return color[0, 0] * by")
    export_program(dim(pg.Input("frame"), pg.Value("by", default=0.5)), tmp_path / "dim", size=(8, 6))
    return tmp_path / "dim"


@pytest.mark.parametrize("backend", ["numpy", "gl"])
def test_a_file_of_kernels_runs_without_its_code(backend: str, tmp_path: Path) -> None:
    code = tmp_path / "mine.py"
    code.write_text(KERNEL)
    assert run(["export", str(code), "--program", str(tmp_path / "out")]) == 0
    code.unlink()
    with pg.load_program(tmp_path / "out", backend) as program:
        for by in (0.5, 2.0):
            got = next(iter(program(frame=FRAME, by=by).values()))
            right = np.concatenate([FRAME[:, 1:], FRAME[:, -1:]], axis=1)
            assert np.allclose(got, FRAME * (1 + by) + right * 0.25, rtol=1e-3)


@pytest.mark.parametrize("backend", ["numpy", "gl"])
def test_an_effect_gives_the_bits_of_its_export(backend: str, tmp_path: Path) -> None:
    assert run(["export", "vignette", "--as-stored", "--program", str(tmp_path)]) == 0
    with (
        pg.load_program(tmp_path, backend) as there,
        pg.compile(vignette(pg.Input("frame"), strength=0.9), backend) as here,
    ):
        ours, theirs = (
            next(iter(picture.values())) for picture in (here(frame=FRAME), there(frame=FRAME, strength=0.9))
        )
        assert ours.tobytes() == theirs.tobytes()
        assert not np.array_equal(ours, next(iter(there(frame=FRAME).values())))  # its default is another


@pytest.mark.parametrize("backend", ["numpy", "gl"])
def test_a_scene_has_the_camera_and_size_of_its_export(backend: str, tmp_path: Path) -> None:
    outputs = soft_shadow(pg.Scene.shipped(), map_size=256)
    export_program(outputs, tmp_path, size=(64, 36))
    with pg.load_program(tmp_path, backend) as there, pg.compile(outputs, backend, (64, 36)) as here:
        ours, theirs = here(), there()
        assert list(ours) == list(theirs)
        for name in ours:
            assert ours[name].tobytes() == theirs[name].tobytes()
    with pytest.raises(pg.InputError, match=r"runs at size \(64, 36\) only, got \(32, 18\)"):
        pg.load_program(tmp_path, backend, (32, 18))


def test_one_folder_has_a_page_and_a_program(tmp_path: Path) -> None:
    for _ in range(2):
        assert run(["export", "vignette", "--size", "8x6", "--web", str(tmp_path), "--program", str(tmp_path)]) == 0
    assert {"effect.json", FILE} <= {path.name for path in tmp_path.iterdir()}


def test_neither_folder_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", "vignette"]) == 2
    assert "expected --web DIR for a page, or --program DIR for Python" in capsys.readouterr().err


def test_a_value_that_is_given_is_a_constant_and_others_are_errors() -> None:
    dim = pg.kernel(source="def dim(color: Image, by: float) -> vec4: return color[0, 0] * by")
    made = dim(pg.Input("frame"), pg.Value("stops").map(lambda stops: 2.0**stops))
    assert pg.to_data(made, stops=-1.0)["passes"][0]["values"] == {"by": 0.5}
    with pytest.raises(pg.GraphError, match="there is no value 'stop' in this graph; it takes stops"):
        pg.to_data(made, stops=1.0, stop=2.0)
    scene = pg.Scene.shipped()
    with pytest.raises(pg.InputError, match="value 'camera' must be a Camera, got int"):
        pg.to_data(soft_shadow(scene), camera=1, light=scene.lights[0], output_size=(48, 32))


def _entry(name: str, value: Any) -> Callable[[dict[str, Any]], None]:
    return lambda document: document.update({name: value})


@pytest.mark.parametrize(
    ("message", "damage"),
    [
        ("is no program; expected what passgraph export --program wrote", _entry("passgraph", "graph")),
        ("version 99; this passgraph reads version 1. Install", _entry("version", 99)),
        ("version True;", _entry("version", True)),
        ("expected the entries", _entry("more", "../../secret")),
        ("expected the entries", lambda document: document.pop("graph")),
        ("size needs a size", _entry("size", "wide")),
        ("size needs a size", _entry("size", [8.5, 6])),
        ("size is 1099511627776x6", _entry("size", [1 << 40, 6])),
        ("resizable", _entry("resizable", 1)),
        ("options: math", _entry("math", ["exact"])),
        ("graph data, the document", _entry("graph", [])),
        ("graph data, passes", lambda document: document["graph"].update(passes=[{"shell": "true"}])),
        ("graph data, version", lambda document: document["graph"].update(version=99)),
    ],
)
def test_a_damaged_file_is_an_error_with_its_name(
    folder: Path, message: str, damage: Callable[[dict[str, Any]], None]
) -> None:
    document = json.loads((folder / FILE).read_text())
    damage(document)
    (folder / FILE).write_text(json.dumps(document))
    with pytest.raises(pg.InputError, match=re.escape(message)) as error:
        pg.load_program(folder)
    assert str(error.value).startswith(str(folder / FILE))


@pytest.mark.parametrize(
    ("message", "content"),
    [
        ("is no JSON", b""),
        ("is no JSON", b'{"passgraph": NaN}'),
        ("is no JSON", b'{"passgraph": "program", "vers'),
        ("is no JSON", b"[" * 200_000),
        ("is no JSON", b'{"version": ' + b"9" * 10_000 + b"}"),
        ("is no JSON", b'{"passgraph": "\xff"}'),
        ("is no JSON", '{"passgraph": "é"}'.encode()),
        ("is no program", b"[]"),
        (f"has more than {2 * MOST_PARTS} parts", b"[" + b"0," * (2 * MOST_PARTS) + b"0]"),
    ],
)
def test_other_files_are_errors(folder: Path, message: str, content: bytes) -> None:
    (folder / FILE).write_bytes(content)
    with pytest.raises(pg.InputError, match=message):
        pg.load_program(folder)


LONG = b"a" * 1024


@pytest.mark.parametrize(
    ("content", "is_read"),
    [
        (b'{"arrays": ["' + LONG + b'", "' + LONG + b'="]}', True),
        (b'{"text": "' + LONG + b'\\ud83d"}', False),
        (b'{"text": "\\ud83d\\"' + LONG + b'"}', False),
        (b'{"text": "\\ud83d\\"' + LONG + b'\\""}', False),
        (b'{"text": "' + LONG.replace(b"aa", b"a ") + b'"}', False),
    ],
)
def test_text_besides_arrays_is_bounded(
    folder: Path, monkeypatch: pytest.MonkeyPatch, content: bytes, is_read: bool
) -> None:
    monkeypatch.setattr(program_folder, "MOST_TEXT", 100)
    (folder / FILE).write_bytes(content)
    told = "is no program" if is_read else r"has \d+ bytes besides its arrays; expected the program .*, at most 100"
    with pytest.raises(pg.InputError, match=told):
        pg.load_program(folder)


def test_missing_huge_and_special_files_are_errors(folder: Path, tmp_path: Path) -> None:
    for missing in (tmp_path / "no", tmp_path):
        with pytest.raises(pg.InputError, match=r"program\.json"):
            pg.load_program(missing)
    with (folder / FILE).open("wb") as file:
        file.truncate(MOST_BYTES + 1)
    with pytest.raises(pg.InputError, match=f"has {MOST_BYTES + 1} bytes; expected at most {MOST_BYTES}"):
        pg.load_program(folder)
    (folder / FILE).unlink()
    os.mkfifo(folder / FILE)
    with pytest.raises(pg.InputError, match="pipe"):
        pg.load_program(folder)


def test_a_path_in_the_data_is_never_read(folder: Path, tmp_path: Path) -> None:
    """The file of a kernel is a name for messages, and a shader's includes are in the document."""
    secret = tmp_path / "secret.py"
    secret.write_text("PASSWORD = 1\n" * 20)
    document = json.loads((folder / FILE).read_text())
    definition = document["graph"]["definitions"][0]
    definition.update(file=str(secret), text="def dim(color: Image, by: float) -> vec4: return colour")
    (folder / FILE).write_text(json.dumps(document))
    with pytest.raises(pg.PassgraphError) as error:
        pg.load_program(folder)
    assert "PASSWORD" not in str(error.value)


def test_memory_is_checked_before_anything_is_allocated(tmp_path: Path) -> None:
    fill = pg.kernel(source="def fill(a: Image) -> vec4: return a[0, 0]")
    large = fill(pg.Input("frame", "rgba32f", (16384, 16384)))
    export_program(large, tmp_path, size=(8, 6))
    with pytest.raises(pg.GraphError, match="memory"):
        pg.load_program(tmp_path, memory="64 MB")
