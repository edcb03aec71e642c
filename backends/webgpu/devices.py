"""Adapters of this machine, and the limits of an open device."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Lock
from typing import Any

from passgraph.backends.base import DeviceInfo
from passgraph.backends.driver import chosen_device
from passgraph.backends.turn import check_driver
from passgraph.backends.webgpu.wgsl import WRAP_MODES
from passgraph.errors import BackendError, DeviceMissingError
from passgraph.language.native import WGSL
from passgraph.plan.limits import NONE, Limits

INSTALL_MODULE = "pip install 'passgraph[webgpu]'"
INSTALL_DRIVER = "apt-get install mesa-vulkan-drivers"
#: Optional features, used if a device has them; with both of the first two, passes can write 16-bit normalized formats.
FILTERS, BLENDS, STENCIL = "float32-filterable", "float32-blendable", "depth32float-stencil8"
FEATURES = ("texture-format16bit-norm", "texture-adapter-specific-format-features", FILTERS, BLENDS, STENCIL)
#: Limits that are raised to the adapter's.
_RAISED = (
    "max-texture-dimension-2d", "max-buffer-size", "max-uniform-buffer-binding-size", "max-color-attachments",
    "max-color-attachment-bytes-per-sample", "max-sampled-textures-per-shader-stage",
    "max-inter-stage-shader-variables", "max-storage-buffer-binding-size",
    "max-compute-workgroup-storage-size",
)  # fmt: skip
#: Bytes of a pixel in the widest color format.
_WIDEST = 16


#: wgpu creates its instance at first use, in any thread; the environment is shared by all threads.
_opening = Lock()


@contextmanager
def _quiet_layer() -> Iterator[None]:
    """Keep Mesa's device selection layer from writing to stderr without a desktop session."""
    name, unset = "NODEVICE_SELECT", "XDG_RUNTIME_DIR" not in os.environ and "NODEVICE_SELECT" not in os.environ
    if unset:
        os.environ[name] = "1"
    try:
        yield
    finally:
        if unset:
            os.environ.pop(name, None)


#: Environment variable of wgpu that chooses an API; with "OpenGL" its layer over OpenGL is used, which lacks formats.
API_VARIABLE, LAYER = "WGPU_BACKEND_TYPE", "OpenGL"


def _native_instance() -> None:
    """Keep wgpu from loading an OpenGL driver, unless the process has already used wgpu or wants it.

    Mesa's OpenGL cannot shut down in a forked process, and loading it doubles the startup time.
    """
    if os.environ.get(API_VARIABLE) == LAYER:
        return
    with suppress(ImportError, RuntimeError, KeyError):
        from wgpu.backends.wgpu_native.extras import set_instance_extras

        set_instance_extras(backends=["Vulkan", "Metal", "DX12"])


def parse_types() -> None:
    """Parse the C types that wgpu uses together, before it parses them one by one.

    cffi 2.1 reads all typedefs of a library again for each new type, 430 for wgpu: 12 ms a type, 70 types a program.
    """
    with suppress(ImportError, AttributeError, TypeError):  # another version of wgpu or cffi does as it does
        from wgpu.backends.wgpu_native import ffi

        names = [name for name in ffi.list_types()[0] if name.startswith("WGPU") and not name.startswith("WGPUProc")]
        missing = [name for name in names if f"{name} *" not in ffi._parsed_types]
        types = ffi.typeof(f"void(*)({', '.join(f'{name} *, {name}(*)[]' for name in missing)})").args
        for name, pointer, array in zip(missing, types[::2], types[1::2], strict=True):
            ffi._parsed_types.update({f"{name} *": (pointer, False), f"{name}[]": (array.item, False)})


def all_adapters() -> list[Any]:
    """Return every adapter of a native API, in the order of their numbers.

    Raises
    ------
    DeviceMissingError
        Without wgpu or without a driver, with the command that installs it.
    """
    try:
        import wgpu
    except ImportError as error:
        raise DeviceMissingError(f"the webgpu backend needs wgpu ({error}); install it: {INSTALL_MODULE}") from None
    try:
        with _opening, _quiet_layer():
            parse_types()
            _native_instance()
            found = wgpu.gpu.enumerate_adapters_sync()
    except Exception as error:
        raise DeviceMissingError(
            f"WebGPU found no driver ({error}); install one, on CPUs lavapipe: {INSTALL_DRIVER}"
        ) from None
    # Unless it is wanted, not wgpu's layer over OpenGL: the gl backend runs there.
    wanted = os.environ.get(API_VARIABLE) == LAYER
    native = [adapter for adapter in found if (adapter.info["backend_type"] == LAYER) == wanted]
    if not native:
        raise DeviceMissingError(
            "WebGPU found no Vulkan, Metal or Direct3D 12 driver; install one, on CPUs lavapipe: " + INSTALL_DRIVER
        )
    return native


def choose(device: str | None) -> Any:
    """Return the adapter with this number or with this text in its name; the first one for None."""
    found = all_adapters()
    return found[chosen_device(device, [f"{name_of(one)} ({one.info['description']})" for one in found], "WebGPU")]


def name_of(adapter: Any) -> str:
    return str(adapter.info["device"] or adapter.info["description"]).strip()


def info_of(adapter: Any) -> DeviceInfo:
    return DeviceInfo(name_of(adapter), adapter.info["description"].strip(), adapter.info["backend_type"])


def device_infos() -> list[DeviceInfo]:
    """Return all devices for a listing, or one entry that names what is missing."""
    try:
        check_driver("webgpu")
        return [info_of(adapter) for adapter in all_adapters()]
    except BackendError as error:
        return [DeviceInfo("WebGPU", "", "", str(error))]


def open_device(adapter: Any) -> Any:
    """Open a device with the features and limits that passes use.

    Raises
    ------
    BackendError
        If the driver fails to open it, for example for lack of memory.
    """
    features = [name for name in FEATURES if name in adapter.features]
    limits = {name: adapter.limits[name] for name in _RAISED if name in adapter.limits}
    try:
        with _opening:
            return adapter.request_device_sync(label="passgraph", required_features=features, required_limits=limits)
    except Exception as error:
        raise BackendError(f"webgpu: {name_of(adapter)} cannot be opened: {' '.join(str(error).split())}") from None


def draws_norm16(device: Any) -> bool:
    """Return True if passes can write 16-bit normalized formats."""
    if FEATURES[0] not in device.features:
        return False
    import wgpu

    try:
        usage = wgpu.TextureUsage.RENDER_ATTACHMENT
        device.create_texture(size=(1, 1, 1), format="rgba16unorm", usage=usage).destroy()
    except wgpu.GPUError:
        return False
    return True


def limits_of(device: Any, name: str) -> Limits:
    """Return the limits of an open device."""
    limits = device.limits
    return Limits(
        f"webgpu ({name})",
        side=limits["max-texture-dimension-2d"],
        picture_bytes=limits["max-buffer-size"],
        images=limits["max-sampled-textures-per-shader-stage"],
        targets=min(limits["max-color-attachments"], limits["max-color-attachment-bytes-per-sample"] // _WIDEST),
        vertex_numbers=limits["max-uniform-buffer-binding-size"] // 4 - 16,
        numbers=limits["max-uniform-buffer-binding-size"] // 4 - 16,
        rounding=4,
        varyings=4 * (limits["max-inter-stage-shader-variables"] - 1),
        filters=tuple(WRAP_MODES) if FILTERS in device.features else (),
        native=WGSL,
        # Not `contracts`: WGSL lets compilers reorder the sums of `fma`, and results leave all bounds.
        trips=65_535 if name.startswith("llvmpipe") else NONE,
    )
