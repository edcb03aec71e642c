"""Write a suite's report, or the comparison of two, as one self-contained HTML file."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from html import escape
from io import BytesIO

import numpy as np
from numpy.typing import NDArray

from passgraph.verify.conformance.case import Picture
from passgraph.verify.conformance.judging import Divergence
from passgraph.verify.conformance.kept_results import KeptCase, KeptReport, changes, other_conditions
from passgraph.verify.conformance.suite import SuiteReport

#: Pictures are enlarged by an integer factor to about this many pixels a side.
SHOWN_PX = 320
#: Colors of pixels outside their bounds, and of NaN.
OUTSIDE_COLOUR, NAN_COLOUR = (255, 40, 40), (255, 0, 255)
#: Number of divergences shown with pictures.
MOST_PICTURES = 50

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 75em; margin: 2em auto; padding: 0 1em; color: #222 }
table { border-collapse: collapse; margin: 1em 0 } td, th { padding: .25em .8em; text-align: right }
th { border-bottom: 2px solid #888 } td:first-child, th:first-child { text-align: left }
tr:nth-child(even) td { background: #f3f3f3 } h2 { margin-top: 2em }
.passed { color: #17691c } .fault { color: #a31515 }
figure { display: inline-block; margin: .5em 1em .5em 0 } img { image-rendering: pixelated; border: 1px solid #aaa }
pre { background: #f3f3f3; padding: .8em; overflow-x: auto; white-space: pre-wrap }
"""


def html_of(report: SuiteReport) -> str:
    """Return the table of groups, then each case that did not pass, with its pictures."""
    faults = report.faults
    word = '<b class="passed">passes</b>' if report.passed else '<b class="fault">does not pass</b>'
    parts = [
        _head(f"Conformance of {report.backend}"),
        f"<p>{len(report.verdicts)} cases, {len(faults)} of them not passed: the backend {word}.</p>",
        *([f"<p>The time was up before {len(report.not_run)} cases.</p>"] if report.not_run else []),
        _table(report),
        _rows((), report.conditions.rows()) if report.conditions is not None else "",
    ]
    shown = 0
    for verdict in faults:
        parts.append(f"<h2>{escape(verdict.id)}: <span class=fault>{escape(verdict.outcome)}</span></h2>")
        parts.append(f"<pre>{escape(str(verdict.divergence or verdict.reason))}</pre>")
        if verdict.divergence is not None and shown < MOST_PICTURES:
            parts += _figures(verdict.divergence)
            shown += 1
    return "\n".join(parts) + "\n"


def compared_html(before: KeptReport, after: KeptReport) -> str:
    """Return what differs between two reports, then every case of both."""
    found = changes(before, after)
    parts = [
        _head("Two runs of the conformance suite"),
        f"<p>A: {escape(before.title)}<br>B: {escape(after.title)}</p>",
        "<h2>Conditions that differ</h2>",
        _rows(("", "A", "B"), list(other_conditions(before, after))),
    ]
    for heading, wanted in (("Cases that differ", True), ("Cases that are the same", False)):
        rows = [
            (c.case, c.kind, *_figures_of(c.before), *_figures_of(c.after)) for c in found if c.is_difference == wanted
        ]
        heads = ("case", "B compared with A", "A", "error of A", "B", "error of B")
        parts += [f"<h2>{heading}: {len(rows)}</h2>", _rows(heads, rows)]
    return "\n".join(parts) + "\n"


def _figures_of(case: KeptCase | None) -> tuple[str, str]:
    return ("not run", "") if case is None else (case.outcome, f"{case.error:.3g}")


def _head(title: str) -> str:
    text = escape(title)
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{text}</title><style>{STYLE}</style><h1>{text}</h1>"
    )


def _table(report: SuiteReport) -> str:
    heads = ("group", "cases", "passed", "most ambiguous", "mean", "least told", "seconds")
    rows = [
        (g.group, g.cases, g.passed, f"{g.most_ambiguous:.2%}", f"{g.mean_ambiguous:.2%}", f"{g.least_told:.1%}",
         f"{g.seconds:.1f}")
        for g in report.groups
    ]  # fmt: skip
    return _rows(heads, rows)


def _rows(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    head = "".join(f"<th>{escape(text)}" for text in heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(str(cell))}" for cell in row) for row in rows)
    return f"<table><tr>{head}{body}</table>"


def _figures(divergence: Divergence) -> Iterator[str]:
    got, expected, beyond = divergence.pictures
    column, row = divergence.pixel
    mask = np.zeros((*beyond.shape, 3), np.uint8)
    mask[...] = 235
    mask[beyond] = OUTSIDE_COLOUR
    scale, words = _scale(expected)
    for picture, title in (
        (_bytes(got, scale), "got"),
        (_bytes(expected, scale), f"expected; {words}"),
        (mask, f"outside its bounds, {beyond.mean():.3%}; worst at column {column}, row {row}"),
    ):
        text = escape(title)
        yield f'<figure><img alt="{text}" src="{_data(picture)}"><figcaption>{text}</figcaption></figure>'


def _scale(picture: Picture) -> tuple[NDArray[np.float64], str]:
    """Scale values from black to white, and describe the scale: stored values if they are colors, otherwise ranks."""
    finite = np.unique(picture[np.isfinite(picture)]).astype(np.float64)
    if finite.size == 0 or (finite[0] >= 0 and finite[-1] <= 1 and picture.shape[2] > 1):
        return np.linspace(0.0, 1.0, 256), "black is 0, white is 1"
    if finite.size == 1:
        return np.array([finite[0] - 1.0, finite[0], finite[0] + 1.0]), f"grey is {finite[0]:.6g}"
    return finite, f"from black, {finite[0]:.6g}, to white, {finite[-1]:.6g}, by rank"


def _bytes(picture: Picture, scale: NDArray[np.float64]) -> NDArray[np.uint8]:
    colours = picture[:, :, :1].repeat(3, axis=2) if picture.shape[2] == 1 else picture[:, :, :3]
    if colours.shape[2] == 2:
        colours = np.concatenate([colours, np.zeros_like(colours[:, :, :1])], axis=2)
    values = np.nan_to_num(colours.astype(np.float64), nan=scale[0])
    pixels = np.rint(np.interp(values, scale, np.linspace(0.0, 255.0, len(scale)))).astype(np.uint8)
    pixels[np.isnan(colours).any(axis=2)] = NAN_COLOUR
    return pixels


def _data(pixels: NDArray[np.uint8]) -> str:
    """Return the enlarged picture as the text of a PNG."""
    from PIL import Image

    factor = max(1, SHOWN_PX // max(pixels.shape[:2]))
    large = pixels.repeat(factor, axis=0).repeat(factor, axis=1)
    stream = BytesIO()
    Image.fromarray(large).save(stream, "PNG")
    return "data:image/png;base64," + base64.b64encode(stream.getvalue()).decode("ascii")
