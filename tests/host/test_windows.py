"""Framebuffer 0 of windows and pbuffers of all kinds is read and written in place, and follows their sizes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.xvfb import screen

pytestmark = [pytest.mark.gl, pytest.mark.skipif(find_spec("pyglet") is None, reason="pip install pyglet")]
#: The states that a guard puts back are the same for windows as for textures.
BOTH = ["sibling", pytest.param("guard", marks=pytest.mark.slow)]
root = Path(__file__).resolve().parent.parent.parent


def stored(isolation: str, has: dict[str, object], display: str = "") -> str:
    """What the frame holds; the process checks the rest."""
    command = [sys.executable, "-m", "tests.host.windows", isolation, json.dumps(has)]
    environment = {**os.environ, "PYTHONPATH": str(root), "DISPLAY": display}
    ran = subprocess.run(command, capture_output=True, text=True, check=False, cwd=root, env=environment, timeout=200)
    if "NoSuchConfigException" in ran.stderr:
        pytest.skip("a window of this kind: the display has none (Mesa 25 offers no four samples)")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    made: str = json.loads(ran.stdout.splitlines()[-1])[0]
    return made


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with screen() as name:
        yield name


@pytest.mark.parametrize("isolation", BOTH)
def test_a_double_buffered_window(isolation: str, display: str) -> None:
    assert stored(isolation, {"alpha": True}, display).startswith("8/8/8/8 bits")


@pytest.mark.parametrize("isolation", BOTH)
def test_a_single_buffered_window(isolation: str, display: str) -> None:
    assert stored(isolation, {"single": True}, display).startswith("8/8/8/0 bits")


@pytest.mark.parametrize("isolation", BOTH)
def test_a_window_of_four_samples(isolation: str, display: str) -> None:
    assert stored(isolation, {"samples": 4}, display).startswith("8/8/8/0 bits")


@pytest.mark.parametrize("isolation", BOTH)
def test_a_window_of_16_bits(isolation: str) -> None:
    with screen(depth=16) as display:
        assert stored(isolation, {}, display).startswith("5/6/5/0 bits")


@pytest.mark.parametrize("isolation", BOTH)
def test_a_pbuffer(isolation: str) -> None:
    assert stored(isolation, {"headless": True}).startswith("5/6/5/0 bits")
