"""Shortcuts of the language tests: kernels from text, run over columns of numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from evaluate import Evaluator
from numpy.typing import NDArray

from passgraph.graph.calls import PixelKernel, kernel
from passgraph.language.lower import Facts, lower
from passgraph.language.scalar import ScalarProgram

Column = NDArray[Any]


def parsed(body: str, result: str = "float", before: str = "", parameters: str = "c: Image") -> PixelKernel:
    """A kernel ``k`` around some lines; ``x y z w`` are the channels of its image."""
    names = "    x, y, z, w = c[0, 0].x, c[0, 0].y, c[0, 0].z, c[0, 0].w\n" if parameters == "c: Image" else ""
    lines = "\n".join("    " + line for line in body.splitlines())
    return kernel(source=f"{before}\n\ndef k({parameters}) -> {result}:\n{names}{lines}\n", name="k")


def lowered(body: str, result: str = "float", before: str = "", **facts: Any) -> ScalarProgram:
    return lower(parsed(body, result, before).program, Facts(**facts))


def run_program(program: ScalarProgram, *columns: Column) -> list[Column]:
    """Every output value of a program whose image holds some columns."""
    count = len(columns[0]) if columns else 1
    picture = np.zeros((count, 4), np.float32)
    for i, column in enumerate(columns):
        picture[:, i] = column
    evaluator = Evaluator(program, count, lambda image, x, y: picture, **{
        "pixel.0": np.arange(count), "pixel.1": np.zeros(count, int),
        "output_size.0": np.full(count, count), "output_size.1": np.ones(count, int),
    })  # fmt: skip
    return [value for output in evaluator.outputs() for value in output]


def run(expression: str, *columns: Column, result: str = "float", before: str = "", **facts: Any) -> Column:
    """One expression of x, y, z, w over columns."""
    values = run_program(lowered(f"return {expression}", result, before, **facts), *columns)
    return values[0] if len(values) == 1 else np.stack(values, axis=-1)
