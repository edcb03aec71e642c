"""What the gallery is made from: photographs, models and a level, each from an optional package."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import passgraph as pg
from docs.gallery_page import InputMissing
from passgraph.effects.light2d import Light2D, Mover, Wall, Window
from passgraph.scene.ground import floor_node
from passgraph.scene.matrices import translation
from passgraph.scene.shipped_scene import box
from passgraph.srgb import srgb_to_linear

Picture = NDArray[np.float32]


def _needs(module: str, package: str) -> None:
    if find_spec(module) is None:
        raise InputMissing(f"{package} is not installed; run: pip install 'passgraph[dev]'")


# Photographs


@lru_cache
def photograph(name: str, stops: float = 0.0) -> Picture:
    """One of scikit-image's photographs in linear light, this many stops brighter."""
    _needs("skimage", "scikit-image")
    from skimage import data

    encoded: Picture = getattr(data, name)()[:, :, :3].astype(np.float32) / 255.0
    return np.asarray(srgb_to_linear(encoded) * 2.0**stops, np.float32)


@lru_cache
def lamps_at_dusk() -> Picture:
    """The rocket before its start, the range that the camera cut off guessed back: x / (1.02 - x), 50 at most."""
    encoded = photograph("rocket")
    return np.asarray(0.7 * encoded / (1.02 - encoded), np.float32)


def _motorcycle() -> tuple[Any, Any]:
    _needs("skimage", "scikit-image")
    from skimage import data

    left, _, disparity = data.stereo_motorcycle()
    # 16:9 without the borders, where the second camera saw nothing
    rows, columns = slice(60, 440), slice(40, 716)
    return left[rows, columns], disparity[rows, columns]


def street() -> Picture:
    """The left picture of the stereo pair, as stored."""
    return np.asarray(_motorcycle()[0] / 255.0, np.float32)


def street_depth() -> Picture:
    """Its measured depth in meters; infinite where nothing was measured.

    Middlebury 2014, "Motorcycle", at a quarter of its size: focal length 994.978 px, cameras 193.001 mm and
    31.086 px of disparity apart.
    """
    disparity = _motorcycle()[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = 0.193001 * 994.978 / (disparity + 31.086)
    return np.where(np.isfinite(disparity), depth, np.inf).astype(np.float32)


def detail(picture: Picture) -> Picture:
    """The handlebar."""
    return np.ascontiguousarray(picture[10:210, 300:550])


def ramps(height: int = 144, width: int = 640) -> Picture:
    """Gray, six pure colors and a skin tone as rows, 16 stops from left to right."""
    colours = [(1, 1, 1), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1), (0.9, 0.45, 0.3)]
    rows = np.repeat(np.array(colours, np.float32), height // len(colours), axis=0)
    light = 0.18 * np.geomspace(2.0**-8, 2.0**8, width).astype(np.float32)
    return np.asarray(rows[:, None, :] * light[None, :, None], np.float32)


# Models


def model(name: str, **options: Any) -> pg.Scene:
    """A model of pybullet's data."""
    _needs("pybullet_data", "pybullet")
    import pybullet_data

    return pg.Scene.load(Path(pybullet_data.getDataPath()) / name, **options)


@lru_cache
def monastery() -> pg.Scene:
    """Samurai monastery, 124,000 triangles; a sun with an extent."""
    scene = model("samurai_monastry.obj", ground=False)
    camera = pg.Camera((62.0, 44.0, 62.0), (-9.0, 1.0, -6.0), vertical_fov_rad=0.52, near=4.0, far=260.0)
    sun = pg.Light.directional((-0.75, -1.0, -0.1), (1.0, 0.93, 0.82), 1.0, radius=0.02)
    return scene.with_(camera=camera, lights=[sun])


def _placed(name: str, at: tuple[float, float, float], scale: float, turn_rad: float = 0.0, **options: Any) -> Any:
    """The model's nodes, standing on y = at[1]."""
    nodes = model(name, ground=False, **options).nodes
    low = np.min([node.bounds[0] for node in nodes], axis=0)
    high = np.max([node.bounds[1] for node in nodes], axis=0)
    middle = np.array([0.5 * (low[0] + high[0]), low[1], 0.5 * (low[2] + high[2])])
    c, s = math.cos(turn_rad) * scale, math.sin(turn_rad) * scale
    turn = np.array([[c, 0, s, 0], [0, scale, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1.0]])
    place = translation(at) @ turn @ translation(-middle)
    return [pg.Node(node.mesh, node.material, place @ node.transform, node.name) for node in nodes]


def _table(at: tuple[float, float, float], turn_rad: float) -> list[pg.Node]:
    """A table of five of the model's textured boxes, as its own description assembles it, in meters."""
    (box,) = model("table/table.obj", ground=False).nodes
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    turn = np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1.0]])
    legs = [((x, 0.28, z), (0.07, 0.56, 0.07)) for x in (-0.5, 0.5) for z in (-0.3, 0.3)]
    parts = []
    for middle, size in [((0.0, 0.585, 0.0), (1.15, 0.05, 0.75)), *legs]:
        place = translation(at) @ turn @ translation(middle) @ np.diag([*size, 1.0])
        parts.append(pg.Node(box.mesh, box.material, place @ box.transform, f"table {len(parts)}"))
    return parts


@lru_cache
def standing() -> pg.Scene:
    """A table, a duck that stands, and one that hovers a hand over the floor, in meters."""
    things = [
        *_table((-0.25, 0.0, -0.2), 0.45),
        *_placed("duck.obj", (0.5, 0.0, 0.5), 0.3, 0.6),
        *_placed("duck.obj", (0.75, 0.1, -0.4), 0.3, -0.8),
    ]
    floor = floor_node([[-1.2, 0.0, -1.2], [1.2, 1.0, 1.2]], tile=0.5)
    camera = pg.Camera((1.5, 1.5, 2.6), (0.12, 0.26, -0.02), vertical_fov_rad=0.46, near=0.5, far=30.0)
    lamp = pg.Light.directional((0.55, -1.0, -0.35), (1.0, 0.95, 0.87), 0.9, radius=0.05)
    return pg.Scene((floor, *things), camera, (lamp,), "table and ducks")


@dataclass(frozen=True, eq=False)
class EnginePictures:
    """What an engine hands over of a frame: (h, w, 4) color in linear light without shadows, (h, w) depth buffer."""

    scene: pg.Scene
    color: Picture
    depth: Picture
    holds: pg.HardwareDepth


@lru_cache
def engine_pictures(size: tuple[int, int] = (960, 540)) -> EnginePictures:
    """The table and the ducks, with a reversed depth buffer, as float32."""
    from passgraph.effects import soft_shadow_passes

    made = soft_shadow_passes(standing(), display=False)
    with pg.compile([made.unshadowed, made.depth], size=size) as program:
        seen = program()
        color, distance = seen["unshadowed"].copy(), seen["depth"][:, :, 0].copy()
    holds = standing().camera.hardware_depth(reversed_z=True)
    return EnginePictures(standing(), color, holds.depth(distance).astype(np.float32), holds)


def colored_room() -> pg.Scene:
    """Two white boxes in a white room with a red and a green wall, as in the Cornell box, under a lamp of some size."""

    def block(
        size: tuple[float, float, float], at: tuple[float, float, float], color: str, turn: float = 0.0
    ) -> pg.Node:
        tint = {"white": (0.75, 0.75, 0.75), "red": (0.63, 0.06, 0.05), "green": (0.14, 0.45, 0.09)}[color]
        c, s = math.cos(turn), math.sin(turn)
        sides = np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1.0]]) @ np.diag((*size, 1.0))
        return pg.Node(box(1.0), pg.Material(color, (*tint, 1.0)), translation(at) @ sides, color)

    nodes = (
        block((2.2, 0.1, 2.2), (0.0, -0.1, 0.0), "white"),
        block((2.2, 2.0, 0.1), (0.0, 0.0, -1.05), "white"),
        block((0.1, 2.0, 2.2), (-1.05, 0.0, 0.0), "red"),
        block((0.1, 2.0, 2.2), (1.05, 0.0, 0.0), "green"),
        block((0.55, 1.2, 0.55), (-0.35, 0.0, -0.35), "white", 0.3),
        block((0.55, 0.6, 0.55), (0.4, 0.0, 0.3), "white", -0.3),
    )
    camera = pg.Camera((0.0, 1.25, 3.9), (0.0, 0.78, 0.0), vertical_fov_rad=0.55, near=0.5, far=10.0)
    lamp = pg.Light.spot((0.3, 3.6, 1.4), (-0.1, -1.0, -0.4), (1.0, 0.95, 0.85), 10.0, radius=0.25, cone_outer_rad=0.8)
    return pg.Scene(nodes, camera, (lamp,), "room")


@lru_cache
def hills() -> pg.Scene:
    """Three ducks on 3 × 3 meters of hills from pybullet's height map, with its own picture as their color."""
    _needs("pybullet_data", "pybullet")
    import pybullet_data

    folder = Path(pybullet_data.getDataPath()) / "heightmaps"
    with Image.open(folder / "wm_height_out.png") as file:
        heights = np.asarray(file.resize((97, 97), Image.Resampling.BOX), np.float64)[::-1] / 255.0 * 0.8
    with Image.open(folder / "gimp_overlay_out.png") as file:
        colours = pg.Texture.make(np.asarray(file.convert("RGB")), "srgb", "hills")
    axis = np.linspace(-1.5, 1.5, 97)
    x, z = np.meshgrid(axis, axis)
    index = np.arange(97 * 97).reshape(97, 97)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)]).reshape(-1, 3)
    uvs = np.stack([(x + 1.5) / 3.0, (z + 1.5) / 3.0], -1).reshape(-1, 2)
    ground = pg.Mesh.make(np.stack([x, heights, z], -1).reshape(-1, 3), faces, uvs=uvs)
    ducks = []
    for place, turn in (((0.3, 0.5), 0.6), ((-0.55, 0.1), 2.4), ((0.6, -0.45), -0.9)):
        row, column = (int((value + 1.5) / 3.0 * 96) for value in (place[1], place[0]))
        low = float(heights[row - 3 : row + 4, column - 3 : column + 4].min())
        ducks += _placed("duck.obj", (place[0], low + 0.04, place[1]), 0.22, turn)
    camera = pg.Camera((0.9, 2.1, 2.7), (0.0, 0.2, 0.0), vertical_fov_rad=0.5, near=0.5, far=30.0)
    lamp = pg.Light.directional((0.55, -1.0, -0.35), (1.0, 0.95, 0.87), 0.9, radius=0.05)
    earth = pg.Material("earth", (1.0, 1.0, 1.0, 1.0), colours)
    return pg.Scene((pg.Node(ground, earth, name="hills"), *ducks), camera, (lamp,), "hills")


def plain_floor(scene: pg.Scene) -> pg.Scene:
    """The same scene on a white floor, where shadows show best."""
    nodes = [
        pg.Node(node.mesh, pg.Material("white", (0.8, 0.8, 0.8, 1.0)), node.transform, node.name)
        if node.name == "floor"
        else node
        for node in scene.nodes
    ]
    return scene.with_(nodes=nodes)


def receding(scene: pg.Scene, factor: float) -> pg.Scene:
    """The camera this many times as far from its target."""
    camera = scene.camera
    eye = np.array(camera.target) + factor * (np.array(camera.eye) - camera.target)
    return scene.with_(camera=replace(camera, eye=tuple(eye), near=factor * camera.near, far=factor * camera.far))


# A level of a flat game, one unit a metre

LEVEL = Window(0.0, 0.0, 48.0, 18.0)
VIEW = Window(8.0, 0.0, 40.0, 18.0)
CELL = 1.5
LAMPS = (
    Light2D((15.0, 11.5), (1.0, 0.78, 0.45), 13.0, 0.9),
    Light2D((31.5, 6.0), (0.45, 0.65, 1.0), 13.0, 0.9),
    Light2D((24.5, 15.5), (0.9, 0.35, 0.25), 7.0, 0.6),
)
WALLS = (
    Wall.box(8.0, 0.0, 9.0, 18.0), Wall.box(39.0, 0.0, 40.0, 18.0),
    Wall.box(19.0, 9.0, 20.0, 18.0), Wall.box(19.0, 0.0, 20.0, 4.0),
    Wall.box(27.5, 11.0, 39.0, 12.0), Wall.box(12.0, 6.0, 14.5, 7.0),
    Wall.box(25.0, 4.5, 26.2, 5.7), Wall.box(34.5, 2.5, 35.5, 3.5), Wall.box(10.5, 14.0, 11.5, 15.0),
)  # fmt: skip
MOVERS = (
    Mover((16.8, 7.2), (0.6, 0.35), 0.6), Mover((11.2, 11.0), (0.5, 0.5), 0.2), Mover((22.5, 6.6), (0.7, 0.4), 1.2),
    Mover((29.2, 8.3), (0.5, 0.3), 2.2), Mover((34.5, 8.4), (0.6, 0.6), 0.9), Mover((29.0, 3.4), (0.45, 0.45), 0.4),
)  # fmt: skip


@lru_cache
def top_view(size: tuple[int, int] = (960, 540)) -> Picture:
    """The level from above without light: gravel, brick walls and the things that move."""
    _needs("skimage", "scikit-image")
    from skimage import data

    y, x = np.mgrid[0 : size[1], 0 : size[0]]
    ground, brick = data.gravel() / 255.0, data.brick() / 255.0
    picture = np.stack([ground[y % 512, x % 512] * tint for tint in (0.62, 0.58, 0.5)], axis=2)
    wx, wy = VIEW.world((x + 0.5, y + 0.5), size)  # type: ignore[arg-type]
    for wall in WALLS:
        (left, low), (right, high) = wall.points[0], wall.points[2]
        inside = (wx > left) & (wx < right) & (wy > low) & (wy < high)
        picture[inside] = (brick[y % 512, x % 512, None] * (0.75, 0.42, 0.32))[inside]
    for mover in MOVERS:
        dx, dy = wx - mover.position[0], wy - mover.position[1]
        c, s = math.cos(mover.angle_rad), math.sin(mover.angle_rad)
        inside = (abs(c * dx + s * dy) < mover.half[0]) & (abs(-s * dx + c * dy) < mover.half[1])
        picture[inside] = (0.55, 0.5, 0.12)
    return np.concatenate([picture, np.ones((*picture.shape[:2], 1))], axis=2).astype(np.float32)


@lru_cache
def dirt(size: tuple[int, int] = (480, 270), specks: int = 160, seed: int = 5) -> Picture:
    """Smears and specks on a lens."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[0 : size[1], 0 : size[0]]
    picture = np.zeros((size[1], size[0]))
    for _ in range(specks):
        column, row = random.random(2) * size
        radius = 2.0 + 16.0 * random.random() ** 3
        away = np.hypot(x - column, y - row) / radius
        picture += (0.15 + 0.5 * random.random()) * np.clip(1.5 - away, 0.0, 0.5) * 2.0 * (0.6 + 0.4 * away)
    return np.repeat(np.clip(picture, 0.0, 1.0)[:, :, None], 4, axis=2).astype(np.float32)
