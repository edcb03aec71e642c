"""Compiles and runs a job, times it, and writes its picture: what ``render`` and ``apply`` have in common."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from passgraph.commands.capture import Capture
from passgraph.commands.files import FLOAT_SUFFIXES, check_folder, check_picture_path
from passgraph.commands.options import check_computes
from passgraph.commands.progress import progress
from passgraph.commands.sources import Job, in_bytes
from passgraph.errors import InputError
from passgraph.pictures import check_holds_bits
from passgraph.quantise import quantised
from passgraph.run.finite_checks import NonFinite

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from passgraph.run.program import Program


def check_one_picture(capture: Path | None, profile: bool, why: str) -> None:
    """Refuse what shows one picture alone; ``why`` there are several."""
    if capture is not None:
        raise InputError(f"--capture shows the passes of one picture, and {why}; leave out one")
    if profile:
        raise InputError(f"--profile times the passes on one picture, and {why}; leave out one")


def check_outputs(output: Path, capture: Path | None, bits: int = 8) -> None:
    """Refuse what cannot be written before the long work."""
    check_picture_path(output)
    if bits == 16:
        check_holds_bits(output, 16)
    if capture is not None:
        check_folder(capture)


def run_and_save(
    job: Job,
    backend: str | None,
    output: Path,
    capture: Path | None,
    non_finite: NonFinite = "error",
    check_finite: bool = False,
    profile: bool = False,
    bits: int = 8,
    like: Path | None = None,
) -> None:
    """Run a job once and write its first output; ``non_finite`` and ``check_finite`` as for :func:`passgraph.compile`.

    ``bits``: 8 or 16 a channel, of formats that have either.
    ``profile``: run it some more times, and say how long each pass takes.  ``like``: the picture file that the output
    is made of, whose colour profile it keeps.
    """
    from passgraph.pictures import save
    from passgraph.plan.data import Options
    from passgraph.run.compile import compile

    observer = None if capture is None else Capture(capture)
    options = Options() if observer is None else Options(fuse=False, alias=False)
    # Values that are not finite are named where a file cannot hold them; finite pictures of bytes stay bytes.
    keeps_more = output.suffix.lower() in FLOAT_SUFFIXES or bits == 16
    in_whole = not (observer or check_finite or keeps_more) and job.holds_bytes
    outputs = in_bytes(job.outputs) if in_whole else job.outputs
    with progress("compiling") as say:
        start = perf_counter()
        made = compile(
            outputs, backend, job.size, options, non_finite=non_finite, check_finite=check_finite,
            results="stored" if in_whole else "float32",
        )  # fmt: skip
        with made as program:
            check_computes(type(program.backend))  # the environment may name another one than the command line
            compiled = perf_counter()
            array = _output_of(program, next(iter(outputs)), job, observer, say)
            ran = perf_counter()
            name = program.backend.name
            if profile:
                say(f"timing each pass on {name}")
                times = program.profile(**job.given)
        say(f"writing {output}")
        is_whole = array.dtype.kind == "u" or output.suffix.lower() in FLOAT_SUFFIXES
        held = array if is_whole else quantised(array, np.dtype(f"u{bits // 8}"), str(output))
        is_half = bits == 16 and output.suffix.lower() in FLOAT_SUFFIXES
        save(output, held, like=like, bits=16 if is_half else None)
    height, width = array.shape[:2]
    looking = " (with capture)" if observer is not None else ""
    click.echo(
        f"{output}: {width}x{height} by {name}; compile {_time(compiled - start)}, run {_time(ran - compiled)}{looking}"
    )
    if observer is not None:
        observer.report()
    if profile:
        click.echo(str(times))


def _output_of(
    program: Program, wanted: str, job: Job, observer: Capture | None, say: Callable[[str], None]
) -> NDArray[Any]:
    """One output of a run, once the device is done."""
    from passgraph.run.room import room_of

    say(f"running on {program.backend.name}")
    room = room_of(program, [wanted])
    program.run(observer, into=room, **job.given)
    program.finish()
    return room[wanted]


def _time(seconds: float) -> str:
    return f"{seconds * 1e3:.1f} ms" if seconds < 1 else f"{seconds:.2f} s"
