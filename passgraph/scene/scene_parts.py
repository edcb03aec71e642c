"""The contents of a scene, before they are checked as one."""

from __future__ import annotations

from typing import NamedTuple

from passgraph.scene.camera import Camera, NamedCamera
from passgraph.scene.lights import Light
from passgraph.scene.materials import Node


class SceneParts(NamedTuple):
    """What `passgraph.Scene` is made of, in the order of its attributes."""

    nodes: tuple[Node, ...]
    camera: Camera
    lights: tuple[Light, ...]
    name: str
    warnings: tuple[str, ...] = ()
    cameras: tuple[NamedCamera, ...] = ()
