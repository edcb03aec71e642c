"""The matte of objects in layers of a Cryptomatte; `passgraph.cryptomatte` reads these layers and their objects."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

import passgraph as pg
from passgraph import arguments
from passgraph.errors import GraphError

#: Most objects of one matte: elements of an array that computed indices reach.
MOST_OBJECTS = 16_384
#: A binary search for each rank. Numbers are compared as floats: none is NaN or so small that a device rounds it to 0.
_TEXT = """
def is_among(number: float, numbers: Array[float, {count}]) -> bool:
    first = 0
    last = {count} - 1
    for _ in range({steps}):
        middle = (first + last) // 2
        if numbers[middle] < number:
            first = middle + 1
        else:
            last = middle
    return numbers[first] == number


def cryptomatte(ranks: Array[Image, {layers}], numbers: Array[float, {count}]) -> float:
    total = 0.0
    for i in range({layers}):
        pair = ranks[i][0, 0]
        total += pair.g if is_among(pair.r, numbers) else 0.0
        total += pair.a if is_among(pair.b, numbers) else 0.0
    return total
"""


def cryptomatte(
    ranks: Sequence[pg.Target], numbers: ArrayLike, into: pg.TargetSpec | None = None, name: str = "matte"
) -> pg.Target:
    """Sum how much of each pixel some objects of a Cryptomatte cover.

    Parameters
    ----------
    ranks : the layers of a Cryptomatte, in float32, such as ``crypto_object00``, ``crypto_object01``
    numbers : numbers of the objects, as `passgraph.cryptomatte.Cryptomatte.find` returns them; at most 16384
    into : destination target; default: one float32 named ``name``
    name : name of the pass

    Results are 0 to 1, but for the rounding of a sum.
    Source: J. Friedman and A. C. Jones, "Cryptomatte Specification" 1.2.0, 2018.

    Examples
    --------
    >>> import numpy as np
    >>> pixel = np.array([[[3.5, 0.75, -2.0, 0.25]]], np.float32)      # an object covers 3/4 of it, another one 1/4
    >>> with pg.compile(cryptomatte([pg.Input("objects00")], [-2.0]), backend="reference") as program:
    ...     float(program(objects00=pixel)["matte"][0, 0, 0])
    0.25
    """
    layers = arguments.several(ranks, pg.Target, "cryptomatte: ranks", "layers of a Cryptomatte")
    with np.errstate(over="ignore"):  # infinite, which is refused below
        found = np.unique(arguments.numbers(numbers, "cryptomatte: numbers", "be floats").astype(np.float32))
    if not layers:
        raise GraphError("cryptomatte: ranks must be one layer of a Cryptomatte or more, got none")
    if not 0 < len(found) <= MOST_OBJECTS or not np.isfinite(found).all():
        raise GraphError(f"cryptomatte: numbers must be 1 to {MOST_OBJECTS} finite floats, got {len(found)}")
    steps = max(1, (len(found) - 1).bit_length())
    text = _TEXT.format(layers=len(layers), count=len(found), steps=steps)
    return pg.kernel(source=text)(layers, found, into=pg.target(name, "r32f") if into is None else into, name=name)
