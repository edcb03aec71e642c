"""What a blend computes, against its formula written out in NumPy."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Block, quantised
from passgraph.formats import FORMATS, Format
from passgraph.graph.draw_state import BLENDS, EQUATIONS, FACTORS, Blend
from passgraph.language import scalar as s
from passgraph.plan.blending import blend_program
from passgraph.plan.data import DrawStep
from tests.corners import placed
from tests.outside_backend.passgraph_plainpy import Run

Pixels = NDArray[np.float32]
ONE = np.float32(1)
NOTHING = Block(np.zeros(0, np.float32), np.zeros(0, np.int32))

#: Factor → its value from source, source alpha, destination, destination alpha.
VALUES: dict[str, Callable[[Any, Any, Any, Any], Any]] = {
    "zero": lambda s, sa, d, da: np.float32(0),
    "one": lambda s, sa, d, da: ONE,
    "source_color": lambda s, sa, d, da: s,
    "one_minus_source_color": lambda s, sa, d, da: ONE - s,
    "destination_color": lambda s, sa, d, da: d,
    "one_minus_destination_color": lambda s, sa, d, da: ONE - d,
    "source_alpha": lambda s, sa, d, da: sa,
    "one_minus_source_alpha": lambda s, sa, d, da: ONE - sa,
    "destination_alpha": lambda s, sa, d, da: da,
    "one_minus_destination_alpha": lambda s, sa, d, da: ONE - da,
}


def wanted(blend: Blend, format_: Format, source: Pixels, held: Pixels) -> Pixels:
    """OpenGL 3.3, tables 4.1 and 4.2, in float32."""
    if format_.steps:
        source = np.clip(source, 0, 1)
    alphas = [x[:, 3] if format_.channels == 4 else np.full(len(x), ONE) for x in (source, held)]
    columns = []
    for channel in range(format_.channels):
        terms = blend.alpha_terms if channel == 3 else (blend.source, blend.destination, blend.equation)
        s, d = source[:, channel], held[:, channel]
        one, other = (
            x * VALUES[factor](s, alphas[0], d, alphas[1]) for x, factor in zip((s, d), terms[:2], strict=True)
        )
        columns.append(
            {
                "add": one + other, "subtract": one - other, "reverse_subtract": other - one,
                "min": np.minimum(s, d), "max": np.maximum(s, d),
            }[terms[2]]
        )  # fmt: skip
    return quantised(np.stack(columns, axis=1), format_)


def run(program: s.ScalarProgram, source: Pixels, held: Pixels) -> Pixels:
    parts = {"source": source, "destination": held}
    builtins = {f"{name}.{k}": column for name, part in parts.items() for k, column in enumerate(part.T)}
    made: Pixels = Run(program, len(source), NOTHING, builtins, {}).outputs[0]
    return made


@pytest.mark.parametrize("name", [form.name for form in FORMATS.values() if form.blendable])
def test_a_blend_is_its_formula(name: str) -> None:
    form = FORMATS[name]
    random = np.random.default_rng(5)
    source = random.uniform(-0.5, 1.5, (40, form.channels)).astype(np.float32)
    held = quantised(random.uniform(0, 1, (40, form.channels)), form)
    # Each on either side, of colour and of alpha.
    blends = [Blend(a, b, "add", b, a, "subtract") for a, b in pairwise((*FACTORS, FACTORS[0]))]
    blends += [Blend("source_alpha", "one", a, equation_alpha=b) for a, b in pairwise((*EQUATIONS, EQUATIONS[0]))]
    for blend in blends:
        np.testing.assert_array_equal(
            run(blend_program(blend, form), source, held), wanted(blend, form, source, held), str(blend)
        )


def test_what_a_zero_factor_takes_away_may_be_infinite() -> None:
    infinite, one = np.full((1, 1), np.inf, np.float32), np.ones((1, 1), np.float32)
    assert run(blend_program(Blend("one", "zero"), FORMATS["r32f"]), one, infinite).tolist() == [[1.0]]
    assert run(blend_program(Blend("zero", "one"), FORMATS["r32f"]), infinite, one).tolist() == [[1.0]]


def test_nan_counts_as_0_in_fractions() -> None:
    nan = np.full((1, 4), np.nan, np.float32)
    held = np.full((1, 4), 0.2, np.float32)
    assert run(blend_program(BLENDS["add"], FORMATS["rgba8"]), nan, held).tolist() == held.tolist()


def test_a_step_tells_how_each_target_is_blended() -> None:
    kernels = placed("""
def paint(corner: Corner) -> tuple[vec4, float]:
    return vec4(1.0), 0.5
""")
    place, paint = pg.vertex(source=kernels, name="place"), pg.fragment(source=kernels, name="paint")
    mesh = pg.Mesh.make(positions=[[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], triangles=[[0, 1, 2]])
    into = (pg.target("a", "rgba8"), pg.target("b", "r32f"))
    for blend, blended in (((None, BLENDS["max"]), [False, True]), ((), [False, False])):
        made = pg.draw(mesh, vertex=place, fragment=paint, into=into, **({"blend": blend} if blend else {}))
        with pg.compile(list(made), backend="null", size=(4, 4)) as program:
            (step,) = program.plan.steps
        assert isinstance(step, DrawStep)
        assert [one is not None for one in step.blending] == blended
