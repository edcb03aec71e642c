from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.host.application import Application


@pytest.fixture
def app() -> Iterator[Application]:
    made = Application()
    yield made
    made.close()
