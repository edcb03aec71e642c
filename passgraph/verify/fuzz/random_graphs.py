"""Random graphs: passes and draws over each other, sizes, formats, borders, history, constants that make dead branches.

A graph is built from a list of steps, so its description is plain data and can be shrunk step by step.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

from passgraph.backends.base import Backend
from passgraph.backends.null import NullBackend
from passgraph.errors import GraphError
from passgraph.formats import format_named
from passgraph.graph.calls import kernel
from passgraph.graph.drawing import draw
from passgraph.graph.reductions import histogram, reduce
from passgraph.graph.run_values import Value
from passgraph.graph.targets import Input, Target, TargetSpec, previous, target
from passgraph.language.borders import BORDERS
from passgraph.language.kernel import Kernel, kernel_from_text
from passgraph.plan.data import Options
from passgraph.run.compile import compile as compile_graph
from passgraph.scene.meshes import Mesh
from passgraph.verify.fuzz.cases import EXACT, Case, Tally, judged, same_bits
from passgraph.verify.fuzz.naive import naive_difference
from passgraph.verify.fuzz.random_kernels import Picture, unit

SIZES = ((12, 9), (6, 5))
#: Formats for random graphs, one of each kind: float, half, unorm of 8 and 16 bits, sRGB.
FORMATS = ("rgba32f", "rgba16f", "rgba8", "rgba16", "rgba8_srgb")
#: The backend for the naive evaluation: it compiles fast, and fusing does not change bits.
NAIVE = "numpy"
OPTIMISATIONS = ("cull", "fuse", "order", "alias", "static", "simplify")
OPERATIONS = (
    "copy", "left", "add", "gain", "curve", "either", "pair", "zoom", "draw", "history", "blur", "reduce", "histogram",
    "draw still",
)  # fmt: skip

PIXEL_KERNELS = {
    "copy": "def copy(color: Image) -> vec4: return color[0, 0]",
    "left": "def left(color: Image) -> vec4: return color[-1, 0] + color[0, 1] * 0.25",
    "add": "def add(a: Image, b: Image) -> vec4: return a[0, 0] * 0.75 + b[0, 0] * 0.5",
    "zoom": "def zoom(color: Image) -> vec4: return color.sample(uv())",
    "gain": "def gain(color: Image, by: float) -> vec4: return color[0, 0] * by",
    "curve": "def curve(c: Image) -> vec4: return sqrt(abs(c[0, 0])) * 0.75 + c[0, 0] * c[0, 0] * 0.125",
    "blur": "def blur(color: Image) -> vec4:\n    total = vec4(0)\n    for i in range(-2, 3):\n"
    "        total += color[i, 0] * 0.2\n    return total",
    "either": "def either(a: Image, b: Image, use_b: Const[bool]) -> vec4:\n"
    "    result = a[0, 0]\n    if use_b:\n        result = b[0, 0]\n    return result",
    "level": "def level(color: Image, top: Image) -> vec4: return color[0, 0] * 0.5 + top.texel(pixel()) * 0.25",
    "pair": "def pair(color: Image) -> tuple[vec4, vec4]: return color[0, 0] * 0.5, vec4(1.0) - color[0, 0]",
}
DRAW_KERNELS = """
class Corner:
    position: vec4
    tint: vec2

def place(vertex: Vertex, shift: float) -> Corner:
    return Corner(vec4(vertex.position + vec3(shift, 0.0, 0.0), 1.0), vertex.uv)

def paint(corner: Corner, texture: Image) -> vec4:
    return vec4(texture.texel(pixel()).rgb * corner.tint.x, 0.5)
"""
QUAD = Mesh.make(
    np.array([[-0.7, -0.6, 0.2], [0.6, -0.7, 0.4], [0.7, 0.8, 0.6], [-0.5, 0.5, 0.8]], np.float32),
    np.array([[0, 1, 2], [0, 2, 3]]),
    uvs=np.array([[0.25, 0], [1, 0], [1, 1], [0.5, 1]], np.float32),
)


class Growing:
    """Builds a graph pass by pass; ``contents`` has every picture with the index of its size."""

    def __init__(self) -> None:
        self.kernels = {name: kernel(source=text, name=name) for name, text in PIXEL_KERNELS.items()}
        self.place = Kernel(kernel_from_text(DRAW_KERNELS, "place"), "vertex")
        self.paint = Kernel(kernel_from_text(DRAW_KERNELS, "paint"), "fragment")
        self.frame = Input("frame", "rgba32f", SIZES[0])
        self.still = Input("still", "rgba32f", SIZES[0], static=True)
        self.contents: list[tuple[Target, int]] = [(self.frame, 0), (self.still, 0)]
        self.written: list[Target] = []
        self.count = 0

    def spec(self, size: int, format_: str) -> TargetSpec:
        self.count += 1
        return target(f"t{self.count}", format_, SIZES[size])

    def keep(self, target: Target, size: int) -> None:
        self.contents.append((target, size))
        self.written.append(target)

    def grow(self, operation: str, first: int, second: int, size: int, format_: str, flag: bool, border: str) -> None:
        """Add a pass; ``first`` and ``second`` count contents back from the newest, so that graphs get deep."""
        a, size_a = self.contents[-1 - first % len(self.contents)]
        b, size_b = self.contents[-1 - second % len(self.contents)]
        named: dict[str, Any] = {"name": f"p{self.count}"}
        kernel = self.kernels.get(operation)
        if operation == "zoom" or (operation in ("add", "either", "history") and size_a != size_b):
            self.keep(self.kernels["zoom"](a.border(border), into=self.spec(size, format_), **named), size)
        elif operation == "pair":
            for one in self.kernels["pair"](
                a, into=(self.spec(size_a, format_), self.spec(size_a, "rgba32f")), **named
            ):
                self.keep(one, size_a)
        elif operation == "history":
            self._history(a, b, size_a, format_, flag, named)
        elif operation in ("reduce", "histogram"):
            self._reduce(operation, a, size_a, format_, flag, border, named)
        elif operation in ("draw", "draw still"):
            self._draw(a, b if operation == "draw" else self.still, size_a, format_, flag, named)
        else:
            assert kernel is not None
            more = {"add": (b,), "either": (b, flag), "gain": (Value("by", float) if flag else 1.25,)}
            arguments = (a if operation == "either" else a.border(border), *more.get(operation, ()))
            self.keep(kernel(*arguments, into=self.spec(size_a, format_), **named), size_a)

    def _history(self, a: Target, b: Target, size: int, format_: str, flag: bool, named: dict[str, Any]) -> None:
        into = self.spec(size, format_)
        last = previous(a if a.made_by is not None else into, 2 if flag else 1)
        self.keep(self.kernels["add"](b, last, into=into, **named), size)

    def _reduce(
        self, operation: str, a: Target, size: int, format_: str, flag: bool, border: str, named: dict[str, Any]
    ) -> None:
        """Reduce to one texel, to one per row, or to bins, and read the result under the border rule."""
        into = self.spec(size, format_)
        name = f"{into.name} top"
        if operation == "histogram":
            top = histogram(a, 17 if flag else 3, channel=1 if flag else "luma", low=0.125, high=0.75, name=name)
        else:
            top = reduce(a, "max", name=name) if flag else reduce(a, "mean", axis="x", name=name)
        self.keep(self.kernels["level"](a, top.border(border), into=into, **named), size)

    def _draw(self, a: Target, b: Target, size: int, format_: str, flag: bool, named: dict[str, Any]) -> None:
        """Draw into a new target, or blend over existing content."""
        can = a.made_by is not None and isinstance(a.spec, TargetSpec) and a.spec.format.blendable
        over = can and flag
        if over and b.spec is a.spec:
            b = self.frame
        blend = "alpha" if flag and (over or format_named(format_).blendable) else None
        drawn = draw(
            QUAD, vertex=self.place, fragment=self.paint, into=a if over else self.spec(size, format_),
            texture=b, shift=0.25 if flag else 0.0, blend=blend, **named,
        )  # fmt: skip
        self.keep(drawn, size)


def grown(case: Case) -> dict[str, Target]:
    """Return the outputs of a description."""
    growing = Growing()
    for step in case["steps"]:
        growing.grow(*step)
    last = len(growing.written) - 1
    return {f"out{i}": growing.written[i] for i in sorted({last, *(n % (last + 1) for n in case["outputs"])})}


@st.composite
def graphs(draw: st.DrawFn, most: int = 10) -> Case:
    """Generate two to ten passes and one to three outputs: a case of kind ``graph``."""
    step = st.tuples(
        st.sampled_from(OPERATIONS), st.integers(0, 3), st.integers(0, 9), st.integers(0, 1),
        st.sampled_from(FORMATS), st.booleans(), st.sampled_from(tuple(BORDERS)),
    )  # fmt: skip
    steps = draw(st.lists(step.map(list), min_size=2, max_size=most))
    outputs = draw(st.lists(st.integers(0, most), max_size=2))
    return {"kind": "graph", "steps": steps, "outputs": outputs, "off": draw(st.sampled_from(OPTIMISATIONS))}


def plannable(outputs: dict[str, Target]) -> bool:
    """Return False if random history names a target that no pass behind the outputs writes, which is an error."""
    try:
        compile_graph(outputs, NullBackend()).close()
    except GraphError as error:
        if "is read, and no pass behind the outputs writes it" not in str(error):
            raise
        return False
    return True


@cache
def frames() -> tuple[Mapping[str, Any], ...]:
    """Return the inputs of five runs: a new frame each, and in a later run another static picture. The same array
    object counts as unchanged, so passes that depend only on it run once."""
    stills = unit(10, SIZES[0]), unit(11, SIZES[0])
    rows = ((0, 0, 0.5), (1, 0, 0.75), (2, 0, 0.75), (2, 1, 0.25), (3, 1, 0.25))
    return tuple({"frame": unit(frame, SIZES[0]), "still": stills[still], "by": by} for frame, still, by in rows)


def run_frames(outputs: dict[str, Target], backend: Backend, options: Options) -> list[dict[str, Picture]]:
    """Return the results of each of `frames`."""
    results = []
    with compile_graph(outputs, backend, options=options) as program:
        names = {*program.plan.inputs, *program.plan.values, *program.inputs}
        for every in frames():
            results.append(dict(program(**{name: value for name, value in every.items() if name in names})))
    return results


def different(
    outputs: dict[str, Target], backend: Backend, one: Options, other: Options, expected: list[Any] | None = None
) -> str:
    """Return where two ways of running a graph differ in a bit; empty if they do not."""
    expected = run_frames(outputs, backend, one) if expected is None else expected
    results = run_frames(outputs, backend, other)
    for number, (a, b) in enumerate(zip(expected, results, strict=True)):
        for name in a:
            if not same_bits(a[name], b[name]):
                apart = np.argwhere(~((a[name] == b[name]) | (np.isnan(a[name]) & np.isnan(b[name]))))
                return f"{name} of run {number} differs at (row, column, channel) {apart[0].tolist()}"
    return ""


def needed_inputs(outputs: dict[str, Target]) -> dict[str, Any]:
    """Return the inputs and values of a single run."""
    needed = {"frame": unit(0, SIZES[0]), "still": unit(10, SIZES[0]), "by": 0.5}
    with compile_graph(outputs, NullBackend(), options=Options(cull=False)) as program:
        names = {*program.plan.inputs, *program.plan.values, *program.inputs}
    return {name: value for name, value in needed.items() if name in names}


def graph_outcome(case: Case, outputs: dict[str, Target], backends: list[Backend], tally: Tally) -> str:
    """Return the oracle's verdict on every pass, then compare runs with one optimization off and all on, bit for
    bit."""
    if not plannable(outputs):
        tally.refused += 1
        return ""
    why = judged(outputs, backends, tally, **needed_inputs(outputs))
    if why:
        return why
    off = Options.without(case["off"])
    for backend in backends:
        if backend.name in EXACT or case["off"] not in ("fuse", "simplify"):
            why = different(outputs, backend, Options(), off)
            if why:
                return f"{backend.name}: with {case['off']} off, {why}"
        if backend.name == NAIVE:
            for options in (Options(), off):
                if why := naive_difference(outputs, backend, frames(), options):
                    return f"{backend.name}: {why}"
    return ""
