"""Built-in functions of shading languages, and what their specifications promise of them.

With ``Options(math="native")`` a kernel calls these in place of the polynomials of :mod:`.prelude`: faster on most
devices, with other results on each.  A backend lists those that it has and that are faster there
(:attr:`~passgraph.plan.limits.Limits.native`); the oracle takes its bounds from here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal, get_args

from passgraph.records import dataclass

#: Functions as this package computes them, alike on every backend, or the device's own.
Math = Literal["exact", "native"]
MATH: tuple[str, ...] = get_args(Math)


@dataclass(frozen=True)
class Accuracy:
    """What a specification promises of a function's float32 result; by default nothing.

    Attributes
    ----------
    ulp : largest error in units in the last place; None if no such number is promised
    ulp_by_size : units that are added for each unit of |x|
    absolute : largest error that is allowed instead where it is larger
    near_one : the same, for arguments in [1/2, 2] only
    formula : kernel text in x, y and z from whose operations an error is inherited that is allowed too
    ordered : the promise holds only where the first argument is below the second
    low, high : first arguments for which the promise holds
    least : smallest size of an argument for which it holds
    """

    ulp: float | None = None
    ulp_by_size: float = 0.0
    absolute: float = 0.0
    near_one: float = 0.0
    formula: str = ""
    ordered: bool = False
    low: float = -math.inf
    high: float = math.inf
    least: float = 0.0

    @property
    def promises(self) -> bool:
        """Return True if anything is promised."""
        return self.ulp is not None or self.absolute > 0.0 or bool(self.formula)

    def __str__(self) -> str:
        """Return the promise as a few words for a table."""
        parts = []
        if self.ulp is not None:
            parts.append(
                f"{self.ulp:g} ULP" if not self.ulp_by_size else f"{self.ulp:g} + {self.ulp_by_size:g}·abs(x) ULP"
            )
        if self.absolute:
            parts.append(f"±{self.absolute:.3g}")
        if self.near_one:
            parts.append(f"±{self.near_one:.3g} in [0.5, 2]")
        if self.formula:
            parts.append(f"as {self.formula}")
        if parts and math.isfinite(self.low):
            parts.append(f"from {self.low:.3g}" + (f" to {self.high:.3g}" if math.isfinite(self.high) else " on"))
        return ", ".join(parts) or "nothing"


NOTHING = Accuracy()
_POSITIVE = (2.0**-126, 2.0**126)
_CIRCLE = (-math.pi, math.pi)
_EXPONENTIAL = Accuracy(3.0, ulp_by_size=2.0)
#: Denormals may count as 0, whose logarithm is undefined.
_LOGARITHM = Accuracy(3.0, near_one=2.0**-21, low=2.0**-126)

#: Functions of GLSL with a precision (GLSL 4.60, 4.7.1; the same numbers in GLSL ES 3.20, 4.7.1).
_WITH_PRECISION = {
    "exp": _EXPONENTIAL, "exp2": _EXPONENTIAL, "log": _LOGARITHM, "log2": _LOGARITHM,
    "pow": Accuracy(formula="exp2(y * log2(x))"),
    "inversesqrt": Accuracy(2.0, low=_POSITIVE[0], high=_POSITIVE[1]),
}  # fmt: skip
#: Functions of GLSL "with undefined precision".
_WITHOUT = "sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh"
_FRACTION = Accuracy(formula="x - floor(x)")
_STEP = "min(max((z - x) / (y - x), 0.0), 1.0)"
GLSL: Mapping[str, Accuracy] = {
    **_WITH_PRECISION, **dict.fromkeys(_WITHOUT.split(), NOTHING),
    "fract": _FRACTION,
    "mod": Accuracy(formula="x - y * floor(x / y)"),
    "smoothstep": Accuracy(formula=f"{_STEP} * {_STEP} * (3.0 - 2.0 * {_STEP})", ordered=True),
}  # fmt: skip

#: WGSL, "Floating point accuracy".  Where it allows the worse of two errors, both are given.
WGSL: Mapping[str, Accuracy] = {
    **_WITH_PRECISION,
    "fract": _FRACTION,
    "sin": Accuracy(absolute=2.0**-11, low=_CIRCLE[0], high=_CIRCLE[1]),
    "cos": Accuracy(absolute=2.0**-11, low=_CIRCLE[0], high=_CIRCLE[1]),
    "tan": Accuracy(formula="sin(x) / cos(x)"),
    "asin": Accuracy(absolute=6.81e-5, formula="atan2(x, sqrt(1.0 - x * x))"),
    "acos": Accuracy(absolute=6.77e-5, formula="atan2(sqrt(1.0 - x * x), x)"),
    "atan": Accuracy(4096.0),
    "atan2": Accuracy(4096.0, least=2.0**-126),
    "sinh": Accuracy(formula="(exp(x) - exp(-x)) * 0.5"),
    "cosh": Accuracy(formula="(exp(x) + exp(-x)) * 0.5"),
    "tanh": Accuracy(absolute=1e-5, formula="sinh(x) / cosh(x)"),
    "asinh": Accuracy(formula="log(x + sqrt(x * x + 1.0))"),
    "acosh": Accuracy(formula="log(x + sqrt(x * x - 1.0))"),
    "atanh": Accuracy(formula="log((1.0 + x) / (1.0 - x)) * 0.5"),
}  # fmt: skip

#: OpenCL C 7.4, single precision of the full profile.
OPENCL: Mapping[str, Accuracy] = {
    name: Accuracy(ulp)
    for ulp, names in {
        2.0: "inversesqrt", 3.0: "exp exp2 log log2", 4.0: "sin cos asin acos sinh cosh asinh acosh",
        5.0: "tan atan tanh atanh", 6.0: "atan2", 16.0: "pow",
    }.items()
    for name in names.split()
}  # fmt: skip
