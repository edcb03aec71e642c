"""Time each pass: `passgraph.Program.profile`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from time import perf_counter

from passgraph.plan.data import PixelStep, Plan, Step

#: A row for more than this many fused passes names only the first and the last.
_NAME_COLUMNS = 64


@dataclass(frozen=True)
class PassTime:
    """The time of a pass, or of several that the backend runs as one.

    Attributes
    ----------
    name : the pass's; several are joined by " + "; passes computed inside another are in brackets
    passes : the names of all its passes, in order
    size : (width, height) of its target, pixels
    seconds : the median over the runs; 0 for a static pass that did not run again
    share : fraction of the whole run, 0 to 1
    """

    name: str
    passes: tuple[str, ...]
    size: tuple[int, int]
    seconds: float
    share: float

    @property
    def pixels_per_second(self) -> float:
        """Return the speed in pixels of its target per second; infinite if it did not run."""
        return self.size[0] * self.size[1] / self.seconds if self.seconds else float("inf")


@dataclass(frozen=True)
class Profile:
    """Times of a program's passes; ``str()`` is a table.

    Attributes
    ----------
    backend : its name
    runs : number of timed runs, after one that is not timed
    seconds : the median of a whole run, from inputs to the last pass; reading results back is not included
    passes : in execution order
    """

    backend: str
    runs: int
    seconds: float
    passes: tuple[PassTime, ...]

    @property
    def rest(self) -> float:
        """Return the seconds of a run outside of passes: inputs, values, history."""
        return max(0.0, self.seconds - sum(each.seconds for each in self.passes))

    def __str__(self) -> str:
        rows = [("pass", "size", "ms", "share", "Mpixel/s")]
        for each in self.passes:
            width, height = each.size
            if each.seconds:
                figures = (f"{each.seconds * 1e3:.3f}", f"{each.share:.1%}", f"{each.pixels_per_second / 1e6:.4g}")
            else:
                figures = ("0", "", "kept")
            rows.append((_short(each), f"{width}x{height}", *figures))
        share = self.rest / self.seconds if self.seconds else 0.0
        rows.append(("inputs, values, history", "", f"{self.rest * 1e3:.3f}", f"{share:.1%}", ""))
        rows.append((f"a run on {self.backend}, median of {self.runs}", "", f"{self.seconds * 1e3:.3f}", "", ""))
        widths = [max(len(row[column]) for row in rows) for column in range(5)]
        return "\n".join(
            "  ".join(
                cell.ljust(width) if column < 2 else cell.rjust(width)
                for column, (cell, width) in enumerate(zip(row, widths, strict=True))
            ).rstrip()
            for row in rows
        )


class Stopwatch:
    """Times each step of each run; waits for the device before and after each step."""

    def __init__(self, finish: Callable[[], None]) -> None:
        self._finish = finish
        self._runs: list[tuple[float, dict[int, float]]] = []

    def run(self, run: Callable[[], None]) -> None:
        """Time a whole run, which calls :meth:`step` for its steps."""
        self._steps: dict[int, float] = {}
        self._finish()
        start = perf_counter()
        run()
        self._finish()
        self._runs.append((perf_counter() - start, self._steps))

    def step(self, step: Step, execute: Callable[[], None]) -> None:
        self._finish()
        start = perf_counter()
        execute()
        self._finish()
        self._steps[id(step)] = perf_counter() - start

    def profile(self, backend: str, plan: Plan, ends: Sequence[Step]) -> Profile:
        """Return the median times; ``ends``: the last step of each timed unit."""
        total = median(seconds for seconds, _ in self._runs)
        rows, first = [], 0
        for end in ends:
            last = plan.steps.index(end)
            steps, first = plan.steps[first : last + 1], last + 1
            seconds = median(times.get(id(end), 0.0) for _, times in self._runs)
            rows.append(
                PassTime(
                    " + ".join(_name(step) for step in steps),
                    tuple(name for step in steps for name in _passes(step)),
                    end.size,
                    seconds,
                    seconds / total if total else 0.0,
                )
            )
        return Profile(backend, len(self._runs), total, tuple(rows))


def _short(row: PassTime) -> str:
    names = row.name.split(" + ")
    return row.name if len(row.name) <= _NAME_COLUMNS else f"{names[0]} + … + {names[-1]} ({len(names)} as one)"


def _passes(step: Step) -> tuple[str, ...]:
    return (*(step.fused if isinstance(step, PixelStep) else ()), step.name)


def _name(step: Step) -> str:
    inner = step.fused if isinstance(step, PixelStep) else ()
    return f"{step.name} [{', '.join(inner)}]" if inner else step.name
