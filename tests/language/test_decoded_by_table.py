"""Kernels that are too long because of the sRGB curve read it from a table, and compute the same bits."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.errors import KernelLengthError
from passgraph.graph.calls import PixelKernel
from passgraph.language import scalar as s
from passgraph.language.facts import Facts, ImageFacts
from passgraph.language.lower import _decoded_steps, lower

#: Places of 16 samples, no two of which share a texel.
PLACES = [(x / 9 + 0.03, y / 5 + 0.07) for y in range(4) for x in range(4)]
SRGB = Facts(images={"c": ImageFacts(4, decode="decode_srgb")})


def sums(count: int) -> PixelKernel[object]:
    lines = "".join(f"    total += c.sample(fract(uv() + vec2({x}, {y})))\n" for x, y in PLACES[:count])
    return pg.kernel(source=f"def sums(c: Image) -> vec4:\n    total = vec4(0.0)\n{lines}    return total\n")


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> int:
    """A limit that lets small kernels be too long."""
    monkeypatch.setattr("passgraph.language.lower.MAX_INSTRUCTIONS", 2000)
    return 2000


def linear(stored: NDArray[np.uint8]) -> NDArray[np.float64]:
    x = stored / 255.0
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl"])
def test_every_step_of_the_table_has_the_bits_of_the_curve(backend: str) -> None:
    """A short kernel computes the curve; every 8-bit number goes through it."""
    copy = pg.kernel(source="def copy(c: Image) -> vec4: return c[0, 0]")
    stored = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(4, axis=2)
    target = copy(pg.Input("c", "rgba8_srgb", (16, 16)), into=pg.target("out", "rgba32f"))
    with pg.compile(target, backend=backend) as program:
        found = program(c=stored)["out"][..., 0].ravel()
    table = np.float32(_decoded_steps("decode_srgb"))
    np.testing.assert_allclose(table, linear(np.arange(256)), rtol=5e-7)
    # A driver that divides by 255 itself may be off by a last bit, which the power makes more of.
    np.testing.assert_allclose(found, table, rtol=1e-6 if backend == "gl" else 0)


@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl"])
def test_a_kernel_that_decodes_too_much_computes_what_its_parts_do(backend: str) -> None:
    stored = np.random.default_rng(8).integers(0, 256, (11, 13, 4), dtype=np.uint8)
    found = []
    for picture, format_ in ((stored, "rgba8_srgb"), (np.float32(linear(stored)), "rgba32f")):
        frame = pg.Input("c", format_, (13, 11)).border("zero")
        picture[..., 3] = stored[..., 3] / 255.0 if format_ == "rgba32f" else stored[..., 3]
        with pg.compile(sums(16)(frame, into=pg.target("out", "rgba32f", size=(13, 11))), backend=backend) as program:
            found.append(program(c=picture)["out"])
    np.testing.assert_allclose(*found, rtol=3e-6)


def test_only_kernels_that_are_too_long_read_tables(few: int) -> None:
    short, long = lower(sums(1).program, SRGB), lower(sums(3).program, SRGB)
    assert not short.tables
    assert 3 * s.count(short.body) > 2 * few
    assert [len(values) for _, _, values in long.tables] == [256]
    assert s.count(long.body) < few / 2
    assert sum(isinstance(i, s.LoadTable) for i in s.walk(long.body)) == 3 * 4 * 3


def test_places_in_the_table_lie_inside_whatever_is_read(few: int) -> None:
    program = lower(sums(3).program, SRGB)
    made = {i.to.id: i for i in program.body if isinstance(i, (s.Op, s.Choose))}
    loads = [i for i in program.body if isinstance(i, s.LoadTable)]
    assert loads
    for load in loads:
        assert isinstance(load.index, s.Val)
        least = made[load.index.id]
        assert isinstance(least, s.Op)
        assert (least.operation, least.arguments[1]) == ("min", s.Lit("int", 255))
        most = made[least.arguments[0].id]  # type: ignore[union-attr]
        assert isinstance(most, s.Op)
        assert (most.operation, most.arguments[1]) == ("max", s.Lit("int", 0))


def test_what_is_too_long_by_itself_is_refused_with_its_own_length(few: int) -> None:
    lines = "".join(f"    total += pow(abs(total) + {n}.25, c[0, 0] + {n}.75)\n" for n in range(4))
    kernel = pg.kernel(source=f"def many(c: Image) -> vec4:\n    total = c.sample(uv())\n{lines}    return total\n")
    lengths = []
    for facts in (SRGB, Facts()):
        with pytest.raises(KernelLengthError, match=rf"at most {few}") as error:
            lower(kernel.program, facts)
        lengths.append(int(re.findall(r"many has (\d+) instructions", str(error.value))[0]))
    assert lengths[1] < lengths[0] < lengths[1] + 200
