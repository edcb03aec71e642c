"""Shader modules, bind group layouts and pipelines, created once for each source and state."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, MutableMapping, Sequence
from typing import Any, TypeVar
from weakref import WeakValueDictionary

import numpy as np

from passgraph.backends.base import ATTRIBUTES, Block
from passgraph.backends.printing import Listing, kept
from passgraph.backends.shader_printing import vec4_count
from passgraph.backends.webgpu.trusted import trusted_module
from passgraph.backends.webgpu.wgsl import (
    FIRST_IMAGE,
    FULLSCREEN,
    HEAD,
    LINEAR,
    NEAREST,
    PARAMETERS,
    WGSL,
    WRAP_MODES,
    uniform_tables,
)
from passgraph.cached import Recent
from passgraph.errors import BackendError
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.scalar import ScalarProgram, filtered_images
from passgraph.language.source import NOWHERE
from passgraph.plan.data import DrawStep

#: Formats of the line in wgpu's messages: "wgsl:12:5" and ":12:5 error".
_LINE = re.compile(r"wgsl:(\d+):\d+|:(\d+):\d+ error")
_VERTEX, _FRAGMENT = 1, 2
#: Most objects that are kept for sources and states that come again, beside those in use. Pipelines of software devices
#: take about half a megabyte.
MOST_CACHED = 32
_T = TypeVar("_T")


def _shader(program: ScalarProgram, varyings: tuple[BuiltinName, ...], steps: tuple[int, ...]) -> Listing:
    return kept(lambda: WGSL(program, varyings, steps).shader(), "wgsl", program.key, varyings, steps)


class Programs:
    """Compiled objects of one device, by cache key: those in use, and the most recent ones."""

    def __init__(self, device: Any) -> None:
        self.device = device
        self.made: MutableMapping[object, Any] = WeakValueDictionary()
        self.cached: dict[object, Any] = Recent(MOST_CACHED)
        self.nearest = device.create_sampler(min_filter="nearest", mag_filter="nearest")
        #: In the order of their bindings.
        self.linear = [
            device.create_sampler(min_filter="linear", mag_filter="linear", address_mode_u=mode, address_mode_v=mode)
            for mode in WRAP_MODES.values()
        ]

    def once(self, key: object, make: Callable[[], _T]) -> _T:
        found: _T | None = self.made.get(key)
        if found is None:
            found = self.made[key] = self.cached[key] = make()
        return found

    def module(self, listing: Listing, kernel: str) -> Any:
        """Return a shader module.

        Raises
        ------
        BackendError
            If the compiler rejects it, with the kernel's file and line and the compiler's message.
        """
        try:
            return self.once(listing.text, lambda: self._module(listing.text))
        except Exception as error:
            raise BackendError(pointed(str(error), listing, kernel)) from None

    def _module(self, code: str) -> Any:
        checked = self.device.create_shader_module(code=code)
        return (trusted_module(self.device, code) if "for (" in code else None) or checked

    def stage_layout(self, program: ScalarProgram) -> Any:
        """Return the bind group layout of one stage."""
        filtered = filtered_images(program)
        key = "layout", program.stage == "vertex", len(program.images), tuple(filtered)
        return self.once(key, lambda: self._stage_layout(program, filtered))

    def _stage_layout(self, program: ScalarProgram, filtered: Collection[int]) -> Any:
        visible = _VERTEX if program.stage == "vertex" else _FRAGMENT
        entries: list[dict[str, Any]] = [
            {"binding": PARAMETERS, "visibility": visible, "buffer": {"type": "uniform"}},
            {"binding": NEAREST, "visibility": visible, "sampler": {"type": "non-filtering"}},
        ]
        for number in range(len(self.linear)):
            entries.append({"binding": LINEAR + number, "visibility": visible, "sampler": {"type": "filtering"}})
        for number in range(len(program.images)):
            kind = {"sample_type": "float" if number in filtered else "unfilterable-float"}
            entries.append({"binding": FIRST_IMAGE + number, "visibility": visible, "texture": kind})
        return self.device.create_bind_group_layout(entries=entries)

    def pixel(self, program: ScalarProgram, steps: tuple[int, ...], formats: tuple[str, ...]) -> Any:
        """Return the pipeline of a pixel pass that writes targets of these formats; ``steps`` as in :class:`WGSL`."""
        return self.once(("pixel", program.key, steps, formats), lambda: self._pixel(program, steps, formats))

    def _pixel(self, program: ScalarProgram, steps: tuple[int, ...], formats: tuple[str, ...]) -> Any:
        module = self.module(_shader(program, (), steps), program.name)
        corners = self.module(Listing(FULLSCREEN, (NOWHERE,)), "fullscreen")
        layout = self.device.create_pipeline_layout(bind_group_layouts=[self.stage_layout(program)])
        return self.pipeline(
            program.name,
            layout=layout,
            vertex={"module": corners, "entry_point": "main"},
            primitive={"topology": "triangle-list"},
            fragment={"module": module, "entry_point": "main", "targets": [{"format": name} for name in formats]},
        )

    def draw(
        self, step: DrawStep, steps: tuple[int, ...], state: dict[str, Any], targets: Sequence[dict[str, Any]]
    ) -> Any:
        """Return the pipeline of a draw; ``state`` holds ``primitive`` and ``depth_stencil``."""
        stages = step.vertex.key, step.fragment and step.fragment.key, step.varyings
        key = "draw", stages, steps, repr(state), repr(targets)
        return self.once(key, lambda: self._draw(step, steps, state, targets))

    def _draw(
        self, step: DrawStep, steps: tuple[int, ...], state: dict[str, Any], targets: Sequence[dict[str, Any]]
    ) -> Any:
        vertex, fragment, varyings, count = step.vertex, step.fragment, step.varyings, len(step.vertex.images)
        buffers = [
            {
                "array_stride": 4 * size,
                "attributes": [
                    {"format": "float32" if size == 1 else f"float32x{size}", "offset": 0, "shader_location": location}
                ],
            }
            for location, (name, (_, size)) in enumerate(ATTRIBUTES.items())
            if name in vertex.attributes
        ]
        first = self.module(_shader(vertex, varyings, steps[:count]), vertex.name)
        layouts, shown = [self.stage_layout(vertex)], {}
        if fragment is not None:
            second = self.module(_shader(fragment, varyings, steps[count:]), fragment.name)
            layouts.append(self.stage_layout(fragment))
            shown = {"fragment": {"module": second, "entry_point": "main", "targets": list(targets)}}
        return self.pipeline(
            vertex.name,
            layout=self.device.create_pipeline_layout(bind_group_layouts=layouts),
            vertex={"module": first, "entry_point": "main", "buffers": buffers},
            **state,
            **shown,
        )

    def pipeline(self, kernel: str, **described: Any) -> Any:
        try:
            return self.device.create_render_pipeline(**described)
        except Exception as error:
            raise BackendError(f"webgpu: the driver refuses kernel {kernel}: {_first(str(error))}") from None


def _first(log: str) -> str:
    return next((line.strip() for line in log.splitlines() if line.strip()), "no message")


def pointed(log: str, listing: Listing, kernel: str) -> str:
    """Return a compiler's message with the kernel line behind the first generated line that it names."""
    said = "; ".join(line.strip() for line in log.splitlines()[:9] if line.strip()) or "no message"
    message = f"WebGPU refuses kernel {kernel}: {said}"
    found = _LINE.search(log)
    if found is None:
        return f"webgpu: {message}"
    return listing.span_at(int(found[1] or found[2])).point_at(message)


def packed_tables(program: ScalarProgram) -> bytes:
    """Return a program's constant tables in the layout of its shader."""
    tables = [np.array(v, np.float32 if type_ == "float" else np.int32) for _, type_, v in uniform_tables(program)]
    return b"".join([table.tobytes().ljust(16 * vec4_count(len(table)), b"\0") for table in tables])


def packed(program: ScalarProgram, size: tuple[int, int], guard: float, block: Block, tables: bytes) -> bytes:
    """Return the parameters of a stage in the layout of its shader; ``tables`` from :func:`packed_tables`."""
    head = np.zeros(HEAD // 4, np.int32)
    head[4:6] = size
    head[6:7] = np.array([guard], np.float32).view(np.int32)
    floats, ints = (16 * max(1, vec4_count(n)) for n in (program.float_count, program.int_count))
    return b"".join([
        head.tobytes(),
        block.floats[: program.float_count].tobytes().ljust(floats, b"\0"),
        block.ints[: program.int_count].tobytes().ljust(ints, b"\0"),
        tables,
    ])  # fmt: skip
