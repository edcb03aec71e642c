"""Generated sources in the disk cache: the same text, with the same kernel lines behind it, for the same key only."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from passgraph import disk_cache
from passgraph.backends.gl.dialect import GLSL_330
from passgraph.backends.gl.glsl import GLSL
from passgraph.backends.gl.textures import ALL_PLAIN
from passgraph.backends.printing import Listing, kept
from passgraph.graph.calls import kernel
from passgraph.language.lower import lower

STEPS = kernel(source="def steps(c: Image) -> vec4:\n    d = sqrt(c[1, 0])\n    return d * 2.0 + sin(c[0, 1])")


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv(disk_cache.CACHE_VARIABLE, str(tmp_path))
    monkeypatch.setattr(disk_cache, "_IMPORTED", float("inf"))  # files of a fresh checkout are new
    disk_cache.package_stamp.cache_clear()
    yield tmp_path
    disk_cache.package_stamp.cache_clear()


def printed() -> Listing:
    return GLSL(lower(STEPS.program), (), ALL_PLAIN, GLSL_330).shader()


def test_the_text_comes_from_the_cache_and_the_lines_from_the_kernel() -> None:
    made: list[int] = []

    def make() -> Listing:
        made.append(1)
        return printed()

    first, second = kept(make, "a"), kept(make, "a")
    assert len(made) == 1 and first.text == second.text == printed().text
    assert [second.span_at(line) for line in range(80)] == [printed().span_at(line) for line in range(80)]
    assert len(made) == 2 and any(span.line == 2 for span in second.spans)


def test_another_key_is_another_source(own_cache: Path) -> None:
    listings = [
        kept(lambda text=text: Listing(text, ()), *key) for text, key in (("x", (1,)), ("y", ("1",)), ("z", (1, ())))
    ]
    assert [one.text for one in listings] == ["x", "y", "z"]
    assert len(list((own_cache / "sources").iterdir())) == 3


def test_a_damaged_file_is_printed_again(own_cache: Path) -> None:
    kept(printed, "a")
    (file,) = (own_cache / "sources").iterdir()
    for damaged in (file.read_bytes()[:-1], b"", file.read_bytes().replace(b"sqrt", b"cbrt")):
        file.write_bytes(damaged)
        assert kept(printed, "a").text == printed().text


def test_nothing_is_kept_once_a_file_of_the_package_changed(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disk_cache, "_IMPORTED", 0.0)
    disk_cache.package_stamp.cache_clear()
    kept(printed, "a")
    assert not (own_cache / "sources").exists()
