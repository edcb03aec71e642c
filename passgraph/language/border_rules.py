"""Border rules for reads outside of a picture, one row each, in the kernel language.

A rule is the same for columns and for rows.
"""

from __future__ import annotations

from passgraph.records import dataclass

_NEAREST = "min(max(i, 0), size - 1)"


@dataclass(frozen=True, slots=True)
class Border:
    """A rule that maps index ``i``, any int, to a texel of an axis of ``size`` texels.

    ``place`` is a branchless expression of the kernel language in ``i`` and ``size``; it leaves indices inside
    unchanged and never overflows 32 bits.  ``period``: the number of texels, for ``size`` above 1, after which it
    repeats; without one it is constant beyond 2 · size texels outside.  ``blank``: reads outside give 0 instead.
    ``wraps``: True if samplers of some devices have a mode with the same meaning.
    """

    place: str
    period: str = ""
    blank: bool = False
    wraps: bool = True

    @property
    def is_nearest(self) -> bool:
        """Return True if reads outside give the texel at the edge, or nothing."""
        return self.place == _NEAREST


#: Name → rule; the first one is the default.
BORDERS = {
    "clamp": Border(_NEAREST),
    "zero": Border(_NEAREST, blank=True),
    "repeat": Border("i % size", period="2 * size"),
    # Mirrored at the outer edge: -1 is 0 and size is size - 1.
    "mirror": Border("min(i % (2 * size), 2 * size - 1 - i % (2 * size))", period="2 * size"),
    # Mirrored at the outer texel, OpenCV's default: -1 is 1 and size is size - 2.
    "reflect-101": Border(
        "min(i % max(2 * size - 2, 1), max(2 * size - 2, 1) - i % max(2 * size - 2, 1))",
        period="2 * max(size - 1, 1)",
        wraps=False,
    ),
}
