"""Inputs of a draw: fixed-function state in OpenGL 3.3's terms, and immutable meshes."""

from __future__ import annotations

from dataclasses import is_dataclass
from types import NoneType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.arguments import one_of
from passgraph.errors import GraphError
from passgraph.records import dataclass

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
    """result = equation(source * source_factor, destination * destination_factor), separately for color and alpha."""

    source: str = "one"
    destination: str = "zero"
    equation: str = "add"
    source_alpha: str | None = None  # default: as for color
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
        """Return (source factor, destination factor, equation) of the alpha channel."""
        return (
            self.source_alpha or self.source,
            self.destination_alpha or self.destination,
            self.equation_alpha or self.equation,
        )


#: Blend modes by name.
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
    """Test ``(reference & read_mask) compare (stored & read_mask)``, then apply one of three operations."""

    compare: str = "always"
    reference: int = 0
    read_mask: int = 0xFF
    write_mask: int = 0xFF
    fail: str = "keep"  # if the stencil test fails
    depth_fail: str = "keep"  # if the stencil test passes and the depth test fails
    passed: str = "keep"  # if both pass

    def __post_init__(self) -> None:
        one_of(self.compare, "stencil compare", COMPARE)
        for operation in (self.fail, self.depth_fail, self.passed):
            one_of(operation, "stencil operation", STENCIL_OPERATIONS)
        for what, value in (
            ("reference", self.reference),
            ("read mask", self.read_mask),
            ("write mask", self.write_mask),
        ):
            arguments.whole_number(value, f"stencil {what}", 0, 255)


@dataclass(frozen=True, slots=True)
class DrawState:
    """The state of a draw besides geometry, kernels and targets.

    Front faces wind counter-clockwise as seen with y up.  ``polygon_offset`` is (factor, units): it moves depth by
    factor * max(|dz/dx|, |dz/dy|) + units * r.  r is the smallest float step at the triangle's largest depth,
    2**(exponent - 23); see OpenGL 3.3, section 3.6.4.
    """

    cull: str = "none"
    depth_compare: str = "less"
    depth_write: bool = True
    stencil: Stencil | None = None
    blend: tuple[Blend | None, ...] = ()  # one per target; empty: no blending
    color_mask: tuple[tuple[bool, bool, bool, bool], ...] = ()  # one per target; empty: all channels
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
        arguments.whole_number(self.clear_stencil, "clear_stencil", 0, 255)


class Geometry(Protocol):
    """The mesh data of a draw: float32 arrays per vertex and (m, 3) int32 triangles."""

    @property
    def positions(self) -> NDArray[np.float32]: ...
    @property
    def triangles(self) -> NDArray[np.int32]: ...


#: Optional attributes of a mesh, and their element types.
ATTRIBUTE_TYPES = {"positions": np.float32, "triangles": np.int32, "normals": np.float32, "uvs": np.float32,
          "colors": np.float32, "tangents": np.float32, "instances": np.float32}  # fmt: skip


class Fixed:
    """A dataclass with read-only arrays, which stay read-only through pickle and deep copy."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update({name: fixed(v) if isinstance(v, np.ndarray) else v for name, v in state.items()})


def fixed(array: NDArray[Any]) -> NDArray[Any]:
    """Make one of our arrays, and the memory behind it, read-only."""
    owned = array if array.base is None else array.copy()
    owned.setflags(write=False)
    return owned


@dataclass(frozen=True, eq=False)
class FrozenGeometry(Fixed):
    """Read-only copies of a mesh's arrays."""

    positions: NDArray[np.float32]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32] | None = None
    uvs: NDArray[np.float32] | None = None
    colors: NDArray[np.float32] | None = None
    tangents: NDArray[np.float32] | None = None
    instances: NDArray[np.float32] | None = None


def frozen(geometry: Geometry) -> Geometry:
    """Return the mesh itself if it and its arrays are immutable, as those of :meth:`passgraph.Mesh.make`; else a copy.

    >>> from types import SimpleNamespace
    >>> mesh = SimpleNamespace(positions=np.zeros((3, 3)), triangles=np.array([[0, 1, 2]]))
    >>> kept = frozen(mesh)
    >>> mesh.positions = np.zeros((9, 3))
    >>> kept.positions.shape, kept.positions.flags.writeable
    ((3, 3), False)
    >>> frozen(kept) is kept
    True
    """
    arrays = {name: getattr(geometry, name, None) for name in ATTRIBUTE_TYPES}
    if _is_frozen(geometry) and all(array is None or is_fixed(array) for array in arrays.values()):
        return geometry
    copies: dict[str, Any] = {}
    for name, array in arrays.items():
        if array is not None:
            with np.errstate(over="ignore"):  # check_geometry rejects infinity
                copies[name] = np.array(array, ATTRIBUTE_TYPES[name], order="C")
            copies[name].setflags(write=False)
    return FrozenGeometry(**copies)


def _is_frozen(geometry: object) -> bool:
    return is_dataclass(geometry) and bool(getattr(geometry, "__dataclass_params__").frozen)  # noqa: B009


def is_fixed(array: object) -> bool:
    """Return True if neither an array nor the memory behind it can be written to.

    >>> array = np.zeros(3)
    >>> array.flags.writeable = False
    >>> is_fixed(array), is_fixed(array[1:]), is_fixed(np.zeros(3))
    (True, True, False)
    """
    while isinstance(array, np.ndarray):
        if array.flags.writeable:
            return False
        array = array.base
    return array is None or isinstance(array, bytes)
