"""Distances from depth buffers, as every device computes them."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.surfaces.engine_depth import distances
from passgraph.errors import GraphError
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import render
from tests.test_hardware_depth import HOLDS


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_float32_keeps_what_the_buffer_holds(backend_name):
    """A factor of 1e6 between near and far costs no digit beyond those that the buffer itself lacks."""
    for holds in HOLDS:
        held = holds.depth(np.geomspace(0.1, 9.9e4, 64)).astype(np.float32)[None]
        made = render(distances(pg.Input("depth"), holds), size=None, backend=backend_name, depth=held)["distance"]
        assert np.allclose(made[..., 0], holds.distance(held), rtol=1e-6, atol=0.0), holds


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
@pytest.mark.parametrize("holds", [pg.HardwareDepth(1.0, 50.0), pg.HardwareDepth(1.0, 50.0, reversed_z=True)], ids=str)
def test_the_sky_and_what_is_no_number_stay_marked(backend_name, holds):
    far = 0.0 if holds.reversed_z else 1.0
    held = np.array([[far, np.nan, 0.5]], np.float32)
    graph = distances(pg.Input("depth"), holds)
    with pg.compile(graph, backend=backend_name, non_finite="keep") as program:
        made = program(depth=held)["distance"][0, :, 0]
    assert made[0] == made[1] == 0.0 < made[2]


def test_16_bits_are_read_as_they_are_stored():
    holds = pg.HardwareDepth(1.0, 50.0)
    stored = np.rint(holds.depth([[1.5, 7.0, 0.0]]) * 65535).astype(np.uint16)
    made = render(distances(pg.Input("depth", "r16", (3, 1)), holds), size=None, depth=stored)["distance"][..., 0]
    assert np.allclose(made, holds.distance(stored / 65535.0), rtol=1e-6)
    assert np.allclose(made, [[1.5, 7.0, 0.0]], rtol=1e-3)


def test_near_and_far_may_change_from_run_to_run():
    holds = pg.Value("holds", pg.HardwareDepth, default=pg.HardwareDepth(1.0, 10.0))
    with pg.compile(distances(pg.Input("depth"), holds), backend="numpy") as program:
        for far in (10.0, 100.0):
            made = program(depth=np.float32([[0.5]]), holds=pg.HardwareDepth(1.0, far))["distance"]
            assert made.item() == pytest.approx(2.0 / (1.0 + 1.0 / far))


def test_devices_agree_on_distances():
    depth = np.random.default_rng(3).uniform(-0.1, 1.1, (5, 7, 1)).astype(np.float32)
    for holds in (HOLDS[0], HOLDS[3], HOLDS[5]):
        assert_within_bounds(distances(pg.Input("depth"), holds), depth=depth)


def test_what_says_nothing_of_the_buffer_is_refused():
    with pytest.raises(GraphError, match=r"distances: holds must be a pg\.HardwareDepth or a pg\.Value, got 0\.1"):
        distances(pg.Input("depth"), 0.1)
