"""Python's builtins in kernels, in a process where an engine has put its own beside them."""

from __future__ import annotations

import subprocess
import sys


def test_what_an_engine_puts_into_builtins_is_not_the_language_s() -> None:
    """As Panda3D's ShowBase does with a ``clamp`` of its own."""
    code = """
import builtins
builtins.clamp = lambda value, low, high: value
import numpy as np
import passgraph as pg
kernel = pg.kernel(source="def k(c: Image) -> vec4: return clamp(c.sample(uv()) * 2.0, 0.0, max(0.5, 0.25))")
print(pg.compile(kernel(pg.Input("c")), backend="reference")(c=np.ones((1, 1, 4), np.float32))["k"][0, 0])
print(pg.clamp is not builtins.clamp)
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert ran.stdout == "[0.5 0.5 0.5 0.5]\nTrue\n", ran.stderr
