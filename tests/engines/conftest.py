"""A screen for engines that need one."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.xvfb import screen


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """A display's name."""
    with screen() as name:
        yield name
