"""The camera: position, view, and matrices that stay precise far from the origin."""

from __future__ import annotations

from dataclasses import replace
from math import asin, atan, atan2, cos, hypot, isfinite, pi, sin, tan
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from passgraph.arguments import shown
from passgraph.errors import InputError
from passgraph.records import dataclass
from passgraph.scene.matrices import (
    Float64,
    Vec3,
    are_parallel,
    bounds_of,
    corners_of,
    floats,
    look_rotation,
    number,
    orthographic,
    perspective,
    rigid,
    rotation_y,
    sphere_of,
    translation,
    unit,
    vec3,
)
from passgraph.scene.projection import HardwareDepth, Projection, far_plane

#: Margin around framed points, as a fraction of their extent in the picture.
FRAME_MARGIN = 0.08
#: Least distance of the eye from the points, in radii of the sphere around their box.
CLOSEST = 0.05
#: The near plane, as a share of the distance of the nearest point; for an eye among the points, of the far plane.
NEAR_SLACK, NEAR_OF_FAR = 0.95, 1e-3
#: Most rounds of the search for the middle of a projection; each finds the bounding points, and a few suffice.
MOST_ROUNDS = 24
#: Directions for finding the outermost points of a profile, and positions of each point on its circle.
PROFILE_WAYS, AROUND = 256, 64


class Aim(NamedTuple):
    """Direction from the target to the camera, and up in the picture: unit vectors."""

    back: Vec3
    up: Vec3


def aim_of(azimuth_rad: float, elevation_rad: float) -> Aim:
    """Return the aim for an azimuth, 0 at +z and growing toward +x, and an elevation above the horizon.

    >>> [round(x, 6) for x in aim_of(pi / 2, 0.0).back]
    [1.0, 0.0, 0.0]
    """
    ca, sa, ce, se = cos(azimuth_rad), sin(azimuth_rad), cos(elevation_rad), sin(elevation_rad)
    return Aim((ce * sa, se, ce * ca), (-se * sa, ce, -se * ca))


def angles_of(back: Float64) -> tuple[float, float]:
    """Return azimuth and elevation of a unit vector from the target to the camera, as `aim_of` takes them."""
    return atan2(back[0], back[2]), asin(min(max(float(back[1]), -1.0), 1.0))


def eye_for(points: Float64, aim: Aim, half: tuple[float, float]) -> Float64:
    """Return the nearest eye, (3,), from which (n, 3) points are within ``half`` the width and height at distance 1.

    Along the side that they do not fill they are centered.
    """
    bounds = np.stack([points.min(axis=0), points.max(axis=0)])
    centre, radius = sphere_of(bounds)
    rotation = look_rotation(tuple(-x for x in aim.back), aim.up)[:3, :3]
    local = (points - centre) @ rotation.T
    z = local[:, 2]
    # |x - eye| <= half (eye_z - z) for all points: two half planes a point, and they meet in the nearest eye
    needed = []
    for axis, tangent in zip((0, 1), half, strict=True):
        above, below = (tangent * z + local[:, axis]).max(), (tangent * z - local[:, axis]).max()
        needed.append((float(above) + float(below)) / (2.0 * tangent))
    distance = max(*needed, float(z.max()) + CLOSEST * radius)
    across = [_middle(local[:, axis], distance - z, tangent) for axis, tangent in zip((0, 1), half, strict=True)]
    return np.asarray(centre + np.array([*across, distance]) @ rotation, dtype=np.float64)


def _middle(across: Float64, depth: Float64, tangent: float) -> float:
    """Return the eye's position on an axis that centers the outermost points."""
    low, high = float((across - tangent * depth).max()), float((across + tangent * depth).min())
    at = 0.5 * (low + high)
    for _ in range(MOST_ROUNDS):
        slopes = (across - at) / depth
        right, left = int(slopes.argmax()), int(slopes.argmin())
        weights = 1.0 / depth[right], 1.0 / depth[left]
        middle = float((across[right] * weights[0] + across[left] * weights[1]) / (weights[0] + weights[1]))
        if middle == at:
            break
        at = middle
    # rounding may reverse the ends of the allowed interval
    return min(max(at, low), max(low, high))


def ways_round(points: Float64, centre: Float64) -> Float64:
    """Return points whose hull holds the volume that (n, 3) points sweep in a turn about the vertical at ``centre``."""
    radius = np.hypot(points[:, 0] - centre[0], points[:, 2] - centre[2])
    height = points[:, 1] - centre[1]
    angle = np.arange(PROFILE_WAYS) * (pi / PROFILE_WAYS) - 0.5 * pi
    outermost = {int((radius * cos(a) + height * sin(a)).argmax()) for a in angle} | {int(height.argmin())}
    outermost_points = sorted(outermost)
    around = np.arange(AROUND) * (2.0 * pi / AROUND)
    # circles become circumscribed polygons
    wide = radius[outermost_points, None] / cos(pi / AROUND)
    x, z = wide * np.sin(around), wide * np.cos(around)
    y = np.broadcast_to(height[outermost_points, None], x.shape)
    return np.asarray(np.stack([x, y, z], axis=-1).reshape(-1, 3) + centre, dtype=np.float64)


def depths(eye: Float64, forward: Float64, points: Float64, lateral: Float64) -> tuple[float, float]:
    """Return near and far planes that hold the points; far holds those of ``lateral`` too."""
    distances = (points - eye) @ forward
    _, radius = sphere_of(np.stack([points.min(axis=0), points.max(axis=0)]))
    far = max(float(distances.max()), float(((lateral - eye) @ forward).max()), radius) + 0.05 * radius
    nearest = NEAR_SLACK * float(distances.min())
    return max(nearest, min(NEAR_OF_FAR * far, 0.01 * radius)), far


# From the target to the camera: a three-quarter view from about 25 degrees above.
DEFAULT_DIRECTION: Vec3 = (0.55, 0.5, 0.85)
DEFAULT_AZIMUTH_RAD = atan2(DEFAULT_DIRECTION[0], DEFAULT_DIRECTION[2])
DEFAULT_ELEVATION_RAD = atan2(DEFAULT_DIRECTION[1], hypot(DEFAULT_DIRECTION[0], DEFAULT_DIRECTION[2]))
# Highest elevation of an orbit: at 90 degrees a turn would only roll the picture.
HIGHEST_RAD = 1.5
# Nearest and farthest of an orbit, in distances of the camera that it begins with.
ORBIT_DISTANCES = (0.05, 20.0)
# Widest angle of view; beyond it the middle of a picture degenerates to a point.
WIDEST_FOV_RAD = 0.999 * pi
# 40 degrees: close to a 50 mm lens on 35 mm film in height, little distortion of single objects.
DEFAULT_FOV_RAD = 40.0 * pi / 180.0


class Window(NamedTuple):
    """The extent of a camera's view: half its width and height, and its middle, at distance 1; at any distance if
    orthographic."""

    half: tuple[float, float]
    middle: tuple[float, float]


@dataclass(frozen=True)
class Camera:
    """A camera, in perspective or orthographic.

    Attributes
    ----------
    eye, target : world points, scene units; float64, so an offset of 1e6 keeps ten digits
    up : world direction that is up in the picture
    vertical_fov_rad : full vertical angle, in ]0, pi[; for an off-center picture, that of a centered one as high
    near, far : distances along the view axis, scene units, 0 < near < far; in perspective far may be infinite
    orthographic_height : height of the picture in scene units, for an orthographic camera; None for perspective
    shift : offset of the picture's middle from the view axis, in half its width (right) and height (up)
    aspect : width / height of the view; None takes the picture's, for square pixels
    back : distance of the eye behind an engine's eye, if its orthographic view begins behind that (`from_matrices`);
        effects measure distances from the engine's eye, such as the start of fog

    >>> Camera(eye=(0, 0, 5), target=(0, 0, 0)).view_matrix()[2, 3].item()
    -5.0
    >>> plan = Camera(eye=(0, 9, 0), target=(0, 0, 0), up=(0, 0, -1), orthographic_height=6.0)
    >>> plan.window(16 / 9).half
    (5.333333333333333, 3.0)
    """

    eye: Vec3
    target: Vec3
    up: Vec3 = (0.0, 1.0, 0.0)
    vertical_fov_rad: float = DEFAULT_FOV_RAD
    near: float = 0.1
    far: float = 100.0
    orthographic_height: float | None = None
    shift: tuple[float, float] = (0.0, 0.0)
    aspect: float | None = None
    back: float = 0.0

    def __post_init__(self) -> None:
        for field in ("eye", "target", "up"):
            object.__setattr__(self, field, vec3(getattr(self, field), f"camera: {field}"))
        object.__setattr__(self, "near", number(self.near, "camera: near", 0.0, np.inf, open_low=True))
        fov = number(self.vertical_fov_rad, "camera: vertical_fov_rad", 0.0, WIDEST_FOV_RAD, open_low=True)
        object.__setattr__(self, "vertical_fov_rad", fov)
        for field in ("orthographic_height", "aspect"):
            if getattr(self, field) is not None:
                length = number(getattr(self, field), f"camera: {field}", 0.0, np.inf, open_low=True)
                object.__setattr__(self, field, length)
        object.__setattr__(self, "far", far_plane(self.far, "camera", self.near, self.orthographic))
        shift = floats(self.shift, "camera: shift", "two finite numbers")
        if shift.shape != (2,) or not np.isfinite(shift).all():
            raise InputError(f"camera: shift: expected two finite numbers, got {shown(self.shift)}")
        object.__setattr__(self, "shift", (float(shift[0]), float(shift[1])))
        object.__setattr__(self, "back", number(self.back, "camera: back", 0.0, np.inf))
        if self.eye == self.target:
            raise InputError(f"camera: eye and target are the same point {self.eye}; move one of them")
        if not any(self.up):
            raise InputError("camera: up: expected a vector that is not zero, got (0, 0, 0)")
        if are_parallel(self.forward, self.up):
            raise InputError(
                f"camera: up {self.up} is parallel to the view direction; "
                "choose another up, for example (0, 0, -1) for a view from above"
            )

    @property
    def orthographic(self) -> bool:
        """True for an orthographic camera."""
        return self.orthographic_height is not None

    @property
    def forward(self) -> Float64:
        """Unit vector from the eye to the target, (3,) float64, world."""
        return unit(np.subtract(self.target, self.eye))

    def view_rotation(self) -> Float64:
        """World to camera axes without the shift, (4, 4): for positions relative to the eye (`relative`)."""
        return look_rotation(self.forward, self.up)

    def view_matrix(self) -> Float64:
        """World to camera frame, (4, 4) float64; far from the origin, round `relative` instead."""
        return self.view_rotation() @ translation(-np.array(self.eye))

    def projection_matrix(self, aspect: float) -> Float64:
        """Camera frame to OpenGL clip space, (4, 4) float64; ``aspect`` is width / height of the picture."""
        half, middle = self.window(aspect)
        project = orthographic if self.orthographic else perspective
        return project(*half, self.near, self.far, middle)

    def window(self, aspect: float) -> Window:
        """Return the extent of the view in a picture of aspect ratio ``aspect``."""
        ratio = number(aspect, "camera: aspect", 0.0, np.inf, open_low=True) if self.aspect is None else self.aspect
        height = self.orthographic_height
        half = tan(0.5 * self.vertical_fov_rad) if height is None else 0.5 * height
        return Window((half * ratio, half), (self.shift[0] * half * ratio, self.shift[1] * half))

    def hardware_depth(self, reversed_z: bool = False) -> HardwareDepth:
        """Return the depth convention of a depth buffer drawn with this camera.

        >>> Camera((0, 0, 5), (0, 0, 0), near=1.0, far=9.0).hardware_depth().depth(9.0).item()
        1.0
        """
        return HardwareDepth(self.near, self.far, reversed_z, self.orthographic)

    @classmethod
    def from_matrices(cls, view: ArrayLike, projection: ArrayLike, zero_to_one: bool | None = None) -> Camera:
        """Return the camera of an engine's two matrices.

        Parameters
        ----------
        view : (4, 4), world to the camera's frame, which looks along -z: a rotation and a translation; ``M @ v``
        projection : (4, 4), to clip space: perspective or orthographic, also off-center, with an infinite far plane,
            with reversed depth, or with y down (Vulkan)
        zero_to_one : True if depth in clip space is from 0 to 1, as in Direct3D, Vulkan, Metal, WebGPU and with
            ``glClipControl``; False for -1 to 1, OpenGL's default. None takes -1 to 1, unless the matrix rules it out,
            which only reversed depth can

        If an orthographic projection begins behind the eye, the eye is moved back by ``back``, with the same picture.
        `passgraph.HardwareDepth.of_projection` reads the encoding of the depth buffer from the same matrix.

        Raises
        ------
        InputError
            For other matrices, with the reason.

        >>> seen = Camera((3, 2, 5), (0, 1, 0), vertical_fov_rad=0.7, near=0.5, far=50.0)
        >>> found = Camera.from_matrices(seen.view_matrix(), seen.projection_matrix(1.5))
        >>> [round(x, 9) for x in (*found.eye, found.vertical_fov_rad, found.near, found.far)]
        [3.0, 2.0, 5.0, 0.7, 0.5, 50.0]
        """
        turn, eye = rigid(view, "view")
        read = Projection.from_matrix(projection, zero_to_one)
        eye = eye + read.back * turn[2]
        # farther away for an eye far from the origin, so that the direction keeps its digits
        target = eye - turn[2] * max(1.0, float(np.abs(eye).max()))
        (width, height), (right, up) = read.half, read.middle
        return cls(
            tuple(eye.tolist()), tuple(target.tolist()), tuple(turn[1].tolist()),
            DEFAULT_FOV_RAD if read.orthographic else 2.0 * atan(height),
            read.near, read.far, 2.0 * height if read.orthographic else None,
            (right / width, up / height), width / height, read.back,
        )  # fmt: skip

    def relative(self, transform: ArrayLike) -> Float64:
        """An object's transform with the eye as origin, (4, 4) float64.

        The large world coordinates cancel here, in float64; the result may be rounded to float32 safely:
        ``projection @ view_rotation @ relative(transform) @ v``.

        >>> camera = Camera(eye=(1e6, 0, 5), target=(1e6, 0, 0))
        >>> camera.relative(translation((1e6, 0, 0)))[:3, 3].tolist()
        [0.0, 0.0, -5.0]
        """
        matrix = floats(transform, "camera: transform", "a (4, 4) matrix of numbers")
        if matrix.shape != (4, 4):
            raise InputError(f"camera: transform: expected a (4, 4) matrix, got shape {matrix.shape}")
        return translation(-np.array(self.eye)) @ matrix

    @classmethod
    def framing(
        cls,
        bounds: ArrayLike,
        direction: ArrayLike | None = None,
        aspect: float = 16.0 / 9.0,
        vertical_fov_rad: float = DEFAULT_FOV_RAD,
        depth_bounds: ArrayLike | None = None,
    ) -> Camera:
        """Return a camera that sees a whole box.

        Parameters
        ----------
        bounds : (2, 3) world minimum and maximum of the box
        direction : from the target to the camera; the default is a three-quarter view from slightly above
        aspect : width / height of the picture
        vertical_fov_rad : full vertical angle
        depth_bounds : (2, 3) larger box that near and far must hold too, such as a floor

        >>> camera = Camera.framing([[-1, -1, -1], [1, 1, 1]])
        >>> 0 < camera.near < camera.far
        True
        """
        box = bounds_of(bounds, "camera: bounds")
        back = vec3(DEFAULT_DIRECTION if direction is None else direction, "camera: direction")
        if not any(back):
            raise InputError("camera: direction: expected a vector that is not zero, got (0, 0, 0)")
        up = (0.0, 0.0, -1.0) if are_parallel(back, (0.0, 1.0, 0.0)) else (0.0, 1.0, 0.0)
        reach = None if depth_bounds is None else bounds_of(depth_bounds, "camera: depth_bounds")
        x, y, z = unit(back).tolist()
        return cls._filled(corners_of(box), Aim((x, y, z), up), aspect, vertical_fov_rad, reach)

    @classmethod
    def orbit(
        cls,
        points: ArrayLike,
        azimuth_rad: float = DEFAULT_AZIMUTH_RAD,
        elevation_rad: float = DEFAULT_ELEVATION_RAD,
        *,
        distance: float | None = None,
        aspect: float = 16.0 / 9.0,
        vertical_fov_rad: float = DEFAULT_FOV_RAD,
        depth_bounds: ArrayLike | None = None,
    ) -> Camera:
        """Return a camera that looks at points from a direction, so that they fill the picture.

        Parameters
        ----------
        points : (n, 3) world points, such as `passgraph.Scene.points` returns
        azimuth_rad : 0 looks from +z, the front of a glTF model; grows toward +x, counter-clockwise seen from above
        elevation_rad : in [-pi/2, pi/2], over (or under) the horizon
        distance : from the eye to the middle of the points' box, scene units; by default the nearest at which all
            points are in the picture, with a margin of `passgraph.scene.camera.FRAME_MARGIN` to the nearest edges
        aspect : width / height of the picture
        vertical_fov_rad : full vertical angle
        depth_bounds : (2, 3) larger box that near and far must hold too, such as a floor

        Raises
        ------
        InputError
            No points, or a number out of its range.

        >>> camera = Camera.orbit([[-1, 0, 0], [1, 0, 0]], 0.0, 0.0, aspect=1.0, vertical_fov_rad=pi / 2)
        >>> [round(x, 9) for x in camera.eye]
        [0.0, 0.0, 1.08]
        """
        table = floats(points, "camera: points", "an array of shape (n, 3) of numbers")
        if table.ndim != 2 or table.shape[1:] != (3,) or not len(table) or not np.isfinite(table).all():
            raise InputError(f"camera: points: expected shape (n, 3), n at least 1, finite, got {shown(points)}")
        aim = aim_of(
            number(azimuth_rad, "camera: azimuth_rad", -np.inf, np.inf),
            number(elevation_rad, "camera: elevation_rad", -pi / 2, pi / 2),
        )
        reach = None if depth_bounds is None else bounds_of(depth_bounds, "camera: depth_bounds")
        if distance is not None:
            distance = number(distance, "camera: distance", 0.0, np.inf, open_low=True)
        return cls._filled(table, aim, aspect, vertical_fov_rad, reach, distance)

    @classmethod
    def _filled(
        cls,
        points: Float64,
        aim: Aim,
        aspect: float,
        vertical_fov_rad: float,
        reach: Float64 | None,
        distance: float | None = None,
    ) -> Camera:
        fov = number(vertical_fov_rad, "camera: vertical_fov_rad", 0.0, WIDEST_FOV_RAD, open_low=True)
        half = tan(0.5 * fov) / (1.0 + FRAME_MARGIN)
        ratio = number(aspect, "camera: aspect", 0.0, np.inf, open_low=True)
        away = np.array(aim.back)
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        eye = eye_for(points, aim, (half * ratio, half)) if distance is None else middle + distance * away
        if not np.isfinite(eye).all():
            raise InputError(f"camera: an angle of {fov:g} rad needs a distance beyond all numbers; give a wider one")
        if distance is not None and np.array_equal(eye, middle):
            raise InputError(f"camera: distance: {distance:g} is lost beside coordinates of {np.abs(middle).max():g}")
        target = eye - away * (float((eye - middle) @ away) if distance is None else distance)
        in_reach = points if reach is None else corners_of(reach)
        return cls(tuple(eye.tolist()), tuple(target.tolist()), aim.up, fov, *depths(eye, -away, points, in_reach))

    def turned(self, centre: ArrayLike, angle_rad: float) -> Camera:
        """Return the camera rotated about the vertical through ``centre``, counter-clockwise seen from above.

        >>> Camera((0, 1, 5), (0, 0, 0)).turned((0, 0, 0), pi / 2).eye[:2]
        (5.0, 1.0)
        """
        middle = np.array(vec3(centre, "camera: centre"))
        turn = rotation_y(number(angle_rad, "camera: angle_rad", -np.inf, np.inf))[:3, :3]
        eye, target = (tuple((middle + turn @ (np.array(p) - middle)).tolist()) for p in (self.eye, self.target))
        return replace(self, eye=eye, target=target, up=tuple((turn @ np.array(self.up)).tolist()))

    def orbited(self, azimuth_rad: float = 0.0, elevation_rad: float = 0.0, distance: float = 1.0) -> Camera:
        """Return the camera orbited round its target, as a drag and the wheel of a mouse do.

        Parameters
        ----------
        azimuth_rad : to the right, counter-clockwise seen from above
        elevation_rad : upward; the camera stops short of the vertical
        distance : factor of the distance from the target; of the height of the picture, if orthographic

        >>> [round(x, 6) for x in Camera((0, 0, 5), (0, 0, 0)).orbited(pi / 2, 0.0, 2.0).eye]
        [10.0, 0.0, 0.0]
        """
        right = number(azimuth_rad, "camera: azimuth_rad", -np.inf, np.inf)
        over = number(elevation_rad, "camera: elevation_rad", -np.inf, np.inf)
        factor = number(distance, "camera: distance", 0.0, np.inf, open_low=True)
        factor = min(max(factor, ORBIT_DISTANCES[0]), ORBIT_DISTANCES[1])
        if (right, over, factor) == (0.0, 0.0, 1.0):
            return self
        azimuth, elevation = angles_of(-self.forward)
        before = aim_of(azimuth, elevation)
        after = aim_of(azimuth + right, min(max(elevation + over, -HIGHEST_RAD), HIGHEST_RAD))
        # Up turns with the eye: a camera that is not rolled stays so.
        first, then = (look_rotation(-np.array(aim.back), aim.up)[:3, :3] for aim in (before, after))
        length = float(np.linalg.norm(np.subtract(self.eye, self.target)))
        height = self.orthographic_height
        return replace(
            self,
            eye=tuple((np.array(self.target) + np.array(after.back) * length * factor).tolist()),
            up=tuple((then.T @ first @ np.array(self.up)).tolist()),
            near=self.near * min(1.0, factor),
            far=self.far * max(1.0, factor) if isfinite(self.far) else self.far,
            orthographic_height=None if height is None else height * factor,
        )

    def zoomed(self, factor: float) -> Camera:
        """Return the camera with a lens that magnifies by ``factor``.

        >>> round(Camera((0, 0, 5), (0, 0, 0), vertical_fov_rad=pi / 2).zoomed(2.0).window(1.0).half[1], 9)
        0.5
        """
        times = number(factor, "camera: zoom", 0.0, np.inf, open_low=True)
        if self.orthographic_height is not None:
            return replace(self, orthographic_height=self.orthographic_height / times)
        fov = 2.0 * atan(tan(0.5 * self.vertical_fov_rad) / times)
        if not 0.0 < fov <= WIDEST_FOV_RAD:
            raise InputError(f"camera: zoom: {times:g} makes an angle of view of {fov:g} rad; expected one nearer to 1")
        return replace(self, vertical_fov_rad=fov)


class NamedCamera(NamedTuple):
    """A view that comes with a scene.

    ``lens`` is the camera's own name in the file, if its node has another name.
    """

    name: str
    camera: Camera
    lens: str = ""
