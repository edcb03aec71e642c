"""Decode graphs from untrusted plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import among
from passgraph.errors import InputError
from passgraph.formats import Format, format_named
from passgraph.graph.calls import PixelKernel
from passgraph.graph.draw_state import Blend, DrawState, FrozenGeometry, Stencil
from passgraph.graph.drawing import draw
from passgraph.graph.reductions import count_rows
from passgraph.graph.run_values import FILLED_IN, MAX_DEPTH, Limit, Value
from passgraph.graph.targets import (
    MAX_SIDE,
    MOST_SLOTS,
    OPEN_SRGB,
    READING,
    Absolute,
    Blocks,
    Computed,
    InputSpec,
    Like,
    Relative,
    SizeClass,
    Target,
    TargetSpec,
    checked_initial,
    checked_scale,
    checked_size,
    previous,
)
from passgraph.language import ir
from passgraph.language.kernel import Kernel
from passgraph.language.long_arrays import is_buffer
from passgraph.language.meanings import INT_MAX, INT_MIN
from passgraph.language.signature import VERTEX
from passgraph.language.symbols import UINT_MAX
from passgraph.language.types import (
    BOOL,
    FLOAT,
    INT,
    UINT,
    Array,
    ImageType,
    Scalar,
    Struct,
    Type,
    component_count,
    element_of,
    flat_type,
    image_names,
    innermost,
    is_plain,
    plain_parts,
    sides_of,
)
from passgraph.language.uniform_layout import FLOAT_END
from passgraph.ranges import Range
from passgraph.serialize.encode import VERSION
from passgraph.serialize.kernel_text import KernelReader
from passgraph.serialize.reader import VALUE_TYPES, Arrays, Document, described

_HELD_AS: dict[Scalar, type[Any]] = {BOOL: bool, INT: int, UINT: int, FLOAT: float}


def from_data(data: object) -> dict[str, Target]:
    """Decode the targets that :func:`passgraph.to_data` encoded, by name, for :func:`passgraph.compile`.

    The data may be untrusted: they are parsed and checked, never executed. A kernel in them has only the capabilities
    of a kernel given as text.

    Parameters
    ----------
    data : the result of `to_data`, perhaps converted to JSON and back

    Returns
    -------
    dict
        Result name → target.

    Raises
    ------
    InputError
        For invalid data, or data of another version, with the position in the data.

    Examples
    --------
    >>> import numpy as np
    >>> import passgraph as pg
    >>> invert = pg.kernel(source="def invert(color: Image) -> vec4: return vec4(1.0 - color[0, 0].rgb, 1.0)")
    >>> data = pg.to_data(invert(pg.Input("frame")))
    >>> with pg.compile(pg.from_data(data), backend="reference") as program:
    ...     program(frame=np.full((1, 1, 4), 0.25, np.float32))["invert"][0, 0, 0].item()
    0.75
    >>> data["passes"][0]["images"]["color"] = {"input": 7, "border": "clamp"}
    >>> pg.from_data(data)
    Traceback (most recent call last):
    passgraph.errors.InputError: graph data, passes[0].images.color.input: must be the number of one of the 1 inputs ...
    """
    return _Graph(Document()).outputs(data)


class _Graph:
    """The objects decoded so far, by section; each refers to earlier ones."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.inputs: list[InputSpec] = []
        self.targets: list[TargetSpec] = []
        self.values: list[Value] = []
        self.kernels: list[Kernel] = []
        self.meshes: list[FrozenGeometry] = []
        self.passes: list[dict[int, Target]] = []  # by slot
        self.arrays = Arrays(document)
        self.texts = KernelReader(document)
        self.definitions = self.texts.definitions

    def outputs(self, data: object) -> dict[str, Target]:
        document = self.document
        if not isinstance(data, Mapping) or data.get("passgraph") != "graph":
            raise InputError(f"graph data, the document: must be what pg.to_data made, got {described(data)}")
        if data.get("version") != VERSION or isinstance(data.get("version"), bool):
            version = described(data.get("version"))
            raise InputError(
                f"graph data, version: this passgraph reads version {VERSION}, got {version}; write the data anew "
                "with the passgraph that reads them, or install the one that wrote them"
            )
        readers = {"inputs": self._input, "targets": self._target, "values": self._value,
                   "definitions": self.texts.definition, "kernels": self.texts.kernel, "meshes": self.arrays.mesh,
                   "passes": self._pass}  # fmt: skip
        record = document.record(data, "the document", "passgraph", "version", *readers, "outputs")
        for section, read in readers.items():
            decoded: list[Any] = getattr(self, section)
            for i, one in enumerate(document.items(record[section], section)):
                decoded.append(read(one, f"{section}[{i}]"))
        outputs: dict[str, Target] = {}
        for i, one in enumerate(document.items(record["outputs"], "outputs")):
            name, handle = document.items(one, f"outputs[{i}]", exactly=2)
            name = document.text(name, f"outputs[{i}]")
            if not name or not name.isprintable() or name in outputs:
                document.wrong(f"outputs[{i}]", "a printable name that no output has yet", name)
            outputs[name] = self._handle(handle, f"outputs[{i}]")
        return outputs

    # Inputs, targets and values

    def _input(self, data: object, where: str) -> InputSpec:
        document = self.document
        record = document.record(data, where, "name", "format", "size", "static", "default")
        with document.at(where):
            srgb = among(record["format"], (OPEN_SRGB,))
            is_open = srgb or record["format"] is None
            format_ = None if is_open else self._format(record["format"], f"{where}.format")
            size = None if record["size"] is None else self._pixels(record["size"], f"{where}.size")
            default = None if record["default"] is None else self.arrays.picture(record["default"], f"{where}.default")
            static = document.flag(record["static"], f"{where}.static")
            return InputSpec(document.text(record["name"], f"{where}.name"), format_, size, static, default, srgb)

    def _target(self, data: object, where: str) -> TargetSpec:
        document = self.document
        record = document.record(data, where, "name", "format", "size", "clear", "notes", "initial")
        clear = record["clear"]
        if clear is not None:
            clear = tuple(document.number(one, f"{where}.clear") for one in document.items(clear, f"{where}.clear", 4))
        notes = document.items(record["notes"], f"{where}.notes")
        texts = tuple(document.text(note, f"{where}.notes[{i}]") for i, note in enumerate(notes))
        with document.at(where):
            format_, size = (
                self._format(record["format"], f"{where}.format"),
                self._size(record["size"], f"{where}.size"),
            )
            spec = TargetSpec(document.text(record["name"], f"{where}.name"), format_, size, clear, texts)
            return replace(spec, initial=self._initial(record["initial"], spec, f"{where}.initial"))

    def _initial(self, data: object, spec: TargetSpec, where: str) -> tuple[float, ...] | NDArray[np.float32]:
        document = self.document
        if isinstance(data, Mapping):
            return checked_initial(self.arrays.picture(data, where), spec.format, f"target {spec.name!r}")
        return tuple(document.number(one, where) for one in document.items(data, where, 4))

    def _format(self, data: object, where: str) -> Format:
        return format_named(self.document.text(data, where))

    def _pixels(self, data: object, where: str) -> tuple[int, int]:
        return checked_size(tuple(self.document.items(data, where, exactly=2)), where)

    def _size(self, data: object, where: str) -> SizeClass | None:
        document = self.document
        if data is None:
            return None
        known = ("pixels", "like", "scale", "blocks", "formulas")
        names = [name for name in known if isinstance(data, Mapping) and name in data]
        record = document.record(data, where, *(names or ["pixels"]))
        if names == ["pixels"]:
            return Absolute(*self._pixels(record["pixels"], where))
        if names == ["formulas"]:
            width, height = document.items(record["formulas"], f"{where}.formulas", exactly=2)
            return Computed(_formula(width), _formula(height))
        if names == ["like", "blocks"]:
            counts = document.items(record["blocks"], f"{where}.blocks", exactly=3)
            across, down, each = (document.integer(count, f"{where}.blocks", 1, MAX_SIDE) for count in counts)
            return Blocks(self._lender(record["like"], f"{where}.like"), across, down, each)
        if names not in (["scale"], ["like", "scale"]):
            expected = "an object with pixels, with scale, with like and scale or blocks, or with formulas"
            document.wrong(where, expected, data)
        scale = checked_scale(document.numbers(record["scale"], f"{where}.scale", nested=1), where)
        return Relative(scale) if names == ["scale"] else Like(self._lender(record["like"], f"{where}.like"), scale)

    def _lender(self, data: object, where: str) -> Target:
        """Return the target whose size is used; only its size is needed, so no pass is decoded for it."""
        kind = "input" if isinstance(data, Mapping) and "input" in data else "target"
        number = self.document.record(data, where, kind)[kind]
        known: list[Any] = self.inputs if kind == "input" else self.targets
        return Target(self.document.index(number, f"{where}.{kind}", known, f"{kind}s"))

    def _value(self, data: object, where: str) -> Value:
        document = self.document
        record = document.record(data, where, "name", "type", "static", "default", "limits")
        type_ = record["type"]
        if not isinstance(type_, str) or type_ not in VALUE_TYPES:
            document.wrong(f"{where}.type", f"one of {', '.join(VALUE_TYPES)}", type_)
        default = None if record["default"] is None else document.numbers(record["default"], f"{where}.default")
        static = document.flag(record["static"], f"{where}.static")
        with document.at(where):
            name = document.text(record["name"], f"{where}.name")
            return Value(name, VALUE_TYPES[type_], static, default, limits=self._limits(record["limits"], where))

    def _limits(self, data: object, where: str) -> tuple[Limit, ...]:
        document, limits = self.document, list[Limit]()
        for i, one in enumerate(document.items(data, f"{where}.limits")):
            place = f"{where}.limits[{i}]"
            parameter, range_ = document.items(one, place, exactly=2)
            record = document.record(range_, place, *(one.name for one in fields(Range)))
            low, high = (
                None if record[name] is None else document.number(record[name], place) for name in ("low", "high")
            )
            above, odd = (document.flag(record[name], place) for name in ("above", "odd"))
            limits.append(
                Limit(
                    document.text(parameter, place), Range(low, high, document.text(record["unit"], place), above, odd)
                )
            )
        return tuple(limits)

    # Passes

    def _pass(self, data: object, where: str) -> dict[int, Target]:
        if isinstance(data, Mapping) and "mesh" in data:
            return self._draw(data, where)
        if isinstance(data, Mapping) and "count" in data:
            return self._count(data, where)
        document = self.document
        names = ("name", "into", "kernel", "images", "values", "constants")
        record = document.record(data, where, *names)
        kernel = self._kernel(record["kernel"], f"{where}.kernel", "pixel")
        arguments = self._arguments([kernel], record, where)
        name, specs = document.text(record["name"], f"{where}.name"), self._specs(record["into"], f"{where}.into")
        assert isinstance(kernel, PixelKernel)
        with document.at(where):
            targets = kernel.called(arguments, specs, name)
        return _by_slot(targets)

    def _count(self, data: object, where: str) -> dict[int, Target]:
        record = self.document.record(data, where, "name", "into", "count")
        name, specs = self.document.text(record["name"], f"{where}.name"), self._specs(record["into"], f"{where}.into")
        numbers = self._handle(record["count"], f"{where}.count")
        with self.document.at(where):
            return _by_slot(count_rows(numbers, specs, name))

    def _draw(self, data: object, where: str) -> dict[int, Target]:
        document = self.document
        names = ("name", "into", "mesh", "vertex", "fragment", "loads", "depth", "depth_load", "state")
        record = document.record(data, where, *names, "images", "values", "constants")
        kernels = [self._kernel(record["vertex"], f"{where}.vertex", "vertex")]
        if record["fragment"] is not None:
            kernels.append(self._kernel(record["fragment"], f"{where}.fragment", "fragment"))
        values = self._arguments(kernels, record, where)
        specs = self._specs(record["into"], f"{where}.into")
        loads = document.items(record["loads"], f"{where}.loads", exactly=len(specs))
        into = tuple(self._drawn(spec, load, f"{where}.loads") for spec, load in zip(specs, loads, strict=True))
        depth = None
        if record["depth"] is not None:
            spec = document.index(record["depth"], f"{where}.depth", self.targets, "targets")
            depth = self._drawn(spec, record["depth_load"], f"{where}.depth_load")
        mesh = document.index(record["mesh"], f"{where}.mesh", self.meshes, "meshes")
        name = document.text(record["name"], f"{where}.name")
        with document.at(where):
            targets = draw(
                mesh, vertex=kernels[0], fragment=kernels[1] if kernels[1:] else None, into=into or None, depth=depth,
                name=name, values=values,
                **self._state(record["state"], f"{where}.state"),
            )  # fmt: skip
        return _by_slot(targets)

    def _drawn(self, spec: TargetSpec, load: object, where: str) -> TargetSpec | Target:
        """Return the destination of a draw: a target to clear, or the content that it draws over."""
        if load is None:
            return spec
        content = self._handle(load, where)
        if content.spec is not spec:
            self.document.wrong(where, f"null, or a handle of target {spec.name!r}", load)
        return content

    def _state(self, data: object, where: str) -> dict[str, Any]:
        document = self.document
        record = dict(document.record(data, where, *(field.name for field in fields(DrawState))))
        if record["stencil"] is not None:
            names = [field.name for field in fields(Stencil)]
            record["stencil"] = Stencil(**document.record(record["stencil"], f"{where}.stencil", *names))
        names = [field.name for field in fields(Blend)]
        blends = [
            None if one is None else Blend(**document.record(one, f"{where}.blend[{i}]", *names))
            for i, one in enumerate(document.items(record["blend"], f"{where}.blend"))
        ]
        masks = [
            tuple(document.flag(one, f"{where}.color_mask") for one in document.items(mask, where, exactly=4))
            for mask in document.items(record["color_mask"], f"{where}.color_mask")
        ]
        offset = document.items(record["polygon_offset"], f"{where}.polygon_offset", exactly=2)
        record["polygon_offset"] = tuple(document.number(one, f"{where}.polygon_offset") for one in offset)
        return {**record, "blend": tuple(blends) or None, "color_mask": tuple(masks) or None}

    def _kernel(self, data: object, where: str, stage: str) -> Kernel:
        kernel: Kernel = self.document.index(data, where, self.kernels, "kernels")
        if kernel.stage != stage:
            self.document.wrong(where, f"the number of a {stage} kernel", data)
        return kernel

    def _specs(self, data: object, where: str) -> tuple[TargetSpec, ...]:
        numbers = self.document.items(data, where, MOST_SLOTS)
        return tuple(self.document.index(number, where, self.targets, "targets") for number in numbers)

    def _arguments(self, kernels: list[Kernel], record: Mapping[str, Any], where: str) -> dict[str, Any]:
        """Return the arguments of kernels, by parameter."""
        document = self.document
        parameters: dict[str, tuple[Type, bool]] = {}
        for kernel in kernels:
            for parameter in kernel.parameters:
                if not _is_handed_in(kernel.stage, parameter.type):
                    parameters.setdefault(parameter.name, (parameter.type, parameter.const))
        names_by_kind: dict[str, list[str]] = {"images": [], "values": [], "constants": []}
        for name, (type_, const) in parameters.items():
            names_by_kind["images"] += image_names(type_, name)
            if any(is_plain(part) for _, part in plain_parts(type_)):
                names_by_kind["constants" if const else "values"].append(name)
        data_by_kind = {
            kind: document.record(record[kind], f"{where}.{kind}", *names) for kind, names in names_by_kind.items()
        }
        arguments: dict[str, Any] = {}
        for name, (type_, const) in parameters.items():
            images = {
                path: self._handle(data_by_kind["images"][path], f"{where}.images.{path}")
                for path in image_names(type_, name)
            }
            kind = "constants" if const else "values"
            arguments[name] = self._argument(name, type_, data_by_kind[kind].get(name), images, f"{where}.{kind}", kind)
        return arguments

    def _argument(
        self, name: str, type_: Type, argument: object, images: Mapping[str, Target], where: str, kind: str
    ) -> object:
        """Decode a parameter's value from its handles and its numbers."""
        document, place = self.document, f"{where}.{name}"
        if kind == "values" and not images and isinstance(argument, Mapping) and "value" in argument:
            number = document.record(argument, place, "value")["value"]
            if isinstance(number, str) and number in FILLED_IN:
                return FILLED_IN[number]
            return document.index(number, f"{place}.value", self.values, "values")
        parts = [(path, part) for path, part in plain_parts(type_, name) if is_plain(part)]
        data: Sequence[object] = (argument,) if parts else ()
        if parts and isinstance(innermost(type_), Struct):
            data = document.items(document.record(argument, place, "fields")["fields"], place, exactly=len(parts))
        numbers = {
            path: self._numbers(one, part, f"{where}.{path}") for (path, part), one in zip(parts, data, strict=True)
        }
        return _built(type_, name, 0, numbers, images)

    def _numbers(self, data: object, type_: Type, where: str) -> Sequence[ir.Number] | NDArray[Any]:
        """Decode the components of a value in order; a scalar has one."""
        if isinstance(type_, Array) and is_buffer(type_):
            return self.arrays.long(data, type_, where)
        flat: Sequence[object] = (data,)
        if not isinstance(type_, Scalar):
            flat = self.document.items(data, where, exactly=component_count(type_))
        return tuple(self._number(part, element_of(type_), where) for part in flat)

    def _number(self, data: object, type_: Scalar, where: str) -> ir.Number:
        """Decode a number of a type; integers are accepted for floats, since JSON writers do not distinguish them."""
        number = self.document.number(data, where)
        if type_ is FLOAT and type(number) is int:
            number = float(number)
        low, high = (0, UINT_MAX) if type_ is UINT else (INT_MIN, INT_MAX) if type_ is INT else (-math.inf, math.inf)
        large = type_ is FLOAT and math.isfinite(number) and abs(number) >= FLOAT_END
        if type(number) is not _HELD_AS[type_] or large or number < low or number > high:
            self.document.wrong(where, f"a number that {type_} holds", data)
        return number

    def _handle(self, data: object, where: str) -> Target:
        document = self.document
        kinds = [kind for kind in ("input", "previous", "pass") if isinstance(data, Mapping) and kind in data]
        kind = kinds[0] if kinds else "input"
        more = [name for name in READING if isinstance(data, Mapping) and name in data and name != "border"]
        names = {"pass": ("pass", "slot"), "previous": ("previous", "frames_ago")}.get(kind, (kind,))
        record = document.record(data, where, *names, "border", *more)
        document.text(record["border"], f"{where}.border")
        reading = {field: record[name] for name, field in READING.items() if name in record}
        with document.at(where):
            if kind == "pass":
                targets = document.index(record["pass"], f"{where}.pass", self.passes, "passes")
                if isinstance(record["slot"], bool) or record["slot"] not in list(targets):
                    document.wrong(f"{where}.slot", f"one of {', '.join(map(str, targets))}", record["slot"])
                target: Target = targets[record["slot"]]
                return replace(target, **reading)
            if kind == "previous":
                spec = document.index(record["previous"], f"{where}.previous", self.targets, "targets")
                return replace(previous(spec, record["frames_ago"]), **reading)
            spec = document.index(record["input"], f"{where}.input", self.inputs, "inputs")
            return Target(spec, **reading)


def _is_handed_in(stage: ir.Stage, type_: Type) -> bool:
    """Return True for a parameter that the stage supplies: the mesh's vertex, or the vertex kernel's outputs."""
    return isinstance(type_, Struct) and (stage == "fragment" or (stage == "vertex" and type_ == VERTEX))


def _formula(data: object, depth: int = 0) -> Any:
    """Convert rows to tuples; the formula's own checks follow later."""
    if isinstance(data, list) and depth <= MAX_DEPTH:
        return tuple(_formula(part, depth + 1) for part in data[:4])
    return data


def _by_slot(returned: Target | tuple[Target, ...]) -> dict[int, Target]:
    """Return the targets of a pass by slot, the depth of a draw included."""
    targets = returned if isinstance(returned, tuple) else (returned,)
    by_slot = {target.slot: target for target in targets}
    if getattr(targets[0].made_by, "depth", None) is not None:
        by_slot.setdefault(-1, targets[0].depth)
    return by_slot


def _built(
    type_: Type,
    path: str,
    entry: int,
    numbers: Mapping[str, Sequence[ir.Number] | NDArray[Any]],
    images: Mapping[str, Target],
) -> object:
    """Rebuild a value as callers pass it, from an entry of the flat arrays that hold such values."""
    if isinstance(type_, Struct):
        fields = {n: _built(inner, f"{path}.{n}", entry, numbers, images) for n, inner in type_.fields}
        return SimpleNamespace(**fields)
    if isinstance(numbers.get(path), np.ndarray) and isinstance(type_, Array) and is_buffer(flat_type(type_)):
        count = component_count(innermost(type_))
        return np.asarray(numbers[path]).reshape(*sides_of(type_), *([count] if count > 1 else []))
    if isinstance(type_, Array) and not isinstance(type_.element, Scalar):
        first, inner = entry * type_.length, type_.element
        return [_built(inner, path, first + k, numbers, images) for k in range(type_.length)]
    if isinstance(type_, ImageType):
        return images.get(path) or images[f"{path}.{entry}"]
    count = component_count(type_)
    entries = numbers[path][entry * count : (entry + 1) * count]
    return entries[0] if isinstance(type_, Scalar) else entries
