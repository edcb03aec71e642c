"""A drawing as a program that shows one of its targets, and how far two results are apart."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.errors import InputError
from passgraph.graph.run_values import sources_of
from passgraph.pictures import scaled
from passgraph.plan.dependencies import inputs_behind, passes_behind
from passgraph.viewer.display import shown
from passgraph.viewer.subject import Drawing

#: Largest factor that differences are shown with.
MOST_GAIN = 4096.0


class Compiled:
    """A drawing on one backend, with the pass that shows one of its targets."""

    def __init__(self, drawing: Drawing, target: str, backend: Backend) -> None:
        self.drawing = drawing
        self.targets = targets_of(drawing.outputs)
        first = next(iter(drawing.outputs.values()))
        #: The target that is shown, and its name among `targets`.
        self.target = self.targets.get(target, first)
        self.target_name = next((name for name, one in self.targets.items() if one == self.target.content), first.name)
        # An input is no output: what passes read of it is shown.
        content = self.target if self.target.made_by else as_read(self.target, into=pg.target("read", "rgba32f"))
        outputs = {"shown": shown(content), "values": content}
        if any(t.is_previous for node in passes_behind([*drawing.outputs.values()]) for t in node.reads):
            # History is kept of all that the drawing computes, whatever is looked at.
            outputs |= {f"output {name}": output for name, output in drawing.outputs.items()}
        self.program = pg.compile(outputs, backend, drawing.size, non_finite="keep", results="stored")
        #: Run values by name; unlike the program's plan they are there before the first run.
        self.values = values_of(outputs.values())
        #: Where history comes from before the next run.
        self._earlier: Compiled | None = None

    def follow(self, earlier: Compiled) -> None:
        """Take over history in the first run, and close the earlier program then."""
        self._earlier = earlier

    def run(self, given: Mapping[str, Any]) -> pg.Result:
        earlier, self._earlier = self._earlier, None
        if earlier is not None:
            self._take_history(earlier, given)
        return self.program(**given)

    def _take_history(self, earlier: Compiled, given: Mapping[str, Any]) -> None:
        try:
            if self.program.has_history and earlier.program.backend is self.program.backend:
                self.program.run(**given)  # inputs whose size is open have one now
                self.program.continue_from(earlier.program)
        finally:
            earlier.close()

    def restart(self) -> None:
        """Begin history anew."""
        if self._earlier is not None:
            self._earlier.close()
            self._earlier = None
        self.program.reset()

    def close(self) -> None:
        if self._earlier is not None:
            self._earlier.close()
        self.program.close()


@pg.kernel
def as_read(picture: pg.Image) -> pg.vec4:
    """A picture as passes read it."""
    return picture[0, 0]


def targets_of(outputs: Mapping[str, pg.Target]) -> dict[str, pg.Target]:
    """Every target that a pass behind the outputs writes, by name, in the order of the passes; inputs behind them.

    A target that is drawn over has several contents: from the second on, a number stands behind its name.
    """
    nodes = passes_behind([*outputs.values()])
    contents = [pg.Target(spec, node, slot) for node in nodes for slot, spec in enumerate(node.into)]
    contents += [pg.Target(spec) for spec in inputs_behind([*outputs.values()]).values()]
    found: dict[str, pg.Target] = {}
    for content in contents:
        name, number = content.name, 1
        while name in found:
            number += 1
            name = f"{content.name} ({number})"
        found[name] = content
    return found


def values_of(outputs: Iterable[pg.Target]) -> dict[str, pg.Value]:
    """The run values of a graph by name."""
    return {source.name: source for node in passes_behind([*outputs]) for source in sources_of(node.values)}


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
        """Of the channels that both have."""
        one, other = (scaled(result["values"]).astype(np.float64) for result in (a, b))
        channels = min(one.shape[2], other.shape[2])
        one, other = one[:, :, :channels], other[:, :, :channels]
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


def flip_map(results: Mapping[str, pg.Result]) -> tuple[NDArray[np.uint8], float]:
    """Return the FLIP map of two results as they are shown, from black to yellow, and its mean.

    FLIP says how much of a difference a person sees who alternates between both pictures: 0 none, 1 the most.
    """
    try:
        from flip_evaluator import evaluate
    except ImportError:
        raise InputError("the FLIP map needs flip-evaluator: pip install 'passgraph[view]'") from None
    first, second = (results[slot]["shown"][:, :, :3].astype(np.float32) / 255.0 for slot in "ab")
    colored, mean, _ = evaluate(second, first, "LDR")
    return np.round(255.0 * np.clip(colored, 0.0, 1.0)).astype(np.uint8), float(mean)
