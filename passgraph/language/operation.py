"""A row of the table of operations: names, types, meaning, examples and bounds, and derived properties."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any, Literal, TypeAlias

from passgraph.cached import cached_property
from passgraph.language.meanings import Values
from passgraph.language.symbols import Symbol
from passgraph.records import dataclass


@dataclass(frozen=True, slots=True)
class Domain:
    """The domain of an operand: from ``low`` to ``high``, and at least ``least`` away from 0.

    Attributes
    ----------
    zero : True if 0 belongs to it although ``least`` is above 0
    beyond : True if the bound also holds outside of it, where results overflow, vanish or jump; tests stay inside
    """

    low: float = -math.inf
    high: float = math.inf
    least: float = 0.0
    zero: bool = True
    beyond: bool = False

    @property
    def promised(self) -> tuple[float, float]:
        """Return the interval in which the bound holds."""
        return (-math.inf, math.inf) if self.beyond else (self.low, self.high)


ANY = Domain()
NOT_NEGATIVE = Domain(0.0)
FROM_ONE = Domain(1.0)
UNIT = Domain(-1.0, 1.0)
#: Angles in radians with a float32 spacing of at most 2^-10.
ANGLE = Domain(-8192.0, 8192.0)
#: Powers of e or 2 within the range of float32.
EXPONENT = Domain(-80.0, 80.0, beyond=True)
#: Exponents whose powers of moderate numbers are within the range of float32.
POWER = Domain(-20.0, 20.0, beyond=True)
#: Numbers whose quotients, products and squares are within the range of float32.
MODERATE = Domain(-(2.0**20), 2.0**20, 2.0**-20, beyond=True)
MODERATE_NOT_ZERO = Domain(-(2.0**20), 2.0**20, 2.0**-20, zero=False)
#: Divisors whose reciprocals are within the range of float32; OpenGL's quotients are undefined beyond.
DIVISOR = Domain(-(2.0**126), 2.0**126, 2.0**-126)
POSITIVE = Domain(2.0**-126, 2.0**126, 2.0**-126, zero=False)
#: Numbers with the same bits everywhere: denormals may count as 0, and 0 and NaN have several encodings.
KNOWN_BITS = Domain(least=2.0**-126, zero=False)
#: The same for their binary16: from 2^-14 on those have 11 bits, below fewer.
HALVES = Domain(-(2.0 - 2.0**-23) * 2.0**127, (2.0 - 2.0**-23) * 2.0**127, 2.0**-126, zero=False, beyond=True)
#: Pairs whose quotients tests can keep away from integers, where floor jumps.
DIVIDEND, SMALL_DIVISOR = Domain(-1000.0, 1000.0, beyond=True), Domain(-8.0, 8.0, 0.5, zero=False, beyond=True)


Kind: TypeAlias = Literal["primitive", "prelude", "expanded"]
Range: TypeAlias = tuple[float, float]

#: Every row, in the order in which modules were imported.
ROWS: list[Operation] = []

#: Range of floats in generated kernels: their sums and products stay distinguishable.
WHOLE: Range = (-8.0, 8.0)
_OPERAND = re.compile(r"\b[a-z]\b")
#: Letter of a signature → the types that primitives of such arguments are printed for.
_TYPES = {"N": ("float", "int"), "G": ("float",), "f": ("float",), "I": ("int",), "i": ("int",), "B": ("bool",)}


@dataclass(frozen=True, eq=False, repr=False)
class Operation(Symbol):
    """One row; if kernels call it by its name, the module attribute is that name.

    Attributes
    ----------
    signature : letters of the operands and of the result, such as ``"N N -> B"``: ``N`` a number of any size (int, uint
        or float), ``G`` floats of any size, ``I`` ints or uints, ``S`` ints, ``U`` uints, ``B`` bools, ``V`` a float
        vector, ``v3`` a vec3, ``M`` a matrix, ``Q`` a square one, ``f i b`` scalars.  A letter that occurs twice stands
        for one type, except that a scalar may be combined with vectors and is then broadcast
    doc : its result, in the words of docs/kernels.md
    reference : its function on float64, int64, uint32 or bool arrays, with a batch on the first axis, then components
    kind : *primitive* rows are spelled by every backend; *prelude* rows are the scalar function with their name in
        :mod:`.prelude`, so that every backend computes the same polynomial; *expanded* ones (of vectors and matrices)
        are expanded by :mod:`.expand`
    examples : operands, then the result; the documentation shows them for special values
    written : spellings in kernels, with single letters for the operands: signs, calls, or both; default: a call of its
        name
    ulp : largest error of a conforming backend's float32 result, in units in the last place, on its domain;
        ``absolute`` is added
    of_terms : True if that unit is the largest term's: where terms of both signs cancel, their rounding stays while the
        result is small
    domain : domain of each operand; default: any number
    tame : for each operand a range on steps of 1/8 within its domain and :data:`WHOLE`, away from poles, where results
        are within :data:`WHOLE` too; default: all of both
    course : monotonicity in a float operand over its domain, for the oracle: ``"rises"``, ``"falls"``, or ``"even"``:
        falls to 0 and rises from there.  Others are in :mod:`passgraph.verify.oracle`
    on : for a primitive, the types that its arguments may have; default: those of the first letter
    unsigned : the row for uints, if their bits differ from its result for ints
    commutes : True if the order of operands does not matter, bit for bit
    """

    signature: str
    doc: str
    reference: Callable[..., Values]
    kind: Kind
    examples: tuple[tuple[Any, ...], ...]
    written: tuple[str, ...] = ()
    ulp: float = 0.0
    absolute: float = 0.0
    of_terms: bool = False
    domain: tuple[Domain, ...] = ()
    tame: tuple[Range, ...] = ()
    course: Literal["", "rises", "falls", "even"] = ""
    on: tuple[str, ...] = ()
    unsigned: str = ""
    commutes: bool = False

    @cached_property
    def operands(self) -> tuple[str, ...]:
        """Return the letter of each operand."""
        return tuple(self.signature.split("->")[0].split())

    @cached_property
    def result(self) -> str:
        """Return the letter of the result."""
        return self.signature.split("->")[1].strip()

    @property
    def of_numbers(self) -> bool:
        """Return True if it maps floats to floats, component by component."""
        return {*self.operands, self.result} <= {"N", "G"} and not self.converts

    @property
    def types(self) -> tuple[str, ...]:
        """Return the scalar types of a primitive for which printers have a spelling."""
        return () if self.kind != "primitive" else self.on or _TYPES[self.operands[0]]

    @property
    def converts(self) -> bool:
        """Return True if it is written as a type: ``float(a)``."""
        return self.call in ("float", "int", "uint")

    @cached_property
    def call(self) -> str:
        """Return the name that kernels call; empty if there is none."""
        forms = self.written or (f"{self.name}()",)
        return next((form.partition("(")[0] for form in forms if "(" in form), "")

    @cached_property
    def signs(self) -> dict[str, str]:
        """Return Python's operators for it, each with its form."""
        return {_OPERAND.sub("", form).strip(): form for form in self.written if "(" not in form}

    @property
    def spoken(self) -> str:
        """Return its name in errors: its first spelling."""
        if self.signs and "(" not in self.written[0]:
            sign = next(iter(self.signs))
            return f"unary {sign}" if len(self.operands) == 1 and sign in "+-" else sign
        return f"{self.call}()"

    def as_written(self, *operands: str, by_name: bool = False) -> str:
        """Return kernel text that applies it to the texts of its operands, by its sign if it has one."""
        if self.signs and not (by_name and self.call):
            given = iter(operands)
            return f"({_OPERAND.sub(lambda _: next(given), next(iter(self.signs.values())))})"
        return f"{self.call}({', '.join(operands)})"

    def domain_of(self, operand: int) -> Domain:
        return self.domain[operand] if operand < len(self.domain) else ANY

    def ordinary(self, operand: int) -> Range:
        """Return the tame range of an operand: the row's, else its domain within :data:`WHOLE`."""
        domain = self.domain_of(operand)
        within = (max(WHOLE[0], domain.low), min(WHOLE[1], domain.high))
        return self.tame[operand] if operand < len(self.tame) else within


def row(
    kind: Kind, name: str, signature: str, doc: str, reference: Callable[..., Values], /, *examples: tuple[Any, ...],
    **known: Any,
) -> Operation:  # fmt: skip
    """Add a new row to the table; ``known`` are further attributes of :class:`Operation`."""
    operation = Operation(name, signature, doc, reference, kind, examples, **known)
    ROWS.append(operation)
    return operation
