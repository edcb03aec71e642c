"""``pg.draw``: draw triangles into targets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import GraphError
from passgraph.graph.calls import _check_result, pass_name, split_arguments
from passgraph.graph.draw_state import BLENDS, Blend, DrawState, Geometry, Stencil, frozen
from passgraph.graph.targets import DrawPass, Target, TargetSpec
from passgraph.language.kernel import Kernel
from passgraph.language.signature import VERTEX
from passgraph.language.types import Struct

#: Optional attributes of a mesh, and the number of components of each.
ATTRIBUTES = {"normals": 3, "uvs": 2, "colors": 4, "tangents": 4, "instances": 1}


def draw(
    geometry: Geometry,
    *,
    vertex: Kernel,
    fragment: Kernel | None = None,
    into: Any = None,
    depth: TargetSpec | Target | None = None,
    stencil: Stencil | None = None,
    blend: str | Blend | tuple[str | Blend | None, ...] | None = None,
    cull: str = "none",
    depth_compare: str = "less",
    depth_write: bool = True,
    color_mask: tuple[bool, ...] | None = None,
    polygon_offset: tuple[float, float] = (0.0, 0.0),
    clear_stencil: int = 0,
    name: str | None = None,
    values: Mapping[str, Any] | None = None,
    **named: Any,
) -> Any:
    """Draw triangles: add a pass with OpenGL 3.3 semantics on every backend.

    Parameters
    ----------
    geometry
        A mesh: ``positions`` (n, 3) float32, ``triangles`` (m, 3) int32 and any of ``normals``, ``uvs``, ``colors``,
        ``tangents``, ``instances`` ((n, 1): see :func:`passgraph.effects.surfaces.marks.instances`).  It is drawn in
        its present state: a :class:`passgraph.Mesh` is immutable, and any other mesh is copied.  To draw another mesh,
        build and compile the graph again.
    vertex, fragment
        Kernels made with :func:`passgraph.vertex` and :func:`passgraph.fragment`.  Without a fragment kernel
        only depth and stencil are written.
    into
        ``pg.target(...)``, cleared first, or the handle of an earlier draw, drawn over; a tuple for several.
    depth
        Likewise for a depth target.  Read it later as ``color.depth``.
    stencil, blend, cull, depth_compare, depth_write, color_mask, polygon_offset
        See :mod:`passgraph.graph.draw_state`; ``blend`` also takes the names in ``BLENDS``.
    name
        Name of the pass; default: that of its targets, or of the fragment kernel if it draws over existing content.
    values, **named
        Parameters of both kernels by name: numbers, targets for images, ``pg.Value`` handles.

    Returns
    -------
    Target or tuple of Target
        One handle for each of ``into``; the depth handle if there is no color target.

    Raises
    ------
    GraphError
        For inconsistent arguments, with the pass and the target.
    """
    own = fragment if isinstance(fragment, Kernel) else vertex
    called = pass_name(name, depth if into is None else into, getattr(own, "name", ""), "the name of a draw")
    where = f"draw {called!r}"
    _check_kernels(vertex, fragment, where)
    check_geometry(geometry, where)
    frozen_geometry = frozen(geometry)
    if frozen_geometry is not geometry:
        check_geometry(frozen_geometry, where)
    specs, loads = _outputs(into, where)
    depth_spec, depth_load = _output(depth, where) if depth is not None else (None, None)
    _check_outputs(specs, depth_spec, fragment, stencil, where)
    blends, masks = _blends(blend, specs, where), _masks(color_mask, specs, where)
    try:
        state = DrawState(cull, depth_compare, depth_write, stencil, blends, masks, polygon_offset, clear_stencil)
    except GraphError as error:
        raise GraphError(f"{where}: {error}") from None
    if values is not None:
        arguments.instance(values, Mapping, f"{where}: values", "a mapping of parameters by name")
    images, bound, constants = _arguments(vertex, fragment, {**(values or {}), **named}, where)
    written = {*specs, depth_spec}
    for image in images.values():
        if image.spec in written and not image.is_previous:
            raise GraphError(f"{where} reads and writes target {image.name!r}; write into another one")
    node = DrawPass(
        called, frozen_geometry, vertex, fragment, images, bound, constants, specs, loads, depth_spec, depth_load, state
    )
    handles = tuple(Target(spec, node, slot) for slot, spec in enumerate(specs))
    if not handles:
        assert depth_spec is not None
        return Target(depth_spec, node, -1)
    return handles[0] if len(handles) == 1 else handles


def _check_kernels(vertex: Kernel, fragment: Kernel | None, where: str) -> None:
    for kernel, stage in ((vertex, "vertex"), (fragment, "fragment")):
        if kernel is None and stage == "fragment":
            continue
        if not isinstance(kernel, Kernel) or kernel.stage != stage:
            raise GraphError(f"{where} needs a {stage} kernel made with @pg.{stage}, got {arguments.shown(kernel)}")
        kernel.check_constants()
    if fragment is None:
        return
    sent = {result.name: result.type for result in vertex.program.results}
    for parameter in fragment.parameters:
        if not isinstance(parameter.type, Struct):
            continue
        for field_name, field_type in parameter.type.fields:
            if sent.get(field_name) != field_type:
                got = sent.get(field_name, "nothing")
                raise GraphError(
                    f"{where}: fragment kernel {fragment.name} takes {field_name}: {field_type}, and vertex "
                    f"kernel {vertex.name} hands over {got}; use one struct for both"
                )


def check_geometry(geometry: Geometry, where: str) -> None:
    """Check shapes, finite numbers and index ranges; the error names the first bad element."""
    for needed in ("positions", "triangles"):
        if isinstance(geometry, type) or not hasattr(geometry, needed):
            got = arguments.shown(geometry)
            raise GraphError(f"{where} needs a mesh with positions and triangles, such as pg.Mesh.make(...), got {got}")
    positions = arguments.numbers(geometry.positions, f"{where}: positions", error=GraphError)
    triangles = arguments.numbers(geometry.triangles, f"{where}: triangles", error=GraphError)
    if positions.ndim != 2 or positions.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise GraphError(
            f"{where}: positions must be (n, 3) and triangles (m, 3), got {positions.shape} and {triangles.shape}"
        )
    if not len(positions) or not len(triangles):
        raise GraphError(f"{where}: the mesh is empty ({len(positions)} vertices, {len(triangles)} triangles)")
    _check_finite(positions, "", where)
    if triangles.dtype.kind not in "iu":
        raise GraphError(f"{where}: triangles must be whole numbers, got {triangles.dtype}")
    low, high = int(triangles.min()), int(triangles.max())
    if low < 0 or high >= len(positions):
        bad = high if high >= len(positions) else low
        raise GraphError(f"{where}: a triangle names vertex {bad}; the mesh has {len(positions)}")
    for name, columns in ATTRIBUTES.items():
        array = getattr(geometry, name, None)
        if array is None:
            continue
        rows = arguments.numbers(array, f"{where}: {name}", error=GraphError)
        if rows.shape != (len(positions), columns):
            raise GraphError(f"{where}: {name} must be {(len(positions), columns)}, got {rows.shape}")
        _check_finite(rows, f"{name} of ", where)


def _check_finite(rows: NDArray[Any], what: str, where: str) -> None:
    with np.errstate(over="ignore"):
        finite = np.isfinite(rows.astype(np.float32, copy=False)).all(axis=1)
    if not finite.all():
        first = int(np.argmin(finite))
        raise GraphError(
            f"{where}: {what}{np.count_nonzero(~finite)} vertices are NaN or infinite, first vertex {first}"
        )


def _outputs(into: Any, where: str) -> tuple[tuple[TargetSpec, ...], tuple[Target | None, ...]]:
    outputs = () if into is None else tuple(into) if isinstance(into, (tuple, list)) else (into,)
    pairs = [_output(one, where) for one in outputs]
    return tuple(spec for spec, _ in pairs), tuple(load for _, load in pairs)


def _output(output: Any, where: str) -> tuple[TargetSpec, Target | None]:
    if isinstance(output, TargetSpec):
        return output, None
    if isinstance(output, Target) and isinstance(output.spec, TargetSpec) and not output.is_previous:
        return output.spec, output.content
    if isinstance(output, Target):
        raise GraphError(
            f"{where} cannot draw into {output.name!r}, an input or last frame's content; copy it with a kernel first"
        )
    raise GraphError(f"{where} draws into pg.target(...) or a handle, got {type(output).__name__}")


def _check_outputs(
    specs: tuple[TargetSpec, ...],
    depth: TargetSpec | None,
    fragment: Kernel | None,
    stencil: Stencil | None,
    where: str,
) -> None:
    if not specs and depth is None:
        raise GraphError(f"{where} has no target; give into= or depth=")
    if depth is not None and not depth.format.is_depth:
        raise GraphError(
            f"{where}: depth target {depth.name!r} is {depth.format.name}; use depth32f or depth32f_stencil8"
        )
    if stencil is not None and (depth is None or not depth.format.stencil):
        raise GraphError(f"{where} tests the stencil and needs depth=pg.target(..., format='depth32f_stencil8')")
    results = fragment.program.results if fragment is not None else ()
    if len(results) != len(specs):
        raise GraphError(
            f"{where}: the fragment kernel returns {len(results)} result(s), and there are {len(specs)} target(s)"
        )
    for spec, result in zip(specs, results, strict=True):
        _check_result((fragment or result).name, spec, result.type)
    if len({*specs, depth}) != len(specs) + 1:
        raise GraphError(f"{where} writes one target twice")


def _blends(argument: Any, specs: tuple[TargetSpec, ...], where: str) -> tuple[Blend | None, ...]:
    if argument is None:
        return ()
    parts = tuple(argument) if isinstance(argument, (list, tuple)) else (argument,) * len(specs)
    if len(parts) != len(specs):
        raise GraphError(f"{where} has {len(parts)} blends for {len(specs)} targets")
    blends: list[Blend | None] = []
    for part, spec in zip(parts, specs, strict=True):
        if isinstance(part, str):
            if part not in BLENDS:
                raise GraphError(
                    f"{where}: there is no blend {part!r}; there are {', '.join(BLENDS)} and pg.Blend(...)"
                )
            part = BLENDS[part]
        if part is not None:
            arguments.instance(part, Blend, f"{where}: blend", f"one of {', '.join(BLENDS)}, or pg.Blend(...)")
        if part is not None and not spec.format.blendable:
            raise GraphError(
                f"{where}: target {spec.name!r} is {spec.format.name}, which cannot be blended; use a linear format"
            )
        blends.append(part)
    return tuple(blends)


def _masks(masks: Any, specs: tuple[TargetSpec, ...], where: str) -> tuple[tuple[bool, bool, bool, bool], ...]:
    if masks is None:
        return ()
    parts = tuple(masks) if isinstance(masks, (list, tuple)) else ()
    if parts and not isinstance(parts[0], (list, tuple)):
        parts = (parts,) * len(specs)
    if (
        len(parts) != len(specs)
        or not all(isinstance(part, (list, tuple)) and len(part) == 4 for part in parts)
        or not all(isinstance(channel, (bool, np.bool_)) for part in parts for channel in part)
    ):
        got = arguments.shown(masks)
        raise GraphError(
            f"{where}: color_mask is four bools (red, green, blue, alpha), once or for each target, got {got}"
        )
    return tuple((bool(r), bool(g), bool(b), bool(a)) for r, g, b, a in parts)


def _arguments(
    vertex: Kernel, fragment: Kernel | None, arguments: Mapping[str, Any], where: str
) -> tuple[dict[str, Target], dict[str, object], dict[str, object]]:
    images: dict[str, Target] = {}
    values: dict[str, object] = {}
    constants: dict[str, object] = {}
    declared: set[str] = set()
    for kernel in (vertex, fragment):
        if kernel is None:
            continue
        # The stage's own struct (the mesh's vertex, the varyings) is not a parameter of the draw.
        names = [p.name for p in kernel.parameters if not isinstance(p.type, Struct) or _is_plain(kernel, p.name)]
        declared.update(names)
        missing = [
            p.name for p in kernel.parameters if p.name in names and p.name not in arguments and not p.has_default
        ]
        if missing:
            raise GraphError(f"{where}: {kernel.stage} kernel {kernel.name} needs {', '.join(missing)}")
        picked = _ParameterSubset(kernel, names)
        more = split_arguments(picked, {n: arguments[n] for n in names if n in arguments})  # type: ignore[arg-type]
        for into, part in zip((images, values, constants), more, strict=True):
            into.update(part)  # type: ignore[attr-defined]
    surplus = [key for key in arguments if key not in declared]
    if surplus:
        raise GraphError(
            f"{where} has no parameter {surplus[0]!r}; its kernels have {', '.join(sorted(declared)) or 'none'}"
        )
    return images, values, constants


class _ParameterSubset:
    """A view of a kernel with some of its parameters."""

    def __init__(self, kernel: Kernel, names: list[str]) -> None:
        self.name = kernel.name
        self.parameters = tuple(p for p in kernel.parameters if p.name in names)


def _is_plain(kernel: Kernel, name: str) -> bool:
    """Return True if a struct parameter is neither the vertex nor the varyings."""
    parameter = next(p for p in kernel.parameters if p.name == name)
    return kernel.stage == "vertex" and parameter.type != VERTEX
