"""What earlier runs wrote, what stands there before, and the number of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.files.sequences import Arrays, Pictures, ToArrays, ToPictures

ADD = pg.kernel(source="def add(a: Image, b: Image) -> float: return a[0, 0].r + b[0, 0].r")
KEPT = pg.kernel(source="def kept(a: Image) -> float: return a[0, 0].r")
NUMBERED = pg.kernel(source="def numbered(a: Image, run: int) -> float: return a[0, 0].r * 0.0 + float(run)")
FRAME = np.ones((3, 5, 1), np.float32)


def numbered() -> pg.Target:
    made: pg.Target = NUMBERED(pg.Input("frame"), pg.FRAME_INDEX, into=pg.target("out", "r32f"))
    return made


@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl", "webgpu", "reference"])
@pytest.mark.parametrize("ago", [1, 2, 5])
def test_a_run_sees_what_was_written_so_many_runs_ago(backend: str, ago: int) -> None:
    now = KEPT(pg.Input("frame"), into=pg.target("now", "r32f", initial=7.0))
    late = KEPT(pg.previous(now, ago), into=pg.target("late", "r32f"))
    with pg.compile({"late": late, "now": now}, backend=backend) as program:
        seen = [float(program(frame=FRAME * n)["late"][2, 4, 0]) for n in range(8)]
        assert seen == [7.0] * ago + [float(n) for n in range(8 - ago)]
        program.reset()
        assert float(program(frame=FRAME)["late"][0, 0, 0]) == 7.0


@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl", "webgpu", "reference"])
def test_a_program_goes_on_where_another_one_stands(backend: str) -> None:
    """Of targets with one name, size and format; of one kept for several runs each of them."""

    def late_by_two(name: str = "now", form: str = "r32f") -> dict[str, pg.Target]:
        now = KEPT(pg.Input("frame", "r32f", (5, 3)), into=pg.target(name, form, initial=7.0))
        return {"late": KEPT(pg.previous(now, 2), into=pg.target("late", "r32f")), "now": now}

    with pg.compile(late_by_two(), backend=backend) as first:
        for number in (1, 2, 3):
            first(frame=FRAME * number)
        for outputs, seen in ((late_by_two(), [2.0, 3.0, 4.0]), (late_by_two(form="r16f"), [7.0, 7.0, 4.0])):
            with pg.compile(outputs, backend=first.backend) as second:
                second.continue_from(first)
                assert [float(second(frame=FRAME * n)["late"][0, 0, 0]) for n in (4, 5, 6)] == seen
        with pg.compile(late_by_two(), backend=first.backend) as used:
            for number in (90, 91, 92):
                used(frame=FRAME * number)
            used.continue_from(first)
            assert [float(used(frame=FRAME * n)["late"][0, 0, 0]) for n in (4, 5, 6)] == [2.0, 3.0, 4.0]
        with pg.compile(numbered(), backend=first.backend) as counting:
            counting(frame=FRAME)
            counting.continue_from(first)
            assert float(counting(frame=FRAME)["out"][0, 0, 0]) == 3.0
        with pg.compile(late_by_two()) as elsewhere, pytest.raises(pg.GraphError, match="history stays on its backend"):
            elsewhere.continue_from(first)


def test_what_is_read_only_from_far_keeps_what_lies_between() -> None:
    now = KEPT(pg.Input("frame"), into=pg.target("now", "r32f"))
    late = KEPT(pg.previous(now, 3), into=pg.target("late", "r32f"))
    with pg.compile({"late": late, "now": now}) as program:
        program(frame=FRAME)
        kinds = [(r.name, r.kind) for r in program.plan.resources if "now" in r.name]
    assert sorted(kinds) == [
        ("2 frames ago now", "history"), ("3 frames ago now", "history"), ("now", "target"),
        ("previous now", "history"),
    ]  # fmt: skip


def test_history_starts_from_a_picture_rounded_as_its_format_says() -> None:
    began = np.linspace(0, 1, 15, dtype=np.float32).reshape(3, 5)
    state = pg.target("state", "r8", initial=began)
    late = KEPT(pg.previous(state), into=pg.target("late", "r32f"))
    with pg.compile({"late": late, "state": KEPT(pg.Input("frame"), into=state)}) as program:
        began[:] = 0.0  # the target has its own
        seen = program(frame=FRAME)["late"][:, :, 0]
    assert np.array_equal(np.round(seen * 255), np.round(np.linspace(0, 1, 15, dtype=np.float32) * 255).reshape(3, 5))


@pytest.mark.parametrize(
    ("initial", "said"),
    [
        ((1.0, 2.0), "starts from 1 or 4 numbers, got 2"),
        ("red", "initial"),
        (np.zeros((3, 5, 2)), r"starts from a picture \(height, width, 4\), got \(3, 5, 2\)"),
        (np.full((3, 5, 4), np.nan), "NaN"),
    ],
)
def test_what_cannot_stand_in_a_target_is_refused(initial: object, said: str) -> None:
    with pytest.raises(pg.GraphError, match=said):
        pg.target("state", "rgba16f", initial=initial)


def test_a_picture_of_another_size_is_refused_when_planned() -> None:
    state = pg.target("state", "r32f", initial=np.zeros((4, 4)))
    total = ADD(pg.previous(state), pg.Input("frame"), into=state)
    with pytest.raises(pg.GraphError, match="starts from a picture of 4x4 pixels and is 5x3"):
        pg.compile(total)(frame=FRAME)


@pytest.mark.parametrize("ago", [0, -1, 65, 1.5, True])
def test_runs_out_of_reach_are_refused(ago: object) -> None:
    with pytest.raises(pg.GraphError, match="frames_ago"):
        pg.previous(pg.target("t"), ago)  # type: ignore[arg-type]


def test_runs_are_counted_where_they_end_well() -> None:
    with pg.compile(numbered()) as program:
        assert [float(program(frame=FRAME)["out"][0, 0, 0]) for _ in range(3)] == [0.0, 1.0, 2.0]
        with pytest.raises(pg.InputError):
            program(frame=FRAME, other=1.0)
        assert float(program(frame=FRAME)["out"][0, 0, 0]) == 3.0
        assert float(program(frame=FRAME, frame_index=40)["out"][0, 0, 0]) == 40.0
        program.reset()
        assert float(program(frame=FRAME)["out"][0, 0, 0]) == 0.0


def test_history_and_the_number_travel() -> None:
    state = pg.target("state", "r32f", initial=np.full((3, 5, 1), 2.0))
    total = ADD(pg.previous(state, 2), numbered(), into=state)
    with pg.compile(total) as here, pg.compile(pg.from_data(pg.to_data({"state": total}))) as there:
        for _ in range(4):
            assert np.array_equal(here(frame=FRAME)["state"], there(frame=FRAME)["state"])


@pytest.mark.parametrize("ago", [0, 65, "1", True, 1.5])
def test_strangers_cannot_ask_for_runs_out_of_reach(ago: object) -> None:
    state = pg.target("state", "r32f")
    data = pg.to_data({"state": ADD(pg.previous(state), pg.Input("frame"), into=state)})
    data["passes"][0]["images"]["a"]["frames_ago"] = ago
    with pytest.raises(pg.InputError, match="frames_ago"):
        pg.from_data(data)


def test_frames_that_are_left_out_count(tmp_path: Path) -> None:
    paths = {number: tmp_path / f"in{number}.exr" for number in (11, 12, 13, 14)}
    outputs = {number: tmp_path / f"out{number}.png" for number in paths}
    for path in paths.values():
        pg.save(path, np.repeat(FRAME, 3, 2))
    kernel = pg.kernel(source="def told(a: Image, run: int) -> vec4: return vec4(vec3(float(run) / 255.0), 1.0)")
    graph = kernel(pg.Input("frame"), pg.FRAME_INDEX, into=pg.target("out", "rgba8"))
    with pg.compile(graph) as program:
        for _ in range(2):
            assert pg.frames(program, Pictures(paths), ToPictures(outputs), resume=True).whole
            outputs[13].unlink()
        pg.frames(program, Pictures(paths), ToPictures(outputs), resume=True)
    seen = [round(float(pg.load(path)[0, 0, 0]) * 255) for path in outputs.values()]
    assert len(set(seen)) == 4


def test_tiles_of_a_picture_are_one_frame() -> None:
    into = pg.target("out", "r32f", scale=1.0)
    graph = NUMBERED(pg.Input("frame"), pg.FRAME_INDEX, into=into)
    out = np.full((70, 70, 1), -1.0, np.float32)
    pg.tiled(graph, {"frame": np.ones((70, 70, 1), np.float32)}, {"out": out}, tile=(32, 32))
    assert np.array_equal(np.unique(out), [0.0])


def test_a_sequence_begins_at_0() -> None:
    sink = ToArrays()
    with pg.compile(numbered()) as program:
        program(frame=FRAME)
        pg.frames(program, Arrays([FRAME] * 3), sink)
    assert [float(picture[0, 0, 0]) for picture in sink.pictures] == [0.0, 1.0, 2.0]
