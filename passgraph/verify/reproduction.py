"""Write a pass whose result is not allowed as a folder that repeats it without passgraph."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from passgraph.backends.base import Backend, Block, SentPass
from passgraph.formats import Format
from passgraph.plan.data import CountStep, PixelStep
from passgraph.verify.conditions import Conditions
from passgraph.verify.conformance.judging import divergence, first_outside
from passgraph.verify.oracle.pass_bounds import Passes
from passgraph.writing import made_folder, write_files

#: Texts of the programs: they run in the folder that they are copied to, and are no modules of passgraph.
PROGRAMS = Path(__file__).parents[1] / "assets" / "reproduction"
README = """A pass whose result on this device is outside of what its arithmetic and its formats allow:

    pip install {packages}
    python reproduce.py

It prints what the device computed and what is allowed. The exit status is 1 if a value is outside.

{facts}

Files
    reproduce.py, case.py   the program; it does not need passgraph
    {sources}   the text that was compiled
    case.json, *.bin   sizes, formats, parameters, and the versions of everything
    image*.npy   stored numbers of the images that the pass reads
    allowed.npz   lowest and highest value of each channel of each pixel, and where NaN is allowed
"""


@dataclass
class _Recorded:
    """The run of one pass: what it was sent, and the stored numbers of its images."""

    sent: SentPass | None = None
    images: list[Any] = field(default_factory=list)


def write_reproduction(passes: Passes, backend: Backend, folder: Path) -> str:
    """Write the first target of a graph that is outside of its bounds, with the reference's pictures as its inputs.

    Parameters
    ----------
    passes : the graph, with the inputs of its runs
    backend : open; it runs the graph twice
    folder : is made in a folder that exists; its files are replaced

    Returns
    -------
    str
        Why there is no reproduction; empty if it was written. Only pixel passes have one, on backends that say what
        they send (`Backend.sent`).
    """
    first = first_outside(passes, backend)
    if first is None:
        return "no target is outside of its bounds when the graph runs again"
    key, got = first
    frame, number, resource = key
    step = passes.plan.steps[number]
    if not isinstance(step, PixelStep) or isinstance(step, CountStep):
        return f"{step.name} is no pixel pass"
    expected, allowed = passes.allowed(backend.promises)
    with _recording(backend, step.name, frame) as recorded:
        for _ in passes.written(backend, expected):
            pass
    if recorded.sent is None:
        return f"{backend.name} does not say what it sends for pass {step.name}"
    bounds, sent = allowed[key].values, recorded.sent
    found = divergence("", got, expected[key], bounds.lo, bounds.hi, bounds.without(got))
    target = passes.plan.resources[resource]
    conditions = Conditions.now(backend, math=passes.plan.options.math)
    case = {
        "size": step.size, "target": step.outputs.index(resource), "steps": target.format.steps,
        "pixel": found.pixel, "channel": found.channel, "device": vars(backend.device_info()),
        "conditions": conditions.as_data(), **sent.calls,
    }  # fmt: skip
    contents = {name: text.encode() for name, text in sent.sources.items()} | sent.buffers
    contents |= {f"image{place}.npy": _bytes_of(np.save, image) for place, image in enumerate(recorded.images)}
    low, high, may_be_nan = (np.broadcast_to(part, got.shape) for part in (bounds.lo, bounds.hi, bounds.nan))
    contents["allowed.npz"] = _bytes_of(np.savez_compressed, low=low, high=high, may_be_nan=may_be_nan)
    contents["case.json"] = (json.dumps(case, indent=1) + "\n").encode()
    contents["case.py"] = (PROGRAMS / "case.py.txt").read_bytes()
    contents["reproduce.py"] = (PROGRAMS / f"{sent.library}_pass.py.txt").read_bytes()
    column, row = found.pixel
    facts = [
        ("pass", f"{step.name}, target {target.name} ({target.format.name})"),
        ("got", f"{found.got:.9g} at column {column}, row {row}, channel {found.channel}"),
        ("allowed", f"{found.low:.9g} to {found.high:.9g}"),
        *(row for row in conditions.rows() if row[0] != "libraries"),
    ]
    readme = README.format(
        packages=" ".join(f"{name}=={metadata.version(name)}" for name in ("numpy", sent.library)),
        facts="\n".join(f"{name}: {text}" for name, text in facts), sources=", ".join(sent.sources),
    )  # fmt: skip
    write_files(made_folder(folder), contents | {"README.txt": readme.encode()})
    return ""


def folder_name(text: str) -> str:
    """Return the name of a case as that of a folder.

    >>> folder_name("draws/blend from beyond [0, 1] into rgba8")
    'draws-blend-from-beyond-0-1-into-rgba8'
    """
    return re.sub(r"[^\w.]+", "-", text).strip("-")


@contextmanager
def _recording(backend: Backend, name: str, frame: int) -> Iterator[_Recorded]:
    """Record what a backend is sent for the pass of this name, when it runs for the ``frame``-th time."""
    recorded, plain, runs = _Recorded(), backend.pixel_pass, [0]

    def pixel_pass(step: PixelStep) -> Any:
        run = plain(step)
        if step.name != name:
            return run

        def run_recorded(outputs: Sequence[Any], images: Sequence[Any], block: Block) -> None:
            if runs[0] == frame:
                recorded.sent = backend.sent(step, outputs, images, block)
                if recorded.sent is not None:
                    described = zip(images, step.image_formats, recorded.sent.images, strict=True)
                    recorded.images = [_numbers(backend, *image) for image in described]
            runs[0] += 1
            run(outputs, images, block)

        return run_recorded

    vars(backend)["pixel_pass"] = pixel_pass  # before the class's method, of this one backend
    try:
        yield recorded
    finally:
        del vars(backend)["pixel_pass"]


def _numbers(backend: Backend, storage: Any, format_: Format, type_: str) -> Any:
    width, height = storage.size
    numbers = np.empty((height, width, format_.channels), type_)
    backend.download_into(storage, numbers, format_)
    return numbers


def _bytes_of(save: Any, *arrays: Any, **named: Any) -> bytes:
    stream = io.BytesIO()
    save(stream, *arrays, **named)
    return stream.getvalue()
