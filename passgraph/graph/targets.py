"""Render targets and inputs, the handles that a graph is written with, and the passes behind them.  No device."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import GraphError
from passgraph.formats import Format, format_named
from passgraph.graph.draw_state import DrawState, Geometry
from passgraph.graph.run_values import Formula, check_formula
from passgraph.language.border_rules import BORDERS
from passgraph.language.kernel import Kernel

#: Largest side of a target, in pixels: what GL 3.3 hardware offers in practice.
MAX_SIDE = 1 << 15
#: Largest number of an output among those of its pass: structs have no more fields.
MOST_SLOTS = 255
#: How ``image.sample(uv)`` filters; the first one where none is given.
FILTERS = ("linear", "nearest")
#: What a handle says of how it is read: word → field of `Target`.
READING = {"border": "border_rule", "filter": "filter_rule", "levels": "has_levels", "slices": "slice_count",
           "hardware": "hardware"}  # fmt: skip
#: Earliest run that :func:`previous` reaches back to: each one on the way is a picture in memory.
MOST_FRAMES_AGO = 64


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


@dataclass(frozen=True, slots=True)
class Computed:
    """Sides as formulas of the output's, rounded down, at least one pixel; see `passgraph.graph.run_values`."""

    width: Formula
    height: Formula

    def __post_init__(self) -> None:
        for formula in (self.width, self.height):
            check_formula(formula, "a computed size")


SizeClass: TypeAlias = Absolute | Relative | Like | Blocks | Computed


@dataclass(frozen=True, eq=False)
class TargetSpec:
    """A render target as declared: what a pass writes ``into``."""

    name: str
    format: Format
    size: SizeClass | None = None
    clear: tuple[float, ...] | None = None
    notes: tuple[str, ...] = ()  # what an effect decided, for plan.explain()
    #: What :func:`previous` of it holds before it was written: one number, one a channel, or a picture.
    initial: tuple[float, ...] | NDArray[np.float32] = (0.0,)

    def __post_init__(self) -> None:
        where = f"target {arguments.text(self.name, 'the name of a target')!r}"
        arguments.instance(self.format, Format, f"{where}: format", "one of passgraph.formats.FORMATS")
        if self.size is not None:
            made_by = "made by pg.target(size=, scale= or like=)"
            arguments.instance(self.size, (Absolute, Relative, Like, Blocks, Computed), f"{where}: size", made_by)
        if self.clear is not None:
            _check_clear(self.clear, self.format, where)
        arguments.several(self.notes, str, f"{where}: notes", "lines of text")
        if not isinstance(self.initial, np.ndarray):
            _check_clear(self.initial, self.format, where, "initial", "starts from")

    def __repr__(self) -> str:
        return f"<target {self.name} {self.format.name}>"


#: An input's format that is left open, where what is given in 8 bits is decoded from sRGB.
OPEN_SRGB = "srgb"


@dataclass(frozen=True, eq=False)
class InputSpec:
    """A picture that each run brings; format and size are bound at the first run where left open.

    ``srgb``: of formats that are left open, what is given in 8 bits is decoded from sRGB as it is read.
    """

    name: str
    format: Format | None = None
    size: tuple[int, int] | None = None
    static: bool = False
    default: object = None  # the picture of runs that bring none
    srgb: bool = False

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
    frames_ago: int = 0  # of history: how many runs before this one
    border_rule: str = "clamp"
    filter_rule: str = "linear"
    has_levels: bool = False
    slice_count: int = 1
    hardware: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.spec, (TargetSpec, InputSpec)):
            raise GraphError(f"a handle stands for pg.target(...) or pg.Input(...), got {arguments.shown(self.spec)}")
        if not arguments.among(self.border_rule, BORDERS):
            got = arguments.shown(self.border_rule)
            raise GraphError(f"there is no border rule {got}; the rules are {', '.join(BORDERS)}")
        if not arguments.among(self.filter_rule, FILTERS):
            got = arguments.shown(self.filter_rule)
            raise GraphError(f"there is no filter {got}; the filters are {', '.join(FILTERS)}")
        arguments.flag(self.hardware, f"handle of {self.name!r}: hardware")
        arguments.flag(self.has_levels, f"handle of {self.name!r}: has_levels")
        arguments.whole_number(self.slice_count, f"handle of {self.name!r}: slices", 1, MAX_SIDE)
        if self.has_levels and self.slice_count > 1:
            raise GraphError(f"handle of {self.name!r}: a volume has no smaller levels; leave out one of the two")
        if self.made_by is not None and not hasattr(self.made_by, "into"):
            raise GraphError(f"a handle is made by a pass, got {arguments.shown(self.made_by)}")
        arguments.whole_number(self.slot, f"handle of {self.name!r}: slot", -1, MOST_SLOTS)
        arguments.whole_number(self.frames_ago, f"handle of {self.name!r}: frames_ago", 0, MOST_FRAMES_AGO)

    @property
    def name(self) -> str:
        return self.spec.name

    def __copy__(self) -> Target:
        return self

    def __deepcopy__(self, _: object) -> Target:
        """Itself: another handle would stand for another content."""
        return self

    def __reduce__(self) -> NoReturn:
        raise GraphError(
            f"handle of {self.name!r}: graphs are not pickled; send plain data: pg.to_data(...), and pg.from_data(...) "
            "where it arrives"
        )

    @property
    def is_previous(self) -> bool:
        """Whether it is what the target held in an earlier run."""
        return self.frames_ago > 0

    @property
    def when(self) -> str:
        """Before its name, the run that its content is of."""
        return ("", "previous ")[self.frames_ago] if self.frames_ago < 2 else f"{self.frames_ago} frames ago "

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
        """The same content with another rule for reads outside: clamp, zero, repeat, mirror or reflect-101."""
        return replace(self, border_rule=rule)

    def filter(self, rule: str, *, hardware: bool = False) -> Target:
        """The same content with another filter of ``image.sample(uv)``: linear, or nearest, the texel at the place.

        With ``hardware`` a device may filter by itself, with the coarser weights that it has.

        >>> Input("frame").filter("nearest").filter_rule
        'nearest'
        """
        return replace(self, filter_rule=rule, hardware=hardware)

    def mipmaps(self) -> Target:
        """The same content with its halves, quarters … down to one texel, for ``image.sample(uv, lod=...)``."""
        return replace(self, has_levels=True)

    def slices(self, count: int) -> Target:
        """The same content as a volume of ``count`` slices below one another, for ``image.sample3(position)``.

        `stacked` makes such a picture of an array (depth, height, width, channels).
        """
        return replace(self, slice_count=count)

    @property
    def content(self) -> Target:
        """The handle without what says how it is read: two handles of one content are equal."""
        return Target(self.spec, self.made_by, self.slot, self.frames_ago)

    def __repr__(self) -> str:
        return f"<{self.when}{self.spec!r}>"


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
        """Color targets, then depth."""
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
    initial: object = 0.0,
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
    initial
        What :func:`previous` of it holds as long as no run has written it: a number, one for each channel, or a
        picture (height, width, channels) of the target's size, row 0 on top.

    Raises
    ------
    GraphError
        For an unknown format or a size that cannot be.

    Examples
    --------
    >>> target("bloom", "rgba16f", scale=0.5)
    <target bloom rgba16f>
    """
    stored = format_named(format)
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
    where = f"target {name!r}"
    values = None if clear is None else _check_clear(clear, stored, where)
    note_texts = arguments.several(notes, str, f"{where}: notes", "text")
    return TargetSpec(name, stored, size_class, values, note_texts, checked_initial(initial, stored, where))


def _check_clear(
    clear: object, format: Format, where: str, what: str = "clear", does: str = "clears to"
) -> tuple[float, ...]:
    """One number, or one a channel."""
    components = clear.tolist() if isinstance(clear, np.ndarray) else clear
    components = components if isinstance(components, (list, tuple)) else (components,)
    values = tuple(arguments.real(value, f"{where}: {what}") for value in components)
    if len(values) not in (1, format.channels):
        raise GraphError(f"{where} ({format.name}) {does} 1 or {format.channels} numbers, got {len(values)}")
    return values


def checked_initial(initial: object, format: Format, where: str) -> tuple[float, ...] | NDArray[np.float32]:
    """Numbers, or a picture of the caller's as a copy that stays as it is."""
    if not isinstance(initial, np.ndarray) or initial.ndim < 2:
        return _check_clear(initial, format, where, "initial", "starts from")
    picture = arguments.numbers(initial, f"{where}: initial", error=GraphError).astype(np.float32)
    picture = picture[:, :, None] if picture.ndim == 2 else picture
    if not np.isfinite(picture).all():
        raise GraphError(f"{where} starts from a picture that holds NaN or infinity; mend it first")
    if picture.ndim != 3 or picture.shape[2] != format.channels:
        raise GraphError(
            f"{where} ({format.name}) starts from a picture (height, width, {format.channels}), got {initial.shape}"
        )
    picture.setflags(write=False)
    return picture


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

    ``format`` is left out, and bound to what runs bring, or one of `passgraph.formats.FORMATS`.  ``"srgb"`` leaves it
    open too, and colors of 8 bits are read as linear light; numbers of more bits count as they are.

    ``static=True`` promises that it changes rarely: passes that depend on static inputs only run once and
    again when one of them is given anew.  ``default`` is the picture of runs that bring none (a texture).

    >>> Input("frame")
    <<input frame>>
    """
    srgb = arguments.among(format, (OPEN_SRGB,))
    is_open = format is None or srgb
    stored = None if is_open else format_named(format)  # type: ignore[arg-type]
    name = arguments.text(name, "the name of an input")
    bound = None if size is None else checked_size(size, f"input {name!r}")
    return Target(InputSpec(name, stored, bound, static, default, srgb)).border(border)


def previous(spec: TargetSpec | Target, frames_ago: int = 1) -> Target:
    """Return a handle to a target's content at the end of an earlier run.

    Parameters
    ----------
    spec
        The target, or any handle of it.
    frames_ago
        How many runs ago, 1 to 64: 1 is the last one.  Each run on the way back keeps a picture.

    Returns
    -------
    Target
        As long as there were fewer runs, what the target starts from: ``pg.target(initial=…)``, 0 where left out.
        `Program.reset` begins anew.

    Raises
    ------
    GraphError
        For an input, and for a number out of range.

    Examples
    --------
    >>> previous(target("state", "r8", initial=1.0), 2)
    <2 frames ago <target state r8>>
    """
    if isinstance(spec, Target):
        if not isinstance(spec.spec, TargetSpec):
            raise GraphError(f"input {spec.name!r} has no history; keep a copy of it in a target")
        spec = spec.spec
    expected = "a target that a pass writes: pg.target(...) or a handle of it"
    arguments.instance(spec, TargetSpec, "what pg.previous takes", expected)
    arguments.whole_number(frames_ago, f"previous of {spec.name!r}: frames_ago", 1, MOST_FRAMES_AGO)
    return Target(spec, frames_ago=frames_ago)


Outputs: TypeAlias = "Target | Iterable[Target] | Mapping[str, Target]"


def named_outputs(outputs: Any) -> dict[str, Target]:
    """One target, several, or a mapping, as a mapping by result name."""
    if isinstance(outputs, (Target, TargetSpec)):
        outputs = [outputs]
    if isinstance(outputs, Mapping):
        for name, target in outputs.items():
            arguments.text(name, "the name of an output")
            _check_target(target)
        return dict(outputs)
    if isinstance(outputs, (str, bytes, np.ndarray)) or not isinstance(outputs, Iterable):
        raise GraphError(f"compile takes targets that passes returned, got {arguments.shown(outputs)}")
    named: dict[str, Target] = {}
    for target in outputs:
        _check_target(target)
        if target.name in named:
            raise GraphError(
                f"two outputs are called {target.name!r}; give a mapping: pg.compile({{'first': ..., 'second': ...}})"
            )
        named[target.name] = target
    return named


def _check_target(target: object) -> None:
    if isinstance(target, TargetSpec):
        raise GraphError(
            f"compile takes targets that passes returned, got target {target.name!r} is declared but not written"
        )
    if not isinstance(target, Target):
        raise GraphError(f"compile takes targets that passes returned, got {arguments.shown(target)}")
