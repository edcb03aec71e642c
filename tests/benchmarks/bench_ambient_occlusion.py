"""What ambient occlusion adds to a frame: gl, numpy and opencl beside pyvista's SSAO, where pyvista is installed.

    python tests/benchmarks/bench_ambient_occlusion.py [WIDTHxHEIGHT] [BACKEND,…]

The same model of about 70,000 triangles and the same 32 samples a pixel for all: points of a hemisphere for ssao and
pyvista, 2 slices of 8 steps to both sides for gtao; all with their blur.  Each is drawn with occlusion and without;
frames are run in turn, so that the machine's drift meets all alike.  Wall time (median) and processor time over all
threads (least of all frames, which other work on the machine disturbs less) are printed; reading back is left out.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, redirect_stderr
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.effects.ambient.ambient_occlusion import ambient_occlusion
from passgraph.effects.shadows.soft_shadow import soft_shadow
from passgraph.scene import Material, Node
from passgraph.scene.ground import floor_node
from passgraph.scene.teapot import teapot_mesh

sys.path.insert(0, str(Path(__file__).parent))
from harness import Ratio

FRAMES = 7
SAMPLES = 32
RADIUS = 0.6
#: Of passgraph's frames with occlusion; "plain" has none.
KINDS: dict[str, dict[str, Any]] = {
    "ssao": {"method": "ssao", "taps": SAMPLES},
    "ssao half": {"method": "ssao", "taps": SAMPLES, "half_resolution": True},
    "gtao": {"method": "gtao", "slices": 2, "steps": SAMPLES // 4},
    "gtao half": {"method": "gtao", "slices": 2, "steps": SAMPLES // 4, "half_resolution": True},
}
PLAIN = "plain"


def scene() -> pg.Scene:
    """The teapot in about 70,000 triangles on a floor; nothing casts, so that a frame is surfaces and light alone."""
    shipped = pg.Scene.shipped()
    pot = Node(teapot_mesh(segments=33), Material("glaze", (0.1, 0.4, 0.45, 1.0)), np.eye(4))
    floor = floor_node(pot.bounds)
    plain = Node(floor.mesh, Material("floor", (0.6, 0.55, 0.5, 1.0)), floor.transform)
    nodes = tuple(replace(node, casts=False) for node in (pot, plain))
    return shipped.with_(nodes=nodes, lights=(replace(shipped.lights[0], radius=0.0),))


@contextmanager
def ours(made: pg.Scene, backend: str, size: tuple[int, int]) -> Iterator[dict[str, Callable[[], None]]]:
    """One frame of each kind, by name."""
    graphs = {PLAIN: soft_shadow(made, ambient=0.5)}
    graphs |= {kind: ambient_occlusion(made, radius=RADIUS, **options) for kind, options in KINDS.items()}
    with ExitStack() as stack:
        programs = {kind: stack.enter_context(pg.compile(g, backend=backend, size=size)) for kind, g in graphs.items()}

        def frame(program: pg.Program) -> Callable[[], None]:
            def run() -> None:
                program.run()
                program.finish()

            return run

        yield {kind: frame(program) for kind, program in programs.items()}


@contextmanager
def theirs(made: pg.Scene, size: tuple[int, int]) -> Iterator[dict[str, Callable[[], None]]]:
    """Likewise by pyvista, off the screen; nothing where it is not installed."""
    try:
        import pyvista
    except ImportError:
        print("pyvista is not installed; pip install pyvista")
        yield {}
        return
    plotters = {kind: pyvista.Plotter(off_screen=True, window_size=size) for kind in (PLAIN, "ssao")}
    camera = made.camera
    for plotter in plotters.values():
        for node in made.nodes:
            places = node.mesh.positions @ node.transform[:3, :3].T + node.transform[:3, 3]
            faces = np.insert(node.mesh.triangles, 0, 3, axis=1)
            mesh = pyvista.PolyData(places, faces.ravel())
            mesh.point_data["Normals"] = node.mesh.normals
            mesh.point_data.active_normals_name = "Normals"
            plotter.add_mesh(mesh, color=node.material.base_color[:3])
        plotter.camera.position, plotter.camera.focal_point = camera.eye, camera.target
        plotter.camera.up, plotter.camera.view_angle = camera.up, float(np.degrees(camera.vertical_fov_rad))
        plotter.camera.clipping_range = (camera.near, camera.far)
    plotters["ssao"].enable_ssao(radius=RADIUS, bias=0.02 * RADIUS, kernel_size=SAMPLES, blur=True)

    def frame(plotter: Any) -> Callable[[], None]:
        def run() -> None:
            plotter.render()
            plotter.render_window.WaitForCompletion()

        return run

    with open(os.devnull, "w") as quiet, redirect_stderr(quiet):
        for plotter in plotters.values():
            plotter.show(auto_close=False)
    yield {kind: frame(plotter) for kind, plotter in plotters.items()}
    for plotter in plotters.values():
        plotter.close()


def measure(
    made: pg.Scene, backends: list[str], size: tuple[int, int], turns: int
) -> dict[tuple[str, str], tuple[float, float]]:
    """Wall and processor milliseconds of a frame by engine and kind."""
    wall: dict[tuple[str, str], list[float]] = {}
    work: dict[tuple[str, str], list[float]] = {}
    with ExitStack() as stack:
        engines = {"pyvista": stack.enter_context(theirs(made, size))}
        engines |= {name: stack.enter_context(ours(made, name, size)) for name in backends}
        for turn in range(turns + 1):
            for engine, frames in engines.items():
                for kind, run in frames.items():
                    begin, used = time.perf_counter(), time.process_time()
                    run()
                    if turn:
                        wall.setdefault((engine, kind), []).append(time.perf_counter() - begin)
                        work.setdefault((engine, kind), []).append(time.process_time() - used)
    return {key: (statistics.median(values) * 1e3, min(work[key]) * 1e3) for key, values in wall.items()}


def ratios(size: tuple[int, int] = (1280, 720), turns: int = FRAMES) -> list[Ratio]:
    """The whole frame with ssao on gl beside pyvista's, by the clock."""
    measured = measure(scene(), ["gl"], size, turns)
    mine, other = (measured[engine, "ssao"][0] for engine in ("gl", "pyvista"))
    return [Ratio("AO frame, gl / pyvista", mine / other, 1.0, mine, other)]


def main() -> None:
    width, height = (int(v) for v in (sys.argv[1] if len(sys.argv) > 1 else "1280x720").split("x"))
    backends = (sys.argv[2] if len(sys.argv) > 2 else "gl,numpy,opencl").split(",")
    made = scene()
    measured = measure(made, backends, (width, height), FRAMES)
    print(f"{made.triangle_count} triangles, {width}x{height}, {SAMPLES} samples a pixel")
    print("                       frame        added        of pyvista's: frame, added; wall time (processor time)")
    for (engine, kind), frame in measured.items():
        if kind == PLAIN:
            continue
        added = [a - b for a, b in zip(frame, measured[engine, PLAIN], strict=True)]
        line = f"{engine:8} {kind:10}" + "".join(f"{a:7.1f} ({b:5.1f}) ms" for a, b in (frame, added))
        if ("pyvista", "ssao") in measured and engine != "pyvista":
            peer, bare = measured["pyvista", "ssao"], measured["pyvista", PLAIN]
            line += f"   {frame[0] / peer[0]:.2f} ({frame[1] / peer[1]:.2f})"
            line += f"  {added[0] / (peer[0] - bare[0]):.2f} ({added[1] / (peer[1] - bare[1]):.2f})"
        print(line)


if __name__ == "__main__":
    main()
