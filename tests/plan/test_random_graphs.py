"""Random graphs: with any optimisation off, every result is the same, bit for bit, over several runs."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import passgraph as pg
from passgraph import Image, vec4
from passgraph.backends.base import Backend
from passgraph.backends.null import NullBackend
from passgraph.backends.registry import open_backend
from passgraph.plan.emit import disjoint, lifetimes
from passgraph.targets import Target, TargetSpec

copy = pg.kernel(source="def copy(color: Image) -> vec4: return color[0, 0]")
add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] * 0.75 + b[0, 0] * 0.5")
left = pg.kernel(source="def left(color: Image) -> vec4: return color[-1, 0] + color[0, 1] * 0.25")
zoom = pg.kernel(source="def zoom(color: Image) -> vec4: return color.sample(uv())")
gain = pg.kernel(source="def gain(color: Image, by: float) -> vec4: return color[0, 0] * by")
either = pg.kernel(
    source="def either(a: Image, b: Image, use_b: Const[bool]) -> vec4:\n"
    "    result = a[0, 0]\n    if use_b:\n        result = b[0, 0]\n    return result"
)
SIZES = ((12, 9), (6, 5))
FORMATS = ("rgba32f", "rgba16f", "rgba8")
OFF = ("cull", "fuse", "order", "alias", "static", "simplify")


@pg.kernel
def pair(color: Image) -> tuple[vec4, vec4]:
    return color[0, 0] * 0.5, vec4(1.0) - color[0, 0]


@pg.struct
class Corner:
    position: vec4
    tint: pg.vec2


@pg.vertex
def place(vertex: pg.Vertex, shift: float) -> Corner:
    return Corner(vec4(vertex.position + pg.vec3(shift, 0.0, 0.0), 1.0), vertex.uv)


@pg.fragment
def paint(corner: Corner, texture: Image) -> vec4:
    return vec4(texture.sample(corner.tint).rgb, 0.5)


QUAD = pg.Mesh.make(
    np.array([[-0.7, -0.6, 0.2], [0.6, -0.7, 0.4], [0.7, 0.8, 0.6], [-0.5, 0.5, 0.8]], np.float32),
    np.array([[0, 1, 2], [0, 2, 3]]),
    uvs=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32),
)


class Growing:
    """A graph that grows by one pass at a time; ``size`` of each content is known."""

    def __init__(self) -> None:
        self.frame = pg.Input("frame", "rgba32f", SIZES[0])
        self.still = pg.Input("still", "rgba32f", SIZES[0], static=True)
        self.contents: list[tuple[Target, int]] = [(self.frame, 0), (self.still, 0)]
        self.written: list[Target] = []
        self.count = 0

    def spec(self, size: int, format_: str) -> TargetSpec:
        self.count += 1
        return pg.target(f"t{self.count}", format_, SIZES[size])

    def keep(self, target: Target, size: int) -> None:
        self.contents.append((target, size))
        self.written.append(target)

    def grow(self, operation: str, first: int, second: int, size: int, format_: str, flag: bool) -> None:
        # Newest first, so that graphs grow deep.
        a, size_a = self.contents[-1 - first % len(self.contents)]
        b, size_b = self.contents[-1 - second % len(self.contents)]
        name = f"p{self.count}"
        if operation == "zoom" or (operation in ("add", "either", "history") and size_a != size_b):
            self.keep(zoom(a, into=self.spec(size, format_), name=name), size)
        elif operation == "pair":
            for made in pair(a, into=(self.spec(size_a, format_), self.spec(size_a, "rgba32f")), name=name):
                self.keep(made, size_a)
        elif operation == "add":
            self.keep(add(a, b, into=self.spec(size_a, format_), name=name), size_a)
        elif operation == "either":
            self.keep(either(a, b, flag, into=self.spec(size_a, format_), name=name), size_a)
        elif operation == "history":
            last = pg.previous(a) if a.made_by is not None else pg.previous(spec := self.spec(size_a, format_))
            into = self.spec(size_a, format_) if a.made_by is not None else spec
            self.keep(add(b, last, into=into, name=name), size_a)
        elif operation == "gain":
            by = pg.Value("by", float) if flag else 1.25
            self.keep(gain(a, by, into=self.spec(size_a, format_), name=name), size_a)
        elif operation == "draw":
            over = a if a.made_by is not None and not a.spec.format.is_depth and flag else None  # type: ignore[union-attr]
            if over is not None and b.spec is over.spec:
                b = self.frame
            into = over if over is not None else self.spec(size_a, format_)
            self.keep(
                pg.draw(
                    QUAD, vertex=place, fragment=paint, into=into, texture=b, shift=0.25 if flag else 0.0,
                    blend="alpha" if flag else None, name=name,
                ),
                size_a,
            )  # fmt: skip
        else:
            self.keep({"copy": copy, "left": left}[operation](a, into=self.spec(size_a, format_), name=name), size_a)


OPERATIONS = (
    "left",
    "left",
    "left",
    "copy",
    "add",
    "left",
    "gain",
    "either",
    "pair",
    "zoom",
    "draw",
    "history",
)


class Outputs(dict[str, Target]):
    """What to compile; prints as its passes, since graphs share parts and print exponentially long."""

    steps: object = ()

    def __repr__(self) -> str:
        return f"{sorted(self)} of {self.steps}"

    def _repr_pretty_(self, printer, cycle: bool) -> None:  # type: ignore[no-untyped-def]
        printer.text(repr(self))


@st.composite
def graphs(draw: st.DrawFn) -> Outputs:
    """Four to ten passes and one to three outputs."""
    grown = Growing()
    step = st.tuples(
        st.sampled_from(OPERATIONS), st.integers(0, 3), st.integers(0, 9), st.integers(0, 1),
        st.sampled_from(FORMATS), st.booleans(),
    )  # fmt: skip
    steps = draw(st.lists(step, min_size=4, max_size=10))
    for chosen in steps:
        grown.grow(*chosen)
    last = len(grown.written) - 1
    picked = {last, *draw(st.lists(st.integers(0, last), max_size=2))}
    outputs = Outputs({f"out{i}": grown.written[i] for i in sorted(picked)})
    outputs.steps = steps
    return outputs


def run(outputs: dict[str, Target], backend: Backend, options: pg.Options) -> list[dict[str, np.ndarray]]:
    """Three runs: the second has another frame and value, the third another static picture."""
    seen = []
    with pg.compile(outputs, backend, SIZES[0], options) as program:
        inputs = list(program.plan.inputs)
        for frame, still, by in ((0, 0, 0.5), (1, 0, 0.75), (1, 1, 0.75)):
            given: dict[str, object] = {}
            every = {"frame": picture(frame), "still": picture(10 + still), "by": by}
            wanted = {*inputs, *program.plan.values, *program._inputs}
            given = {name: value for name, value in every.items() if name in wanted}
            seen.append(dict(program(**given)))
    return seen


@lru_cache
def picture(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).random((SIZES[0][1], SIZES[0][0], 4)).astype(np.float32)


def compiles(outputs: dict[str, Target]) -> bool:
    """Random history may name a target that no pass behind the outputs writes, which is refused."""
    try:
        pg.compile(outputs, NullBackend(), SIZES[0]).close()
    except pg.GraphError as error:
        if "is read, and no pass behind the outputs writes it" not in str(error):
            raise
        return False
    return True


@settings(max_examples=100, deadline=None, derandomize=True, database=None)
@given(graphs())
def test_plans_never_let_pictures_overlap(outputs: dict[str, Target]) -> None:
    if not compiles(outputs):
        return
    for off in (None, *OFF):
        options = pg.Options() if off is None else replace(pg.Options(), **{off: False})
        with pg.compile(outputs, NullBackend(), SIZES[0], options) as program:
            made = program.plan
            spans = lifetimes(list(made.resources), list(made.steps))
            for one in made.resources:
                for other in made.resources[one.id + 1 :]:
                    assert one.memory != other.memory or disjoint(spans[one.id], spans[other.id])
            written = {resource.id for resource in made.resources if resource.kind != "target"}
            for step in made.steps:
                assert set(step.reads) <= written, "read before it is written"
                written.update(step.writes)
            assert set(made.outputs.values()) <= written


@settings(
    max_examples=12,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
@given(outputs=graphs())
def test_each_optimisation_off_equals_on(outputs: dict[str, Target]) -> None:
    """On the CPU, where compilers do not contract a * b + c, so that bits can be asked for."""
    if not compiles(outputs):
        return
    with open_backend("numpy") as backend:
        expected = run(outputs, backend, pg.Options())
        for off in OFF:
            found = run(outputs, backend, replace(pg.Options(), **{off: False}))
            for number, (one, other) in enumerate(zip(expected, found, strict=True)):
                for name in one:
                    assert np.array_equal(one[name], other[name], equal_nan=True), f"{off} off, run {number}, {name}"


@pytest.mark.slow
@settings(max_examples=40, deadline=None, derandomize=True, database=None)
@given(outputs=graphs())
def test_the_plan_means_what_was_written(outputs: dict[str, Target]) -> None:
    """The reference with everything on, against everything off."""
    if not compiles(outputs):
        return
    everything_off = pg.Options(**dict.fromkeys(OFF, False))
    with open_backend("reference") as backend:
        expected, found = run(outputs, backend, everything_off), run(outputs, backend, pg.Options())
    for one, other in zip(expected, found, strict=True):
        for name in one:
            assert np.array_equal(one[name], other[name], equal_nan=True)
