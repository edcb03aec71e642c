"""``passgraph render`` for models of one's own: camera, light, ground and turntable, from file to picture."""

from __future__ import annotations

import base64
import json
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.command_graph import Job, scene_job
from passgraph.commands.entry import run
from passgraph.commands.render import run_turntable
from passgraph.commands.running import RunOptions
from passgraph.commands.scene_view import View, seen_by
from passgraph.effects.effect_table import EFFECTS
from tests.commands.told import refused

SIZE = ["--size", "64x36", "--map-size", "128", "--antialias", "none", "-b", "numpy"]
#: A tower of 1 × 6 × 1 on y = 0, whose front (+z) is red, and whose other sides are not.
CORNERS = np.array([[x, y, z] for z in (0.5, -0.5) for y in (0, 6) for x in (-0.5, 0.5)], np.float32)
SIDES = {
    "front": [0, 1, 3, 2], "back": [5, 4, 6, 7], "right": [1, 5, 7, 3], "left": [4, 0, 2, 6], "top": [2, 3, 7, 6],
    "bottom": [4, 5, 1, 0],
}  # fmt: skip


LIGHTS = "expected a number or a name of 1 'lamp', 2 'sun'"
CAMERAS = "expected a number or a name of 1 'front', 2 'side'"


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PASSGRAPH_TRACEBACK", raising=False)
    Path("tower.mtl").write_text("newmtl red\nKd 0.9 0.05 0.05\nnewmtl green\nKd 0.05 0.7 0.05\n")
    rows = ["mtllib tower.mtl", *(f"v {x} {y} {z}" for x, y, z in CORNERS)]
    for name, side in SIDES.items():
        rows += [f"usemtl {'red' if name == 'front' else 'green'}", f"f {' '.join(str(c + 1) for c in side)}"]
    Path("tower.obj").write_text("\n".join(rows) + "\n")


def render(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[str, Any]:
    capsys.readouterr()
    assert run(["render", *SIZE, *arguments, "-o", "out.png"]) == 0, capsys.readouterr().err
    return capsys.readouterr().out, pg.load("out.png")[..., :3]


def red(picture: Any) -> Any:
    return (picture[..., 0] > 0.2) & (picture[..., 1] < 0.5 * picture[..., 0])


def green(picture: Any) -> Any:
    return (picture[..., 1] > 0.15) & (picture[..., 0] < 0.5 * picture[..., 1])


def rows_of(mask: Any) -> tuple[int, int]:
    rows = np.flatnonzero(mask.any(axis=1))
    return int(rows[0]), int(rows[-1])


def test_the_model_fills_the_picture(capsys: pytest.CaptureFixture[str]) -> None:
    """36 rows, of which the margin takes 1 / 1.08: 33.3 rows in the middle."""
    for azimuth in ("0", "1e6", "-77"):
        _, picture = render(capsys, "tower.obj", "--ground", "none", "--azimuth", azimuth, "--elevation", "0")
        assert rows_of(red(picture) | green(picture)) == (1, 34)


def test_the_camera_stands_where_it_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    common = ["tower.obj", "--ground", "none", "--elevation", "0"]
    fronts = {a: red(render(capsys, *common, "--azimuth", a)[1]).sum() for a in ("0", "40", "180", "400", "-320")}
    assert fronts["0"] > fronts["40"] > fronts["180"] == 0
    assert fronts["40"] == fronts["400"] == fronts["-320"]


def test_a_longer_way_and_a_zoom_change_the_size(capsys: pytest.CaptureFixture[str]) -> None:
    common = ["tower.obj", "--ground", "none", "--elevation", "0"]
    placed = [*common, "--azimuth", "0", "--size", "256x144"]
    near = red(render(capsys, *placed, "--distance", "10")[1]).sum()
    assert red(render(capsys, *placed, "--distance", "19.5")[1]).sum() == pytest.approx(near / 4, rel=0.1)
    assert red(render(capsys, *placed, "--distance", "19.5", "--zoom", "2")[1]).sum() == pytest.approx(near, rel=0.1)
    narrow = render(capsys, *common, "--fov", "5", "--azimuth", "45")[1]
    assert rows_of(red(narrow) | green(narrow)) == (1, 34)


def test_a_model_without_a_floor_gets_one_and_it_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    out, picture = render(capsys, "tower.obj", "--light-elevation", "60")
    assert out.splitlines()[1] == "ground: a plane at y = -0.000308221; --ground none leaves it out"
    bare_out, bare = render(capsys, "tower.obj", "--ground", "none", "--light-elevation", "60")
    assert len(bare_out.splitlines()) == 1
    around = ~(red(bare) | green(bare))
    assert np.ptp(bare[around], axis=0).max() < 0.02  # sky
    assert np.ptp(picture[around], axis=0).max() > 0.2  # ground and a shadow on it


def test_a_scene_with_a_floor_gets_none_unless_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert len(render(capsys)[0].splitlines()) == 1
    assert "ground: a plane" in render(capsys, "--ground", "plane")[0]


def shadow_of(picture: Any, bare: Any) -> Any:
    """Of light from above: how much darker than lit ground, where ground is."""
    light = picture.mean(axis=2)
    ground = ~(red(bare) | green(bare))
    return np.where(ground, np.median(light[ground]) - light, 0.0)


def test_the_shadow_falls_away_from_the_light_and_grows_soft_with_it(capsys: pytest.CaptureFixture[str]) -> None:
    common = ["tower.obj", "--azimuth", "0", "--elevation", "60", "--zoom", "0.5", "--light-elevation", "35"]
    bare = render(capsys, *common, "--ground", "none")[1]
    middles, soft = {}, {}
    for azimuth in ("90", "-90"):
        dark = shadow_of(render(capsys, *common, "--light-azimuth", azimuth, "--light-radius", "0")[1], bare)
        middles[azimuth] = float((np.arange(64) * dark.clip(0)).sum() / dark.clip(0).sum())
    assert middles["90"] < 30 < 34 < middles["-90"]
    for radius in ("0", "0.3"):
        dark = shadow_of(render(capsys, *common, "--light-azimuth", "90", "--light-radius", radius)[1], bare)
        soft[radius] = int(((dark > 0.04) & (dark < 0.12)).sum())
    assert soft["0.3"] > 2 * soft["0"]


def test_the_light_has_the_colour_that_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    picture = render(capsys, "tower.obj", "--light-color", "1", "0", "0", "--ambient", "0", "--elevation", "50")[1]
    assert picture[..., 0].mean() > 0.2
    assert picture[0, 0, 1:].max() == 0.0


def own_file(**more: Any) -> str:
    """The tower as glTF with a camera in front, one on the right, a lamp and a sun."""
    faces = np.array([[s[i] for i in (0, 1, 2, 0, 2, 3)] for s in SIDES.values()], np.uint16).reshape(-1)
    blob = CORNERS.tobytes() + faces.tobytes()
    lights = [{"type": "point", "name": "lamp", "intensity": 60.0}, {"type": "directional", "name": "sun"}]
    header = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1, 2, 3, 4]}],
        "nodes": [
            {"mesh": 0},
            {"camera": 0, "translation": [0, 3, 30], "name": "front"},
            {"camera": 1, "translation": [30, 3, 0], "rotation": [0, 2**-0.5, 0, 2**-0.5], "name": "side"},
            {"translation": [4, 8, 4], "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"rotation": [-(2**-0.5), 0, 0, 2**-0.5], "extensions": {"KHR_lights_punctual": {"light": 1}}},
        ],
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}},
            {"type": "orthographic", "orthographic": {"xmag": 8, "ymag": 8, "znear": 1, "zfar": 90}},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "extensions": {"KHR_lights_punctual": {"lights": lights}},
        "bufferViews": [
            {"buffer": 0, "byteLength": CORNERS.nbytes},
            {"buffer": 0, "byteOffset": CORNERS.nbytes, "byteLength": faces.nbytes},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "buffers": [{"uri": "data:;base64," + base64.b64encode(blob).decode(), "byteLength": len(blob)}],
        **more,
    }  # fmt: skip
    Path("own.gltf").write_text(json.dumps(header))
    return "own.gltf"


def test_the_cameras_and_lights_of_a_file_are_chosen_by_name_or_number(capsys: pytest.CaptureFixture[str]) -> None:
    file = own_file()
    out, first = render(capsys, file, "--ground", "none")
    assert out.splitlines()[1] == "camera: 1 'front' of 2; --camera NAME or NUMBER chooses"
    np.testing.assert_array_equal(render(capsys, file, "--ground", "none", "--camera", "front")[1], first)
    side = render(capsys, file, "--ground", "none", "--camera", "2")[1]
    assert (side != first).any()
    np.testing.assert_array_equal(render(capsys, file, "--ground", "none", "--camera", "side")[1], side)
    sun, lamp = (render(capsys, file, "--camera", "1", "--light", name)[1] for name in ("sun", "lamp"))
    assert (sun != lamp).any()
    turned = render(capsys, file, "--azimuth", "90", "--elevation", "0", "--ground", "none")[1]
    assert (turned != side).any()


def test_a_camera_s_own_name_stands_behind_that_of_its_node() -> None:
    """A lens may hang on several nodes, and be called as another node is."""
    lens = {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}
    names = {"name": "front", "camera": 0}, {"name": "side", "camera": 1}, {"camera": 2}, {"name": "top", "camera": 1}
    nodes = [{"mesh": 0}, *({**one, "translation": [0, 3, 30 + at]} for at, one in enumerate(names))]
    file = own_file(
        scenes=[{"nodes": list(range(5))}], nodes=nodes,
        cameras=[{**lens, "name": name} for name in ("wide", "front", "alone")],
    )  # fmt: skip

    def shown(camera: str) -> float:
        return seen_by(View(camera=camera, ground="none"), Path(file), (64, 48)).scene.camera.eye[2]

    for camera, at in (("wide", 30), ("front", 30), ("1", 30), ("2", 31), ("side", 31), ("alone", 32), ("top", 33)):
        assert shown(camera) == at, camera
    listed = "1 'front' ('wide'), 2 'side' ('front'), 3 'alone', 4 'top' ('front')"
    for camera in ("narrow", "5"):
        with pytest.raises(pg.InputError, match=re.escape(f"expected a number or a name of {listed}")):
            shown(camera)
    nodes[1]["name"], nodes[3]["name"] = "first", "third"
    own_file(scenes=[{"nodes": list(range(5))}], nodes=nodes, cameras=[{**lens, "name": "front"}] * 3)
    with pytest.raises(pg.InputError, match="4 have that name"):
        shown("front")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ("--camera top", f"--camera 'top': the scene has no such camera; {CAMERAS}"),
        ("--camera 3", f"--camera '3': the scene has no such camera; {CAMERAS}"),
        ("--camera 0", f"--camera '0': the scene has no such camera; {CAMERAS}"),
        ("--light moon", f"--light 'moon': the scene has no such light; {LIGHTS}"),
        (
            "--camera 1 --azimuth 3",
            "--camera is a view of the scene's own, and --azimuth would place another; leave out one",
        ),
        ("--camera 2 --fov 30", "--fov is for cameras in perspective, and this one has parallel rays; use --zoom"),
        (
            "--light-radius 3",
            "--light-radius: the scene has 2 lights, 1 'lamp', 2 'sun'; say which one with --light",
        ),
        ("--zoom 1e-9", "camera: zoom: 1e-09 makes an angle of view of 3.14159 rad; expected one nearer to 1"),
    ],
)  # fmt: skip
def test_what_a_file_does_not_have_is_refused(arguments: str, text: str, capsys: pytest.CaptureFixture[str]) -> None:
    line = refused(capsys, "render", *SIZE, own_file(), *arguments.split(), "-o", "out.png")
    assert line == f"passgraph: error: {text}\n"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ("tower.obj --camera 1", "--camera '1': the scene has no camera of its own; leave it out"),
        ("--up z", "--up is for files, and the scene that comes with passgraph has y up; leave it out"),
        ("-e light2d --azimuth 3", "effect light2d draws a flat world, which takes no --azimuth; leave it out"),
        ("--fov 0", "Invalid value for '--fov': 0.0 is not in the range 0.1<=x<=170.0."),
        ("--fov 180", "Invalid value for '--fov': 180.0 is not in the range 0.1<=x<=170.0."),
        ("--azimuth inf", "Invalid value for '--azimuth': inf is not a finite number"),
        ("--elevation nan", "Invalid value for '--elevation': nan is not a finite number"),
        ("--distance 0", "Invalid value for '--distance': 0.0 is not in the range 0.0<x<=1000000000000000.0."),
        ("--light-color 1 -1 0", "Invalid value for '--light-color': -1.0 is not in the range x>=0.0."),
        ("--turntable 0", "Invalid value for '--turntable': 0 is not in the range x>=1."),
        (
            "--turntable 3",
            "out.png: is one picture, and --turntable makes several; give a numbered sequence (-o turn.%04d.png) or a "
            "video (-o turn.mp4)",
        ),
        (
            "--turntable 3 --rate 30",
            "--rate is for videos, and out.png is none; leave it out, or name one: -o turn.mp4",
        ),
        ("--rate 30", "--rate is for the video of a --turntable, and this is one picture; leave it out"),
        (
            "--turntable 3 --rate 0",
            "--rate '0': expected frames a second from 1/1000 to 1000, such as 25 or 30000/1001",
        ),
        ("--turntable 3 --profile", "--profile times the passes on one picture, and --turntable makes several; leave"),
        (
            "--turntable 3 --capture steps",
            "--capture shows the passes of one picture, and --turntable makes several; leave",
        ),
    ],
)
def test_what_cannot_be_shown_is_refused(arguments: str, text: str, capsys: pytest.CaptureFixture[str]) -> None:
    common = SIZE if "light2d" not in arguments else ["--size", "64x36"]
    line = refused(capsys, "render", *common, *arguments.split(), "-o", "out.png")
    assert line.startswith(f"passgraph: error: {text}")


def test_a_turntable_writes_numbered_pictures_that_are_those_of_its_cameras(capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    common = ["render", *SIZE, "tower.obj", "--elevation", "10", "--ground", "none", "--light-elevation", "90"]
    assert run([*common, "--azimuth", "0", "--turntable", "4", "-o", "turn.%02d.png"]) == 0
    assert capsys.readouterr().out.startswith("turn.%02d.png: 4 frames 64x36 by numpy in ")
    assert sorted(path.name for path in Path.cwd().glob("turn*")) == [f"turn.{n:02}.png" for n in (1, 2, 3, 4)]
    frames = [pg.load(f"turn.{n:02}.png")[..., :3] for n in (1, 2, 3, 4)]
    assert [red(frame).any() for frame in frames] == [True, False, False, False]
    sizes = [int((red(frame) | green(frame)).sum()) for frame in frames]
    assert np.ptp(sizes) <= 4
    view = pg.Scene.load("tower.obj", ground=False).turntable(4, 0.0, np.radians(10), aspect=64 / 36)[2]
    seen = np.c_[CORNERS, np.ones(8)] @ (view.projection_matrix(64 / 36) @ view.view_matrix()).T
    low, high = rows_of(green(frames[2]))
    expected = 18 - 18 * (seen[:, 1] / seen[:, 3])
    assert (low, high + 1) == pytest.approx((expected.min(), expected.max()), abs=1.0)


def test_a_turntable_tells_an_effect_the_camera_before() -> None:
    """The first frame has its own, as one picture has."""
    filled = pg.kernel(source="def filled(by: float) -> float: return by")
    now, before = (pg.Value(name, pg.Camera) for name in ("camera", "previous_camera"))
    by = pg.combine(lambda here, there: (here.eye[0] - there.eye[0]) / 255.0, now, before)
    job = Job({"way": filled(by, into=pg.target("way", "r8"))}, (4, 4))
    cameras = [pg.Camera((x, 0.0, 5.0), (x, 0.0, 0.0)) for x in (3.0, 10.0, 30.0)]
    assert run_turntable(job, cameras, Path("way.%d.png"), RunOptions("numpy"), None) == 0
    assert [round(float(pg.load(f"way.{n}.png")[0, 0, 0]) * 255.0) for n in (1, 2, 3)] == [0, 7, 20]
    scene = pg.Scene.shipped()
    over_frames = scene_job(EFFECTS["ambient-occlusion"], None, (64, 36), {"most_frames": 4}, scene)
    assert over_frames.given == {"previous_camera": scene.camera}


def test_a_turntable_becomes_a_video(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("av")
    assert run(["render", *SIZE, "tower.obj", "--turntable", "3", "-o", "turn.mp4"]) == 0
    from passgraph.files import Video

    assert len(list(Video(Path("turn.mp4")))) == 3
    assert Video(Path("turn.mp4")).rate == 25
    assert run(["render", *SIZE, "tower.obj", "--turntable", "3", "--rate", "30000/1001", "-o", "slow.mp4"]) == 0
    assert Video(Path("slow.mp4")).rate == Fraction(30000, 1001)


@pytest.mark.parametrize(
    "rows", ["v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "v 1e7 0 1e7\nv 1.2e7 0 1e7\nv 1e7 3e6 1e7\nf 1 2 3\n"]
)
def test_one_triangle_without_normals_fills_the_picture(rows: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("one.obj").write_text(rows)
    picture = render(capsys, "one.obj", "--azimuth", "0", "--elevation", "0", "--ground", "none")[1]
    body = picture[..., 2] - picture[..., 0] < 0.05
    assert rows_of(body) in ((1, 34), (2, 34))  # its upper corner is narrower than a pixel


def test_an_empty_mesh_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    Path("none.obj").write_text("v 0 0 0\n")
    text = "none.obj: holds only points or lines; expected at least one triangle in its scene"
    line = refused(capsys, "render", *SIZE, "none.obj", "-o", "out.png")
    assert line == f"passgraph: error: {text}\n"


# How large a model is


@pytest.mark.parametrize("backend", ["numpy", "gl"])
def test_a_model_of_any_scale_makes_the_same_picture(capsys: pytest.CaptureFixture[str], backend: str) -> None:
    """Nothing on the way from the file to the picture may have a length of its own."""
    head, *others = [row for row in Path("tower.obj").read_text().splitlines() if not row.startswith("v ")]
    pictures = []
    for scale in (1.0, 1e-10, 1e10):
        rows = [f"v {' '.join(repr(float(x) * scale) for x in corner)}" for corner in CORNERS]
        Path("scaled.obj").write_text("\n".join([head, *rows, *others]) + "\n")
        pictures.append(render(capsys, "scaled.obj", "-b", backend)[1])
    assert red(pictures[0]).mean() > 0.03
    for picture in pictures[1:]:
        np.testing.assert_allclose(picture, pictures[0], atol=2 / 255)


# A transparent background


def shown(name: str, *options: str) -> Any:
    size = ["--size", "48x27", "--map-size", "64", "-b", "numpy"]
    assert run(["render", "tower.obj", *size, *options, "-o", name]) == 0
    return pg.load(name, linear=True)


@pytest.mark.parametrize("antialias", ["none", "ssaa4"])
def test_without_ground_the_picture_may_be_laid_over_any_background(antialias: str) -> None:
    """Over blue light it is the picture that is drawn on blue; in light, to half a step of 8 bits each."""
    clear = shown("clear.png", "--ground", "none", "--antialias", antialias)
    assert 0.2 < (clear[..., 3] == 0.0).mean() < 0.9
    assert ((clear[..., 3] > 0.0) & (clear[..., 3] < 1.0)).any() == (antialias == "ssaa4")
    blue = np.array([0.0, 0.0, 1.0])
    on_blue = shown("blue.png", "--ground", "none", "--antialias", antialias, "--background", "0", "0", "1")
    assert on_blue[..., 3].min() == 1.0
    over = clear[..., :3] * clear[..., 3:] + blue * (1.0 - clear[..., 3:])
    assert np.abs(over - on_blue[..., :3]).max() < 0.012


@pytest.mark.parametrize("antialias", ["fxaa", "smaa"])
def test_smoothed_edges_hold_no_color_of_the_background(antialias: str) -> None:
    """The tower is red and green; the sky behind it is blue."""
    clear = shown("clear.png", "--ground", "none", "--antialias", antialias)
    edge = clear[(clear[..., 3] > 0.0) & (clear[..., 3] < 1.0)]
    assert len(edge) > 5
    assert edge[:, 2].max() < 0.15


@pytest.mark.parametrize(
    ("name", "options", "alpha"),
    [("a.jpg", ["--ground", "none"], 1.0), ("a.exr", ["--ground", "none"], 0.0), ("a.png", [], 1.0),
     ("b.png", ["--background-alpha", "0.5", "--ground", "none"], 128 / 255)],
)  # fmt: skip
def test_alpha_goes_where_files_hold_it(name: str, options: list[str], alpha: float) -> None:
    assert shown(name, "--antialias", "none", *options)[0, 0, 3] == pytest.approx(alpha)
