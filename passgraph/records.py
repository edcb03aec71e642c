"""`dataclass`, as the standard library's, for modules that every process loads: a class in a tenth of the time.

The standard one writes the text of up to eight methods for each class and compiles it, half a millisecond a class, and
a command loads more than a hundred.  Here all but ``__init__`` are the same functions for every class, over the names
of its fields, and ``__init__`` is compiled when it is first asked for, which of most classes it never is.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(
        cls: type | None = None, /, *, frozen: bool = False, eq: bool = True, repr: bool = True, slots: bool = False,
        kw_only: bool = False,
    ) -> Any:  # fmt: skip
        """The options of the standard decorator that this project uses, with their meaning.

        >>> @dataclass(frozen=True)
        ... class Point:
        ...     x: int
        ...     y: int = 0
        >>> Point(1), Point(1) == Point(1, 0), len({Point(1), Point(1, 0)}), dataclasses.replace(Point(1), y=2)
        (Point(x=1, y=0), True, 1, Point(x=1, y=2))
        """

        def decorated(cls: type) -> type:
            # The standard one makes a signature, and for it ``__init__``, where there is no docstring.
            told = cls.__doc__
            cls.__doc__ = told or cls.__name__
            # It checks that what inherits from a frozen class is frozen, and compiles what freezes it.
            below = frozen and any(getattr(base, "__dataclass_params__", _FREE).frozen for base in cls.__mro__[1:])
            standard = dataclasses.dataclass(
                init=False, repr=False, eq=False, frozen=below, slots=slots, kw_only=kw_only
            )
            made = standard(cls)
            made.__doc__ = told
            made.__dataclass_params__.frozen = frozen  # as what inherits from it asks
            _give_methods(made, frozen, eq, repr, slots)
            return made

        return decorated if cls is None else decorated(cls)


class _FREE:
    """What is no dataclass freezes nothing."""

    frozen = False


class _Init:
    """A class's ``__init__`` until it is first asked for, by whatever way: then the compiled one takes its place."""

    def __init__(self, owner: type, frozen: bool, slots: bool) -> None:
        self._owner, self._frozen, self._slots = owner, frozen, slots

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        made = _compiled_init(self._owner, self._frozen, self._slots)
        setattr(self._owner, "__init__", made)  # noqa: B010 (mypy)
        return made.__get__(instance, owner)


def _give_methods(cls: type, frozen: bool, eq: bool, repr: bool, slots: bool) -> None:
    """What the class has itself stays, as in the standard library."""
    fields = dataclasses.fields(cls)
    methods: dict[str, Any] = {"__init__": _Init(cls, frozen, slots)}
    if repr:
        methods["__repr__"] = _repr_of([one.name for one in fields if one.repr])
    if eq:
        values = _values_of([one.name for one in fields if one.compare])
        methods["__eq__"] = _eq_of(values)
        hashed = [one.name for one in fields if (one.compare if one.hash is None else one.hash)]
        methods["__hash__"] = _hash_of(_values_of(hashed)) if frozen else None
    if frozen:
        names = frozenset(one.name for one in fields)
        methods |= {"__setattr__": _refusing(cls, names, "assign to"), "__delattr__": _refusing(cls, names, "delete")}
        if slots:
            methods |= {"__getstate__": _state, "__setstate__": _set_state}
    for name, method in methods.items():
        # Python itself puts ``__hash__ = None`` into a class with an ``__eq__`` of its own.
        own = cls.__dict__.get(name, MISSING)
        if own is MISSING or (name == "__hash__" and own is None):
            setattr(cls, name, method)


def _values_of(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """What gives an object's values as a tuple."""
    if not names:
        return lambda one: ()
    get = attrgetter(*names)
    return get if len(names) > 1 else lambda one: (get(one),)


def _eq_of(values: Callable[[Any], tuple[Any, ...]]) -> Callable[[Any, Any], Any]:
    def __eq__(self: Any, other: Any) -> Any:
        return values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented

    return __eq__


def _hash_of(values: Callable[[Any], tuple[Any, ...]]) -> Callable[[Any], int]:
    def __hash__(self: Any) -> int:
        return hash(values(self))

    return __hash__


def _repr_of(names: list[str]) -> Callable[[Any], str]:
    @recursive_repr()
    def __repr__(self: Any) -> str:
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return __repr__


def _refusing(cls: type, names: frozenset[str], what: str) -> Callable[..., None]:
    way = "__setattr__" if what == "assign to" else "__delattr__"

    def refuse(self: Any, name: str, *value: Any) -> None:
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot {what} field {name!r}")
        getattr(super(cls, self), way)(name, *value)

    return refuse


def _state(self: Any) -> list[Any]:
    return [getattr(self, one.name) for one in dataclasses.fields(self)]


def _set_state(self: Any, state: list[Any]) -> None:
    for one, value in zip(dataclasses.fields(self), state, strict=True):
        object.__setattr__(self, one.name, value)


def _compiled_init(cls: type, frozen: bool, slots: bool) -> Callable[..., None]:
    """The ``__init__`` of a class: a parameter for each field, in the standard library's order."""
    fields = dataclasses.fields(cls)
    given = [one for one in fields if one.init]
    positional, by_name = ([one for one in given if bool(one.kw_only) is wanted] for wanted in (False, True))
    known: dict[str, Any] = {"_put": object.__setattr__, "_made": _MADE}
    parameters = ["self", *(_parameter(one, known) for one in positional)]
    parameters += ["*", *(_parameter(one, known) for one in by_name)] if by_name else []
    lines = [line for one in fields if (line := _line(one, frozen, slots, known))]
    lines += ["self.__post_init__()"] if hasattr(cls, "__post_init__") else []
    exec(f"def __init__({', '.join(parameters)}):\n " + "\n ".join(lines or ["pass"]), known)
    made: Callable[..., None] = known["__init__"]
    made.__qualname__, made.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    made.__annotations__ = {**{one.name: one.type for one in given}, "return": None}
    return made


class _Made:
    """Stands for a value that is made anew for each object."""

    def __repr__(self) -> str:
        return "<factory>"


_MADE = _Made()


def _parameter(one: Field[Any], known: dict[str, Any]) -> str:
    if one.default is not MISSING:
        known[f"_default_{one.name}"] = one.default
        return f"{one.name}=_default_{one.name}"
    return one.name if one.default_factory is MISSING else f"{one.name}=_made"


def _line(one: Field[Any], frozen: bool, slots: bool, known: dict[str, Any]) -> str:
    """What gives an object one value; empty where its class has it."""
    value = one.name
    if one.default_factory is not MISSING:
        known[f"_new_{one.name}"] = one.default_factory
        value = f"_new_{one.name}()" + (f" if {one.name} is _made else {one.name}" if one.init else "")
    elif not one.init:
        if one.default is MISSING or not slots:
            return ""
        known[f"_default_{one.name}"] = one.default
        value = f"_default_{one.name}"
    return f"_put(self, {one.name!r}, {value})" if frozen else f"self.{one.name} = {value}"
