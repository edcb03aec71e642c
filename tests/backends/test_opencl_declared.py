"""declared.cl stands for the declarations of all of OpenCL C, which PoCL would read for each program."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.opencl import OpenCLBackend, programs
from passgraph.backends.opencl.opencl_c import (
    SPELLED,
    join,
    load_expression,
    package_text,
    prologue,
    store_expression,
)
from passgraph.backends.opencl.storage import ImageLayout
from passgraph.backends.opencl.transfers import move_source
from passgraph.backends.registry import open_backend
from passgraph.errors import BackendError
from passgraph.formats import FORMATS
from tests.conftest import require

pytestmark = pytest.mark.opencl
FOLDER = Path(programs.__file__).parent
#: What stands before a bracket and is no function.
WORDS = {"if", "for", "while", "return", "defined", "reqd_work_group_size", "float4", "bool"}
CALLED = re.compile(r"(?<![\w#])([a-z_]\w*) ?\(")


@pytest.fixture
def device() -> Iterator[OpenCLBackend]:
    require("opencl")
    with open_backend("opencl") as opened:
        assert isinstance(opened, OpenCLBackend)
        if not opened.programs.declares:
            pytest.skip("another driver than PoCL reads its own declarations")
        yield opened


def texts() -> Iterator[str]:
    """All that our kernels are made of."""
    yield from (re.sub("//.*", "", path.read_text()) for path in FOLDER.glob("*.cl") if path.name != "declared.cl")
    yield prologue(True)
    yield from (text for spelled in SPELLED.values() for text in spelled.values())
    for format_ in FORMATS.values():
        yield load_expression(format_, "image", "i") + store_expression(format_, "value")
        yield move_source(ImageLayout.tight(format_, (4, 4)), ImageLayout.tight(FORMATS["rgba32f"], (4, 4)), 4)
        yield move_source(ImageLayout.tight(FORMATS["rgba32f"], (4, 4)), ImageLayout.tight(format_, (4, 4)), 4)
    # What is printed by other parts: bounds of reads, and of the stencil; what a macro stands for.
    yield "clamp(x, 0, 1) min(a, b) max(a, b) get_global_id(0) fma(a, b, c)"


def called(text: str) -> set[str]:
    """Functions of OpenCL C, without those that are ours or in the compiler itself."""
    return {name for name in CALLED.findall(text) if not name.startswith(("pg_", "as_", "__"))} - WORDS


def test_what_kernels_call_is_declared_and_nothing_else() -> None:
    assert called("".join(texts())) == called(re.sub("//.*", "", package_text("declared.cl")))


def test_pocl_takes_them(device: OpenCLBackend) -> None:
    """Programs of which one calls each: a draw, a copy with conversions, arithmetic on ints."""
    text = """
def all_sorts(c: Image) -> vec4:
    n = int(c[0, 0].x * 7.0)
    return vec4(floor(c[1, 0].x), ceil(c[0, 1].y), round(sqrt(abs(c[0, 0].z))), float(abs(n) % 5 + (n << 3)))
"""
    picture = np.random.default_rng(3).random((30, 40, 4)).astype(np.float32)
    made = pg.kernel(source=text)(pg.Input("c", "rgba16f"), into=pg.target("out", "rgba16f"))
    with pg.compile(made, backend=device) as program:
        program(c=picture)
    for path, defines in (("raster.cl", "#define PG_TILE 16\n#define PG_INTS 12\n"), ("helpers.cl", "")):
        helpers = "" if path == "helpers.cl" else package_text("helpers.cl")
        device.programs.build(join(helpers, defines, package_text(path)), path)
    assert device.programs.declares


def test_a_compiler_that_refuses_them_reads_its_own(device: OpenCLBackend, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once; from then on it is not asked again."""
    asked = []

    def refused(name: str) -> str:
        asked.append(name)
        return "#error these are none\n"

    monkeypatch.setattr(programs, "package_text", refused)
    for value in (1, 2):
        built = device.programs.build(join(f"__kernel void k(__global int* a) {{ a[0] = {value}; }}\n"), "a test")
        assert built.all_kernels()[0].function_name == "k"
    assert asked == ["declared.cl"]
    assert not device.programs.declares


def test_a_kernel_that_is_wrong_leaves_them_in_use(device: OpenCLBackend) -> None:
    with pytest.raises(BackendError, match="no_such_function"):
        device.programs.build(join("__kernel void k(__global int* a) { a[0] = no_such_function(1); }\n"), "a test")
    assert device.programs.declares
