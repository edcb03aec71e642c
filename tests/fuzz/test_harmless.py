"""What makes programs faster changes no bit: optimisations, order, tiles and threads, on effects and random cases.

Not of pictures alone: every target of a graph is asked for by itself, so that chains of passes end at each of them.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx as nx
import pytest
from hypothesis import HealthCheck, given, settings

import passgraph as pg
import passgraph.backends.numpy.pixels.chains as numpy_chains
import passgraph.backends.numpy.pixels.runner as numpy_pixels
import passgraph.backends.numpy.raster.draw as numpy_raster
import passgraph.backends.opencl.pixel as opencl_pixel
import passgraph.backends.opencl.raster as opencl_raster
import passgraph.plan.build
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.commands.command_graph import Job, scene_job
from passgraph.effects.effect_table import EFFECTS, Effect
from passgraph.graph.targets import named_outputs
from passgraph.verify.fuzz.cases import EXACT, output_of, run, same_bits
from passgraph.verify.fuzz.random_draws import drawn, draws
from passgraph.verify.fuzz.random_graphs import OPTIMISATIONS, graphs, grown, plannable, run_frames
from passgraph.verify.fuzz.random_kernels import Picture, unit
from tests.conftest import DEVICES, require
from tests.plan.orders import shuffled

pytestmark = pytest.mark.slow

SIZE = (48, 32)
FEW = settings(
    max_examples=3, deadline=None, database=None, derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)  # fmt: skip
#: Smaller than the defaults: what is compared is how programs run, not how they look.
SMALL = {"map_size": 64, "taps": 4, "radius_px": 3, "levels": 2, "draws": 4}

OPTIMISED = pg.Options()


def job_of(effect: Effect) -> Job:
    """An effect on small pictures, or on the scene or world that is shipped."""
    known = {parameter.name for parameter in effect.parameters}
    small = {name: value for name, value in SMALL.items() if name in known}
    if effect.takes in ("scene", "world2d"):
        return scene_job(effect, None, SIZE, small)
    pictures = {"frame": unit(1, SIZE), "depth": unit(2, SIZE, 1) + 1}
    names = ["frame", "depth"] if effect.takes == "picture+depth" else ["frame"]
    targets = [pg.Input(name, "rgba32f" if name == "frame" else "r32f", SIZE) for name in names]
    return Job(named_outputs(effect.build(*targets, **small)), SIZE, {name: pictures[name] for name in names})


def results(job: Job, backend: Backend, options: pg.Options) -> list[dict[str, Picture]]:
    """Two runs: what is static is computed in the first only."""
    with pg.compile(job.outputs, backend, job.size, options) as program:
        return [dict(program(**job.given)) for _ in range(2)]


def assert_same(one: list[dict[str, Picture]], other: list[dict[str, Picture]], what: str) -> None:
    for number, (a, b) in enumerate(zip(one, other, strict=True)):
        for name in a:
            assert same_bits(a[name], b[name]), f"{what}: {name} of run {number}"


ON_DEVICES = [(name, device) for name in EFFECTS for device in DEVICES]


@pytest.mark.parametrize(("name", "backend_name"), ON_DEVICES)
def test_optimisations_and_order_change_no_bit_of_an_effect(
    name: str, backend: Backend, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each optimisation off by itself; of effects on scenes, which take long to compile, all off at once.

    And in an order of passes by chance, another on each device.
    """
    job = job_of(EFFECTS[name])
    # GL's compilers may contract a * b + c, so there kernels stay as they are.
    off = [o for o in OPTIMISATIONS if backend.name in EXACT or o not in ("fuse", "simplify")]
    quick = EFFECTS[name].takes.startswith("picture")
    expected = results(job, backend, pg.Options())
    for chosen in [[o] for o in off] if quick else [off]:
        options = replace(pg.Options(), **dict.fromkeys(chosen, False))
        assert_same(expected, results(job, backend, options), f"without {chosen}")
    way = DEVICES.index(backend.name)
    monkeypatch.setattr(passgraph.plan.build, "order", lambda work: shuffled(work, way))
    assert_same(expected, results(job, backend, pg.Options()), f"in another order ({way})")


def targets_of(outputs: dict[str, pg.Target]) -> dict[str, pg.Target]:
    """Every target that a pass behind the outputs writes, by a name of its own."""
    graph = pg.graph(*outputs.values())
    made = [node for node in nx.topological_sort(graph) if isinstance(node, pg.Target) and node.made_by is not None]
    return {f"{number} {target.name}": target for number, target in enumerate(made)}


def as_written(job: Job, targets: dict[str, pg.Target], backend: Backend) -> list[dict[str, Picture]]:
    """All targets of two runs with nothing optimised; both are the same where nothing is kept from run to run."""
    options = replace(pg.Options(), **dict.fromkeys(OPTIMISATIONS, False))
    runs = results(replace(job, outputs=targets), backend, options)
    with pg.compile(targets, "null", job.size) as program:
        if not program.has_history:
            assert_same(runs[:1], runs[1:], "a second run")
    return runs


@pytest.mark.parametrize(("name", "backend_name"), ON_DEVICES)
def test_no_target_on_the_way_is_another_one_when_optimised(name: str, backend: Backend) -> None:
    """All of them results, then some beside the picture: what is needed further on differs each time."""
    job = job_of(EFFECTS[name])
    targets = targets_of(job.outputs)
    expected = as_written(job, targets, backend)
    # GL's compilers may contract a * b + c where passes are fused.
    options = replace(pg.Options(), fuse=backend.name in EXACT, simplify=backend.name in EXACT)
    assert_same(expected, results(replace(job, outputs=targets), backend, options), "all at once")
    for title in list(targets)[2::5]:
        assert_target(job, title, targets[title], expected, backend, "beside the picture", options)


def assert_target(
    job: Job, title: str, target: pg.Target, expected: list[dict[str, Picture]], backend: Backend, what: str,
    options: pg.Options = OPTIMISED,
) -> None:  # fmt: skip
    """A target on the way as one more result: chains of passes have to end there."""
    made = results(replace(job, outputs={title: target, **job.outputs}), backend, options)
    assert_same([{title: one[title]} for one in expected], [{title: one[title]} for one in made], what)


#: Constants of the numpy backend that say how targets are cut into pieces, and which passes are chained.
PIECES: tuple[dict[str, int], ...] = (
    {"MIN_PIXELS_A_PIECE": 64},
    {"MIN_PIXELS_A_PIECE": 100, "MIN_SHARE": 1, "MAX_AGAIN": 10**6},
    {"MIN_PIXELS_A_PIECE": 64, "MIN_SHARE": 1, "MIN_COLUMNS": 16, "RING_BYTES": 4 * 1024, "MAX_AGAIN": 10**6},
    {"MIN_PIXELS_A_PIECE": 300, "MIN_SHARE": 2, "MIN_COLUMNS": 1, "RING_BYTES": 6 * 1024, "MAX_AGAIN": 60},
    {"MIN_PIXELS_A_PIECE": 1, "MIN_SHARE": 1, "MAX_AGAIN": 0},
)
THREADS = (1, 2, 3, 5)


def set_pieces(patch: pytest.MonkeyPatch, constants: dict[str, int]) -> None:
    for name, value in constants.items():
        patch.setattr(numpy_pixels if name == "MIN_PIXELS_A_PIECE" else numpy_chains, name, value)


@pytest.mark.parametrize("name", list(EFFECTS))
def test_pieces_and_threads_change_no_bit_of_any_target(name: str) -> None:
    """Every target in pieces of one kind, another for each; the last in all of them."""
    job = job_of(EFFECTS[name])
    targets = targets_of(job.outputs)
    with open_backend("numpy:1") as backend:
        expected = as_written(job, targets, backend)
    for way, constants in enumerate(PIECES):
        threads = THREADS[way % len(THREADS)]
        with pytest.MonkeyPatch.context() as patch, open_backend(f"numpy:{threads}") as backend:
            set_pieces(patch, constants)
            for title in {*list(targets)[way :: len(PIECES)], list(targets)[-1]}:
                what = f"{constants}, {threads} threads"
                assert_target(job, title, targets[title], expected, backend, what)


@settings(FEW, max_examples=5)
@given(case=graphs())
def test_pieces_and_threads_change_no_bit_of_a_graph(case: dict[str, Any]) -> None:
    """Every target of a random graph, beside its results, in pieces of every kind."""
    outputs = grown(case)
    if not plannable(outputs):
        return
    targets = targets_of(outputs)
    with open_backend("numpy:1") as backend:
        expected = run_frames(targets, backend, replace(pg.Options(), **dict.fromkeys(OPTIMISATIONS, False)))
    for way, constants in enumerate(PIECES):
        with pytest.MonkeyPatch.context() as patch, open_backend(f"numpy:{THREADS[way % 4]}") as backend:
            set_pieces(patch, constants)
            for title, target in targets.items():
                made = run_frames({**outputs, title: target}, backend, pg.Options())
                kept = [{title: one[title]} for one in made]
                assert_same([{title: one[title]} for one in expected], kept, f"{constants}")


def test_pieces_are_other_pieces() -> None:
    """The constants do what the tests above count on: more pieces, narrower ones, more and fewer chains."""
    job = job_of(EFFECTS["gaussian-blur"])
    seen = set()
    for constants in ({}, *PIECES):
        tiles: list[Any] = []

        def tiling(*given: Any, tiles: list[Any] = tiles) -> Any:
            tiles.append(numpy_chains.tiling(*given))
            return tiles[-1]

        with pytest.MonkeyPatch.context() as patch, open_backend("numpy:2") as backend:
            set_pieces(patch, constants)
            patch.setattr(numpy_pixels, "tiling", tiling)
            results(job, backend, pg.Options())
        seen.add(tuple(tiles))
    assert len(seen) >= len(PIECES)
    assert any(None in tiles for tiles in seen), "a chain is refused"
    assert any(tile.columns > 1 for tiles in seen for tile in tiles if tile is not None)


@FEW
@given(case=draws())
def test_numbers_of_threads_and_of_triangles_at_once_change_no_bit_of_a_draw(case: dict[str, Any]) -> None:
    outputs, size = drawn(case), (case["size"][0], case["size"][1])
    seen = []
    for threads, chunk in ((1, 4096), (3, 4096), (2, 5), (5, 1)):
        with pytest.MonkeyPatch.context() as patch, open_backend(f"numpy:{threads}") as backend:
            patch.setattr(numpy_raster, "CHUNK", chunk)
            seen.append(run(outputs, backend, size))
    for other in seen[1:]:
        assert_same(seen[:1], [other], "threads and triangles")


#: Prints a digest of every target of some draws, in tiles of a side that is compiled into their code.
TILED = """
import hashlib, sys
import passgraph.backends.numpy.raster.layout as names
names.TILE = int(sys.argv[1])
names.SPAN_ROWS = names.TILE + 3  # made of the side when it was imported
from passgraph.backends.numpy.machine.shipped import Shipped
Shipped.is_current = lambda *_: False  # what is shipped was made for the side as it is
from passgraph.verify.conformance import cases
from passgraph.verify.fuzz.cases import run
from passgraph.backends.registry import open_backend
chosen = ("cull none, lean", "several targets", "discard", "blend alpha", "stencil increment on passed", "depth only",
          "polygon offset 1.5, 0")
with open_backend("numpy:2") as backend:
    for case in cases(["draw states"]):
        if case.name in chosen:
            for name, picture in run(dict(case.graph()), backend, (150, 131)).items():
                print(case.name, name, hashlib.sha256(picture.tobytes()).hexdigest())
"""


def test_tiles_of_other_sides_change_no_bit_of_a_draw_on_numpy(tmp_path: Path) -> None:
    """Each side in a process and with a cache of its own."""
    seen = []
    for side in (64, 16, 32, 128):
        environment = {**os.environ, "PASSGRAPH_CACHE": str(tmp_path / str(side))}
        done = subprocess.run(
            [sys.executable, "-c", TILED, str(side)], env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr[-2000:]
        seen.append(done.stdout.splitlines())
    assert len(seen[0]) >= 10
    for other in seen[1:]:
        assert other == seen[0]


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
