"""Wrong spellings that a test plants in a printer."""

from __future__ import annotations

from typing import Any

import pytest

from passgraph import disk_cache


def respelled(patch: pytest.MonkeyPatch, table: Any, name: str, text: str) -> None:
    """Change an operation's spelling, and keep no source: the disk cache knows a printer by its file."""
    without_kept_sources(patch)
    patch.setitem(table, name, text)


def without_kept_sources(patch: pytest.MonkeyPatch) -> None:
    """Print each source anew and keep none."""
    patch.setattr(disk_cache, "package_stamp", lambda: None)
