"""Soft shadows of meshes on an engine's picture, given its depth."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph import arguments
from passgraph.effects.checked import checked
from passgraph.effects.parameters import Called
from passgraph.effects.quantities import Color, MapSize, NotNegative, Width
from passgraph.effects.shadows.lighting import Lighting
from passgraph.effects.shadows.shadow_choice import Auto, ShadowFilter
from passgraph.effects.shadows.shadow_light import share_of
from passgraph.effects.shadows.soft_shadow import blurred_shadows, decided, lights_of, width_of_edges
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.effects.surfaces.g_buffer import GBuffer
from passgraph.effects.surfaces.views import Casters, View
from passgraph.language import Image, vec3, vec4


@pg.kernel
def shares(free: Image, shadowed: Image, depth: Image) -> vec4:
    """Return the share of light that arrives, for each channel; 1 without a surface."""
    light = free[0, 0].rgb
    dim = shadowed[0, 0].rgb
    share = vec3(share_of(dim.r, light.r), share_of(dim.g, light.g), share_of(dim.b, light.b))
    return vec4(share if depth[0, 0].r > 0.0 else vec3(1.0), 1.0)


@pg.kernel
def take_shares(color: Image, shares: Image) -> vec4:
    """Multiply each channel of a picture by the remaining fraction of light."""
    here = color[0, 0]
    return vec4(here.rgb * shares[0, 0].rgb, here.a)


@checked
def shadowed(
    color: pg.Target,
    depth: pg.Target,
    casters: pg.Scene,
    *,
    softness: Width | pg.Value | None = None,
    filter: Annotated[ShadowFilter | None, Called("shadow_filter")] = None,
    map_size: MapSize = 1024,
    ambient: NotNegative | Color = 0.25,
    camera: pg.Camera | pg.Value | None = None,
    into: pg.TargetSpec | None = None,
    name: str = "shadowed",
) -> pg.Target:
    """Add soft shadows of meshes to an engine's picture, whose surfaces are known by depth only.

    Parameters
    ----------
    color : the picture, linear light, with surfaces lit by the same lights without shadows
    depth : red is the distance along the view axis in scene units, 0 where there is no surface; of the size of
        ``color``. `passgraph.effects.surfaces.engine_depth.distances` computes it from an engine's depth buffer
    casters : meshes that cast shadows, in the engine's world space, and the lights; receivers need not be among them
    softness, filter, map_size : see `passgraph.effects.shadows.soft_shadow.soft_shadow`
    ambient : scene-linear ambient light (or its red, green, blue) in the picture, in addition to the lights, on a white
        surface; shadows do not affect it
    camera : the camera of both, from `passgraph.Camera.from_matrices` for an engine's; a run may set another. Default:
        that of ``casters``
    into : destination target; default: float32 named ``name``
    name : name of the last pass and target

    Normals are computed from the depth.  Maps contain all casters, as the visible receivers are unknown in advance.

    Returns
    -------
    A run takes ``camera=`` and ``light=`` (with several lights ``light0=``, ``light1=`` …).

    Raises
    ------
    GraphError
        If there are no casters or no lights.

    Examples
    --------
    >>> scene = pg.Scene.shipped()
    >>> frame, depth = pg.Input("frame", "rgba16f", (32, 18)), pg.Input("depth", "r32f", (32, 18))
    >>> with pg.compile(shadowed(frame, depth, scene, map_size=64), backend="null") as program:
    ...     [step.name for step in program.plan.steps][-2:]
    ['penumbrae of light', 'shadowed']
    """
    arguments.instance(casters, pg.Scene, "shadowed: casters", "a pg.Scene", pg.GraphError)
    nodes = tuple(node for node in casters.nodes if node.casts and node.material.alpha_mode != "blend")
    if not nodes or not casters.lights:
        what = "light" if nodes else "mesh that casts a shadow"
        raise pg.GraphError(f"shadowed: casters: scene {casters.name!r} has no {what}; give it one")
    view = View(
        camera if isinstance(camera, pg.Value) else pg.Value("camera", pg.Camera, default=camera or casters.camera)
    )
    chosen = decided(Auto() if filter is None else filter, casters, softness)
    # a floor below all other casters shadows the engine's geometry under it
    thrown = Casters(nodes, casters.bounds())
    lights, notes = lights_of(casters), list[str]()
    seen = GBuffer(color, depth_normals(depth, view.camera, f"{name} normals"), depth)
    width = width_of_edges(softness, lights, thrown)
    lighting = Lighting(
        casters, view, seen, lights, thrown, map_size, 0, notes, chosen, False, width
    )  # fmt: skip
    sums = lighting.sums((ambient, ambient, ambient) if isinstance(ambient, (int, float)) else ambient)
    share = shares(*sums, depth, into=pg.target(f"{name} shares", "rgba16f", like=depth), name="shares of light")
    blurred = blurred_shadows(share, seen, view, chosen, width, notes)
    result: pg.Target = take_shares(color, blurred, into=into or pg.target(name, "rgba32f"), name=name)
    return result
