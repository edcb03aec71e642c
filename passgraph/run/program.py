"""A compiled graph: bind inputs, run the plan on a backend, read results."""

from __future__ import annotations

import weakref
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, NoReturn

from passgraph import arguments
from passgraph.cached import cached_property
from passgraph.errors import GraphError, PassgraphError
from passgraph.formats import Format
from passgraph.graph.run_values import FRAME_INDEX, sources_of
from passgraph.graph.targets import InputSpec, Target
from passgraph.plan.data import CountStep, Options, Plan
from passgraph.plan.dependencies import inputs_behind, passes_behind, read_history
from passgraph.run.caller_arrays import Admission, bound_to, given_room
from passgraph.run.finite_checks import NonFinite, PassCheck
from passgraph.run.result import Into, Observer, Result, Results

if TYPE_CHECKING:
    from passgraph.backends.base import Backend
    from passgraph.run.execution import Execution, Timed
    from passgraph.run.inspection import Inspection
    from passgraph.run.profile import Profile


@dataclass
class Held:
    """A program's resources, separate so that its finalizer can hold them without holding the program."""

    backend: Backend
    owns: bool
    execution: Execution | None = None

    def abandoned(self) -> None:
        """Handle a program that was dropped without being closed; may run in any thread at any time."""
        execution, self.execution = self.execution, None
        # A backend without another owner is freed with its last reference, and with it all that it made.
        if execution is not None and not self.owns:
            self.backend.turn.later(execution.release)


class Alone:
    """A context in which one thread uses a program exclusively; a class, since every call enters it."""

    __slots__ = ("program", "what")

    def __init__(self, program: Program, what: str) -> None:
        self.program, self.what = program, what

    def __enter__(self) -> None:
        program = self.program
        program.backend.turn.__enter__()
        # Only the thread that holds the lock can enter twice.
        if program._busy or (program._closed and self.what != "closed"):
            program.backend.turn.__exit__()
            program._check_open()
            raise GraphError(
                f"a program cannot be {self.what} from inside its own run; an observer, or a value's function, "
                "keeps what it needs and does this after the run"
            )
        program._busy = True

    def __exit__(self, *_: object) -> None:
        self.program._busy = False
        self.program.backend.turn.__exit__()


class Program:
    """A compiled graph, returned by :func:`passgraph.compile`. Call it with inputs and values by name.

    It owns its pictures and compiled passes until :meth:`close`; it is also a context manager.

    Threads may share a program: calls and :meth:`close` are exclusive, and other threads wait.  Between :meth:`run` and
    :meth:`read`, another thread's run may intervene; call the program instead.  An observer or a value's function must
    not run, change or close the program.  In a forked process a program compiled before the fork works on ``numpy`` and
    ``reference``, and raises an error on ``gl`` and ``opencl``.
    """

    def __init__(
        self,
        outputs: dict[str, Target],
        backend: Backend,
        owns: bool,
        size: tuple[int, int] | None,
        options: Options,
        non_finite: NonFinite = "error",
        check_finite: bool = False,
        results: Results = "float32",
    ) -> None:
        self._outputs, self.backend, self._owns = outputs, backend, owns
        self._results = results
        self._held = Held(backend, owns)
        weakref.finalize(self, self._held.abandoned).atexit = False
        self._non_finite, self._check_finite = non_finite, check_finite
        # Checks name passes as written, so no pass is computed inside another.
        options = replace(options, fuse=False) if check_finite else options
        self._size, self._options = (
            size,
            options if backend.optimises else replace(options, fuse=False, simplify=True),
        )
        self._inputs = inputs_behind(list(outputs.values()))
        _check_names(self._inputs, outputs.values())
        self._bound: dict[str, tuple[Format, tuple[int, int]]] = {}
        self._plan: Plan | None = None
        self._busy = False
        self._pass_check: PassCheck | None = None
        self._overrides: dict[tuple[str, str], object] = {}
        self._admission = Admission(self._inputs, outputs.values(), non_finite)
        self._closed = False
        #: Memory limit of the targets in bytes; None: half of the machine's memory.
        self.most_memory: int | None = None
        self.replanned = 0  # number of new plans for inputs of another size or format

    @property
    def _execution(self) -> Execution | None:
        return self._held.execution

    @property
    def inputs(self) -> dict[str, InputSpec]:
        """Return the input pictures by name: every input behind the outputs, even if no step reads it."""
        return dict(self._inputs)

    @cached_property
    def has_history(self) -> bool:
        """Return True if a pass reads last run's picture, so that the order of runs matters."""
        return read_history(self._outputs.values())

    @cached_property
    def has_frame_index(self) -> bool:
        """Return True if something depends on :data:`passgraph.FRAME_INDEX`."""
        passes = passes_behind(list(self._outputs.values()))
        return any(value is FRAME_INDEX for node in passes for value in sources_of(node.values))

    @property
    def plan(self) -> Plan:
        """The plan; if inputs are open and have no default, available after the first run."""
        self._check_open()
        plan = self._plan
        if plan is None:
            with self._alone("planned"):
                if self._plan is None:
                    self._bound = self._bound or self._admission.known()
                    self._make_plan()
                plan = self._plan
        assert plan is not None
        return plan

    @property
    def known_plan(self) -> Plan | None:
        """The plan, or None where it depends on inputs of the first run."""
        try:
            return self.plan
        except PassgraphError:
            return None

    @property
    def outputs(self) -> dict[str, Target]:
        """The targets that it computes, by name."""
        return dict(self._outputs)

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """Show the plan in a notebook, or the graph before the first run if the sizes of inputs are open."""
        from passgraph import notebook

        plan = self.known_plan
        about = f"program on {self.backend.name}"
        if plan is None:
            outputs = self.outputs
            return notebook.bundle(f"{about}: {', '.join(outputs)}", svg=notebook.graph_svg([*outputs.values()]))
        views = plan._repr_mimebundle_()
        return {
            **views,
            "text/plain": f"{about}\n{views['text/plain']}",
            "text/html": f"<p>{about}</p>{views['text/html']}",
        }

    def _alone(self, what: str) -> Alone:
        """Return a context in which no other thread uses the backend."""
        return Alone(self, what)

    def _check_open(self) -> None:
        if self._closed:
            raise GraphError("this program is closed; compile the graph again")

    def explain(self) -> str:
        """Explain the order of steps, and how the arrays of the last run were transferred."""
        lines = [self.plan.explain()]
        lines += self._own_ways()
        if self.backend.about:
            lines.append(f"- runs in {self.backend.about}")
        if self._execution is not None:
            lines += [f"- {what}: {how}" for what, how in self._execution.storages.caller_arrays.transfers.items()]
        return "\n".join(lines)

    def _own_ways(self) -> list[str]:
        """List the steps that the device implements in its own way."""
        lines: list[str] = []
        for unit in [] if self._execution is None else self._execution.units:
            step = unit.steps[0]
            way = self.backend.own_way(step) if isinstance(step, CountStep) else None
            if way is not None:
                lines.append(f"- {step.name} is implemented in this device's own way: {way}")
        return lines

    def to_data(self) -> dict[str, Any]:
        """Return the graph as plain data, to compile in another process or machine: see :func:`passgraph.to_data`.

        It holds the outputs only; backend, size and options are arguments of the `compile` call there.
        """
        from passgraph.serialize import to_data

        return to_data(self._outputs)

    def settings(self) -> dict[str, Any]:
        """Return the settings of `compile` except the outputs, as plain data; the backend by its name."""
        return {
            "backend": self.backend.name, "size": self._size, "options": asdict(self._options),
            "non_finite": self._non_finite, "check_finite": self._check_finite, "results": self._results,
            "memory": self.most_memory,
        }  # fmt: skip

    def _make_plan(self) -> None:
        from passgraph.plan.build import build
        from passgraph.plan.limits import check_memory
        from passgraph.run.execution import Execution

        # No half-made state remains if the new plan fails: the next run starts afresh.
        if self._execution is not None:
            self._execution.release()
        self._held.execution = self._plan = None
        plan = build(self._outputs, self._size, self._bound, self._options, self.backend.limits)
        check_memory(plan, self.most_memory)
        self._held.execution = execution = Execution(plan, self.backend)
        self._plan = plan
        self._pass_check = PassCheck(plan) if self._check_finite else None
        for (step, name), value in self._overrides.items():
            execution.override(step, name, value)

    def __call__(self, /, into: Into | None = None, **inputs: Any) -> Result:
        """Run once and read every output.

        The caller owns the results: no later run changes them.  Buffers of results that have been garbage-collected are
        reused.

        Parameters
        ----------
        into
            Destination arrays by output name, (height, width, channels) in float32 or in the target's own dtype (uint8
            for ``rgba8``, uint16 for ``rgba16``, float16 for ``rgba16f``).  Results are written there, in place if the
            backend can, and the returned result holds these arrays.  They may be views with any row stride.  Pictures
            on the backend's device are accepted too, such as those of a `pg.gl.Host`.
        given
            Pictures and values by name.  Arrays in a format's dtype (uint8, uint16, float16, float32) are read without
            conversion, in place if the backend can; no reference is kept after the call.

        Raises
        ------
        InputError
            For a missing, unknown or unfit input or value, by name; for a picture that holds NaN or infinity; for a
            destination array that has another shape or dtype, is read-only, or shares memory with another one.
        """
        with self._alone("called"):
            self._run(None, inputs, into, results=self._results)
            return self._read(None)

    def run(self, _observe: Observer | None = None, /, into: Into | None = None, **inputs: Any) -> None:
        """Run once without reading results back, except those given in ``into``.

        ``_observe(step, pictures)`` is called after every step with what it wrote: slow, for debugging.
        """
        if _observe is not None:
            arguments.function(_observe, "the observer of a run")
        with self._alone("run"):
            self._run(_observe, inputs, into)

    def _run(
        self, observe: Observer | None, inputs: Mapping[str, Any], into: Into | None, timed: Timed | None = None,
        results: Results | None = None,
    ) -> None:  # fmt: skip
        pictures = self._admission.pictures(inputs, self.backend.picture_of)
        if self._bind(pictures) or self._plan is None:
            self._make_plan()
        execution, plan = self._held.execution, self._plan
        assert execution is not None and plan is not None
        values = {name: value for name, value in inputs.items() if name not in self._inputs}
        result_arrays = {} if into is None else given_room(into, plan, pictures, self.backend.picture_of)
        execution.run(pictures, values, observe, self._pass_check, result_arrays, timed, results)

    def read(self, name: str | None = None) -> Result:
        """Return the outputs of the last run, or one of them; after a call, copies of its results as they are now."""
        with self._alone("read"):
            return self._read(name)

    def _read(self, name: str | None) -> Result:
        execution = self._execution
        if execution is None:
            raise GraphError("nothing has run yet")
        outputs = execution.plan.outputs
        if name is not None and not arguments.among(name, outputs):
            raise GraphError(f"there is no output {arguments.shown(name)}; there are {', '.join(outputs)}")
        names = list(outputs) if name is None else [name]
        with self.backend.running():
            return Result({n: execution.result(outputs[n], self._results) for n in names})

    def reset(self) -> None:
        """Start over: the next run is the first, for `passgraph.FRAME_INDEX` and for what `passgraph.previous` reads.

        >>> import passgraph as pg
        >>> add = pg.kernel(source="def add(a: Image, b: Image) -> float: return a[0, 0].r + b[0, 0].r")
        >>> total = pg.target("total", "r32f", initial=10.0)
        >>> with pg.compile(add(pg.previous(total), pg.Input("frame"), into=total)) as program:
        ...     one = [[[1.0]]]
        ...     sums = [float(program(frame=one)["total"][0, 0, 0]) for _ in range(2)]
        ...     program.reset()
        ...     sums + [float(program(frame=one)["total"][0, 0, 0])]
        [11.0, 12.0, 11.0]
        """
        with self._alone("reset"):
            self._reset()

    def _reset(self) -> None:
        if self._execution is not None:
            self._execution.reset()
            if self._pass_check is not None:
                self._pass_check = PassCheck(self._execution.plan)

    def continue_from(self, earlier: Program) -> None:
        """Continue from another program on this backend: take over its frame index, and history of targets in both.

        Targets match by name, size and format; history of others begins at their initial values. Both need a plan: a
        program has one after its first run, or once the formats and sizes of its inputs are known.

        >>> import passgraph as pg
        >>> text = "def add(total: Image, step: float) -> float: return total[0, 0].r + step"
        >>> total = pg.target("total", "r32f", (1, 1))
        >>> by_one, by_ten = (pg.kernel(source=text)(pg.previous(total), step, into=total) for step in (1.0, 10.0))
        >>> with pg.compile(by_one) as first, pg.compile(by_ten, backend=first.backend) as second:
        ...     first.run()
        ...     second.continue_from(first)
        ...     float(second()["total"][0, 0, 0])
        11.0

        Raises
        ------
        GraphError
            If the other program runs on another backend, or one of the two is closed.
        """
        if earlier.backend is not self.backend:
            raise GraphError("history stays on its backend; compile both programs with backend=first.backend")
        _ = self.plan, earlier.plan
        with self._alone("continued"):
            assert self._execution is not None and earlier._execution is not None
            self._reset()
            with self.backend.running():
                self._execution.continue_from(earlier._execution)

    def set(self, step: str, name: str, value: object) -> None:
        """Set a plain parameter of a pass, by the pass's name and the parameter's."""
        with self._alone("changed"):
            if self._execution is None:
                self._make_plan()
            assert self._execution is not None
            self._execution.override(step, name, value)
            self._overrides[step, name] = value

    def inspect(self, x: int, y: int, step: str | None = None, /, **inputs: Any) -> Inspection:
        """Trace the kernel of a pass at one pixel, line by line, in float64 on the reference.

        The reference also computes what the pass reads, as in a first run.  For a draw, the trace is of the fragment
        kernel for the visible fragment and a few others; it begins with the triangles that cover the pixel, the fate of
        each, and the vertex kernel's results at their corners.

        Parameters
        ----------
        x, y
            The pixel, counted from 0 at the top left.
        step
            The name of a pass; default: the last pass.  Of several passes with one name it selects the last; a number
            behind the name (``"draw 1"``) selects the first, second …
        given
            Pictures and values by name, as for a call.

        Returns
        -------
        Inspection
            Its text shows each line of the source with the variable's values, branches, and loop iterations.  Its
            docstring has an example of a draw.

        Raises
        ------
        GraphError
            For an unknown pass, or a pixel outside of it.
        InputError
            As for a call.

        Examples
        --------
        >>> import numpy as np
        >>> import passgraph as pg
        >>> double = pg.kernel(source="def double(color: Image, gain: float = 2.0) -> vec4: return color[0, 0] * gain")
        >>> with pg.compile(double(pg.Input("frame"))) as program:
        ...     found = program.inspect(0, 0, frame=np.full((1, 1, 4), 0.25, np.float32))
        >>> found.parameters, found.results  # print(found) shows the lines between them
        ({'gain': 2.0}, {'double': (0.5, 0.5, 0.5, 0.5)})
        """
        from passgraph.run.inspection import Known, inspected

        with self._alone("inspected"):
            pictures = self._admission.pictures(inputs, self.backend.picture_of)
            values = {name: value for name, value in inputs.items() if name not in self._inputs}
            subject = Known(self._outputs, self._size, self._bound_to(pictures), pictures, values, self._overrides)
            return inspected(subject, step, x, y)

    def profile(self, runs: int = 5, /, **inputs: Any) -> Profile:
        """Time each pass: the median of some runs, after one that compiles and uploads.

        It waits for the device around each pass, so passes do not overlap.  Passes that run as one are one row.

        Parameters
        ----------
        runs
            Number of timed runs, 1 to 1000; each counts as a run for history too.
        given
            Pictures and values by name, as for a call.

        Returns
        -------
        Profile
            Its text is a table.

        Raises
        ------
        GraphError, InputError
            For another number of runs, and as for a call.

        Examples
        --------
        >>> import numpy as np
        >>> import passgraph as pg
        >>> from passgraph.effects.filters.blur import gaussian_blur
        >>> with pg.compile(gaussian_blur(pg.Input("frame"))) as program:
        ...     profile = program.profile(3, frame=np.zeros((9, 16, 4), np.float32))
        >>> [each.passes for each in profile.passes], profile.runs
        ([('gaussian_blur_x', 'gaussian_blur_y')], 3)
        """
        from passgraph.run.profile import Stopwatch

        count = arguments.whole_number(runs, "profile: runs", 1, 1000)
        with self._alone("profiled"):
            self._run(None, inputs, None)
            watch = Stopwatch(self.backend.finish)
            for _ in range(count):
                watch.run(lambda: self._run(None, inputs, None, watch.step))
            assert self._execution is not None
            return watch.profile(self.backend.name, self._execution.plan, self._execution.ends(self._check_finite))

    def finish(self) -> None:
        """Wait for the device."""
        with self._alone("waited for"):
            self.backend.finish()

    def _bound_to(self, pictures: Mapping[str, Any]) -> dict[str, tuple[Format, tuple[int, int]]]:
        return {name: bound_to(pictures[name], spec) for name, spec in self._inputs.items()}

    def _bind(self, pictures: Mapping[str, Any]) -> bool:
        """Bind the formats and sizes of this run's inputs; return True if they differ from the plan's."""
        bound = self._bound_to(pictures)
        changed = bound != self._bound
        if changed and self._plan is not None:
            self.replanned += 1
        self._bound = bound
        return changed

    def close(self) -> None:
        """Release all pictures and compiled passes; also the backend, if the program opened it.

        Waits for a call in another thread to end.
        """
        if self._closed or self.backend.turn.lost:
            # Resources of the parent process are left alone after a fork.
            self._closed = True
            return
        with self._alone("closed"):
            self._closed = True
            if self._execution is not None and not self._owns:
                self._execution.release()
            self._held.execution = None
            if self._owns:
                self.backend.close()

    def __reduce__(self) -> NoReturn:
        raise GraphError(
            "a program has a device of this process, and is neither copied nor pickled; compile the graph again, in "
            "another process from program.to_data() and pg.from_data(...)"
        )

    def __enter__(self) -> Program:
        self._check_open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _check_names(inputs: Mapping[str, InputSpec], outputs: Iterable[Target]) -> None:
    """Check that no input or value is called ``into``, which is the argument for destination arrays."""
    values = {value.name for node in passes_behind(list(outputs)) for value in sources_of(node.values)}
    for what, names in (("an input", inputs), ("a value", values)):
        if "into" in names:
            raise GraphError(
                f"{what} cannot be called 'into', which names the destination arrays; give it another name"
            )
