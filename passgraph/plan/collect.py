"""First phase: collect all passes and inputs behind the outputs, check them, and resolve formats and sizes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from passgraph.errors import GraphError
from passgraph.formats import Format, format_named
from passgraph.graph.run_values import Value, sources_of
from passgraph.graph.targets import InputSpec, Pass, Target, TargetSpec
from passgraph.plan.dependencies import inputs_of, passes_behind
from passgraph.plan.draft import Collected
from passgraph.plan.sizes import Sizes


def collect(
    outputs: Mapping[str, Target],
    size: tuple[int, int] | None,
    inputs: Mapping[str, tuple[Format, tuple[int, int]]],
    in_windows: bool = False,
) -> Collected:
    """Return the passes behind ``outputs``; arguments are those of :func:`passgraph.plan.build.build`."""
    if not outputs:
        raise GraphError("nothing to compile: give at least one target")
    for name, target in outputs.items():
        _check_output(name, target)
    passes = passes_behind(list(outputs.values()))
    bound = _bind_inputs(passes, inputs)
    _check_names(passes)
    _check_values(passes, bound)
    sizes = Sizes(outputs, bound, size, in_windows)
    sized = sizes.of_passes(passes)
    written = dict.fromkeys(spec for node in passes for spec in node.into)
    final = _final_contents(passes)
    _check_starts(final, sizes.found)
    return Collected(
        outputs=dict(outputs), size=sizes.of_output(), inputs=bound, passes=sized, sizes=sizes.found, final=final,
        notes=tuple(note for spec in written for note in spec.notes),
    )  # fmt: skip


def _check_output(name: str, target: object) -> None:
    if isinstance(target, TargetSpec):
        raise GraphError(f"target {target.name!r} is declared but not written; compile what its pass returned")
    if not isinstance(target, Target):
        raise GraphError(f"output {name!r} must be a target, got {type(target).__name__}")
    if target.made_by is None:
        what = "an earlier frame's content" if target.is_previous else "an input"
        raise GraphError(f"output {name!r} is {what}, which no pass computes; put a pass behind it")


def _bind_inputs(
    passes: list[Pass], known_inputs: Mapping[str, tuple[Format, tuple[int, int]]]
) -> dict[InputSpec, tuple[Format, tuple[int, int]]]:
    specs = inputs_of(passes)
    bound = {}
    for name, spec in specs.items():
        given_format, given_size = known_inputs.get(name, (None, None))
        format_ = spec.format or given_format
        size = spec.size or given_size
        if format_ is None or size is None:
            raise GraphError(
                f"input {name!r} has no size or format yet; run the program with it, or "
                f"declare them: pg.Input({name!r}, 'rgba32f', (w, h))"
            )
        bound[spec] = (format_named(format_), size)
    return bound


def _check_names(passes: list[Pass]) -> None:
    """Check that each name means one target, so that results and messages are unambiguous."""
    names: dict[str, TargetSpec] = {}
    for node in passes:
        for spec in node.writes:
            if names.setdefault(spec.name, spec) is not spec:
                raise GraphError(
                    f"two different targets are called {spec.name!r} (one in pass {node.name!r}); give them two names"
                )


def _check_values(passes: list[Pass], inputs: Mapping[InputSpec, object]) -> None:
    """Check that each name means one run value and no input, as runs set both by name."""
    values_by_name: dict[str, Value] = {}
    names = {spec.name for spec in inputs}
    for node in passes:
        for value in sources_of(node.values):
            first = values_by_name.setdefault(value.name, value)
            if first.type is not value.type or first.static != value.static:
                raise GraphError(
                    f"two different values are called {value.name!r} (one in pass {node.name!r}); "
                    "use one handle, or give them two names"
                )
            if value.name in names:
                raise GraphError(f"an input and a value are both called {value.name!r}; give them two names")


def _final_contents(passes: list[Pass]) -> dict[TargetSpec, Target]:
    writers = {spec: node for node in passes for spec in node.writes}  # the last writer of each
    final: dict[TargetSpec, Target] = {}
    for spec in dict.fromkeys(t.spec for node in passes for t in node.reads if t.is_previous):
        assert isinstance(spec, TargetSpec)
        if spec not in writers:
            raise GraphError(
                f"an earlier frame's {spec.name!r} is read, and no pass behind the outputs writes it; compile its pass "
                "too"
            )
        last = writers[spec]
        slot = last.into.index(spec) if spec in last.into else -1
        final[spec] = Target(spec, last, slot)
    return final


def _check_starts(specs: Iterable[TargetSpec], sizes: Mapping[TargetSpec, tuple[int, int]]) -> None:
    """Check that initial pictures of history are as large as their targets."""
    for spec in specs:
        width, height = sizes[spec]
        if isinstance(spec.initial, np.ndarray) and spec.initial.shape[:2] != (height, width):
            initial_size = "x".join(map(str, reversed(spec.initial.shape[:2])))
            raise GraphError(
                f"target {spec.name!r} starts from a picture of {initial_size} pixels and is {width}x{height}; give "
                "one of its size, or a color"
            )
