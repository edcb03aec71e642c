"""The thread that computes: it takes what the page last asked for, runs programs, and hands out the newest picture."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from math import isfinite
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.errors import InputError, PassgraphError
from passgraph.graph.run_values import sources_of
from passgraph.pictures import scaled
from passgraph.plan.dependencies import passes_behind
from passgraph.scene.camera import aim_of
from passgraph.viewer.display import Look, encode, histogram_of, range_of, shown
from passgraph.viewer.subject import Control, Drawing, Loaded, Subject, run_values_of

#: Seconds between looks at the files of a subject, and after the last change until a still is sent exactly.
POLL_S, SETTLED_S = 0.05, 0.25
#: Largest factor that differences are shown with.
MOST_GAIN = 4096.0


@dataclass(frozen=True)
class Asked:
    """What the page asks for.

    Attributes
    ----------
    values : of controls that were moved, by name
    target : the name of the target that is shown; empty for the first output
    look : how
    backend, other : the backends; ``other`` is compared with the first, or empty
    compare : "", "other", "both" or "difference"
    gain : of differences
    playing : whether frame follows frame
    frame : of an input of several, counted from 0
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
    """One state as clients get it: what it says as JSON, and pictures by slot ("a", "b", "difference")."""

    number: int
    facts: Mapping[str, Any]
    pictures: Mapping[str, tuple[bytes, str]] = field(default_factory=dict)


class _Compiled:
    """A drawing on one backend, with the pass that shows one of its targets."""

    def __init__(self, drawing: Drawing, target: str, backend: str) -> None:
        self.targets = targets_of(drawing)
        self.target = self.targets.get(target) or next(iter(drawing.outputs.values()))
        outputs = {"shown": shown(self.target), "values": self.target}
        self.program = pg.compile(outputs, backend or None, drawing.size, non_finite="keep", results="stored")
        #: Run values by name; unlike the program's plan they are there before the first run.
        self.values = values_of(outputs)

    def run(self, given: Mapping[str, Any]) -> pg.Result:
        return self.program(**given)

    def close(self) -> None:
        self.program.close()


def targets_of(drawing: Drawing) -> dict[str, pg.Target]:
    """Every target that a pass behind the outputs writes, by name, in the order of the passes.

    A target that is drawn over has several contents: from the second on, a number stands behind its name.
    """
    found: dict[str, pg.Target] = {}
    for node in passes_behind(list(drawing.outputs.values())):
        for slot, spec in enumerate(node.into):
            name, number = spec.name, 1
            while name in found:
                number += 1
                name = f"{spec.name} ({number})"
            found[name] = pg.Target(spec, node, slot)
    return found


def values_of(outputs: Mapping[str, pg.Target]) -> dict[str, pg.Value]:
    """The run values of a graph by name."""
    return {source.name: source for node in passes_behind([*outputs.values()]) for source in sources_of(node.values)}


@dataclass(frozen=True)
class Difference:
    """How far two results of one target are apart.

    Attributes
    ----------
    apart : of each pixel the largest difference of a channel, (height, width); 0 where one of both is not a number
    one_is_nan : pixels where one result is NaN and the other is not
    """

    apart: NDArray[np.float64]
    one_is_nan: NDArray[np.bool_]

    @classmethod
    def of(cls, a: pg.Result, b: pg.Result) -> Difference:
        one, other = (scaled(result["values"]).astype(np.float64) for result in (a, b))
        with np.errstate(invalid="ignore"):
            apart = np.nan_to_num(np.abs(one - other)).max(axis=2)
        return cls(apart, np.isnan(one).any(axis=2) != np.isnan(other).any(axis=2))

    def picture(self, gain: float) -> NDArray[np.uint8]:
        """Differences times gain, black to white; magenta where one result alone is NaN."""
        level = np.clip(self.apart * min(gain, MOST_GAIN) * 255.0, 0, 255).astype(np.uint8)
        made = np.dstack([level, level, level, np.full_like(level, 255)])
        made[self.one_is_nan] = (255, 0, 255, 255)
        return made

    def facts(self) -> dict[str, Any]:
        """The largest difference, where it is, and how many pixels differ."""
        y, x = np.unravel_index(int(self.apart.argmax()), self.apart.shape)
        return {
            "largest": float(self.apart[y, x]), "at": [int(x), int(y)],
            "pixels": int(((self.apart > 0) | self.one_is_nan).sum()),
        }  # fmt: skip


class Session:
    """One subject on screen.

    `ask` may be called in any thread; `publish` is called in the session's own thread, each time there is more to see.
    """

    def __init__(self, subject: Subject, backend: str, publish: Callable[[Published], None]) -> None:
        self.subject, self.publish = subject, publish
        self._asked = Asked(backend=backend)
        self._changed = threading.Condition()
        self._dirty, self._closed, self._reads_input = True, False, True
        self._wanted = 0  # pictures that clients wait for
        self._thread = threading.Thread(target=self._run, name="passgraph_view", daemon=True)
        self._stamp: tuple[int, ...] = ()
        self._loaded: Loaded | None = None
        self._drawing: Drawing | None = None
        self._programs: dict[str, _Compiled] = {}
        self._key: object = None
        self._handles: dict[str, pg.Value] = {}
        self._error = ""
        self._number, self._clock, self._frame = 0, (0, 0), -1
        #: By slot ("a", "b") what ran last, when it had, how long that took, and the difference of both.
        self._results: dict[str, pg.Result] = {}
        self._ran_at, self._is_rough = 0.0, False
        self._times: dict[str, float] = {}
        self._difference: Difference | None = None
        self._using = threading.Lock()
        self._inputs: dict[str, Any] = {}

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
            self._drop()

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
        self.subject.replace_input(path)
        with self._changed:
            self._dirty, self._reads_input, self._key = True, True, None
            self._changed.notify()

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

    def inspect(self, x: int, y: int) -> dict[str, Any]:
        """Every line of the kernel of the target that is shown at a pixel, and the first line where backends differ."""
        with self._using:
            drawing, compiled = self._drawing, self._programs.get("a")
            if drawing is None or compiled is None:
                return {"text": "there is no picture yet"}
            made_by = compiled.target.made_by
            if made_by is None:
                return {"text": "an input: no kernel computes it"}
            with pg.compile(drawing.outputs, "reference", drawing.size, non_finite="keep") as program:
                given = self._given(program.inputs, values_of(drawing.outputs), self._asked)
                found = program.inspect(x, y, made_by.name, **given)
            return {"text": str(found)}

    def profile(self) -> dict[str, Any]:
        """The plan in words and as a drawing, and the time of each pass."""
        with self._using:
            drawing = self._drawing
            if drawing is None:
                return {"text": "there is no picture yet"}
            with pg.compile(drawing.outputs, self._asked.backend or None, drawing.size, non_finite="keep") as program:
                given = self._given(program.inputs, values_of(drawing.outputs), self._asked)
                times = program.profile(5, **given)
                plan = program.plan
            return {"text": f"{plan.explain()}\n\n{times}", "svg": plan.svg()}

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
                self._loaded, dirty = None, True
            if dirty or playing:
                self._show(asked, advance=playing and not dirty)
            elif self._is_rough and perf_counter() - self._ran_at > SETTLED_S:
                self._send(exact=True)

    def _files_changed(self) -> bool:
        stamp: list[int] = []
        for path in self.subject.files:
            with suppress(OSError):
                found = path.stat()
                stamp += [found.st_mtime_ns, found.st_size]
        changed, self._stamp = tuple(stamp) != self._stamp, tuple(stamp)
        return changed

    def _show(self, asked: Asked, *, advance: bool) -> None:
        try:
            with self._using:
                start = perf_counter()
                self._compile(asked)
                compiled = perf_counter()
                results = self._run_programs(asked, advance)
                ran = perf_counter()
            self._results, self._ran_at, self._error = results, ran, ""
            self._difference = Difference.of(results["a"], results["b"]) if "b" in results else None
            self._times = {"compile_ms": 1e3 * (compiled - start), "run_ms": 1e3 * (ran - compiled)}
            self._send(exact=False)
        except Exception as error:  # whatever a user's file does is shown on the page, and the last picture stays
            self._error = str(error) if isinstance(error, PassgraphError) else f"{type(error).__name__}: {error}"
            self._number += 1
            self.publish(Published(self._number, self._facts()))

    def _compile(self, asked: Asked) -> None:
        """Programs for what is asked, made anew where more changed than what a run brings."""
        if self._loaded is None:
            loaded = self.subject.load()
            names = {control.name for control in loaded.controls}
            kept = {name: value for name, value in asked.values.items() if name in names}
            self._handles = run_values_of(loaded, _defaults(loaded) | kept)
            self._loaded, self._key = loaded, None
        values = _defaults(self._loaded) | {n: v for n, v in asked.values.items() if v is not None}
        known = {control.name for control in self._loaded.controls}
        fixed = {n: v for n, v in values.items() if n in known and n not in self._handles}
        others = [asked.other] if asked.other and asked.compare else []
        key = (repr(sorted(fixed.items())), asked.target, asked.backend, *others)
        if key == self._key:
            return
        drawing = self._loaded.draw({**fixed, **self._handles})
        made: dict[str, _Compiled] = {}
        try:
            for slot, backend in zip("ab", [asked.backend, *others], strict=False):
                made[slot] = _Compiled(drawing, asked.target, backend)
        except BaseException:
            for compiled in made.values():
                compiled.close()
            raise
        self._drop()
        self._drawing, self._programs, self._key, self._reads_input = drawing, made, key, True

    def _run_programs(self, asked: Asked, advance: bool) -> dict[str, pg.Result]:
        count = self.subject.frame_count()
        clock = (asked.steps, asked.restarts)
        is_restart = clock[1] != self._clock[1]
        step = advance or clock[0] != self._clock[0]
        if is_restart:
            for compiled in self._programs.values():
                compiled.program.reset()
        if count is not None:
            frame = asked.frame
            if step or is_restart:
                frame = 0 if is_restart else (frame + 1) % count
                with self._changed:
                    self._asked = replace(self._asked, frame=frame)
            if self._reads_input or step or is_restart or frame != self._frame:
                self._inputs = dict(self.subject.frame(frame))
                self._frame, self._reads_input = frame, False
        self._clock = clock
        return {
            slot: one.run(self._given(one.program.inputs, one.values, asked)) for slot, one in self._programs.items()
        }

    def _given(self, inputs: Collection[str], taken: Mapping[str, pg.Value], asked: Asked) -> dict[str, Any]:
        """What a run is given that takes these: pictures, values of controls, the camera as the page has turned it."""
        drawing = self._drawing
        assert drawing is not None
        given = {**drawing.given, **self._inputs}
        assert self._loaded is not None
        known = _defaults(self._loaded) | {n: v for n, v in asked.values.items() if v is not None}
        moved = {name: float(known[name]) for name in self._handles if name in known}
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
        else:
            slots = {"other": "b", "both": "ab"}.get(asked.compare, "a") if "b" in self._results else "a"
            pictures = {slot: encode(self._results[slot]["shown"], exact) for slot in slots}
        with self._changed:
            self._wanted = 0
        self._number += 1
        self.publish(Published(self._number, self._facts(), pictures))

    def _facts(self) -> dict[str, Any]:
        """The state as the page shows it."""
        loaded, compiled = self._loaded, self._programs.get("a")
        facts: dict[str, Any] = {
            "name": self.subject.name, "error": self._error, "times": self._times,
            "frames": self.subject.frame_count(), "frame": max(self._frame, 0),
            "command": "" if loaded is None else self.subject.command(dict(self._asked.values)),
        }  # fmt: skip
        if loaded is not None:
            facts["controls"] = [_control_facts(control) for control in loaded.controls]
        if compiled is not None:
            facts["targets"] = [
                {"name": name, "format": "" if target.spec.format is None else target.spec.format.name}
                for name, target in compiled.targets.items()
            ]
            facts["target"] = compiled.target.name
            facts["backend"] = compiled.program.backend.name
            facts["camera"] = "camera" in compiled.values
            if "a" in self._results:
                height, width = self._results["a"]["shown"].shape[:2]
                facts["size"] = [width, height]
            if self._difference is not None:
                facts["differs"] = self._difference.facts()
        return facts

    def _drop(self) -> None:
        for compiled in self._programs.values():
            compiled.close()
        self._programs = {}


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
