"""A plan as text, and as a drawing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from passgraph.plan.data import Plan


def explain(plan: Plan) -> str:
    """Describe the steps in order, memory, and what was culled, fused or aliased."""
    steps = "1 step" if len(plan.steps) == 1 else f"{len(plan.steps)} steps"
    lines = [f"{steps}, output {plan.size[0]}x{plan.size[1]}"]
    names = {r.id: r.name for r in plan.resources}
    for number, step in enumerate(plan.steps, 1):
        reads = ", ".join(dict.fromkeys(names[r] for r in step.reads)) or "nothing"
        writes = ", ".join(names[r] for r in step.writes)
        once = "; runs once" if step.static else ""
        lines.append(f"{number:3}. {step.name}: {reads} → {writes} ({step.work}, {step.size[0]}x{step.size[1]}{once})")
    saved = plan.bytes_unaliased - plan.bytes
    lines.append(
        f"memory: {_mebibytes(plan.bytes)} in {len(plan.memories)} pictures for "
        f"{len(plan.resources)} targets and inputs" + (f"; sharing saves {_mebibytes(saved)}" if saved else "")
    )
    lines += [f"- {note}" for note in plan.notes]
    return "\n".join(lines)


def _mebibytes(count: int) -> str:
    return f"{count / 2**20:.1f} MiB"


ROW_PX, COLUMN_PX, LEFT_PX = 34, 56, 300
#: Height above the first row for a title, and per letter of a name written at 45 degrees.
TITLE_PX, LETTER_PX, LABEL_DEGREES = 40, 5, -45
#: Hues, one for each shared allocation; distinguishable with the commonest kinds of color blindness (Okabe and Ito,
#: 2008).
COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442")
ALONE = "#999999"


def svg(plan: Plan) -> str:
    """Return the drawing as SVG text; pictures that share an allocation have one color, others are gray."""
    top_px = TITLE_PX + LETTER_PX * max((len(r.name) for r in plan.resources), default=0)
    width = LEFT_PX + COLUMN_PX * len(plan.resources) + top_px
    height = top_px + ROW_PX * (len(plan.steps) + 1)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        *_columns(plan, top_px),
        *_rows(plan, top_px, width),
        '<text x="12" y="20" fill="#555">● writes ○ reads, bar: lifetime, one colour: one memory '
        f"({len(plan.memories)})</text>",
    ]
    return "\n".join([*parts, "</svg>"])


def _middle(column: int) -> int:
    return LEFT_PX + column * COLUMN_PX + COLUMN_PX // 2


def _columns(plan: Plan, top_px: int) -> Iterator[str]:
    """Draw a bar for each picture, and its name above."""
    spans, uses = plan.lifetimes, Counter(r.memory for r in plan.resources)
    shared = [memory for memory, count in uses.items() if count > 1]
    for column, resource in enumerate(plan.resources):
        x, memory = _middle(column), resource.memory
        first, last = spans[resource.id]
        top, bottom = top_px + first * ROW_PX, top_px + min(last + 1, len(plan.steps)) * ROW_PX
        colour = COLOURS[shared.index(memory) % len(COLOURS)] if memory in shared else ALONE
        title = f"{resource.name}: {resource.format.name} {resource.size[0]}x{resource.size[1]}, memory {memory}"
        yield (
            f'<rect x="{x - 9}" y="{top + 3}" width="18" height="{bottom - top - 6}" rx="6" '
            f'fill="{colour}" fill-opacity="0.5">'
            f"<title>{escape(title)}</title></rect>"
        )
        yield (
            f'<text x="{x}" y="{top_px - 8}" transform="rotate({LABEL_DEGREES} {x} {top_px - 8})">'
            f"{escape(resource.name)}</text>"
        )


def _rows(plan: Plan, top_px: int, width: int) -> Iterator[str]:
    """Draw the name of each step, and dots at what it reads and writes."""
    for row, step in enumerate(plan.steps):
        y = top_px + row * ROW_PX + ROW_PX // 2
        note = " (runs once)" if step.static else ""
        yield f'<text x="12" y="{y + 4}" data-pass="{escape(step.name)}">{row + 1}. {escape(step.name)}{note}</text>'
        yield f'<line x1="12" x2="{width - 12}" y1="{y + 17}" y2="{y + 17}" stroke="#ddd"/>'
        for resource_id in step.reads:
            yield f'<circle cx="{_middle(resource_id)}" cy="{y}" r="5" fill="white" stroke="black"/>'
        for resource_id in step.writes:
            yield f'<circle cx="{_middle(resource_id)}" cy="{y}" r="5" fill="black"/>'
