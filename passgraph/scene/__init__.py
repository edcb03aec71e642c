"""Scenes: meshes, materials, lights and a camera, checked and ready to draw.

Reading order: matrices, meshes, materials, lights, projection, camera, ground, scene, load_scene, shipped_scene.
Importing this package needs numpy only; trimesh and pillow are imported when a file is loaded.
"""

from passgraph.scene.camera import Camera, NamedCamera
from passgraph.scene.lights import Light
from passgraph.scene.materials import Material, Node, Texture
from passgraph.scene.meshes import Mesh, merge
from passgraph.scene.projection import HardwareDepth
from passgraph.scene.scene import Scene

__all__ = ["Camera", "HardwareDepth", "Light", "Material", "Mesh", "NamedCamera", "Node", "Scene", "Texture", "merge"]
