"""Effects beside the published GLSL that does the same or the nearest: what is measured by bench_originals.py."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import moderngl
import numpy as np

import passgraph as pg
from passgraph import effects
from passgraph.effects.color.black_and_white import REC601
from passgraph.effects.filters.blur import gaussian_weights
from tests.benchmarks.original_passes import LUMINANCE, REC709, VERTEX, Drawn, Pass, Picture, Texts
from tests.effects import smaa_original

WIDTH, HEIGHT = SIZE = (1280, 720)
RESOLUTION = (float(WIDTH), float(HEIGHT))
TEXEL = (1.0 / WIDTH, 1.0 / HEIGHT)
FRAME = {"tDiffuse": "frame"}
INPUT = {"inputBuffer": "frame", "texture": "frame"}
SMALL = (WIDTH // 2, HEIGHT // 2)


@dataclass(frozen=True)
class Case:
    """An effect, and the passes of the original.

    Attributes
    ----------
    effect, options, original : for the table
    passes : of the texts
    ours : of the input and the destination
    differs : what ours does otherwise; empty where both give the same picture
    input_size, format : of the frame, and of the result
    """

    effect: str
    original: str
    passes: Callable[[Texts], list[Pass]]
    ours: Callable[[pg.Input, Any], pg.Target]
    differs: str = ""
    options: str = ""
    input_size: tuple[int, int] = SIZE
    format: str = "rgba32f"

    def drawn(self, context: moderngl.Context, texts: Texts, frame: Picture) -> Drawn | DrawnSmaa:
        """Return the original, ready to draw."""
        return Drawn(context, self.passes(texts), frame)


class DrawnSmaa:
    """The original of SMAA, in its preset "high"; its edges and weights have 8 bits."""

    def __init__(self, context: moderngl.Context, frame: Picture) -> None:
        self.original = smaa_original.Original(context, 0.1, 16, 8, 0.25)
        self.pictures = [context.texture(SIZE, 4, dtype=kind) for kind in ("f4", "f1", "f1", "f4")]
        self.pictures[0].write(frame.tobytes())

    def draw(self) -> None:
        with self.original.context:
            self.original.draw(*self.pictures)
            self.original.context.finish()

    def read(self) -> Picture:
        with self.original.context:
            return np.frombuffer(self.pictures[3].read(), np.float32).reshape(HEIGHT, WIDTH, 4)


class Smaa(Case):
    """SMAA, whose original is in the repository."""

    def drawn(self, context: moderngl.Context, texts: Texts, frame: Picture) -> DrawnSmaa:
        return DrawnSmaa(context, frame)


def _three(name: str, **values: Any) -> Callable[[Texts], list[Pass]]:
    return lambda texts: [Pass(texts.three(name), FRAME, SIZE, values)]


def _effect(name: str, support: str = "", **values: Any) -> Callable[[Texts], list[Pass]]:
    def passes(texts: Texts) -> list[Pass]:
        vertex, fragment = texts.effect(name, support=support)
        return [Pass(fragment, INPUT, SIZE, values, vertex)]

    return passes


def _glfx(name: str, **values: Any) -> Callable[[Texts], list[Pass]]:
    return lambda texts: [Pass(texts.glfx(name), INPUT, SIZE, {"texSize": RESOLUTION, **values}, version=100)]


def _tone(curve: str) -> Callable[[Texts], list[Pass]]:
    defines = f"#define {curve}_TONE_MAPPING\n#define SRGB_TRANSFER\n"
    return lambda texts: [
        Pass(defines + texts.three("OutputShader"), FRAME, SIZE, {"toneMappingExposure": 1.0}, kind="f1")
    ]


def _sobel(texts: Texts) -> list[Pass]:
    gray = Pass(texts.three("LuminosityShader"), FRAME, SIZE)
    return [gray, Pass(texts.three("SobelOperatorShader"), {"tDiffuse": 0}, SIZE, {"resolution": RESOLUTION})]


def _tilt_shift(texts: Texts) -> list[Pass]:
    across = Pass(texts.three("HorizontalTiltShiftShader"), FRAME, SIZE, {"h": TEXEL[0] * 2.0, "r": 0.5})
    return [
        across,
        Pass(texts.three("VerticalTiltShiftShader"), {"tDiffuse": 0}, SIZE, {"v": TEXEL[1] * 2.0, "r": 0.5}),
    ]


def _gaussian(texts: Texts) -> list[Pass]:
    """Two taps by one filtered read, as `GaussKernel` has them."""
    weights = (*gaussian_weights(2.0, 7), 0.0)
    kernel = [(0.0, weights[0])]
    for i in range(1, 8, 2):
        both = weights[i] + weights[i + 1]
        kernel.append(((i * weights[i] + (i + 1) * weights[i + 1]) / both, both))
    fragment = f"#define STEPS {len(kernel)}\n" + texts.material("convolution_gaussian_default")
    vertex = texts.material("convolution_gaussian_default2")
    values = {"kernel": kernel, "texelSize": TEXEL, "scale": 1.0}
    return [
        Pass(fragment, {"inputBuffer": source}, SIZE, {**values, "direction": direction}, vertex)
        for source, direction in (("frame", (1.0, 0.0)), (0, (0.0, 1.0)))
    ]


def _bloom(texts: Texts) -> list[Pass]:
    """Luminance, four halvings, three doublings, and the sum."""
    head = "#define THRESHOLD\n#define COLOR\n"
    passes = [
        Pass(
            REC709 + head + texts.material("luminance_default"),
            {"inputBuffer": "frame"}, SIZE, {"threshold": 1.0, "smoothing": 0.03},
        )
    ]  # fmt: skip
    sizes = [SIZE, *((WIDTH >> level, HEIGHT >> level) for level in range(1, 5))]
    names = [f"convolution_{way}sampling_default" for way in ("down", "up")]
    (down, down_vertex), (up, up_vertex) = ((texts.material(n), texts.material(f"{n}2")) for n in names)
    for level in range(1, 5):
        texel = {"texelSize": (1.0 / sizes[level - 1][0], 1.0 / sizes[level - 1][1])}
        passes.append(Pass(down, {"inputBuffer": level - 1}, sizes[level], texel, down_vertex))
    for level in range(3, 0, -1):
        values = {"texelSize": (1.0 / sizes[level + 1][0], 1.0 / sizes[level + 1][1]), "radius": 0.85}
        reads = {"inputBuffer": len(passes) - 1, "supportBuffer": level}
        passes.append(Pass(up, reads, sizes[level], values, up_vertex))
    _, glow = texts.effect("bloom_default")
    added = glow.replace("gl_FragColor); }", "gl_FragColor); gl_FragColor += texture2D(inputBuffer, uv); }")
    return [*passes, Pass(added, {"inputBuffer": "frame", "map": len(passes) - 1}, SIZE, {"intensity": 0.5})]


def _god_rays(texts: Texts) -> list[Pass]:
    light = REC709 + "#define THRESHOLD\n#define COLOR\n"
    first = Pass(
        light + texts.material("luminance_default"), {"inputBuffer": "frame"}, SMALL,
        {"threshold": 0.9, "smoothing": 0.03},
    )  # fmt: skip
    head = "#define SAMPLES_INT 60\n#define SAMPLES_FLOAT 60.0\n"
    values = {
        "lightPosition": (0.5, 0.75), "exposure": 0.6, "decay": 0.9, "density": 0.96, "weight": 0.4, "clampMax": 1.0
    }  # fmt: skip
    rays = Pass(head + texts.material("convolution_god_rays_default"), {"inputBuffer": 0}, SMALL, values)
    _, shown = texts.effect("god_rays_default")
    added = shown.replace("gl_FragColor); }", "gl_FragColor); gl_FragColor += texture2D(inputBuffer, uv); }")
    return [first, rays, Pass(added, {"inputBuffer": "frame", "map": 1}, SIZE)]


def _fxaa(texts: Texts) -> list[Pass]:
    defines = (
        "#define SAMPLES 12\n#define EDGE_THRESHOLD_MIN 0.0833\n#define EDGE_THRESHOLD_MAX 0.166\n"
        "#define SUBPIXEL_QUALITY 0.75\n"
    )
    vertex, fragment = texts.effect("fxaa_default", defines, "fxaa_default2", LUMINANCE.format(*REC601))
    return [Pass(fragment, INPUT, SIZE, {"texelSize": TEXEL}, vertex)]


def _unsharp(texts: Texts) -> list[Pass]:
    """Radius 4: the deviation of a tent that ends at it is 1.63."""
    blur, mask = texts.glfx("triangleBlur"), texts.glfx("unsharpMask")
    reads = {"originalTexture": "frame", "blurredTexture": 1}
    return [
        Pass(blur, {"texture": "frame"}, SIZE, {"delta": (4.0 / WIDTH, 0.0)}, version=100),
        Pass(blur, {"texture": 0}, SIZE, {"delta": (0.0, 4.0 / HEIGHT)}, version=100),
        Pass(mask, reads, SIZE, {"strength": 0.8, "threshold": 0.0}, version=100),
    ]


def _bilateral(texts: Texts) -> list[Pass]:
    text = texts.file("glslSmartDeNoise/Shaders/frag.glsl")
    function = text[text.index("#define INV_SQRT_OF_2PI") :].partition("//  About Standard")[0]
    main = "uniform sampler2D tDiffuse; varying vec2 vUv;\nvoid main() { gl_FragColor = smartDeNoise(tDiffuse, vUv, "
    return [Pass(f"{function}{main}3.0, 4.0 / 3.0, 0.1); }}", FRAME, SIZE)]


def _amd(texts: Texts, repository: str, folder: str, name: str, loads: str, main: str) -> str:
    head = "uniform sampler2D source;\n#define A_GPU 1\n#define A_GLSL 1\n"
    begin = texts.file(f"{repository}/{folder}/ffx_a.h")
    return f"{head}{begin}\n{loads}\n{texts.file(f'{repository}/{folder}/{name}')}\nvoid main() {{ {main} }}"


def _cas(texts: Texts) -> list[Pass]:
    loads = (
        "AF3 CasLoad(ASU2 p) { return texelFetch(source, p, 0).rgb; }\n"
        "void CasInput(inout AF1 r, inout AF1 g, inout AF1 b) {}"
    )
    size = f"{WIDTH}.0, {HEIGHT}.0"
    main = (
        f"AU4 a, b; CasSetup(a, b, 0.5, {size}, {size}); AF3 c;"
        "CasFilter(c.r, c.g, c.b, AU2(gl_FragCoord.xy), a, b, true); gl_FragColor = vec4(c, 1.0);"
    )
    text = _amd(texts, "FidelityFX-CAS", "ffx-cas", "ffx_cas.h", loads, main)
    return [Pass(text, {"source": "frame"}, SIZE, version=430)]


def _fsr1(texts: Texts) -> list[Pass]:
    gathers = "\n".join(
        f"AF4 FsrEasu{letter}F(AF2 p) {{ return textureGather(source, p, {number}); }}"
        for number, letter in enumerate("RGB")
    )
    load = (
        "AF4 FsrRcasLoadF(ASU2 p) { return texelFetch(source, p, 0); }\n"
        "void FsrRcasInputF(inout AF1 r, inout AF1 g, inout AF1 b) {}"
    )
    small, large = (f"{width}.0, {height}.0" for width, height in (SMALL, SIZE))
    easu = (
        f"AU4 a, b, c, d; FsrEasuCon(a, b, c, d, {small}, {small}, {large}); AF3 color;"
        "FsrEasuF(color, AU2(gl_FragCoord.xy), a, b, c, d); gl_FragColor = vec4(color, 1.0);"
    )
    rcas = (
        "AU4 a; FsrRcasCon(a, 0.2); AF3 c; FsrRcasF(c.r, c.g, c.b, AU2(gl_FragCoord.xy), a);"
        "gl_FragColor = vec4(c, 1.0);"
    )
    make = partial(_amd, texts, "FidelityFX-FSR", "ffx-fsr", "ffx_fsr1.h")
    return [
        Pass(make("#define FSR_EASU_F 1\n" + gathers, easu), {"source": "frame"}, SIZE, version=430),
        Pass(make("#define FSR_RCAS_F 1\n" + load, rcas), {"source": 0}, SIZE, version=430),
    ]


def _crt(texts: Texts) -> list[Pass]:
    """The original reads one pixel of four by four; a small picture is drawn first, as a console's is given."""
    copy = "uniform sampler2D tDiffuse; varying vec2 vUv; void main() { gl_FragColor = texture2D(tDiffuse, vUv); }"
    small = (WIDTH // 4, HEIGHT // 4)
    text = texts.file("glsl-shaders/crt/shaders/crt-lottes.glsl").replace("out vec4 FragColor;", "")
    head = "#define FRAGMENT\n#define FragColor gl_FragColor\n#define PARAMETER_UNIFORM\n"
    values = {
        "OutputSize": RESOLUTION, "TextureSize": small, "InputSize": small, "hardScan": -8.0, "hardPix": -3.0,
        "warpX": 0.031, "warpY": 0.041, "maskDark": 0.5, "maskLight": 1.5, "scaleInLinearGamma": 0.0,
        "shadowMask": 3.0, "brightBoost": 1.0, "hardBloomPix": -1.5, "hardBloomScan": -2.0, "bloomAmount": 0.0625,
        "shape": 2.0,
    }  # fmt: skip
    vertex = VERTEX.replace("vec2 vUv", "vec4 TEX0").replace(
        "vUv = position.xy * 0.5 + 0.5", "TEX0 = vec4(position.xy * 0.5 + 0.5, 0.0, 0.0)"
    )
    return [Pass(copy, FRAME, small), Pass(head + text, {"Texture": 0}, SIZE, values, vertex)]


CASES = (
    Case(
        "black-and-white", "three LuminosityShader", _three("LuminosityShader"),
        lambda frame, into: effects.black_and_white(frame, into=into),
    ),
    Case(
        "sepia", "three SepiaShader", _three("SepiaShader", amount=1.0),
        lambda frame, into: effects.sepia(frame, into=into),
    ),
    Case(
        "hue-saturation", "three HueSaturationShader", _three("HueSaturationShader", hue=0.3, saturation=-0.3),
        lambda frame, into: effects.hue_saturation(frame, 0.94, 0.7, into=into),
        "luma stays, not the mean of the channels",
    ),
    Case(
        "tone-map", "three OutputShader", _tone("NEUTRAL"),
        lambda frame, into: effects.tone_map(frame, curve="pbr-neutral", into=into), options="pbr-neutral",
        format="rgba8",
    ),
    Case(
        "tone-map", "three OutputShader", _tone("AGX"),
        lambda frame, into: effects.tone_map(frame, curve="agx", into=into),
        "the sigmoid itself, by exact logarithms and powers, not a polynomial", options="agx", format="rgba8",
    ),
    Case(
        "vignette", "postprocessing VignetteEffect", _effect("vignette_default", offset=0.5, darkness=0.5),
        lambda frame, into: effects.vignette(frame, into=into),
        "a power of the angle's cosine, exact, not a smooth step",
    ),
    Case(
        "film-grain", "three FilmShader", _three("FilmShader", time=0.1, intensity=0.5),
        lambda frame, into: effects.film_grain(frame, into=into), "a hash of ints, no sine; bell-shaped noise",
    ),
    Case(
        "chromatic-aberration", "three RGBShiftShader", _three("RGBShiftShader", amount=0.005, angle=0.0),
        lambda frame, into: effects.chromatic_aberration(frame, samples=3, into=into),
        "grows toward the corners; filters in 32 bits, not by the device", options="3 samples",
    ),
    Case(
        "lens-distortion", "postprocessing LensDistortionEffect",
        _effect(
            "lens_distortion_default", distortion=(-0.1, -0.1), focalLength=(1.0, 1.0), principalPoint=(0.0, 0.0),
            skew=0.0,
        ),
        lambda frame, into: effects.lens_distortion(frame, -0.1, undo=True, into=into),
        "three coefficients, aspect kept; filters in 32 bits", options="undo",
    ),
    Case(
        "pixelate", "postprocessing PixelationEffect",
        _effect("pixelation_default", is_active=True, d=(8.0 / WIDTH, 8.0 / HEIGHT, WIDTH / 8.0, HEIGHT / 8.0)),
        lambda frame, into: effects.pixelate(frame, into=into), "the mean of 64 pixels, not one of them",
    ),
    Case(
        "halftone", "glfx colorHalftone", _glfx("colorHalftone", angle=0.3, scale=0.4, center=(640.0, 360.0)),
        lambda frame, into: effects.halftone(frame, into=into), "exact areas of ink: 16 samples of a pixel, not 1",
    ),
    Case(
        "halftone", "three HalftoneShader",
        _three(
            "HalftoneShader", radius=8.0, rotateR=0.26, rotateG=0.52, rotateB=0.79, scatter=0.0, width=float(WIDTH),
            height=float(HEIGHT), shape=1, disable=False, blending=1.0, blendingMode=1, greyscale=False,
        ),
        lambda frame, into: effects.halftone(frame, into=into), "one read, where the original reads 108 times",
    ),
    Case(
        "glitch", "three DigitalGlitch",
        _three(
            "DigitalGlitch", byp=0, amount=0.08, angle=0.02, seed=0.02, seed_x=0.02, seed_y=0.02, distortion_x=0.5,
            distortion_y=0.6, col_s=0.05,
        ),
        lambda frame, into: effects.glitch(frame, into=into), "bands and blocks by a hash of ints",
    ),
    Case("crt", "libretro crt-lottes", _crt, lambda frame, into: effects.crt(frame, into=into),
         "squares of 16 pixels are averaged"),
    Case(
        "sobel", "three LuminosityShader, SobelOperatorShader", _sobel,
        lambda frame, into: effects.sobel(frame, strength=4.0 * 2.0**0.5, into=into),
    ),
    Case(
        "gaussian-blur", "postprocessing GaussianBlurMaterial", _gaussian,
        lambda frame, into: effects.gaussian_blur(frame, 2.0, 7, into=into), options="15 taps",
    ),
    Case("unsharp", "glfx unsharpMask", _unsharp, lambda frame, into: effects.unsharp(frame, 0.8, 1.63, into=into),
         "a Gaussian of 11 taps, not a tent of 61"),
    Case("bilateral", "glslSmartDeNoise", _bilateral, lambda frame, into: effects.bilateral(frame, into=into),
         "texels of whole steps, not between two rows; an exact exponential"),
    Case("tilt-shift", "three HorizontalTiltShiftShader, Vertical…", _tilt_shift,
         lambda frame, into: effects.tilt_shift(frame, sigma_px=4.0 / 3.0, into=into),
         "a Gaussian of each pixel's own width", options="9 taps at most"),
    Case("radial-blur", "glfx zoomBlur", _glfx("zoomBlur", center=(640.0, 360.0), strength=0.1),
         lambda frame, into: effects.radial_blur(frame, into=into), "64 times by 16 reads, not 41 by 41"),
    Case("god-rays", "postprocessing GodRaysMaterial", _god_rays,
         lambda frame, into: effects.god_rays(frame, threshold=0.9, into=into),
         "216 positions by 18 reads, not 60 by 60"),
    Case("bloom", "postprocessing MipmapBlurPass", _bloom, lambda frame, into: effects.bloom(frame, into=into),
         "5 and 8 reads, not 13 and 10"),
    Case("cas", "AMD FidelityFX CAS", _cas, lambda frame, into: effects.cas(frame, into=into),
         "exact divisions and roots"),
    Case("fsr1", "AMD FidelityFX FSR 1", _fsr1, lambda frame, into: effects.fsr1(frame, into=into),
         "exact divisions and roots", input_size=SMALL),
    Case("fxaa", "postprocessing FXAAEffect", _fxaa, lambda frame, into: effects.fxaa(frame, "39", into=into),
         options="39"),
    Smaa("smaa", "postprocessing SMAAEffect", lambda texts: [],
         lambda frame, into: effects.smaa(frame, 0.1, 16, 8, 0.25, into=into), "luma in a pass of its own"),
)  # fmt: skip
