"""Several effects in one command: the same picture as one after another, in one plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.commands.effect_chain import EffectChain
from passgraph.commands.named import is_named, named_effect
from passgraph.effects.effect_table import EFFECTS
from tests.commands.told import Outcome, refused


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    random = np.random.default_rng(4)
    picture = random.random((24, 32, 4)).astype(np.float32)
    np.save("clear.npy", picture)
    picture[..., 3] = 1.0
    np.save("opaque.npy", picture)


def well(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    outcome = Outcome(capsys, *arguments)
    assert (outcome.status, outcome.err) == (0, "")
    return outcome.out


def shown(name: str) -> NDArray[np.float32]:
    return pg.load(name)


@pytest.mark.parametrize("picture", ["opaque.npy", "clear.npy"])
@pytest.mark.parametrize("names", [["gaussian-blur", "vignette"], ["sepia", "unsharp", "glitch"], ["bloom", "bloom"]])
def test_a_chain_gives_what_its_effects_give_one_after_another(
    names: list[str], picture: str, capsys: pytest.CaptureFixture[str]
) -> None:
    well(capsys, "apply", ", ".join(names), picture, "-o", "chain.npy", "-b", "reference")
    before = picture
    for number, name in enumerate(names):
        well(capsys, "apply", name, before, "-o", f"{number}.npy", "-b", "reference")
        before = f"{number}.npy"
    np.testing.assert_allclose(shown("chain.npy"), shown(before), rtol=1e-5, atol=1e-6)


def test_parameters_have_the_name_of_their_effect_before_them(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--bloom-threshold", "0.2", "--bloom-2-intensity", "0.9", "--vignette-strength", "3"]
    well(capsys, "apply", "bloom,bloom,vignette", "opaque.npy", "-o", "chain.npy", *options, "-b", "reference")
    well(capsys, "apply", "bloom", "opaque.npy", "-o", "1.npy", "--threshold", "0.2", "-b", "reference")
    well(capsys, "apply", "bloom", "1.npy", "-o", "2.npy", "--intensity", "0.9", "-b", "reference")
    well(capsys, "apply", "vignette", "2.npy", "-o", "3.npy", "--strength", "3", "-b", "reference")
    np.testing.assert_allclose(shown("chain.npy"), shown("3.npy"), rtol=1e-5, atol=1e-6)


def test_light_is_linear_for_those_that_want_it(capsys: pytest.CaptureFixture[str]) -> None:
    """Behind `tone-map`, whose result is for a display, `cas` gets linear light again, and its result is encoded."""
    pg.save("photo.png", np.load("opaque.npy"))
    well(capsys, "apply", "tone-map, cas", "photo.png", "-o", "chain.png", "-b", "reference")
    well(capsys, "apply", "tone-map", "photo.png", "-o", "1.png", "--bits", "16", "-b", "reference")
    well(capsys, "apply", "cas", "1.png", "-o", "2.png", "--bits", "8", "-b", "reference")
    np.testing.assert_allclose(shown("chain.png"), shown("2.png"), atol=1.01 / 255)
    assert np.abs(shown("chain.png") - shown("1.png"))[..., :3].max() > 0.02


def test_passes_of_different_effects_fuse(capsys: pytest.CaptureFixture[str]) -> None:
    pg.save("photo.png", np.load("opaque.npy"))
    assert "1 step" in well(capsys, "plan", "photo.png", "--effect", "sepia, vignette, hue-saturation")


def test_a_sequence_and_a_parameter_that_changes(capsys: pytest.CaptureFixture[str]) -> None:
    line = ["apply", "sepia, vignette", "opaque.npy", "--frames", "3", "--vignette-strength", "0..4", "-b", "reference"]
    well(capsys, *line, "-o", "f.%d.npy")
    assert shown("f.3.npy").sum() < shown("f.2.npy").sum() < shown("f.1.npy").sum()


def test_effects_of_my_file_are_parts(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.txt").write_text("def dark(color: Image, share: float = 0.5) -> vec4:\n    return color[0, 0] * share\n")
    well(capsys, "apply", "own.txt, sepia", "opaque.npy", "-o", "chain.npy", "--dark-share", "0", "-b", "reference")
    assert shown("chain.npy")[..., :3].max() == 0.0


@pytest.mark.parametrize(
    ("chain", "words"),
    [
        ("bloom, soft-shadow", "effect soft-shadow takes a scene; in a chain each takes a picture"),
        ("bloom, nothing", "there is no effect 'nothing'"),
        ("bloom,", "there is no effect ''"),
    ],
)
def test_what_cannot_be_in_a_chain_is_an_error(chain: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert words in refused(capsys, "apply", chain, "opaque.npy", "-o", "x.npy")


def test_a_part_that_makes_several_pictures_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.txt").write_text("def two(color: Image) -> tuple[vec4, vec4]:\n    return color[0, 0], color[1, 0]\n")
    error = refused(capsys, "apply", "own.txt, sepia", "opaque.npy", "-o", "x.npy")
    assert "two: makes several pictures; in a chain each makes one" in error


def test_a_file_with_a_comma_in_its_name_is_a_file() -> None:
    Path("a,b.txt").write_text("def same(color: Image) -> vec4:\n    return color[0, 0]\n")
    assert named_effect("a,b.txt").name == "same"
    assert is_named("bloom, vignette") and not is_named("bloom, photo.png")


def test_depth_goes_to_those_that_take_it() -> None:
    chain = EffectChain.of([EFFECTS["sepia"], EFFECTS["fog"]])
    assert chain.takes == "picture+depth"
    made = chain.build(pg.Input("frame"), pg.Input("depth"))
    with pg.compile(made, backend="reference") as program:
        far = program(frame=np.load("opaque.npy"), depth=np.full((24, 32, 1), 1e4, np.float32))[made.name]
    assert np.ptp(far[..., :3].reshape(-1, 3), axis=0).max() < 1e-3
