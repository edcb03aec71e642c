"""The figures that a change may spoil unnoticed, in less than two minutes: each a ratio within one run.

    python tests/benchmarks/quick.py            what moved by more than 15 % against the accepted values
    python tests/benchmarks/quick.py --accept   take this run's values as the accepted ones (quick.json)

Frames and compiles are shares of a copy of a picture by both cores (1280x720 rgba32f), whole calls of OpenCV's time for
the same, commands of a script that does the same with OpenCV or Pillow. Memory is in MiB. Medians of runs in turn.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import cv2
import numpy as np

import passgraph as pg
from passgraph.commands.command_graph import picture_job, scene_job
from passgraph.effects import black_and_white, gaussian_blur
from passgraph.effects.effect_table import EFFECTS

sys.path.insert(0, str(Path(__file__).parent))
from bench_apply import PICTURE, ran
from bench_numpy import parallel_copy
from harness import interleaved

ACCEPTED = Path(__file__).with_suffix(".json")
MOVED = 0.15
SIZE = (1280, 720)
BACKENDS = ("numpy", "gl", "opencl")
ROUNDS = 5

Row = tuple[str, float]


def frames() -> Iterator[Row]:
    """A frame of each effect on each backend, in copies of a picture."""
    picture = np.random.default_rng(1).random((SIZE[1], SIZE[0], 4), np.float32)
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        np.save(f"{folder}/frame.npy", picture)
        jobs: dict[str, Callable[[], object]] = {"copy": parallel_copy(picture, np.empty_like(picture))}
        for name in ("soft-shadow", "contact", "bloom", "light2d"):
            effect = EFFECTS[name]
            if effect.takes == "picture":
                job = picture_job(effect, Path(folder, "frame.npy"), None, False, {})
            else:
                job = scene_job(effect, None, SIZE, {})
            for backend in BACKENDS:
                program = stack.enter_context(pg.compile(job.outputs, backend, job.size))
                jobs[f"{name}, {backend}"] = lambda program=program, job=job: program(**job.given)
        times = interleaved(jobs, ROUNDS, 2)
    copy = times.pop("copy")
    for name, spent in times.items():
        yield f"frame {name} / copy", statistics.median(a / b for a, b in zip(spent, copy, strict=True))


def whole_calls() -> Iterator[Row]:
    """From an array of bytes to an array of bytes, beside OpenCV."""
    picture = np.random.default_rng(1).integers(0, 256, (1080, 1920, 4), np.uint8)
    frame, into = pg.Input("frame", "rgba8", (1920, 1080)), pg.target("out", "rgba8")
    peers: dict[str, tuple[Any, Callable[[], object]]] = {
        "B&W": (
            black_and_white(frame, into=into),
            lambda: cv2.cvtColor(cv2.cvtColor(picture, cv2.COLOR_RGBA2GRAY), cv2.COLOR_GRAY2RGBA),
        ),
        "blur": (
            gaussian_blur(frame, sigma_px=2.5, radius_px=7, into=into),
            lambda: cv2.GaussianBlur(picture, (15, 15), 2.5),
        ),
    }
    for name, (made, peer) in peers.items():
        with pg.compile(made, "numpy", results="stored") as program:
            times = interleaved({"ours": lambda program=program: program(frame=picture), "peer": peer}, 15, 3)
        yield (
            f"{name} 8 bits / OpenCV",
            statistics.median(a / b for a, b in zip(times["ours"], times["peer"], strict=True)),
        )


PILLOW = "import sys; from PIL import Image, ImageFilter as f; i = Image.open(sys.argv[1]); "
PILLOW += "i.filter(f.GaussianBlur(2)).save(sys.argv[2])"
OPENCV = "import sys, cv2; cv2.imwrite(sys.argv[2], cv2.GaussianBlur(cv2.imread(sys.argv[1]), (15, 15), 2))"


def commands() -> Iterator[Row]:
    """`passgraph apply gaussian-blur` as a process, beside a script with OpenCV and one with Pillow."""
    with tempfile.TemporaryDirectory() as folder:
        smooth = cv2.resize(np.random.default_rng(1).integers(0, 256, (270, 480, 3), np.uint8), (3840, 2160))
        cv2.imwrite(f"{folder}/large.jpg", smooth)
        cv2.imwrite(f"{folder}/small.png", smooth[:512, :512])
        ours = [sys.executable, "-m", "passgraph", "apply", "gaussian-blur", "--sigma-px", "2"]
        for name, script, file in (("OpenCV", OPENCV, "large.jpg"), ("Pillow", PILLOW, "small.png")):
            jobs: dict[str, Callable[[], object]] = {
                "ours": _command([*ours, f"{folder}/{file}", "-o", f"{folder}/ours-{file}"]),
                "peer": _command([sys.executable, "-c", script, f"{folder}/{file}", f"{folder}/peer-{file}"]),
            }
            times = interleaved(jobs, ROUNDS, 1)
            yield (
                f"apply blur {file} / {name}",
                statistics.median(a / b for a, b in zip(times["ours"], times["peer"], strict=True)),
            )


def _command(arguments: list[str]) -> Callable[[], object]:
    return lambda: subprocess.run(arguments, check=True, capture_output=True)


COMPILE = """
import re, sys, time
import passgraph as pg
from passgraph.commands.command_graph import load_scene, values_of
from passgraph.effects import soft_shadow
scene = load_scene(None)
begin = time.perf_counter()
made = soft_shadow(scene)
with pg.compile(made, sys.argv[1], size=(1280, 720)) as program:
    spent = time.perf_counter() - begin
    program(**values_of(scene, {"made": made}))
    # Not ru_maxrss, which a process takes over from the one that started it.
    print(spent, int(re.search(r"VmHWM:\\s*(\\d+)", open("/proc/self/status").read())[1]) / 1024)
"""


def compiles() -> Iterator[Row]:
    """Soft shadows of the shipped scene, compiled without anything kept on disk and again: in copies of a picture."""
    picture = np.zeros((SIZE[1], SIZE[0], 4), np.float32)
    copy = statistics.median(interleaved({"copy": parallel_copy(picture, np.empty_like(picture))}, 25, 5)["copy"]) / 1e3
    for backend in BACKENDS:
        with tempfile.TemporaryDirectory() as cache:
            kept = {**os.environ, "XDG_CACHE_HOME": cache, "POCL_CACHE_DIR": cache, "MESA_SHADER_CACHE_DIR": cache}
            command = [sys.executable, "-c", COMPILE, backend]
            runs = [
                subprocess.run(command, check=True, capture_output=True, text=True, env=kept).stdout.split()
                for _ in range(3)
            ]
        yield f"compile soft-shadow {backend}, cold / copy", float(runs[0][0]) / copy
        yield f"compile soft-shadow {backend}, warm / copy", min(float(run[0]) for run in runs[1:]) / copy
        yield f"peak memory soft-shadow {backend}, MiB", float(runs[-1][1])


GRAY = "from passgraph.commands import main; main(['apply', 'black-and-white', 'in.png', '-o', 'ours.png'])"
GRAY_OPENCV = "import cv2; cv2.imwrite('theirs.png', cv2.cvtColor(cv2.imread('in.png'), cv2.COLOR_BGR2GRAY))"
SHADOW = """
import passgraph as pg
from passgraph.effects import soft_shadow
with pg.compile(soft_shadow(pg.Scene.shipped()), {backend!r}, size=(640, 360)) as program:
    program()
"""


def starts() -> Iterator[Row]:
    """Processor time of whole processes, from the second one on: a command, and a first picture on each backend."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        ran(PICTURE.format(size=(512, 512), kind="png"), folder)
        pairs = [("apply black-and-white / OpenCV", GRAY, GRAY_OPENCV)]
        for backend in (*BACKENDS, "webgpu"):
            pairs.append((f"soft-shadow {backend} / import numpy", SHADOW.format(backend=backend), "import numpy"))
        for what, ours, peer in pairs:
            turns = [[ran(code, folder)[0] for code in (ours, peer)] for _ in range(ROUNDS + 1)]
            yield f"start {what}", statistics.median(one / other for one, other in turns[1:])


def main() -> None:
    begin = time.perf_counter()
    known = json.loads(ACCEPTED.read_text()) if ACCEPTED.exists() else {}
    found: dict[str, float] = {}
    for part in (whole_calls, commands, frames, compiles, starts):
        for name, got in part():
            found[name] = round(got, 3)
            before = known.get(name)
            moved = before is not None and abs(got / before - 1) > MOVED
            print(
                f"{name:46} {got:9.2f} {'' if before is None else f'{before:9.2f}'}{'  MOVED' if moved else ''}",
                flush=True,
            )
    print(f"{time.perf_counter() - begin:.0f} s, load {os.getloadavg()[0]:.1f}")
    if "--accept" in sys.argv[1:]:
        ACCEPTED.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
