"""The blur of a point by an aperture: its width and its shape."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin, sqrt

import passgraph as pg
from passgraph.arguments import shown

#: Angle between successive points about the center: the golden angle, which forms no rows.
GOLDEN_ANGLE = pi * (3.0 - sqrt(5.0))
MM_PER_M = 1000.0


@dataclass(frozen=True)
class ThinLens:
    """A thin lens in front of a sensor.

    Attributes
    ----------
    f_number : focal length divided by the diameter of the aperture
    focal_length_mm, sensor_height_mm : the picture's vertical angle of view is 2 atan(height / (2 focal length))
    unit_m : meters of a scene unit
    """

    f_number: float
    focal_length_mm: float
    sensor_height_mm: float
    unit_m: float

    def blur(self, focus_distance: float) -> tuple[float, float]:
        """Return the blur of a distance z: a disc of radius ``|a - b / z|`` of the picture's height, negative in front.

        The circle of confusion's diameter on the sensor is F² / (N (s - F)) · |z - s| / z.

        >>> a, b = ThinLens(2.0, 50.0, 24.0, 1.0).blur(2.0)
        >>> round(a * 24.0 * 2.0, 4), round(b / a, 4)  # mm at infinity; nothing at 2 m
        (0.641, 2.0)
        """
        away_mm = focus_distance * self.unit_m * MM_PER_M
        if away_mm <= self.focal_length_mm:
            raise pg.GraphError(
                f"depth_of_field: focus_distance is {shown(focus_distance)} scene units, {away_mm:g} mm, and a lens of "
                f"{self.focal_length_mm:g} mm focuses beyond its focal length only; mend unit_m or focus_distance"
            )
        diameter_mm = self.focal_length_mm**2 / (self.f_number * (away_mm - self.focal_length_mm))
        radius = 0.5 * diameter_mm / self.sensor_height_mm
        return radius, radius * focus_distance


def aperture_places(
    count: int, blades: int, rotation_rad: float = 0.0, crowded: bool = False
) -> tuple[tuple[float, float, float, float], ...]:
    """Return points in an aperture of radius 1: x, y, distance (1 at the rim), and the area that each represents.

    The aperture is round, or a polygon with this number of blades and the same area, standing on a corner if not
    rotated.  Areas are 1 on average: of equal size, or with ``crowded`` denser toward the center, with the number of
    points within a distance proportional to it.

    >>> [round(value, 2) for value in aperture_places(4, 0)[3]]
    [0.74, 0.57, 0.94, 1.0]
    """
    places = []
    for number in range(count):
        share, angle = (number + 0.5) / count, number * GOLDEN_ANGLE
        out = share if crowded else sqrt(share)
        far = out * _rim(angle - rotation_rad, blades)
        places.append((far * sin(angle), far * cos(angle), out, 2.0 * out if crowded else 1.0))
    return tuple(places)


def _rim(angle: float, blades: int) -> float:
    """Return the radius of the aperture's rim in a direction, measured from a corner's axis."""
    if blades == 0:
        return 1.0
    part = 2.0 * pi / blades
    return corner_radius(blades) * cos(0.5 * part) / cos(angle % part - 0.5 * part)


def corner_radius(blades: int) -> float:
    """Return the distance of the aperture's corners: a polygon with the area of a disc of radius 1.

    >>> corner_radius(0), round(corner_radius(4), 3)
    (1.0, 1.253)
    """
    part = 2.0 * pi / blades if blades else 0.0
    return sqrt(part / sin(part)) if blades else 1.0
