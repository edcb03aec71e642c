"""Windows of a plan: the halo of its results, and the plan that computes one window."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from functools import cache
from itertools import chain, count
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import GraphError
from passgraph.graph.run_values import OUTPUT_SIZE as _PICTURE_SIZE
from passgraph.graph.run_values import Value
from passgraph.graph.targets import Blocks
from passgraph.language import scalar as s
from passgraph.language.borders import border_place
from passgraph.language.builtin_name import OUTPUT_SIZE, PIXEL, size_names
from passgraph.language.parameter_name import ParameterName
from passgraph.language.types import IVEC4
from passgraph.plan.data import PixelStep, Plan, Resource, Step
from passgraph.records import dataclass


class Halo(NamedTuple):
    """A margin of pixels around a rectangle."""

    left: int = 0
    right: int = 0
    up: int = 0
    down: int = 0

    def over(self, other: Halo) -> Halo:
        """Return the larger of both on every side."""
        return Halo(*map(max, self, other))

    def beyond(self, other: Halo) -> Halo:
        """Return the sum of both: this halo around a rectangle with the ``other`` one."""
        return Halo(*(a + b for a, b in zip(self, other, strict=True)))


@dataclass(frozen=True)
class Footprint:
    """The halo and whole inputs of a window of a plan's results.

    Attributes
    ----------
    halo : margin of every input, and of every intermediate target
    uncut : resources that each window reads whole: pictures of another size, such as tables and textures
    wide, high : why a window must be as wide, or as high, as the picture; empty if it need not
    """

    halo: Halo
    uncut: frozenset[int]
    wide: str = ""
    high: str = ""


def footprint(plan: Plan) -> Footprint:
    """Return the footprint of the results' windows.

    Raises
    ------
    GraphError
        If the plan cannot be windowed: a pass draws, reads last run's content, reads anywhere in the picture, or has
        another size than the results; the message names the pass and the remedy.
    """
    size = _result_size(plan)
    uncut = _find_uncut(plan, size)
    needs = {resource.id: Halo() for resource in plan.resources}
    wide = high = ""
    for step in reversed(plan.steps):
        if not isinstance(step, PixelStep) or step.size != size:
            continue
        around = Halo()
        for written in step.outputs:
            around = around.over(needs[written])
        for name, resource in step.images:
            if resource not in uncut:
                use = step.program.image(name)
                needs[resource] = needs[resource].over(_reach(step.program, use).beyond(around))
                across, down = _wraps(step, use, plan.resources[resource])
                wide, high = wide or across, high or down
    halo = Halo()
    for need in needs.values():
        halo = halo.over(need)
    return Footprint(halo, uncut, wide, high)


def is_pointwise(plan: Plan) -> bool:
    """Return True if each pixel of the results depends on the same pixel of the inputs alone, wherever that is."""
    return _PICTURE_SIZE.name not in plan.values and all(
        type(step) is PixelStep
        and not step.program.builtins
        and all(step.program.image(name).pointwise and plan.resources[r].kind != "history" for name, r in step.images)
        for step in plan.steps
    )


def _result_size(plan: Plan) -> tuple[int, int]:
    sizes = {name: plan.resources[resource].size for name, resource in plan.outputs.items()}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"{name} {width}x{height}" for name, (width, height) in sizes.items())
        raise GraphError(
            f"outputs of different sizes cannot be computed tile by tile together ({listed}); "
            "ask for those of one size at a time"
        )
    return next(iter(sizes.values()))


def _find_uncut(plan: Plan, size: tuple[int, int]) -> frozenset[int]:
    """Return the resources that every window reads whole; raise GraphError for passes that cannot be windowed."""
    near = {
        resource
        for step in plan.steps
        if isinstance(step, PixelStep)
        for name, resource in step.images
        if step.program.image(name).relative
    }
    inputs = {resource: name in plan.static_inputs for name, resource in plan.inputs.items()}
    # A static input that is read anywhere is a texture, even if it is as large as the picture.
    uncut = {
        resource
        for resource, static in inputs.items()
        if plan.resources[resource].size != size or (static and resource not in near)
    }
    uncut.update(plan.buffers)
    for step in plan.steps:
        if not isinstance(step, PixelStep):
            _refuse(step, "draws over the whole picture", "compute what it draws apart, and give it as an input")
        history = [plan.resources[r] for r in (*step.reads, *step.writes) if plan.resources[r].history is not None]
        history += [plan.resources[r] for r in step.reads if plan.resources[r].kind == "history"]
        if history:
            _refuse(
                step,
                f"goes on from last run's content (pg.previous) by {history[0].name!r}",
                "give that content as an input",
            )
        inside = [resource for resource in step.reads if resource not in uncut]
        if step.size == size:
            _check_near(step, plan, uncut)
        elif inside:
            _refuse_scaled(step, plan.resources[inside[0]], size)
        else:
            uncut.update(step.outputs)
    return frozenset(uncut)


def _check_near(step: PixelStep, plan: Plan, uncut: set[int]) -> None:
    for name, resource in step.images:
        read = plan.resources[resource]
        if resource not in uncut and step.program.image(name).absolute:
            _refuse(
                step,
                f"reads {read.name!r} at places that it computes (.sample, .texel), which may lie anywhere in it",
                "read it at bounded offsets (image[dx, dy])",
            )


def _refuse_scaled(step: PixelStep, read: Resource, size: tuple[int, int]) -> NoReturn:
    if any(isinstance(spec.size, Blocks) for spec in step.source.into):
        _refuse(
            step,
            f"reduces {read.name!r} ({read.size[0]}x{read.size[1]}) to {step.size[0]}x{step.size[1]} pixels",
            "compute the reduction apart, and give its result as an input",
        )
    _refuse(
        step,
        f"makes {step.size[0]}x{step.size[1]} pixels of {read.name!r} ({read.size[0]}x{read.size[1]}), "
        f"and the results have {size[0]}x{size[1]}",
        "compute it at the results' size, or apart, and give it as an input",
    )


def _refuse(step: Step, reason: str, mend: str) -> NoReturn:
    fused = f" (with {', '.join(step.fused)} inside)" if isinstance(step, PixelStep) and step.fused else ""
    raise GraphError(
        f"the picture cannot be computed tile by tile: pass {step.name!r}{fused} {reason}; {mend}, "
        "or run the program on the whole picture"
    )


def _reach(program: s.ScalarProgram, use: s.ImageUse) -> Halo:
    """Return the halo of a pass's relative reads of one image."""
    if not use.relative:
        return Halo()
    left, right, up, down = max(0, -use.x[0]), max(0, use.x[1]), max(0, -use.y[0]), max(0, use.y[1])
    if any(not _stays(rule) for rule in _rules(program, use)):
        # Some rules mirror at the edge: reads beyond the left edge go to the right of it.
        left = right = max(left, right)
        up = down = max(up, down)
    return Halo(left, right, up, down)


def _rules(program: s.ScalarProgram, use: s.ImageUse) -> set[str]:
    return {i.border for i in s.texel_loads(program.body, use.name) if i.relative}


def _wraps(step: PixelStep, use: s.ImageUse, read: Resource) -> tuple[str, str]:
    """Explain why windows must be as wide and as high as the picture: a border rule that wraps to the other side."""
    rules = [rule for rule in _rules(step.program, use) if not _turns_near(rule)]
    if not rules:
        return "", ""
    why = f"pass {step.name!r} reads {read.name!r} beyond its border by the rule {rules[0]!r}, which leads to the "
    return (
        f"{why}other side: tiles must be as wide as the picture" if use.x != (0, 0) else "",
        f"{why}other side: tiles must be as high as the picture" if use.y != (0, 0) else "",
    )


#: Length of the axis on which border rules are probed, and the distance probed beyond its ends.
_AXIS = 64


@cache
def _beyond(rule: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return positions beyond an axis' start, and where a rule maps them."""
    outside = np.arange(1, _AXIS // 2)
    return outside, border_place(rule, -outside, _AXIS)


def _stays(rule: str) -> bool:
    """Return True if the rule maps reads beyond an edge to the edge itself."""
    return bool((_beyond(rule)[1] == 0).all())


def _turns_near(rule: str) -> bool:
    """Return True if the rule maps reads beyond an edge to the same distance inside it."""
    outside, near = _beyond(rule)
    return bool((near <= outside).all())


def windows(length: int, core: int, before: int, behind: int) -> Iterator[tuple[int, int, int]]:
    """Yield the windows along an axis: start, and begin and end of their valid results.

    All have the same length: those at the ends are moved inward.

    >>> list(windows(10, 4, 1, 2))
    [(0, 0, 4), (3, 4, 8), (3, 8, 10)]
    """
    window = min(length, core + before + behind)
    for begin in range(0, length, core):
        yield min(max(0, begin - before), length - window), begin, min(begin + core, length)


#: Position of the window and size of the picture: (x, y, width, height), in pixels.  No kernel parameter can have this
#: name, as it is no identifier.
WINDOW = Value("tile window", tuple)
WINDOW_PARAMETER = ParameterName(WINDOW.name)


def window_plan(plan: Plan, footprint: Footprint, size: tuple[int, int]) -> Plan:
    """Return the plan of a window of (width, height) pixels; :data:`WINDOW` gives each run its position.

    ``plan`` is that of the whole picture, made without static passes; it is never run.

    Raises
    ------
    GraphError
        If a run value has the name of :data:`WINDOW`.
    """
    if WINDOW.name in plan.values:
        raise GraphError(f"{WINDOW.name!r} is reserved for the value with a tile's position; rename your value")
    inside = [r for r in plan.resources if r.id not in footprint.uncut]
    cut_memories = {r.memory for r in inside}
    resources = tuple(r if r.id in footprint.uncut else replace(r, size=size) for r in plan.resources)
    memories = tuple(replace(m, size=size) if n in cut_memories else m for n, m in enumerate(plan.memories))
    names = {r.id for r in inside}
    steps = tuple(_step(step, plan, names, size) for step in plan.steps)
    return replace(plan, steps=steps, resources=resources, memories=memories, size=size)


def _step(step: Step, plan: Plan, inside: Collection[int], size: tuple[int, int]) -> Step:
    assert isinstance(step, PixelStep)
    if not set(step.outputs) <= set(inside):
        return step
    program = placed(step.program, [name for name, resource in step.images if resource in inside])
    values = step.values if program is step.program else {**step.values, WINDOW_PARAMETER: WINDOW}
    return replace(step, program=program, values=values, size=size)


def placed(program: s.ScalarProgram, inside: Iterable[str]) -> s.ScalarProgram:
    """Return the program of a window; ``inside`` are the images that are windowed too."""
    sizes = [OUTPUT_SIZE, *map(size_names, inside)]
    entries = {name: axis for axis, name in enumerate(PIXEL)}
    entries |= {name: 2 + axis for size in sizes for axis, name in enumerate(size)}
    if not any(name in entries for name, _ in program.builtins):
        return program
    slot = s.UniformSlot(WINDOW_PARAMETER, IVEC4, "int", program.int_count, 4)
    walked = list(s.walk(program.body))
    defined = [*chain.from_iterable(map(s.results_of, walked)), *(i.index for i in walked if isinstance(i, s.For))]
    fresh = (s.Val("int", number) for number in count(max((value.id for value in defined), default=0) + 1))

    def read(i: s.Instruction) -> list[s.Instruction]:
        """Read a builtin from the window's parameter."""
        if not isinstance(i, s.LoadBuiltin) or i.name not in entries:
            return [i]
        entry = s.Lit("int", slot.offset + entries[i.name])
        if i.name not in PIXEL:
            return [s.LoadUniform(i.to, "int", entry)]
        here, origin = next(fresh), next(fresh)
        added = s.Op(i.to, "add", "int", (here, origin))
        return [s.LoadBuiltin(here, i.name), s.LoadUniform(origin, "int", entry), added]

    builtins = tuple((name, type_) for name, type_ in program.builtins if name in PIXEL or name not in entries)
    return replace(program, body=s.rewritten(program.body, read), uniforms=(*program.uniforms, slot), builtins=builtins)
