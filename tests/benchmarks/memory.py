"""Memory of each effect's graph, from its plan: as written, with passes fused, and with memory shared.

    python tests/benchmarks/memory.py [WIDTHxHEIGHT]

Nothing runs: the plan knows every picture's format and size.  Inputs and textures count; meshes do not.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import passgraph as pg
from passgraph.effects.effect_table import EFFECTS, Effect
from passgraph.graph.targets import named_outputs
from passgraph.plan.build import build
from passgraph.plan.data import Plan

sys.path.insert(0, str(Path(__file__).parent))
from harness import Ratio

FULL_HD = (1920, 1080)
MEBIBYTE = 2.0**20


@dataclass(frozen=True, slots=True)
class Row:
    """One effect with its defaults.

    Attributes
    ----------
    name : in the registry, or of the variant
    passes, pictures : as written
    written : bytes with a memory for each picture of each pass
    fused : bytes with passes fused, still a memory for each picture
    shared : bytes with passes fused and memory shared, as programs run
    alone : bytes with memory shared and no pass fused
    """

    name: str
    passes: int
    pictures: int
    written: int
    fused: int
    shared: int
    alone: int

    @property
    def saved(self) -> float:
        """Share of the memory as written that fusing and sharing save together."""
        return 1.0 - self.shared / self.written

    @property
    def saved_by_sharing(self) -> float:
        """Share of the memory as written that sharing saves where no pass is fused."""
        return 1.0 - self.alone / self.written

    @property
    def markdown(self) -> str:
        sizes = " | ".join(f"{size / MEBIBYTE:.1f}" for size in (self.written, self.fused, self.alone, self.shared))
        return f"| {self.name} | {self.passes} | {self.pictures} | {sizes} | {self.saved:.0%} |"


HEADER = (
    "| Effect | Passes | Pictures | As written | Fused | Shared | Fused and shared | Saved |\n"
    "|---|---|---|---|---|---|---|---|"
)


def row(name: str, outputs: object, size: tuple[int, int]) -> Row:
    """The memory of a graph."""

    def plan(fuse: bool, alias: bool) -> Plan:
        return build(named_outputs(outputs), size, None, pg.Options(fuse=fuse, alias=alias))

    written = plan(False, False)
    return Row(
        name,
        len(written.steps),
        len(written.resources),
        written.bytes,
        plan(True, False).bytes,
        plan(True, True).bytes,
        plan(False, True).bytes,
    )


def made_by(effect: Effect, size: tuple[int, int], **parameters: object) -> object:
    """The effect on full-size float16 pictures, or on the shipped scene."""
    if effect.takes == "scene":
        return effect.build(pg.Scene.shipped(), **parameters)
    if effect.takes == "world2d":
        from passgraph.effects.light2d import World2D

        return effect.build(World2D.shipped(), size, **parameters)
    inputs = [pg.Input("frame", "rgba16f", size)]
    if effect.takes == "picture+depth":
        inputs.append(pg.Input("depth", "r32f", size))
    return effect.build(*inputs, **parameters)


def rows(size: tuple[int, int] = FULL_HD) -> list[Row]:
    """Every effect of the registry with its defaults; soft shadows with each of their filters."""
    found = [row(effect.name, made_by(effect, size), size) for effect in EFFECTS.values()]
    soft = EFFECTS["soft-shadow"]
    for choice in soft.parameter("shadow_filter").choices:
        if choice != soft.parameter("shadow_filter").default:
            found.append(row(f"soft-shadow, {choice}", made_by(soft, size, shadow_filter=choice), size))
    return found


def ratios(size: tuple[int, int] = FULL_HD) -> list[Ratio]:
    """What sharing memory saves on soft shadows, and sharing and fusing together."""
    found = row("soft-shadow", made_by(EFFECTS["soft-shadow"], size), size)
    return [
        Ratio("soft-shadow memory saved by sharing", 100 * found.saved_by_sharing, 40.0, unit="%", at_least=True),
        Ratio("soft-shadow memory saved by fusing and sharing", 100 * found.saved, 40.0, unit="%", at_least=True),
    ]


def table(size: tuple[int, int] = FULL_HD) -> str:
    """MiB, as a Markdown table."""
    return "\n".join([HEADER, *(each.markdown for each in rows(size))])


def main() -> None:
    width, height = (int(v) for v in (sys.argv[1] if len(sys.argv) > 1 else "1920x1080").split("x"))
    print(f"MiB at {width}x{height}")
    print(table((width, height)))


if __name__ == "__main__":
    main()
