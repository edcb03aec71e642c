"""A picture larger than memory in tiles, against the same pixels in pictures that fit, one after another.

    python tests/benchmarks/bench_tiles.py [--size 100000x20000] [--memory "1 GB"] [--folder /tmp]

A 15-tap Gaussian on RGB with 8 bits, from tiled TIFF to tiled TIFF.  Each way runs in a process of its own, which says
the most memory that it held; the pictures that fit are of 5,000 × 5,000 pixels, read and written by tifffile.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tifffile

sys.path.insert(0, str(Path(__file__).parent))
from harness import Ratio

import passgraph as pg
from passgraph.effects.filters.blur import gaussian_weights

WEIGHTS = gaussian_weights(2.5, 7)
#: Of a picture that fits: its sides, px.
SIDE = 5000
TILE = 256


@pg.kernel
def blur(color: pg.Image, dx: pg.Const[int], dy: pg.Const[int]) -> pg.vec3:
    total = color[0, 0].rgb * WEIGHTS[0]
    for i in range(1, 8):
        total += (color[i * dx, i * dy].rgb + color[-i * dx, -i * dy].rgb) * WEIGHTS[i]
    return total


def graph() -> pg.Target:
    across = blur(pg.Input("frame"), 1, 0, into=pg.target("across", "rgb32f"), name="across")
    made: pg.Target = blur(across, 0, 1, into=pg.target("soft", "rgb8"), name="soft")
    return made


def make(path: Path, width: int, height: int) -> None:
    """A picture by chance, tile by tile."""
    rng = np.random.default_rng(0)
    band = rng.integers(0, 256, (TILE, width + TILE, 3), np.uint8)

    def tiles() -> Iterator[Any]:
        for top in range(0, height, TILE):
            for left in range(0, width, TILE):
                yield np.roll(band[:, left : left + TILE], top // TILE, 0)

    shape = (height, width, 3)
    tifffile.imwrite(path, tiles(), shape=shape, dtype=np.uint8, tile=(TILE, TILE), photometric="rgb", bigtiff=True)


def in_tiles(folder: Path, memory: str, _: int) -> dict[str, float]:
    grid = pg.tiled(graph(), folder / "large.tif", folder / "out.tif", memory, progress=False)
    return {"tiles": len(grid), "across": grid.window[0], "down": grid.window[1], "counted": grid.bytes}


def that_fit(folder: Path, _: str, count: int) -> dict[str, float]:
    with pg.compile(graph()) as program:
        for _number in range(count):
            picture = program(frame=tifffile.imread(folder / "small.tif"))["soft"]
            numbers = np.rint(picture * np.float32(255)).astype(np.uint8)
            tifffile.imwrite(folder / "out.tif", numbers, photometric="rgb", tile=(TILE, TILE))
    return {}


WAYS = {"in tiles": in_tiles, "that fit": that_fit}


def run(way: str, folder: Path, memory: str, count: int) -> dict[str, float]:
    """One way in a process of its own."""
    command = [
        sys.executable,
        __file__,
        "--way",
        way,
        "--memory",
        memory,
        "--count",
        str(count),
        "--folder",
        str(folder),
    ]
    found: dict[str, float] = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    (folder / "out.tif").unlink()
    return found


def worker(way: str, folder: Path, memory: str, count: int) -> None:
    started, used = time.perf_counter(), time.process_time()
    found = WAYS[way](folder, memory, count)
    found |= {"seconds": time.perf_counter() - started, "cpu": time.process_time() - used}
    found["peak"] = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(json.dumps(found))


def measure(width: int, height: int, memory: str, folder: str | None = None) -> dict[str, dict[str, float]]:
    """Both ways on as many pixels; what each process took."""
    with tempfile.TemporaryDirectory(dir=folder) as made:
        place = Path(made)
        make(place / "large.tif", width, height)
        make(place / "small.tif", SIDE, SIDE)
        count = -(-width * height // SIDE**2)
        return {way: run(way, place, memory, count) for way in WAYS}


def ratios(found: dict[str, dict[str, float]]) -> list[Ratio]:
    tiled, fitting = found["in tiles"], found["that fit"]
    took, other = 1e3 * tiled["seconds"], 1e3 * fitting["seconds"]
    return [
        Ratio("a large picture in tiles / as much in pictures that fit", took / other, 1.2, took, other),
        Ratio("processor time of the same", tiled["cpu"] / fitting["cpu"], None),
        Ratio("most memory of the process in tiles, of 1 GiB", 100 * tiled["peak"] / 2**30, 100.0, unit="%"),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="100000x20000")
    parser.add_argument("--memory", default="1 GB")
    parser.add_argument("--folder", default=tempfile.gettempdir())
    parser.add_argument("--way", choices=WAYS, help=argparse.SUPPRESS)
    parser.add_argument("--count", type=int, default=1, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.way:
        worker(asked.way, Path(asked.folder), asked.memory, asked.count)
        return
    width, height = map(int, asked.size.split("x"))
    for way, found in measure(width, height, asked.memory, asked.folder).items():
        told = ", ".join(f"{name} {value:,.1f}" for name, value in found.items() if name != "peak")
        print(f"{way}: {told}, peak {found['peak'] / 2**20:.0f} MiB")


if __name__ == "__main__":
    main()
