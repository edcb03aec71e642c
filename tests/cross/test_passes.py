"""What holds between two runs of one backend: optimised or not, once and again.

Whether each run by itself is right, passgraph.verify.conformance says (tests/conformance).
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.formats import FORMATS, Format
from passgraph.verify.conformance import Case, cases
from passgraph.verify.conformance.case import values

COLOUR_FORMATS = [f for f in FORMATS.values() if not f.is_depth]
#: Numbers of channels are stored alike; each kind of number once, and each number of channels.
FIRST_OF_EACH_KIND = ("r8", "rg16", "rgb16f", "rgba32f", "rgba8", "rgba16f", "rgb8_srgb")
#: Draws whose order, blending, tests or threads could show.
DRAWS = ("cull none, lean", "blend alpha", "blend into rgba8", "discard", "several targets", "stencil invert on passed")


def through(format_: Format) -> pg.Target:
    """A picture stored in a format and read back by a second pass."""
    letters = "rgba"[: format_.channels]
    result = "float" if format_.channels == 1 else f"vec{format_.channels}"
    store = pg.kernel(source=f"def store(color: Image) -> {result}: return color[0, 0].{letters}")
    read = pg.kernel(source="def read(color: Image) -> vec4: return color[0, 0]")
    stored = store(pg.Input("frame"), into=pg.target("stored", format_))
    return read(stored, into=pg.target("out", "rgba32f"))


def run(target: pg.Target, backend: str, frame: NDArray[np.float32], **options: bool) -> NDArray[np.float32]:
    with pg.compile({"out": target}, backend=backend, options=pg.Options(**options)) as program:
        return program(frame=frame)["out"]


@pytest.mark.sampled
@pytest.mark.parametrize(
    "format_",
    [
        pytest.param(form, id=form.name, marks=() if form.name in FIRST_OF_EACH_KIND else pytest.mark.slow)
        for form in COLOUR_FORMATS
    ],
)
def test_fused_passes_give_the_same_bits(format_: Format, backend_name: str) -> None:
    """A fused producer still passes through its target's format."""
    frame = values((37, 23), format_.channels)
    fused, apart = (run(through(format_), backend_name, frame, fuse=fuse) for fuse in (True, False))
    # GL reads integer formats within one ulp, which decoding sRGB makes a few.
    ulp = (16 if format_.srgb else 1) * 2.0**-23 if format_.steps and backend_name == "gl" else 0.0
    np.testing.assert_allclose(fused, apart, rtol=0, atol=ulp)


def test_two_runs_are_the_same_bits(backend_name: str) -> None:
    text = "def wave(c: Image) -> vec4: return sin(c[0, 0] * 40.0) * exp(c[1, 0]) + c.sample(uv() * 0.9)"
    kernel = pg.kernel(source=text)
    frame = values((129, 65), 4)
    target = kernel(pg.Input("frame"), into=pg.target("out", "rgba32f"))
    np.testing.assert_array_equal(run(target, backend_name, frame), run(target, backend_name, frame))


@pytest.mark.sampled
@pytest.mark.parametrize("case", [c for c in cases(["draw states"]) if c.name in DRAWS], ids=lambda case: case.name)
def test_a_draw_gives_the_same_bits_again(case: Case, backend_name: str) -> None:
    """In the same program and in another one: the order of triangles is kept, whatever runs in parallel."""
    outputs = dict(case.graph())
    results = []
    for _ in range(2):
        with pg.compile(outputs, backend=backend_name, size=case.size) as program:
            results += [dict(program()), dict(program())]
    for name, picture in results[0].items():
        for other in results[1:]:
            np.testing.assert_array_equal(other[name], picture)
