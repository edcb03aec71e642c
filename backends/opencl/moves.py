"""Pictures from one layout into another, on the device: of other formats, with other channels, rows and places."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from passgraph.backends.opencl.opencl_c import element, join, load_expression, package_text
from passgraph.backends.opencl.storage import ImageLayout
from passgraph.formats import Format

if TYPE_CHECKING:
    from passgraph.backends.opencl.backend import OpenCLBackend

_SOURCE = """
__kernel void pg_move(__global const {source}* restrict from, __global {destination}* restrict to)
{{
    int y = (int)get_global_id(1), start = (int)get_global_id(0) * {run}, end = min(start + {run}, {width});
    for (int x = start; x < end; ++x)
    {{
        {source_type} f = {source_place};
        {destination_type} t = {destination_place};
        {body}
    }}
}}
"""


def nearest_number(format_: Format, value: str) -> str:
    """The number nearest to a value, as an expression; as in passgraph.backends.steps, NaN is held as the lowest."""
    if not format_.steps:
        return f"pg_store_half({value})" if format_.number == "f2" else value
    # Comparisons and a plain conversion vectorise.
    low, steps = f"{format_.low}f", f"{format_.steps}.0f"
    clamped = f"({low} < {value} ? (1.0f < {value} ? 1.0f : {value}) : {low})"
    return f"({element(format_)})(int)rint({clamped} * {steps})"


def move_source(source: ImageLayout, destination: ImageLayout, run: int) -> str:
    """``pg_move``: ``run`` pixels of a row in one work-item.  Alpha that the source lacks is 1."""
    rows = []
    for channel in range(destination.channels):
        if channel >= source.channels:
            number = nearest_number(destination.format, "1.0f")
        elif source.format.number == destination.format.number:
            number = f"from[f + {source.channel(channel)}]"
        else:
            rows.append(
                f"float v{channel} = {load_expression(source.format, 'from', f'f + {source.channel(channel)}')};"
            )
            number = nearest_number(destination.format, f"v{channel}")
        rows.append(f"to[t + {destination.channel(channel)}] = {number};")
    return _SOURCE.format(
        source=element(source.format), destination=element(destination.format), run=run, width=source.size[0],
        source_type=source.index_type, source_place=source.place("x", "y"),
        destination_type=destination.index_type, destination_place=destination.place("x", "y"),
        body="\n        ".join(rows),
    )  # fmt: skip


def move(backend: OpenCLBackend, source: tuple[Any, ImageLayout], destination: tuple[Any, ImageLayout]) -> None:
    """A buffer's picture into another one of the same size."""
    layouts = source[1], destination[1]
    width, height = layouts[0].size
    run = width if backend.is_cpu else 1
    kernel = backend.moves.get(layouts)
    if kernel is None:
        text = join(package_text("helpers.cl"), move_source(*layouts, run))
        kernel = backend.cl.Kernel(backend.programs.build(text, "a copy of a picture"), "pg_move")
        backend.moves[layouts] = kernel
    kernel.set_args(source[0], destination[0])
    group = (1, 1) if backend.is_cpu else None
    backend.cl.enqueue_nd_range_kernel(backend.queue, kernel, (-(-width // run), height), group)
