"""What an engine's depth buffer holds, in both directions."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.errors import InputError

HOLDS = [
    pg.HardwareDepth(0.1, 1e5),
    pg.HardwareDepth(0.1, np.inf),
    pg.HardwareDepth(0.1, 1e5, reversed_z=True),
    pg.HardwareDepth(0.1, np.inf, reversed_z=True),
    pg.HardwareDepth(0.1, 1e5, orthographic=True),
    pg.HardwareDepth(0.1, 1e5, reversed_z=True, orthographic=True),
]


@pytest.mark.parametrize("holds", HOLDS, ids=str)
def test_distances_come_back_from_what_is_held(holds):
    distances = np.geomspace(0.1001, 9e4, 50)
    # 1 - d loses digits of float64 beside 1, as many as far / near has
    assert np.allclose(holds.distance(holds.depth(distances)), distances, rtol=1e-9)
    # where nothing is drawn stays marked
    assert holds.distance(holds.depth(0.0)) == 0.0


@pytest.mark.parametrize("holds", HOLDS, ids=str)
@pytest.mark.parametrize("zero_to_one", [False, True])
def test_the_number_is_what_the_projection_writes(holds, zero_to_one):
    """The fixed function of an engine: clip space by its matrix, then its depth range."""
    low = 0.0 if zero_to_one else -1.0
    matrix = _engine_matrix(holds, low)
    assert pg.HardwareDepth.of_projection(matrix, zero_to_one) == _close(holds)
    for distance in (0.1, 0.7, 30.0, 5e4):
        clip = matrix @ (0.3, 0.2, -distance, 1.0)
        written = (clip[2] / clip[3] - low) / (1.0 - low)
        assert holds.depth(distance) == pytest.approx(written, abs=1e-12)


def _engine_matrix(holds, low):
    """Solved from what it has to do: near to one end of clip space, far to the other."""
    at_near, at_far = (1.0, low) if holds.reversed_z else (low, 1.0)
    matrix = np.diag([1.5, 2.0, 0.0, 0.0])
    near, far = holds.near, holds.far
    if holds.orthographic:
        slope = (at_far - at_near) / (far - near)
        matrix[2, 2:], matrix[3, 3] = (-slope, at_near - slope * near), 1.0
    else:
        # depth = a + b / distance
        b = (at_near - at_far) / (1.0 / near - 1.0 / far)
        a = at_near - b / near
        matrix[2, 2:], matrix[3, 2] = (-a, b), -1.0
    return matrix


def _close(holds):
    return pytest.approx(holds) if isinstance(holds, float) else _Close(holds)


class _Close:
    """Equal to what has the same words and nearly the same numbers."""

    def __init__(self, holds):
        self.holds = holds

    def __eq__(self, other):
        near = np.isclose([self.holds.near, self.holds.far], [other.near, other.far], rtol=1e-6).all()
        return near and (self.holds.reversed_z, self.holds.orthographic) == (other.reversed_z, other.orthographic)


@pytest.mark.parametrize("reversed_z", [False, True])
def test_what_is_no_number_is_not_drawn(reversed_z):
    holds = pg.HardwareDepth(1.0, 9.0, reversed_z)
    far = 0.0 if reversed_z else 1.0
    assert holds.distance([np.nan, far, far + (-1.0 if reversed_z else 1.0)]).tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"near": 0.0, "far": 1.0}, "hardware depth: near: expected a finite number in ]0"),
        ({"near": 2.0, "far": 1.0}, "hardware depth: expected near < far, got near 2 and far 1"),
        ({"near": 1.0, "far": "x"}, "hardware depth: far: expected a number above near, got 'x'"),
        ({"near": 1.0, "far": np.nan}, "hardware depth: far: expected a finite number"),
        ({"near": 1.0, "far": 2.0, "reversed_z": 1}, "hardware depth: reversed_z must be True or False, got 1"),
        ({"near": 1.0, "far": np.inf, "orthographic": True}, "a parallel projection has a finite far plane, got inf"),
    ],
)
def test_bad_fields_are_named(fields, text):
    with pytest.raises(InputError, match=text):
        pg.HardwareDepth(**fields)
