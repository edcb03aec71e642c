"""Shadow methods that are measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from passgraph.effects.color.tone_map import tone_map
from passgraph.effects.shadows.five_pass import DARKEST, five_pass_targets
from passgraph.effects.shadows.shadow_choice import Blur, Evsm4, Hard, Msm, Pcf, Pcss, Penumbra, Vsm
from passgraph.effects.shadows.soft_shadow import SoftShadow, soft_shadow_passes
from passgraph.errors import InputError
from passgraph.graph.targets import Target, target
from passgraph.scene import Scene


@dataclass(frozen=True)
class Made:
    """The targets of one method.

    Attributes
    ----------
    picture : the whole frame, which is timed
    share : the visible share of the light is ``scale * red + offset``
    """

    picture: Target
    share: Target
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Method:
    """A method with its settings.

    Attributes
    ----------
    name : name on the command line and in tables
    series : name shared by methods that differ in one setting and are drawn as one line
    make : builds the graph of a scene with a shadow map of this many texels
    """

    name: str
    series: str
    make: Callable[[Scene, int], Made]


def passes_of(scene: Scene, map_size: int, **options: Any) -> SoftShadow:
    """Return a soft shadow without ambient light, so that the shadow mask is the share of the only light."""
    return soft_shadow_passes(scene, ambient=0.0, map_size=map_size, **options)


def _soft(name: str, series: str, **options: Any) -> Method:
    def make(scene: Scene, map_size: int) -> Made:
        passes = passes_of(scene, map_size, **options)
        if passes.shadows_blurred is None:
            raise InputError(f"bench scene {scene.name!r} has no shadows: {'; '.join(passes.notes)}")
        return Made(passes.picture, passes.shadows_blurred)

    return Method(name, series, make)


def _five_pass(scene: Scene, map_size: int) -> Made:
    targets = five_pass_targets(scene, map_size=map_size)
    return Made(targets.picture, targets.mask_blurred, 1.0 / (1.0 - DARKEST), -DARKEST / (1.0 - DARKEST))


#: The baseline of time ratios.
PLAIN = "hard"
METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        _soft(PLAIN, "hard", filter=Hard()),
        *(_soft(f"pcf-{n}", "PCF", filter=Pcf(n)) for n in (3, 5, 9, 15)),
        *(_soft(f"pcss-{n}", "PCSS", filter=Pcss(taps=n)) for n in (8, 16, 32, 64)),
        *(_soft(f"penumbra-{n}", "penumbra", filter=Penumbra(taps=n)) for n in (8, 16, 32)),
        _soft("vsm", "VSM", filter=Vsm()),
        _soft("evsm4", "EVSM4", filter=Evsm4()),
        _soft("msm", "MSM", filter=Msm()),
        _soft("blur-constant", "blur, constant", filter=Blur("constant")),
        _soft("blur-world", "blur, depth-aware", filter=Blur("world")),
        Method("five-pass", "five passes", _five_pass),
    )
}


def method_named(name: str) -> Method:
    """
    >>> method_named("pcss-32").series
    'PCSS'
    """
    if name not in METHODS:
        raise InputError(f"there is no shadow method {name!r}; there are {', '.join(METHODS)}")
    return METHODS[name]


def frame_without_shadows(scene: Scene, map_size: int) -> list[Target]:
    """Return a frame that draws the shadow map, the surfaces and the lit picture, without a shadow lookup."""
    passes = passes_of(scene, map_size, filter=Hard())
    picture = tone_map(passes.unshadowed, 0.0, "linear", into=target("picture", "rgba8"), name="picture")
    return [picture, *passes.shadow_maps]
