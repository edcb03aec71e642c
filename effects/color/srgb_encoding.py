"""The sRGB encoding as functions of kernels."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from passgraph.language import sqrt
from passgraph.language.kernel import function

#: 1.055 x^(5/12) - 0.055 on [0.0031308, 1] is 1 plus this polynomial, without constant, of 1 - x^(1/4): least error.
ENCODING = (
    0.154326256, -0.447555582, 0.578349545, -0.399551984, 0.1791709, -0.0201497298, 0.0709641106, 0.585708974,
    -1.75832364,
)  # fmt: skip


@function
def encode_srgb(x: float) -> float:
    """Encode as sRGB (IEC 61966-2-1), x in [0, 1], within 2e-7.

    The power is a polynomial in 1 - x^(1/4), at a third of the cost of `pow`; 1 becomes exactly 1.
    """
    away = 1.0 - sqrt(sqrt(x))
    p = ENCODING[0]
    for i in range(1, len(ENCODING)):
        p = p * away + ENCODING[i]
    return 12.92 * x if x <= 0.0031308 else p * away + 1.0


@function
def encode_srgb_wide(x: float) -> float:
    """Encode as sRGB, any x: for values above 1, and for tighter bounds where x itself has wide ones."""
    return 12.92 * x if x <= 0.0031308 else 1.055 * pow(x, 1.0 / 2.4) - 0.055


@function
def decode_srgb(code: float) -> float:
    """Decode sRGB (IEC 61966-2-1); codes above 1 stay on its curve."""
    return code / 12.92 if code <= 0.04045 else pow((code + 0.055) / 1.055, 2.4)
