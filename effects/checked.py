"""The decorator that makes a function an effect: checks arguments against its signature, and names it for the command
line."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, ParamSpec, TypeAlias, TypeVar, get_args, get_type_hints

import numpy as np

from passgraph import arguments, signatures
from passgraph.arguments import flag, near, one_of, text
from passgraph.effects.annotations import check, check_fields, ranges_of
from passgraph.errors import GraphError
from passgraph.graph.run_values import Derived, Limit, Value
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.color_tags import ColorSpace
    from passgraph.graph.targets import Target

P = ParamSpec("P")
R = TypeVar("R")
#: An effect is a pair of functions: one returns the picture, one every target; messages use the same name for both.
SUFFIXES = ("_passes", "_targets")
#: Positional arguments of an effect: nothing, if it makes its picture from parameters alone; one picture; a picture and
#: a linear depth picture; a scene; a flat world and a size.
Takes = Literal["nothing", "picture", "picture+depth", "scene", "world2d"]
#: Meaning of color and alpha for an effect, see `effect`.
Alpha = Literal["straight", "premultiplied", "ignored"]
#: See `effect`.
ResultSpace: TypeAlias = "Callable[..., ColorSpace | None]"
#: Number of positional arguments; the others are parameters.
POSITIONAL: dict[Takes, int] = {"nothing": 0, "picture": 1, "picture+depth": 2, "scene": 1, "world2d": 2}


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function so that its arguments are checked against its annotations, including `passgraph.Range`.

    >>> import passgraph as pg
    >>> from typing import Annotated
    >>> @checked
    ... def dimmed(color: pg.Target, share: Annotated[float, pg.Range(0, 1)] = 0.5) -> pg.Target:
    ...     return color
    >>> dimmed(pg.Input("frame"), "half")
    Traceback (most recent call last):
    passgraph.errors.GraphError: dimmed: share must be a finite number, got 'half'
    >>> dimmed(pg.Input("frame"), 2.0)
    Traceback (most recent call last):
    passgraph.errors.GraphError: dimmed: share must be 0 to 1, got 2.0
    """
    signature = signatures.signature(function)
    name = function.__name__
    for suffix in SUFFIXES:
        name = name.removesuffix(suffix)

    @functools.cache
    def hints() -> dict[str, Any]:
        return get_type_hints(function, include_extras=True)

    @signatures.wraps(function)
    def wrapper(*args: P.args, **options: P.kwargs) -> R:
        bound = _bound(signature, name, args, options)
        for argument, value in bound.arguments.items():
            if value is not signature.parameters[argument].default:
                check(value, hints().get(argument, Any), f"{name}: {argument}")
                if isinstance(value, np.generic):
                    # NumPy's scalars wrap at 8 bits and round to halves when an effect computes with them.
                    bound.arguments[argument] = value.item()
                elif isinstance(value, (Value, Derived)):
                    limits = (Limit(f"{name}: {argument}", one) for one in ranges_of(hints().get(argument, Any)))
                    bound.arguments[argument] = value.limited(*limits)
        return function(*bound.args, **bound.kwargs)

    return wrapper


def _bound(
    signature: inspect.Signature, name: str, args: Sequence[Any], options: Mapping[str, Any]
) -> inspect.BoundArguments:
    """Bind arguments like `inspect.Signature.bind`, with errors that name the effect and its parameters."""
    try:
        return signature.bind(*args, **options)
    except TypeError as error:
        known = signature.parameters
        unknown = [option for option in options if option not in known]
        if not unknown:
            raise TypeError(f"{name}: {error}") from None
        raise TypeError(
            f"{name} has no parameter {unknown[0]!r}{near(unknown[0], known)}; it has {', '.join(known)}"
        ) from None


def with_surface_depth(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate an effect so that infinite, NaN and negative values of a depth input become 0.

    Depth 0 means no surface. Other tools use infinity, which a gather would spread.
    """
    from passgraph.graph.targets import Target

    signature = signatures.signature(function)

    @signatures.wraps(function)
    def wrapper(*args: P.args, **options: P.kwargs) -> R:
        bound = signature.bind(*args, **options)
        depth = bound.arguments.get("depth")
        if isinstance(depth, Target) and depth.made_by is None and not depth.is_previous:
            bound.arguments["depth"] = _surface_depth(depth)
        return function(*bound.args, **bound.kwargs)

    return wrapper


#: The largest float32 replaces infinity.
_TEXT = """
def {}(depth: Image) -> float:
    z = depth[0, 0].r
    return z if z > 0.0 and z < 3.4028234e38 else 0.0
"""


def _surface_depth(depth: Target) -> Target:
    from passgraph.graph.calls import kernel
    from passgraph.graph.targets import target
    from passgraph.run.finite_checks import SURFACE_DEPTH

    distance: Target = kernel(source=_TEXT.format(SURFACE_DEPTH))(
        depth, into=target(f"surfaces of {depth.name}", "r32f", like=depth)
    )
    return distance


@dataclass(frozen=True, slots=True)
class Mark:
    """The properties that `effect` attaches to a function.

    Attributes
    ----------
    name : on the command line, such as "tone-map"
    takes : its positional arguments
    linear : True if pictures of 8 and 16 bits are decoded from sRGB to linear light by default
    alpha : meaning of its pictures' alpha
    encodes : True if it returns colors for a display, not linear light
    result_space : the color space of its results, see `effect`; None if colors stay in their space
    alike : True if it takes and gives pictures of one and two channels too
    """

    name: str
    takes: Takes
    linear: bool
    alpha: Alpha = "straight"
    encodes: bool = False
    result_space: ResultSpace | None = None
    alike: bool = False


def effect(
    name: str,
    takes: Takes = "picture",
    *,
    linear: bool = False,
    alpha: Alpha = "straight",
    encodes: bool = False,
    result_space: ResultSpace | None = None,
    alike: bool = False,
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a `checked` function, so that command line, documentation and conformance find it by name.

    Its parameters come from its signature (`passgraph.effects.parameters`), their help from its docstring.
    `passgraph.effects.effect_table` finds it by this decorator's source text: write the arguments as plain string
    literals.

    Parameters
    ----------
    name : lower-case words with hyphens
    takes : "nothing": it makes its picture from parameters; "picture": a target; "picture+depth": a target and its
        linear depth; "scene": a `passgraph.Scene`; "world2d": a `passgraph.effects.light2d.World2D` and a size
    linear : True for effects on linear light: `apply` decodes pictures of 8 and 16 bits from sRGB, and encodes results
        that it writes in 8 and 16 bits
    alpha : "premultiplied" for effects that mix pixels: color is multiplied by alpha in their inputs and results. They
        leave opaque pictures opaque. "straight": color is not multiplied, as in most picture files; for effects on each
        pixel's color. "ignored": alpha is not opacity; the effect gets 1 and the result keeps the picture's. `apply`
        converts, as does `on_straight_alpha` (`passgraph.effects.pictures.alpha`)
    encodes : True for an effect that takes linear light and returns colors for a display, such as a tone map
    result_space : for an effect that converts colors, a function that takes the effect's parameters by name and returns
        the `passgraph.color_tags.ColorSpace` of its results, or None if the colors stay in their space. `apply` writes
        its tags into files, instead of the source's
    alike : True for an effect that computes every channel like the first: it takes and gives pictures of one and two
        channels too (`passgraph.effects.channels`), such as gray ones
    """

    mark = Mark(
        text(name, "effect: name"), takes, flag(linear, "effect: linear"), alpha, flag(encodes, "effect: encodes"),
        None if result_space is None else arguments.function(result_space, "effect: result_space"),
        flag(alike, "effect: alike"),
    )  # fmt: skip
    one_of(takes, "effect: takes", get_args(Takes))
    one_of(alpha, "effect: alpha", get_args(Alpha))

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        for parameter in signatures.signature(function).parameters.values():
            if parameter.annotation is inspect.Parameter.empty:
                raise GraphError(
                    f"effect {name!r}: parameter {parameter.name!r} needs a type, such as {parameter.name}: float, or "
                    f"{parameter.name}: pg.Target for a picture"
                )
        wrapped = checked(with_surface_depth(function) if takes == "picture+depth" else function)
        wrapped.effect = mark  # type: ignore[attr-defined]
        return wrapped

    return decorate


class Choice:
    """A base class for alternatives of an effect: frozen dataclasses with the settings that each needs.

    Fields are checked against their annotations.  The command line has an option for the choice, by the classes' names,
    and one for each field.

    >>> @dataclass(frozen=True)
    ... class Disc(Choice):
    ...     taps: int = 32
    >>> Disc(2.5)
    Traceback (most recent call last):
    passgraph.errors.GraphError: Disc: taps must be a whole number, got 2.5
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        check_fields(self)

    @classmethod
    def word(cls) -> str:
        """Return its name on the command line.

        >>> Choice.word()
        'choice'
        """
        return cls.__name__.lower()
