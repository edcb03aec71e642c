"""Numbers that an operand may be: where the bound of a row of the table of operations holds."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Domain:
    """From ``low`` to ``high``, and no nearer to 0 than ``least``.

    Attributes
    ----------
    zero : whether 0 belongs to it where ``least`` is above 0
    beyond : whether the bound holds beyond it too, where results overflow, vanish or jump; tests stay inside
    """

    low: float = -math.inf
    high: float = math.inf
    least: float = 0.0
    zero: bool = True
    beyond: bool = False

    @property
    def promised(self) -> tuple[float, float]:
        """From where to where the bound holds."""
        return (-math.inf, math.inf) if self.beyond else (self.low, self.high)


ANY = Domain()
NOT_NEGATIVE = Domain(0.0)
FROM_ONE = Domain(1.0)
UNIT = Domain(-1.0, 1.0)
#: Angles in radians that float32 still tells apart by 2^-10.
ANGLE = Domain(-8192.0, 8192.0)
#: Powers of e or 2 that float32 holds.
EXPONENT = Domain(-80.0, 80.0, beyond=True)
#: Exponents whose powers of moderate numbers float32 holds.
POWER = Domain(-20.0, 20.0, beyond=True)
#: Numbers whose quotients, products and squares float32 holds.
MODERATE = Domain(-(2.0**20), 2.0**20, 2.0**-20, beyond=True)
MODERATE_NOT_ZERO = Domain(-(2.0**20), 2.0**20, 2.0**-20, zero=False)
#: Divisors whose reciprocals float32 holds; OpenGL's quotients are undefined beyond.
DIVISOR = Domain(-(2.0**126), 2.0**126, 2.0**-126)
POSITIVE = Domain(2.0**-126, 2.0**126, 2.0**-126, zero=False)
#: Numbers whose bits are the same everywhere: denormals may count as 0, and 0 and NaN have several.
KNOWN_BITS = Domain(least=2.0**-126, zero=False)
#: The same of their binary16: from 2^-14 on those have 11 bits, below fewer.
HALVES = Domain(-(2.0 - 2.0**-23) * 2.0**127, (2.0 - 2.0**-23) * 2.0**127, 2.0**-126, zero=False, beyond=True)
#: Pairs whose quotients tests can keep off whole numbers, where a floor jumps.
DIVIDEND, SMALL_DIVISOR = Domain(-1000.0, 1000.0, beyond=True), Domain(-8.0, 8.0, 0.5, zero=False, beyond=True)
