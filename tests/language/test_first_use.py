"""Kernels of this package are parsed when they are first used, all others where they are defined."""

from __future__ import annotations

import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import passgraph
from passgraph.language.kernel import Kernel

WRONG = """
import passgraph as pg
from passgraph import Image, vec4


@pg.{stage}
def wrong({parameter}) -> vec4:
    return vec4(1.0) @ 2.0
"""


@pytest.mark.parametrize(
    ("stage", "parameter"), [("kernel", "color: Image"), ("vertex", "vertex: pg.Vertex"), ("fragment", "by: float")]
)
def test_a_users_kernel_is_refused_where_it_is_defined(
    stage: str, parameter: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Importing the module fails, though nobody uses the kernel."""
    name = f"with_a_wrong_{stage}"
    (tmp_path / f"{name}.py").write_text(WRONG.format(stage=stage, parameter=parameter), encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(passgraph.KernelError, match=rf"{name}.py:[78]: "):
        importlib.import_module(name)


def test_an_effect_that_nobody_runs_needs_no_parser() -> None:
    code = "import sys, passgraph.effects.shadows.soft_shadow; print('passgraph.language.parse' in sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert ran.stdout.strip() == "False"


def test_every_kernel_of_the_package_is_one() -> None:
    """What waits for its first use would be refused only there: here all of them are used."""
    import passgraph.effects
    import passgraph.verify

    met = 0
    for package in (passgraph.effects, passgraph.verify):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if found.name.endswith("pytest_plugin"):
                continue
            for kernel in vars(importlib.import_module(found.name)).values():
                if isinstance(kernel, Kernel):
                    assert kernel.program.name == kernel.name
                    met += 1
    assert met > 100
