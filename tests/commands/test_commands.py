"""Every command from end to end, and every way to go wrong: one line, status 2, no partial file."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference import ReferenceBackend
from passgraph.commands.entry import COMMANDS
from passgraph.effects import fxaa, smaa
from passgraph.effects.effect_table import EFFECTS
from passgraph.errors import DeviceMissingError
from passgraph.srgb import linear_to_srgb, srgb_to_linear
from tests.commands.told import Outcome, refused

root = Path(__file__).resolve().parents[2]
SMALL = ["--size", "48x27", "--map-size", "32"]


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Commands run in an empty folder with one picture in it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PASSGRAPH_TRACEBACK", raising=False)
    y, x = np.mgrid[0:20, 0:30] / 32
    pg.save("in.png", np.dstack([x, y, 1 - x, np.ones_like(x)]).astype(np.float32))
    return tmp_path


def well(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    outcome = Outcome(capsys, *arguments)
    assert outcome.status == 0, outcome.err
    assert outcome.err == ""
    return outcome.out


# render


def test_render_writes_the_shipped_scene(capsys: pytest.CaptureFixture[str]) -> None:
    out = well(capsys, "render", *SMALL, "-o", "shadow.png", "-b", "numpy")
    assert out.startswith("shadow.png: 48x27 by numpy; compile ")
    assert ", run " in out
    picture = pg.load("shadow.png")
    assert picture.shape == (27, 48, 4)
    assert picture[..., :3].std() > 0.05


def test_render_to_exr_keeps_what_is_above_one(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("OpenEXR")
    well(capsys, "render", *SMALL, "-o", "hdr.exr", "-b", "numpy", "--ambient", "4")
    well(capsys, "render", *SMALL, "-o", "shown.exr", "-b", "numpy", "--ambient", "4", "--display")
    assert pg.load("hdr.exr").max() > 1.5
    assert pg.load("shown.exr").max() <= 1.0


def test_render_reads_a_scene_file(capsys: pytest.CaptureFixture[str]) -> None:
    Path("box.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    well(capsys, "render", "box.obj", "--effect", "soft-shadow", *SMALL, "-o", "box.png", "-b", "numpy")
    assert pg.load("box.png").shape == (27, 48, 4)


def test_render_captures_every_target(capsys: pytest.CaptureFixture[str]) -> None:
    out = well(capsys, "render", *SMALL, "-o", "shadow.png", "-b", "numpy", "--capture", "steps")
    exact = {path.stem for path in Path("steps").glob("*.npy")}
    assert exact == {path.stem for path in Path("steps").glob("*.png")}
    assert f"{len(exact)} targets in steps" in out
    assert any("shadow_map" in name for name in exact)
    depth = next(path for path in sorted(Path("steps").glob("*.npy")) if path.stem.endswith("-depth"))
    values = np.load(depth)
    assert f"{depth.stem}.png  48x27, black is {values.min():.6g}, white is {values.max():.6g}" in out
    assert pg.load(depth.with_suffix(".png"))[..., 0].max() == 1.0


def test_render_smooths_edges_where_nothing_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    made = {}
    for way in ("default", "fxaa", "smaa", "none"):
        given = [] if way == "default" else ["--antialias", way]
        well(capsys, "render", *SMALL, "-o", f"{way}.png", "-b", "numpy", *given)
        made[way] = pg.load(f"{way}.png")
    assert np.array_equal(made["default"], made["fxaa"])
    for smooth in (fxaa, smaa):
        name = smooth.__name__
        with pg.compile(smooth(pg.Input("frame", "rgba8"))) as program:
            np.testing.assert_array_equal(made[name], program(frame=made["none"])[name])
        assert 0.02 < (made[name] != made["none"]).any(axis=2).mean() < 0.7


@pytest.mark.parametrize("effect", ["soft-shadow", "light2d"])
def test_render_takes_four_samples_a_pixel(effect: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Each pixel is the mean, in linear light, of four of the picture of twice the size."""
    common = ["render", "-e", effect, "-b", "numpy"]
    well(capsys, *common, "--size", "96x54", "--antialias", "none", "-o", "large.png")
    well(capsys, *common, "--size", "48x27", "--antialias", "ssaa4", "-o", "smooth.png")
    light = srgb_to_linear(pg.load("large.png").astype(np.float64)).reshape(27, 2, 48, 2, 4).mean(axis=(1, 3))
    assert np.abs(linear_to_srgb(light) - pg.load("smooth.png"))[..., :3].max() <= 0.51 / 255


def test_render_smooths_hdr_by_samples_only(capsys: pytest.CaptureFixture[str]) -> None:
    common = ["render", "-b", "numpy", "--map-size", "32", "--ambient", "4"]
    well(capsys, *common, "--size", "48x27", "-o", "plain.npy")
    well(capsys, *common, "--size", "48x27", "--antialias", "none", "-o", "none.npy")
    assert np.array_equal(np.load("plain.npy"), np.load("none.npy"))
    well(capsys, *common, "--size", "96x54", "-o", "large.npy")
    well(capsys, *common, "--size", "48x27", "--antialias", "ssaa4", "-o", "smooth.npy")
    mean = np.load("large.npy").reshape(27, 2, 48, 2, 4).mean(axis=(1, 3))
    np.testing.assert_allclose(np.load("smooth.npy"), mean, rtol=1e-3)
    assert "--antialias fxaa smooths pictures for display, and the result is HDR; use --antialias ssaa4" in refused(
        capsys, *common, "--antialias", "fxaa", "-o", "hdr.npy"
    )
    assert "ssaa4 draws 20000x10 at 40000x20, and a side has at most 32768 pixels" in refused(
        capsys, *common, "--antialias", "ssaa4", "--size", "20000x10", "-o", "wide.png"
    )


# apply


def test_apply_black_and_white(capsys: pytest.CaptureFixture[str]) -> None:
    out = well(capsys, "apply", "black-and-white", "in.png", "-o", "gray.png", "--weights", "1", "0", "0")
    assert out.startswith("gray.png: 30x20 by numpy; compile ")
    made = pg.load("gray.png")
    assert np.array_equal(made[..., 0], made[..., 1])
    assert np.abs(made[..., 0] - pg.load("in.png")[..., 0]).max() <= 1 / 255


@pytest.mark.sampled
@pytest.mark.parametrize("name", [n for n, e in EFFECTS.items() if e.takes == "picture"])
@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".webp", ".npy"])
def test_apply_writes_every_format(capsys: pytest.CaptureFixture[str], name: str, suffix: str) -> None:
    well(capsys, "apply", name, "in.png", "-o", f"out{suffix}", "-b", "reference")
    scale = {"fsr1": 2.0, "resize": 0.5}.get(name, 1.0)
    assert pg.load(f"out{suffix}").shape == (20 * scale, 30 * scale, 4)


def test_apply_on_each_backend_gives_one_picture(capsys: pytest.CaptureFixture[str], backend_name: str) -> None:
    for name in ("reference", backend_name):
        well(capsys, "apply", "gaussian-blur", "in.png", "-o", f"{name}.png", "-b", name, "--sigma-px", "1.5")
    assert np.abs(pg.load("reference.png") - pg.load(f"{backend_name}.png")).max() <= 1 / 255 + 1e-6


def test_apply_with_a_depth_picture(capsys: pytest.CaptureFixture[str]) -> None:
    np.save("depth.npy", np.full((20, 30), 3.0, np.float32))
    well(
        capsys,
        "apply",
        "depth-aware-blur",
        "in.png",
        "--depth",
        "depth.npy",
        "-o",
        "out.png",
        "-b",
        "reference",
    )
    np.save("depth.npy", np.full((20, 31), 3.0, np.float32))
    assert "depth.npy: is 31x20 pixels, and in.png is 30x20" in refused(
        capsys, "apply", "depth-aware-blur", "in.png", "--depth", "depth.npy", "-o", "two.png"
    )


def test_a_blur_of_width_zero_copies(capsys: pytest.CaptureFixture[str]) -> None:
    well(capsys, "apply", "gaussian-blur", "in.png", "-o", "out.png", "--sigma-px", "0", "-b", "reference")
    assert np.array_equal(pg.load("out.png"), pg.load("in.png"))


def test_linear_decodes_the_input(capsys: pytest.CaptureFixture[str]) -> None:
    well(capsys, "apply", "black-and-white", "in.png", "-o", "linear.npy", "--linear", "-b", "reference")
    well(capsys, "apply", "black-and-white", "in.png", "-o", "stored.npy", "-b", "reference")
    assert np.load("linear.npy").mean() < np.load("stored.npy").mean() - 0.05


def test_apply_captures(capsys: pytest.CaptureFixture[str]) -> None:
    out = well(capsys, "apply", "gaussian-blur", "in.png", "-o", "out.png", "--capture", "steps", "-b", "reference")
    assert "2 targets in steps (exact values in the npy files):" in out
    assert len(list(Path("steps").iterdir())) == 4


# compare


def test_compare_holds_every_backend_against_the_reference(
    capsys: pytest.CaptureFixture[str], backend_name: str
) -> None:
    out = well(capsys, "compare", "in.png", "--effect", "gaussian-blur", "--sigma-px", "1", "-b", backend_name)
    assert f"{backend_name} against the reference" in out
    assert f"{backend_name}: within bounds" in out
    assert "gaussian_blur_x (rgba32f)" in out


def test_compare_renders_scenes_too(capsys: pytest.CaptureFixture[str]) -> None:
    out = well(capsys, "compare", "--effect", "soft-shadow", "--size", "32x18", "--map-size", "16", "-b", "numpy")
    assert "numpy: within bounds" in out
    assert "picture (rgba8)" in out


class Wrong(ReferenceBackend):
    """Downloads everything a little too bright."""

    name = "wrong"

    def download(self, storage):  # type: ignore[no-untyped-def]
        return super().download(storage) * np.float32(1.01)


def test_compare_ends_with_one_where_a_backend_diverges(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("passgraph.verify.compare.open_backend", lambda name: Wrong())
    outcome = Outcome(capsys, "compare", "in.png", "-e", "black-and-white", "-b", "gl")
    assert outcome.status == 1
    assert "gl: diverges first in pass black_and_white, target black_and_white: outside its bounds at" in outcome.out
    assert "worst at column" in outcome.out


def test_compare_lists_what_is_missing(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def gone(name: str) -> ReferenceBackend:
        raise DeviceMissingError("no OpenGL; run:\n    apt-get install libegl1")

    monkeypatch.setattr("passgraph.verify.compare.open_backend", gone)
    outcome = Outcome(capsys, "compare", "in.png", "-e", "black-and-white")
    assert outcome.status == 1
    assert "gl: missing: no OpenGL; run: apt-get install libegl1" in outcome.out
    assert "no backend is here to be compared; see: passgraph backends" in outcome.out


# backends, plan


def test_backends_lists_all(capsys: pytest.CaptureFixture[str]) -> None:
    out = well(capsys, "backends")
    for name in ("reference", "numpy", "gl", "gles", "opencl", "webgpu", "webgpu:chromium", "null"):
        assert name in out


def test_backends_tells_how_to_install_what_is_missing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from passgraph.backends.base import DeviceInfo

    missing = [DeviceInfo("", "", "", "no driver; run: apt-get install x")]
    monkeypatch.setattr(ReferenceBackend, "devices", classmethod(lambda cls: missing))
    assert "missing: reference: no driver; run: apt-get install x" in well(capsys, "backends")


def test_versions_for_a_report_are_those_of_the_libraries_themselves(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    import json
    import platform
    from importlib.metadata import version

    import llvmlite.binding
    import OpenImageIO

    assert well(capsys, "--version") == f"passgraph, version {pg.__version__}\n"
    lines = well(capsys, "--version", "--verbose").splitlines()
    assert lines[0] == f"passgraph, version {pg.__version__}"
    known = dict(line.partition(": ")[::2] for line in lines[1:])
    assert platform.python_version() in known["python"]
    assert platform.system() in known["system"]
    assert known["numpy"] == np.__version__
    assert known["openimageio"] == OpenImageIO.VERSION_STRING
    assert known["llvmlite"] == version("llvmlite")
    assert "LLVM " + ".".join(map(str, llvmlite.binding.llvm_version_info)) in known["backend numpy"]
    assert "ruff" not in known
    well(capsys, "backends", "--json", str(tmp_path / "here.json"))
    data = json.loads((tmp_path / "here.json").read_text())
    assert [f"backend {name}" for name in data["devices"]] == [name for name in known if name.startswith("backend ")]
    assert data["libraries"] == {name: known[name] for name in data["libraries"]}
    assert data["devices"]["reference"] == [
        {"name": "CPU, float64", "driver": "numpy", "version": np.__version__, "missing": ""}
    ]


def test_the_opencl_driver_is_named_with_its_llvm() -> None:
    from types import SimpleNamespace

    from passgraph.backends.opencl.backend import _driver_text

    pocl = SimpleNamespace(
        name="PoCL", version="OpenCL 3.0 PoCL 6.0  Linux, Release, RELOC, SPIR-V, LLVM 18.1.8, SLEEF"
    )
    intel = SimpleNamespace(name="Intel(R) OpenCL", version="OpenCL 3.0 LINUX")
    assert _driver_text(SimpleNamespace(platform=pocl, driver_version="6.0")) == "PoCL 6.0 (LLVM 18.1.8)"
    assert _driver_text(SimpleNamespace(platform=intel, driver_version="2025.1")) == "Intel(R) OpenCL 2025.1"


def test_the_version_loads_no_driver() -> None:
    code = (
        "import sys; from passgraph.commands.entry import run; run(['--version']); "
        "print([name for name in ('llvmlite', 'OpenImageIO', 'passgraph.environment') if name in sys.modules])"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.splitlines()[1] == "[]"


def test_verbose_alone_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = Outcome(capsys, "--verbose")
    assert outcome.status == 2
    assert "--verbose goes with --version: passgraph --version --verbose" in outcome.err


def test_plan_explains_and_draws(capsys: pytest.CaptureFixture[str]) -> None:
    out = well(capsys, "plan", "--effect", "soft-shadow", "--size", "64x36", "--svg", "plan.svg")
    assert "steps, output 64x36" in out
    assert "memory: " in out
    assert "fused pass " in out
    assert Path("plan.svg").read_text().startswith("<svg ")
    assert "fused pass" not in well(capsys, "plan", "--effect", "soft-shadow", "--off", "fuse")


def test_plan_of_a_picture(capsys: pytest.CaptureFixture[str]) -> None:
    out = well(capsys, "plan", "in.png", "--effect", "gaussian-blur")
    assert "1. gaussian_blur_x: frame → gaussian_blur_x (pixels, 30x20)" in out


# help


@pytest.mark.parametrize(
    "arguments",
    [[], *([name] for name in COMMANDS), *(["apply", n] for n, e in EFFECTS.items() if e.takes.startswith("picture"))],
)
def test_help(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    assert "Usage: passgraph" in well(capsys, *arguments, "--help")


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda effect: effect.name)
def test_help_shows_every_parameter_with_unit_and_range(capsys: pytest.CaptureFixture[str], effect) -> None:  # type: ignore[no-untyped-def]
    commands = [["plan", "--effect", effect.name], ["compare", "-e", effect.name]]
    picture = effect.takes.startswith("picture")
    commands.append(["apply", effect.name] if picture else ["render", "--effect", effect.name])
    for command in commands:
        text = " ".join(well(capsys, *command, "--help").split()).replace("- ", "-")
        for parameter in effect.parameters:
            assert "--" + parameter.name.replace("_", "-") in text
            assert parameter.range.unit in text
            low, high = parameter.range.low, parameter.range.high
            if low is not None and high is not None and parameter.type == "int":
                assert f"{low}<=x<={high}" in text


def test_help_without_an_effect_names_all_of_them(capsys: pytest.CaptureFixture[str]) -> None:
    text = " ".join(well(capsys, "compare", "--help").split()).replace("- ", "-")
    assert "passgraph compare --effect NAME --help shows the parameters of one" in text
    assert [effect.name for effect in EFFECTS.values() if f"{effect.name} {effect.summary}" not in text] == []
    text = " ".join(well(capsys, "render", "--help").split())
    assert "Parameters of soft-shadow" in text and "contact " in text and "tone-map " not in text


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert well(capsys, "--version").startswith("passgraph, version ")


def test_without_a_command_the_help_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = Outcome(capsys)
    assert outcome.status == 2
    assert "Usage: passgraph" in outcome.err


# Errors

BLUR = ["apply", "gaussian-blur", "in.png", "-o", "out.png"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["frobnicate"], "there is no command 'frobnicate'; there are render, apply"),
        (["apply", "blurr", "in.png", "-o", "out.png"], "there is no effect 'blurr'"),
        (["apply", "gausian-blur", "in.png", "-o", "out.png"], "did you mean 'gaussian-blur'?"),
        (["apply", "soft-shadow", "in.png", "-o", "out.png"], "takes a scene; use: passgraph render"),
        (["render", "--effect", "nope", "-o", "out.png"], "there is no effect 'nope'; there are"),
        (["render", "--effect", "tone-map", "-o", "out.png"], "effect 'tone-map' takes a picture"),
        (["render", "-o"], "Option '-o' requires an argument"),
        (["render"], "Missing option '--output' / '-o'"),
        (["render", "-o", "out.png", "--effect"], "Option '--effect' requires an argument"),
        (["render", "--size", "0x5", "-o", "out.png"], "each side must be 1 to 32768 pixels"),
        (["render", "--size", "99999x5", "-o", "out.png"], "each side must be 1 to 32768 pixels"),
        (["render", "--size", "9" * 5000 + "x5", "-o", "out.png"], "each side must be 1 to 32768 pixels"),
        (["render", "--size", "12", "-o", "out.png"], "is not a size; write width x height in pixels"),
        (["render", "--size", "-3x4", "-o", "out.png"], "is not a size"),
        (["render", "--size", "1.5x4", "-o", "out.png"], "is not a size"),
        (["render", "nope.glb", "-o", "out.png"], "nope.glb: no such file"),
        (["render", "in.png", "-o", "out.png"], "in.png"),
        (["render", "-b", "vulkan", "-o", "out.png"], "there is no backend 'vulkan'"),
        (["render", "-o", "out.abc"], "unknown suffix '.abc'; expected one of .png"),
        (["render", "-o", "out"], "unknown suffix ''"),
        (["render", "-o", "folder/out.png"], "does not exist; make it first"),
        (["render", "-o", "out.png", "--capture", "a/b"], "a/b: cannot be made a folder"),
        (["render", "-o", "out.png", "--capture", "in.png"], "in.png: cannot be made a folder"),
        (["render", "-o", "out.png", "--map-size", "7"], "7 is not in the range 16<=x<=8192"),
        (["render", "-o", "out.png", "--map-size", "7.5"], "'7.5' is not a valid integer"),
        (["render", "-o", "out.png", "--softness", "nan"], "nan is not a finite number"),
        (["render", "-o", "out.png", "--background", "1", "2"], "Option '--background' requires 3 arguments"),
        (["render", "-o", "out.png", "--curve", "wiggly"], "'wiggly' is not one of 'linear', 'reinhard'"),
        (["render", "-o", "out.png", "--sigma-px", "3"], "No such option '--sigma-px'"),
        (["apply", "gaussian-blur", "nope.png", "-o", "out.png"], "nope.png: no such file"),
        (["apply", "gaussian-blur", ".", "-o", "out.png"], "is a directory; expected a picture file"),
        ([*BLUR, "--sigma-px", "-1"], "-1.0 is not in the range 0.0<=x<=100.0"),
        ([*BLUR, "--sigma-px", "inf"], "inf is not in the range"),
        ([*BLUR, "--sigma-px", "wide"], "'wide' is not a valid float"),
        (["apply", "fog", "--fog-color", "1,0,0", "in.png", "-o", "o.png"], "numbers are written with spaces"),
        ([*BLUR, "-b", "opencl:77"], "OpenCL"),
        ([*BLUR, "more.png"], "more.png: no such file"),
        (["apply", "depth-aware-blur", "in.png", "-o", "out.png"], "Missing option '--depth'"),
        (["compare", "in.png"], "Missing option '--effect' / '-e'"),
        (["compare", "--effect", "tone-map"], "effect tone-map needs a picture: name a file"),
        (["compare", "in.png", "-e", "tone-map", "--depth", "in.png"], "effect tone-map takes no --depth"),
        (["compare", "in.png", "-e", "depth-aware-blur"], "needs --depth FILE"),
        (["compare", "in.png", "-e", "tone-map", "-b", "nope"], "there is no backend 'nope'"),
        (["plan", "in.png", "--effect", "tone-map", "--svg", "folder/plan.svg"], "does not exist; make"),
        (["plan", "in.png", "--effect", "tone-map", "--off", "everything"], "'everything' is not one of"),
        (["backends", "all"], "Got unexpected extra argument"),
    ],
)  # fmt: skip
def test_refusals(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    assert message in refused(capsys, *arguments)


@pytest.mark.parametrize("content", [b"", b"not a picture at all", b"\x89PNG\r\n\x1a\n" + b"\0" * 40])
def test_broken_pictures(capsys: pytest.CaptureFixture[str], content: bytes) -> None:
    Path("broken.png").write_bytes(content)
    assert "broken.png: " in refused(capsys, "apply", "gaussian-blur", "broken.png", "-o", "out.png")


def test_a_truncated_picture(capsys: pytest.CaptureFixture[str]) -> None:
    Path("half.png").write_bytes(Path("in.png").read_bytes()[:90])
    assert "half.png: truncated or corrupt" in refused(capsys, "apply", "tone-map", "half.png", "-o", "out.png")


def test_an_unwritable_output_is_refused_before_the_work(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("passgraph.commands.render.seen_by", lambda *_: pytest.fail("work began"))
    for output in ("nowhere/out.png", "out.abc", "folder.png"):
        Path("folder.png").mkdir(exist_ok=True)
        refused(capsys, "render", "-o", output)


def test_a_folder_without_permission(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir()
    locked.chmod(0o500)
    if os.access(locked, os.W_OK):
        pytest.skip("this user may write everywhere")
    assert "cannot be written (Permission denied)" in refused(capsys, *BLUR[:-1], "locked/out.png")


def test_a_failure_leaves_the_old_file(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    Path("out.png").write_bytes(b"precious")

    # The disk cache replaces files too, and does without where it cannot.
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device", "out.png")

    monkeypatch.setattr("passgraph.pictures.os.replace", full)
    outcome = Outcome(capsys, *BLUR, "-b", "reference")
    assert outcome.status == 2
    assert "No space left on device" in outcome.err
    assert Path("out.png").read_bytes() == b"precious"
    assert not list(Path.cwd().glob(".passgraph*"))


def test_a_missing_driver_is_one_line_with_its_cure(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(self: ReferenceBackend, device: str | None = None) -> None:
        raise DeviceMissingError("no driver here;\n  run: apt-get install driver")

    monkeypatch.setattr(ReferenceBackend, "__init__", gone)
    assert "no driver here; run: apt-get install driver" in refused(capsys, *BLUR, "-b", "reference")


@pytest.mark.parametrize(
    ("raised", "status", "text"),
    [
        (KeyboardInterrupt(), 130, "passgraph: interrupted"),
        (MemoryError("32 GiB"), 2, "not enough memory (32 GiB); use a smaller --size or picture"),
        (PermissionError(13, "Permission denied", "x"), 2, "x: Permission denied"),
        (
            RuntimeError("a driver\nbroke"),
            2,
            "unforeseen RuntimeError: a driver broke; set PASSGRAPH_TRACEBACK=1 to see where",
        ),
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_is_raised_inside(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    raised: BaseException,
    status: int,
    text: str,
) -> None:
    def fail(*_: object) -> None:
        raise raised

    monkeypatch.setattr("passgraph.commands.apply_effect.run_and_save", fail)
    outcome = Outcome(capsys, *BLUR)
    assert outcome.status == status
    assert text in outcome.err
    assert outcome.err.strip().count("\n") == 0


# In a process of its own


def process(*arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(root)}
    command = [sys.executable, "-m", "passgraph", *arguments]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


def test_python_m_passgraph() -> None:
    made = process("apply", "black-and-white", "in.png", "-o", "gray.png", "-b", "reference")
    assert (made.returncode, made.stderr) == (0, "")
    assert Path("gray.png").exists()


def test_a_process_fails_with_one_line() -> None:
    made = process("apply", "black-and-white", "nope.png", "-o", "gray.png")
    assert made.returncode == 2
    assert made.stdout == ""
    assert made.stderr.startswith("passgraph: error: nope.png: no such file")
    assert made.stderr.count("\n") == 1


def test_a_reader_that_leaves_early_is_no_error() -> None:
    command = f"{sys.executable} -m passgraph --help | true; exit ${{PIPESTATUS[0]}}"
    environment = {**os.environ, "PYTHONPATH": str(root)}
    made = subprocess.run(["bash", "-c", command], capture_output=True, text=True, env=environment, check=False)
    assert made.returncode in (0, 141)
    assert made.stderr == ""
