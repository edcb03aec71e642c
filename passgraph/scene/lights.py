"""Lights with an extent: directional, point and spot, and the frustums of their shadow maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import asin, atan2, inf, pi, radians, tan
from typing import Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from passgraph.arguments import among, shown, string
from passgraph.errors import InputError
from passgraph.records import dataclass
from passgraph.scene.camera import aim_of
from passgraph.scene.matrices import (
    Float64,
    Vec3,
    bounds_of,
    corners_of,
    look_from,
    number,
    orthographic,
    perspective,
    sphere_of,
    transform_points,
    unit,
    vec3,
)

# A wider single perspective map wastes nearly all texels on its border: tan(80 deg) = 5.7.
WIDEST_HALF_RAD = radians(80.0)
# A point light gets one fitted map up to a full angle of 150 degrees.
FITTED_HALF_RAD = radians(75.0)
# Margin on each side, as a fraction of the extent.
MARGIN = 0.02
# A perspective depth buffer of 24 bits still resolves 1e-4 of the far distance at this ratio.
NEAREST_OF_FAR = 1e-3
# Direction and up of the faces of a cube map (OpenGL 4.6, table 8.19).
CUBE_FACES = (
    ((1, 0, 0), (0, -1, 0)), ((-1, 0, 0), (0, -1, 0)), ((0, 1, 0), (0, 0, 1)), ((0, -1, 0), (0, 0, -1)),
    ((0, 0, 1), (0, -1, 0)), ((0, 0, -1), (0, -1, 0)),
)  # fmt: skip


def _depth_range(depth: Float64, radius: float) -> tuple[float, float]:
    """Return near and far for distances along the axis; a box behind or around the light gets a usable range."""
    far = float(depth.max())
    if far <= 0.0:
        far = radius
    far *= 1.0 + MARGIN
    near = max(float(depth.min()) * (1.0 - MARGIN), far * NEAREST_OF_FAR)
    return near, far


LightKind = Literal["directional", "point", "spot"]


@dataclass(frozen=True)
class Light:
    """A light; use `Light.directional`, `Light.point` or `Light.spot` to create one.

    Attributes
    ----------
    kind : "directional", "point" or "spot"
    position : world, scene units; a directional light ignores it
    direction : world unit vector from the light into the scene; a point light ignores it
    color : linear RGB, each 0 or more
    intensity : 0 or more, scene-linear. A white diffuse surface that faces the light shows
        ``color * intensity``: everywhere for a directional light, at distance 1 for the others, which fall
        off with the square of the distance
    radius : size of the emitter. Scene units for point and spot; for directional the tangent of the angular
        radius, that is the radius of a disc seen at distance 1 (the sun: 0.00465). 0 gives hard shadows
    cone_inner_rad, cone_outer_rad : half angles of a spot: full light inside the first, none past the second
    name : used in messages

    >>> Light.directional((0, -2, 0)).direction
    (0.0, -1.0, 0.0)
    """

    kind: LightKind
    position: Vec3 = (0.0, 0.0, 0.0)
    direction: Vec3 = (0.0, -1.0, 0.0)
    color: Vec3 = (1.0, 1.0, 1.0)
    intensity: float = 1.0
    radius: float = 0.0
    cone_inner_rad: float = 0.0
    cone_outer_rad: float = pi / 4
    name: str = "light"

    def __post_init__(self) -> None:
        where = f"light {string(self.name, 'the name of a light')!r}"
        if not among(self.kind, ("directional", "point", "spot")):
            raise InputError(f"{where}: kind: expected 'directional', 'point' or 'spot', got {shown(self.kind)}")
        direction = vec3(self.direction, f"{where}: direction")
        if not any(direction):
            raise InputError(f"{where}: direction: expected a vector that is not zero, got {shown(self.direction)}")
        color = vec3(self.color, f"{where}: color")
        if min(color) < 0.0:
            raise InputError(f"{where}: color: expected linear RGB of 0 or more, got {shown(self.color)}")
        outer = number(self.cone_outer_rad, f"{where}: cone_outer_rad", 0.0, pi / 2, open_low=True)
        fields = {
            "position": vec3(self.position, f"{where}: position"),
            "direction": tuple(float(c) for c in unit(direction)),
            "color": color,
            "intensity": number(self.intensity, f"{where}: intensity", 0.0, inf),
            "radius": number(self.radius, f"{where}: radius", 0.0, inf),
            "cone_inner_rad": number(self.cone_inner_rad, f"{where}: cone_inner_rad", 0.0, outer),
            "cone_outer_rad": outer,
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)

    @classmethod
    def directional(
        cls,
        direction: ArrayLike,
        color: ArrayLike = (1.0, 1.0, 1.0),
        intensity: float = 1.0,
        radius: float = 0.02,
        name: str = "light",
    ) -> Light:
        """Return a light at infinity, from one direction; ``radius`` is a tangent, see the class."""
        along, tint = cast("Vec3", direction), cast("Vec3", color)
        return cls("directional", direction=along, color=tint, intensity=intensity, radius=radius, name=name)

    @classmethod
    def point(
        cls,
        position: ArrayLike,
        color: ArrayLike = (1.0, 1.0, 1.0),
        intensity: float = 1.0,
        radius: float = 0.0,
        name: str = "light",
    ) -> Light:
        """Return a light that is a sphere of ``radius`` scene units and shines in all directions.

        >>> Light.point((0, 3, 0), radius=0.25).radius
        0.25
        """
        place, tint = cast("Vec3", position), cast("Vec3", color)
        return cls("point", place, color=tint, intensity=intensity, radius=radius, name=name)

    @classmethod
    def spot(
        cls,
        position: ArrayLike,
        direction: ArrayLike,
        color: ArrayLike = (1.0, 1.0, 1.0),
        intensity: float = 1.0,
        radius: float = 0.0,
        cone_inner_rad: float | None = None,
        cone_outer_rad: float = pi / 4,
        name: str = "light",
    ) -> Light:
        """Return a light that is a disc of ``radius`` and shines into a cone; the inner cone defaults to 2/3 of it."""
        place, along, tint = cast("Vec3", position), cast("Vec3", direction), cast("Vec3", color)
        outer = number(cone_outer_rad, f"light {name!r}: cone_outer_rad", 0.0, pi / 2, open_low=True)
        inner = outer * 2.0 / 3.0 if cone_inner_rad is None else cone_inner_rad
        return cls("spot", place, along, tint, intensity, radius, inner, outer, name)

    def reaching(self, place: ArrayLike, nearest: float = 1e-9) -> float:
        """Return the brightness of a white surface at ``place`` that faces the light, whatever its color and cone.

        A lamp that is closer than ``nearest``, above 0 and in scene units, counts as that far away.

        >>> Light.point((0, 2, 0), intensity=8.0).reaching((0, 0, 0))
        2.0
        """
        if self.kind == "directional":
            return self.intensity
        away = float(np.linalg.norm(np.subtract(vec3(place, f"light {self.name!r}: place"), self.position)))
        return self.intensity / max(away, nearest) ** 2

    def around(self, centre: ArrayLike, azimuth_rad: float | None = None, elevation_rad: float | None = None) -> Light:
        """Return the light from another direction, seen from ``centre``; omitted angles are unchanged.

        Point and spot lights keep their distance from the center, and spots point at it. Angles are those of
        `Camera.orbit`: azimuth 0 is light from the front, elevation pi/2 light from above.

        >>> light = Light.directional((0, -1, 0)).around((0, 0, 0), 0.0, 0.0)
        >>> light.direction[2]
        -1.0
        """
        where, middle = f"light {self.name!r}", np.array(vec3(centre, f"light {self.name!r}: centre"))
        offset = -np.array(self.direction) if self.kind == "directional" else np.subtract(self.position, middle)
        distance = float(np.linalg.norm(offset))
        if distance == 0.0:
            raise InputError(f"{where}: lies in the centre {middle.tolist()} that it is to be turned about; move it")
        x, y, z = (offset / distance).tolist()
        azimuth = atan2(x, z) if azimuth_rad is None else number(azimuth_rad, f"{where}: azimuth_rad", -inf, inf)
        elevation = asin(max(-1.0, min(1.0, y)))
        if elevation_rad is not None:
            elevation = number(elevation_rad, f"{where}: elevation_rad", -pi / 2, pi / 2)
        toward = np.array(aim_of(azimuth, elevation).back)
        if self.kind == "directional":
            return replace(self, direction=_three(-toward))
        aimed = self if self.kind == "point" else replace(self, direction=_three(-toward))
        return replace(aimed, position=_three(middle + distance * toward))

    def frustum(self, bounds: ArrayLike) -> tuple[Float64, Float64]:
        """Return the view and projection matrices of one shadow map that holds a world box.

        Parameters
        ----------
        bounds : (2, 3) world minimum and maximum of all casters and receivers

        Returns
        -------
        view : (4, 4) float64, world to light frame, a rotation and a shift (distances are kept)
        projection : (4, 4) float64 to OpenGL clip space; square, so that a texel is as wide as it is high.
            Directional: orthographic, holds the box. Spot: perspective over the cone, at most
            `WIDEST_HALF_RAD` to each side. Point: perspective that holds the box.

        Raises
        ------
        InputError
            For a point light too near to the box for one map; use `cube_views`.

        >>> view, projection = Light.directional((0, -1, 0)).frustum([[-1, 0, -1], [1, 2, 1]])
        >>> bool(abs((projection @ view @ [1, 2, 1, 1])[:3]).max() < 1)
        True
        """
        box = bounds_of(bounds, f"light {self.name!r}: bounds")
        centre, radius = sphere_of(box)
        if self.kind == "directional":
            # two radii back, so that near is positive: depth is measured from the eye, as for the other lights
            view = look_from(centre - 2.0 * radius * np.array(self.direction), self.direction)
            points = transform_points(view, corners_of(box))
            half = max(float(np.abs(points[:, :2]).max()), 0.01 * radius) * (1.0 + MARGIN)
            depth, slack = -points[:, 2], MARGIN * radius
            return view, orthographic(half, half, float(depth.min()) - slack, float(depth.max()) + slack)
        if self.kind == "spot":
            view = look_from(self.position, self.direction)
            near, far = _depth_range(-transform_points(view, corners_of(box))[:, 2], radius)
            half = tan(min(self.cone_outer_rad, WIDEST_HALF_RAD)) * (1.0 + MARGIN)
            return view, perspective(half, half, near, far)
        fitted = self.fitted_frustum(box)
        if fitted is None:
            raise InputError(
                f"light {self.name!r}: the scene spans more than 150 degrees seen from this point light; "
                "use its six cube_views(), or move it away from the scene"
            )
        return fitted

    def view_matrix(self, bounds: ArrayLike) -> Float64:
        """Return the first matrix of `frustum`."""
        return self.frustum(bounds)[0]

    def projection_matrix(self, bounds: ArrayLike) -> Float64:
        """Return the second matrix of `frustum`."""
        return self.frustum(bounds)[1]

    def fitted_frustum(self, bounds: ArrayLike) -> tuple[Float64, Float64] | None:
        """Return view and projection that hold the box as seen from a point or spot light.

        None if the box extends more than 75 degrees from its middle, or contains the light.
        """
        if self.kind == "directional":
            raise InputError(f"light {self.name!r}: fitted_frustum is for point and spot lights")
        box = bounds_of(bounds, f"light {self.name!r}: bounds")
        centre, radius = sphere_of(box)
        towards = centre - np.array(self.position)
        if float(np.linalg.norm(towards)) <= 1e-3 * radius:
            return None
        view = look_from(self.position, towards)
        points = transform_points(view, corners_of(box))
        depth = -points[:, 2]
        across = np.linalg.norm(points[:, :2], axis=1)
        if np.any(depth <= 0.0) or np.any(across > tan(FITTED_HALF_RAD) * depth):
            return None
        half = max(float((np.abs(points[:, :2]) / depth[:, None]).max()), 1e-3) * (1.0 + MARGIN)
        near, far = _depth_range(depth, radius)
        return view, perspective(half, half, near, far)

    def cube_views(self) -> tuple[Float64, ...]:
        """Return six view matrices in the order and orientation of OpenGL cube map faces: +x, -x, +y, -y, +z, -z."""
        if self.kind == "directional":
            raise InputError(f"light {self.name!r}: cube_views is for point and spot lights")
        return tuple(look_from(self.position, forward, up) for forward, up in CUBE_FACES)

    def cube_projection(self, bounds: ArrayLike) -> Float64:
        """Return the 90 degree projection of every face of `cube_views`, with near and far from the box."""
        box, place = bounds_of(bounds, f"light {self.name!r}: bounds"), np.array(self.position)
        # depth is measured along an axis, so it is at most the box's largest coordinate
        far = max(float(np.abs(corners_of(box) - place).max()), sphere_of(box)[1]) * (1.0 + MARGIN)
        # a surface appears in the face of its largest coordinate, with that coordinate as depth
        gap = np.maximum(np.maximum(box[0] - place, place - box[1]), 0.0)
        near = max(float(gap.max()) * (1.0 - MARGIN), far * NEAREST_OF_FAR)
        return perspective(1.0, 1.0, min(near, 0.5 * far), far)


def _three(vector: Float64) -> Vec3:
    x, y, z = vector.tolist()
    return x, y, z


def exposed(lights: Sequence[Light], bounds: Float64) -> list[Light]:
    """Scale lights by one factor, so that together they show a white surface in the middle of ``bounds``, (2, 3), as 1.

    A light nearer than a fiftieth of the diagonal counts as that far away.
    """
    middle = bounds.mean(axis=0)
    nearest = max(float(np.linalg.norm(bounds[1] - bounds[0])) / 50.0, 1e-9)
    total = sum(light.reaching(middle, nearest) for light in lights)
    return [replace(light, intensity=light.intensity / (total if total > 0.0 else 1.0)) for light in lights]
