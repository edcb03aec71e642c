"""Chains: consecutive pixel steps that a backend may make one, since what lies between is read by them alone.

They are of one size; or they count bins together (:func:`passgraph.plan.known.counting_of`), from the step that finds
the numbers of bins on.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from passgraph.language import scalar as s
from passgraph.plan.data import PixelStep, Plan, Step
from passgraph.plan.known import counting_of

#: Steps of a chain at most.  What a chain computes again around a piece grows with its length, and one kernel of many
#: passes takes long to compile; longer rows of passes become several chains.
MAX_STEPS = 16
#: Instructions of all its steps together: beyond that the way to memory and back is little beside them.  Steps that are
#: long stand alone, and steps alike are compiled once then (128 passes of some 80 instructions each: 12 s together, 3
#: apart).
MAX_INSTRUCTIONS = 2000


class Chains:
    """Where the chains of a plan may begin and end; what hangs on the whole plan is looked up once."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        writers = Counter(resource for step in plan.steps for resource in step.writes)
        #: Resource → the first and the last step that reads it.
        readers: dict[int, tuple[int, int]] = {}
        for number, step in enumerate(plan.steps):
            for resource in step.reads:
                readers[resource] = (readers.get(resource, (number, number))[0], number)
        #: Instructions of each step.
        self.lengths = [_length(step) for step in plan.steps]
        never = (-1, len(plan.steps))
        #: For each step the first and the last that read what it writes, as far as a chain may hold that.
        self.spans: list[tuple[int, int]] = []
        for number, step in enumerate(plan.steps):
            spans = [(number, number)]
            for written in step.writes:
                picture = plan.resources[written]
                kept = picture.persistent or picture.history is not None or writers[written] > 1
                spans.append(never if kept else readers.get(written, (number, number)))
            self.spans.append((min(first for first, _ in spans), max(last for _, last in spans)))

    def ends(self, start: int) -> Iterator[int]:
        """Steps before which a chain that begins with step ``start`` may end, the longest chain first."""
        if not self.plan.options.fuse:
            return
        yield from self._ends_of_counting(start)
        closed: list[int] = []
        last = start  # that reads what the chain's steps but its last write
        length = 0
        for end in range(start + 1, min(start + MAX_STEPS, len(self.plan.steps)) + 1):
            length += self.lengths[end - 1]
            if length > MAX_INSTRUCTIONS or not self._alike(start, end - 1):
                break
            if end > start + 1 and last < end:
                closed.append(end)
            first, last_reader = self.spans[end - 1]
            last = max(last, last_reader if first >= start else len(self.plan.steps))
        yield from reversed(closed)

    def _ends_of_counting(self, start: int) -> Iterator[int]:
        """Those of what counts bins together: the longest adds up all rows there are."""
        steps: list[PixelStep] = []
        found: list[int] = []
        for end, step in enumerate(self.plan.steps[start : start + MAX_STEPS], start + 1):
            if not isinstance(step, PixelStep) or (steps and step.static != steps[0].static):
                break
            steps.append(step)
            if len(steps) > 1 and counting_of(steps) is None:
                break
            closed = all(first >= start and last < end for first, last in self.spans[start : end - 1])
            found += [end] * (closed and len(steps) > 1)
        yield from reversed(found)

    def _alike(self, start: int, number: int) -> bool:
        first, step = self.plan.steps[start], self.plan.steps[number]
        if not isinstance(step, PixelStep) or step.known is not None:  # which devices do in ways of their own
            return False
        return step.size == first.size and step.static == first.static


def _length(step: Step) -> int:
    return s.count(step.program.body) if isinstance(step, PixelStep) else 0
