"""Wrap a method of an engine to call a function too, for engines without callbacks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from passgraph.arguments import shown
from passgraph.errors import InputError

#: A predicate of the method's arguments, and the function to call if it is true.
_Call: TypeAlias = tuple[Callable[..., object], Callable[[], object]]


class _Hooked:
    """A replacement of a method that also calls the hooked functions, in the order of their registration."""

    def __init__(self, owner: Any, name: str) -> None:
        self.owner, self.name = owner, name
        self.was_own = name in vars(owner)
        self.method: Callable[..., Any] = getattr(owner, name)
        self.before: list[_Call] = []
        self.after: list[_Call] = []

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        for when, call in list(self.before):
            if when(*arguments, **named):
                call()
        result = self.method(*arguments, **named)
        for when, call in list(self.after):
            if when(*arguments, **named):
                call()
        return result

    def remove_when_idle(self) -> None:
        """Remove the hook; if another hook wraps it, it stays and does nothing."""
        if self.before or self.after or vars(self.owner).get(self.name) is not self:
            return
        if self.was_own:
            setattr(self.owner, self.name, self.method)
        else:
            delattr(self.owner, self.name)


def hook(
    owner: Any, name: str, *, before: Callable[[], object] | None = None, after: Callable[[], object] | None = None,
    when: Callable[..., object] = lambda *_, **__: True,
) -> Callable[[], None]:  # fmt: skip
    """Call a function before or after a method of one object, or a function of a module; return the unhook function.

    ``when`` is called with the method's arguments; if it returns False, the function is not called.

    >>> from types import SimpleNamespace
    >>> window = SimpleNamespace(flip=lambda: print("shown"))
    >>> end = hook(window, "flip", before=lambda: print("drawn"))
    >>> window.flip(); end(); window.flip()
    drawn
    shown
    shown
    """
    hooked = vars(owner).get(name)
    if not isinstance(hooked, _Hooked):
        hooked = _Hooked(owner, name)
        setattr(owner, name, hooked)
    both = [(calls, (when, call)) for calls, call in ((hooked.before, before), (hooked.after, after)) if call]
    for calls, call in both:
        calls.append(call)

    def end() -> None:
        for calls, call in both:
            if call in calls:
                calls.remove(call)
        hooked.remove_when_idle()

    return end


def check_has(owner: Any, engine: str, expected: str, *names: str) -> None:
    """Raise InputError unless an object has the attributes that an adapter needs; no engine is imported.

    >>> check_has("a title", "pyglet", "a pyglet.window.Window", "flip")
    Traceback (most recent call last):
    passgraph.errors.InputError: pyglet: attach takes a pyglet.window.Window, got 'a title', which has no flip
    """
    missing = [name for name in names if not hasattr(owner, name)]
    if missing:
        raise InputError(
            f"{engine}: attach takes {expected}, got {shown(owner)}, which has no {' and no '.join(missing)}"
        )
