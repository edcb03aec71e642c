"""The gles backend: OpenGL ES in a context of its own, compared with the reference and desktop OpenGL."""

from __future__ import annotations

import ctypes.util
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.base import SNAP_PX, Backend
from passgraph.backends.gl import GLBackend, context
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.es import EGL_VARIABLE, GLESBackend
from passgraph.backends.registry import compared_backends, open_backend
from passgraph.effects import soft_shadow
from passgraph.errors import BackendError, DeviceMissingError
from passgraph.formats import FORMATS
from passgraph.verify.compare import compare
from passgraph.verify.conformance import Case
from tests.conformance.choice import CASES, assert_all_conform, first_of_each
from tests.conftest import require
from tests.offscreen import offscreen
from tests.test_threads import expected, picture, shared_graph

pytestmark = pytest.mark.gl
#: The tests of this file that also run with older versions of OpenGL ES.
ANY_VERSION = "conforms or scene or histogram"


@pytest.fixture(autouse=True)
def _needs_it() -> None:
    require("gles")


@pytest.fixture(scope="module")
def devices() -> Iterator[list[Backend]]:
    with open_backend("reference") as reference, open_backend("gles") as device:
        yield [reference, device]


@pytest.mark.sampled
@pytest.mark.parametrize("case", first_of_each(), ids=lambda case: case.id)
def test_a_case_conforms(case: Case, devices: list[Backend]) -> None:
    assert_all_conform(case, devices)


@pytest.mark.slow
@pytest.mark.parametrize("case", [case for case in CASES if case.quick], ids=lambda case: case.id)
def test_every_quick_case_conforms(case: Case, devices: list[Backend]) -> None:
    assert_all_conform(case, devices)


@pytest.mark.slow
def test_the_shipped_scene_is_within_its_bounds_on_each_driver() -> None:
    scene = pg.Scene.shipped()
    report = compare(
        soft_shadow(scene), ["numpy", "gl", "gles"], size=(48, 32), camera=scene.camera, light=scene.lights[0]
    )
    assert report.within_bounds, [str(verdict) for verdict in report.faults]


def test_its_context_is_of_opengl_es_and_its_messages_name_it() -> None:
    with GLESBackend() as backend:
        assert backend.device_info().version.startswith("OpenGL ES 3") and backend.limits.device.startswith("gles (")
        with pytest.raises(BackendError, match=r"^gles: a r8 target of 70000 x 1 .* is too large"):
            backend.make(FORMATS["r8"], (70_000, 1))
        storage = backend.make(FORMATS["r8"], (2, 2))
        with backend.context as gl:
            gl.Enable(0)
            with pytest.raises(BackendError, match=r"^gles: invalid enum while running it"):
                gl.check("running it")
    with pytest.raises(BackendError, match=r"^this gles backend was closed; open another one$"):
        backend.download(storage)


def test_corners_lie_on_the_drivers_own_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of SwiftShader below ANGLE it has steps of 1/16 pixel; Mesa's rasterizer has those of the rules."""
    with GLESBackend() as backend:
        assert backend.corner_px == SNAP_PX
    told = g.Functions.integer
    monkeypatch.setattr(g.Functions, "integer", lambda gl, what: 4 if what == 0x0D50 else told(gl, what))
    with GLESBackend() as backend:
        assert backend.corner_px == 1 / 16


def test_it_needs_no_package() -> None:
    """moderngl and glcontext have no wheels for Linux on ARM."""
    code = (
        "import sys\nsys.modules['glcontext'] = sys.modules['moderngl'] = None\nimport passgraph as pg\n"
        "half = pg.kernel(source='def half(c: Image) -> vec4: return c[0, 0] * 0.5')(pg.Input('frame', size=(2, 2)))\n"
        "with pg.compile(half, 'gles') as program: print(program(frame=[[[1.0] * 4] * 2] * 2)['half'].sum())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.split() == ["8.0"], done.stderr


def test_another_programs_context_and_api_stay_current() -> None:
    """The API that a thread has bound decides which contexts EGL makes there; its default is OpenGL ES."""
    with offscreen() as host:
        current = context.Current()
        egl, before = current.egl, current.state()
        assert egl is not None
        api = egl.query_api()
        texture = host.texture((2, 2), 4, bytes(range(16)))
        with pg.compile(shared_graph(), backend="gles") as program:
            assert (current.state(), egl.query_api()) == (before, api)
            np.testing.assert_array_equal(program(frame=picture(1), by=3.0)["out"], expected(picture(1), 3.0))
        assert (current.state(), egl.query_api()) == (before, api)
        assert texture.read() == bytes(range(16)) and host.error == "GL_NO_ERROR"


def test_it_and_desktop_opengl_take_turns_in_one_thread() -> None:
    frame = picture(1)
    with pg.compile(shared_graph(), "gl") as one, pg.compile(shared_graph(), "gles") as other:
        for by in (2.0, 3.0):
            for program in (one, other):
                np.testing.assert_array_equal(program(frame=frame, by=by)["out"], expected(frame, by))


def test_it_is_compared_only_if_it_is_named() -> None:
    assert "gl" in compared_backends() and "gles" not in compared_backends()


def test_a_histogram_is_counted_by_a_compute_shader() -> None:
    frame = np.random.default_rng(1).integers(0, 256, (40, 33, 1)).astype(np.uint8)
    with pg.compile(pg.histogram(pg.Input("frame", "r8"), name="counts"), backend="gles") as program:
        counts = program(frame=frame)["counts"].ravel()
        assert isinstance(program.backend, GLBackend)
        with program.backend.context as gl:
            assert ("compute shader" in program.explain()) == (gl.has.version >= (3, 1))
    np.testing.assert_array_equal(counts, np.bincount(frame.ravel(), minlength=256))


def test_a_format_that_a_driver_lacks_is_unsupported_in_the_suite() -> None:
    cases = [word for name in ("pictures/r8 7x5 clamp", "pictures/r16 7x5 clamp") for word in ("--only", name)]
    command = [sys.executable, "-m", "passgraph", "conform", "--backend", "gles", *cases]
    told = {"MESA_EXTENSION_OVERRIDE": "-GL_EXT_texture_norm16"}
    done = subprocess.run(command, env={**os.environ, **told}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "r16; gles (" in done.stdout and "takes GL_EXT_texture_norm16" in done.stdout
    assert done.stdout.splitlines()[-1] == "gles: 1 passed, 1 unsupported"


# Devices and libraries


def test_a_missing_device_names_the_command_and_the_variable() -> None:
    expected_text = rf"^gles: there is no OpenGL ES device 15; install a driver: apt-get .*; or .* in {EGL_VARIABLE}$"
    with pytest.raises(DeviceMissingError, match=expected_text):
        GLESBackend("15")
    with pytest.raises(DeviceMissingError, match="there is no OpenGL ES device 'voodoo'"):
        GLESBackend("voodoo")


def test_without_egl_the_backend_is_listed_as_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("passgraph.backends.gl.es.library", lambda name: None)
    assert "there is no OpenGL ES device 0" in GLESBackend.devices()[0].missing


def test_another_egl_library_adds_its_devices(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    own = len(GLESBackend.devices())
    monkeypatch.setenv(EGL_VARIABLE, str(ctypes.util.find_library("EGL")))
    assert len(GLESBackend.devices()) == 2 * own
    with pg.compile(shared_graph(), backend=f"gles:{own}") as program:
        np.testing.assert_array_equal(program(frame=picture(1), by=3.0)["out"], expected(picture(1), 3.0))
    (tmp_path / "libEGL.so").write_text("no library")
    monkeypatch.setenv(EGL_VARIABLE, str(tmp_path / "libEGL.so"))
    GLESBackend().close()  # the first device is the system's
    with pytest.raises(
        DeviceMissingError, match=rf"^gles: the EGL library .*: {tmp_path}/libEGL.so: file too short; set"
    ):
        GLESBackend(str(own))


def test_angle_computes_passes_as_the_reference() -> None:
    """Draws lie on its device's grid, and its GLSL has no `precise`."""
    if "angle" not in " ".join(device.name.lower() for device in GLESBackend.devices()):
        pytest.skip(f"ANGLE is not here: set {EGL_VARIABLE} to its EGL library")
    with open_backend("reference") as reference, GLESBackend("angle") as angle:
        for case in first_of_each():
            if case.group in ("operations", "pictures", "plans"):
                assert_all_conform(case, [reference, angle])


@pytest.mark.slow
@pytest.mark.skipif("MESA_GLES_VERSION_OVERRIDE" in os.environ, reason="this is that other process")
@pytest.mark.parametrize(("version", "extensions"), [("3.0", "-GL_OES_texture_float_linear"), ("3.1", "")])
def test_older_versions_conform(version: str, extensions: str) -> None:
    told = {"MESA_GLES_VERSION_OVERRIDE": version, "MESA_EXTENSION_OVERRIDE": extensions}
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-p",
        "no:cacheprovider",
        "-m",
        "not slow",
        "-k",
        ANY_VERSION,
    ]
    done = subprocess.run([*command, __file__], env={**os.environ, **told}, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout[-3000:]
