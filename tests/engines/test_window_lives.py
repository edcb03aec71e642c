"""What windows go through while an effect is attached; each claim is a function of ``windows.py``, in a process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.engines.harmless import need

pytestmark = pytest.mark.engines
SCRIPT = Path(__file__).with_name("windows.py")
root = SCRIPT.parent.parent.parent


def run(claim: str, distribution: str, display: str = "") -> None:
    need(distribution)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(root), os.environ.get("PYTHONPATH", "")])}
    environment["DISPLAY"] = display
    command = [sys.executable, str(SCRIPT), claim]
    ran = subprocess.run(command, capture_output=True, text=True, check=False, env=environment, timeout=300)
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_two_effects_run_in_the_order_in_which_they_came() -> None:
    run("two_effects_run_in_the_order_in_which_they_came", "moderngl-window")


def test_several_samples_a_pixel_are_read_as_their_mean_and_all_written() -> None:
    run("several_samples_a_pixel", "moderngl-window")


@pytest.mark.slow
def test_two_windows_of_one_process_have_an_effect_each(display: str) -> None:
    run("two_windows_of_one_process", "pyglet", display)


@pytest.mark.slow
def test_the_effect_goes_on_in_a_context_that_is_made_anew(display: str) -> None:
    run("a_context_is_made_anew", "pygame-ce", display)


@pytest.mark.slow
def test_the_display_may_be_closed_first(display: str) -> None:
    run("the_display_is_closed_first", "pygame-ce", display)


@pytest.mark.slow
def test_a_window_beside_the_display_has_an_effect(display: str) -> None:
    run("a_window_beside_the_display", "pygame-ce", display)


@pytest.mark.slow
def test_the_effect_follows_a_widget_to_another_window(display: str) -> None:
    run("a_widget_moves_to_another_window", "PySide6", display)


def test_picking_goes_without_the_effect() -> None:
    run("picking_goes_without", "vispy")
