"""Entries of the gallery for grading, filters and styles: one photograph, many ways."""

from __future__ import annotations

import numpy as np

import passgraph as pg
from docs.gallery_inputs import Picture, detail, photograph, street
from docs.gallery_looks import MOTORCYCLE
from docs.gallery_page import Entry, Panel
from passgraph.effects import (
    bilateral,
    cas,
    color_grade,
    crt,
    denoise,
    distance_field,
    dither,
    fill,
    fsr1,
    glitch,
    halftone,
    hue_saturation,
    kuwahara,
    lens_distortion,
    morphology,
    pixelate,
    resize,
    sepia,
    sobel,
    tone_map,
    unsharp,
)
from passgraph.effects.antialias.resize import FILTERS as FILTERS_OF_SIZE
from passgraph.effects.antialias.resize import Filter
from passgraph.srgb import srgb_to_linear

FRAME = pg.Input("frame")
#: A Gaussian of this width takes the finest detail out, which sharpening brings back.
SOFTENED_PX = 1.0


def grades() -> list[Panel]:
    given = {"frame": photograph("coffee")}

    def graded(label: str, **options: object) -> Panel:
        return Panel(label, tone_map(color_grade(FRAME, **options), curve="linear"), given)  # type: ignore[arg-type]

    return [
        graded("as it is"),
        graded("white of 4500 K", temperature_k=4500.0),
        graded("contrast 1.4", contrast=1.4),
        graded("teal shadows, orange highlights", pivot=0.4, shadows=(0.4, 1.0, 1.5), highlights=(1.3, 1.0, 0.7)),
        graded("lift, gamma, gain", lift=(0.02, 0.02, 0.06), gamma=(1.2, 1.2, 1.2), gain=(1.1, 1.0, 0.9)),
        graded("saturation 0.4", saturation=0.4),
    ]


def colors() -> list[Panel]:
    given = {"frame": street()}
    return [
        Panel("hue, a third of a turn", hue_saturation(FRAME, 2.0943951), given),
        Panel("saturation 2", hue_saturation(FRAME, saturation=2.0), given),
        Panel("sepia", sepia(FRAME), given),
    ]


def softened() -> Picture:
    from scipy.ndimage import gaussian_filter

    soft: Picture = gaussian_filter(detail(street())[..., :3], (SOFTENED_PX, SOFTENED_PX, 0.0))
    return soft


def sharp() -> list[Panel]:
    soft = softened()
    unchanged = pg.kernel(source="def unchanged(color: Image) -> vec4: return color[0, 0]")
    light = {"frame": np.asarray(srgb_to_linear(soft), np.float32)}
    return [
        Panel("softened", unchanged(FRAME), {"frame": soft}),
        Panel("unsharp", unsharp(FRAME, 1.5, 1.5), {"frame": soft}),
        Panel("cas", tone_map(cas(FRAME, 1.0), curve="linear"), light),
    ]


def smooth() -> list[Panel]:
    frame = detail(street())[..., :3]
    noise = np.random.default_rng(3).normal(0.0, 0.06, frame.shape)
    noisy = {"frame": np.asarray(np.clip(frame + noise, 0.0, 1.0), np.float32)}
    unchanged = pg.kernel(source="def unchanged(color: Image) -> vec4: return color[0, 0]")
    return [
        Panel("with noise", unchanged(FRAME), noisy),
        Panel("bilateral", bilateral(FRAME, 5, 3.0, 0.25), noisy),
        Panel("denoise", denoise(FRAME, 0.08, 0.06), noisy),
        Panel("kuwahara", kuwahara(FRAME, 5), noisy),
    ]


def shapes() -> list[Panel]:
    given = {"frame": detail(street())}
    return [
        Panel("sobel", sobel(FRAME, strength=2.0), given),
        Panel("morphology, erode", morphology(FRAME, "erode", 2), given),
        Panel("morphology, dilate", morphology(FRAME, "dilate", 2), given),
    ]


def lenses() -> list[Panel]:
    frame = street().copy()
    frame[19::38, :, :3] = frame[:, 19::38, :3] = (1.0, 0.8, 0.0)
    given, shown = {"frame": frame}, FRAME.border("zero")
    bent = lens_distortion(shown, -0.15, name="bent").border("zero")
    return [
        Panel("k1 = -0.15, a barrel", bent, given),
        Panel("k1 = 0.15, a pincushion", lens_distortion(shown, 0.15), given),
        Panel("the barrel, straightened", lens_distortion(bent, -0.15, undo=True), given),
    ]


def sizes() -> list[Panel]:
    shown = np.ascontiguousarray(detail(street())[60:144, 60:165])
    given = {"frame": np.asarray(srgb_to_linear(shown), np.float32)}

    def enlarged(filter: Filter) -> Panel:
        return Panel(filter, tone_map(resize(FRAME, 4.0, filter), curve="linear"), given)

    return [*map(enlarged, FILTERS_OF_SIZE), Panel("fsr1", fsr1(FRAME, 4.0), {"frame": shown})]


def prints() -> list[Panel]:
    shown = np.ascontiguousarray(detail(street())[20:180, 30:230])
    near = {"frame": shown}
    light = {"frame": np.asarray(srgb_to_linear(shown), np.float32)}
    return [
        Panel("pixelate", pixelate(FRAME, 6), near),
        Panel("dither, 2 levels", dither(FRAME, 2), near),
        Panel("dither, blue noise", dither(FRAME, 2, "blue-noise"), near),
        Panel("dither, 4 levels", dither(FRAME, 4), near),
        Panel("halftone", tone_map(halftone(FRAME, 5.0), curve="linear"), light),
        Panel("halftone, black", tone_map(halftone(FRAME, 5.0, colored=False), curve="linear"), light),
    ]


def distances() -> list[Panel]:
    from skimage.data import horse

    shape = np.repeat(1.0 - np.pad(horse(), 20, constant_values=True)[..., None].astype(np.float32), 4, axis=2)
    unchanged = pg.kernel(source="def unchanged(color: Image) -> vec4: return color[0, 0]")
    away = distance_field(FRAME, signed=True)
    rings = pg.kernel(
        source="""
def rings(distance: Image) -> vec4:
    d = distance[0, 0].r
    wave = smoothstep(-0.6, 0.6, sin(0.6 * d) / 0.6)
    return vec4(mix(vec3(0.95, 0.5, 0.1), vec3(0.1, 0.35, 0.6), smoothstep(-1.0, 1.0, d)) * (0.6 + 0.4 * wave), 1.0)
"""
    )
    return [
        Panel("the shape", unchanged(FRAME), {"frame": shape}),
        Panel("distance", distance_field(FRAME, unit_px=100.0), {"frame": shape}),
        Panel("lines of equal distance", rings(away), {"frame": shape}),
    ]


def holes() -> list[Panel]:
    random, whole = np.random.default_rng(5), np.ones((200, 250, 4), np.float32)
    whole[..., :3] = detail(street())[..., :3]
    scratched, (y, x) = whole.copy(), np.mgrid[:200, :250]
    for left, top, angle, width in random.random((25, 4)) * (250.0, 200.0, 3.2, 1.5):
        scratched[np.abs((x - left) * np.sin(angle) - (y - top) * np.cos(angle)) < width] = 0.0
    sparse = np.where(random.random((200, 250, 1)) < 0.15, whole, np.float32(0.0))
    unchanged = pg.kernel(source="def unchanged(color: Image) -> vec4: return color[0, 0]")
    return [
        Panel("scratches", unchanged(FRAME), {"frame": scratched}),
        Panel("filled", fill(FRAME), {"frame": scratched}),
        Panel("15 % of the pixels", unchanged(FRAME), {"frame": sparse}),
        Panel("filled", fill(FRAME), {"frame": sparse}),
    ]


def tubes() -> list[Panel]:
    small = street().reshape(95, 4, 169, 4, 3).mean(axis=(1, 3), dtype=np.float32)
    given = {"frame": np.asarray(srgb_to_linear(small), np.float32)}
    large = pg.target("crt", "rgba32f", (1272, 716))
    soft, sharp = crt(FRAME, 1, into=large), crt(FRAME, 1, 16.0, curve=0.0, mask="grille", into=large)
    return [
        Panel("stretched VGA mask", tone_map(soft, curve="linear"), given, middle=0.5),
        Panel("aperture grille, flat", tone_map(sharp, curve="linear"), given, middle=0.5),
    ]


def damage() -> list[Panel]:
    given = {"frame": street()}
    return [
        Panel("amount 0.2", glitch(FRAME, 0.2, 16, 6), given),
        Panel("amount 0.6", glitch(FRAME, 0.6, 60, 12, index=3), given),
    ]


FILTERS: tuple[Entry, ...] = (
    Entry(
        "Color grading", "`skimage.data.coffee()` in linear light",
        "Each step of the grade by itself: the white of a lamp, contrast around middle gray, split toning, lift, gamma "
        "and gain, and saturation.",
        grades, 3, 1.5,
    ),
    Entry("Hue, saturation, sepia", MOTORCYCLE, "Matrices on encoded color, as CSS has them.", colors, 3),
    Entry(
        "Sharpening", f"{MOTORCYCLE}, blurred with a deviation of one pixel",
        "An unsharp mask overshoots at edges; contrast adaptive sharpening holds back there.", sharp, 3, 1.25,
    ),
    Entry(
        "Smoothing that keeps edges", f"{MOTORCYCLE}, with noise",
        "The bilateral filter takes the noise and leaves the picture. Non-local means keep textures that come again. "
        "The Kuwahara filter paints the picture with a brush.",
        smooth, 2, 1.25,
    ),
    Entry(
        "Edges and shapes", MOTORCYCLE,
        "Where luminance rises, and the least and the largest number of each channel within two pixels.",
        shapes, 3, 1.25,
    ),
    Entry(
        "Distance field", "`skimage.data.horse()`",
        "How far each pixel is from a shape, and from its outside, by flooding in steps that halve.", distances, 3, 1.2,
    ),
    Entry(
        "Filling holes", f"{MOTORCYCLE}, with pixels missing",
        "What is transparent is filled from what is known around it; what is known stays.", holes, 2, 1.25,
    ),
    Entry(
        "A cathode ray tube", f"{MOTORCYCLE}, 169×95",
        "Lines of the beam, phosphors and some glow: the middle of each picture.", tubes, 2,
    ),
    Entry(
        "A bad signal", MOTORCYCLE, "Bands and blocks that lost their place, and colors that come apart.", damage, 2
    ),
    Entry(
        "Lens distortion", f"{MOTORCYCLE}, with a grid",
        "By the coefficients that OpenCV's calibration gives, and back by the same ones.", lenses, 3,
    ),
    Entry(
        "Sizes", MOTORCYCLE,
        "105 by 84 pixels, four times as large: by each filter of `resize`, and along edges.", sizes, 3, 1.25,
    ),
    Entry(
        "Squares, dither and dots", MOTORCYCLE,
        "Even squares; two levels of each channel; ink on paper, whose mean is the picture's color.", prints, 3, 1.25,
    ),
)  # fmt: skip
