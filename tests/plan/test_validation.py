"""What a plan refuses: every message names pass, target and mend."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import passgraph as pg
from passgraph import vec4
from passgraph.backends.null import NullBackend
from passgraph.formats import format_named
from passgraph.graph.targets import MAX_SIDE, PixelPass, Target
from passgraph.plan.build import build
from passgraph.plan.sizes import MAX_PICTURE_BYTES

copy = pg.kernel(source="def copy(color: Image) -> vec4: return color[0, 0]")
add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] + b[0, 0]")
scaled = pg.kernel(source="def scaled(color: Image, factor: float) -> vec4: return color[0, 0] * factor")
fill = pg.kernel(source="def fill(level: float) -> vec4: return vec4(level)")
frame = pg.Input("frame", "rgba32f", (8, 4))


@pg.kernel
def pair(color: pg.Image) -> tuple[vec4, vec4]:
    return color[0, 0], color[0, 0] * 2.0


def refusal(*outputs: Target, **options: object) -> str:
    named = {f"out{i}": target for i, target in enumerate(outputs)}
    with pytest.raises(pg.GraphError) as caught:
        build(named, **options)  # type: ignore[arg-type]
    return str(caught.value)


def test_nothing_to_compile() -> None:
    assert refusal() == "nothing to compile: give at least one target"


def test_an_output_that_no_pass_writes() -> None:
    with pytest.raises(
        pg.GraphError, match=r"target 'lost' is declared but not written; compile what its pass returned"
    ):
        build({"lost": pg.target("lost")})  # type: ignore[dict-item]


def test_an_output_that_is_no_target() -> None:
    with pytest.raises(pg.GraphError, match="output 'x' must be a target, got int"):
        build({"x": 3})  # type: ignore[dict-item]


def test_an_output_that_is_an_input_or_history() -> None:
    assert refusal(frame) == "output 'out0' is an input, which no pass computes; put a pass behind it"
    last = pg.previous(pg.target("t"))
    assert refusal(last) == "output 'out0' is an earlier frame's content, which no pass computes; put a pass behind it"


def test_a_cycle_is_named_pass_by_pass() -> None:
    first = copy(frame, name="first")
    second = copy(first, name="second")
    assert isinstance(first.made_by, PixelPass)
    forged = first.made_by.images
    assert isinstance(forged, dict)
    forged["color"] = second
    text = refusal(second)
    assert text.startswith("passes form a cycle: ")
    assert "first" in text
    assert "second" in text
    assert text.endswith("; read last frame's content with pg.previous() where it closes")


def test_an_input_without_size() -> None:
    open_input = pg.Input("open")
    assert refusal(copy(open_input)) == (
        "input 'open' has no size or format yet; run the program with it, or declare them: "
        "pg.Input('open', 'rgba32f', (w, h))"
    )


def test_two_inputs_of_one_name() -> None:
    other = pg.Input("frame", "rgba32f", (8, 4))
    assert refusal(add(frame, other)) == (
        "two different inputs are called 'frame'; use one handle, or give them two names"
    )


def test_two_targets_of_one_name() -> None:
    one = copy(frame, into=pg.target("t"), name="one")
    two = copy(one, into=pg.target("t"), name="two")
    assert refusal(add(one, two, into=pg.target("sum"))) == (
        "two different targets are called 't' (one in pass 'two'); give them two names"
    )


def test_two_values_of_one_name() -> None:
    first = scaled(frame, pg.Value("gain", float), into=pg.target("a"))
    second = scaled(first, pg.Value("gain", float, static=True), into=pg.target("b"), name="second")
    assert refusal(second) == (
        "two different values are called 'gain' (one in pass 'second'); use one handle, or give them two names"
    )
    assert build({"x": scaled(scaled(frame, pg.Value("gain")), pg.Value("gain"), into=pg.target("y"))})


def test_a_value_called_like_an_input() -> None:
    assert refusal(scaled(frame, pg.Value("frame"))) == (
        "an input and a value are both called 'frame'; give them two names"
    )


def test_no_size_known() -> None:
    assert refusal(fill(1.0)) == "the output's size is not known: give pg.compile(..., size=(width, height))"


def test_targets_of_different_sizes_in_one_pass() -> None:
    into = (pg.target("small", size=(2, 2)), pg.target("large", size=(4, 4)))
    assert refusal(*pair(frame, into=into)) == (
        "pass 'small+large' writes targets of different sizes (small 2x2, large 4x4); give them one size"
    )


def test_relative_offsets_need_equal_sizes() -> None:
    assert refusal(copy(frame, into=pg.target("half", scale=0.5))) == (
        "pass 'half' reads 'frame' (8x4) by relative offsets and is 4x2 itself; "
        "read it by .sample(uv()) or make the sizes equal"
    )


def test_a_size_may_be_taken_from_what_is_made_later_in_the_graph() -> None:
    half = copy(frame, into=pg.target("half", "rgba32f", (3, 5)))
    late = fill(2.0, into=pg.target("late", like=half), name="later")
    early = fill(1.0, into=pg.target("early", like=late), name="sooner")
    for outputs in ({"early": early, "late": late}, {"late": late, "early": early}):
        with pg.compile(outputs, "null") as program:
            assert {step.size for step in program.plan.steps} == {(3, 5)}


def test_a_size_taken_from_what_nothing_makes() -> None:
    late = copy(frame, into=pg.target("late", "rgba32f"), name="later")
    early = fill(1.0, into=pg.target("early", like=late), name="sooner")
    text = refusal(early, size=(8, 4))
    assert text == "pass 'sooner' takes its size from 'late', which no pass before it makes; give that one a size"


def test_a_target_too_large() -> None:
    huge = fill(1.0, into=pg.target("huge", "rgba32f", scale=16.0))
    assert refusal(huge, size=(20_000, 10)) == (
        f"target 'huge' would be 320000x160 rgba32f (0.8 GiB); "
        f"the limits are {MAX_SIDE} a side and {MAX_PICTURE_BYTES >> 30} GiB"
    )


def test_history_that_nothing_writes() -> None:
    never = pg.target("never", size=(8, 4))
    assert refusal(add(frame, pg.previous(never))) == (
        "an earlier frame's 'never' is read, and no pass behind the outputs writes it; compile its pass too"
    )


# compile()


def test_compile_wants_what_passes_returned() -> None:
    with pytest.raises(pg.GraphError, match="compile takes targets that passes returned, got target 't' is declared"):
        pg.compile(pg.target("t"), backend=NullBackend())  # type: ignore[arg-type]
    with pytest.raises(pg.GraphError, match="compile takes targets that passes returned, got 3"):
        pg.compile([3], backend=NullBackend())  # type: ignore[list-item]


def test_compile_wants_names_that_differ() -> None:
    one, two = copy(frame, into=pg.target("t")), copy(frame, into=pg.target("t"))
    with pytest.raises(pg.GraphError, match="two outputs are called 't'; give a mapping"):
        pg.compile([one, two], backend=NullBackend())


@pytest.mark.parametrize("size", [(0, 4), (4, MAX_SIDE + 1), (1.5, 2), "8x4", (True, 2)])
def test_compile_checks_the_size(size: object) -> None:
    with pytest.raises(pg.GraphError, match="the output"):
        pg.compile(copy(frame), backend=NullBackend(), size=size)  # type: ignore[arg-type]


def test_compile_without_size_says_so_at_once() -> None:
    with pytest.raises(pg.GraphError, match="the output's size is not known"):
        pg.compile(fill(1.0), backend=NullBackend())


# Running


def test_read_before_the_first_run() -> None:
    open_input = pg.Input("open")
    with (
        pg.compile(copy(open_input), backend=NullBackend()) as program,
        pytest.raises(pg.GraphError, match="nothing has run yet"),
    ):
        program.read()


def test_read_of_what_is_no_output() -> None:
    program = pg.compile(copy(frame), backend=NullBackend())
    with program, pytest.raises(pg.GraphError, match="there is no output 'x'; there are copy"):
        program.read("x")


def test_a_closed_program() -> None:
    program = pg.compile(copy(frame), backend=NullBackend())
    program.close()
    program.close()
    with pytest.raises(pg.GraphError, match="this program is closed"):
        program.run(frame=np.zeros((4, 8, 4), np.float32))


def test_set_names_what_is_missing() -> None:
    with pg.compile(scaled(frame, 1.0), backend=NullBackend()) as program:
        with pytest.raises(pg.GraphError, match="there is no pass 'x'; there are scaled"):
            program.set("x", "factor", 1.0)
        with pytest.raises(pg.GraphError, match="pass 'scaled' has no parameter 'x' to set; it has factor"):
            program.set("scaled", "x", 1.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "input 'frame' is missing; run the program as program(frame=picture)"),
        ({"frame": "photo.png"}, "input 'frame' must be an array (height, width, channels) of numbers"),
        (
            {"frame": 7},
            "got 7. For a texture of OpenGL give host.texture(...) of the pg.gl.Host that the program runs on",
        ),
        ({"frame": np.zeros((4, 8, 3), np.float32)}, "input 'frame' is rgba32f with 4 channel(s), got 3"),
        ({"frame": np.zeros((5, 8, 4), np.float32)}, "input 'frame' is declared 8x4 pixels, got 8x5"),
        (
            {"frame": np.zeros((0, 8, 4), np.float32)},
            "input 'frame' must have 1 to 4 channels and at least one pixel",
        ),
        ({"frame": np.zeros((4, 8, 4), np.int32)}, "input 'frame' has dtype int32; give float32"),
        (
            {"frame": np.zeros((4, 8, 4), np.float32)},
            "value 'gain' is missing; run the program as program(gain=...)",
        ),
        (
            {"frame": np.zeros((4, 8, 4), np.float32), "gain": 1.0, "more": 2},
            "there is no input or value 'more' in this graph; it takes frame, gain",
        ),
        ({"frame": np.zeros((4, 8, 4), np.float32), "gain": "much"}, "factor of pass 'scaled' must be float"),
        (
            {"frame": np.zeros((4, 8, 4), np.float32), "gain": (1.0, 2.0)},
            "factor of pass 'scaled' must be float",
        ),
    ],
)
def test_runs_name_what_does_not_fit(given: dict[str, object], message: str) -> None:
    with pg.compile(scaled(frame, pg.Value("gain")), backend=NullBackend()) as program:
        with pytest.raises(pg.InputError) as caught:
            program(**given)
        assert message in str(caught.value)


def test_a_value_of_another_class() -> None:
    lamp = pg.Value("lamp", SimpleNamespace).map(lambda given: given.power)
    program = pg.compile(scaled(frame, lamp), backend=NullBackend())
    with program, pytest.raises(pg.InputError, match="value 'lamp' must be a SimpleNamespace, got float"):
        program(frame=np.zeros((4, 8, 4), np.float32), lamp=1.0)


def test_a_plan_that_fails_leaves_a_usable_program() -> None:
    """The first run binds a size that does not fit, the second one that does."""
    open_input = pg.Input("open", "rgba32f")
    made = add(open_input, frame)
    with pg.compile(made, backend=NullBackend()) as program:
        good, picture = np.zeros((4, 8, 4), np.float32), np.zeros((4, 8, 4), np.float32)
        for _ in range(2):
            with pytest.raises(pg.GraphError, match="by relative offsets"):
                program(open=np.zeros((3, 3, 4), np.float32), frame=picture)
        assert program(open=good, frame=picture)["add"].shape == (4, 8, 4)


def test_a_format_that_is_not_there_is_close_to_one_that_is() -> None:
    with pytest.raises(
        pg.GraphError,
        match="there is no format 'rgb_16f' \\(did you mean",
    ):
        format_named("rgb_16f")


def test_handles_keep_their_content_apart_from_their_border() -> None:
    made = copy(frame)
    assert made.border("zero").content == made
    assert replace(made, border_rule="zero") == made.border("zero")
