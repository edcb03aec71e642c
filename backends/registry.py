"""Find backends by name: built-in ones, and others through the entry point group ``passgraph.backends``."""

from __future__ import annotations

import os
from importlib import import_module

from passgraph.arguments import near
from passgraph.backends.base import Backend
from passgraph.errors import BackendError

GROUP = "passgraph.backends"
#: Environment variable that names the default backend.
DEFAULT_VARIABLE = "PASSGRAPH_BACKEND"
BUILT_IN = {
    "reference": "passgraph.backends.reference:ReferenceBackend",
    "numpy": "passgraph.backends.numpy:NumpyBackend",
    "gl": "passgraph.backends.gl:GLBackend",
    "gles": "passgraph.backends.gl.es:GLESBackend",
    "opencl": "passgraph.backends.opencl:OpenCLBackend",
    "webgpu": "passgraph.backends.webgpu:WebGPUBackend",
    "null": "passgraph.backends.null:NullBackend",
}
#: Backends that comparisons leave out unless they are named: the truth, one that computes nothing, and a second way to
#: the driver of `gl`.
_ON_REQUEST = ("reference", "null", "gles")
#: Common other names of backends.
_OTHER_NAMES = {"opengl": "gl", "glsl": "gl", "moderngl": "gl", "cl": "opencl", "pyopencl": "opencl", "cpu": "numpy",
    "wgpu": "webgpu", "vulkan": "webgpu", "metal": "webgpu", "opengles": "gles", "angle": "gles"}  # fmt: skip


def backend_names() -> list[str]:
    """Return the names of built-in backends, then of those from other packages."""
    return [*BUILT_IN, *sorted(set(_entry_points()) - set(BUILT_IN))]


def compared_backends() -> list[str]:
    """Return the names of the backends that are compared if none is named."""
    return [name for name in backend_names() if name not in _ON_REQUEST]


def _entry_points() -> dict[str, str]:
    """Return name → module and class of every entry point."""
    from importlib.metadata import entry_points  # importing it takes as long as compiling a small graph

    return {entry.name: entry.value for entry in entry_points(group=GROUP)}


def backend_class(name: str) -> type[Backend]:
    """Return the class of a backend; importing it loads no driver.

    Raises
    ------
    BackendError
        For an unknown name, or a package that fails to load.
    """
    path = BUILT_IN.get(name) or _entry_points().get(name)
    if path is None:
        hint = near(_OTHER_NAMES.get(name, name), backend_names())
        raise BackendError(f"there is no backend {name!r}{hint}; there are {', '.join(backend_names())}")
    module, _, attribute = path.partition(":")
    try:
        class_ = getattr(import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise BackendError(f"backend {name!r} ({path}) cannot be loaded: {error}") from error
    if not (isinstance(class_, type) and issubclass(class_, Backend)):
        raise BackendError(f"backend {name!r} ({path}) is not a subclass of passgraph.backends.base.Backend")
    return class_


def open_backend(name: str | None = None) -> Backend:
    """Open ``"gl"``, ``"opencl:1"`` (a device by number or part of its name) …; None takes the default, numpy.

    Raises
    ------
    BackendError
        For an unknown name; DeviceMissingError with the install command if a driver is missing.
    """
    full = (os.environ.get(DEFAULT_VARIABLE) or "numpy") if name is None else name
    base, _, device = full.partition(":")
    return backend_class(base)(device or None)
