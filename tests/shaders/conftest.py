"""Makes the helpers beside the tests importable (pytest's importlib mode puts no folder on the path)."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    import moderngl

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="module")
def context() -> Iterator[moderngl.Context]:
    """OpenGL for the originals, once a module."""
    from tests.offscreen import offscreen  # here, since moderngl need not be installed

    with offscreen(430) as made:
        yield made
