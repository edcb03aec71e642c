"""What makes programs faster changes no bit: optimisations, order, tiles and threads, on effects and random draws."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

import passgraph as pg
import passgraph.backends.opencl.pixel as opencl_pixel
import passgraph.backends.opencl.raster as opencl_raster
import passgraph.plan.build
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.commands.sources import Job, scene_job, world_job
from passgraph.effects.registry import EFFECTS, Effect
from passgraph.fuzz.cases import EXACT, output_of, run, same_bits
from passgraph.fuzz.draws import drawn, draws
from passgraph.fuzz.graphs import OPTIMISATIONS
from passgraph.fuzz.pictures import Picture, unit
from passgraph.program import named_outputs
from tests.conftest import require
from tests.plan.orders import shuffled

SIZE = (48, 32)
FEW = settings(
    max_examples=3, deadline=None, database=None, derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)  # fmt: skip
#: Smaller than the defaults: what is compared is how programs run, not how they look.
SMALL = {"map_size": 64, "taps": 4, "radius_px": 3, "levels": 2, "draws": 4}


def job_of(effect: Effect) -> Job:
    """An effect on small pictures, or on the scene or world that is shipped."""
    known = {parameter.name for parameter in effect.parameters}
    small = {name: value for name, value in SMALL.items() if name in known}
    if effect.takes == "scene":
        return scene_job(effect, None, SIZE, small)
    if effect.takes == "world2d":
        return world_job(effect, None, SIZE, small)
    pictures = {"frame": unit(1, SIZE), "depth": unit(2, SIZE, 1) + 1}
    names = ["frame", "depth"] if effect.takes == "picture+depth" else ["frame"]
    targets = [pg.Input(name, "rgba32f" if name == "frame" else "r32f", SIZE) for name in names]
    return Job(named_outputs(effect.function(*targets, **small)), SIZE, {name: pictures[name] for name in names})


def results(job: Job, backend: Backend, options: pg.Options) -> list[dict[str, Picture]]:
    """Two runs: what is static is computed in the first only."""
    with pg.compile(job.outputs, backend, job.size, options) as program:
        return [dict(program(**job.given)) for _ in range(2)]


def assert_same(one: list[dict[str, Picture]], other: list[dict[str, Picture]], what: str) -> None:
    for number, (a, b) in enumerate(zip(one, other, strict=True)):
        for name in a:
            assert same_bits(a[name], b[name]), f"{what}: {name} of run {number}"


@pytest.mark.parametrize("name", EFFECTS)
def test_optimisations_and_order_change_no_bit_of_an_effect(
    name: str, backend: Backend, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each optimisation off by itself; of effects on scenes, which take long to compile, all off at once."""
    job = job_of(EFFECTS[name])
    # GL's compilers may contract a * b + c, so there kernels stay as they are.
    off = [o for o in OPTIMISATIONS if backend.name in EXACT or o not in ("fuse", "simplify")]
    quick = EFFECTS[name].takes.startswith("picture")
    expected = results(job, backend, pg.Options())
    for chosen in [[o] for o in off] if quick else [off]:
        options = replace(pg.Options(), **dict.fromkeys(chosen, False))
        assert_same(expected, results(job, backend, options), f"without {chosen}")
    for way in range(3):
        monkeypatch.setattr(passgraph.plan.build, "order", lambda work, way=way: shuffled(work, way))
        assert_same(expected, results(job, backend, pg.Options()), f"in another order ({way})")


@pytest.mark.parametrize("name", ["gaussian-blur", "soft-shadow", "light2d"])
def test_numbers_of_threads_change_no_bit_of_an_effect(name: str) -> None:
    job = job_of(EFFECTS[name])
    seen = []
    for threads in (1, 2, 5):
        with open_backend(f"numpy:{threads}") as backend:
            seen.append(results(job, backend, pg.Options()))
    for other in seen[1:]:
        assert_same(seen[0], other, name)


@FEW
@given(case=draws())
def test_numbers_of_threads_change_no_bit_of_a_draw(case: dict[str, Any]) -> None:
    outputs, size = drawn(case), (case["size"][0], case["size"][1])
    seen = []
    for threads in (1, 3):
        with open_backend(f"numpy:{threads}") as backend:
            seen.append(run(outputs, backend, size))
    assert_same(seen[:1], seen[1:], "threads")


@pytest.mark.opencl
@settings(FEW, max_examples=2)
@given(case=draws())
def test_tiles_change_no_bit_of_a_draw(case: dict[str, Any]) -> None:
    """Tiles of other sides, a work-item for each and a work-group for each."""
    require("opencl")
    outputs, size = drawn(case), (case["size"][0], case["size"][1])
    with pytest.MonkeyPatch.context() as patch:
        seen = []
        for serial, side in ((True, 32), (True, 8), (False, 16)):
            patch.setattr(opencl_raster, "TILE_SERIAL", side)
            with open_backend("opencl") as backend:
                backend.is_cpu = serial  # type: ignore[attr-defined]
                seen.append(run(outputs, backend, size))
    for other in seen[1:]:
        assert_same(seen[:1], [other], "tiles")


@pytest.mark.opencl
def test_work_groups_change_no_bit_of_a_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    """Narrow groups have an inner kernel where wide ones have borders only."""
    require("opencl")
    text = "def k(c: Image) -> vec4: return sin(c[-2, 1] * 3.0) + c[3, 0] * c[0, -1] + sqrt(abs(c[1, 1]))\n"
    case = {"kind": "kernel", "text": text, "format": "rgba32f", "border": "mirror", "special": False, "seed": 0}
    out = output_of(case, text)
    seen = []
    for group in (128, 16, 1):
        monkeypatch.setattr(opencl_pixel, "GROUP", group)
        with open_backend("opencl") as backend:
            seen.append(run({"out": out}, backend, None, c=unit(0, (67, 19))))
    for other in seen[1:]:
        assert_same(seen[:1], [other], "groups")


def test_the_check_notices_a_difference() -> None:
    assert not same_bits(unit(0, (2, 2)), unit(1, (2, 2)))
