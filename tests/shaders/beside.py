"""Shader files read here beside the originals on OpenGL: what both are given, and by how much they differ."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from originals import Asked, Clock, File, IsfFile, Original, Picture, Size, TransitionFile

import passgraph as pg
from passgraph.shaders.shader_file import load_shader

#: Collections of published shaders; checkouts of users have none.
FOLDER = Path(__file__).resolve().parents[3] / "shared" / "shaders"
MISSING = f"the collections of published shaders are not here ({FOLDER})"
#: Steps of 8 bits that a value may lie from the original's, and the share of pixels that may lie farther.
STEPS, SHARE = 1.001, 0.001
CLOCK = Clock()


def files(kind: str) -> list[Path]:
    """Every file of a container: "isf" or "transitions"."""
    return sorted((FOLDER / kind).glob("*.fs" if kind == "isf" else "*.glsl"))


def read_original(path: Path) -> File:
    return IsfFile(path) if path.suffix == ".fs" else TransitionFile(path)


@cache
def pictures(size: Size) -> tuple[Picture, ...]:
    """Three pictures of 8 bits: discs before a gradient, stripes, and noise; the alpha of the last two varies."""
    width, height = size
    y, x = np.mgrid[0:height, 0:width].astype(np.float64)
    u, v = (x + 0.5) / width, (y + 0.5) / height
    disc = ((u - 0.35) ** 2 + (v - 0.4) ** 2 < 0.05).astype(float)
    first = np.stack([0.2 + 0.7 * u, 0.9 * v * (1 - disc) + 0.1, 0.3 + 0.6 * disc, np.ones_like(u)], -1)
    stripes = 0.5 + 0.5 * np.sin(30 * u + 12 * v)
    second = np.stack([stripes, 1 - u, 0.2 + 0.5 * v, 0.5 + 0.5 * v], -1)
    noise = np.random.default_rng(7).random((height, width, 4))
    return tuple((np.round(p * 255) / 255).astype(np.float32) for p in (first, second, noise))


def values_of(asked: Mapping[str, Asked], seed: int) -> dict[str, Any]:
    """A value for each parameter: 0 are the defaults, other seeds are random within the ranges."""
    rng = np.random.default_rng(seed)
    return {name: one.default if seed == 0 else _random(one, rng) for name, one in asked.items()}


def _random(one: Asked, rng: np.random.Generator) -> Any:
    if one.type == "bool":
        return bool(rng.integers(2))
    if one.type == "int":
        low, high = max(one.low or 0, one.default - 2), one.default + 3
        return int(rng.choice(one.values)) if one.values else int(rng.integers(low, max(low + 1, high)))
    count = len(one.default) if isinstance(one.default, tuple) else 1
    lows, highs = _ends(one, count)
    if one.type[0] == "i":
        return tuple(int(rng.integers(1, max(2, 2 * number))) for number in one.default)
    numbers = [lo + (hi - lo) * float(t) for lo, hi, t in zip(lows, highs, rng.uniform(0.05, 0.95, count), strict=True)]
    return numbers[0] if count == 1 else tuple(numbers)


def _ends(one: Asked, count: int) -> tuple[list[float], list[float]]:
    """Ends of a range for each component; where the file has none, around the default."""
    defaults = one.default if isinstance(one.default, tuple) else (one.default,)
    ends = []
    for said, share in ((one.low, 0.7), (one.high, 1.3)):
        parts = said if isinstance(said, list) else [said] * count
        ends.append([d * share if part is None else float(part) for part, d in zip(parts, defaults, strict=False)])
    return ends[0], ends[1]


@dataclass(frozen=True)
class Case:
    """One file at one size with one set of values, for some frames."""

    path: Path
    size: Size
    seed: int = 0
    frames: int = 1
    file: File = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "file", read_original(self.path))

    @property
    def values(self) -> dict[str, Any]:
        return values_of(self.file.parameters, self.seed)

    def given(self) -> dict[str, Picture]:
        """A picture for each image; generators have none."""
        here = {name: pictures(self.size)[number % 3] for number, name in enumerate(self.file.images)}
        imported = getattr(self.file, "imported", {})
        return here | {name: _four(pg.load(path)) for name, path in imported.items()}

    def original(self, context: moderngl.Context, settled: Collection[str] | None = None) -> list[Picture]:
        """The picture of each frame, as the file's host shows it; with functions ``settled``, as kernels have them."""
        run = Original(context, self.file, self.size, settled=settled)
        try:
            run.show(self.given())
            # Shown are 8 bits, whatever the last pass draws into.
            shown = [run.draw(self.values, frame, CLOCK)[-1] for frame in range(self.frames)]
            return [np.clip(np.nan_to_num(picture), 0.0, 1.0) for picture in shown]
        finally:
            run.release()

    def graph(self, format: str = "rgba32f", shown: str = "rgba8") -> pg.Target:
        """The same as passgraph has it, of pictures in a format, drawn in another."""
        effect = load_shader(self.path)
        clock = {"time": CLOCK.time, "time_step": CLOCK.step, "date": CLOCK.date}
        own = {name: value for name, value in clock.items() if name in effect.parameters}
        own |= {name: value for name, value in self.values.items() if name in effect.parameters}
        images = {name: pg.Input(name, format, self.size) for name in effect.images}
        return effect(*images.values(), into=pg.target("shown", shown, scale=1.0), **own)

    def ours(self, backend: str = "numpy", shown: str = "rgba8") -> list[Picture]:
        with pg.compile(self.graph(shown=shown), backend=backend, size=self.size) as program:
            given = {name: picture for name, picture in self.given().items() if name in program.inputs}
            return [np.asarray(program(**given)["shown"]) for _ in range(self.frames)]


def _four(picture: Picture) -> Picture:
    height, width, channels = picture.shape
    if channels == 4:
        return picture
    colors = picture if channels == 3 else np.repeat(picture[:, :, :1], 3, 2)
    return np.concatenate([colors, np.ones((height, width, 1), np.float32)], 2)


@dataclass(frozen=True)
class Apart:
    """By how much two series of pictures differ: in steps of 8 bits, and the share of pixels beyond one step."""

    steps: float
    share: float

    @property
    def agrees(self) -> bool:
        return self.share <= SHARE

    @property
    def verdict(self) -> str:
        if self.steps == 0:
            return "equal"
        if self.steps <= STEPS:
            return "one step"
        return "one step but for few" if self.agrees else "farther"


def apart(these: list[Picture], those: list[Picture]) -> Apart:
    differences = [np.abs(a - b).max(axis=2) * 255 for a, b in zip(these, those, strict=True)]
    whole = np.nan_to_num(np.stack(differences), nan=255.0)
    return Apart(round(float(whole.max()), 3), float((whole > STEPS).mean()))
