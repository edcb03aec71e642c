"""Backends that are open for all cases of a file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import pytest

from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from tests.conftest import present_devices


@pytest.fixture(scope="module")
def backends() -> Iterator[list[Backend]]:
    """The reference and every device that is here; one that is expected and missing fails."""
    with ExitStack() as stack:
        yield [stack.enter_context(open_backend(name)) for name in ("reference", *present_devices())]
