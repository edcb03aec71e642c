"""Running: history, static work, values, inputs bound anew, and what is given back."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import passgraph as pg
from passgraph import Image, vec4
from passgraph.backends.base import Backend
from passgraph.backends.null import NullBackend
from passgraph.backends.registry import open_backend
from passgraph.errors import BackendError
from passgraph.formats import Format
from tests.corners import placed

copy = pg.kernel(source="def copy(color: Image) -> vec4: return color[0, 0]")
left = pg.kernel(source="def left(color: Image) -> vec4: return color[-1, 0]")
add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] + b[0, 0]")
fade = pg.kernel(source="def fade(a: Image, b: Image) -> vec4: return (a[0, 0] + b[0, 0]) * 0.5")
gain = pg.kernel(source="def gain(color: Image, by: float) -> vec4: return color[0, 0] * by")


def flat(level: float, width: int = 3, height: int = 2) -> np.ndarray:
    return np.full((height, width, 4), level, np.float32)


def level(result: pg.Result, name: str) -> float:
    assert (result[name] == result[name][0, 0, 0]).all()
    return float(result[name][0, 0, 0])


# History


def test_a_cross_fade_over_frames(backend: Backend) -> None:
    """The first frame fades in from zero; results are this run's, not the last one's."""
    spec = pg.target("shown", "rgba32f")
    shown = fade(pg.Input("frame"), pg.previous(spec), into=spec)
    with pg.compile(shown, backend) as program:
        assert [level(program(frame=flat(1.0)), "shown") for _ in range(4)] == [0.5, 0.75, 0.875, 0.9375]
        assert level(program.read("shown"), "shown") == 0.9375
        assert level(program.read("shown"), "shown") == 0.9375


def test_history_of_another_target_is_one_run_old(backend: Backend) -> None:
    frame = pg.Input("frame")
    spec = pg.target("kept", "rgba32f")
    kept = copy(frame, into=spec, name="kept")
    old = copy(pg.previous(spec), into=pg.target("old", "rgba32f"))
    with pg.compile([kept, old], backend) as program:
        found = [program(frame=flat(value)) for value in (1.0, 2.0, 3.0)]
    assert [level(f, "old") for f in found] == [0.0, 1.0, 2.0]
    assert [level(f, "kept") for f in found] == [1.0, 2.0, 3.0]


def test_a_run_that_fails_does_not_lose_history() -> None:
    spec = pg.target("shown", "rgba32f")
    shown = fade(pg.Input("frame"), pg.previous(spec), into=spec)
    with pg.compile(shown, "reference") as program:
        program(frame=flat(1.0))
        with pytest.raises(pg.InputError):
            program(frame=flat(1.0), nothing=1)
        assert level(program(frame=flat(1.0)), "shown") == 0.75


# Static work


def test_static_work_runs_again_only_when_its_input_is_new() -> None:
    still, frame = pg.Input("still", static=True), pg.Input("frame")
    once = left(still, name="once")
    out = add(once, frame, name="out")
    with pg.compile(out, null := NullBackend()) as program:
        picture = flat(1.0)
        program(still=picture, frame=flat(0.0))
        program(still=picture, frame=flat(1.0))
        assert null.calls == ["once", "out", "out"]
        program(still=flat(1.0), frame=flat(1.0))
        assert null.calls == ["once", "out", "out", "once", "out"]


def test_an_8_bit_static_picture_counts_as_the_same_too() -> None:
    still, frame = pg.Input("still", static=True), pg.Input("frame")
    with pg.compile(add(left(still, name="once"), frame, name="out"), null := NullBackend()) as program:
        picture = np.zeros((2, 3, 4), np.uint8)
        for _ in range(3):
            program(still=picture, frame=flat(0.0))
        assert null.calls == ["once", "out", "out", "out"]


def test_a_static_input_inside_a_fused_pass_is_noticed(backend: Backend) -> None:
    still = pg.Input("still", static=True)
    out = left(copy(still, name="inner"), name="out")
    with pg.compile(out, backend) as program:
        assert [level(program(still=flat(value)), "out") for value in (1.0, 2.0)] == [1.0, 2.0]
    chain = copy(copy(still, name="inner"), name="out")
    with pg.compile(chain, backend) as program:
        assert program.inputs
        assert [level(program(still=flat(value)), "out") for value in (1.0, 2.0)] == [1.0, 2.0]


def test_static_values_count_by_value() -> None:
    still = pg.Input("still", static=True)
    out = gain(still, pg.Value("by", float, static=True), name="out")
    with pg.compile(out, null := NullBackend()) as program:
        picture = flat(1.0)
        for by in (1.5, float("1.5"), 2.5, 2.5):
            program(still=picture, by=by)
        assert null.calls == ["out", "out"]


def test_a_failed_run_does_not_count_as_done(backend: Backend) -> None:
    still = pg.Input("still", static=True)
    by = pg.Value("by", float, static=True).map(lambda v: 1.0 / v)
    with pg.compile(gain(still, by, name="out"), backend) as program:
        picture = flat(1.0)
        assert level(program(still=picture, by=2.0), "out") == 0.5
        with pytest.raises(ZeroDivisionError):
            program(still=picture, by=0.0)
        assert level(program(still=picture, by=2.0), "out") == 0.5


# Values


def test_values_change_from_run_to_run(backend: Backend) -> None:
    by = pg.Value("by", float, default=2.0)
    out = gain(pg.Input("frame"), by.map(lambda v: v + 1.0), name="out")
    with pg.compile(out, backend) as program:
        assert level(program(frame=flat(1.0)), "out") == 3.0
        assert level(program(frame=flat(1.0), by=0.0), "out") == 1.0


def test_a_derived_value_is_computed_once_a_run() -> None:
    calls = []
    by = pg.combine(lambda a, b: calls.append(1) or a + b, pg.Value("a", float), pg.Value("b", float))
    frame = pg.Input("frame")
    out = add(gain(frame, by, name="one"), gain(frame, by, name="two"), name="out")
    with pg.compile(out, "reference") as program:
        assert level(program(frame=flat(1.0), a=1.0, b=2.0), "out") == 6.0
        assert len(calls) == 1


def test_a_default_may_be_an_array() -> None:
    tint = pg.kernel(source="def tint(color: Image, by: vec4) -> vec4: return color[0, 0] * by")
    by = pg.Value("by", np.ndarray, default=np.ones(4)).map(lambda v: v * 2)
    with pg.compile(tint(pg.Input("frame"), by), "reference") as program:
        assert level(program(frame=flat(1.0)), "tint") == 2.0


def test_plain_parameters_can_be_set(backend: Backend) -> None:
    out = gain(gain(pg.Input("frame"), 2.0, name="inner"), 3.0, name="out")
    with pg.compile(out, backend) as program:
        assert level(program(frame=flat(1.0)), "out") == 6.0
        program.set("out", "by", 5.0)
        assert level(program(frame=flat(1.0)), "out") == 10.0
        # Kept when another size plans again.
        assert level(program(frame=flat(1.0, 5, 4)), "out") == 10.0


# Inputs


def test_an_input_of_another_size_or_format_plans_again(backend: Backend) -> None:
    with pg.compile(copy(pg.Input("frame")), backend) as program:
        assert program(frame=flat(1.0))["copy"].shape == (2, 3, 4)
        assert program(frame=flat(1.0))["copy"].shape == (2, 3, 4)
        assert program.replanned == 0
        assert program(frame=flat(1.0, 5, 7))["copy"].shape == (7, 5, 4)
        assert program(frame=flat(1.0, 5, 7)[:, :, :1])["copy"][0, 0].tolist() == [1.0, 0.0, 0.0, 1.0]
        assert program.replanned == 2


def test_integers_count_from_zero_to_one(backend: Backend) -> None:
    with pg.compile(copy(pg.Input("frame")), backend) as program:
        for dtype in (np.uint8, np.uint16):
            top = np.full((2, 3, 4), np.iinfo(dtype).max, dtype)
            assert level(program(frame=top), "copy") == 1.0


# What is given back


def test_everything_is_given_back() -> None:
    null = NullBackend()
    with pg.compile(left(left(pg.Input("frame"), name="a"), name="b"), null) as program:
        program(frame=flat(1.0))
        assert null.storages
        program(frame=flat(1.0, 9, 9))
        assert {storage.size for storage in null.storages} == {(9, 9)}
    assert null.storages == []


def test_a_plan_that_cannot_be_compiled_gives_back_what_it_made() -> None:
    class Small(NullBackend):
        def make(self, format, size):  # type: ignore[no-untyped-def]
            if len(self.storages) == 2:
                raise BackendError("out of memory")
            return super().make(format, size)

    small = Small()
    with pg.compile(left(left(pg.Input("frame"), name="a"), name="b"), small) as program:
        with pytest.raises(BackendError, match="out of memory"):
            program(frame=flat(1.0))
        assert small.storages == []


def test_a_program_closes_the_backend_that_it_opened_and_no_other() -> None:
    with open_backend("null") as mine:
        closed = []
        mine.close = lambda: closed.append(1)  # type: ignore[method-assign]
        pg.compile(copy(pg.Input("frame")), mine).close()
        assert closed == []


def test_observers_see_what_each_step_wrote(backend: Backend) -> None:
    seen = []
    out = gain(gain(pg.Input("frame"), 2.0, name="inner"), 3.0, name="out")
    with pg.compile(out, backend, options=pg.Options(fuse=False, alias=False)) as program:
        program.run(
            lambda step, pictures: seen.append((step.name, {n: p.max() for n, p in pictures.items()})),
            frame=flat(1.0),
        )
    assert seen == [("inner", {"inner": 2.0}), ("out", {"out": 6.0})]


# Draws over content

QUAD = pg.Mesh.make(
    np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32), np.array([[0, 1, 2], [0, 2, 3]])
)


@pg.struct
class Corner:
    position: vec4


@pg.vertex
def place(vertex: pg.Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0))


@pg.fragment
def paint(corner: Corner, level: float) -> vec4:
    return vec4(level)


@pg.fragment
def show(corner: Corner, texture: Image) -> vec4:
    return texture.sample(pg.vec2(0.5, 0.5))


def drawn(into: object, level: float, name: str) -> pg.Target:
    made: pg.Target = pg.draw(QUAD, vertex=place, fragment=paint, into=into, blend="add", level=level, name=name)
    return made


def test_draws_over_content_keep_old_content_for_who_needs_it(backend: Backend) -> None:
    base = drawn(pg.target("canvas", "rgba32f"), 1.0, "base")
    one, two = drawn(base, 2.0, "one"), drawn(base, 4.0, "two")
    outputs = {"base": base, "one": one, "two": two, "both": drawn(one, 8.0, "more")}
    with pg.compile(outputs, backend, (3, 2)) as program:
        for _ in range(2):
            found = program()
            assert {name: level(found, name) for name in outputs} == {
                "base": 1.0,
                "one": 3.0,
                "two": 5.0,
                "both": 11.0,
            }


def test_closing_a_program_gives_its_meshes_back(backend: Backend) -> None:
    """The backend stays open and is the caller's: nothing of the program may stay alive in it."""
    import gc

    from passgraph.backends.gl import GLBackend
    from passgraph.backends.opencl import OpenCLBackend
    from passgraph.scene import Mesh

    source = placed("""
def paint(corner: Corner) -> vec4:
    return vec4(1.0)
""")
    place, paint = pg.vertex(source=source, name="place"), pg.fragment(source=source, name="paint")

    def alive() -> object:
        gc.collect()
        if isinstance(backend, GLBackend):
            # Compiled programs stay for the next program with the same kernels.
            return sorted(kind for kind, _ in backend.objects.alive if kind not in ("Program", "Shader"))
        return len(backend.alive) if isinstance(backend, OpenCLBackend) else None

    def draw() -> None:
        mesh = Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
        out = pg.draw(mesh, vertex=place, fragment=paint, into=pg.target("out", "rgba8"))
        with pg.compile(out, backend=backend, size=(8, 8)) as program:
            assert program()["out"].any()

    draw()
    before = alive()
    draw()
    assert alive() == before


class Narrow(NullBackend):
    """A device with memory for one picture."""

    name = "narrow"

    def __init__(self) -> None:
        super().__init__()
        self.held: list[object] = []

    def make(self, format: Format, size: tuple[int, int]) -> object:
        if self.held:
            raise MemoryError("no more")
        self.held.append(super().make(format, size))
        return self.held[-1]

    def release(self, storage: object) -> None:
        self.held.remove(storage)


def test_memory_that_is_not_there_is_told_with_what_it_is_for_and_nothing_is_kept() -> None:
    backend = Narrow()
    made = copy(pg.Input("frame", "rgba32f", (512, 256)))
    says = r"'copy' is 512x256 rgba32f \(2 MiB\), for which narrow finds no memory; use a smaller size or format"
    for _ in range(2):
        with pytest.raises(BackendError, match=says):
            pg.compile(made, backend=backend)
        assert not backend.held


HUNGRY = """
import resource, sys
import numpy as np, passgraph as pg
backend, extra = sys.argv[1], int(sys.argv[2])
kernel = pg.kernel(source="def mean(p: Image) -> vec4:\\n    return p[-1, 0] * 0.5 + p[1, 0] * 0.5")

def program(size):
    once = kernel(pg.Input("frame", "rgba32f", size), into=pg.target("once", "rgba32f"))
    return pg.compile(kernel(once, into=pg.target("twice", "rgba32f")), backend=backend)

def taken():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[0]) * resource.getpagesize()

opening = 0
if len(sys.argv) == 3:  # all that is loaded and compiled once, and what a device takes while it is open
    for _ in range(2):
        before = taken()
        with program((64, 64)) as small:
            small(frame=np.ones((64, 64, 4), np.float32))
            opening = taken() - before
size = (2048, 2048) if len(sys.argv) == 3 else (64, 64)
picture = np.ones((2048, 2048, 4), np.float32)
resource.setrlimit(resource.RLIMIT_AS, (taken() + opening + (extra << 20),) * 2)
try:
    with program(size) as large:
        large(frame=picture[: size[1], : size[0]])
except pg.BackendError as error:
    print(error)
"""


#: Writes a texture that there is no memory for, with nothing of ours.
HUNGRY_DRIVER = """
import resource, wgpu
device = wgpu.gpu.request_adapter_sync().request_device_sync()
def write(side):
    texture = device.create_texture(size=(side, side, 1), format="rgba32float", usage=wgpu.TextureUsage.COPY_DST)
    device.queue.write_texture({"texture": texture}, data, {"bytes_per_row": 16 * side}, (side, side, 1))
data = bytes(2048 * 2048 * 16)
write(64)
with open("/proc/self/statm") as file:
    now = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (now + (100 << 20),) * 2)
write(2048)
"""


@pytest.mark.sampled
@pytest.mark.skipif(sys.platform != "linux", reason="limits of address space are Linux's")
@pytest.mark.parametrize("extra", [30, 200], ids=["for its targets", "for its results"])
def test_a_process_without_memory_is_told_so(backend_name: str, extra: int) -> None:
    command = [sys.executable, "-c", HUNGRY, backend_name, str(extra)]
    made = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    if made.returncode == -signal.SIGSEGV and backend_name == "webgpu":
        alone = subprocess.run([sys.executable, "-c", HUNGRY_DRIVER], capture_output=True, check=False, timeout=300)
        assert alone.returncode == -signal.SIGSEGV, made.stderr
        pytest.skip("needs a driver that tells of missing memory (Mesa 26.1 ends the process)")
    assert made.returncode == 0, made.stderr
    assert re.search(r"2048 ?x ?2048|192 MiB", made.stdout) and "memory" in made.stdout.lower(), made.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="limits of address space are Linux's")
def test_a_process_without_memory_for_the_compiler_is_told_so(tmp_path: Path) -> None:
    made = subprocess.run(
        [sys.executable, "-c", HUNGRY, "numpy", "100", "at once"], capture_output=True, text=True, check=False,
        timeout=300, env={**os.environ, "PASSGRAPH_CACHE": str(tmp_path)},
    )  # fmt: skip
    assert "llvmlite, which cannot be loaded here; its library takes about 300 MB" in made.stdout, made.stderr


def test_a_struct_of_the_user_may_be_named_vertex() -> None:
    """The type of a parameter decides what the draw hands in, here and in a document; its name does not."""
    kernels = """
import passgraph as pg

class Vertex:
    shift: vec3

class Corner:
    position: vec4

def place(vertex: pg.Vertex, extra: Vertex) -> Corner:
    return Corner(vec4(vertex.position + extra.shift, 1.0))

def paint(corner: Corner) -> vec4:
    return vec4(0.25)
"""
    triangle = pg.Mesh.make(positions=[[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], triangles=[[0, 1, 2]])
    color = pg.draw(
        triangle, vertex=pg.vertex(source=kernels, name="place"), fragment=pg.fragment(source=kernels, name="paint"),
        into=pg.target("color", "rgba32f"), values={"extra": SimpleNamespace(shift=(1.0, 0.0, 0.0))},
    )  # fmt: skip
    for graph in (color, pg.from_data(pg.to_data(color))["color"]):
        with pg.compile(graph, size=(4, 2)) as program:
            assert program()["color"][0, :, 0].tolist() == [0.0, 0.0, 0.25, 0.25]
