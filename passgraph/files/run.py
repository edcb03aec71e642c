"""Frames through a program: decoding and encoding in threads, the passes of one frame after another."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeAlias

from passgraph import arguments
from passgraph.errors import GraphError, InputError
from passgraph.files.flow import Run, Values, Watch
from passgraph.files.frame import MOST_JOBS, Sink, Source, Summary
from passgraph.files.sequences import Numbers
from passgraph.run.program import Program

if TYPE_CHECKING:
    from distributed import Client


Feed: TypeAlias = "Source | str | os.PathLike[str]"
#: Most threads where nothing is said: two 4K pictures in float32 for each are 2 GB.
DEFAULT_JOBS = 8


def frames(
    program: Program,
    source: Feed | Mapping[str, Feed],
    sink: Sink | str | os.PathLike[str],
    *,
    values: Values | None = None,
    output: str | None = None,
    jobs: int | None = None,
    linear: bool = False,
    resume: bool = False,
    same_size: bool = False,
    watch: Watch | None = None,
    client: Client | None = None,
) -> Summary:
    """Run a program on every frame of a source, and store the results.

    Pictures are decoded and encoded in threads, a few ahead, while the program runs frame after frame in order: so
    effects with history (``pg.previous``) see every frame, and memory holds a few frames however many there are.

    Parameters
    ----------
    program : what `passgraph.compile` returned; it stays open
    source : where the frames of its one input come from, or ``{name: source}`` for several, which go in step.  A path
        is a picture, a folder of pictures, a numbered sequence (``shot.%04d.exr``, ``shot.####.exr``) or a video.
        `Numbers` counts the frames of a program that takes no pictures.
    sink : where results go; a path is a numbered sequence, a folder, or a video
    values : what else a run is given by name: constants, or a function from the frame's number to them
    output : the target that is stored; left out, the program's first
    jobs : threads that decode and encode; 1 does everything in turn in the caller's; left out, one a core, at most 8
    linear : decode the colours of 8- and 16-bit pictures from sRGB to linear light first
    resume : leave out frames whose output is there, newer than the input.  Programs with history run them all the
        same, without writing them.
    same_size : refuse a frame for which several sources bring pictures of different sizes
    watch : called with each frame's `Outcome`, in order, in the caller's thread
    client : a ``distributed.Client``: frames are read and computed by its workers, each on the backend of the program's
        name, and stored here or, as picture files, by them; see docs/frames.md.  Programs with history are refused.

    Returns
    -------
    A `Summary`.  A frame that cannot be read, computed or written fails alone and the others are done, but where the
    disk is full the run stops.  Where a picture's size changes, the program plans again; with history that frame fails.

    Raises
    ------
    InputError, GraphError : what cannot begin: a source that does not open, names that the program does not have.
    KeyboardInterrupt : frames that were done stay; what is not whole is removed.

    Examples
    --------
    >>> import numpy as np
    >>> import passgraph as pg
    >>> from passgraph.files import Arrays, ToArrays
    >>> invert = pg.kernel(source="def invert(color: Image) -> vec4: return vec4(1.0 - color[0, 0].rgb, 1.0)")
    >>> made = ToArrays()
    >>> with pg.compile(invert(pg.Input("frame")), backend="reference") as program:
    ...     pg.frames(program, Arrays([np.zeros((2, 3, 4), np.uint8)] * 5), made).written
    5
    >>> made.pictures[0][0, 0].tolist()
    [1.0, 1.0, 1.0, 1.0]
    """
    from passgraph.files.open import open_sink

    arguments.instance(program, Program, "the program of frames", "what pg.compile returned")
    if isinstance(sink, (str, os.PathLike)):
        sink = open_sink(sink)
    arguments.instance(sink, Sink, "the sink of frames", "a path, or a sink such as ToPictures(...)", InputError)
    for name, flag in (("linear", linear), ("resume", resume), ("same_size", same_size)):
        arguments.flag(flag, f"frames: {name}", InputError)
    if values is not None and not callable(values):
        arguments.instance(values, Mapping, "frames: values", "a mapping, or a function of the frame's number")
    if output is not None:
        arguments.text(output, "frames: output")
    if watch is not None:
        arguments.function(watch, "frames: watch")
    count = None if jobs is None else arguments.whole_number(jobs, "jobs", 1, MOST_JOBS, InputError)
    told = program, _by_name(program, source, values), sink, values, output, linear, resume, same_size, watch
    if client is None:
        return Run(*told).all(count or default_jobs())
    from passgraph.files.remote import RemoteRun, check_travels, checked_client, threads_for

    checked_client(client)
    check_travels(program)
    return RemoteRun(*told, client=client).all(count or min(threads_for(client), MOST_JOBS))


def default_jobs() -> int:
    """One a core that this process may use, and not too many: each holds pictures."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores, DEFAULT_JOBS)


def _by_name(program: Program, source: Feed | Mapping[str, Feed], values: Values | None) -> dict[str, Source]:
    if isinstance(source, Mapping):
        for name in source:
            if not arguments.among(name, program.inputs):
                known = ", ".join(program.inputs) or "none"
                raise GraphError(f"there is no input {arguments.shown(name)}; the program has {known}")
        if not source:
            raise GraphError("frames needs a source; give one, or {'frame': source}")
        return {name: _opened(one) for name, one in source.items()}
    if isinstance(source, Numbers):
        wanted = [name for name, spec in program.inputs.items() if spec.default is None]
        if wanted:
            raise GraphError(f"the program takes pictures ({', '.join(wanted)}), and Numbers brings none")
        return {"": source}
    constant = values if isinstance(values, Mapping) else {}
    fed = [name for name, spec in program.inputs.items() if spec.default is None and name not in constant]
    if len(fed) != 1:
        known = ", ".join(program.inputs) or "none"
        raise GraphError(
            f"the program has {len(fed)} inputs that a source could be for ({known}); give a mapping such as "
            "{'frame': source}"
        )
    return {fed[0]: _opened(source)}


def _opened(source: Feed) -> Source:
    from passgraph.files.open import open_source

    if isinstance(source, (str, os.PathLike)):
        return open_source(source)
    if not isinstance(source, Source):
        raise InputError(
            f"a source of frames must be a path, or one such as Pictures([...]) or Arrays([...]), got "
            f"{arguments.shown(source)}"
        )
    return source
