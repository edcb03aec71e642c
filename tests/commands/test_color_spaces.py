"""Color spaces around an effect on the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import PyOpenColorIO as ocio
import pytest

import passgraph as pg
from passgraph.commands import main
from passgraph.commands.color_spaces import ConvertedEffect, take_color_spaces
from passgraph.effects.effect_table import EFFECTS

CONFIG = "ocio://cg-config-v4.0.0_aces-v2.0_ocio-v2.5"
PICTURE = np.random.default_rng(2).random((16, 24, 3)).astype(np.float32)


def run(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    return int(ended.value.code or 0)


def blurred(tmp_path: Path, name: str, *words: str) -> np.ndarray:
    """A blur of no width, so that only the color spaces change the picture."""
    source, result = tmp_path / name, tmp_path / f"out{Path(name).suffix}"
    if not source.exists():
        pg.save(source, PICTURE)
    assert run("apply", "gaussian-blur", str(source), "-o", str(result), "--radius-px", "0", *words) == 0
    return pg.load(result)


def test_a_picture_comes_back_in_its_own_space(tmp_path: Path) -> None:
    same = blurred(tmp_path, "photo.png", "--from-space", "sRGB Encoded Rec.709 (sRGB)", "--color-config", CONFIG)
    np.testing.assert_array_equal(same, pg.load(tmp_path / "photo.png"))


def test_a_layer_of_a_float_file_is_light(tmp_path: Path) -> None:
    plate = np.ones((2, 3, 3), np.float32) * 0.5
    pg.save(tmp_path / "plate.exr", plate)
    options = {"alpha": "premultiplied", "from_space": None, "to_space": "ACEScct", "color_config": None}
    effect = take_color_spaces(EFFECTS["bloom"], (f"{tmp_path}/plate.exr:diffuse",), "out.png", options)
    assert isinstance(effect, ConvertedEffect)
    assert (effect.source, effect.result, options) == ("lin_rec709", "ACEScct", {"linear": False})


@pytest.mark.parametrize(("name", "space"), [("plate.exr", "lin_rec709"), ("photo.png", "srgb_tx")])
def test_what_a_file_holds_is_known_from_its_kind(tmp_path: Path, name: str, space: str) -> None:
    found = blurred(tmp_path, name, "--to-space", "ACEScct", "--color-config", CONFIG)
    expected = pg.load(tmp_path / name)
    processor = ocio.Config.CreateFromFile(CONFIG).getProcessor(space, "ACEScct")
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGBA(expected)
    np.testing.assert_allclose(found, expected, atol=1e-5 if name.endswith("exr") else 0.51 / 255)


def test_the_effect_works_in_light(tmp_path: Path) -> None:
    """Half black and half white blur to half of the light, which sRGB encodes as 188."""
    halves = np.repeat(np.array([[0.0], [1.0]]), [12, 12], axis=0).reshape(1, 24, 1) * np.ones((16, 1, 3))
    pg.save(tmp_path / "halves.png", halves.astype(np.float32))
    words = ("--radius-px", "8", "--from-space", "sRGB Encoded Rec.709 (sRGB)", "--color-config", CONFIG)
    source, result = str(tmp_path / "halves.png"), str(tmp_path / "out.png")
    assert run("apply", "gaussian-blur", source, "-o", result, *words) == 0
    middle = pg.load(result)[8, 11:13, 0].mean()
    assert abs(middle * 255 - 188) < 3


def test_several_files_go_the_same_way(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        pg.save(tmp_path / name, PICTURE)
    words = ("--from-space", "srgb_tx", "--to-space", "ACEScct", "--color-config", CONFIG, "--radius-px", "0")
    files = (str(tmp_path / "a.png"), str(tmp_path / "b.png"))
    assert run("apply", "gaussian-blur", *files, "-o", str(tmp_path / "out"), *words) == 0
    one = blurred(tmp_path, "a.png", *words[:6])
    np.testing.assert_array_equal(pg.load(tmp_path / "out" / "b.png"), one)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--from-space", "ACESgc"), "did you mean 'ACEScg'"),
        (("--color-config", CONFIG), "--from-space or --to-space"),
    ],
)
def test_wrong_spaces_are_told(
    tmp_path: Path, words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    pg.save(tmp_path / "a.png", PICTURE)
    assert run("apply", "gaussian-blur", str(tmp_path / "a.png"), "-o", str(tmp_path / "b.png"), *words) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "b.png").exists()


@pytest.mark.sampled
@pytest.mark.parametrize("suffix", [".png", ".jpg", ".exr"])
@pytest.mark.parametrize("effect", ["cas", "color-grade", "tilt-shift", "radial-blur", "gaussian-blur --linear"])
def test_results_in_linear_light_are_encoded_for_files_of_integers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, effect: str, suffix: str
) -> None:
    """Even areas stay as they are, in one file and in several; a file of floats gets linear light."""
    monkeypatch.chdir(tmp_path)
    gray = np.full((9, 9, 4), 0.5, np.float32)
    gray[..., 3] = 1.0
    for name in ("a", "b"):
        pg.save(f"{name}.png", gray)
    assert run("apply", *effect.split(), "a.png", "-o", f"one{suffix}") == 0
    assert run("apply", *effect.split(), "a.png", "b.png", "-o", f"many%d{suffix}") == 0
    stored = np.float32(128 / 255)
    expected = ((stored + 0.055) / 1.055) ** 2.4 if suffix == ".exr" else stored
    files = sorted(tmp_path.glob(f"[om]*{suffix}"))
    assert len(files) == 3
    for file in files:
        np.testing.assert_allclose(pg.load(file)[4, 4, :3], expected, atol=1e-4, err_msg=file.name)


def test_a_tone_map_encodes_by_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    light = np.full((4, 4, 4), 0.25, np.float32)
    pg.save("light.exr", light)
    assert run("apply", "tone-map", "light.exr", "-o", "shown.png", "--curve", "linear", "--alpha", "ignored") == 0
    np.testing.assert_allclose(pg.load("shown.png")[0, 0, 0], 1.055 * 0.25 ** (1 / 2.4) - 0.055, atol=1 / 255)
