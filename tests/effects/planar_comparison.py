"""Plain planar projection beside the contact penumbra: why a floor wants the second under feet and cloth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import passgraph as pg
from passgraph.effects.ambient.contact import contact_passes
from passgraph.effects.color.tone_map import tone_map
from passgraph.effects.planar_shadows.planar import SHADOW_OFFSET, darken, flatten, ground_of, projection
from passgraph.effects.shadows.shadow_light import multiply
from passgraph.effects.surfaces.batches import merged
from passgraph.effects.surfaces.views import View

#: Towards a light straight above.
ABOVE = np.array([0.0, 1.0, 0.0, 0.0])


@dataclass(frozen=True)
class PlanarComparison:
    """One scene with its soft shadows, darkened in two ways.

    Attributes
    ----------
    projected, contact : 8-bit sRGB pictures
    projected_share, contact_share : what each leaves of the floor's colour, on the screen; 1 elsewhere
    """

    projected: pg.Target
    contact: pg.Target
    projected_share: pg.Target
    contact_share: pg.Target


def planar_comparison(
    scene: pg.Scene,
    *,
    height: float = 0.0,
    threshold: float = 0.3,
    darkness: float = 0.7,
    map_size: int = 256,
    lift: float = 0.001,
) -> PlanarComparison:
    """All casters projected straight down onto a plane, and the contact penumbra of the same scene.

    Parameters
    ----------
    scene, height, threshold, darkness, map_size : see `passgraph.effects.ambient.contact.contact`
    lift : of the projected triangles over the plane, scene units

    Both look down from straight above; the first has no threshold and no filter.

    Source: as for `passgraph.effects.planar_shadows.planar.planar` and `passgraph.effects.ambient.contact.contact`.
    Deviation: each pixel is darkened once by a minimum in place of the stencil, for the share starts at 1.

    Examples
    --------
    >>> planar_comparison(pg.Scene.shipped()).projected.name
    'projected picture'
    """
    soft = contact_passes(scene, height=height, threshold=threshold, darkness=darkness, map_size=map_size)
    objects = ground_of(scene, height).objects
    casting = [node for node in objects.nodes if node.casts] if objects is not None else []
    origin = np.mean([node.bounds.mean(axis=0) for node in casting], axis=0)
    level = height - float(origin[1])
    view = View(pg.Value("camera", pg.Camera, default=scene.camera))
    flat = projection(ABOVE, level + lift)
    share = pg.draw(
        merged(casting, origin), vertex=flatten, fragment=darken,
        into=pg.target("projected share", "rgba16f", scale=1.0, clear=1.0), depth=soft.scene.base_color.depth,
        depth_compare="less_equal", depth_write=False, polygon_offset=SHADOW_OFFSET, blend="min",
        clip_from_local=view.clip_from(origin).map(lambda seen: seen @ flat), above_row=(0.0, 1.0, 0.0, -level),
        beyond_row=projection(ABOVE, level)[3], spot_from_local=np.eye(4), darkness=darkness,
        axis=(0.0, -1.0, 0.0), cone=(-3.0, -2.0), translucent=False,
    )  # fmt: skip
    lit = multiply(soft.scene.soft_shadow, share, into=pg.target("projected", "rgba16f"))
    picture = tone_map(lit, 0.0, "linear", into=pg.target("projected picture", "rgba8"), name="projected picture")
    return PlanarComparison(picture, soft.picture, share, soft.share)
