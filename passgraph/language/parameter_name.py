"""Names of parameters in lowered programs and plans; only messages spell them as text."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True, repr=False)
class ParameterName:
    """The name of a parameter, or of a plain part of one.

    >>> ParameterName("light", ("color",)), ParameterName("by").of(0)
    ('light.color', 'p0/by')

    Attributes
    ----------
    parameter : in the signature of the kernel
    path : names of the fields that lead from it to the part; empty for the whole parameter
    producer : number of the producer inside a fused pass that has the parameter; None for the pass's own
    """

    parameter: str
    path: tuple[str, ...] = ()
    producer: int | None = None

    @property
    def whole(self) -> ParameterName:
        """Return the name of the parameter that this is a part of."""
        return replace(self, path=()) if self.path else self

    def of(self, producer: int | None) -> ParameterName:
        """Return the name of the same parameter of a producer."""
        return replace(self, producer=producer)

    def __str__(self) -> str:
        return image_of(self.producer, ".".join((self.parameter, *self.path)))

    def __repr__(self) -> str:
        return repr(str(self))


def image_of(producer: int | None, name: str) -> str:
    """Return the name of an image in the program of a fused pass; ``producer`` is that of `ParameterName`.

    >>> image_of(None, "color"), image_of(1, "color")
    ('color', 'p1/color')
    """
    return name if producer is None else f"p{producer}/{name}"
