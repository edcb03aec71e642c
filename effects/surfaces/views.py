"""Camera and lights as kernel values: matrices relative to the eye, composed in float64."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from math import cos
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.surfaces.batches import bounds_of
from passgraph.effects.surfaces.geometry import ViewFrame
from passgraph.effects.surfaces.map_fit import Fit, pieces_of
from passgraph.language import mat3, mat4, vec2, vec3, vec4
from passgraph.records import dataclass
from passgraph.scene.matrices import translation

Float64 = NDArray[np.float64]
#: Most sides of a ground: a slab, a plate, a floor.
MOST_PLANES = 64
#: Relative error of a depth after a few float32 operations, with a margin.
DEPTH_ROUNDING = 4e-6


@pg.struct
class LightFrame:
    """A light for the picture's kernels: in the camera's frame, with the eye at the origin."""

    map_from_view: mat4  # to the clip space of its shadow map
    depth_row: vec4  # distance along the light's axis
    place: vec3  # its position; for directional lights the unit vector toward it
    axis: vec3  # direction of its light
    world: mat3  # camera axes to world axes
    color: vec3  # scene-linear, times intensity
    cone: vec2  # cosines of the outer and inner half angle
    texel: float  # width of a map's texel, in scene units; per unit of depth for perspective maps
    bias: float  # rounding error of a depth, in scene units
    radius: float  # radius of the light, scene units; for directional lights of a disc seen at distance 1
    near: float  # least depth of a caster, in scene units


@dataclass(frozen=True)
class View:
    """A camera, and values derived from it.

    Attributes
    ----------
    camera : a run value; or a plain `passgraph.Camera`, which is constant and serialized with a graph
    """

    camera: Any

    def derived(self, function: Callable[[pg.Camera], Any]) -> Any:
        """Apply a function to the camera: in each run, or now for a constant one."""
        return function(self.camera) if isinstance(self.camera, pg.Camera) else self.camera.map(function)

    def view_from(self, origin: Float64) -> pg.Derived:
        """Return the matrix from positions relative to ``origin`` (world) to the camera's frame, (4, 4)."""
        matrix: pg.Derived = self.camera.map(lambda camera: view_from_world(camera, origin))
        return matrix

    def clip_from(self, origin: Float64) -> pg.Derived:
        """Return the matrix from positions relative to ``origin`` (world) to clip space, (4, 4)."""

        def matrix(camera: pg.Camera, size: tuple[int, int]) -> Float64:
            clip: Float64 = camera.projection_matrix(size[0] / size[1]) @ view_from_world(camera, origin)
            return clip

        return pg.combine(matrix, self.camera, pg.OUTPUT_SIZE)

    def frame(self) -> Any:
        """Return the `ViewFrame` that converts places and distances to positions."""
        return self.derived(view_frame)

    def in_perspective(self) -> Any:
        """Return True if the projection is a perspective."""
        return self.derived(lambda camera: not camera.orthographic)

    def up(self) -> Any:
        """Return world +y in the camera's frame."""
        return self.derived(lambda camera: camera.view_rotation()[:3, 1])


def view_frame(camera: pg.Camera) -> ViewFrame:
    """Return the camera for kernels."""
    make: Any = ViewFrame  # its fields are tuples on the host, vectors in kernels
    frame = make(camera.window(1.0).half[1], camera.aspect or 0.0, camera.shift, not camera.orthographic)
    assert isinstance(frame, ViewFrame)
    return frame


def view_from_world(camera: pg.Camera, origin: Float64) -> Float64:
    """Return the matrix from world positions relative to ``origin`` to the camera's frame; large offsets cancel in
    float64."""
    return camera.view_rotation() @ camera.relative(translation(origin))


#: The camera of a run and the size of its picture.
Seen = tuple[pg.Camera, tuple[int, int]]


@dataclass(frozen=True, eq=False)
class MapView:
    """The view of one shadow map; a cube map has six."""

    light: pg.Value
    casters: Casters
    face: int = -1  # of a cube: +x, -x, +y, -y, +z, -z
    fit: Fit | None = None  # fitted to the camera's view; None: the map contains all casters

    def frustum(self, light: pg.Light, seen: Seen | None = None) -> tuple[Float64, Float64]:
        """Return view and projection matrix, (4, 4) each, for the light and, if the map is fitted, the camera of a
        run."""
        view, projection = self._whole_scene(light)
        if self.fit is None or seen is None:
            return view, projection
        return view, self.fit.window(light, (view, projection), *seen) @ projection

    def _whole_scene(self, light: pg.Light) -> tuple[Float64, Float64]:
        """Return the matrices of the map of all casters."""
        default = self.light.default
        assert isinstance(default, pg.Light)
        if light.kind != default.kind:
            raise pg.InputError(
                f"value {self.light.name!r} was a {default.kind} light when the effect was built, and is now "
                f"a {light.kind} one; build the effect again with that light in the scene"
            )
        bounds = self.casters.bounds_for(light)
        if self.face >= 0:
            return light.cube_views()[self.face], light.cube_projection(bounds)
        return light.frustum(bounds)

    def clip_from(self, origin: Float64) -> pg.Derived:
        """Return the matrix from caster positions relative to ``origin`` (world) to the map's clip space."""

        def matrix(light: pg.Light, *seen: Any) -> Float64:
            view, projection = self.frustum(light, seen or None)
            return projection @ view @ translation(origin)

        return self.derived(matrix)

    def derived(self, function: Callable[..., object]) -> pg.Derived:
        """Derive a value from the light, and from the camera's view if the map is fitted to it; it then changes in
        steps."""
        if self.fit is None:
            return self.light.map(function)
        return pg.combine(function, self.light, self.fit.camera, pg.OUTPUT_SIZE, by_value=True)

    def depth_row(self, origin: Float64) -> pg.Derived:
        """Return the row that gives the depth of positions relative to ``origin``, in scene units along the light's
        axis."""
        return self.light.map(lambda light: -(self._whole_scene(light)[0] @ translation(origin))[2])

    def frame(self, view: View, map_size: int) -> pg.Derived:
        """Return the light for the picture's kernels."""

        def frame_of(camera: pg.Camera, light: pg.Light, size: tuple[int, int]) -> LightFrame:
            return self._frame(camera, light, size, map_size)

        return pg.combine(frame_of, view.camera, self.light, pg.OUTPUT_SIZE)

    def _frame(self, camera: pg.Camera, light: pg.Light, size: tuple[int, int] | None, map_size: int) -> LightFrame:
        rotation = camera.view_rotation()
        view, projection = self.frustum(light, None if size is None else (camera, size))
        light_from_view = view @ translation(camera.eye) @ rotation.T
        directional = light.kind == "directional"
        toward = -np.array(light.direction) if directional else np.subtract(light.position, camera.eye)
        # rounding matters where a map shows the receiver itself: among the casters
        low, high = self.casters.bounds_for(light)
        reach = float(np.linalg.norm(high - low)) + float(np.linalg.norm(0.5 * (low + high) - camera.eye))
        if not directional:
            reach += float(np.linalg.norm(toward))
        scale, shift = float(projection[2, 2]), float(projection[2, 3])
        near = (shift + 1.0) / scale if directional else shift / (scale - 1.0)
        make: Any = LightFrame  # its fields are numpy arrays on the host, vectors and matrices in kernels
        frame = make(
            projection @ light_from_view, -light_from_view[2],
            rotation[:3, :3] @ toward, rotation[:3, :3] @ light.direction, rotation[:3, :3].T,
            np.array(light.color) * light.intensity, (cos(light.cone_outer_rad), cos(light.cone_inner_rad)),
            2.0 / (float(np.linalg.norm(projection[0, :2])) * map_size), DEPTH_ROUNDING * reach,
            light.radius, near,
        )  # fmt: skip
        assert isinstance(frame, LightFrame)
        return frame


@dataclass(frozen=True, eq=False)
class Casters:
    """The shadow casters, with boxes for fitting shadow maps."""

    nodes: tuple[pg.Node, ...]
    scene_bounds: Float64
    grounds: tuple[tuple[int, Float64, float], ...] = field(default=())  # node, normal and offset of its plane
    kept: dict[tuple[int, ...], Float64] = field(default_factory=dict)

    @property
    def origin(self) -> Float64:
        """Return the world position that caster meshes are relative to: amid the casters."""
        nodes = self.shadowing_nodes()
        return np.asarray((bounds_of(nodes) if nodes else self.scene_bounds).mean(axis=0), np.float64)

    @classmethod
    def in_scene(cls, scene: pg.Scene) -> Casters:
        """Return the casters; flat or convex nodes with all others in front of one of their planes count as grounds."""
        nodes = tuple(node for node in scene.nodes if node.casts and node.material.alpha_mode != "blend")
        found = []
        for index, node in enumerate(nodes):
            plane = _plane_below(node, scene, bounds_of(nodes))
            if plane is not None:
                found.append((index, *plane))
        return cls(nodes, scene.bounds(), tuple(found))

    def shadowing_nodes(self) -> list[pg.Node]:
        """Return the casting nodes without grounds, or all if there are no others."""
        flat = {index for index, _, _ in self.grounds}
        return [node for index, node in enumerate(self.nodes) if index not in flat] or list(self.nodes)

    def nodes_for(self, light: pg.Light) -> tuple[pg.Node, ...]:
        """Return all nodes that can cast a shadow under this light: a ground lit from above cannot."""
        harmless = set()
        for index, normal, offset in self.grounds:
            if light.kind == "directional":
                above = float(normal @ light.direction) <= 0.0
            else:
                above = float(normal @ np.array(light.position)) >= offset
            if above:
                harmless.add(index)
        return tuple(node for index, node in enumerate(self.nodes) if index not in harmless)

    def pieces_for(self, light: pg.Light) -> Float64:
        """Return boxes of all nodes that can cast a shadow under this light, relative to `origin`."""
        nodes = self.nodes_for(light)
        key = tuple(id(node) for node in nodes)
        if key not in self.kept:
            self.kept[key] = pieces_of(nodes, self.origin)
        return self.kept[key]

    def bounds_for(self, light: pg.Light) -> Float64:
        """Return a box of all nodes that can cast a shadow under this light."""
        nodes = self.nodes_for(light)
        return bounds_of(nodes) if nodes else self.scene_bounds


def _plane_below(node: pg.Node, scene: pg.Scene, box: Float64) -> tuple[Float64, float] | None:
    """Return normal and offset of a plane of a large node that has the node, and no vertex of others, behind it, else
    None.

    "Large" is relative to the box of all casters: distant points that cast nothing do not matter.

    Neither a flat node nor a convex one shadows its own parts that face the light.
    """
    low, high = box
    extent = float(np.linalg.norm(high - low))
    if float(np.linalg.norm(node.bounds[1] - node.bounds[0])) < 0.25 * extent:
        return None  # too small to matter for the fit
    centre = 0.5 * (low + high)
    points = _world(node, centre)
    planes = _outer_planes(points, points[node.mesh.triangles], 1e-6 * extent)
    if planes is None:
        return None
    other_vertices = np.concatenate(
        [np.zeros((0, 3)), *(_world(other, centre) for other in scene.nodes if other is not node)]
    )
    slack = 1e-4 * extent
    for normal, offset in planes:
        if not len(other_vertices) or float((other_vertices @ normal).min()) - offset >= -slack:
            return normal, offset + float(normal @ centre)
    return None


def _outer_planes(points: Float64, corners: Float64, slack: float) -> list[tuple[Float64, float]] | None:
    """Return the planes of a flat or convex mesh, as outward normals and offsets; None if it is neither."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    order = np.argsort(-areas)[areas[np.argsort(-areas)] > 0.0]
    planes: list[tuple[Float64, float]] = []
    for index in order:
        normal = normals[index] / areas[index]
        offset = float(normal @ corners[index, 0])
        if any(float(normal @ n) > 1.0 - 1e-9 and abs(offset - at) <= slack for n, at in planes):
            continue
        heights = points @ normal - offset
        if float(np.abs(heights).max()) <= slack:
            return [(normal, offset), (-normal, -offset)]
        if len(planes) == MOST_PLANES or float(heights.max()) > slack:
            return None
        planes.append((normal, offset))
    return planes


def _world(node: pg.Node, origin: Float64) -> Float64:
    points: Float64 = node.mesh.positions @ node.transform[:3, :3].T + (node.transform[:3, 3] - origin)
    return points
