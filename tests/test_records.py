"""The project's `dataclass` beside the standard library's: whatever a class has, both make the same of it."""

from __future__ import annotations

import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field
from typing import Any, ClassVar

import pytest

from passgraph import records

Decorator = Callable[..., Any]
#: All options that are used, and the one that leaves out nothing.
OPTIONS: list[dict[str, bool]] = [
    {}, {"frozen": True}, {"frozen": True, "slots": True}, {"eq": False}, {"frozen": True, "eq": False, "slots": True},
    {"frozen": True, "eq": False, "repr": False}, {"frozen": True, "kw_only": True},
]  # fmt: skip


def made(decorator: Decorator, options: dict[str, bool]) -> Any:
    @decorator(**options)
    class Point:
        x: int
        y: float = field(default=2.0, compare=False)
        tags: list[str] = field(default_factory=list, repr=False, hash=False)
        late: int = field(init=False, default=7)
        z: int = field(kw_only=True, default=0)
        count: ClassVar[int] = 3

    return Point


def told(call: Callable[[], object]) -> object:
    """What a call gives, or the kind and text of its error."""
    try:
        return call()
    except Exception as error:
        return type(error), str(error)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_a_class_is_as_the_standard_one(options: dict[str, bool]) -> None:
    ours, theirs = (made(decorator, options) for decorator in (records.dataclass, dataclasses.dataclass))
    assert str(inspect.signature(ours)) == str(inspect.signature(theirs))
    assert ours.__match_args__ == theirs.__match_args__
    assert [(one.name, one.type) for one in dataclasses.fields(ours)] == [
        (one.name, one.type) for one in dataclasses.fields(theirs)
    ]

    def facts(kind: Any) -> list[object]:
        one = kind(x=1, z=3)
        same, other, far = kind(x=1, y=5.0, z=3), kind(x=2, z=3), kind(x=1, tags=["far"], z=3)
        found = [
            one == same,
            one == other,
            one == far,
            one != same,
            one == 1,
            one.late,
            one.tags,
            one.tags is same.tags,
        ]
        found += [told(lambda: hash(one) == hash(same)), told(lambda: hash(one) == hash(far)), kind.__hash__ is None]
        found += [repr(one) == object.__repr__(one) or repr(one), dataclasses.asdict(one)]
        found += [dataclasses.astuple(dataclasses.replace(one, x=4)), told(lambda: setattr(one, "x", 5)), one.x]
        found += [told(lambda: delattr(one, "y")), hasattr(one, "y"), hasattr(one, "__dict__")]
        if not options.get("slots"):
            found.append(told(lambda: setattr(one, "strange", 5)))
        return found

    assert facts(ours) == facts(theirs)


def test_wrong_arguments_are_told_of_as_by_the_standard_one() -> None:
    ours, theirs = (made(decorator, {"frozen": True}) for decorator in (records.dataclass, dataclasses.dataclass))
    for arguments in ({}, {"x": 1, "w": 2}, {"x": 1, "late": 2}):
        assert told(lambda given=arguments: ours(**given)) == told(lambda given=arguments: theirs(**given))  # type: ignore[misc]


@records.dataclass(frozen=True)
class Whole:
    """Kept as it is."""

    a: int
    b: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if self.a < 0:
            raise ValueError("negative")


@records.dataclass(frozen=True, slots=True)
class Slim:
    a: int
    b: int = 1


@records.dataclass(frozen=True)
class Below(Whole):
    c: int = 3

    def __eq__(self, other: object) -> bool:
        return True

    def __repr__(self) -> str:
        return "below"


@dataclasses.dataclass(frozen=True)
class Beside(Whole):
    c: int = 3


@pytest.mark.parametrize("one", [Whole(1, (2,)), Slim(1), Below(1, c=4), Beside(1, c=4)])
def test_what_is_frozen_travels_and_stays_frozen(one: Any) -> None:
    copy = pickle.loads(pickle.dumps(one))
    assert copy == one and dataclasses.astuple(copy) == dataclasses.astuple(one) and type(copy) is type(one)
    with pytest.raises(FrozenInstanceError):
        copy.a = 5


def test_what_a_class_has_itself_stays() -> None:
    assert Whole.__doc__ == "Kept as it is." and Slim.__doc__ is None
    assert repr(Below(1)) == "below" and Below(1) == 5
    with pytest.raises(ValueError, match="negative"):
        Below(-1)
    with pytest.raises(TypeError, match="non-frozen"):
        records.dataclass(type("Loose", (Whole,), {}))
    with pytest.raises(ValueError, match="mutable default"):
        records.dataclass(type("Shared", (), {"__annotations__": {"a": "list"}, "a": []}))


def test_an_init_is_made_when_it_is_asked_for() -> None:
    late = made(records.dataclass, {})
    assert type(late.__dict__["__init__"]).__name__ == "_Init"
    late(1)
    assert inspect.isfunction(late.__dict__["__init__"])


def test_rings_are_written_as_the_standard_one_writes_them() -> None:
    one = made(records.dataclass, {})(1)
    one.x = one
    assert "x=..." in repr(one)
