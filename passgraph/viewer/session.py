"""The computing thread of the live view: apply the page's latest settings, run programs, publish pictures."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from fractions import Fraction
from math import isfinite
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

from numpy.typing import NDArray

from passgraph.backends.registry import backend_names
from passgraph.errors import InputError, PassgraphError
from passgraph.pictures import load_stored
from passgraph.plan.dependencies import inputs_behind
from passgraph.run.result import Result
from passgraph.viewer.compiled import Compiled, values_of
from passgraph.viewer.debugger import Debugger, View
from passgraph.viewer.programs import REFERENCE_FILE, ProgramSet, SubjectPrograms
from passgraph.viewer.recording import record
from passgraph.viewer.requests import Requests, Settings
from passgraph.viewer.shown import Shown
from passgraph.viewer.shown_frame import ShownFrame
from passgraph.viewer.subject import Control, Subject

#: Seconds between checks of the subject's files, and from the last change until a picture is sent losslessly.
POLL_S, SETTLED_S = 0.05, 0.25


@dataclass(frozen=True)
class Published:
    """A state as sent to clients: facts as JSON, and pictures by slot ("a", "b", "difference", "flip")."""

    number: int
    facts: Mapping[str, Any]
    pictures: Mapping[str, tuple[bytes, str]] = field(default_factory=dict)


class Session:
    """A subject on screen.

    `requests` take changes in any thread; `publish` is called in the session's own thread for each new state.

    Attributes
    ----------
    requests : settings and keys of the page
    shown : the latest results
    programs : that compute them
    """

    def __init__(self, subject: Subject, backend: str, publish: Callable[[Published], None]) -> None:
        self.subject, self.publish = subject, publish
        self.requests, self.shown, self.programs = (
            Requests(Settings(backend=backend)),
            Shown(),
            SubjectPrograms(subject),
        )
        self._frame = ShownFrame(subject, self.requests.keyboard.picture())
        self._thread = threading.Thread(target=self._run, name="passgraph_view", daemon=True)
        self._debugger = Debugger()
        self._stamp: tuple[int, ...] = ()  # of the subject's files
        #: Held while programs are compiled and run, and while their inputs are replaced.
        self._lock = threading.Lock()
        self._input_changed = False
        self._number, self._error, self._is_rough = 0, "", False  # of the state published last

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """End the thread and close the programs."""
        self.requests.close()
        if self._thread.ident is not None:
            self._thread.join(10.0)
        with self._lock:
            self.programs.close()
        self._debugger.close()

    # For the server

    def replace_input(self, path: Path) -> None:
        """Replace the first input by another picture."""
        # Not during a run, which has read the earlier input and would mark the new one as read.
        with self._lock:
            self.subject.replace_input(path)
            self._input_changed = True
        self.requests.ask()

    def compare_with(self, path: Path) -> None:
        """Compare with a picture file, without converting its values."""
        self._compare(load_stored(path))

    def keep(self, picture: NDArray[Any]) -> dict[str, Any]:
        """Compare the following pictures with this one."""
        self._compare(picture.copy())
        return {}

    def _compare(self, picture: NDArray[Any]) -> None:
        with self._lock:
            self.programs.reference = picture
            self._input_changed = True
        self.requests.ask()

    def picture(self, output: Literal["values", "shown"]) -> NDArray[Any]:
        """See `Shown.picture`."""
        return self.shown.picture(output)

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
        record(self.view(), self._frame_inputs, first, last, rate, path, lambda: self.requests.closed)

    def _frame_inputs(self, number: int) -> dict[str, Any]:
        program_set = self.programs.current
        with self._lock:
            values = {} if program_set is None else program_set.content.values(self.requests.settings)
            return self._frame.recorded(number, values)

    def view(self) -> View:
        """Return the view that is on screen.

        Raises
        ------
        InputError
            If no picture has been computed yet.
        """
        with self._lock:
            program_set = self.programs.current
            if program_set is None:
                raise InputError("there is no picture yet")
            compiled, settings = program_set.programs["a"], self.requests.settings
            drawing = compiled.drawing
            backends = [settings.backend]
            if "b" in program_set.programs and settings.other != REFERENCE_FILE:
                backends.append(settings.other)
            inputs, values = inputs_behind([*drawing.outputs.values()]), values_of(drawing.outputs.values())
            run_inputs = self._frame.run_inputs(program_set.content, drawing, inputs, values, settings)
            return View(drawing, compiled.target, backends, run_inputs)

    # The thread

    def _run(self) -> None:
        while True:
            settings, changed, playing = self.requests.wait(POLL_S)
            if self.requests.closed:
                return
            if self._files_changed():
                self.programs.reload()
                changed = True
            if changed or playing:
                self._show(settings, advance=playing and not changed)
            elif self._is_rough and perf_counter() - self.shown.ran_at > SETTLED_S:
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
                before = self.programs.current
                program_set = self.programs.compiled(settings, again=self._input_changed)
                self._input_changed = False
                if program_set is not before:
                    self._frame.read_again()
                compiled = perf_counter()
                results = self._run_programs(program_set, settings, advance)
                ran = perf_counter()
            times = {"compile_ms": 1e3 * (compiled - start), "run_ms": 1e3 * (ran - compiled)}
            self.shown, self._error = Shown.of(results, settings, times, ran), ""
            self._send(exact=False)
        except Exception as error:  # any error of a user's file is shown on the page, with the last picture
            self._error = str(error) if isinstance(error, PassgraphError) else f"{type(error).__name__}: {error}"
            self.requests.answered()  # so that a playing view does not fail again at once
            self._publish({})

    def _run_programs(self, program_set: ProgramSet, settings: Settings, advance: bool) -> dict[str, Result]:
        number, is_restart = self._frame.next(settings, advance=advance)
        if number != settings.frame:
            self.requests.show_frame(number)
        if is_restart:
            for compiled in program_set.programs.values():
                compiled.restart()
        self._frame.show(number, self.requests.end_frame())
        results = {}
        for slot, compiled in program_set.programs.items():
            inputs = compiled.program.inputs
            results[slot] = compiled.run(
                self._frame.run_inputs(program_set.content, compiled.drawing, inputs, compiled.values, settings)
            )
        self._frame.end(settings)
        return results

    def _send(self, *, exact: bool) -> None:
        if not self.shown.results:
            return
        self._is_rough = not exact
        pictures = self.shown.pictures(self.requests.settings, exact)
        self.requests.answered()
        self._publish(pictures)

    def _publish(self, pictures: Mapping[str, tuple[bytes, str]]) -> None:
        self._number += 1
        self.publish(Published(self._number, self._facts(), pictures))

    def _facts(self) -> dict[str, Any]:
        """Return the state for the page."""
        program_set, content = self.programs.current, self.programs.content
        facts: dict[str, Any] = {
            "name": self.subject.name,
            "error": self._error,
            "times": self.shown.times,
            "frames": self.subject.frame_count(),
            "frame": self._frame.number,
            "backends": [name for name in backend_names() if name != "null"],  # null computes nothing
            "command": "" if content is None else self.subject.command(dict(self.requests.settings.values)),
        }
        if content is not None:
            facts["controls"] = [_control_facts(control) for control in content.loaded.controls]
            facts["light"] = content.loaded.is_light
        return facts if program_set is None else facts | _program_facts(program_set.programs["a"]) | self.shown.facts()


def _program_facts(compiled: Compiled) -> dict[str, Any]:
    """Return what the page writes of the program that is shown."""
    program = compiled.program
    return {
        "targets": [
            {"name": name, "format": "" if target.spec.format is None else target.spec.format.name}
            for name, target in compiled.targets.items()
        ],
        "target": compiled.target_name,
        "backend": program.backend.name,
        "camera": "camera" in compiled.values,
        "keyboard": "keyboard" in program.inputs,
        "moves": program.has_frame_index or program.has_history or "audio" in program.inputs,
    }


def _control_facts(control: Control) -> dict[str, Any]:
    """Return a control for JSON; infinite ends of its range become None."""
    ends = {name: getattr(control, name) for name in ("low", "high")}
    return asdict(control) | {name: e if e is not None and isfinite(e) else None for name, e in ends.items()}
