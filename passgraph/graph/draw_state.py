"""Fixed-function state of a draw: OpenGL 3.3's words and meanings on every backend."""

from __future__ import annotations

from dataclasses import dataclass
from types import NoneType

from passgraph import arguments
from passgraph.arguments import one_of
from passgraph.errors import GraphError

COMPARE = ("never", "less", "equal", "less_equal", "greater", "not_equal", "greater_equal", "always")
STENCIL_OPERATIONS = (
    "keep",
    "zero",
    "replace",
    "increment",
    "increment_wrap",
    "decrement",
    "decrement_wrap",
    "invert",
)
FACTORS = (
    "zero", "one", "source_color", "one_minus_source_color",
    "destination_color", "one_minus_destination_color",
    "source_alpha", "one_minus_source_alpha", "destination_alpha", "one_minus_destination_alpha",
)  # fmt: skip
EQUATIONS = ("add", "subtract", "reverse_subtract", "min", "max")
CULL = ("none", "back", "front")


@dataclass(frozen=True, slots=True)
class Blend:
    """result = equation(source * source_factor, destination * destination_factor), colour and alpha apart."""

    source: str = "one"
    destination: str = "zero"
    equation: str = "add"
    source_alpha: str | None = None  # as for colour where left out
    destination_alpha: str | None = None
    equation_alpha: str | None = None

    def __post_init__(self) -> None:
        for what, value in (("source", self.source), ("destination", self.destination)):
            one_of(value, f"blend {what} factor", FACTORS)
        for factor in (self.source_alpha, self.destination_alpha):
            if factor is not None:
                one_of(factor, "blend alpha factor", FACTORS)
        one_of(self.equation, "blend equation", EQUATIONS)
        if self.equation_alpha is not None:
            one_of(self.equation_alpha, "blend alpha equation", EQUATIONS)

    @property
    def alpha_terms(self) -> tuple[str, str, str]:
        """(source factor, destination factor, equation) of the alpha channel."""
        return (
            self.source_alpha or self.source,
            self.destination_alpha or self.destination,
            self.equation_alpha or self.equation,
        )


#: Blends by name.
BLENDS = {
    "add": Blend("one", "one"),
    "alpha": Blend("source_alpha", "one_minus_source_alpha", source_alpha="one"),
    "premultiplied": Blend("one", "one_minus_source_alpha"),
    "multiply": Blend("zero", "source_color"),
    "min": Blend("one", "one", "min"),
    "max": Blend("one", "one", "max"),
}


@dataclass(frozen=True, slots=True)
class Stencil:
    """Test ``(reference & read_mask) compare (stored & read_mask)``, then one of three operations."""

    compare: str = "always"
    reference: int = 0
    read_mask: int = 0xFF
    write_mask: int = 0xFF
    fail: str = "keep"  # the stencil test fails
    depth_fail: str = "keep"  # stencil passes, depth fails
    passed: str = "keep"  # both pass

    def __post_init__(self) -> None:
        one_of(self.compare, "stencil compare", COMPARE)
        for operation in (self.fail, self.depth_fail, self.passed):
            one_of(operation, "stencil operation", STENCIL_OPERATIONS)
        for what, value in (
            ("reference", self.reference),
            ("read mask", self.read_mask),
            ("write mask", self.write_mask),
        ):
            arguments.whole(value, f"stencil {what}", 0, 255)


@dataclass(frozen=True, slots=True)
class DrawState:
    """Everything about a draw that is neither geometry, kernel nor target.

    Front faces wind counter-clockwise as seen with y up.  ``polygon_offset`` is (factor, units): depth moves
    by factor * max(|dz/dx|, |dz/dy|) + units * r with r the smallest step of a float depth at the triangle's
    largest depth, 2**(exponent - 23), as OpenGL 3.3 section 3.6.4 has it.
    """

    cull: str = "none"
    depth_compare: str = "less"
    depth_write: bool = True
    stencil: Stencil | None = None
    blend: tuple[Blend | None, ...] = ()  # one a target; empty means none blends
    color_mask: tuple[tuple[bool, bool, bool, bool], ...] = ()  # one a target; empty means all channels
    polygon_offset: tuple[float, float] = (0.0, 0.0)
    clear_stencil: int = 0

    def __post_init__(self) -> None:
        one_of(self.cull, "cull", CULL)
        one_of(self.depth_compare, "depth_compare", COMPARE)
        arguments.flag(self.depth_write, "depth_write")
        if self.stencil is not None:
            arguments.instance(self.stencil, Stencil, "stencil", "pg.Stencil(...)")
        arguments.several(self.blend, (Blend, NoneType), "blend", "pg.Blend(...) or None, one a target")
        for mask in arguments.several(self.color_mask, tuple, "color_mask", "four bools, one a target"):
            if len(mask) != 4:
                raise GraphError(f"color_mask has four bools (red, green, blue, alpha), got {arguments.shown(mask)}")
            for channel in mask:
                arguments.flag(channel, "a channel of color_mask")
        offset = arguments.several(self.polygon_offset, object, "polygon_offset", "two numbers (factor, units)")
        if len(offset) != 2:
            raise GraphError(f"polygon_offset must be two numbers (factor, units), got {arguments.shown(offset)}")
        object.__setattr__(self, "polygon_offset", tuple(arguments.real(value, "polygon_offset") for value in offset))
        arguments.whole(self.clear_stencil, "clear_stencil", 0, 255)
