"""Notebook output of objects: pictures at their size, graphs as SVG, tables as HTML, always with a text.

Each function returns the result of a class's ``_repr_mimebundle_``: content by media type.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from passgraph.graph.targets import Pass, Target
    from passgraph.language.kernel import Kernel
    from passgraph.plan.data import Plan
    from passgraph.run.program import Program
    from passgraph.run.result import Result
    from passgraph.verify.conformance.suite import SuiteReport
    from passgraph.verify.report import Report

Bundle = dict[str, str]
#: Most pixels of a shown picture, since they are stored in the notebook's file; larger pictures are subsampled.
MOST_PIXELS = 1 << 23
#: Boxes of a graph, gaps between them, and the margin for lines that pass rows, in pixels.
BOX_WIDTH, BOX_HEIGHT, GAP_X, GAP_Y, SIDE = 190, 40, 16, 30, 72


def bundle(text: str, html: str = "", svg: str = "") -> Bundle:
    """Return the content by media type, without empty entries.

    >>> bundle("a text", html="<b>a text</b>")
    {'text/plain': 'a text', 'text/html': '<b>a text</b>'}
    """
    kinds = {"text/plain": text, "text/html": html, "image/svg+xml": svg}
    return {kind: content for kind, content in kinds.items() if content}


def of_result(result: Result) -> Bundle:
    """Show each picture at its size, with a description of its mapping; alpha is left out, NaN is magenta."""
    lines, figures = [], []
    for name, picture in result.items():
        array = np.asarray(picture)
        height, width, channels = array.shape
        about = f"{name}: {width}x{height}, {channels} channels, {array.dtype}"
        image, words = _image(array)
        lines.append(about)
        figures.append(f"<figure>{image}<figcaption>{escape(f'{about}; {words}')}</figcaption></figure>")
    return bundle("\n".join(lines), "".join(figures))


def of_target(target: Target) -> Bundle:
    """Show the graph that a target depends on."""
    return bundle(repr(target), svg=graph_svg([target]))


def of_kernel(kernel: Kernel) -> Bundle:
    """Show a kernel's parameters with defaults and ranges, and its source."""
    rows = [
        (p.name, str(p.type), _default(p.default) if p.has_default else "", "" if p.range is None else str(p.range))
        for p in kernel.parameters
    ]
    shader = getattr(kernel, "shader", None)
    source = kernel.definition.source.text if kernel.definition is not None else "" if shader is None else shader.text
    parts = [f"<p><b>{escape(kernel.name)}</b>, a {kernel.stage} kernel</p>"]
    parts.append(table(("parameter", "type", "default", "range"), rows))
    if source:
        parts.append(f"<pre>{escape(source)}</pre>")
    return bundle(repr(kernel), "".join(parts))


def _default(value: object) -> str:
    """Return a float32 default as the shortest decimal number."""
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def of_plan(plan: Plan) -> Bundle:
    """Show the steps of a plan with their reads and writes, notes, and the diagram of lifetimes."""
    names = {resource.id: resource.name for resource in plan.resources}
    rows = [
        (
            number, step.name, ", ".join(dict.fromkeys(names[r] for r in step.reads)),
            ", ".join(names[r] for r in step.writes), f"{step.size[0]}x{step.size[1]}", step.work,
        )
        for number, step in enumerate(plan.steps, 1)
    ]  # fmt: skip
    notes = "".join(f"<li>{escape(note)}</li>" for note in plan.notes)
    steps = table(("", "pass", "reads", "writes", "size", "work"), rows)
    memory = f"<p>{plan.bytes / 2**20:.1f} MiB in {len(plan.memories)} pictures</p>"
    svg = plan.svg()
    return bundle(plan.explain(), f"{steps}{memory}<ul>{notes}</ul>{svg}" if notes else f"{steps}{memory}{svg}", svg)


def of_program(program: Program) -> Bundle:
    """Show a program's plan, or its graph before the first run if the sizes of inputs are open."""
    plan = program.known_plan
    about = f"program on {program.backend.name}"
    if plan is None:
        outputs = program.outputs
        return bundle(f"{about}: {', '.join(outputs)}", svg=graph_svg([*outputs.values()]))
    views = of_plan(plan)
    return {
        **views,
        "text/plain": f"{about}\n{views['text/plain']}",
        "text/html": f"<p>{about}</p>{views['text/html']}",
    }


def of_suite(report: SuiteReport) -> Bundle:
    """Show the table of groups of cases, and the cases that did not pass."""
    verdict = "passes" if report.passed else "does not pass"
    text = f"conformance of {report.backend}: {len(report.verdicts)} cases, {len(report.faults)} not passed: {verdict}"
    rows = [(g.group, g.cases, g.passed, f"{g.most_ambiguous:.2%}", f"{g.seconds:.1f}") for g in report.groups]
    faults = [(v.id, v.outcome, str(v.divergence or v.reason)) for v in report.faults]
    parts = [f"<p>{escape(text)}</p>", table(("group", "cases", "passed", "most ambiguous", "seconds"), rows)]
    if faults:
        parts.append(table(("case", "outcome", "why"), faults))
    return bundle("\n".join([text, *(f"{case}: {outcome}: {why}" for case, outcome, why in faults)]), "".join(parts))


def of_report(report: Report) -> Bundle:
    """Show each target on each backend against its bounds."""
    lines, rows = [], []
    for backend in report.backends:
        verdict = "; ".join(backend.faults) or "within bounds"
        lines.append(f"{backend.name}: {verdict}")
        if not backend.targets:
            rows.append((backend.name, "", "", "", "", verdict))
        for t in backend.targets:
            within = "within bounds" if t.within_bounds else f"outside at {t.outside:.3%} of pixels"
            rows.append((backend.name, t.step, t.target, f"{t.max_error:.3g}", f"{t.rmse:.3g}", within))
    lines += [report.equality] if report.equality else []
    heads = ("backend", "pass", "target", "largest error", "rmse", "verdict")
    return bundle("\n".join(lines), f"{table(heads, rows)}<p>{escape(report.equality)}</p>")


# Parts


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return an HTML table of texts and numbers.

    >>> table(["name", "size"], [("a<b", 3)])
    '<table><thead><tr><th>name</th><th>size</th></tr></thead><tbody><tr><td>a&lt;b</td><td>3</td></tr></tbody></table>'
    """
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join(f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _image(picture: Any) -> tuple[str, str]:
    """Return a picture as an HTML element with one CSS pixel a texel, and a description of its mapping."""
    from PIL import Image

    from passgraph.pictures import scaled, viewable

    height, width = picture.shape[:2]
    step = 1
    while (width // step) * (height // step) > MOST_PIXELS:
        step += 1
    seen, words = viewable(scaled(picture[::step, ::step]))
    pixels = np.round(seen * 255.0).astype(np.uint8)
    file = BytesIO()
    Image.fromarray(pixels[:, :, 0] if pixels.shape[2] == 1 else pixels).save(file, "PNG")
    data = b64encode(file.getvalue()).decode()
    style = "max-width:none;image-rendering:pixelated"
    words += f", every {step} texels" if step > 1 else ""
    return f'<img width="{width}" height="{height}" style="{style}" src="data:image/png;base64,{data}">', words


def graph_svg(outputs: Sequence[Target]) -> str:
    """Return an SVG of the passes with their targets, and of the inputs; each is below those that it reads."""
    boxes, reads = _boxes(outputs)
    rows = _rows(boxes, reads)
    most = max(len(row) for row in rows)
    width = most * (BOX_WIDTH + GAP_X) + GAP_X + SIDE
    places = {
        key: (GAP_X + (at + (most - len(row)) / 2) * (BOX_WIDTH + GAP_X), GAP_Y / 2 + number * (BOX_HEIGHT + GAP_Y))
        for number, row in enumerate(rows)
        for at, key in enumerate(row)
    }
    height = len(rows) * (BOX_HEIGHT + GAP_Y)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    for key, sources in reads.items():
        for source in sources:
            parts.append(f'<path d="{_curve(places[source], places[key])}" fill="none" stroke="#555"/>')
    for key, (title, about, is_pass) in boxes.items():
        x, y = places[key]
        look = 'rx="6" fill="#e3edf9"' if is_pass else 'fill="#f4f4f4" stroke-dasharray="4 3"'
        parts += [
            f"<g><title>{escape(f'{title}: {about}')}</title>",
            f'<rect x="{x:g}" y="{y:g}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" {look} stroke="#555"/>',
            f'<text x="{x + 8:g}" y="{y + 16:g}" font-weight="bold" fill="#111">{escape(_cut(title))}</text>',
            f'<text x="{x + 8:g}" y="{y + 32:g}" fill="#333">{escape(_cut(about))}</text></g>',
        ]
    return "\n".join([*parts, "</svg>"])


def _curve(above: tuple[float, float], below: tuple[float, float]) -> str:
    """Return the path from the bottom of a box to the top of a lower one; it passes other rows beside the boxes."""
    (x1, y1), (x2, y2) = above, below
    rows = round((y2 - y1) / (BOX_HEIGHT + GAP_Y))
    if rows == 1:
        x1, y1, x2, middle = x1 + BOX_WIDTH / 2, y1 + BOX_HEIGHT, x2 + BOX_WIDTH / 2, (y1 + BOX_HEIGHT + y2) / 2
        return f"M{x1:g},{y1:g} C{x1:g},{middle:g} {x2:g},{middle:g} {x2:g},{y2:g}"
    x1, y1, x2, y2 = x1 + BOX_WIDTH, y1 + BOX_HEIGHT / 2, x2 + BOX_WIDTH, y2 + BOX_HEIGHT / 2
    side = max(x1, x2) + min(8 * rows + 8, SIDE)
    return f"M{x1:g},{y1:g} C{side:g},{y1:g} {side:g},{y2:g} {x2:g},{y2:g}"


def _cut(text: str, most: int = 27) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"


#: A pass, an input, or a picture of the last run.
Key = Any


def _boxes(outputs: Sequence[Target]) -> tuple[dict[Key, tuple[str, str, bool]], dict[Key, list[Key]]]:
    """Return the title, text and kind of each box, and the boxes that each reads."""
    boxes: dict[Key, tuple[str, str, bool]] = {}
    reads: dict[Key, list[Key]] = {}
    pending = [output.content for output in outputs]
    while pending:
        target = pending.pop()
        node: Pass | None = target.made_by
        key: Key = target if node is None else node
        if key in boxes:
            continue
        if node is None:
            format_ = target.spec.format
            about = (
                f"{'earlier run' if target.is_previous else 'input'}{'' if format_ is None else f', {format_.name}'}"
            )
            boxes[key], reads[key] = (target.name, about, False), []
            continue
        kernel = getattr(node, "kernel", None) or getattr(node, "fragment", None)
        written = ", ".join(
            spec.format.name if spec.name == node.name else f"{spec.name} {spec.format.name}" for spec in node.into
        )
        boxes[key] = (node.name, f"{'' if kernel is None else kernel.name} → {written}".strip(), True)
        contents = list(dict.fromkeys(read.content for read in node.reads))
        reads[key] = list(dict.fromkeys(one if one.made_by is None else one.made_by for one in contents))
        pending += contents
    return boxes, reads


def _rows(boxes: Mapping[Key, object], reads: Mapping[Key, Sequence[Key]]) -> list[list[Key]]:
    """Arrange boxes in rows by their longest path from an input, each near the middle of those that it reads."""
    import networkx as nx

    graph = nx.DiGraph()
    graph.add_nodes_from(boxes)
    graph.add_edges_from((source, key) for key, sources in reads.items() for source in sources)
    rows = [list(row) for row in nx.topological_generations(graph)]
    place: dict[Key, float] = {}
    for row in rows:
        row.sort(key=lambda key: sum(place[s] for s in reads[key]) / max(1, len(reads[key])))
        place.update((key, (at + 0.5) / len(row)) for at, key in enumerate(row))
    return rows
