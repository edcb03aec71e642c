"""A camera that orbits in an exported page: its poses are those of Python, its drags those of the live view."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run as command
from passgraph.effects import soft_shadow
from passgraph.errors import InputError
from passgraph.graph.targets import named_outputs
from passgraph.verify.oracle.pass_bounds import OPTIONS, Passes
from passgraph.web import Orbit, export_web
from passgraph.web.export import Written
from tests.web.browser import CHROMIUM, opened, read, run
from tests.web.test_agreement import within, written_in

in_chromium = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
SIZE = (48, 32)
#: 4 azimuths a quarter turn apart; the exported camera is one of 3 elevations, and of 3 distances.
FEW = Orbit(azimuths=4, elevations=3, distances=3)

eye = pg.Value("camera", pg.Camera, default=pg.Camera((0, 0, 5), (0, 0, 0)))
paint = pg.kernel(source="def paint(at: vec3, size: int) -> vec4: return vec4(at, float(size))")


def eye_of(folder: Path, orbit: Orbit | None = FEW, value: pg.Value = eye, **given: Any) -> Written:
    """Export a picture that shows where the camera is, in red, green and blue, and its whole distance in alpha."""
    place = value.map(lambda camera: tuple(0.125 * x for x in camera.eye))
    away = value.map(lambda camera: round(float(np.linalg.norm(camera.eye))))
    target = paint(place, away, into=pg.target("eye", format="rgba32f"))
    return export_web(target, folder, size=SIZE, orbit=orbit, **given)


def poses_of(folder: Path) -> Any:
    return json.loads((folder / "effect.json").read_text())["orbit"]


def test_the_table_holds_what_changes(tmp_path: Path) -> None:
    written = eye_of(tmp_path)
    described, table = poses_of(tmp_path), np.fromfile(tmp_path / "orbit.bin", "<f4")
    assert (written.poses, written.constants) == ((4, 3, 3), ())
    assert (described["azimuths"], described["columns"], described["bytes"]) == (4, 4, table.nbytes)
    rows = table.reshape(4, 3, 3, 4)
    assert rows[0, 1, 1, :3] == pytest.approx((0.0, 0.0, 0.625))
    assert rows[1, 1, 2, :3] == pytest.approx((0.125 * 5 * 2**0.5, 0.0, 0.0), abs=1e-6)
    assert rows.view("<i4")[2, 0, :, 3].tolist() == [4, 5, 7]


def test_a_value_that_stays_is_a_constant(tmp_path: Path) -> None:
    fov = eye.map(lambda camera: (camera.vertical_fov_rad, 0.0, 0.0))
    target = paint(fov, 1, into=pg.target("eye"))
    export_web(target, tmp_path, size=SIZE, orbit=FEW)
    assert (poses_of(tmp_path)["columns"], (tmp_path / "orbit.bin").stat().st_size) == (0, 0)


def test_a_large_table_has_fewer_azimuths(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("passgraph.web.orbit.MOST_BYTES", 3 * 4 * 9 * 4)
    assert eye_of(tmp_path).poses == (3, 3, 3)
    assert (tmp_path / "orbit.bin").stat().st_size == 3 * 4 * 9 * 4


def test_elevations_stop_short_of_the_vertical(tmp_path: Path) -> None:
    above = pg.Camera((0, 5, 0.1), (0, 0, 0))
    assert eye_of(tmp_path, camera=above).poses == (4, 2, 3)
    assert poses_of(tmp_path)["elevations"] == [-0.15, 0.0]


def test_progress_counts_the_poses(tmp_path: Path) -> None:
    said: list[tuple[str, int, int]] = []
    eye_of(tmp_path, progress=lambda *counts: said.append(counts))
    assert said == [("orbit", number, 36) for number in range(36)]


def test_an_effect_without_a_camera_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"orbit: expected an effect with one camera, got none; leave out the orbit"):
        export_web(paint((0.0, 0.0, 0.0), 1), tmp_path, orbit=FEW)


@pytest.mark.parametrize("count", [0, 1.5, 100, True])
def test_a_wrong_count_is_an_error_that_names_it(count: Any) -> None:
    with pytest.raises(InputError, match=r"orbit: elevations must be a whole number from 1 to 99, got"):
        Orbit(elevations=count)


def test_an_orbit_of_another_class_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"orbit must be passgraph.web.Orbit\(...\), got True"):
        eye_of(tmp_path, True)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["vignette", "--web", "{}"], "orbit: expected an effect with one camera, got none"),
        (["soft-shadow", "--program", "{}"], "--orbit is for a page; give --web DIR too, or leave it out"),
    ],
)
def test_the_command_refuses_an_orbit_of_nothing(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    assert command(["export", *(one.format(tmp_path / "out") for one in arguments), "--orbit"]) == 2
    assert message in capsys.readouterr().err


@in_chromium
def test_the_nearest_pose_is_chosen(tmp_path: Path) -> None:
    eye_of(tmp_path)
    with opened(tmp_path) as page:
        run(page, {})
        assert read(page)[0, 0].tolist() == pytest.approx([0, 0, 0.625, 5])
        for pose, azimuth, elevation, distance in [
            ({"azimuth": 1.5, "elevation": 0.08, "distance": 1.3}, pi / 2, 0.15, 2**0.5),
            ({"azimuth": -0.7, "elevation": -9, "distance": 0.01}, 0, -0.15, 0.5**0.5),
            ({"azimuth": -9 * pi / 2}, 3 * pi / 2, 0, 1),
            ({}, 0, 0, 1),
        ]:
            chosen = page.evaluate("pose => { const chosen = program.pose(pose); program.run(); return chosen; }", pose)
            assert list(chosen.values()) == pytest.approx([azimuth, elevation, distance])
            x, y, z = eye.default.orbited(azimuth, elevation, distance).eye
            assert read(page)[0, 0].tolist() == pytest.approx(
                [0.125 * x, 0.125 * y, 0.125 * z, round(5 * distance)], abs=1e-6
            )
        for pose, message in [({"distance": 0}, "a distance above 0, got azimuth 0"), ({"azimuth": None}, "null")]:
            code = "pose => { try { program.pose(pose); } catch (error) { return String(error); } }"
            assert message in page.evaluate(code, pose)


@in_chromium
def test_poses_of_another_effect_are_errors(tmp_path: Path) -> None:
    eye_of(tmp_path / "short")
    (tmp_path / "short" / "orbit.bin").write_bytes(bytes(12))
    with opened(tmp_path / "short") as page:
        assert "orbit.bin: expected 576 bytes, got 12" in page.evaluate("globalThis.failed")
    eye_of(tmp_path / "none", orbit=None)
    with opened(tmp_path / "none") as page:
        said = page.evaluate("() => { try { program.pose({}); } catch (error) { return String(error); } }")
        assert "this effect has no poses of a camera; export it with --orbit" in said


@in_chromium
def test_damaged_entries_of_the_table_are_errors_that_name_the_place(tmp_path: Path) -> None:
    eye_of(tmp_path)
    path = tmp_path / "effect.json"
    whole = path.read_text()
    damages: dict[str, Callable[[Any], object]] = {
        "orbit.file: expected the name of a file beside it": lambda one: one["orbit"].update(file="../orbit.bin"),
        "orbit.azimuths: expected a whole number from 1": lambda one: one["orbit"].update(azimuths=0),
        "orbit.elevations: expected numbers, got []": lambda one: one["orbit"].update(elevations=[], bytes=0),
        "orbit.bytes: expected 576, 4 for each number": lambda one: one["orbit"].update(bytes=580),
        "steps[0].stages[0].poses: expected a whole number from 0 to 1, got 2": (
            lambda one: one["steps"][0]["stages"][0]["poses"][0].update(column=2)
        ),
        "steps[0].stages[0].poses: expected a whole number from 32": (
            lambda one: one["steps"][0]["stages"][0]["poses"][0].update(at=0)
        ),
    }
    code = """async () => {
        const { load } = await import("./passgraph.js");
        try { await load("effect.json?" + Math.random()); return "loaded"; } catch (error) { return String(error); }
    }"""
    with opened(tmp_path) as page:
        for message, damage in damages.items():
            document = json.loads(whole)
            damage(document)
            path.write_text(json.dumps(document))
            assert message in page.evaluate(code)


@in_chromium
def test_drags_and_the_wheel_turn_the_camera(tmp_path: Path) -> None:
    """200 pixels are a radian, as in the live view; a drag to the right moves the camera to the left."""
    eye_of(tmp_path, Orbit(azimuths=72, elevations=7, distances=3))

    with opened(tmp_path, "index.html") as page:

        def moves_to(*pose: float) -> None:
            """Wait until the picture is that of a pose."""
            expected = [0.125 * one for one in eye.default.orbited(*pose).eye]
            page.wait_for_function(
                """async (expected) => {
                    if (!program.frame) return false;
                    const { data } = await program.read();
                    return expected.every((one, i) => Math.abs(data[i] - one) < 1e-6);
                }""", arg=expected, timeout=20_000
            )  # fmt: skip

        moves_to(0.0)
        assert page.locator("#camera-help").is_visible()
        page.mouse.move(300, 300)
        page.mouse.down()
        page.mouse.move(300 - 200 * 20 * pi / 72 - 2, 300)
        moves_to(20 * pi / 72)
        page.mouse.move(300 - 200 * 20 * pi / 72 - 2, 360)
        page.mouse.up()
        moves_to(20 * pi / 72, 0.3)
        page.mouse.wheel(0, 120)
        moves_to(20 * pi / 72, 0.3, 2**0.5)
        # Alt zooms the picture and leaves the camera, which goes on from there.
        page.keyboard.down("Alt")
        page.mouse.wheel(0, -120)
        page.keyboard.up("Alt")
        page.locator("#stage").focus()
        page.keyboard.press("Control+ArrowRight")
        moves_to(22 * pi / 72, 0.3, 2**0.5)
        assert page.faults == []


@in_chromium
def test_a_static_pass_runs_again_when_its_pose_changes(tmp_path: Path) -> None:
    """A value that is compared by itself makes its pass static, although the camera moves."""
    side = pg.combine(lambda camera: 1.0 if camera.eye[0] > 1.0 else 0.0, eye, by_value=True)
    fill = pg.kernel(source="def fill(by: float) -> float: return by")
    export_web(fill(side, into=pg.target("side", format="r32f")), tmp_path, size=SIZE, orbit=FEW)
    with opened(tmp_path) as page:
        assert page.evaluate("program.effect.steps.every((step) => step.static)")
        for azimuth, expected in [(0, 0), (pi / 2, 1), (pi, 0), (pi / 2, 1)]:
            page.evaluate("azimuth => { program.pose({ azimuth }); program.run(); }", azimuth)
            assert read(page)[0, 0, 0] == expected


@in_chromium
@pytest.mark.slow
def test_poses_of_the_shipped_scene(tmp_path: Path) -> None:
    """A pose is within the bounds of the passes with Python's camera; others equal an export of that camera alone."""
    scene = pg.Scene.shipped()
    outputs, light = named_outputs(soft_shadow(scene, display=True)), scene.lights[0]

    def export(folder: Path, camera: pg.Camera, orbit: Orbit | None = None) -> None:
        export_web(outputs, folder, size=SIZE, options=OPTIONS, orbit=orbit, camera=camera, light=light)

    poses = [(pi / 2, 0.15, 2**0.5), (3 * pi / 2, -0.15, 0.5**0.5), (pi, 0.0, 1.0)]
    cameras = [scene.camera.orbited(*pose) for pose in poses]
    passes = [Passes(outputs, SIZE, [{"camera": camera, "light": light}]) for camera in cameras]
    export(tmp_path / "orbit", scene.camera, FEW)
    posed = []
    with opened(tmp_path / "orbit") as page:
        assert page.evaluate("globalThis.failed") is None
        for (azimuth, elevation, distance), of_pose in zip(poses, passes, strict=True):
            pose = {"azimuth": azimuth, "elevation": elevation, "distance": distance}
            page.evaluate("pose => { program.pose(pose); program.run(); }", pose)
            posed.append(written_in(page, of_pose))
    assert within(passes[0], posed[0]) > 10
    for number in (1, 2):
        export(tmp_path / str(number), cameras[number])
        with opened(tmp_path / str(number)) as page:
            run(page, {})
            alone = written_in(page, passes[number])
        for key, picture in alone.items():
            np.testing.assert_array_equal(posed[number][key], picture)
