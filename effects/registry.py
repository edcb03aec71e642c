"""One table of every effect and its parameters: what the command line, the documentation and tests read.

Importing it loads no effect; :attr:`Effect.function` does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

ParameterType = Literal["float", "int", "bool", "choice", "rgb"]
#: What an effect is applied to: one picture; a mask and a linear depth picture; a scene.
Takes = Literal["picture", "picture+depth", "scene"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One keyword argument of an effect.

    Attributes
    ----------
    name : the keyword
    type : "float", "int", "bool", "choice" or "rgb" (three floats)
    default : what the effect takes where nothing is given; None means that the effect chooses, see ``help``
    low, high : inclusive range of numbers (of each of the three for "rgb"); None where there is no limit
    unit : such as "px" or "stops"; empty for pure numbers
    help : one line
    choices : the names that "choice" allows
    """

    name: str
    type: ParameterType
    default: object
    low: float | None = None
    high: float | None = None
    unit: str = ""
    help: str = ""
    choices: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Effect:
    """One effect by its command-line name.

    Attributes
    ----------
    name : such as "tone-map"
    path : module and function, ``"passgraph.effects.tone_map:tone_map"``
    takes : what its positional arguments are, see `Takes`
    parameters : its keyword arguments
    summary : one line
    """

    name: str
    path: str
    takes: Takes
    parameters: tuple[Parameter, ...]
    summary: str

    @property
    def function(self) -> Callable[..., Any]:
        """The function from targets (or a scene) to a target."""
        module, _, name = self.path.partition(":")
        found: Callable[..., Any] = getattr(import_module(module), name)
        return found

    def parameter(self, name: str) -> Parameter:
        """One parameter by name; KeyError names what there is."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        known = ", ".join(p.name for p in self.parameters) or "none"
        raise KeyError(f"effect {self.name!r} has no parameter {name!r}; it has {known}")


_WEIGHTS = Parameter(
    "weights", "rgb", (0.2126, 0.7152, 0.0722), 0.0, 1.0, "", "share of red, green and blue (Rec. 709)"
)
_EXPOSURE = Parameter(
    "exposure_stops", "float", 0.0, -16.0, 16.0, "stops", "brightness before the curve: factor 2 a stop"
)
_CURVES = ("linear", "reinhard", "hable", "aces")
_CURVE = Parameter("curve", "choice", "aces", help="how high values are compressed", choices=_CURVES)
_SRGB = Parameter("encode", "bool", True, help="encode as sRGB for display and 8-bit files")

_SOFT_SHADOW = (
    Parameter(
        "softness",
        "float",
        None,
        0.0,
        None,
        "scene units",
        "half width of shadow edges; left out: from the lights' radius; 0: hard",
    ),
    Parameter(
        "shadow_filter",
        "choice",
        "blur",
        help="blur on the screen, or filter where the map is compared",
        choices=("blur", "hard", "pcf", "disc", "pcss"),
    ),
    Parameter("pcf_size", "int", 5, 1, 15, "texels", "texels along each side with shadow_filter=pcf, odd"),
    Parameter("taps", "int", 32, 1, 128, "", "comparisons with shadow_filter=disc, and of each step of pcss"),
    Parameter(
        "blur",
        "choice",
        "world",
        help="width in scene units, or in pixels as in plain blurs",
        choices=("world", "constant"),
    ),
    Parameter("radius_px", "int", 7, 1, 31, "px", "taps to each side; the width itself with blur=constant"),
    Parameter("map_size", "int", 1024, 16, 8192, "texels", "width and height of each shadow map"),
    Parameter("map_blur_px", "int", 0, 0, 31, "texels", "blurs the shadow maps instead, which softens nothing"),
    Parameter("ambient", "float", 0.25, 0.0, None, "", "light that no shadow takes away, scene-linear"),
    Parameter("background", "rgb", (0.32, 0.42, 0.55), 0.0, None, "", "linear colour where there is no surface"),
    Parameter(
        "hdr_format",
        "choice",
        "rgba16f",
        help="of the lit picture; rgb32f is 96-bit HDR",
        choices=("rgba16f", "rgb32f", "rgba32f"),
    ),
    Parameter("exposure_stops", "float", 0.0, -16.0, 16.0, "stops", "brightness before the curve: factor 2 a stop"),
    Parameter("curve", "choice", "linear", help="how high values are compressed", choices=_CURVES),
    Parameter("display", "bool", True, help="tone-mapped sRGB; off: the HDR result"),
)

_FIVE_PASS = (
    Parameter(
        "kernel",
        "choice",
        "normalised",
        help="of the blur; faithful: as printed in 2005, brighter and shifted",
        choices=("normalised", "faithful"),
    ),
    Parameter("weights", "choice", "host", help="where they are computed", choices=("host", "kernel")),
    Parameter("map_size", "int", 512, 16, 8192, "texels", "width and height of the shadow map"),
    Parameter("mask_format", "choice", "r16f", help="of the shadow mask", choices=("r8", "r16f", "r32f")),
    Parameter("ambient", "float", 0.0, 0.0, None, "", "light that nothing takes away, scene-linear"),
    Parameter("background", "rgb", (0.0, 0.0, 0.0), 0.0, None, "", "linear colour where there is no surface"),
    Parameter("display", "bool", True, help="8-bit sRGB; off: the linear result"),
)

_PLANAR = (
    Parameter("height", "float", 0.0, None, None, "scene units", "of the plane, world y"),
    Parameter("top", "rgb", (1.0, 1.0, 1.0), 0.0, None, "", "linear colour of the plane's upper face"),
    Parameter("top_opacity", "float", 0.7, 0.0, 1.0, "", "what is left over shows the reflection"),
    Parameter("bottom", "rgb", (0.25, 0.2, 0.2), 0.0, None, "", "linear colour of the plane's lower face"),
    Parameter("bottom_opacity", "float", 1.0, 0.0, 1.0, "", "what is left over shows the reflection"),
    Parameter("darkness", "float", 0.6, 0.0, 1.0, "", "share of the colour that each light's shadow takes"),
    Parameter("lift", "float", 0.001, 0.0, None, "scene units", "of the shadows over the plane"),
    Parameter("ambient", "float", 0.25, 0.0, None, "", "light from all around, scene-linear"),
    Parameter("fog", "choice", "linear", help="OpenGL's fog modes", choices=("none", "linear", "exp", "exp2")),
    Parameter("fog_color", "rgb", (0.32, 0.42, 0.55), 0.0, None, "", "linear; also where there is no surface"),
    Parameter("fog_start", "float", 10.0, None, None, "scene units", "of linear fog, along the view axis"),
    Parameter("fog_end", "float", 40.0, None, None, "scene units", "of linear fog, above fog_start"),
    Parameter("fog_density", "float", 0.05, 0.0, None, "per scene unit", "of exp and exp2"),
    Parameter("display", "bool", True, help="sRGB; off: the HDR result"),
)

_CONTACT = (
    Parameter("height", "float", 0.0, None, None, "scene units", "of the floor, world y"),
    Parameter("threshold", "float", 0.3, 1e-6, None, "scene units", "what is higher throws no contact shadow"),
    Parameter("darkness", "float", 0.7, 0.0, 1.0, "", "share of the light that is taken at contact"),
    Parameter("map_size", "int", 256, 16, 4096, "texels", "along each side of the view from above"),
    Parameter("display", "bool", True, help="sRGB; off: the HDR result"),
)

EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        Effect(
            "black-and-white",
            "passgraph.effects.black_and_white:black_and_white",
            "picture",
            (_WEIGHTS,),
            "Luma of each pixel.",
        ),
        Effect(
            "tone-map",
            "passgraph.effects.tone_map:tone_map",
            "picture",
            (_EXPOSURE, _CURVE, _SRGB),
            "Scene-linear HDR to a display.",
        ),
        Effect(
            "gaussian-blur",
            "passgraph.effects.blur:gaussian_blur",
            "picture",
            (
                Parameter("sigma_px", "float", 3.0, 0.0, 100.0, "px", "standard deviation"),
                Parameter("radius_px", "int", None, 0, 300, "px", "taps to each side; left out: 3 sigma, rounded up"),
            ),
            "Gaussian blur, horizontally, then vertically.",
        ),
        Effect(
            "bloom",
            "passgraph.effects.bloom:bloom",
            "picture",
            (
                Parameter("threshold", "float", 1.0, 0.0, None, "", "what is above it glows, scene-linear"),
                Parameter("intensity", "float", 0.5, 0.0, None, "", "factor on the glow"),
                Parameter("levels", "int", 4, 1, 8, "", "halvings; each doubles the glow's width"),
            ),
            "Glow around what is bright, by dual filtering.",
        ),
        Effect(
            "depth-aware-blur",
            "passgraph.effects.blur:depth_aware_blur",
            "picture+depth",
            (
                Parameter("radius_px", "int", 7, 0, 63, "px", "taps to each side"),
                Parameter(
                    "tolerance",
                    "float",
                    0.05,
                    0.0,
                    None,
                    "relative",
                    "difference of depth, as a share of it, that still mixes",
                ),
            ),
            "Blur that stops where depth jumps.",
        ),
        Effect(
            "soft-shadow",
            "passgraph.effects.soft_shadow:soft_shadow",
            "scene",
            _SOFT_SHADOW,
            "A scene with soft shadows by post-effect.",
        ),
        Effect(
            "five-pass",
            "passgraph.effects.five_pass:five_pass",
            "scene",
            _FIVE_PASS,
            "A spotlit scene with a soft shadow in five passes, as of 2005.",
        ),
        Effect(
            "planar",
            "passgraph.effects.planar:planar",
            "scene",
            _PLANAR,
            "Reflection in, and shadows on, a plane, by a stencil buffer; fog.",
        ),
        Effect(
            "contact",
            "passgraph.effects.contact:contact",
            "scene",
            _CONTACT,
            "Soft shadows, and a floor darkened near contacts.",
        ),
    )
}


def effect_named(name: str) -> Effect:
    """The effect of this name.

    >>> effect_named("tone-map").takes
    'picture'
    """
    if name not in EFFECTS:
        import difflib

        near = difflib.get_close_matches(name, EFFECTS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise KeyError(f"there is no effect {name!r}{hint} There are {', '.join(EFFECTS)}")
    return EFFECTS[name]
