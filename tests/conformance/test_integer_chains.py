"""Chains of integer operations on special values mean what they mean to Python's own integers."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.graph.calls import kernel
from passgraph.verify.conformance import cases
from passgraph.verify.conformance.case import Case

CHAINS = [case for case in cases(["language"]) if case.name.startswith("chains after ")]


@pytest.mark.sampled
@pytest.mark.parametrize("case", CHAINS, ids=lambda case: case.name)
def test_in_the_reference_every_operation_feeds_every_other_one(case: Case) -> None:
    with pg.compile(case.graph(), "reference", case.size) as program:
        results = program(**case.frames[0])
    for target, expected in case.exact.items():
        assert callable(expected)
        np.testing.assert_array_equal(results[target], expected())


@pytest.mark.opencl
@pytest.mark.gl
@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl", "webgpu"])
def test_an_index_of_the_lowest_int_stays_inside_its_array(backend: str) -> None:
    """Its magnitude is itself, below every lower bound."""
    lookup = kernel(
        source="""
def lookup(p: Image, table: Array[float, 64]) -> vec4:
    lowest = int(p[0, 0].x) << 16
    trips = 0
    for i in range(clamp(abs(lowest), -5, 3), 5):
        trips += 1
    written = [1.0, 2.0, 3.0]
    written[clamp(abs(lowest), -5, 5)] = 9.0
    return vec4(table[clamp(abs(lowest), -5, 5)], float(clamp(abs(lowest), -5, 5)), float(trips), written[0])
"""
    )
    table = tuple(float(k + 1) for k in range(64))
    image = np.full((4, 8, 4), -32768, np.float32)
    with pg.compile(lookup(pg.Input("p", "rgba32f", (8, 4)), table=table), backend) as program:
        (result,) = program(p=image).values()
    assert result[0, 0].tolist() == [1.0, -5.0, 10.0, 1.0]
