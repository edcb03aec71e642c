"""Contexts of the gl backend: opened, shared with others, closed without a trace."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import moderngl
import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.gl import GLBackend, context, programs
from passgraph.backends.gl.glsl import GLSL
from passgraph.errors import BackendError, DeviceMissingError
from passgraph.formats import FORMATS
from passgraph.language import scalar as s
from tests.backends.multiples import times
from tests.offscreen import offscreen
from tests.respelling import without_kept_sources

pytestmark = pytest.mark.gl

DOUBLE = "def double(color: Image, k: float = 2.0) -> vec4:\n    c = color[0, 0]\n    return c * k"


def doubled() -> pg.Target:
    into = pg.target("double", format="rgba32f")
    return pg.kernel(source=DOUBLE)(pg.Input("color"), into=into)  # type: ignore[no-any-return]


def test_importing_the_backend_loads_no_driver() -> None:
    code = "import sys, passgraph.backends.gl; print('moderngl' in sys.modules, 'glcontext' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


def test_devices_are_named() -> None:
    first = GLBackend.devices()[0]
    assert first.name and first.version and not first.missing


def test_devices_say_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "glcontext", None)
    assert "pip install 'passgraph[gl]'" in GLBackend.devices()[0].missing


def test_a_missing_module_names_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "glcontext", None)
    with pytest.raises(DeviceMissingError, match=r"pip install 'passgraph\[gl\]'"):
        GLBackend()


def test_a_missing_device_names_the_command() -> None:
    with pytest.raises(DeviceMissingError, match="apt-get install libegl1 libgl1-mesa-dri libgles2 libgl1"):
        GLBackend("15")


def test_a_device_is_found_by_a_part_of_its_name() -> None:
    name = GLBackend.devices()[0].name
    GLBackend(name[:5].lower()).close()
    with pytest.raises(DeviceMissingError, match="there is no OpenGL device 'voodoo'"):
        GLBackend("voodoo")


def test_many_backends_open_and_close_in_one_process() -> None:
    opened = [GLBackend() for _ in range(12)]
    for backend in opened[::2]:
        backend.close()
    for backend in opened[1::2]:
        storage = backend.make(FORMATS["r8"], (2, 2))
        assert not backend.download(storage).any()
        backend.close()


def test_closing_leaves_no_object_alive() -> None:
    backend = GLBackend()
    with pg.compile(doubled(), backend=backend) as program:
        program(color=np.ones((2, 2, 4), np.float32))
        made = set(backend.objects.alive)
        assert {kind for kind, _ in made} >= {"Program", "VertexArray", "Texture", "Framebuffer"}
    with backend.context as gl:
        backend.objects.delete_all()
        assert not [(kind, name) for kind, name in made if getattr(gl, f"Is{kind}")(name)]
    backend.close()
    assert not backend.objects.alive


def test_a_released_storage_is_gone() -> None:
    with GLBackend() as backend:
        before = set(backend.objects.alive)
        storage = backend.make(FORMATS["rgba32f"], (4, 4))
        backend.release(storage)
        assert backend.objects.alive == before
        with backend.context as gl:
            assert not gl.IsTexture(storage.name)


def test_closing_twice_is_allowed() -> None:
    backend = GLBackend()
    backend.close()
    backend.close()


def test_another_context_stays_current_and_unharmed() -> None:
    with offscreen() as other:
        texture = other.texture((2, 2), 4, np.arange(16, dtype=np.float32).tobytes(), dtype="f4")
        with pg.compile(doubled(), backend="gl") as program:
            program(color=np.ones((2, 2, 4), np.float32))
            assert np.frombuffer(texture.read(), np.float32).tolist() == list(range(16))
        assert np.frombuffer(texture.read(), np.float32).tolist() == list(range(16))
        assert other.error == "GL_NO_ERROR"
        assert moderngl.get_context() is other


def test_equal_kernels_share_a_program() -> None:
    with GLBackend() as backend:
        for _ in range(2):
            with pg.compile(doubled(), backend=backend) as program:
                program(color=np.ones((2, 2, 4), np.float32))
        assert len(backend.programs.made) == 1


def test_programs_of_sources_that_no_longer_come_are_deleted(monkeypatch: pytest.MonkeyPatch) -> None:
    """And those in use are not, however many others come: their names would go to these."""
    monkeypatch.setattr("passgraph.backends.gl.programs.MOST_KEPT", 3)
    ones = np.ones((2, 2, 4), np.float32)
    with GLBackend() as backend, pg.compile(times(2), backend=backend) as first:
        for factor in range(3, 12):
            with pg.compile(times(factor), backend=backend) as program:
                assert program(color=ones)["times"][0, 0, 0] == factor
            assert first(color=ones)["times"][0, 0, 0] == 2
        assert len([kind for kind, _ in backend.objects.alive if kind == "Program"]) <= 1 + 3 + 1
        assert len(backend.programs.made) == 1 + 3


def test_uniforms_are_sent_again_when_they_change() -> None:
    value = pg.Value("k", float)
    target = pg.kernel(source=DOUBLE)(pg.Input("color"), value, into=pg.target("double", format="rgba32f"))
    with pg.compile(target, backend="gl") as program:
        picture = np.ones((1, 1, 4), np.float32)
        assert [program(color=picture, k=k)["double"][0, 0, 0] for k in (2.0, 3.0, 3.0)] == [2.0, 3.0, 3.0]


def test_a_refused_shader_points_to_the_kernel_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def nonsense(self: GLSL, op: s.Op, arguments: list[str]) -> str:
        return "no_such_function()"

    without_kept_sources(monkeypatch)
    monkeypatch.setattr(GLSL, "operation", nonsense)
    with pytest.raises(BackendError) as caught, pg.compile(doubled(), backend="gl") as program:
        program(color=np.ones((2, 2, 4), np.float32))
    text = str(caught.value)
    assert "<kernel text>:3: the OpenGL driver refuses kernel double" in text
    assert "no_such_function" in text and "return c * k" in text


@pytest.mark.parametrize(
    "log",
    [
        "0:12(5): error: `x' undeclared",
        "0(12) : error C1503: undefined variable",
        "ERROR: 0:12: 'x' : undeclared identifier",
    ],
)
def test_lines_are_read_from_every_drivers_message(log: str) -> None:
    found = programs._LINE.search(log)
    assert found is not None and found.group(1) == "12"


def test_too_many_parameters_are_refused() -> None:
    lines = [f"w{i}: Array[float, 1024]" for i in range(20)]
    total = " + ".join(f"w{i}[0]" for i in range(20))
    kernel = pg.kernel(source=f"def many(color: Image, {', '.join(lines)}) -> float:\n    return {total}")
    named = {f"w{i}": [0.0] * 1024 for i in range(20)}
    target = kernel(pg.Input("color"), **named)
    with pytest.raises(
        BackendError, match=r"pass 'many' has 20480 numbers as parameters of kernel many; gl \(.+\) takes"
    ):
        pg.compile(target, backend="gl")(color=np.ones((2, 2, 4), np.float32))


def test_the_context_module_names_the_install_commands() -> None:
    assert context.INSTALL == "pip install 'passgraph[gl]'"
    assert context.INSTALL_DRIVER == "apt-get install libegl1 libgl1-mesa-dri libgles2 libgl1"


@pg.kernel
def three(color: pg.Image) -> tuple[float, float, float]:
    return color[0, 0].r, color[0, 0].g, color[0, 0].b


def test_more_targets_than_the_device_has_are_refused() -> None:
    into = tuple(pg.target(name, format="r32f") for name in "abc")
    targets = three(pg.Input("color"), into=into)
    with GLBackend() as backend:
        backend.limits = replace(backend.limits, targets=2)
        with pytest.raises(BackendError, match=r"pass 'a\+b\+c' writes 3 targets; gl \(.+\) takes 2 in one pass"):
            pg.compile(list(targets), backend=backend)(color=np.ones((2, 2, 4), np.float32))
