"""Pictures with gaps between their pixels are moved by compiled code, which reads nothing that may not be read."""

from __future__ import annotations

from collections.abc import Iterator
from mmap import mmap

import numpy as np
import pytest

from passgraph.backends.numpy.machine.workers import PAGE, Workers
from passgraph.backends.numpy.pixels.moves import Moves
from passgraph.formats import colour_format

#: So large that NumPy does not move them.
SIZE = (61, 131)
VIEWS = {
    "RGB of RGBA": (4, np.s_[:, :, :3]),
    "BGR of RGBA": (4, np.s_[:, :, 2::-1]),
    "the last three": (4, np.s_[::-1, :, 1:]),
    "two, rows apart": (3, np.s_[::2, :, 1:]),
    "one of three": (3, np.s_[:, :, 1:2]),
    "every other column": (2, np.s_[:, ::2, :]),
}


@pytest.fixture
def moves() -> Iterator[Moves]:
    with Workers(2) as workers:
        yield Moves(workers)


def moved(moves: Moves, view: np.ndarray) -> np.ndarray:
    format_ = colour_format(view.dtype.str[1:], view.shape[2])
    assert format_ is not None
    made = np.zeros(view.shape, view.dtype)
    moves(view, format_, made, format_)
    return made


def within_a_page(array: np.ndarray) -> np.ndarray:
    """A copy that ends in the middle of a page: where it happens to end with one, NumPy has to move it."""
    room = np.empty(array.nbytes + PAGE, np.uint8)
    first = (PAGE // 2 - room.ctypes.data - array.nbytes) % PAGE
    copy = room[first : first + array.nbytes].view(array.dtype).reshape(array.shape)
    copy[...] = array
    return copy


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("dtype", ["u1", "u2", "f2", "f4"])
def test_views_of_some_channels_are_moved_by_compiled_code(name: str, dtype: str, moves: Moves) -> None:
    channels, view = VIEWS[name]
    rng = np.random.default_rng(len(name))
    whole = within_a_page((rng.random((SIZE[0] * 2, SIZE[1] * 2, channels)) * 200).astype(dtype))
    given, before = whole[view], whole.copy()
    np.testing.assert_array_equal(moved(moves, given), given)
    np.testing.assert_array_equal(whole, before)
    assert moves._run.cache_info().currsize == 1


@pytest.mark.parametrize("behind", [0, 1])
def test_what_a_page_ends_with_is_not_read_beyond(behind: int, moves: Moves) -> None:
    """The last pixel's fourth number is in the next page, which nobody may have to read, or just before it."""
    count = SIZE[0] * SIZE[1] * 4
    pages = -(-(count + PAGE) // PAGE)
    memory = np.frombuffer(mmap(-1, pages * PAGE), np.uint8)
    memory[:] = np.arange(memory.size, dtype=np.uint32) % 251
    first = memory.size - count - behind
    whole = memory[first : first + count].reshape(*SIZE, 4)
    # As colours begin one number late, what has them as four channels ends one behind the array.
    given = whole[..., 1:]
    np.testing.assert_array_equal(moved(moves, given), given)
    assert moves._run.cache_info().currsize == behind
