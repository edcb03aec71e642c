"""Entries of the gallery for light on its way to the eye: beams, lenses, mirrors."""

from __future__ import annotations

import numpy as np

import passgraph as pg
from docs.gallery_inputs import colored_room, engine_pictures, monastery, photograph
from docs.gallery_looks import MOTORCYCLE, TABLE, street_light
from docs.gallery_page import Entry, Panel
from passgraph.effects import (
    god_rays,
    lens_flare,
    light_streaks,
    radial_blur,
    soft_shadow_passes,
    ssgi,
    ssr,
    tilt_shift,
    tone_map,
)
from passgraph.effects.surfaces.engine_depth import distances
from passgraph.truth import first_surfaces

FRAME = pg.Input("frame")
#: Panels of scenes are rendered at twice their size.
LARGE = (1272, 716)
#: A sky with a sun, where no surface is; the model is dark before it.
SKY = pg.kernel(
    source="""
def before_sky(color: Image, depth: Image, at: vec2) -> vec4:
    way = (uv() - at) * vec2(float(output_size().x) / float(output_size().y), 1.0)
    glow = vec3(1.5, 0.9, 0.4) * exp(-40.0 * dot(way, way)) + vec3(30.0) * (1.0 - smoothstep(0.02, 0.03, length(way)))
    return vec4(color[0, 0].rgb * 0.2 if depth[0, 0].r > 0.0 else vec3(0.04, 0.07, 0.16) + glow, 1.0)
"""
)


def backlit(sun: tuple[float, float]) -> tuple[pg.Target, pg.Target]:
    """The monastery before a sun at this place of the picture, and its depth."""
    camera = pg.Camera((84.0, 8.0, 84.0), (-9.0, 13.0, -6.0), vertical_fov_rad=0.42, near=1.0, far=260.0)
    seen = soft_shadow_passes(monastery().with_(camera=camera), display=False)
    frame: pg.Target = SKY(seen.picture, seen.depth, sun)
    return frame, seen.depth


def rays() -> list[Panel]:
    sun = (0.235, 0.27)
    frame, depth = backlit(sun)
    lit = god_rays(frame, *sun, 1.5, 0.3, decay=0.3, occluders=depth)
    return [
        Panel(label, tone_map(made, curve="aces"), size=LARGE)
        for label, made in (("without", frame), ("god rays", lit))
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


def mirrors() -> list[Panel]:
    seen = engine_pictures(LARGE)
    bare = first_surfaces(seen.scene.with_(nodes=seen.scene.nodes[:1]), LARGE).depth
    floor = np.where(np.isclose(seen.holds.depth(bare), seen.depth, rtol=1e-3), np.float32(bare > 0.0), np.float32(0.0))
    given, depth = {"frame": seen.color, "depth": seen.depth, "floor": floor}, distances(pg.Input("depth"), seen.holds)
    options = {"reflectance": 0.4, "reach": 2.0, "thickness": 0.06, "steps": 256, "camera": seen.scene.camera}
    panels = [Panel("without", tone_map(FRAME, curve="linear"), {"frame": seen.color})]
    for label, roughness in (("a polished floor", 0.0), ("roughness 0.1", 0.1), ("roughness 0.25", 0.25)):
        made = ssr(FRAME, depth, mask=pg.Input("floor"), roughness=roughness, **options)  # type: ignore[arg-type]
        panels.append(Panel(label, tone_map(made, curve="linear"), given))
    return panels


def bounces() -> list[Panel]:
    seen, ambient = (soft_shadow_passes(colored_room(), ambient=one, display=False) for one in (0.0, 0.2))
    camera = pg.Value("camera", pg.Camera)
    options = {"albedo": seen.base_color, "reach": 3.0, "steps": 64, "thickness": 0.3, "camera": camera}
    made = {
        "direct light": seen.picture,
        "direct and constant ambient light": ambient.picture,
        "ssgi": ssgi(seen.picture, seen.depth, **options),  # type: ignore[arg-type]
        "ssgi, the mean of 16 frames": ssgi(seen.picture, seen.depth, most_frames=16, **options),  # type: ignore[arg-type]
    }
    given = {"camera": colored_room().camera}
    return [Panel(label, tone_map(one, curve="aces"), given, LARGE, frames=15) for label, one in made.items()]


def flares() -> list[Panel]:
    frame, _ = backlit((0.42, 0.13))
    flare = lens_flare(frame, 2.0, 0.06, 6, 1.35, 2.0, 0.3)
    streaks = light_streaks(frame, 2.0, 0.25, 0.9, tint=(0.3, 0.5, 1.0))
    star = light_streaks(frame, 2.0, 0.25, 0.4, 6, 0.3)
    return [
        Panel(label, tone_map(made, curve="aces"), size=LARGE)
        for label, made in (
            ("without", frame),
            ("lens flare", flare),
            ("light streaks", streaks),
            ("a star filter", star),
        )
    ]


LIGHT: tuple[Entry, ...] = (
    Entry(
        "God rays", "`samurai_monastry.obj` of pybullet's data",
        "Beams between the roofs: at each pixel the mean of what 216 places on the way to the sun have of the sky.",
        rays, 2,
    ),
    Entry(
        "Lens flare and light streaks", "`samurai_monastry.obj` of pybullet's data",
        "Ghosts of the sun on the line through the middle, and its halo; streaks of an anamorphic lens and of a star "
        "filter.",
        flares, 2,
    ),
    Entry(
        "Screen-space reflections", TABLE,
        "The floor mirrors what the picture shows along reflected rays, most at grazing angles. What is hidden or "
        "outside is missing. A rough floor blurs reflections with their distance.",
        mirrors, 2,
    ),
    Entry(
        "Screen-space global illumination", "two boxes in a room, described in Python",
        "The walls color what is near them, where constant ambient light is gray. A mean over 4 by 4 pixels hides most "
        "of the noise of a frame, and one over frames the rest.",
        bounces, 2,
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
