"""Frozen dataclasses are as those of the standard library in all that a program sees."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from dataclasses import field, fields, replace
from typing import Any

import pytest

from passgraph import records

CASES: dict[str, dict[str, Any]] = {
    "plain": {},
    "by identity": {"eq": False},
    "named": {"kw_only": True},
    "slots": {"slots": True},
    "slots by identity": {"slots": True, "eq": False},
    "no text": {"repr": False},
}
TEXT = """
class Part:
    "A part."
    name: str
    size: tuple = (1, 2)
    parts: list = field(default_factory=list)
    secret: float = field(default=0.5, compare=False, repr=False)
    rank: int = field(default=1, kw_only=True)
    hashed: int = field(default=1, hash=False)
    made: dict = field(default_factory=dict, init=False, compare=False)

    def __post_init__(self):
        if self.name == "":
            raise ValueError("no name")
"""
MORE = """
class More(Part):
    "More."
    extra: int = 3
"""


def classes(options: dict[str, Any]) -> list[tuple[type, type]]:
    """Return a class and one that derives from it, by both decorators."""
    found = []
    for decorator in (records.dataclass, dataclasses.dataclass):
        names: dict[str, Any] = {"field": field, "__name__": __name__}
        exec(TEXT, names)  # each needs a class of its own
        names["Part"] = decorator(frozen=True, **options)(names["Part"])
        exec(MORE, names)
        found.append((names["Part"], decorator(frozen=True, **options)(names["More"])))
    return found


def seen(made: type, options: dict[str, Any]) -> list[Any]:
    """Return what a program sees of a class."""
    is_by_value = options.get("eq", True)
    call = {"name": "a", "size": (3, 4), "rank": 2}
    one, other, third = (made(**call, parts=()), made(**call, parts=(), secret=0.25), made(**{**call, "rank": 3}))
    assert (one == other) is is_by_value
    texts: list[Any] = [
        str(inspect.signature(made)), [(f.name, f.init, f.kw_only, f.compare) for f in fields(one)],
        repr(one).partition(" at 0x")[0], one != third, one == one, one == 3, made.__doc__, made.__init__.__qualname__,
        getattr(made, "__match_args__", None), one.made is not other.made, made(name="b").parts,
    ]  # fmt: skip
    if is_by_value:
        texts += [hash(one) == hash(other), one in {other}]
    for change in (lambda: setattr(one, "name", "b"), lambda: delattr(one, "name"), lambda: setattr(one, "new", 1)):
        # with slots, Python 3.11's own class raises a TypeError for a name that is no field
        with pytest.raises((dataclasses.FrozenInstanceError, TypeError)) as error:
            change()
        texts.append("new" if "slots" in options else (type(error.value), str(error.value)))
    for wrong in ({}, {"name": "a", "unknown": 1}, {"name": ""}):
        with pytest.raises((TypeError, ValueError)) as error:
            made(**wrong)
        texts.append((type(error.value), str(error.value)))
    for again in (replace(one, size=(5, 6)), copy.copy(one), copy.deepcopy(one)):
        texts.append([getattr(again, f.name) for f in fields(again)])
    return texts


@pytest.mark.parametrize("case", CASES)
def test_a_class_is_as_that_of_the_standard_library(case: str) -> None:
    ours, theirs = classes(CASES[case])
    for mine, other in zip(ours, theirs, strict=True):
        assert seen(mine, CASES[case]) == seen(other, CASES[case])


@records.dataclass(frozen=True, slots=True)
class Slotted:
    """A class that pickle finds."""

    name: str
    count: int = 3


@records.dataclass(frozen=True)
class WithOwn:
    """A class with methods of its own."""

    name: str

    def __eq__(self, other: object) -> bool:
        return True

    def __repr__(self) -> str:
        return "own"


def test_slots_can_be_pickled_and_matched() -> None:
    assert pickle.loads(pickle.dumps(Slotted("a", 4))) == Slotted("a", 4)
    match Slotted("a"):
        case Slotted(name, count):
            assert (name, count) == ("a", 3)


def test_own_methods_stay() -> None:
    assert WithOwn("a") == WithOwn("b") and repr(WithOwn("a")) == "own"
    assert hash(WithOwn("a")) == hash(("a",))


def test_a_record_in_itself_has_a_text() -> None:
    @records.dataclass(frozen=True)
    class Knot:
        """A record that may hold itself."""

        parts: list[Any]

    knot = Knot([])
    knot.parts.append(knot)
    assert repr(knot).endswith("Knot(parts=[...])")


def test_classes_of_the_standard_library_can_derive_and_be_derived_from() -> None:
    @dataclasses.dataclass(frozen=True)
    class Child(Slotted):
        more: int = 1

    @records.dataclass(frozen=True)
    class Grandchild(Child):
        most: int = 2

    assert Grandchild("a").most == 2 and replace(Grandchild("a"), most=3) == Grandchild("a", most=3)
    with pytest.raises(dataclasses.FrozenInstanceError):
        Grandchild("a").name = "b"  # type: ignore[misc]
