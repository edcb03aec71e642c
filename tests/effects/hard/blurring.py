"""Cases in which a blur on the screen, or of the map, goes wrong; and the claims that the blur was chosen for."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from functools import lru_cache
from math import tan

import numpy as np
from scipy.ndimage import maximum_filter

import passgraph as pg
from passgraph.effects import soft_shadow_passes
from passgraph.effects.shadows.shadow_choice import Blur, Hard, Pcss
from passgraph.scene.matrices import translation
from passgraph.scene.shipped_scene import ball, cylinder
from passgraph.truth import first_surfaces
from tests.effects.hard.case import SIZE, Case, Figure, Picture, mask, rmse, shown, traced, width_of
from tests.effects.hard.naive import sure
from tests.effects.scenes import cube, floor, floor_places, from_above, sun


def before_a_shadow() -> pg.Scene:
    """A lit pillar in front of a shadow on the floor behind it."""
    nodes = (
        floor(5.0),
        pg.Node(cylinder(0.14, 1.5), transform=translation((0.2, 0, 1.1)), name="pillar"),
        cube((-1.4, 0, -0.1), 1.3),
    )
    light = pg.Light.directional((1.0, -0.8, -0.35), radius=0.06)
    return pg.Scene(nodes, pg.Camera((0.4, 1.5, 4.4), (0.25, 0.45, 0), vertical_fov_rad=0.5), (light,))


@lru_cache
def pillar(backend: str) -> Case:
    scene = before_a_shadow()
    truth = traced(scene)
    softness = 0.06
    bad = mask(scene, backend, softness=softness, filter=Blur("constant", radius_px=9), map_size=512)
    good = mask(scene, backend, softness=softness, map_size=512)
    seen = first_surfaces(scene, SIZE)
    # away from where the pillar turns from the light, which no mask gets right to a pixel
    facing = -seen.normals @ np.array(scene.lights[0].direction) > 0.3
    lit = truth.valid & (truth.share == 1.0) & (seen.node == 1) & facing
    beside = maximum_filter((seen.node == 1).astype(np.uint8), 19) > 0
    umbra = truth.valid & (truth.share == 0.0) & (seen.node == 0) & beside & sure(truth.share, 3)
    figures = [
        Figure("least light on the pillar's lit side", 1.0, *(float(p[lit].min()) for p in (bad, good))),
        Figure("most light in the umbra behind it", 0.0, *(float(p[umbra].max()) for p in (bad, good))),
        Figure("RMSE to rays", 0.0, rmse(bad, truth), rmse(good, truth)),
    ]
    return Case(
        "pillar",
        "A mask blurred across a pillar's edge",
        "The blur takes the shadow on the floor behind for one on the pillar, and light from the pillar for light in"
        " the shadow: a halo, 9 pixels wide.",
        "A tap counts less the farther it lies off the receiver's plane (from depth and normal), and a floor under the"
        " sum of weights keeps it above 0.",
        ("ray-traced", "constant blur", "passgraph"),
        tuple(figures),
        (
            ("ray-traced", shown(scene, truth.share)),
            ("constant blur", shown(scene, bad)),
            ("passgraph", shown(scene, good)),
        ),
    )


DOLLY = (6.0, 9.0, 12.0, 18.0, 24.0)
DOLLY_SIZE = (96, 64)


def receding(distance: float) -> pg.Scene:
    """A cube's shadow from straight above, from ever farther away; the sun makes edges 0.15 wide."""
    return pg.Scene((floor(40.0), cube()), from_above(distance), (sun(45, 20, radius=0.15),))


def dark_mass(share: Picture, distance: float) -> float:
    """Floor area that is more than half dark, weighted by darkness, square units."""
    dark = 1.0 - share
    pixel = 2.0 * tan(0.3) * distance / DOLLY_SIZE[1]
    return float(dark[dark > 0.5].sum() * pixel * pixel)


def along_dolly(backend: str, distances: Sequence[float]) -> list[tuple[Picture, Picture, Picture]]:
    """Rays, constant blur and blur in scene units from each distance; the camera is a value of each run."""
    made = [[traced(receding(distance), DOLLY_SIZE).share for distance in distances]]
    for width in (Blur("constant"), Blur("world")):
        passes = soft_shadow_passes(receding(distances[0]), ambient=0.0, map_size=256, softness=0.15, filter=width)
        assert passes.shadows_blurred is not None
        with pg.compile(passes.shadows_blurred, backend=backend, size=DOLLY_SIZE) as program:
            runs = [program(camera=from_above(distance))["shadows_blurred"] for distance in distances]
        made.append([np.array(run[:, :, 0]) for run in runs])
    return list(zip(*made, strict=True))


@lru_cache
def dolly(backend: str) -> Case:
    figures, strip = [], []
    for distance, shares in zip(DOLLY, along_dolly(backend, DOLLY), strict=True):
        masses = (dark_mass(share, distance) for share in shares)
        figures.append(Figure(f"shadow mass from {distance:g} units away", *masses))
        if distance == 18.0:
            labels = ("ray-traced, 18 units", "constant blur", "blur in scene units")
            strip = [(label, _closer(shown(receding(distance), s))) for label, s in zip(labels, shares, strict=True)]
    slow = [float(distance) for distance in np.linspace(10.0, 12.0, 8)]
    each = [[dark_mass(s, d) for s in shares] for d, shares in zip(slow, along_dolly(backend, slow), strict=True)]
    spread = np.std(each, axis=0) / np.mean(each, axis=0)
    figures.append(Figure("spread of the mass over a dolly from 10 to 12 units, of its mean", *map(float, spread)))
    return Case(
        "dolly",
        "The camera recedes from a shadow",
        "A blur of a fixed number of pixels grows on the floor as the camera recedes, until it washes the shadow away.",
        "The blur's width is given in scene units and divided by the depth of each pixel; never below one pixel.",
        ("ray-traced", "blur of 15 pixels", "blur in scene units"),
        tuple(figures),
        tuple(strip),
    )


def _closer(picture: Picture) -> Picture:
    """The middle of a small picture, four times as large, so that its pixels are seen."""
    h, w = picture.shape[0] // 2, picture.shape[1] // 2
    return np.repeat(np.repeat(picture[h - 18 : h + 18, w - 30 : w + 30], 4, 0), 4, 1)


CLAIM_SIZE = (192, 128)


def over_edge(distance: float = 3.0) -> pg.Scene:
    """The far edge of a cube's shadow from straight above; rays of its sun make an edge 1.374 × 0.106 × 1.41 wide."""
    return pg.Scene((floor(), cube()), from_above(distance, 1.3), (sun(45, radius=0.106),))


def far_edge_width(share: Picture, scene: pg.Scene, size: tuple[int, int] = CLAIM_SIZE) -> float:
    """From 0.1 to 0.9 along the middle row, over the edge at x = 1.5."""
    x, _ = floor_places(scene.camera, size)
    middle = slice(size[1] // 2 - 4, size[1] // 2 + 4)
    beyond = x[0] > 1.0
    return width_of(share[middle].mean(axis=0)[beyond], x[0][beyond])


@lru_cache
def blur_before(backend: str) -> Case:
    """The same 15 texels before and after the comparison."""
    scene = over_edge()
    truth = traced(scene, CLAIM_SIZE)
    after = mask(scene, backend, CLAIM_SIZE, softness=0.26)
    before = mask(scene, backend, CLAIM_SIZE, softness=0.0, map_blur_px=15)
    sharp = mask(scene, backend, CLAIM_SIZE, softness=0.0)
    widths = [far_edge_width(p, scene) for p in (truth.share, before, after)]
    return Case(
        "blur-before",
        "A depth map blurred before the comparison",
        "Depths are not shares of light: a blurred depth is a surface that is not there, and what is compared with it"
        " is still lit or dark. The edge moves and stays hard.",
        "Compare first, blur the result.",
        ("ray-traced", "map blurred by 15 texels", "mask blurred"),
        (
            Figure("width of the edge, units", *widths),
            Figure("the same without any blur", widths[0], far_edge_width(sharp, scene), None),
            Figure("RMSE to rays", 0.0, rmse(before, truth), rmse(after, truth)),
        ),
        (
            ("ray-traced", shown(scene, truth.share)),
            ("map blurred", shown(scene, before)),
            ("mask blurred", shown(scene, after)),
        ),
    )


FRAMES = 6
MAP_SIZES = (256, 512, 1024, 2048, 4096)


def usual() -> pg.Scene:
    """Some of everything, under one sun with an extent."""
    nodes = (
        floor(4.0),
        cube((-0.6, 0, 0.3)),
        cube((1.3, 0, -0.8), 0.6),
        pg.Node(ball(0.45), transform=translation((0.9, 0.45, 0.9)), name="ball"),
        pg.Node(cylinder(0.08, 1.8), transform=translation((-1.6, 0, -0.6)), name="pillar"),
    )
    camera = pg.Camera((2.4, 3.4, 5.6), (0.3, 0.3, 0), vertical_fov_rad=0.56)
    return pg.Scene(nodes, camera, (sun(45.0, 25.0, radius=0.08),))


def frame_ms(
    programs: Sequence[tuple[pg.Scene, dict[str, object]]], backend: str, size: tuple[int, int]
) -> list[float]:
    """Least processor time of a frame of each, all threads together, milliseconds: what else runs does not count.

    Frames are run in turn, with lights moved so that nothing is reused.
    """
    least = [np.inf] * len(programs)
    with ExitStack() as stack:
        opened = [
            stack.enter_context(
                pg.compile(soft_shadow_passes(scene, **options).picture, backend=backend, size=size)  # type: ignore[arg-type]
            )
            for scene, options in programs
        ]
        for run in range(FRAMES + 1):
            for index, program in enumerate(opened):
                scene = programs[index][0]
                lights = {
                    n: _nudged(light, 1e-4 * (run + 1)) for n, light in zip(_names(scene), scene.lights, strict=True)
                }
                begin = time.process_time()
                program.run(**lights)
                program.finish()
                if run:
                    least[index] = min(least[index], 1e3 * (time.process_time() - begin))
    return least


def _names(scene: pg.Scene) -> list[str]:
    return ["light"] if len(scene.lights) == 1 else [f"light{i}" for i in range(len(scene.lights))]


def _nudged(light: pg.Light, by: float) -> pg.Light:
    x, y, z = light.direction
    return pg.Light.directional((x + by, y, z), light.color, light.intensity, light.radius)


@lru_cache
def larger_maps(backend: str) -> Case:
    """Sharper and sharper, and no nearer to the truth."""
    scene = usual()
    truth = traced(scene)
    blurred = mask(scene, backend, map_size=512, filter=Blur())
    settings: list[dict[str, object]] = [{"map_size": 512, "filter": Blur()}]
    settings += [{"map_size": side, "filter": Hard()} for side in MAP_SIZES]
    times = frame_ms([(scene, options) for options in settings], backend, SIZE)
    figures = [
        Figure("RMSE to rays, blur, 512²", 0.0, None, rmse(blurred, truth)),
        Figure("processor ms a frame, blur, 512²", None, None, times[0], 1),
    ]
    for side, ms in zip(MAP_SIZES, times[1:], strict=True):
        sharp = mask(scene, backend, filter=Hard(), map_size=side)
        figures += [
            Figure(f"RMSE to rays, {side}²", 0.0, rmse(sharp, truth), None),
            Figure(f"processor ms a frame, {side}²", None, ms, None, 1),
        ]
    return Case(
        "larger-maps",
        "A larger shadow map instead of a blur",
        "More texels make edges straight, not soft: the error against a sun with an extent falls to that of a hard"
        " shadow and stays there, while the map's cost grows with its area.",
        "A small map, and a blur on the screen.",
        ("ray-traced", "hard, larger map", "blur, 512²"),
        tuple(figures),
        (
            ("ray-traced", shown(scene, truth.share)),
            ("hard, 4096 texels wide", shown(scene, sharp)),
            ("blur, 512 texels wide", shown(scene, blurred)),
        ),
    )


LIGHTS = (1, 2, 4, 8)


def under_lights(count: int) -> pg.Scene:
    lights = [sun(40 + 3 * i, 25 + 360 * i / max(LIGHTS), radius=0.08, intensity=1.0 / count) for i in range(count)]
    return usual().with_(lights=lights)


SPEED_SIZE = (480, 300)
PARTS: dict[str, dict[str, object]] = {
    "no shadows": {"softness": 0.0},
    "hard shadows": {"softness": 0.0},
    "blurred shadows": {"filter": Blur()},
    "pcss, 16 taps": {"filter": Pcss(taps=16)},
}


def silenced(scene: pg.Scene) -> pg.Scene:
    """Nothing casts."""
    return scene.with_(nodes=[pg.Node(n.mesh, n.material, n.transform, n.name, casts=False) for n in scene.nodes])


@lru_cache
def many_lights(backend: str) -> Case:
    """All lights share one blur; each adds a map and a lookup."""
    options: dict[str, object] = {"map_size": 512, "filter": Blur()}
    scenes = [(under_lights(count), options) for count in LIGHTS]
    times = frame_ms(scenes, backend, SPEED_SIZE)
    figures = [Figure(f"processor ms, {n} lights", None, None, ms, 1) for n, ms in zip(LIGHTS, times, strict=True)]
    each = (times[-1] - times[0]) / (LIGHTS[-1] - LIGHTS[0])
    figures.append(Figure("processor ms for each light more", None, None, each, 1))
    one = under_lights(1)
    parts: list[tuple[pg.Scene, dict[str, object]]] = [
        (silenced(one) if name == "no shadows" else one, {"map_size": 512, **part}) for name, part in PARTS.items()
    ]
    for name, ms in zip(PARTS, frame_ms(parts, backend, SPEED_SIZE), strict=True):
        figures.append(Figure(f"processor ms, 1 light, {name}", None, None, ms, 1))
    return Case(
        "many-lights",
        "Many lights, and what a frame is made of",
        "A blur for each light would cost as much again each time.",
        "The mask holds the share of all light that arrives, so that any number of lights needs one blur.",
        ("", "", f"passgraph, {SPEED_SIZE[0]}×{SPEED_SIZE[1]}"),
        tuple(figures),
    )


def self_shadowing() -> pg.Scene:
    """A slab on a pillar shadows the floor, the pillar, the cube and the ball; its own back is dark."""
    nodes = (
        floor(4.0),
        pg.Node(cylinder(0.25, 1.0), name="pillar"),
        pg.Node(cube().mesh, transform=translation((0, 1.0, 0)) @ np.diag([1.2, 0.2, 1.2, 1.0]), name="slab"),
        pg.Node(ball(0.15), transform=translation((0.1, 1.34, 0.1)), name="small ball"),
        cube((-0.9, 0, 0.4), 0.7),
        pg.Node(ball(0.3), transform=translation((0.0, 0.3, 0.75)), name="ball"),
    )
    camera = pg.Camera((2.4, 2.2, 4.4), (-0.1, 0.55, 0.1), vertical_fov_rad=0.5)
    return pg.Scene(nodes, camera, (sun(42.0, 165.0, radius=0.04),))


@lru_cache
def everything(backend: str) -> Case:
    """Each node's darkness, where its own surface faces the light."""
    scene = self_shadowing()
    truth = traced(scene)
    soft = mask(scene, backend, map_size=512, filter=Blur())
    seen = first_surfaces(scene, SIZE)
    figures = []
    for number, node in enumerate(scene.nodes):
        on = truth.valid & (seen.node == number)
        figures.append(
            Figure(
                f"mean share that arrives on the {node.name}",
                float(truth.share[on].mean()),
                None,
                float(soft[on].mean()),
            )
        )
    silent = pg.Scene(
        tuple(pg.Node(n.mesh, n.material, n.transform, n.name, receives=n.name == "floor") for n in scene.nodes),
        scene.camera, scene.lights,
    )  # fmt: skip
    planar = mask(silent, backend, map_size=512, filter=Blur())
    figures.append(Figure("RMSE to rays", 0.0, rmse(planar, truth), rmse(soft, truth)))
    return Case(
        "everything",
        "Every object casts and receives",
        "Shadows on a floor alone, as planar shadows are, leave all else lit.",
        "A shadow map knows no roles: things shadow the floor, each other and themselves.",
        ("ray-traced", "floor only", "passgraph"),
        tuple(figures),
        (
            ("ray-traced", shown(scene, truth.share)),
            ("floor only", shown(scene, planar)),
            ("passgraph", shown(scene, soft)),
        ),
    )


CASES = (pillar, dolly, blur_before, larger_maps, many_lights, everything)
