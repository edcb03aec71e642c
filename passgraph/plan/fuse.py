"""Fuse pixel passes: inline a producer that is read at the same pixel into its reader."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import CountPass, InputSpec, Pass, PixelPass, Target
from passgraph.language.facts import Facts, Fused, ImageFacts, inner_first
from passgraph.language.lower_cache import lower_once
from passgraph.language.parameter_name import image_of
from passgraph.language.scalar import count, trips
from passgraph.plan.draft import Draft, LoweredPixels

#: Longest fused program in instructions: compile time grows faster than the savings.  Live values exceed the registers
#: long before, and a driver takes about a second to compile a kernel of this length.
MAX_FUSED_INSTRUCTIONS = 2048
#: Most images of a fused program: fusion saves one write and read, which is small compared with many images.
MAX_FUSED_IMAGES = 32


def fuse(draft: Draft) -> Draft:
    """Return the draft with producers computed inside their readers."""
    return _Fusion(draft).fused() if draft.options.fuse else draft


class _Fusion:
    """The passes of a draft while some become one, and their properties, which change with each that is fused."""

    def __init__(self, draft: Draft) -> None:
        self.draft, self.passes = draft, dict(draft.passes)
        self.static = _static_passes(draft)
        self.wanted = {target.content for target in draft.roots()}
        #: Pass → its readers, including those through passes fused before.
        self.readers: dict[Pass, set[Pass]] = {}
        for node, lowered in draft.passes.items():
            for target in lowered.reads:
                if target.made_by is not None:
                    self.readers.setdefault(target.made_by, set()).add(node)
        pixels = {node: low for node, low in draft.passes.items() if isinstance(low, LoweredPixels)}
        self.lengths = {node: count(low.program.body) for node, low in pixels.items()}
        #: Floats and ints among a pass's parameters, and its loop iterations.
        self.numbers = {
            node: (low.program.float_count, low.program.int_count, trips(low.program.body))
            for node, low in pixels.items()
        }
        self.notes: list[str] = []

    def fused(self) -> Draft:
        grown: dict[Pass, LoweredPixels] = {}
        # Producers first, so that chains grow from their head.
        for node in self.draft.passes:
            consumer = self.passes.get(node)
            if not isinstance(consumer, LoweredPixels):
                continue
            for image, target in list(consumer.images.items()):
                producer = self.passes.get(target.made_by) if target.made_by is not None else None
                if image in consumer.images and isinstance(producer, LoweredPixels) and self._fits(producer, consumer):
                    grown.pop(producer.node, None)
                    self.passes[node] = grown[node] = consumer = _inlined(producer, consumer)
                    self._note(producer, consumer)
        # Lowered once, when the fused content is complete.
        for node, consumer in grown.items():
            self.passes[node] = _lowered_again(consumer, self.draft)
        return replace(self.draft, passes=self.passes, notes=(*self.draft.notes, *self.notes))

    def _note(self, producer: LoweredPixels, consumer: LoweredPixels) -> None:
        """Note that the producer is inside the consumer, which now reads its inputs."""
        node = consumer.node
        del self.passes[producer.node]
        self.notes.append(f"fused pass {producer.name} into {consumer.name}: read at the same pixel, by it alone")
        self.lengths[node] += self.lengths[producer.node]
        self.numbers[node] = self._combined_needs(producer.node, node)
        for target in (*consumer.images.values(), *_images_inside(consumer)):
            readers = self.readers.get(target.made_by) if target.made_by is not None else None
            if readers is not None and producer.node in readers:
                readers.remove(producer.node)
                readers.add(node)

    def _fits(self, producer: LoweredPixels, consumer: LoweredPixels) -> bool:
        """Return True if the producer can be computed inside the consumer, and both together fit the device."""
        if producer.size != consumer.size:
            return False
        if isinstance(producer.node, CountPass):
            return False  # a device that scatters needs a pass of its own
        if any(target in self.wanted for target in producer.colours):
            return False
        if self.readers[producer.node] != {consumer.node}:
            return False
        if producer.node in self.static and consumer.node not in self.static:
            return False
        if any(image.made_by is producer.node for image in _images_inside(consumer)):
            return False
        names = [name for name, t in consumer.images.items() if t.made_by is producer.node]
        if any(not consumer.program.image(name).pointwise or consumer.program.reads_size(name) for name in names):
            return False
        if producer.program.arrays or consumer.program.arrays:
            return False  # arrays in one kernel are limited; together they could exceed that
        if self.lengths[producer.node] + self.lengths[consumer.node] > MAX_FUSED_INSTRUCTIONS:
            return False
        own = len(consumer.images) - len(names) + len(producer.images)
        images = own + len(_images_inside(consumer)) + len(_images_inside(producer))
        numbers = self._combined_needs(producer.node, consumer.node)
        return images <= MAX_FUSED_IMAGES and self.draft.limits.fits(images, len(consumer.slots), *numbers)

    def _combined_needs(self, one: Pass, other: Pass) -> tuple[int, int, int]:
        (floats, ints, instructions), (more_floats, more_ints, more) = self.numbers[one], self.numbers[other]
        return floats + more_floats, ints + more_ints, instructions + more


def _static_passes(draft: Draft) -> set[Pass]:
    """Return the passes that depend on static inputs, directly or through others, and on nothing that changes.

    Passes without inputs do not count: they are cheap to compute again.
    """
    static: set[Pass] = set()
    for node, lowered in draft.passes.items():  # producers first
        values = [v for v in lowered.values.values() if isinstance(v, (Value, Derived))]
        images = lowered.images.values()
        still = [t.spec.static if isinstance(t.spec, InputSpec) else t.made_by in static for t in images]
        if still and all(still) and all(value.static for value in values):
            static.add(node)
    return static


def _inlined(producer: LoweredPixels, consumer: LoweredPixels) -> LoweredPixels:
    """Return the consumer with the producer of one of its images inside, which it alone reads."""
    assert isinstance(producer.done, PixelPass)
    facts, images = dict(consumer.facts.images), dict(consumer.images)
    for name, read in consumer.node.images.items():
        if read.made_by is producer.node and name in consumer.images:
            slot = producer.slots.index(read.slot)
            fused = Fused(producer.done.kernel.program, producer.facts, producer.index, slot)
            facts[name] = replace(facts[name], fused=fused)
            images.pop(name)
    return replace(
        consumer,
        facts=replace(consumer.facts, images=facts),
        images=images,
        inside={**consumer.inside, producer.index: producer, **producer.inside},
        fused=(*producer.fused, producer.name, *consumer.fused),
    )


def _images_inside(lowered: LoweredPixels) -> list[Target]:
    """Return the images of the producers that are computed inside a pass."""
    return [target for producer in lowered.inside.values() for target in producer.images.values()]


def _lowered_again(consumer: LoweredPixels, draft: Draft) -> LoweredPixels:
    """Return a pass with the program of all that is computed inside it.

    Producers are numbered from 0 on, in writing order, so that equal sequences of passes become one program, which is
    lowered and compiled once.
    """
    assert isinstance(consumer.done, PixelPass)
    numbers = {index: number for number, index in enumerate(sorted(consumer.inside))}
    facts = _renumbered(consumer.facts, numbers)
    images, values = dict(consumer.images), dict(consumer.values)
    for index, producer in consumer.inside.items():
        images |= {image_of(numbers[index], name): target for name, target in producer.images.items()}
        values |= {name.of(numbers[index]): value for name, value in producer.values.items()}
    program = lower_once(consumer.done.kernel.program, facts, draft.programs)
    images = {use.name: images[use.name] for use in program.images}
    return replace(consumer, facts=facts, program=program, images=images, values=values)


def _renumbered(facts: Facts, numbers: Mapping[int, int]) -> Facts:
    renumbered: dict[int, Facts] = {}
    for each in inner_first(facts):
        images = {name: _rename_image(image, numbers, renumbered) for name, image in each.images.items()}
        renumbered[id(each)] = replace(each, images=images)
    return renumbered[id(facts)]


def _rename_image(image: ImageFacts, numbers: Mapping[int, int], renumbered: Mapping[int, Facts]) -> ImageFacts:
    if image.fused is None:
        return image
    fused = replace(image.fused, producer=numbers[image.fused.producer], facts=renumbered[id(image.fused.facts)])
    return replace(image, fused=fused)
