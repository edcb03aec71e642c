"""A scene of nodes, a camera and lights, and functions to load or change it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import lru_cache
from math import pi
from os import PathLike
from typing import Literal, cast

from passgraph import arguments
from passgraph.cached import cached_property
from passgraph.errors import InputError
from passgraph.records import dataclass
from passgraph.scene.camera import (
    DEFAULT_AZIMUTH_RAD,
    DEFAULT_ELEVATION_RAD,
    DEFAULT_FOV_RAD,
    Camera,
    NamedCamera,
    ways_round,
)
from passgraph.scene.ground import (
    bounds_of_nodes,
    floors_of,
    has_floor,
    seeing_floors,
    standing_points,
    with_ground,
)
from passgraph.scene.lights import Light
from passgraph.scene.materials import Node
from passgraph.scene.matrices import Float64

#: Most views of a turntable: an hour of 60 frames a second.
MOST_VIEWS = 216_000


@dataclass(frozen=True, eq=False)
class Scene:
    """Nodes, a camera and lights.

    Attributes
    ----------
    nodes : at least one
    camera : the view
    lights : any number
    name : used in messages
    warnings : missing and unsupported parts of the file, a line each (missing textures, skipped parts)
    cameras : the views of the file, by name, perhaps with ``camera`` among them

    >>> scene = Scene.shipped()
    >>> scene.triangle_count > 1000, len(scene.lights)
    (True, 1)
    """

    nodes: tuple[Node, ...]
    camera: Camera
    lights: tuple[Light, ...] = ()
    name: str = "scene"
    warnings: tuple[str, ...] = ()
    cameras: tuple[NamedCamera, ...] = ()

    def __post_init__(self) -> None:
        where = f"scene {arguments.string(self.name, 'the name of a scene')!r}"
        for field, class_, expected in (
            ("nodes", Node, "pg.Node"),
            ("lights", Light, "pg.Light"),
            ("warnings", str, "lines of text"),
            ("cameras", NamedCamera, "a NamedCamera"),
        ):
            items = arguments.several(getattr(self, field), class_, f"{where}: {field}", expected, InputError)
            object.__setattr__(self, field, items)
        arguments.instance(self.camera, Camera, f"{where}: camera", "a pg.Camera", InputError)
        if not self.nodes:
            raise InputError(f"scene {self.name!r}: no nodes; a scene needs at least one mesh")

    @cached_property
    def _bounds(self) -> Float64:
        return bounds_of_nodes(self.nodes)

    def bounds(self) -> Float64:
        """Return the world box around all nodes, (2, 3) float64: minimum, maximum."""
        return self._bounds.copy()

    @cached_property
    def _floors(self) -> tuple[Node, ...]:
        return floors_of(self.nodes)

    def points(self) -> Float64:
        """Return all vertices in the world, (n, 3) float64, without floors that other nodes stand on."""
        return standing_points(self.nodes, self._floors)

    def seen_from(
        self,
        azimuth_rad: float = DEFAULT_AZIMUTH_RAD,
        elevation_rad: float = DEFAULT_ELEVATION_RAD,
        *,
        distance: float | None = None,
        aspect: float = 16.0 / 9.0,
        vertical_fov_rad: float = DEFAULT_FOV_RAD,
    ) -> Scene:
        """Return the scene with a camera that its objects fill; parameters as for `Camera.orbit`.

        >>> bare = Scene(Scene.shipped().nodes[1:2], Scene.shipped().camera)
        >>> bare.seen_from(0.0, 0.0).camera.forward.round(3).tolist()
        [0.0, 0.0, -1.0]
        """
        points = self.points()
        camera = Camera.orbit(
            points, azimuth_rad, elevation_rad, distance=distance, aspect=aspect, vertical_fov_rad=vertical_fov_rad
        )
        return self.with_(camera=seeing_floors(camera, self._floors))

    def turntable(
        self,
        count: int,
        azimuth_rad: float = DEFAULT_AZIMUTH_RAD,
        elevation_rad: float = DEFAULT_ELEVATION_RAD,
        *,
        distance: float | None = None,
        aspect: float = 16.0 / 9.0,
        vertical_fov_rad: float = DEFAULT_FOV_RAD,
    ) -> list[Camera]:
        """Return cameras in even steps around the scene's objects, at one distance; the first follows the last.

        Parameters
        ----------
        count : 1 or more
        azimuth_rad : azimuth of the first camera; other parameters as for `Camera.orbit`

        >>> views = Scene.shipped().turntable(4, 0.0, 0.3)
        >>> [round(camera.eye[1] - views[0].eye[1], 6) for camera in views]
        [0.0, 0.0, 0.0, 0.0]
        """
        arguments.whole_number(count, "turntable: count", 1, MOST_VIEWS, InputError)
        points = self.points()
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        swept = ways_round(points, middle)
        first = Camera.orbit(
            swept, azimuth_rad, elevation_rad, distance=distance, aspect=aspect, vertical_fov_rad=vertical_fov_rad
        )
        return [seeing_floors(first.turned(middle, 2.0 * pi * step / count), self._floors) for step in range(count)]

    def has_floor(self) -> bool:
        """True if the scene has a surface below that receives shadows; see `passgraph.scene.ground.has_floor`."""
        return has_floor(self.nodes)

    def with_ground(self) -> Scene:
        """Return the scene with a plain floor up to the horizon; see `passgraph.scene.ground.with_ground`."""
        nodes, camera = with_ground(self.nodes, self.camera)
        return self.with_(nodes=nodes, camera=camera)

    def two_sided(self) -> Scene:
        """Return the scene with all materials double-sided.

        >>> {node.material.double_sided for node in Scene.shipped().two_sided().nodes}
        {True}
        """
        # Shared materials stay shared, so that their nodes are drawn in one call.
        materials = {node.material: dataclasses.replace(node.material, double_sided=True) for node in self.nodes}
        nodes = [dataclasses.replace(node, material=materials[node.material]) for node in self.nodes]
        return self.with_(nodes=nodes)

    @property
    def triangle_count(self) -> int:
        """Number of triangles of all nodes."""
        return sum(node.mesh.triangle_count for node in self.nodes)

    def with_(
        self,
        *,
        nodes: Sequence[Node] | None = None,
        camera: Camera | None = None,
        lights: Sequence[Light] | None = None,
    ) -> Scene:
        """Return a copy with other nodes, another camera or other lights.

        >>> Scene.shipped().with_(lights=[]).lights
        ()
        """
        return dataclasses.replace(
            self,
            nodes=self.nodes if nodes is None else cast("tuple[Node, ...]", nodes),
            camera=self.camera if camera is None else camera,
            lights=self.lights if lights is None else cast("tuple[Light, ...]", lights),
        )

    @classmethod
    def load(
        cls, path: str | PathLike[str], *, ground: bool | None = None, up: Literal["y", "z"] | None = None
    ) -> Scene:
        """Load a model or scene file; see `passgraph.scene.load_scene.load_scene`."""
        from passgraph.scene.load_scene import load_scene

        return cls(*load_scene(path, ground=ground, up=up))

    @classmethod
    @lru_cache(maxsize=1)
    def shipped(cls) -> Scene:
        """Return the shipped scene: the Utah teapot on a tiled floor, one light with an extent."""
        from passgraph.scene.shipped_scene import shipped_scene

        return cls(*shipped_scene())
