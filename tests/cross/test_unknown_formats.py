"""A format that a backend does not know is an error that names the format and the file to change."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.errors import BackendError
from passgraph.formats import FORMATS, Format
from passgraph.language.lowering.passes import CHECK_VARIABLE

#: Backend → the file that spells formats for it; the reference stores what NumPy has.
FILES = {"gl": "gl/textures.py", "opencl": "opencl/opencl_c.py", "numpy": "numpy/vector/texels.py",
         "webgpu": "webgpu/textures.py"}  # fmt: skip


def copied(format_: Format) -> pg.Target:
    kernel = pg.kernel(source="def copy(a: Image) -> float: return a[0, 0].r")
    spec = pg.target("out", "r16f")
    return kernel(pg.Input("a", "r32f", (4, 3)), into=replace(spec, format=format_))


def test_a_format_that_is_not_spelled_is_named(device: Backend, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(CHECK_VARIABLE, raising=False)  # programs with such a number are malformed
    if device.name not in FILES:
        pytest.skip("it stores any number that NumPy has")
    strange = replace(FORMATS["r16f"], name="r64s", bits=64, steps=2**63 - 1)
    where = re.escape(FILES[device.name])
    expected = rf"^format 'r64s': .*{where} has no spelling for channel type 'u8', only 'u1'"
    with pytest.raises(BackendError, match=expected), pg.compile(copied(strange), backend=device) as program:
        program(a=[[0.5] * 4] * 3)


def test_a_format_whose_numbers_no_kernel_rounds_is_named() -> None:
    with pytest.raises(BackendError, match=r"^format 'r64f': .*formats\.py has no spelling for channel type 'f8'"):
        _ = Format("r64f", 1, 64).store
