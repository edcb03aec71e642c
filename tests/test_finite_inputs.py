"""NaN and infinity: refused where pictures enter, replaced on demand, traced to the pass that makes them."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.commands.entry import run
from passgraph.effects import gaussian_blur, planar, soft_shadow
from passgraph.run.finite_checks import HALF_OVERFLOW, LARGEST_FLOAT, LARGEST_HALF, find
from tests.conftest import SLOW_ON_OPENCL
from tests.effects.scenes import Picture, cube, floor, from_above, sun

copy = pg.kernel(source="def copy(color: Image) -> vec4: return color[0, 0]")
ratio = pg.kernel(source="def ratio(a: Image, b: Image) -> vec4: return a[0, 0] / b[0, 0]")
FRAME = pg.Input("frame")


def plain(width: int = 24, height: int = 16) -> Picture:
    return np.full((height, width, 4), 0.5, np.float32)


def spoiled(value: float = np.nan) -> Picture:
    picture = plain()
    picture[7, 11, 1] = value
    return picture


def blurred(backend: Backend, picture: Picture, **options: Any) -> Picture:
    made = gaussian_blur(FRAME, 1.5, 4)
    with pg.compile(made, backend, **options) as program:
        return program(frame=picture)[made.name]


def test_kept_one_nan_spreads_over_all_that_a_blur_reaches(backend: Backend) -> None:
    """What the check is for: 9 × 9 pixels are lost to one, and no more than that."""
    shown = blurred(backend, spoiled(), non_finite="keep")
    lost = np.isnan(shown[:, :, 1])
    expected = np.zeros_like(lost)
    expected[3:12, 7:16] = True
    np.testing.assert_array_equal(lost, expected)
    assert np.isfinite(shown[:, :, [0, 2, 3]]).all()


@pytest.mark.parametrize(("value", "text"), [(np.nan, "nan"), (np.inf, "inf"), (-np.inf, "-inf")])
def test_it_is_refused_by_name_pixel_and_reader(backend: Backend, value: float, text: str) -> None:
    message = (
        rf"input 'frame': 1 of 1536 values is not finite, the first at column 11, row 7, channel g: {text}; "
        r"pass 'gaussian_blur_x' reads it\. Mend the picture, or compile with non_finite='replace'"
    )
    with pytest.raises(pg.InputError, match=message):
        blurred(backend, spoiled(value))


def test_the_first_is_that_of_the_upper_row() -> None:
    picture = plain()
    picture[9, 1, 0] = picture[2, 20, 3] = np.inf
    with pytest.raises(pg.InputError, match=r"2 of 1536 values are not finite, the first at column 20, row 2, channel"):
        _run_once(copy(FRAME), picture)


def test_every_reader_is_named() -> None:
    readers = [copy(FRAME, into=pg.target(f"t{i}", "rgba32f"), name=f"reader {i}") for i in range(6)]
    with pytest.raises(pg.InputError, match=r"passes 'reader \d', 'reader \d', 'reader \d', 'reader \d' and 2 more"):
        _run_once(readers, spoiled())


def _run_once(outputs: Any, picture: Any, **options: Any) -> Picture:
    with pg.compile(outputs, "reference", **options) as program:
        return next(iter(program(frame=picture).values()))


@pytest.mark.parametrize(
    ("value", "becomes"), [(np.nan, 0.0), (np.inf, LARGEST_FLOAT), (-np.inf, -LARGEST_FLOAT), (3.0, 3.0)]
)
def test_replaced_nan_is_0_and_infinity_the_largest_number(backend: Backend, value: float, becomes: float) -> None:
    with pg.compile(copy(FRAME, into=pg.target("shown", "rgba32f")), backend, non_finite="replace") as program:
        shown = program(frame=spoiled(value))["shown"]
    expected = plain()
    expected[7, 11, 1] = becomes
    np.testing.assert_array_equal(shown, expected)


def test_a_replaced_nan_leaves_its_neighbours_to_the_blur(backend: Backend) -> None:
    black = plain()
    black[7, 11, 1] = 0.0
    np.testing.assert_array_equal(blurred(backend, spoiled(), non_finite="replace"), blurred(backend, black))


@pytest.mark.parametrize("value", [HALF_OVERFLOW, 1e9, -7e4])
def test_what_a_half_float_input_cannot_hold_counts_as_infinite(backend: Backend, value: float) -> None:
    made = copy(pg.Input("frame", "rgba16f"), into=pg.target("shown", "rgba32f"))
    with pg.compile(made, backend) as program:
        with pytest.raises(
            pg.InputError, match=rf"channel g: {value:g}".replace("+", r"\+") + " in rgba16f; pass 'shown'"
        ):
            program(frame=spoiled(value))
        largest = np.nextafter(np.float32(HALF_OVERFLOW), np.float32(0))
        assert program(frame=spoiled(largest))["shown"][7, 11, 1] == LARGEST_HALF
    with pg.compile(made, backend, non_finite="replace") as program:
        assert program(frame=spoiled(value))["shown"][7, 11, 1] == np.sign(value) * LARGEST_HALF


def test_large_finite_values_are_no_mistake() -> None:
    """Their squares overflow, so the fast look is not enough."""
    assert find(np.full((2, 2, 4), LARGEST_FLOAT, np.float32)) is None
    assert _run_once(copy(FRAME, into=pg.target("t", "rgba32f")), spoiled(-3e38))[7, 11, 1] == np.float32(-3e38)


def test_float64_beyond_float32_counts_as_infinite() -> None:
    with pytest.raises(pg.InputError, match="channel g: inf"):
        _run_once(copy(FRAME), spoiled().astype(np.float64) * 0.0 + 1e300 * (np.arange(4) == 1))


def test_8_bit_pictures_and_inputs_are_not_looked_through(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("looked through")

    monkeypatch.setattr("passgraph.run.finite_checks.find", never)
    _run_once(copy(FRAME), np.zeros((2, 2, 4), np.uint8))
    _run_once(copy(pg.Input("frame", "rgba8")), np.zeros((2, 2, 4), np.float32))


def test_a_static_input_is_looked_through_once(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[object] = []
    monkeypatch.setattr("passgraph.run.finite_checks.find", lambda picture, _=None: seen.append(picture))
    fixed, picture = copy(pg.Input("frame", static=True)), plain()
    with pg.compile(fixed, "reference") as program:
        for _ in range(3):
            program.run(frame=picture)
        assert len(seen) == 1
        program.run(frame=picture.copy())
    assert len(seen) == 2


def test_a_program_runs_on_behind_a_refused_picture(backend: Backend) -> None:
    """History too: the refused frame has left nothing in it."""
    spec = pg.target("sum", "rgba32f")
    add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] + b[0, 0]")
    with pg.compile(add(FRAME, pg.previous(spec), into=spec), backend) as program:
        program.run(frame=plain())
        with pytest.raises(pg.InputError, match="not finite"):
            program.run(frame=spoiled())
        np.testing.assert_array_equal(program(frame=plain())["sum"], np.full((16, 24, 4), 1.0, np.float32))


def test_an_unknown_choice_is_refused() -> None:
    with pytest.raises(pg.GraphError, match="non_finite cannot be 'ignore'; it is one of error, replace, keep"):
        pg.compile(copy(FRAME), "null", non_finite="ignore")  # type: ignore[arg-type]


def test_looking_through_a_full_picture_is_one_reduction(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is read once and nothing of its size is made: every other step of NumPy's sees a single number."""
    picture = np.random.default_rng(1).random((1080, 1920, 4), np.float32)
    read: list[int] = []

    class Counted(np.ndarray):  # type: ignore[type-arg]
        def __array_ufunc__(self, ufunc: Any, method: str, *given: Any, **options: Any) -> Any:
            read.append(max(getattr(one, "size", 1) for one in given))
            plain = [one.view(np.ndarray) if isinstance(one, Counted) else one for one in given]
            return getattr(ufunc, method)(*plain, **options)

        def __array_function__(self, function: Any, _: Any, given: Any, options: Any) -> Any:
            read.append(max(getattr(one, "size", 1) for one in given))
            plain = [one.view(np.ndarray) if isinstance(one, Counted) else one for one in given]
            return function(*plain, **options)

    monkeypatch.setattr(np, "ascontiguousarray", lambda one: one)  # it would make a plain array of ours
    tracemalloc.start()
    try:
        assert find(picture.view(Counted)) is None
        assert tracemalloc.get_traced_memory()[1] < 2**16
    finally:
        tracemalloc.stop()
    assert read == [picture.size]


# The pass that makes one


def chain() -> pg.Target:
    top = copy(FRAME, into=pg.target("top", "rgba32f"))
    made = ratio(top, pg.Input("below"), into=pg.target("quotient", "rgba32f"), name="divide")
    return gaussian_blur(made, 1.5, 4)


def test_the_first_pass_that_makes_one_is_named(backend: Backend) -> None:
    below = plain()
    below[3, 5, 2] = 0.0
    message = (
        r"pass 'divide' makes values that are not finite in target 'quotient' \(rgba32f\) from finite ones: "
        r"1 of 1536 values is not finite, the first at column 5, row 3, channel b: inf"
    )
    with pg.compile(chain(), backend, check_finite=True) as program:
        with pytest.raises(pg.GraphError, match=message):
            program.run(frame=plain(), below=below)
        program.run(frame=plain(), below=plain())  # and a run without one goes through


def test_overflow_of_a_half_target_is_made_by_its_pass(backend: Backend) -> None:
    bright = spoiled(7e4)
    with (
        pg.compile(copy(FRAME, into=pg.target("half", "rgba16f")), backend, check_finite=True) as program,
        pytest.raises(pg.GraphError, match=r"pass 'half' .* target 'half' \(rgba16f\).* row 7, channel g: inf"),
    ):
        program.run(frame=bright)


def test_a_pass_that_only_spreads_is_not_blamed(backend: Backend) -> None:
    with pg.compile(gaussian_blur(FRAME, 1.5, 4), backend, non_finite="keep", check_finite=True) as program:
        program.run(frame=spoiled())


def test_history_that_spreads_is_not_blamed_in_the_next_run() -> None:
    spec = pg.target("sum", "rgba32f")
    add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] + b[0, 0]")
    made = add(FRAME, pg.previous(spec), into=spec)
    with pg.compile(made, "reference", non_finite="keep", check_finite=True) as program:
        program.run(frame=spoiled())
        shown = program(frame=plain())["sum"]
    assert np.isnan(shown[7, 11, 1])


def test_a_reset_keeps_the_check_and_adds_none() -> None:
    spec = pg.target("state", "r32f", initial=(2.0,))
    grow = pg.kernel(source="def grow(before: Image, by: Image) -> float: return before[0, 0].r * by[0, 0].r")
    made = grow(pg.previous(spec), pg.Input("by", "r32f"), into=spec)
    huge = np.full((1, 1, 1), 3e38, np.float32)
    with pg.compile(made, "numpy", check_finite=True) as checked, pg.compile(made, "numpy") as unchecked:
        for _ in range(2):
            with pytest.raises(pg.GraphError, match="pass 'state' makes values that are not finite"):
                checked(by=huge)
            checked.reset()
            assert np.isinf(unchecked(by=huge)["state"]).all()
            unchecked.reset()


@pytest.mark.parametrize("backend_name", SLOW_ON_OPENCL)
@pytest.mark.parametrize("effect", [soft_shadow, planar])
def test_whole_effects_make_none(effect: Any, backend: Backend) -> None:
    camera = pg.Camera((3, 3, 5), (0, 0.5, 0), vertical_fov_rad=0.6)
    scene = pg.Scene((floor(), cube()), camera, (sun(40, 30, radius=0.1),))
    with pg.compile(effect(scene), backend, size=(48, 27), check_finite=True) as program:
        program.run(camera=scene.camera)


def test_a_check_fuses_nothing() -> None:
    lights = (sun(radius=0.1),)
    scene = pg.Scene((floor(), cube()), from_above(), lights)
    with pg.compile(soft_shadow(scene, map_size=64), "null", size=(64, 36), check_finite=True) as program:
        assert not any(getattr(step, "fused", ()) for step in program.plan.steps)


# The command


def _apply(capsys: pytest.CaptureFixture[str], tmp_path: Path, picture: Picture, *options: str) -> tuple[int, str]:
    np.save(tmp_path / "in.npy", picture)
    arguments = ["apply", "gaussian-blur", str(tmp_path / "in.npy"), "-o", str(tmp_path / "out.npy"), *options]
    status = run(arguments)
    return status, capsys.readouterr().err


def test_the_command_refuses_with_its_own_cure(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, message = _apply(capsys, tmp_path, spoiled())
    assert status == 2
    assert message.count("\n") == 1
    assert "column 11, row 7, channel g: nan" in message
    assert "--non-finite replace" in message
    assert not (tmp_path / "out.npy").exists()


@pytest.mark.parametrize(("choice", "finite"), [("replace", True), ("keep", False)])
def test_the_command_replaces_or_keeps(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, choice: str, finite: bool
) -> None:
    status, message = _apply(capsys, tmp_path, spoiled(), "--non-finite", choice)
    assert status == 0, message
    assert np.isfinite(np.load(tmp_path / "out.npy")).all() == finite


def test_the_command_names_the_pass_that_makes_one(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    # two taps are added before their weight makes them small again
    picture = np.full((4, 4, 4), 3e38, np.float32)
    picture[..., 3] = 1.0
    status, message = _apply(capsys, tmp_path, picture, "--check-finite")
    assert status == 2
    assert "pass 'gaussian_blur_x' makes values that are not finite in target 'gaussian_blur_x'" in message


HALVES = np.arange(1 << 16, dtype=np.uint16).view(np.float16)


@pytest.mark.parametrize("turned", [False, True])
def test_every_half_is_told_finite_or_not(turned: bool) -> None:
    """One number beside zeros, each of all there are: NumPy's word for it, in any layout."""
    picture = np.zeros((2, 3, 4), np.float16)[:, ::-1] if turned else np.zeros((2, 3, 4), np.float16)
    with np.errstate(invalid="ignore"):
        finite = np.isfinite(HALVES)
    for value, expected in zip(HALVES[:: 1 if turned else 5], finite[:: 1 if turned else 5], strict=True):
        picture[1, 2, 3] = value
        found = find(picture)
        assert (found is None) == bool(expected)
        assert found is None or (found.row, found.column, found.channel) == (1, 2, 3)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_halves_for_an_input_of_halves_are_refused_and_replaced(value: float) -> None:
    picture = plain().astype(np.float16)
    picture[7, 11, 1] = value
    graph = copy(pg.Input("frame", "rgba16f"), into=pg.target("out", "rgba16f"))
    with pg.compile(graph) as program, pytest.raises(pg.InputError, match=r"column 11, row 7.*"):
        program(frame=picture)
    with pg.compile(graph, non_finite="replace") as program:
        assert program(frame=picture)["out"][7, 11, 1] == (0.0 if np.isnan(value) else LARGEST_HALF)


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_pictures_are_looked_through_without_a_copy(dtype: type) -> None:
    """Whatever their strides: rows apart, upside down."""
    whole = np.ones((300, 500, 4), dtype)
    for picture in (whole, whole[:, :400], whole[::-1], whole[:, ::-1]):
        tracemalloc.start()
        assert find(picture) is None
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert most < whole.nbytes // 2
        bad = picture.copy()
        bad[299, 3, 1] = np.inf
        found = find(bad[::-1])
        assert found is not None and (found.row, found.column, found.channel, found.count) == (0, 3, 1, 1)
