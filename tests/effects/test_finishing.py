"""From an engine's bytes to a display's: fog, lens, glow, tones, edges and grain as one graph."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import bloom, depth_of_field, film_grain, fog, fxaa, tone_map
from passgraph.effects.surfaces.engine_depth import distances
from passgraph.srgb import srgb_to_linear
from tests.conftest import DEVICES
from tests.effects.scenes import Picture

SIZE = (64, 48)
HOLDS = pg.HardwareDepth(0.1, 100.0, reversed_z=True)
CAMERA = pg.Camera((0, 1.6, 0), (0, 1.6, -1))
NUMBER = pg.Value("number", int, default=0)


def engine() -> tuple[np.ndarray[tuple[int, ...], np.dtype[np.uint8]], Picture]:
    """A frame with edges and lamps, alpha of its own, and a depth buffer with sky."""
    y, x = np.mgrid[0:48, 0:64]
    near = np.hypot(x - 20, y - 28) < 12
    color = np.where(near[..., None], (240, 210, 60, 255), (40, 70, 110, 200)).astype(np.uint8)
    color[8:10, 40:42, :3] = 255
    distance = np.where(near, 1.0, np.where(y < 10, 0.0, 60.0 / (y + 1.0)))
    return color, HOLDS.depth(distance).astype(np.float32)[:, :, None]


STEPS = {
    "fog": lambda color, distance: fog(color, distance, density=0.05, camera=CAMERA),
    "lens": lambda color, distance: depth_of_field(color, distance, 1.0, 1.0, 90.0),
    "glow": lambda color, _: bloom(color, threshold=0.2, levels=2),
    "tones": lambda color, _: tone_map(color, curve="agx"),
    "edges": lambda color, _: fxaa(color),
    "grain": lambda color, _: film_grain(color, 0.04, index=NUMBER, into=pg.target("finished", "rgba8")),
}


def whole(color: pg.Target, depth: pg.Target) -> pg.Target:
    distance = distances(depth, HOLDS)
    for step in STEPS.values():
        color = step(color, distance)
    return color


FRAME, DEPTH = pg.Input("frame", "rgba8_srgb", SIZE), pg.Input("depth", "r32f", SIZE)


#: PoCL compiles it for long.
@pytest.mark.parametrize(
    "backend_name",
    DEVICES,
    indirect=True,
)
def test_one_graph_is_what_its_steps_are_one_by_one(backend_name: str) -> None:
    """On every backend against each step run alone on numpy, from bytes to bytes."""
    color, depth = engine()
    seen: Picture = color / np.float32(255)
    seen[:, :, :3] = srgb_to_linear(seen[:, :, :3])
    away = HOLDS.distance(depth).astype(np.float32)
    for step in STEPS.values():
        made = step(pg.Input("color"), pg.Input("distance"))
        with pg.compile(made, backend="numpy", size=SIZE) as program:
            names = {"color": seen, "distance": away}
            seen = program(**{name: names[name] for name in program.inputs})[made.name]
    shown = np.zeros_like(color)
    with pg.compile(whole(FRAME, DEPTH), backend=backend_name) as program:
        assert program(frame=color, depth=depth, into={"finished": shown})["finished"] is shown
    off = np.abs(shown.astype(np.float32) - seen * 255)
    assert (off > 1.01).mean() < 0.002
    assert 0.0 < (shown[:, :, 3] != color[:, :, 3]).mean() < 0.06  # along smoothed edges


def test_only_the_grain_is_new_in_each_frame() -> None:
    color, depth = engine()
    with pg.compile(whole(FRAME, DEPTH)) as program:
        first, again, second = (
            program(frame=color, depth=depth, number=number)["finished"].copy() for number in (1, 1, 2)
        )
    np.testing.assert_array_equal(first, again)
    assert (first[..., :3] != second[..., :3]).mean() > 0.3
    assert abs((first - second).mean()) < 0.002


def test_every_step_changes_the_picture() -> None:
    color, depth = engine()
    distance = distances(DEPTH, HOLDS)
    before: Picture | None = None
    made = FRAME
    for name, step in STEPS.items():
        made = step(made, distance)
        with pg.compile(made) as program:
            given = {"frame": color, "depth": depth}
            after = program(**{key: given[key] for key in program.inputs})[made.name].copy()
        if before is not None:
            assert (np.abs(after - before) > 1e-3).any(axis=2).mean() > 0.01, name
        before = after
