"""A plan in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from passgraph.plan.data import Plan


def explain(plan: Plan) -> str:
    """Steps in order, memory, and what was left out, fused or shared."""
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
