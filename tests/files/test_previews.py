"""``--frames``, ``--proxy`` and ``--contact-sheet``: some frames, smaller frames, frames side by side."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.commands import main
from passgraph.errors import InputError
from passgraph.files import Arrays, ToArrays
from passgraph.files.frame_range import FrameRange
from passgraph.proxies import reduced, sampled

SAME = ("gaussian-blur", "--radius-px", "0")


def apply(*words: str, folder: Path) -> int:
    with contextlib.chdir(folder), pytest.raises(SystemExit) as ended:
        main(["apply", *words])
    return int(ended.value.code or 0)


def shots(folder: Path, numbers: Any, size: tuple[int, int] = (6, 8)) -> None:
    for number in numbers:
        pg.save(folder / f"shot.{number:04}.png", np.full((*size, 3), number % 256, np.uint8))


def numbers_in(folder: Path) -> list[int]:
    return sorted(int(path.name.split(".")[1]) for path in folder.glob("out.*"))


@pytest.mark.parametrize(
    ("text", "expected"),
    [("3-5", [3, 4, 5]), ("1-9x3", [1, 4, 7]), ("2,6-7", [2, 6, 7]), ("4-4", [4]), ("-2-0", [-2, -1, 0])],
)
def test_ranges(text: str, expected: list[int]) -> None:
    frames = FrameRange.parsed(text)
    assert [number for number in range(-10, 20) if number in frames] == expected
    assert frames.last == expected[-1]


@pytest.mark.parametrize("text", ["", "a", "5-3", "1-9x0", "1-", "1--", "1-2-3", "1,,2"])
def test_ranges_that_are_none(text: str) -> None:
    with pytest.raises(InputError, match="expected numbers or ranges, FIRST-LAST or FIRST-LASTxSTEP"):
        FrameRange.parsed(text)


def test_frames_of_a_sequence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shots(tmp_path, range(1001, 1021))
    assert apply(*SAME, "shot.####.png", "-o", "out.####.png", "--frames", "1003-1011x4", folder=tmp_path) == 0
    assert numbers_in(tmp_path) == [1003, 1007, 1011]
    assert pg.load(tmp_path / "out.1007.png")[0, 0, 0] * 255 == pytest.approx(1007 % 256)
    assert "3 frames" in capsys.readouterr().out
    assert apply(*SAME, "shot.####.png", "-o", "out.####.png", "--frames", "1019-1022", folder=tmp_path) == 0
    assert "frames 1021, 1022 are not there" in capsys.readouterr().err
    assert apply(*SAME, "shot.####.png", "-o", "out.####.png", "--frames", "5-6", folder=tmp_path) == 2
    assert "has the frames 1001 to 1020, and none of those" in capsys.readouterr().err


def test_a_frame_is_the_same_alone(tmp_path: Path) -> None:
    """What changes over the frames depends on the whole sequence; a second sequence stays in step."""
    shots(tmp_path, range(1, 9))
    fade = tmp_path / "fade.py"
    fade.write_text(
        "import passgraph as pg\nfrom passgraph.language import Image, vec4\n\n@pg.kernel\n"
        "def fade(color: Image, to: Image, share: float = 0.5) -> vec4:\n"
        "    return color[0, 0] * (1.0 - share) + to[0, 0] * share\n"
    )
    for number in range(1, 9):
        pg.save(tmp_path / f"other.{number}.png", np.full((6, 8, 3), 255 - 20 * number, np.uint8))
    words = ("fade.py", "shot.####.png", "--to", "other.#.png", "--share", "0..1")
    assert apply(*words, "-o", "all.#.png", folder=tmp_path) == 0
    assert apply(*words, "-o", "out.#.png", "--frames", "4-8x2", folder=tmp_path) == 0
    assert numbers_in(tmp_path) == [4, 6, 8]
    for number in (4, 6, 8):
        assert (tmp_path / f"out.{number}.png").read_bytes() == (tmp_path / f"all.{number}.png").read_bytes()


def test_history_sees_all_frames() -> None:
    """A mean of all frames so far; those that are left out count, and none after the last is read."""
    total = pg.target("total", "rgba32f")
    add = pg.kernel(source="def add(now: Image, before: Image) -> vec4: return now[0, 0] + before[0, 0]")
    frames = [np.full((2, 3, 4), 2.0**i, np.float32) for i in range(6)]
    made = ToArrays()
    with pg.compile(add(pg.Input("now"), pg.previous(total), into=total), backend="numpy") as program:
        summary = pg.frames(program, Arrays(frames), made, select=[2, 4])
    assert [float(one[0, 0, 0]) for one in made.pictures] == [3.0, 15.0]
    assert (summary.written, summary.kept) == (2, 0)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("shot.0001.png", "--frames", "1-2", "-o", "out.png"), "is one picture; give a sequence, or a NUMBER"),
        (("shot.####.png", "--frames", "2-1", "-o", "out.#.png"), "expected numbers or ranges"),
        (("shot.####.png", "--frames", "0", "-o", "out.#.png"), "0 is not in the range"),
        (("shot.####.png", "--proxy", "2", "-o", "out.#.png"), "'2': expected 1/2 to 1/64"),
        (("shot.####.png", "--contact-sheet", "4", "-o", "s.png"), "'4': expected COLUMNSxROWS of 1 to 64"),
        (("shot.####.png", "--contact-sheet", "2x1", "-o", "s.exr"), "a contact sheet has 8 bits a channel"),
        (
            ("shot.0001.png", "--proxy", "1/2", "--capture", "c", "-o", "out.png"),
            "--proxy and --contact-sheet make frames",
        ),
    ],
)
def test_mistakes(tmp_path: Path, words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    shots(tmp_path, (1, 2))
    assert apply(*SAME, *words, folder=tmp_path) == 2
    assert said in " ".join(capsys.readouterr().err.split())


def test_videos_are_not_cut(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("av")
    shots(tmp_path, range(1, 6), (16, 16))
    assert apply(*SAME, "shot.####.png", "-o", "clip.mkv", "--codec", "ffv1", folder=tmp_path) == 0
    assert apply(*SAME, "clip.mkv", "-o", "cut.mkv", "--frames", "2-3", folder=tmp_path) == 2
    assert "--frames does not cut videos" in capsys.readouterr().err
    assert apply(*SAME, "clip.mkv", "-o", "out.#.png", "--frames", "2-5x3", folder=tmp_path) == 0
    assert numbers_in(tmp_path) == [2, 5]


def test_means_and_samples() -> None:
    rng = np.random.default_rng(1)
    picture = rng.random((12, 18, 3), np.float32)
    pillow = np.stack([np.asarray(Image.fromarray(picture[..., i]).reduce(3)) for i in range(3)], axis=-1)
    np.testing.assert_allclose(reduced(picture, 3), pillow, atol=1e-6)
    assert np.array_equal(sampled(picture, 3), picture[1::3, 1::3])
    assert reduced(picture, 5).shape == sampled(picture, 5).shape == (3, 4, 3)


def test_colors_count_by_their_alpha() -> None:
    picture = np.float32([[[1, 0, 0, 1], [0, 1, 0, 0]], [[1, 0, 0, 1], [9, 9, 9, 0]]])
    assert reduced(picture, 2).tolist() == [[[1, 0, 0, 0.5]]]
    assert reduced(np.zeros((2, 2, 4), np.float32) + np.float32([0.5, 0, 0, 0]), 2).tolist() == [[[0.5, 0, 0, 0]]]


def test_a_proxy_looks_like_the_picture_made_small(tmp_path: Path) -> None:
    """Radii are scaled: a blur of half the picture is the half of the blur."""
    y, x = np.mgrid[:128, :160]
    picture = np.stack([np.hypot(x - 80, y - 64) < 30, x > 100, (x // 16 + y // 16) % 2], -1).astype(np.float32)
    pg.save(tmp_path / "a.exr", picture)
    blur = ("gaussian-blur", "a.exr", "--sigma-px", "8")
    assert apply(*blur, "-o", "full.exr", folder=tmp_path) == 0
    assert apply(*blur, "-o", "small.exr", "--proxy", "1/4", folder=tmp_path) == 0
    small, expected = pg.load(tmp_path / "small.exr"), reduced(pg.load(tmp_path / "full.exr"), 4)
    assert small.shape == (32, 40, 4)
    assert abs(small - expected).max() < 0.03
    assert apply("gaussian-blur", "a.exr", "--sigma-px", "2", "-o", "same.exr", folder=tmp_path) == 0
    assert abs(reduced(pg.load(tmp_path / "same.exr"), 4) - expected).max() > 0.1


def test_defaults_and_ramps_are_scaled(tmp_path: Path) -> None:
    """Squares of 8 pixels by default are squares of 4 at half the size; of 2 to 16, of 1 to 8."""
    rng = np.random.default_rng(3)
    for number in (1, 2):
        pg.save(tmp_path / f"shot.{number:04}.png", rng.integers(0, 256, (32, 32, 3), np.uint8))
    assert apply("pixelate", "shot.####.png", "-o", "out.#.png", "--proxy", "1/2", folder=tmp_path) == 0
    made = pg.load(tmp_path / "out.1.png")
    assert made.shape == (16, 16, 4)
    assert all(np.ptp(made[y : y + 4, x : x + 4], axis=(0, 1)).max() == 0 for y in (0, 4) for x in (0, 4))
    assert np.ptp(made[0:8, 0:8], axis=(0, 1)).max() > 0


def test_velocity_is_scaled(tmp_path: Path) -> None:
    """A point that moves by 16 pixels is a streak of 8 at half the size, of a still and of a sequence of velocities."""
    picture = np.zeros((16, 64, 3), np.float32)
    picture[6:10, 30:34] = 1
    depth, motion = np.ones((16, 64), np.float32), np.zeros((16, 64, 3), np.float32)
    motion[..., 0] = 16
    for name, one in (("a.0001", picture), ("z", depth), ("v", motion), ("v.0001", motion)):
        pg.save(tmp_path / f"{name}.exr", one)
    lengths = []
    for velocity in ("v.exr", "v.####.exr"):
        for proxy in ((), ("--proxy", "1/2")):
            words = ("motion-blur", "a.####.exr", "--depth", "z.exr", "--velocity", velocity, *proxy)
            assert apply(*words, "-o", "out.#.exr", folder=tmp_path) == 0
            lengths.append(int((pg.load(tmp_path / "out.1.exr")[..., 0].max(axis=0) > 0.01).sum()))
    assert lengths[0] == lengths[2]
    assert lengths[1] == lengths[3]
    assert abs(lengths[1] - lengths[0] / 2) <= 1


def test_a_contact_sheet(tmp_path: Path) -> None:
    shots(tmp_path, range(1, 24), (60, 80))
    assert apply(*SAME, "shot.####.png", "-o", "sheet.png", "--contact-sheet", "3x2", folder=tmp_path) == 0
    sheet = np.asarray(Image.open(tmp_path / "sheet.png"))
    assert sheet.shape == (2 * 64 + 4, 3 * 84 + 4, 3)
    centers = [sheet[4 + 64 * row + 40, 4 + 84 * column + 40, 0] for row in range(2) for column in range(3)]
    assert centers == [1, 5, 10, 14, 19, 23]
    words = ("--contact-sheet", "8x1", "--frames", "2-6x2", "--proxy", "1/2")
    assert apply(*SAME, "shot.####.png", "-o", "sheet.png", *words, folder=tmp_path) == 0
    sheet = np.asarray(Image.open(tmp_path / "sheet.png"))
    assert sheet.shape == (34 + 4, 3 * 44 + 4, 3)
    assert [sheet[25, 4 + 44 * column + 30, 0] for column in range(3)] == [2, 4, 6]


def test_large_frames_are_reduced_for_a_sheet(tmp_path: Path) -> None:
    shots(tmp_path, (1, 2), (300, 2000))
    assert apply(*SAME, "shot.####.png", "-o", "sheet.jpg", "--contact-sheet", "2x1", folder=tmp_path) == 0
    with Image.open(tmp_path / "sheet.jpg") as sheet:
        assert sheet.size == (2 * 671 + 4, 104 + 4)
