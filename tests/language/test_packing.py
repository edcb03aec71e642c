"""Packing parameters: plain values by the short way, with the same numbers and refusals as the long one."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.errors import InputError
from passgraph.language import uniform_layout
from passgraph.language.types import BOOL, FLOAT, INT, IVEC2, VEC2, VEC3, VEC4, Array, Matrix, Type, Vector

BVEC3 = Vector(BOOL, 3)
MATRIX = np.arange(16.0).reshape(4, 4)
INT_MIN, INT_MAX = -(2**31), 2**31 - 1
LARGEST = float(np.finfo(np.float32).max)

#: What callers hand in run by run.
PLAIN: list[tuple[Type, Any, Any]] = [
    (FLOAT, 0.5, [0.5]),
    (FLOAT, 3, [3]),
    (FLOAT, True, [1]),
    (FLOAT, np.float32(0.5), [0.5]),
    (FLOAT, np.float64(-LARGEST), [-LARGEST]),
    (FLOAT, np.uint8(7), [7]),
    (FLOAT, np.array(0.25), [0.25]),
    (INT, INT_MIN, [INT_MIN]),
    (INT, np.int64(INT_MAX), [INT_MAX]),
    (INT, np.uint32(INT_MAX), [INT_MAX]),
    (BOOL, True, [1]),
    (BOOL, np.bool_(False), [0]),
    (BOOL, 1, [1]),
    (VEC2, [1, 0.5], [1, 0.5]),
    (VEC3, (0.5, 1, True), [0.5, 1, 1]),
    (VEC3, pg.vec3(1.0, 2.0, 3.0), [1, 2, 3]),
    (VEC3, tuple(np.array([1.0, 2.0, 3.0])), [1, 2, 3]),
    (VEC3, np.array([1, 2, 3], ">f8"), [1, 2, 3]),
    (VEC3, np.array([1, 2, 3], np.float16), [1, 2, 3]),
    (VEC4, np.full(4, LARGEST), [LARGEST] * 4),
    (IVEC2, pg.ivec2(INT_MIN, INT_MAX), [INT_MIN, INT_MAX]),
    (IVEC2, np.array([INT_MIN, INT_MAX]), [INT_MIN, INT_MAX]),
    (IVEC2, np.array([-3, 4], np.int16), [-3, 4]),
    (BVEC3, (True, 0, 1), [1, 0, 1]),
    (BVEC3, np.array([True, False, True]), [1, 0, 1]),
    (Matrix(4, 4), MATRIX, MATRIX.T.ravel()),
    (Matrix(4, 4), MATRIX.astype(np.float32), MATRIX.T.ravel()),
    (Matrix(4, 4), np.asfortranarray(MATRIX), MATRIX.T.ravel()),
    (Matrix(4, 4), tuple(map(tuple, MATRIX.tolist())), MATRIX.T.ravel()),
    (Matrix(4, 4), tuple(MATRIX.ravel().tolist()), MATRIX.ravel()),
    (Matrix(2, 2), pg.mat2(1.0, 2.0, 3.0, 4.0), [1, 2, 3, 4]),
    (Array(FLOAT, 100), np.full(100, LARGEST), [LARGEST] * 100),
    (Array(FLOAT, 100), list(range(100)), range(100)),
    (Array(INT, 100), np.full(100, INT_MIN), [INT_MIN] * 100),
    (Array(VEC2, 3), [(1, 2), (3, 4), (5, 6)], range(1, 7)),
    (Matrix(2, 3), np.arange(6.0).reshape(3, 2), [0, 2, 4, 1, 3, 5]),
    (Matrix(2, 3), pg.mat2x3(1.0, 2.0, 3.0, 4.0, 5.0, 6.0), range(1, 7)),
    (Matrix(4, 2), [[1, 2, 3, 4], [5, 6, 7, 8]], [1, 5, 2, 6, 3, 7, 4, 8]),
    (Array(Matrix(3, 2), 2), np.arange(12.0).reshape(2, 2, 3), [0, 3, 1, 4, 2, 5, 6, 9, 7, 10, 8, 11]),
    (Array(Matrix(2, 2), 2), np.arange(8.0).reshape(2, 2, 2), [0, 2, 1, 3, 4, 6, 5, 7]),
]


def named(case: Any) -> str:
    return f"{case[0]} {type(case[1]).__name__}"


@pytest.mark.parametrize("case", PLAIN, ids=named)
def test_plain_values_get_no_long_look(case: tuple[Type, Any, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    type_, value, wanted = case
    looked = uniform_layout._fully_checked(value, type_, "w")
    monkeypatch.setattr(uniform_layout, "_fully_checked", None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = uniform_layout.components(value, type_, "w")
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found, np.array(wanted, np.float64))
    np.testing.assert_array_equal(found, looked)


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("count", [1, 3, 16, 17, 100])
def test_what_is_not_finite_is_a_float(number: float, count: int) -> None:
    given = np.arange(float(count))
    given[-1] = number
    for value in (given, given.tolist(), given.astype(np.float32), tuple(given)):
        np.testing.assert_array_equal(uniform_layout.components(value, Array(FLOAT, count), "w"), given)


@pytest.mark.parametrize("count", [1, 3, 16, 17, 100])
def test_bits_above_the_ints_mean_the_int_with_these_bits(count: int) -> None:
    given = np.arange(count)
    given[-1] = 0xFFFFFFFF
    for value in (given, given.tolist(), given.astype(np.uint32), given.astype(np.uint64), tuple(given)):
        np.testing.assert_array_equal(uniform_layout.components(value, Array(INT, count), "w"), [*range(count - 1), -1])


@pytest.mark.parametrize("count", [1, 3, 16, 17, 100])
@pytest.mark.parametrize(
    ("element", "wrong", "words"),
    [
        (FLOAT, 3.5e38, "finite floats reach"),
        (FLOAT, -1e300, "finite floats reach"),
        (INT, 2.0**32, "got floats"),
        (INT, 2**32, "ints reach from"),
        (INT, INT_MIN - 1, "ints reach from"),
        (INT, 0.5, "got floats"),
        (BOOL, 2, "a bool is True or False"),
        (BOOL, -1, "a bool is True or False"),
    ],
)
def test_one_number_out_of_range_among_many_is_refused(element: Any, wrong: float, words: str, count: int) -> None:
    """Wherever it stands, in whatever holds it: the sum of squares of a -1 is no larger than that of a 1."""
    rest = [0] * (count - 1)
    for row in ([*rest, wrong], [wrong, *rest]):
        for value in (row, tuple(row), np.array(row), np.array(row)[::-1]):
            with pytest.raises(InputError, match=words):
                uniform_layout.components(value, Array(element, count), "w")


@pytest.mark.parametrize("value", [0.5, np.float32(1), (1, 2), [1, 2, 3, 4], np.zeros(2), [[1, 2, 3]] * 2, "abc", None])
def test_another_number_of_numbers_is_refused(value: object) -> None:
    with pytest.raises(InputError, match=r"w must be vec3 \(3 numbers\), got "):
        uniform_layout.components(value, VEC3, "w")


def test_rows_and_columns_of_an_oblong_matrix_are_not_mixed_up() -> None:
    """Two rows of three hold as many numbers as three rows of two, and mean another matrix."""
    with pytest.raises(InputError, match=r"w must be mat2x3 \(6 numbers; 3 rows of 2 each\), got "):
        uniform_layout.components(np.zeros((2, 3)), Matrix(2, 3), "w")
    with pytest.raises(InputError, match="3 rows of 2 each"):
        uniform_layout.components(np.zeros((4, 2, 3)), Array(Matrix(2, 3), 4), "w")
