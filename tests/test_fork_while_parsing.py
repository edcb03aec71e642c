"""A process forked while another thread of its parent makes kernels is not stuck."""

from __future__ import annotations

import subprocess
import sys

import pytest

#: A thread that makes kernels without end, and a child that makes and runs one.
SCRIPT = """
import os, signal, threading, time
import numpy as np
import passgraph as pg

TEXT = "def gain{0}(color: Image) -> vec4: return color[0, 0] * {0}.0"
stop = False

def make():
    number = 0
    while not stop:
        number += 1
        pg.kernel(source=TEXT.format(number)).program

thread = threading.Thread(target=make)
thread.start()
failed = 0
for attempt in range(20):
    time.sleep(0.003)
    child = os.fork()
    if child == 0:
        signal.alarm(20)
        made = pg.kernel(source=TEXT.format(3))(pg.Input("frame"))
        with pg.compile(made, "reference") as program:
            (result,) = program(frame=np.ones((2, 2, 4), np.float32)).values()
        os._exit(int(result[0, 0, 0] != 3.0))
    failed += os.waitpid(child, 0)[1] != 0
stop = True
thread.join()
print(failed)
"""


@pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="this system has no fork")
def test_a_child_forked_while_kernels_are_made_runs() -> None:
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", SCRIPT], capture_output=True, text=True, timeout=300)
    assert done.stdout == "0\n", done.stderr
