"""Names of the values that a stage gives to a kernel; only printers and messages spell them as text."""

from __future__ import annotations

from dataclasses import replace

from passgraph.records import dataclass

#: Builtins of a fragment that depend on its triangle; at other pixels they are extrapolated on the triangle's plane.
OF_TRIANGLE = ("varying", "fragment_depth")
#: Offsets of the other pixels of a quad: horizontal, vertical, diagonal.
OTHER_PIXELS = ("x", "y", "xy")


@dataclass(frozen=True, slots=True, repr=False)
class BuiltinName:
    """The name of a builtin, or of one of its components.

    >>> BuiltinName("pixel", component=1), BuiltinName("varying", "normal", 2).at("x"), BuiltinName("front_facing")
    ('pixel.1', 'varying@x.normal.2', 'front_facing')

    Attributes
    ----------
    kind : ``pixel``, ``output_size``, ``size`` of an image (if lowered, ``pitch``, ``texel``, ``here`` … too),
        ``vertex``, ``varying`` …
    of : the image, the attribute of the vertex, or the result of the vertex kernel; else empty
    component : None for the whole, which a scalar is too
    axes : of :data:`OF_TRIANGLE` at another pixel of the quad: one of :data:`OTHER_PIXELS`; else empty
    """

    kind: str
    of: str = ""
    component: int | None = None
    axes: str = ""

    @property
    def is_of_triangle(self) -> bool:
        return self.kind in OF_TRIANGLE

    def at(self, axes: str) -> BuiltinName:
        """Return the same builtin at a pixel of the quad; ``""`` is the fragment's own."""
        return replace(self, axes=axes)

    def part(self, component: int) -> BuiltinName:
        """Return the name of a component."""
        return replace(self, component=component)

    def __str__(self) -> str:
        kind = f"{self.kind}@{self.axes}" if self.axes else self.kind
        return ".".join(
            [kind, *([self.of] if self.of else []), *([] if self.component is None else [str(self.component)])]
        )

    def __repr__(self) -> str:
        return repr(str(self))


WHOLE_PIXEL, WHOLE_SIZE = BuiltinName("pixel"), BuiltinName("output_size")
#: The components x and y.
PIXEL = WHOLE_PIXEL.part(0), WHOLE_PIXEL.part(1)
OUTPUT_SIZE = WHOLE_SIZE.part(0), WHOLE_SIZE.part(1)


def size_names(image: str) -> tuple[BuiltinName, BuiltinName]:
    """Return the names of an image's width and height."""
    return BuiltinName("size", image, 0), BuiltinName("size", image, 1)
