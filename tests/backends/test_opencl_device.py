"""The OpenCL device: formats, memory, errors, caching, and that everything is given back."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.opencl import OpenCLBackend, backend
from passgraph.backends.opencl.programs import build_error
from passgraph.backends.printing import Listing
from passgraph.errors import BackendError, DeviceMissingError, InputError
from passgraph.formats import FORMATS
from passgraph.language.source import Span
from tests.conftest import require
from tests.respelling import respelled

pytestmark = pytest.mark.opencl
GRAY = "def gray(color: Image) -> vec4: return vec4(vec3(dot(color[0, 0].rgb, vec3(0.2, 0.7, 0.1))), 1.0)"


@pytest.fixture
def device() -> Iterator[OpenCLBackend]:
    require("opencl")
    with OpenCLBackend() as opened:
        yield opened


def run_gray(device: OpenCLBackend) -> None:
    with pg.compile(pg.kernel(source=GRAY)(pg.Input("frame")), backend=device) as program:
        program(frame=np.ones((3, 5, 4), np.float32))


@pytest.mark.parametrize("name", list(FORMATS))
def test_formats_hold_what_they_can(device: OpenCLBackend, name: str) -> None:
    made = FORMATS[name]
    steps = made.steps or 512
    rng = np.random.default_rng(2)
    count = (5, 7, made.channels)
    picture = (rng.integers(0, steps + 1, count).astype(np.float32) / np.float32(steps)).astype(np.float32)
    storage = device.make(made, (7, 5))
    device.upload(storage, picture)
    np.testing.assert_array_equal(device.download(storage), picture)


@pytest.mark.parametrize("name", ["r8", "r16", "r16f"])
def test_uploads_round_to_the_nearest_value_halves_to_even(device: OpenCLBackend, name: str) -> None:
    values = np.array([[0.1, 1 / 3, 0.5 / 255, 1.5 / 255, 2.0, -1.0]], np.float32)[..., None]
    storage = device.make(FORMATS[name], (6, 1))
    device.upload(storage, values)
    if name == "r16f":
        expected = values.astype(np.float16).astype(np.float32)
    else:
        one = np.float32(255 if name == "r8" else 65535)
        expected = np.rint(np.clip(values, 0, 1) * one) / one
    np.testing.assert_array_equal(device.download(storage), expected)


def stencil_of(device: OpenCLBackend, storage: Any) -> NDArray[np.uint8]:
    """The stencil of a depth-stencil storage, (height, width)."""
    stored = np.empty(storage.size[::-1], np.uint8)
    device.read(storage.stencil, stored)
    return stored


def test_targets_begin_with_zeros(device: OpenCLBackend) -> None:
    storage = device.make(FORMATS["depth32f_stencil8"], (9, 4))
    assert not device.download(storage).any()
    assert not stencil_of(device, storage).any()


def test_copies_are_equal_stencil_included(device: OpenCLBackend) -> None:
    made = FORMATS["depth32f_stencil8"]
    source, destination = device.make(made, (4, 3)), device.make(made, (4, 3))
    device.upload(source, np.full((3, 4, 1), 0.5, np.float32))
    device.fill(source.stencil, 12)
    device.write(source.stencil, np.arange(12, dtype=np.uint8))
    device.copy(source, destination)
    np.testing.assert_array_equal(device.download(destination), 0.5)
    np.testing.assert_array_equal(stencil_of(device, destination).ravel(), np.arange(12))


def test_a_picture_of_another_shape_is_refused(device: OpenCLBackend) -> None:
    with pytest.raises(
        InputError, match=r"shape \(2, 2, 4\) cannot go into rgba8 of 3x2 pixels; expected shape \(2, 3, 4\)"
    ):
        device.upload(device.make(FORMATS["rgba8"], (3, 2)), np.zeros((2, 2, 4), np.float32))


def test_what_does_not_fit_is_refused_before_it_is_made(device: OpenCLBackend) -> None:
    device.max_bytes = 1000
    with pytest.raises(BackendError, match=r"a target of 16x16 pixels rgba32f needs 4,096 bytes; .* at most 1,000"):
        device.make(FORMATS["rgba32f"], (16, 16))


def test_devices_lists_what_is_here(device: OpenCLBackend) -> None:
    listed = OpenCLBackend.devices()
    assert [one.missing for one in listed] == [""] * len(listed)
    assert device.device.name.strip() in [one.name for one in listed]


def test_a_device_is_chosen_by_number_or_name(device: OpenCLBackend) -> None:
    name = device.device.name.strip()
    for choice in ("0", name[:8].upper()):
        with OpenCLBackend(choice) as opened:
            assert opened.device == device.device


def test_an_unknown_device_is_refused_with_the_list(device: OpenCLBackend) -> None:
    with pytest.raises(DeviceMissingError, match=r"no OpenCL device 'abacus'; there are 0: "):
        OpenCLBackend("abacus")
    with pytest.raises(DeviceMissingError, match="no OpenCL device '99'"):
        OpenCLBackend("99")


def test_without_pyopencl_the_error_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyopencl", None)
    with pytest.raises(DeviceMissingError, match=r"pip install 'passgraph\[opencl\]'"):
        OpenCLBackend()
    (listed,) = OpenCLBackend.devices()
    assert backend.INSTALL_MODULE in listed.missing


def test_without_a_driver_the_error_says_how_to_install_one() -> None:
    require("opencl")
    code = "from passgraph.backends.opencl import OpenCLBackend as B; print(B.devices()[0].missing)"
    shown = python(code, OCL_ICD_VENDORS="/nonexistent", OPENCL_VENDOR_PATH="/nonexistent")
    assert backend.INSTALL_DRIVER in shown


def python(code: str, **environment: str) -> str:
    root = Path(__file__).resolve().parents[2]
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(root), **environment},
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_import_loads_no_driver() -> None:
    assert python("import passgraph.backends.opencl, sys; print('pyopencl' in sys.modules)").strip() == "False"


def test_close_gives_everything_back(device: OpenCLBackend) -> None:
    opened = OpenCLBackend()
    context = opened.context
    run_gray(opened)
    storage = opened.make(FORMATS["rgba16f"], (64, 64))
    assert opened.alive
    opened.close()
    opened.close()
    assert not opened.alive
    assert not opened.scratch
    assert storage.buffer is not None
    del storage
    gc.collect()
    # What is left is the reference that this test holds.
    assert context.reference_count == 1


def test_closed_programs_leave_nothing_in_an_open_backend(device: OpenCLBackend) -> None:
    run_gray(device)
    gc.collect()
    assert not device.alive


def test_dozens_of_backends_in_one_process() -> None:
    require("opencl")
    for _ in range(40):
        with OpenCLBackend() as opened:
            storage = opened.make(FORMATS["r8"], (4, 4))
            opened.upload(storage, np.ones((4, 4, 1), np.float32))
            assert opened.download(storage).min() == 1


def test_a_closed_backend_says_so(device: OpenCLBackend) -> None:
    device.close()
    with pytest.raises(BackendError, match="was closed"):
        device.make(FORMATS["r8"], (1, 1))


def test_one_source_is_built_once_in_a_process(device: OpenCLBackend) -> None:
    run_gray(device)
    run_gray(device)
    assert len(device.programs.built) == 1


def test_a_second_process_finds_compiled_code_in_the_cache_of_the_user(tmp_path: Path) -> None:
    require("opencl")
    code = f"""
import numpy as np, passgraph as pg, time
from passgraph.backends.opencl import OpenCLBackend
with OpenCLBackend() as device:
    program = pg.compile(pg.kernel(source={GRAY!r})(pg.Input("frame")), backend=device)
    program(frame=np.ones((64, 256, 4), np.float32))
    program.close()
"""

    def files() -> set[Path]:
        # PoCL notes the time of last use of a program, so only what was compiled counts.
        return {path for path in tmp_path.rglob("*") if path.suffix in (".so", ".bc") or path.name == "binary"}

    # PoCL looks at the first, pyopencl's own cache (used for other drivers) at the second.
    places = {"POCL_CACHE_DIR": str(tmp_path / "pocl"), "XDG_CACHE_HOME": str(tmp_path)}
    (tmp_path / "pocl").mkdir()
    python(code, **places)
    first = files()
    python(code, **places)
    assert first
    assert files() == first


def test_a_refused_build_names_the_kernel_line_and_repeats_the_driver() -> None:
    span = Span("effect.py", 12, 4, 9, "    a + b")
    error = build_error(Listing("int x;\nbroken\n", (span, span)), "pass 'glow'", "tmp.cl:2:1: error: unknown type")
    assert str(error).startswith("effect.py:12: the OpenCL driver refuses pass 'glow'")
    assert "unknown type" in str(error)


def test_a_build_that_fails_is_a_backend_error(device: OpenCLBackend, monkeypatch: pytest.MonkeyPatch) -> None:
    from passgraph.backends.opencl.opencl_c import SPELLED

    respelled(monkeypatch, SPELLED["float"], "mul", "no_such_function({0}, {1})")
    with pytest.raises(
        BackendError, match=r"kernel text>:1: the OpenCL driver refuses pass 'gray'(.|\n)*no_such_function"
    ):
        run_gray(device)
