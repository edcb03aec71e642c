"""What effects claim is tried on one device, the one that compiles fastest.

That devices agree on effects is for the conformance suite and for ``tests.agreement``, which hold each of them against
the oracle, and that optimising changes no bit of an effect is for tests/fuzz/test_harmless.py, on each of them too.
A test whose claim is about devices asks for all:

    @pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
"""

from __future__ import annotations

import pytest

from tests.conftest import DEVICES, present_devices, require


@pytest.fixture
def backend_name(request: pytest.FixtureRequest) -> str:
    """The first device that is here, unless the test names some."""
    name: str = request.param if hasattr(request, "param") else (present_devices() or DEVICES)[0]
    require(name)
    return name
