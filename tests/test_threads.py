"""What threads and forked processes may do with programs (docs/backends.md, "Threads, processes, contexts").

Each case runs in a process of its own: what goes wrong here ends processes, or hangs them.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.registry import backend_class, open_backend
from passgraph.backends.turn import Turn
from passgraph.errors import BackendError, GraphError
from tests.conftest import require
from tests.corners import placed

pytestmark = pytest.mark.slow

#: Backends that a forked process can go on using.
SURVIVING = ("numpy", "reference")
BACKENDS = ("numpy", "gl", "opencl", "webgpu", "reference")
THREADS = 8
SIZE = (24, 16)
#: A child that has not ended by then hangs; none takes a tenth of it.
HANGS_S = 240
TIMES = pg.kernel(source="def times(c: Image, by: float) -> vec4: return c[0, 0] * by")
MOVED = pg.kernel(source="def moved(c: Image, by: float) -> vec4: return c[-1, 0] + by")
STAGES = placed("""
def paint(corner: Corner, level: float) -> vec4:
    return vec4(level)
""")
PLACE, PAINT = pg.vertex(source=STAGES, name="place"), pg.fragment(source=STAGES, name="paint")
COVERING = [[-1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [-1.0, 3.0, 0.0]]


def child(case: Callable[..., None], *arguments: object, **environment: str) -> str:
    """Run a case of this file in another process and give what it printed."""
    text = f"from {case.__module__} import {case.__name__}; {case.__name__}(*{arguments!r})"
    made = subprocess.Popen(
        [sys.executable, "-X", "faulthandler", "-c", text],
        cwd=Path(__file__).parent.parent, env={**os.environ, **environment},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    with made:
        try:
            printed, errors = made.communicate(timeout=HANGS_S)
        except subprocess.TimeoutExpired:
            os.killpg(made.pid, signal.SIGKILL)  # the processes that it forked too
            raise
    assert made.returncode == 0, f"exit status {made.returncode}\n{printed}{errors[-4000:]}"
    return printed


def at_once(work: Callable[[int], None], threads: int = THREADS) -> None:
    """``work(0)`` … in threads that begin together; raises what one of them raised."""
    errors: list[BaseException] = []
    begin = threading.Barrier(threads)

    def run(number: int) -> None:
        try:
            begin.wait()
            work(number)
        except BaseException as error:
            errors.append(error)

    started = [threading.Thread(target=run, args=(number,)) for number in range(threads)]
    for thread in started:
        thread.start()
    for thread in started:
        thread.join()
    if errors:
        raise errors[0]


def picture(number: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Small whole numbers, which every backend multiplies and adds without rounding."""
    return np.random.default_rng(number).integers(0, 100, (SIZE[1], SIZE[0], 4)).astype(np.float32)


def shared_graph() -> pg.Target:
    """Two passes and a draw: ``frame[-1] + by``, times ``by``, times the level that the draw wrote."""
    by = pg.Value("by", float)
    mesh = pg.Mesh.make(COVERING, [[0, 1, 2]])
    level = pg.draw(mesh, vertex=PLACE, fragment=PAINT, into=pg.target("level", "rgba32f", SIZE), level=by)
    moved = MOVED(pg.Input("frame", "rgba32f", SIZE), by, into=pg.target("moved", "rgba32f"))
    both = pg.kernel(source="def both(c: Image, d: Image) -> vec4: return c[0, 0] * d[0, 0]")
    made: pg.Target = both(moved, level, into=pg.target("out", "rgba32f"))
    return made


def expected(frame: np.ndarray[Any, Any], by: float) -> np.ndarray[Any, Any]:
    return (frame[:, np.maximum(np.arange(SIZE[0]) - 1, 0)] + np.float32(by)) * np.float32(by)


# Cases, each run in a process of its own


def first_use(backend: str) -> None:
    """Each thread compiles and runs programs that nobody has compiled before."""

    def work(number: int) -> None:
        own = number + 2
        kernel = pg.kernel(source=f"def own{own}(c: Image) -> vec4: return c[0, 0] * {own}.0 + {own}.0")
        fragment = STAGES.replace("vec4(level)", f"vec4(level + {own}.0)")
        drawn = pg.draw(pg.Mesh.make(COVERING, [[0, 1, 2]]), vertex=PLACE, level=1.0,
                        fragment=pg.fragment(source=fragment, name="paint"),
                        into=pg.target("drawn", "rgba32f", SIZE))  # fmt: skip
        target = kernel(pg.Input("frame", "rgba32f", SIZE), into=pg.target("out", "rgba32f"))
        for outputs in (target, [target, drawn]):
            with pg.compile(outputs, backend=backend) as program:
                got = program(frame=picture(own))
            np.testing.assert_array_equal(got["out"], picture(own) * own + own)
        np.testing.assert_array_equal(got["drawn"], np.full_like(got["drawn"], own + 1))

    at_once(work)


def one_program(backend: str, calls: int) -> None:
    with pg.compile(shared_graph(), backend=backend) as program:

        def work(number: int) -> None:
            for call in range(calls):
                frame, by = picture(number * calls + call), float(number + 1)
                np.testing.assert_array_equal(program(frame=frame, by=by)["out"], expected(frame, by))

        at_once(work)


def one_backend(backend: str) -> None:
    with open_backend(backend) as opened:

        def work(number: int) -> None:
            for call in range(4):
                with pg.compile(shared_graph(), backend=opened) as program:
                    for by in (2.0, 3.0 + number):
                        frame = picture(number * 4 + call)
                        np.testing.assert_array_equal(program(frame=frame, by=by)["out"], expected(frame, by))

        at_once(work)


def closed_during_runs(backend: str) -> None:
    program = pg.compile(shared_graph(), backend=backend)
    running = threading.Semaphore(0)
    refused: list[str] = []

    def work(number: int) -> None:
        if number == 0:
            for _ in range(3 * (THREADS - 1)):
                running.acquire()
            program.close()
            return
        frame, by = picture(number), float(number + 1)
        try:
            while True:
                np.testing.assert_array_equal(program(frame=frame, by=by)["out"], expected(frame, by))
                running.release()
        except GraphError as error:
            refused.append(str(error))

    at_once(work)
    assert refused == ["this program is closed; compile the graph again"] * (THREADS - 1)


def other_thread(backend: str) -> None:
    """Compiled in a thread that has ended, called from others one after the other."""
    made: list[pg.Program] = []
    at_once(lambda _: made.append(pg.compile(shared_graph(), backend=backend)), 1)
    frame = picture(0)

    def call(_: int) -> None:
        np.testing.assert_array_equal(made[0](frame=frame, by=3.0)["out"], expected(frame, 3.0))

    call(0)
    at_once(call, 1)
    call(0)
    at_once(lambda _: made[0].close(), 1)


@contextmanager
def forked() -> Iterator[bool]:
    """True inside the child process; the parent waits for it and passes its failure on."""
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        status = 1
        try:
            yield True
            status = 0
        except BaseException:
            import traceback

            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
    _, ended = os.waitpid(pid, 0)
    assert ended == 0, f"the child ended with {ended}"
    yield False


def fork(backend: str) -> None:
    """A child uses, closes and compiles programs; the parent's work on."""
    program = pg.compile(shared_graph(), backend=backend)
    large = pg.compile(TIMES(pg.Input("frame"), by=2.0), backend=backend)
    wide = np.ones((256, 1024, 4), np.float32)
    frame = picture(1)
    program(frame=frame, by=2.0)
    large(frame=wide)  # enough for numpy to start its threads
    for _ in range(2):
        with forked() as inside:
            if inside and backend in SURVIVING:
                np.testing.assert_array_equal(program(frame=frame, by=3.0)["out"], expected(frame, 3.0))
                assert (large(frame=wide)["times"] == 2.0).all()
                if backend == "numpy":  # the threads of this process, not those that the fork left behind
                    workers = large.backend.workers  # type: ignore[attr-defined]
                    assert workers.count < 2 or any(thread.is_alive() for thread in workers._threads)
                at_once(lambda _: large(frame=wide))
            elif inside:
                for use in (program, lambda **_: program.run(**_), lambda **_: pg.compile(shared_graph(), backend)):
                    with pytest.raises(BackendError, match=rf"^{backend}: this process was forked .*spawn"):
                        use(frame=frame, by=3.0)
                with pytest.raises(BackendError, match="forked"):
                    program.read()
                listed = backend_class(backend).devices()
                assert len(listed) == 1 and "was forked from one that had opened a driver" in listed[0].missing
            if inside:
                program.close()
                large.close()
                with pytest.raises((GraphError, BackendError)):
                    program(frame=frame, by=3.0)
                with pg.compile(TIMES(pg.Input("frame"), by=3.0), backend="numpy") as other:
                    np.testing.assert_array_equal(other(frame=frame)["times"], 3.0 * frame)
    np.testing.assert_array_equal(program(frame=frame, by=4.0)["out"], expected(frame, 4.0))
    program.close()


def fork_that_ends_as_processes_do(backend: str) -> None:
    """What the child inherits is given back to Python when it ends, and must not wait for the driver."""
    program = pg.compile(shared_graph(), backend=backend)
    program(frame=picture(1), by=2.0)
    fork_that_ends(program)


def fork_that_ends(held: object) -> None:
    """The child inherits what its parent holds, drops it and ends with 7."""
    pid = os.fork()
    if pid == 0:
        del held
        sys.exit(7)
    _, ended = os.waitpid(pid, 0)
    assert os.waitstatus_to_exitcode(ended) == 7
    os._exit(0)


def fork_with_a_driver_alone(name: str) -> None:
    """As `fork_that_ends_as_processes_do`, with nothing of ours."""
    if name == "gl":
        import moderngl

        context = moderngl.create_context(standalone=True, backend="egl")
        context.simple_framebuffer((16, 16)).read()
        fork_that_ends(context)
    elif name == "webgpu":
        import wgpu

        device = wgpu.gpu.request_adapter_sync().request_device_sync()
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(device))  # Python does not give it back
        fork_that_ends(device)


def fork_during_a_run(backend: str) -> None:
    """Another thread is in the middle of a run: what it holds is half done in the child."""
    inside, on = threading.Event(), threading.Event()

    def observe(*_: object) -> None:
        inside.set()
        on.wait()

    program = pg.compile(shared_graph(), backend=backend)
    runs = threading.Thread(target=lambda: program.run(observe, frame=picture(0), by=2.0))
    runs.start()
    inside.wait()
    with forked() as child_process:
        if child_process:
            with pytest.raises(BackendError, match=r"another thread was using this backend|forked from one that had"):
                program(frame=picture(0), by=2.0)
            program.close()
            if backend in SURVIVING:
                one_program(backend, 2)
    on.set()
    runs.join()
    np.testing.assert_array_equal(program(frame=picture(2), by=4.0)["out"], expected(picture(2), 4.0))


def fork_while_compiling() -> None:
    """Compiling threads hold locks; a child does not begin with them held."""
    # Modules are loaded first: Python itself cannot fork while another thread imports one.
    with pg.compile(TIMES(pg.Input("frame"), by=2.0)) as first:
        first(frame=picture(0))
    stop = threading.Event()

    def compile_on() -> None:
        number = 0
        while not stop.is_set():
            number += 1
            kernel = pg.kernel(source=f"def made{number}(c: Image) -> vec4: return c[0, 0] * {number}.0")
            with pg.compile(kernel(pg.Input("frame", "rgba32f", SIZE)), backend="numpy") as program:
                program(frame=picture(0))

    thread = threading.Thread(target=compile_on)
    thread.start()
    try:
        for number in range(12):
            with forked() as inside:
                if inside:
                    kernel = pg.kernel(source=f"def other(c: Image) -> vec4: return c[0, 0] * {number}.5")
                    with pg.compile(kernel(pg.Input("frame", "rgba32f", SIZE)), backend="numpy") as program:
                        got = program(frame=picture(0))["other"]
                    np.testing.assert_array_equal(got, picture(0) * (number + 0.5))
    finally:
        stop.set()
        thread.join()


def fork_while_llvm_is_busy() -> None:
    """A thread is inside LLVM without a lock of ours, as one is whose machine is disposed of when it ends."""
    from llvmlite.binding import ffi

    with pg.compile(TIMES(pg.Input("frame"), by=2.0)) as first:
        first(frame=picture(0))
    inside_llvm = threading.Event()

    def stay() -> None:
        with ffi.lib._lock:
            inside_llvm.set()
            time.sleep(0.5)

    thread = threading.Thread(target=stay)
    thread.start()
    inside_llvm.wait()
    with forked() as inside:
        if inside:
            assert ffi.lib._lock._lock.acquire(timeout=20)
    thread.join()


# Tests


@pytest.fixture(params=BACKENDS)
def name(request: pytest.FixtureRequest) -> str:
    found: str = request.param
    if found != "reference":
        require(found)
    return found


def test_threads_compile_programs_of_their_own_at_first_use(name: str, tmp_path: Path) -> None:
    child(first_use, name, PASSGRAPH_CACHE=str(tmp_path))


def test_threads_share_a_program(name: str) -> None:
    child(one_program, name, 10 if name == "reference" else 100)


def test_programs_of_several_threads_share_a_backend(name: str) -> None:
    child(one_backend, name)


def test_a_program_is_closed_while_threads_call_it(name: str) -> None:
    child(closed_during_runs, name)


def test_a_program_is_called_in_other_threads_than_it_was_compiled_in(name: str) -> None:
    child(other_thread, name)


def test_a_forked_process_uses_what_it_can_and_is_refused_the_rest(name: str) -> None:
    child(fork, name)


def test_a_forked_process_ends_as_any_other(name: str) -> None:
    try:
        child(fork_that_ends_as_processes_do, name)
    except subprocess.TimeoutExpired:
        with pytest.raises(subprocess.TimeoutExpired):
            child(fork_with_a_driver_alone, name)
        pytest.skip("needs a driver that lets forked processes exit (Mesa 26.1 waits for threads of the parent)")


def test_a_fork_in_the_middle_of_another_threads_run_loses_that_program(name: str) -> None:
    child(fork_during_a_run, name)


def test_a_process_forks_while_another_thread_is_inside_llvm(tmp_path: Path) -> None:
    child(fork_while_llvm_is_busy, PASSGRAPH_CACHE=str(tmp_path))


def test_a_process_forks_while_another_thread_compiles(tmp_path: Path) -> None:
    child(fork_while_compiling, PASSGRAPH_CACHE=str(tmp_path))


@pytest.mark.parametrize(
    ("what", "use"),
    [
        ("closed", lambda program: program.close()),
        ("called", lambda program: program(frame=picture(0), by=1.0)),
        ("run", lambda program: program.run(frame=picture(0), by=1.0)),
        ("read", lambda program: program.read()),
        ("changed", lambda program: program.set("moved", "by", 1.0)),
    ],
)
def test_a_program_is_not_used_from_inside_its_own_run(
    what: str, use: Callable[[pg.Program], object], name: str
) -> None:
    frame = picture(3)
    with pg.compile(shared_graph(), backend=name) as program:
        text = f"^a program cannot be {what} from inside its own run; an observer, or a value's function, keeps what"
        with pytest.raises(GraphError, match=text):
            program.run(lambda *_: use(program), frame=frame, by=2.0)
        np.testing.assert_array_equal(program(frame=frame, by=5.0)["out"], expected(frame, 5.0))


def test_an_observer_may_use_another_program_of_the_same_backend(name: str) -> None:
    frame, seen = picture(4), []
    with open_backend(name) as opened, pg.compile(shared_graph(), backend=opened) as program:
        with pg.compile(shared_graph(), backend=opened) as other:
            program.run(lambda *_: seen.append(other(frame=frame, by=7.0)["out"]), frame=frame, by=2.0)
        np.testing.assert_array_equal(program.read()["out"], expected(frame, 2.0))
    for one in seen:
        np.testing.assert_array_equal(one, expected(frame, 7.0))
    assert len(seen) >= 2


def test_what_fails_to_be_given_back_leaves_the_turn_free() -> None:
    turn = Turn("any")
    turn.later(lambda: {}["missing"])
    with pytest.raises(KeyError), turn:
        pass
    entered = threading.Event()

    def enter() -> None:
        with turn:
            entered.set()

    other = threading.Thread(target=enter, daemon=True)
    other.start()
    assert entered.wait(HANGS_S)


DAEMONS = """
import sys, threading, time
import numpy as np, passgraph as pg

kernel = pg.kernel(source="def left(p: Image) -> vec4: return p[-1, 0]")
frame = np.ones((480, 640, 4), np.float32)
running = threading.Semaphore(0)

def run(program):
    program(frame=frame)
    running.release()
    while True:
        program(frame=frame)

moved = kernel(pg.Input("frame", "rgba32f", (640, 480)), into=pg.target("out"))
shared, another = (pg.compile(moved, sys.argv[1]) for _ in range(2))
for program in (shared, shared, another):
    threading.Thread(target=run, args=(program,), daemon=True).start()
for _ in range(3):
    running.acquire()
"""


def test_the_interpreter_ends_while_daemon_threads_run(backend_name: str) -> None:
    for _ in range(2):
        made = subprocess.run(
            [sys.executable, "-c", DAEMONS, backend_name], capture_output=True, text=True, check=False, timeout=HANGS_S
        )
        assert (made.returncode, made.stderr) == (0, "")
