"""Effects that treat channels alike take and give pictures of one and two channels, in memory and in files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest
import scipy.ndimage
import tifffile

import passgraph as pg
from passgraph.effects.effect_table import EFFECTS
from passgraph.effects.filters.blur import gaussian_blur
from passgraph.effects.pictures.alpha import on_straight_alpha
from tests.commands.told import Outcome

ALIKE = sorted(name for name in EFFECTS if EFFECTS[name].alike)
GRAY = np.random.default_rng(1).random((24, 30, 1), np.float32)
DEPTH = 1.0 + GRAY


def applied(name: str, frame: Any, format_: str | None, **options: Any) -> Any:
    effect = EFFECTS[name]
    depth = [pg.Input("depth", "r32f")] if effect.takes == "picture+depth" else []
    given = {"depth": DEPTH} if depth else {}
    with pg.compile(effect.build(pg.Input("frame", format_), *depth, **options)) as program:
        return next(iter(program(frame=frame, **given).values()))


@pytest.mark.parametrize("name", ALIKE)
@pytest.mark.parametrize(("format_", "channels", "most"), [("r32f", 1, 1), ("rg32f", 2, 1), ("r16", 1, 65535)])
def test_one_channel_is_that_of_a_picture_of_four(name: str, format_: str, channels: int, most: int) -> None:
    one = GRAY if most == 1 else (GRAY * most).astype(np.uint16)
    four = np.concatenate([one, one, one, np.full_like(one, most)], axis=2)
    got = applied(name, np.repeat(one, channels, axis=2), format_)
    assert got.shape[2] == channels
    assert np.array_equal(got, applied(name, four, None)[..., :channels])


@pytest.mark.parametrize("name", ALIKE)
def test_a_target_takes_the_first_channels(name: str) -> None:
    four = np.random.default_rng(2).random((24, 30, 4), np.float32)
    whole = applied(name, four, "rgba32f")
    for letters in ("r", "rg", "rgb"):
        got = applied(name, four, "rgba32f", into=pg.target("o", f"{letters}32f"))
        assert np.array_equal(got, whole[..., : len(letters)])


def test_the_blur_of_one_channel_is_that_of_scipy() -> None:
    blur = gaussian_blur(pg.Input("f", "r32f"), sigma_px=2.0, radius_px=8, into=pg.target("o", "r32f"))
    with pg.compile(blur) as program:
        got = program(f=GRAY)["o"][..., 0]
    expected = scipy.ndimage.gaussian_filter(GRAY[..., 0].astype(np.float64), 2.0, mode="nearest", radius=8)
    assert np.abs(got - expected).max() < 1e-6


def test_the_graph_can_be_sent() -> None:
    blur = gaussian_blur(pg.Input("f", "r32f"), into=pg.target("o", "r32f"))
    with pg.compile(blur) as program, pg.compile(pg.from_data(pg.to_data({"o": blur}))) as other:
        assert np.array_equal(program(f=GRAY)["o"], other(f=GRAY)["o"])


def test_gray_has_no_alpha_to_convert() -> None:
    soft = on_straight_alpha(gaussian_blur)(pg.Input("f", "r32f"), into=pg.target("o", "r32f"))
    with pg.compile(soft) as program:
        assert np.array_equal(program(f=GRAY)["o"], applied("gaussian-blur", GRAY, "r32f"))


def test_other_kernels_still_need_a_target_of_four_channels() -> None:
    dim = pg.kernel(source="def dim(color: Image) -> vec4: return color[0, 0] * 0.5")
    with pytest.raises(pg.GraphError, match=r"returns vec4, and target 'o' has 1 channel\(s\)"):
        dim(pg.Input("f"), into=pg.target("o", "r32f"))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    codes = (GRAY[..., 0] * 65535).astype(np.uint16)
    PIL.Image.fromarray((codes >> 8).astype(np.uint8)).save("a.png")
    PIL.Image.fromarray(codes).save("deep.png")
    alpha = np.dstack([codes >> 8, np.full_like(codes, 255)]).astype(np.uint8)
    alpha[3:9, 4:20, 1] = 77
    PIL.Image.fromarray(alpha, "LA").save("alpha.png")
    tifffile.imwrite("a.tif", codes)


@pytest.mark.parametrize(
    ("name", "effect", "mode"),
    [
        ("a.png", "unsharp", "L"),
        ("deep.png", "median", "I;16"),
        ("alpha.png", "gaussian-blur", "LA"),
        ("a.png", "tone-map", "L"),
        ("a.png", "sepia", "RGB"),
        ("alpha.png", "sepia", "RGBA"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_files_keep_their_channels(name: str, effect: str, mode: str, capsys: pytest.CaptureFixture[str]) -> None:
    outcome = Outcome(capsys, "apply", effect, name, "-o", "b.png")
    assert outcome.status == 0, outcome.err
    with PIL.Image.open("b.png") as made:
        assert made.mode == mode


@pytest.mark.usefixtures("folder")
def test_a_gray_tiff_stays_gray_and_deep_in_tiles_and_whole(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = Outcome(capsys, "apply", "unsharp", "a.tif", "-o", "b.tif")
    assert outcome.status == 0, outcome.err
    whole = tifffile.imread("b.tif")
    assert (whole.shape, whole.dtype) == ((24, 30), np.uint16)
    sharp = EFFECTS["unsharp"].build(pg.Input("frame", "r16"), into=pg.target("o", "r16"))
    pg.tiled(sharp, "a.tif", "c.tif", tile=(16, 16), progress=False)
    assert np.array_equal(tifffile.imread("c.tif"), whole)
