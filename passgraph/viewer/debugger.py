"""Debug a picture of the live view: the lines of a pixel, the passes and their code, the oracle's verdict.

The debugger has its own backends and runs in the caller's thread, while the view continues.
"""

from __future__ import annotations

import base64
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import BytesIO
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from passgraph.backends.base import Backend
from passgraph.backends.registry import backend_names, open_backend
from passgraph.errors import DeviceMissingError
from passgraph.graph.targets import PixelPass, Target
from passgraph.language.kernel import Kernel
from passgraph.plan.build import build
from passgraph.plan.data import DrawStep, Options, PixelStep, Plan
from passgraph.plan.dependencies import inputs_behind
from passgraph.run.caller_arrays import admitted_picture, bound_to
from passgraph.run.compile import compile
from passgraph.run.inspection import text_of
from passgraph.verify.lines import Lines, LineValue, lines_at
from passgraph.verify.oracle.pass_bounds import Passes
from passgraph.verify.oracle.time_limit import TimeLimit
from passgraph.viewer.compiled import targets_of, values_of
from passgraph.viewer.subject import Drawing

#: Time limit of the oracle for a picture in seconds, and most texels of an image that are listed.
VERDICT_S, MOST_TEXELS = 30.0, 4096
#: Colors of the oracle's mask (red, green, blue, alpha).
OUTSIDE, UNDECIDED = (255, 0, 60, 255), (255, 200, 0, 150)


@dataclass(frozen=True)
class View:
    """The view that is on screen.

    Attributes
    ----------
    drawing : the graph
    target : the shown target
    backends : names; the first is shown and the second compared with it; empty for the default
    run_inputs : pictures and run values of the drawing, by name
    """

    drawing: Drawing
    target: Target
    backends: Sequence[str]
    run_inputs: Mapping[str, Any]

    def run_inputs_of(self, outputs: Mapping[str, Target]) -> dict[str, Any]:
        """Return the pictures and run values that some targets depend on."""
        names = {*inputs_behind([*outputs.values()]), *values_of(outputs.values())}
        return {name: value for name, value in self.run_inputs.items() if name in names}


class Debugger:
    """Inspects a view; `close` closes its backends."""

    def __init__(self) -> None:
        self._backends: dict[str, Backend] = {}
        self._turn = threading.Lock()

    def close(self) -> None:
        with self._turn:
            for backend in self._backends.values():
                backend.close()
            self._backends = {}

    @contextmanager
    def _using(self, names: Sequence[str]) -> Iterator[list[Backend]]:
        with self._turn:
            for name in names:
                if name not in self._backends:
                    self._backends[name] = open_backend(name or None)
            yield [self._backends[name] for name in names]

    def pixel(self, view: View, x: int, y: int) -> dict[str, Any]:
        """Return the values of each line of the target's kernel at a pixel, on the reference and the backends."""
        made_by = view.target.made_by
        if made_by is None:
            return {"text": f"({x}, {y}) of {view.target.name}: an input, which no kernel computes"}
        outputs = {"target": view.target}
        run_inputs = view.run_inputs_of(outputs)
        if not isinstance(made_by, PixelPass):
            with compile(outputs, "reference", view.drawing.size, non_finite="keep") as program:
                return {"text": str(program.inspect(x, y, made_by.name, **run_inputs))}
        with self._using(view.backends) as backends:
            lines = [lines_at(outputs, b, (x, y), run_inputs, size=view.drawing.size) for b in backends]
        return _lines_facts(view, lines)

    def passes(self, view: View) -> dict[str, Any]:
        """Return the plan as text with the times of passes, and as SVG."""
        outputs = view.drawing.outputs
        with self._using(view.backends[:1]) as (backend,):
            program = compile(outputs, backend, view.drawing.size, non_finite="keep")
            with program:
                times = program.profile(5, **view.run_inputs_of(outputs))
                plan = program.plan
        return {"text": f"{plan.explain()}\n\n{times}", "svg": plan.svg(), "passes": [step.name for step in plan.steps]}

    def code(self, view: View, name: str) -> dict[str, Any]:
        """Return the source of a pass's kernel, and the code that each backend generates from it."""
        with self._using(view.backends[:1]) as (shown,):
            plan = _plan(view, shown)
        step = next((s for s in plan.steps if s.name == name and isinstance(s, (PixelStep, DrawStep))), None)
        if step is None:
            return {"name": name, "text": "a copy: no kernel computes it", "code": {}}
        sizes = {resource.id: resource.size for resource in plan.resources}
        code = {}
        for backend in backend_names():
            with suppress(DeviceMissingError), self._using([backend]) as (opened,):
                code[backend] = opened.code(step, sizes)
        source = step.source
        text = "\n\n".join(map(_source_of, source.kernels))
        written = next((k for k, t in targets_of(view.drawing.outputs).items() if t.made_by is source), "")
        return {"name": name, "target": written, "text": text, "code": {k: v for k, v in code.items() if v}}

    def verdict(self, view: View) -> dict[str, Any]:
        """Return a mask of the target's pixels that are outside the oracle's bounds on the shown backend.

        Each pass reads the reference's pictures, so that errors of earlier passes do not count.
        """
        outputs = {"target": view.target}
        if view.target.made_by is None:
            return {"text": "an input: no kernel computes it"}
        limit = TimeLimit(VERDICT_S)
        passes = Passes(outputs, view.drawing.size, [view.run_inputs_of(outputs)], limit)
        resource = passes.plan.outputs["target"]
        with self._using(view.backends[:1]) as (backend,):
            expected, allowed = passes.allowed(backend.promises)
            (written,) = passes.written(backend, expected)
        key = max(key for key in expected if key[2] == resource)
        bounds = allowed[key]
        outside = bounds.values.without(written[key]).any(axis=2) & ~bounds.ambiguous
        mask = np.zeros((*outside.shape, 4), np.uint8)
        mask[bounds.ambiguous] = UNDECIDED
        mask[outside] = OUTSIDE
        text = (
            f"{outside.sum()} of {outside.size} pixels are outside of their bounds, {bounds.ambiguous.sum()} undecided"
        )
        text += f", {bounds.untried} not tried in {VERDICT_S:.0f} s" if bounds.untried else ""
        return {"text": f"{backend.name}: {text}", "mask": _png(mask)}


def _plan(view: View, backend: Backend) -> Plan:
    """Return the drawing's plan on the shown backend."""
    outputs = view.drawing.outputs
    pictures, inputs = view.run_inputs_of(outputs), inputs_behind([*outputs.values()])
    bound = {n: bound_to(admitted_picture(pictures.get(n, spec.default), spec), spec) for n, spec in inputs.items()}
    options = Options() if backend.optimises else Options(fuse=False)
    return build(outputs, view.drawing.size, bound, options, backend.limits)


def _png(pixels: Any) -> str:
    from PIL import Image

    file = BytesIO()
    Image.fromarray(pixels).save(file, "PNG", compress_level=1)
    return base64.b64encode(file.getvalue()).decode()


def _source_of(kernel: Kernel) -> str:
    """Return the text of a kernel, or of its shader file, with its position."""
    span = kernel.program.source
    if kernel.definition is not None:
        return f"{Path(span.file).name}:{span.line}\n{kernel.definition.source.text}"
    shader = getattr(kernel, "shader", None)
    return f"{span.file}\n{shader.text}" if shader is not None else f"{span.file}: {kernel!r}"


# Lines


def _lines_facts(view: View, lines: Sequence[Lines]) -> dict[str, Any]:
    """Return the lines of a pixel on each backend, for the page."""
    first = lines[0].inspection
    names = {content.content: name for name, content in targets_of(view.drawing.outputs).items()}
    images = view.target.made_by.images if isinstance(view.target.made_by, PixelPass) else {}
    texels = [
        {"image": image, "target": names.get(images[image].content, ""), "at": list(read[:MOST_TEXELS])}
        for image, read in first.texels.items()
        if image in images
    ]
    return {
        "title": f"pass {first.step} at {first.pixel} of {first.size[0]}x{first.size[1]}: kernel {first.kernel}, "
        f"{Path(first.file).name}",
        "parameters": [f"{name} = {text_of(value)}" for name, value in first.parameters.items()],
        "backends": [of_backend.backend for of_backend in lines],
        "verdicts": [_verdict(of_backend) for of_backend in lines] + _first_difference(lines),
        "rows": [_row(values) for values in zip_longest(*(of_backend.values for of_backend in lines))],
        "texels": texels,
        "text": str(first),
    }


def _verdict(lines: Lines) -> str:
    wrong = lines.first_wrong
    if wrong is None:
        return f"{lines.backend}: every line is within its bounds"
    return f"{lines.backend}: line {lines.values[wrong].probe.span.line} is the first outside of its bounds"


def _first_difference(lines: Sequence[Lines]) -> list[str]:
    """Return a sentence about the first line at which two backends differ; empty for one backend."""
    if len(lines) < 2:
        return []
    first, second = lines
    for a, b in zip(first.values, second.values, strict=False):
        if a.value != b.value or a.probe != b.probe:
            return [f"{first.backend} and {second.backend} first differ at line {a.probe.span.line}"]
    return [f"{first.backend} and {second.backend} have the same bits at each line"]


def _row(values: Sequence[LineValue | None]) -> dict[str, Any]:
    """Return a line's value on the reference and on each backend; ``wrong`` is True for those outside their bounds."""
    known = next(value for value in values if value is not None)
    probe = known.probe
    texts = ["" if v is None else "=" if v.value == v.reference else _numbers(v.value, v) for v in values]
    return {
        "line": probe.span.line,
        "source": probe.span.text.strip(),
        "name": probe.name,
        "kind": probe.kind,
        "values": [_numbers(known.reference, known), *texts],
        "wrong": [value is not None and not value.allowed for value in values],
        "differs": any(value is not None and value.value != known.value for value in values),
    }


def _numbers(numbers: Sequence[float], value: LineValue) -> str:
    if value.probe.kind == "branch":
        return "holds" if numbers[0] else "does not hold"
    return "  ".join(f"{number:.9g}" for number in numbers)
