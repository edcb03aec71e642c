"""Detect NaN or infinity where the reference has a number, or the reverse, although bounds allow it.

Outside an operation's documented domain, bounds allow everything, NaN too: a backend that writes NaN there conforms.
But a NaN in a picture grows with each later blur, so authors of kernels need to know.  ``check`` and ``compare``
therefore report it as a fault.  The conformance suite does not: it judges backends, and its cases use such numbers on
purpose.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from passgraph.language.operations import OPERATIONS
from passgraph.plan.data import CopyStep, Plan
from passgraph.verify.oracle.allowed import Allowed
from passgraph.verify.oracle.pass_bounds import Key, Passes, Picture
from passgraph.verify.oracle.watch import Cause, Watch

#: How to keep an operation within its documented domain; for other operations, the numbers are too large.
MENDS = {
    "sqrt": "sqrt(max(x, 0.0))",
    "inversesqrt": "inversesqrt(max(x, 1e-12))",
    "log": "log(max(x, 1e-6))",
    "log2": "log2(max(x, 1e-6))",
    "pow": "pow(max(x, 0.0), y)",
    "div": "x / max(y, 1e-6)",
    "mod": "mod(x, max(y, 1e-6))",
    "asin": "asin(clamp(x, -1.0, 1.0))",
    "acos": "acos(clamp(x, -1.0, 1.0))",
    "normalize": "v / max(length(v), 1e-6)",
}
SMALLER = "min(x, 65504.0) on what goes in"
#: Most causes in a message, in the order in which the kernel computes them.
MOST_CAUSES = 3


@dataclass(frozen=True)
class OtherKind:
    """Values of one target of another kind (number, NaN, infinity) than the reference's, not explained by a decision.

    Attributes
    ----------
    share : of the pixels
    pixel : (column, row) of the first
    got, expected : all channels of that pixel
    reads : the texels at this pixel of the images that the pass reads, by the kernel's name
    causes : operations whose result may be NaN or infinite there although no argument is, in the kernel's order
    """

    share: float
    pixel: tuple[int, int]
    got: tuple[float, ...]
    expected: tuple[float, ...]
    reads: tuple[tuple[str, tuple[float, ...]], ...]
    causes: tuple[Cause, ...]
    both: bool = False  # the reference has the same kind

    def __str__(self) -> str:
        column, row = self.pixel
        if self.both:
            return (
                f"NaN or infinity at {self.share:.3%} of pixels, as the reference computes it, such as column "
                f"{column}, row {row}: {numbers(self.got)}{self.given}: {self.cause}"
            )
        return (
            f"NaN or infinity where the reference has numbers, or the reverse, at {self.share:.3%} of pixels, such as "
            f"column {column}, row {row}: {numbers(self.got)} where the reference has {numbers(self.expected)}"
            f"{self.given}. {self.why}"
        )

    @property
    def given(self) -> str:
        """Describe the texels that the pass reads there."""
        return reads_in_words(self.reads)

    @property
    def why(self) -> str:
        """Explain why bounds allow both, and how to fix it in the kernel."""
        return f"The bounds allow both, since {self.cause}"

    @property
    def cause(self) -> str:
        """Return the place in the kernel that causes it, and how to fix it."""
        if not self.causes:
            return (
                "what is stored may lie beyond the largest number of the format; "
                f"mend the kernel: {SMALLER}, or a format that holds more"
            )
        causes = list({str(cause): cause for cause in self.causes}.values())[:MOST_CAUSES]
        mends = dict.fromkeys(MENDS.get(cause.operation, SMALLER) for cause in causes)
        reasons = " and ".join(f"{cause} {_reason(cause.operation)}" for cause in causes)
        return f"{reasons}; mend the kernel there, such as: {', or '.join(mends)}"


def reads_in_words(reads: tuple[tuple[str, tuple[float, ...]], ...]) -> str:
    """Describe what a pass reads at a pixel; empty if it reads nothing.

    >>> reads_in_words((("a", (0.5,)),))
    ', given a = (0.5)'
    """
    return "".join(f", given {name} = {numbers(values)}" for name, values in reads)


def numbers(values: tuple[float, ...]) -> str:
    """Format float32 values so that different ones read differently.

    >>> numbers((0.1, float("nan")))
    '(0.1, nan)'
    """
    return f"({', '.join(str(np.float32(value)) for value in values)})"


def _reason(operation: str) -> str:
    if operation in ("div", "mod"):
        return "may divide by 0, or what is too large"
    if operation == "pow":
        return "promises nothing below 0, and may leave the range of float32"
    if operation == "normalize":
        return "may be given a vector without a length"
    low, high = OPERATIONS[operation].domain_of(0).promised if operation in OPERATIONS else (-np.inf, np.inf)
    if low > -np.inf:
        below = "at 0 and below" if operation in ("log", "log2") or low > 0 else f"below {low:g}"
        return f"promises nothing {below}" + (f" and above {high:g}" if high < 1e30 else "")
    return "may leave the range of float32"


def other_kinds(
    judged: Mapping[Key, Picture], expected: Mapping[Key, Picture], allowed: Mapping[Key, Allowed]
) -> dict[Key, NDArray[np.bool_]]:
    """Return by target, if it has any, the pixels (height, width) of another kind than the reference's that no decision
    explains."""
    pixels_by_key = {key: _other_kind(judged[key], picture, allowed[key]) for key, picture in expected.items()}
    return {key: pixels for key, pixels in pixels_by_key.items() if pixels.any()}


def _other_kind(got: Picture, expected: Picture, allowed: Allowed) -> NDArray[np.bool_]:
    same_kind = (np.isnan(got) == np.isnan(expected)) & (np.isinf(got) == np.isinf(expected))
    turned = allowed.ambiguous & ~allowed.unpromised
    return np.asarray(~same_kind.all(axis=2) & ~turned)


def first_other_kind(
    passes: Passes, key: Key, pixels: NDArray[np.bool_], got: Picture, expected: dict[Key, Picture], watch: Watch
) -> OtherKind:
    """Return the report of the first of some pixels."""
    row, column = (int(i) for i in np.argwhere(pixels)[0])
    causes = watch.opened_at(row * pixels.shape[1] + column)
    return OtherKind(
        float(pixels.mean()),
        (column, row),
        _values(got[row, column]),
        _values(expected[key][row, column]),
        reads_at(passes, key, expected, row, column),
        causes,
    )


def _values(pixel: NDArray[np.floating]) -> tuple[float, ...]:
    return tuple(float(value) for value in pixel)


def reads_at(
    passes: Passes, key: Key, expected: dict[Key, Picture], row: int, column: int
) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """Return the texels at a pixel of the images of the same size, which usually determine the result."""
    frame, number, _ = key
    plan: Plan = passes.plan
    step = plan.steps[number]
    if isinstance(step, CopyStep):
        return ()
    inputs = {resource: name for name, resource in plan.inputs.items()}
    reads = []
    for name, resource in step.images:
        if plan.resources[resource].size != step.size:
            continue
        written = [expected[k] for k in expected if k[0] == frame and k[1] < number and k[2] == resource]
        if written:
            reads.append((name, _values(written[-1][row, column])))
        elif resource in inputs:
            texel = np.asarray(passes.frames[frame][0][inputs[resource]][row, column])
            steps = plan.resources[resource].format.steps if texel.dtype.kind == "u" else 0
            reads.append((name, _values(texel / np.float32(steps or 1))))
    return tuple(reads)
