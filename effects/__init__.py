"""Effects: functions from targets (or a scene) to targets, one family a file.

Reading order: annotations, checked, quantities, parameters, registry: how a signature is all that is said of an
effect; black_and_white, tone_map, blur, bloom; then soft shadows: geometry, views, batches, textures,
g_buffer, shadow_map, shadow_filters, shadow_choice, shadow_lookup, shadow_light, lighting, shadow_blur, soft_shadow;
then five_pass_blur, five_pass; planar_matrices, planar_kernels, planar_draws, planar; contact; horizon_occlusion,
hemisphere_occlusion, occlusion_filter, ambient_occlusion; stretched, lens; light2d.

A new effect is a function under `effect` in a file of its own here, or in another package that names it as an entry
point of the group ``passgraph.effects``; the command line, conformance and the tests find it by that.
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
    from passgraph.effects.checked import effect
    from passgraph.effects.contact import Contact, contact, contact_passes
    from passgraph.effects.five_pass import FivePass, five_pass, five_pass_targets
    from passgraph.effects.planar import Planar, planar, planar_passes
    from passgraph.effects.registry import EFFECTS
    from passgraph.effects.shadow_choice import (
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
    from passgraph.effects.soft_shadow import SoftShadow, soft_shadow, soft_shadow_passes
    from passgraph.effects.tone_map import tone_map

#: Module → what this package has of it; an effect with the name of its module needs no row.
_MODULES = {
    "ambient_occlusion": "AmbientOcclusion Occlusion ambient_occlusion ambient_occlusion_passes occluded occlusion",
    "black_and_white": "black_and_white",
    "bloom": "bloom",
    "blur": "depth_aware_blur gaussian_blur",
    "checked": "effect",
    "contact": "Contact contact contact_passes",
    "five_pass": "FivePass five_pass five_pass_targets",
    "planar": "Planar planar planar_passes",
    "registry": "EFFECTS",
    "shadow_choice": "Auto Blur Disc Evsm4 Hard Msm Pcf Pcss Penumbra Vsm",
    "soft_shadow": "SoftShadow soft_shadow soft_shadow_passes",
    "tone_map": "tone_map",
}
_HOME = {name: module for module, names in _MODULES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    """Effects are loaded when first used: parsing the kernels of all of them takes a quarter of a second."""
    home = f"{__name__}.{_HOME.get(name, name)}"
    try:
        module = import_module(home)
    except ModuleNotFoundError as error:
        if error.name != home:
            raise
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None
    found = globals()[name] = getattr(module, name) if name in _HOME or _is_effect(module, name) else module
    return found


def _is_effect(module: ModuleType, name: str) -> bool:
    """Whether a module has an effect of this name."""
    return hasattr(getattr(module, name, None), "effect")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})


class _Package(ModuleType):
    """Most effects are named as their module, which Python sets here once it is loaded: the effect goes first."""

    def __setattr__(self, name: str, value: object) -> None:
        shown = isinstance(value, ModuleType) and _is_effect(value, name)
        super().__setattr__(name, getattr(value, name) if shown else value)


sys.modules[__name__].__class__ = _Package

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
    "SoftShadow",
    "Vsm",
    "ambient_occlusion",
    "ambient_occlusion_passes",
    "black_and_white",
    "bloom",
    "contact",
    "contact_passes",
    "depth_aware_blur",
    "effect",
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
