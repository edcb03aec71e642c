"""What a draw needs of a mesh, and meshes that stay as they were when they were drawn."""

from __future__ import annotations

from dataclasses import dataclass, is_dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


class Geometry(Protocol):
    """What a draw needs of a mesh: float32 arrays by vertex and (m, 3) int32 triangles."""

    @property
    def positions(self) -> NDArray[np.float32]: ...
    @property
    def triangles(self) -> NDArray[np.int32]: ...


#: Attributes that a mesh may have, and their element types.
ATTRIBUTE_TYPES = {"positions": np.float32, "triangles": np.int32, "normals": np.float32, "uvs": np.float32,
          "colors": np.float32, "tangents": np.float32, "instances": np.float32}  # fmt: skip


class Fixed:
    """Data whose arrays nobody can write to, behind a pickle and a deep copy too."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update({name: fixed(v) if isinstance(v, np.ndarray) else v for name, v in state.items()})


def fixed(array: NDArray[Any]) -> NDArray[Any]:
    """An array of ours that cannot be written to, nor the memory that it looks at."""
    owned = array if array.base is None else array.copy()
    owned.setflags(write=False)
    return owned


@dataclass(frozen=True, eq=False)
class FrozenGeometry(Fixed):
    """Copies of a mesh's arrays, which nobody can write to."""

    positions: NDArray[np.float32]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32] | None = None
    uvs: NDArray[np.float32] | None = None
    colors: NDArray[np.float32] | None = None
    tangents: NDArray[np.float32] | None = None
    instances: NDArray[np.float32] | None = None


def frozen(geometry: Geometry) -> Geometry:
    """The mesh itself where neither it nor its arrays can change, as of :meth:`passgraph.Mesh.make`; else a copy.

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
            with np.errstate(over="ignore"):  # infinity is refused by whoever checks the mesh
                copies[name] = np.array(array, ATTRIBUTE_TYPES[name], order="C")
            copies[name].setflags(write=False)
    return FrozenGeometry(**copies)


def _is_frozen(geometry: object) -> bool:
    return is_dataclass(geometry) and bool(getattr(geometry, "__dataclass_params__").frozen)  # noqa: B009


def is_fixed(array: object) -> bool:
    """Whether neither an array nor the memory that it looks at can be written to.

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
