"""Film grain: its statistics, and the same bits everywhere."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import film_grain
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture, render

FRAME = pg.Input("frame")
#: pcg3d in 32 bits without sign: multiplier and increment of its linear steps.
MULTIPLIER, INCREMENT = np.uint32(1664525), np.uint32(1013904223)


def run(picture: Picture, backend: str = "numpy", **options: object) -> Picture:
    made = film_grain(FRAME, into=pg.target("shown", "rgba32f"), **options)  # type: ignore[arg-type]
    return render(made, size=None, backend=backend, frame=picture)["shown"]


def grey(value: float, size: tuple[int, int] = (256, 192)) -> Picture:
    return np.full((size[1], size[0], 4), value, np.float32)


def grain(size: tuple[int, int] = (256, 192), **options: object) -> Float64:
    """What is added to middle grey, in standard deviations."""
    return (run(grey(0.5, size), strength=0.05, **options)[:, :, :3].astype(np.float64) - 0.5) / 0.05


def pcg3d(x: Float64, y: Float64, z: int) -> list[Float64]:
    v = [np.asarray(each).astype(np.uint32) * MULTIPLIER + INCREMENT for each in (x, y, np.full_like(x, z))]
    for _ in range(2):
        v[0] = v[0] + v[1] * v[2]
        v[1] = v[1] + v[2] * v[0]
        v[2] = v[2] + v[0] * v[1]
        if _ == 0:
            v = [each ^ (each >> np.uint32(16)) for each in v]
    return v  # type: ignore[return-value]


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_grain_is_the_published_hash(backend_name: str) -> None:
    """The four bytes of each of three numbers, added."""
    shown = run(grey(0.5, (37, 23)), backend_name, strength=0.05, colored=True, index=7)[:, :, :3]
    y, x = np.mgrid[0:23, 0:37]
    deviation = np.sqrt(4 * (256**2 - 1) / 12)
    for channel, bits in enumerate(pcg3d(x, y, 7)):
        total = sum((bits >> np.uint32(8 * byte)) & np.uint32(255) for byte in range(4)).astype(np.float64) - 510
        np.testing.assert_allclose(shown[:, :, channel], 0.5 + 0.05 * total / deviation, atol=1e-7)


@pytest.mark.parametrize("size_px", [0.0, 1.5, 4.0])
def test_it_is_0_on_average_and_as_strong_as_it_is_asked_for(size_px: float) -> None:
    """In the middle and at the border; the average of grains as wide as 4 px is that of fewer."""
    made = grain(size_px=size_px)[:, :, 0]
    grains = made.size / max(1.0, np.pi * size_px**2)
    assert abs(made.mean()) < 4.0 / np.sqrt(grains)
    assert made.std() == pytest.approx(1.0, rel=4.0 / np.sqrt(grains))
    border = np.concatenate([made[0], made[-1], made[:, 0], made[:, -1]])
    assert border.std() == pytest.approx(1.0, rel=0.25)


def test_grain_of_a_pixel_has_no_neighbours_and_does_not_repeat() -> None:
    """Correlation with itself elsewhere, at every way within the picture, and with other pictures."""
    made = grain((512, 512))[:, :, 0]
    spectrum = np.abs(np.fft.fft2(made)) ** 2
    correlation = np.fft.ifft2(spectrum).real / made.size
    correlation[0, 0] = 0.0
    assert np.abs(correlation).max() < 5.5 / np.sqrt(made.size)  # 262,144 normal numbers reach 4.7
    assert spectrum[1:].max() / spectrum.mean() < 20.0  # exponential: ln 262,144 is 12.5
    for options in ({"index": 1}, {"seed": 1}, {"index": 2**31 - 1}):
        other = grain((512, 512), **options)[:, :, 0]
        assert abs((made * other).mean()) < 5.0 / np.sqrt(made.size)


def test_wide_grain_is_as_wide_as_it_is_asked_for() -> None:
    """Correlation of a blurred field falls to exp(-1/4 · (d / sigma)²): at 4 px, sigma 2, exp(-1)."""
    made = grain((512, 512), size_px=4.0)[:, :, 0]
    correlation = np.fft.ifft2(np.abs(np.fft.fft2(made)) ** 2).real / made.size
    for place in ((0, 4), (4, 0), (3, 3)):
        assert correlation[place] == pytest.approx(np.exp(-(place[0] ** 2 + place[1] ** 2) / 16.0), abs=0.05)


def test_black_and_white_have_none_and_the_average_stays() -> None:
    for value in (0.0, 1.0):
        np.testing.assert_array_equal(run(grey(value), strength=0.07), grey(value))
    for value in (0.01, 0.2, 0.99):
        shown = run(grey(value), strength=0.07)[:, :, :3]
        assert 0.0 <= shown.min() < value < shown.max() <= 1.0
        assert shown.std() == pytest.approx(0.07 * 4 * value * (1 - value), rel=0.02)
        assert shown.mean() == pytest.approx(value, abs=5 * shown.std() / np.sqrt(256 * 192))


def test_grain_is_grey_unless_it_is_colored() -> None:
    made = grain()
    np.testing.assert_array_equal(made[:, :, 0], made[:, :, 2])
    colours = grain(colored=True).reshape(-1, 3)
    assert np.abs(np.corrcoef(colours.T) - np.eye(3)).max() < 5.0 / np.sqrt(len(colours))


def test_alpha_stays_and_one_pixel_is_enough() -> None:
    picture = np.random.default_rng(1).random((1, 1, 4), np.float32)
    assert run(picture, size_px=3.0)[0, 0, 3] == picture[0, 0, 3]


def test_frames_bring_their_number() -> None:
    from passgraph.files import Arrays, ToArrays

    made = film_grain(FRAME, index=pg.Value("index", int))
    shown = ToArrays()
    with pg.compile(made) as program:
        source = Arrays([np.full((16, 16, 4), 128, np.uint8)] * 3)
        pg.frames(program, source, shown, values=lambda number: {"index": number})
    assert len({picture.tobytes() for picture in shown.pictures}) == 3


def test_what_is_out_of_range_is_refused() -> None:
    with pytest.raises(pg.GraphError, match="film_grain: index must be 0 or more, got -1"):
        film_grain(FRAME, index=-1)
    with pytest.raises(pg.GraphError, match="film_grain: size_px must be 0 to 16, got 17"):
        film_grain(FRAME, size_px=17)
