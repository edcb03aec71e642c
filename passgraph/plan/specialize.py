"""Lower every kernel, specialized for what the graph determines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import cast

from passgraph.errors import GraphError
from passgraph.formats import Format, float_format
from passgraph.graph.targets import DrawPass, InputSpec, Pass, PixelPass, Target
from passgraph.language.border_rules import BORDERS
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.emitter import eliminate_dead
from passgraph.language.facts import Facts, ImageFacts
from passgraph.language.ir import MIPS
from passgraph.language.kernel import Kernel
from passgraph.language.long_arrays import layout_of
from passgraph.language.lower_cache import lower_once
from passgraph.language.native import Accuracy
from passgraph.language.parameter_name import ParameterName
from passgraph.language.scalar import LoadBuiltin, Output, ScalarProgram, texel_loads, walk
from passgraph.language.sized import loops_over_sizes
from passgraph.language.types import Array
from passgraph.plan.data import BufferSpec, Options
from passgraph.plan.draft import Collected, Draft, Lowered, LoweredDraw, LoweredPixels, Sized
from passgraph.plan.limits import Limits
from passgraph.plan.sizes import level_sizes


def is_native(kernel: Kernel, draft: Draft) -> bool:
    """Return True if a kernel calls the device's own functions."""
    return (kernel.math or draft.options.math) == "native"


def native_functions(kernel: Kernel, draft: Draft) -> Mapping[str, Accuracy]:
    """Return the functions of a kernel that the device itself computes."""
    return draft.limits.native if is_native(kernel, draft) else {}


def contracts_products(kernel: Kernel, draft: Draft) -> bool:
    """Return True if a kernel multiplies and adds in one instruction."""
    return draft.limits.contracts and is_native(kernel, draft)


def image_facts(
    target: Target, where: str, draft: Draft, sized: bool = False, reader: Pass | None = None
) -> ImageFacts:
    """Return the facts of a picture that a pass reads."""
    format_, size = draft.format_of(target), draft.size_of(target)
    if size[1] % target.slice_count:
        raise GraphError(
            f"{where} reads {target.name!r} as {target.slice_count} slices, and it is {size[0]}x{size[1]}: "
            "its height must be a multiple of that; pg.stacked makes such a picture of a volume"
        )
    by_device = isinstance(reader, PixelPass) and target.border_rule in draft.limits.filters
    hardware = target.hardware or (isinstance(reader, PixelPass) and is_native(reader.kernel, draft))
    # Encoded values and depths must not be interpolated.
    wraps = BORDERS[target.border_rule].wraps and target.filter_rule == "linear"
    fits = wraps and not (format_.srgb or format_.is_depth)
    return ImageFacts(
        format_.channels, target.border_rule, format_.decode, size=size if sized else None, filter=target.filter_rule,
        levels=len(level_sizes(size)) if target.has_levels else 1, slices=target.slice_count,
        bits=format_.bits if hardware and fits else 0, by_device=hardware and fits and by_device,
    )  # fmt: skip


class LongArrays:
    """Pictures of long array parameters: passes that are given one array share one."""

    def __init__(self) -> None:
        #: By the parameter's value, the field names from it to the array, and its type.
        self._specs: dict[tuple[int, tuple[str, ...], Array], BufferSpec] = {}
        self.inputs: dict[InputSpec, tuple[Format, tuple[int, int]]] = {}

    def picture(self, node: Pass, name: ParameterName, type_: Array) -> Target:
        """Return the picture of a pass's parameter, or of an array within one."""
        value = node.values[name.parameter]
        key = id(value), name.path, type_  # the graph keeps the value
        if key not in self._specs:
            layout = layout_of(type_)
            format_ = float_format(layout.channels)
            self._specs[key] = spec = BufferSpec(
                f"{name} of {node.name}", format_, layout.size, True, value=value, fields=name.path, type=type_
            )
            self.inputs[spec] = format_, layout.size
        return Target(self._specs[key])


def specialize(collected: Collected, options: Options, limits: Limits) -> Draft:
    """Return the first draft: every pass with its programs."""
    draft = Draft(
        options=options, limits=limits, outputs=collected.outputs, size=collected.size, inputs=collected.inputs,
        sizes=collected.sizes, final=collected.final, passes={}, notes=collected.notes,
    )  # fmt: skip
    arrays, notes = LongArrays(), list(draft.notes)
    passes = {one.node: specialized(one, draft, arrays, notes) for one in collected.passes}
    return replace(draft, passes=passes, inputs={**draft.inputs, **arrays.inputs}, notes=tuple(notes))


def specialized(one: Sized, draft: Draft, arrays: LongArrays, notes: list[str]) -> Lowered:
    """Return a pass with its programs; adds to its long arrays and to the notes."""
    node = one.node
    sized = _needs_sizes(node)
    # Smaller levels are stored in a picture of the same format, which :mod:`.mipmaps` substitutes for the image.
    read = {**node.images, **{name + MIPS: target for name, target in node.images.items()}}
    where = f"pass {node.name!r}"
    images = {name: image_facts(target, where, draft, sized, node) for name, target in read.items()}
    size = one.size if sized else None
    lowered: Lowered
    if isinstance(node, PixelPass):
        lowered = _pixels(node, one, images, size, draft, notes)
    else:
        lowered = _draw(node, one, images, size, draft)
    used: dict[str, Target] = {}
    for program in lowered.programs:
        used |= used_images(program, read, node, arrays)
    lowered = replace(lowered, images=used)
    if isinstance(lowered, LoweredPixels):
        check_relative(lowered, draft)
    return lowered


def _pixels(
    node: PixelPass, one: Sized, images: dict[str, ImageFacts], size: tuple[int, int] | None, draft: Draft,
    notes: list[str],
) -> LoweredPixels:  # fmt: skip
    stores = tuple(spec.format.store for spec in node.into)
    native, contracts = native_functions(node.kernel, draft), contracts_products(node.kernel, draft)
    facts = Facts(node.constants, images, stores, draft.options.simplify, size, native, contracts)
    program = lower_once(node.kernel.program, facts, draft.programs)
    # Filter in the kernel if it also reads the picture by texel: a texture has one filter per pass.
    loads = list(texel_loads(program.body))
    filtered = {i.image for i in loads if i.filtered}
    both = filtered & {i.image for i in loads if not i.filtered}
    if both:
        images = {n: replace(f, by_device=f.by_device and n not in both) for n, f in facts.images.items()}
        facts = replace(facts, images=images)
        program = lower_once(node.kernel.program, facts, draft.programs)
    for name in sorted(filtered - both):
        where = f"pass {node.name} samples {node.images[name].name}"
        notes.append(f"{where} by the device's own filter, whose weights have 8 bits")
    return LoweredPixels(
        node, one.size, one.index, done=node, slots=tuple(range(len(node.into))), facts=facts, images={},
        values=_by_name(node.values), program=program,
    )  # fmt: skip


def _by_name(values: Mapping[str, object]) -> dict[ParameterName, object]:
    return {ParameterName(name): value for name, value in values.items()}


def _needs_sizes(node: Pass) -> bool:
    """Return True if the pass requests known sizes, or needs them to bound loops over whole pictures."""
    return (isinstance(node, PixelPass) and node.known_sizes) or any(
        loops_over_sizes(kernel.program) for kernel in node.kernels
    )


def _draw(
    node: DrawPass, one: Sized, images: dict[str, ImageFacts], size: tuple[int, int] | None, draft: Draft
) -> LoweredDraw:
    blends = node.state.blend or (None,) * len(node.into)
    # The backend quantizes a blended target after blending.
    stores = tuple(((), ()) if blend else spec.format.store for spec, blend in zip(node.into, blends, strict=True))
    simplify = draft.options.simplify
    native = native_functions(node.vertex, draft)
    vertex_facts = Facts(node.constants, images, (), simplify, one.size, native)
    # Products of vertex kernels are not contracted: passes that draw one mesh need the same depths.
    shading = node.fragment or node.vertex
    native, contracts = native_functions(shading, draft), contracts_products(shading, draft)
    facts = Facts(node.constants, images, stores, simplify, size, native, contracts)
    vertex = lower_once(node.vertex.program, vertex_facts, draft.programs)
    fragment = None if node.fragment is None else lower_once(node.fragment.program, facts, draft.programs)
    varyings = varyings_of(fragment)
    return LoweredDraw(
        node, one.size, one.index, done=node, slots=tuple(range(len(node.into))), facts=facts, images={},
        values=_by_name(node.values), vertex=link(vertex, varyings), vertex_facts=vertex_facts, fragment=fragment,
        varyings=varyings,
    )  # fmt: skip


def varyings_of(fragment: ScalarProgram | None) -> tuple[BuiltinName, ...]:
    """Return the scalars that the fragment kernel really reads, at any pixel of the quad."""
    builtins = () if fragment is None else fragment.builtins
    return tuple(dict.fromkeys(name.at("") for name, _ in builtins if name.kind == "varying"))


def link(vertex: ScalarProgram, varyings: tuple[BuiltinName, ...]) -> ScalarProgram:
    """Return the vertex program reduced to two outputs, position and the wanted varyings."""
    outputs = {output.name: output.values for output in vertex.outputs}
    place, scalars = outputs["position"], tuple(outputs[name.of][name.component or 0] for name in varyings)
    linked_outputs = (Output("position", place, place), Output("varyings", scalars, scalars))
    roots = [value for output in linked_outputs for value in output.values]
    body = eliminate_dead(list(vertex.body), roots)
    used = {i.name for i in walk(body) if isinstance(i, LoadBuiltin)}
    builtins = tuple((n, t) for n, t in vertex.builtins if n in used)
    made_program = replace(vertex, outputs=linked_outputs, body=body, builtins=builtins)
    read = {i.image for i in texel_loads(body)}
    images = tuple(use for use in vertex.images if use.name in read or made_program.reads_size(use.name))
    names = {use.name for use in images}
    return replace(made_program, images=images, buffers=tuple(row for row in vertex.buffers if row[0] in names))


def used_images(program: ScalarProgram, images: dict[str, Target], node: Pass, arrays: LongArrays) -> dict[str, Target]:
    """Return the images that a program reads, pictures of long arrays included."""
    long = {name: arrays.picture(node, parameter, cast(Array, type_)) for name, parameter, type_ in program.buffers}
    return {use.name: long.get(use.name) or images[use.name] for use in program.images}


def check_relative(lowered: LoweredPixels, draft: Draft) -> None:
    """Check that images read as ``image[dx, dy]`` have the pass's size."""
    for use in lowered.program.images:
        target = lowered.images[use.name]
        if use.relative and (size := draft.size_of(target)) != lowered.size:
            raise GraphError(
                f"pass {lowered.name!r} reads {target.name!r} ({size[0]}x{size[1]}) "
                f"by relative offsets and is "
                f"{lowered.size[0]}x{lowered.size[1]} itself; read it by .sample(uv()) or make the sizes equal"
            )
