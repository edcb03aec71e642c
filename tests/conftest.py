"""What every test may use: the backends that are here, one after another.

PASSGRAPH_EXPECT names devices that must be here (``gl,opencl,numpy``): a missing one fails, it does
not skip.
"""

from __future__ import annotations

import gc
import os
import shutil
from collections import Counter
from collections.abc import Generator, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any
from zlib import crc32

import pytest

from passgraph.backends.base import Backend
from passgraph.backends.registry import backend_class, open_backend
from passgraph.errors import PassgraphError
from passgraph.language.lowering.passes import CHECK_VARIABLE

# In this process and those that it starts.
os.environ[CHECK_VARIABLE] = "1"

#: Backends that are held against the reference.
DEVICES = ("gl", "opencl", "webgpu", "numpy")
#: The same for what numpy shows as well, and PoCL would compile dozens of programs for.
SLOW_ON_OPENCL = ("gl", pytest.param("opencl", marks=pytest.mark.slow), "webgpu", "numpy")
#: New objects after which Python looks for cycles among them: kernels are trees of many small ones that stay, and its
#: own 700 cost tests a twentieth of their time.
GARBAGE_AFTER = 20_000


#: Folders whose tests always run on webgpu.  Mesa's Vulkan and OpenGL drivers share a compiler and a rasterizer, so
#: beside the conformance suite, which holds each operation, state and effect, webgpu mostly adds time.
ALWAYS_ON_WEBGPU = ("backends", "conformance")

#: Tests of which parameters are collected.
_begun: set[tuple[Path, str]] = set()


def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark tests as slow that repeat, on another device, what the conformance suite holds there.

    So are tests with the parameter webgpu outside the folders above, and tests of effects with the parameters opencl
    and gl; and most parameters of tests with the marker sampled: the first and about a sixth of the others always run.
    """
    if not isinstance(item, pytest.Function) or not hasattr(item, "callspec"):
        return
    folder = item.path.parent.name
    names = {value.partition(":")[0] for value in item.callspec.params.values() if isinstance(value, str)}
    if ("webgpu" in names and folder not in ALWAYS_ON_WEBGPU) or (names & {"opencl", "gl"} and folder == "effects"):
        item.add_marker(pytest.mark.slow)
    elif item.get_closest_marker("sampled"):
        # By a hash: the choice is the same in each run, and no parameter, such as a backend, is always left out.
        test = item.path, item.originalname
        if test in _begun and crc32(item.name.encode()) % 6:
            item.add_marker(pytest.mark.slow)
        _begun.add(test)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test with the parameter backend needs that one."""
    if isinstance(item, pytest.Function) and hasattr(item, "callspec"):
        backend = item.callspec.params.get("backend")
        if isinstance(backend, str) and backend in DEVICES:
            require(backend)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What is collected lives as long as the run.

    Python's collector of cycles would walk these 700,000 objects again and again: a fifth of the time of tests that
    make many.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.set_threshold(GARBAGE_AFTER, *gc.get_threshold()[1:])
        gc.enable()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Count the skipped tests by the reason, which names what they need."""
    reasons = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in terminalreporter.getreports("skipped"))
    reasons.pop("all tests skipped by +SKIP option", None)  # doctest: examples that are never run
    if reasons:
        terminalreporter.section("skipped")
        for reason, count in reasons.most_common():
            terminalreporter.line(f"{count:4} {reason}")


def expected_devices() -> set[str]:
    return {name.strip() for name in os.environ.get("PASSGRAPH_EXPECT", "").split(",") if name.strip()}


def oclgrind(log: Path) -> tuple[str, ...]:
    """What stands before a command so that its OpenCL kernels run in a simulator, which writes into ``log`` which of
    them read or write outside of their buffers, or race."""
    found = shutil.which("oclgrind")
    if found is None:
        pytest.skip("oclgrind is not here: apt-get install oclgrind")
    return found, "--data-races", "--log", str(log)


@lru_cache
def why_missing(name: str) -> str:
    """Empty where a backend can be opened, else the reason that it gives."""
    try:
        devices = backend_class(name).devices()
    except PassgraphError as error:
        return str(error)
    if any(not device.missing for device in devices):
        if name == "opencl":
            _hold_opencl()
        return ""
    return devices[0].missing if devices else "it lists no device"


@lru_cache
def _hold_opencl() -> Any:
    """A context that nobody uses, for as long as the tests run.

    With its last context PoCL drops the library of functions that programs are linked with: each test that opens a
    backend of its own would wait 0.4 s while it is read again.
    """
    import pyopencl

    return pyopencl.create_some_context(interactive=False)


def require(name: str) -> None:
    """Skip, or fail where the environment expects the device."""
    reason = why_missing(name)
    if reason and name in expected_devices():
        pytest.fail(f"backend {name} is expected here and missing: {reason}", pytrace=False)
    if reason:
        pytest.skip(f"backend {name} is not here: {reason}")


def present_devices(*names: str) -> list[str]:
    """Return the devices that are here, of all or of ``names``; one that is expected and missing fails."""
    names = names or DEVICES
    for name in names:
        if name in expected_devices():
            require(name)
    return [name for name in names if not why_missing(name)]


@pytest.fixture(params=DEVICES)
def backend_name(request: pytest.FixtureRequest) -> str:
    """The name of each device backend, one test run apiece."""
    name: str = request.param
    require(name)
    return name


@pytest.fixture
def backend(backend_name: str) -> Iterator[Backend]:
    """Each device backend, opened; closed behind the test."""
    require(backend_name)  # a test may name its own
    with open_backend(backend_name) as opened:
        yield opened


@pytest.fixture
def reference() -> Iterator[Backend]:
    """The float64 interpreter that says what is right."""
    with open_backend("reference") as opened:
        yield opened
