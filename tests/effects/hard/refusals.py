"""Inputs that have no right picture, or a degenerate one: a clear error, or what is right."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

import passgraph as pg
from passgraph.effects import soft_shadow
from passgraph.effects.shadows.shadow_choice import Hard
from tests.effects.hard.case import Case, Figure, mask, traced
from tests.effects.scenes import cube, floor, from_above, sun

ABOVE = from_above(6.0)


def shadowed(*nodes: pg.Node, light: pg.Light | None = None) -> pg.Scene:
    return pg.Scene((floor(), *nodes), ABOVE, (light or sun(45.0),))


def triangle(*corners: tuple[float, float, float]) -> pg.Mesh:
    return pg.Mesh.make(list(corners), [[0, 1, 2]])


def _empty() -> object:
    return pg.Mesh.make(np.zeros((0, 3)), np.zeros((0, 3), int))


def _no_triangles() -> object:
    return pg.Mesh.make([[0, 0, 0]], np.zeros((0, 3), int))


def _nan_vertex() -> object:
    return triangle((0, 0, 0), (1, 0, 0), (0, float("nan"), 0))


def _infinite_vertex() -> object:
    return triangle((0, 0, 0), (1, 0, 0), (0, float("inf"), 0))


def _index() -> object:
    return pg.Mesh.make([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]])


def _no_nodes() -> object:
    return pg.Scene((), ABOVE)


def _nan_light() -> object:
    return pg.Light.point((0, float("nan"), 0))


def _no_direction() -> object:
    return pg.Light.directional((0, 0, 0))


def _negative_radius() -> object:
    return pg.Light.point((0, 1, 0), radius=-0.1)


def _wide() -> object:
    return pg.Light.spot((0, 1, 0), (0, -1, 0), cone_outer_rad=2.0)


def _near_zero() -> object:
    return pg.Camera((0, 1, 0), (0, 0, 1), near=0.0)


def _near_far() -> object:
    return pg.Camera((0, 1, 0), (0, 0, 1), near=2.0, far=1.0)


def _singular() -> object:
    return pg.Node(cube().mesh, transform=np.diag([1.0, 0.0, 1.0, 1.0]))


def _zero_size() -> object:
    return pg.compile(soft_shadow(shadowed(cube()), map_size=64), backend="null", size=(0, 4))


#: What is tried, what does it, and words that the error must hold.
REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "a mesh without vertices": (_empty, "empty; a mesh needs at least one triangle"),
    "a mesh without triangles": (_no_triangles, "triangles: empty"),
    "a vertex that is NaN": (_nan_vertex, "1 of 3 rows are not finite, the first is row 2"),
    "a vertex at infinity": (_infinite_vertex, "1 of 3 rows are not finite, the first is row 2"),
    "a triangle that names no vertex": (_index, "outside 0..2, the first is triangle 0"),
    "a scene without nodes": (_no_nodes, "a scene needs at least one mesh"),
    "a light at NaN": (_nan_light, "position: expected three finite numbers"),
    "a sun without direction": (_no_direction, "direction: expected a vector that is not zero"),
    "a light of negative radius": (_negative_radius, "radius: expected a finite number"),
    "a spotlight wider than 90 degrees": (_wide, "cone_outer_rad: expected a finite number"),
    "a camera with near 0": (_near_zero, "near: expected a finite number in ]0, inf]"),
    "a camera with near beyond far": (_near_far, "expected near < far"),
    "a node squeezed flat": (_singular, "transform"),
    "a picture of 0 × 4 pixels": (_zero_size, "the output is 0x4 pixels; each side must be 1 to 32768"),
}


def error_of(attempt: Callable[[], object]) -> str:
    """What is said; empty where nothing is refused."""
    try:
        attempt()
    except pg.PassgraphError as error:
        return str(error)
    return ""


def degenerate() -> dict[str, tuple[pg.Scene, pg.Scene]]:
    """Scenes with something without area, and the same without it."""
    plain = shadowed(cube())
    point = pg.Node(triangle((0.9, 1, 0), (0.9, 1, 0), (0.9, 1, 0)), name="point")
    line = pg.Node(triangle((-1, 1, -1), (0, 1, 0), (1, 1, 1)), name="line")
    far = pg.Node(triangle((1e7, 1e7, 1e7), (1e7, 1e7, 1e7), (1e7, 1e7, 1e7)), name="far point", casts=False)
    return {
        "a triangle that is a point": (shadowed(cube(), point), plain),
        "a triangle that is a line": (shadowed(cube(), line), plain),
        "a point far away that casts nothing": (shadowed(cube(), far), plain),
    }


@lru_cache
def refusals(backend: str) -> Case:
    figures = []
    for name, (scene, plain) in degenerate().items():
        with_it, without = (mask(s, backend, (96, 64), filter=Hard()) for s in (scene, plain))
        figures.append(Figure(f"pixels that {name} changes", 0, None, float((with_it != without).sum()), 0))
    for name, middle in (("in the shadow", 1.0), ("in the light", 2.5)):
        scene = shadowed(cube()).with_(camera=from_above(6.0, middle))
        one = mask(scene, backend, (1, 1), filter=Hard())
        figures.append(
            Figure(
                f"light in a picture of 1 × 1 pixel, {name}",
                float(traced(scene, (1, 1)).share[0, 0]),
                None,
                float(one[0, 0]),
                1,
            )
        )
    texts = [f"{name}: “{error_of(attempt).splitlines()[0]}”" for name, (attempt, _) in REFUSED.items()]
    return Case(
        "refusals",
        "Empty, infinite and degenerate inputs",
        "Silent garbage, a crash, or a whole frame of NaN.",
        "What has no picture is refused where it enters; what has no area changes nothing.",
        ("right", "", "passgraph"),
        tuple(figures),
        notes=tuple(texts),
    )


CASES = (refusals,)
