"""Backends over a driver: choose a device, check transfers, and free everything once."""

from __future__ import annotations

import weakref
from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Backend, FloatBlock, clear_colour, device_number, quantised
from passgraph.errors import BackendError, DeviceMissingError, InputError
from passgraph.formats import Format


def chosen_device(device: str | None, names: Sequence[str], kind: str) -> int:
    """Return the number of the device with this number or with this text in its name; the first one for None.

    >>> chosen_device("tesla", ["llvmpipe", "Tesla T4"], "OpenCL")
    1
    """
    number = 0 if device is None else device_number(device)
    if number is None:
        number = next((k for k, name in enumerate(names) if str(device).lower() in name.lower()), len(names))
    if number >= len(names):
        listed = "; ".join(f"{k}: {name}" for k, name in enumerate(names))
        raise DeviceMissingError(f"there is no {kind} device {device!r}; there are {listed}")
    return number


def shaped(array: NDArray[Any], storage: Any) -> NDArray[Any]:
    """Return an array that has the shape of a storage's picture; InputError for any other."""
    (width, height), format_ = storage.size, storage.format
    if array.shape != (height, width, format_.channels):
        raise InputError(
            f"a picture of shape {array.shape} cannot go into {format_.name} of {width}x{height} pixels; expected "
            f"shape {(height, width, format_.channels)}"
        )
    return array


def stored_clear(value: tuple[float, ...], format_: Format) -> FloatBlock:
    """Return a clear color as four floats that the format stores exactly; alpha of a three-channel format is 1."""
    four = np.array([0, 0, 0, 1], np.float32)
    four[: format_.channels] = clear_colour(value, format_.channels, format_.srgb)
    return quantised(four, format_)


class DriverBackend(Backend):
    """A backend of one device of a driver; its storages have a ``format`` and a ``size``."""

    closed = False

    def check_open(self) -> None:
        if self.closed:
            raise BackendError(f"this {self.name} backend was closed; open another one")

    def check_copy(self, source: Any, destination: Any) -> None:
        """Raise BackendError unless both storages have one format and size."""
        if (source.format, source.size) != (destination.format, destination.size):
            raise BackendError(
                f"{self.name}: cannot copy {source.format.name} {source.size} into {destination.format.name} "
                f"{destination.size}; format and size must be the same"
            )

    def download(self, storage: Any) -> FloatBlock:
        width, height = storage.size
        values = np.empty((height, width, storage.format.channels), np.float32)
        self.download_into(storage, values, storage.format)
        return values

    def free(self, resource: Any) -> None:
        """Free an object of the driver, if it is not yet."""

    def free_with(self, owner: object, resource: Any) -> None:
        """Free an object of the driver when its owner is garbage-collected."""
        weakref.finalize(owner, _freed, weakref.ref(self), resource).atexit = False

    def close(self) -> None:
        if self.turn.lost:
            self.closed = True
            return
        with self.turn:
            if not self.closed:
                self._close()

    @abstractmethod
    def _close(self) -> None:
        """Wait for the device, set ``closed``, and release everything."""


def _freed(backend: weakref.ReferenceType[DriverBackend], resource: Any) -> None:
    """Free an object; the finalizer holds only a weak reference, so that it does not keep the backend alive."""
    owner = backend()
    if owner is not None and not owner.closed:
        owner.free(resource)
