"""What tests of what all backends mean alike have in common."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from tests.conftest import DEVICES, require


@pytest.fixture(scope="module", params=["reference", *DEVICES])
def device(request: pytest.FixtureRequest) -> Iterator[Backend]:
    """The reference, and every backend that is held against it."""
    if request.param != "reference":
        require(request.param)
    with open_backend(request.param) as opened:
        yield opened
