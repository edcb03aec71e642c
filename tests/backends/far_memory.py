"""Load machine code where only single pages are free within 2 GiB of it: a process that a test starts."""

import ctypes
import mmap

import numpy as np

import passgraph as pg
from passgraph.backends.numpy.machine import compiler

PAGE = mmap.PAGESIZE
MAP_NORESERVE = 0x4000
libc = ctypes.CDLL(None)
libc.mmap.restype = ctypes.c_void_p
libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long]
libc.munmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
load_object = compiler.load_object


def reserve(size: int) -> int:
    return int(libc.mmap(None, size, 0, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | MAP_NORESERVE, -1, 0))


def fill_address_space() -> None:
    """Leave gaps of one page only, and none of them in the 3 GiB above what is mapped next."""
    with open("/proc/self/maps") as maps:
        lowest = min(start for line in maps if (start := int(line.split("-")[0], 16)) > 0x7000_0000_0000)
    size = 1 << 30
    while size >= 2 * PAGE:
        while (address := reserve(size)) > lowest:
            pass
        libc.munmap(address, size)
        size //= 2
    pages = reserve(256 * PAGE)
    reserve(3 << 30)
    for page in range(1, 256, 2):
        libc.munmap(pages + page * PAGE, PAGE)


def load_far(code, function):
    fill_address_space()
    return load_object(code, function)


if __name__ == "__main__":
    compiler.load_object = load_far
    terms = " + ".join(f"pow(abs(c[{column}, 0]), vec4(0.{column + 1}))" for column in range(12))
    kernel = pg.kernel(source=f"def k(c: Image) -> vec4: return {terms}")
    with pg.compile(kernel(pg.Input("c")), backend="numpy") as program:
        picture = program(c=np.ones((4, 4, 4), np.float32))["k"]
    np.testing.assert_array_equal(picture, 12.0)
