"""The numpy backend's generated code: cached on disk, vectorisable, the same bits on any number of threads."""

from __future__ import annotations

import gc
import os
import platform
import re
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph import disk_cache
from passgraph.backends.numpy.backend import NumpyBackend
from passgraph.backends.numpy.machine import compiler, machine_code
from passgraph.backends.numpy.machine.workers import Workers
from passgraph.backends.numpy.pixels.body import body_text
from passgraph.backends.numpy.pixels.buffer_layout import Layout
from passgraph.backends.numpy.pixels.chains import single_stage
from passgraph.backends.numpy.pixels.code import pixel_text
from passgraph.errors import BackendError
from passgraph.formats import format_named
from passgraph.plan.data import PixelStep

GATHER = """
def gather(color: Image, other: Image) -> float:
    position = ivec2(color[0, 0].xy * 100.0)
    lit = 0.0
    for i in range(-1, 2):
        for j in range(-1, 2):
            lit += 1.0 if other.texel(position + ivec2(i, j)).r > 0.5 else 0.0
    return lit / 9.0
"""
BRANCHES = """
def branches(color: Image, reach: Const[int] = 40) -> vec4:
    total = color[0, 0]
    for i in range(reach):
        if total.x > 1000.0:
            break
        if total.y > 0.5:
            total = total * 1.5 + color[i % 3, 0]
        else:
            total = total + color.texel(ivec2(total.xy * 7.0)) * 0.25
    return total
"""
BLUR = """
def blur(color: Image, across: Const[int] = 1) -> vec4:
    total = vec4(0.0)
    for i in range(-7, 8):
        total += color[i * across, i * (1 - across)] * exp(-0.03 * float(i * i))
    return total
"""


def pixel_step(text: str) -> PixelStep:
    kernel = pg.kernel(source=text)
    images = [pg.Input(p.name, "rgba32f", (64, 48)) for p in kernel.parameters if str(p.type) == "Image"]
    with pg.compile(kernel(*images), backend="null") as program:
        (step,) = program.plan.steps
    assert isinstance(step, PixelStep)
    return step


def emitted(text: str) -> str:
    """LLVM text of a pass as this backend writes it: its body, and what is around."""
    layout = Layout.for_chain(single_stage(pixel_step(text)), machine_code.lanes())
    return body_text(layout.stages[0], "body") + pixel_text(layout, "pieces")


def assembly(text: str) -> str:
    """Assembly of a pass's body."""
    layout = Layout.for_chain(single_stage(pixel_step(text)), machine_code.lanes())
    return str(compiler.machine().emit_assembly(compiler.optimised(body_text(layout.stages[0], "body"))))


@pytest.mark.parametrize("text", [BLUR, BRANCHES])
def test_compiled_code_is_of_vectors(text: str) -> None:
    """Packed products and sums only, where a kernel branches and loops too: a scalar one would have single ones."""
    instructions = re.findall(r"^\t(v?f?[a-z0-9]+(?:\tv)?)", assembly(text), re.MULTILINE)
    assert {"vmulps", "mulps", "fmul\tv"} & set(instructions)
    assert not {"vmulss", "mulss", "vaddss", "addss"} & set(instructions)


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="about instructions of x86")
def test_reads_anywhere_are_vectorised_without_gather_instructions() -> None:
    """The comparisons are packed, and so are the conversions to texel numbers; each texel is a load of its own."""
    instructions = re.findall(r"^\t(v?[a-z0-9]+)\b", assembly(GATHER), re.MULTILINE)
    assert any(name.startswith(("vcmp", "cmp")) and name.endswith("ps") for name in instructions)
    assert {"vcvttps2dq", "cvttps2dq"} & set(instructions)
    assert not [name for name in instructions if "gather" in name]


def test_products_and_sums_round_one_by_one() -> None:
    """No a * b + c becomes a fused operation, which would round once: bits must not depend on what is fused."""
    size = (64, 48)
    rng = np.random.default_rng(3)
    a, b, c = (rng.random((size[1], size[0], 4), np.float32) for _ in range(3))
    kernel = pg.kernel(
        source="def sums(a: Image, b: Image, c: Image) -> tuple[vec4, vec4]:\n"
        "    return a[0, 0] * b[0, 0] + c[0, 0], a[0, 0] * b[0, 0] - c[0, 0]"
    )
    images = [pg.Input(name, "rgba32f", size) for name in "abc"]
    made = kernel(*images, into=(pg.target("plus", "rgba32f"), pg.target("minus", "rgba32f")))
    with pg.compile(made, "numpy") as program:
        found = program(a=a, b=b, c=c)
    np.testing.assert_array_equal(found["plus"], a * b + c)
    np.testing.assert_array_equal(found["minus"], a * b - c)


def run_twice(backend: str) -> np.ndarray:
    picture = np.random.default_rng(1).random((97, 131, 4), np.float32)
    kernel = pg.kernel(source=BLUR)
    with pg.compile(
        kernel(kernel(pg.Input("frame"), into=pg.target("a", "rgba16f")), across=0), backend=backend
    ) as program:
        return program(frame=picture)["blur"]


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
def test_any_number_of_threads_gives_the_same_bits(threads: int) -> None:
    np.testing.assert_array_equal(run_twice("numpy:1"), run_twice(f"numpy:{threads}"))


@pytest.mark.parametrize("border", ["clamp", "zero", "repeat", "mirror", "reflect-101"])
@pytest.mark.parametrize("size", [(1, 1), (2, 3), (5, 1), (16, 16), (33, 20)])
def test_border_and_interior_agree_with_the_reference(border: str, size: tuple[int, int]) -> None:
    """Footprint wider than some of the pictures: every pixel is then a border pixel."""
    picture = np.random.default_rng(2).random((size[1], size[0], 4), np.float32)
    kernel = pg.kernel(source=BLUR)
    results = []
    for name in ("reference", "numpy"):
        with pg.compile(kernel(pg.Input("frame", border=border)), backend=name) as program:
            results.append(program(frame=picture)["blur"])
    np.testing.assert_allclose(results[1], results[0], rtol=15 * 2.0**-23)


SECOND = """
import sys, numpy as np
import passgraph as pg
from passgraph.backends.numpy.machine import compiler
compile_text, texts = compiler.compiled, []
compiler.compiled = lambda text, loops: texts.append(text) or compile_text(text, loops)
kernel = pg.kernel(source=sys.argv[1])
with pg.compile(kernel(pg.Input("frame")), backend="numpy") as program:
    program(frame=np.zeros((16, 16, 4), np.float32))
print(len(texts), "numba" in sys.modules)
"""


def test_a_second_process_starts_with_compiled_code(tmp_path: Path) -> None:
    """It compiles nothing; and neither process needs numba for pixel passes."""
    environment = {**os.environ, "PASSGRAPH_CACHE": str(tmp_path)}
    said = []
    for _ in range(2):
        made = subprocess.run(
            [sys.executable, "-c", SECOND, BLUR],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
            timeout=120,
        )
        said.append(made.stdout.split())
    (compiled, *_), _ = said
    assert int(compiled) > 0
    assert said == [[compiled, "False"], ["0", "False"]]


def test_a_cache_that_others_may_write_to_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Code from there is run, so it must be the user's alone; passes are compiled all the same."""
    (tmp_path / "code").mkdir(mode=0o777)
    (tmp_path / "code").chmod(0o777)
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    monkeypatch.setattr(disk_cache, "_said", set())
    with pytest.warns(UserWarning, match=r"others may write.*chmod 700"):
        assert machine_code.function_code(("a test of its own", str(tmp_path)), returns).address
    assert not list((tmp_path / "code").iterdir())


def returns(name: str) -> str:
    return f"define void @{name}() {{\n  ret void\n}}\n"


def test_generated_code_holds_no_name_of_the_users() -> None:
    text = emitted(GATHER.replace("color", "os_system").replace("gather", "evil"))
    assert "os_system" not in text and "evil" not in text


def test_device_is_a_number_of_threads() -> None:
    with NumpyBackend("3") as backend:
        assert backend.workers.count == 3
    with pytest.raises(BackendError, match=r"number of threads.*'fast'"):
        NumpyBackend("fast")


def test_pictures_too_large_to_count_are_refused() -> None:
    with NumpyBackend("1") as backend, pytest.raises(BackendError, match=r"65536x32768 target has more pixels"):
        backend.make(format_named("r8"), (65536, 32768))


def test_pieces_run_side_by_side_and_each_once() -> None:
    """Two threads meet at a barrier, which one thread alone would never pass."""
    meeting, seen = threading.Barrier(2, timeout=60), []

    def piece(number: int) -> None:
        if number < 2:
            meeting.wait()
        seen.append(number)

    with Workers(2) as workers:
        workers.each(piece, 50)
    assert sorted(seen) == list(range(50))


def test_closed_or_forgotten_workers_leave_no_thread() -> None:
    def names() -> set[str]:
        return {thread.name for thread in threading.enumerate()}

    before = names()
    closed, forgotten = Workers(3), Workers(3)
    for workers in (closed, forgotten):
        workers.each(lambda number: None, 9)
    assert len(names() - before) == 2
    closed.close()
    closed.close()
    closed.each(lambda number: None, 9)  # alone, in the caller's thread
    del forgotten, workers
    gc.collect()
    assert names() == before


def test_an_exception_in_one_thread_reaches_the_caller() -> None:
    with NumpyBackend("2") as backend:

        def fail(piece: int) -> None:
            raise ValueError(str(piece))

        with pytest.raises(ValueError, match=r"\d"):
            backend.workers.each(fail, 8)


def test_every_primitive_has_its_instruction() -> None:
    """On each type that the table of operations lets it have."""
    from passgraph.backends.numpy.vector.lanes import _ROWS
    from passgraph.language.operations import OPERATIONS

    for row in OPERATIONS.values():
        for scalar in row.types:
            assert row.name in _ROWS[scalar], f"{row.name} on {scalar}"


def test_code_and_its_constants_lie_together_where_free_memory_is_scattered() -> None:
    """LLVM ends the process where it maps them more than 2 GiB apart, as its older loader may."""
    ended = subprocess.run(
        [sys.executable, "-m", "tests.backends.far_memory"], capture_output=True, text=True, timeout=100, check=False
    )
    assert ended.returncode == 0, ended.stderr
