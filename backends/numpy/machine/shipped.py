# mypy: disable-error-code="no-untyped-call"
"""Functions written for numba: shipped as LLVM text and called without numba."""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from passgraph.backends.numpy.machine.native import Code, function_code
from passgraph.cached import cached_property
from passgraph.errors import BackendError


@dataclass(frozen=True)
class Shipped:
    """Texts in one folder, a file a function, and what they were made from.

    Attributes
    ----------
    folder : of the texts, ``name.ll``
    sources : the Python files that decide them
    command : what makes them anew
    """

    folder: Path
    sources: tuple[Path, ...]
    command: str

    def text(self, name: str, make: Callable[[], str]) -> str:
        """A function's text; where the sources have changed since, what ``make`` gives, which needs numba.

        Raises
        ------
        BackendError
            The text is missing or older than its sources, and numba is not installed.
        """
        if self.is_current(name):
            return self._file(name).read_text(encoding="utf-8")
        if find_spec("numba") is None:
            raise BackendError(
                f"{self._file(name)} is missing or older than the functions that it is made from "
                f"({', '.join(source.name for source in self.sources)}); make it anew with numba: "
                f"pip install 'passgraph[dev]', then {self.command}"
            )
        return make()

    def is_current(self, name: str) -> bool:
        """Whether a function's text was made from the sources as they are."""
        try:
            with self._file(name).open(encoding="utf-8") as file:
                return file.readline() == self._heading()
        except FileNotFoundError:
            return False

    def write(self, name: str, text: str) -> None:
        """Keep a text that was made from the sources as they are."""
        self.folder.mkdir(exist_ok=True)
        self._file(name).write_text(f"{self._heading()}; Made by `{self.command}`.\n\n{text}", encoding="utf-8")

    def _file(self, name: str) -> Path:
        return self.folder / f"{name}.ll"

    def _heading(self) -> str:
        """The first line of every text.  Read as text, a source is the same with any system's ends of lines."""
        texts = [part for source in self.sources for part in (source.name, source.read_text(encoding="utf-8"))]
        digest = hashlib.sha256("\0".join(texts).encode()).hexdigest()
        return f"; Sources {digest}\n"


_LLVM = {"i64": "i64", "f64": "double"}
_DTYPES = {
    name: np.dtype(kind)
    for name, kind in (("i64", np.int64), ("i32", np.int32), ("u8", np.uint8), ("f64", np.float64), ("f32", np.float32))
}


class NumbaCode:
    """One such function.

    Parameters
    ----------
    name
        Tells it from every other, in its text too.
    pieces
        How many whole numbers each call passes on.
    kinds
        Of the other arguments: "i64", "f64", or arrays in C order such as "f32[1]" and "i32[2]" (dimensions).
    find
        Gives the Python function; called where its text is older than it.
    shipped
        Where its text is.
    level
        At which LLVM optimizes it, 1 to 3.
    """

    def __init__(
        self, name: str, pieces: int, kinds: Sequence[str], find: Callable[[], Callable[..., Any]], shipped: Shipped,
        level: int,
    ) -> None:  # fmt: skip
        self.name, self.pieces, self.kinds = name, pieces, tuple(kinds)
        self.find, self.shipped, self.level = find, shipped, level

    def call(self) -> Call:
        """Return a call object for one caller."""
        parts = ("shipped", self.name, str(self.pieces), *self.kinds)
        return Call(function_code(parts, self._text, loops=self.level), self.pieces, self.kinds)

    def generate(self) -> str:
        """Its text, made anew by numba."""
        from passgraph.backends.numpy.machine.numba_text import llvm_text, portable

        return portable(*llvm_text(self.find(), self.pieces, self.kinds), self.name)

    def _text(self, name: str) -> str:
        return self.shipped.text(self.name, self.generate) + entry_text(name, self.name, self.pieces, self.kinds)


class Call:
    """A function with its context, for one caller at a time: what stays the same from frame to frame is bound once."""

    def __init__(self, code: Code, pieces: int, kinds: Sequence[str]) -> None:
        self.code, self.pieces, self.kinds = code, pieces, kinds
        split = [kind.rstrip("]").split("[") for kind in kinds]
        self.arrays = [(_DTYPES[rest[0]], int(rest[1])) if len(rest) == 2 else None for rest in split]
        sizes = [1 if array is None else 1 + array[1] for array in self.arrays]
        self.places = [0, *accumulate(sizes)]
        self.numbers = np.zeros(sum(sizes), np.int64)
        self.floats = self.numbers.view(np.float64)
        self.held: list[Any] = [None] * len(sizes)

    @cached_property
    def run(self) -> Callable[..., int]:
        """A function of the numbers of a piece."""
        kind = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, *[ctypes.c_int64] * self.pieces)
        return partial(self.code.function(kind, self.numbers, self.held), self.numbers.ctypes.data)

    def bound(self, *arguments: Any) -> Callable[..., int]:
        """A function of the numbers of a piece, until others are bound; the arrays are kept alive as long."""
        for number, (current, argument) in enumerate(zip(self.held, arguments, strict=True)):
            if current is not argument:
                self._bind(number, argument)
        return self.run

    def _bind(self, number: int, argument: Any) -> None:
        array, place = self.arrays[number], self.places[number]
        if array is not None:
            assert (argument.dtype, argument.ndim) == array and argument.flags.c_contiguous
            self.numbers[place : place + 1 + argument.ndim] = (argument.ctypes.data, *argument.shape)
        else:
            (self.floats if self.kinds[number] == "f64" else self.numbers)[place] = argument
        self.held[number] = argument


def entry_text(name: str, inner: str, pieces: int, kinds: Sequence[str]) -> str:
    """A function of the context and a piece's numbers that calls numba's with arguments as numba lays them out: an
    array is its owner and parent (none), count, size of an item, address, shape and strides."""
    lines: list[str] = []
    passed = [f"i64 %piece{k}" for k in range(pieces)]
    place = 0

    def entry(kind: str) -> str:
        nonlocal place
        lines.append(f"%at{place} = getelementptr i64, ptr %context, i64 {place}")
        lines.append(f"%c{place} = load {kind}, ptr %at{place}")
        place += 1
        return f"%c{place - 1}"

    for number, kind in enumerate(kinds):
        if kind in _LLVM:
            passed.append(f"{_LLVM[kind]} {entry(_LLVM[kind])}")
            continue
        element, dimensions = kind.rstrip("]").split("[")
        address = entry("ptr")
        shape = [entry("i64") for _ in range(int(dimensions))]
        size = _DTYPES[element].itemsize
        step, strides = str(size), list[str]()
        for axis in reversed(range(len(shape))):
            strides.insert(0, step)
            lines.append(f"%step{number}_{axis} = mul i64 {step}, {shape[axis]}")
            step = f"%step{number}_{axis}"
        lines.append(f"%count{number} = udiv i64 {step}, {size}")
        passed += ["ptr null", "ptr null", f"i64 %count{number}", f"i64 {size}", f"ptr {address}"]
        passed += [f"i64 {value}" for value in (*shape, *strides)]
    lines += [
        "%result = alloca i64",
        "store i64 0, ptr %result",
        "%error = alloca ptr",
        f"%status = call i32 @{inner}(ptr %result, ptr %error, {', '.join(passed)})",
        "%returned = load i64, ptr %result",
        "ret i64 %returned",
    ]
    arguments = ", ".join(["ptr %context", *(f"i64 %piece{k}" for k in range(pieces))])
    return f"\ndefine i64 @{name}({arguments}) {{\n  " + "\n  ".join(lines) + "\n}\n"
