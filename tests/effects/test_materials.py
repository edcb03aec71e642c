"""Unlit surfaces, and cut-out surfaces without a texture: what is seen of them, and their shadows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import ambient_occlusion, five_pass, planar, soft_shadow
from tests.agreement import assert_within_bounds

SIZE = (48, 36)
LAMP = pg.Light.directional((0.8, -1.0, 0.3), (1.0, 1.0, 1.0), 0.6, 0.02, "sun")
CAMERA = pg.Camera((0.0, 6.0, 0.01), (0.0, 0.0, 0.0), near=0.5, far=20.0, orthographic_height=4.0)


def sheet(height: float, half: float, colors: Any = None) -> pg.Mesh:
    places = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]) * half + [0, height, 0]
    return pg.Mesh.make(places, [[0, 1, 2], [0, 2, 3]], [[0, 1, 0]] * 4, colors=colors)


def over_floor(material: pg.Material, colors: Any = None, floor: pg.Material | None = None) -> pg.Scene:
    """A sheet above a white floor, seen and lit from above."""
    white = pg.Material("white", (1.0, 1.0, 1.0, 1.0))
    nodes = (pg.Node(sheet(0.0, 3.0), floor or white), pg.Node(sheet(1.0, 0.6, colors), material))
    return pg.Scene(nodes, CAMERA, (LAMP,))


def seen(graph: pg.Target, size: tuple[int, int] = SIZE) -> Any:
    with pg.compile(graph, backend="numpy", size=size) as program:
        return next(iter(program().values()))[..., :3]


@pytest.mark.parametrize("effect", [soft_shadow, ambient_occlusion, five_pass, planar])
def test_an_unlit_surface_shows_its_own_color(effect: Any) -> None:
    color = (0.25, 0.5, 0.75)
    lit = over_floor(pg.Material("card", (*color, 1.0)))
    unlit = over_floor(pg.Material("card", (*color, 1.0), unlit=True))
    given = {} if effect in (soft_shadow, ambient_occlusion) else {"display": False}
    middle = tuple(n // 2 for n in SIZE[::-1])
    shown = [seen(effect(scene, **({"display": False} | given)))[middle] for scene in (lit, unlit)]
    assert np.allclose(shown[1], color, atol=1e-3)
    assert not np.allclose(shown[0], color, atol=0.02)


@pytest.mark.parametrize("unlit", [False, True])
def test_an_unlit_floor_receives_no_shadow(unlit: bool) -> None:
    floor = pg.Material("floor", (0.5, 0.5, 0.5, 1.0), unlit=unlit)
    scene = over_floor(pg.Material("card", (1.0, 1.0, 1.0, 1.0)), floor=floor)
    below, card = scene.nodes
    free = pg.Scene((below, replace(card, casts=False)), CAMERA, (LAMP,))
    with_shadow, without = (seen(soft_shadow(each, display=False)) for each in (scene, free))
    assert np.array_equal(with_shadow, without) == unlit


@pytest.mark.parametrize("alpha", [0.2, 0.8])
def test_a_cut_out_surface_without_a_texture_casts_the_shadow_of_what_is_seen(alpha: float) -> None:
    """The right half of a sheet has an alpha below or above the cutoff."""
    material = pg.Material("card", (1.0, 1.0, 1.0, 1.0), alpha_mode="mask", alpha_cutoff=0.5)
    card = sheet(1.0, 0.6)

    def half(x: float, opacity: float) -> pg.Node:
        colors = [[1.0, 1.0, 1.0, opacity]] * 4
        places = card.positions * [0.5, 1.0, 1.0] + [x, 0.0, 0.0]
        return pg.Node(pg.Mesh.make(places, card.triangles, card.normals, colors=colors), material)

    def brightness(*cards: pg.Node) -> float:
        floor = pg.Node(sheet(0.0, 3.0), pg.Material("white", (1.0, 1.0, 1.0, 1.0)))
        scene = pg.Scene((floor, *cards), CAMERA, (LAMP,))
        return float(seen(soft_shadow(scene, display=False, softness=0.0, map_size=256)).mean())

    alone, both = brightness(half(-0.3, 1.0)), brightness(half(-0.3, 1.0), half(0.3, 1.0))
    assert abs(alone - both) > 1e-3
    shown = brightness(half(-0.3, 1.0), half(0.3, alpha))
    # the maps of two casters cover more than that of one, so their texels lie elsewhere
    assert shown == pytest.approx(both if alpha > 0.5 else alone, abs=0.1 * abs(alone - both))


def test_backends_agree_on_unlit_and_cut_out_surfaces() -> None:
    colors = np.array([[1, 1, 1, 0.2], [1, 1, 1, 0.9], [1, 1, 1, 0.9], [1, 1, 1, 0.2]])
    material = pg.Material("card", (0.3, 0.6, 0.9, 1.0), alpha_mode="mask", alpha_cutoff=0.5, unlit=True)
    assert_within_bounds(soft_shadow(over_floor(material, colors), map_size=64, display=False), (20, 12))
