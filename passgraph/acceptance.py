"""How far a conforming backend may be from the reference: one table, by operation and format.

Each row of :data:`passgraph.language.operations.OPERATIONS` states how many ULP of float32 a conforming
backend's result may lie off.  What this means for a pixel is found by stochastic arithmetic: the reference
runs a pass again, each operation moved up or down by its whole bound at random, and the spread of the
results estimates what rounding may do to that pixel: cancellation, poles and neighbours included.  It is an
estimate from few samples, not a proof; what it says is the same for every test, and none has an epsilon of its own.

Source: D. S. Parker, Monte Carlo Arithmetic, UCLA CSD-970002, 1997; J. Vignes, A stochastic arithmetic for
reliable scientific computation, Math. Comput. Simul. 35 (1993).  Deviation: two-sided full-bound steps
instead of uniform noise, so that few samples suffice.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.draw_pass import ReferenceDrawPass
from passgraph.backends.reference.images import SampledImage
from passgraph.backends.reference.number_domain import NumberDomain, Numbers
from passgraph.backends.reference.pixel_pass import ReferencePixelPass
from passgraph.backends.reference.stage import BoundStage, Builtins, Stage
from passgraph.backends.reference.storage import Storage
from passgraph.formats import Format
from passgraph.language import ir
from passgraph.language.lower import Facts
from passgraph.language.operations import OPERATIONS
from passgraph.language.scalar import ScalarProgram
from passgraph.plan.data import CopyStep, DrawStep, PixelStep, Step

Picture = NDArray[np.float32]

#: One ULP of float32 relative to the value is at most this.
ULP = 2.0**-23
#: Noisy runs of the reference for each pass.
SAMPLES = 4
#: The spread of few samples times this covers rounding worse than theirs.  A judgement, not a derivation: samples step
#: by whole bounds where real rounding is spread within them; planted errors in passes and draws are still caught.
SPREAD = 4.0
#: ULP that interpolation over a triangle may lose, relative to the largest value of the draw: three
#: products, two sums, a quotient (2.5) and the quotient 1/w (2.5), each twice for weights and values.
INTERPOLATION_ULP = 8.0
#: How far a triangle's corner may lie from where the reference has it, in pixels.  The reference snaps to
#: 1/256; OpenGL leaves the grid and its rounding open, and drivers interpolate from unsnapped positions.
SNAP_PX = 1.0 / 256.0


@dataclass(frozen=True, slots=True)
class StoreBound:
    """What storing adds, in steps of the format at the stored value."""

    kind: str
    steps: float
    reason: str


#: By kind of format.
STORES = {
    row.kind: row
    for row in (
        StoreBound("float", 2.0, "stored as computed; one ULP for the result, one for how the reference rounds"),
        StoreBound("half", 1.0, "kernels quantise to nearest even; near a half-way point the neighbour is right too"),
        StoreBound(
            "unorm8",
            1.0,
            "kernels quantise to nearest even; near a half-way point the neighbour is right too",
        ),
        StoreBound(
            "unorm16",
            1.0,
            "kernels quantise to nearest even; near a half-way point the neighbour is right too",
        ),
        StoreBound(
            "depth",
            2.0 * INTERPOLATION_ULP,
            "interpolated in float32 from corners whose own depth is off as much",
        ),
    )
}


@dataclass(frozen=True, slots=True)
class OperationClass:
    """What a pass does, as far as it decides how many pixels may lie outside their bound."""

    name: str
    outside: float  # ceiling, as a share of all pixels
    reason: str


SMOOTH = OperationClass("arithmetic", 0.0, "continuous in its inputs: the bound holds at every pixel")
GATHER = OperationClass("sums over neighbours", 0.0, "continuous in its inputs: the bound holds at every pixel")
DECISION = OperationClass(
    "decisions", 0.001, "a comparison or a floor may fall the other way where its operands nearly meet"
)
DRAW = OperationClass(
    "draw", 0.01, "a corner's rounding may move an edge across a pixel's centre, or swap two equal depths"
)
COPY = OperationClass("copy", 0.0, "bits are moved")
#: Rows whose result jumps.
JUMPS = {
    "less", "less_equal", "greater", "greater_equal", "equal", "not_equal", "floor", "ceil", "trunc", "round",
    "fract", "mod", "step", "sign", "to_int", "float_floor_divide", "bits_from_float",
}  # fmt: skip


def operation_class(step: Step) -> OperationClass:
    """The class of a step, from the operations that its kernel uses."""
    if isinstance(step, CopyStep):
        return COPY
    if isinstance(step, DrawStep):
        return DRAW
    if any(name in JUMPS for name in operations_of(step.source.kernel.program)):
        return DECISION
    return SMOOTH if all(use.pointwise for use in step.program.images) else GATHER


def operations_of(node: object) -> Iterator[str]:
    """Names of every applied row in a typed program, as often as they occur."""
    if isinstance(node, tuple):
        for part in node:
            yield from operations_of(part)
    elif dataclasses.is_dataclass(node) and type(node).__module__ == "passgraph.language.ir":
        if hasattr(node, "operation"):
            yield node.operation
        for entry in dataclasses.fields(node):
            yield from operations_of(getattr(node, entry.name))


def step_size(format_: Format, picture: Picture) -> NDArray[np.float64]:
    """The distance between neighbouring stored values at each value of a picture."""
    size = np.abs(np.asarray(picture, np.float64))
    finite = np.where(np.isfinite(size), size, 0.0)
    if format_.kind == "half":
        return np.exp2(np.maximum(np.floor(np.log2(np.maximum(finite, 2.0**-14))), -14.0) - 10.0)
    if format_.kind in ("unorm8", "unorm16"):
        # A step between two stored values is itself rounded to float32, once at either end.
        return np.full(size.shape, format_.unit + ULP)
    if format_.kind == "depth":
        return np.full(size.shape, 2.0**-24)  # of 1, the largest depth
    # Denormals may be flushed, so a step is never below the smallest normal number.
    return np.maximum(finite * ULP, 2.0**-126)


def bounds(format_: Format, reference: Picture, spread: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far each value may lie from the reference.

    Parameters
    ----------
    format_
        Of the target.
    reference
        (h, w, channels), what the reference stored.
    spread
        Likewise, the largest distance of a noisy sample from it.
    """
    return SPREAD * spread + STORES[format_.kind].steps * step_size(format_, reference)


def largest_term(operation: str, arguments: Sequence[Numbers]) -> Numbers:
    """For sums of terms that may cancel (OF_TERMS), what their rounding is relative to; 0 for all others."""
    sizes = [np.abs(argument) for argument in arguments]
    if operation == "mod":
        return np.asarray(sizes[0])
    if operation == "mix":
        return np.asarray(np.maximum(sizes[0], sizes[1]))
    if operation in ("dot", "matmul"):
        return OPERATIONS[operation].reference(*sizes)
    if operation in ("cross", "reflect", "refract"):
        # Every term is a product of a component of one vector and components of the other.
        one, other = (np.max(size, axis=-1, keepdims=True) for size in sizes[:2])
        return np.asarray(one * np.maximum(other, other * other if operation != "cross" else other))
    return np.zeros(())


class NoisyDomain(NumberDomain):
    """Numbers where each operation is off by its whole bound, up or down at random."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)

    def apply(self, operation: str, arguments: Sequence[Numbers]) -> Numbers:
        exact = super().apply(operation, arguments)
        row = OPERATIONS[operation]
        if exact.dtype.kind != "f" or not (row.ulp or row.absolute):
            return exact
        magnitude = np.maximum(np.abs(exact), largest_term(operation, arguments))
        moved = exact + self.signs(exact.shape) * (magnitude * (row.ulp * ULP) + row.absolute)
        if row.ulp > 0.5 or row.kind != "primitive":
            return moved
        # A correctly rounded operation hits what float32 can hold: whole numbers stay whole.
        return np.where(exact.astype(np.float32) == exact, exact, moved)

    def signs(self, shape: tuple[int, ...]) -> NDArray[np.float64]:
        return self.random.integers(0, 2, shape).astype(np.float64) * 2.0 - 1.0


class _NoisyStage(Stage):
    """A stage in noisy numbers."""

    def __init__(
        self,
        program: ir.Program,
        scalar: ScalarProgram,
        facts: Facts,
        noise: NoisyDomain,
        size: tuple[int, int] = (1, 1),
    ) -> None:
        super().__init__(program, scalar, facts)
        self.domain = self.noise = noise
        self.size = size  # of the picture drawn into, for vertex kernels

    def bind(self, block: Block, names: Sequence[str] = (), storages: Sequence[Storage] = ()) -> BoundStage:
        return _NoisyBoundStage(self, block, super().bind(block, names, storages).images)


class _NoisyBoundStage(BoundStage):
    """Fragments get noisy varyings too."""

    def __init__(self, stage: _NoisyStage, block: Block, images: dict[str, SampledImage]) -> None:
        super().__init__(stage, block, images)
        self.noise, self.size = stage.noise, stage.size

    def run(self, count: int, builtins: Builtins) -> tuple[list[Numbers], NDArray[np.bool_] | None]:
        results, keep = super().run(count, {name: self._varied(name, value) for name, value in builtins.items()})
        if self.program.stage == "vertex":
            names = [result.name for result in self.program.results]
            at = names.index("position")
            results[at] = self._moved(results[at])
        return results, keep

    def _moved(self, clip: Numbers) -> Numbers:
        """Corners moved by a step of the subpixel grid: 2 / size of clip space is a pixel."""
        step = np.array([2.0 / self.size[0], 2.0 / self.size[1]]) * SNAP_PX
        moved = clip.copy()
        moved[:, :2] += self.noise.signs((len(clip), 2)) * step * clip[:, 3:]
        return moved

    def _varied(self, name: str, value: Callable[[], Numbers]) -> Callable[[], Numbers]:
        if not name.startswith("varying."):
            return value

        def disturbed() -> Numbers:
            exact = value()
            if not exact.size:
                return exact
            largest = np.abs(exact).max(axis=0, keepdims=True)
            noisy: Numbers = exact + self.noise.signs(exact.shape) * largest * (INTERPOLATION_ULP * ULP)
            return noisy

        return disturbed


class NoisyReference(ReferenceBackend):
    """The reference with rounding noise: what another backend may compute."""

    def __init__(self, seed: int = 0) -> None:
        super().__init__()
        self.noise = NoisyDomain(seed)

    def pixel_pass(self, step: PixelStep) -> ReferencePixelPass:
        made = super().pixel_pass(step)
        made.stage = _NoisyStage(step.source.kernel.program, step.program, step.facts, self.noise)
        return made

    def draw_pass(self, step: DrawStep) -> ReferenceDrawPass:
        made, source = super().draw_pass(step), step.source
        made.vertex = _NoisyStage(source.vertex.program, step.vertex, step.vertex_facts, self.noise, step.size)
        if source.fragment is not None and step.fragment is not None:
            made.fragment = _NoisyStage(source.fragment.program, step.fragment, step.fragment_facts, self.noise)
        return made
