"""Cases in which a comparison of depths goes wrong."""

from __future__ import annotations

from functools import lru_cache
from math import radians, tan

import numpy as np

import passgraph as pg
from passgraph.effects.shadows.shadow_choice import Hard, Pcf
from passgraph.scene.matrices import rotation_y, translation
from passgraph.scene.shipped_scene import ball, cylinder
from tests.effects.hard.case import SIZE, Case, Figure, Picture, mask, shown, traced
from tests.effects.hard.naive import constant_bias, frame, naive, plane_by_differences, sure
from tests.effects.scenes import cube, floor, floor_places, sun

GRAZING_DEG = (1.0, 3.0, 5.0)


def grazed(elevation_deg: float) -> pg.Scene:
    """Low blocks all over a floor, under a light that hardly clears it."""
    height = 1.5 * tan(radians(elevation_deg))
    places = [(-2.5, -1.5), (-0.5, 0.5), (1.0, -1.0), (-2.0, 1.8), (2.0, 1.6)]
    nodes = [floor(4.0)]
    for x, z in places:
        flat = translation((x, 0, z)) @ np.diag([0.5, height, 0.5, 1.0])
        nodes.append(pg.Node(cube().mesh, transform=flat, name="block"))
    camera = pg.Camera((0, 5.5, 6.0), (0, 0, 0.2), vertical_fov_rad=0.72)
    return pg.Scene(tuple(nodes), camera, (sun(elevation_deg, 33.0),))


@lru_cache
def grazing_light(backend: str) -> Case:
    figures = []
    for degrees in GRAZING_DEG:
        bare = grazed(degrees).with_(nodes=[floor(4.0)])
        one_texel = frame(bare)["texel"]
        for side in (1, 7):
            bad = naive(constant_bias, bare, backend, bias=one_texel, half=side // 2)
            good = mask(bare, backend, filter=Pcf(side))
            name = f"share of a bare floor that is darkened, {side}×{side} texels, {degrees:g}°"
            seen = traced(bare).valid
            figures.append(Figure(name, 0.0, float((bad[seen] < 1.0).mean()), float((good[seen] < 1.0).mean())))
    scene = grazed(3.0)
    acne = naive(constant_bias, scene, backend, bias=frame(scene)["texel"], half=3)
    return Case(
        "grazing-light",
        "A plane under a light at 1 to 5 degrees",
        "A texel of the map covers a long strip of the plane, whose depth changes by more than any constant bias: the"
        " plane shadows itself (acne). More comparisons reach farther and make it worse.",
        "Every comparison is made with the depth that the receiver's own plane has at that texel, after a lift along"
        " the normal of 1.5 texels times the part of the normal that lies in the map; a plane never shadows itself.",
        ("truth", "bias of one texel", "passgraph"),
        tuple(figures),
        (
            ("ray-traced, 3°", shown(scene, traced(scene).share)),
            ("bias of one texel, 7 x 7", shown(scene, acne)),
            ("passgraph pcf, 7 x 7", shown(scene, mask(scene, backend, filter=Pcf(7)))),
        ),
    )


def creased() -> pg.Scene:
    """Edges, hollows and silhouettes of every kind."""
    nodes = (
        floor(4.0),
        cube((-1.0, 0, 0.2)),
        pg.Node(cube().mesh, transform=translation((-1.0, 1.0, 0.2)) @ rotation_y(0.6) @ np.diag([0.5, 0.5, 0.5, 1])),
        pg.Node(ball(0.45), transform=translation((0.7, 0.45, 0.9)), name="ball"),
        pg.Node(cylinder(0.12, 1.6), transform=translation((1.1, 0, -0.5)), name="pillar"),
    )
    return pg.Scene(nodes, pg.Camera((2.4, 3.0, 4.6), (0.1, 0.45, 0.2), vertical_fov_rad=0.38), (sun(50.0, 25.0),))


@lru_cache
def creases(backend: str) -> Case:
    scene = creased()
    truth = traced(scene)
    reach = 7
    bad = naive(plane_by_differences, scene, backend, bias=0.5 * frame(scene)["texel"], half=2)
    good = mask(scene, backend, filter=Pcf(5))
    # a ball's own terminator is left out: facets hide it before smooth normals do
    clear = sure(truth.share, reach) & truth.valid
    wrong = [float((abs(p - truth.share)[clear] > 0.25).mean()) for p in (bad, good)]
    return Case(
        "creases",
        "Receiver-plane bias at creases and silhouettes",
        "The plane is guessed from the pixels beside; across a silhouette they lie on another surface, the 2×2 system"
        " is nearly singular, and the bias is any number: lines of light and of shadow along edges.",
        "The plane comes from the stored normal, its slope is bounded by the light's cone, and a texel counts only"
        f" where it is nearer to the light than a 45° cone about the receiver. Counted {reach} pixels away from true"
        " edges.",
        ("ray-traced", "plane from differences", "passgraph"),
        (Figure("share of pixels wrong by more than 1/4", 0.0, *wrong, digits=4),),
        (
            ("ray-traced", shown(scene, truth.share)),
            ("plane from differences", shown(scene, bad)),
            ("passgraph pcf, 5 x 5", shown(scene, good)),
        ),
    )


def card() -> pg.Node:
    """Upright, without thickness, its foot on the floor at x = 0."""
    corners = [[0, 0, -0.5], [0, 0, 0.5], [0, 1, 0.5], [0, 1, -0.5]]
    mesh = pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]])
    return pg.Node(mesh, pg.Material(double_sided=True), name="card")


def foot_camera(foot: float) -> pg.Camera:
    """Close above the place where something stands."""
    return pg.Camera((foot + 0.1, 1.2, 0), (foot + 0.1, 0, 0), up=(0, 0, -1), vertical_fov_rad=0.3, near=0.05, far=40.0)


def gap_of_light(share: Picture, foot: float) -> float:
    """How far behind a foot the floor is still lit, scene units."""
    x, z = floor_places(foot_camera(foot), SIZE)
    behind = (x > foot) & (x < foot + 0.22) & (abs(z) < 0.15)
    lit = behind & (share > 0.5)
    return float(x[lit].max(initial=foot) - foot)


THINGS = {
    "cube": (cube(), 0.5),
    "board, 1 cm thick": (pg.Node(cube().mesh, transform=np.diag([0.01, 1.0, 1.0, 1.0]), name="board"), 0.005),
    "card without thickness": (card(), 0.0),
}


def stood(thing: str, camera: pg.Camera) -> pg.Scene:
    return pg.Scene((floor(4.0), THINGS[thing][0]), camera, (sun(40.0),))


@lru_cache
def contacts(backend: str) -> Case:
    figures = []
    cure = acne_free_bias(backend)
    for thing, (_, foot) in THINGS.items():
        scene = stood(thing, foot_camera(foot))
        texel = frame(scene)["texel"]
        shares = (
            traced(scene).share,
            naive(constant_bias, scene, backend, bias=cure * texel, half=0),
            mask(scene, backend, filter=Hard()),
        )
        gaps = (gap_of_light(share, foot) / texel for share in shares)
        figures.append(Figure(f"gap of light behind a {thing}, texels", *gaps, digits=1))
    scene = stood("board, 1 cm thick", pg.Camera((2.6, 1.9, 2.4), (0.35, 0.36, 0), vertical_fov_rad=0.48))
    texel = frame(scene)["texel"]
    return Case(
        "contacts",
        "A box standing on a floor; a thin card",
        f"The constant bias that cures the acne of a plane at 5° is {cure:.0f} texels. It frees the floor from the"
        " shadow of all that is thinner than that: things seem to float (peter-panning).",
        "The lift along the normal leaves depths nearly alone: boxes lose nothing, a card without thickness up to"
        " three texels at its foot; `contact` draws that contact.",
        ("ray-traced", f"bias of {cure:.0f} texels", "passgraph"),
        tuple(figures),
        (
            ("ray-traced", shown(scene, traced(scene).share)),
            (
                f"bias of {cure:.0f} texels",
                shown(scene, naive(constant_bias, scene, backend, bias=cure * texel, half=0)),
            ),
            ("passgraph hard", shown(scene, mask(scene, backend, filter=Hard()))),
        ),
    )


@lru_cache
def acne_free_bias(backend: str) -> float:
    """The smallest constant bias, in texels (powers of two), under which a plane at 5° does not shadow itself."""
    scene = grazed(5.0)
    truth = traced(scene)
    texel = frame(scene)["texel"]
    lit = sure(truth.share, 4) & truth.valid & (truth.share == 1.0)
    for texels in 2.0 ** np.arange(8):
        if naive(constant_bias, scene, backend, bias=texels * texel, half=0)[lit].min() == 1.0:
            return float(texels)
    raise AssertionError("no constant bias cures the acne")


CASES = (grazing_light, creases, contacts)
