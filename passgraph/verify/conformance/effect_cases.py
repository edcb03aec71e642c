"""Effects of the table on a small scene, picture or 2D world, with parameters that select other code paths."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from importlib.util import find_spec
from typing import Any

import passgraph as pg
from passgraph.effects.effect_table import EFFECTS, Effect
from passgraph.graph.targets import named_outputs
from passgraph.verify.compare import MOST_AMBIGUOUS
from passgraph.verify.conformance import case_inputs
from passgraph.verify.conformance.case import Case

GROUP = "effects"
MAPS = {"map_size": 32}

#: Config of OpenColorIO 2.2 and newer.
COLOR_CONFIG = "ocio://cg-config-v1.0.0_aces-v1.3_ocio-v2.1"
#: Effects that need an optional package; left out if it is not installed.
NEEDS = {"color-transform": "PyOpenColorIO"}

#: Camera of the previous frame; that of the current frame is at the origin.
BEFORE = pg.Camera((1.0, 0.5, -1.0), (0.0, 0.0, -1.0))

#: Effect → variants: the parameters of each, and ``light``, which selects the scene's light.
VARIANTS: dict[str, list[dict[str, Any]]] = {
    "tone-map": [{"curve": curve} for curve in ("linear", "reinhard", "hable", "aces", "agx", "pbr-neutral")],
    "color-transform": [{"display": "sRGB - Display", "view": "Un-tone-mapped", "config": COLOR_CONFIG}],
    "gaussian-blur": [{}, {"sigma_px": 1.0, "radius_px": 2}],
    "bloom": [{"levels": 2}, {"levels": 4, "threshold": 0.5}],
    "fsr1": [{"scale": 1.5}],
    "fxaa": [{}, {"quality": "39", "contrast": 0.05, "least_contrast": 0.02}],
    "film-grain": [{}, {"size_px": 1.5, "colored": True, "seed": 3}],
    "god-rays": [{"threshold": 0.3}],
    "color-grade": [
        {"temperature_k": 4000.0, "contrast": 1.2, "shadows": (0.8, 1.0, 1.2), "lift": (0.02, 0.0, -0.02),
         "gamma": (1.2, 1.0, 0.9), "saturation": 0.8},
    ],
    "denoise": [{"search_radius_px": 1}],
    "resize": [{"filter": "mitchell"}, {"scale": 1.5}, {"filter": "box", "scale": 0.3}],
    "smaa": [{"steps": 4, "diagonal_steps": 3}, {"steps": 4, "diagonal_steps": 0, "linear": True}],
    "tilt-shift": [{"sigma_px": 2.0}, {"sigma_px": 1.0, "angle_rad": 0.5, "y": 0.2}],
    "sobel": [{}, {"weights": "scharr"}],
    "morphology": [{}, {"operation": "open", "radius_px": 2}],
    "kuwahara": [{"radius_px": 2}],
    "lens-distortion": [{}, {"k1": 0.2, "undo": True}],
    "glitch": [{"shift_px": 4, "band_px": 2, "block_px": 8}],
    "lens-flare": [{"threshold": 0.3, "ghosts": 2}],
    "light-streaks": [{"threshold": 0.3, "length": 0.1, "angle_rad": 0.5}],
    "ssgi": [
        {"steps": 4, "rays": 1},
        {"steps": 4, "rays": 1, "denoise": False, "most_frames": 4, "previous_camera": BEFORE},
    ],
    "ssr": [{"steps": 8}, {"steps": 4, "roughness": 0.4, "rays": 2}],
    "crt": [{"pixel_px": 2}, {"pixel_px": 3, "mask": "tv", "curve": 0.0}],
    "radial-blur": [{"spin_rad": 0.1}],
    "fill": [{"levels": 3}],
    "distance-field": [{"signed": True, "reach_px": 15}],
    "dither": [{}, {"pattern": "gradient-noise"}, {"pattern": "blue-noise"}],
    "halftone": [{}, {"colored": False}],
    "brightness-contrast": [{"brightness": 1.2, "contrast": 1.5}],
    "hue-saturation": [{"hue_rad": 1.0, "saturation": 1.5}],
    "depth-of-field": [
        {"focus_distance": 3.0, "f_number": 1.0, "focal_length_mm": 200.0, "taps": 8, "widest_px": 8, **shape}
        for shape in ({}, {"blades": 5, "rotation_rad": 0.5, "cats_eye": 0.8})
    ],
    "motion-blur": [{"previous_camera": BEFORE, "taps": 4, "longest_px": 8}],
    "outlines": [{}, {"width_px": 2, "crease_rad": 0.2}],
    "soft-shadow": [
        *({**MAPS, "shadow_filter": name, "taps": 8, "radius_px": 3}
          for name in ("blur", "hard", "pcf", "disc", "pcss", "vsm", "evsm4", "msm")),
        {**MAPS, "radius_px": 3, "light": "spot"},
        {**MAPS, "radius_px": 3, "light": "point"},
        {**MAPS, "radius_px": 3, "light": "two", "blur": "constant", "hdr_format": "rgb32f"},
        {**MAPS, "shadow_filter": "msm", "moment_format": "rgba16", "light": "spot"},
    ],
    "five-pass": [
        {**MAPS, "light": "spot"},
        {**MAPS, "light": "spot", "kernel": "faithful", "weights": "kernel", "mask_format": "r8"},
    ],
    "planar": [{"fog": fog} for fog in ("none", "linear", "exp2")],
    "contact": [MAPS],
    "ambient-occlusion": [
        {"method": "gtao", "slices": 1, "steps": 2, "radius": 0.6},
        {"method": "gtao", "slices": 1, "steps": 2, "radius": 0.6, "half_resolution": True, "bounces": True},
        {"method": "ssao", "taps": 4, "radius": 0.6},
    ],
    "occluded": [
        {"slices": 1, "steps": 2, **more}
        for more in ({}, {"half_resolution": True}, {"most_frames": 4, "previous_camera": BEFORE})
    ],
    "contact-shadow": [{"steps": 4}, {"steps": 2, "denoised": False}],
    "fog": [{}, {"falloff": 0.3, "start": 1.0, "sky": True}],
    "light2d": [{"penumbra": name, "draws": 2} for name in ("mixed", "none", "rotate", "move", "exact")],
}  # fmt: skip


#: Effects with only their first variant in a short run: the oracle tries every outcome of their taps.
SLOW = ("ambient-occlusion", "occluded", "light2d", "five-pass")
#: The exact penumbra compares tangents with one selected from them; bounds do not know that both are the same number.
#: All values are undecided where an edge hides part of the lamp: this share of the pixels.
IN_SHADOW = 0.223
#: Smallest shares of values with narrow bounds, where they are below 0.9.
LEAST_TOLD = {
    # Where one surface fills the filter (the lit floor), the variance of the moments is a difference of equal numbers,
    # and a quotient by it may be anything: half of the picture.
    "msm": 0.5,
    # A mask with smears as fine as its texels; a driver may move corners by 1/256 pixel, which shifts them.
    "dirty-lens": 0.8,
    "exact": 1.0 - IN_SHADOW,
}
#: The same by target. A triangle's slope from pixel to pixel is a difference of nearly equal distances; its bounds are
#: as wide as theirs, and widest where a driver may move corners.
TOLD_LESS = {"rises": 0.2}
#: Largest shares of ambiguous pixels, where they are above the default limit.
AMBIGUOUS = {"exact": IN_SHADOW}


def cases() -> Iterator[Case]:
    """Yield each variant of each effect; effects without variants in :data:`VARIANTS` use their defaults."""
    for effect in EFFECTS.values():
        if effect.name in NEEDS and find_spec(NEEDS[effect.name]) is None:
            continue
        for number, parameters in enumerate(VARIANTS.get(effect.name, [{}])):
            quick = number == 0 or effect.name not in SLOW
            given = " ".join(f"{name}={value}" for name, value in parameters.items() if value is not BEFORE)
            frame = {}
            if effect.takes.startswith("picture"):
                frame["frame"] = case_inputs.picture()
            if effect.takes == "picture+depth":
                frame["depth"] = case_inputs.depth()
            name = f"{effect.name} {given}".strip()
            kind = parameters.get("shadow_filter", parameters.get("penumbra", effect.name))
            yield Case(
                GROUP, name, partial(_graph, effect, parameters), case_inputs.SIZE, (frame,),
                most_ambiguous=AMBIGUOUS.get(kind, MOST_AMBIGUOUS), least_told=LEAST_TOLD.get(kind, 0.9),
                told_less=TOLD_LESS, quick=quick,
            )  # fmt: skip


def _graph(effect: Effect, parameters: Mapping[str, Any]) -> Mapping[str, pg.Target]:
    given = {name: value for name, value in parameters.items() if name != "light"}
    arguments: list[Any] = [pg.Input("frame")]
    if effect.takes == "picture+depth":
        arguments.append(pg.Input("depth"))
    elif effect.takes == "scene":
        arguments = [case_inputs.scene(parameters.get("light", "sun"))]
    elif effect.takes == "world2d":
        arguments = [case_inputs.world(), case_inputs.SIZE]
    return named_outputs(effect.build(*arguments, **given))
