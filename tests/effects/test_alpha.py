"""Pictures with straight alpha through effects, in Python and by ``passgraph apply``.

What is right is known from compositing: an effect that mixes pixels linearly, and keeps what is even as it is, does the
same to a picture before and after it is laid over an even background.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.effects import EFFECTS, chromatic_aberration, effect, fxaa, gaussian_blur
from passgraph.effects.checked import Mark
from passgraph.effects.pictures.alpha import on_straight_alpha
from tests.agreement import assert_within_bounds

MIXING = [one for one in EFFECTS.values() if one.takes.startswith("picture") and one.alpha == "premultiplied"]
#: Effects whose result is gray: blue shows in its red.
GRAY = ("sobel",)
#: Left opaque blue, right red that nobody sees.
FRINGE = np.repeat(np.float32([[[0, 0, 1, 1], [1, 0, 0, 0]]]), (20, 20), axis=1).repeat(24, axis=0)


def random_picture() -> Any:
    made = np.random.default_rng(5).random((24, 40, 4)).astype(np.float32)
    made[4:12, 10:20, 3] = 0.0
    made[12:, 25:, 3] = 1.0
    return made


def shown(target: pg.Target, backend: str = "numpy", **given: Any) -> Any:
    with pg.compile({"out": target}, backend=backend) as program:
        return program(**given)["out"]


def over(picture: Any, background: Any) -> Any:
    return picture[..., :3] * picture[..., 3:] + np.asarray(background) * (1.0 - picture[..., 3:])


@pytest.mark.parametrize("background", [(0.0, 0.0, 0.0), (0.25, 1.0, 0.5)])
def test_a_blur_of_a_picture_laid_over_a_background_is_the_blur_of_what_is_seen(
    background: Any, backend_name: str
) -> None:
    picture = random_picture()
    soft = on_straight_alpha(gaussian_blur)(pg.Input("frame"), sigma_px=2.0, radius_px=8)
    expected = over(picture.astype(np.float64), background)
    for axis in (0, 1):
        expected = gaussian_filter1d(expected, 2.0, axis, mode="nearest", radius=8)
    assert np.abs(over(shown(soft, backend_name, frame=picture), background) - expected).max() < 1e-5
    plain = shown(gaussian_blur(pg.Input("frame"), sigma_px=2.0, radius_px=8), backend_name, frame=picture)
    assert np.abs(over(plain, background) - expected).max() > 0.05


@pytest.mark.sampled
@pytest.mark.parametrize("one", MIXING, ids=lambda one: one.name)
def test_what_nobody_sees_has_no_part(one: Any) -> None:
    taken = [pg.Input("frame")]
    given: dict[str, Any] = {"frame": FRINGE}
    if one.takes == "picture+depth":
        taken.append(pg.Input("depth"))
        given["depth"] = np.full((*FRINGE.shape[:2], 1), 3.0, np.float32)
    made = shown(on_straight_alpha(one.function)(*taken), **given)
    assert one.name in GRAY or made[made[..., 3] > 0.0][:, 0].max() == 0.0
    without = dict(given, frame=FRINGE * np.float32([0, 1, 1, 1]))
    np.testing.assert_array_equal(made[..., 1:], shown(on_straight_alpha(one.function)(*taken), **without)[..., 1:])


@pytest.mark.sampled
@pytest.mark.parametrize("one", MIXING, ids=lambda one: one.name)
def test_opaque_pictures_come_out_as_without(one: Any) -> None:
    picture = random_picture()
    picture[..., 3] = 1.0
    taken = [pg.Input("frame"), *([pg.Input("depth")] if one.takes == "picture+depth" else [])]
    given = {"frame": picture, **({"depth": np.full((24, 40, 1), 9.0)} if len(taken) > 1 else {})}
    plain, converted = one.function(*taken), on_straight_alpha(one.function)(*taken)
    assert (converted.name, converted.spec.format) == (plain.name, plain.spec.format)
    # A blur's weights add up to 1 but for rounding, and so does its alpha.
    np.testing.assert_allclose(shown(converted, **given), shown(plain, **given), rtol=2.0**-21, atol=0.0)


def test_backends_agree() -> None:
    frame = pg.Input("frame")
    for alpha in ("premultiplied", "ignored"):
        assert_within_bounds(on_straight_alpha(chromatic_aberration, alpha)(frame), frame=random_picture())


def test_little_alpha_does_not_show_the_steps_of_8_bits() -> None:
    """fxaa stores 8 bits; of color times 1/50 no more than 5 steps would be left."""
    picture = np.full((6, 8, 4), 0.5, np.float32)
    picture[..., 3] = 0.02
    assert np.abs(shown(on_straight_alpha(fxaa)(pg.Input("frame")), frame=picture)[..., :3] - 0.5).max() < 1 / 255


def test_alpha_that_is_no_opacity_comes_back() -> None:
    picture = random_picture()
    made = shown(on_straight_alpha(gaussian_blur, "ignored")(pg.Input("frame"), sigma_px=2.0), frame=picture)
    plain = shown(gaussian_blur(pg.Input("frame"), sigma_px=2.0), frame=picture)
    np.testing.assert_array_equal(made[..., 3], picture[..., 3])
    np.testing.assert_array_equal(made[..., :3], plain[..., :3])


def test_an_effect_says_what_it_takes() -> None:
    @effect("own", alpha="premultiplied")
    def own(color: pg.Target) -> pg.Target:
        return color

    assert own.effect == Mark("own", "picture", False, "premultiplied")  # type: ignore[attr-defined]
    assert EFFECTS["tone-map"].alpha == "straight"
    assert on_straight_alpha(EFFECTS["tone-map"].function) is EFFECTS["tone-map"].function
    with pytest.raises(pg.GraphError, match="alpha cannot be 'associated'"):
        effect("own", alpha="associated")  # type: ignore[arg-type]


# On the command line


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    pg.save("fringe.png", FRINGE)
    pg.save("opaque.png", FRINGE[..., :3])
    return tmp_path


def applied(*words: str, output: str = "out.png") -> Any:
    assert run(["apply", "gaussian-blur", *words, "-o", output]) == 0
    return pg.load(output if Path(output).is_file() else next(Path(output).iterdir()))


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("many", [False, True])
def test_apply_converts_as_the_option_says(many: bool) -> None:
    words = ("fringe.png", "opaque.png") if many else ("fringe.png",)

    def made(*options: str) -> Any:
        if not many:
            return applied(*words, *options)
        assert run(["apply", "gaussian-blur", *words, *options, "-o", "out/"]) == 0
        return pg.load("out/fringe.png")

    assert made()[..., 0].max() == 0.0
    assert made("--alpha", "straight")[..., 0].max() > 0.9
    ignored = made("--alpha", "ignored")
    assert np.array_equal(ignored[..., 3], FRINGE[..., 3])
    assert ignored[..., 0].max() > 0.9


@pytest.mark.usefixtures("folder")
def test_files_without_alpha_cost_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    applied("opaque.png", "--capture", "shown")
    assert not [path.name for path in Path("shown").iterdir() if "premultipl" in path.name]
    applied("fringe.png", "--capture", "shown")
    assert [path.name for path in Path("shown").iterdir() if "premultipl" in path.name]


@pytest.mark.usefixtures("folder")
def test_a_color_space_is_left_before_alpha_is_multiplied() -> None:
    """Half opaque white beside nothing: in light its color stays white at every alpha."""
    white = FRINGE.copy()
    white[:, :20, :3] = 1.0
    pg.save("white.png", white)
    made = applied("white.png", "--from-space", "srgb_tx", "--color-config", "ocio://default")
    assert made[made[..., 3] > 0.02][:, :3].min() > 0.99


@pytest.mark.usefixtures("folder")
def test_every_picture_that_a_kernel_takes_is_converted() -> None:
    Path("mixed.py").write_text(
        "import passgraph as pg\nfrom passgraph import Image, mix, vec4\n\n@pg.kernel\n"
        "def mixed(color: Image, to: Image) -> vec4: return mix(color[0, 0], to[0, 0], 0.5)\n"
    )
    pg.save("clear.png", np.float32([1, 0, 0, 0]) * np.ones((24, 40, 1), np.float32))
    pg.save("blue.png", np.float32([0, 0, 1]) * np.ones((24, 40, 1), np.float32))
    words = ["apply", "mixed.py", "blue.png", "--to", "clear.png", "-o", "out.png"]
    assert run([*words, "--alpha", "premultiplied"]) == 0
    assert pg.load("out.png")[0, 0].round(2).tolist() == [0.0, 0.0, 1.0, 0.5]
    assert run(words) == 0
    assert pg.load("out.png")[0, 0].round(2).tolist() == [0.5, 0.0, 0.5, 0.5]


@pytest.mark.usefixtures("folder")
def test_a_kernel_that_makes_opaque_pictures_transparent_is_converted_too() -> None:
    Path("fade.py").write_text(
        "import passgraph as pg\nfrom passgraph import Image, vec4\n\n@pg.kernel\n"
        "def fade(color: Image) -> vec4: return color[0, 0] * 0.5\n"
    )
    pg.save("blue.png", np.float32([0, 0, 1]) * np.ones((24, 40, 1), np.float32))
    assert run(["apply", "fade.py", "blue.png", "-o", "out.png", "--alpha", "premultiplied"]) == 0
    assert pg.load("out.png")[0, 0].round(2).tolist() == [0.0, 0.0, 1.0, 0.5]
    assert run(["apply", "fade.py", "blue.png", "-o", "out.png", "--alpha", "ignored"]) == 0
    assert pg.load("out.png")[0, 0].round(2).tolist() == [0.0, 0.0, 0.5, 1.0]
