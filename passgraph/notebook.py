"""Parts of what objects show in notebooks: pictures at their size, graphs as SVG, tables as HTML, always with a text.

A class's ``_repr_mimebundle_`` puts them together; this module knows none of these classes.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from io import BytesIO
from typing import Any, Protocol

import numpy as np

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


def short(value: object) -> str:
    """Return a float32 default as the shortest decimal number."""
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return an HTML table of texts and numbers.

    >>> table(["name", "size"], [("a<b", 3)])
    '<table><thead><tr><th>name</th><th>size</th></tr></thead><tbody><tr><td>a&lt;b</td><td>3</td></tr></tbody></table>'
    """
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join(f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def image(picture: Any) -> tuple[str, str]:
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


class Boxed(Protocol):
    """A picture of a graph."""

    def _notebook_box_(self) -> Box:
        """Return the box that shows how it is made."""


@dataclass(frozen=True)
class Box:
    """A pass, an input, or a picture of an earlier run.

    Attributes
    ----------
    key : equal for pictures that share the box
    """

    key: Hashable
    title: str
    about: str
    is_pass: bool
    reads: Sequence[Boxed] = ()


def graph_svg(outputs: Sequence[Boxed]) -> str:
    """Return an SVG of the passes with their targets, and of the inputs; each is below those that it reads."""
    boxes: dict[Hashable, Box] = {}
    pending = list(outputs)
    while pending:
        box = pending.pop()._notebook_box_()
        if box.key not in boxes:
            boxes[box.key] = box
            pending += box.reads
    reads = {key: list(dict.fromkeys(read._notebook_box_().key for read in box.reads)) for key, box in boxes.items()}
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
    for key, box in boxes.items():
        x, y = places[key]
        look = 'rx="6" fill="#e3edf9"' if box.is_pass else 'fill="#f4f4f4" stroke-dasharray="4 3"'
        parts += [
            f"<g><title>{escape(f'{box.title}: {box.about}')}</title>",
            f'<rect x="{x:g}" y="{y:g}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" {look} stroke="#555"/>',
            f'<text x="{x + 8:g}" y="{y + 16:g}" font-weight="bold" fill="#111">{escape(_cut(box.title))}</text>',
            f'<text x="{x + 8:g}" y="{y + 32:g}" fill="#333">{escape(_cut(box.about))}</text></g>',
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


def _rows(boxes: Mapping[Hashable, object], reads: Mapping[Hashable, Sequence[Hashable]]) -> list[list[Hashable]]:
    """Arrange boxes in rows by their longest path from an input, each near the middle of those that it reads."""
    import networkx as nx

    graph = nx.DiGraph()
    graph.add_nodes_from(boxes)
    graph.add_edges_from((source, key) for key, sources in reads.items() for source in sources)
    rows = [list(row) for row in nx.topological_generations(graph)]
    place: dict[Hashable, float] = {}
    for row in rows:
        row.sort(key=lambda key: sum(place[s] for s in reads[key]) / max(1, len(reads[key])))
        place.update((key, (at + 0.5) / len(row)) for at, key in enumerate(row))
    return rows
