"""The memory of a plan is checked before anything is allocated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.plan import limits
from passgraph.run.execution import Execution

COPY = pg.kernel(source="def copy(c: Image) -> vec4: return c[0, 0]")
FRAME = pg.Input("frame", "rgba32f", (64, 32))


def two_large() -> pg.Target:
    stretch = pg.kernel(source="def stretch(c: Image) -> vec4: return c.sample(uv())")
    large = stretch(FRAME, into=pg.target("large", "rgba32f", (4096, 4096)))
    return stretch(large, into=pg.target("small", "rgba8", (8, 8)))


@pytest.fixture
def nothing_is_allocated(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        pytest.fail("allocated")

    monkeypatch.setattr(Execution, "__init__", fail)


@pytest.mark.usefixtures("nothing_is_allocated")
@pytest.mark.parametrize("given", ["100 MB", 100_000_000])
def test_a_plan_that_takes_more_is_refused_with_its_largest_targets(given: int | str) -> None:
    expected = r"take 269 MB, and at most 100 MB are allowed, the memory that is given; the largest are large 4096x4096"
    with pytest.raises(pg.GraphError, match=expected):
        pg.compile(two_large(), "numpy", memory=given, options=pg.Options(fuse=False))


@pytest.mark.usefixtures("nothing_is_allocated")
def test_half_of_the_machine_is_the_default(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "machine_memory", lambda: 400_000_000)
    with pytest.raises(pg.GraphError, match=r"at most 200 MB are allowed, half of this machine's memory"):
        pg.compile(two_large(), "numpy", options=pg.Options(fuse=False))


def test_what_fits_runs() -> None:
    with pg.compile(COPY(FRAME), "numpy", memory="1 MB") as program:
        assert np.asarray(program(frame=np.ones((32, 64, 4), np.float32))).shape == (32, 64, 4)
        assert program.settings()["memory"] == 1_000_000


def test_an_open_size_is_checked_at_the_run() -> None:
    with (
        pg.compile(COPY(pg.Input("frame")), "numpy", memory="1 MB") as program,
        pytest.raises(pg.GraphError, match="at most 1 MB"),
    ):
        program(frame=np.ones((512, 512, 4), np.float32))


def test_a_shader_of_a_stranger_is_held_to_it(tmp_path: Path) -> None:
    """Little text that asks for a large texture."""
    head = "//!HOOK MAIN\n//!BIND HOOKED\n//!WIDTH 16384\n//!HEIGHT 16384\n"
    text = head + "vec4 hook() { return HOOKED_tex(HOOKED_pos); }\n"
    (tmp_path / "large.hook").write_text(text)
    effect = pg.load_shader(tmp_path / "large.hook")
    with pytest.raises(pg.GraphError, match=r"the targets of this graph take .* at most 500 MB"):
        pg.compile(effect(pg.Input("frame", "rgba32f", (8, 8))), "numpy", memory="500 MB")


def test_a_container_has_the_memory_of_its_group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "max").write_text("123456789\n")
    (tmp_path / "none").write_text("max\n")
    monkeypatch.setattr(limits, "_CGROUPS", (str(tmp_path / "none"), str(tmp_path / "max"), str(tmp_path / "absent")))
    limits.machine_memory.cache_clear()
    assert limits.machine_memory() == 123456789
    limits.machine_memory.cache_clear()
