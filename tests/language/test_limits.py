"""Ranges of kernels' parameters: how they are written, what they refuse, and how far loops then reach."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest

import passgraph as pg
from passgraph import Const, Image, vec4
from passgraph.commands.entry import run
from passgraph.errors import InputError, KernelError
from passgraph.language.lower import Facts, lower
from passgraph.language.scalar import For, walk

TAPS = pg.Range(1, 64, "taps")
LOOP = """
def k(n: {type}) -> float:
    total = 0.0
    for i in range(n):
        total += 1.0
    return total
"""
FRAME = np.ones((2, 9, 4), np.float32)


def made(type_: str, body: str = "return 1.0") -> Any:
    return pg.kernel(source=f"def k(n: {type_}) -> float: {body}", name="k")


@pytest.mark.parametrize(
    ("type_", "limits"),
    [
        ("Annotated[int, Range(1, 64)]", "1 to 64"),
        ("Annotated[int, Range(low=1, high=9, odd=True)]", "odd, 1 to 9"),
        ("'Annotated[int, Range(1)]'", "1 or more"),
        ("Annotated[float, Range(-1.5, 2, 'px', True)]", "above -1.5 and at most 2"),
        ("Annotated[mat2, Range(None, 3)]", "3 or less"),
        ("Annotated[Const[int], Range(1, 8)]", "1 to 8"),
        ("Annotated[Array[vec3, 4], Range(0, 1)]", "0 to 1"),
        ("Annotated[uint, Range(0, 4294967295)]", "0 to 4294967295"),
    ],
)
def test_ranges_are_read_from_text(type_: str, limits: str) -> None:
    assert str(made(type_).parameters[0].range) == limits


def test_a_python_function_says_them_by_any_name() -> None:
    @pg.kernel
    def taps(c: Image, n: Annotated[int, TAPS] = 4, gain: Annotated[float, pg.Range(0, 2)] = 1.0) -> vec4:
        total = vec4(0)
        for i in range(n):
            total += c[i, 0]
        return total * gain

    assert [p.range for p in taps.parameters] == [None, TAPS, pg.Range(0, 2)]
    with pg.compile(taps(pg.Input("c"), pg.Value("n", int))) as program:
        assert program(c=FRAME, n=5)["taps"][0, 0, 0] == 5.0
        assert program.plan.steps[0].program.image("c").x == (0, 63)


@pytest.mark.parametrize(
    ("type_", "good", "bad"),
    [
        ("Annotated[int, Range(1, 64, 'taps')]", (1, 64), (0, 65)),
        ("Annotated[int, Range(1, 9, odd=True)]", (1, 9), (2, 11)),
        ("Annotated[uint, Range(3, 4294967290)]", (3, 4294967290), (2, 4294967291)),
        ("Annotated[float, Range(0, 0.1)]", (0, 0.1, np.float32(0.1)), (-1e-9, 0.1000001, np.nan, np.inf)),
        ("Annotated[float, Range(0, above=True)]", (1e-30, np.inf), (0.0, -0.0, np.nan)),
        ("Annotated[vec2, Range(0, 1)]", ((0, 1),), ((0, 1.5), (-1, 0))),
        ("Annotated[Const[int], Range(1, 64)]", (1, 64), (0, 65)),
    ],
)
def test_values_outside_are_refused_when_given_and_when_run(
    type_: str, good: tuple[Any, ...], bad: tuple[Any, ...]
) -> None:
    body = "return float(n)" if "vec2" not in type_ else "return n.x + n.y"
    kernel = made(type_, body)
    for value in good:
        kernel(value)
    for value in bad:
        with pytest.raises(InputError, match=r"kernel k, parameter 'n' must be .*, got "):
            kernel(value)
    if "Const" in type_:
        return
    with pg.compile(kernel(pg.Value("n", pg.Array)), size=(1, 1)) as program:
        for value in good:
            program(n=value)
        for value in bad:
            with pytest.raises(InputError, match=r"n of pass 'k' must be .*, got "):
                program(n=value)
        program(n=good[0])
        program.set("k", "n", bad[0])
        with pytest.raises(InputError, match="n of pass 'k' must be"):
            program(n=good[0])


@pytest.mark.parametrize("simplify", [True, False])
def test_a_loop_as_long_as_the_parameter_says_needs_no_min(simplify: bool) -> None:
    kernel = pg.kernel(source=LOOP.format(type="Annotated[int, Range(1, 64)]"))
    loops = [i for i in walk(lower(kernel.program, Facts(simplify=simplify)).body) if isinstance(i, For)]
    assert [loop.trips for loop in loops] == [64]
    with pytest.raises(KernelError, match=r"range\(min\(n, 64\)\)|limit"):
        lower(pg.kernel(source=LOOP.format(type="int")).program)
    with pytest.raises(KernelError):
        lower(pg.kernel(source=LOOP.format(type="Annotated[int, Range(1)]")).program)


@pytest.mark.parametrize("name", ["reference", "numpy", "gl"])
def test_such_a_loop_makes_the_trips_that_are_asked_for(name: str) -> None:
    text = LOOP.format(type="Annotated[int, Range(-3, 70)]")
    with pg.compile(pg.kernel(source=text)(pg.Value("n", int)), backend=name, size=(1, 1)) as program:
        assert [float(program(n=n)["k"][0, 0, 0]) for n in (-3, 0, 1, 69, 70)] == [0.0, 0.0, 1.0, 69.0, 70.0]


def test_a_float_bounds_the_int_made_of_it() -> None:
    text = LOOP.format(type="Annotated[float, Range(0, 20.5)]").replace("range(n)", "range(int(n))")
    (loop,) = [i for i in walk(lower(pg.kernel(source=text).program).body) if isinstance(i, For)]
    assert loop.trips == 20


def test_it_holds_in_a_pass_that_is_fused_and_in_one_that_arrives_as_data() -> None:
    text = LOOP.format(type="Annotated[int, Range(1, 64, 'taps')]")
    after = pg.kernel(source="def after(c: Image) -> float: return c[0, 0].r * 2.0")
    made = after(pg.kernel(source=text)(pg.Value("n", int)))
    for graph in (made, pg.from_data(json.loads(json.dumps(pg.to_data(made))))):
        with pg.compile(graph, size=(1, 1)) as program:
            assert program.plan.steps[0].fused
            assert program(n=7)["after"][0, 0, 0] == 14.0
            with pytest.raises(InputError, match="must be 1 to 64 taps, got 65"):
                program(n=65)
    for wrong in ("Range(64, 1)", "Range(1, 2, 3)", "Range('1')", "Range(None, None, '', 3)", "Range(exit())"):
        data = json.loads(json.dumps(pg.to_data(made)).replace("Range(1, 64, 'taps')", wrong))
        with pytest.raises(InputError, match="graph data"):
            pg.from_data(data)


def test_the_command_line_shows_and_checks_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "from typing import Annotated\nimport passgraph as pg\nfrom passgraph import Image, vec4\n\n@pg.kernel\n"
        "def mine(c: Image, taps: Annotated[int, pg.Range(3, 9, 'px')],\n"
        "         gain: Annotated[float, pg.Range(0.0, 2.0, 'stops')] = 1.0) -> vec4:\n    total = vec4(0)\n"
        "    for i in range(taps):\n        total += c[i, 0] * gain\n    return total\n"
    )
    assert run(["apply", str(file), "--help"]) == 0
    shown = capsys.readouterr().out
    assert "3<=x<=9" in shown
    assert "(px)" in shown
    assert "(stops)" in shown
    assert run(["apply", str(file), "--taps", "10", "in.png", "out.png"]) == 2
    assert "3<=x<=9" in capsys.readouterr().err
    # what has no default is given a value that it may have: 1 is not one
    assert run(["check", str(file), "--size", "8x6", "--backend", "numpy"]) == 0


def test_a_const_parameter_has_one_too() -> None:
    @pg.kernel
    def k(c: Image, n: Annotated[Const[int], pg.Range(1, 3)] = 2) -> vec4:
        return c[0, 0] * float(n)

    with pytest.raises(InputError, match="parameter 'n' must be 1 to 3, got 4"):
        k(pg.Input("c"), 4)
