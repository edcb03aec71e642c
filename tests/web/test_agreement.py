"""What a browser computes, held against the bounds of each pass."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import vec4
from passgraph.backends.base import Promises
from passgraph.backends.webgpu.chromium import SWIFTSHADER_PX
from passgraph.effects import auto_exposure, bloom, soft_shadow, vignette
from passgraph.graph.targets import named_outputs
from passgraph.plan.data import CopyStep
from passgraph.verify.conformance.case_inputs import quad
from passgraph.verify.oracle.backend import OracleBackend
from passgraph.verify.oracle.pass_bounds import OPTIONS, Key, Passes, Picture
from passgraph.verify.report import MOST_AMBIGUOUS
from passgraph.web import export_web
from tests.web.browser import CHROMIUM, opened, read, run

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")

BROWSER = Promises(SWIFTSHADER_PX)
SHADERS = Path(__file__).resolve().parents[2] / "docs" / "shaders"


def picture() -> Any:
    """A gradient with noise, 24x16, some of it transparent."""
    made = np.random.default_rng(5).integers(0, 256, (16, 24, 4), np.uint8)
    made[:8, :, 0] = np.linspace(0, 255, 24)
    made[..., 3] = np.where(made[..., 3] < 64, 128, 255)
    return made


def held(outputs: Any, folder: Path, given: dict[str, Any], values: dict[str, Any], runs: int = 1) -> int:
    """Hold every pass of each run in the browser, on the browser's own pictures; return how many were held."""
    named = named_outputs(outputs)
    pictures = {name: value for name, value in given.items() if isinstance(value, np.ndarray)}
    passes = Passes(named, None if pictures else (48, 32), [{**given, **values}] * runs)
    export_web(named, folder, size=None if pictures else (48, 32), options=OPTIONS, **given)
    got: dict[Key, Picture] = {}
    with opened(folder) as page:
        assert page.evaluate("globalThis.failed") is None
        for frame in range(runs):
            run(page, values)
            got |= written_in(page, passes, frame)
        assert (page.asked, page.faults) == ({page.host}, [])
    return within(passes, got)


def written_in(page: Any, passes: Passes, frame: int = 0) -> dict[Key, Picture]:
    """What each target of a run holds at its end, by the step that wrote it last."""
    last = {resource: number for number, step in enumerate(passes.plan.steps) for resource in step.writes}
    return {
        (frame, number, resource): read(page, passes.plan.resources[resource].name) for resource, number in last.items()
    }


def within(passes: Passes, got: dict[Key, Picture], most_ambiguous: float = MOST_AMBIGUOUS) -> int:
    """Assert that pictures are within bounds; passes read what the browser made of the passes before."""
    expected, _ = passes.allowed(BROWSER)
    oracle, count = OracleBackend(BROWSER), 0
    for written in passes.written(oracle, {**expected, **got}):
        for key in written.keys() & got.keys():
            step = passes.plan.steps[key[1]]
            if isinstance(step, CopyStep) or key[2] in step.reads:
                continue  # a draw over another keeps pixels of that one, which cannot be read in between
            allowed = oracle.found[id(step)][step.writes.index(key[2])]
            outside = allowed.values.without(got[key]).any(axis=2) & ~allowed.ambiguous
            assert not outside.any(), f"{step.name}: {int(outside.sum())} pixels outside of their bounds"
            assert allowed.ambiguous.mean() <= most_ambiguous, step.name
            count += 1
    return count


def test_a_picture_effect_with_a_parameter(tmp_path: Path) -> None:
    outputs = vignette(pg.Input("frame", "rgba8"), strength=pg.Value("strength", default=1.0))
    assert held(outputs, tmp_path, {"frame": picture()}, {"strength": 0.5}) == 1


@pg.struct
class Corner:
    position: vec4


@pg.vertex
def place(vertex: pg.Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0))


@pg.fragment
def depth_of(corner: Corner) -> float:
    return pg.fragment_depth()


def test_a_polygon_offset_moves_the_depth_that_a_kernel_reads_without_a_depth_target(tmp_path: Path) -> None:
    """WebGPU offsets depths only where a draw has a depth target."""
    seen = pg.draw(
        quad(), vertex=place, fragment=depth_of, into=pg.target("seen", "r32f"), polygon_offset=(0.0, 2.0**20)
    )
    assert held(seen, tmp_path, {}, {}) == 1


@pytest.mark.slow
def test_bloom(tmp_path: Path) -> None:
    outputs = bloom(pg.Input("frame", "rgba8_srgb"), threshold=pg.Value("threshold", default=1.0), levels=2)
    assert held(outputs, tmp_path, {"frame": picture()}, {"threshold": 0.25}) > 3


def test_history(tmp_path: Path) -> None:
    assert held(auto_exposure(pg.Input("frame", "rgba8_srgb")), tmp_path, {"frame": picture()}, {}, runs=3) > 6


@pytest.mark.slow
def test_a_shadertoy_whose_buffer_goes_on(tmp_path: Path) -> None:
    shader = pg.load_shader(SHADERS / "ripples.json")
    images = {name: picture() for name in shader.images}
    assert held(shader(*map(pg.Input, images)), tmp_path, images, {}, runs=2) >= 4


@pytest.mark.slow
def test_soft_shadows_of_the_shipped_scene(tmp_path: Path) -> None:
    scene = pg.Scene.shipped()
    given = {"camera": scene.camera, "light": scene.lights[0]}
    assert held(soft_shadow(scene, display=True), tmp_path, given, {}) > 10
