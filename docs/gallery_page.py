"""From entries of the gallery to its page: pictures are rendered, timed on each backend, and written."""

from __future__ import annotations

import inspect
import os
import re
import statistics
import textwrap
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont, ImageOps

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.registry import backend_class, open_backend
from passgraph.errors import PassgraphError
from passgraph.graph.targets import Absolute

Picture = NDArray[np.float32]
FOLDER = Path(__file__).resolve().parent
PICTURES = FOLDER / "images" / "gallery"
BACKENDS = ("gl", "opencl", "numpy")
#: Width of a whole picture of the page, and the gap between its panels, in pixels.
WIDTH, GAP = 1280, 8
#: Height of the letters of a panel's label, in pixels.
LETTERS = 20
#: A picture of the page is no larger; qualities of WebP in the order in which they are tried.
MOST_BYTES, QUALITIES = 250_000, (92, 88, 84, 78, 70, 60, 45)
#: Two backends agree at a pixel where no channel differs by more than this: two steps of 8 bits.
SAME = 2.0 / 255.0
#: Pictures whose proportions differ from their panel's by a larger share get borders.
SAME_SHAPE = 0.05
WARM_UP, RUNS, SECONDS = 2, 15, 0.4


class InputMissing(Exception):
    """A picture or model that an entry needs is not here; the text says what brings it."""


@dataclass(frozen=True)
class Panel:
    """One picture of an entry.

    Attributes
    ----------
    label : stands in the picture and in the table
    target : what is shown
    given : inputs and values of each run; of what is a function, its result for the number of the frame
    size : (width, height) in pixels in place of the entry's
    middle : share of the width and height that is shown
    frames : the one that is shown is so many frames after the beginning
    """

    label: str
    target: pg.Target
    given: dict[str, Any] = field(default_factory=dict)
    size: tuple[int, int] | None = None
    middle: float = 1.0
    frames: int = 1


@dataclass(frozen=True)
class Entry:
    """One effect, shown.

    Attributes
    ----------
    title : heading, and name of the picture
    inputs : in words
    text : what is to be seen
    panels : makes them; its source is what the page prints as the effect's call
    columns : panels beside one another
    aspect : width through height of a panel
    """

    title: str
    inputs: str
    text: str
    panels: Callable[[], Sequence[Panel]]
    columns: int = 1
    aspect: float = 16 / 9

    @property
    def file(self) -> str:
        return "".join(c if c.isalnum() else "-" for c in self.title.lower()) + ".webp"

    @property
    def panel_size(self) -> tuple[int, int]:
        """As rendered, where nothing else is said, and as shown, in pixels; the width is even."""
        width = (WIDTH - GAP * (self.columns - 1)) // self.columns // 2 * 2
        return width, round(width / self.aspect)


@dataclass(frozen=True)
class Timed:
    """Milliseconds a frame by backend, None where it is not here, and how far their pictures agree."""

    label: str
    size: tuple[int, int]
    milliseconds: dict[str, float | None]
    apart: float  # largest share of pixels of two backends that differ by more than `SAME`


# Rendering


def open_backends(names: Sequence[str] = BACKENDS) -> dict[str, Backend | None]:
    """Those that are timed; None for one that is not here."""
    found: dict[str, Backend | None] = {}
    for name in names:
        try:
            found[name] = open_backend(name)
        except PassgraphError as error:
            print(f"  {name} is left out: {error}", flush=True)
            found[name] = None
    return found


def milliseconds(program: pg.Program, given: dict[str, Any]) -> float:
    """Median of a frame after warm-up, device finished; what is static was computed before."""
    for _ in range(WARM_UP):
        program.run(**given)
    program.finish()
    taken: list[float] = []
    end = time.perf_counter() + SECONDS
    while len(taken) < 3 or (len(taken) < RUNS and time.perf_counter() < end):
        begin = time.perf_counter()
        program.run(**given)
        program.finish()
        taken.append(time.perf_counter() - begin)
    return 1e3 * statistics.median(taken)


def shown(panel: Panel, entry: Entry, backends: dict[str, Backend | None], timed: bool) -> tuple[Image.Image, Timed]:
    """A panel's picture, by the last backend that is here, and its times on all."""
    width, height = entry.panel_size
    # What is made of pictures has their size, and some targets have one of their own.
    has_own = isinstance(panel.target.spec.size, Absolute) or any(np.ndim(v) == 3 for v in panel.given.values())
    size = panel.size or (None if has_own else (width, height))
    taken: dict[str, float | None] = dict.fromkeys(backends)
    pictures: list[Picture] = []
    for name, backend in backends.items():
        if backend is not None:
            with pg.compile(panel.target, backend, size) as program:
                if timed:
                    taken[name] = milliseconds(program, given_at(panel, 0))
                    program.reset()
                for number in range(panel.frames):
                    program.run(**given_at(panel, number))
                pictures.append(program.read()[panel.target.name])
    if not pictures:
        raise SystemExit("gallery: no backend is here")
    picture = pictures[-1]
    apart = max(float((abs(other - picture) > SAME).any(axis=2).mean()) for other in pictures)
    whole = _middle(Image.fromarray(_eight_bits(picture)), panel.middle)
    # pixels of what is much enlarged are to be seen, and all alike
    little = whole.width < width < 2 * whole.width
    filter = Image.Resampling.BICUBIC if little else Image.Resampling.BOX
    made = whole.resize((width, height), filter)
    if abs(whole.width * height / (whole.height * width) - 1.0) > SAME_SHAPE:
        made = ImageOps.pad(whole, (width, height), filter, (160, 160, 160))
    _write_label(made, panel.label)
    return made, Timed(panel.label, (picture.shape[1], picture.shape[0]), taken, apart)


def given_at(panel: Panel, number: int) -> dict[str, Any]:
    """What a run of a panel is given for one frame."""
    return {name: value(number) if callable(value) else value for name, value in panel.given.items()}


def _eight_bits(picture: Picture) -> NDArray[np.uint8]:
    colours = np.repeat(picture, 3, axis=2) if picture.shape[2] == 1 else picture[:, :, :3]
    return np.asarray(np.rint(np.clip(colours, 0.0, 1.0) * 255.0), np.uint8)


def _middle(picture: Image.Image, share: float) -> Image.Image:
    width, height = picture.size
    x, y = round(0.5 * (1.0 - share) * width), round(0.5 * (1.0 - share) * height)
    return picture.crop((x, y, width - x, height - y))


def _write_label(picture: Image.Image, label: str) -> None:
    if label:
        pen, font = ImageDraw.Draw(picture), ImageFont.load_default(LETTERS)
        left, top, right, bottom = pen.textbbox((10, 6), label, font)
        pen.rectangle((left - 8, top - 6, right + 8, bottom + 6), fill=(0, 0, 0))
        pen.text((10, 6), label, (255, 255, 255), font)


def strip(pictures: Sequence[Image.Image], columns: int) -> Image.Image:
    """Pictures of one size in rows."""
    width, height = pictures[0].size
    rows = -(-len(pictures) // columns)
    whole = Image.new("RGB", (columns * (width + GAP) - GAP, rows * (height + GAP) - GAP), (255, 255, 255))
    for number, picture in enumerate(pictures):
        row, column = divmod(number, columns)
        whole.paste(picture, (column * (width + GAP), row * (height + GAP)))
    return whole


def write_picture(picture: Image.Image, path: Path) -> None:
    """WebP in true color: without loss where that is small enough, else of the best quality that is."""
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, "WEBP", lossless=True, method=4)
    for quality in QUALITIES:
        if path.stat().st_size <= MOST_BYTES:
            return
        # letters and edges of saturated colours blur where chroma is halved by a plain mean
        picture.save(path, "WEBP", quality=quality, method=6, use_sharp_yuv=True)


# Writing


def machine() -> str:
    """The kind of machine: cores, and each backend's device in its own words."""
    parts = [f"{os.cpu_count()} cores"]
    for name in BACKENDS:
        try:
            devices = [device.name for device in backend_class(name).devices() if not device.missing]
        except PassgraphError:
            devices = []
        parts.append(f"`{name}` on {devices[0]}" if devices else f"`{name}` is not here")
    return "; ".join([*parts, f"taken {date.today()}"])


def source_of(function: Callable[..., object]) -> str:
    """The body of a function without its docstring."""
    lines = inspect.getsource(function).splitlines()
    first = next(number for number, line in enumerate(lines) if line.rstrip().endswith(":"))
    body = textwrap.dedent("\n".join(lines[first + 1 :])).strip()
    if body.startswith('"""'):
        body = body.split('"""', 2)[2].strip()
    return body


def link(entry: Entry) -> str:
    return f"![{entry.title}](images/gallery/{entry.file})"


def section(entry: Entry, times: Sequence[Timed]) -> str:
    """One entry as Markdown."""
    rows = [
        f"| {timed.label or entry.title} | {timed.size[0]}×{timed.size[1]} | "
        + " | ".join(
            "–" if timed.milliseconds[name] is None else f"{timed.milliseconds[name]:.1f}" for name in BACKENDS
        )
        + f" | {timed.apart:.2%} |"
        for timed in times
    ]
    heading = f"| Frame in ms | size | {' | '.join(BACKENDS)} | differ |"
    table = "\n".join([heading, "|---|---|" + "---|" * (len(BACKENDS) + 1), *rows])
    return (
        f"## {entry.title}\n\n{link(entry)}\n\n{entry.text}\n\n"
        f"Input: {entry.inputs}.\n\n```text\n{source_of(entry.panels)}\n```\n\n{table}\n"
    )


def rendered(entry: Entry, backends: dict[str, Backend | None], timed: bool = True) -> list[Timed]:
    """An entry's picture written, and the rows of its table."""
    made = [shown(panel, entry, backends, timed) for panel in entry.panels()]
    write_picture(strip([picture for picture, _ in made], entry.columns), PICTURES / entry.file)
    return [row for _, row in made]


def with_picture(old: str, entry: Entry) -> str:
    """A section of the page as it is, with the entry's picture."""
    return re.sub(r"^!\[.*\]\(.*\)$", link(entry), old, count=1, flags=re.MULTILINE)
