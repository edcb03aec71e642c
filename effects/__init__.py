"""Effects: functions from targets (or a scene) to targets, one family a file.

Reading order: black_and_white, tone_map, blur; then soft shadows: geometry, views, batches, textures,
g_buffer, shadow_map, shadow_light, lighting, shadow_blur, soft_shadow.  `passgraph.effects.registry` lists
them with their parameters.
"""

from passgraph.effects.black_and_white import black_and_white
from passgraph.effects.blur import depth_aware_blur, gaussian_blur
from passgraph.effects.registry import EFFECTS
from passgraph.effects.soft_shadow import SoftShadow, soft_shadow, soft_shadow_passes
from passgraph.effects.tone_map import tone_map

__all__ = [
    "EFFECTS",
    "SoftShadow",
    "black_and_white",
    "depth_aware_blur",
    "gaussian_blur",
    "soft_shadow",
    "soft_shadow_passes",
    "tone_map",
]
