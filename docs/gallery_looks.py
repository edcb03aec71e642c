"""Entries of the gallery for what cameras and displays do: edges, lenses, film, lines."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

import passgraph as pg
from docs.gallery_inputs import monastery, standing, street
from docs.gallery_page import Entry, Panel
from passgraph.effects import (
    bloom,
    chromatic_aberration,
    depth_of_field,
    film_grain,
    fog,
    fxaa,
    jittered,
    motion_blur,
    outlines,
    smaa,
    soft_shadow,
    soft_shadow_passes,
    supersampled,
    taa,
    tone_map,
    vignette,
)

FRAME = pg.Input("frame")
#: Of the table and the ducks, m; panels of edges are shown eight times as large.
DUCK, ENLARGED = 2.75, 0.125


def edges() -> list[Panel]:
    scene = standing()
    shown, seen, size = soft_shadow(scene), soft_shadow_passes(scene, display=False), (960, 540)
    sampled = {"camera": lambda number: jittered(scene.camera, number, size)}
    over_frames = tone_map(taa(seen.picture, seen.depth, camera=scene.camera), curve="linear")
    return [
        Panel("none", shown, size=size, middle=ENLARGED),
        Panel("fxaa", fxaa(shown), size=size, middle=ENLARGED),
        Panel("fxaa, quality 39", fxaa(shown, "39"), size=size, middle=ENLARGED),
        Panel("smaa", smaa(shown), size=size, middle=ENLARGED),
        Panel("four samples a pixel", supersampled(shown), size=(1920, 1080), middle=ENLARGED),
        Panel("taa, 16 frames", over_frames, sampled, size=size, middle=ENLARGED, frames=16),
    ]


def film() -> list[Panel]:
    light, bytes_ = {"frame": street_light()}, {"frame": street()}
    return [
        Panel("as it is", tone_map(FRAME, curve="linear"), light),
        Panel("vignette", tone_map(vignette(FRAME, 1.2), curve="linear"), light),
        Panel("chromatic aberration", tone_map(chromatic_aberration(FRAME, 0.015), curve="linear"), light),
        Panel("film grain", film_grain(FRAME, 0.07, size_px=1.5), bytes_),
    ]


def focus() -> list[Panel]:
    scene = standing()
    seen, lens = soft_shadow_passes(scene, display=False), 12.0 / math.tan(0.5 * scene.camera.vertical_fov_rad)

    def at(distance: float, f_number: float, **options: int) -> pg.Target:
        blurred = depth_of_field(seen.picture, seen.depth, distance, f_number, lens, unit_m=0.25, **options)
        return tone_map(blurred, curve="linear")

    return [
        Panel("all in focus", soft_shadow(scene)),
        Panel("the duck in front, f/1.4", at(DUCK, 1.4)),
        Panel("the table, f/1.4", at(3.4, 1.4)),
        Panel("the duck in front, f/5.6", at(DUCK, 5.6)),
    ]


def motion() -> list[Panel]:
    scene = standing()
    seen, now = soft_shadow_passes(scene, display=False), scene.camera
    aside = replace(now, eye=(1.2, 1.4, 2.8))
    near = replace(now, eye=(1.7, 1.71, 2.95))

    def since(before: pg.Camera) -> pg.Target:
        blurred = motion_blur(seen.picture, seen.depth, camera=now, previous_camera=before)
        return tone_map(blurred, curve="linear")

    return [Panel("aside", since(aside)), Panel("forward", since(near))]


def highlights() -> list[Panel]:
    y, x = np.mgrid[0:360, 0:640]
    lamps = np.zeros((360, 640, 4), np.float32)
    lamps[..., :3] = 0.02 + 0.03 * (y / 360.0)[..., None]
    for place in np.random.default_rng(2).uniform((20, 20), (620, 340), (60, 2)):
        spot = np.hypot(x - place[0], y - place[1]) < 1.6
        lamps[spot, :3] = np.random.default_rng(int(place[0])).uniform(5.0, 60.0, 3)
    lamps[..., 3] = 1.0
    given = {"frame": lamps, "depth": np.full((360, 640, 1), 30.0, np.float32)}

    def through(label: str, blades: int, **options: float) -> Panel:
        blurred = depth_of_field(FRAME, pg.Input("depth"), 2.0, 1.8, 85.0, blades=blades, taps=160, **options)  # type: ignore[arg-type]
        return Panel(label, tone_map(blurred, curve="reinhard"), given)

    return [
        through("round", 0),
        through("six blades", 6),
        through("six blades, turned", 6, rotation_rad=0.26),
        through("round, a rim that narrows corners", 0, cats_eye=0.8),
    ]


def lines() -> list[Panel]:
    def drawn(scene: pg.Scene, **options: float) -> pg.Target:
        seen, camera = soft_shadow_passes(scene), pg.Value("camera", pg.Camera, default=scene.camera)
        return fxaa(outlines(seen.picture, seen.depth, camera=camera, **options))  # type: ignore[arg-type]

    return [Panel("1 px", drawn(standing(), crease_rad=1.2)), Panel("2 px", drawn(monastery(), width_px=2, jump=0.004))]


def street_light() -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    from passgraph.srgb import srgb_to_linear

    return srgb_to_linear(street())


def finish() -> list[Panel]:
    scene = standing()
    seen, camera = soft_shadow_passes(scene, display=False), scene.camera
    lens = 12.0 / math.tan(0.5 * camera.vertical_fov_rad)
    air = fog(seen.picture, seen.depth, density=0.03, camera=camera, fog_color=(0.6, 0.5, 0.35))
    blurred = depth_of_field(air, seen.depth, DUCK, 2.0, lens, unit_m=0.25)
    light = vignette(bloom(blurred, threshold=0.6, intensity=0.4), camera.vertical_fov_rad, 4.0)
    return [
        Panel("as drawn", tone_map(seen.picture, curve="linear")),
        Panel("finished", film_grain(fxaa(tone_map(light, 0.2, "aces")), 0.02)),
    ]


MOTORCYCLE = "the left picture of the stereo pair `skimage.data.stereo_motorcycle()`"
TABLE = "`table/table.obj` and `duck.obj` of pybullet's data"

LOOKS: tuple[Entry, ...] = (
    Entry(
        "Smooth edges", TABLE,
        "The middle of each picture, enlarged. FXAA and SMAA smooth edges of the finished picture; four samples a "
        "pixel see more of the scene, at four times the work; TAA sees one sample of each pixel in each frame, and "
        "keeps those of the frames before.",
        edges, 2,
    ),
    Entry(
        "Lens and film", MOTORCYCLE,
        "Light that falls off toward the corners, colors magnified by their wavelength, and grain that is strongest "
        "between black and white.",
        film, 2,
    ),
    Entry(
        "Depth of field", TABLE,
        "A thin lens by its f-number, focal length and focus distance: what is near is blurred over what is sharp, and "
        "what is sharp does not bleed into what is behind it.",
        focus, 2,
    ),
    Entry(
        "Highlights out of focus", "lamps from a random generator",
        "Points become discs, or polygons of the aperture's blades; the front rim of a lens narrows them in corners.",
        highlights, 2,
    ),
    Entry(
        "Motion blur", TABLE,
        "A shutter that is open for half a frame, from one picture, its depth and two cameras.", motion, 2,
    ),
    Entry(
        "Outlines", f"{TABLE}; `samurai_monastry.obj`",
        "Silhouettes and creases from distance alone, smoothed by FXAA; floors have no lines at any angle.", lines, 2,
    ),
    Entry(
        "A finished picture", TABLE,
        "Fog, depth of field, vignette, bloom, tone map, FXAA and grain as one graph ([finishing](finishing.md)).",
        finish, 2,
    ),
)  # fmt: skip
