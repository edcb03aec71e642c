"""A plan on a device: its storages and compiled steps; runs them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import text
from passgraph.backends.base import DevicePicture
from passgraph.errors import BackendError, GraphError, InputError
from passgraph.graph.draw_state import is_fixed
from passgraph.graph.run_values import FRAME_INDEX, OUTPUT_SIZE, Derived, Value
from passgraph.language.long_arrays import picture_of
from passgraph.language.parameter_name import ParameterName
from passgraph.language.scalar import ScalarProgram
from passgraph.language.uniform_layout import in_range
from passgraph.plan.chains import Chains
from passgraph.plan.data import CopyStep, CountStep, DrawStep, PixelStep, Plan, Step
from passgraph.run.caller_arrays import CallerArrays
from passgraph.run.caller_arrays import Picture as Given
from passgraph.run.result import Results

if TYPE_CHECKING:
    from passgraph.backends.base import Backend, Block
    from passgraph.run.finite_checks import PassCheck


def picked(value: object, fields: Sequence[str], name: object) -> object:
    """Return the nested field of a value; for a list, a list of each entry's field."""
    for i, field in enumerate(fields):
        # Lists have methods, such as count, that fields may be named like; a named tuple is a struct.
        if isinstance(value, (list, tuple)) and not hasattr(value, "_fields"):
            return [picked(one, fields[i:], name) for one in value]
        if not hasattr(value, field):
            raise InputError(f"{str(name)!r} needs a field {field!r}, which {type(value).__name__} lacks")
        value = getattr(value, field)
    return value


def resolve(handle: object, values: dict[Any, object]) -> object:
    """Return the value of a handle in this run."""
    if isinstance(handle, Value):
        return values[handle.name]
    assert isinstance(handle, Derived)
    # Compared by identity: a default in the handle may be an array, which is not hashable.
    if id(handle) not in values:
        values[id(handle)] = handle.function(*(values[source.name] for source in handle.sources))
    return values[id(handle)]


class Buffers:
    """The buffers of a plan's long array parameters; ``storages`` maps resource ids to their storage."""

    def __init__(self, plan: Plan, backend: Backend, storages: Mapping[int, Any]) -> None:
        self.plan, self.backend, self.storages = plan, backend, storages
        #: By resource, the parameter's value: an array, or a handle that each run sets.
        self.given: dict[int, object] = {resource: spec.value for resource, spec in plan.buffers.items()}
        #: By resource, the value whose numbers it holds, if that cannot change unnoticed.
        self.written: dict[int, object] = {}
        for resource, value in self.given.items():
            if not isinstance(value, (Value, Derived)):
                self._write(resource, value)

    def bring(self, values: dict[Any, object]) -> None:
        """Upload the values that changed since the last run.

        Raises
        ------
        InputError
            For a value of the wrong type or shape.
        """
        for resource, source in self.given.items():
            value = resolve(source, values) if isinstance(source, (Value, Derived)) else source
            if resource not in self.written or self.written[resource] is not value or not self._stays(resource, value):
                self._write(resource, value)

    def _write(self, resource: int, value: object) -> None:
        self.written.pop(resource, None)
        stays, spec = self._stays(resource, value), self.plan.buffers[resource]
        picture = picture_of(picked(value, spec.fields, spec.name), spec.type, spec.name)
        self.backend.upload(self.storages[resource], picture)
        if stays:
            self.written[resource] = value

    def _stays(self, resource: int, value: object) -> bool:
        """Return True if a value is the one uploaded last."""
        source = self.given[resource]
        if not isinstance(source, (Value, Derived)) or source.static:
            return True
        return isinstance(value, np.ndarray) and is_fixed(value)

    def override(self, step: Step, key: ParameterName, value: object) -> None:
        """Set a parameter of a step."""
        mine = self._of(step, key)
        for other in self.plan.steps:
            names = [key] if other is step else []
            if any(resource in mine and parameter not in names for resource, parameter in self._used(other)):
                raise GraphError(
                    f"parameter {str(key)!r} of pass {step.name!r} is one array with what pass {other.name!r} reads; "
                    "give both a pg.Value, which each run brings, or two arrays"
                )
        for resource in mine:
            self.given[resource] = value
            self.written.pop(resource, None)

    def _of(self, step: Step, key: ParameterName) -> set[int]:
        return {resource for resource, parameter in self._used(step) if parameter == key}

    def _used(self, step: Step) -> list[tuple[int, ParameterName]]:
        """Return the long arrays that a step reads, each with its parameter's name."""
        resources = {} if isinstance(step, CopyStep) else dict(step.images)
        return [(resources[name], part.whole) for program in step.programs for name, part, _ in program.buffers]


Picture = NDArray[np.float32]
Execute: TypeAlias = Callable[[dict[Any, object]], None]
#: Values of plain parameters that replace those of the graph, by the name of the step.
Overrides: TypeAlias = Mapping[tuple[str, ParameterName], object]
#: Runs a step that it is given, and measures the time.
Timed: TypeAlias = Callable[[Step, Callable[[], None]], None]


class Execution:
    """Owns a plan's storages until :meth:`release`."""

    def __init__(self, plan: Plan, backend: Backend) -> None:
        from passgraph.backends.base import Block

        self.plan, self.backend = plan, backend
        self.memories: list[Any] = []
        #: Resource id → memory index; history moves them on after each run.
        self.places = [resource.memory for resource in plan.resources]
        self._geometries: dict[int, Any] = {}
        self._empty = Block(np.zeros(1, np.float32), np.zeros(1, np.int32))
        self._overrides: dict[tuple[str, ParameterName], object] = {}
        self._uploaded: dict[str, object] = {}
        self._static_seen: dict[str, object] | None = None
        self._static_values = [name for name, handle in plan.values.items() if handle.static]
        #: Values of static steps that are derived from sources that are not static.
        self._by_value = [
            value
            for step in plan.steps
            if step.static
            for value in step.values.values()
            if isinstance(value, Derived) and value.by_value
        ]
        #: Compiled steps, singly and as chains (under the chain's last step).
        self._runs: list[tuple[Step, Execute]] = []
        self._chained: list[tuple[Step, Execute]] = []
        #: Steps that run as one unit, in order.
        self.units: list[tuple[Step, ...]] = []
        #: Results of chains whose allocation also backs one of the chain's images, and their replacement allocation.
        self._apart: dict[int, int] = {}
        self.caller_arrays = CallerArrays(plan, backend)
        self.runs = 0  # completed runs, since history began
        self._moves_due = False
        #: Resource id and that of its content one run before, the earliest first.
        self._histories = earliest_first(plan)
        try:
            for number in range(len(plan.memories)):
                self.memories.append(self._new_storage(number))
            self._begin_history(started=True)
            # They hold no reference to this object, so that a dropped program is freed at once.
            self._buffers = Buffers(plan, backend, {resource: self._storage(resource) for resource in plan.buffers})
            chains = Chains(plan)
            with backend.compiling(), self._reports_memory("compile this graph"):
                while len(self._runs) < len(plan.steps):
                    self._compile_next(chains)
        except BaseException:
            self.release()
            raise

    def _storage(self, resource: int) -> Any:
        place, lent_storages = self.places[resource], self.caller_arrays.storages
        return lent_storages[place] if place in lent_storages else self.memories[place]

    # Compiling: each step becomes a function of this run's values.

    def _compile_next(self, chains: Chains) -> None:
        """Compile the next chain that the backend runs as one, or else the next single step."""
        start = len(self._runs)
        for end in chains.ends(start):
            steps = self.plan.steps[start:end]
            execute = self._compile_chain(cast("tuple[PixelStep, ...]", steps))
            if execute is not None:
                self._chained.append((steps[-1], execute))
                self.units.append(steps)
                self._runs += [(step, self._compiled_when_run(step)) for step in steps]
                return
        step = self.plan.steps[start]
        self._runs.append((step, self._compile(step)))
        self._chained.append(self._runs[-1])
        self.units.append((step,))

    def _compiled_when_run(self, step: Step) -> Execute:
        """Return a function that compiles a chain's step when first called: single steps run only under observation."""
        compiled: list[Execute] = []

        def execute(values: dict[Any, object]) -> None:
            if not compiled:
                compiled.append(self._compile(step))
            compiled[0](values)

        return execute

    def _compile_chain(self, steps: tuple[PixelStep, ...]) -> Execute | None:
        run = self.backend.pixel_chain(steps)
        if run is None:
            return None
        blocks = [Uniforms(step.program, step, self._overrides) for step in steps]
        image_ids = [[r for _, r in step.images] for step in steps]
        outputs = steps[-1].outputs
        # Single steps may write over an image that only an earlier step reads; a chain still reads it at that time.
        inner = {r for step in steps[:-1] for r in step.outputs}
        used_pictures = {self._apart.get(r, self.places[r]) for ids in image_ids for r in ids if r not in inner}
        for resource in outputs:
            if self.places[resource] in used_pictures:
                apart = self._new_storage(self.places[resource])
                self._apart[resource] = len(self.memories)
                self.memories.append(apart)
        return lambda values: run(
            [self._storage(r) for r in outputs],
            [[self._storage(r) for r in ids] for ids in image_ids],
            [block.pack(values) for block in blocks],
        )

    def _compile(self, step: Step) -> Execute:
        if isinstance(step, CopyStep):
            return lambda _: self.backend.copy(self._storage(step.source_resource), self._storage(step.outputs[0]))
        if isinstance(step, PixelStep):
            run = self.backend.count_pass(step) if isinstance(step, CountStep) else self.backend.pixel_pass(step)
            block = Uniforms(step.program, step, self._overrides)
            image_ids = [r for _, r in step.images]
            return lambda values: run(
                [self._storage(r) for r in step.outputs],
                [self._storage(r) for r in image_ids],
                block.pack(values),
            )
        return self._compile_draw(step)

    @contextmanager
    def _reports_memory(self, doing: str) -> Iterator[None]:
        """Report an out-of-memory error with the failed operation and the memory of the graph's targets."""
        try:
            yield
        except MemoryError as error:
            mebibytes = sum(memory.bytes for memory in self.plan.memories) / 2**20
            raise BackendError(
                f"{self.backend.name} finds no memory to {doing} ({error}); its targets take {mebibytes:.0f} MiB, and "
                "the results come on top; use a smaller size or format, or work tile by tile"
            ) from error

    def _new_storage(self, number: int) -> Any:
        """Return a new storage for one of the plan's allocations."""
        memory = self.plan.memories[number]
        try:
            return self.backend.make(memory.format, memory.size)
        except MemoryError as error:
            name = next(resource.name for resource in self.plan.resources if resource.memory == number)
            raise BackendError(
                f"{name!r} is {memory.size[0]}x{memory.size[1]} {memory.format.name} ({memory.bytes / 2**20:.0f} MiB), "
                f"for which {self.backend.name} finds no memory; use a smaller size or format, or work tile by tile"
            ) from error

    def _compile_draw(self, step: DrawStep) -> Execute:
        run = self.backend.draw_pass(step)
        mesh = step.source.geometry
        if id(mesh) not in self._geometries:
            self._geometries[id(mesh)] = self.backend.geometry(mesh)
        geometry = self._geometries[id(mesh)]
        vertex = Uniforms(step.vertex, step, self._overrides)
        fragment = Uniforms(step.fragment, step, self._overrides) if step.fragment is not None else None
        image_ids = [r for _, r in step.images]

        def draw(values: dict[Any, object]) -> None:
            run(
                [self._storage(r) for r in step.outputs],
                None if step.depth is None else self._storage(step.depth),
                [self._storage(r) for r in image_ids],
                geometry,
                vertex.pack(values),
                fragment.pack(values) if fragment is not None else self._empty,
            )

        return draw

    # Running

    def run(
        self,
        pictures: Mapping[str, Given],
        inputs: Mapping[str, object],
        observe: Callable[[Step, dict[str, Picture]], None] | None,
        check: PassCheck | None = None,
        result_arrays: Mapping[int, Given] | None = None,
        timed: Timed | None = None,
        results: Results | None = None,
    ) -> None:
        """Run every step in order; static steps only if a source changed.

        ``observe`` and ``check`` get the results of each step, which are read back: slow, for debugging.
        ``result_arrays`` has the destination arrays, by resource; ``results`` says how other results are returned, None
        if they are not.  ``timed`` runs each step.
        """
        with self._reports_memory("allocate the results"):
            self.caller_arrays.begin(result_arrays or {}, results)
        values = self._values(inputs)
        static = {name: values[name] for name in self._static_values}
        for number, handle in enumerate(self._by_value):
            static[str(number)] = _contents(resolve(handle, values))
        static_changed = self._changed(static)
        self._static_seen = None  # until this run completes, static steps count as not done
        if check is not None:
            check.begin()
        try:
            with self._reports_memory("run this graph"):
                self._run_steps(pictures, values, observe, check, static_changed, timed)
        except BaseException:
            self.caller_arrays.begin({})
            raise
        self._static_seen, self._moves_due = static, True
        self.runs += 1

    def _run_steps(
        self, pictures: Mapping[str, Given], values: dict[Any, object],
        observe: Callable[[Step, dict[str, Picture]], None] | None, check: PassCheck | None, static_changed: bool,
        timed: Timed | None,
    ) -> None:  # fmt: skip
        looking = observe is not None or check is not None
        # The observer may use the device between two steps.
        with nullcontext() if looking else self.backend.running():
            static_changed |= self._upload(pictures)
            if check is not None:
                for name, resource in self.plan.inputs.items():
                    stored = pictures[name]
                    check.admit(resource, self.download(resource) if isinstance(stored, DevicePicture) else stored)
            self._buffers.bring(values)
            self._move_history()
            for resource, apart in self._apart.items():
                self.places[resource] = self.plan.resources[resource].memory if looking else apart
            self.caller_arrays.bind_results(self.places)
            for step, execute in self._runs if looking else self._chained:
                if step.static and not static_changed:
                    continue
                if timed is None:
                    execute(values)
                else:
                    timed(step, partial(execute, values))
                if observe is not None or check is not None:
                    written = {resource: self.download(resource) for resource in step.writes}
                    if observe is not None:
                        observe(step, {self.plan.resources[r].name: picture for r, picture in written.items()})
                    if check is not None:
                        check.look(step, written)
            self.caller_arrays.end(self.places, self.memories)

    def ends(self, looking: bool) -> list[Step]:
        """Return the last step of each unit, in order; when observed, each step is a unit."""
        return [step for step, _ in (self._runs if looking else self._chained)]

    def _move_history(self) -> None:
        """Age the history by one run; done at the start of a run, so that results can be read after the last one."""
        if self._moves_due:
            self._moves_due = False
            places = self.places
            for now, before in self._histories:
                places[now], places[before] = places[before], places[now]

    def reset(self) -> None:
        """Reset to the state before the first run: history holds the targets' initial values."""
        self.runs, self._moves_due, self._static_seen = 0, False, None
        self._begin_history(started=False)

    def continue_from(self, earlier: Execution) -> None:
        """Copy the run count, and history of targets that match in name, size and format."""
        earlier._move_history()
        earlier_history = {(r.name, r.size, r.format): r.id for r in earlier.plan.resources if r.kind == "history"}
        for resource in self.plan.resources:
            source = earlier_history.get((resource.name, resource.size, resource.format))
            if source is not None and resource.kind == "history":
                self.backend.copy(earlier._storage(source), self._storage(resource.id))
        self.runs = earlier.runs

    def _begin_history(self, started: bool) -> None:
        """Fill the history from before the first run. ``started``: memory is new, and 0."""
        for resource in self.plan.resources:
            is_zero = not isinstance(resource.initial, np.ndarray) and not any(resource.initial)
            if resource.kind == "history" and not (started and is_zero):
                width, height = resource.size
                shape = (height, width, resource.format.channels)
                picture = np.broadcast_to(np.asarray(resource.initial, np.float32), shape)
                self.backend.upload(self._storage(resource.id), np.ascontiguousarray(picture))

    def _values(self, run_values: Mapping[str, object]) -> dict[Any, object]:
        """Return run values by handle; derived values are computed on first use."""
        needed = self.plan.values
        if run_values and (surplus := [name for name in run_values if name not in needed]):
            names = ", ".join([*self.plan.inputs, *needed]) or "nothing"
            raise InputError(f"there is no input or value {surplus[0]!r} in this graph; it takes {names}")
        values: dict[Any, object] = {}
        if not needed:
            return values
        for name, handle in needed.items():
            value = run_values.get(name, self._default_value(handle))
            if value is None:
                raise InputError(f"value {name!r} is missing; run the program as program({name}=...)")
            handle.check(value)
            values[name] = value
        return values

    def _default_value(self, handle: Value) -> object:
        """Return the default of a value that a run does not set."""
        if handle is OUTPUT_SIZE:
            return self.plan.size
        return self.runs if handle is FRAME_INDEX else handle.default

    def _upload(self, pictures: Mapping[str, Given]) -> bool:
        """Upload the inputs; return True if a static one is new."""
        changed = False
        static = self.plan.static_inputs
        for name, resource in self.plan.inputs.items():
            picture = pictures[name]
            format_ = self.plan.resources[resource].format
            if name in static and self._uploaded.get(name) is picture:
                continue
            if self.caller_arrays.takes(name, resource, self.places[resource], picture):
                continue
            if not isinstance(picture, DevicePicture) and picture.dtype == np.float32:
                self.backend.upload(self._storage(resource), picture)
            else:
                self.backend.upload_stored(self._storage(resource), picture, format_)
            if name in static:
                self._uploaded[name] = picture
                changed = True
        return changed

    def _changed(self, static: dict[str, object]) -> bool:
        """Return True if a static value differs from the last run's; an array passed again counts as changed."""
        last_static = self._static_seen
        if last_static is not None and not static:
            return False
        return last_static is None or any(not _same(last_static.get(name), value) for name, value in static.items())

    def override(self, step: str, name: str, value: object) -> None:
        """Set a plain parameter of a step."""
        step, name = text(step, "the name of a pass"), text(name, "the name of a parameter")
        steps = [s for s in self.plan.steps if s.name == step or (isinstance(s, PixelStep) and step in s.fused)]
        if not steps:
            raise GraphError(f"there is no pass {step!r}; there are {', '.join(s.name for s in self.plan.steps)}")
        keys = [key for key in steps[0].values if name in (key.parameter, str(key))]
        if not keys:
            known = ", ".join(map(str, steps[0].values)) or "none"
            raise GraphError(f"pass {step!r} has no parameter {name!r} to set; it has {known}")
        self._buffers.override(steps[0], keys[0], value)
        self._overrides[steps[0].name, keys[0]] = value
        self._static_seen = None

    def download(self, resource: int) -> Picture:
        """Return a picture of the last run."""
        with self._reports_memory(f"read {self.plan.resources[resource].name!r}"):
            return self.backend.download(self._storage(resource))

    def result(self, resource: int, results: Results) -> Given:
        """Return a picture in the requested form: the caller's array, the format's dtype, or float32."""
        result = self.caller_arrays.result(resource)
        if result is None:
            info = self.plan.resources[resource]
            with self._reports_memory(f"read {info.name!r} ({info.size[0]}x{info.size[1]} {info.format.name})"):
                dtype = np.dtype(info.format.number if results == "stored" else np.float32)
                result = self.caller_arrays.array(resource, dtype)
                self.backend.download_into(self._storage(resource), result, info.format)
        return result

    def replace(self, resource: int, picture: Picture) -> None:
        """Replace what a step wrote by another picture, to compare pass by pass."""
        self.backend.upload(self._storage(resource), picture)

    def release(self) -> None:
        """Release pictures, meshes and compiled steps."""
        for memory in self.memories:
            self.backend.release(memory)
        for geometry in self._geometries.values():
            self.backend.release_geometry(geometry)
        self.forget()

    def forget(self) -> None:
        """Drop all references; compiled steps refer to this object, so it would wait for the cycle collector."""
        self.memories, self._runs, self._chained = [], [], []
        self._geometries.clear()


def earliest_first(plan: Plan) -> list[tuple[int, int]]:
    """Order the history and its content one run before, so that each is moved before it is overwritten."""
    follows = {r.id: r.history for r in plan.resources if r.history is not None}
    chains: list[tuple[int, int]] = []
    for start in follows.keys() - set(follows.values()):
        chain = [start]
        while chain[-1] in follows:
            chain.append(follows[chain[-1]])
        chains += reversed(list(pairwise(chain)))
    return chains


def _same(one: object, other: object) -> bool:
    plain = (bool, int, float, str, bytes, tuple)
    return one is other or (type(one) is type(other) and isinstance(one, plain) and bool(one == other))


def _contents(value: object) -> object:
    """Return a key of a derived value: numbers as bytes, struct fields one by one."""
    if isinstance(value, (list, tuple)) and any(hasattr(part, "__dict__") for part in value):
        return tuple(map(_contents, value))
    if isinstance(value, np.ndarray) or not hasattr(value, "__dict__"):
        return np.asarray(value, np.float64).tobytes()
    return tuple(_contents(part) for part in vars(value).values())


class Uniforms:
    """The parameters of one stage: constants packed once, run values at each run."""

    def __init__(self, program: ScalarProgram, step: Step, overrides: Overrides) -> None:
        from passgraph.backends.base import Block

        self.step, self.overrides = step, overrides
        self.floats = np.zeros(max(1, program.float_count), np.float32)
        self.ints = np.zeros(max(1, program.int_count), np.int32)
        self.block: Block = Block(self.floats, self.ints)
        self.constant: list[Any] = []
        self.changing: list[Any] = []
        for slot in program.uniforms:
            key, fields = slot.name.whole, slot.name.path
            block = self.floats if slot.block == "float" else self.ints
            place = block[slot.offset : slot.offset + slot.count]
            entry = (key, fields, place, slot, f"{slot.name} of pass {step.name!r}")
            value = step.values[key]
            (self.changing if isinstance(value, (Value, Derived)) else self.constant).append(entry)
        for entry in self.constant:
            self._store(entry, step.values[entry[0]])

    def _store(self, entry: Any, value: object) -> None:
        key, fields, place, slot, name = entry
        place[:] = in_range(picked(value, fields, key), slot.type, slot.range, name)

    def pack(self, values: dict[Any, object]) -> Block:
        """Return the parameter block for this run."""
        for entry in self.changing:
            handle = self.step.values[entry[0]]
            self._store(entry, self.overrides.get((self.step.name, entry[0]), resolve(handle, values)))
        if self.overrides:
            for entry in self.constant:
                key = (self.step.name, entry[0])
                if key in self.overrides:
                    self._store(entry, self.overrides[key])
        return self.block
