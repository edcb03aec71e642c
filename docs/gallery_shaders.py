"""Entries of the gallery for shader files: the examples of docs/shaders, in the formats that are read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

import passgraph as pg
from docs.gallery_inputs import Picture, photograph, street
from docs.gallery_page import Entry, Panel
from passgraph.shaders.containers.effect import ShaderEffect
from passgraph.srgb import linear_to_srgb

FOLDER = Path(__file__).resolve().parent / "shaders"
FRAME, NEXT = pg.Input("frame"), pg.Input("next")
MOTORCYCLE = "the left picture of the stereo pair `skimage.data.stereo_motorcycle()`"
COFFEE = "`skimage.data.coffee()`"


def load(name: str) -> ShaderEffect:
    return pg.load_shader(FOLDER / name)


def coffee(size: tuple[int, int] = (676, 380)) -> Picture:
    return _sized(np.asarray(linear_to_srgb(photograph("coffee")[:, :, :3]), np.float32), size)


def small(size: tuple[int, int] = (320, 180)) -> Picture:
    return _sized(street(), size)


def _sized(picture: Picture, size: tuple[int, int]) -> Picture:
    bytes_ = np.uint8(np.rint(np.clip(picture, 0.0, 1.0) * 255.0))
    made = Image.fromarray(bytes_).resize(size, Image.Resampling.LANCZOS)
    return np.asarray(made, np.float32) / np.float32(255.0)


def film() -> list[Panel]:
    film = load("film.fs")
    return [
        Panel("film.fs", film(FRAME), {"frame": street()}),
        Panel("everything at its most", film(FRAME, fade=1.0, warmth=1.0, grain=1.0, edges=1.0), {"frame": street()}),
    ]


def glow() -> list[Panel]:
    glow = load("glow.fs")
    return [
        Panel("glow.fs", glow(FRAME), {"frame": coffee()}),
        Panel("threshold 0.3, tinted blue", glow(FRAME, threshold=0.3, tint=(0.3, 0.6, 1.0, 1.0)), {"frame": coffee()}),
    ]


def night() -> list[Panel]:
    night = load("night-vision.fs")
    return [
        Panel("night-vision.fs", night(FRAME), {"frame": street()}),
        Panel("white, gain 1.5", night(FRAME, phosphor=1, gain=1.5, tube=False), {"frame": street()}),
    ]


def reaction() -> list[Panel]:
    reaction, given = load("reaction-diffusion.fs"), {"frame": small()}
    return [
        Panel("reaction-diffusion.fs, frame 150", reaction(FRAME), given, frames=150),
        Panel("frame 600", reaction(FRAME), given, frames=600),
        Panel("feed 0.03, kill 0.062", reaction(FRAME, feed=0.03, kill=0.062), given, frames=600),
        Panel("guided 1", reaction(FRAME, guided=1.0), given, frames=600),
    ]


def dissolve() -> list[Panel]:
    dissolve, given = load("dissolve.glsl"), {"frame": street(), "next": coffee()}
    return [Panel(f"progress {at}", dissolve(FRAME, NEXT, progress=at), given) for at in (0.3, 0.5, 0.7)]


def ripples() -> list[Panel]:
    ripples = load("ripples.json")
    return [
        Panel(f"ripples.json, frame {frames}", ripples(FRAME), {"frame": street()}, frames=frames)
        for frames in (30, 150)
    ]


def kuwahara() -> list[Panel]:
    kuwahara = load("kuwahara.glsl")
    return [
        Panel(f"radius {radius}", kuwahara(FRAME, radius=radius, output_scale=1.0), {"frame": street()})
        for radius in (2, 6)
    ]


def crt() -> list[Panel]:
    crt, given = load("crt.glslp"), {"frame": small((160, 90))}
    return [
        Panel("crt.glslp", crt(FRAME), given),
        Panel("flat, without a mask", crt(FRAME, BULGE=0.0, MASK=0.0, LINES=0.8), given),
    ]


def halftone() -> list[Panel]:
    halftone = load("halftone.glsl")
    return [
        Panel(f"dots of {spacing} pixels", halftone(FRAME, spacing=float(spacing)), {"frame": coffee()})
        for spacing in (6, 12)
    ]


def hexes() -> list[Panel]:
    hexes = load("hex-tiles.glsl")
    return [
        Panel(f"sides of {side} pixels", hexes(FRAME, side=float(side)), {"frame": street()}) for side in (6, 12)
    ]  # fmt: skip


def _entry(title: str, file: str, inputs: str, text: str, panels: Callable[[], Sequence[Panel]], columns: int) -> Entry:
    return Entry(title, inputs, f"[{file}](shaders/{file}): {text}", panels, columns)


SHADERS: tuple[Entry, ...] = (
    _entry(
        "A film look", "film.fs", MOTORCYCLE,
        "an ISF file of one pass. Blacks are lifted, lights warm and shadows cool; the grain is noise of whole "
        "numbers, the same on every device.",
        film, 2,
    ),
    _entry(
        "A glow of passes", "glow.fs", COFFEE,
        "an ISF file of four passes. What is bright is cut out at a quarter of the size, blurred each way and added.",
        glow, 2,
    ),
    _entry(
        "Night vision", "night-vision.fs", MOTORCYCLE,
        "an ISF file with a choice and a switch: amplified luma on phosphor, noise, lines, the tube's edge.", night, 2,
    ),
    _entry(
        "Reaction and diffusion", "reaction-diffusion.fs", f"{MOTORCYCLE}, 320×180",
        "an ISF file with a persistent buffer of floats. Two chemicals of Gray and Scott go on from frame to frame.",
        reaction, 2,
    ),
    _entry(
        "A burning transition", "dissolve.glsl", f"{MOTORCYCLE}; {COFFEE}",
        "a transition as gl-transitions.com has them, along cells of noise with an edge that glows.", dissolve, 3,
    ),
    _entry(
        "Drops on water", "ripples.json", MOTORCYCLE,
        "a Shadertoy with a buffer that reads its last frame: waves, and the picture seen through them.", ripples, 2,
    ),
    _entry(
        "A painter's filter", "kuwahara.glsl", MOTORCYCLE,
        "an mpv hook. Of four squares around a pixel the mean of the most even one, after Kuwahara and others (1976).",
        kuwahara, 2,
    ),
    _entry(
        "A television tube", "crt.glslp", f"{MOTORCYCLE}, 160×90",
        "a libretro preset of two shaders: the beam softens lines, the mask and the curved glass show them larger.",
        crt, 2,
    ),
    _entry(
        "Four inks", "halftone.glsl", COFFEE, "plain GLSL: dots on screens that are turned, as in print.", halftone, 2
    ),
    _entry(
        "Six-sided tiles", "hex-tiles.glsl", MOTORCYCLE, "plain GLSL: tiles of one color each, with a bevel.", hexes, 2
    ),
)  # fmt: skip
