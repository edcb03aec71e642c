"""Hostile draws: clip coordinates that no camera makes, on every state of a draw, judged by the oracle.

A draw is compiled once for each of a few setups; a case is then only new vertices and triangles, so that thousands
run in a minute.  Cases run in a process of their own, which a crash or a loop without end ends: its last line names
the case.

    python -m tests.hostile.draws --cases 5000 --seed 1 --backend numpy
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend, Block
from passgraph.backends.registry import open_backend
from passgraph.graph.draw_state import COMPARE, CULL, EQUATIONS, FACTORS, STENCIL_OPERATIONS, Blend, Stencil
from passgraph.language.kernel import Kernel, kernel_from_text
from passgraph.plan.build import build
from passgraph.plan.data import DrawStep, Options, Plan
from passgraph.verify.conformance.case_inputs import Soup
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.backend import OracleBackend
from tests.hostile.guard import guarded, guarded_copy

Float32 = NDArray[np.float32]

KERNELS = """
class Corner:
    position: vec4
    value: vec4

def place(vertex: Vertex) -> Corner:
    return Corner(vertex.color, vec4(vertex.position, 1.0))

def paint(corner: Corner) -> vec4:
    return corner.value

def holes(corner: Corner) -> vec4:
    if (pixel().x + pixel().y) % 3 == 0:
        discard()
    return corner.value

def facing(corner: Corner) -> vec4:
    return vec4(corner.value.rgb, 1.0) if front_facing() else vec4(fragment_depth())
"""
#: Larger meshes are only drawn: layers over layers take the oracle long.
MOST_JUDGED = 16
#: Seconds after which a batch counts as hung, for each of its cases and for compiling.
CASE_SECONDS, START_SECONDS = 2.0, 120.0
#: The simulator's, which interprets every instruction.
SIMULATED_SECONDS = 20.0


@dataclass(frozen=True)
class Setup:
    """A draw as it is compiled."""

    size: tuple[int, int]
    fragment: str | None = "paint"
    format: str = "rgba32f"
    depth: str | None = None
    state: tuple[tuple[str, Any], ...] = ()

    def graph(self) -> dict[str, pg.Target]:
        mesh = Soup(np.zeros((3, 3), np.float32), np.arange(3, dtype=np.int32)[None], np.ones((3, 4), np.float32))
        depth = pg.target("depth", self.depth, clear=1.0) if self.depth else None
        vertex = Kernel(kernel_from_text(KERNELS, "place"), "vertex")
        if self.fragment is None:
            return {"depth": pg.draw(mesh, vertex=vertex, depth=depth, **dict(self.state))}
        fragment = Kernel(kernel_from_text(KERNELS, self.fragment), "fragment")
        into = pg.target("color", self.format, clear=0.25)
        return {"color": pg.draw(mesh, vertex=vertex, fragment=fragment, into=into, depth=depth, **dict(self.state))}


COUNTING = Stencil(compare="not_equal", reference=3, passed="increment", depth_fail="decrement_wrap", fail="invert")
#: Odd and tiny sizes, both ways of shading (a tile at once, fragment by fragment), every fixed function.
SETUPS = (
    Setup((1, 1)),
    Setup((1, 7), "facing", "rgba8", "depth32f"),
    Setup((65, 1), "paint", "rgba16f", "depth32f", (("cull", "back"),)),
    Setup((64, 64), "paint", "rgba32f", "depth32f", (("depth_compare", "greater_equal"), ("cull", "front"))),
    Setup((129, 3), "holes", "rgba32f", "depth32f_stencil8", (("stencil", COUNTING),)),
    Setup((31, 33), "paint", "rgba16", None, (("blend", Blend("one", "one")),)),
    Setup((2, 200), "facing", "rgba32f", "depth32f", (("polygon_offset", (1.5, -4.0)), ("depth_write", False))),
    Setup((21, 17), None, "rgba32f", "depth32f"),
    Setup((70, 9), "holes", "rgba8", "depth32f", (("color_mask", (True, False, True, False)),)),
)


def setup_of(number: int) -> Setup:
    """The setups above, then random ones."""
    if number < len(SETUPS):
        return SETUPS[number]
    random = np.random.default_rng([7, number])

    def one(options: Any) -> Any:
        return options[int(random.integers(len(options)))]

    depth = one((None, "depth32f", "depth32f_stencil8"))
    state: dict[str, Any] = {"cull": one(CULL), "depth_compare": one(COMPARE), "depth_write": one((True, False))}
    state["polygon_offset"] = one(((0.0, 0.0), (0.0, 4.0), (-1.5, 2.0)))
    if depth == "depth32f_stencil8":
        bits = [int(x) for x in random.integers(0, 256, 3)]
        state["stencil"] = Stencil(one(COMPARE), *bits, *(one(STENCIL_OPERATIONS) for _ in range(3)))
    if random.random() < 0.4:
        state["blend"] = Blend(one(FACTORS), one(FACTORS), one(EQUATIONS))
    if random.random() < 0.3:
        state["color_mask"] = tuple(bool(x) for x in random.integers(0, 2, 4))
    size = tuple(int(x) for x in random.integers(1, (90, 40)))
    return Setup(
        (size[0], size[1]), one(("paint", "holes", "facing")), one(("rgba32f", "rgba16f", "rgba8", "rgba16")), depth,
        tuple(state.items()),
    )  # fmt: skip


# Cases

SPECIAL = np.array(
    [0.0, -0.0, 1.0, -1.0, 8.0, -8.0, np.inf, -np.inf, np.nan, 3.4028235e38, -3.4028235e38, 1.1754944e-38, 1e-45, 1e8,
     1e16, -1e16, 1e-16, 1e30, 1e-30, 3e37],
    np.float32,
)  # fmt: skip


def clip_of(random: np.random.Generator, count: int) -> Float32:
    """(count, 4) clip coordinates of one or several kinds."""
    kinds = random.choice(len(KINDS), size=int(random.integers(1, 3)), replace=False)
    made = [np.asarray(KINDS[kind](random, count), np.float32) for kind in kinds]
    chosen = random.integers(0, len(made), count)
    return np.choose(chosen[:, None], made).astype(np.float32) if len(made) > 1 else made[0]


def _seen(random: np.random.Generator, count: int) -> Any:
    w = 10.0 ** random.uniform(-1, 1, (count, 1))
    return np.concatenate([random.uniform(-1.5, 1.5, (count, 3)) * w, w], axis=1)


def _scaled(random: np.random.Generator, count: int) -> Any:
    """w of one triangle from ordinary to 1e30 times as much."""
    reach = random.choice([3, 8, 16, 30])
    return _seen(random, count) * 10.0 ** random.uniform(-reach, reach, (count, 1)) * random.choice([1, 1, -1])


def _one_huge(random: np.random.Generator, count: int) -> Any:
    ratio = 10.0 ** random.choice([3, 6, 8, 12, 16, 30, 37])
    return random.uniform(-1, 1, (count, 4)) * np.where(random.random((count, 1)) < 0.3, ratio, 1.0)


def _bits(random: np.random.Generator, count: int) -> Any:
    return random.integers(0, 1 << 32, (count, 4), dtype=np.uint32).view(np.float32)


def _special(random: np.random.Generator, count: int) -> Any:
    made = _seen(random, count).astype(np.float32)
    return np.where(random.random((count, 4)) < 0.3, random.choice(SPECIAL, (count, 4)), made)


def _on_planes(random: np.random.Generator, count: int) -> Any:
    """On planes of the volume and of the guard band, or the next number from there."""
    w = 10.0 ** random.uniform(-3, 3, (count, 1)) * random.choice([1.0, 1.0, 1.0, -1.0, 0.0], (count, 1))
    made = (w * random.choice([-8.0, -1.0, 0.0, 1.0, 8.0, 0.5], (count, 4))).astype(np.float32)
    made[:, 3:] = w
    side = np.where(random.random((count, 4)) < 0.5, np.inf, -np.inf).astype(np.float32)
    return np.where(random.random((count, 4)) < 0.3, np.nextafter(made, side), made)


def _through_the_eye(random: np.random.Generator, count: int) -> Any:
    """Triangles whose corners nearly add up to the eye."""
    made = random.uniform(-1, 1, (count, 4)).astype(np.float32)
    made[2::3] = -(made[0::3][: len(made[2::3])] + made[1::3][: len(made[2::3])])
    return made


def _slivers(random: np.random.Generator, count: int) -> Any:
    along = random.uniform(-2, 2, (1, 2)) + random.uniform(-2, 2, (1, 2)) * random.uniform(-1, 1, (count, 1))
    place = along + random.normal(0, 10.0 ** random.uniform(-6, -2), (count, 2))
    w = 10.0 ** random.uniform(0, 3, (count, 1))
    return np.concatenate([place * w, random.uniform(-1, 1, (count, 1)) * w, w], axis=1)


KINDS: tuple[Callable[[np.random.Generator, int], Any], ...] = (
    _seen, _scaled, _one_huge, _bits, _special, _on_planes, _through_the_eye, _slivers,
)  # fmt: skip


def case_of(seed: int) -> Soup:
    """Vertices with clip coordinates for colours, and triangles of them: none, few, many; of any indices."""
    random = np.random.default_rng([11, seed])
    count = int(random.choice([0, 1, 2, 3, 8, 16, 200, 9000], p=[0.02, 0.2, 0.25, 0.2, 0.2, 0.1, 0.02, 0.01]))
    vertices = max(3 * count, 1)
    clip = clip_of(random, vertices)
    values = random.uniform(0, 1, (vertices, 3))
    if random.random() < 0.1:
        values *= 10.0 ** random.uniform(-36, 36)
    triangles = np.arange(3 * count).reshape(-1, 3)
    how = random.integers(5)
    if how == 1:  # shared, in any order, a corner twice
        triangles = random.integers(0, vertices, (count, 3))
    elif how == 2:  # the last vertices only
        triangles = vertices - 1 - random.integers(0, min(3, vertices), (count, 3))
    elif how == 3 and count:  # one triangle over and over
        triangles = np.tile(triangles[:1], (count, 1))
    return Soup(values.astype(np.float32), triangles.astype(np.int32), clip)


# Runs


class Drawn:
    """A setup compiled on a backend and on the oracle."""

    def __init__(self, setup: Setup, backend: Backend) -> None:
        self.backend, self.oracle = backend, OracleBackend(backend.promises)
        self.plan: Plan = build(setup.graph(), setup.size, {}, Options(fuse=False, alias=False, static=False))
        (step,) = self.plan.steps
        assert isinstance(step, DrawStep)
        self.step = step
        self.runs = [(one, one.draw_pass(step)) for one in (backend, self.oracle)]

    def __call__(self, mesh: Soup, judged: bool = True) -> str:
        """Why the picture is none that the oracle allows, or empty."""
        runs = self.runs if judged and len(mesh.triangles) <= MOST_JUDGED else self.runs[:1]
        written = [self._written(backend, run, mesh) for backend, run in runs]
        if runs is not self.runs:
            return ""
        allowed: list[Allowed] = self.oracle.found[id(self.step)]
        for name, got, bounds in zip(self.step.writes, written[0], allowed, strict=True):
            beyond = bounds.values.without(got)
            if beyond.any():
                row, column, channel = (int(i) for i in np.argwhere(beyond)[0])
                low, high = (float(x[row, column, channel]) for x in (bounds.values.lo, bounds.values.hi))
                return (
                    f"{self.plan.resources[name].name} at column {column}, row {row}, channel {channel}: "
                    f"{got[row, column, channel]:.9g} where {low:.9g} to {high:.9g} is allowed; {beyond.sum()} so"
                )
        return ""

    def picture(self, mesh: Soup) -> Float32:
        """What the backend draws, (h, w, channels)."""
        return self._written(*self.runs[0], mesh)[0]

    def _written(self, backend: Backend, run: Any, mesh: Soup) -> list[Float32]:
        storages = {r: backend.make(self.plan.resources[r].format, self.step.size) for r in self.step.writes}
        nothing = Block(guarded_copy(np.zeros(1, np.float32)), guarded_copy(np.zeros(1, np.int32)))
        geometry = backend.geometry(mesh)
        depth = None if self.step.depth is None else storages[self.step.depth]
        run([storages[r] for r in self.step.outputs], depth, [], geometry, nothing, nothing)
        backend.finish()
        made = [backend.download(storages[r]) for r in self.step.writes]
        for storage in storages.values():
            backend.release(storage)
        backend.release_geometry(geometry)
        return made


def guarded_mesh(mesh: Soup) -> Soup:
    return Soup(guarded_copy(mesh.positions), guarded_copy(mesh.triangles), guarded_copy(mesh.colors))


def cases(backend: Backend, first: int, count: int, each: int, *, guards: bool, judged: bool) -> str:
    """Cases of the seeds ``first`` on, ``each`` of them on one setup; the first that fails, or empty."""
    drawn: Drawn | None = None
    for number, seed in enumerate(range(first, first + count)):
        if number % each == 0:
            print(f"setup {number // each}", flush=True)
            drawn = Drawn(setup_of(number // each), backend)
        assert drawn is not None
        print(f"seed {seed}", flush=True)
        with guarded() if guards else nullcontext():
            mesh = case_of(seed)
            why = drawn(guarded_mesh(mesh) if guards else mesh, judged)
        if why:
            return f"setup {number // each}, seed {seed}: {why}"
    return ""


def run(
    backend: str, first: int, count: int, each: int, *,
    before: tuple[str, ...] = (), seconds: float = CASE_SECONDS, start: float = START_SECONDS, judged: bool = True,
) -> str:  # fmt: skip
    """The same in a process of its own, within a time; what is wrong, naming the seed, or empty."""
    command = [*before, sys.executable, "-m", "tests.hostile.draws", "--child", "--backend", backend]
    command += ["--seed", str(first), "--cases", str(count), "--each", str(each)]
    command += [] if judged else ["--unjudged"]
    limit = start + seconds * count
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired as error:
        shown = error.output.decode() if isinstance(error.output, bytes) else error.output or ""
        return f"did not end in {limit:g} s; {_last(shown)}"
    if done.returncode == 0:
        return ""
    return f"exit {done.returncode}; {_last(done.stdout)}; {done.stderr[-2000:]}"


def _last(shown: str) -> str:
    return ", ".join(shown.split("\n")[-3:]).strip(", ")


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--each", type=int, default=100, help="cases on one setup")
    parser.add_argument("--backend", default="numpy")
    parser.add_argument("--unjudged", action="store_true", help="only draw: a crash or a loop without end is all")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if not given.child:
        why = run(given.backend, given.seed, given.cases, given.each, judged=not given.unjudged)
        print(why or f"{given.cases} cases on {given.backend} from seed {given.seed}: nothing wrong")
        return 1 if why else 0
    with open_backend(given.backend) as backend, np.errstate(all="ignore"):
        guards = given.backend == "numpy"
        why = cases(backend, given.seed, given.cases, given.each, guards=guards, judged=not given.unjudged)
    print(why)
    return 1 if why else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
