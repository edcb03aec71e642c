"""Texts compiled by several threads at once: each once, all there in the end, and nobody left behind."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.numpy.backend import NumpyBackend
from passgraph.backends.numpy.machine import compiler, machine_code

SIZE = (40, 30)


@pytest.fixture(autouse=True)
def compiled(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[list[tuple[str, str]]]:
    """What is compiled, nothing being known before: the text's first line and the thread."""
    made: list[tuple[str, str]] = []
    original = compiler.compiled

    def note(text: str, loops: int) -> bytes:
        made.append((text.splitlines()[0], threading.current_thread().name))
        return original(text, loops)

    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    monkeypatch.setattr(machine_code, "_codes", {})
    monkeypatch.setattr(compiler, "compiled", note)
    yield made
    assert not helpers_left()


def helpers_left() -> list[threading.Thread]:
    """Those that do not end by themselves."""
    return [thread for thread in threading.enumerate() if thread.name == "passgraph_compile" and _stays(thread)]


def _stays(thread: threading.Thread) -> bool:
    thread.join(20)
    return thread.is_alive()


def asked(number: int) -> machine_code.Code:
    return machine_code.function_code(("side by side", str(number)), lambda name: f"; {number}\n{_text(name, number)}")


def _text(name: str, number: int) -> str:
    return f"define i64 @{name}() {{\n  ret i64 {number}\n}}\n"


def test_each_text_is_compiled_once_and_loaded(compiled: list[tuple[str, str]]) -> None:
    with machine_code.side_by_side(4):
        codes = [asked(number) for number in (*range(12), *range(12))]
    assert sorted(text for text, _ in compiled) == sorted(f"; {number}" for number in range(12))
    addresses = [code._address for code in codes]
    assert None not in addresses
    assert addresses[:12] == addresses[12:]
    assert len(set(addresses)) == 12


def test_two_texts_are_compiled_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two texts that wait for each other are compiled: one after the other they would wait for ever."""
    both, original = threading.Barrier(2, timeout=60), compiler.optimised

    def wait(*given: object, **named: object) -> object:
        both.wait()
        return original(*given, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(compiler, "optimised", wait)
    with machine_code.side_by_side(2):
        asked(0), asked(1)


def test_one_thread_compiles_by_itself(compiled: list[tuple[str, str]]) -> None:
    with machine_code.side_by_side(1):
        for number in range(3):
            asked(number)
    assert [thread for _, thread in compiled] == [threading.current_thread().name] * 3


def broken() -> None:
    with machine_code.side_by_side(3):
        asked(1)
        machine_code.function_code(("side by side", "broken"), lambda name: f"define nonsense @{name}")


def test_what_cannot_be_compiled_is_told_to_who_asked() -> None:
    with pytest.raises(RuntimeError, match="expected"):
        broken()


def given_up() -> None:
    with machine_code.side_by_side(2):
        for number in range(200):
            asked(number)
        raise KeyError


def test_what_nobody_waits_for_is_left(compiled: list[tuple[str, str]], monkeypatch: pytest.MonkeyPatch) -> None:
    """The one helper may have begun a text, in which it is held until all is given up; it takes no other after it."""
    is_given_up, original = threading.Event(), compiler.optimised

    def wait(*given: object, **named: object) -> object:
        assert is_given_up.wait(60)
        return original(*given, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(compiler, "optimised", wait)
    with pytest.raises(KeyError):
        given_up()
    is_given_up.set()
    assert not helpers_left()
    assert len(compiled) <= 1
    assert asked(199).address  # and made when it is asked for


def test_a_program_is_whole_when_it_is_compiled(compiled: list[tuple[str, str]]) -> None:
    kernels = [pg.kernel(source=f"def k(c: Image) -> vec4: return c[{n}, 0] * {n}.5") for n in range(1, 6)]
    frame = pg.Input("frame", "rgba32f", SIZE)
    outputs = {f"o{n}": kernel(frame, into=pg.target(f"o{n}", "rgba32f")) for n, kernel in enumerate(kernels)}
    picture = np.random.default_rng(0).random((SIZE[1], SIZE[0], 4), np.float32)
    with pg.compile(outputs, NumpyBackend("2"), options=None) as program:
        before = len(compiled)
        assert all(code._address is not None for code in machine_code._codes.values())
        result = program(frame=picture)
        assert len(compiled) == before >= 5
    for n in range(5):
        moved = np.take(picture, np.minimum(np.arange(SIZE[0]) + n + 1, SIZE[0] - 1), axis=1)
        np.testing.assert_array_equal(result[f"o{n}"], moved * np.float32(n + 1.5))
