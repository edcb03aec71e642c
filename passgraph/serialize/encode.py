"""Encode targets as plain data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import numbers, shown
from passgraph.errors import GraphError
from passgraph.formats import FORMATS
from passgraph.graph.calls import leaves
from passgraph.graph.draw_state import ATTRIBUTE_TYPES, DrawState
from passgraph.graph.run_values import FILLED_IN, Derived, Value, values_by_name
from passgraph.graph.targets import (
    OPEN_SRGB,
    READING,
    Absolute,
    Blocks,
    Computed,
    CountPass,
    DrawPass,
    InputSpec,
    Like,
    Outputs,
    Pass,
    Relative,
    Target,
    TargetSpec,
    named_outputs,
)
from passgraph.language.kernel import Kernel
from passgraph.language.long_arrays import as_held, checked_numbers, is_buffer
from passgraph.language.meanings import uint_of_bits
from passgraph.language.types import Array, Scalar, Struct, Type, element_of, innermost, is_plain
from passgraph.language.uniform_layout import components
from passgraph.plan.dependencies import passes_behind
from passgraph.serialize.kernel_text import KernelWriter
from passgraph.serialize.reader import VALUE_TYPES, array_data, number_data

#: Version of the document format; other versions are errors.
VERSION = 5
_TYPE_NAMES = {type_: name for name, type_ in VALUE_TYPES.items()}
_PLAIN: dict[str, Callable[[float], bool | int | float]] = {
    "bool": bool,
    "int": int,
    "uint": lambda number: uint_of_bits(int(number)),
    "float": float,
}


def to_data(outputs: Outputs, **given: object) -> dict[str, Any]:
    """Encode the outputs for :func:`passgraph.compile` as plain data for JSON: no Python functions, no pickle.

    The data contain inputs, targets, passes with the text of their kernels, numbers and run values, and draws with
    their meshes. Kernels keep their file and line for errors. Numbers are exact, NaN and infinity too.

    Parameters
    ----------
    outputs : one target, several, or ``{name: target}``, as for `passgraph.compile`
    given : run values that become constants, by name, such as ``camera=``; what Python functions compute from them is
        a constant too

    Returns
    -------
    dict
        Objects, lists, texts, numbers, true, false and null; :func:`passgraph.from_data` reads it.

    Raises
    ------
    GraphError
        For values that cannot be serialized, with the pass and the parameter: values computed by Python functions
        (`Value.map`, `combine`) and values of classes such as `Camera` unless they are given, and custom formats.
        For a name in ``given`` that no run value has.
    InputError
        For a value in ``given`` of another class.

    Examples
    --------
    >>> import json
    >>> import passgraph as pg
    >>> invert = pg.kernel(source="def invert(color: Image) -> vec4: return vec4(1.0 - color[0, 0].rgb, 1.0)")
    >>> data = pg.to_data(invert(pg.Input("frame")))
    >>> data["version"], [one["name"] for one in data["passes"]], data["inputs"][0]["name"]
    (5, ['invert'], 'frame')
    >>> pg.to_data(pg.from_data(json.loads(json.dumps(data)))) == data
    True
    """
    named = named_outputs(outputs)
    writer, nodes = _Writer(given), passes_behind(list(named.values()))
    known = values_by_name(node.values for node in nodes)
    for name, value in given.items():
        if name not in known:
            raise GraphError(f"there is no value {name!r} in this graph; it takes {', '.join(sorted(known)) or 'none'}")
        known[name].check(value)
    for node in nodes:
        writer.add_pass(node)
    outputs_data = [[name, writer.handle(target)] for name, target in named.items()]
    return {"passgraph": "graph", "version": VERSION, **writer.sections, "outputs": outputs_data}


class _Writer:
    """The sections of a document; each object is written once, and referred to by its number."""

    def __init__(self, given: Mapping[str, object]) -> None:
        self.given = given
        self.sections: dict[str, list[Any]] = {
            "inputs": [], "targets": [], "values": [], "definitions": [], "kernels": [], "meshes": [], "passes": [],
        }  # fmt: skip
        self._numbers: dict[int, int] = {}
        self._kernels = KernelWriter(self.sections["definitions"])

    def _add(self, section: str, one: object, data: Any) -> int:
        self._numbers[id(one)] = len(self.sections[section])
        self.sections[section].append(data)
        return self._numbers[id(one)]

    # Inputs and targets

    def _input(self, spec: InputSpec) -> int:
        if id(spec) in self._numbers:
            return self._numbers[id(spec)]
        where = f"input {spec.name!r}"
        format_ = OPEN_SRGB if spec.srgb else None if spec.format is None else _format_name(spec.format, where)
        size = None if spec.size is None else list(spec.size)
        default = None if spec.default is None else _picture_data(spec.default, where)
        data = {"name": spec.name, "format": format_, "size": size, "static": spec.static, "default": default}
        return self._add("inputs", spec, data)

    def _target(self, spec: TargetSpec) -> int:
        # Targets whose sizes depend on each other can form a long chain.
        chain = [spec]
        while id(chain[-1]) not in self._numbers and isinstance(chain[-1].size, Like | Blocks):
            lender = chain[-1].size.other.spec
            if not isinstance(lender, TargetSpec) or lender in chain:
                break
            chain.append(lender)
        for one in reversed(chain):
            if id(one) not in self._numbers:
                where = f"target {one.name!r}"
                data = {"name": one.name, "format": _format_name(one.format, where), "size": self._size(one, where),
                        "clear": None if one.clear is None else list(one.clear), "notes": list(one.notes),
                        "initial": _initial_data(one.initial, where)}  # fmt: skip
                self._add("targets", one, data)
        return self._numbers[id(spec)]

    def _size(self, spec: TargetSpec, where: str) -> Any:
        size = spec.size
        if isinstance(size, Absolute):
            return {"pixels": [size.width, size.height]}
        if isinstance(size, Relative):
            return {"scale": _scale_data(size.scale)}
        if size is None:
            return None
        if isinstance(size, Computed):
            return {"formulas": [size.width, size.height]}
        if isinstance(size, Like):
            part: dict[str, Any] = {"scale": _scale_data(size.scale)}
        else:
            part = {"blocks": [size.width, size.height, size.each]}
        lender = size.other.spec
        if isinstance(lender, InputSpec):
            return {"like": {"input": self._input(lender)}, **part}
        if id(lender) not in self._numbers:
            raise GraphError(f"{where} takes its size from itself, by way of {lender.name!r}; give one of them a size")
        return {"like": {"target": self._numbers[id(lender)]}, **part}

    def handle(self, target: Target) -> dict[str, Any]:
        spec = target.spec
        if isinstance(spec, InputSpec):
            return {"input": self._input(spec), **_reading(target)}
        if target.is_previous:
            return {"previous": self._target(spec), "frames_ago": target.frames_ago, **_reading(target)}
        assert target.made_by is not None  # a target is written by a pass, or belongs to the last frame
        return {"pass": self._numbers[id(target.made_by)], "slot": target.slot, **_reading(target)}

    # Passes

    def add_pass(self, node: Pass) -> None:
        into = [self._target(spec) for spec in node.into]
        if isinstance(node, CountPass):
            (numbers,) = node.images.values()
            self._add("passes", node, {"name": node.name, "into": into, "count": self.handle(numbers)})
            return
        if isinstance(node, DrawPass):
            of_kind: dict[str, Any] = {"into": into, **self._draw(node)}
            kernels = [node.vertex] if node.fragment is None else [node.vertex, node.fragment]
        else:
            of_kind = {"into": into, "kernel": self._kernel(node, node.kernel)}
            kernels = [node.kernel]
        # A draw's kernels share parameters; the type in the first kernel decides how a number is written.
        types = {parameter.name: parameter.type for kernel in reversed(kernels) for parameter in kernel.parameters}
        images = {name: self.handle(target) for name, target in node.images.items()}
        arguments: dict[str, Any] = {"values": {}, "constants": {}}
        for kind, parameters in (("values", node.values), ("constants", node.constants)):
            for name, value in parameters.items():
                where = f"pass {node.name!r}, parameter {name!r}"
                arguments[kind][name] = self._parameter(value, types[name], where)
        self._add("passes", node, {"name": node.name, **of_kind, "images": images, **arguments})

    def _draw(self, node: DrawPass) -> dict[str, Any]:
        loads = [None if load is None else self.handle(load) for load in node.loads]
        depth = None if node.depth is None else self._target(node.depth)
        depth_load = None if node.depth_load is None else self.handle(node.depth_load)
        fragment = None if node.fragment is None else self._kernel(node, node.fragment)
        return {"mesh": self._mesh(node), "vertex": self._kernel(node, node.vertex), "fragment": fragment,
                "loads": loads, "depth": depth, "depth_load": depth_load, "state": _state_data(node.state)}  # fmt: skip

    def _mesh(self, node: DrawPass) -> int:
        mesh = node.geometry
        if id(mesh) not in self._numbers:
            arrays = {name: getattr(mesh, name, None) for name in ATTRIBUTE_TYPES}
            where = f"pass {node.name!r}, mesh"
            self._add(
                "meshes", mesh, {name: None if one is None else array_data(one, where) for name, one in arrays.items()}
            )
        return self._numbers[id(mesh)]

    def _parameter(self, value: object, type_: Type, where: str) -> Any:
        if isinstance(value, (Value, Derived)) and all(source.name in self.given for source in value.sources):
            known = [self.given[source.name] for source in value.sources]
            value = value.function(*known) if isinstance(value, Derived) else known[0]
        if isinstance(value, Derived):
            raise GraphError(
                f"{where}: its value is computed from {value.name!r} by a Python function, which cannot be serialized; "
                "compute the number where the graph runs and give it as a pg.Value"
            )
        if isinstance(value, Value):
            filled_in = FILLED_IN.get(value.name) is value
            return {"value": value.name if filled_in else self._value(value, where)}
        plain = [leaf for leaf in leaves(value, type_, where) if is_plain(leaf[1])]
        parts = [_numbers_data(part, leaf, name) for name, leaf, part in plain]
        return {"fields": parts} if isinstance(innermost(type_), Struct) else parts[0]

    def _value(self, value: Value, where: str) -> int:
        if id(value) in self._numbers:
            return self._numbers[id(value)]
        if value.type not in _TYPE_NAMES:
            name = getattr(value.type, "__name__", value.type)
            raise GraphError(
                f"{where}: value {value.name!r} is of class {name}, which cannot be serialized; give each number as "
                f"a pg.Value of its own, of type {', '.join(VALUE_TYPES)}"
            )
        default = None if value.default is None else _default_data(value.default, f"value {value.name!r}: default")
        limits = [[limit.where, asdict(limit.range)] for limit in value.limits]
        data = {"name": value.name, "type": _TYPE_NAMES[value.type], "static": value.static, "default": default,
                "limits": limits}  # fmt: skip
        return self._add("values", value, data)

    def _kernel(self, node: Pass, kernel: Kernel) -> int:
        written_from = kernel.definition or getattr(kernel, "shader", None)
        if written_from is None or id(written_from) not in self._numbers:
            data, known = self._kernels.kernel(kernel, f"pass {node.name!r}"), self.sections["kernels"]
            if data not in known:
                return self._add("kernels", written_from, data)
            self._numbers[id(written_from)] = known.index(data)
        return self._numbers[id(written_from)]


def _scale_data(scale: tuple[float, float]) -> float | list[float]:
    """Return one number where width and height are scaled alike, else two."""
    return scale[0] if scale[0] == scale[1] else list(scale)


def _reading(target: Target) -> dict[str, Any]:
    """Encode how a target is read: its border, and other settings that are not defaults."""
    reading = {name: getattr(target, field) for name, field in READING.items()}
    unread = {name: getattr(target.content, field) for name, field in READING.items()}
    return {name: value for name, value in reading.items() if name == "border" or value != unread[name]}


def _state_data(state: DrawState) -> dict[str, Any]:
    lists = {"color_mask": [list(mask) for mask in state.color_mask], "polygon_offset": list(state.polygon_offset)}
    return {**asdict(state), "blend": [blend and asdict(blend) for blend in state.blend], **lists}


def _format_name(format_: Any, where: str) -> str:
    if FORMATS.get(format_.name) != format_:
        raise GraphError(f"{where}: format {format_.name!r} is not one of passgraph.formats.FORMATS; use one of those")
    return str(format_.name)


def _numbers_data(value: object, type_: Type, where: str) -> Any:
    """Encode a number, or components in order, by their types; long arrays as bytes."""
    if isinstance(type_, Array) and is_buffer(type_):
        return array_data(as_held(checked_numbers(value, type_, where), type_), where)
    plain = _PLAIN[element_of(type_).name]
    flat = [number_data(plain(number)) for number in components(value, type_, where).tolist()]
    return flat[0] if isinstance(type_, Scalar) else flat


def _default_data(value: object, where: str) -> Any:
    """Encode nested numbers as lists."""
    default = numbers(value, where, error=GraphError).tolist() if not isinstance(value, (bool, int, float)) else value

    def nested(part: Any) -> Any:
        return [nested(one) for one in part] if isinstance(part, list) else number_data(part)

    return nested(default)


def _initial_data(initial: tuple[float, ...] | NDArray[np.float32], where: str) -> Any:
    """Encode an initial value: a picture, or numbers."""
    if isinstance(initial, np.ndarray):
        return array_data(initial, f"{where}: initial")
    return [number_data(one) for one in initial]


def _picture_data(picture: object, where: str) -> dict[str, Any]:
    array = numbers(picture, f"{where}: its default", error=GraphError)
    if array.ndim not in (2, 3):
        raise GraphError(f"{where}: its default must be a picture (height, width, channels), got {shown(picture)}")
    return array_data(array, where)
