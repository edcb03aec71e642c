"""The blur of the five passes: 15 taps, every other texel, as printed at the time and corrected."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import exp, pi, sqrt
from typing import Literal

import passgraph as pg
from passgraph.effects.checked import checked
from passgraph.language import Array, Const, Image

BlurKernel = Literal["normalised", "faithful"]
WeightsFrom = Literal["host", "kernel"]
#: Distances 1, 3 … 13 to each side.
PAIRS = 7
CENTER_RHO = 2.0
RHO = 3.0
ROOT_TAU = sqrt(2.0 * pi)


def tap_weights(kernel: BlurKernel = "normalised") -> tuple[float, ...]:
    """Return the weights of the texels at 0, +1, -1, +3, -3 … +13, -13.

    The center has 1·G(0; rho=2), the others 2·G(i; rho=3), with G(x; rho) = exp(-x²/(2 rho²)) / sqrt(2 pi rho²).
    "faithful" weights the texel at -i with 2·G(i + 1; 3) and does not normalize; "normalised" weights both sides alike
    and divides by the sum.

    >>> round(sum(tap_weights("faithful")), 4), round(sum(tap_weights()), 12)
    (1.0665, 1.0)
    """

    def g(x: float, rho: float) -> float:
        return exp(-x * x / (2.0 * rho * rho)) / (ROOT_TAU * rho)

    slip = 1 if kernel == "faithful" else 0
    weights = [g(0, CENTER_RHO)]
    for i in range(1, 2 * PAIRS + 1, 2):
        weights += [2.0 * g(i, RHO), 2.0 * g(i + slip, RHO)]
    total = 1.0 if kernel == "faithful" else sum(weights)
    return tuple(weight / total for weight in weights)


@pg.kernel
def blur_with(mask: Image, weights: Array[float, Literal[15]], dx: Const[int], dy: Const[int]) -> float:
    """Blur with weights from the host."""
    total = mask[0, 0].r * weights[0]
    for pair in range(PAIRS):
        i = 2 * pair + 1
        total += mask[i * dx, i * dy].r * weights[i] + mask[-i * dx, -i * dy].r * weights[i + 1]
    return total


@pg.function
def gaussian(x: float, rho: float) -> float:
    """Return a one-dimensional Gaussian with integral 1."""
    return pg.exp(-x * x / (2.0 * rho * rho)) / (ROOT_TAU * rho)


@pg.kernel
def blur_computing(mask: Image, slip: Const[int], dx: Const[int], dy: Const[int]) -> float:
    """Blur with weights computed for each pixel; ``slip`` 1 gives those as printed, 0 normalized ones."""
    weight = gaussian(0.0, CENTER_RHO)
    total = mask[0, 0].r * weight
    for pair in range(PAIRS):
        i = 2 * pair + 1
        ahead = 2.0 * gaussian(float(i), RHO)
        behind = 2.0 * gaussian(float(i + slip), RHO)
        total += mask[i * dx, i * dy].r * ahead + mask[-i * dx, -i * dy].r * behind
        weight += ahead + behind
    return total if slip == 1 else total / weight


@checked
def blur_mask(
    mask: pg.Target, kernel: BlurKernel = "normalised", weights: WeightsFrom = "host", mask_format: str = "r32f"
) -> tuple[pg.Target, pg.Target]:
    """Run passes 3 and 4: blur the red channel horizontally, then vertically.

    Parameters
    ----------
    mask : any picture; outside of it, reads follow the rule of ``mask.border(...)``
    kernel : see `tap_weights`
    weights : computed by the "host" in float64, or in the "kernel" for each pixel
    mask_format : of both targets

    Returns
    -------
    "mask_x" and "mask_blurred".

    Source: "Soft-Edged Shadows", GameDev.net article 2193, 2005.

    Examples
    --------
    >>> import numpy as np
    >>> _, blurred = blur_mask(pg.Input("mask"), "faithful")
    >>> with pg.compile(blurred, backend="reference") as program:
    ...     picture = program(mask=np.ones((4, 4), np.float32))["mask_blurred"]
    >>> round(float(picture[0, 0, 0]), 4)
    1.1374
    """
    across = _pass(mask, kernel, weights, 1, 0, pg.target("mask_x", mask_format), "pass 3: blur x")
    down = _pass(
        across.border(mask.border_rule), kernel, weights, 0, 1,
        pg.target("mask_blurred", mask_format), "pass 4: blur y",
    )  # fmt: skip
    return across, down


def _pass(
    mask: pg.Target, kernel: BlurKernel, weights: WeightsFrom, dx: int, dy: int, into: pg.TargetSpec, name: str
) -> pg.Target:
    blurred: pg.Target
    if weights == "host":
        blurred = blur_with(mask, tap_weights(kernel), dx, dy, into=into, name=name)
    else:
        blurred = blur_computing(mask, int(kernel == "faithful"), dx, dy, into=into, name=name)
    return blurred
