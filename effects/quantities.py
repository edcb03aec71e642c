"""Kinds of parameters that effects share, each with its range and unit."""

from __future__ import annotations

from typing import Annotated

import passgraph as pg

#: Brightness before a curve: factor 2 a stop.
Exposure = Annotated[float, pg.Range(-16, 16, "stops")]
#: Scene-linear light, factors and the like.
NotNegative = Annotated[float, pg.Range(0)]
#: A share of a whole.
Share = Annotated[float, pg.Range(0, 1)]
#: Scene-linear red, green and blue.
Color = Annotated[tuple[float, float, float], pg.Range(0)]
#: A place or a height in a scene or world.
Height = Annotated[float, pg.Range(None, None, "scene units")]
#: A length, a distance or a width that may be nothing.
Width = Annotated[float, pg.Range(0, None, "scene units")]
#: One that has to be something.
Reach = Annotated[float, pg.Range(0, None, "scene units", above=True)]
#: The full vertical angle of view, of pictures whose camera is not known.
FieldOfView = Annotated[float, pg.Range(0, 3.13, "rad", above=True)]
#: Texels along each side of a shadow map.
MapSize = Annotated[int, pg.Range(16, 8192, "texels")]
