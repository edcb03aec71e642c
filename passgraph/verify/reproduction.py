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
from passgraph.formats import FORMATS, Format
from passgraph.plan.data import CountStep, DrawStep, PixelStep
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
    """The run of one pass: what it was sent, and the stored numbers of images and of pictures it draws over."""

    sent: SentPass | None = None
    pictures: dict[str, Any] = field(default_factory=dict)


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
        Why there is no reproduction; empty if it was written. Pixel passes and draws have one, on backends that say
        what they send (`Backend.sent`, `Backend.sent_draw`).
    """
    first = first_outside(passes, backend)
    if first is None:
        return "no target is outside of its bounds when the graph runs again"
    key, got = first
    frame, number, resource = key
    step = passes.plan.steps[number]
    if not isinstance(step, (PixelStep, DrawStep)) or isinstance(step, CountStep):
        return f"{step.name} is no pixel pass and no draw"
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
        "size": step.size, "target": step.writes.index(resource), "steps": target.format.steps,
        "pixel": found.pixel, "channel": found.channel, "device": vars(backend.device_info()),
        "conditions": conditions.as_data(), **sent.calls,
    }  # fmt: skip
    contents = {name: text.encode() for name, text in sent.sources.items()} | sent.buffers
    contents |= {f"{name}.npy": _bytes_of(np.save, picture) for name, picture in recorded.pictures.items()}
    low, high, may_be_nan = (np.broadcast_to(part, got.shape) for part in (bounds.lo, bounds.hi, bounds.nan))
    contents["allowed.npz"] = _bytes_of(np.savez_compressed, low=low, high=high, may_be_nan=may_be_nan)
    contents["case.json"] = (json.dumps(case, indent=1) + "\n").encode()
    contents["case.py"] = (PROGRAMS / "case.py.txt").read_bytes()
    contents["reproduce.py"] = (PROGRAMS / f"{sent.library}_{sent.program}.py.txt").read_bytes()
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
    recorded, pixels, draws, runs = _Recorded(), backend.pixel_pass, backend.draw_pass, [0]

    def keep(step: PixelStep | DrawStep, sent: SentPass | None, images: Sequence[Any]) -> None:
        recorded.sent = sent
        if sent is not None:
            described = zip(images, step.image_formats, sent.images, strict=True)
            recorded.pictures = {f"image{k}": _numbers(backend, *image) for k, image in enumerate(described)}

    def pixel_pass(step: PixelStep) -> Any:
        run = pixels(step)
        if step.name != name:
            return run

        def run_recorded(outputs: Sequence[Any], images: Sequence[Any], block: Block) -> None:
            if runs[0] == frame:
                keep(step, backend.sent(step, outputs, images, block), images)
            runs[0] += 1
            run(outputs, images, block)

        return run_recorded

    def draw_pass(step: DrawStep) -> Any:
        run = draws(step)
        if step.name != name:
            return run

        def run_recorded(outputs: Sequence[Any], depth: Any, images: Sequence[Any], *mesh_and_blocks: Any) -> None:
            if runs[0] == frame:
                sent = backend.sent_draw(step, outputs, depth, images, *mesh_and_blocks)
                keep(step, sent, images)
                if sent is not None:
                    for k, (storage, format_) in enumerate(zip(outputs, step.output_formats, strict=True)):
                        if sent.calls["kept"][k]:
                            type_ = sent.calls["outputs"][k][-1]
                            recorded.pictures[f"target{k}"] = _numbers(backend, storage, format_, type_)
                    if sent.calls["keeps_depth"]:
                        recorded.pictures["depth"] = _numbers(backend, depth, FORMATS["depth32f"], "float32")
            runs[0] += 1
            run(outputs, depth, images, *mesh_and_blocks)

        return run_recorded

    # Before the class's methods, of this one backend.
    vars(backend).update(pixel_pass=pixel_pass, draw_pass=draw_pass)
    try:
        yield recorded
    finally:
        del vars(backend)["pixel_pass"], vars(backend)["draw_pass"]


def _numbers(backend: Backend, storage: Any, format_: Format, type_: str) -> Any:
    width, height = storage.size
    numbers = np.empty((height, width, format_.channels), type_)
    backend.download_into(storage, numbers, format_)
    return numbers


def _bytes_of(save: Any, *arrays: Any, **named: Any) -> bytes:
    stream = io.BytesIO()
    save(stream, *arrays, **named)
    return stream.getvalue()
