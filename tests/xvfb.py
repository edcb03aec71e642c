"""A screen for what needs one: a virtual X server (Debian: xvfb)."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def screen(depth: int = 24) -> Iterator[str]:
    """The name of a display of so many bits, for the environment variable DISPLAY; skips where there is no Xvfb."""
    program = shutil.which("Xvfb")
    if program is None:
        pytest.skip("there is no Xvfb here: apt-get install xvfb")
    read, write = os.pipe()
    # Without -noreset it begins anew when the last client goes, and refuses the next one meanwhile.
    server = subprocess.Popen(
        [program, "-displayfd", str(write), "-screen", "0", f"1280x1024x{depth}", "-nolisten", "tcp", "-noreset"],
        pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(write)
    try:
        with os.fdopen(read) as chosen:
            number = chosen.readline().strip()
        assert number, "Xvfb did not start"
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()
