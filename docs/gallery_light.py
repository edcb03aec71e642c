"""Entries of the gallery for light on its way to the eye: beams, lenses, mirrors."""

from __future__ import annotations

import passgraph as pg
from docs.gallery_inputs import monastery, photograph
from docs.gallery_looks import MOTORCYCLE, street_light
from docs.gallery_page import Entry, Panel
from passgraph.effects import god_rays, radial_blur, soft_shadow_passes, tilt_shift, tone_map

FRAME = pg.Input("frame")
#: A sky with a sun, where no surface is; the model is dark before it.
SKY = pg.kernel(
    source="""
def before_sky(color: Image, depth: Image, at: vec2) -> vec4:
    way = (uv() - at) * vec2(float(output_size().x) / float(output_size().y), 1.0)
    glow = vec3(1.5, 0.9, 0.4) * exp(-40.0 * dot(way, way)) + vec3(30.0) * (1.0 - smoothstep(0.02, 0.03, length(way)))
    return vec4(color[0, 0].rgb * 0.2 if depth[0, 0].r > 0.0 else vec3(0.04, 0.07, 0.16) + glow, 1.0)
"""
)


def rays() -> list[Panel]:
    camera = pg.Camera((84.0, 8.0, 84.0), (-9.0, 13.0, -6.0), vertical_fov_rad=0.42, near=1.0, far=260.0)
    seen, sun = soft_shadow_passes(monastery().with_(camera=camera), display=False), (0.235, 0.27)
    frame: pg.Target = SKY(seen.picture, seen.depth, sun)
    size = (1272, 716)
    lit = god_rays(frame, *sun, 1.5, 0.3, decay=0.3, occluders=seen.depth)
    return [
        Panel("without", tone_map(frame, curve="aces"), size=size),
        Panel("god rays", tone_map(lit, curve="aces"), size=size),
    ]


def models() -> list[Panel]:
    given = {"frame": photograph("rocket", 1.0)[80:]}
    tilted = tilt_shift(FRAME, 0.85, 0.0, 0.1, 7.0)
    return [
        Panel("without", tone_map(FRAME, curve="linear"), given),
        Panel("tilt-shift", tone_map(tilted, curve="linear"), given),
    ]


def exposures() -> list[Panel]:
    given = {"frame": street_light()}
    return [
        Panel("zoom", tone_map(radial_blur(FRAME, 0.3, x=0.62, y=0.5), curve="linear"), given),
        Panel("spin", tone_map(radial_blur(FRAME, 0.0, 0.3, 0.62, 0.5), curve="linear"), given),
    ]


LIGHT: tuple[Entry, ...] = (
    Entry(
        "God rays", "`samurai_monastry.obj` of pybullet's data",
        "Beams between the roofs: at each pixel the mean of what 216 places on the way to the sun have of the sky.",
        rays, 2,
    ),
    Entry(
        "Radial blur", MOTORCYCLE, "A camera that zooms, and one that rolls, while its shutter is open.", exposures, 2
    ),
    Entry(
        "Tilt-shift", "`skimage.data.rocket()`",
        "Sharp along a band, and the more blurred the farther from it, so that what is large looks like a model.",
        models, 2,
    ),
)  # fmt: skip
