"""Cases in which float32 runs out of digits."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph import dot, mat4, normalize, vec3, vec4
from passgraph.effects import soft_shadow_passes
from passgraph.scene.matrices import rotation_y, translation
from passgraph.scene.shipped_scene import ball
from passgraph.srgb import linear_to_srgb
from tests.effects.hard.case import SIZE, Case, Figure, Picture
from tests.effects.scenes import cube, floor, moved, render, sun

OFFSETS = (1e6, 1e7)
BACKGROUND = (0.3, 0.36, 0.42)


@pg.struct
class Flat:
    """A vertex in clip space, and its normal."""

    position: vec4
    normal: vec3


@pg.vertex
def in_world(vertex: pg.Vertex, model: mat4, view_projection: mat4) -> Flat:
    """First to world positions, then to the screen: the usual chain, in float32."""
    world = model * vec4(vertex.position, 1.0)
    return Flat(view_projection * world, vertex.normal)


@pg.fragment
def grey(flat: Flat, toward: vec3) -> vec4:
    """Lambert, with light from all around."""
    return vec4(vec3(0.25 + 0.7 * max(dot(normalize(flat.normal), toward), 0.0)), 1.0)


def naive_picture(scene: pg.Scene, backend: str, size: tuple[int, int]) -> Picture:
    """Every node through world positions in float32, linear values."""
    camera, light = scene.camera, scene.lights[0]
    view = camera.view_matrix()
    into: Any = pg.target("naive", "rgba16f", scale=1.0, clear=(*BACKGROUND, 1.0))
    depth: Any = pg.target("naive depth", "depth32f", scale=1.0)
    for node in scene.nodes:
        into = pg.draw(
            node.mesh, vertex=in_world, fragment=grey, into=into, depth=depth, cull="back",
            model=node.transform, view_projection=camera.projection_matrix(size[0] / size[1]) @ view,
            toward=tuple(-np.array(light.direction)),
        )  # fmt: skip
        depth = into.depth
    return render(into, size=size, backend=backend)["naive"][:, :, :3]


def set_of_things() -> pg.Scene:
    nodes = (
        floor(2.0),
        pg.Node(cube().mesh, transform=translation((-0.5, 0, 0)) @ rotation_y(0.5), name="cube"),
        pg.Node(ball(0.4), transform=translation((0.7, 0.4, 0.3)), name="ball"),
    )
    return pg.Scene(nodes, pg.Camera((2.2, 2.2, 3.4), (0, 0.3, 0), vertical_fov_rad=0.62), (sun(45, 30, radius=0.1),))


def library_picture(scene: pg.Scene, backend: str, size: tuple[int, int]) -> Picture:
    passes = soft_shadow_passes(scene, map_size=256, display=False, background=BACKGROUND)
    return render(passes.soft_shadow, size=size, backend=backend)["soft_shadow"][:, :, :3]


@lru_cache
def far_from_origin(backend: str) -> Case:
    scene = set_of_things()
    # the same view: what changes by more than a rounding of the picture is wrong
    naive_here, ours_here = (f(scene, backend, SIZE) for f in (naive_picture, library_picture))
    figures, strip = [], [("at the origin", linear_to_srgb(np.clip(ours_here, 0, 1)))]
    for offset in OFFSETS:
        far = moved(scene, (offset, offset / 3.0, -offset / 7.0))
        bad, good = (f(far, backend, SIZE) for f in (naive_picture, library_picture))
        figures.append(
            Figure(
                f"share of pixels changed at {offset:.0e} units",
                0.0,
                changed(bad, naive_here),
                changed(good, ours_here),
            )
        )
        if offset == 1e6:
            strip += [
                ("world positions, 1e6", linear_to_srgb(np.clip(bad, 0, 1))),
                ("passgraph, 1e6", linear_to_srgb(np.clip(good, 0, 1))),
            ]
    return Case(
        "far-from-origin",
        "A world far from its origin",
        "A float32 step is 0.06 units at 1e6 and 1 unit at 1e7: vertices snap to it, matrices lose their small terms.",
        "Matrices relative to the eye are composed in float64 on the host; meshes are relative to a near origin; light"
        " frames are relative to the eye too.",
        ("at the origin", "float32 world positions", "passgraph"),
        tuple(figures),
        tuple(strip),
    )


def changed(got: Picture, before: Picture) -> float:
    """Share of pixels that differ by more than 1/50 of white."""
    return float((abs(got - before) > 0.02).any(axis=2).mean())


@pg.struct
class Point:
    """A vertex whose linear depth is kept."""

    position: vec4
    view_z: float


@pg.vertex
def projected(vertex: pg.Vertex, projection: mat4) -> Point:
    """A camera at the origin."""
    return Point(projection * vec4(vertex.position, 1.0), -vertex.position.z)


@pg.fragment
def linear_depth(point: Point) -> float:
    """Distance along the view axis, scene units."""
    return point.view_z


def ramp() -> pg.Mesh:
    """A plane that fills the view and falls from depth 900 to 901."""
    points = []
    for y in (-1.0, 1.0):
        for x, z in ((-1.0, 900.0), (1.0, 901.0)):
            points.append([x * z * 1.01, y * z * 1.01, -z])
    return pg.Mesh.make(points, [[0, 1, 3], [0, 3, 2]])


@lru_cache
def distant_depths(backend: str) -> Case:
    camera = pg.Camera((0, 0, 0), (0, 0, -1), vertical_fov_rad=np.pi / 2, near=0.1, far=1000.0)
    size = (1000, 2)
    linear = pg.draw(
        ramp(), vertex=projected, fragment=linear_depth, into=pg.target("linear", "r32f", scale=1.0),
        depth=pg.target("test", "depth32f", scale=1.0), projection=camera.projection_matrix(1.0),
    )  # fmt: skip
    made = render(linear, linear.depth, size=size, backend=backend)
    stored, kept = made["test"][0, :, 0], made["linear"][0, :, 0]
    exact = np.linspace(900, 901, size[0])
    return Case(
        "distant-depths",
        "near 0.1, far 1000, depths from 900 to 901",
        "A perspective depth buffer spends its values near the eye: float32 has three left between 900 and 901.",
        "Depths that are compared with a map are linear, in a float32 color target beside the depth buffer; only the"
        " order of surfaces is left to the buffer, and fitted frusta keep near above a thousandth of far.",
        ("asked for", "depth buffer", "linear depth"),
        (
            Figure(
                "distinct values in 1000 pixels", len(np.unique(exact)), len(np.unique(stored)), len(np.unique(kept)), 0
            ),
            Figure("largest error, units", 0.0, depth_error(stored, camera, kept), float(abs(np.diff(kept)).max())),
        ),
        (
            ("asked for", bands(exact - 900.0)),
            ("depth buffer, as units", bands(unprojected(stored, camera) - 900.0)),
            ("linear depth", bands(kept - 900.0)),
        ),
    )


def unprojected(stored: NDArray[Any], camera: pg.Camera) -> NDArray[np.float64]:
    """Window depth back to distances along the view axis."""
    near, far = camera.near, camera.far
    return near * far / (far - stored.astype(np.float64) * (far - near))


def depth_error(stored: NDArray[Any], camera: pg.Camera, exact: NDArray[Any]) -> float:
    return float(abs(unprojected(stored, camera) - exact).max())


def bands(values: NDArray[Any]) -> Picture:
    """A row of 0 to 1 as a picture."""
    row = np.interp(np.linspace(0, 1, SIZE[0]), np.linspace(0, 1, len(values)), values)
    return np.broadcast_to(row, (60, SIZE[0])).astype(np.float32)


@pg.fragment
def painted(flat: Flat, tone: float) -> vec4:
    """One tone."""
    return vec4(tone, tone, tone, 1.0)


def coplanar_picture(backend: str, distance: float, offset: tuple[float, float]) -> Picture:
    """A dark mat lies `LIFT` over a light floor; it is as large in the picture at any distance."""
    size = SIZE
    eye = np.array([0.3, 0.5, 0.8]) * distance
    camera = pg.Camera(tuple(eye), (0, 0, 0), vertical_fov_rad=2.0 / distance, near=0.1, far=1000.0)
    view = camera.view_matrix()
    values = {"view_projection": camera.projection_matrix(size[0] / size[1]) @ view}
    into = pg.target("mat", "rgba16f", scale=1.0, clear=(*BACKGROUND, 1.0))
    depth = pg.target("mat depth", "depth32f", scale=1.0)
    first = pg.draw(
        floor(1.5).mesh, vertex=in_world, fragment=painted, into=into, depth=depth, tone=0.6,
        model=rotation_y(0.3), values=values,
    )  # fmt: skip
    # another tessellation: its depths round differently
    ring = np.array([[np.cos(a), 0.0, -np.sin(a)] for a in np.linspace(0, 2 * np.pi, 7)[:-1]])
    mesh = pg.Mesh.make(np.concatenate([[[0, 0, 0]], 0.5 * ring]), [[0, i + 1, (i + 1) % 6 + 1] for i in range(6)])
    second = pg.draw(
        mesh, vertex=in_world, fragment=painted, into=first, depth=first.depth,
        polygon_offset=offset, tone=0.1, model=translation((0, LIFT, 0)), values=values,
    )  # fmt: skip
    return render(second, size=size, backend=backend)["mat"][:, :, :3]


#: Scene units: a millimetre, where a unit is a metre.
LIFT = 1e-3
DISTANCES = (3.0, 100.0, 300.0)


@lru_cache
def coplanar(backend: str) -> Case:
    figures, strip = [], []
    for distance in DISTANCES:
        whole = coplanar_picture(backend, distance, (-64.0, -4096.0))
        bad = coplanar_picture(backend, distance, (0.0, 0.0))
        good = coplanar_picture(backend, distance, (-1.0, -4.0))
        mat = whole[:, :, 0] < 0.3
        lost = [float((p[:, :, 0][mat] > 0.3).mean()) for p in (bad, good)]
        figures.append(Figure(f"share of the mat that the floor shows through, {distance:g} units away", 0.0, *lost))
        strip = [("all of the mat", whole), ("lifted, 300 units away", bad), ("and polygon offset", good)]
    return Case(
        "coplanar",
        "Two surfaces in one plane, one of them lifted",
        "A millimeter keeps them apart nearby; the depth buffer's steps grow with the square of the distance, and there"
        " one and the other shows, pixel by pixel (z-fighting).",
        "`polygon_offset` moves the upper one's depth by its own slope and by steps of the depth format, at any"
        " distance. Planar shadows are blended once by the stencil; those of `soft_shadow` are no geometry.",
        ("truth", "lifted by a millimeter", "and polygon offset (−1, −4)"),
        tuple(figures),
        tuple((label, linear_to_srgb(np.clip(picture, 0, 1))) for label, picture in strip),
    )


TABLES = (1024, 4096)


@lru_cache
def summed_area(backend: str) -> Case:
    """NumPy's float32 sums; no backend takes part."""
    figures = []
    for size in TABLES:
        picture = np.random.default_rng(3).random((size, size), dtype=np.float32)
        figures.append(
            Figure(f"largest error of an 8×8 mean, far corner, {size}²", 0.0, *corner_errors(picture), digits=7)
        )
    return Case(
        "summed-area",
        "A summed-area table",
        "The far corner holds the sum of the whole picture; a box is a small difference of four such numbers.",
        "Subtract the picture's mean first, so that sums stay small (or sum integers). passgraph's filters take taps"
        " and need no table.",
        ("exact", "float32 sums", "centered sums"),
        tuple(figures),
    )


def corner_errors(picture: Picture) -> tuple[float, float]:
    """Of 8×8 means in the last 64×64 pixels, from plain and from centred float32 tables."""
    mean = np.float32(picture.mean(dtype=np.float64))
    exact = means(np.cumsum(np.cumsum(picture.astype(np.float64), 0), 1))
    plain = means(np.cumsum(np.cumsum(picture, 0), 1))
    centred = means(np.cumsum(np.cumsum(picture - mean, 0), 1)) + mean
    return float(abs(plain - exact).max()), float(abs(centred - exact).max())


def means(table: NDArray[Any]) -> NDArray[Any]:
    corner = table[-73:, -73:]
    return (corner[8:, 8:] - corner[:-8, 8:] - corner[8:, :-8] + corner[:-8, :-8]) / 64


CASES = (far_from_origin, distant_depths, coplanar, summed_area)
