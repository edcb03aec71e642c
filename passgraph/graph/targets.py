"""Render targets and inputs, the handles that graphs are built from, and passes.  Independent of devices."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import GraphError
from passgraph.formats import Format, format_named
from passgraph.graph.draw_state import DrawState, Geometry
from passgraph.graph.run_values import Formula, check_formula
from passgraph.language.border_rules import BORDERS
from passgraph.language.kernel import Kernel
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.notebook import Box

#: Largest side of a target in pixels: the usual limit of GL 3.3 hardware.
MAX_SIDE = 1 << 15
#: Largest index of an output within its pass: the limit on fields of a struct.
MOST_SLOTS = 255
#: Most bins of a histogram: a table of this size fits into the local memory of a work-group or the cache of a core.
MOST_BINS = 2048
#: Filters of ``image.sample(uv)``; the first one is the default.
FILTERS = ("linear", "nearest")
#: Settings of how a handle is read: word → field of `Target`.
READING = {"border": "border_rule", "filter": "filter_rule", "levels": "has_levels", "slices": "slice_count",
           "hardware": "hardware"}  # fmt: skip
#: Most runs that :func:`previous` can look back; each one keeps a picture in memory.
MOST_FRAMES_AGO = 64


@dataclass(frozen=True, slots=True)
class Absolute:
    """A size in pixels."""

    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Relative:
    """A fraction of the output's width and height, rounded up."""

    scale: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Like:
    """A fraction of the width and height of another target or input, rounded up."""

    other: Target
    scale: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Blocks:
    """A number of pixels side by side for each block of another picture's texels; blocks at edges may be smaller."""

    other: Target
    width: int
    height: int
    each: int = 1


@dataclass(frozen=True, slots=True)
class Computed:
    """Sides as formulas of the output's size, rounded down, at least one pixel; see `passgraph.graph.run_values`."""

    width: Formula
    height: Formula

    def __post_init__(self) -> None:
        for formula in (self.width, self.height):
            check_formula(formula, "a computed size")


SizeClass: TypeAlias = Absolute | Relative | Like | Blocks | Computed


@dataclass(frozen=True, eq=False)
class TargetSpec:
    """The declaration of a render target: what a pass writes ``into``."""

    name: str
    format: Format
    size: SizeClass | None = None
    clear: tuple[float, ...] | None = None
    notes: tuple[str, ...] = ()  # decisions of an effect, for plan.explain()
    #: Content for :func:`previous` before the first write: one number, one per channel, or a picture.
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


#: The format of an input that leaves it open and decodes 8-bit pictures from sRGB.
OPEN_SRGB = "srgb"


@dataclass(frozen=True, eq=False)
class InputSpec:
    """A picture that each run provides; open formats and sizes are bound at the first run.

    ``srgb``: if the format is open, 8-bit pictures are decoded from sRGB as they are read.
    """

    name: str
    format: Format | None = None
    size: tuple[int, int] | None = None
    static: bool = False
    default: object = None  # the picture for runs that provide none
    srgb: bool = False

    def __post_init__(self) -> None:
        arguments.flag(self.static, f"input {arguments.text(self.name, 'the name of an input')!r}: static")

    def __repr__(self) -> str:
        return f"<input {self.name}>"


@dataclass(frozen=True)
class Target:
    """A handle to the content of a target at one point of the graph: a pass returns it, other passes read it.

    Drawing into the target again gives a new handle; this one keeps referring to the earlier content.
    """

    spec: TargetSpec | InputSpec
    made_by: Pass | None = None  # None for inputs and for history
    slot: int = 0  # index among the pass's outputs; -1 is its depth
    frames_ago: int = 0  # for history: number of runs before this one
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
        """Return itself: a copy would refer to another content."""
        return self

    def __reduce__(self) -> NoReturn:
        raise GraphError(
            f"handle of {self.name!r}: graphs cannot be pickled; send plain data: pg.to_data(...), "
            "and pg.from_data(...) where it arrives"
        )

    @property
    def is_previous(self) -> bool:
        """Return True if it is the target's content in an earlier run."""
        return self.frames_ago > 0

    @property
    def when(self) -> str:
        """Describe the run of its content, as a prefix to its name."""
        return ("", "previous ")[self.frames_ago] if self.frames_ago < 2 else f"{self.frames_ago} frames ago "

    @property
    def depth(self) -> Target:
        """Return the depth (and stencil) target of the same draw."""
        depth = getattr(self.made_by, "depth", None)
        if depth is None:
            raise GraphError(
                f"target {self.name!r} was not drawn with a depth target; give pg.draw(depth=pg.target(...))"
            )
        return replace(self, spec=depth, slot=-1)

    def border(self, rule: str) -> Target:
        """Return the same content with another border rule: clamp, zero, repeat, mirror or reflect-101."""
        return replace(self, border_rule=rule)

    def filter(self, rule: str, *, hardware: bool = False) -> Target:
        """Return the same content with another filter for ``image.sample(uv)``: linear, or nearest.

        ``hardware`` allows the device's own filter, whose weights are coarser.

        >>> Input("frame").filter("nearest").filter_rule
        'nearest'
        """
        return replace(self, filter_rule=rule, hardware=hardware)

    def mipmaps(self) -> Target:
        """Return the same content with mipmaps, for ``image.sample(uv, lod=...)``."""
        return replace(self, has_levels=True)

    def slices(self, count: int) -> Target:
        """Return the same content as a volume of ``count`` slices one below another, for ``image.sample3(position)``.

        `stacked` makes such a picture from an array (depth, height, width, channels).
        """
        return replace(self, slice_count=count)

    @property
    def content(self) -> Target:
        """Return the handle without its read settings: handles of the same content are equal."""
        return Target(self.spec, self.made_by, self.slot, self.frames_ago)

    def __repr__(self) -> str:
        return f"<{self.when}{self.spec!r}>"

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """Show the graph that a target depends on in a notebook."""
        from passgraph import notebook

        return notebook.bundle(repr(self), svg=notebook.graph_svg([self]))

    def _notebook_box_(self) -> Box:
        """Return the box of its pass, or of the input, in a picture of the graph."""
        from passgraph.notebook import Box

        node = self.made_by
        if node is None:
            format_ = "" if self.spec.format is None else f", {self.spec.format.name}"
            return Box(self.content, self.name, f"{'earlier run' if self.is_previous else 'input'}{format_}", False)
        kernel = getattr(node, "kernel", None) or getattr(node, "fragment", None)
        written = ", ".join(
            spec.format.name if spec.name == node.name else f"{spec.name} {spec.format.name}" for spec in node.into
        )
        about = f"{'' if kernel is None else kernel.name} → {written}".strip()
        return Box(node, node.name, about, True, node.reads)


@dataclass(frozen=True, eq=False)
class PixelPass:
    """A kernel that runs on every pixel of its targets."""

    name: str
    kernel: Kernel
    images: Mapping[str, Target]
    values: Mapping[str, object]  # parameter → number, tuple, array, Value or Derived
    constants: Mapping[str, object]
    into: tuple[TargetSpec, ...]
    known_sizes: bool = False  # compiled for the sizes in the plan

    @property
    def kernels(self) -> tuple[Kernel, ...]:
        return (self.kernel,)

    @property
    def reads(self) -> tuple[Target, ...]:
        return tuple(self.images.values())

    @property
    def writes(self) -> tuple[TargetSpec, ...]:
        return self.into

    @property
    def drawn_over(self) -> tuple[Target, ...]:
        """Return nothing: it writes every pixel, so it needs no earlier content."""
        return ()


@dataclass(frozen=True, eq=False)
class CountPass(PixelPass):
    """A count of the numbers in each row of a picture (`passgraph.graph.reductions.count_rows`).

    A pixel pass gathers: each bin reads all texels.  The kernel defines the result on every device and for the oracle;
    a device that can scatter adds each texel to its bin instead (`Backend.count_pass`).
    """


@dataclass(frozen=True, eq=False)
class DrawPass:
    """Triangles drawn by a vertex and a fragment kernel."""

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
    def kernels(self) -> tuple[Kernel, ...]:
        """Return the vertex kernel, and the fragment kernel if there is one."""
        return (self.vertex,) if self.fragment is None else (self.vertex, self.fragment)

    @property
    def reads(self) -> tuple[Target, ...]:
        """Return all handles that must exist before: images read and content drawn over."""
        return (*self.images.values(), *self._loaded)

    @property
    def writes(self) -> tuple[TargetSpec, ...]:
        """Return the color targets, then depth."""
        return self.into if self.depth is None else (*self.into, self.depth)

    @property
    def drawn_over(self) -> tuple[Target, ...]:
        """Return the contents that are drawn over instead of cleared."""
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
    scale: float | tuple[float, float] | None = None,
    like: Target | None = None,
    clear: float | tuple[float, ...] | None = None,
    notes: tuple[str, ...] = (),
    initial: object = 0.0,
) -> TargetSpec:
    """Declare a render target.

    Parameters
    ----------
    name
        Name of the target in results and messages.
    format
        One of :data:`passgraph.formats.FORMATS`.
    size
        (width, height) in pixels.  Default: like the first image that its pass reads, or like the output.
    scale
        Fraction of the size of the output (or of ``like``) instead of ``size``, above 0; or one fraction of its width
        and one of its height.
    like
        A target or input to take the size from.
    clear
        Value that a draw clears it to (default 0; depth 1), unless it draws over existing content.
    notes
        Decisions of an effect and their reasons, shown by ``plan.explain()``.
    initial
        Content that :func:`previous` returns before any run has written it: a number, one for each channel, or a
        picture (height, width, channels) of the target's size, row 0 on top.

    Raises
    ------
    GraphError
        For an unknown format or an impossible size.

    Examples
    --------
    >>> target("bloom", "rgba16f", scale=0.5)
    <target bloom rgba16f>
    >>> target("narrow", "rgba16f", scale=(0.25, 1.0)).size
    Relative(scale=(0.25, 1.0))
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
    """Return the clear value of each channel, given one number or one per channel."""
    components = clear.tolist() if isinstance(clear, np.ndarray) else clear
    components = components if isinstance(components, (list, tuple)) else (components,)
    values = tuple(arguments.real(value, f"{where}: {what}") for value in components)
    if len(values) not in (1, format.channels):
        raise GraphError(f"{where} ({format.name}) {does} 1 or {format.channels} numbers, got {len(values)}")
    return values


def checked_initial(initial: object, format: Format, where: str) -> tuple[float, ...] | NDArray[np.float32]:
    """Return the numbers, or a copy of the caller's picture."""
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
    """Return (width, height) as ints within limits, or raise GraphError."""
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


def checked_scale(scale: object, name: str) -> tuple[float, float]:
    """Return the fractions of width and height; raise GraphError where they are no numbers above 0 and up to 16."""
    pair = scale if isinstance(scale, (tuple, list)) else (scale, scale)
    if len(pair) != 2:
        raise GraphError(f"target {name!r}: scale must be one number or two, got {len(pair)}")
    width, height = (arguments.real(one, f"target {name!r}: scale", 0.0, 16.0, above=True) for one in pair)
    return width, height


def Input(
    name: str,
    format: str | Format | None = None,
    size: tuple[int, int] | None = None,
    *,
    static: bool = False,
    border: str = "clamp",
    default: object = None,
) -> Target:
    """Declare a picture that each run provides by name.

    ``format`` is one of `passgraph.formats.FORMATS`; by default it is bound to that of the first picture.  ``"srgb"``
    leaves it open too, and decodes 8-bit colors to linear light; other dtypes are not decoded.

    ``static=True`` declares that it changes rarely: passes that depend only on static inputs run once, and again when
    one of them is given again.  ``default`` is the picture for runs that provide none (a texture).

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
        Number of runs ago, 1 to 64: 1 is the last run.  Each run in between keeps a picture in memory.

    Returns
    -------
    Target
        Before enough runs have happened, its content is the target's initial content: ``pg.target(initial=…)``, default
        0.  `Program.reset` returns to that state.

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
    """Convert one target, several, or a mapping to a mapping by result name."""
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
