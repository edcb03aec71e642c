"""``passgraph apply`` on a TIFF stack: one program over all planes, or over those of ``--channel`` and ``--plane``."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from passgraph.commands.command_graph import effect_output, picture_parameters
from passgraph.commands.large_picture import takes_gray
from passgraph.commands.options import Decorated, together
from passgraph.commands.running import RunOptions, program_of
from passgraph.errors import InputError
from passgraph.graph.targets import Input, named_outputs
from passgraph.pictures import holds_several
from passgraph.quantise import integers_of
from passgraph.run.caller_arrays import format_of

if TYPE_CHECKING:
    from passgraph.effects.effect_table import Effect
    from passgraph.tiles.grid import Numbers

TIFF = (".tif", ".tiff")

stack_options: Callable[[Decorated], Decorated] = together(
    click.option("--channel", metavar="NAME", help="Channel of a TIFF stack, by its name or number from 0."),
    click.option(
        "--plane", multiple=True, metavar="AXIS=NUMBER",
        help="Place along an axis of a TIFF stack, from 0: z=3; may be repeated.  [default: every plane]",
    ),
)  # fmt: skip


def apply_to_stack(
    effect: Effect, picture: Path, output: Path, parameters: dict[str, Any], run: RunOptions, linear: bool,
    channel: str | None, planes: tuple[str, ...],
) -> bool:  # fmt: skip
    """Apply an effect to each plane of a TIFF stack; return False if the input or the output is none."""
    chosen = {"c": channel} if channel is not None else {}
    for text in planes:
        axis, equals, place = text.partition("=")
        if not (axis and equals and place):
            raise InputError(f"--plane {text!r}: expected AXIS=NUMBER, such as z=3")
        chosen[axis] = place
    if picture.suffix.lower() not in TIFF or output.suffix.lower() not in TIFF:
        if chosen:
            raise InputError(
                f"--channel and --plane are for TIFF stacks, from .tif to .tif; got {picture} and {output}"
            )
        return False
    if not chosen and (not holds_several(picture) or find_spec("tifffile") is None):
        return False
    from passgraph.tiles.stacks import opened_stack, write_stack

    with opened_stack(picture) as stack:
        if stack is None:
            if chosen:
                raise InputError(f"{picture}: is no stack; leave out --channel and --plane")
            return False
        if linear:
            raise InputError(f"{picture}: is a stack, whose numbers are not encoded; add --as-stored")
        places = stack.places(chosen)
        height, width, *samples = stack.plane_shape
        gray = not samples and takes_gray(effect)
        channels = 1 if gray else samples[0] if samples else 3
        dtype = stack.dtype if stack.dtype.kind == "u" else np.dtype(np.float32)
        parameters, inputs = picture_parameters(effect, parameters)
        effect = effect.for_opaque() if channels != 4 else effect
        frame = Input("frame", format_of(dtype, channels), (width, height))
        outputs = named_outputs(effect_output(effect, [frame], parameters))
        name = next(iter(outputs))
        with program_of(outputs, None, run, as_stored=False) as program:

            def compute(plane: Numbers) -> Numbers:
                given = plane if samples else np.repeat(plane[..., None], channels, axis=2)
                result = program(frame=given, **inputs)[name]
                result = result[..., 0] if gray else result[..., :channels]
                return integers_of(result, dtype, str(output)) if dtype.kind == "u" else result.astype(np.float32)

            count = write_stack(stack, places, output, compute)
            backend = program.backend.name
    click.echo(f"{output}: {count} plane{'s' if count > 1 else ''} of {width}x{height} by {backend}")
    return True
