"""Measure exact and native math, and write the tables of docs/native-math.md: ``docs/native_math.py [contracted]``

Errors of functions on each device, then time and error of the built-in effects in both modes; or the
table of times on processors, where native math changes nothing but products in sums.
"""

from __future__ import annotations

import platform
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from datetime import date
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.effects import soft_shadow
from passgraph.effects.effect_table import EFFECTS
from passgraph.plan.data import PixelStep
from passgraph.verify.function_errors import measure_functions

PAGE = Path(__file__).parent / "native-math.md"
MARK = "<!-- docs/native_math.py writes what follows -->"
DEVICES = ("gl", "webgpu")
_ERRORS = """Errors in ULP over 262,144 arguments of each function's domain. What is promised of exact functions
is in the [table of operations](kernels.md#functions-of-numbers).
"""
#: Sizes for times and for errors: the reference takes seconds for a large picture.
SIZE, SMALL = (1280, 720), (160, 90)
ROUNDS = 15
TABLE_BEGIN, TABLE_END = "<!-- docs/native_math.py contracted writes this table -->", "<!-- end of the table -->"
CONTRACTED = ("bilateral", "film-grain", "tone-map", "vignette")
EIGHT = """
def eight_functions(c: Image) -> vec4:
    v = c[0, 0]
    powers = exp(-abs(v)) + exp2(v * 0.3) + log2(abs(v) + 1.0) + pow(abs(v) + 0.1, vec4(2.2))
    return powers + sin(v) + cos(v * 2.0) + atan(v) + tanh(v)
"""


def hdr_picture(size: tuple[int, int]) -> NDArray[np.float32]:
    """Return a smooth picture with highlights up to 8, and noise."""
    width, height = size
    y, x = np.mgrid[:height, :width].astype(np.float32) / np.float32(height)
    random = np.random.default_rng(1)
    waves = 0.5 + 0.5 * np.stack([np.sin(9 * x + 3 * y), np.sin(5 * x - 7 * y + 1), np.cos(11 * y)], 2)
    light = 8.0 * np.exp(-40.0 * ((x - 0.6) ** 2 + (y - 0.4) ** 2))[..., None]
    color = waves + light + 0.02 * random.random((height, width, 1))
    return np.concatenate([color, np.ones((height, width, 1))], 2).astype(np.float32)


def graphs(size: tuple[int, int]) -> Iterator[tuple[str, pg.Target]]:
    """Yield each built-in effect on one picture, with its defaults, and soft shadows of the shipped scene."""
    frame = pg.Input("frame", "rgba32f", size, static=True)
    for name, effect in sorted(EFFECTS.items()):
        if effect.takes == "picture" and not any(parameter.required for parameter in effect.parameters):
            yield name, effect.function(frame)
    yield "soft-shadow", soft_shadow(pg.Scene.shipped())


def given(program: pg.Program, size: tuple[int, int]) -> dict[str, NDArray[np.float32]]:
    return {"frame": hdr_picture(size)} if "frame" in program.inputs else {}


def picture_of(output: pg.Target, backend: Backend | str, math: str) -> NDArray[np.float32]:
    options = pg.Options(math=math)  # type: ignore[arg-type]
    with pg.compile({"out": output}, backend, SMALL, options) as program:
        return np.asarray(program(**given(program, SMALL))["out"], np.float32)


def programs_of(output: pg.Target, backend: Backend, math: str) -> str:
    """Return the programs of a graph's pixel passes as text."""
    options = pg.Options(math=math)  # type: ignore[arg-type]
    with pg.compile({"out": output}, backend, SMALL, options) as program:
        assert program.plan is not None
        return "".join(repr(step.program.body) for step in program.plan.steps if isinstance(step, PixelStep))


def frame_times(
    output: pg.Target, backend: Backend, clock: Callable[[], float] = time.perf_counter, rounds: int = ROUNDS
) -> tuple[float, float]:
    """Return the medians of frames in milliseconds, exact and native, measured in turn; uploads are left out."""
    modes = ("exact", "native")
    options = {math: pg.Options(static=False, math=math) for math in modes}  # type: ignore[arg-type]
    programs = {math: pg.compile({"out": output}, backend, SIZE, options[math]) for math in modes}
    pictures = {math: given(program, SIZE) for math, program in programs.items()}
    spent: dict[str, list[float]] = {math: [] for math in modes}
    for _ in range(rounds + 1):
        for math, program in programs.items():
            begin = clock()
            program.run(**pictures[math])
            program.finish()
            spent[math].append(clock() - begin)
    for program in programs.values():
        program.close()
    exact, native = (statistics.median(spent[math][1:]) * 1e3 for math in modes)
    return exact, native


def functions_table(name: str) -> Iterator[str]:
    with open_backend(name) as backend:
        exact = {found.name: found for found in measure_functions(backend)}
        native = list(measure_functions(backend, "native"))
        device = backend.limits.device
    yield f"### {device}\n"
    yield "| function | exact, largest | median | native, largest | median | promised of native |"
    yield "|---|---:|---:|---:|---:|---|"
    for found in native:
        ours = exact[found.name]
        figures = ours.worst, ours.typical, found.worst, found.typical
        yield f"| `{found.name}` | {' | '.join(map(_ulp, figures))} | {found.promised} |"


def _ulp(error: float) -> str:
    return f"{error:.2f}" if error < 1000 else f"{error:.2g}"


def effects_table(device: str, truths: dict[str, NDArray[np.float32]]) -> Iterator[str]:
    """Yield the lines of a device's table; ``truths`` keeps the reference's pictures for the next device."""
    yield "| effect | exact, ms | native, ms | native / exact | largest error, exact | native | RMS, exact | native |"
    yield "|---|---:|---:|---:|---:|---:|---:|---:|"
    with open_backend(device) as backend:
        small = dict(graphs(SMALL))
        for name, output in graphs(SIZE):
            if programs_of(small[name], backend, "exact") == programs_of(small[name], backend, "native"):
                continue
            if name not in truths:
                truths[name] = picture_of(small[name], "reference", "exact")
            errors = [np.abs(picture_of(small[name], backend, math) - truths[name]) for math in ("exact", "native")]
            exact, native = frame_times(output, backend)
            largest = " | ".join(f"{np.nanmax(error):.2g}" for error in errors)
            squares = " | ".join(f"{np.sqrt(np.nanmean(error**2)):.2g}" for error in errors)
            yield f"| `{name}` | {exact:.2f} | {native:.2f} | {native / exact:.2f} | {largest} | {squares} |"
            print(device, name, f"{native / exact:.2f}", file=sys.stderr)


def contracted_table() -> str:
    """Return a table of times on processors: of all threads, which other work on the machine changes little."""
    title = f"Native / exact: processor time of frames of {SIZE[0]} × {SIZE[1]}, medians of 7 in turn, {date.today()}."
    lines = [f"{title}\n"]
    lines += ["| | `numpy` | `opencl` (PoCL) |", "|---|---:|---:|"]
    found = dict(graphs(SIZE))
    found["eight functions"] = pg.kernel(source=EIGHT)(pg.Input("frame", "rgba32f", SIZE, static=True))
    for name in (*CONTRACTED, "eight functions"):
        ratios = []
        for device in ("numpy", "opencl"):
            with open_backend(device) as backend:
                exact, native = frame_times(found[name], backend, time.process_time, 7)
            ratios.append(f"{native / exact:.2f}")
        lines.append(f"| {name} | {' | '.join(ratios)} |")
        print(lines[-1], file=sys.stderr)
    return "\n".join(lines)


def write_contracted() -> None:
    head, _, rest = PAGE.read_text(encoding="utf-8").partition(TABLE_BEGIN)
    table = contracted_table()
    PAGE.write_text(f"{head}{TABLE_BEGIN}\n\n{table}\n\n{TABLE_END}{rest.partition(TABLE_END)[2]}", encoding="utf-8")


def main() -> None:
    if sys.argv[1:] == ["contracted"]:
        write_contracted()
        return
    lines = [f"Taken {date.today()} on {platform.machine()}, 2 cores, Python {platform.python_version()}.\n"]
    lines += ["## Functions\n", _ERRORS]
    for name in DEVICES:
        lines += [*functions_table(name), ""]
    lines += ["## Effects\n"]
    lines += [
        f"Frames of {SIZE[0]} × {SIZE[1]}, medians of {ROUNDS} in turn; errors against the reference at "
        f"{SMALL[0]} × {SMALL[1]}, of an HDR picture with values up to 8. "
        "Effects with the same code in both are left out.\n",
    ]
    truths: dict[str, NDArray[np.float32]] = {}
    for name in DEVICES:
        lines += [f"### On {name}\n", *effects_table(name, truths), ""]
    head = PAGE.read_text(encoding="utf-8").partition(MARK)[0]
    PAGE.write_text(f"{head}{MARK}\n\n" + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
