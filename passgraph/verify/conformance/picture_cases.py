"""Formats stored and read, by texel and filtered, under every border rule, in pictures of several sizes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import passgraph as pg
from passgraph.formats import FORMATS, Format, float_format
from passgraph.graph.targets import FILTERS
from passgraph.language.borders import BORDERS
from passgraph.verify.conformance.case import Case, values

GROUP = "pictures"
#: A pixel, odd sides, a column, a row, and more than a tile of 64 in both directions.
SIZES = ((1, 1), (7, 5), (1, 9), (9, 1), (70, 66))

#: Reads next to this pixel (if picture and target have one size) and far outside, and filtered reads from beyond one
#: side to beyond the other.
READS = """
def reads(color: Image) -> tuple[vec4, vec4]:
    texels = color[-3, 2] + color[4, -1] * 2.0 + color.texel(pixel() * 3 - ivec2(70, 90)) * 4.0
    return texels, color.sample(uv() * 2.5 - 0.7)
"""
#: Many reads of a row, as in blurs: a backend may decode bytes once for all of them.
ROW = """
def row(color: Image) -> vec4:
    total = color[-3, 1]
    for i in range(-2, 4):
        total += color[i, 1] * float(i)
    return total
"""
#: A target of another size than its input, read at texel centers, between texels and at the corners.
RESIZED = """
def resized(color: Image) -> vec4:
    return color.sample(uv())
"""
#: Texels by position, by name and by the filter of the handle.
ENLARGED = """
def enlarged(color: Image, filtered: Image) -> tuple[vec4, vec4]:
    return color.nearest(uv()), filtered.sample(uv())
"""
#: Positions at the ends of the int range, in texels and as fractions of the picture.
FAR = """
def far(color: Image) -> tuple[vec4, vec4, vec4]:
    p = pixel() * 97
    beyond = vec2(pixel() * 2 - ivec2(7, 5)) * 7e8
    lowest = color.texel(ivec2(-2147483647 - 1, p.y)) + color.texel(ivec2(p.x, -2147483647 - 1) + ivec2(p.y, p.x % 3))
    highest = color.texel(ivec2(2147483647 - p.x, p.y)) + color.texel(ivec2(p.x, 2147483584 + p.y % 64))
    return lowest, highest, color.sample(beyond)
"""
#: Positions inside texels and outside the picture; mipmap levels between and beyond the existing ones.
AT_PLACES = """
def at_places(color: Image) -> tuple[vec4, vec4, vec4, vec4]:
    place = uv() * 1.7 - 0.37
    deep = color.sample(place, float(pixel().x) * 0.375 - 0.5) + color.texel(pixel() - 3, pixel().y % 5) * 2.0
    return color.nearest(place), color.gather(place, 1), color.sample(place), deep + vec4(vec2(color.size_of(1)), 0, 0)
"""
VOLUME = """
def volume(table: Image) -> tuple[vec4, vec4]:
    place = vec3(uv() * 1.47 - 0.24, fract(uv().x * 7.0) * 1.51 - 0.26)
    return table.sample3(place), table.sample3(vec3(vec2(pixel() % 4), float(pixel().x % 3)) * 0.23 + 0.01)
"""


def cases() -> Iterator[Case]:
    """Yield cases format by format."""
    for border in BORDERS:
        for filter in FILTERS:
            frames = {"frame": values((13, 10)), "table": values((5, 12))}
            # A short run has each rule and each filter.
            quick = (border == "repeat") == (filter == "nearest")
            name = f"{filter}, levels and volumes, {border}"
            yield Case(GROUP, name, partial(at_places, border, filter), (11, 9), (frames,), quick=quick)
        frame = {"frame": values((7, 5))}
        yield Case(GROUP, f"far outside, {border}", partial(far, border), (7, 5), (frame,))
    forms = [form for form in FORMATS.values() if not form.is_depth]
    for number, form in enumerate(forms):
        for at, size in enumerate(SIZES):
            frame = {"frame": values(size, form.channels, seed=size[0])}
            for which, border in enumerate(BORDERS):
                # A short run has each format in one size under one rule, and one format in all combinations.
                quick = form.name == "rgba32f" or (at, which) == (
                    number % len(SIZES),
                    (number + number // len(SIZES)) % len(BORDERS),
                )
                name = f"{form.name} {size[0]}x{size[1]} {border}"
                yield Case(GROUP, name, partial(through, form, border), size, (frame,), quick=quick)
        if not form.srgb:
            frame = {"frame": values((7, 5), form.channels)}
            yield Case(GROUP, f"{form.name} brought from the host", partial(brought, form), (7, 5), (frame,))
    small = values((5, 4))
    threefold = small.repeat(3, axis=0).repeat(3, axis=1)
    yield Case(
        GROUP, "nearest, three times as large", enlarged, (15, 12), ({"frame": small},),
        exact={"by name": threefold, "by filter": threefold},
    )  # fmt: skip
    for size in SIZES:
        frame = {"frame": values((33, 18), 4)}
        yield Case(GROUP, f"33x18 resized to {size[0]}x{size[1]}", resized, size, (frame,))


def enlarged() -> Mapping[str, pg.Target]:
    """Enlarge each texel to 3 × 3."""
    frame = pg.Input("frame", size=(5, 4))
    specs = tuple(pg.target(name, "rgba32f", size=(15, 12)) for name in ("by name", "by filter"))
    by_name, by_filter = pg.kernel(source=ENLARGED)(frame, frame.filter("nearest"), into=specs)
    return {"by name": by_name, "by filter": by_filter}


def through(form: Format, border: str) -> Mapping[str, pg.Target]:
    """Store in a format, then read by texel and filtered under a border rule."""
    letters = "rgba"[: form.channels]
    result = "float" if form.channels == 1 else f"vec{form.channels}"
    store = pg.kernel(source=f"def store(color: Image) -> {result}: return color[0, 0].{letters}")
    stored = store(pg.Input("frame"), into=pg.target("stored", form))
    into = pg.target("texels", "rgba32f"), pg.target("samples", "rgba32f")
    texels, samples = pg.kernel(source=READS)(stored.border(border), into=into)
    row = pg.kernel(source=ROW)(stored.border(border), into=pg.target("row", "rgba32f"))
    return {"stored": stored, "texels": texels, "samples": samples, "row": row}


def far(border: str) -> Mapping[str, pg.Target]:
    """Read at the largest positions."""
    into = tuple(pg.target(f"far{k}", "rgba32f") for k in range(3))
    targets = pg.kernel(source=FAR)(pg.Input("frame", "rgba32f").border(border), into=into)
    return {target.name: target for target in targets}


def at_places(border: str, filter: str) -> Mapping[str, pg.Target]:
    """Read at positions: nearest, gathered, filtered, from mipmap levels, from a volume."""
    frame, table = (pg.Input(name).border(border).filter(filter) for name in ("frame", "table"))
    into = tuple(pg.target(name, "rgba32f", (11, 9)) for name in ("nearest", "gather", "sample", "deep"))
    targets = pg.kernel(source=AT_PLACES)(frame.mipmaps(), into=into)
    into = tuple(pg.target(name, "rgba32f", (11, 9)) for name in ("volume", "edges"))
    layers = pg.kernel(source=VOLUME)(table.slices(4), into=into)
    return {target.name: target for target in (*targets, *layers)}


def brought(form: Format) -> Mapping[str, pg.Target]:
    """Test that an input is rounded to its format, ties to even."""
    letters = "rgba"[: form.channels]
    result = "float" if form.channels == 1 else f"vec{form.channels}"
    read = pg.kernel(source=f"def read(color: Image) -> {result}: return color[0, 0].{letters}")
    return {"read": read(pg.Input("frame", form.name), into=pg.target("read", float_format(form.channels)))}


def resized() -> Mapping[str, pg.Target]:
    """Compute larger and smaller pictures than the input under each border rule."""
    kernel = pg.kernel(source=RESIZED)
    targets, frame = {}, pg.Input("frame")
    for border in BORDERS:
        into = pg.target(border, "rgba32f", scale=1.0)
        targets[border] = kernel(frame.border(border), into=into, name=border)
    return targets
