"""The frame of a subject that is shown, and the inputs of its run."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.graph.run_values import FRAME_INDEX, Value
from passgraph.scene import Camera
from passgraph.viewer.programs import Content
from passgraph.viewer.requests import Settings
from passgraph.viewer.subject import Drawing, Subject


class ShownFrame:
    """The frame that is shown.

    Attributes
    ----------
    number : of the frame, from 0
    keys : the keyboard's picture in it
    """

    def __init__(self, subject: Subject, keys: NDArray[np.uint8]) -> None:
        self.subject, self.number, self.keys = subject, 0, keys
        self._inputs: dict[str, Any] | None = None
        self._steps, self._restarts = 0, 0
        self._orbit_before = Settings.orbit

    def next(self, settings: Settings, *, advance: bool) -> tuple[int, bool]:
        """Return the number of the next frame, and True if frames start over."""
        count = self.subject.frame_count()
        is_restart, number = settings.restarts != self._restarts, max(0, settings.frame)
        if is_restart or advance or settings.steps != self._steps:
            number = 0 if is_restart else number + 1
            number = number if count is None else number % count
        self._steps, self._restarts = settings.steps, settings.restarts
        return number, is_restart

    def show(self, number: int, keys: NDArray[np.uint8]) -> None:
        """Show a frame: read its inputs unless it is the one that is shown."""
        if self._inputs is None or number != self.number:
            self._inputs = dict(self.subject.frame(0 if self.subject.frame_count() is None else number))
        self.number, self.keys = number, keys

    def read_again(self) -> None:
        """Read the inputs again when the next frame is shown."""
        self._inputs = None

    def end(self, settings: Settings) -> None:
        """Note that the frame was computed: its camera is the previous one of the next."""
        self._orbit_before = settings.orbit

    def recorded(self, number: int, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the inputs of any frame, for a recording."""
        count = self.subject.frame_count()
        inputs = dict(self.subject.frame(0 if count is None else number % count))
        audio = self.subject.audio(number, values)
        return inputs if audio is None else {**inputs, "audio": audio}

    def run_inputs(
        self,
        content: Content,
        drawing: Drawing,
        inputs: Collection[str],
        run_values: Mapping[str, Value],
        settings: Settings,
    ) -> dict[str, Any]:
        """Return the pictures and run values of a run: values of controls, the time, and the orbited camera."""
        run_inputs = {
            "keyboard": self.keys, **drawing.run_inputs, **(self._inputs or {}), FRAME_INDEX.name: self.number
        }  # fmt: skip
        parameters = content.values(settings)
        if "audio" in inputs and (audio := self.subject.audio(self.number, parameters)) is not None:
            run_inputs["audio"] = audio
        parameters = {name: parameters[name] for name in content.handles if name in parameters}
        run_inputs = {n: v for n, v in run_inputs.items() if n in inputs or n in run_values}
        run_inputs |= {name: value for name, value in parameters.items() if name in run_values}
        run_inputs |= {name: value for name, value in settings.look.values().items() if name in run_values}
        camera = run_inputs.get("camera", getattr(run_values.get("camera"), "default", None))
        if isinstance(camera, Camera):
            run_inputs["camera"] = camera.orbited(*settings.orbit)
            if "previous_camera" in run_values:
                run_inputs["previous_camera"] = camera.orbited(*self._orbit_before)
        return run_inputs
