"""Lights in places where projections break down."""

from __future__ import annotations

from functools import lru_cache
from math import radians

import numpy as np

import passgraph as pg
from passgraph.effects.shadows.shadow_choice import Hard
from passgraph.effects.surfaces.views import Casters
from passgraph.scene.matrices import translation
from tests.effects.hard.case import SIZE, Case, Figure, Picture, mask, mean_off, shown, traced
from tests.effects.hard.naive import divided_depth, naive
from tests.effects.scenes import cube, floor


def wide_spot(half_angle_deg: float) -> pg.Scene:
    """A lamp among blocks shines level across a floor: half of what is seen lies behind it."""
    light = pg.Light.spot(
        (0.0, 0.8, 0.0), (1, -0.25, 0), radius=0.02, cone_outer_rad=radians(half_angle_deg), intensity=2.0
    )
    blocks = [cube((x, 0, z), 0.5) for x, z in ((1.2, 0.5), (1.6, -0.9), (-1.2, 0.6), (-1.5, -0.8), (0.2, 1.4))]
    camera = pg.Camera((0.6, 4.6, 4.6), (0, 0, 0.1), vertical_fov_rad=0.62)
    return pg.Scene((floor(3.5), *blocks), camera, (light,))


@lru_cache
def wide_spots(backend: str) -> Case:
    figures, strip = [], ()
    for degrees in (60.0, 85.0, 89.9):
        scene = wide_spot(degrees)
        truth = traced(scene, samples=36)
        projection = scene.lights[0].projection_matrix(Casters.in_scene(scene).bounds_for(scene.lights[0]))
        scale, shift = float(projection[2, 2]), float(projection[2, 3])
        bad = naive(divided_depth, scene, backend, scale=scale, shift=shift, bias=2e-4)
        good = mask(scene, backend, filter=Hard(), map_size=512)
        behind = _behind(scene)
        bad_shadow, good_shadow = (float((p[behind] < 0.5).mean()) for p in (bad, good))
        figures += [
            Figure(f"share of what lies behind the lamp that is dark, {degrees:g}°", 0.0, bad_shadow, good_shadow),
            Figure(f"mean error before it, {degrees:g}°", 0.0, mean_off(bad, truth), mean_off(good, truth)),
        ]
        if degrees == 60.0:
            strip = (
                ("ray-traced, 60°", shown(scene, truth.share)),
                ("no look at w, 60°", shown(scene, bad)),
                ("passgraph, 60°", shown(scene, good)),
            )
    return Case(
        "wide-spots",
        "A spotlight of 60 to 89.9 degrees to each side, with surfaces behind it",
        "Behind the lamp w is negative and the division mirrors the map: things before the lamp throw shadows backward."
        " At 90 degrees the projection is infinite.",
        "w ≤ 0 is lit, and the cone gives it no light; a map never spans more than 80 degrees to each side, and what"
        " lies between that and the cone is lit unshadowed.",
        ("ray-traced", "no look at w", "passgraph"),
        tuple(figures),
        strip,
        ("The pictures show where shadows lie, on surfaces shaded as by a lamp without a cone.",),
    )


def _behind(scene: pg.Scene) -> np.ndarray:
    from passgraph.truth import first_surfaces

    seen, light = first_surfaces(scene, SIZE), scene.lights[0]
    with np.errstate(invalid="ignore"):
        return np.asarray((seen.positions + seen.origin - light.position) @ light.direction < 0.0)


def odd_lights() -> dict[str, pg.Light]:
    """Where lights are not expected: none may spoil a frame."""
    return {
        "point light on the floor": pg.Light.point((0.9, 0.0, 0.9)),
        "point light inside the cube": pg.Light.point((0.0, 0.5, 0.0)),
        "point light exactly at a vertex": pg.Light.point((0.5, 1.0, 0.5)),
        "point light on a side of the cube": pg.Light.point((0.5, 0.5, 0.0)),
        "spotlight exactly at a vertex": pg.Light.spot((0.5, 1.0, 0.5), (0.3, -1, 0.2)),
        "spotlight of 90 degrees": pg.Light.spot((2.3, 1.5, 0), (-1, -0.6, 0), cone_outer_rad=radians(90)),
        "spotlight straight down": pg.Light.spot((0.9, 2.0, 0.9), (0, -1, 0)),
        "sun along a side of the cube": pg.Light.directional((0, -1, 0), radius=0.0),
        "sun along the floor": pg.Light.directional((1, 0, 0), radius=0.0),
        "sun from below": pg.Light.directional((0.2, 1, 0.1), radius=0.0),
    }


def under(light: pg.Light) -> pg.Scene:
    nodes = (
        floor(2.5),
        cube(),
        pg.Node(cube().mesh, transform=translation((1.4, 0, 0.4)) @ np.diag([0.3, 0.3, 0.3, 1])),
    )
    return pg.Scene(nodes, pg.Camera((2.2, 2.4, 3.6), (0.3, 0.2, 0.2), vertical_fov_rad=0.62), (light,))


@lru_cache
def odd_places(backend: str) -> Case:
    figures = []
    for name, light in odd_lights().items():
        scene = under(light)
        truth = traced(scene)
        soft = mask(scene, backend, filter=Hard(), map_size=512)
        figures.append(Figure(f"mean error, {name}", 0.0, None, mean_off(soft, truth) if truth.valid.any() else 0.0))
    scene = under(odd_lights()["point light exactly at a vertex"])
    share: Picture = mask(scene, backend, filter=Hard(), map_size=512)
    return Case(
        "odd-places",
        "Lights on, at and inside geometry",
        "Near planes of 0, normalized zero vectors and distances of 0 give NaN, which a blur spreads.",
        "near is never below a thousandth of far, `normalize` of a zero vector is zero, distances have a floor: every"
        " picture is finite, and near what rays say.",
        ("", "", "passgraph hard"),
        tuple(figures),
        (("ray-traced, at a vertex", shown(scene, traced(scene).share)), ("passgraph hard", shown(scene, share))),
    )


CASES = (wide_spots, odd_places)
