"""Random mistakes can be planted in every package, and its tests are there."""

from __future__ import annotations

import ast
import random

import pytest

from tests.mutation.places import ROOT, sources
from tests.mutation.sample import TESTS, main, mistakes, ordered


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


@pytest.mark.parametrize("package", ["backends/gl", "backends/opencl", "backends/webgpu"])
def test_shader_text_is_mistaken_outside_of_comments(package: str) -> None:
    inside = sorted(set(mistakes(package, shaders=True)) - set(mistakes(package)), key=str)
    assert len(inside) > 50
    for mistake in random.Random(package).sample(inside, 20):
        old, new = sources()[mistake.file], mistake.planted().decode()
        (line,) = (number for number, (a, b) in enumerate(zip(old.split("\n"), new.split("\n"), strict=True)) if a != b)
        assert line == mistake.line - 1
        assert "//" not in old.encode()[: mistake.start].decode().rpartition("\n")[2]
        if mistake.file.endswith(".py"):
            assert isinstance(ast.parse(new), ast.Module)


def test_a_package_that_no_test_is_known_for_needs_conformance(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["backends/gl"])
    assert "with --conform any folder of the sources" in capsys.readouterr().err


def test_every_package_of_the_sources_is_sampled() -> None:
    """But those whose mistakes conformance judges, and a few small modules at the top."""
    folders = {"/".join(file.split("/")[:2]) for file in sources() if file.count("/") > 1}
    judged = {f"backends/{name}" for name in ("gl", "numpy", "opencl", "webgpu")}
    assert folders - judged - {"passgraph/assets"} == set(TESTS)
