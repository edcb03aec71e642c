"""Render targets and inputs, the handles that a graph is written with, and the passes behind them.  No device."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from passgraph import arguments
from passgraph.errors import GraphError
from passgraph.formats import Format, format_named
from passgraph.graph.draw_state import DrawState
from passgraph.graph.geometry import Geometry
from passgraph.language.borders import BORDERS
from passgraph.language.kernel import Kernel

#: Largest side of a target, in pixels: what GL 3.3 hardware offers in practice.
MAX_SIDE = 1 << 15
#: Largest number of an output among those of its pass: structs have no more fields.
MOST_SLOTS = 255


@dataclass(frozen=True, slots=True)
class Absolute:
    """A size in pixels."""

    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Relative:
    """A fraction of the output's size, rounded up."""

    scale: float = 1.0


@dataclass(frozen=True, slots=True)
class Like:
    """A fraction of the size of another target or input, rounded up."""

    other: Target
    scale: float = 1.0


@dataclass(frozen=True, slots=True)
class Blocks:
    """So many pixels side by side for each block of another picture's texels; a block at an edge may be smaller."""

    other: Target
    width: int
    height: int
    each: int = 1


SizeClass: TypeAlias = Absolute | Relative | Like | Blocks


@dataclass(frozen=True, eq=False)
class TargetSpec:
    """A render target as declared: what a pass writes ``into``."""

    name: str
    format: Format
    size: SizeClass | None = None
    clear: tuple[float, ...] | None = None
    notes: tuple[str, ...] = ()  # what an effect decided, for plan.explain()

    def __post_init__(self) -> None:
        where = f"target {arguments.text(self.name, 'the name of a target')!r}"
        arguments.instance(self.format, Format, f"{where}: format", "one of passgraph.formats.FORMATS")
        if self.size is not None:
            arguments.instance(
                self.size,
                (Absolute, Relative, Like, Blocks),
                f"{where}: size",
                "made by pg.target(size=, scale= or like=)",
            )
        if self.clear is not None:
            _check_clear(self.clear, self.format, where)
        arguments.several(self.notes, str, f"{where}: notes", "lines of text")

    def __repr__(self) -> str:
        return f"<target {self.name} {self.format.name}>"


@dataclass(frozen=True, eq=False)
class InputSpec:
    """A picture that each run brings; format and size are bound at the first run where left open."""

    name: str
    format: Format | None = None
    size: tuple[int, int] | None = None
    static: bool = False
    default: object = None  # the picture of runs that bring none

    def __post_init__(self) -> None:
        arguments.flag(self.static, f"input {arguments.text(self.name, 'the name of an input')!r}: static")

    def __repr__(self) -> str:
        return f"<input {self.name}>"


@dataclass(frozen=True)
class Target:
    """The content of a target at one point of the graph: what a pass returns and another one reads.

    Drawing into it again gives a new handle; this one goes on meaning the content from before.
    """

    spec: TargetSpec | InputSpec
    made_by: Pass | None = None  # None for inputs and for history
    slot: int = 0  # which of the pass's outputs; -1 is its depth
    is_previous: bool = False
    border_rule: str = "clamp"

    def __post_init__(self) -> None:
        if not isinstance(self.spec, (TargetSpec, InputSpec)):
            raise GraphError(f"a handle stands for pg.target(...) or pg.Input(...), got {arguments.shown(self.spec)}")
        if not arguments.among(self.border_rule, BORDERS):
            got = arguments.shown(self.border_rule)
            raise GraphError(f"there is no border rule {got}; the rules are {', '.join(BORDERS)}")
        if self.made_by is not None and not hasattr(self.made_by, "into"):
            raise GraphError(f"a handle is made by a pass, got {arguments.shown(self.made_by)}")
        arguments.whole(self.slot, f"handle of {self.name!r}: slot", -1, MOST_SLOTS)
        arguments.flag(self.is_previous, f"handle of {self.name!r}: is_previous")

    @property
    def name(self) -> str:
        return self.spec.name

    @property
    def depth(self) -> Target:
        """The depth (and stencil) target of the same draw."""
        depth = getattr(self.made_by, "depth", None)
        if depth is None:
            raise GraphError(
                f"target {self.name!r} was not drawn with a depth target; give pg.draw(depth=pg.target(...))"
            )
        return replace(self, spec=depth, slot=-1)

    def border(self, rule: str) -> Target:
        """The same content with another rule for reads outside: clamp, zero, repeat or mirror."""
        return replace(self, border_rule=rule)

    @property
    def content(self) -> Target:
        """The handle without its border rule: two handles of one content are equal."""
        return replace(self, border_rule="clamp")

    def __repr__(self) -> str:
        return f"<{'previous ' if self.is_previous else ''}{self.spec!r}>"


@dataclass(frozen=True, eq=False)
class PixelPass:
    """A kernel over every pixel of its targets."""

    name: str
    kernel: Kernel
    images: Mapping[str, Target]
    values: Mapping[str, object]  # parameter → number, tuple, array, Value or Derived
    constants: Mapping[str, object]
    into: tuple[TargetSpec, ...]
    known_sizes: bool = False  # made for the sizes that the plan has

    @property
    def reads(self) -> tuple[Target, ...]:
        return tuple(self.images.values())

    @property
    def writes(self) -> tuple[TargetSpec, ...]:
        return self.into

    @property
    def drawn_over(self) -> tuple[Target, ...]:
        """It writes every pixel, so that it starts from no content."""
        return ()


@dataclass(frozen=True, eq=False)
class DrawPass:
    """Triangles through a vertex and a fragment kernel."""

    name: str
    geometry: Geometry
    vertex: Kernel
    fragment: Kernel | None
    images: Mapping[str, Target]
    values: Mapping[str, object]
    constants: Mapping[str, object]
    into: tuple[TargetSpec, ...]
    loads: tuple[Target | None, ...]  # for each of ``into``: the content drawn over, or None to clear
    depth: TargetSpec | None
    depth_load: Target | None
    state: DrawState = field(default_factory=DrawState)

    @property
    def reads(self) -> tuple[Target, ...]:
        """Everything that must exist before: images read and content drawn over."""
        return (*self.images.values(), *self._loaded)

    @property
    def writes(self) -> tuple[TargetSpec, ...]:
        """Colour targets, then depth."""
        return self.into if self.depth is None else (*self.into, self.depth)

    @property
    def drawn_over(self) -> tuple[Target, ...]:
        """Contents that it starts from instead of clearing."""
        return tuple(t.content for t in self._loaded)

    @property
    def _loaded(self) -> list[Target]:
        return [t for t in (*self.loads, self.depth_load) if t is not None]


Pass: TypeAlias = PixelPass | DrawPass


def target(
    name: str,
    format: str | Format = "rgba16f",
    size: tuple[int, int] | None = None,
    *,
    scale: float | None = None,
    like: Target | None = None,
    clear: float | tuple[float, ...] | None = None,
    notes: tuple[str, ...] = (),
) -> TargetSpec:
    """Declare a render target.

    Parameters
    ----------
    name
        What results are read by, and what messages say.
    format
        One of :data:`passgraph.formats.FORMATS`.
    size
        (width, height) in pixels.  Left out: like the first image that its pass reads, or like the output.
    scale
        Fraction of the output (or of ``like``) instead of a size, above 0.
    like
        A target or input whose size it takes.
    clear
        What a draw clears it to first (default 0; depth 1), unless it draws into what is there.
    notes
        What an effect decided and why, shown by ``plan.explain()``.

    Raises
    ------
    GraphError
        For an unknown format or a size that cannot be.

    Examples
    --------
    >>> target("bloom", "rgba16f", scale=0.5)
    <target bloom rgba16f>
    """
    made = format_named(format)
    name = arguments.text(name, "the name of a target")
    if size is not None and (scale is not None or like is not None):
        raise GraphError(f"target {name!r} has both a size and a scale; give one")
    size_class: SizeClass | None = None
    if size is not None:
        size_class = Absolute(*checked_size(size, f"target {name!r}"))
    elif like is not None:
        arguments.instance(like, Target, f"target {name!r}: like", "a target that a pass returned, or an input")
        size_class = Like(like, checked_scale(1.0 if scale is None else scale, name))
    elif scale is not None:
        size_class = Relative(checked_scale(scale, name))
    values = None if clear is None else _check_clear(clear, made, f"target {name!r}")
    return TargetSpec(name, made, size_class, values, arguments.several(notes, str, f"target {name!r}: notes", "text"))


def _check_clear(clear: object, format: Format, where: str) -> tuple[float, ...]:
    """One number, or one a channel."""
    given = clear.tolist() if isinstance(clear, np.ndarray) else clear
    given = given if isinstance(given, (list, tuple)) else (given,)
    values = tuple(arguments.real(value, f"{where}: clear") for value in given)
    if len(values) not in (1, format.channels):
        raise GraphError(f"{where} ({format.name}) clears to 1 or {format.channels} numbers, got {len(values)}")
    return values


def checked_size(size: object, what: str) -> tuple[int, int]:
    """(width, height) as ints within limits, or GraphError."""
    if not (
        isinstance(size, (tuple, list))
        and len(size) == 2
        and all(isinstance(v, (int, np.integer)) and not isinstance(v, bool) for v in size)
    ):
        raise GraphError(f"{what} needs a size (width, height) in whole pixels, got {arguments.shown(size)}")
    width, height = size
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        shown = "x".join(map(arguments.shown, size))
        raise GraphError(f"{what} is {shown} pixels; each side must be 1 to {MAX_SIDE}")
    return int(width), int(height)


def checked_scale(scale: object, name: str) -> float:
    return arguments.real(scale, f"target {name!r}: scale", 0.0, 16.0, above=True)


def Input(
    name: str,
    format: str | Format | None = None,
    size: tuple[int, int] | None = None,
    *,
    static: bool = False,
    border: str = "clamp",
    default: object = None,
) -> Target:
    """A picture that each run brings by name.

    ``static=True`` promises that it changes rarely: passes that depend on static inputs only run once and
    again when one of them is given anew.  ``default`` is the picture of runs that bring none (a texture).

    >>> Input("frame")
    <<input frame>>
    """
    made = None if format is None else format_named(format)
    name = arguments.text(name, "the name of an input")
    bound = None if size is None else checked_size(size, f"input {name!r}")
    return Target(InputSpec(name, made, bound, static, default)).border(border)


def previous(spec: TargetSpec | Target) -> Target:
    """What a target held at the end of the last run; zero at the first."""
    if isinstance(spec, Target):
        if not isinstance(spec.spec, TargetSpec):
            raise GraphError(f"input {spec.name!r} has no history; keep a copy of it in a target")
        spec = spec.spec
    expected = "a target that a pass writes: pg.target(...) or a handle of it"
    arguments.instance(spec, TargetSpec, "what pg.previous takes", expected)
    return Target(spec, is_previous=True)
