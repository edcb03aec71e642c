"""Cases in which the width of a penumbra is guessed wrongly, or divides by zero."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

import passgraph as pg
from passgraph.bench.bench_scenes import scene_named
from passgraph.bench.metrics import FALSE_SHARE
from passgraph.bench.truth import PENUMBRA, truth_of
from passgraph.effects.shadows.shadow_choice import Blur, Disc, Hard, Pcf, Pcss, Penumbra
from passgraph.scene.matrices import translation
from tests.effects.hard.case import SIZE, Case, Figure, Picture, mask, rmse, shown, traced, width_of
from tests.effects.hard.naive import closer_soft, frame, naive
from tests.effects.scenes import cube, floor, sun

SUN_TANGENT = 0.2
#: Below everything: a depth is never raised to it.
UNCLAMPED = -1e30


def sheet(height: float, low: float, high: float, name: str = "sheet") -> pg.Node:
    """A level card over low ≤ x ≤ high."""
    corners = np.array([[low, 0, 1.5], [high, 0, 1.5], [high, 0, -1.5], [low, 0, -1.5]])
    mesh = pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]])
    return pg.Node(mesh, pg.Material(double_sided=True), translation((0, height, 0)), name)


def under_sheets(*sheets: pg.Node) -> pg.Scene:
    """Seen from below them at a slant, lit from straight above."""
    camera = pg.Camera((3.0, 0.32, 0), (0.6, 0, 0), vertical_fov_rad=0.35, near=0.05, far=40.0)
    return pg.Scene((floor(4.0), *sheets), camera, (sun(90.0, radius=SUN_TANGENT),))


def profile(share: Picture, scene: pg.Scene) -> tuple[np.ndarray, np.ndarray]:
    """World x and share down the middle column of the picture, on the floor, x rising."""
    from passgraph.truth import first_surfaces

    seen = first_surfaces(scene, SIZE)
    column = SIZE[0] // 2
    places = (seen.positions + seen.origin)[:, column, 0]
    on_floor = (seen.node[:, column] == 0) & (places > 0.0) & (places < 2.0)
    x = places[on_floor]
    order = np.argsort(x)
    return x[order], share[on_floor, column][order]


def edge_width(share: Picture, scene: pg.Scene) -> float:
    x, y = profile(share, scene)
    return width_of(y, x)


def bar_over_box() -> pg.Scene:
    """The shadow of a high bar falls across that of a low box."""
    bar = pg.Node(cube().mesh, transform=translation((-1.1, 2.4, 0.1)) @ np.diag([2.2, 0.1, 0.35, 1.0]), name="bar")
    nodes = (floor(4.0), cube((0.55, 0, -0.1), 0.6), bar)
    camera = pg.Camera((1.9, 2.0, 3.0), (1.25, 0.1, 0), vertical_fov_rad=0.5)
    return pg.Scene(nodes, camera, (sun(45.0, radius=0.12),))


@lru_cache
def stacked(backend: str) -> Case:
    single = {f"one sheet at {height:g}": under_sheets(sheet(height, -1.5, 0.8)) for height in (0.4, 1.6)}
    double = under_sheets(sheet(0.4, -1.5, 0.8), sheet(1.6, -1.5, 0.6, "upper"))
    figures = []
    for name, scene in (single | {"both, one over the other": double}).items():
        truth = traced(scene, samples=400)
        hard, pcss = (mask(scene, backend, filter=f, map_size=512) for f in (Hard(), Pcss(taps=32)))
        figures += [
            Figure(f"penumbra's width, {name}", *(edge_width(p, scene) for p in (truth.share, hard, pcss))),
            Figure(f"RMSE to rays, {name}", 0.0, rmse(hard, truth), rmse(pcss, truth)),
        ]
    scene = bar_over_box()
    truth = traced(scene)
    hard, pcss = (mask(scene, backend, filter=f, map_size=512) for f in (Hard(), Pcss(taps=64)))
    figures.append(Figure("RMSE to rays, a bar's shadow across a box's", 0.0, rmse(hard, truth), rmse(pcss, truth)))
    return Case(
        "stacked-blockers",
        "PCSS under two casters, one over the other",
        "PCSS knows one mean distance of casters. Of two sheets the map shows the upper one only, and the lower one"
        " past its edge: the widths of the two penumbrae are mixed.",
        "A limit of PCSS: measured against rays beside single sheets, where the width is right. `penumbra` knows two"
        " distances, see the next case.",
        ("ray-traced", "hard", "passgraph pcss"),
        tuple(figures),
        (
            ("ray-traced", shown(scene, truth.share)),
            ("hard", shown(scene, hard)),
            ("passgraph pcss", shown(scene, pcss)),
        ),
    )


#: Scenes of `passgraph.bench.bench_scenes` in which casters lie one over the other.
STACK_SIZE = (480, 270)
STACKS = ("two-sheets", "three-sheets", "shelf", "cage", "leaves", "furniture")


@lru_cache
def overlapping(backend: str) -> Case:
    """What arrives in full shadow where the map shows the uppermost of several casters."""
    figures, strip = [], []
    for name in STACKS:
        scene = scene_named(name)
        truth = truth_of(scene, STACK_SIZE, 144)
        pcss, ours = (
            mask(scene, backend, size=STACK_SIZE, filter=f, map_size=1024) for f in (Pcss(taps=32), Penumbra())
        )
        umbra = truth.counts & (truth.share <= PENUMBRA[0])
        leaks = (float(np.mean(p[umbra] > FALSE_SHARE)) for p in (pcss, ours))
        errors = (float(np.sqrt(np.mean((p - truth.share)[truth.counts] ** 2))) for p in (pcss, ours))
        figures += [
            Figure(f"share of the umbra that shows more than 0.1 of the light, {name}", 0.0, *leaks, digits=4),
            Figure(f"RMSE to rays, {name}", 0.0, *errors, digits=4),
        ]
        if name == STACKS[0]:
            strip = [
                (label, shown(scene, p))
                for label, p in (("ray-traced", truth.share), ("pcss", pcss), ("passgraph penumbra", ours))
            ]
    return Case(
        "overlapping-casters",
        "Full shadow below several casters",
        "A map shows the uppermost caster only. Past its edge the lower one appears, and counts there with the width of"
        " the upper one's penumbra, or not at all: light leaks into full shadow.",
        "`penumbra`, the default, compares each ray to the light where it passes the far casters, and again where it"
        " passes the near ones; a caster that a farther one hides goes on below it. Still missed are strips of a"
        " lower caster that are narrow against the upper one's penumbra.",
        ("ray-traced", "pcss, 32 taps", "passgraph penumbra"),
        tuple(figures),
        tuple(strip),
    )


@lru_cache
def clamped_depth(backend: str) -> Case:
    """A caster that stands before the near plane and is drawn upon it ("pancaked") loses its distance."""
    scene = under_sheets(sheet(1.6, -1.5, 0.8))
    truth = traced(scene, samples=400)
    known = frame(scene, map_size=512)
    values = {"bias": 4 * known["texel"], "radius": SUN_TANGENT, "search": 1.6 * SUN_TANGENT, "spared": True}
    # the depth of a plane 0.4 over the floor, along the light
    depth_of_floor = floor_depth(scene)
    flattened = naive(closer_soft, scene, backend, map_size=512, lowest=depth_of_floor - 0.4, **values)
    kept = naive(closer_soft, scene, backend, map_size=512, lowest=UNCLAMPED, **values)
    ours = mask(scene, backend, filter=Pcss(taps=32), map_size=512)
    widths = [edge_width(p, scene) for p in (truth.share, flattened, ours)]
    # the picture shows the same sheet from a corner
    corner = scene.with_(camera=pg.Camera((3.6, 1.35, 3.0), (0.3, 0, 0.6), vertical_fov_rad=0.62))
    seen = (
        traced(corner).share,
        naive(closer_soft, corner, backend, map_size=512, lowest=depth_of_floor - 0.4, **values),
        mask(corner, backend, filter=Pcss(taps=32), map_size=512),
    )
    labels = ("ray-traced", "clamped", "passgraph pcss")
    return Case(
        "clamped-depth",
        "PCSS when depth is clamped",
        "Casters before the near plane are drawn upon it, to keep the map's depth range for the rest. Their distance is"
        " lost, and with it the width of their penumbra: here a sheet at 1.6 seems to hang at 0.4.",
        "The map holds linear, unclamped depth in a float32 target, and its frustum holds every caster.",
        labels,
        (
            Figure("penumbra's width", *widths),
            Figure("the same kernel without the clamp", widths[0], None, edge_width(kept, scene)),
            Figure("RMSE to rays", 0.0, rmse(flattened, truth), rmse(ours, truth)),
        ),
        tuple((label, shown(corner, share)) for label, share in zip(labels, seen, strict=True)),
    )


def floor_depth(scene: pg.Scene) -> float:
    """Along the light's axis, of the world's origin, which lies on the floor."""
    from passgraph.effects.surfaces.views import Casters

    light = scene.lights[0]
    view, _ = light.frustum(Casters.in_scene(scene).bounds_for(light))
    return float(-view[2, 3])


def blocks(light: pg.Light, *nodes: pg.Node) -> pg.Scene:
    camera = pg.Camera((2.6, 2.6, 4.4), (0.2, 0.3, 0), vertical_fov_rad=0.6)
    return pg.Scene((floor(4.0), *(nodes or (cube(), cube((-1.2, 0, 0.6), 0.5)))), camera, (light,))


SOFT_FILTERS = {
    "blur": {"filter": Blur(), "softness": None},
    "pcf, 1×1": {"filter": Pcf(1)},
    "disc": {"filter": Disc(), "softness": 0.0},
    "pcss": {"filter": Pcss()},
}


@lru_cache
def zero_area(backend: str) -> Case:
    """A light without extent: every filter is the hard shadow, bit by bit."""
    scene = blocks(sun(45, 30, radius=0.0))
    hard = mask(scene, backend, filter=Hard())
    bilinear = mask(scene, backend, filter=Blur(), softness=0.0)
    figures = []
    for name, options in SOFT_FILTERS.items():
        # the blurred mask compares four texels bilinearly; without a blur that is what must be left
        exact = bilinear if name == "blur" else hard
        got = mask(scene, backend, **options)
        figures.append(
            Figure(f"pixels that differ from the hard shadow, {name}", 0, None, float((got != exact).sum()), 0)
        )
    with np.errstate(invalid="ignore", divide="ignore"):
        weights = np.exp(-((np.arange(-1, 2) / np.float64(0.0)) ** 2))
        weights /= weights.sum()
    figures.append(Figure("NaN weights of a Gaussian of width 0, of 3", 0, float(np.isnan(weights).sum()), 0.0, 0))
    return Case(
        "zero-area",
        "A light without extent",
        "Widths of 0 divide 0 by 0 in the penumbra's estimate and in the weights of a blur.",
        "Every filter gives the hard shadow exactly; the blur's passes are left out of the plan.",
        ("expected", "0 / 0", "passgraph"),
        tuple(figures),
    )


@lru_cache
def no_blockers(backend: str) -> Case:
    """Where the search finds no caster, the mean of their depths is 0 / 0."""
    scene = blocks(sun(45, 30, radius=0.1))
    truth = traced(scene)
    known = frame(scene)
    values = {"bias": 3 * known["texel"], "radius": 0.1, "search": 0.2, "lowest": UNCLAMPED}
    bad = naive(closer_soft, scene, backend, spared=False, **values)
    good = mask(scene, backend, filter=Pcss(taps=48))
    lit = truth.valid & (truth.share == 1.0)
    spoilt = (float(((~np.isfinite(p) | (p < 0.99)) & lit).sum() / lit.sum()) for p in (bad, good))
    alone = blocks(replace(scene.lights[0], radius=0.1), cube((30, 0, 30)))
    bare = mask(alone, backend, filter=Pcss())
    return Case(
        "no-blockers",
        "No caster before the receiver",
        "The mean of no depths is 0 / 0. Kept from being NaN by a divisor of at least 1 it is a caster at the light"
        " itself: the filter becomes as wide as the map, and a haze of far shadows lies about each.",
        "The search ends early with 1 where it finds no caster.",
        ("truth", "without the early out", "passgraph pcss"),
        (
            Figure("share of fully lit pixels that are darkened", 0.0, *spoilt),
            Figure("least light on a bare floor", 1.0, None, float(bare[traced(alone).valid].min())),
        ),
        (
            ("ray-traced", shown(scene, truth.share)),
            ("mean of nothing", shown(scene, np.nan_to_num(bad))),
            ("passgraph pcss", shown(scene, good)),
        ),
    )


CASES = (stacked, overlapping, clamped_depth, zero_area, no_blockers)
