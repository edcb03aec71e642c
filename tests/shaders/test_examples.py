"""The shaders of docs/shaders draw what their originals draw on OpenGL, on every backend."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import original_mpv
import original_shadertoy
import pytest
from beside import Case, apart, pictures
from original import Original
from original_libretro import Chain, Drawn
from original_mpv import MpvFile
from originals import Picture

import passgraph as pg

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "shaders"
BACKENDS = ("numpy", "gl", "opencl")
SIZE = (48, 36)
FRAME = pictures(SIZE)[0]
#: Files that other files name.
PARTS = {"crt-beam.glsl", "crt-glass.glsl"}


def glsl(context: moderngl.Context, name: str) -> list[Picture]:
    """A shader with ``in vec2 uv`` and ``out vec4 color``, at its defaults."""
    text = (FOLDER / name).read_text().replace("#version 330\n", "")
    text = text.replace("in vec2 uv;", "#define uv pg_position").replace("out vec4 color;", "#define color shown_color")
    return [Original(context).run(text, SIZE, {"image": FRAME}, {})]


def mpv(context: moderngl.Context, name: str) -> list[Picture]:
    return [original_mpv.Original(context, MpvFile(FOLDER / name), SIZE, SIZE).draw(FRAME)]


def shadertoy(context: moderngl.Context, name: str) -> list[Picture]:
    """Frames of a buffer that reads itself, and of the picture made of it."""
    passes = {one["name"]: one["code"] for one in json.loads((FOLDER / name).read_text())["Shader"]["renderpass"]}
    water = original_shadertoy.Drawn("water", passes["Buffer A"], {0: "water"})
    image = original_shadertoy.Drawn("image", passes["Image"], {0: "water", 1: "picture"})
    run = original_shadertoy.Original(context, [water, image], passes["Common"], SIZE, {"picture": FRAME})
    return [run.frame(frame, frame / 60.0, 1.0 / 60.0, (0.0,) * 4) for frame in range(6)]


def libretro(context: moderngl.Context, name: str) -> list[Picture]:
    values = {name: float(one.default) for name, one in pg.load_shader(FOLDER / name).parameters.items()}
    beam, glass = ((FOLDER / f"crt-{part}.glsl").read_text() for part in ("beam", "glass"))
    large = (4 * SIZE[0], 4 * SIZE[1])
    passes = [Drawn(beam, SIZE, False, "clamp", "rgba32f"), Drawn(glass, large, True, "zero")]
    return [Chain(context, passes, values=values).frame(FRAME, 0)]


ORIGINALS: dict[str, Callable[[moderngl.Context, str], list[Picture]]] = {
    "halftone.glsl": glsl, "hex-tiles.glsl": glsl, "kuwahara.glsl": mpv, "ripples.json": shadertoy,
    "crt.glslp": libretro,
}  # fmt: skip
#: Frames and seeds of values of ISF files and transitions, whose hosts the tests have.
HOSTED = {
    "film.fs": (2, 1), "glow.fs": (1, 0), "night-vision.fs": (2, 0), "reaction-diffusion.fs": (5, 1),
    "dissolve.glsl": (1, 0),
}  # fmt: skip


def drawn(name: str, backend: str, frames: int) -> list[Picture]:
    effect = pg.load_shader(FOLDER / name)
    images = [pg.Input(image) for image in effect.images]
    values: dict[str, Any] = {"output_scale": 1.0} if name == "kuwahara.glsl" else {}
    graph = effect(*images, into=pg.target("shown", "rgba32f"), **values)
    with pg.compile(graph, backend=backend, size=SIZE) as program:
        return [np.asarray(program(**{image.name: FRAME for image in images})["shown"]) for _ in range(frames)]


def _shown(series: list[Picture]) -> list[Picture]:
    return [np.clip(picture, 0.0, 1.0) for picture in series]


def test_every_example_is_held_against_its_original() -> None:
    assert {path.name for path in FOLDER.iterdir()} == {*ORIGINALS, *HOSTED, *PARTS}


@pytest.mark.sampled
@pytest.mark.parametrize("name", ORIGINALS)
def test_an_example_draws_what_its_original_draws(name: str, context: moderngl.Context) -> None:
    original = _shown(ORIGINALS[name](context, name))
    assert original[-1].std() > 0.05, "a plain picture shows nothing"
    for backend in BACKENDS:
        assert apart(original, _shown(drawn(name, backend, len(original)))).agrees, backend


@pytest.mark.sampled
@pytest.mark.parametrize("name", HOSTED)
def test_an_isf_or_transition_example_draws_what_its_original_draws(name: str, context: moderngl.Context) -> None:
    frames, seed = HOSTED[name]
    case = Case(FOLDER / name, SIZE, seed, frames)
    original = case.original(context)
    assert original[-1].std() > 0.05, "a plain picture shows nothing"
    for backend in BACKENDS:
        assert apart(original, case.ours(backend)).agrees, backend
