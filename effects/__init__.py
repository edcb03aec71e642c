"""Effects: functions from targets (or a scene) to targets, one family a file.

Reading order: black_and_white, tone_map, blur, bloom; then soft shadows: geometry, views, batches, textures,
g_buffer, shadow_map, shadow_filters, shadow_light, lighting, shadow_blur, soft_shadow; then
five_pass_blur, five_pass; planar_matrices, planar_kernels, planar_draws, planar; contact; horizon_occlusion,
hemisphere_occlusion, occlusion_filter, ambient_occlusion; lens; light2d.
`passgraph.effects.registry` lists those that the command line has, with their parameters; `passgraph.effects.checked`
holds arguments against it and against annotations.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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

#: Module → what this package has of it.
_MODULES = {
    "ambient_occlusion": "AmbientOcclusion Occlusion ambient_occlusion ambient_occlusion_passes occluded occlusion",
    "black_and_white": "black_and_white",
    "bloom": "bloom",
    "blur": "depth_aware_blur gaussian_blur",
    "contact": "Contact contact contact_passes",
    "five_pass": "FivePass five_pass five_pass_targets",
    "planar": "Planar planar planar_passes",
    "registry": "EFFECTS",
    "soft_shadow": "SoftShadow soft_shadow soft_shadow_passes",
    "tone_map": "tone_map",
}
_HOME = {name: module for module, names in _MODULES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    """Effects are loaded when first used: parsing the kernels of all of them takes a quarter of a second."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})


class _Package(ModuleType):
    """Most effects are named as their module, which Python sets here once it is loaded: the effect goes first."""

    def __setattr__(self, name: str, value: object) -> None:
        effect = isinstance(value, ModuleType) and _HOME.get(name) == name
        super().__setattr__(name, getattr(value, name) if effect else value)


sys.modules[__name__].__class__ = _Package

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
