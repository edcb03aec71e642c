"""Measure every method on every scene, at every map size, on every backend."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field

import numpy as np

from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.bench.bench_scenes import scene_named
from passgraph.bench.methods import METHODS, Made, Method, frame_without_shadows, passes_of
from passgraph.bench.metrics import Errors, compared
from passgraph.bench.timing import FrameTime, frame_times
from passgraph.bench.truth import Float32, Mask, Truth, truth_of
from passgraph.effects.shadows.shadow_choice import Hard
from passgraph.errors import DeviceMissingError, PassgraphError
from passgraph.plan.data import Options
from passgraph.run.compile import compile
from passgraph.run.profile import Profile
from passgraph.run.program import Program
from passgraph.scene import Scene

#: The truth is traced with more rays until its own error is this many times below the best method's.
FINER = 10.0
FIRST_SAMPLES, MOST_SAMPLES = 64, 4096
#: Row of a frame's common part, without a shadow lookup.
NO_SHADOWS = "(no shadows)"


@dataclass(frozen=True)
class Row:
    """The result of one method on one scene and backend.

    Attributes
    ----------
    frame : time of the whole frame: shadow map, surfaces, light, shadow, picture
    filter : time in addition to a frame that draws the same map and surfaces without a shadow lookup
    passes : time of each pass, with a wait after each
    """

    scene: str
    backend: str
    method: str
    series: str
    map_size: int
    frame: FrameTime
    filter: FrameTime
    passes: Profile
    errors: Errors


@dataclass(frozen=True, eq=False)
class SceneResult:
    """The results of one scene.

    Attributes
    ----------
    shares : the shadow factor by backend, method and map size
    counts : pixels that are compared, by backend
    failed : measurements that failed, and why
    """

    name: str
    scene: Scene
    truth: Truth
    rows: tuple[Row, ...]
    shares: Mapping[tuple[str, str, int], Float32]
    counts: Mapping[str, Mask]
    failed: tuple[str, ...]

    @property
    def best_rmse(self) -> float:
        return min((row.errors.rmse for row in self.rows), default=float("nan"))


@dataclass(frozen=True)
class Settings:
    """Settings of a benchmark.

    Attributes
    ----------
    size : width and height of the picture
    map_sizes : texels along each side of shadow maps
    methods : names of methods
    backends : names, with devices after colons
    frames : number of timed frames of each method
    most_samples : most rays per pixel, whatever the best method's error requires
    """

    size: tuple[int, int] = (640, 360)
    map_sizes: tuple[int, ...] = (512, 1024, 2048)
    methods: tuple[str, ...] = tuple(METHODS)
    backends: tuple[str, ...] = ("numpy", "gl", "opencl")
    frames: int = 9
    most_samples: int = MOST_SAMPLES


@dataclass
class _Drawn:
    """Intermediate results of one scene."""

    shares: dict[tuple[str, str, int], Float32] = field(default_factory=dict)
    counts: dict[str, Mask] = field(default_factory=dict)
    times: dict[tuple[str, str, int], tuple[FrameTime, FrameTime, Profile]] = field(default_factory=dict)
    failed: list[str] = field(default_factory=list)


def measure(name: str, settings: Settings, say: Callable[[str], object] = lambda _: None) -> SceneResult:
    """Measure a scene with every method of the settings."""
    scene, drawn = scene_named(name), _Drawn()
    say(f"{name}: tracing {FIRST_SAMPLES} rays a pixel")
    truth = truth_of(scene, settings.size, FIRST_SAMPLES)
    for backend in settings.backends:
        try:
            device = open_backend(backend)
        except DeviceMissingError as error:
            drawn.failed.append(f"{backend}: {error}")
            continue
        with device:
            drawn.counts[backend] = _counts(scene, device, settings.size, truth)
            for map_size in settings.map_sizes:
                say(f"{name}: {backend}, maps of {map_size}")
                _measure_on(device, backend, scene, map_size, settings, drawn)
    errors = {key: compared(share, truth, drawn.counts[key[0]]) for key, share in drawn.shares.items()}
    samples = truth.samples
    while errors and truth.noise > (best := min(e.rmse for e in errors.values())) / FINER:
        # errors of stratified samples fall with a power of their number between -1/2 (as for independent ones) and -1
        samples = min(settings.most_samples, samples * int(np.clip((FINER * truth.noise / best) ** 1.4, 2, 16)))
        if samples <= truth.samples:
            break
        say(f"{name}: tracing {samples} rays a pixel")
        truth = truth_of(scene, settings.size, samples)
        errors = {key: compared(share, truth, drawn.counts[key[0]]) for key, share in drawn.shares.items()}
    rows = [
        Row(name, backend, method, METHODS[method].series, size, *drawn.times[backend, method, size], off)
        for (backend, method, size), off in errors.items()
    ]
    return SceneResult(name, scene, truth, tuple(rows), drawn.shares, drawn.counts, tuple(drawn.failed))


def _counts(scene: Scene, device: Backend, size: tuple[int, int], truth: Truth) -> Mask:
    """Return where pixels count: the truth is valid, the rasterizer sees the same surface, and the shading normal faces
    the light."""
    passes = passes_of(scene, 64, filter=Hard())
    with compile([passes.depth, passes.unshadowed], backend=device, size=size) as program:
        drawn = program()
    lit = drawn[passes.unshadowed.name][:, :, :3].max(axis=2) > 0.0
    return np.asarray(truth.counts & lit & truth.same_surface(drawn[passes.depth.name][:, :, 0]))


def _measure_on(device: Backend, backend: str, scene: Scene, map_size: int, settings: Settings, drawn: _Drawn) -> None:
    """Measure all methods at one map size."""
    graphs = _graphs(scene, map_size, settings.methods, f"{backend}, map {map_size}", drawn.failed)
    for name, graph in graphs.items():
        with compile(graph.share, backend=device, size=settings.size) as program:
            red = program()[graph.share.name][:, :, 0]
        drawn.shares[backend, name, map_size] = np.clip(graph.scale * red + graph.offset, 0.0, 1.0)
    light = scene.lights[0]
    with ExitStack() as stack:
        programs: dict[str, Program] = {}
        for name, targets in {**{n: g.picture for n, g in graphs.items()}, NO_SHADOWS: None}.items():
            graph_of = frame_without_shadows(scene, map_size) if targets is None else targets
            programs[name] = stack.enter_context(compile(graph_of, backend=device, size=settings.size))
        times = frame_times(programs, light, settings.frames)
    base = times.pop(NO_SHADOWS)
    for name, frame in times.items():
        over = FrameTime(frame.wall - base.wall, frame.cpu - base.cpu)
        # A light that moves draws its map again in each frame.
        with compile(graphs[name].picture, device, settings.size, Options(static=False)) as program:
            each = program.profile(max(settings.frames // 3, 1), light=light)
        drawn.times[backend, name, map_size] = frame, over, each


def _graphs(scene: Scene, map_size: int, methods: Sequence[str], where: str, failed: list[str]) -> dict[str, Made]:
    graphs = {}
    for name in methods:
        method: Method = METHODS[name]
        try:
            graphs[name] = method.make(scene, map_size)
        except PassgraphError as error:
            failed.append(f"{name} ({where}): {error}")
    return graphs
