"""Probes of precision: the largest error of a function over samples of its domain."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from passgraph.language.native import GLSL, NOTHING, OPENCL, WGSL, Accuracy
from passgraph.language.operations import OPERATIONS
from passgraph.verify.function_errors import samples, ulp_errors
from passgraph.verify.probes.probe import Bench, Language, Probe, Program, Said, Stage

PART = "Largest errors of functions in ULP, in their usual range; in all of their domain"
#: Samples of each function; the smallest argument of the usual ones.
COUNT, LEAST = 8192, 1e-3
#: Functions with another name than the kernel language's; empty if the language has none.
_NAMES: Mapping[str, Mapping[Language, str]] = {
    "inversesqrt": {"wgsl": "inverseSqrt", "opencl": "rsqrt"}, "atan2": {"glsl": "atan"},
}  # fmt: skip
_NUMPY: Mapping[str, Callable[..., Any]] = {
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2, "asinh": np.arcsinh,
    "acosh": np.arccosh, "atanh": np.arctanh, "pow": np.power, "div": np.divide,
    "inversesqrt": lambda x: np.float32(1) / np.sqrt(x),
}  # fmt: skip
_PROMISES: Mapping[Language, Mapping[str, Accuracy]] = {"glsl": GLSL, "wgsl": WGSL, "opencl": OPENCL}
_SECTIONS: Mapping[Language, str] = {
    "glsl": "GLSL 4.60 4.7.1", "wgsl": "WGSL, Floating Point Accuracy", "opencl": "OpenCL C 3.0 7.4",
}  # fmt: skip
#: What the tables of native functions lack.
_MORE: Mapping[Language, Mapping[str, Accuracy]] = {
    "glsl": {"div": Accuracy(2.5), "sqrt": Accuracy(formula="1.0 / inversesqrt(x)")},
    "wgsl": {"div": Accuracy(2.5), "sqrt": Accuracy(formula="1.0 / inverseSqrt(x)")},
    "opencl": {"div": Accuracy(2.5), "sqrt": Accuracy(3.0)},
}
#: Ends a fact that is not what is promised.
OUTSIDE = ", more than promised"
#: Functions of OpenCL that are as fast as the device can, with errors of its own.
NATIVE = ("exp", "exp2", "log", "log2", "sin", "cos", "tan", "inversesqrt", "sqrt")


def errors_of(name: str, results: Any, arguments: list[Any], promise: Accuracy) -> str:
    """Return the largest errors in ULP: over the range in which programs use a function, and over all samples."""
    with np.errstate(all="ignore"):
        exact = OPERATIONS[name].reference(*(a.astype(np.float64) for a in arguments))
    errors, usual = ulp_errors(results, exact), np.ones(len(results), bool)
    for operand, numbers in enumerate(arguments):
        low, high = OPERATIONS[name].ordinary(operand)
        usual &= (numbers >= np.float32(low)) & (numbers <= np.float32(high)) & (np.abs(numbers) >= LEAST)
    outside = OUTSIDE if (errors > _promised_ulp(promise, exact, arguments)).any() else ""
    return f"{_ulp(errors[usual].max())}; {_ulp(errors.max())}{outside}"


def _ulp(error: float) -> str:
    return (
        "∞"
        if np.isinf(error)
        else f"{error:.2g}"
        if error < 10
        else f"{error:.0f}"
        if error < 1000
        else f"{error:.0e}".replace("e+", "e")
    )


def _promised_ulp(promise: Accuracy, exact: Any, arguments: list[Any]) -> Any:
    """Return the largest error in ULP that is promised for each sample; infinite where nothing is."""
    first = arguments[0].astype(np.float64)
    if promise.formula or not promise.promises:
        return np.full(first.shape, np.inf)
    with np.errstate(all="ignore"):
        unit = np.spacing(np.clip(np.abs(exact), 2.0**-126, 3.4e38).astype(np.float32)).astype(np.float64)
    most = np.full(first.shape, promise.ulp or 0.0) + promise.ulp_by_size * np.abs(first)
    most = np.maximum(most, promise.absolute / unit)
    most = np.where((first >= 0.5) & (first <= 2.0), np.maximum(most, promise.near_one / unit), most)
    smallest = np.min([np.abs(numbers) for numbers in arguments], 0)
    return np.where((first >= promise.low) & (first <= promise.high) & (smallest >= promise.least), most, np.inf)


def _arguments(name: str) -> list[Any]:
    random, row = np.random.default_rng(0), OPERATIONS[name]
    return [samples(row, operand, random, COUNT) for operand in range(len(row.operands))]


def _precision(name: str, prefix: str = "") -> Probe:
    def promise(language: Language) -> Accuracy:
        return NOTHING if prefix else {**_PROMISES[language], **_MORE[language]}[name]

    def on(language: Language) -> Callable[[Bench], str]:
        called = prefix + _NAMES.get(name, {}).get(language, name)
        operands = ("a", "b")[: len(OPERATIONS[name].operands)]
        code = "r = a / b;" if name == "div" else f"r = {called}({', '.join(operands)});"
        stage: Stage = "compute" if language == "opencl" else "fragment"

        def measured(bench: Bench) -> str:
            arguments = _arguments(name)
            rows = np.zeros((COUNT, 4), np.float32)
            for k, numbers in enumerate(arguments):
                rows[:, k] = numbers
            results = bench.compute(Program(code, "float", stage), rows.view(np.uint32)).view(np.float32)
            return errors_of(name, results, arguments, promise(language))

        return measured

    def by_numpy(bench: object) -> str:
        arguments = _arguments(name)
        with np.errstate(all="ignore"):
            return errors_of(name, (_NUMPY.get(name) or getattr(np, name))(*arguments), arguments, NOTHING)

    languages: tuple[Language, ...] = ("opencl",) if prefix else tuple(_PROMISES)
    measure: dict[Language, Callable[[Any], str]] = {language: on(language) for language in languages}
    if not prefix:
        measure["numpy"] = by_numpy
    said = {language: Said(str(promise(language)), _SECTIONS[language], forbidden=OUTSIDE) for language in languages}
    label = "a / b" if name == "div" else f"{prefix}{_NAMES.get(name, {}).get('opencl', name)}" if prefix else name
    return Probe(f"{prefix or 'error-'}{name}", PART, f"`{label}`", measure, said)


FUNCTIONS = tuple(
    [_precision(name) for name in ("div", "sqrt", *OPENCL)] + [_precision(name, "native_") for name in NATIVE]
)
