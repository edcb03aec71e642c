"""Random mistakes can be planted in every package, and its tests are there."""

from __future__ import annotations

import ast
import random

import pytest

from tests.mutation.places import ROOT, sources
from tests.mutation.sample import TESTS, mistakes, ordered


@pytest.mark.sampled
@pytest.mark.parametrize("package", TESTS)
def test_every_mistake_is_another_program(package: str) -> None:
    possible = mistakes(package)
    assert len(possible) > 30
    for mistake in random.Random(package).sample(possible, 5):
        assert ast.dump(ast.parse(mistake.planted())) != ast.dump(ast.parse(sources()[mistake.file])), mistake
    tests = ordered(possible[0], TESTS[package])
    assert tests
    assert all((ROOT / test).is_file() for test in tests)


def test_every_package_of_the_sources_is_sampled() -> None:
    """But those whose mistakes conformance judges, and a few small modules at the top."""
    folders = {"/".join(file.split("/")[:2]) for file in sources() if file.count("/") > 1}
    judged = {f"backends/{name}" for name in ("gl", "numpy", "opencl", "webgpu")}
    assert folders - judged - {"passgraph/assets"} == set(TESTS)
