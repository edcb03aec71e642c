"""`Program.inspect` against what NumPy makes of the same lines, and against the picture that the reference makes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference.traced import KEPT_TRIPS, Branch, Loop
from passgraph.commands.entry import run
from passgraph.effects import bloom

FRAME = np.random.default_rng(5).random((6, 9, 4), np.float32)
TEXT = """
class Light:
    color: vec3
    power: float

def brighter(x: vec3, gain: float) -> vec3:
    if gain > 2.0:
        return x * 2.0
    gain += 1.0
    return x * gain

def look(c: Image, weights: vec3 = (0.25, 0.5, 0.25), n: Const[int] = 9) -> vec4:
    s = vec3(0.0)
    for i in range(n):
        if i == 7:
            break
        s += c[i - 2, 0].rgb * weights
    unlit = Light(s, 0.5)
    q = brighter(unlit.color, unlit.power)
    t, u = q.x, q.y
    if t > 1.0:
        t = 1.0
    elif t > 0.5:
        t *= 0.5
    e = c.sample(uv()).r
    return vec4(t, u, e, 1.0)
"""


def inspected(x: int, y: int, text: str = TEXT, frame: np.ndarray = FRAME, **known: object) -> pg.run.Inspection:  # type: ignore[name-defined]
    made = pg.kernel(source=text)(pg.Input("frame"), into=pg.target("made", "rgba32f"), **known)
    with pg.compile(made, "reference", non_finite="keep") as program:
        return program.inspect(x, y, frame=frame)


def near(found: object, expected: object) -> bool:
    return bool(np.allclose(found, expected, rtol=1e-12, atol=0, equal_nan=True))


def test_values_are_those_of_numpy() -> None:
    found = inspected(5, 3)
    weights, s = np.array([0.25, 0.5, 0.25]), np.zeros(3)
    partial = [s]
    for i in range(7):
        s = s + FRAME[3, np.clip(5 + i - 2, 0, 8), :3].astype(np.float64) * weights
        partial.append(s)
    kept = [partial[at] for at in (0, 1, 2, 7)]  # before the loop, of the first trips and the last that added
    assert near(found.values("s"), kept)
    (color,), (power,) = found.values("unlit.color"), found.values("unlit.power")
    assert near(color, s) and power == 0.5
    (t, *_), (u,) = found.values("t"), found.values("u")
    assert near(t, s[0] * 1.5) and near(u, s[1] * 1.5) and found.values("gain") == [0.5, 1.5]
    assert near(found.parameters["weights"], weights) and found.parameters["n"] == 9
    assert near(found.results["made"][3], 1.0)


def test_branches_say_which_way_and_loops_how_often() -> None:
    found = inspected(5, 3)
    loop = next(event for event in found.events if isinstance(event, Loop))
    assert (loop.name, loop.count, [index for index, _ in loop.trips]) == ("i", 8, [0, 1, 6, 7])
    assert [[e.holds for e in events if isinstance(e, Branch)] for _, events in loop.trips] == [[False]] * 3 + [[True]]
    outside = [(e.span.text.strip(), e.holds) for e in found.events if isinstance(e, Branch)]
    t = found.values("t")[0]
    assert outside[0] == ("if gain > 2.0:", False) and outside[1] == ("if t > 1.0:", t > 1.0)
    assert [text for text, _ in outside[2:]] == ([] if t > 1.0 else ["elif t > 0.5:"])


@pytest.mark.parametrize("size", [(1, 1), (9, 6), (2, 5)])
def test_every_pixel_is_that_of_the_reference(size: tuple[int, int]) -> None:
    width, height = size
    frame = np.random.default_rng(7).random((height, width, 4), np.float32)
    made = pg.kernel(source=TEXT)(pg.Input("frame"), into=pg.target("made", "rgba16f"))
    with pg.compile(made, "reference") as program:
        picture = program(frame=frame)["made"]
        for y in range(height):
            for x in range(width):
                assert near(program.inspect(x, y, frame=frame).stored["made"], picture[y, x])


def test_the_text_shows_lines_of_the_source() -> None:
    lines = str(inspected(5, 3)).splitlines()
    assert lines[0] == "pass made at (5, 3) of 9x6: kernel look, <kernel text>:12"
    assert "  n = 9" in lines and "  weights = (0.25, 0.5, 0.25)" in lines
    (loop,) = (line for line in lines if line.startswith("   14      for i in range(n):"))
    assert loop.endswith("  8 trips")
    assert "             … 4 more" in lines and "             i = 7:" in lines
    assert any(line.startswith("   19      q = brighter(unlit.color, unlit.power)  ") for line in lines)
    assert "<passgraph library>" not in str(lines) and "returned" not in str(lines)
    assert lines[-1].startswith("made = (") and "held as (" in lines[-1]


@pytest.mark.parametrize(("trips", "kept"), [(0, 0), (1, 1), (3, 3), (5, 4), (9_000, 2 * KEPT_TRIPS)])
def test_long_loops_cost_no_memory(trips: int, kept: int) -> None:
    text = (
        f"def k(c: Image) -> vec4:\n    s = 0.0\n    for i in range({trips}):\n        s += 1.0\n    return vec4(s)\n"
    )
    found = inspected(0, 0, text)
    (loop,) = (event for event in found.events if isinstance(event, Loop))
    assert (loop.count, len(loop.trips), found.results["made"][0]) == (trips, kept, trips)


def test_nan_and_whole_numbers_are_told_as_they_are() -> None:
    text = "def k(c: Image) -> vec4:\n    n = -2147483648 - 1\n    b = c[0, 0].r > 0.0\n    return c[0, 0] * float(n)\n"
    found = inspected(0, 0, text, np.full((1, 1, 4), np.nan, np.float32))
    assert found.values("n") == [2**31 - 1] and found.values("b") == [False]
    assert "n = 2147483647" in str(found) and "b = False" in str(found) and "made = (nan, nan, nan, nan)" in str(found)


def test_values_of_the_run_and_set_parameters_count() -> None:
    text = "def k(c: Image, gain: float, power: float = 2.0) -> vec4: return c[0, 0] * gain * power"
    made = pg.kernel(source=text)(pg.Input("frame"), pg.Value("gain"), name="k")
    for backend in ("numpy", "gl"):
        with pg.compile(made, backend) as program:
            program(frame=FRAME, gain=1.0)
            program.set("k", "power", 8.0)
            assert program.inspect(1, 2, frame=FRAME, gain=0.5).parameters == {"gain": 0.5, "power": 8.0}


def test_a_pass_in_the_middle_reads_what_the_reference_made() -> None:
    with pg.compile(bloom(pg.Input("frame")), "reference") as program:
        seen: dict[str, np.ndarray] = {}
        observed = pg.compile(bloom(pg.Input("frame")), "reference", options=pg.Options(fuse=False, alias=False))
        observed.run(lambda step, pictures: seen.update(pictures), frame=FRAME)
        found = program.inspect(1, 1, "bloom_down1", frame=FRAME)
        (name,) = found.stored
        assert near(found.stored[name], seen[name][1, 1])
        observed.close()


def test_draws_feed_passes() -> None:
    from passgraph.effects import soft_shadow

    scene = pg.Scene.shipped()
    with pg.compile(soft_shadow(scene, map_size=16), "reference", size=(16, 9)) as program:
        given = (
            {"camera": scene.camera, "light": scene.lights[0]} if len(scene.lights) == 1 else {"camera": scene.camera}
        )
        given |= {f"light{i}": light for i, light in enumerate(scene.lights)} if len(scene.lights) > 1 else {}
        known = {name: value for name, value in given.items() if name in program.plan.values}
        picture = next(iter(program(**known).values()))
        found = program.inspect(8, 5, **known)
        assert near(next(iter(found.stored.values())), picture[5, 8])


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ((9, 0), r"inspect: x, in pass 'look' must be a whole number from 0 to 8, got 9"),
        ((0, -1), r"inspect: y, in pass 'look' must be a whole number from 0 to 5, got -1"),
        ((0.5, 0), r"must be a whole number from 0 to 8, got 0.5"),
        ((0, 0, "lok"), r"there is no pass 'lok' \(did you mean 'look'\?\); there are look"),
        ((0, 0, 3), r"there is no pass 3; there are look"),
    ],
)
def test_what_is_not_there_is_refused(place: tuple[object, ...], words: str) -> None:
    with pg.compile(pg.kernel(source=TEXT, name="look")(pg.Input("frame"))) as program:
        with pytest.raises(pg.GraphError, match=words):
            program.inspect(*place, frame=FRAME)  # type: ignore[arg-type]
        with pytest.raises(pg.InputError, match="input 'frame' is missing"):
            program.inspect(0, 0)


def test_the_command_shows_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    pg.save("in.png", np.ones((2, 3, 4), np.float32))
    Path("mine.txt").write_text(
        "def twice(c: Image, gain: float = 2.0) -> vec4:\n    d = c[0, 0]\n    return d * gain\n"
    )
    assert run(["inspect", "mine.txt:twice", "in.png", "--at", "2,1", "--gain", "0.5"]) == 0
    assert capsys.readouterr().out == (
        "pass twice at (2, 1) of 3x2: kernel twice, mine.txt:1\n"
        "  gain = 0.5\n"
        f"    2  {'    d = c[0, 0]':<56}  d = (1, 1, 1, 1)\n"
        f"    3  {'    return d * gain':<56}  returns (0.5, 0.5, 0.5, 0.5)\n"
        "twice = (0.5, 0.5, 0.5, 0.5)\n"
    )
    for at, words in (("3,0", "from 0 to 2, got 3"), ("1", "is not X,Y"), ("-1,0", "is not X,Y"), ("²,1", "is not X")):
        assert run(["inspect", "mine.txt", "in.png", "--at", at]) == 2
        assert words in capsys.readouterr().err
