"""`functools.cached_property` without a lock, and a bounded dict."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, TypeVar

__all__ = ["Recent", "cached_property"]

_Key = TypeVar("_Key")
_Value = TypeVar("_Value")


class Recent(dict[_Key, _Value]):
    """A bounded dict of the most recent items, such as programs whose sources change often.

    >>> recent = Recent[str, int](2)
    >>> recent["a"], recent["b"], recent["c"] = 1, 2, 3
    >>> recent
    {'b': 2, 'c': 3}
    """

    def __init__(self, most: int) -> None:
        super().__init__()
        self.most = most

    def __setitem__(self, key: _Key, value: _Value) -> None:
        while len(self) >= self.most and key not in self:
            del self[next(iter(self))]
        super().__setitem__(key, value)


if TYPE_CHECKING or sys.version_info >= (3, 12):
    from functools import cached_property
else:
    T = TypeVar("T")

    class cached_property(Generic[T]):
        """Compute an attribute at its first use and keep it in the instance.

        Python 3.11's own version holds a class-wide lock while it computes; a process forked meanwhile would wait for
        that lock forever. Here two threads may compute the same value; the last one is kept.
        """

        def __init__(self, function: Callable[[Any], T]) -> None:
            self.function, self.__doc__ = function, function.__doc__

        def __set_name__(self, owner: type, name: str) -> None:
            self.name = name

        def __get__(self, instance: Any, owner: type | None = None) -> Any:
            if instance is None:
                return self
            value = instance.__dict__[self.name] = self.function(instance)
            return value
