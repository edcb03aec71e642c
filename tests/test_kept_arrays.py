"""Arrays of this package in the disk cache: the same in every bit, and made again where the file is not theirs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from passgraph import disk_cache, kept_arrays
from passgraph.scene import ground, teapot


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv(disk_cache.CACHE_VARIABLE, str(tmp_path))
    monkeypatch.setattr(disk_cache, "_IMPORTED", float("inf"))  # files of a fresh checkout are new
    disk_cache.package_stamp.cache_clear()
    yield tmp_path
    disk_cache.package_stamp.cache_clear()


def stored(made: list[int], count: int = 3) -> tuple[NDArray[Any], ...]:
    def numbers(count: int) -> tuple[NDArray[Any], ...]:
        made.append(count)
        return np.arange(count), np.full((2, count), 0.1, np.float32)

    return kept_arrays.kept(numbers)(count)


@pytest.mark.parametrize("make", [lambda: teapot._teapot(4), lambda: ground._tile_pictures(64, 7)])
def test_what_is_recalled_is_the_same_in_every_bit(make: Any) -> None:
    for one, other in zip(make(), make(), strict=True):
        assert one is not other
        assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())


def test_a_second_call_makes_nothing_and_other_arguments_do() -> None:
    made: list[int] = []
    assert [stored(made, count)[1].shape for count in (3, 3, 4)] == [(2, 3), (2, 3), (2, 4)]
    assert made == [3, 4]


@pytest.mark.parametrize("content", [b"", b"no array", b"\x93NUMPY\x01\x00\x02\x00{", b"\x93NUMPY\x01\x00"])
def test_a_file_with_anything_else_is_made_again(own_cache: Path, content: bytes) -> None:
    made: list[int] = []
    stored(made)
    (file,) = (own_cache / "arrays").iterdir()
    disk_cache.remember("arrays", file.name, content)
    assert stored(made)[0].tolist() == [0, 1, 2] and made == [3, 3]
    file.write_bytes(b"torn")
    assert stored(made)[0].tolist() == [0, 1, 2] and made == [3, 3, 3]


def test_nothing_is_kept_once_a_file_of_the_package_changed(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disk_cache, "_IMPORTED", 0.0)
    disk_cache.package_stamp.cache_clear()
    made: list[int] = []
    stored(made), stored(made)
    assert made == [3, 3] and not (own_cache / "arrays").exists()
