"""Frozen dataclasses, made in a quarter of the time: each command makes two hundred when it starts.

`dataclasses` before Python 3.13 compiles up to six methods of a class one by one. Here one is compiled; the others are
closures.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any


class _Factory:
    def __repr__(self) -> str:
        return "<factory>"


_FACTORY = _Factory()

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, *, frozen=False, eq=True, repr=True, **options):
        """Do what `dataclasses.dataclass` does, except for a frozen class with ``order`` or an `InitVar`.

        >>> @dataclass(frozen=True)
        ... class Size:
        ...     width: int
        ...     height: int = 1
        >>> Size(3), Size(3) == Size(3, 1), hash(Size(3)) == hash(Size(3))
        (Size(width=3, height=1), True, True)
        """

        def made(cls):
            if not frozen:
                return dataclasses.dataclass(eq=eq, repr=repr, **options)(cls)
            return _frozen(cls, eq, repr, options)

        return made if cls is None else made(cls)


def _frozen(cls: Any, eq: bool, repr: bool, options: dict[str, Any]) -> Any:
    own = {name for name, value in vars(cls).items() if value is not None}
    cls.__doc__ = cls.__doc__ or cls.__name__  # else a signature is formatted
    # A class with a frozen base must be made frozen, which compiles two methods more.
    inherits = any(dataclasses.is_dataclass(base) for base in cls.__mro__[1:])
    cls = dataclasses.dataclass(init=False, eq=False, repr=False, frozen=inherits, **options)(cls)
    fields = dataclasses.fields(cls)
    methods: dict[str, Any] = {"__init__": _init(cls, fields)}
    if not inherits:
        methods |= _guards(cls, [field.name for field in fields])
        cls.__dataclass_params__.frozen = True
        if "__slots__" in vars(cls):
            methods |= {"__getstate__": _state, "__setstate__": _set_state}
    if repr:
        methods["__repr__"] = _repr([field.name for field in fields if field.repr])
    if eq:
        values = _values([field.name for field in fields if field.compare])
        hashed = _values([field.name for field in fields if (field.compare if field.hash is None else field.hash)])
        methods["__eq__"] = lambda self, other: (
            values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented
        )
        methods["__hash__"] = lambda self: hash(hashed(self))
    for name, method in methods.items():
        if name not in own:
            method.__qualname__ = f"{cls.__qualname__}.{name}"
            setattr(cls, name, method)
    return cls


def _init(cls: type, fields: tuple[Field[Any], ...]) -> Any:
    """Compile the method that sets the fields."""
    known: dict[str, object] = {"_set": object.__setattr__, "_FACTORY": _FACTORY}
    positional: list[str] = []
    named: list[str] = []
    lines: list[str] = []
    types: dict[str, object] = {}
    for field in fields:
        name, value, text = field.name, field.name, field.name
        if field.default_factory is not MISSING:
            known[f"_make_{name}"] = field.default_factory
            text, value = f"{name}=_FACTORY", f"_make_{name}() if {name} is _FACTORY else {name}"
            value = value if field.init else f"_make_{name}()"
        elif field.default is not MISSING:
            known[f"_default_{name}"] = field.default
            text = f"{name}=_default_{name}"
        if field.init:
            types[name] = field.type
            (named if field.kw_only else positional).append(text)
        elif field.default_factory is MISSING:
            continue
        lines.append(f"_set(self, {name!r}, {value})")
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    parameters = ", ".join(["self", *positional, *(["*", *named] if named else [])])
    body = "\n  ".join(lines or ["pass"])
    made: dict[str, Any] = {}
    exec(
        f"def make({', '.join(known)}):\n def __init__({parameters}):\n  {body}\n return __init__",
        vars(sys.modules[cls.__module__]),
        made,
    )
    init = made["make"](**known)
    init.__annotations__ = {**types, "return": None}
    return init


def _guards(cls: Any, names: list[str]) -> dict[str, Any]:
    """Return the methods that keep fields from being set and deleted."""

    def set_attribute(self: object, name: str, value: object) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def delete_attribute(self: object, name: str) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return {"__setattr__": set_attribute, "__delattr__": delete_attribute}


def _repr(names: list[str]) -> Any:
    def text(self: object) -> str:
        return f"{type(self).__qualname__}({', '.join([f'{name}={getattr(self, name)!r}' for name in names])})"

    return recursive_repr()(text)


def _values(names: list[str]) -> Callable[[object], tuple[Any, ...]]:
    if len(names) > 1:
        return attrgetter(*names)
    return lambda self: tuple([getattr(self, name) for name in names])


def _state(self: Any) -> list[object]:
    return [getattr(self, field.name) for field in dataclasses.fields(self)]


def _set_state(self: Any, state: list[object]) -> None:
    for field, value in zip(dataclasses.fields(self), state, strict=True):
        object.__setattr__(self, field.name, value)
