"""The package of effects: loads what is asked for, by the names of effects."""

from __future__ import annotations

import subprocess
import sys

import pytest

import passgraph.effects as effects

SCRIPT = """
import sys
import passgraph.effects
loaded = lambda: sorted(name for name in sys.modules if name.startswith("passgraph.effects."))
assert loaded() == [], loaded()
import passgraph.effects.lens.bloom
from passgraph.effects import bloom, tone_map
assert callable(bloom) and callable(tone_map)
assert "passgraph.effects.ambient.ambient_occlusion" not in loaded()
assert "networkx" not in sys.modules and "numba" not in sys.modules
"""


def test_importing_the_package_loads_no_effect() -> None:
    subprocess.run([sys.executable, "-c", SCRIPT], check=True)


def test_every_name_is_there() -> None:
    assert set(effects.__all__) <= set(dir(effects))
    for name in effects.__all__:
        assert callable(getattr(effects, name)) or name == "EFFECTS"


def test_a_name_that_is_not_there_is_named() -> None:
    with pytest.raises(AttributeError, match=r"'passgraph\.effects' has no attribute 'blooom'"):
        effects.blooom  # noqa: B018
