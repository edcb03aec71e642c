"""Planar reflection and shadows with a stencil buffer, and fog: eight steps in a fixed order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args

import passgraph as pg
from passgraph.effects.checked import checked, effect
from passgraph.effects.passes import picture_of
from passgraph.effects.pictures.tone_map import tone_map
from passgraph.effects.planar_shadows.planar_draws import Draws
from passgraph.effects.planar_shadows.planar_kernels import fogged
from passgraph.effects.planar_shadows.planar_matrices import LIGHTS_MOST, ground_of
from passgraph.effects.quantities import Color, Height, NotNegative, Share, Width
from passgraph.effects.surfaces.engine_depth import depth_frame

Fog = Literal["none", "linear", "exp", "exp2"]
FOGS: tuple[Fog, ...] = get_args(Fog)


@dataclass(frozen=True)
class Planar:
    """Every step's colour: the same target after each draw.

    Attributes
    ----------
    picture : what `planar` returns
    reflection : steps 1 and 2, the mirrored objects inside the plane's stencil
    objects : step 3 and 4, plane and objects without shadows
    shadowed : steps 5 and 6
    fogged : step 7; ``shadowed`` without fog
    """

    picture: pg.Target
    reflection: pg.Target
    objects: pg.Target
    shadowed: pg.Target
    fogged: pg.Target


@checked
def planar_passes(
    scene: pg.Scene,
    *,
    height: Height = 0.0,
    top: Color = (1.0, 1.0, 1.0),
    top_opacity: Share = 0.7,
    bottom: Color = (0.25, 0.2, 0.2),
    bottom_opacity: Share = 1.0,
    darkness: Share = 0.6,
    lift: Width = 0.001,
    ambient: NotNegative = 0.25,
    fog: Fog = "linear",
    fog_color: Color = (0.32, 0.42, 0.55),
    fog_start: Height = 10.0,
    fog_end: Height = 40.0,
    fog_density: Annotated[float, pg.Range(0, None, "per scene unit")] = 0.05,
    display: bool = True,
) -> Planar:
    """`planar` with every step; parameters as there."""
    if not fog_start < fog_end:
        raise pg.GraphError(f"planar: fog_start must be below fog_end, got {fog_start!r} and {fog_end!r}")
    if len(scene.lights) > LIGHTS_MOST:
        raise pg.GraphError(f"planar: {len(scene.lights)} lights; at most {LIGHTS_MOST} fit")
    ground = ground_of(scene, height)
    draws = Draws(scene, ground, ambient)
    side = draws.side
    into: Any = pg.target("planar", "rgba16f", scale=1.0, clear=(*fog_color, 1.0))
    marked = draws.plane(
        into, pg.target("planar depth", "depth32f_stencil8", scale=1.0), "1 stencil", (0.0,) * 4,
        stencil=pg.Stencil("always", 1, passed="replace"), color_mask=(False,) * 4, depth_write=False,
    )  # fmt: skip
    reflection = draws.objects(marked, "2 reflection", True)
    plane = draws.plane(
        reflection, reflection.depth, "3 plane",
        side.map(lambda up: (*top, top_opacity) if up > 0.0 else (*bottom, bottom_opacity)),
        blend="alpha", color_mask=(True, True, True, False),
    )  # fmt: skip
    objects = draws.objects(plane, "4 objects", False)
    shadowed = draws.shadows(objects, darkness, lift)
    result = shadowed
    if fog != "none":
        holds = draws.view.camera.map(lambda camera: depth_frame(camera.hardware_depth()))
        result = fogged(
            shadowed, shadowed.depth, holds, fog_color, (fog_start, fog_end, fog_density), FOGS.index(fog),
            into=pg.target("planar fog", "rgba16f"), name="7 fog",
        )  # fmt: skip
    picture = tone_map(result, 0.0, "linear", into=pg.target("picture", "rgba8"), name="picture") if display else result
    return Planar(picture, reflection, objects, shadowed, result)


@effect("planar", "scene")
@picture_of(planar_passes)
def planar() -> None:
    """A scene that is mirrored in, and throws shadows on, a plane parallel to XOZ, in fog.

    Parameters
    ----------
    scene : a flat node at ``height`` is the plane (with its base colour map); without one, a square is made
    height : of the plane, world y
    top : linear colour of the plane's upper face; a texture multiplies it
    top_opacity : what is left over shows the reflection
    bottom : linear colour of the plane's lower face; a texture multiplies it
    bottom_opacity : what is left over shows the reflection
    darkness : share of the colour that the shadow of each light takes, once a pixel
    lift : of the shadows over the plane; with 0 they speckle. Beside it they have a polygon offset; with 0 they
        have neither: here to be seen
    ambient : scene-linear light from all around
    fog : OpenGL's fog modes
    fog_color : scene-linear; also where there is no surface
    fog_start : of linear fog, along the view axis
    fog_end : of linear fog, beyond ``fog_start``
    fog_density : of the exponential ones
    display : return an 8-bit sRGB picture; off, the scene-linear HDR target

    Returns
    -------
    The target "picture", or the scene-linear one with ``display=False``.  A run takes ``camera=``, and
    ``light=`` (with several lights ``light0=``, ``light1=`` …, four at most).

    Source: J. Blinn, "Me and My (Fake) Shadow", 1988; M. Woo et al., "OpenGL Programming Guide" (the red
    book), 3rd edition, chapter 14, shadows and reflections; OpenGL 2.1, section 3.10 (fog).  Deviations: a
    bit of the stencil for each light, so that the shadows of two lights add up and those of two objects do
    not; the reflection's fog is that of the plane it is seen in; a spot's shadows end with its cone; the
    shadow of a translucent object lets its colour through, and where several overlap one of them counts.

    Examples
    --------
    >>> with pg.compile(planar(pg.Scene.shipped()), backend="null", size=(32, 18)) as program:
    ...     program.plan.steps[0].name
    '1 stencil'
    """
