"""Which OpenCL devices are here, and which one a name means."""

from __future__ import annotations

from typing import Any

from passgraph.backends.base import DeviceInfo, device_number
from passgraph.backends.turn import check_driver
from passgraph.errors import BackendError, DeviceMissingError

INSTALL_MODULE = "pip install 'passgraph[opencl]'"
INSTALL_DRIVER = "apt-get install pocl-opencl-icd ocl-icd-libopencl1"


def all_devices() -> list[Any]:
    """Every device of every platform, in the order in which numbers count them.

    Raises
    ------
    DeviceMissingError
        Without pyopencl, without a driver or without a device, with the command that installs it.
    """
    try:
        import pyopencl as cl
    except ImportError as error:
        raise DeviceMissingError(f"the opencl backend needs pyopencl ({error}); install it: {INSTALL_MODULE}") from None
    try:
        found = [
            device
            for platform in cl.get_platforms()
            for device in platform.get_devices()
            if device.available and device.compiler_available
        ]
    except cl.Error as error:
        raise DeviceMissingError(
            f"OpenCL found no driver ({error}); install one, on CPUs PoCL: {INSTALL_DRIVER}"
        ) from None
    if not found:
        raise DeviceMissingError(
            f"OpenCL found drivers but no usable device; install one, on CPUs PoCL: {INSTALL_DRIVER}"
        )
    return found


def choose(device: str | None) -> Any:
    """The device of this number or with this in its name; the first for None."""
    found = all_devices()
    if device is None:
        return found[0]
    number = device_number(device)
    if number is not None:
        matches = found[number : number + 1]
    else:
        matches = [one for one in found if device.lower() in f"{one.name} {one.platform.name}".lower()]
    if not matches:
        names = "; ".join(f"{number}: {one.name.strip()}" for number, one in enumerate(found))
        raise DeviceMissingError(f"there is no OpenCL device {device!r}; there are {names}")
    return matches[0]


def device_infos() -> list[DeviceInfo]:
    """All devices for a listing; one entry that says what is missing where there is none."""
    try:
        check_driver("opencl")
        return [
            DeviceInfo(one.name.strip(), f"{one.platform.name} {one.driver_version}", one.version.strip())
            for one in all_devices()
        ]
    except BackendError as error:
        return [DeviceInfo("OpenCL", "", "", str(error))]
    except Exception as error:
        return [DeviceInfo("OpenCL", "", "", f"the OpenCL driver failed: {error}")]
