"""Types of parameters that effects share, each with its range and unit."""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from math import cos, sin, tan
from typing import Annotated, Any

from passgraph.graph.run_values import Derived, Value, combine
from passgraph.ranges import Range

#: Brightness before a curve: factor 2 per stop.
Exposure = Annotated[float, Range(-16, 16, "stops")]
#: Scene-linear light, factors and the like.
NotNegative = Annotated[float, Range(0)]
#: A fraction of a whole.
Share = Annotated[float, Range(0, 1)]
#: Scene-linear red, green and blue.
Color = Annotated[tuple[float, float, float], Range(0)]
#: A position in the picture, as a fraction of its width or height; 0 to 1 is inside.
Place = Annotated[float, Range(-8, 9)]
#: A position or a height in a scene or world.
Height = Annotated[float, Range(None, None, "scene units")]
#: A length, a distance or a width that may be 0.
Width = Annotated[float, Range(0, None, "scene units")]
#: A length above 0.
Reach = Annotated[float, Range(0, None, "scene units", above=True)]
#: The full vertical angle of view, for pictures without a known camera.
FieldOfView = Annotated[float, Range(0, 3.13, "rad", above=True)]
#: Texels along each side of a shadow map.
MapSize = Annotated[int, Range(16, 8192, "texels")]


def mapped(value: Any, function: Callable[[Any], object]) -> Any:
    """Return ``function(value)``; for a run value, a value computed at each run.

    >>> import passgraph as pg
    >>> mapped(0.0, axis_of), mapped(pg.Value("angle"), axis_of).name
    ((1.0, 0.0), 'angle')
    """
    return value.map(function) if isinstance(value, (Value, Derived)) else function(value)


def combined(function: Callable[..., object], *given: Any) -> Any:
    """Return a function of numbers and of run values; with any of these, it is computed at each run.

    >>> import passgraph as pg
    >>> combined(max, 1.0, 2.0), combined(max, pg.Value("a"), 2.0, pg.Value("b").map(abs)).name
    (2.0, 'a+b')
    """
    sources = [source for one in given if isinstance(one, (Value, Derived)) for source in one.sources]
    if not sources:
        return function(*given)

    def computed(*values: object) -> object:
        rest = iter(values)

        def now(one: Any) -> object:
            if isinstance(one, Derived):
                return one.function(*islice(rest, len(one.sources)))
            return next(rest) if isinstance(one, Value) else one

        return function(*map(now, given))

    return combine(computed, *sources)


def axis_of(angle_rad: float) -> tuple[float, float]:
    """Return cosine and sine."""
    return cos(angle_rad), sin(angle_rad)


def tan_half(angle_rad: float) -> float:
    """Return the tangent of half an angle of view: half the picture's height at distance one."""
    return tan(0.5 * angle_rad)
