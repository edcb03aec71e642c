"""Effects: functions from targets (or a scene) to targets, one family a file.

Reading order: black_and_white, tone_map, blur, bloom; then soft shadows: geometry, views, batches, textures,
g_buffer, shadow_map, shadow_filters, shadow_light, lighting, shadow_blur, soft_shadow; then
five_pass_blur, five_pass; planar_matrices, planar_kernels, planar_draws, planar; contact; horizon_occlusion,
hemisphere_occlusion, occlusion_filter, ambient_occlusion; lens; light2d.
`passgraph.effects.registry` lists those that the command line has, with their parameters.
"""

from passgraph.effects.ambient_occlusion import (
    AmbientOcclusion,
    Occlusion,
    ambient_occlusion,
    ambient_occlusion_passes,
    occluded,
    occlusion,
)
from passgraph.effects.black_and_white import black_and_white
from passgraph.effects.bloom import bloom
from passgraph.effects.blur import depth_aware_blur, gaussian_blur
from passgraph.effects.contact import Contact, contact, contact_passes
from passgraph.effects.five_pass import FivePass, five_pass, five_pass_targets
from passgraph.effects.planar import Planar, planar, planar_passes
from passgraph.effects.registry import EFFECTS
from passgraph.effects.soft_shadow import SoftShadow, soft_shadow, soft_shadow_passes
from passgraph.effects.tone_map import tone_map

__all__ = [
    "EFFECTS",
    "AmbientOcclusion",
    "Contact",
    "FivePass",
    "Occlusion",
    "Planar",
    "SoftShadow",
    "ambient_occlusion",
    "ambient_occlusion_passes",
    "black_and_white",
    "bloom",
    "contact",
    "contact_passes",
    "depth_aware_blur",
    "five_pass",
    "five_pass_targets",
    "gaussian_blur",
    "occluded",
    "occlusion",
    "planar",
    "planar_passes",
    "soft_shadow",
    "soft_shadow_passes",
    "tone_map",
]
