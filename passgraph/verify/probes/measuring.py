"""Run all probes of a backend in a process of their own, which a driver may end."""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

from passgraph.errors import BackendError, DeviceMissingError, PassgraphError, on_one_line
from passgraph.verify.probes.kept import Results
from passgraph.verify.probes.probe import Language, NotHereError

#: Backend → the language of its probes.
LANGUAGES: dict[str, Language] = {"gl": "glsl", "webgpu": "wgsl", "opencl": "opencl", "numpy": "numpy"}
#: Begins the lines of the process that are messages; drivers print others.
MARK = "passgraph-probe "
#: Seconds after which a probe counts as hanging; browsers and compilers start within.
MOST_SECONDS = 120.0
#: Characters of an error in a fact.
_MOST = 100
Say = Callable[[str], object]


def measure(backend: str, say: Say = lambda name: None) -> Results:
    """Return the facts of a device; ``say`` gets the name of each probe when it begins.

    Raises
    ------
    BackendError
        For a backend without probes, and one that does not open.
    """
    base = backend.partition(":")[0]
    if base not in LANGUAGES:
        raise BackendError(f"there are no probes for backend {backend!r}; there are for {', '.join(LANGUAGES)}")
    conditions: dict[str, Any] = {}
    facts: dict[str, str] = {}
    while True:
        now, end = "", _process(backend, list(facts))
        for message in end.messages():
            if "conditions" in message:
                conditions = message["conditions"]
            elif "begin" in message:
                now = message["begin"]
                say(now)
            elif "error" in message:
                raise (DeviceMissingError if message["missing"] else BackendError)(message["error"])
            elif "fact" in message:
                facts[now], now = message["fact"], ""
            else:
                return Results(backend, LANGUAGES[base], conditions, facts)
        if not now:
            raise BackendError(f"{backend}: its process of probes ended before it began ({end.how()})")
        facts[now] = end.how()


class _Process:
    """A process of probes, and its messages."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process, self._lines, self._hangs = process, queue.Queue[str | None](), False
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as lines:
            for line in lines:
                self._lines.put(line)
        self._lines.put(None)

    def messages(self) -> Any:
        """Yield messages until the process ends or hangs; then, or when no more are asked for, it is ended."""
        has_ended = False
        try:
            while (line := self._lines.get(timeout=MOST_SECONDS)) is not None:
                if line.startswith(MARK):
                    yield json.loads(line.removeprefix(MARK))
            has_ended = True
        except queue.Empty:
            self._hangs = True
        finally:
            if not has_ended:
                self._process.kill()
            self._process.wait()
            self._thread.join()

    def how(self) -> str:
        """Return in words how the process ended."""
        if self._hangs:
            return "hangs"
        status = self._process.wait()
        return f"ends the process ({signal.Signals(-status).name if status < 0 else f'status {status}'})"


def _process(backend: str, done: list[str]) -> _Process:
    command = [sys.executable, "-m", "passgraph.verify.probes.measuring", backend, *done]
    environment = {**os.environ, "PYTHONFAULTHANDLER": ""}
    return _Process(
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment)
    )


def _bench(backend: str) -> tuple[Any, dict[str, Any]]:
    """Return the bench of a backend, and its conditions."""
    from passgraph.backends.registry import open_backend
    from passgraph.verify.conditions import Conditions

    base, _, device = backend.partition(":")
    opened = open_backend(backend)
    conditions = Conditions.now(opened).as_data()
    if base == "opencl":
        from passgraph.verify.probes.opencl_bench import OpenCLBench

        return OpenCLBench(opened), conditions
    if base == "webgpu":
        from passgraph.verify.probes.webgpu_bench import WebGPUBench

        return WebGPUBench(opened), conditions
    opened.close()
    if base == "gl":
        from passgraph.backends.gl.backend import GLBackend, device_index
        from passgraph.verify.probes.gl_bench import GLBench

        return GLBench(device_index(device or None, GLBackend.contexts)), conditions
    from passgraph.verify.probes.processor_bench import ProcessorBench

    return ProcessorBench(), conditions


def _send(**message: Any) -> None:
    print(MARK + json.dumps(message), flush=True)


def main(backend: str, done: list[str]) -> None:
    """Measure what is not done yet, a message for each step."""
    from passgraph.verify.probes.table import PROBES

    try:
        bench, conditions = _bench(backend)
    except PassgraphError as error:
        _send(error=str(error), missing=isinstance(error, DeviceMissingError))
        return
    _send(conditions=conditions)
    for probe in PROBES.values():
        if probe.name in done or bench.language not in probe.measure:
            continue
        _send(begin=probe.name)
        try:
            fact = probe.measure[bench.language](bench)
        except NotHereError as error:
            fact = str(error)
        except Exception as error:  # of a library, its compiler or its driver
            fact = f"error: {on_one_line(str(error))[:_MOST]}"
        _send(fact=fact)
    _send(done=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
