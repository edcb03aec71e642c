"""The guard itself: pages beside an array cannot be touched, and the numpy backend works inside it."""

from __future__ import annotations

import ctypes
import subprocess
import sys

import numpy as np
import pytest

import passgraph as pg
from tests.hostile import guard
from tests.hostile.guard import check_rooms, guarded, guarded_aligned_zeros, guarded_zeros


@pytest.mark.parametrize("place", [-1, 4 * 7])
def test_a_byte_beside_a_guarded_array_kills(place: int) -> None:
    code = f"""
import ctypes
from tests.hostile.guard import guarded_zeros
array = guarded_zeros(7, "float32")
ctypes.memset(array.ctypes.data + {place if place > 0 else -4096}, 1, 1)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert done.returncode == -11, done


def test_guarded_arrays_are_zeros_that_can_be_written() -> None:
    array = guarded_zeros((3, 5), np.int32)
    assert array.shape == (3, 5)
    assert not array.any()
    ctypes.memset(array.ctypes.data, 1, array.nbytes)
    assert (array == 0x01010101).all()


def test_a_program_runs_guarded_as_it_does_unguarded() -> None:
    blur = pg.kernel(
        source="def blur(c: Image) -> vec4:\n    return (c[-1, 0] + c[0, 0] + c[1, 0] + c[0, 1] + c[0, -1]) / 5.0"
    )
    picture = np.random.default_rng(1).random((37, 53, 4), np.float32)
    made = blur(pg.Input("frame"))
    with pg.compile(made) as program:
        plain = program(frame=picture)["blur"]
    with guarded(), pg.compile(made) as program:
        assert np.array_equal(program(frame=picture)["blur"], plain)


def test_a_write_behind_an_array_is_seen_though_reads_there_are_allowed() -> None:
    array = guarded_aligned_zeros(7)
    check_rooms()
    array = guarded_aligned_zeros(7)
    ctypes.memset(array.ctypes.data + 4 * 7 + 40, 0, 1)
    with pytest.raises(AssertionError, match="written behind an array"):
        check_rooms()
    guard._rooms.clear()
