"""Sequences of frames: history, static passes and aliased memory.

Numbers are small and whole, so every sum, product and result is exact, on every backend and with every optimization.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

import passgraph as pg
from passgraph.verify.conformance.case import Case, Picture, whole_numbers
from passgraph.verify.conformance.case_inputs import quad
from passgraph.verify.conformance.draw_state_cases import painted

GROUP = "sequences"
SIZE = (23, 17)
#: Side of a picture, and most loop iterations of a pixel; the lower rows make most: 33 million in all.
LONG, STEPS = 256, 1024

KERNELS = {
    "add": "def add(a: Image, b: Image) -> vec4: return a[0, 0] + b[0, 0]",
    "shift": "def shift(a: Image) -> vec4: return a[1, 0] * 2.0 + a[-1, -1]",
    "scale": "def scale(a: Image, factor: float) -> vec4: return a[0, 0] * factor",
    "count": "def count(a: Image) -> vec4: return a[0, 0] + 1.0",
}


def called(name: str, *arguments: object, into: str | pg.TargetSpec, **values: object) -> pg.Target:
    kernel = pg.kernel(source=KERNELS[name])
    spec = pg.target(into, "rgba32f") if isinstance(into, str) else into
    target: pg.Target = kernel(*arguments, into=spec, name=spec.name, **values)
    return target


def cases() -> Iterator[Case]:
    """Yield each case with its exact result after the last frame."""
    frames = tuple({"frame": whole_numbers(SIZE, seed)} for seed in range(4))
    pictures = [frame["frame"] for frame in frames]
    total = np.sum(pictures, axis=0)
    for form in ("rgba32f", "rgba16f"):
        graph = partial(running_sum, form)
        yield Case(GROUP, f"a running sum in {form}", graph, SIZE, frames, exact={"sum": total})
    shifted = np.zeros_like(total)
    for picture in pictures:
        shifted = shift(shifted) + picture
    # Whole numbers grow threefold per frame; float32 holds them exactly.
    yield Case(GROUP, "history read beside the pixel", moving, SIZE, frames, exact={"moved": shifted})
    lagging = {"late": pictures[-2] * 2.0}
    yield Case(GROUP, "last frame's picture", one_late, SIZE, frames, exact=lagging)
    began = whole_numbers(SIZE, 9)
    lags = {"late": began + 10.0 * pictures[0] + 100.0 * pictures[2], "now": pictures[3]}
    yield Case(GROUP, "pictures of several runs ago", partial(several_ago, began), SIZE, frames, exact=lags)
    yield Case(GROUP, "what history starts from", started, SIZE, frames, exact={"out": total + np.array([3, 2, 1, 0])})
    yield Case(GROUP, "the number of a run", numbered, SIZE, frames, exact={"out": pictures[3] * 3.0})
    yield Case(GROUP, "drawn over history", drawn_over, SIZE, ({},) * 3, exact={"hits": 3.0})
    yield Case(GROUP, "a long pass is waited for", walked, (LONG, LONG), exact={"walked": _walk()})
    yield from _static(pictures)
    yield from _memories(pictures[0])


def shift(a: Picture) -> Picture:
    """Compute the kernel of that name, with its zero border."""
    padded = np.pad(a, ((1, 1), (1, 1), (0, 0)))
    shifted: Picture = padded[1:-1, 2:] * 2.0 + padded[:-2, :-2]
    return shifted


def running_sum(form: str) -> Mapping[str, pg.Target]:
    """A target that adds to its previous content."""
    spec = pg.target("sum", form)
    kernel = pg.kernel(source=KERNELS["add"])
    return {"sum": kernel(pg.previous(spec), pg.Input("frame"), into=spec)}


def moving() -> Mapping[str, pg.Target]:
    """History read at other pixels, with a pass in between."""
    spec = pg.target("moved", "rgba32f")
    shifted = called("shift", pg.previous(spec).border("zero"), into="beside")
    return {"moved": pg.kernel(source=KERNELS["add"])(shifted, pg.Input("frame"), into=spec)}


def one_late() -> Mapping[str, pg.Target]:
    """Read the last run's content while this run writes a new one."""
    now = called("scale", pg.Input("frame"), into="now", factor=2.0)
    late = called("scale", pg.previous(now), into="late", factor=1.0)
    return {"late": late, "now": now}


def several_ago(began: Picture) -> Mapping[str, pg.Target]:
    """The fourth run reads the target's initial value, and the contents of the first and third runs."""
    text = "def late(a: Image, b: Image, c: Image) -> vec4: return a.texel(pixel()) + b[0, 0] * 10.0 + c[0, 0] * 100.0"
    now = called("scale", pg.Input("frame"), into=pg.target("now", "rgba32f", initial=began), factor=1.0)
    earlier = (pg.previous(now, ago) for ago in (4, 3, 1))
    return {"late": pg.kernel(source=text)(*earlier, into=pg.target("late", "rgba32f")), "now": now}


def started() -> Mapping[str, pg.Target]:
    """A sum that starts from a color, in half floats."""
    spec = pg.target("out", "rgba16f", initial=(3.0, 2.0, 1.0, 0.0))
    return {"out": pg.kernel(source=KERNELS["add"])(pg.previous(spec), pg.Input("frame"), into=spec)}


def numbered() -> Mapping[str, pg.Target]:
    text = "def numbered(a: Image, run: int) -> vec4: return a[0, 0] * float(run)"
    return {"out": pg.kernel(source=text)(pg.Input("frame"), pg.FRAME_INDEX, into=pg.target("out", "rgba32f"))}


def drawn_over() -> Mapping[str, pg.Target]:
    """Add a draw to a copy of its sum from the last run."""
    seen = pg.target("hits", "rgba32f")
    kept = called("scale", pg.previous(seen), into="kept", factor=1.0)
    one = painted(quad(), pg.target("one", "rgba32f"), blend="add", name="one")
    return {"hits": pg.kernel(source=KERNELS["add"])(kept, one, into=seen)}


def walked() -> Mapping[str, pg.Target]:
    """A pass of tens of milliseconds, whose result is read immediately."""
    text = f"""
def walked() -> float:
    n = pixel().x * 7 + pixel().y * 1000
    for i in range({STEPS}):
        if i >= pixel().y * {STEPS // LONG}:
            break
        n = (n * 75 + 74) & 0xFFFFF
    return float(n)
"""
    return {"walked": pg.kernel(source=text)(into=pg.target("walked", "r32f"))}


def _walk() -> Picture:
    y, x = np.mgrid[0:LONG, 0:LONG]
    n = x * 7 + y * 1000
    for step in range(STEPS):
        n = np.where(step < y * (STEPS // LONG), (n * 75 + 74) & 0xFFFFF, n)
    return np.asarray(n[:, :, None], np.float32)


def _static(pictures: list[Picture]) -> Iterator[Case]:
    first, other = pictures[0], pictures[1]
    frames = (
        {"table": first, "frame": pictures[2], "factor": 1.0},
        {"table": first, "frame": pictures[3], "factor": 2.0},
        {"table": other, "frame": pictures[3], "factor": 3.0},
        {"table": other, "frame": pictures[2], "factor": 3.0},
    )
    expected = shift(other * 3.0) + pictures[2]
    yield Case(GROUP, "static inputs change", static, SIZE, frames, exact={"out": expected})


def static() -> Mapping[str, pg.Target]:
    """Return two passes that depend on a static input and a static value, and a third that does not."""
    factor = pg.Value("factor", float, static=True)
    scaled = called("scale", pg.Input("table", static=True), into="scaled", factor=factor)
    baked = called("shift", scaled.border("zero"), into="baked")
    return {"out": called("add", baked, pg.Input("frame"), into="out")}


def _memories(picture: Picture) -> Iterator[Case]:
    expected = picture
    for _ in range(6):
        expected = shift(expected)
    frames = ({"frame": picture},) * 2
    yield Case(GROUP, "memories shared along a chain", partial(chain, 6), SIZE, frames, exact={"out": expected})
    sides = [shift(picture) * factor for factor in (1.0, 2.0, 3.0)]
    late = sides[0] + shift(shift(sides[1]) + sides[2])
    yield Case(GROUP, "memories held while others run", braid, SIZE, frames, exact={"out": late})
    yield Case(GROUP, "a picture drawn into twice", twice, SIZE, exact={"first": 1.0, "again": 2.0})
    yield Case(GROUP, "one input of each size", sizes, SIZE, _size_frames(), exact={"out": 6.0})


def chain(count: int) -> Mapping[str, pg.Target]:
    """A chain of passes that read next to their pixel, so none is fused; two allocations suffice."""
    target = pg.Input("frame")
    for number in range(count):
        target = called("shift", target.border("zero"), into="out" if number == count - 1 else f"link {number}")
    return {"out": target}


def braid() -> Mapping[str, pg.Target]:
    """Pictures with different lifetimes."""
    frame = pg.Input("frame")
    base = called("shift", frame.border("zero"), into="base")
    first = called("scale", base, into="held", factor=1.0)
    second = called("scale", base, into="second", factor=2.0)
    third = called("scale", base, into="third", factor=3.0)
    turned = called("shift", second.border("zero"), into="turned")
    joined = called("add", turned, third, into="joined")
    last = called("shift", joined.border("zero"), into="last")
    return {"out": called("add", first, last, into="out")}


def twice() -> Mapping[str, pg.Target]:
    """The content before a draw over a target stays readable."""
    first = painted(quad(), pg.target("hits", "rgba32f"), blend="add", name="first")
    again = painted(quad(), first, blend="add", name="again")
    return {"first": called("scale", first, into="first copy", factor=1.0), "again": again}


def _size_frames() -> tuple[Mapping[str, Picture], ...]:
    one = np.ones((1, 1, 4), np.float32)
    return ({"small": one, "tall": np.full((40, 1, 4), 2.0, np.float32), "wide": np.full((1, 70, 4), 3.0, np.float32)},)


def sizes() -> Mapping[str, pg.Target]:
    """Inputs of other sizes than the output."""
    text = (
        "def total(small: Image, tall: Image, wide: Image) -> vec4:\n"
        "    return small.texel(pixel()) + tall.texel(pixel()) + wide.texel(pixel())"
    )
    into = pg.target("out", "rgba32f", scale=1.0)
    return {"out": pg.kernel(source=text)(pg.Input("small"), pg.Input("tall"), pg.Input("wide"), into=into)}
