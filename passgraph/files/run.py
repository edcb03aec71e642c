"""Run a program on every frame of a source: decode and encode in threads, compute the frames in order."""

from __future__ import annotations

import os
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, TypeAlias

from passgraph import arguments
from passgraph.errors import GraphError, InputError
from passgraph.files.flow import Run, Values, Watch
from passgraph.files.frame import MOST_JOBS, Sink, Source, Summary
from passgraph.files.frame_range import FrameRange
from passgraph.files.sequences import Numbers
from passgraph.run.program import Program

if TYPE_CHECKING:
    from distributed import Client


Feed: TypeAlias = "Source | str | os.PathLike[str]"
#: Most threads by default: at two 4K pictures in float32 for each, 2 GB.
DEFAULT_JOBS = 8
#: Most pixels across that a proxy makes one of.
MOST_PROXY = 64


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
    select: str | Collection[int] | FrameRange | None = None,
    proxy: int = 1,
    watch: Watch | None = None,
    client: Client | None = None,
) -> Summary:
    """Run a program on every frame of a source, and store the results.

    Threads decode a few frames ahead and encode results while the program computes the frames in order. Effects with
    history (``pg.previous``) see every frame, and memory holds only a few frames at a time.

    Parameters
    ----------
    program : what `passgraph.compile` returned; it stays open
    source : the source of the program's one input, or ``{name: source}`` for several inputs, read in step. A path is a
        picture, a folder of pictures, a numbered sequence (``shot.%04d.exr``, ``shot.####.exr``), an animation or a
        video. `Numbers` counts frames for a program that takes no pictures.
    sink : the sink of the results; a path is a numbered sequence, an animation or a video
    values : further run values by name: constants, or a function from the frame's number to them
    output : the target to store; by default the program's first
    jobs : threads that decode and encode; 1 does everything in the caller's thread; by default one a core, at most 8
    linear : decode the colors of 8- and 16-bit pictures from sRGB to linear light first
    resume : keep frames whose output is complete and was made of the same graph, settings, values, inputs (files by
        their size and modification time) and version; what differs is computed again (``remade`` of the summary). A
        video goes on after the frames that were encoded. Programs with history compute all frames without writing
        those. What made an output is recorded beside it, in ``.passgraph-made.jsonl``.
    same_size : fail a frame whose sources have pictures of different sizes
    select : numbers of the frames to store, such as ``"1001-1100x2"``; by default all. Programs with history compute
        those before too.
    proxy : reduce pictures by this factor before the program gets them: the first source's by means, others' by
        leaving out pixels, since they may be data
    watch : called with each frame's `Outcome`, in order, in the caller's thread
    client : a ``distributed.Client`` whose workers read and compute the frames, on the program's backend. Results are
        stored here, or by the workers as picture files; see docs/frames.md. Programs with history raise InputError.

    Returns
    -------
    A `Summary`. A frame that cannot be read, computed or written fails alone, but a full disk ends the run. If a
    picture's size changes, the program plans again; with history that frame fails.

    Raises
    ------
    InputError, GraphError : the run cannot begin: a source cannot be opened, or the program lacks a name.
    KeyboardInterrupt : finished frames are kept; incomplete output is removed.

    Examples
    --------
    >>> import numpy as np
    >>> import passgraph as pg
    >>> from passgraph.files import Arrays, ToArrays
    >>> invert = pg.kernel(source="def invert(color: Image) -> vec4: return vec4(1.0 - color[0, 0].rgb, 1.0)")
    >>> results = ToArrays()
    >>> with pg.compile(invert(pg.Input("frame")), backend="reference") as program:
    ...     pg.frames(program, Arrays([np.zeros((2, 3, 4), np.uint8)] * 5), results).written
    5
    >>> results.pictures[0][0, 0].tolist()
    [1.0, 1.0, 1.0, 1.0]
    """
    from passgraph.files.open import open_sink

    arguments.instance(program, Program, "the program of frames", "what pg.compile returned")
    if isinstance(sink, (str, os.PathLike)):
        sink = open_sink(sink)
    arguments.instance(sink, Sink, "the sink of frames", "a path, or a sink such as ToPictures(...)", InputError)
    proxy = arguments.whole_number(proxy, "frames: proxy", 1, MOST_PROXY, InputError)
    if isinstance(select, str):
        select = FrameRange.parsed(select)
    elif select is not None and not isinstance(select, FrameRange):
        select = FrameRange.of(select)
    for name, flag in (("linear", linear), ("resume", resume), ("same_size", same_size)):
        arguments.flag(flag, f"frames: {name}", InputError)
    if values is not None and not callable(values):
        arguments.instance(values, Mapping, "frames: values", "a mapping, or a function of the frame's number")
    if output is not None:
        arguments.text(output, "frames: output")
    if watch is not None:
        arguments.function(watch, "frames: watch")
    count = None if jobs is None else arguments.whole_number(jobs, "jobs", 1, MOST_JOBS, InputError)
    settings = (
        program,
        _by_name(program, source, values),
        sink,
        values,
        output,
        linear,
        resume,
        same_size,
        watch,
        select,
    )
    if client is None:
        return Run(*settings, proxy=proxy).all(count or default_jobs())
    from passgraph.files.remote import RemoteRun, check_remote, checked_client, threads_for

    if proxy != 1:
        raise InputError("frames: proxies are computed here; leave out client, or proxy")
    checked_client(client)
    check_remote(program)
    return RemoteRun(*settings, client=client).all(count or min(threads_for(client), MOST_JOBS))


def default_jobs() -> int:
    """Return the default number of threads: one a core that this process may use, at most `DEFAULT_JOBS`."""
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
        return {name: _opened(feed) for name, feed in source.items()}
    if isinstance(source, Numbers):
        required = [name for name, spec in program.inputs.items() if spec.default is None]
        if required:
            raise GraphError(f"the program takes pictures ({', '.join(required)}), and Numbers brings none")
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
