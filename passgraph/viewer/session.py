"""The computing thread of the live view: apply the page's latest settings, run programs, publish pictures."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from fractions import Fraction
from math import isfinite
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Backend
from passgraph.backends.registry import backend_names, open_backend
from passgraph.errors import InputError, PassgraphError
from passgraph.graph.run_values import FRAME_INDEX, Value
from passgraph.graph.targets import Input, Target
from passgraph.pictures import load_stored, scaled
from passgraph.plan.dependencies import inputs_behind
from passgraph.run.caller_arrays import format_of
from passgraph.run.result import Result
from passgraph.scene import Camera
from passgraph.viewer.compiled import Compiled, Difference, flip_map, values_of
from passgraph.viewer.debugger import Debugger, View
from passgraph.viewer.display import Look, encode, histogram_of, range_of
from passgraph.viewer.keyboard import Keyboard
from passgraph.viewer.recording import record
from passgraph.viewer.subject import Control, Drawing, Loaded, Subject, run_values_of

#: Seconds between checks of the subject's files, and from the last change until a picture is sent losslessly.
POLL_S, SETTLED_S = 0.05, 0.25
#: The name of a picture file among the backends to compare with, and the name of its input.
REFERENCE_FILE, REFERENCE_INPUT = "file", "reference picture"


@dataclass(frozen=True)
class Settings:
    """The settings of the page.

    Attributes
    ----------
    values : values of the controls that were moved, by name
    target : the name of the target to show; empty for the first output
    look : how the target is shown
    backend, other : names of the backends; ``other`` is compared with the first, `REFERENCE_FILE` for a picture, or
        empty
    compare : "", "other", "both", "difference" or "flip"
    gain : factor of differences
    playing : True while frames play
    frame : frame number from 0, of the input's frames or of the time
    steps, restarts : how often the page requested the next frame, and the first one
    orbit : radians to the right and up, and the factor of the distance
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    target: str = ""
    look: Look = field(default_factory=Look)
    backend: str = ""
    other: str = ""
    compare: str = ""
    gain: float = 1.0
    playing: bool = False
    frame: int = 0
    steps: int = 0
    restarts: int = 0
    orbit: tuple[float, float, float] = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Published:
    """A state as sent to clients: facts as JSON, and pictures by slot ("a", "b", "difference", "flip")."""

    number: int
    facts: Mapping[str, Any]
    pictures: Mapping[str, tuple[bytes, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Content:
    """The content of the subject's files, when they were last read without an error.

    Attributes
    ----------
    loaded : the content
    handles : run values of its numeric parameters, by name
    """

    loaded: Loaded
    handles: Mapping[str, Value] = field(default_factory=dict)

    def values(self, settings: Settings) -> dict[str, Any]:
        """Return the value of each parameter: its control's, else the default."""
        known = {control.name for control in self.loaded.controls}
        moved = {name: value for name, value in settings.values.items() if name in known and value is not None}
        return _defaults(self.loaded) | moved


@dataclass(frozen=True)
class ProgramSet:
    """Compiled programs by slot, the content they were compiled from, and the key of the settings they depend on."""

    content: Content
    key: object
    programs: Mapping[str, Compiled]

    def close(self) -> None:
        for compiled in self.programs.values():
            compiled.close()


class Session:
    """A subject on screen.

    `ask` may be called in any thread; `publish` is called in the session's own thread for each new state.
    """

    def __init__(self, subject: Subject, backend: str, publish: Callable[[Published], None]) -> None:
        self.subject, self.publish = subject, publish
        self._settings = Settings(backend=backend)
        self._changed = threading.Condition()
        self._dirty, self._closed = True, False
        self._requested_pictures = 0  # for which clients wait
        self._thread = threading.Thread(target=self._run, name="passgraph_view", daemon=True)
        self._stamp: tuple[int, ...] = ()
        #: None until the files are read, and after a change; `_program_set` stays until the next one is compiled.
        self._content: Content | None = None
        self._program_set: ProgramSet | None = None
        #: Open backends by name; consecutive programs share a backend, and so keep history.
        self._backends: dict[str, Backend] = {}
        self._debugger = Debugger()
        self._reference: NDArray[Any] | None = None
        self._error = ""
        self._number, self._clock, self._frame = 0, (0, 0), 0
        self._names = [name for name in backend_names() if name != "null"]  # null computes nothing
        #: The latest results by slot ("a", "b"), their time and durations, and the difference of both.
        self._results: dict[str, Result] = {}
        self._ran_at, self._is_rough = 0.0, False
        self._times: dict[str, float] = {}
        self._difference: Difference | None = None
        self._flip: tuple[NDArray[np.uint8], float] | None = None
        #: Held while programs are compiled and run, and while their inputs are replaced.
        self._lock = threading.Lock()
        self._inputs: dict[str, Any] = {}
        self._orbit_before = self._settings.orbit
        self._keyboard = Keyboard()
        self._keys = self._keyboard.picture()  # of the latest frame
        self._input_changed, self._must_read_input = False, True

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """End the thread and close the programs."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        if self._thread.ident is not None:
            self._thread.join(10.0)
        with self._lock:
            if self._program_set is not None:
                self._program_set.close()
            self._program_set = None
            for backend in self._backends.values():
                backend.close()
        self._debugger.close()

    # For the server

    def ask(self, **changes: Any) -> None:
        """Change fields of `Settings`."""
        with self._changed:
            self._settings = replace(self._settings, **changes)
            self._dirty = True
            self._changed.notify()

    def ready(self) -> None:
        """Count a client that has shown the last picture and can take the next one."""
        with self._changed:
            self._requested_pictures += 1
            self._changed.notify()

    def key(self, code: int, down: bool) -> None:
        """Press or release a key. Playing shaders read it in the next frame, others are run for it."""
        with self._changed:
            self._keyboard.change(code, down)
            self._dirty |= not self._settings.playing
            self._changed.notify()

    def replace_input(self, path: Path) -> None:
        """Replace the first input by another picture."""
        # Not during a run, which has read the earlier input and would mark the new one as read.
        with self._lock:
            self.subject.replace_input(path)
            self._input_changed = True
        self.ask()

    def values_at(self, x: int, y: int) -> dict[str, list[float]]:
        """Return a texel of the shown target, on each backend."""
        texels: dict[str, list[float]] = {}
        for slot, result in self._results.items():
            picture = result["values"]
            if 0 <= y < picture.shape[0] and 0 <= x < picture.shape[1]:
                texels[slot] = [_json_number(number) for number in picture[y, x].tolist()]
        return texels

    def statistics(self) -> dict[str, Any]:
        """Return the range of the shown target, its counts of NaN and infinity, and a histogram."""
        if "a" not in self._results:
            return {}
        values = scaled(self._results["a"]["values"])
        low, high = range_of(values)
        return {
            "low": low,
            "high": high,
            "nan": int(np.isnan(values).any(axis=2).sum()),
            "infinite": int(np.isinf(values).any(axis=2).sum()),
            "histogram": histogram_of(values, low, high),
        }

    def compare_with(self, path: Path) -> None:
        """Compare with a picture file, without converting its values."""
        self._compare(load_stored(path))

    def keep(self, picture: NDArray[Any]) -> dict[str, Any]:
        """Compare the following pictures with this one."""
        self._compare(picture.copy())
        return {}

    def _compare(self, picture: NDArray[Any]) -> None:
        with self._lock:
            self._reference = picture
            self._input_changed = True
        self.ask()

    def inspect(self, x: int, y: int) -> dict[str, Any]:
        """See `Debugger.pixel`."""
        return self._debugger.pixel(self.view(), x, y)

    def profile(self) -> dict[str, Any]:
        """See `Debugger.passes`."""
        return self._debugger.passes(self.view())

    def code(self, name: str) -> dict[str, Any]:
        """See `Debugger.code`."""
        return self._debugger.code(self.view(), name)

    def verdict(self) -> dict[str, Any]:
        """See `Debugger.verdict`."""
        return self._debugger.verdict(self.view())

    def record(self, first: int, last: int, rate: Fraction, path: Path) -> None:
        """See `passgraph.viewer.recording.record`."""
        record(self.view(), self._frame_inputs, first, last, rate, path, lambda: self._closed)

    def _frame_inputs(self, number: int) -> dict[str, Any]:
        count, program_set = self.subject.frame_count(), self._program_set
        with self._lock:
            inputs = dict(self.subject.frame(0 if count is None else number % count))
            values = {} if program_set is None else program_set.content.values(self._settings)
            audio = self.subject.audio(number, values)
            return inputs if audio is None else {**inputs, "audio": audio}

    def view(self) -> View:
        """Return the view that is on screen.

        Raises
        ------
        InputError
            If no picture has been computed yet.
        """
        with self._lock:
            program_set = self._program_set
            if program_set is None:
                raise InputError("there is no picture yet")
            compiled, settings = program_set.programs["a"], self._settings
            drawing = compiled.drawing
            backends = [settings.backend]
            if "b" in program_set.programs and settings.other != REFERENCE_FILE:
                backends.append(settings.other)
            inputs = inputs_behind([*drawing.outputs.values()])
            run_inputs = self._run_inputs(
                program_set.content, drawing, inputs, values_of(drawing.outputs.values()), settings
            )
            return View(drawing, compiled.target, backends, run_inputs)

    def picture(self, output: Literal["values", "shown"]) -> NDArray[Any]:
        """Return the values of the shown target, or the picture as shown, (height, width, channels)."""
        if "a" not in self._results:
            raise InputError("there is no picture yet")
        picture: NDArray[Any] = self._results["a"][output]
        return picture

    # The thread

    def _run(self) -> None:
        while True:
            with self._changed:
                if not (self._dirty or self._closed or (self._settings.playing and self._requested_pictures)):
                    self._changed.wait(POLL_S)
                if self._closed:
                    return
                settings, dirty = self._settings, self._dirty
                playing = settings.playing and self._requested_pictures > 0
                self._dirty = False
            if self._files_changed():
                self._content, dirty = None, True
            if dirty or playing:
                self._show(settings, advance=playing and not dirty)
            elif self._is_rough and perf_counter() - self._ran_at > SETTLED_S:
                self._send(exact=True)

    def _files_changed(self) -> bool:
        stamp: list[int] = []
        for path in self.subject.files:
            with suppress(OSError):
                status = path.stat()
                if not status.st_size:
                    return False  # an editor has truncated it and is about to write
                stamp += [status.st_mtime_ns, status.st_size]
        changed, self._stamp = tuple(stamp) != self._stamp, tuple(stamp)
        return changed

    def _show(self, settings: Settings, *, advance: bool) -> None:
        try:
            with self._lock:
                start = perf_counter()
                program_set = self._compile(settings)
                compiled = perf_counter()
                results = self._run_programs(program_set, settings, advance)
                ran = perf_counter()
            self._results, self._ran_at, self._error = results, ran, ""
            self._difference = _difference(results)
            self._flip = flip_map(results) if settings.compare == "flip" and "b" in results else None
            self._times = {"compile_ms": 1e3 * (compiled - start), "run_ms": 1e3 * (ran - compiled)}
            self._send(exact=False)
        except Exception as error:  # any error of a user's file is shown on the page, with the last picture
            self._error = str(error) if isinstance(error, PassgraphError) else f"{type(error).__name__}: {error}"
            with self._changed:
                self._requested_pictures = 0  # so that a playing view does not fail again at once
            self._number += 1
            self.publish(Published(self._number, self._facts()))

    def _compile(self, settings: Settings) -> ProgramSet:
        """Return the programs for the settings, compiled again if more than run values changed."""
        if self._content is None:
            loaded = self.subject.load()
            self._content = Content(loaded, run_values_of(loaded, Content(loaded).values(settings)))
        content = self._content
        fixed = {name: value for name, value in content.values(settings).items() if name not in content.handles}
        others = [settings.other] if settings.other and settings.compare else []
        key = (repr(sorted(fixed.items())), settings.target, settings.backend, *others)
        program_set = self._program_set
        if (
            program_set is not None
            and program_set.content is content
            and program_set.key == key
            and not self._input_changed
        ):
            return program_set
        drawing = content.loaded.draw({**fixed, **content.handles})
        programs: dict[str, Compiled] = {}
        try:
            programs["a"] = Compiled(drawing, settings.target, self._backend(settings.backend))
            for other in others:
                programs["b"] = self._compared(drawing, programs["a"].target, settings, other)
        except BaseException:
            ProgramSet(content, key, programs).close()
            raise
        for slot, earlier in ({} if program_set is None else program_set.programs).items():
            if slot in programs:
                programs[slot].follow(earlier)
            else:
                earlier.close()
        self._program_set, self._input_changed, self._must_read_input = ProgramSet(content, key, programs), False, True
        return self._program_set

    def _backend(self, name: str) -> Backend:
        if name not in self._backends:
            self._backends[name] = open_backend(name or None)
        return self._backends[name]

    def _compared(self, drawing: Drawing, target: Target, settings: Settings, other: str) -> Compiled:
        """Compile the drawing on another backend, or a picture file that is shown like the target."""
        if other != REFERENCE_FILE:
            return Compiled(drawing, settings.target, self._backend(other))
        if self._reference is None:
            raise InputError("choose a picture to compare with")
        height, width, channels = self._reference.shape
        picture = Input(REFERENCE_INPUT, format_of(self._reference.dtype, channels), (width, height))
        reference = Drawing({target.name: picture}, (width, height), {REFERENCE_INPUT: self._reference})
        return Compiled(reference, "", self._backend(settings.backend))

    def _run_programs(self, program_set: ProgramSet, settings: Settings, advance: bool) -> dict[str, Result]:
        count = self.subject.frame_count()
        clock = (settings.steps, settings.restarts)
        is_restart = clock[1] != self._clock[1]
        frame = max(0, settings.frame)
        if is_restart or advance or clock[0] != self._clock[0]:
            frame = 0 if is_restart else frame + 1
            frame = frame if count is None else frame % count
            with self._changed:
                self._settings = replace(self._settings, frame=frame)
        if is_restart:
            for compiled in program_set.programs.values():
                compiled.restart()
        if self._must_read_input or frame != self._frame:
            self._inputs = dict(self.subject.frame(0 if count is None else frame))
        self._clock, self._frame, self._must_read_input = clock, frame, False
        with self._changed:
            self._keys = self._keyboard.picture()
            self._keyboard.end_frame()
        results = {}
        for slot, compiled in program_set.programs.items():
            inputs = compiled.program.inputs
            run_inputs = self._run_inputs(program_set.content, compiled.drawing, inputs, compiled.values, settings)
            results[slot] = compiled.run(run_inputs)
        self._orbit_before = settings.orbit
        return results

    def _run_inputs(
        self,
        content: Content,
        drawing: Drawing,
        inputs: Collection[str],
        run_values: Mapping[str, Value],
        settings: Settings,
    ) -> dict[str, Any]:
        """Return the pictures and run values of a run: values of controls, the time, and the orbited camera."""
        run_inputs = {"keyboard": self._keys, **drawing.run_inputs, **self._inputs, FRAME_INDEX.name: self._frame}
        parameters = content.values(settings)
        if "audio" in inputs and (audio := self.subject.audio(self._frame, parameters)) is not None:
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

    def _send(self, *, exact: bool) -> None:
        if not self._results:
            return
        self._is_rough = not exact
        settings, pictures = self._settings, {}
        if settings.compare == "difference" and self._difference is not None:
            pictures["difference"] = encode(self._difference.picture(settings.gain), exact)
        elif settings.compare == "flip" and self._flip is not None:
            pictures["flip"] = encode(self._flip[0], exact)
        else:
            slots = {"other": "b", "both": "ab"}.get(settings.compare, "a") if "b" in self._results else "a"
            pictures = {slot: encode(self._results[slot]["shown"], exact) for slot in slots}
        with self._changed:
            self._requested_pictures = 0
        self._number += 1
        self.publish(Published(self._number, self._facts(), pictures))

    def _facts(self) -> dict[str, Any]:
        """Return the state for the page."""
        program_set = self._program_set
        content = self._content or (None if program_set is None else program_set.content)
        compiled = None if program_set is None else program_set.programs["a"]
        facts: dict[str, Any] = {
            "name": self.subject.name,
            "error": self._error,
            "times": self._times,
            "frames": self.subject.frame_count(),
            "frame": self._frame,
            "backends": self._names,
            "command": "" if content is None else self.subject.command(dict(self._settings.values)),
        }
        if content is not None:
            facts["controls"] = [_control_facts(control) for control in content.loaded.controls]
            facts["light"] = content.loaded.is_light
        if compiled is not None:
            facts["targets"] = [
                {"name": name, "format": "" if target.spec.format is None else target.spec.format.name}
                for name, target in compiled.targets.items()
            ]
            facts["target"] = compiled.target_name
            facts["backend"] = compiled.program.backend.name
            facts["camera"] = "camera" in compiled.values
            facts["keyboard"] = "keyboard" in compiled.program.inputs
            facts["moves"] = compiled.program.has_frame_index or compiled.program.has_history
            facts["moves"] |= "audio" in compiled.program.inputs
            if "a" in self._results:
                height, width = self._results["a"]["shown"].shape[:2]
                facts["size"] = [width, height]
            if self._difference is not None:
                facts["differs"] = self._difference.facts()
            if self._flip is not None:
                facts["flip"] = self._flip[1]
        return facts


def _difference(results: Mapping[str, Result]) -> Difference | None:
    if "b" not in results:
        return None
    a, b = (results[slot]["values"].shape[1::-1] for slot in "ab")
    if a != b:
        raise InputError(f"the picture to compare with: is {b[0]}x{b[1]}, and the target is {a[0]}x{a[1]}; resize it")
    return Difference.of(results["a"], results["b"])


def _control_facts(control: Control) -> dict[str, Any]:
    """Return a control for JSON; infinite ends of its range become None."""
    ends = {name: getattr(control, name) for name in ("low", "high")}
    return asdict(control) | {name: e if e is not None and isfinite(e) else None for name, e in ends.items()}


def _defaults(loaded: Loaded) -> dict[str, Any]:
    return {control.name: control.default for control in loaded.controls if control.default is not None}


def _json_number(number: float) -> Any:
    """Return a number for JSON; NaN and infinity become text."""
    return number if isinstance(number, int) or isfinite(number) else str(number)
