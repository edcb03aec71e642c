"""A scene: nodes, a camera and lights, with the ways to load or make one."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from typing import Literal, cast

import numpy as np

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.scene.camera import Camera
from passgraph.scene.light import Light
from passgraph.scene.matrices import Float64
from passgraph.scene.node import Node


@dataclass(frozen=True, eq=False)
class Scene:
    """What is drawn, from where, and lit by what.

    Attributes
    ----------
    nodes : at least one
    camera : the view
    lights : any number
    name : used in messages
    warnings : what a file asked for and did not get, one line each (missing textures, skipped parts)

    >>> scene = Scene.shipped()
    >>> scene.triangle_count > 1000, len(scene.lights)
    (True, 1)
    """

    nodes: tuple[Node, ...]
    camera: Camera
    lights: tuple[Light, ...] = ()
    name: str = "scene"
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        where = f"scene {arguments.string(self.name, 'the name of a scene')!r}"
        for field, class_, expected in (
            ("nodes", Node, "pg.Node"), ("lights", Light, "pg.Light"), ("warnings", str, "lines of text")
        ):  # fmt: skip
            given = arguments.several(getattr(self, field), class_, f"{where}: {field}", expected, InputError)
            object.__setattr__(self, field, given)
        arguments.instance(self.camera, Camera, f"{where}: camera", "a pg.Camera", InputError)
        if not self.nodes:
            raise InputError(f"scene {self.name!r}: no nodes; a scene needs at least one mesh")

    @cached_property
    def _bounds(self) -> Float64:
        boxes = np.stack([node.bounds for node in self.nodes])
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    def bounds(self) -> Float64:
        """The world box round all nodes, (2, 3) float64: minimum, maximum."""
        return self._bounds.copy()

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
        """A copy with other nodes, another camera or other lights.

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
    def load(cls, path: str | PathLike[str], *, ground: bool | None = None, up: Literal["y", "z"] = "y") -> Scene:
        """Load a model or scene file; see `passgraph.scene.load.load_scene`."""
        from passgraph.scene.load import load_scene

        return load_scene(cls, path, ground=ground, up=up)

    @classmethod
    def shipped(cls) -> Scene:
        """The scene that comes with passgraph: the Utah teapot on a tiled floor, one light with an extent."""
        from passgraph.scene.shipped import shipped_scene

        return shipped_scene(cls)  # type: ignore[arg-type]  # a class can be hashed, which mypy asks of its objects
