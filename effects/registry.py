"""One table of every effect and its parameters: what the command line, the documentation and tests read.

Importing it loads no effect; :attr:`Effect.function` does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

from passgraph.arguments import among, shown
from passgraph.errors import UnknownNameError

ParameterType = Literal["float", "int", "bool", "choice", "rgb", "picture"]
#: What an effect is applied to: one picture; a mask and a linear depth picture; a scene; a flat world and a size.
Takes = Literal["picture", "picture+depth", "scene", "world2d"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One keyword argument of an effect.

    Attributes
    ----------
    name : the keyword
    type : "float", "int", "bool", "choice", "rgb" (three floats) or "picture" (a target;
        on the command line a file)
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
            if among(name, (parameter.name,)):
                return parameter
        known = ", ".join(p.name for p in self.parameters) or "none"
        raise UnknownNameError(f"effect {self.name!r} has no parameter {shown(name)}; it has {known}")


_WEIGHTS = Parameter(
    "weights", "rgb", (0.2126, 0.7152, 0.0722), 0.0, 1.0, "", "share of red, green and blue (Rec. 709)"
)
_EXPOSURE = Parameter(
    "exposure_stops", "float", 0.0, -16.0, 16.0, "stops", "brightness before the curve: factor 2 a stop"
)
_CURVES = ("linear", "reinhard", "hable", "aces", "agx", "pbr-neutral")
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
        "auto",
        help="auto: penumbra, or blur where softness is given; the others compare maps, or blur those of moments",
        choices=("auto", "blur", "hard", "pcf", "disc", "pcss", "penumbra", "vsm", "evsm4", "msm"),
    ),
    Parameter("pcf_size", "int", 5, 1, 15, "texels", "texels along each side with shadow_filter=pcf, odd"),
    Parameter(
        "taps",
        "int",
        None,
        1,
        128,
        "",
        "comparisons of disc, and of each step of pcss, and half of penumbra's; left out: 32 or 16",
    ),
    Parameter("bleed", "float", None, 0.0, 0.9, "", "share of light that counts as none with vsm, evsm4 and msm"),
    Parameter("exponent", "float", 40.0, 1.0, 42.0, "", "of shadow_filter=evsm4: more leaks less"),
    Parameter(
        "moment_format", "choice", "rgba32f", help="of the map of shadow_filter=msm", choices=("rgba32f", "rgba16")
    ),
    Parameter(
        "blur",
        "choice",
        "world",
        help="width in scene units, or in pixels as in plain blurs",
        choices=("world", "constant"),
    ),
    Parameter("radius_px", "int", 7, 1, 31, "px", "taps to each side; the width itself with blur=constant"),
    Parameter("map_size", "int", 1024, 16, 8192, "texels", "width and height of each shadow map"),
    Parameter(
        "fit", "choice", "view", help="of maps: what the camera sees, or the whole scene", choices=("view", "scene")
    ),
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
    Parameter("lift", "float", 0.001, 0.0, None, "scene units", "of the shadows over the plane; with 0 they speckle"),
    Parameter("ambient", "float", 0.25, 0.0, None, "", "light from all around, scene-linear"),
    Parameter("fog", "choice", "linear", help="OpenGL's fog modes", choices=("none", "linear", "exp", "exp2")),
    Parameter("fog_color", "rgb", (0.32, 0.42, 0.55), 0.0, None, "", "linear; also where there is no surface"),
    Parameter("fog_start", "float", 10.0, None, None, "scene units", "of linear fog, along the view axis"),
    Parameter("fog_end", "float", 40.0, None, None, "scene units", "of linear fog, above fog_start"),
    Parameter("fog_density", "float", 0.05, 0.0, None, "per scene unit", "of exp and exp2"),
    Parameter("display", "bool", True, help="sRGB; off: the HDR result"),
)

_CONTACT = (
    Parameter("height", "float", 0.0, None, None, "scene units", "of the floor's plane, world y"),
    Parameter("threshold", "float", 0.3, 1e-6, None, "scene units", "what is higher throws no contact shadow"),
    Parameter("darkness", "float", 0.7, 0.0, 1.0, "", "share of the light that is taken at contact"),
    Parameter("map_size", "int", 256, 16, 4096, "texels", "along each side of the view from above"),
    Parameter("display", "bool", True, help="sRGB; off: the HDR result"),
)

_AMBIENT_OCCLUSION = (
    Parameter("method", "choice", "gtao", help="horizons, or points of a hemisphere", choices=("gtao", "ssao")),
    Parameter(
        "radius",
        "float",
        None,
        1e-6,
        None,
        "scene units",
        "how far things take light; left out: 8 % of the scene's size",
    ),
    Parameter("slices", "int", 2, 1, 64, "", "of gtao: planes through the line of sight, a pixel"),
    Parameter("steps", "int", 4, 1, 256, "", "of gtao: taps to each side of a slice"),
    Parameter("falloff", "float", 0.6, 1e-3, 1.0, "", "of gtao: share of the radius over which things fade out"),
    Parameter("thickness", "float", 0.0, 0.0, 1.0, "", "of gtao: how fast a horizon sinks behind thin things"),
    Parameter("taps", "int", 16, 1, 256, "", "of ssao: points of the hemisphere, a pixel"),
    Parameter("bias", "float", 0.02, 0.0, 1.0, "of the radius", "of ssao: how far before a point a thing hides it"),
    Parameter("range_check", "bool", True, help="of ssao: far things take nothing; off: they leave halos"),
    Parameter("power", "float", 1.0, 0.0, None, "", "exponent on the visibility; more is darker"),
    Parameter("half_resolution", "bool", False, help="search at half the size, then enlarge along surfaces"),
    Parameter("denoise", "bool", True, help="average over the 4 by 4 pixels of the noise"),
    Parameter("bounces", "bool", False, help="lighten by what hidden surfaces of the same colour reflect"),
    Parameter("ambient", "float", 0.5, 0.0, None, "", "light from all around, scene-linear; it alone is dimmed"),
    Parameter("display", "bool", True, help="sRGB; off: the HDR result"),
)

_LIGHT2D = (
    Parameter(
        "penumbra",
        "choice",
        "exact",
        help="of lamps: the exact angle in sight, none, or shadows drawn several times or blurred",
        choices=("exact", "none", "rotate", "move", "mixed"),
    ),
    Parameter("draws", "int", 8, 2, 64, "", "of penumbra=rotate and penumbra=move"),
    Parameter("rims", "float", 0.5, 0.0, 1.0, "", "darkness of the rims along walls"),
    Parameter(
        "near", "choice", "fade", help="of moving shadows near a lamp: fade, or more sprites", choices=("fade", "fan")
    ),
    Parameter(
        "lens",
        "choice",
        "none",
        help="dirt on the lens: where it is bright, at spots of light, or by a map of them",
        choices=("none", "bright", "spots", "map"),
    ),
    Parameter("lens_strength", "float", 1.0, 0.0, None, "", "factor on the dirt"),
    Parameter("exposure_stops", "float", 0.0, -16.0, 16.0, "stops", "brightness: factor 2 a stop"),
    Parameter("display", "bool", True, help="sRGB; off: the linear HDR result"),
)

_LENS = (
    Parameter(
        "dirt", "picture", None, help="how much light the dirt scatters, as it is stored; left out: dust, smears"
    ),
    Parameter("strength", "float", 1.0, 0.0, None, "", "factor on the dirt"),
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
            "dirty-lens",
            "passgraph.effects.lens:dirty_lens",
            "picture",
            _LENS,
            "Dirt on the lens where the picture is bright.",
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
        Effect(
            "ambient-occlusion",
            "passgraph.effects.ambient_occlusion:ambient_occlusion",
            "scene",
            _AMBIENT_OCCLUSION,
            "Soft shadows, and light from all around dimmed in corners.",
        ),
        Effect(
            "light2d",
            "passgraph.effects.light2d.picture:light2d",
            "world2d",
            _LIGHT2D,
            "A flat world with soft shadows, seen from above.",
        ),
    )
}


def effect_named(name: str) -> Effect:
    """The effect of this name.

    >>> effect_named("tone-map").takes
    'picture'
    """
    if not among(name, EFFECTS):
        import difflib

        near = difflib.get_close_matches(shown(name), EFFECTS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise UnknownNameError(f"there is no effect {shown(name)}{hint} There are {', '.join(EFFECTS)}")
    return EFFECTS[name]
