"""Read and copy signatures of functions, the same on every Python version.

Python 3.14 evaluates annotations when they are read (PEP 649 and PEP 749): reading them may raise NameError, and
`functools.wraps` copies ``__annotate__``, the function that evaluates them, which is None for annotations that were
assigned.
"""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable, Sequence
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


def signature(function: Callable[..., Any]) -> inspect.Signature:
    """Return the signature of a function; annotations that cannot be evaluated yet stay unevaluated.

    >>> list(signature(wraps).parameters)
    ['function']
    """
    if sys.version_info >= (3, 14):
        import annotationlib

        return inspect.signature(function, annotation_format=annotationlib.Format.FORWARDREF)
    else:  # without it mypy finds a statement that cannot be reached
        return inspect.signature(function)


def wraps(function: Callable[..., Any]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a wrapper like `functools.wraps`, and copy annotations that were assigned, too.

    >>> def scaled(value, factor=2.0):
    ...     return value * factor
    >>> scaled.__annotations__ = {"value": float, "factor": float}
    >>> @wraps(scaled)
    ... def wrapper(*values, **options):
    ...     return scaled(*values, **options)
    >>> wrapper.__annotations__ == scaled.__annotations__
    True
    """
    copied: Sequence[str] = functools.WRAPPER_ASSIGNMENTS
    if getattr(function, "__annotate__", None) is None:
        copied = (*copied, "__annotations__")
    return functools.wraps(function, copied)


def set_annotations(function: Callable[..., Any], annotations: dict[str, Any]) -> None:
    """Assign the annotations of a function so that wrappers of other packages keep them, too."""
    function.__annotations__ = annotations
    if sys.version_info >= (3, 14):

        def annotate(format: int) -> dict[str, Any]:
            if format != 1:  # annotationlib.Format.VALUE; annotationlib makes the other formats of it
                raise NotImplementedError
            return dict(annotations)

        function.__annotate__ = annotate
