"""Chains: consecutive pixel steps that a backend may run piece by piece, so that rows between them stay in cache."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from passgraph.language import scalar as s
from passgraph.plan.data import CountStep, PixelStep, Plan, Step

#: Most steps of a chain.  The halo that a chain recomputes around each piece grows with its length, and one kernel of
#: many passes compiles slowly; longer sequences of passes become several chains.
MAX_STEPS = 16
#: Most instructions of a chain's steps together: for longer ones, memory traffic is small compared with the
#: computation.  Long steps run singly, so equal ones are compiled once (128 passes of some 80 instructions each: 12 s
#: as chains, 3 s singly).
MAX_INSTRUCTIONS = 2000


class Chains:
    """The possible starts and ends of a plan's chains; properties of the whole plan are computed once."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        writers = Counter(resource for step in plan.steps for resource in step.writes)
        #: Resource → the first and the last step that reads it.
        readers: dict[int, tuple[int, int]] = {}
        for number, step in enumerate(plan.steps):
            for resource in step.reads:
                readers[resource] = (readers.get(resource, (number, number))[0], number)
        #: Number of instructions of each step.
        self.lengths = [_instruction_count(step) for step in plan.steps]
        never = (-1, len(plan.steps))
        #: For each step the first and the last readers of its output, within the length of a chain.
        self.spans: list[tuple[int, int]] = []
        for number, step in enumerate(plan.steps):
            spans = [(number, number)]
            for written in step.writes:
                picture = plan.resources[written]
                stays = picture.persistent or picture.history is not None or writers[written] > 1
                spans.append(never if stays else readers.get(written, (number, number)))
            self.spans.append((min(first for first, _ in spans), max(last for _, last in spans)))

    def ends(self, start: int) -> Iterator[int]:
        """Yield the steps before which a chain that begins with step ``start`` may end, the longest chain first."""
        if not self.plan.options.fuse:
            return
        closed: list[int] = []
        last = start  # the last reader of what the chain's steps, except the last, write
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

    def _alike(self, start: int, number: int) -> bool:
        first, step = self.plan.steps[start], self.plan.steps[number]
        if not isinstance(step, PixelStep) or isinstance(step, CountStep):
            return False
        return step.size == first.size and step.static == first.static


def _instruction_count(step: Step) -> int:
    return s.count(step.program.body) if isinstance(step, PixelStep) else 0
