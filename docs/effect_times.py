"""Measure each effect with its defaults on every backend that is here: python docs/effect_times.py [WORD ...]

writes docs/effect_times.json, which docs/effect-times.md shows as a table. With words, effects whose name has one of
them are measured and printed, and the file stays as it is.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from contextlib import ExitStack
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

root = Path(__file__).resolve().parent.parent
if str(root) not in sys.path:
    sys.path.insert(0, str(root))

import passgraph as pg
from passgraph.backends.registry import backend_class
from passgraph.bench.timing import times_in_turn
from passgraph.effects.effect_table import EFFECTS, Effect
from passgraph.errors import DeviceMissingError, PassgraphError

FILE = Path(__file__).with_suffix(".json")
#: What tests/benchmarks/bench_originals.py measured.
ORIGINALS = Path(__file__).with_name("original_times.json")
#: The numpy backend is always here, and times of the others are measured in turn with it.
BACKENDS = ("numpy", "gl", "opencl", "webgpu")
SIZE, FRAMES = (1280, 720), 15
#: Two backends agree at a pixel if no channel differs by more: two steps of 8 bits.
SAME = 2.0 / 255.0
INPUTS = {"picture": "waves", "picture+depth": "waves", "scene": "the shipped scene", "world2d": "the shipped world"}


def machine() -> str:
    """Return the number of cores, each backend's device by its own name, and the date."""
    parts = [f"{os.cpu_count()} cores"]
    for name in BACKENDS:
        try:
            devices = [device.name for device in backend_class(name).devices() if not device.missing]
        except PassgraphError:
            devices = []
        parts.append(f"`{name}` on {devices[0]}" if devices else f"`{name}` is not here")
    return "; ".join([*parts, f"taken {date.today()}"])


def waves(channels: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Return a picture of waves between 0 and 1, other ones in each channel; as a depth, in front of the camera."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] / 40.0
    picture = [0.5 + 0.5 * np.sin(x * (1.0 + 0.3 * c) + np.cos(y * (1.2 - 0.2 * c))) for c in range(channels)]
    return np.stack(picture, axis=2).astype(np.float32)


def measured(effect: Effect) -> dict[str, Any]:
    """Return the row of an effect: medians in milliseconds by backend, without readback and static passes.

    `differ` is the largest share of pixels at which a backend differs from numpy by more than `SAME`.
    """
    from tests.benchmarks.memory import made_by

    given = {
        "picture": {"frame": waves(4)},
        "picture+depth": {"frame": waves(4), "depth": 2.0 + waves(1)},
    }.get(effect.takes, {})
    programs: dict[str, pg.Program] = {}
    with ExitStack() as stack:
        for name in BACKENDS:
            try:
                programs[name] = stack.enter_context(pg.compile(made_by(effect, SIZE), name, SIZE))  # type: ignore[arg-type]
            except DeviceMissingError as error:
                print(f"  {name} is left out: {error}", flush=True)
        shown = {name: next(iter(program(**given).values())) for name, program in programs.items()}
        times = times_in_turn({name: _frame(program, given) for name, program in programs.items()}, FRAMES)
    differ = max(float((abs(picture - shown["numpy"]) > SAME).any(axis=2).mean()) for picture in shown.values())
    milliseconds = {name: round(time.wall, 2) for name, time in times.items()}
    return {
        "effect": effect.name, "options": "", "input": INPUTS[effect.takes], "size": list(SIZE), "ms": milliseconds,
        "differ": round(differ, 6),
    }  # fmt: skip


def _frame(program: pg.Program, given: dict[str, Any]) -> Callable[[int], None]:
    def run(_: int) -> None:
        program.run(**given)
        program.finish()

    return run


def table(known: dict[str, Any] | None = None) -> str:
    """Return measurements, by default the file's, as Markdown: where they come from, and a row for each."""
    known = known or json.loads(FILE.read_text(encoding="utf-8"))
    names = [name for name in BACKENDS if any(name in row["ms"] for row in known["rows"])]
    lines = [
        f"Machine: {known['machine']}; taken {known['date']} by {known['command']}.\n",
        f"| effect | options | input | {' | '.join(names)} | differ |",
        f"|---|---|---|{'---:|' * (len(names) + 1)}",
    ]
    for row in known["rows"]:
        times = " | ".join(f"{row['ms'][name]:.1f}" if name in row["ms"] else "–" for name in names)
        options = f"`{row['options']}`" if row["options"] else "defaults"
        size = "×".join(map(str, row["size"]))
        lines.append(f"| {row['effect']} | {options} | {row['input']}, {size} | {times} | {row['differ']:.2%} |")
    return "\n".join(lines) + "\n"


def originals_table() -> str:
    """Return the times of effects relative to the published GLSL, as Markdown."""
    known = json.loads(ORIGINALS.read_text(encoding="utf-8"))
    kinds = list(known["rows"][0]["ratios"])
    lines = [
        f"Machine: {known['machine']}; taken {known['date']}, medians of {known['runs']} frames.\n",
        f"| effect | original | ms | {' | '.join(kinds)} | ours differs by |",
        f"|---|---|---:|{'---:|' * len(kinds)}---|",
    ]
    for row in known["rows"]:
        ratios = " | ".join(f"{row['ratios'][kind]:.2f}" for kind in kinds)
        differs = row["differs"] or ("nothing" if row["apart"] == 0.0 else f"{row['apart']:.1%} of pixels")
        name = f"{row['effect']}, {row['options']}" if row["options"] else row["effect"]
        lines.append(f"| {name} | {row['original']} | {row['ms']:.1f} | {ratios} | {differs} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    words = sys.argv[1:]
    rows = []
    for effect in EFFECTS.values():
        if not words or any(word in effect.name for word in words):
            print(effect.name, flush=True)
            rows.append(measured(effect))
    where, _, day = machine().rpartition("; taken ")
    made = {"machine": where, "date": day, "command": "`python docs/effect_times.py`", "rows": rows}
    if words:
        print(table(made))
    else:
        FILE.write_text(json.dumps(made, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
