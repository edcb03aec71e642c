"""Effects: functions from targets (or a scene) to targets, in families.

Reading order: annotations, checked, quantities, parameters, effect_table: an effect is described by its signature and
docstring. On pictures: `color`, `filters`, `antialias`, `lens`, `style`, and their shared helpers in `pictures`. On
scenes: `surfaces`, whose passes other effects share; `shadows`; then `ambient`, `planar_shadows` and `light2d`. On an
engine's picture and depth: `screen`. Over several frames: `temporal`.

A new effect is a function under `effect` in a file of its own in one of these folders, or in another package that
registers it as an entry point of the group ``passgraph.effects``; the command line, conformance and the tests find it
there.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from passgraph.effects.ambient.ambient_occlusion import (
        AmbientOcclusion,
        Occlusion,
        ambient_occlusion,
        ambient_occlusion_passes,
        occlusion,
    )
    from passgraph.effects.ambient.contact import Contact, contact, contact_passes
    from passgraph.effects.antialias.fsr1 import fsr1
    from passgraph.effects.antialias.fxaa import fxaa
    from passgraph.effects.antialias.resize import resize
    from passgraph.effects.antialias.smaa import smaa
    from passgraph.effects.antialias.supersampled import supersampled
    from passgraph.effects.checked import effect
    from passgraph.effects.color.auto_exposure import auto_exposure
    from passgraph.effects.color.black_and_white import black_and_white
    from passgraph.effects.color.brightness_contrast import brightness_contrast
    from passgraph.effects.color.color_grade import color_grade
    from passgraph.effects.color.color_transform import color_transform
    from passgraph.effects.color.hue_saturation import hue_saturation
    from passgraph.effects.color.normalize import normalize
    from passgraph.effects.color.sepia import sepia
    from passgraph.effects.color.tone_map import tone_map
    from passgraph.effects.effect_table import EFFECTS
    from passgraph.effects.filters.bilateral import bilateral
    from passgraph.effects.filters.blur import depth_aware_blur, gaussian_blur
    from passgraph.effects.filters.cas import cas
    from passgraph.effects.filters.denoise import denoise
    from passgraph.effects.filters.distance_field import distance_field
    from passgraph.effects.filters.fill import fill
    from passgraph.effects.filters.median import median
    from passgraph.effects.filters.morphology import morphology
    from passgraph.effects.filters.radial_blur import radial_blur
    from passgraph.effects.filters.sobel import sobel
    from passgraph.effects.filters.tilt_shift import tilt_shift
    from passgraph.effects.filters.unsharp import unsharp
    from passgraph.effects.lens.bloom import bloom
    from passgraph.effects.lens.chromatic_aberration import chromatic_aberration
    from passgraph.effects.lens.film_grain import film_grain
    from passgraph.effects.lens.god_rays import god_rays
    from passgraph.effects.lens.lens_distortion import lens_distortion
    from passgraph.effects.lens.lens_flare import lens_flare
    from passgraph.effects.lens.light_streaks import light_streaks
    from passgraph.effects.lens.vignette import vignette
    from passgraph.effects.pictures.cryptomatte import cryptomatte
    from passgraph.effects.planar_shadows.planar import Planar, planar, planar_passes
    from passgraph.effects.screen.contact_shadow import contact_shadow
    from passgraph.effects.screen.depth_of_field import depth_of_field
    from passgraph.effects.screen.fog import fog
    from passgraph.effects.screen.occluded import occluded
    from passgraph.effects.screen.outlines import outlines
    from passgraph.effects.screen.shadowed import shadowed
    from passgraph.effects.screen.ssgi import ssgi
    from passgraph.effects.screen.ssr import ssr
    from passgraph.effects.shadows.five_pass import FivePass, five_pass, five_pass_targets
    from passgraph.effects.shadows.shadow_choice import (
        Auto,
        Blur,
        Disc,
        Evsm4,
        Hard,
        Msm,
        Pcf,
        Pcss,
        Penumbra,
        Vsm,
    )
    from passgraph.effects.shadows.soft_shadow import SoftShadow, soft_shadow, soft_shadow_passes
    from passgraph.effects.style.crt import crt
    from passgraph.effects.style.dither import dither
    from passgraph.effects.style.glitch import glitch
    from passgraph.effects.style.halftone import halftone
    from passgraph.effects.style.kuwahara import kuwahara
    from passgraph.effects.style.pixelate import pixelate
    from passgraph.effects.surfaces.g_buffer import SceneSurfaces, scene_surfaces
    from passgraph.effects.temporal.jitter import jitter_px, jittered
    from passgraph.effects.temporal.motion_blur import motion_blur
    from passgraph.effects.temporal.taa import taa
    from passgraph.effects.temporal.velocity import camera_velocity

#: Module → public names from it; effects whose module has no other public name need no row.
_MODULES = {
    "ambient.ambient_occlusion": ("AmbientOcclusion Occlusion ambient_occlusion ambient_occlusion_passes occlusion"),
    "ambient.contact": "Contact contact contact_passes",
    "checked": "effect",
    "filters.blur": "depth_aware_blur gaussian_blur",
    "antialias.supersampled": "supersampled",
    "pictures.cryptomatte": "cryptomatte",
    "planar_shadows.planar": "Planar planar planar_passes",
    "effect_table": "EFFECTS",
    "screen.shadowed": "shadowed",
    "shadows.five_pass": "FivePass five_pass five_pass_targets",
    "shadows.shadow_choice": "Auto Blur Disc Evsm4 Hard Msm Pcf Pcss Penumbra Vsm",
    "shadows.soft_shadow": "SoftShadow soft_shadow soft_shadow_passes",
    "surfaces.g_buffer": "SceneSurfaces scene_surfaces",
    "temporal.jitter": "jitter_px jittered",
    "temporal.velocity": "camera_velocity",
}
_HOME = {name: module for module, names in _MODULES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    """Import effects on first use: parsing all their kernels takes a quarter of a second."""
    if name in _HOME:
        found = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    else:
        from passgraph.effects.effect_table import function_named

        found = function_named(name)
        if found is None:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


__all__ = [
    "EFFECTS",
    "AmbientOcclusion",
    "Auto",
    "Blur",
    "Contact",
    "Disc",
    "Evsm4",
    "FivePass",
    "Hard",
    "Msm",
    "Occlusion",
    "Pcf",
    "Pcss",
    "Penumbra",
    "Planar",
    "SceneSurfaces",
    "SoftShadow",
    "Vsm",
    "ambient_occlusion",
    "ambient_occlusion_passes",
    "auto_exposure",
    "bilateral",
    "black_and_white",
    "bloom",
    "brightness_contrast",
    "camera_velocity",
    "cas",
    "chromatic_aberration",
    "color_grade",
    "color_transform",
    "contact",
    "contact_passes",
    "contact_shadow",
    "crt",
    "cryptomatte",
    "denoise",
    "depth_aware_blur",
    "depth_of_field",
    "distance_field",
    "dither",
    "effect",
    "fill",
    "film_grain",
    "five_pass",
    "five_pass_targets",
    "fog",
    "fsr1",
    "fxaa",
    "gaussian_blur",
    "glitch",
    "god_rays",
    "halftone",
    "hue_saturation",
    "jitter_px",
    "jittered",
    "kuwahara",
    "lens_distortion",
    "lens_flare",
    "light_streaks",
    "median",
    "morphology",
    "motion_blur",
    "normalize",
    "occluded",
    "occlusion",
    "outlines",
    "pixelate",
    "planar",
    "planar_passes",
    "radial_blur",
    "resize",
    "scene_surfaces",
    "sepia",
    "shadowed",
    "smaa",
    "sobel",
    "soft_shadow",
    "soft_shadow_passes",
    "ssgi",
    "ssr",
    "supersampled",
    "taa",
    "tilt_shift",
    "tone_map",
    "unsharp",
    "vignette",
]
