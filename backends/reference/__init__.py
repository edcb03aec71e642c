"""The reference backend: a float64 interpreter of the typed representation and an exact rasterizer.

It defines the results that other backends must reproduce.  In reading order: ``domain`` and ``interpreter`` (the
walker), ``number_domain`` (float64), ``images`` and ``stage`` (a kernel's inputs), ``pixel_pass``; then ``draw_pass``
with ``raster_clip``, ``raster_setup``, ``raster_cover``, ``output_tests`` and ``output_merge``; ``traced`` and
``traced_draw`` record a kernel and a draw at one pixel.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from passgraph.backends.base import Backend, DeviceInfo, FloatBlock, quantised
from passgraph.backends.reference.draw_pass import ReferenceDrawPass
from passgraph.backends.reference.stage import ReferencePixelPass, Storage
from passgraph.errors import BackendError
from passgraph.formats import Format
from passgraph.graph.draw_state import Geometry
from passgraph.plan.data import DrawStep, PixelStep


class ReferenceBackend(Backend):
    """Computes with NumPy in float64; only stores round."""

    name: ClassVar[str] = "reference"
    optimises: ClassVar[bool] = False

    def __init__(self, device: str | None = None) -> None:
        self.device = device

    @classmethod
    def devices(cls) -> list[DeviceInfo]:
        return [DeviceInfo("CPU, float64", "numpy", np.__version__)]

    def make(self, format: Format, size: tuple[int, int]) -> Storage:
        return Storage.make(format, size)

    def upload(self, storage: Storage, picture: FloatBlock) -> None:
        shape = storage.pixels.shape
        array = np.asarray(picture, np.float32)
        if array.size != storage.pixels.size or array.shape[:2] != shape[:2]:
            raise BackendError(f"upload of {array.shape} into a storage of {shape}: both must have one shape")
        storage.pixels[...] = quantised(array.reshape(shape), storage.format)

    def download(self, storage: Storage) -> FloatBlock:
        return storage.pixels.copy()

    def copy(self, source: Storage, destination: Storage) -> None:
        destination.pixels[...] = source.pixels
        if source.stencil is not None and destination.stencil is not None:
            destination.stencil[...] = source.stencil

    def geometry(self, mesh: Geometry) -> Geometry:
        return mesh

    def pixel_pass(self, step: PixelStep) -> ReferencePixelPass:
        return ReferencePixelPass(step)

    def draw_pass(self, step: DrawStep) -> ReferenceDrawPass:
        return ReferenceDrawPass(step)

    def release(self, storage: Storage) -> None:
        """Do nothing: the arrays are freed with the last reference to them."""

    def after_fork(self) -> bool:
        return True

    def close(self) -> None:
        """Do nothing."""
