"""Fuse pixel passes: a producer read at the same pixel is computed inside its reader; chains share rows in cache."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import InputSpec, Pass, PixelPass, Target
from passgraph.language import scalar as s
from passgraph.language.facts import Facts, Fused, ImageFacts, fused_in, inner_first
from passgraph.language.lower_cache import lower_once
from passgraph.language.scalar import count, trips
from passgraph.plan.data import PixelStep, Plan, Step
from passgraph.plan.limits import Limits
from passgraph.plan.work import Lowered, Work

#: Steps of a chain at most.  What a chain computes again around a piece grows with its length, and one kernel of many
#: passes takes long to compile; longer rows of passes become several chains.
MAX_STEPS = 16
#: Instructions of all its steps together: beyond that the way to memory and back is little beside them.  Steps that are
#: long stand alone, and steps alike are compiled once then (128 passes of some 80 instructions each: 12 s together, 3
#: apart).
MAX_INSTRUCTIONS = 2000


class Chains:
    """The places where a plan's chains may begin and end; properties of the whole plan are computed once."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        writers = Counter(resource for step in plan.steps for resource in step.writes)
        #: Resource → the first and the last step that reads it.
        readers: dict[int, tuple[int, int]] = {}
        for number, step in enumerate(plan.steps):
            for resource in step.reads:
                readers[resource] = (readers.get(resource, (number, number))[0], number)
        #: Instructions of each step.
        self.lengths = [_instruction_count(step) for step in plan.steps]
        never = (-1, len(plan.steps))
        #: For each step the first and the last that read what it writes, as far as a chain may hold that.
        self.spans: list[tuple[int, int]] = []
        for number, step in enumerate(plan.steps):
            spans = [(number, number)]
            for written in step.writes:
                picture = plan.resources[written]
                stays = picture.persistent or picture.history is not None or writers[written] > 1
                spans.append(never if stays else readers.get(written, (number, number)))
            self.spans.append((min(first for first, _ in spans), max(last for _, last in spans)))

    def ends(self, start: int) -> Iterator[int]:
        """Steps before which a chain that begins with step ``start`` may end, the longest chain first."""
        if not self.plan.options.fuse:
            return
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

    def _alike(self, start: int, number: int) -> bool:
        first, step = self.plan.steps[start], self.plan.steps[number]
        if not isinstance(step, PixelStep) or step.known is not None:  # which devices do in ways of their own
            return False
        return step.size == first.size and step.static == first.static


def _instruction_count(step: Step) -> int:
    return s.count(step.program.body) if isinstance(step, PixelStep) else 0


#: A fused program longer than this stays two passes: compile time grows faster than what is saved.  Numbers that are
#: alive at once leave the registers long before, and a driver takes about a second for a kernel of this length.
MAX_FUSED_INSTRUCTIONS = 2048
#: Nor does fusion alone make a program that reads more images: it saves one written and read, which is little then.
MAX_FUSED_IMAGES = 32


@dataclass(frozen=True)
class Known:
    """Properties of the whole graph for fusion; ``readers`` and ``lengths`` change as passes are fused."""

    static: set[Pass]
    wanted: set[Target]
    #: Pass → who reads what it makes, images of passes fused before too.
    readers: dict[Pass, set[Pass]]
    lengths: dict[Pass, int]
    #: Floats and ints that a pass has as parameters, and trips of its loops.
    numbers: dict[Pass, tuple[int, int, int]]
    limits: Limits


def fuse(work: Work, limits: Limits) -> None:
    if not work.options.fuse:
        return
    counts = _known(work, limits)
    grown: dict[Pass, Lowered] = {}
    # Producers first, so that a chain grows from its head.
    for consumer in list(work.passes.values()):
        if isinstance(consumer.node, PixelPass) and consumer.node in work.passes:
            for image, target in list(consumer.images.items()):
                if image in consumer.images and _fusable(target, consumer, counts, work):
                    assert target.made_by is not None
                    grown.pop(target.made_by, None)
                    grown[consumer.node] = consumer
                    _fuse_into(consumer, target, work)
                    _note_fused(target.made_by, consumer, counts)
    # Lowered once, when all that belongs inside is known.
    for consumer in grown.values():
        assert isinstance(consumer.done, PixelPass)
        _number_anew(consumer)
        consumer.program = lower_once(consumer.done.kernel.program, consumer.facts, work.programs)
        consumer.images = {use.name: consumer.images[use.name] for use in consumer.program.images}


def _known(work: Work, limits: Limits) -> Known:
    readers: dict[Pass, set[Pass]] = {}
    for node, lowered in work.passes.items():
        for target in lowered.reads:
            if target.made_by is not None:
                readers.setdefault(target.made_by, set()).add(node)
    lengths = {node: _length(lowered) for node, lowered in work.passes.items()}
    numbers = {
        node: (low.program.float_count, low.program.int_count, trips(low.program.body))
        for node, low in work.passes.items()
        if low.program is not None
    }
    return Known(_static_passes(work), {t.content for t in work.roots()}, readers, lengths, numbers, limits)


def _note_fused(producer: Pass, consumer: Lowered, counts: Known) -> None:
    """Note that the producer's inputs are now read by the consumer."""
    counts.lengths[consumer.node] += counts.lengths[producer]
    counts.numbers[consumer.node] = _together(counts, producer, consumer.node)
    for target in consumer.images.values():
        readers = counts.readers.get(target.made_by) if target.made_by is not None else None
        if readers is not None and producer in readers:
            readers.remove(producer)
            readers.add(consumer.node)


def _length(lowered: Lowered) -> int:
    return count(lowered.program.body) if lowered.program is not None else 0


def _fusable(target: Target, consumer: Lowered, counts: Known, work: Work) -> bool:
    producer = work.passes.get(target.made_by) if target.made_by is not None else None
    if producer is None or not isinstance(producer.node, PixelPass) or producer.size != consumer.size:
        return False
    assert consumer.program is not None and producer.program is not None
    if any(target in counts.wanted for target in producer.colours):
        return False
    if counts.readers[producer.node] != {consumer.node}:
        return False
    if producer.node in counts.static and consumer.node not in counts.static:
        return False
    names = [name for name, t in consumer.images.items() if t.made_by is producer.node]
    if any("/" in name for name in names):
        return False  # also read by a pass that was fused into the consumer
    if any(not consumer.program.image(name).pointwise or consumer.program.reads_size(name) for name in names):
        return False
    if producer.program.arrays or consumer.program.arrays:
        return False  # what one kernel may hold in arrays is bounded; together they could take more
    if counts.lengths[producer.node] + counts.lengths[consumer.node] > MAX_FUSED_INSTRUCTIONS:
        return False
    images = len(consumer.images) - len(names) + len(producer.images)
    numbers = _together(counts, producer.node, consumer.node)
    return images <= MAX_FUSED_IMAGES and counts.limits.fits(images, len(consumer.slots), *numbers)


def _together(counts: Known, one: Pass, other: Pass) -> tuple[int, int, int]:
    (floats, ints, instructions), (more_floats, more_ints, more) = counts.numbers[one], counts.numbers[other]
    return floats + more_floats, ints + more_ints, instructions + more


def _static_passes(work: Work) -> set[Pass]:
    """Passes that depend on static inputs, directly or through others, and on nothing that changes.

    What depends on no picture at all does not count: it is cheap to compute again.
    """
    static: set[Pass] = set()
    for node, lowered in work.passes.items():  # producers first
        values = [v for v in lowered.values.values() if isinstance(v, (Value, Derived))]
        images = lowered.images.values()
        still = [t.spec.static if isinstance(t.spec, InputSpec) else t.made_by in static for t in images]
        if still and all(still) and all(value.static for value in values):
            static.add(node)
    return static


def _fuse_into(consumer: Lowered, target: Target, work: Work) -> None:
    assert target.made_by is not None and isinstance(consumer.node, PixelPass)
    producer = work.passes[target.made_by]
    assert isinstance(producer.done, PixelPass)
    prefix = f"p{producer.index}/"
    images = dict(consumer.facts.images)
    for name, read in consumer.node.images.items():
        if read.made_by is producer.node and name in consumer.images:
            slot = producer.slots.index(read.slot)
            fused = Fused(producer.done.kernel.program, producer.facts, prefix, slot)
            images[name] = replace(images[name], fused=fused)
            consumer.images.pop(name, None)
    consumer.facts = replace(consumer.facts, images=images)
    consumer.images |= {_prefixed(prefix, n): t for n, t in producer.images.items()}
    consumer.values |= {_prefixed(prefix, n): v for n, v in producer.values.items()}
    consumer.fused = (*producer.fused, producer.name, *consumer.fused)
    work.notes.append(f"fused pass {producer.name} into {consumer.name}: read at the same pixel, by it alone")
    del work.passes[producer.node]


def _prefixed(prefix: str, name: str) -> str:
    """Names that already carry the prefix of a pass fused earlier keep it."""
    return name if "/" in name else prefix + name


def _number_anew(consumer: Lowered) -> None:
    """Number what is fused from 0 on, in writing order: rows of passes that are alike then are one program, wherever in
    the graph they stand, and are lowered and compiled once."""
    renumbered: dict[int, Facts] = {}
    order = inner_first(consumer.facts)
    prefixes = {fused.prefix for facts in order for fused in fused_in(facts)}
    new = {prefix: f"p{place}/" for place, prefix in enumerate(sorted(prefixes, key=_index))}
    for facts in order:
        images = {name: _under(image, new, renumbered) for name, image in facts.images.items()}
        renumbered[id(facts)] = replace(facts, images=images)
    consumer.facts = renumbered[id(consumer.facts)]
    consumer.images = {_renamed(name, new): target for name, target in consumer.images.items()}
    consumer.values = {_renamed(name, new): value for name, value in consumer.values.items()}


def _under(image: ImageFacts, prefixes: Mapping[str, str], renumbered: Mapping[int, Facts]) -> ImageFacts:
    if image.fused is None:
        return image
    fused = replace(image.fused, prefix=prefixes[image.fused.prefix], facts=renumbered[id(image.fused.facts)])
    return replace(image, fused=fused)


def _renamed(name: str, prefixes: Mapping[str, str]) -> str:
    prefix, slash, rest = name.partition("/")
    return prefixes[prefix + slash] + rest if slash else name


def _index(prefix: str) -> int:
    return int(prefix[1:-1])
