"""Describe what a result depends on: versions of Python, the system, libraries, and devices with their drivers."""

from __future__ import annotations

import platform
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import Any

from passgraph.backends.base import Backend, DeviceInfo
from passgraph.backends.registry import backend_class, backend_names
from passgraph.errors import PassgraphError

#: Extras that serve work on passgraph itself.
_OF_DEVELOPERS = re.compile(r"""extra == ["'](dev|docs)["']""")


@dataclass(frozen=True)
class Environment:
    """Versions of everything that results depend on.

    Attributes
    ----------
    passgraph, python, system, cpu : as text; ``cpu`` is LLVM's name of the processor
    libraries : installed packages that passgraph names as dependencies or in its extras → version
    devices : backend → its devices; an entry with ``missing`` says why there is none
    """

    passgraph: str
    python: str
    system: str
    cpu: str
    libraries: dict[str, str]
    devices: dict[str, list[DeviceInfo]]

    def as_data(self) -> dict[str, Any]:
        """Return it as values of JSON."""
        return asdict(self)


def environment(backend: Backend | None = None) -> Environment:
    """Ask this machine about every device, which loads every driver and can take seconds; with an open backend, about
    its device alone.

    >>> import platform
    >>> from passgraph.backends.registry import open_backend
    >>> with open_backend("numpy") as backend:
    ...     found = environment(backend)
    >>> found.python.split()[1] == platform.python_version(), "numpy" in found.libraries, list(found.devices)
    (True, True, ['numpy'])
    """
    import llvmlite.binding

    import passgraph

    python = f"{platform.python_implementation()} {platform.python_version()} ({platform.python_compiler()})"
    cpu = llvmlite.binding.get_host_cpu_name()
    found = devices() if backend is None else {backend.name: [backend.device_info()]}
    return Environment(passgraph.__version__, python, _system(), cpu, dict(_libraries()), found)


def devices() -> dict[str, list[DeviceInfo]]:
    """Return the devices of every backend by its name; an entry with ``missing`` says why there is none."""
    from passgraph.backends.webgpu import chromium

    found: dict[str, list[DeviceInfo]] = {}
    for name in backend_names():
        try:
            found[name] = backend_class(name).devices()
        except PassgraphError as error:
            found[name] = [DeviceInfo("", "", "", str(error))]
        if name == "webgpu":
            found["webgpu:chromium"] = [chromium.device_info()]
    return found


def _system() -> str:
    with suppress(OSError):
        return f"{platform.freedesktop_os_release()['PRETTY_NAME']}, {platform.platform()}"
    return platform.platform()


def _libraries() -> Iterator[tuple[str, str]]:
    """Yield the dependencies that are installed, those without an extra first."""
    try:
        required = metadata.requires("passgraph") or []
    except metadata.PackageNotFoundError:  # a checkout on the path, not installed
        return
    named = (re.split(r"[^\w.-]", text)[0] for text in required if not _OF_DEVELOPERS.search(text))
    for name in dict.fromkeys(named):
        if name == "passgraph":
            continue
        with suppress(metadata.PackageNotFoundError):
            version = metadata.version(name)
            within = _WITHIN.get(name)
            yield name, f"{version} ({within()})" if within is not None else version


def _ffmpeg() -> str:
    import av

    return f"FFmpeg {av.ffmpeg_version_info}"


def _wgpu_native() -> str:
    from wgpu.backends import wgpu_native

    return f"wgpu-native {wgpu_native.__version__}"


#: Packages that contain another library, whose version is a fact of its own.
_WITHIN: dict[str, Callable[[], str]] = {"av": _ffmpeg, "wgpu": _wgpu_native}
