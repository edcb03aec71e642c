"""Fuse pixel passes: inline a producer that is read at the same pixel into its reader."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import CountPass, InputSpec, Pass, PixelPass, Target
from passgraph.language.facts import Facts, Fused, ImageFacts, fused_in, inner_first
from passgraph.language.lower_cache import lower_once
from passgraph.language.scalar import count, trips
from passgraph.plan.limits import Limits
from passgraph.plan.work import Lowered, LoweredPixels, Work

#: Longest fused program in instructions: compile time grows faster than the savings.  Live values exceed the registers
#: long before, and a driver takes about a second to compile a kernel of this length.
MAX_FUSED_INSTRUCTIONS = 2048
#: Most images of a fused program: fusion saves one write and read, which is small compared with many images.
MAX_FUSED_IMAGES = 32


@dataclass(frozen=True)
class Known:
    """Properties of the whole graph for fusion; ``readers`` and ``lengths`` change as passes are fused."""

    static: set[Pass]
    wanted: set[Target]
    #: Pass → its readers, including those through passes fused before.
    readers: dict[Pass, set[Pass]]
    lengths: dict[Pass, int]
    #: Floats and ints among a pass's parameters, and its loop iterations.
    numbers: dict[Pass, tuple[int, int, int]]
    limits: Limits


def fuse(work: Work, limits: Limits) -> None:
    if not work.options.fuse:
        return
    counts = _known(work, limits)
    grown: dict[Pass, None] = {}
    # Producers first, so that chains grow from their head.
    for node in list(work.passes):
        consumer = work.passes.get(node)
        if not isinstance(consumer, LoweredPixels):
            continue
        for image, target in list(consumer.images.items()):
            if image in consumer.images and _fusable(target, consumer, counts, work):
                assert target.made_by is not None
                grown.pop(target.made_by, None)
                grown[node] = None
                work.passes[node] = consumer = _fused(consumer, target, work)
                _note_fused(target.made_by, consumer, counts)
    # Lowered once, when the fused content is complete.
    for node in grown:
        work.passes[node] = _lowered_again(work.passes[node], work)


def _lowered_again(consumer: Lowered, work: Work) -> LoweredPixels:
    assert isinstance(consumer, LoweredPixels)
    consumer = _renumbered(consumer)
    assert isinstance(consumer.done, PixelPass)
    program = lower_once(consumer.done.kernel.program, consumer.facts, work.programs)
    return replace(consumer, program=program, images={use.name: consumer.images[use.name] for use in program.images})


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
        if isinstance(low, LoweredPixels)
    }
    return Known(_static_passes(work), {t.content for t in work.roots()}, readers, lengths, numbers, limits)


def _note_fused(producer: Pass, consumer: Lowered, counts: Known) -> None:
    """Note that the producer's inputs are now read by the consumer."""
    counts.lengths[consumer.node] += counts.lengths[producer]
    counts.numbers[consumer.node] = _combined_needs(counts, producer, consumer.node)
    for target in consumer.images.values():
        readers = counts.readers.get(target.made_by) if target.made_by is not None else None
        if readers is not None and producer in readers:
            readers.remove(producer)
            readers.add(consumer.node)


def _length(lowered: Lowered) -> int:
    return count(lowered.program.body) if isinstance(lowered, LoweredPixels) else 0


def _fusable(target: Target, consumer: LoweredPixels, counts: Known, work: Work) -> bool:
    producer = work.passes.get(target.made_by) if target.made_by is not None else None
    if not isinstance(producer, LoweredPixels) or producer.size != consumer.size:
        return False
    if isinstance(producer.node, CountPass):
        return False  # a device that scatters needs a pass of its own
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
        return False  # arrays in one kernel are limited; together they could exceed that
    if counts.lengths[producer.node] + counts.lengths[consumer.node] > MAX_FUSED_INSTRUCTIONS:
        return False
    images = len(consumer.images) - len(names) + len(producer.images)
    numbers = _combined_needs(counts, producer.node, consumer.node)
    return images <= MAX_FUSED_IMAGES and counts.limits.fits(images, len(consumer.slots), *numbers)


def _combined_needs(counts: Known, one: Pass, other: Pass) -> tuple[int, int, int]:
    (floats, ints, instructions), (more_floats, more_ints, more) = counts.numbers[one], counts.numbers[other]
    return floats + more_floats, ints + more_ints, instructions + more


def _static_passes(work: Work) -> set[Pass]:
    """Return the passes that depend on static inputs, directly or through others, and on nothing that changes.

    Passes without inputs do not count: they are cheap to compute again.
    """
    static: set[Pass] = set()
    for node, lowered in work.passes.items():  # producers first
        values = [v for v in lowered.values.values() if isinstance(v, (Value, Derived))]
        images = lowered.images.values()
        still = [t.spec.static if isinstance(t.spec, InputSpec) else t.made_by in static for t in images]
        if still and all(still) and all(value.static for value in values):
            static.add(node)
    return static


def _fused(consumer: LoweredPixels, target: Target, work: Work) -> LoweredPixels:
    """Return the consumer with the producer of one of its images inside, which it alone reads."""
    assert target.made_by is not None
    producer = work.passes.pop(target.made_by)
    assert isinstance(producer, LoweredPixels) and isinstance(producer.done, PixelPass)
    prefix = f"p{producer.index}/"
    facts, images = dict(consumer.facts.images), dict(consumer.images)
    for name, read in consumer.node.images.items():
        if read.made_by is producer.node and name in consumer.images:
            slot = producer.slots.index(read.slot)
            fused = Fused(producer.done.kernel.program, producer.facts, prefix, slot)
            facts[name] = replace(facts[name], fused=fused)
            images.pop(name, None)
    work.notes.append(f"fused pass {producer.name} into {consumer.name}: read at the same pixel, by it alone")
    return replace(
        consumer,
        facts=replace(consumer.facts, images=facts),
        images=images | {_prefixed(prefix, n): t for n, t in producer.images.items()},
        values={**consumer.values, **{_prefixed(prefix, n): v for n, v in producer.values.items()}},
        fused=(*producer.fused, producer.name, *consumer.fused),
    )


def _prefixed(prefix: str, name: str) -> str:
    """Return a prefixed name; names from passes fused earlier keep their prefix."""
    return name if "/" in name else prefix + name


def _renumbered(consumer: LoweredPixels) -> LoweredPixels:
    """Number the fused passes from 0 on, in writing order, so that equal sequences of passes become one program, which
    is lowered and compiled once."""
    renumbered: dict[int, Facts] = {}
    order = inner_first(consumer.facts)
    prefixes = {fused.prefix for facts in order for fused in fused_in(facts)}
    new = {prefix: f"p{place}/" for place, prefix in enumerate(sorted(prefixes, key=_index))}
    for facts in order:
        images = {name: _rename_image(image, new, renumbered) for name, image in facts.images.items()}
        renumbered[id(facts)] = replace(facts, images=images)
    return replace(
        consumer,
        facts=renumbered[id(consumer.facts)],
        images={_renamed(name, new): target for name, target in consumer.images.items()},
        values={_renamed(name, new): value for name, value in consumer.values.items()},
    )


def _rename_image(image: ImageFacts, prefixes: Mapping[str, str], renumbered: Mapping[int, Facts]) -> ImageFacts:
    if image.fused is None:
        return image
    fused = replace(image.fused, prefix=prefixes[image.fused.prefix], facts=renumbered[id(image.fused.facts)])
    return replace(image, fused=fused)


def _renamed(name: str, prefixes: Mapping[str, str]) -> str:
    prefix, slash, rest = name.partition("/")
    return prefixes[prefix + slash] + rest if slash else name


def _index(prefix: str) -> int:
    return int(prefix[1:-1])
