"""The thread that computes: it takes what the page last asked for, runs programs, and hands out the newest picture."""

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

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.registry import backend_names, open_backend
from passgraph.errors import InputError, PassgraphError
from passgraph.pictures import load_stored, scaled
from passgraph.plan.dependencies import inputs_behind
from passgraph.run.caller_arrays import format_of
from passgraph.scene.camera import aim_of
from passgraph.viewer.compiled import Compiled, Difference, flip_map, values_of
from passgraph.viewer.debugger import Debugger, View
from passgraph.viewer.display import Look, encode, histogram_of, range_of
from passgraph.viewer.recording import record
from passgraph.viewer.subject import Control, Drawing, Loaded, Subject, run_values_of

#: Seconds between looks at the files of a subject, and after the last change until a still is sent exactly.
POLL_S, SETTLED_S = 0.05, 0.25
#: What a picture file is compared as, among the names of backends, and the input that it is given as.
REFERENCE_FILE, REFERENCE_INPUT = "file", "reference picture"


@dataclass(frozen=True)
class Asked:
    """What the page asks for.

    Attributes
    ----------
    values : of controls that were moved, by name
    target : the name of the target that is shown; empty for the first output
    look : how
    backend, other : the backends; ``other`` is compared with the first, `REFERENCE_FILE` for a picture, or empty
    compare : "", "other", "both", "difference" or "flip"
    gain : of differences
    playing : whether frame follows frame
    frame : counted from 0: of an input of several, else the time of what moves
    steps, restarts : how often the page asked for one frame more, and for the first one
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
    """One state as clients get it: what it says as JSON, and pictures by slot ("a", "b", "difference", "flip")."""

    number: int
    facts: Mapping[str, Any]
    pictures: Mapping[str, tuple[bytes, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Read:
    """What the subject's files held when they were last read without an error.

    Attributes
    ----------
    loaded : the content
    handles : run values of its numeric parameters by name
    """

    loaded: Loaded
    handles: Mapping[str, pg.Value] = field(default_factory=dict)

    def values(self, asked: Asked) -> dict[str, Any]:
        """Return the value of each parameter: as it was moved, else its default."""
        known = {control.name for control in self.loaded.controls}
        moved = {name: value for name, value in asked.values.items() if name in known and value is not None}
        return _defaults(self.loaded) | moved


@dataclass(frozen=True)
class Made:
    """Programs by slot, what they were made from, and a key of all that they depend on besides run values."""

    read: Read
    key: object
    programs: Mapping[str, Compiled]

    def close(self) -> None:
        for compiled in self.programs.values():
            compiled.close()


class Session:
    """One subject on screen.

    `ask` may be called in any thread; `publish` is called in the session's own thread, each time there is more to see.
    """

    def __init__(self, subject: Subject, backend: str, publish: Callable[[Published], None]) -> None:
        self.subject, self.publish = subject, publish
        self._asked = Asked(backend=backend)
        self._changed = threading.Condition()
        self._dirty, self._closed = True, False
        self._wanted = 0  # pictures that clients wait for
        self._thread = threading.Thread(target=self._run, name="passgraph_view", daemon=True)
        self._stamp: tuple[int, ...] = ()
        #: None until the files are read, and once they have changed; `_made` stays until something new is made.
        self._read: Read | None = None
        self._made: Made | None = None
        #: Open backends by name: programs that follow one another share theirs, and history.
        self._backends: dict[str, Backend] = {}
        self._debugger = Debugger()
        self._reference: NDArray[Any] | None = None
        self._error = ""
        self._number, self._clock, self._frame = 0, (0, 0), 0
        self._names = [name for name in backend_names() if name != "null"]  # which computes nothing
        #: By slot ("a", "b") what ran last, when it had, how long that took, and the difference of both.
        self._results: dict[str, pg.Result] = {}
        self._ran_at, self._is_rough = 0.0, False
        self._times: dict[str, float] = {}
        self._difference: Difference | None = None
        self._flip: tuple[NDArray[np.uint8], float] | None = None
        #: Held while programs are made and run, and while what they are made from is replaced.
        self._using = threading.Lock()
        self._inputs: dict[str, Any] = {}
        self._has_other_input, self._reads_input = False, True

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """End the thread and close the programs."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        if self._thread.ident is not None:
            self._thread.join(10.0)
        with self._using:
            if self._made is not None:
                self._made.close()
            self._made = None
            for backend in self._backends.values():
                backend.close()
        self._debugger.close()

    # For the server

    def ask(self, **changes: Any) -> None:
        """Show something else: fields of `Asked`."""
        with self._changed:
            self._asked = replace(self._asked, **changes)
            self._dirty = True
            self._changed.notify()

    def ready(self) -> None:
        """A client has shown the last picture, and takes another one."""
        with self._changed:
            self._wanted += 1
            self._changed.notify()

    def replace_input(self, path: Path) -> None:
        """Another picture in the place of the first input."""
        # Between runs: one that is under way has read the earlier input, and would count the new one as read.
        with self._using:
            self.subject.replace_input(path)
            self._has_other_input = True
        self.ask()

    def values_at(self, x: int, y: int) -> dict[str, list[float]]:
        """The texel of the target that is shown, on each backend."""
        found: dict[str, list[float]] = {}
        for slot, result in self._results.items():
            picture = result["values"]
            if 0 <= y < picture.shape[0] and 0 <= x < picture.shape[1]:
                found[slot] = [_json_number(number) for number in picture[y, x].tolist()]
        return found

    def statistics(self) -> dict[str, Any]:
        """The range of the target that is shown, how much of it is not finite, and a histogram."""
        if "a" not in self._results:
            return {}
        values = scaled(self._results["a"]["values"])
        low, high = range_of(values)
        return {
            "low": low, "high": high, "nan": int(np.isnan(values).any(axis=2).sum()),
            "infinite": int(np.isinf(values).any(axis=2).sum()), "histogram": histogram_of(values, low, high),
        }  # fmt: skip

    def compare_with(self, path: Path) -> None:
        """A picture file to compare with, as it is stored."""
        self._compare(load_stored(path))

    def keep(self, picture: NDArray[Any]) -> dict[str, Any]:
        """Compare what follows with values that were shown."""
        self._compare(picture.copy())
        return {}

    def _compare(self, picture: NDArray[Any]) -> None:
        with self._using:
            self._reference = picture
            self._has_other_input = True
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
        record(self.view(), self._frame_inputs, first, last, rate, path)

    def _frame_inputs(self, number: int) -> dict[str, Any]:
        count = self.subject.frame_count()
        with self._using:
            return dict(self.subject.frame(0 if count is None else number % count))

    def view(self) -> View:
        """What is on screen now.

        Raises
        ------
        InputError
            Where nothing is yet.
        """
        with self._using:
            made = self._made
            if made is None:
                raise InputError("there is no picture yet")
            compiled, asked = made.programs["a"], self._asked
            drawing = compiled.drawing
            backends = [asked.backend]
            if "b" in made.programs and asked.other != REFERENCE_FILE:
                backends.append(asked.other)
            inputs = inputs_behind([*drawing.outputs.values()])
            given = self._given(made.read, drawing, inputs, values_of(drawing.outputs.values()), asked)
            return View(drawing, compiled.target, backends, given)

    def picture(self, output: Literal["values", "shown"]) -> NDArray[Any]:
        """The values of the target that is shown, or the picture as it is shown, (height, width, channels)."""
        if "a" not in self._results:
            raise InputError("there is no picture yet")
        picture: NDArray[Any] = self._results["a"][output]
        return picture

    # The thread

    def _run(self) -> None:
        while True:
            with self._changed:
                if not (self._dirty or self._closed or (self._asked.playing and self._wanted)):
                    self._changed.wait(POLL_S)
                if self._closed:
                    return
                asked, dirty = self._asked, self._dirty
                playing = asked.playing and self._wanted > 0
                self._dirty = False
            if self._files_changed():
                self._read, dirty = None, True
            if dirty or playing:
                self._show(asked, advance=playing and not dirty)
            elif self._is_rough and perf_counter() - self._ran_at > SETTLED_S:
                self._send(exact=True)

    def _files_changed(self) -> bool:
        stamp: list[int] = []
        for path in self.subject.files:
            with suppress(OSError):
                found = path.stat()
                if not found.st_size:
                    return False  # an editor has emptied it and is about to write
                stamp += [found.st_mtime_ns, found.st_size]
        changed, self._stamp = tuple(stamp) != self._stamp, tuple(stamp)
        return changed

    def _show(self, asked: Asked, *, advance: bool) -> None:
        try:
            with self._using:
                start = perf_counter()
                made = self._compile(asked)
                compiled = perf_counter()
                results = self._run_programs(made, asked, advance)
                ran = perf_counter()
            self._results, self._ran_at, self._error = results, ran, ""
            self._difference = _difference(results)
            self._flip = flip_map(results) if asked.compare == "flip" and "b" in results else None
            self._times = {"compile_ms": 1e3 * (compiled - start), "run_ms": 1e3 * (ran - compiled)}
            self._send(exact=False)
        except Exception as error:  # whatever a user's file does is shown on the page, and the last picture stays
            self._error = str(error) if isinstance(error, PassgraphError) else f"{type(error).__name__}: {error}"
            with self._changed:
                self._wanted = 0  # else what plays would fail again at once
            self._number += 1
            self.publish(Published(self._number, self._facts()))

    def _compile(self, asked: Asked) -> Made:
        """Programs for what is asked, made anew where more changed than what a run brings."""
        if self._read is None:
            loaded = self.subject.load()
            self._read = Read(loaded, run_values_of(loaded, Read(loaded).values(asked)))
        read = self._read
        fixed = {name: value for name, value in read.values(asked).items() if name not in read.handles}
        others = [asked.other] if asked.other and asked.compare else []
        key = (repr(sorted(fixed.items())), asked.target, asked.backend, *others)
        made = self._made
        if made is not None and made.read is read and made.key == key and not self._has_other_input:
            return made
        drawing = read.loaded.draw({**fixed, **read.handles})
        programs: dict[str, Compiled] = {}
        try:
            programs["a"] = Compiled(drawing, asked.target, self._backend(asked.backend))
            for other in others:
                programs["b"] = self._compared(drawing, programs["a"].target, asked, other)
        except BaseException:
            Made(read, key, programs).close()
            raise
        for slot, earlier in ({} if made is None else made.programs).items():
            if slot in programs:
                programs[slot].follow(earlier)
            else:
                earlier.close()
        self._made, self._has_other_input, self._reads_input = Made(read, key, programs), False, True
        return self._made

    def _backend(self, name: str) -> Backend:
        if name not in self._backends:
            self._backends[name] = open_backend(name or None)
        return self._backends[name]

    def _compared(self, drawing: Drawing, target: pg.Target, asked: Asked, other: str) -> Compiled:
        """The drawing on another backend, or a picture that is shown as the target is."""
        if other != REFERENCE_FILE:
            return Compiled(drawing, asked.target, self._backend(other))
        if self._reference is None:
            raise InputError("choose a picture to compare with")
        height, width, channels = self._reference.shape
        picture = pg.Input(REFERENCE_INPUT, format_of(self._reference.dtype, channels), (width, height))
        alone = Drawing({target.name: picture}, (width, height), {REFERENCE_INPUT: self._reference})
        return Compiled(alone, "", self._backend(asked.backend))

    def _run_programs(self, made: Made, asked: Asked, advance: bool) -> dict[str, pg.Result]:
        count = self.subject.frame_count()
        clock = (asked.steps, asked.restarts)
        is_restart = clock[1] != self._clock[1]
        frame = max(0, asked.frame)
        if is_restart or advance or clock[0] != self._clock[0]:
            frame = 0 if is_restart else frame + 1
            frame = frame if count is None else frame % count
            with self._changed:
                self._asked = replace(self._asked, frame=frame)
        if is_restart:
            for compiled in made.programs.values():
                compiled.restart()
        if self._reads_input or frame != self._frame:
            self._inputs = dict(self.subject.frame(0 if count is None else frame))
        self._clock, self._frame, self._reads_input = clock, frame, False
        return {
            slot: one.run(self._given(made.read, one.drawing, one.program.inputs, one.values, asked))
            for slot, one in made.programs.items()
        }

    def _given(
        self, read: Read, drawing: Drawing, inputs: Collection[str], taken: Mapping[str, pg.Value], asked: Asked
    ) -> dict[str, Any]:
        """What a run is given that takes these: pictures, values of controls, time, the camera as it was turned."""
        given = {**drawing.given, **self._inputs, pg.FRAME_INDEX.name: self._frame}
        known = read.values(asked)
        moved = {name: known[name] for name in read.handles if name in known}
        given = {n: v for n, v in given.items() if n in inputs or n in taken}
        given |= {name: value for name, value in moved.items() if name in taken}
        given |= {name: value for name, value in asked.look.values().items() if name in taken}
        camera = given.get("camera", getattr(taken.get("camera"), "default", None))
        if isinstance(camera, pg.Camera):
            given["camera"] = orbited(camera, *asked.orbit)
        return given

    def _send(self, *, exact: bool) -> None:
        if not self._results:
            return
        self._is_rough = not exact
        asked, pictures = self._asked, {}
        if asked.compare == "difference" and self._difference is not None:
            pictures["difference"] = encode(self._difference.picture(asked.gain), exact)
        elif asked.compare == "flip" and self._flip is not None:
            pictures["flip"] = encode(self._flip[0], exact)
        else:
            slots = {"other": "b", "both": "ab"}.get(asked.compare, "a") if "b" in self._results else "a"
            pictures = {slot: encode(self._results[slot]["shown"], exact) for slot in slots}
        with self._changed:
            self._wanted = 0
        self._number += 1
        self.publish(Published(self._number, self._facts(), pictures))

    def _facts(self) -> dict[str, Any]:
        """The state as the page shows it."""
        made = self._made
        read = self._read or (None if made is None else made.read)
        compiled = None if made is None else made.programs["a"]
        facts: dict[str, Any] = {
            "name": self.subject.name, "error": self._error, "times": self._times,
            "frames": self.subject.frame_count(), "frame": self._frame, "backends": self._names,
            "command": "" if read is None else self.subject.command(dict(self._asked.values)),
        }  # fmt: skip
        if read is not None:
            facts["controls"] = [_control_facts(control) for control in read.loaded.controls]
            facts["light"] = read.loaded.is_light
        if compiled is not None:
            facts["targets"] = [
                {"name": name, "format": "" if target.spec.format is None else target.spec.format.name}
                for name, target in compiled.targets.items()
            ]
            facts["target"] = compiled.target_name
            facts["backend"] = compiled.program.backend.name
            facts["camera"] = "camera" in compiled.values
            facts["moves"] = compiled.program.has_frame_index or compiled.program.has_history
            if "a" in self._results:
                height, width = self._results["a"]["shown"].shape[:2]
                facts["size"] = [width, height]
            if self._difference is not None:
                facts["differs"] = self._difference.facts()
            if self._flip is not None:
                facts["flip"] = self._flip[1]
        return facts


def _difference(results: Mapping[str, pg.Result]) -> Difference | None:
    if "b" not in results:
        return None
    a, b = (results[slot]["values"].shape[1::-1] for slot in "ab")
    if a != b:
        raise InputError(f"the picture to compare with: is {b[0]}x{b[1]}, and the target is {a[0]}x{a[1]}; resize it")
    return Difference.of(results["a"], results["b"])


def _control_facts(control: Control) -> dict[str, Any]:
    """A control as JSON holds it; infinite ends are open."""
    ends = {end: getattr(control, end) for end in ("low", "high")}
    return asdict(control) | {end: at if at is not None and isfinite(at) else None for end, at in ends.items()}


def _defaults(loaded: Loaded) -> dict[str, Any]:
    return {control.name: control.default for control in loaded.controls if control.default is not None}


def _json_number(number: float) -> Any:
    """JSON has no NaN and no infinity."""
    return number if isinstance(number, int) or isfinite(number) else str(number)


def orbited(camera: pg.Camera, right: float, up: float, distance: float) -> pg.Camera:
    """The camera carried round its target by angles in radians, at a multiple of its distance."""
    if (right, up, distance) == (0.0, 0.0, 1.0):
        return camera
    away = np.subtract(camera.eye, camera.target)
    length = float(np.linalg.norm(away))
    azimuth = float(np.arctan2(away[0], away[2])) + right
    elevation = float(np.clip(np.arcsin(np.clip(away[1] / length, -1, 1)) + up, -1.5, 1.5))
    factor = float(np.clip(distance, 0.05, 20.0))
    eye = np.asarray(camera.target) + np.array(aim_of(azimuth, elevation).back) * length * factor
    far = camera.far if not isfinite(camera.far) else camera.far * max(1.0, factor)
    return replace(camera, eye=tuple(eye.tolist()), far=far, near=camera.near * min(1.0, factor))
