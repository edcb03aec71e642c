"""OpenCL C of one draw: its kernels and its state, combined with raster.cl and pixels.cl."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from passgraph.backends.base import ATTRIBUTES, clear_colour
from passgraph.backends.opencl.opencl_c import (
    OpenCLPrinter,
    element,
    join,
    load_expression,
    package_text,
    prologue,
    store_expression,
)
from passgraph.backends.opencl.storage import INT_LIMIT, ImageLayout
from passgraph.backends.printing import Listing
from passgraph.graph.draw_state import Stencil
from passgraph.language.builtin_name import OTHER_PIXELS, OUTPUT_SIZE, PIXEL, BuiltinName
from passgraph.language.scalar import ScalarProgram
from passgraph.plan.data import DrawStep
from passgraph.records import dataclass

SIGNS = {
    "less": "<",
    "equal": "==",
    "less_equal": "<=",
    "greater": ">",
    "not_equal": "!=",
    "greater_equal": ">=",
}


def compare(how: str, new: str, stored: str) -> str:
    if how in ("always", "never"):
        return "true" if how == "always" else "false"
    return f"{new} {SIGNS[how]} {stored}"


def stencil_update(operation: str, stencil: Stencil) -> str:
    """Return the statement of one stencil operation, under the write mask."""
    old = "(int)pg_stencils[at]"
    new = {
        "keep": old,
        "zero": "0",
        "replace": str(stencil.reference),
        "increment": f"min({old} + 1, 255)",
        "increment_wrap": f"({old} + 1)",
        "decrement": f"max({old} - 1, 0)",
        "decrement_wrap": f"({old} - 1)",
        "invert": f"(~{old})",
    }[operation]
    if operation == "keep" or not stencil.write_mask:
        return ""
    keep = 255 & ~stencil.write_mask
    return f"pg_stencils[at] = (uchar)(({old} & {keep}) | ({new} & {stencil.write_mask}));"


#: Ints of a triangle; see raster.cl.
TRIANGLE_INTS = 12
#: Offsets of the other pixels of a quad, and their numbers in pixels.cl.
PIXELS = {axes: number for number, axes in enumerate(("", *OTHER_PIXELS))}


@dataclass(frozen=True)
class DrawLayouts:
    """The layouts of a draw's storages."""

    vertex_images: tuple[ImageLayout, ...]
    images: tuple[ImageLayout, ...]
    outputs: tuple[ImageLayout, ...]
    depth: bool
    stencil: bool


def draw_sources(
    step: DrawStep, layouts: DrawLayouts, tile: int, *, serial: bool, constant: bool
) -> dict[tuple[str, ...], Listing]:
    """Return kernels → their source; ``serial`` gives a tile to one work-item instead of a work-group.

    Compilers are slow, so there are three sources: draws with one vertex kernel share the first, all draws the second.
    """
    triangles = {"PG_TILE": tile, "PG_INTS": TRIANGLE_INTS}
    pixels = _defines(triangles | _pixel_rows(step, layouts, tile, serial))
    return {
        ("pg_vertices",): join(prologue(constant), _vertex(step, layouts)),
        ("pg_count", "pg_setup", "pg_scan", "pg_fill"): join(
            package_text("helpers.cl"), _defines(triangles), package_text("raster.cl")
        ),
        ("pg_tiles",): join(
            prologue(constant), pixels, _clear(step, layouts), *_blends(step), _shade(step, layouts),
            package_text("pixels.cl"),
        ),
    }  # fmt: skip


def triangle_floats(step: DrawStep) -> int:
    """Return the number of floats of a triangle; see raster.cl."""
    return 8 + 3 * len(step.varyings)


def _defines(rows: Mapping[str, object]) -> str:
    return "".join(f"#define {name} {value}\n" for name, value in rows.items())


def _read(program: ScalarProgram | None) -> list[BuiltinName]:
    """List the builtins of a fragment kernel."""
    return [] if program is None else [name for name, _ in program.builtins]


def _pixel_rows(step: DrawStep, layouts: DrawLayouts, tile: int, serial: bool) -> dict[str, object]:
    width, height = step.size
    fragment = step.fragment
    resources = _image_parameters(layouts.images)
    resources += [f"__global {element(o.format)}* restrict out{i}" for i, o in enumerate(layouts.outputs)]
    resources += ["__global float* restrict depths"] if layouts.depth else []
    resources += ["__global uchar* restrict stencils"] if layouts.stencil else []
    resources += ["PG_UNIFORMS float* restrict floats", "PG_UNIFORMS int* restrict ints"]
    names = [text.split()[-1] for text in resources]
    # pg_tiles has parameters with these names itself.
    resources = [text.removesuffix(name) + f"pg_{name}" for text, name in zip(resources, names, strict=True)]
    return {
        "PG_WIDTH": width,
        "PG_HEIGHT": height,
        "PG_TILES_X": -(-width // tile),
        "PG_FLOATS": triangle_floats(step),
        "PG_DEPTH": int(layouts.depth),
        "PG_READS_DEPTH": int(any(name.kind == "fragment_depth" for name in _read(fragment))),
        "PG_BESIDE": sum(1 << pixel for pixel in {PIXELS[name.axes] for name in _read(fragment)} if pixel),
        "PG_SERIAL": int(serial),
        "PG_INDEX": "int" if width * height * 4 < INT_LIMIT else "long",
        "PG_KERNEL_RESOURCES": ", ".join(resources),
        # The kernel's own restrict suffices; oclgrind fails when more of them are inlined.
        "PG_RESOURCES": ", ".join(resources).replace(" restrict ", " "),
        "PG_PASS": ", ".join(f"pg_{name}" for name in names),
    }


def _image_parameters(layouts: Sequence[ImageLayout]) -> list[str]:
    return [f"__global const {element(o.format)}* restrict image{i}" for i, o in enumerate(layouts)]


def _images(program: ScalarProgram, layouts: Sequence[ImageLayout], name: str) -> dict[str, tuple[str, ImageLayout]]:
    """Map a program's images to the kernel parameter and layout of each."""
    pairs = enumerate(zip(program.images, layouts, strict=True))
    return {use.name: (f"{name}{i}", layout) for i, (use, layout) in pairs}


def _vertex(step: DrawStep, layouts: DrawLayouts) -> Listing:
    """Print ``pg_vertices``: clip positions and varyings of every vertex."""
    program = step.vertex
    builtins = {}
    for attribute, (_, components) in ATTRIBUTES.items():
        for k in range(components):
            builtins[BuiltinName("vertex", attribute, k)] = f"in_{attribute}[{components} * vertex + {k}]"
        if components == 1:
            builtins[BuiltinName("vertex", attribute)] = f"in_{attribute}[vertex]"
    images = _images(program, layouts.vertex_images, "image")
    printer = OpenCLPrinter(program, builtins, images, prefix="pg_vertex_")
    parameters = [f"__global const float* restrict in_{name}" for name in program.attributes]
    parameters += _image_parameters(layouts.vertex_images)
    parameters += ["PG_UNIFORMS float* restrict floats", "PG_UNIFORMS int* restrict ints"]
    parameters += ["__global float* restrict clip", "__global float* restrict sent", "int count"]
    printer.open(f"__kernel void pg_vertices({', '.join(parameters)})")
    printer.line("int vertex = (int)get_global_id(0);\nif (vertex >= count) { return; }")
    printer.variables()
    printer.block(printer.program.body)
    position, *varyings = program.outputs
    for k, value in enumerate(position.values):
        printer.line(f"clip[4 * vertex + {k}] = {printer.operand(value)};")
    sent = [value for output in varyings for value in output.values]
    for k, value in enumerate(sent):
        printer.line(f"sent[{len(sent)} * vertex + {k}] = {printer.operand(value)};")
    return printer.close()


def _clear(step: DrawStep, layouts: DrawLayouts) -> str:
    """Print ``pg_clear_pixel``: clear one pixel."""
    printer = OpenCLPrinter(EMPTY, {})
    lines = [_place(i, layout) for i, layout in enumerate(layouts.outputs)]
    for i, (values, layout) in enumerate(zip(step.clears, layouts.outputs, strict=True)):
        if values is None:
            continue
        for k, value in enumerate(clear_colour(values, layout.channels, layout.format.srgb)):
            stored = store_expression(layout.format, printer.float_literal(value))
            lines.append(f"pg_out{i}[o{i} + {layout.places[k]}] = {stored};")
    if layouts.depth and step.depth_clear is not None:
        lines.append(f"pg_depths[at] = {printer.float_literal(step.depth_clear)};")
        if layouts.stencil:
            lines.append(f"pg_stencils[at] = {step.state.clear_stencil & 255};")
    body = "".join(f"    {line}\n" for line in lines)
    return (
        "void pg_clear_pixel(int x, int y, PG_RESOURCES)\n"
        f"{{\n    PG_INDEX at = (PG_INDEX)y * PG_WIDTH + x;\n{body}}}\n"
    )


def _shade(step: DrawStep, layouts: DrawLayouts) -> Listing:
    """Print ``pg_shade``: tests, the fragment kernel and the writes for a covered pixel."""
    program = step.fragment if step.fragment is not None else EMPTY
    width, height = step.size
    builtins = dict(zip((*PIXEL, *OUTPUT_SIZE), ("x", "y", str(width), str(height)), strict=True))
    builtins[BuiltinName("front_facing")] = "front"
    for axes, pixel in PIXELS.items():
        builtins[BuiltinName("fragment_depth", axes=axes)] = f"there[{pixel}].z"
        builtins |= {name.at(axes): f"varying{k}{axes}" for k, name in enumerate(step.varyings)}
    images = _images(program, layouts.images, "pg_image")
    printer = FragmentPrinter(program, builtins, images, prefix="pg_fragment_")
    printer.open(
        "void pg_shade(int x, int y, const float3* there, bool front, __global const float* tri, PG_RESOURCES)"
    )
    printer.line("PG_INDEX at = (PG_INDEX)y * PG_WIDTH + x;\nfloat depth = there[0].z;")
    for i, layout in enumerate(layouts.outputs):
        printer.line(_place(i, layout))
    early, late = _tests(step, layouts, discards=program.keep is not None)
    printer.line(early)
    for name in _read(program):
        if name.kind == "varying":
            k, place = step.varyings.index(name.at("")), f"there[{PIXELS[name.axes]}]"
            a, b, c = (f"tri[{8 + 3 * k + j}]" for j in range(3))
            printer.line(f"float varying{k}{name.axes} = {a} + ({b} - {a}) * {place}.x + ({c} - {a}) * {place}.y;")
    printer.variables()
    printer.block(printer.program.body)
    if program.keep is not None:
        printer.line(f"if (!({printer.operand(program.keep)})) {{ return; }}")
    printer.line(late)
    for i, output in enumerate(program.outputs):
        _write(printer, step, i, layouts.outputs[i], [printer.operand(value) for value in output.values])
    return printer.close()


class FragmentPrinter(OpenCLPrinter):
    """Prints a fragment kernel, whose uniforms come with the draw's resources."""

    def uniform(self, block: str, index: str | int) -> str:
        return f"pg_{block}s[{index}]"


EMPTY = ScalarProgram("none", "fragment", (), (), None, (), (), (), (), ())


def _tests(step: DrawStep, layouts: DrawLayouts, *, discards: bool) -> tuple[str, str]:
    """Return the stencil and depth tests, split into the parts before and after the fragment kernel.

    A discarded fragment changes nothing, so a kernel that discards runs before any write.
    """
    state = step.state
    if not layouts.depth:
        return "", ""
    passes = compare(state.depth_compare, "depth", "pg_depths[at]")
    write = "pg_depths[at] = depth;" if state.depth_write else ""
    if state.stencil is None or not layouts.stencil:
        reject = f"if (!({passes})) {{ return; }}"
        return (reject, write) if discards else (f"{reject}\n{write}", "")
    stencil = state.stencil
    masked = f"((int)pg_stencils[at] & {stencil.read_mask})"
    lines = [
        f"if (!({compare(stencil.compare, str(stencil.reference & stencil.read_mask), masked)})) {{",
        f"    {stencil_update(stencil.fail, stencil)}",
        "    return;",
        "}",
        f"if (!({passes})) {{",
        f"    {stencil_update(stencil.depth_fail, stencil)}",
        "    return;",
        "}",
        stencil_update(stencil.passed, stencil),
        write,
    ]
    text = "\n".join(lines)
    return ("", text) if discards else (text, "")


def _blends(step: DrawStep) -> Iterator[Listing]:
    """Print ``pg_blend0`` … for the blended targets: functions of the source color and the stored pixel."""
    for i, program in enumerate(step.blending):
        if program is None:
            continue
        builtins = {
            BuiltinName(name, component=k): f"{name}.s{k}" for name in ("source", "destination") for k in range(4)
        }
        printer = OpenCLPrinter(program, builtins)
        printer.open(f"float4 pg_blend{i}(float4 source, float4 destination)")
        printer.variables()
        printer.block(printer.program.body)
        printer.line(f"return {_four([printer.operand(value) for value in program.outputs[0].values])};")
        yield printer.close()


def _place(i: int, layout: ImageLayout) -> str:
    """Return the declaration of this pixel's index in a target."""
    return f"{layout.index_type} o{i} = {layout.place('x', 'y')};"


def _four(values: Sequence[str]) -> str:
    return f"(float4)({', '.join([*values, '0.0f', '0.0f', '0.0f'][:4])})"


def _write(printer: OpenCLPrinter, step: DrawStep, i: int, layout: ImageLayout, values: Sequence[str]) -> None:
    """Blend, mask and store one target."""
    state = step.state
    mask = state.color_mask[i] if state.color_mask else (True,) * 4
    at = [f"o{i} + {layout.places[k]}" for k in range(layout.channels)]
    results = list(values)
    if step.blending[i] is not None:
        stored = [load_expression(layout.format, f"pg_out{i}", index) for index in at]
        printer.line(f"float4 blended{i} = pg_blend{i}({_four(values)}, {_four(stored)});")
        results = [f"blended{i}.s{k}" for k in range(layout.channels)]
    for k, result in enumerate(results):
        if mask[k]:
            printer.line(f"pg_out{i}[{at[k]}] = {store_expression(layout.format, result)};")
