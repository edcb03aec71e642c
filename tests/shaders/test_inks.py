"""A long shader whose functions are called from many places: held against its own GLSL, all marks and manners of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from agreement_glsl import picture
from defined import definitions, precise, used
from original import HEAD, original

import passgraph as pg
from passgraph.language import scalar as s
from passgraph.plan.data import PixelStep
from passgraph.verify.report import other_bits

TEXT = Path(__file__).with_name("inks.glsl").read_text()
SIZE = (64, 48)
VALUES = {
    "pitch": 4.0, "angle_r": 0.26, "angle_g": 0.52, "angle_b": 0.79, "jitter": 0.0, "share": 0.7,
    "extent": (64.0, 48.0), "mark": 1, "manner": 1, "grey": False, "plain": False,
}  # fmt: skip
OTHERS = (
    *({"mark": 1 + n, "manner": 5 - n} for n in range(5)), {"jitter": 0.9, "pitch": 7.5, "mark": 0, "manner": 0},
    {"grey": True, "pitch": 2.0}, {"plain": True}, {"pitch": 0.0},
)  # fmt: skip


def test_every_branch_has_the_bits_of_the_original_with_settled_functions() -> None:
    """Position and functions are those of kernels, which drivers are free in."""
    shown = picture(*SIZE, seed=3)
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]].astype(np.float32)
    places = np.zeros_like(shown)
    places[..., 0] = (x + np.float32(0.5)) / np.float32(SIZE[0])
    places[..., 1] = (SIZE[1] - 1 - y + np.float32(0.5)) / np.float32(SIZE[1])
    head = HEAD.replace("330", "420").replace("out vec4", "precise out vec4") + definitions(used(TEXT))
    head += "uniform sampler2D places;\n#define at (texelFetch(places, ivec2(gl_FragCoord.xy), 0).xy)\n"
    text = precise(TEXT.replace("varying vec2 at;", ""))
    given = {name: value if isinstance(value, tuple) else pg.Value(name) for name, value in VALUES.items()}
    made = pg.kernel(glsl=TEXT, name="inks")(
        pg.Input("picture", "rgba32f", SIZE), into=pg.target("out", "rgba32f"), **given
    )
    with original() as driver, pg.compile(made, backend="numpy", size=SIZE) as program:
        assert sum(s.count(step.program.body) for step in program.plan.steps if isinstance(step, PixelStep)) > 15_000
        for other in OTHERS:
            values = {**VALUES, **other}
            found = program(picture=shown, **{name: v for name, v in values.items() if name != "extent"})["out"]
            there = driver.run(text, SIZE, {"picture": shown, "places": places}, values, head)
            assert not other_bits(found, there).any(), other
