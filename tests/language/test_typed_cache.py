"""Kernels of this package that the disk cache holds: equal to the parsed ones, and never taken for another."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import passgraph as pg
from passgraph import disk_cache
from passgraph.effects.color import black_and_white as gray_module
from passgraph.effects.shadows import shadow_filters
from passgraph.effects.shadows.penumbra_search import find_penumbrae
from passgraph.effects.surfaces import g_buffer
from passgraph.language import ir, lower_cache, parse, typed_cache, types
from passgraph.language.kernel import Kernel


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv(disk_cache.CACHE_VARIABLE, str(tmp_path))
    monkeypatch.setattr(disk_cache, "_IMPORTED", float("inf"))  # files of a fresh checkout are new
    disk_cache.package_stamp.cache_clear()
    yield tmp_path
    disk_cache.package_stamp.cache_clear()


def kernels_of(*modules: ModuleType) -> list[Kernel]:
    found = [value for module in modules for value in vars(module).values() if isinstance(value, Kernel)]
    return [*found, find_penumbrae(4)]


def single_types(program: ir.TypedKernel) -> list[object]:
    """Return the types that have one object each, by which the compiler compares them; None for other types."""
    nodes = [*program.parameters, *ir.expressions(*program.body), *program.results]
    return [next((one for one in types.NAMED.values() if node.type is one), None) for node in nodes]


def same_again(kernel: Kernel) -> Kernel:
    """Return a kernel of the same function that has no program yet."""
    assert kernel.definition is not None
    return Kernel(kernel.definition, kernel.stage)


def positions(program: ir.TypedKernel) -> str:
    return str([node.span for node in ir.expressions(*program.body)]) + str(program.source)


def test_a_kernel_from_the_cache_is_the_parsed_one_with_its_positions() -> None:
    kernels = kernels_of(gray_module, shadow_filters, g_buffer)
    assert len(kernels) > 4
    for kernel in kernels:
        parsed, _ = parse.parse_with_scopes(kernel.definition, kernel.stage)  # type: ignore[arg-type]
        typed_cache.remember(kernel.name, parsed)
        recalled = typed_cache.recall(kernel.name)
        assert recalled is not None and recalled is not parsed
        assert recalled == parsed
        assert single_types(recalled) == single_types(parsed)
        assert any(single_types(parsed))
        assert positions(recalled) == positions(parsed)
        known = lower_cache.kernel_digest(recalled)
        lower_cache.DIGESTS.pop(id(recalled))
        assert known == lower_cache.kernel_digest(recalled) == lower_cache.kernel_digest(parsed)


def test_a_second_use_parses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    (kernel, *_) = kernels_of(gray_module)
    expected = same_again(kernel).program
    monkeypatch.setattr(parse, "parse_with_scopes", lambda *_: pytest.fail("it was parsed"))
    assert same_again(kernel).program == expected


def test_its_scopes_are_there_for_serialization() -> None:
    (kernel, *_) = kernels_of(gray_module)
    _ = same_again(kernel).program
    recalled = same_again(kernel)
    _ = recalled.program
    assert recalled.definition in recalled.scopes


def test_values_that_a_kernel_captures_belong_to_its_key() -> None:
    few, many = find_penumbrae(4).definition, find_penumbrae(8).definition
    assert few.cache_key and many.cache_key
    assert few.cache_key != many.cache_key


def test_kernels_of_a_user_are_parsed_each_time() -> None:
    @pg.kernel
    def mine(color: pg.Image) -> pg.vec4:
        return color[0, 0]

    assert mine.definition is not None and mine.definition.cache_key == ""
    text = pg.kernel(source="def mine(color: Image) -> vec4: return color[0, 0]")
    assert text.definition is not None and text.definition.cache_key == ""


def test_nothing_is_kept_once_a_file_of_the_package_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    (kernel, *_) = kernels_of(gray_module)
    monkeypatch.setattr(disk_cache, "_IMPORTED", 0.0)
    disk_cache.package_stamp.cache_clear()
    typed_cache.remember("x", kernel.program)
    assert typed_cache.recall("x") is None


def test_a_change_of_a_file_makes_another_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inner = tmp_path / "package" / "inner"
    inner.mkdir(parents=True)
    file = inner / "kernels.py"
    stamps = set()
    monkeypatch.setattr(disk_cache, "PACKAGE", str(tmp_path / "package"))
    for text in ("a = 1", "a = 12"):
        file.write_text(text)
        disk_cache.package_stamp.cache_clear()
        stamps.add(disk_cache.package_stamp())
    assert len(stamps) == 2 and None not in stamps


@pytest.mark.parametrize("content", [b"", b"no pickle", pickle.dumps(("digest", Path("x"))), pickle.dumps(("", 1))])
def test_a_file_with_anything_else_is_no_kernel(content: bytes) -> None:
    stamp = disk_cache.package_stamp()
    assert stamp is not None
    disk_cache.remember("kernels", lower_cache.digest(stamp, "x"), content)
    assert typed_cache.recall("x") is None


#: A soft shadow, and the modules of the compiler that it imported.
SHADOW = """
import sys, passgraph as pg
from passgraph.effects import soft_shadow
with pg.compile(soft_shadow(pg.Scene.shipped()), backend="numpy", size=(48, 32)) as program:
    program()
compilers = "language.parse language.expressions language.lower backends.numpy.pixels.code backends.numpy.pixels.body"
print(*[name for name in compilers.split() if f"passgraph.{name}" in sys.modules])
"""


def test_a_second_process_imports_no_compiler(own_cache: Path) -> None:
    environment = {**os.environ, disk_cache.CACHE_VARIABLE: str(own_cache)}
    first, second = (
        subprocess.run(
            [sys.executable, "-c", SHADOW], env=environment, capture_output=True, text=True, check=True
        ).stdout
        for _ in range(2)
    )
    assert "language.lower" in first and second.strip() == ""
