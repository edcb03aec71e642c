"""A probe, the programs that it runs, and what a bench does for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

Language = Literal["glsl", "wgsl", "opencl", "numpy"]
Stage = Literal["fragment", "vertex", "compute"]
Type = Literal["float", "int", "uint"]
#: NumPy's type of a result.
DTYPES: Mapping[Type, Any] = {"float": np.float32, "int": np.int32, "uint": np.uint32}
#: Integers with a name of their own.
NAMES = {-(2**31): "-2³¹", 2**31 - 1: "2³¹-1", 2**31: "2³¹", 2**32 - 1: "2³²-1", 2**31 - 128: "2³¹-128",
          2**32 - 256: "2³²-256"}  # fmt: skip


class NotHereError(Exception):
    """The device or its language lacks what a probe needs."""


@dataclass(frozen=True)
class Said:
    """What a specification says of a fact.

    Attributes
    ----------
    text : in a few words
    section : the document and its section
    allowed : the facts that conform; empty if each does
    begins : the beginning of facts that conform
    forbidden : the end of facts that do not
    """

    text: str
    section: str
    allowed: tuple[str, ...] = ()
    begins: str = ""
    forbidden: str = ""

    def allows(self, fact: str) -> bool:
        """Return True if a fact conforms."""
        if self.allowed:
            return fact in self.allowed
        return fact.startswith(self.begins) and not (self.forbidden and fact.endswith(self.forbidden))


@dataclass(frozen=True)
class Program:
    """Statements that compute ``r`` from four words of input, once for each row.

    The words are there as the floats ``a b c d``, the ints ``i j k l`` and the uints ``u v``.

    Attributes
    ----------
    code : statements in the language of the bench
    before : declarations before the function
    options : of OpenCL's compiler
    qualifier : of the result's declaration in GLSL, such as "precise"
    version : of GLSL, the first one that has what the code uses
    """

    code: str
    result: Type = "float"
    stage: Stage = "fragment"
    before: str = ""
    options: tuple[str, ...] = ()
    qualifier: str = ""
    version: int = 330


class Bench(Protocol):
    """An open device on which probes run; the methods raise NotHereError for what it lacks.

    Formats are "rgba8", "rgba8_srgb", "rgba16" and "rgba16f". Stored numbers are those of memory, halves as float16.
    """

    language: Language

    def compute(self, program: Program, rows: NDArray[np.uint32]) -> NDArray[np.uint32]:
        """Return the bits of ``r`` for each row of four words."""

    def store(self, format: str, values: NDArray[np.float32], times: int = 0) -> NDArray[Any]:
        """Write a row of colors to a picture, and return its numbers; with ``times``, add them so often, times their
        alpha, by blending."""

    def load(self, format: str, numbers: NDArray[Any]) -> NDArray[np.float32]:
        """Return what a shader reads of a row of stored numbers."""

    def sample(self, texels: NDArray[np.uint8], at: NDArray[np.float32], linear: bool) -> NDArray[np.float32]:
        """Return the first channel of an rgba8 row of texels at horizontal coordinates from 0 to 1, clamped."""

    def cover(self, corners: NDArray[np.float32], size: tuple[int, int], samples: int = 1) -> NDArray[np.float32]:
        """Return the share of samples of each pixel, row 0 at y = 0, that triangles cover; corners are in pixels."""

    def mipmap(self, texels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the first channel of the second level of an rgba8 picture that the driver makes."""


@dataclass(frozen=True)
class Expression:
    """A program and its arguments, whose results are listed as they are."""

    program: Program
    rows: NDArray[np.uint32]


@dataclass(frozen=True)
class Probe:
    """A fact to measure.

    Attributes
    ----------
    name : its key in kept results
    part : the table that shows it
    asks : the arguments, or what is measured, in a few words
    measure : by language, what runs it on a bench and returns the fact
    said : what the specification says, by language
    expressions : by language, the program whose results are the fact
    """

    name: str
    part: str
    asks: str
    measure: Mapping[Language, Callable[[Any], str]]
    said: Mapping[Language, Said] = field(default_factory=dict)
    expressions: Mapping[Language, Expression] = field(default_factory=dict)


def rows_of(*rows: Sequence[float | int]) -> NDArray[np.uint32]:
    """Return rows of four words, from floats, and ints for those that are read as such.

    >>> rows_of((1.0, 2))[0].tolist()
    [1065353216, 2, 0, 0]
    """
    words = np.zeros((len(rows), 4), np.uint32)
    for row, given in zip(words, rows, strict=True):
        for k, number in enumerate(given):
            row[k] = number % 2**32 if isinstance(number, int) else np.float32(number).view(np.uint32)
    return words


def text_of(number: Any) -> str:
    """Return a number as a fact shows it.

    >>> text_of(np.float32(np.inf)), text_of(np.int32(-(2**31))), text_of(np.float32(0.1))
    ('∞', '-2³¹', '0.1')
    """
    if isinstance(number, np.floating):
        if np.isnan(number):
            return "NaN"
        if np.isinf(number):
            return "∞" if number > 0 else "-∞"
        return f"{number:.6g}"
    return NAMES.get(int(number), str(int(number)))


def listed(numbers: NDArray[Any]) -> str:
    """Return the results of all rows in their order."""
    return ", ".join(text_of(number) for number in numbers)
