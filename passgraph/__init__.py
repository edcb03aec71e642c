"""Write a post-effect once, in Python; run it on OpenGL, OpenCL, WebGPU or the CPU; know by how much they differ.

>>> import numpy as np
>>> import passgraph as pg
>>> invert = pg.kernel(source="def invert(color: Image) -> vec4: return vec4(1.0 - color[0, 0].rgb, 1.0)")
>>> program = pg.compile(invert(pg.Input("frame")), backend="reference")
>>> program(frame=np.full((1, 1, 4), 0.25, np.float32))["invert"][0, 0, 0].item()
0.75
>>> program.close()
"""

from __future__ import annotations

import sys
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import TYPE_CHECKING, Any

from passgraph import interrupts, language
from passgraph.forking import importing
from passgraph.version import __version__ as __version__

if interrupts.is_command():  # before the imports that take long
    interrupts.install()

if TYPE_CHECKING:
    from passgraph.errors import (
        BackendError,
        DeviceMissingError,
        GraphError,
        InputError,
        KernelError,
        PassgraphError,
    )
    from passgraph.files.program_folder import load_program
    from passgraph.files.run import frames
    from passgraph.graph.calls import fragment, graph, kernel, vertex
    from passgraph.graph.draw_state import Blend, Stencil
    from passgraph.graph.drawing import draw
    from passgraph.graph.percentiles import percentile
    from passgraph.graph.reductions import histogram, reduce
    from passgraph.graph.run_values import FRAME_INDEX, OUTPUT_SIZE, Derived, Value, combine
    from passgraph.graph.targets import Input, Target, TargetSpec, previous, target
    from passgraph.hosts import gl, opencl, webgpu
    from passgraph.language import *  # noqa: F403 (every name of the kernel language)
    from passgraph.language.kernel import function, struct
    from passgraph.pictures import load, save
    from passgraph.plan.data import Options
    from passgraph.ranges import Range
    from passgraph.run.compile import compile
    from passgraph.run.program import Program
    from passgraph.run.result import Result
    from passgraph.scene import Camera, HardwareDepth, Light, Material, Mesh, Node, Scene, Texture
    from passgraph.serialize import from_data, to_data
    from passgraph.shaders.shader_file import load_shader
    from passgraph.tiles.chunks import map_blocks
    from passgraph.tiles.lazy_array import lazily_tiled
    from passgraph.tiles.tiled import tiled
    from passgraph.viewer.show import view
    from passgraph.volumes import stacked

#: Names of kernels, graphs and programs by the module that defines them. All are imported at the first use of one, so
#: that a command that needs none, such as --help, starts fast.
_CORE = {
    "errors": "BackendError DeviceMissingError GraphError InputError KernelError PassgraphError",
    "graph.calls": "fragment kernel vertex",
    "graph.draw_state": "Blend Stencil",
    "graph.drawing": "draw",
    "graph.run_values": "FRAME_INDEX OUTPUT_SIZE Derived Value combine",
    "graph.targets": "Input Target TargetSpec previous target",
    "language.kernel": "function struct",
    "plan.data": "Options",
    "ranges": "Range",
    "run.compile": "compile",
    "run.program": "Program",
    "run.result": "Result",
}
#: Names that are imported one by one.
_LATER = {
    name: f"passgraph.{module}"
    for module, names in {
        "files.program_folder": "load_program",
        "files.run": "frames",
        "graph.percentiles": "percentile",
        "graph.reductions": "histogram reduce",
        "pictures": "load save",
        "scene": "Camera HardwareDepth Light Material Mesh Node Scene Texture",
        "serialize": "from_data to_data",
        "shaders.shader_file": "load_shader",
        "tiles.chunks": "map_blocks",
        "tiles.lazy_array": "lazily_tiled",
        "tiles.tiled": "tiled",
        "viewer.show": "view",
        "volumes": "stacked",
    }.items()
    for name in names.split()
}
#: Modules under a shorter name.
_MODULES = {"gl": "passgraph.hosts.gl", "opencl": "passgraph.hosts.opencl", "webgpu": "passgraph.hosts.webgpu"}


@cache
def _core() -> dict[str, Any]:
    """Import the core and return its names."""
    found = {name: getattr(language, name) for name in language.__all__}
    for path, names in _CORE.items():
        module = import_module(f"passgraph.{path}")
        found |= {name: getattr(module, name) for name in names.split()}
    return found


def __getattr__(name: str) -> Any:
    """Import a name at its first use."""
    if name in _MODULES:
        return import_module(_MODULES[name])
    if name in _LATER:
        value = globals()[name] = getattr(import_module(_LATER[name]), name)
        return value
    # `from passgraph import arguments` asks for the name first, then imports the module of that name.
    if name in __all__ or not (name.startswith("_") or find_spec(f"passgraph.{name}")):
        with importing:
            globals().update(_core())
    if name in globals():
        return globals()[name]
    raise AttributeError(f"module 'passgraph' has no attribute {name!r}")


class _Package(ModuleType):
    """The module, in which ``graph`` is the function: importing the package of that name would replace it."""

    @property
    def graph(self) -> Any:
        return import_module("passgraph.graph.calls").graph

    @graph.setter
    def graph(self, package: ModuleType) -> None:
        pass


sys.modules[__name__].__class__ = _Package


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("_"))})


__all__ = [
    "FRAME_INDEX", "OUTPUT_SIZE", "BackendError", "Blend", "Camera", "Derived", "DeviceMissingError", "GraphError",
    "HardwareDepth", "Input", "InputError", "KernelError", "Light", "Material", "Mesh", "Node", "Options",
    "PassgraphError", "Program", "Range", "Result", "Scene", "Stencil", "Target", "TargetSpec", "Texture", "Value",
    "combine", "compile", "draw", "fragment", "frames", "from_data", "function", "gl", "graph", "histogram", "kernel",
    "lazily_tiled", "load", "load_program", "load_shader", "map_blocks", "opencl", "percentile", "previous", "reduce",
    "save", "stacked", "struct", "target", "tiled", "to_data", "vertex", "view", "webgpu",
]  # fmt: skip
# Names of kernels, which new code imports from passgraph.language: a star import of this list shadows Python's compile.
__all__ += language.__all__
