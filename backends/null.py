"""The null backend: plans and compiles as usual but runs nothing; for tests of schedules and documentation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from passgraph.backends.base import Backend, DeviceInfo, FloatBlock
from passgraph.formats import Format
from passgraph.graph.draw_state import Geometry
from passgraph.plan.data import DrawStep, PixelStep


@dataclass(eq=False)
class NullStorage:
    """A picture without content."""

    format: Format
    size: tuple[int, int]


@dataclass
class NullRunner:
    """Records that its step was run."""

    step: PixelStep | DrawStep
    calls: list[str]

    def __call__(self, *_: Any, **__: Any) -> None:
        self.calls.append(self.step.name)


class NullBackend(Backend):
    """A backend whose pictures read as zeros; ``compiled``, ``calls`` and ``storages`` record what would have happened.

    ``calls`` has the names of steps in execution order; ``storages`` has the storages that are not yet released.
    """

    name: ClassVar[str] = "null"
    computes: ClassVar[bool] = False

    def __init__(self, device: str | None = None) -> None:
        self.compiled: list[str] = []
        self.calls: list[str] = []
        self.storages: list[NullStorage] = []

    @classmethod
    def devices(cls) -> list[DeviceInfo]:
        return [DeviceInfo("nothing", "null", "1")]

    def make(self, format: Format, size: tuple[int, int]) -> NullStorage:
        self.storages.append(NullStorage(format, size))
        return self.storages[-1]

    def upload(self, storage: NullStorage, picture: FloatBlock) -> None:
        """Ignore the picture."""

    def download(self, storage: NullStorage) -> FloatBlock:
        width, height = storage.size
        return np.zeros((height, width, storage.format.channels), np.float32)

    def copy(self, source: NullStorage, destination: NullStorage) -> None:
        """Do nothing."""

    def geometry(self, mesh: Geometry) -> Geometry:
        return mesh

    def pixel_pass(self, step: PixelStep) -> NullRunner:
        return self._compile(step)

    def draw_pass(self, step: DrawStep) -> NullRunner:
        return self._compile(step)

    def _compile(self, step: PixelStep | DrawStep) -> NullRunner:
        self.compiled.append(step.name)
        return NullRunner(step, self.calls)

    def release(self, storage: NullStorage) -> None:
        if storage in self.storages:
            self.storages.remove(storage)

    def after_fork(self) -> bool:
        return True

    def close(self) -> None:
        self.storages.clear()
