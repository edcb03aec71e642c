"""Triangles of a scene, and the surface visible at each pixel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.scene.camera import Camera
from passgraph.scene.materials import Node
from passgraph.scene.scene import Scene
from passgraph.truth.rays import Float64, Tracer

#: Most back faces of single-sided surfaces that a view ray passes through before it counts as a miss.
MOST_LAYERS = 64


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The first surface along each pixel's line of sight.

    Attributes
    ----------
    origin : (3,) world point that positions are relative to, the middle of the scene
    positions : (h, w, 3) float64 scene units, relative to ``origin``; NaN where there is no surface
    normals : (h, w, 3) float64 of the triangles, toward the viewer
    depth : (h, w) float64 distance along the view axis, 0 where there is no surface
    node : (h, w) index of the node, -1 where there is none
    """

    origin: Float64
    positions: Float64
    normals: Float64
    depth: Float64
    node: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Triangles:
    """Placed triangles, relative to an origin that is subtracted in float64."""

    corners: Float64  # (n, 3, 3)
    node: NDArray[np.int32]  # (n,) index of the node
    single_sided: NDArray[np.bool_]  # (n,)

    @property
    def extent(self) -> float:
        """Return the largest coordinate."""
        return float(np.abs(self.corners).max())


def placed_triangles(nodes: Sequence[tuple[int, Node]], origin: Float64) -> Triangles:
    """Return the triangles of numbered nodes, except those without area, which rays cannot hit.

    Raises
    ------
    InputError
        If a material has holes given by a texture: rays do not sample textures.
    """
    corners, numbers, single = [], [], []
    for number, node in nodes:
        if node.material.alpha_mode == "mask" and node.material.base_color_texture is not None:
            raise InputError(
                f"node {node.name!r}: the holes of its material {node.material.name!r} come from a texture, which "
                "rays do not look into; make them geometry, or leave the node out"
            )
        linear = node.transform[:3, :3]
        places = node.mesh.positions.astype(np.float64) @ linear.T + (node.transform[:3, 3] - origin)
        faces = node.mesh.triangles[:, ::-1] if node.flips_winding else node.mesh.triangles
        part = places[faces]
        part = part[np.linalg.norm(np.cross(part[:, 1] - part[:, 0], part[:, 2] - part[:, 0]), axis=1) > 0.0]
        corners.append(part)
        numbers.append(np.full(len(part), number, np.int32))
        single.append(np.full(len(part), not node.material.double_sided))
    if not corners:
        return Triangles(np.zeros((0, 3, 3)), np.zeros(0, np.int32), np.zeros(0, np.bool_))
    return Triangles(np.concatenate(corners), np.concatenate(numbers), np.concatenate(single))


def seen_triangles(scene: Scene, origin: Float64) -> Triangles:
    """Return the triangles that a camera sees: everything that is not translucent."""
    nodes = [(i, n) for i, n in enumerate(scene.nodes) if n.material.alpha_mode != "blend"]
    return placed_triangles(nodes, origin)


def casting_triangles(scene: Scene, origin: Float64) -> Triangles:
    """Return the triangles that a light sees: everything that casts shadows and is not translucent."""
    nodes = [(i, n) for i, n in enumerate(scene.nodes) if n.casts and n.material.alpha_mode != "blend"]
    return placed_triangles(nodes, origin)


def first_surfaces(scene: Scene, size: tuple[int, int], camera: Camera | None = None) -> Surfaces:
    """Cast one ray through the middle of each pixel; positions are computed in float64 from the triangle's plane.

    Parameters
    ----------
    scene : the scene; back faces of single-sided materials are invisible
    size : width and height in pixels
    camera : default: the scene's

    >>> surfaces = first_surfaces(Scene.shipped(), (16, 9))
    >>> surfaces.positions.shape, int(surfaces.node.max())
    ((9, 16, 3), 4)
    """
    width, height = size
    if width < 1 or height < 1:
        raise InputError(f"size: expected at least 1 x 1 pixels, got {width} x {height}")
    camera = scene.camera if camera is None else camera
    origin = scene.bounds().mean(axis=0)
    triangles = seen_triangles(scene, origin)
    begin, directions = (rays.reshape(-1, 3) for rays in _view_rays(camera, size))
    eye = begin + np.subtract(camera.eye, origin)
    hits = np.full(len(directions), -1, np.int32)
    if len(triangles.corners):
        rays = Tracer(triangles.corners)
        hits, far = _first_front(rays, triangles, eye, directions, camera)
    is_hit = hits >= 0
    a, b, c = triangles.corners[hits[is_hit]].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    d = directions[is_hit]
    normals *= -np.sign(np.einsum("ij,ij->i", normals, d))[:, None]
    positions = np.full((height * width, 3), np.nan)
    facing, depth = np.zeros((height * width, 3)), np.zeros(height * width)
    node = np.full(height * width, -1, np.int32)
    if is_hit.any():
        positions[is_hit] = eye[is_hit] + far[is_hit, None] * d
        facing[is_hit], node[is_hit] = normals, triangles.node[hits[is_hit]]
        depth[is_hit] = far[is_hit] * (d @ camera.forward)
    shape = (height, width)
    return Surfaces(
        origin, positions.reshape(*shape, 3), facing.reshape(*shape, 3), depth.reshape(shape), node.reshape(shape)
    )


def _view_rays(camera: Camera, size: tuple[int, int]) -> tuple[Float64, Float64]:
    """Return the origins of the rays through the pixel centers, relative to the eye, and their unit directions.

    (h, w, 3) each, row 0 on top.
    """
    width, height = size
    half, middle = camera.window(width / height)
    x = middle[0] + (2.0 * (np.arange(width) + 0.5) / width - 1.0) * half[0]
    y = middle[1] + (1.0 - 2.0 * (np.arange(height) + 0.5) / height) * half[1]
    flat, none = np.stack([*np.meshgrid(x, y), np.zeros((height, width))], axis=-1), np.zeros((height, width, 3))
    begin, way = (flat, none) if camera.orthographic else (none, flat)
    turn = camera.view_rotation()[:3, :3]
    directions = (way - (0.0, 0.0, 1.0)) @ turn
    return begin @ turn, np.asarray(directions / np.linalg.norm(directions, axis=-1, keepdims=True), np.float64)


def _first_front(
    rays: Tracer, triangles: Triangles, eye: Float64, directions: Float64, camera: Camera
) -> tuple[NDArray[np.int32], Float64]:
    """Return the first triangle between near and far whose culled back does not face the ray, and the distance to
    it."""
    hits, far = np.full(len(directions), -1, np.int32), np.zeros(len(directions))
    cosine = directions @ camera.forward
    start = camera.near / cosine
    live = np.arange(len(directions))
    for _ in range(MOST_LAYERS):
        d = directions[live]
        triangles_hit = rays.closest(eye[live] + start[live, None] * d, d)
        live, triangles_hit = live[triangles_hit >= 0], triangles_hit[triangles_hit >= 0]
        if len(live) == 0:
            break
        d = directions[live]
        a, b, c = triangles.corners[triangles_hit].transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        slope = np.einsum("ij,ij->i", normal, d)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.einsum("ij,ij->i", normal, a - eye[live]) / slope
        front = (slope < 0.0) | ((slope > 0.0) & ~triangles.single_sided[triangles_hit])
        visible = front & (at * cosine[live] <= camera.far)
        hits[live[visible]], far[live[visible]] = triangles_hit[visible], at[visible]
        live, at = live[~front], at[~front]
        # beyond this layer, by more than the tracer's rounding
        start[live] = np.maximum(start[live], np.where(np.isfinite(at), at, 0.0)) + 4.0 * rays.rounding * (
            triangles.extent + np.linalg.norm(eye[live], axis=1)
        )
    return hits, far
