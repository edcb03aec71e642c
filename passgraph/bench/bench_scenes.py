"""Benchmark scenes: shipped ones, hard cases for shadow maps, and models from other packages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from passgraph.errors import InputError
from passgraph.scene import Camera, Light, Material, Mesh, Node, Scene
from passgraph.scene.matrices import rotation_y, translation
from passgraph.scene.shipped_scene import ball, box, cylinder

GREY = Material("grey", (0.6, 0.6, 0.6, 1.0))
SHEET = Material("sheet", (0.6, 0.6, 0.6, 1.0), double_sided=True)
#: Package that contains pybullet's models.
MODELS = "pybullet_data"


@dataclass(frozen=True)
class BenchScene:
    """A named scene.

    Attributes
    ----------
    name : name on the command line and in file names
    about : description, one line
    make : builds the scene, with one light that has a radius
    needs : the package that it comes from; empty if none
    """

    name: str
    about: str
    make: Callable[[], Scene]
    needs: str = ""

    @property
    def here(self) -> bool:
        return not self.needs or find_spec(self.needs) is not None


def _sheet(width: float, depth: float, at: tuple[float, float, float], name: str, material: Material = SHEET) -> Node:
    corners = np.array([[-width, 0, depth], [width, 0, depth], [width, 0, -depth], [-width, 0, -depth]]) * 0.5
    mesh = Mesh.make(corners, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 1.0, 0.0], (4, 1)), name=name)
    return Node(mesh, material, translation(at), name)


def plane(half: float) -> Node:
    """Return a square of y = 0."""
    return _sheet(2.0 * half, 2.0 * half, (0.0, 0.0, 0.0), "plane", GREY)


def _block(at: tuple[float, float, float], size: tuple[float, float, float], name: str) -> Node:
    """Return a box that stands on the center of its lower side."""
    return Node(box(1.0), GREY, translation(at) @ np.diag([*size, 1.0]), name)


def slab(half: float, thickness: float) -> Node:
    """Return a floor with an underside; its upper side is y = 0."""
    return _block((0.0, -thickness, 0.0), (2.0 * half, thickness, 2.0 * half), "slab")


#: Tangent of the angular radius of the light over the box, for very wide penumbrae.
BOX_LIGHT = 0.1
BOX_HEIGHT = 1.0
#: Radius and height of the ball; radius and position of the spherical light over it.
BALL, BALL_HEIGHT = 0.5, 1.0
LAMP, LAMP_PLACE = 0.4, (0.0, 5.0, 0.0)


def box_scene() -> Scene:
    """Return a cube on a plane, with light at 45 degrees along x."""
    camera = Camera((3.6, 2.6, 3.4), (0.7, 0.15, 0.0), vertical_fov_rad=0.5, near=0.5, far=60.0)
    light = Light.directional((1, -1, 0), radius=BOX_LIGHT)
    return Scene((plane(20.0), Node(box(BOX_HEIGHT), GREY, name="box")), camera, (light,), "box")


def sphere_scene() -> Scene:
    """Return a ball over a plane, under a spherical light."""
    camera = Camera((2.6, 2.4, 2.6), (0.0, 0.3, 0.0), vertical_fov_rad=0.55, near=0.5, far=60.0)
    light = Light.point(LAMP_PLACE, intensity=20.0, radius=LAMP)
    floating = Node(ball(BALL, 64), GREY, translation((0.0, BALL_HEIGHT, 0.0)), "ball")
    return Scene((plane(20.0), floating), camera, (light,), "sphere")


def fence_scene() -> Scene:
    """Return thin bars, low and high: narrow casters, and penumbrae as wide as the gaps."""
    nodes = [plane(20.0)]
    for i in range(9):
        bar = cylinder(0.04, 1.6, 16)
        nodes.append(Node(bar, GREY, translation((-0.9, 0.0, -1.2 + 0.3 * i)), f"bar {i}"))
    nodes.append(Node(box(0.5), GREY, translation((0.9, 1.1, 0.3)) @ rotation_y(0.4), "floating box"))
    camera = Camera((4.4, 3.2, 3.8), (0.9, 0.3, 0.0), vertical_fov_rad=0.55, near=0.5, far=60.0)
    light = Light.directional((1.0, -0.9, -0.15), radius=0.08)
    return Scene(tuple(nodes), camera, (light,), "fence")


def layers_scene() -> Scene:
    """Return sheets near the floor and far above it, with crossing shadows: moment filters leak light there."""
    nodes = (
        plane(20.0),
        _sheet(1.6, 1.6, (-0.2, 0.35, 0.0), "low sheet"),
        _sheet(1.2, 2.6, (-1.6, 2.0, 0.3), "high sheet"),
        Node(cylinder(0.06, 0.35), GREY, translation((-0.2, 0.0, 0.0)), "leg"),
    )
    camera = Camera((3.8, 2.2, 3.6), (0.3, 0.2, 0.0), vertical_fov_rad=0.62, near=0.5, far=60.0)
    light = Light.directional((0.8, -1.0, -0.1), radius=0.09)
    return Scene(nodes, camera, (light,), "layers")


def slab_scene() -> Scene:
    """Return a ball on a floor with an underside that extends behind the lamp, up to the lamp's plane."""
    camera = Camera((3.2, 2.4, 3.4), (0.1, 0.3, 0.0), vertical_fov_rad=0.55, near=0.5, far=60.0)
    light = Light.spot((1.6, 3.4, 1.2), (-0.5, -1.0, -0.35), intensity=14.0, radius=0.3, cone_outer_rad=0.7)
    return Scene((slab(6.0, 0.2), _ball()), camera, (light,), "slab")


def room_scene() -> Scene:
    """Return a closed room with objects, under a spot recessed into its ceiling."""
    walls = [
        _block(at, size, name)
        for name, at, size in (
            ("floor", (0.0, -0.2, 0.0), (5.4, 0.2, 5.4)),
            ("ceiling", (0.0, 3.0, 0.0), (5.4, 0.2, 5.4)),
            ("left wall", (-2.6, 0.0, 0.0), (0.2, 3.0, 5.4)),
            ("right wall", (2.6, 0.0, 0.0), (0.2, 3.0, 5.4)),
            ("back wall", (0.0, 0.0, -2.6), (5.0, 3.0, 0.2)),
            ("front wall", (0.0, 0.0, 2.6), (5.0, 3.0, 0.2)),
        )
    ]
    things = (
        Node(ball(0.5, 64), GREY, translation((0.5, 0.5, 0.5)), "ball"),
        Node(box(0.8), GREY, translation((-1.0, 0.0, -0.6)) @ rotation_y(0.5), "box"),
        Node(box(1.0), GREY, translation((0.9, 0.9, -1.1)) @ np.diag([1.2, 0.06, 0.8, 1.0]), "shelf"),
    )
    camera = Camera((0.8, 1.9, 2.4), (-0.1, 0.5, -0.4), vertical_fov_rad=1.0, near=0.05, far=20.0)
    light = Light.spot((0.0, 2.95, 0.0), (0.0, -1.0, 0.0), intensity=8.0, radius=0.2, cone_outer_rad=1.2)
    return Scene((*walls, *things), camera, (light,), "room")


def wide_scene() -> Scene:
    """Return a ball and posts on a floor 200 units wide, with an underside."""
    posts = [Node(box(0.3), GREY, translation((x, 0.0, z)), "post") for x, z in ((-1.2, 0.4), (1.3, -0.6), (0.3, 1.4))]
    camera = Camera((3.2, 2.4, 3.4), (0.3, 0.3, 0.0), vertical_fov_rad=0.55, near=0.5, far=60.0)
    light = Light.directional((0.8, -1.0, -0.2), radius=0.06)
    return Scene((slab(100.0, 0.2), _ball(), *posts), camera, (light,), "wide")


def chequer_scene() -> Scene:
    """Return a checkered board over a floor, with every other square missing and squares as wide as the penumbra."""
    side, squares = 0.2, 8
    corners: list[list[float]] = []
    faces: list[list[int]] = []
    for i in range(squares):
        for k in range(squares):
            if (i + k) % 2 == 0:
                x, z = (i - squares / 2) * side, (k - squares / 2) * side
                faces += [[len(corners) + j for j in (0, 1, 2)], [len(corners) + j for j in (0, 2, 3)]]
                corners += [[x, 0, z + side], [x + side, 0, z + side], [x + side, 0, z], [x, 0, z]]
    board = Mesh.make(corners, faces, np.tile([0.0, 1.0, 0.0], (len(corners), 1)), name="board")
    camera = Camera((3.2, 2.4, 3.4), (0.5, 0.1, 0.0), vertical_fov_rad=0.5, near=0.5, far=60.0)
    light = Light.directional((0.7, -1.0, 0.1), radius=0.08)
    return Scene(
        (slab(6.0, 0.2), Node(board, SHEET, translation((0.0, 1.0, 0.0)), "board")), camera, (light,), "chequer"
    )


def stack(heights: tuple[float, ...]) -> Scene:
    """Return sheets over a floor, each offset from the one below it."""
    sheets = [_sheet(1.8, 1.8, (-0.25 * i, height, 0.1 * i), f"sheet {i}") for i, height in enumerate(heights)]
    camera = Camera((3.9, 2.1, 2.6), (0.35, 0.1, 0.0), vertical_fov_rad=0.6, near=0.5, far=60.0)
    return Scene((plane(20.0), *sheets), camera, (Light.directional((0.5, -1.0, -0.2), radius=0.1),))


def shelf_scene() -> Scene:
    """Return four boards above each other between two sides, with a lamp in front."""
    boards = [_block((0.0, 0.15 + 0.5 * i, 0.0), (1.6, 0.05, 0.6), f"board {i}") for i in range(4)]
    sides = [_block((x, 0.0, 0.0), (0.05, 1.8, 0.6), "side") for x in (-0.82, 0.82)]
    things = [_block((x, 0.2, 0.1), (0.2, 0.3, 0.2), "thing") for x in (-0.5, 0.3)]
    camera = Camera((1.9, 2.0, 4.2), (0.0, 0.6, 0.2), vertical_fov_rad=0.6, near=0.5, far=60.0)
    light = Light.point((0.9, 3.6, 1.6), intensity=16.0, radius=0.25)
    return Scene((slab(6.0, 0.2), *boards, *sides, *things), camera, (light,), "shelf")


def cage_scene() -> Scene:
    """Return crossed bars with a roof of bars over a ball."""
    bars = [_block((x, 0.0, z), (0.05, 1.5, 0.05), "bar") for x in np.linspace(-0.9, 0.9, 7) for z in (-0.9, 0.9)]
    bars += [_block((x, 0.0, z), (0.05, 1.5, 0.05), "bar") for z in np.linspace(-0.6, 0.6, 5) for x in (-0.9, 0.9)]
    bars += [_block((x, 1.5, 0.0), (0.05, 0.05, 1.85), "roof") for x in np.linspace(-0.9, 0.9, 7)]
    bars += [_block((0.0, y, z), (1.85, 0.04, 0.04), "rail") for y in (0.5, 1.0) for z in (-0.9, 0.9)]
    camera = Camera((3.4, 3.2, 3.8), (0.5, 0.4, 0.0), vertical_fov_rad=0.6, near=0.5, far=60.0)
    light = Light.directional((0.9, -1.0, -0.45), radius=0.07)
    return Scene((plane(20.0), *bars, _ball()), camera, (light,), "cage")


def leaves_scene() -> Scene:
    """Return leaves at all heights over a floor and a box, as in a tree's crown."""
    rng = np.random.default_rng(7)
    corners = np.array([[-1.0, 0, 0], [0, 0, 0.5], [1.0, 0, 0], [0, 0, -0.5]]) * 0.16
    nodes = [plane(20.0), _block((0.6, 0.0, 0.4), (0.5, 0.5, 0.5), "box")]
    for i in range(160):
        x, y, z, turn = rng.uniform((-1.2, 0.7, -1.2, 0.0), (1.2, 2.4, 1.2, 2.0 * np.pi))
        tilted = corners + np.outer(corners[:, 0] * rng.uniform(-0.6, 0.6), [0.0, 1.0, 0.0])
        leaf = Mesh.make(tilted, [[0, 1, 2], [0, 2, 3]], name="leaf")
        nodes.append(Node(leaf, SHEET, translation((x, y, z)) @ rotation_y(turn), f"leaf {i}"))
    camera = Camera((3.8, 3.4, 3.6), (0.5, 0.5, 0.0), vertical_fov_rad=0.65, near=0.5, far=60.0)
    return Scene(tuple(nodes), camera, (Light.directional((0.5, -1.0, -0.2), radius=0.06),), "leaves")


def furniture_scene() -> Scene:
    """Return a table with objects on it and chairs around it under a wide lamp."""
    nodes = [slab(6.0, 0.2), _block((0.0, 0.72, 0.0), (1.6, 0.05, 0.9), "top")]
    nodes += [_block((x, 0.0, z), (0.06, 0.72, 0.06), "leg") for x in (-0.7, 0.7) for z in (-0.38, 0.38)]
    for x, z, side in ((-0.4, 0.8, 1), (0.45, 0.75, 1), (0.1, -0.8, -1)):
        nodes += [
            _block((x, 0.42, z), (0.42, 0.04, 0.42), "seat"),
            _block((x, 0.46, z + 0.19 * side), (0.42, 0.5, 0.03), "back"),
        ]
        nodes += [_block((x + a, 0.0, z + b), (0.04, 0.42, 0.04), "leg") for a in (-0.18, 0.18) for b in (-0.18, 0.18)]
    nodes += [_block((-0.3, 0.77, 0.1), (0.3, 0.12, 0.22), "book")]
    nodes += [Node(cylinder(0.07, 0.25), GREY, translation((0.35, 0.77, -0.1)), "vase")]
    camera = Camera((2.6, 2.3, 3.2), (0.0, 0.35, 0.1), vertical_fov_rad=0.62, near=0.3, far=60.0)
    return Scene(tuple(nodes), camera, (Light.point((0.5, 3.2, 0.4), intensity=14.0, radius=0.6),), "furniture")


def _ball() -> Node:
    return Node(ball(0.5, 64), GREY, translation((0.0, 0.5, 0.0)), "ball")


def _models_folder() -> Path:
    spec = find_spec(MODELS)
    assert spec is not None and spec.origin is not None
    return Path(spec.origin).parent


def samurai_scene() -> Scene:
    """Return the courtyard of a monastery, 124,000 triangles: eaves, fences, lanterns on poles."""
    scene = Scene.load(_models_folder() / "samurai_monastry.obj", ground=False)
    centre, far = scene.bounds().mean(axis=0), 0.5 * float(np.linalg.norm(np.ptp(scene.bounds(), axis=0)))
    eye, target = centre + np.array([0.15, 0.1, 0.25]) * far, centre + np.array([0.0, -0.05, 0.0]) * far
    camera = Camera(tuple(eye), tuple(target), vertical_fov_rad=0.8, near=0.005 * far, far=4.0 * far)
    light = Light.directional((0.6, -1.0, -0.5), (1.0, 0.96, 0.9), 0.9, 0.04)
    return scene.with_(camera=camera, lights=[light])


def bunny_scene() -> Scene:
    """Return the Stanford bunny on the automatic ground of models without a floor."""
    return Scene.load(_models_folder() / "bunny.obj")


SCENES: dict[str, BenchScene] = {
    scene.name: scene
    for scene in (
        BenchScene("shipped", "teapot, pillar, box and ball on a textured floor", Scene.shipped),
        BenchScene("box", "a box on a plane under a sun: analytic on the floor", box_scene),
        BenchScene("sphere", "a ball over a plane under a lamp: analytic on the floor", sphere_scene),
        BenchScene("fence", "thin bars, and a box in the air", fence_scene),
        BenchScene("layers", "sheets near and far whose shadows cross", layers_scene),
        BenchScene("slab", "a ball on a thick floor under a spot that looks past the floor's border", slab_scene),
        BenchScene("room", "things in a closed room, a spot in its ceiling", room_scene),
        BenchScene("wide", "a ball and posts on a thick floor 200 wide, under a sun", wide_scene),
        BenchScene("chequer", "a chequered board over a thick floor", chequer_scene),
        BenchScene("two-sheets", "two sheets over a floor, one over the other", lambda: stack((0.4, 1.6))),
        BenchScene("three-sheets", "three sheets over a floor, one over the other", lambda: stack((0.3, 0.9, 2.2))),
        BenchScene("shelf", "four boards one over the other", shelf_scene),
        BenchScene("cage", "a ball in a cage of bars", cage_scene),
        BenchScene("leaves", "leaves at all heights over a floor", leaves_scene),
        BenchScene("furniture", "a table, chairs and things under a lamp of radius 0.6", furniture_scene),
        BenchScene("samurai", "a monastery's courtyard, 124,000 triangles", samurai_scene, MODELS),
        BenchScene("bunny", "the Stanford bunny on a floor", bunny_scene, MODELS),
    )
}


@lru_cache(maxsize=4)
def scene_named(name: str) -> Scene:
    """Return a scene of the list or of a file; it must have a light with a radius, the first of which is used.

    >>> scene_named("box").name
    'box'
    """
    known = SCENES.get(name)
    if known is None and not Path(name).suffix:
        raise InputError(f"there is no bench scene {name!r}; there are {', '.join(SCENES)}, or name a file")
    if known is not None and not known.here:
        raise InputError(f"bench scene {name!r} needs the package {known.needs}; run: pip install pybullet")
    scene = Scene.load(name) if known is None else known.make()
    if not scene.lights or scene.lights[0].radius == 0.0:
        raise InputError(f"bench scene {name!r}: its first light has no radius, so that nothing is soft")
    return scene.with_(lights=scene.lights[:1])
