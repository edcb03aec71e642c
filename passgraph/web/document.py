"""A plan as plain data for the browser: effect.json, and the bytes of effect.bin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import ATTRIBUTES, vertex_attribute
from passgraph.backends.webgpu.recorder import RecordingBackend, constants, offset
from passgraph.errors import InputError
from passgraph.formats import FORMATS, Format
from passgraph.graph.draw_state import Geometry
from passgraph.graph.run_values import FRAME_INDEX, OUTPUT_SIZE, Derived, Value, is_object_type
from passgraph.language.long_arrays import picture_of
from passgraph.language.parameter_name import ParameterName
from passgraph.language.scalar import ScalarProgram, UniformSlot
from passgraph.language.types import element_of
from passgraph.plan.data import CopyStep, DrawStep, PixelStep, Plan, Resource, Step
from passgraph.run.parameters import Uniforms, picked, resolve
from passgraph.web.orbit import PoseTable
from passgraph.web.size_rules import Rule

#: Version of effect.json; a runtime reads one version.
VERSION = 1


class Blob:
    """The bytes of effect.bin; each part begins at a multiple of 4."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.size = 0
        self._known: dict[bytes, dict[str, int]] = {}

    def add(self, data: bytes) -> dict[str, int]:
        """Store bytes and return their place; equal bytes are stored once."""
        if data not in self._known:
            self._known[data] = {"at": self.size, "bytes": len(data)}
            padded = data.ljust(-(-len(data) // 4) * 4, b"\0")
            self.parts.append(padded)
            self.size += len(padded)
        return self._known[data]


class PlanWriter:
    """Writes one plan.

    ``constants`` are values of this export by name, such as a camera: what depends on them alone is a constant too.
    ``poses`` has what changes when the camera orbits.
    """

    def __init__(
        self, plan: Plan, backend: RecordingBackend, constants: Mapping[str, object], poses: PoseTable | None
    ) -> None:  # fmt: skip
        self.plan, self.backend, self.blob, self.poses = plan, backend, Blob(), poses
        self.constants: dict[Any, object] = {**constants, OUTPUT_SIZE.name: plan.size}
        #: Depth targets beside the plan's, each with the resource whose size it has.
        self.unread_depths: list[tuple[Resource, int]] = []
        self.meshes: list[dict[str, Any]] = []
        self._mesh_numbers: dict[int, int] = {}
        self.pipelines: list[dict[str, Any]] = []

    # Pictures

    def resource(self, resource: Resource, rule: Rule) -> dict[str, Any]:
        stored = self.backend.stored(resource.format)
        described = {
            "name": resource.name, "kind": resource.kind, "format": resource.format.name,
            "channels": resource.format.channels, "texture": stored.name, "texel": np.dtype(stored.format.number).name,
            "stored": stored.format.channels, "steps": resource.format.steps, "srgb": resource.format.srgb,
            "size": list(resource.size), "rule": rule, "memory": resource.memory,
        }  # fmt: skip
        if resource.kind == "buffer":
            described["data"] = self._buffer(resource)
        if resource.kind == "history":
            initial = resource.initial
            if isinstance(initial, np.ndarray):
                described["data"] = self.picture(initial, resource.format, resource.size)
            else:
                spread = initial * resource.format.channels if len(initial) == 1 else initial
                described["initial"] = [float(number) for number in spread]
            if resource.format.is_depth and ("data" in described or any(resource.initial)):
                raise InputError(f"{resource.name!r}: a depth target cannot start from a picture or number in WebGPU")
        if resource.kind == "input" and resource.format.is_depth:
            raise InputError(
                f"input {resource.name!r} is {resource.format.name}, which WebGPU cannot upload; declare it as r32f"
            )
        return described

    def picture(self, picture: NDArray[Any], format_: Format, size: tuple[int, int]) -> dict[str, int]:
        """Store the texels of a picture and return their place."""
        return self.blob.add(self.backend.texels(picture, format_, size))

    def _buffer(self, resource: Resource) -> dict[str, int]:
        spec = self.plan.buffers[resource.id]
        value = spec.value
        if isinstance(value, (Value, Derived)):
            missing = [source.name for source in value.sources if source.name not in self.constants]
            if missing:
                raise InputError(
                    f"value {missing[0]!r} is a long array ({spec.type}), which a page cannot set; give the export "
                    "its numbers"
                )
            value = resolve(value, self.constants)
        array = picture_of(picked(value, spec.fields, spec.name), spec.type, spec.name)
        return self.picture(array, resource.format, resource.size)

    # Steps

    def step(self, step: Step) -> dict[str, Any]:
        described: dict[str, Any] = {"name": step.name, "static": step.static, "outputs": list(step.outputs)}
        if isinstance(step, CopyStep):
            return {**described, "kind": "copy", "source": step.source_resource}
        images = [resource for _, resource in step.images]
        if isinstance(step, PixelStep):
            described |= {"kind": "pixel", "pipeline": self._pipeline(self.backend.pixel_pipeline(step))}
            return {**described, "stages": [self._stage(step.program, step, images)]}
        assert isinstance(step, DrawStep)
        return {**described, **self._draw(step, images)}

    def _draw(self, step: DrawStep, images: list[int]) -> dict[str, Any]:
        depth = None if step.depth is None else self.plan.resources[step.depth].format
        pipeline = self.backend.draw_pipeline(step, depth)
        clears, place, clear = pipeline.pop("clears"), step.depth, step.depth_clear
        if pipeline.pop("lacks_depth"):
            place, clear = self._unread_depth(step), 0.0
        count = len(step.vertex.images)
        stages = [self._stage(step.vertex, step, images[:count])]
        if step.fragment is not None:
            stages.append(self._stage(step.fragment, step, images[count:]))
        stencil = step.state.stencil
        return {
            "kind": "draw", "pipeline": self._pipeline(pipeline), "stages": stages, "clears": clears,
            "depth": place, "depthClear": clear, "stencilClear": step.state.clear_stencil,
            "stencilReference": 0 if stencil is None else stencil.reference,
            "mesh": self._mesh(step.source.geometry),
            "attributes": [name for name in ATTRIBUTES if name in step.vertex.attributes],
        }  # fmt: skip

    def _unread_depth(self, step: DrawStep) -> int:
        """Add a depth target of the size of a draw, and return its number."""
        like, count = self.plan.resources[step.outputs[0]], len(self.unread_depths)
        depth = replace(
            like, id=len(self.plan.resources) + count, name=f"unread depth of {step.name}", kind="unread",
            format=FORMATS["depth32f"], memory=len(self.plan.memories) + count,
        )  # fmt: skip
        self.unread_depths.append((depth, like.id))
        return depth.id

    def _pipeline(self, described: dict[str, Any]) -> int:
        if described not in self.pipelines:
            self.pipelines.append(described)
        return self.pipelines.index(described)

    def _mesh(self, geometry: Geometry) -> int:
        if id(geometry) not in self._mesh_numbers:
            triangles = np.ascontiguousarray(geometry.triangles, np.uint32)
            self._mesh_numbers[id(geometry)] = len(self.meshes)
            self.meshes.append({"count": triangles.size, "indices": self.blob.add(triangles.tobytes()),
                                "attributes": {}})  # fmt: skip
        return self._mesh_numbers[id(geometry)]

    def add_attributes(self) -> None:
        """Write the vertex attributes that draws read."""
        for step in self.plan.steps:
            if isinstance(step, DrawStep):
                geometry = step.source.geometry
                written = self.meshes[self._mesh(geometry)]["attributes"]
                for name in step.vertex.attributes:
                    if name not in written:
                        written[name] = self.blob.add(vertex_attribute(geometry, name).tobytes())

    # Parameters

    def _constant(self, step: PixelStep | DrawStep, name: ParameterName) -> object:
        """Return a parameter of a step: its constant, or the run value that the page sets.

        Raises
        ------
        InputError
            For a value that a Python function computes, with its name.
        """
        handle = step.values[name]
        if not isinstance(handle, (Value, Derived)) or handle is OUTPUT_SIZE or handle is FRAME_INDEX:
            return handle
        missing = [source for source in handle.sources if source.name not in self.constants]
        if not missing:
            return resolve(handle, self.constants)
        if isinstance(handle, Derived):
            raise InputError(
                f"pass {step.name!r}: {name.parameter!r} is computed by a Python function from the value "
                f"{missing[0].name!r}, which a browser cannot call; give the export a number for {missing[0].name!r}"
            )
        if is_object_type(handle.type):
            raise InputError(
                f"value {handle.name!r} is a {handle.type.__name__}, which a page cannot set; give the export one"  # type: ignore[attr-defined]
            )
        return handle

    def _stage(self, program: ScalarProgram, step: PixelStep | DrawStep, images: Sequence[int]) -> dict[str, Any]:
        """Return the images and parameters of one stage: a block of constants, and the places of run values in it."""
        constant = replace(step, values={name: self._constant(step, name) for name in step.values})
        uniforms = Uniforms(program, constant, {})
        values = [
            _place(slot, constant.values[key].name, fields, offset(program, slot))  # type: ignore[attr-defined]
            for key, fields, _, slot, _ in uniforms.changing
        ]
        block = self.blob.add(constants(program, uniforms.block))
        described = {"images": list(images), "constants": block, "values": values}
        if self.poses is not None:
            columns = [(slot, self.poses.column(slot, step.values)) for slot in program.uniforms]
            described["poses"] = [
                {"at": offset(program, slot), "count": slot.count, "column": column}
                for slot, column in columns
                if column is not None
            ]
        return described


def _place(slot: UniformSlot, value: str, fields: Sequence[str], at: int) -> dict[str, Any]:
    if fields:
        raise InputError(f"value {value!r} is a struct, which a page cannot set; give the export one")
    place: dict[str, Any] = {
        "value": value, "at": at, "count": slot.count,
        "type": element_of(slot.type).name,  # type: ignore[arg-type]
    }  # fmt: skip
    if slot.range is not None:
        limits = slot.range
        place["range"] = {"low": limits.low, "high": limits.high, "above": limits.above, "odd": limits.odd}
    return place


def written_plan(
    plan: Plan, rules: Sequence[Rule] | None, constants: Mapping[str, object], pictures: Mapping[str, NDArray[Any]],
    poses: PoseTable | None = None,
) -> tuple[dict[str, Any], bytes]:  # fmt: skip
    """Return a plan as plain data and the bytes beside it.

    Parameters
    ----------
    rules : the size rule of each resource; None fixes the sizes
    constants : values of this export by name
    pictures : inputs whose picture is part of the export, by name
    poses : of a camera that orbits; None for a camera that is a constant

    Raises
    ------
    InputError
        For a value that cannot be exported, with its name.
    """
    backend = RecordingBackend()
    writer = PlanWriter(plan, backend, constants, poses)
    fixed = [{"fixed": list(resource.size)} for resource in plan.resources]
    resources = [writer.resource(r, rule) for r, rule in zip(plan.resources, rules or fixed, strict=True)]
    steps = [writer.step(step) for step in plan.steps]
    resources += [writer.resource(r, resources[like]["rule"]) for r, like in writer.unread_depths]
    writer.add_attributes()
    inputs: dict[str, dict[str, Any]] = {}
    for name, resource in plan.inputs.items():
        inputs[name] = {"resource": resource, "static": name in plan.static_inputs, "data": None}
        if name in pictures:
            info = plan.resources[resource]
            inputs[name]["data"] = writer.picture(pictures[name], info.format, info.size)
    document = {
        "format": "passgraph effect", "version": VERSION,
        "size": list(plan.size), "resizable": rules is not None,
        "features": backend.features(plan), "limits": backend.raised_limits(plan),
        "memories": len(plan.memories) + len(writer.unread_depths),
        "resources": resources, "inputs": inputs, "outputs": dict(plan.outputs),
        "history": [list(pair) for pair in plan.histories],
        "steps": steps, "pipelines": writer.pipelines, "modules": backend.modules,
        "fullscreen": backend.fullscreen(), "meshes": writer.meshes,
        "staticValues": sorted(n for n, v in plan.values.items() if v.static and n not in writer.constants),
        "data": {"file": "effect.bin", "bytes": writer.blob.size},
    }  # fmt: skip
    return document, b"".join(writer.blob.parts)
