"""Common part of the engines' adapters: run an effect on the engine's frame in place.

An adapter calls :meth:`Attachment.draw` from the engine's hook, and supplies the framebuffer and the camera.
"""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import inspect
import logging
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, TypeAlias, cast, get_args, get_type_hints

import numpy as np
from numpy.typing import ArrayLike

import passgraph as pg
from passgraph import arguments
from passgraph.backends.gl.context import OtherContextError
from passgraph.effects.pictures.decoded import as_it_is
from passgraph.effects.surfaces.engine_depth import distances
from passgraph.formats import FORMATS, Format, curved
from passgraph.graph.calls import check_given
from passgraph.graph.run_values import sources_of
from passgraph.hosts.gl import Host, HostFramebuffer, HostPicture, Isolation
from passgraph.hosts.gl_pictures import EmptyPictureError, RegionError
from passgraph.language.native import MATH, Math
from passgraph.plan.dependencies import passes_behind
from passgraph.shaders.containers.effect import ShaderEffect, checked
from passgraph.signatures import signature

LOG = logging.getLogger("passgraph.engines")
#: A function from the target "frame" to a target; see :class:`Attachment`.
Effect: TypeAlias = Callable[..., pg.Target]
#: Parameters of effects that are set from each frame.
_PER_FRAME = ("depth", "camera", "previous_camera")
_HOLDS = "depth_holds"
#: Programs kept for earlier frame sizes and formats, such as several views of a scene.
KEPT_PROGRAMS = 4


def imported(module: str, distribution: str) -> Any:
    """Import an engine's module, which has no types.

    Raises
    ------
    DeviceMissingError
        If it is not installed, with the command that installs it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise pg.DeviceMissingError(
            f"{distribution} is not installed, or misses something ({error}); run: pip install {distribution}"
        ) from error


@dataclass(frozen=True)
class View:
    """The camera of a frame.

    Attributes
    ----------
    camera : the camera for effects
    holds : the encoding of the depth buffer
    """

    camera: pg.Camera
    holds: pg.HardwareDepth

    @classmethod
    def from_camera(cls, source: object, zero_to_one: bool | None = None) -> View:
        """Convert a view, a camera, or an engine's matrices.

        Matrices are (view, projection) or (view, projection, zero_to_one), (4, 4) each with ``M @ v``. ``zero_to_one``
        is True if depth in clip space is from 0 to 1; the argument is its default.

        >>> camera = pg.Camera((0, 0, 5), (0, 0, 0), near=1.0, far=9.0)
        >>> View.from_camera((camera.view_matrix(), camera.projection_matrix(1.5))).holds.near
        1.0
        """
        if isinstance(source, View):
            return source
        if isinstance(source, pg.Camera):
            return cls(source, source.hardware_depth())
        if isinstance(source, tuple) and len(source) in (2, 3):
            view, projection, *depth_range = source
            return cls.of_matrices(view, projection, depth_range[0] if depth_range else zero_to_one)
        raise pg.InputError(
            "camera= takes a pg.Camera, (view, projection) or (view, projection, zero_to_one) with two (4, 4) "
            f"matrices, or a function that returns one of them, got {arguments.shown(source)}"
        )

    @classmethod
    def of_matrices(cls, view: ArrayLike, projection: ArrayLike, zero_to_one: bool | None = None) -> View:
        """See `passgraph.Camera.from_matrices`."""
        return cls(
            pg.Camera.from_matrices(view, projection, zero_to_one),
            pg.HardwareDepth.of_projection(projection, zero_to_one),
        )


class Seen:
    """The view of an engine's matrices, rebuilt when they change."""

    def __init__(self, zero_to_one: bool | None = None) -> None:
        self._zero_to_one = zero_to_one
        self._key: tuple[bytes, bytes] | None = None
        self._view: View | None = None

    def by(self, view: ArrayLike, projection: ArrayLike) -> View:
        """See `View.of_matrices`."""
        key = (np.asarray(view, np.float64).tobytes(), np.asarray(projection, np.float64).tobytes())
        if self._view is None or key != self._key:
            self._view, self._key = View.of_matrices(view, projection, self._zero_to_one), key
        return self._view


@dataclass(frozen=True)
class _Facts:
    """The frame properties that a program is planned for."""

    size: tuple[int, int]
    frame: Format
    depth: Format | None
    #: Identifies the parameters that the effect's graph was built with.
    structure: object = None


class Attachment:
    """An effect in an engine, until :meth:`close`; an adapter's ``attach`` returns it.

    The effect is called with the target ``frame``. If its signature has them, it also gets ``depth`` (distances along
    the view axis in scene units, "r32f", 0 where nothing is drawn), ``camera`` (a run value, `passgraph.Camera`) and
    ``previous_camera`` (that of the last frame). Its result overwrites the frame. Effects declared to take linear light
    (`passgraph.effects.checked.effect`) get 8-bit frames decoded from sRGB.

    ``set``, ``enabled`` and ``close`` are thread-safe, also while a frame is drawn. Frames without pixels, of minimized
    windows, are skipped. Frames smaller than the engine reports are skipped with a warning.

    Programs of the latest frame sizes are kept, so that views of different sizes may alternate; each has its own
    history.

    An effect that fails is disabled, with one line in the log "passgraph.engines". The engine's loop continues, and
    its frame is unchanged.

    Attributes
    ----------
    engine : the engine's name
    effect : the current effect; `replace` sets another one
    error : why the effect was disabled, or None
    """

    def __init__(
        self, engine: str, effect: Effect, values: Mapping[str, object], *,
        frame: Callable[[Host], HostFramebuffer | None] = lambda host: host.framebuffer(srgb=False),
        camera: object = None, engine_camera: Callable[[], View | None] = lambda: None,
        isolation: Isolation = "auto",
    ) -> None:  # fmt: skip
        """
        Parameters
        ----------
        effect, values : the caller's effect, and its parameters or run values of its graph
        frame : returns the framebuffer of a frame, called with the engine's context current; None to skip the frame
        camera : the caller's camera, as for `View.of`, or a function that returns it; None takes the engine's
        engine_camera : returns the engine's camera of the frame
        isolation : how the engine's state is protected, see `passgraph.hosts.gl.Host.current`
        """
        self.engine = engine
        self.error: BaseException | None = None
        self._frame, self._camera, self._engine_camera = frame, camera, engine_camera
        self._enabled, self._closed, self._skipped = True, False, ""
        self._setting, self._running, self._is_drawing = threading.RLock(), threading.RLock(), False
        self._structure = object()
        self._math: Math = "exact"
        self._isolation = isolation
        self._detach: list[Callable[[], object]] = []
        self._host: Any = None
        #: Programs by the properties they are planned for, the most recently used last.
        self._programs: dict[_Facts, pg.Program] = {}
        #: The camera of the last frame, by the size of frames.
        self._cameras: dict[tuple[int, int], pg.Camera] = {}
        self._given: dict[str, object] = {}
        self._take(effect, values)
        if camera is not None and not callable(camera):
            View.from_camera(camera)

    @property
    def effect(self) -> Effect:
        return self._effect

    def replace(self, effect: Effect, **values: object) -> None:
        """Run another effect from the next frame on, with these parameters.

        History continues for targets of the same name, size and format.

        Raises
        ------
        InputError, GraphError, KernelError
            As for `set` and ``attach``; the current effect is kept.
        """
        # No frame is drawn meanwhile; the host and other state of frames are not restored after an error.
        with self._running, self._setting:
            before = {name: getattr(self, name) for name in ("_effect", "_takes", "_handles", "_names", "_given")}
            try:
                self._take(effect, values)
            except BaseException:
                vars(self).update(before)
                raise
            self._structure = object()

    @property
    def math(self) -> Math:
        """Which functions the effect calls: ``"exact"`` ones or the device's own, ``"native"``.

        As in `passgraph.Options`; setting it plans the effect again at the next frame.
        """
        return self._math

    @math.setter
    def math(self, math: Math) -> None:
        with self._setting:
            self._math = cast("Math", arguments.one_of(math, f"{self.engine}: math", MATH, pg.InputError))
            self._structure = object()

    def _take(self, effect: Effect, values: Mapping[str, object]) -> None:
        """Set the effect and its parameters."""
        self._effect = arguments.function(effect, f"{self.engine}: the effect", pg.InputError)
        _check_takes_frames(self.engine, effect)
        parameters = signature(effect).parameters
        self._takes = {name for name in _PER_FRAME if name in parameters}
        self._handles = _handles_of(effect)
        self._names = set(parameters) - {next(iter(parameters), ""), *_PER_FRAME}
        shader = _shader(effect)
        if shader is not None:
            self._names = {*shader.parameters, *shader.images[1:]}
        elif any(p.kind is p.VAR_KEYWORD for p in parameters.values()):
            self._names |= values.keys()
        self._given = {}
        self._set(values)

    @property
    def enabled(self) -> bool:
        """True if the effect runs. Set it to True after an error to try again."""
        return self._enabled and not self._closed

    @enabled.setter
    def enabled(self, on: bool) -> None:
        self._enabled = arguments.flag(on, f"{self.engine}: enabled", pg.InputError)
        self.error = None if on else self.error

    @property
    def takes_depth(self) -> bool:
        """True if the effect reads the frame's depth."""
        return "depth" in self._takes

    @property
    def isolation(self) -> str | None:
        """Return how the engine's state is protected: "sibling" or "guard"; None before the first frame."""
        return None if self._host is None else str(self._host.isolation)

    def set(self, **values: object) -> None:
        """Change values from the next frame on.

        Run values change without planning: numbers for which the effect takes a `passgraph.Value`, and uniforms of a
        shader that no target's size depends on. Other parameters plan the effect again at the next frame; the log
        "passgraph.engines" reports the time (level INFO). History continues as after `replace`.

        Raises
        ------
        InputError
            For a name that is neither a parameter of the effect nor a run value of its graph, and for a number outside
            the range of a parameter.
        GraphError, KernelError
            Raised by the effect; the values are unchanged.
        """
        with self._setting:
            self._set(values)

    def _set(self, values: Mapping[str, object]) -> None:
        shader = _shader(self._effect)
        if shader is not None:
            values = {n: checked(shader, n, v) if n in shader.parameters else v for n, v in values.items()}
        parameters = {**self._given, **values}
        target = self._graph(_Facts((0, 0), FORMATS["rgba8"], None), parameters, bound=False)
        passes = passes_behind([target])
        known = {source.name for node in passes for source in sources_of(node.values)} | self._names
        for name in values:
            if name not in known:
                have = ", ".join(sorted(known - {*_PER_FRAME, _HOLDS, "into", "name"})) or "none"
                raise pg.InputError(f"{self.engine}: the effect has no value {name!r}; it has {have}")
        check_given(passes, values)
        planned = self._names - self._handles.keys()
        is_other = any(name in planned and parameters[name] is not self._given.get(name) for name in values)
        self._given = parameters
        if is_other:
            self._structure = object()  # set after the values, so that a frame that sees it plans with them

    def on_close(self, detach: Callable[[], object]) -> None:
        """Register the function that removes the hook from the engine; for adapters."""
        self._detach.append(detach)

    def close(self) -> None:
        """Remove the effect from the engine, and release its resources; idempotent."""
        if self._closed:
            return
        self._closed = True
        for detach in reversed(self._detach):
            detach()
        with self._running:
            if not self._is_drawing:  # else the end of the current frame does it
                self._drop()

    def __enter__(self) -> Attachment:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # In the hook

    def draw(self, *_: object) -> None:
        """Run the effect on the frame; called in the engine's hook, with its context current. Never raises."""
        with self._running:
            if not self.enabled or self._is_drawing:
                return
            self._is_drawing = True
            try:
                self._draw_again()
                self._skipped = ""
            except EmptyPictureError:
                pass
            except RegionError as error:
                self._skip(error)
            except Exception as error:
                self.error, self._enabled = error, False
                LOG.error(
                    "%s: the effect failed and is switched off; the engine's frames are as without it: %s",
                    self.engine,
                    error,
                    exc_info=not isinstance(error, pg.PassgraphError),
                )
            finally:
                self._is_drawing = False
                if self._closed:
                    self._drop()

    def _skip(self, reason: RegionError) -> None:
        """Skip a frame, with one warning for consecutive frames with the same reason."""
        if str(reason) != self._skipped:
            LOG.warning("%s: a frame stays without the effect: %s", self.engine, reason)
        self._skipped = str(reason)

    def _draw_again(self) -> None:
        """Draw in a context that the engine has recreated, if necessary."""
        try:
            self._draw()
        except OtherContextError:
            self._drop()
            self._draw()

    def _opened_host(self) -> Any:
        """Return the backend in the engine's context; it is opened at first use."""
        if self._host is None:
            self._host = self._open_host()
        return self._host

    def _open_host(self) -> Any:
        """Open the backend in the engine's context; adapters of other APIs than OpenGL override it."""
        return Host.current(self._isolation)

    def _destination(self, frame: Any) -> Any:
        """Return the picture to write: the frame itself, unless an adapter overrides it."""
        return frame

    def _current_frame(self) -> tuple[HostPicture, HostPicture | None, _Facts] | None:
        """Return the frame, its depth if the effect reads it, and the properties to plan for; None without a frame."""
        current = self._frame(self._opened_host())
        if current is None or current.color is None:
            return None
        frame = self._as_decoded(current.color)
        depth = current.depth if "depth" in self._takes else None
        if "depth" in self._takes and depth is None:
            raise pg.InputError(f"{self.engine}: the effect takes depth, and the frame has none")
        return frame, depth, _Facts(frame.size, frame.format, None if depth is None else depth.format, self._structure)

    def warm_up(self) -> bool:
        """Plan, compile and run the effect once before the first frame; return False if there is no frame yet.

        Call it with the engine's context current. Drivers finish compiling at a program's first use, so the effect runs
        once, into its own memory; the frame is unchanged, and history is reset afterwards.

        Raises
        ------
        PassgraphError
            The error that `draw` would store in ``error``.
        """
        with self._running:
            try:
                frame = self._current_frame()
            except EmptyPictureError:
                frame = None
            if frame is None:
                return False
            program = self._program_for(frame[2])
            program.run(**self._inputs_of(program, *frame[:2]))
            program.reset()
            return True

    def _draw(self) -> None:
        current = self._current_frame()
        if current is not None:
            frame, depth, facts = current
            program = self._program_for(facts)
            program.run(into={"picture": self._destination(frame)}, **self._inputs_of(program, frame, depth))

    def _inputs_of(self, program: pg.Program, frame: HostPicture, depth: HostPicture | None) -> dict[str, Any]:
        """Return the inputs of a run for this frame."""
        run_values = program.plan.values
        inputs: dict[str, Any] = {name: value for name, value in self._given.items() if name in run_values}
        if not run_values.keys().isdisjoint(("camera", "previous_camera", _HOLDS)):
            view = self._view()
            before = self._cameras.get(frame.size, view.camera)
            self._cameras[frame.size] = view.camera
            view_values = {"camera": view.camera, "previous_camera": before, _HOLDS: view.holds}
            inputs |= {name: value for name, value in view_values.items() if name in run_values}
        if "depth" in program.inputs:
            inputs["depth"] = depth
        return {**inputs, "frame": frame}

    def _view(self) -> View:
        camera = self._camera() if callable(self._camera) else self._camera
        assert self._host is not None
        view = self._engine_camera() if camera is None else View.from_camera(camera, self._host.zero_to_one)
        if view is None:
            raise pg.InputError(
                f"{self.engine}: the effect takes {' and '.join(sorted(self._takes))}, and the engine has no camera "
                "that could be asked; give camera=, a pg.Camera or a function that returns one"
            )
        return view

    def _as_decoded(self, frame: HostPicture) -> HostPicture:
        """Return the frame decoded from sRGB if the effect takes linear light; engines store it in linear formats."""
        mark = getattr(self.effect, "effect", None)
        encoded = curved(frame.format, True) if mark is not None and mark.linear else None
        return frame if encoded is None else replace(frame, format=encoded)

    def _program_for(self, facts: _Facts) -> pg.Program:
        """Return the program for a frame's properties; a new one replaces the least recently used."""
        program = self._programs.pop(facts, None)
        if program is None:
            outdated = [known for known in self._programs if known.structure is not facts.structure]
            is_set = bool(outdated)
            begin = time.perf_counter()
            target = self._graph(facts, self._given, bound=True)
            program = pg.compile({"picture": target}, backend=self._host, options=pg.Options(math=self._math))
            if is_set and program.has_history:
                program.continue_from(self._programs[outdated[-1]])
            for known in outdated or list(self._programs)[: max(0, len(self._programs) - KEPT_PROGRAMS + 1)]:
                self._programs.pop(known).close()
            if is_set:
                took = (time.perf_counter() - begin) * 1e3
                LOG.info("%s: parameters or effect changed: planned and compiled in %.0f ms", self.engine, took)
        self._programs[facts] = program
        return program

    def _graph(self, facts: _Facts, parameters: Mapping[str, object], bound: bool) -> pg.Target:
        """Build the effect's graph for a frame; if not ``bound``, for a frame of any size."""
        frame = pg.Input("frame", facts.frame, facts.size) if bound else pg.Input("frame")
        handles: dict[str, object] = {}
        if "depth" in self._takes:
            depth_input = pg.Input("depth", facts.depth, facts.size) if bound else pg.Input("depth")
            handles["depth"] = distances(depth_input, pg.Value(_HOLDS, pg.HardwareDepth))
        for name in {"camera", "previous_camera"} & self._takes:
            handles[name] = pg.Value(name, pg.Camera)
        for name in self._names & parameters.keys():
            handle = self._handles.get(name)
            is_plain = not isinstance(parameters[name], (pg.Value, pg.Derived, str))
            handles[name] = handle if handle is not None and is_plain else parameters[name]
        if _shader(self.effect) is not None:
            handles = {**self._handles, **handles}
        target: object = self.effect(frame, **handles)
        if not isinstance(target, pg.Target):
            got = arguments.shown(target)
            raise pg.GraphError(f"{self.engine}: the effect must return the target of its last pass, got {got}")
        if target.made_by is None or (bound and facts.frame.srgb and not _is_encoded(target)):
            target = as_it_is(target, into=pg.target("stored", facts.frame, like=frame))
        return target

    def _drop(self) -> None:
        host, programs = self._host, list(self._programs.values())
        self._host = None
        self._programs.clear()
        self._cameras.clear()
        for program in programs:
            with suppress(OtherContextError):  # the program is closed with the host, which can be closed anywhere
                program.close()
        if host is not None:
            host.close()


def _check_takes_frames(engine: str, effect: Effect) -> None:
    """Raise InputError for built-in effects that render a scene or a world."""
    mark = getattr(effect, "effect", None)
    if mark is not None and not mark.takes.startswith("picture"):
        raise pg.InputError(
            f"{engine}: {mark.name} draws a {mark.takes} of passgraph's, and an engine has frames; attach an effect on "
            'frames, listed at "What attach takes" in docs/engines.md, such as passgraph.effects.occluded'
        )


def _is_encoded(target: pg.Target) -> bool:
    return target.spec.format is not None and target.spec.format.srgb


def _shader(effect: object) -> ShaderEffect | None:
    """Return the effect if it is from `passgraph.load_shader`, else None."""
    return effect if isinstance(effect, ShaderEffect) else None


def _handles_of(effect: Effect) -> dict[str, pg.Value]:
    """Return run values for the parameters that accept one; these change without planning again."""
    shader = _shader(effect)
    if shader is not None:
        free = {name: one for name, one in shader.parameters.items() if name not in shader.constants}
        return {name: pg.Value(name, object, default=one.default) for name, one in free.items()}
    try:
        hints = get_type_hints(inspect.unwrap(effect))
    except (NameError, TypeError):  # annotations of the caller may not be evaluable
        return {}
    numbers = (name for name, hint in hints.items() if pg.Value in get_args(hint) and float in get_args(hint))
    return {name: pg.Value(name, float) for name in numbers}
