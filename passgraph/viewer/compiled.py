"""Compile a drawing to a program that shows one of its targets, and measure the difference of two results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Backend
from passgraph.errors import InputError
from passgraph.formats import FORMATS
from passgraph.graph.calls import kernel
from passgraph.graph.run_values import Value, sources_of
from passgraph.graph.targets import Target
from passgraph.graph.targets import target as declared
from passgraph.language import Image, vec4
from passgraph.pictures import scaled
from passgraph.plan.dependencies import inputs_behind, passes_behind
from passgraph.quantise import numbers_of
from passgraph.run.compile import compile
from passgraph.run.result import Result
from passgraph.viewer.display import shown
from passgraph.viewer.subject import Drawing

#: Largest factor for showing differences.
MOST_GAIN = 4096.0


class Compiled:
    """A drawing compiled for a backend, with a pass that shows one of its targets."""

    def __init__(self, drawing: Drawing, target: str, backend: Backend) -> None:
        self.drawing = drawing
        self.targets = targets_of(drawing.outputs)
        first = next(iter(drawing.outputs.values()))
        #: The target that is shown, and its name among `targets`.
        self.target = self.targets.get(target, first)
        self.target_name = next((name for name, t in self.targets.items() if t == self.target.content), first.name)
        # An input cannot be an output: a pass copies it, as passes read it.
        content = self.target if self.target.made_by else as_read(self.target, into=declared("read", "rgba32f"))
        outputs = {"shown": shown(content), "values": content}
        if any(t.is_previous for node in passes_behind([*drawing.outputs.values()]) for t in node.reads):
            # History is kept of all outputs of the drawing, whichever target is shown.
            outputs |= {f"output {name}": output for name, output in drawing.outputs.items()}
        self.program = compile(outputs, backend, drawing.size, non_finite="keep", results="stored")
        #: Run values by name; unlike the program's plan they exist before the first run.
        self.values = values_of(outputs.values())
        #: The program whose history the next run continues.
        self._earlier: Compiled | None = None

    def follow(self, earlier: Compiled) -> None:
        """Continue the history of an earlier program in the first run, which then closes that program."""
        self._earlier = earlier

    def run(self, run_inputs: Mapping[str, Any]) -> Result:
        earlier, self._earlier = self._earlier, None
        if earlier is not None:
            self._take_history(earlier, run_inputs)
        return self.program(**run_inputs)

    def _take_history(self, earlier: Compiled, run_inputs: Mapping[str, Any]) -> None:
        try:
            if self.program.has_history and earlier.program.backend is self.program.backend:
                self.program.run(**run_inputs)  # sets the size of inputs whose size is open
                self.program.continue_from(earlier.program)
        finally:
            earlier.close()

    def restart(self) -> None:
        """Reset history to its initial values."""
        if self._earlier is not None:
            self._earlier.close()
            self._earlier = None
        self.program.reset()

    def close(self) -> None:
        if self._earlier is not None:
            self._earlier.close()
        self.program.close()


@kernel
def as_read(picture: Image) -> vec4:
    """Copy a picture as passes read it."""
    return picture[0, 0]


def targets_of(outputs: Mapping[str, Target]) -> dict[str, Target]:
    """Return the targets that the outputs depend on, by name, in the order of the passes, and then the inputs.

    A target that several passes draw into has several contents; from the second on, its name ends with a number.
    """
    nodes = passes_behind([*outputs.values()])
    contents = [Target(spec, node, slot) for node in nodes for slot, spec in enumerate(node.into)]
    contents += [Target(spec) for spec in inputs_behind([*outputs.values()]).values()]
    targets: dict[str, Target] = {}
    for content in contents:
        name, number = content.name, 1
        while name in targets:
            number += 1
            name = f"{content.name} ({number})"
        targets[name] = content
    return targets


def values_of(outputs: Iterable[Target]) -> dict[str, Value]:
    """Return the run values of a graph by name."""
    return {source.name: source for node in passes_behind([*outputs]) for source in sources_of(node.values)}


@dataclass(frozen=True)
class Difference:
    """The difference of two results of a target.

    Attributes
    ----------
    largest : the largest absolute difference of a pixel's channels, (height, width); NaN counts as 0
    nan_mismatch : pixels where one result is NaN and the other is not
    """

    largest: NDArray[np.float64]
    nan_mismatch: NDArray[np.bool_]

    @classmethod
    def of(cls, a: Result, b: Result) -> Difference:
        """Compare the channels that both results have."""
        first, second = (scaled(result["values"]).astype(np.float64) for result in (a, b))
        channels = min(first.shape[2], second.shape[2])
        first, second = first[:, :, :channels], second[:, :, :channels]
        with np.errstate(invalid="ignore"):
            largest = np.nan_to_num(np.abs(first - second)).max(axis=2)
        return cls(largest, np.isnan(first).any(axis=2) != np.isnan(second).any(axis=2))

    def picture(self, gain: float) -> NDArray[np.uint8]:
        """Return the differences times gain, black to white; magenta where only one result is NaN."""
        level = np.clip(self.largest * min(gain, MOST_GAIN) * 255.0, 0, 255).astype(np.uint8)
        picture = np.dstack([level, level, level, np.full_like(level, 255)])
        picture[self.nan_mismatch] = (255, 0, 255, 255)
        return picture

    def facts(self) -> dict[str, Any]:
        """Return the largest difference, its position, and the number of pixels that differ."""
        y, x = np.unravel_index(int(self.largest.argmax()), self.largest.shape)
        return {
            "largest": float(self.largest[y, x]),
            "at": [int(x), int(y)],
            "pixels": int(((self.largest > 0) | self.nan_mismatch).sum()),
        }


def flip_map(results: Mapping[str, Result]) -> tuple[NDArray[np.uint8], float]:
    """Return the FLIP map of two results as shown, from black to yellow, and its mean.

    FLIP estimates the difference that a viewer sees when alternating between the pictures, from 0 to 1.
    """
    try:
        from flip_evaluator import evaluate
    except ImportError:
        raise InputError("the FLIP map needs flip-evaluator; run: pip install 'passgraph[flip]'") from None
    first, second = (results[slot]["shown"][:, :, :3].astype(np.float32) / 255.0 for slot in "ab")
    colored, mean, _ = evaluate(second, first, "LDR")
    return numbers_of(colored, FORMATS["rgb8"]), float(mean)
