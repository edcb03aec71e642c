"""The table of docs/engines.md: what an effect costs in each engine that is installed, and what it changes beside.

    python docs/engines/table.py [ENGINE ...] [--one ENGINE]

measures the engines named, or all, and writes their rows into docs/engines.json and the table into docs/engines.md.
Times are CPU time over all threads, in milliseconds a frame of 1280x720, medians of frames taken in turn.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

root = Path(__file__).resolve().parent.parent.parent
if sys.path[0] == str(root / "docs" / "engines"):
    sys.path[0] = str(root)

from docs.engines.by_hand import ByCopy, ByHand
from docs.engines.demo import Scene, functions, gray_and_soft, installed, played
from passgraph.engines.attachment import Attachment

ENGINES = (
    "panda3d", "vtk", "mujoco", "blender", "ogre", "pyglet", "arcade", "moderngl_window", "pygame", "qt", "napari",
    "vispy", "raylib", "kivy",
)  # fmt: skip
SIZE = (1280, 720)
ROUNDS, FRAMES = 6, 5
PAGE, ROWS = root / "docs" / "engines.md", root / "docs" / "engines.json"
BEGIN, END = "<!-- table: python docs/engines/table.py -->", "<!-- end of the table -->"
COLUMNS = (
    "engine", "hook", "isolation", "without", "passgraph", "by hand", "by copy", "passgraph / by hand",
    "the effect alone", "bits changed",
)  # fmt: skip


def measured(engine: str) -> dict[str, Any]:
    """One engine's row; in a process of its own."""
    kind: type[Scene] = import_module(f"docs.engines.{engine}").Scene
    scene = kind(SIZE)
    scene.draw()
    attached = scene.attach(gray_and_soft)
    scene.draw()
    hand, copy = Later(ByHand), Later(ByCopy)
    variants: dict[str, Callable[[], Callable[[], object]]] = {
        "without": lambda: lambda: None,
        "passgraph": lambda: switched_on(attached),
        "by hand": lambda: scene.hook_in(hand),
        "by copy": lambda: scene.hook_in(copy),
    }
    attached.enabled = False
    times: dict[str, list[float]] = {name: [] for name in variants}
    for number in range(ROUNDS):
        for name, begin in variants.items():
            end = begin()
            scene.draw()
            functions().Finish()
            for _ in range(FRAMES):
                start = time.process_time()
                scene.draw()
                functions().Finish()
                if number:
                    times[name].append(1000.0 * (time.process_time() - start))
            end()
    isolation = attached.isolation
    attached.close()
    scene.close()
    return {
        "engine": kind.engine, "version": installed(kind.engine), "hook": kind.hook, "isolation": isolation,
        "ms": {name: round(median(each), 1) for name, each in times.items()},
    }  # fmt: skip


class Later:
    """Made where it is first called: in the engine's hook, with its context current."""

    def __init__(self, kind: type[ByHand | ByCopy]) -> None:
        self.kind = kind
        self.made: ByHand | ByCopy | None = None

    def __call__(self) -> None:
        if self.made is None:
            self.made = self.kind(SIZE)
        self.made()


def switched_on(attached: Attachment) -> Callable[[], None]:
    attached.enabled = True

    def off() -> None:
        if attached.error is not None:
            raise attached.error
        attached.enabled = False

    return off


def changed_bits(engine: str, under: tuple[str, ...]) -> int:
    """In frames without the effect, before and after two that had it."""
    plain, changed = (played(engine, *options, under=under) for options in ((), ("--effect", "2", "3")))
    return sum(int(np.bitwise_count(plain[n] ^ changed[n]).sum()) for n in "01456")


def row(engine: str) -> dict[str, Any]:
    """An engine's row, or why there is none."""
    kind = import_module(f"docs.engines.{engine}").Scene
    if installed(kind.engine) is None:
        return {"engine": kind.engine, "missing": "not installed"}
    under = ("xvfb-run", "-a") if getattr(kind, "needs_display", False) and not os.environ.get("DISPLAY") else ()
    if under and shutil.which(under[0]) is None:
        return {"engine": kind.engine, "missing": "needs a display, or xvfb-run"}
    ran = subprocess.run(
        [*under, sys.executable, __file__, "--one", engine], capture_output=True, text=True, check=False
    )
    if ran.returncode:
        print(ran.stderr, file=sys.stderr)
        return {"engine": kind.engine, "missing": f"failed: {ran.stderr.strip().splitlines()[-1]}"}
    return {**json.loads(ran.stdout.splitlines()[-1]), "bits": changed_bits(engine, under)}


def line(made: dict[str, Any]) -> str:
    """A row in Markdown."""
    if "missing" in made:
        return _cells([made["engine"], made["missing"], *[""] * (len(COLUMNS) - 2)])
    ms = made["ms"]
    ours, hand = ms["passgraph"] - ms["without"], ms["by hand"] - ms["without"]
    times = [f"{ms[name]:.1f}" for name in ("without", "passgraph", "by hand", "by copy")]
    ratios = [f"{ms['passgraph'] / ms['by hand']:.2f} ×", f"{ours / hand:.2f} ×"]
    name = f"{made['engine']} {made['version']}"
    return _cells([name, made["hook"], made["isolation"], *times, *ratios, f"{made['bits']:,}"])


def _cells(texts: Sequence[str]) -> str:
    return f"| {' | '.join(texts)} |"


def main(wanted: list[str]) -> None:
    rows: dict[str, Any] = json.loads(ROWS.read_text()) if ROWS.exists() else {}
    for engine in wanted or [name for name in ENGINES if (root / f"docs/engines/{name}.py").exists()]:
        made = row(engine)
        print(line(made), flush=True)
        if "ms" in made or "ms" not in rows.get(engine, {}):  # what another Python measured stays
            rows[engine] = made
    write({name: rows[name] for name in ENGINES if name in rows})


def write(rows: dict[str, Any]) -> None:
    """The rows into their file, and the table into the page."""
    ROWS.write_text(json.dumps(rows, indent=1) + "\n")
    page = PAGE.read_text()
    before, after = page.split(BEGIN)[0], page.split(END)[1]
    head = [_cells(COLUMNS), _cells(["---"] * 3 + ["---:"] * 7)]
    table = "\n".join([*head, *map(line, rows.values())])
    PAGE.write_text(f"{before}{BEGIN}\n{table}\n{END}{after}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(measured(sys.argv[2])))
    else:
        main(sys.argv[1:])
