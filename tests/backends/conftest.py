"""A caller of OpenCL with a queue, and a host on it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

import passgraph as pg
from tests.conftest import require


@pytest.fixture
def context() -> Any:
    require("opencl")
    import pyopencl

    return pyopencl.create_some_context(interactive=False)


@pytest.fixture
def queue(context: Any) -> Any:
    import pyopencl

    return pyopencl.CommandQueue(context)


@pytest.fixture
def host(queue: Any) -> Iterator[pg.opencl.Host]:
    with pg.opencl.Host(queue) as made:
        yield made
