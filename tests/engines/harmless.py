"""Engines in processes of their own, with and without an effect, frame by frame."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np
import pytest

from docs.engines.demo import inverse_of, played

root = Path(__file__).resolve().parent.parent.parent
#: Half a byte a frame; a picture of these frames has 1,536.
GROWTH_BYTES = 4_000_000

Frames = dict[str, Any]


def need(distribution: str) -> None:
    """Skip where an engine is not installed."""
    try:
        version(distribution)
    except PackageNotFoundError:
        pytest.skip(f"{distribution} is not installed; pip install {distribution}")


@cache
def frames(engine: str, *options: str, under: tuple[str, ...] = ()) -> Frames:
    """See `played`; each is played once."""
    return played(engine, *options, under=under)


def said(code: str, **variables: str) -> str:
    """What a new interpreter prints."""
    environment = {
        **os.environ,
        **variables,
        "PYTHONPATH": os.pathsep.join([str(root), os.environ.get("PYTHONPATH", "")]),
    }
    command = [sys.executable, "-c", dedent(code)]
    ran = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


def differing(one: Frames, other: Frames) -> list[int]:
    """Numbers of the frames in which a bit differs."""
    numbers = sorted(int(name) for name in one if name.isdigit())
    assert len({one[str(n)].tobytes() for n in numbers}) == len(numbers), "the scene must move from frame to frame"
    return [n for n in numbers if not np.array_equal(one[str(n)], other[str(n)])]


def check_harmless(engine: str, isolation: str, *options: str, under: tuple[str, ...] = ()) -> None:
    """An effect in frames 2 and 3 of 7 changes these as it should, and no other by a bit."""
    plain = frames(engine, *options, under=under)
    changed = frames(engine, "--effect", "2", "3", "--isolation", isolation, *options, under=under)
    assert str(changed["error"]) == ""
    assert str(changed["isolation"]) == isolation
    assert differing(plain, changed) == [2, 3]
    assert changed["after"].tolist() == plain["after"].tolist(), "OpenGL objects are left"
    for number in ("2", "3"):
        np.testing.assert_array_equal(changed[number], inverse_of(plain[number]))


def check_resized(engine: str, *options: str, under: tuple[str, ...] = ()) -> None:
    """The engine's frames change their size while the effect runs, which then does so at the new one."""
    plain = frames(engine, "--resize", "4", *options, under=under)
    changed = frames(engine, "--effect", "2", "3", "4", "5", "--resize", "4", *options, under=under)
    assert plain["3"].shape != plain["4"].shape
    assert str(changed["error"]) == ""
    assert differing(plain, changed) == [2, 3, 4, 5]
    for number in "2345":
        np.testing.assert_array_equal(changed[number], inverse_of(plain[number]))


def check_failing_effect(engine: str, *options: str, under: tuple[str, ...] = ()) -> None:
    """One that fails while it runs is switched off and said to be; the frames are as without it."""
    plain, changed = (
        frames(engine, *options, under=under),
        frames(engine, "--effect", "2", "3", "--which", "broken", under=under),
    )
    assert differing(plain, changed) == []
    assert "value 'gain' is missing" in str(changed["error"])
    assert changed["log"].count("the effect failed and is switched off") == 1


def check_sensitive(engine: str, left: str, *options: str, under: tuple[str, ...] = ()) -> None:
    """What is left behind in the engine's context is seen by the comparison, so that it proves something."""
    plain = frames(engine, *options, under=under)
    careless = frames(engine, "--effect", "2", "3", "--leave", left, *options, under=under)
    assert set(differing(plain, careless)) > {2, 3}


def check_no_growth(engine: str, *options: str, under: tuple[str, ...] = ()) -> None:
    """From the 2,000th frame with the effect to the 10,000th neither memory nor objects become more."""
    made = frames(engine, "--frames", "0", "--many", "10000", "--size", "24", "16", *options, under=under)
    assert str(made["failed"]) == ""
    first, last = made["held"].tolist()
    assert first == last
    early, late = made["resident"].tolist()
    assert late - early < GROWTH_BYTES


def check_by_hand_is_alike(engine: str, *options: str, under: tuple[str, ...] = ()) -> None:
    """What the table compares with is the same picture, but for rounding to 8 bits, and breaks no frame."""
    ours, hand = (
        frames(engine, "--effect", "2", "3", "--which", which, *options, under=under)
        for which in ("soft", "soft by hand")
    )
    assert max(int(np.abs(ours[n].astype(int) - hand[n]).max()) for n in "0123456") <= 1
    assert differing(frames(engine, *options, under=under), ours) == [2, 3]
