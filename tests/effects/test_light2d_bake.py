"""A light map in the vertex colours of geometry."""

from __future__ import annotations

import numpy as np

import passgraph as pg
from passgraph.effects.light2d import Light2D, Wall, Window, light_map
from passgraph.effects.light2d.bake import baked, light_at, lit_surface, placed
from passgraph.scene import Mesh
from tests.effects.scenes import Picture

WINDOW = Window(-4, -3, 4, 3)
SIZE = (32, 24)


def read_map() -> Picture:
    made = light_map(
        WINDOW, [Light2D((-1, 0), (1, 0.6, 0.2), 6, 0.2)], [Wall.box(0.5, -1, 1, 1)], SIZE, format="rgba32f"
    )
    with pg.compile(made, backend="reference") as program:
        return program()["light_map"]


def slab(columns: int = 16, rows: int = 12) -> Mesh:
    """A floor of the window's extent, its vertices on the map's pixel centres and between them."""
    x, y = np.meshgrid(np.linspace(-4, 4, columns + 1), np.linspace(3, -3, rows + 1))
    positions = np.stack([x.ravel(), np.zeros(x.size), -y.ravel()], axis=1)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    quads = np.stack([first, first + columns + 1, first + columns + 2, first + 1], axis=1)
    return Mesh.make(positions, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


def test_vertex_colours_are_what_the_kernel_language_samples_there() -> None:
    """The bilinear sample of every backend, at the places of the vertices."""
    light, mesh = read_map(), slab()
    sample = pg.kernel(source="def sample(light: Image) -> vec4: return light.sample(vec2(pixel()) / vec2(16.0, 12.0))")
    target = sample(pg.Input("light"), into=pg.target("sampled", "rgba32f", (17, 13)))
    with pg.compile(target, backend="reference") as program:
        expected = program(light=light)["sampled"].reshape(-1, 4)
    np.testing.assert_allclose(baked(mesh, light, WINDOW).colors, expected, atol=1e-6)
    assert expected[:, 0].max() > 0.5
    assert expected[:, 0].min() == 0.0


def test_baked_light_is_multiplied_onto_the_colours_that_were_there() -> None:
    mesh = Mesh.make([[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]], colors=[[0.5, 0.5, 0.5, 1]] * 3)
    light = read_map()
    expected = 0.5 * light_at(light, WINDOW, np.array([[0.0, 0], [1, 0], [0, -1]]))[:, :3]
    np.testing.assert_allclose(baked(mesh, light, WINDOW).colors[:, :3], expected, atol=1e-6)


def test_a_draw_shows_the_map_on_the_geometry(backend_name: str) -> None:
    """From above, pixels on vertices show the map times the surface's colour."""
    light = read_map()
    # clip x, y from world x, -z
    above = np.array([[0.25, 0, 0, 0], [0, 0, -1 / 3, 0], [0, 0.1, 0, 0], [0, 0, 0, 1]], np.float32)
    fine = slab(2 * SIZE[0], 2 * SIZE[1])  # every second vertex on a pixel's centre
    target = pg.draw(
        baked(fine, light, WINDOW), vertex=placed, fragment=lit_surface, into=pg.target("top", "rgba32f", SIZE),
        view_projection=above, albedo=(0.5, 1.0, 2.0),
    )  # fmt: skip
    with pg.compile(target, backend=backend_name) as program:
        top = program()["top"]
    np.testing.assert_allclose(top[:, :, :3], light[:, :, :3] * (0.5, 1.0, 2.0), atol=2e-5)
