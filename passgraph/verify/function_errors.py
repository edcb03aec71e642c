"""Measure the functions of the kernel language on a backend: errors in ULP beside what is promised."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Backend
from passgraph.graph.calls import kernel
from passgraph.graph.targets import Input
from passgraph.language.native import OPENCL, Math
from passgraph.language.operations import OPERATIONS, Operation
from passgraph.plan.data import Options
from passgraph.run.compile import compile
from passgraph.run.program import Program

#: Functions that are measured: all that some specification has a precision for.
MEASURED: tuple[str, ...] = tuple(name for name in OPERATIONS if name in OPENCL)
#: Samples are a square picture of this side, in pixels.
SIDE = 512
SMALLEST_NORMAL, LARGEST = 2.0**-126, (2.0 - 2.0**-23) * 2.0**127
#: Arguments with results that a table states one by one.
SPECIAL = (0.0, -0.0, 1e-40, np.inf, -np.inf, np.nan)


@dataclass(frozen=True)
class FunctionErrors:
    """Errors of one function's float32 results over samples of its domain.

    Attributes
    ----------
    worst, typical : largest and median error in units in the last place of the exact result; infinite where the result
        is not finite and the exact one is
    worst_at : arguments of the largest error
    promised : what the language promises, or for native math the device's specification
    special : (argument, result) for zeros, a denormal, infinities and NaN, for functions of one argument
    """

    name: str
    math: Math
    worst: float
    typical: float
    worst_at: tuple[float, ...]
    promised: str
    special: tuple[tuple[float, float], ...] = ()


def measure_functions(
    backend: Backend, math: Math = "exact", side: int = SIDE, seed: int = 0
) -> Iterator[FunctionErrors]:
    """Yield the errors of each function on an open backend.

    Half of the samples are spread evenly over the float32 numbers of the domain, by their bits; half over the range in
    which programs use the function.  Exact results are float64, whose own error is below 1e-8 ULP of float32.

    Parameters
    ----------
    math
        ``"native"`` measures the functions that it changes, and no others.
    side
        The samples are ``side`` squared.

    Examples
    --------
    >>> from passgraph.backends.registry import open_backend
    >>> with open_backend("numpy") as backend:
    ...     worst = {found.name: found.worst for found in measure_functions(backend, side=64)}
    >>> worst["exp2"] < 3
    True
    """
    for name in measurable(backend, math, MEASURED):
        yield _measured(backend, OPERATIONS[name], math, side, seed)


def _measured(backend: Backend, row: Operation, math: Math, side: int, seed: int) -> FunctionErrors:
    random, count = np.random.default_rng(seed), len(row.operands)
    arguments = [samples(row, operand, random, side * side) for operand in range(count)]
    results = _results(backend, row, math, arguments, side)
    with np.errstate(all="ignore"):
        exact = row.reference(*(a.astype(np.float64) for a in arguments))
    errors = ulp_errors(results, exact)
    at = int(np.argmax(errors))
    special: tuple[tuple[float, float], ...] = ()
    if count == 1:
        given = np.resize(np.array(SPECIAL, np.float32), side * side)
        found = _results(backend, row, math, [given], side)[: len(SPECIAL)]
        special = tuple((float(x), float(y)) for x, y in zip(SPECIAL, found, strict=True))
    return FunctionErrors(
        row.name, math, float(errors[at]), float(np.median(errors)), tuple(float(a[at]) for a in arguments),
        promised_by(row, math, backend), special,
    )  # fmt: skip


def measurable(backend: Backend, math: Math, names: Iterable[str]) -> tuple[str, ...]:
    """Return the functions whose results depend on this mode: all if products are contracted, else the device's own."""
    limits = backend.limits
    return tuple(name for name in names if math == "exact" or limits.contracts or name in limits.native)


def promised_by(row: Operation, math: Math, backend: Backend) -> str:
    """Return what the language promises of a function, or for native math the device's specification, in words."""
    if math == "native" and row.name in backend.limits.native:
        return str(backend.limits.native[row.name])
    return f"{row.ulp:g} ULP" + (f" + {row.absolute:.3g}" if row.absolute else "")


def samples(row: Operation, operand: int, random: np.random.Generator, count: int) -> NDArray[np.float32]:
    """Return numbers of an operand's domain, half of them spread over its bits."""
    domain, (low, high) = row.domain_of(operand), row.ordinary(operand)
    bits = random.integers(0, 0x7F800000, 4 * count, dtype=np.int64).astype(np.uint32)
    numbers = bits.view(np.float32) * np.where(random.random(4 * count) < 0.5, -1, 1).astype(np.float32)
    least = max(domain.least, SMALLEST_NORMAL)
    inside = numbers[(numbers >= domain.low) & (numbers <= domain.high) & (np.abs(numbers) >= least)]
    ordinary = random.uniform(low, high, count).astype(np.float32)
    mixed = np.concatenate([np.resize(inside, count - count // 2) if len(inside) else ordinary, ordinary])[:count]
    return random.permutation(mixed)


def _results(
    backend: Backend, row: Operation, math: Math, arguments: list[NDArray[np.float32]], side: int
) -> NDArray[np.float32]:
    picture = np.zeros((side, side, 4), np.float32)
    for channel, numbers in enumerate(arguments):
        picture[..., channel] = numbers.reshape(side, side)
    with program_of(backend, row, math, "rgba32f") as program:
        return np.asarray(program(samples=picture)["measured"], np.float32).reshape(-1)


def program_of(backend: Backend, row: Operation, math: Math, format: str) -> Program:
    """Compile a function that takes its arguments from channels of the input ``samples`` and writes ``measured``."""
    called = row.as_written(*(f"at.{letter}" for letter in "xy"[: len(row.operands)]), by_name=True)
    text = f"def measured(p: Image) -> float:\n    at = p[0, 0]\n    return {called}\n"
    result = kernel(source=text)(Input("samples", format))
    return compile(result, backend, options=Options(math=math), non_finite="keep")


def ulp_errors(results: NDArray[np.float32], exact: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return errors in units in the last place of the exact results.

    Denormals may be flushed, and results beyond the largest number may stop there or be infinite.
    """
    with np.errstate(all="ignore"):
        got = results.astype(np.float64)
        unit = np.spacing(np.clip(np.abs(exact), SMALLEST_NORMAL, LARGEST).astype(np.float32)).astype(np.float64)
        errors = np.abs(got - exact) / unit
        beyond = (np.abs(exact) > LARGEST) & (np.abs(got) >= LARGEST) & (np.sign(got) == np.sign(exact))
        tiny = (np.abs(exact) < SMALLEST_NORMAL) & (np.abs(got) <= SMALLEST_NORMAL)
        same = beyond | tiny | (np.isnan(got) & np.isnan(exact))
    return np.where(same, 0.0, np.where(np.isfinite(errors), errors, np.inf))
