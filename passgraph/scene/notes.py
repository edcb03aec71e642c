"""Unsupported features of a file: one line each, with the names of the objects concerned."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Notes:
    """Notes about a file, collected while it is read; equal notes are merged.

    >>> notes = Notes()
    >>> for name in "abcde":
    ...     notes.add("its emissive light is not shown", f"material {name!r}")
    >>> notes.lines()
    ["material 'a', material 'b', material 'c' and 2 more: its emissive light is not shown"]
    """

    found: dict[str, list[str]] = field(default_factory=dict)

    def add(self, what: str, where: str) -> None:
        """Add a note; ``what`` is the feature and its treatment, ``where`` the object."""
        names = self.found.setdefault(what, [])
        if where not in names:
            names.append(where)

    def lines(self) -> list[str]:
        """Return a line for each note, with at most three names."""
        return [f"{_listed(names)}: {what}" for what, names in self.found.items()]


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:3])
    return shown if len(names) <= 3 else f"{shown} and {len(names) - 3} more"
