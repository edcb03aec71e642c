"""Median: the middle one of the numbers around a pixel, which takes out specks and keeps edges."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Literal

import passgraph as pg
from passgraph import Const, Image, vec4
from passgraph.effects.checked import effect

#: Exchanges that bring the middle one of 9 numbers to place 4, and of 25 to place 12: two digits (base 36) each, the
#: places of the smaller and the larger one.
NINE = "124578013467124578 03 58 47 36 14 25 47 42 64 42"
