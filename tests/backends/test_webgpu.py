"""The webgpu backend on a device: choosing one, formats, errors, and what is left behind."""

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

import passgraph as pg
from passgraph.backends.base import Block, DeviceInfo
from passgraph.backends.webgpu import WebGPUBackend, chromium, devices, programs, trusted, wgsl
from passgraph.errors import BackendError, DeviceMissingError
from passgraph.formats import FORMATS
from passgraph.graph.draw_state import Blend
from tests.backends.multiples import times
from tests.conftest import require
from tests.corners import placed
from tests.respelling import respelled

pytestmark = pytest.mark.webgpu

SIZE = (7, 5)
SCALED = pg.kernel(source="def scaled(c: Image, by: float) -> vec4: return c[0, 0] * by")
KERNELS = placed("""
def paint(corner: Corner) -> vec4:
    return vec4(0.25, 0.5, 0.75, 0.5)
""")
PLACE, PAINT = (pg.vertex(source=KERNELS, name="place"), pg.fragment(source=KERNELS, name="paint"))
WIDE = pg.Mesh.make([[-3, -1, 0.0], [1, -1, 0.0], [1, 3, 0.0]], [[0, 1, 2]])


@pytest.fixture
def opened() -> Iterator[WebGPUBackend]:
    require("webgpu")
    with WebGPUBackend() as backend:
        yield backend


def picture(channels: int = 4) -> Any:
    return np.random.default_rng(5).random((SIZE[1], SIZE[0], channels), np.float32)


def drawn(into: str = "rgba16f", depth: str | None = None, **state: Any) -> pg.Target:
    made: pg.Target = pg.draw(
        WIDE, vertex=PLACE, fragment=PAINT, into=pg.target("drawn", into, SIZE), name="mark",
        depth=None if depth is None else pg.target("depth", depth, SIZE), **state,
    )  # fmt: skip
    return made


# Choosing a device


def test_without_wgpu_the_error_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "wgpu", None)
    with pytest.raises(DeviceMissingError, match=r"needs wgpu .*pip install 'passgraph\[webgpu\]'"):
        WebGPUBackend()
    (missing,) = WebGPUBackend.devices()
    assert "pip install 'passgraph[webgpu]'" in missing.missing


def test_without_playwright_the_error_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "playwright.sync_api", None)
    with pytest.raises(DeviceMissingError, match=r"webgpu:chromium needs playwright .*pip install 'passgraph\[web\]'"):
        WebGPUBackend("chromium")
    monkeypatch.setattr(chromium, "find_spec", lambda name: None)
    assert "pip install 'passgraph[web]'" in chromium.device_info().missing


def test_chromium_is_listed_with_its_version_or_with_what_it_lacks(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("playwright")
    browser = tmp_path / "chromium"
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "no Chromium or Chrome on PATH; install one: " in chromium.device_info().missing
    browser.write_text("#!/bin/sh\n[ $1 = --version ] && echo 'Chromium 1.2 '")
    browser.chmod(0o755)
    assert chromium.device_info() == DeviceInfo("SwiftShader in headless Chromium", str(browser), "Chromium 1.2")
    browser.write_text("#!/bin/sh\nexit 3")
    assert f"{browser} cannot be started: " in chromium.device_info().missing


def test_without_a_driver_the_error_says_how_to_install_one(monkeypatch: pytest.MonkeyPatch) -> None:
    require("webgpu")
    import wgpu

    layered = [adapter for adapter in wgpu.gpu.enumerate_adapters_sync() if adapter.info["backend_type"] == "OpenGL"]
    monkeypatch.setattr(type(wgpu.gpu), "enumerate_adapters_sync", lambda self: layered)
    with pytest.raises(DeviceMissingError, match=r"no Vulkan, Metal or Direct3D 12 driver.*mesa-vulkan-drivers"):
        WebGPUBackend()


def test_a_device_is_chosen_by_number_or_a_part_of_its_name() -> None:
    require("webgpu")
    first = WebGPUBackend.devices()[0]
    for device in (None, "0", first.name[:6].upper()):
        with WebGPUBackend(device) as backend:
            assert backend.device_name == first.name
    with pytest.raises(DeviceMissingError, match=r"no WebGPU device '99'; there are 0: "):
        WebGPUBackend("99")


# Kernels


def test_an_error_of_the_compiler_names_the_line_of_the_kernel(
    opened: WebGPUBackend, monkeypatch: pytest.MonkeyPatch
) -> None:
    respelled(monkeypatch, wgsl.WGSL.spelled["float"], "sqrt", "no_such_function({0})")
    rooted = pg.kernel(source="def rooted(c: Image) -> float:\n    d = c[0, 0].r + 1.0\n    return sqrt(d)")
    with pytest.raises(BackendError, match=r"3: WebGPU refuses kernel rooted: .*no_such_function(.|\n)*return sqrt"):
        pg.compile(rooted(pg.Input("c", "r32f", SIZE)), backend=opened)


def test_loops_give_the_same_with_wgpus_count_of_trips(opened: WebGPUBackend, monkeypatch: pytest.MonkeyPatch) -> None:
    looped = pg.kernel(
        source="def looped(c: Image, n: int) -> float:\n    x = c[0, 0].r\n    for i in range(40):\n"
        "        if i >= n: break\n        x = x * 0.5 + 0.25\n    return x"
    )(pg.Input("c", "r32f", SIZE), pg.Value("n", int))
    results = []
    for kept in (True, False):
        if not kept:
            opened.programs.cached.clear()
            monkeypatch.setattr(programs, "trusted_module", lambda device, code: None)
        with pg.compile(looped, backend=opened) as program:
            results.append(program(c=picture(1), n=11)["looped"])
    np.testing.assert_array_equal(*results)


def test_where_wgpu_has_no_such_call_no_module_is_made(opened: WebGPUBackend, monkeypatch: pytest.MonkeyPatch) -> None:
    import wgpu.backends.wgpu_native

    assert trusted.trusted_module(opened.device, wgsl.FULLSCREEN) is not None
    monkeypatch.setattr(wgpu.backends.wgpu_native, "lib", object())
    assert trusted.trusted_module(opened.device, wgsl.FULLSCREEN) is None


def test_a_pass_that_runs_twice_in_one_submission_keeps_both_values(opened: WebGPUBackend) -> None:
    target = SCALED(pg.Input("c", "rgba32f", SIZE), pg.Value("by", float))
    with pg.compile(target, backend="null") as program:
        (step,) = program.plan.steps
    made = [opened.make(FORMATS["rgba32f"], SIZE) for _ in range(3)]
    opened.upload(made[0], picture())
    run = opened.pixel_pass(step)
    with opened.running():
        for storage, by in zip(made[1:], (2.0, 3.0), strict=True):
            run([storage], [made[0]], Block(np.array([by], np.float32), np.zeros(1, np.int32)))
    np.testing.assert_array_equal(opened.download(made[1]), picture() * np.float32(2))
    np.testing.assert_array_equal(opened.download(made[2]), picture() * np.float32(3))


# Formats


@pytest.mark.parametrize("name", [name for name, format_ in FORMATS.items() if format_.number == "u2"])
def test_16_bits_stored_wider_give_the_same(opened: WebGPUBackend, name: str) -> None:
    channels = FORMATS[name].channels
    letters, type_ = "rgba"[:channels], "float" if channels == 1 else f"vec{channels}"
    kernel = pg.kernel(source=f"def half(c: Image) -> {type_}: return c[1, 0].{letters} * 0.5")
    target = kernel(pg.Input("c", name, SIZE), into=pg.target("half", name))
    results = []
    for draws in (opened.draws_norm16, False):
        opened.draws_norm16 = draws
        for stored in ("float32", "stored"):
            with pg.compile(target, backend=opened, results=stored) as program:
                results.append(program(c=picture(channels))["half"])
    np.testing.assert_array_equal(results[0], results[2])
    np.testing.assert_array_equal(results[1], results[3])
    assert results[1].dtype == np.uint16


def test_blending_that_the_device_lacks_is_an_error(opened: WebGPUBackend) -> None:
    opened.draws_norm16 = False
    if "texture-formats-tier1" in opened.device.features:
        pytest.skip("the device blends 16-bit fractions")
    with pytest.raises(BackendError, match=r"draw 'mark' blends into rgba16, .*feature texture-formats-tier1"):
        pg.compile(drawn("rgba16", blend=Blend("one", "one")), backend=opened)


def test_a_part_of_a_unit_of_polygon_offset_is_an_error(opened: WebGPUBackend) -> None:
    with pytest.raises(BackendError, match=r"draw 'mark' has a polygon offset of 1.5 units; .*round it"):
        pg.compile(drawn(depth="depth32f", polygon_offset=(0.0, 1.5)), backend=opened)


@pytest.mark.parametrize("name", ["depth32f", "depth32f_stencil8"])
def test_depth_is_kept_when_it_is_uploaded_copied_and_drawn_over(opened: WebGPUBackend, name: str) -> None:
    depth = picture(1)
    first, second = (opened.make(FORMATS[name], SIZE) for _ in range(2))
    np.testing.assert_array_equal(opened.download(first), 0)
    opened.upload(first, depth)
    np.testing.assert_array_equal(opened.download(first), depth)
    opened.copy(first, second)
    np.testing.assert_array_equal(opened.download(second), depth)
    with pg.compile(drawn(depth=name, depth_compare="less"), backend="null") as program:
        (step,) = program.plan.steps
    object.__setattr__(step, "depth_clear", None)
    opened.upload(second, depth)
    color = opened.make(FORMATS["rgba16f"], SIZE)
    empty = Block(np.zeros(1, np.float32), np.zeros(1, np.int32))
    opened.draw_pass(step)([color], second, [], opened.geometry(WIDE), empty, empty)
    np.testing.assert_array_equal(opened.download(second), np.minimum(depth, np.float32(0.5)))
    np.testing.assert_array_equal(opened.download(color)[..., 3] > 0, depth[..., 0] > 0.5)


@pytest.mark.parametrize("compare", ["never", "less", "equal", "less_equal", "greater", "not_equal", "greater_equal"])
def test_a_stencil_test_of_empty_masks_is_made(opened: WebGPUBackend, compare: str) -> None:
    stencil = pg.Stencil(compare, reference=3, read_mask=0, write_mask=0)
    with pg.compile(drawn(depth="depth32f_stencil8", stencil=stencil), backend=opened) as program:
        passes = program()["drawn"][..., 3] > 0
    np.testing.assert_array_equal(passes, compare in ("equal", "less_equal", "greater_equal"))


# Closing


def test_nothing_is_alive_after_close() -> None:
    require("webgpu")
    import wgpu

    def alive() -> dict[str, int]:
        gc.collect()
        found = wgpu.diagnostics.object_counts.get_dict()
        return {name: counts["count"] for name, counts in found.items() if counts.get("count")}

    before = alive()
    program = pg.compile(SCALED(drawn(depth="depth32f_stencil8"), pg.Value("by", float)), backend="webgpu")
    program(by=2.0)
    assert alive() != before
    program.close()
    assert alive() == before


def test_objects_for_sources_that_no_longer_come_are_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    """And a program whose own were dropped goes on."""
    monkeypatch.setattr(programs, "MOST_CACHED", 5)
    ones = np.ones((2, 2, 4), np.float32)
    with WebGPUBackend() as backend, pg.compile(times(2), backend=backend) as first:
        for factor in range(3, 9):
            with pg.compile(times(factor), backend=backend) as program:
                assert program(color=ones)["times"][0, 0, 0] == factor
            assert first(color=ones)["times"][0, 0, 0] == 2
        assert len(backend.programs.cached) == 5
        # Those in use are found again, and the others are gone.
        pipelines = [key for key in backend.programs.made if key[0] == "pixel"]
        assert len(pipelines) == 1 + sum(key[0] == "pixel" for key in backend.programs.cached)
        monkeypatch.setattr(programs.Programs, "pipeline", None)
        with pg.compile(times(2), backend=backend) as again:
            assert again(color=ones)["times"][0, 0, 0] == 2


def test_a_closed_backend_may_be_closed_again_and_refuses_work(opened: WebGPUBackend) -> None:
    storage = opened.make(FORMATS["r8"], SIZE)
    opened.close()
    opened.close()
    opened.release(storage)
    for use in (lambda: opened.make(FORMATS["r8"], SIZE), lambda: opened.download(storage)):
        with pytest.raises(BackendError, match="this webgpu backend was closed"):
            use()


def test_adapters_over_opengl_are_listed_alone_where_they_are_wanted_and_else_not() -> None:
    require("webgpu")
    assert all(adapter.info["backend_type"] != "OpenGL" for adapter in devices.all_adapters())
    names = (
        "from passgraph.backends.webgpu import WebGPUBackend; "
        "print(*{info.version for info in WebGPUBackend.devices()})"
    )
    environment = {**os.environ, "WGPU_BACKEND_TYPE": "OpenGL"}
    listed = subprocess.run([sys.executable, "-c", names], capture_output=True, text=True, check=True, env=environment)
    assert listed.stdout.strip() == "OpenGL"


# Constant tables


@pytest.mark.parametrize(
    "lengths",
    [
        (3, 5, 7),
        (1024, 1024, 1024),
        (*(1024,) * 15, 16, 1008),  # more than a uniform buffer holds: the one of 16 stays a variable
    ],
)
def test_tables_with_computed_indices_hold_their_numbers(opened: WebGPUBackend, lengths: tuple[int, ...]) -> None:
    """Floats, ints and bools in turns; the floats of the smallest table have an infinity and a denormal."""
    rng = np.random.default_rng(7)
    tables: list[Any] = [rng.integers(-9, 9, length) for length in lengths]
    for number in range(0, len(tables), 3):
        tables[number] = tables[number] + 0.25
    tables[15 if len(tables) > 15 else 0][:2] = np.inf, 2.0**-140
    for number in range(2, len(tables), 3):
        tables[number] = tables[number] > 0
    text, terms = "", []
    for number, table in enumerate(tables):
        text += f"T{number} = ({', '.join('1e999' if v == np.inf else repr(v) for v in table.tolist())})\n"
        entry = f"T{number}[int(at * {len(table)}.0)]"
        terms.append(f"(1.0 if {entry} else 0.0)" if table.dtype == bool else f"float({entry})")
    text += f"def looked(c: Image) -> float:\n    at = c[0, 0].r\n    return {' + '.join(terms)}"
    at = rng.random((24, 32), np.float32)
    with pg.compile(pg.kernel(source=text)(pg.Input("c", "r32f", (32, 24))), opened) as program:
        found = program(c=at)["looked"][..., 0]
    chosen = [table[(at * np.float32(len(table))).astype(int)].astype(np.float32) for table in tables]
    np.testing.assert_array_equal(found, sum(chosen[1:], chosen[0]))


#: Parses of types by wgpu while a program opens a device, draws and reads back; and whether memoized types are right.
PARSES = """
import numpy as np, passgraph as pg
from wgpu.backends.wgpu_native import _ffi
parsed, parse = [], _ffi.ffi._parser.parse_type
_ffi.ffi._parser.parse_type = lambda text: (parsed.append(text), parse(text))[1]
double = pg.kernel(source="def double(c: Image) -> vec4: return c[0, 0] * 2.0")
with pg.compile(double(pg.Input("c", "rgba32f")), backend="webgpu") as program:
    program(c=np.zeros((4, 4, 4), np.float32))
known = {name: given[0] for name, given in _ffi.ffi._parsed_types.items() if name.startswith("WGPU")}
fresh = _ffi.FFI()
fresh.cdef(_ffi.get_wgpu_header())
for name in sorted(known)[::40]:
    same = fresh.typeof(name)
    assert (known[name].kind, known[name].cname) == (same.kind, same.cname), name
    if same.kind == "pointer" and same.item.kind == "struct":
        fields = [[(field, where.offset) for field, where in one.item.fields or ()] for one in (known[name], same)]
        assert fields[0] == fields[1], name
print([text for text in parsed if text.startswith("WGPU") and not text.endswith(" ")])
"""


def test_types_of_wgpu_are_parsed_together() -> None:
    made = subprocess.run([sys.executable, "-c", PARSES], capture_output=True, text=True, timeout=300)
    assert made.stdout.strip() == "[]", made.stdout + made.stderr
