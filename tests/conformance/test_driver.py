"""The OpenGL driver as users have it: tests/run.sh has Mesa compile shaders without optimising them, to save time.

One process without that setting runs every operation and the first case of each group.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from passgraph.backends.registry import open_backend
from passgraph.verify.conformance import Case, judge
from tests.conformance.choice import CASES
from tests.conftest import require

#: What Mesa's software renderer reads once, when it is loaded; tests/run.sh sets it.
SETTING = "GALLIVM_PERF"
ROOT = Path(__file__).parents[2]


def chosen() -> list[Case]:
    """Every short case of the operations, the first one of each other group, and a shadow."""
    quick = [case for case in CASES if case.quick]
    first = {case.group: case for case in reversed(quick)}
    shadow = next(case for case in quick if case.name.startswith("soft-shadow "))
    return [*(case for case in quick if case.group == "operations"), *first.values(), shadow]


def main() -> None:
    """Prints what does not pass, and how many cases there were."""
    assert SETTING not in os.environ
    with open_backend("reference") as reference, open_backend("gl") as gl:
        for case in chosen():
            for verdict in judge(case, [reference, gl]):
                if verdict.outcome != "passed":
                    print(verdict)
    print(len(chosen()), "cases")


@pytest.mark.slow
def test_the_driver_as_users_have_it_conforms() -> None:
    require("gl")
    environment = {name: value for name, value in os.environ.items() if name != SETTING}
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-c", f"from {__name__} import main; main()"]
    done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, timeout=600, check=False)
    assert (done.returncode, done.stdout) == (0, f"{len(chosen())} cases\n"), done.stdout + done.stderr
