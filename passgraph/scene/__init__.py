"""Scenes: meshes, materials, lights and a camera, checked and ready to draw.

Reading order: matrices, mesh, material, framing, light, projection, hardware_depth, camera, node, ground, scene,
load, shipped. Importing this package needs numpy only; files are read through trimesh and pillow, which are imported
when a file is loaded.
"""

from passgraph.scene.camera import Camera, NamedCamera
from passgraph.scene.hardware_depth import HardwareDepth
from passgraph.scene.light import Light
from passgraph.scene.material import Material, Texture
from passgraph.scene.mesh import Mesh, merge
from passgraph.scene.node import Node
from passgraph.scene.scene import Scene

__all__ = ["Camera", "HardwareDepth", "Light", "Material", "Mesh", "NamedCamera", "Node", "Scene", "Texture", "merge"]
