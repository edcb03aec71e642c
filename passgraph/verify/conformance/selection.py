"""Which cases of the suite run, and in which order."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import zip_longest

from passgraph.arguments import near
from passgraph.errors import InputError
from passgraph.verify.conformance.case import Case


def selected(cases: Iterable[Case], only: Sequence[str] = (), skip: Sequence[str] = ()) -> list[Case]:
    """Return the cases that a pattern of ``only`` names (default: all), without those that one of ``skip`` names.

    A pattern is ``group/name``; ``*`` stands for any text.

    Raises
    ------
    InputError
        For a pattern that names no case.

    Examples
    --------
    >>> from passgraph.verify.conformance import cases
    >>> [case.id for case in selected(cases(["operations"]), ["operations/is*"], ["*nan"])]
    ['operations/isinf', 'operations/isfinite']
    """
    every = list(cases)
    wanted, unwanted = ({pattern: _named(pattern, every, option) for pattern in patterns} for option, patterns in
                        (("only", only), ("skip", skip)))  # fmt: skip
    chosen = set().union(*wanted.values()) if only else {case.id for case in every}
    chosen -= set().union(*unwanted.values())
    return [case for case in every if case.id in chosen]


def _named(pattern: str, cases: Sequence[Case], option: str) -> set[str]:
    matches = re.compile(".*".join(map(re.escape, pattern.split("*")))).fullmatch
    found = {case.id for case in cases if matches(case.id)}
    if not found:
        hint = near(pattern, [case.id for case in cases])
        raise InputError(f"{option}: no case is named {pattern!r}{hint}; expected group/name, where * is any text")
    return found


def most_telling_first(cases: Iterable[Case]) -> list[Case]:
    """Return the cases in an order that soon has tried something of everything: first those that resemble no other,
    in turns of the groups.
    """
    groups: dict[str, list[Case]] = {}
    for case in cases:
        groups.setdefault(case.group, []).append(case)
    for group in groups.values():
        group.sort(key=lambda case: not case.quick)
    return [case for row in zip_longest(*groups.values()) for case in row if case is not None]
