"""Depth of field against rays through a thin lens, and what it must not do."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import depth_of_field
from tests.conftest import DEVICES
from tests.effects.lens_truth import Camera, Layer, pinhole, seen
from tests.effects.scenes import Float64, Picture

COLOR, DEPTH = pg.Input("color"), pg.Input("depth")
SIZE = (128, 96)
#: 200 mm in front of 24 mm, focused at 4 m: blurs of many pixels in small pictures.
LENS = {"focus_distance": 4.0, "f_number": 2.0, "focal_length_mm": 200.0}


def run(color: Picture, depth: Picture | Float64, backend: str = "numpy", **options: object) -> Picture:
    given = {**LENS, **options}
    made = depth_of_field(COLOR, DEPTH, into=pg.target("shown", "rgba32f"), **given)  # type: ignore[arg-type]
    with pg.compile(made, backend=backend) as program:
        return program(color=color, depth=np.asarray(depth, np.float32))["shown"]


def waves(x: Float64, y: Float64, period_px: float, base: tuple[float, float, float]) -> Float64:
    step = 2 * np.pi / period_px
    return np.asarray((1.0 + 0.6 * np.sin(step * x) * np.sin(step * y))[..., None] * base)


def with_lamps(x: Float64, y: Float64) -> Float64:
    # none is hidden by what stands before it: nobody could tell that from the picture
    lamp = (np.abs(x + 50) < 1.5) & (np.abs((y + 5) % 47 - 23) < 1.5)
    return waves(x, y, 60.0, (0.25, 0.3, 0.5)) + 20.0 * lamp[..., None]


BACK = Layer(20.0, with_lamps, lambda x, y: np.ones_like(x))
FOCUS = Layer(4.0, lambda x, y: waves(x, y, 7.0, (0.6, 0.4, 0.2)), lambda x, y: 1.0 * (np.hypot(x + 12, y - 4) < 28))
FRONT = Layer(2.6, lambda x, y: waves(x, y, 20.0, (0.1, 0.5, 0.15)), lambda x, y: 1.0 * (np.abs(x - 0.4 * y - 20) < 9))


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("layers", "f_number", "most"),
    [((FOCUS, BACK), 2.8, 0.03), ((FRONT, BACK), 2.8, 0.03), ((FRONT, FOCUS, BACK), 2.8, 0.03)],
    ids=["behind", "before and behind", "before, in and behind"],
)
def test_it_is_what_a_thin_lens_sees(layers: tuple[Layer, ...], f_number: float, most: float) -> None:
    """RMSE of what a display shows, against 200 rays a pixel; a pinhole's picture is three times as far away."""
    camera = Camera(SIZE, 4.0, 0.2, f_number)
    color, depth = pinhole(camera, layers)
    truth = np.minimum(seen(camera, layers, rays=200, parts=1), 1.0)
    shown = np.minimum(run(color, depth, f_number=f_number)[:, :, :3], 1.0)

    def error(picture: Float64 | Picture) -> float:
        return float(np.sqrt(np.mean((np.minimum(picture, 1.0) - truth) ** 2)))

    assert error(shown) < most
    assert error(color[:, :, :3]) > 2.5 * error(shown)


@pytest.mark.parametrize("distance", [1.0, 5.0])
@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_a_point_becomes_a_disc_of_the_lens_s_radius(distance: float, backend_name: str) -> None:
    """Its light is kept, and lies at a mean square of half the radius squared from its middle; rims are soft."""
    color = np.zeros((96, 96, 4), np.float32)
    color[48:50, 48:50] = 1000.0
    f_number = 1.4 if distance > 2.0 else 7.0
    shown = run(color, np.full((96, 96), distance), backend_name, f_number=f_number)[:, :, 0].astype(float)
    assert shown.sum() == pytest.approx(4000.0, rel=0.03)
    y, x = np.mgrid[0:96, 0:96] - 48.5
    square = (shown * (x * x + y * y)).sum() / shown.sum() - 0.5  # the spot itself: 4 pixels
    radius = abs(Camera((96, 96), 4.0, 0.2, f_number).shift_px(distance))
    assert np.sqrt(2 * square) == pytest.approx(radius, abs=0.85)


def test_what_is_sharp_does_not_bleed_into_what_is_blurred() -> None:
    """A red thing in focus before a blue wall that is not: the wall beside it has no red."""
    near = np.hypot(*(np.mgrid[0:64, 0:64] - 31.5)) < 14
    color = np.where(near[..., None], (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)).astype(np.float32)
    shown = run(color, np.where(near, 4.0, 40.0))
    np.testing.assert_array_equal(shown, color)


def test_what_is_near_covers_its_share_of_the_lens() -> None:
    """Half of it at a straight edge, and nothing farther away than its radius."""
    near = np.arange(96) < 48
    color = np.tile(np.where(near[:, None], (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 1.0)), (64, 1, 1)).astype(np.float32)
    radius = abs(Camera((96, 64), 4.0, 0.2, 1.0).shift_px(2.5))
    row = run(color, np.tile(np.where(near, 2.5, 4.0), (64, 1)), f_number=1.0)[32, :, 0]
    assert radius > 8
    assert 0.35 < row[48] < row[47] < 0.65
    assert (np.diff(row) <= 0.02).all()
    np.testing.assert_array_equal(row[: int(47 - radius - 3)], 1.0)
    np.testing.assert_array_equal(row[int(49 + radius + 3) :], 0.0)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (33, 21)], ids=str)
def test_an_even_picture_stays_even_at_any_depth(size: tuple[int, int]) -> None:
    depth = np.random.default_rng(3).choice([0.0, 0.9, 2.0, 3.9, 4.0, 7.0, 500.0], size[::-1])
    color = np.full((size[1], size[0], 4), (0.5, 3.0, 0.0, 0.25), np.float32)
    np.testing.assert_allclose(run(color, depth), color, rtol=2e-3, atol=1e-6)


def test_what_is_in_focus_stays_as_it_is() -> None:
    color = np.random.default_rng(4).random((31, 45, 4)).astype(np.float16).astype(np.float32)
    np.testing.assert_array_equal(run(color, np.full((31, 45), 4.0)), color)


def test_nothing_drawn_is_far_away() -> None:
    color = np.random.default_rng(4).random((24, 32, 4), np.float32)
    np.testing.assert_allclose(run(color, np.zeros((24, 32))), run(color, np.full((24, 32), 1e9)), atol=1e-3)


def test_blades_give_points_corners_and_lenses_turn_them_over() -> None:
    """A triangle has its corner above or below, as what it is a picture of lies before or behind the focus."""
    color = np.zeros((96, 96, 4), np.float32)
    color[48:50, 48:50] = 1000.0
    up = np.mgrid[0:96, 0:96][0] - 48.5
    leaning = []
    for distance in (2.5, 10.0):
        disc, triangle = (
            run(color, np.full((96, 96), distance), f_number=1.4, blades=blades)[:, :, 0] for blades in (0, 3)
        )
        assert triangle.sum() == pytest.approx(disc.sum(), rel=0.06)
        radius = abs(Camera((96, 96), 4.0, 0.2, 1.4).shift_px(distance))
        # of a triangle with the area of a disc this mean is 0.094: a fortieth of its corner's way cubed
        leaning.append(((triangle - disc) * up**3).sum() / disc.sum() / radius**3)
    assert min(map(abs, leaning)) > 0.02
    assert leaning[0] * leaning[1] < 0


def aperture(at: tuple[float, float], radius: float, blades: int, turn: float, eye: float) -> Float64:
    """The share of each pixel under a polygon with the area of a disc, its corners at ``turn``, and under a disc as
    wide as its corners that is shifted by ``eye`` in the picture's corners; a negative radius shows it upright."""
    (width, height), parts = SIZE, 8
    y, x = (np.mgrid[: height * parts, : width * parts] + 0.5) / parts
    across, down = (x - at[0]) / radius, (y - at[1]) / radius
    inside, corner = np.hypot(across, down) <= 1.0, 1.0
    if blades:
        corner = np.sqrt(2 * np.pi / blades / np.sin(2 * np.pi / blades))
        sides = turn + 2 * np.pi * (np.arange(blades) + 0.5) / blades
        inside = np.all(
            [across * np.sin(a) + down * np.cos(a) <= corner * np.cos(np.pi / blades) for a in sides], axis=0
        )
    shift = eye * np.subtract(np.multiply(2.0, at), SIZE) / np.hypot(*SIZE)
    inside &= np.hypot(across + shift[0], down + shift[1]) <= corner + 1e-9
    return inside.reshape(height, parts, width, parts).mean(axis=(1, 3))


def middle(picture: Float64) -> Float64:
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]] + 0.5
    return np.array([(picture * x).sum(), (picture * y).sum()]) / picture.sum()


@pytest.mark.sampled
@pytest.mark.parametrize("distance", [10.0, 2.5])
@pytest.mark.parametrize(
    ("blades", "turn", "eye"),
    [(0, 0.0, 0.0), (6, 0.0, 0.0), (6, 0.3, 0.0), (0, 0.0, 0.9), (6, 0.3, 0.9), (5, -1.0, 0.5)],
)
@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_a_point_becomes_what_the_blades_and_the_rim_leave(
    blades: int, turn: float, eye: float, distance: float, backend_name: str
) -> None:
    at = (97.0, 25.0)
    color = np.zeros((SIZE[1], SIZE[0], 4), np.float32)
    color[24:26, 96:98] = 1000.0
    depth, options = np.full((SIZE[1], SIZE[0]), distance), {"blades": blades, "rotation_rad": turn, "cats_eye": eye}
    made = run(color, depth, backend_name, f_number=1.4, taps=160, **options)[..., 0].astype(float)
    radius = abs(Camera(SIZE, 4.0, 0.2, 1.4).shift_px(distance)) * (1 if distance > 4.0 else -1)
    truth = aperture(at, radius, blades, turn, eye)
    lit, shape = made > 0.5 * 4000.0 / truth.sum(), truth > 0.5
    # by pixels of the rim alone, of half the size
    assert (lit ^ shape).sum() < 0.2 * shape.sum()
    np.testing.assert_allclose(middle(made), middle(truth), atol=0.4)
    # brightness stays, as that of what is even must; a rim that is shifted draws all places to the middle, or off it
    drawn = (1.0 - eye * radius / np.hypot(*SIZE)) ** 2
    low, high = sorted((drawn, 1.0 if blades else drawn))
    assert low - 0.02 < made.sum() / 4000.0 < high + 0.02


def test_a_shifted_rim_leaves_even_pictures_even() -> None:
    color = np.full((33, 21, 4), (0.5, 3.0, 0.0, 0.25), np.float32)
    for distance in (2.0, 9.0):
        made = run(color, np.full((33, 21), distance), blades=5, cats_eye=1.0)
        np.testing.assert_allclose(made, color, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("backend_name", [*DEVICES, "reference"], indirect=True)
def test_every_backend_shows_the_same(backend_name: str) -> None:
    """But where rounding moves a tap to the next texel."""
    camera = Camera((96, 96), 4.0, 0.2, 4.0)
    color, depth = pinhole(camera, (FRONT, FOCUS, BACK))
    off = np.abs(run(color, depth, backend_name) - run(color, depth, "numpy")).max(axis=2)
    assert (off > 1e-3).mean() < 0.01


def test_focus_may_move_from_run_to_run() -> None:
    color, depth = pinhole(Camera((64, 48), 4.0), (FOCUS, BACK))
    made = depth_of_field(COLOR, DEPTH, pg.Value("focus", float), 2.0, 200.0, into=pg.target("shown", "rgba32f"))
    with pg.compile(made) as program:
        for focus in (4.0, 20.0):
            moved = program(color=color, depth=depth, focus=focus)["shown"].copy()
            np.testing.assert_array_equal(moved, run(color, depth, focus_distance=focus))


def test_what_no_lens_does_is_refused() -> None:
    with pytest.raises(pg.GraphError, match=r"is 0\.1 scene units, 100 mm, and a lens of 200 mm focuses"):
        depth_of_field(COLOR, DEPTH, 0.1, focal_length_mm=200.0)
    with pytest.raises(pg.GraphError, match="blades must be 0 or 3 to 16, got 2"):
        depth_of_field(COLOR, DEPTH, blades=2)
