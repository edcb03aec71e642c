"""Parameters and bindings reach a device only when they change."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.opencl import raster
from tests.conftest import require

SIZE = (40, 24)
KERNELS = """
class Corner:
    position: vec4

def place(vertex: Vertex, shift: float) -> Corner:
    return Corner(vec4(vertex.position.xy, shift, 1.0))

def paint(corner: Corner, colour: float) -> vec4:
    return vec4(colour)
"""
TIMES = pg.kernel(
    source="def times(c: Image, by: float, weights: Array[float, 6]) -> vec4: return c[0, 0] * by * weights[3]"
)
PLACE, PAINT = (pg.vertex(source=KERNELS, name="place"), pg.fragment(source=KERNELS, name="paint"))


def graph() -> pg.Target:
    """A draw and a pass over it, each with a value of its own that changes and others that do not."""
    mesh = pg.Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    drawn = pg.draw(mesh, vertex=PLACE, fragment=PAINT, into=pg.target("drawn", "rgba32f", SIZE, clear=0.5),
                    shift=0.25, colour=pg.Value("colour", float))  # fmt: skip
    made: pg.Target = TIMES(drawn, pg.Value("by", float), [1.0] * 6, into=pg.target("out", "rgba32f", SIZE))
    return made


class CountedFunctions:
    """A table of OpenGL functions that counts what is called."""

    def __init__(self, inner: Any) -> None:
        self.inner, self.calls = inner, Counter[str]()

    def __getattr__(self, name: str) -> Any:
        called = getattr(self.inner, name)
        if not callable(called):
            return called

        def count(*given: Any) -> Any:
            self.calls[name] += 1
            return called(*given)

        return count


@contextmanager
def gl_program() -> Iterator[tuple[pg.Program, CountedFunctions]]:
    from passgraph.backends.gl import GLBackend

    require("gl")
    with GLBackend() as backend, pg.compile(graph(), backend=backend) as program:
        program.run(colour=0.5, by=1.0)
        counted = CountedFunctions(backend.context.gl)
        backend.context.gl = counted  # type: ignore[assignment]
        backend.objects.gl = counted  # type: ignore[assignment]
        yield program, counted


def uniforms(calls: Counter[str]) -> int:
    return sum(count for name, count in calls.items() if name.startswith("Uniform"))


@pytest.mark.gl
def test_gl_sends_no_uniform_that_has_not_changed() -> None:
    with gl_program() as (program, counted):
        program.run(colour=0.5, by=1.0)
        assert counted.calls["DrawElements"] == counted.calls["DrawArrays"] == 1
        assert uniforms(counted.calls) == 0


@pytest.mark.gl
def test_gl_sends_the_one_block_that_has_changed() -> None:
    with gl_program() as (program, counted):
        program.run(colour=0.5, by=2.0)
        assert uniforms(counted.calls) == 1
        program.run(colour=0.75, by=2.0)
        assert uniforms(counted.calls) == 2
        np.testing.assert_array_equal(program.read()["out"].max(), 1.5)


@pytest.mark.gl
def test_gl_uploads_meshes_and_makes_framebuffers_once() -> None:
    with gl_program() as (program, counted):
        program.run(colour=0.25, by=1.0)
        for name in ("BufferData", "GenFramebuffers", "TexImage2D", "TexSubImage2D", "CompileShader"):
            assert counted.calls[name] == 0, name


@pytest.mark.opencl
def test_opencl_writes_no_parameter_and_sets_no_argument_that_has_not_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    from passgraph.backends.opencl import OpenCLBackend
    from passgraph.backends.opencl.pixel import Launch, Uniforms

    require("opencl")
    calls: Counter[str] = Counter()
    written: list[bytes] = []
    write, same, bind = OpenCLBackend.write, raster.DrawPassRunner.bind, Launch.bind

    def counted_bind(self: raster.DrawPassRunner, kernel: Any, arguments: Any) -> None:
        held = self.bound.get(id(kernel))
        same(self, kernel, arguments)
        calls["draw arguments"] += self.bound[id(kernel)] is not held

    def counted_write(self: OpenCLBackend, buffer: Any, array: Any) -> Any:
        if any(buffer is own for runner in made for own in runner.buffers):
            written.append(array.tobytes())
        return write(self, buffer, array)

    made: list[Uniforms] = []
    initialise = Uniforms.__init__

    def remembered(self: Uniforms, *given: Any) -> None:
        initialise(self, *given)
        made.append(self)

    def counted_launch(self: Launch, buffers: Any) -> None:
        calls["pass arguments"] += 1
        bind(self, buffers)

    monkeypatch.setattr(Uniforms, "__init__", remembered)
    monkeypatch.setattr(OpenCLBackend, "write", counted_write)
    monkeypatch.setattr(raster.DrawPassRunner, "bind", counted_bind)
    monkeypatch.setattr(Launch, "bind", counted_launch)
    with OpenCLBackend() as backend, pg.compile(graph(), backend=backend) as program:
        program.run(colour=0.5, by=1.0)
        assert calls["draw arguments"] >= 6  # kernels of a draw
        assert calls["pass arguments"] >= 1
        calls.clear()
        written.clear()
        program.run(colour=0.5, by=1.0)
        assert not written
        program.run(colour=0.75, by=1.0)
        assert written == [np.float32(0.75).tobytes()]
        program.run(colour=0.75, by=2.0)
        assert len(written) == 2
        assert calls["pass arguments"] == calls["draw arguments"] == 0
        assert program.read()["out"].max() == 1.5
