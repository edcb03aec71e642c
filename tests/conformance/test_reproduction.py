"""A pass with a planted mistake is written as a folder, and fails there alone: on its driver, without passgraph."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.gl.glsl import GLSL
from passgraph.backends.opencl.opencl_c import OpenCLPrinter
from passgraph.backends.registry import open_backend
from passgraph.backends.webgpu.wgsl import WGSL
from passgraph.commands.entry import run as run_command
from passgraph.formats import FORMATS
from passgraph.scene import Mesh
from passgraph.verify.oracle.pass_bounds import Passes
from passgraph.verify.reproduction import write_reproduction
from tests.conftest import present_devices
from tests.respelling import respelled

#: Sums of floats are wrong by this text.
PLANTED = " + 0.03125"
PRINTERS: dict[str, Any] = {"gl": GLSL, "opencl": OpenCLPrinter, "webgpu": WGSL}
TEXT = """
def mixed(c: Image, d: Image, by: float, n: int) -> {type}:
    return (c[1, 0].{read} * by + d[0, -1].g * 0.25) * 0.5 + float(n) * 0.125
"""


@pytest.fixture(params=PRINTERS)
def device(request: pytest.FixtureRequest) -> str:
    if request.param not in present_devices():
        pytest.skip(f"{request.param} is not here")
    return str(request.param)


@pytest.fixture
def planted(device: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[Backend]:
    text = "({0} + {1}" + PLANTED + ("f" if device == "opencl" else "") + ")"
    respelled(monkeypatch, PRINTERS[device].spelled["float"], "add", text)
    with open_backend(device) as backend:
        yield backend


def passes_of(image: str, other: str, target: str) -> Passes:
    """A pass that reads neighbors of two images beyond the border, and parameters of both kinds."""
    channels = FORMATS[target].channels
    type_, read = ("float", "r") if channels == 1 else (f"vec{channels}", "rgba"[:channels])
    kernel = pg.kernel(source=TEXT.format(type=type_, read=read))
    random = np.random.default_rng(0)

    def picture(name: str) -> Any:
        format_ = FORMATS[name]
        values = random.uniform(0.0, 0.9, (13, 150, format_.channels))
        return (values * (format_.steps or 1)).astype(format_.number)

    out = kernel(pg.Input("c", image), pg.Input("d", other).border("mirror"), 0.3, 2, into=pg.target("out", target))
    return Passes({"out": out}, None, [{"c": picture(image), "d": picture(other)}])


def repeated(folder: Path, tmp_path: Path) -> tuple[int, str]:
    """Run the program of a folder, where passgraph cannot be imported."""
    away = tmp_path / "away"
    away.mkdir(exist_ok=True)
    (away / "passgraph.py").write_text("raise ImportError('there is no passgraph here')")
    done = subprocess.run(
        [sys.executable, "-W", "ignore", folder / "reproduce.py"], cwd=away, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(away)}, check=False, timeout=120,
    )  # fmt: skip
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode, done.stdout


@pytest.mark.parametrize(
    ("image", "other", "target"),
    [
        ("rgba8", "rg16", "rgba32f"), ("rgb32f", "rg16f", "rgb16f"), ("rgba8_srgb", "rgba16", "rgba8_srgb"),
        ("rgba16f", "rg8", "rg16"), ("rgb16", "rgb8", "r32f"),
    ],
)  # fmt: skip
def test_a_wrong_pass_fails_alone_and_a_right_one_does_not(
    device: str, planted: Backend, tmp_path: Path, image: str, other: str, target: str
) -> None:
    folder = tmp_path / "found"
    assert write_reproduction(passes_of(image, other, target), planted, folder) == ""
    case = json.loads((folder / "case.json").read_text())
    assert case["device"] == vars(planted.device_info())
    status, out = repeated(folder, tmp_path)
    assert status == 1
    lines = out.splitlines()
    assert lines[0].startswith(f"device: {case['device']['name']}")
    # The program got what the backend got, to the last digit that is printed.
    got = next(line for line in (folder / "README.txt").read_text().splitlines() if line.startswith("got: "))
    assert f"got {got.split()[1]}, allowed " in lines[1]
    (source,) = (path for path in folder.iterdir() if path.name in ("pass.frag", "pass.cl", "pass.wgsl"))
    text = source.read_text()
    assert PLANTED in text
    source.write_text(text.replace(PLANTED + "f", "").replace(PLANTED, ""))
    status, out = repeated(folder, tmp_path)
    count = 13 * 150 * FORMATS[target].channels
    assert (status, out.splitlines()[2]) == (0, f"0 of {count} values are outside of what is allowed")


DRAWN = """
class Corner:
    position: vec4
    color: vec4

def place(vertex: Vertex, shift: vec3, more: Image) -> Corner:
    return Corner(vec4(vertex.position + shift, 1.0), vertex.color * (1.0 - more.texel(ivec2(3, 4)).r))

def paint(corner: Corner, picture: Image, by: float) -> vec4:
    return corner.color * by + picture.texel(ivec2(5, 6)) * 0.25
"""
TRIANGLES = Mesh.make(
    positions=[[-1, -1, 0], [0.9, -1, 0.5], [-1, 0.7, 0.25], [1, 1, 0.1], [-0.8, 0.9, 0.6], [0.5, -0.9, 0.2]],
    triangles=[[0, 1, 2], [3, 4, 5]], colors=np.linspace(0.1, 0.6, 24).reshape(6, 4),
)  # fmt: skip


def drawing(format_: str, depth: str | None, **state: Any) -> Passes:
    """A draw over a picture that is there, of two triangles in front of each other, that reads two images."""
    place, paint = pg.vertex(source=DRAWN, name="place"), pg.fragment(source=DRAWN, name="paint")
    random, channels = np.random.default_rng(0), FORMATS[format_].channels
    fill = pg.kernel(source="def fill(c: Image) -> vec4: return c[0, 0]") if channels == 4 else pg.kernel(
        source="def fill(c: Image) -> vec3: return c[0, 0].rgb")  # fmt: skip
    under = fill(pg.Input("under", "rgba32f"), into=pg.target("under_it", format_))
    if depth is not None:
        state |= {"depth": pg.target("depth", depth)}
    drawn = pg.draw(
        TRIANGLES, vertex=place, fragment=paint, into=under, shift=(0.1, 0.0, 0.1),
        more=pg.Input("more", "r16f"), picture=pg.Input("picture", "rgba8"), by=0.5, **state,
    )  # fmt: skip
    pictures = {"under": random.uniform(0, 0.3, (23, 37, 4)), "more": random.uniform(0, 0.1, (23, 37, 1)),
                "picture": random.uniform(0, 1, (23, 37, 4))}  # fmt: skip
    return Passes({"out": drawn}, (37, 23), [{name: a.astype(np.float32) for name, a in pictures.items()}])


@pytest.mark.gl
@pytest.mark.parametrize(
    ("format_", "depth", "state"),
    [
        ("rgba16f", None, {}), ("rgba8", "depth32f", {"blend": "add", "cull": "back"}),
        ("rgba32f", "depth32f", {"polygon_offset": (1.0, 4.0), "depth_compare": "less_equal"}),
    ],
)  # fmt: skip
def test_a_wrong_draw_fails_alone_and_a_right_one_does_not(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, format_: str, depth: str | None, state: dict[str, Any]
) -> None:
    if "gl" not in present_devices():
        pytest.skip("gl is not here")
    respelled(monkeypatch, GLSL.spelled["float"], "add", "({0} + {1}" + PLANTED + ")")
    folder = tmp_path / "found"
    with open_backend("gl") as backend:
        assert write_reproduction(drawing(format_, depth, **state), backend, folder) == ""
    status, out = repeated(folder, tmp_path)
    assert status == 1
    got = next(line for line in (folder / "README.txt").read_text().splitlines() if line.startswith("got: "))
    assert f"got {got.split()[1]}, allowed " in out.splitlines()[1]
    for source in (folder / "draw.vert", folder / "draw.frag"):
        text = source.read_text()
        assert PLANTED in text
        source.write_text(text.replace(PLANTED, ""))
    status, out = repeated(folder, tmp_path)
    assert (status, out.splitlines()[2].split(" values")[0]) == (0, f"0 of {37 * 23 * 4}")


def test_what_is_within_its_bounds_has_none(device: str, tmp_path: Path) -> None:
    with open_backend(device) as backend:
        why = write_reproduction(passes_of("rgba8", "rg16", "rgba32f"), backend, tmp_path / "found")
    assert why == "no target is outside of its bounds when the graph runs again"
    assert not (tmp_path / "found").exists()


SUM = """
def summed(c: Image, old: Image, by: float) -> vec4:
    return c[0, 0] if by == 0.0 else c[0, 0] + old[0, 0]
"""


def test_a_pass_of_a_later_run_is_found_with_its_history(planted: Backend, tmp_path: Path) -> None:
    """The running sum adds nothing in its first run."""
    half = pg.kernel(source="def half(c: Image) -> vec4: return c[0, 0] * 0.5")
    total = pg.target("total", "rgba32f")
    halves = half(pg.Input("c"), into=pg.target("halves", "rgba32f"))
    out = pg.kernel(source=SUM)(halves, pg.previous(total), pg.Value("by", float), into=total)
    frames = [{"c": np.full((2, 3, 4), k + 1, np.float32), "by": float(k)} for k in range(3)]
    assert write_reproduction(Passes({"out": out}, None, frames), planted, tmp_path / "found") == ""
    assert "pass: total, target total (rgba32f)" in (tmp_path / "found" / "README.txt").read_text()
    status, printed = repeated(tmp_path / "found", tmp_path)
    assert status == 1
    assert "got 1.53125, allowed 1.5" in printed  # half of 1, and half of 2


def test_what_no_program_repeats_is_said(tmp_path: Path) -> None:
    with open_backend("reference") as backend:
        vars(backend)["download"] = lambda storage: type(backend).download(backend, storage) + np.float32(0.25)
        why = write_reproduction(passes_of("rgba8", "rg16", "rgba32f"), backend, tmp_path / "found")
    assert why == "reference does not say what it sends for pass out"


def test_conform_writes_a_folder_for_each_failed_case(
    planted: Backend, device: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    chosen = ["--only", "operations/add", "--only", "operations/sub", "--only", "draw states/cull none, place"]
    assert run_command(["conform", "-b", device, *chosen, "--export-repro", "repro"]) == 1
    out = capsys.readouterr().out
    assert "repro/operations-add: written; run reproduce.py there" in out
    assert sorted(path.name for path in Path("repro").iterdir()) == ["operations-add"]
    assert repeated(Path("repro/operations-add").absolute(), tmp_path)[0] == 1
