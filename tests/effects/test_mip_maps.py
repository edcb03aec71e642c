"""Mip maps: the levels, the level that is chosen, and far tiles against a supersampled truth."""

from __future__ import annotations

from itertools import product
from math import tan
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import Const, Image, pixel, vec2, vec4
from passgraph.effects.surfaces.g_buffer import g_buffer
from passgraph.effects.surfaces.material_textures import WRAPS, mipped, mips_of
from passgraph.effects.surfaces.views import View
from tests.agreement import assert_within_bounds

SIZE = (160, 90)
HALF, TILES = 200.0, 50.0
PADS: Any = {"repeat": "wrap", "clamp": "edge", "mirror": "symmetric"}


def noise() -> np.random.Generator:
    return np.random.default_rng(3)


def checks() -> Any:
    """(64, 64) bytes: 4 × 4 squares of a chequer."""
    return (np.kron(np.indices((4, 4)).sum(0) % 2, np.ones((16, 16))) * 255).astype(np.uint8)


def floor_scene(texture: pg.Texture | None = None, **maps: Any) -> pg.Scene:
    """A chequered floor to the horizon."""
    places = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]) * HALF
    uvs = np.array([[0, 1], [1, 1], [1, 0], [0, 0]]) * TILES
    mesh = pg.Mesh.make(places, [[0, 1, 2], [0, 2, 3]], [[0, 1, 0]] * 4, uvs)
    material = pg.Material("floor", (1, 1, 1, 1), texture or pg.Texture.make(checks()), **maps)
    camera = pg.Camera((0, 2, 0), (0.5, 0.8, -10), vertical_fov_rad=0.9, near=0.1, far=500.0)
    return pg.Scene((pg.Node(mesh, material),), camera)


def buffers(scene: pg.Scene) -> Any:
    view = View(pg.Value("camera", pg.Camera, default=scene.camera))
    return g_buffer(scene, view, (0.0, 0.0, 0.0))


def rays(camera: pg.Camera, samples: int) -> Any:
    """Means of the texture as rays through samples² places of each pixel see it, (h, w), and where all hit."""
    texture = checks().astype(np.float64) / 255.0
    turn, eye = camera.view_rotation()[:3, :3], np.array(camera.eye)
    half = tan(0.5 * camera.vertical_fov_rad)
    total, inside = np.zeros(SIZE[::-1]), np.ones(SIZE[::-1], bool)
    for row in range(samples):
        for column in range(samples):
            x = ((np.arange(SIZE[0]) + (column + 0.5) / samples) / SIZE[0] * 2 - 1) * half * SIZE[0] / SIZE[1]
            y = (1 - (np.arange(SIZE[1]) + (row + 0.5) / samples) / SIZE[1] * 2) * half
            ways = np.stack(np.broadcast_arrays(x, y[:, None], -1.0), -1) @ turn
            down = np.minimum(ways[..., 1], -1e-9)
            places = eye + ways * (-eye[1] / down)[..., None]
            inside &= (ways[..., 1] < -1e-9) & (np.abs(places[..., [0, 2]]) < HALF).all(-1)
            at = (places[..., [0, 2]] + HALF) / (2 * HALF) * TILES * 64 - 0.5
            total += bilinear(texture, at[..., 0], at[..., 1])
    return total / samples**2, inside


def bilinear(texture: Any, u: Any, v: Any) -> Any:
    """A repeating texture at places in texels, 0 in the middle of the first."""
    i, j = np.floor(u).astype(np.int64), np.floor(v).astype(np.int64)
    a, b = u - i, v - j
    height, width = texture.shape

    def row(y: Any) -> Any:
        return texture[y % height, i % width] * (1 - a) + texture[y % height, (i + 1) % width] * a

    return row(j) * (1 - b) + row(j + 1) * b


def test_far_tiles_do_not_alias() -> None:
    """Held against 256 rays a pixel; one ray a pixel is what a picture without mip maps shows."""
    scene = floor_scene()
    with pg.compile({"color": buffers(scene).color}, backend="numpy", size=SIZE) as program:
        shown = program()["color"][..., 0]
    truth, inside = rays(scene.camera, 16)
    once, _ = rays(scene.camera, 1)
    rows = np.nonzero(inside.all(1))[0]
    far, near = rows[: len(rows) // 4], rows[len(rows) // 2 :]

    def error(picture: Any, part: Any) -> float:
        return float(np.sqrt(((picture - truth)[part] ** 2).mean()))

    assert error(once, far) > 0.3  # there is something to claim
    assert error(shown, far) < 0.4 * error(once, far)
    assert error(shown, near) < error(once, near)
    # as a whole neither brighter nor darker
    assert abs((shown - truth)[far].mean()) < 0.01


@pytest.mark.slow
def test_backends_agree() -> None:
    pixels = noise().integers(0, 256, (16, 16, 4), np.uint8)
    normals = pg.Texture.make(pixels[::2, ::2, :3] // 4 + np.uint8(96), "linear")
    made = buffers(floor_scene(pg.Texture.make(pixels, wrap="mirror"), normal_texture=normals))
    assert_within_bounds([made.color, made.normals], (20, 12))


# Levels


@pytest.mark.sampled
@pytest.mark.parametrize("size", [(8, 8), (16, 4), (6, 5), (9, 13), (2, 2)])
def test_levels_are_means_over_areas(size: tuple[int, int]) -> None:
    """Each texel of level 1 by integration over 60 × 60 places inside it."""
    pixels = noise().random((size[1], size[0], 4)).astype(np.float32)
    pixels[..., 3] = 1.0
    mips = mips_of(pixels, "base color", ("repeat", "repeat"))
    width, height = mips.size[0] // 2, mips.size[1] // 2
    assert mips.count == min(mips.size).bit_length() - 1
    fine = 60 * np.array([height, width])
    rows = ((np.arange(fine[0]) + 0.5) / fine[0] * size[1]).astype(int)
    columns = ((np.arange(fine[1]) + 0.5) / fine[1] * size[0]).astype(int)
    expected = pixels[rows][:, columns].reshape(height, 60, width, 60, 4).mean((1, 3))
    level = mips.picture[1 : 1 + height, 1 : 1 + width]
    assert np.allclose(level, expected, atol=0.02)
    assert np.allclose(level.mean((0, 1)), pixels.mean((0, 1)), atol=1e-5)


def test_what_cannot_be_seen_gives_no_colour() -> None:
    pixels = np.zeros((2, 2, 4), np.float32)
    pixels[0, 0] = 1.0, 0.5, 0.25, 1.0
    pixels[1, 1, :3] = 1.0
    assert mips_of(pixels, "base color", ("repeat", "repeat")).picture[1, 1].tolist() == [1.0, 0.5, 0.25, 0.25]


def test_normals_of_levels_have_length_1() -> None:
    way = noise().normal(size=(16, 16, 3)) * [0.5, 0.5, 0.1] + [0, 0, 1]
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    pixels = np.dstack([way * 0.5 + 0.5, np.ones((16, 16))]).astype(np.float32)
    level = mips_of(pixels, "normals", ("repeat", "repeat")).picture[1:9, 1:9, :3] * 2 - 1
    expected = way.reshape(8, 2, 8, 2, 3).mean((1, 3))
    assert np.allclose(level, expected / np.linalg.norm(expected, axis=2, keepdims=True), atol=1e-5)


def test_a_texture_of_one_texel_has_no_levels() -> None:
    scene = floor_scene(pg.Texture.make(np.full((1, 1), 255, np.uint8)))
    with pg.compile({"color": buffers(scene).color}, backend="numpy", size=(8, 6)) as program:
        assert program()["color"][-1, 0].tolist() == [1, 1, 1, 1]


@pg.kernel
def looked_up(
    base: Image, levels: Image, size: vec2, count: Const[int], wrap: Const[int], minify: Const[int], level: float
) -> vec4:
    """Places from (-1.5, -1.5) to (2.5, 2.5)."""
    return mipped(base, levels, size, count, wrap, minify, (vec2(pixel()) + 0.37) / 16.0 - 1.5, level)


@pytest.mark.parametrize("level", [-3.0, 1.0, 1.75, 3.0, 9.0])
@pytest.mark.parametrize(("across", "down"), list(product(WRAPS, WRAPS)))
def test_a_level_wraps_as_the_texture_does(across: Any, down: Any, level: float) -> None:
    pixels = noise().random((8, 16, 4)).astype(np.float32)
    pixels[..., 3] = 1.0
    mips = mips_of(pixels, "base color", (across, down))
    border = across if across == down else "repeat"
    base = pg.Input("base", "rgba32f", (16, 8), border=border, default=pixels)
    levels = pg.Input("levels", "rgba32f", (mips.picture.shape[1], mips.picture.shape[0]), default=mips.picture)
    given = tuple(map(float, mips.size)), mips.count, WRAPS.index(across) + 3 * WRAPS.index(down), 0
    out = looked_up(base, levels, *given, level, into=pg.target("out", "rgba32f", (64, 64)))
    with pg.compile(out, backend="numpy") as program:
        shown = program()["out"]
    held = min(max(level, 0.0), 3.0)
    lower = int(held)

    def on(number: int) -> Any:
        small = pixels.reshape(8 >> number, 1 << number, 16 >> number, 1 << number, 4).mean((1, 3))
        height, width = small.shape[:2]
        wide = np.pad(small, ((0, 0), (2 * width, 2 * width), (0, 0)), PADS[across])
        wide = np.pad(wide, ((2 * height, 2 * height), (0, 0), (0, 0)), PADS[down])
        at = (np.arange(64) + 0.37) / 16.0 - 1.5
        u, v = np.meshgrid(at * width - 0.5 + 2 * width, at * height - 0.5 + 2 * height)
        return np.stack([bilinear(wide[..., k], u, v) for k in range(4)], -1)

    expected = on(lower) + (held - lower) * (on(min(lower + 1, 3)) - on(lower))
    assert np.abs(shown - expected).max() < 1e-4


# Filters: a square that fills the picture, seen straight on, so that the texture coordinates of a pixel are known


def seen_straight(texels: Any, pixels: int, backend: str, **filters: Any) -> Any:
    """Red, green and blue of ``pixels`` squared of a picture (n, n, 3) that fills them."""
    places = [[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]
    mesh = pg.Mesh.make(places, [[0, 2, 1], [0, 3, 2]], [[0, 0, 1]] * 4, [[0, 0], [1, 0], [1, 1], [0, 1]])
    material = pg.Material("flat", (1, 1, 1, 1), pg.Texture.make(texels, "linear", **filters))
    camera = pg.Camera((0, 0, 2), (0, 0, 0), near=0.5, far=5.0, orthographic_height=2.0)
    made = buffers(pg.Scene((pg.Node(mesh, material),), camera)).color
    with pg.compile({"color": made}, backend=backend, size=(pixels, pixels)) as program:
        return program()["color"][..., :3]


def means(texels: Any, step: int) -> Any:
    count = len(texels) // step
    return texels.reshape(count, step, count, step, 3).mean((1, 3))


def test_magnified_texels_are_flat_squares(backend_name: str) -> None:
    texels = noise().integers(0, 2, (4, 4, 3), np.uint8) * np.uint8(255)
    shown = seen_straight(texels, 24, backend_name, magnify="nearest")
    assert np.array_equal(shown * 255, np.kron(texels, np.ones((6, 6, 1))))
    assert not np.array_equal(seen_straight(texels, 24, backend_name) * 255, np.kron(texels, np.ones((6, 6, 1))))


@pytest.mark.parametrize("minify", ["nearest", "nearest mipmap nearest", "nearest mipmap linear"])
def test_minified_texels_are_those_of_the_level_that_is_named(minify: Any, backend_name: str) -> None:
    """8 texels over 3 pixels: log2(8 / 3) = 1.415, between the levels of 4 and of 2 texels a side."""
    texels = noise().integers(0, 2, (32, 32, 3), np.uint8) * np.uint8(255)
    centers = (np.arange(12) + 0.5) / 12
    of = {step: means(texels, step)[np.ix_(*2 * [(centers * 32 / step).astype(int)])] for step in (1, 2, 4)}
    share = np.log2(32 / 12) - 1
    expected = {
        "nearest": of[1],
        "nearest mipmap nearest": of[2],
        "nearest mipmap linear": of[2] * (1 - share) + of[4] * share,
    }
    for magnify in ("linear", "nearest"):
        shown = seen_straight(texels, 12, backend_name, magnify=magnify, minify=minify) * 255
        # levels are stored as half floats
        assert np.allclose(shown, expected[minify], rtol=0.0, atol=0.0 if minify == "nearest" else 0.2)
