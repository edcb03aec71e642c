"""Cases of maps of moments, which may be blurred before they are compared."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

import passgraph as pg
from passgraph.effects.shadows.shadow_choice import Evsm4, Msm, Vsm
from passgraph.scene.matrices import translation
from tests.effects.hard.case import Case, Figure, mask, rmse, shown, traced
from tests.effects.hard.naive import sure
from tests.effects.scenes import cube, floor, sun

FILTERS: dict[str, dict[str, object]] = {
    "vsm, no bleed remap": {"filter": Vsm(bleed=0.0)},
    "vsm": {"filter": Vsm()},
    "evsm4, exponent 5": {"filter": Evsm4(exponent=5.0)},
    "evsm4, exponent 40": {"filter": Evsm4()},
    "msm": {"filter": Msm()},
}


def stretched(at: tuple[float, float, float], by: tuple[float, float, float], name: str) -> pg.Node:
    return pg.Node(cube().mesh, transform=translation(at) @ np.diag([*by, 1.0]), name=name)


def slats_over_board() -> pg.Scene:
    """A row of slats high over a board: the board's shadow on the floor holds all of the slats' shadows."""
    slats = [stretched((x, 1.9, -0.9), (0.14, 0.05, 1.6), "slat") for x in np.arange(-0.9, 1.0, 0.3)]
    nodes = (floor(4.0), stretched((0, 0.55, -0.3), (2.0, 0.04, 1.0), "board"), *slats)
    camera = pg.Camera((0.0, 1.15, 3.6), (0.0, 0.2, 0.0), vertical_fov_rad=0.5)
    return pg.Scene(nodes, camera, (sun(50.0, 90.0, radius=0.05),))


@lru_cache
def leaks(backend: str) -> Case:
    scene = slats_over_board()
    truth = traced(scene)
    umbra = truth.valid & (truth.share == 0.0) & sure(truth.share, 3)
    shares = {name: mask(scene, backend, softness=0.05, map_size=512, **options) for name, options in FILTERS.items()}
    first = next(iter(shares))
    figures = []
    for name, share in shares.items():
        values = (float(share[umbra].max()), rmse(share, truth))
        for what, exact, value in zip(("most light in the umbra", "RMSE to rays"), (0.0, 0.0), values, strict=True):
            columns = (value, None) if name == first else (None, value)
            figures.append(Figure(f"{what}, {name}", exact, *columns))
    return Case(
        "leaks",
        "Moments where one caster hangs over another",
        "Two moments of a mixture of two depths say little: Chebyshev's bound lets light through where both casters are"
        " in a texel's neighborhood (a receiver at 0.9 behind casters at 0.2 and 0.8, half and half, keeps 0.36).",
        "A remap takes shares below 0.2 for none, too little here; exponential warps, taken in both directions,"
        " and four moments bound the share more tightly. All blur by one width: a box, 0.1 units wide.",
        ("ray-traced", "vsm, no bleed remap", "passgraph"),
        tuple(figures),
        (
            ("ray-traced", shown(scene, truth.share)),
            ("vsm, no bleed remap", shown(scene, shares[first])),
            ("passgraph evsm4", shown(scene, shares["evsm4, exponent 40"])),
            ("passgraph msm", shown(scene, shares["msm"])),
        ),
    )


CASES = (leaks,)
