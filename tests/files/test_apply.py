"""``passgraph apply`` on folders, sequences, videos and streams."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.commands.clips import Clip
from passgraph.commands.frames import FramesJob, Settings, run_clips
from passgraph.effects.effect_table import EFFECTS
from passgraph.files import Pattern, ToPictures
from passgraph.files.open import open_source
from passgraph.image_files import opened_image
from passgraph.pictures import load_stored
from tests.commands.told import Outcome, refused
from tests.files.made import ADD, grays, picture, sequence, value, video
from tests.picture_files import names_in, png_16

GRAY = ["apply", "black-and-white", "-b", "reference"]
TINY = ["apply", "gaussian-blur", "--sigma-px", "0", "-b", "reference"]


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PASSGRAPH_TRACEBACK", raising=False)


def well(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    outcome = Outcome(capsys, *arguments)
    assert (outcome.status, outcome.err) == (0, "")
    return outcome.out


# What goes in, and where it goes


@pytest.mark.parametrize("inputs", [["a"], ["a/"], ["a/*.png"], ["a/in.%04d.png"], ["a/in.####.png"],
                                    ["a/in.0002.png", "a/in.0003.png", "a/in.0004.png"]])  # fmt: skip
def test_every_way_to_name_pictures(capsys: pytest.CaptureFixture[str], inputs: list[str]) -> None:
    sequence(Path("a"), range(2, 5))
    out = well(capsys, *TINY, *inputs, "-o", "out/")
    assert out.startswith("out: 3 frames 6x4 by reference in ")
    assert names_in("out") == [f"in.000{n}.png" for n in (2, 3, 4)]
    assert [value(Path("out", name)) for name in names_in("out")] == [20, 30, 40]


def test_pictures_behind_the_first_of_a_file_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    Path("in").mkdir()
    stack = [Image.fromarray(np.full((4, 6, 3), 40 * n, np.uint8)) for n in (1, 2, 3)]
    for name in ("a.tif", "b.tif", "c.tif"):
        stack[0].save(Path("in", name), save_all=True, append_images=stack[1:])
    stack[0].save("in/d.tif")
    Path("in/e.tif").write_bytes(b"II*\0")
    told = "passgraph: warning: in/{}: holds several pictures{}; the first is read\n"
    one = Outcome(capsys, *TINY, "in/b.tif", "-o", "one.png")
    assert (one.status, one.err) == (0, told.format("b.tif", ""))
    assert value(Path("one.png")) == 40
    assert Outcome(capsys, *TINY, "in", "-o", "out/").err.startswith(told.format("a.tif", ", and so do 2 others"))
    two = Outcome(capsys, *TINY, "in/a.tif", "in/b.tif", "-o", "both/")
    assert two.err == told.format("a.tif", ", and so does 1 other")
    assert well(capsys, *TINY, "in/d.tif", "-o", "two.png")


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (["b.HEIC"], "in/b.HEIC: left out, pictures of such a format are not read"),
        (["b.arw", "c.avif"], "in/b.arw and 1 other in that folder: left out"),
        (["b10.cr2", "b9.cr2", "c.dng"], "in/b9.cr2 and 2 others in that folder: left out"),
        (["notes.txt", ".b.avif.txt"], ""),
    ],
)
def test_pictures_of_a_folder_that_are_not_read_are_told(
    capsys: pytest.CaptureFixture[str], names: list[str], told: str
) -> None:
    Path("in").mkdir()
    Image.fromarray(np.zeros((2, 3, 3), np.uint8)).save("in/a.png")
    for name in names:
        Path("in", name).touch()
    outcome = Outcome(capsys, *TINY, "in", "-o", "out/")
    assert (outcome.status, outcome.err.startswith(f"passgraph: warning: {told}")) == (0, bool(told)), outcome.err
    assert names_in("out") == ["a.png"]


def test_a_link_of_a_folder_that_leads_nowhere_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    Path("in").mkdir()
    Image.fromarray(np.zeros((2, 3, 3), np.uint8)).save("in/a.png")
    Path("in/b.png").symlink_to("nowhere.png")
    Path("in/c.png").mkdir()
    outcome = Outcome(capsys, *TINY, "in", "-o", "out/")
    assert outcome.status == 1
    assert outcome.err == "passgraph: error: in/b.png: is a link to nowhere.png, which is not there; mend the link\n"
    assert names_in("out") == ["a.png"]


def test_16_bits_stay_16_bits_where_it_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    """One picture, a folder and a sequence; and where files cannot hold them it is said before the work."""
    wide = np.random.default_rng(0).integers(0, 65536, (5, 7, 3)).astype(np.uint16)
    Path("in").mkdir()
    for name in ("a.png", "b.tif"):
        pg.save(Path("in", name), wide)
    well(capsys, *TINY, "in/a.png", "--bits", "16", "-o", "one.tif")
    well(capsys, *TINY, "in", "--bits", "16", "-o", "out/")
    well(capsys, *TINY, "in", "--bits", "16", "-o", "n.%d.png")
    for file in ("one.tif", "out/a.png", "out/b.tif", "n.1.png", "n.2.png"):
        assert np.array_equal(load_stored(Path(file))[..., :3], wide), file
    well(capsys, *TINY, "in/a.png", "--bits", "8", "-o", "eight.png")
    assert load_stored(Path("eight.png")).dtype == np.uint8
    well(capsys, *TINY, "in", "--bits", "16", "-o", "half.%d.exr")
    well(capsys, *TINY, "in/a.png", "--bits", "16", "-o", "half.exr")
    for name in ("half.1.exr", "half.exr"):
        with opened_image(Path(name)) as image:
            assert image.dtype == np.float16
    for told, *arguments in (
        ("x.jpg: JPEG holds 8-bit", "in/a.png", "-o", "x.jpg"),
        ("x/a.webp: WebP holds 8-bit", "in/a.webp", "in/a.png", "-o", "x/"),
        ("--bits is for picture files, and none is written", "in", "-o", "x.mp4"),
    ):
        pg.save("in/a.webp", np.zeros((5, 7, 3)))
        assert told in refused(capsys, *TINY, *arguments, "--bits", "16")


def test_folders_need_no_slash_and_may_be_there(capsys: pytest.CaptureFixture[str]) -> None:
    sequence(Path("a"), [1, 2])
    well(capsys, *TINY, "a", "-o", "out")
    well(capsys, *TINY, "a/in.0001.png", "-o", "out")
    assert names_in("out") == ["in.0001.png", "in.0002.png"]


def test_one_sign_in_the_name_of_one_picture_is_no_number(capsys: pytest.CaptureFixture[str]) -> None:
    sequence(Path("a"), [1])
    assert well(capsys, *TINY, "a/in.0001.png", "-o", "b#1.png").startswith("b#1.png: 6x4 by reference; compile ")
    well(capsys, *TINY, "a/in.0001.png", "-o", "c.##.png")
    assert value(Path("b#1.png")) == value(Path("c.01.png")) == 10


def test_numbers_stay_in_a_sequence(capsys: pytest.CaptureFixture[str]) -> None:
    sequence(Path("a"), [3, 4, 5])
    well(capsys, *TINY, "a/in.####.png", "-o", "b.%02d.npy")
    assert [path.name for path in sorted(Path().glob("b.*"))] == ["b.03.npy", "b.04.npy", "b.05.npy"]
    well(capsys, *TINY, "a", "-o", "c.#.png")
    assert [path.name for path in sorted(Path().glob("c.*"))] == ["c.1.png", "c.2.png", "c.3.png"]


def test_the_folder_of_a_sequence_is_made(capsys: pytest.CaptureFixture[str]) -> None:
    sequence(Path("a"), range(2, 4))
    well(capsys, *TINY, "a", "-o", "made/shot.%04d.png")
    assert names_in("made") == ["shot.0001.png", "shot.0002.png"]


def test_gaps_of_a_sequence_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    sequence(Path("a"), [1, 2, 5])
    outcome = Outcome(capsys, *TINY, "a/in.####.png", "-o", "out/")
    assert outcome.status == 0
    assert outcome.err == "passgraph: warning: a/in.####.png: frames 3-4 are not there\n"


def test_formats_that_are_not_written_become_png(capsys: pytest.CaptureFixture[str]) -> None:
    from PIL import Image

    Path("a").mkdir()
    Image.new("RGB", (3, 2), (9, 9, 9)).save("a/one.gif")
    well(capsys, *TINY, "a", "-o", "out")
    assert names_in("out") == ["one.png"]
    Image.new("RGB", (3, 2), (9, 9, 9)).save("a/one.png")
    assert "out/one.png: a/one.gif and a/one.png would both be written to it" in refused(
        capsys, *TINY, "a", "-o", "out"
    )


#: What some effects need beside their pictures.
NEEDED = {"color-transform": ("--src", "sRGB - Texture", "--dst", "ACEScct")}


@pytest.mark.sampled
@pytest.mark.parametrize("name", [n for n, e in EFFECTS.items() if e.takes == "picture"])
def test_a_sequence_gives_what_single_pictures_give(capsys: pytest.CaptureFixture[str], name: str) -> None:
    """To the bit, of 8 bits that are decoded from sRGB too."""
    needed = NEEDED.get(name, ())
    y, x = np.mgrid[0:20, 0:30] / 32
    for number, size in enumerate([(20, 30), (20, 30), (13, 17)]):
        tinted = np.dstack([x, y, 1 - x, np.ones_like(x)])[: size[0], : size[1]] * (1 - number / 8)
        tinted[..., 3] = 1
        pg.save(f"in{number}.png", tinted.astype(np.float32))
        well(capsys, "apply", name, f"in{number}.png", "-o", f"one{number}.npy", "-b", "reference", *needed)
    well(capsys, "apply", name, "in?.png", "-o", "many%d.npy", "-b", "reference", *needed)
    for number in range(3):
        np.testing.assert_array_equal(np.load(f"many{number + 1}.npy"), np.load(f"one{number}.npy"))


@pytest.mark.parametrize("backend", ["numpy", "gl"])
def test_every_byte_is_decoded_in_one_place(capsys: pytest.CaptureFixture[str], backend: str) -> None:
    """Of pictures in 8 and in 16 bits, alone and in a row, with all that 8 bits can be."""
    ramp = np.arange(256, dtype=np.uint8).reshape(16, 16)
    pg.save("in0.png", np.dstack([ramp, ramp[::-1], ramp.T, np.full_like(ramp, 255)]))
    Path("in1.png").write_bytes(png_16(np.linspace(0, 65535, 256).astype(np.uint16).reshape(16, 16, 1), 0))
    for number in range(2):
        well(capsys, "apply", "vignette", f"in{number}.png", "-o", f"one{number}.npy", "-b", backend, "--linear")
    well(capsys, "apply", "vignette", "in?.png", "-o", "many%d.npy", "-b", backend, "--linear")
    for number in range(2):
        np.testing.assert_array_equal(np.load(f"many{number + 1}.npy"), np.load(f"one{number}.npy"))


def test_depth_is_one_picture_or_a_sequence(capsys: pytest.CaptureFixture[str]) -> None:
    sequence(Path("a"), range(1, 4))
    blur = ["apply", "depth-aware-blur", "-b", "reference", "a"]
    np.save("depth.npy", np.full((4, 6), 3.0, np.float32))
    well(capsys, *blur, "-o", "one", "--depth", "depth.npy")
    for number in range(3):
        np.save(f"depth{number}.npy", np.full((4, 6), 3.0, np.float32))
    well(capsys, *blur, "-o", "many", "--depth", "depth#.npy")
    assert names_in("one") == names_in("many") == ["in.0001.png", "in.0002.png", "in.0003.png"]
    Path("depth2.npy").unlink()
    short = Outcome(capsys, *blur, "-o", "short", "--depth", "depth#.npy")
    assert (short.status, names_in("short")) == (1, ["in.0001.png", "in.0002.png"])
    assert "depth#.npy: ends after 2 frames, and a has more" in short.err
    np.save("depth.npy", np.full((4, 7), 3.0, np.float32))
    wide = Outcome(capsys, *blur, "-o", "wide", "--depth", "depth.npy")
    assert (wide.status, wide.err.count("depth.npy: is 7x4 pixels, and a/in.000")) == (1, 3)


def test_depth_may_be_an_engines_buffer(capsys: pytest.CaptureFixture[str]) -> None:
    """The same fog as from distances: of one picture with 16 bits, and of a sequence."""
    sequence(Path("a"), range(1, 3))
    fog = ["apply", "fog", "-b", "reference", "--density", "0.3", "--fog-color", "1", "1", "1"]
    holds = pg.HardwareDepth(0.5, np.inf, reversed_z=True)
    held = np.rint(holds.depth(np.linspace(0.6, 8.0, 24).reshape(4, 6)) * 65535.0)
    np.save("distance.npy", holds.distance(held / 65535.0).astype(np.float32))
    np.save("held.npy", (held / 65535.0).astype(np.float32))
    Path("held.png").write_bytes(png_16(held.astype(np.uint16)[..., None], 0))
    buffer = ["--depth-buffer", "0.5:inf,reversed"]
    well(capsys, *fog, "a/in.0001.png", "-o", "plain.npy", "--depth", "distance.npy")
    for name in ("held.npy", "held.png"):
        well(capsys, *fog, "a/in.0001.png", "-o", "one.npy", "--depth", name, *buffer)
        assert np.load("one.npy") == pytest.approx(np.load("plain.npy"), abs=1e-5)
    well(capsys, *fog, "a", "-o", "many%d.npy", "--depth", "held.npy", *buffer)
    assert np.load("many1.npy") == pytest.approx(np.load("plain.npy"), abs=1e-5)
    for wrong in ("0.5", "2:1", "0.5:9,upside-down", "near:far"):
        said = refused(capsys, *fog, "a", "-o", "x", "--depth", "held.npy", "--depth-buffer", wrong)
        assert f"{wrong!r}: expected NEAR:FAR with 0 < NEAR < FAR" in said


def test_a_picture_that_is_a_parameter_goes_with_every_frame(capsys: pytest.CaptureFixture[str]) -> None:
    sequence(Path("a"), [10, 20], (30, 20))
    pg.save("dirt.png", picture(200, (9, 5)))
    dirty = ["apply", "dirty-lens", "-b", "reference", "--dirt", "dirt.png"]
    well(capsys, *dirty, "a", "-o", "many")
    well(capsys, *dirty, "a/in.0020.png", "-o", "one.png")
    assert np.array_equal(pg.load("one.png"), pg.load("many/in.0020.png"))


class Summing:
    """An effect that adds up all frames until now."""

    takes = "picture"

    def build(self, color: pg.Target) -> pg.Target:
        spec = pg.target("sum", "rgba32f")
        return ADD(pg.previous(spec), color, into=spec)


def test_history_begins_anew_with_each_sequence() -> None:
    clips = []
    for name in "ab":
        sequence(Path(name), [1, 2, 3])
        clips.append(Clip(open_source(f"{name}/in.####.png"), ToPictures(Pattern(f"{name}.#.png"))))
    summing: Any = Summing()
    assert run_clips(FramesJob(summing, {}), clips, Settings("reference", jobs=2), []) == 0
    assert [value(Path(f"{name}.{n}.png")) for name in "ab" for n in (1, 2, 3)] == [10, 30, 60] * 2


# Videos


def test_a_video_becomes_a_video(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("av")
    video(Path("a.mp4"), 6, sound=True)
    out = well(capsys, *GRAY, "a.mp4", "-o", "b.mp4")
    assert out.startswith("b.mp4: 6 frames 64x48 by reference in ")
    assert np.abs(np.array(grays(Path("b.mp4"))) - [20, 30, 40, 50, 60, 70]).max() <= 3
    well(capsys, *GRAY, "a.mp4", "-o", "c.%d.png")
    assert abs(value(Path("c.6.png")) - 70) <= 3
    well(capsys, *GRAY, "c.%d.png", "-o", "d.mkv", "--rate", "12.5", "--codec", "ffv1")
    assert len(grays(Path("d.mkv"))) == 6


def test_a_folder_of_pictures_and_videos(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("av")
    sequence(Path("a"), [1, 2])
    video(Path("a/b.mp4"), 3)
    video(Path("a/c.mkv"), 4)
    out = well(capsys, *TINY, "a", "-o", "out")
    assert names_in("out") == ["b.mp4", "c.mkv", "in.0001.png", "in.0002.png"]
    assert [line.split(" by ")[0] for line in out.splitlines()] == [
        "out: 2 frames 6x4", "out/b.mp4: 3 frames 64x48", "out/c.mkv: 4 frames 64x48",
    ]  # fmt: skip
    Path("a/b.mp4").write_bytes(b"broken")
    again = Outcome(capsys, *TINY, "a", "-o", "again")
    assert (again.status, names_in("again")) == (1, ["c.mkv", "in.0001.png", "in.0002.png"])
    assert again.err.startswith("passgraph: error: a/b.mp4: cannot be read as a video")


def test_several_videos_by_number_into_a_folder(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("av")
    for number in (1, 2):
        video(Path(f"a{number}.mp4"), 1 + number)
    well(capsys, *TINY, "a%d.mp4", "-o", "out")
    assert [len(grays(Path("out", name))) for name in names_in("out")] == [2, 3]


def test_resume_keeps_a_whole_video(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("av")
    video(Path("a.mp4"), 3)
    assert "3 frames" in well(capsys, *TINY, "a.mp4", "-o", "b.mp4", "--resume")
    before = Path("b.mp4").stat().st_mtime_ns
    assert well(capsys, *TINY, "a.mp4", "-o", "b.mp4", "--resume") == "b.mp4: is there already\n"
    assert Path("b.mp4").stat().st_mtime_ns == before
    os.utime("a.mp4")
    assert "3 frames" in well(capsys, *TINY, "a.mp4", "-o", "b.mp4", "--resume")


# What fails


def test_a_broken_frame_is_named_and_the_rest_done(capsys: pytest.CaptureFixture[str]) -> None:
    sequence(Path("a"), range(1, 6))
    Path("a/in.0002.png").write_bytes(b"no picture")
    outcome = Outcome(capsys, *TINY, "a", "-o", "out")
    assert outcome.status == 1
    assert names_in("out") == [f"in.000{n}.png" for n in (1, 3, 4, 5)]
    assert outcome.err.startswith("passgraph: error: a/in.0002.png: not a picture that can be read")
    assert outcome.err.count("\n") == 1
    assert outcome.out.startswith("out: 4 frames 6x4 by reference in ")
    assert outcome.out.endswith(", 1 frame failed\n")


def test_resume_does_what_is_left(capsys: pytest.CaptureFixture[str]) -> None:
    sequence(Path("a"), range(1, 6))
    well(capsys, *TINY, "a", "-o", "out")
    Path("out/in.0003.png").unlink()
    out = well(capsys, *TINY, "a", "-o", "out", "--resume")
    assert out.startswith("out: 1 frame 6x4 by reference in ")
    assert out.endswith(", 4 frames there already\n")
    one = [*TINY, "a/in.0001.png", "-o", "out/one.png", "--resume"]
    well(capsys, *one)
    assert well(capsys, *one) == "out/one.png: is there already\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a/in.0001.png", "-o", "a/in.0001.png"], "would overwrite the input a/in.0001.png; give the output another"),
        (["a", "-o", "a"], "a/in.0001.png: would overwrite the input"),
        (["a/in.####.png", "-o", "a/in.%04d.png"], "a/in.0001.png: would overwrite the input"),
        (["a/in.####.png", "-o", "link.#.png"], "link.2.png: would overwrite the input a/in.0001.png"),
        (["a", "b", "-o", "out/"], "out/in.0001.png: a/in.0001.png and b/in.0001.png would both be written to it"),
        (["a", "b", "-o", "c.#.png"], "c.1.png: a/in.0001.png and b/in.0001.png would both be written to it"),
        (["a/in.0001.png", "a/in.0001.png", "-o", "out/"], "would both be written to it; run them apart"),
        (["a", "b", "-o", "c.mp4"], "c.mp4: a and b would all be written to it; give a folder"),
        (["a", "a/in.0001.png", "b", "-o", "c.png"], "c.png: a and a/in.0001.png and others would all be written"),
        (["a/*.png", "-o", "c.png"], "c.png: is one picture, and there are 2 frames of a/*.png; give a folder"),
        (["a", "-o", "c.png"], "a: is a directory; expected a picture file"),
        (["a", "-o", "none/out"], "none/out: cannot be made a folder"),
        (["a", "-o", "none/out/out.#.png"], "none/out: cannot be made a folder"),
        (["a", "-o", "out.#.abc"], "unknown suffix '.abc'"),
        (["a", "-o", "a/in.0001.png/"], "cannot be made a folder"),
        (["none", "-o", "out/"], "none: no such file"),
        (["none*.png", "-o", "out/"], "none*.png: no file has such a name; check the wildcard"),
        (["none.####.png", "-o", "out/"], "none.####.png: no file has such a name; check the folder"),
        (["a", "-o", "out/", "--capture", "steps"], "--capture shows the passes of one picture"),
        (["a", "-o", "out/", "--jobs", "0"], "0 is not in the range 1<=x<=256"),
        (["a", "-o", "out.mp4", "--rate", "0"], "--rate '0': expected frames a second"),
        (["a", "-o", "out.mp4", "--rate", "1/0"], "--rate '1/0': expected frames a second"),
        (["a", "-o", "out.mp4", "--rate", "1e9999999"], "--rate '1e9999999': expected frames a second"),
        (["a", "-o", "out.mp4", "--rate", "1/1000000"], "--rate '1/1000000': expected frames a second from 1/1000"),
        (["a", "-o", "out.mp4", "--codec", "none"], "out.mp4: no encoder 'none' for such a file"),
        (["a", "-o", "out.mp4", "--codec-option", "crf"], "--codec-option 'crf': expected KEY=VALUE"),
        (["a", "-o", "out/", "--rate", "25"], "--rate, --codec and --codec-option are for videos, and none is written"),
        (["b/whole.mp4", "-o", "out.mp4", "--rate", "25"], "frames of a video keep their times; leave it out"),
        (["a", "-o", "out/", "--raw", "rgb24"], "--raw is for streams, and none is read or written"),
        (["a", "-o", "out/", "--raw", "wrong"], "'wrong' is not a layout of raw pixels"),
        (["-", "-o", "out/"], "nothing names the files of standard input; give numbers: -o out/%04d.png"),
        (["-", "-o", "out.#.png", "--raw", "rgb24"], "raw pixels have no size of their own"),
        (["b/video.mp4", "-o", "out.mp4"], "b/video.mp4: cannot be read as a video"),
    ],
)
def test_refusals(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    pytest.importorskip("av")
    sequence(Path("a"), [1, 2])
    sequence(Path("b"), [1])
    Path("b/video.mp4").write_bytes(b"broken")
    if "b/whole.mp4" in arguments:
        video(Path("b/whole.mp4"), 2)
    if arguments[:2] == ["a", "b"] or "b" in arguments:
        Path("b/video.mp4").unlink()
    os.link("a/in.0001.png", "link.2.png")
    assert message in refused(capsys, *TINY, *arguments)


def test_a_hard_link_to_the_input_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    sequence(Path("a"), [1])
    os.link("a/in.0001.png", "same.png")
    assert "same.png: would overwrite the input a/in.0001.png" in refused(
        capsys, *TINY, "a/in.0001.png", "-o", "same.png"
    )


# The process itself


def passgraph(*arguments: str, **how: Any) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([sys.executable, "-m", "passgraph", *arguments], capture_output=True, check=False, **how)


def test_streams_of_pictures_and_of_raw_pixels() -> None:
    sequence(Path("a"), [1, 2, 3])
    stream = b"".join(Path(f"a/in.000{n}.png").read_bytes() for n in (1, 2, 3))
    done = passgraph(*TINY, "-", "-o", "-", input=stream)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count(b"IEND") == 3
    assert done.stderr.startswith(b"standard output: 3 frames 6x4 by reference in ")
    raw = passgraph(*TINY, "-", "-o", "-", "--raw", "2x1:rgb24", input=bytes(range(12)))
    assert raw.stdout == bytes(range(12))
    cut = passgraph(*TINY, "-", "-o", "out.#.png", input=stream[:-20])
    assert cut.returncode == 1
    assert cut.stderr == b"passgraph: error: standard input, picture 3: truncated; the stream ends inside it\n"
    assert [value(Path(f"out.{n}.png")) for n in (1, 2)] == [10, 20]
    assert not Path("out.3.png").exists()


def test_ctrl_c_keeps_what_is_whole() -> None:
    sequence(Path("a"), range(1, 25), (400, 300))
    command = [sys.executable, "-m", "passgraph", "apply", "gaussian-blur", "a", "-o", "out", "-b", "numpy", "-j", "2"]
    process = subprocess.Popen(
        [*command, "--sigma-px", "20"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    while process.poll() is None and not list(Path("out").glob("[!.]*.png")):
        time.sleep(0.002)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert "Traceback" not in err
    assert all(pg.load(path).shape == (300, 400, 4) for path in Path("out").glob("*.png"))
    if process.returncode == 0:
        return  # it was faster than this test
    assert process.returncode == 130
    assert err.strip().startswith("passgraph: interrupted after ")
    assert " of 24 frames of a; " in err
    assert out == ""


def test_a_reader_that_goes_away() -> None:
    """What it leaves unread is more than a pipe holds."""
    Path("a").mkdir()
    noise = np.random.default_rng(0).integers(0, 256, (150, 200, 3), np.uint8)
    for number in range(1, 20):
        pg.save(f"a/in.{number:04d}.png", noise)
    command = f"{sys.executable} -m passgraph apply gaussian-blur --sigma-px 0 -b numpy a -o -"
    shell = f"{command} | head -c 100 > head.bin; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", shell], capture_output=True, check=False)
    assert (done.stdout, done.stderr) == (b"141\n", b"")


def test_progress_is_shown_on_a_terminal_only() -> None:
    import pty

    sequence(Path("a"), range(1, 6))
    Path("a/in.0003.png").write_bytes(b"no picture")
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-m", "passgraph", *TINY, "a", "-o", "out"], stdout=subprocess.PIPE, stderr=theirs,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "120"},
    ) as process:  # fmt: skip
        os.close(theirs)
        shown = b""
        try:
            while part := os.read(ours, 4096):
                shown += part
        except OSError:  # the other end is closed
            pass
        assert process.wait() == 1
    os.close(ours)
    assert b"/5" in shown
    assert b"in.0003.png: not a picture that can be read" in shown


# The documentation


def test_commands_of_the_documentation_run(capsys: pytest.CaptureFixture[str]) -> None:
    """Those of docs/frames.md that need no other program."""
    pytest.importorskip("av")
    pytest.importorskip("OpenEXR")
    text = (Path(__file__).resolve().parents[2] / "docs" / "frames.md").read_text()
    block = text.split("```sh\n")[1].split("```")[0]
    commands = [shlex.split(line.split("  #")[0].split(" # ")[0]) for line in block.splitlines() if "|" not in line]
    assert len(commands) >= 5
    Path("photos").mkdir()
    for number in (1, 2):
        pg.save(f"photos/{number}.jpg", picture(9)[..., :3])
        pg.save(f"frame.{number}.png", picture(9, (32, 32)))
        pg.save(f"shot.{number:04d}.exr", picture(9))
    video(Path("clip.mov"), 3, sound=True)
    Image.fromarray(picture(9)).save("cat.gif", save_all=True, append_images=[Image.fromarray(picture(8))])
    for command in commands:
        assert command[0] == "passgraph"
        well(capsys, *command[1:], "-b", "reference")
