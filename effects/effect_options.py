"""Share one list of options between an effect's two functions: with every target, and with the picture only."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ParamSpec, Protocol

import passgraph as pg
from passgraph.signatures import set_annotations, signature, wraps

P = ParamSpec("P")


class HasPicture(Protocol):
    """Protocol of effect results that have a final picture and intermediate targets."""

    @property
    def picture(self) -> pg.Target: ...


def picture_of(passes: Callable[P, HasPicture]) -> Callable[[Callable[..., Any]], Callable[P, pg.Target]]:
    """Decorate a function so that it returns only the ``picture`` of ``passes``.

    The decorated function's body never runs: it provides the name and the docstring; parameters, defaults and types are
    those of ``passes``, for type checkers, ``help`` and `inspect.signature` alike.

    >>> class Two:
    ...     picture = pg.Input("frame")
    >>> def two_passes(scene: pg.Scene, *, height: float = 0.5) -> Two:
    ...     return Two()
    >>> @picture_of(two_passes)
    ... def two() -> None:
    ...     '''Documented once.'''
    >>> import inspect
    >>> inspect.signature(two).parameters["height"].default, two(pg.Scene.shipped()).name
    (0.5, 'frame')
    """

    def decorate(described: Callable[..., Any]) -> Callable[P, pg.Target]:
        @wraps(described)
        def wrapper(*args: P.args, **options: P.kwargs) -> pg.Target:
            return passes(*args, **options).picture

        # Types written as text are looked up in the module of the innermost wrapped function.
        wrapper.__wrapped__ = passes  # type: ignore[attr-defined]
        wrapper.__signature__ = signature(passes).replace(return_annotation=pg.Target)  # type: ignore[attr-defined]
        set_annotations(wrapper, {**passes.__annotations__, "return": pg.Target})
        return wrapper

    return decorate
