"""Kernel texts that once crashed, hung or were told wrongly, held against plain NumPy."""

from __future__ import annotations

import tracemalloc
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.numpy.pixels.buffer_layout import Layout
from passgraph.backends.numpy.pixels.chains import MAX_WINDOW, near_images, single_stage, stages
from passgraph.errors import KernelError
from passgraph.language.lower import lower

BACKENDS = [
    "reference",
    "numpy",
    pytest.param("gl", marks=pytest.mark.gl),
    pytest.param("opencl", marks=pytest.mark.opencl),
]
BORDERS = ("clamp", "zero", "repeat", "mirror")
PICTURE = np.random.default_rng(5).random((5, 7, 4), np.float32)
INT_MIN, INT_MAX = -(2**31), 2**31 - 1


def body(text: str) -> str:
    return "def k(c: Image) -> vec4:\n    v = c[0, 0]\n" + "\n".join("    " + line for line in text.split("\n")) + "\n"


def result(text: str, backend: str, border: str = "clamp", given: Any = PICTURE) -> Any:
    frame = pg.Input("frame", "rgba32f", (given.shape[1], given.shape[0])).border(border)
    with pg.compile(pg.kernel(source=text, name="k")(frame), backend) as program:
        return program(frame=given)["k"]


def moved(dx: int, dy: int, border: str) -> Any:
    """The picture read at an offset, in Python's whole numbers."""

    def place(offset: int, count: int) -> tuple[list[int], list[bool]]:
        wanted = [x + offset for x in range(count)]
        if border == "repeat":
            return [x % count for x in wanted], [True] * count
        if border == "mirror":
            return [min(x % (2 * count), 2 * count - 1 - x % (2 * count)) for x in wanted], [True] * count
        inside = [0 <= x < count for x in wanted]
        return [min(max(x, 0), count - 1) for x in wanted], inside if border == "zero" else [True] * count

    (rows, rows_in), (columns, columns_in) = place(dy, PICTURE.shape[0]), place(dx, PICTURE.shape[1])
    return PICTURE[np.ix_(rows, columns)] * np.outer(rows_in, columns_in)[..., None]


# Reads far away


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_far_relative_read_finds_what_the_border_rule_says(backend: str) -> None:
    """Also where the sum of pixel and offset leaves 32 bits, and where a loop makes the offset; all rules at once."""
    offsets = [(1, 600_000), (INT_MAX, 3), (-2, INT_MIN), (1_073_741_825, -100_000)]
    looped = [(i, -1) for i in range(INT_MIN, INT_MAX, 357_913_941)]
    lines = []
    for rule in BORDERS:
        lines.append(f"{rule}0 = " + " + ".join(f"{rule}[{x}, {y}]" for x, y in offsets))
        lines.append(f"{rule}1 = vec4(0)")
        lines.append(f"for i in range({INT_MIN}, {INT_MAX}, 357913941): {rule}1 += {rule}[i, -1]")
    returned = ", ".join(f"{rule}0, {rule}1" for rule in BORDERS)
    head = f"def k({', '.join(f'{rule}: Image' for rule in BORDERS)}) -> tuple[{', '.join(['vec4'] * 8)}]:\n    "
    kernel = pg.kernel(source=head + "\n    ".join(lines) + f"\n    return {returned}\n")
    frame = pg.Input("frame", "rgba32f", (7, 5))
    made = kernel(*(frame.border(rule) for rule in BORDERS), into=[pg.target(f"t{n}", "rgba32f") for n in range(8)])
    with pg.compile(list(made), backend) as program:
        shown = program(frame=PICTURE)
    for number, rule in enumerate(BORDERS):
        for way, places in enumerate((offsets, looped)):
            wanted = sum(moved(x, y, rule) for x, y in places)
            np.testing.assert_allclose(shown[f"t{2 * number + way}"], wanted, rtol=1e-5, err_msg=f"{rule} {way}")


@pytest.mark.parametrize("text", ["c[1, 600000] + c[0, 0]", "c[100000, 3] + c[3, 100000]", "c[300, 300] + c[0, 0]"])
def test_far_reads_take_no_memory_of_their_own(text: str) -> None:
    frame = pg.Input("frame", "rgba32f", (7, 5))
    with pg.compile(pg.kernel(source=body("return " + text), name="k")(frame), "numpy") as program:
        layout = Layout.for_chain(single_stage(program.plan.steps[0]), 16)  # type: ignore[arg-type]
        assert (layout.scratch, layout.stages[0].views) == (0, ())
        tracemalloc.start()
        try:
            program.run(frame=PICTURE)
            assert tracemalloc.get_traced_memory()[1] < 2**20
        finally:
            tracemalloc.stop()


def test_windows_are_bounded_together() -> None:
    """Two images, one read far across and one far up and down: each would fit alone."""
    text = "def k(c: Image, d: Image) -> vec4: return c[32000, 0] + c[-32000, 0] + d[0, 500] + d[0, -500]"
    program = lower(pg.kernel(source=text).program)
    assert [use.name for use in near_images(program)] == ["c"]
    near = lower(pg.kernel(source=text.replace("32000", "30")).program)
    assert [use.name for use in near_images(near)] == ["c", "d"]
    assert 1001 * 61 < MAX_WINDOW < 64001 * 1001


@pytest.mark.parametrize("first", ["c[0, 700] + c[0, -700]", "c[1 if v.x > 0.5 else -2, 0] + c[1, 0]"])
def test_what_no_window_holds_is_not_chained(first: str) -> None:
    """The passes beside it are; the values are the same either way."""
    frame = pg.Input("frame", "rgba32f", (64, 48))
    blur = pg.kernel(source=body("return (c[-1, 0] + c[1, 0]) * 0.5"), name="k")
    far = pg.kernel(source=body("return " + first), name="k")
    made = [blur(frame, into=pg.target("one", "rgba32f"))]
    for number, kernel in enumerate((far, blur, blur)):
        made.append(kernel(made[-1], into=pg.target(f"t{number}", "rgba32f")))
    given = np.random.default_rng(3).random((48, 64, 4), np.float32)
    with pg.compile(made[-1], "numpy") as program, pg.compile(made[-1], "reference") as reference:
        steps = program.plan.steps
        assert stages(steps[:2]) is None  # type: ignore[arg-type]
        assert stages(steps[2:]) is not None  # type: ignore[arg-type]
        shown, wanted = (p(frame=given)["t2"] for p in (program, reference))
    np.testing.assert_allclose(shown, wanted, rtol=1e-5)


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_offset_that_pixels_choose_reads_what_each_chose(backend: str) -> None:
    made = result(body("return c[2 if v.x > 0.5 else -1, 0]"), backend)
    wanted = np.where(PICTURE[..., :1] > 0.5, moved(2, 0, "clamp"), moved(-1, 0, "clamp"))
    np.testing.assert_array_equal(made, wanted)


# Loops to the ends of an int


RANGES = [
    range(INT_MIN, INT_MAX, 1_177_000),
    range(0, INT_MAX, 1_177_000),
    range(INT_MAX, INT_MIN, -2_000_003),
    range(INT_MAX - 5, INT_MAX, 2),
    range(INT_MIN + 3, INT_MIN, -2),
    range(INT_MIN, INT_MAX, INT_MAX),
    range(INT_MAX, INT_MIN, INT_MIN),
    range(5, INT_MIN, INT_MAX),
]


@pytest.mark.parametrize("backend", BACKENDS)
def test_range_means_what_it_means_in_python(backend: str) -> None:
    """How many trips, and the index of each: by sums that float32 holds."""
    lines = ["n = 0", "low = 0", "last = 0"]
    for number, one in enumerate(RANGES):
        lines += ["n = 0", "low = 0", "last = 0", f"for i in range({one.start}, {one.stop}, {one.step}):"]
        lines += ["    if v.x > 2.0:", "        break"]  # so that it stays a loop
        lines += ["    n += 1", "    low += i & 255", "    last = i & 65535"]
        lines += [f"r{number} = vec4(float(n), float(low & 65535), float(last), 1.0)"]
    head = f"def k(c: Image) -> tuple[{', '.join(['vec4'] * 8)}]:\n    v = c[0, 0]\n    "
    kernel = pg.kernel(source=head + "\n    ".join([*lines, f"return {', '.join(f'r{n}' for n in range(8))}\n"]))
    made = kernel(pg.Input("frame", "rgba32f", (3, 2)), into=[pg.target(f"t{n}", "rgba32f") for n in range(8)])
    with pg.compile(list(made), backend) as program:
        shown = program(frame=PICTURE[:2, :3])
    for number, one in enumerate(RANGES):
        wanted = [len(one), sum(i & 255 for i in one) & 65_535, one[-1] & 65_535 if len(one) else 0, 1]
        np.testing.assert_array_equal(shown[f"t{number}"][0, 0], wanted, err_msg=str(one))


# Long and deep texts


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_hundreds_of_statements_may_depend_on_one_another(backend: str) -> None:
    text = "x = v.x\n" + "x = x * 0.5 + v.y\n" * 1500 + "return vec4(x)"
    x = PICTURE[..., 0].astype(np.float64)
    for _ in range(1500):
        x = x * 0.5 + PICTURE[..., 1]
    np.testing.assert_allclose(result(body(text), backend), np.repeat(x[..., None], 4, axis=2), rtol=1e-5)


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_branches_may_follow_one_another(backend: str) -> None:
    text = "x = v.x\n" + "".join(f"if x > {n}.0: x = x + 1.0\n" for n in range(500)) + "return vec4(x)"
    made = result(body(text), backend)
    np.testing.assert_allclose(made[..., 0], PICTURE[..., 0] + 500.0, rtol=1e-6)


def test_channels_are_compared_without_recursion() -> None:
    """A chain of thousands of dependent instructions that treat all channels alike is one channel's."""
    text = body("x = v\n" + "x = x * 0.5 + v\n" * 1200 + "return x")
    frame = pg.Input("frame", "rgba32f", (7, 5))
    with pg.compile(pg.kernel(source=text, name="k")(frame), "null") as program:
        assert Layout.for_chain(single_stage(program.plan.steps[0]), 16).stages[0].alike == 4  # type: ignore[arg-type]


def test_structs_nest_to_a_limit() -> None:
    text = "class S0:\n    v: float\n" + "".join(f"class S{n + 1}:\n    a: S{n}\n" for n in range(1000))
    with pytest.raises(KernelError, match="struct S32 holds structs 33 deep; at most 32"):
        pg.kernel(source=text + "def k(c: Image, s: S1000) -> vec4: return c[0, 0]")


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_tables_of_several_lengths_and_an_array_meet_in_one_kernel(backend: str) -> None:
    """All at an index of each pixel's own."""
    text = (
        "T = (1.0,)\nU = (1.0, 2.0, 3.0)\ndef k(c: Image) -> vec4:\n    v = c[0, 0]\n    i = int(v.x * 3.0)\n"
        "    a = [v.x] * 100\n    a[i] = v.y\n    return vec4(T[i], U[i], a[i], a[i - 9])\n"
    )
    index = np.minimum((PICTURE[..., 0] * np.float32(3)).astype(int), 2)
    first = np.where(index == 0, PICTURE[..., 1], PICTURE[..., 0])  # an index below 0 reads entry 0
    wanted = np.stack([np.ones_like(first), index + 1, PICTURE[..., 1], first], axis=2)
    np.testing.assert_array_equal(result(text, backend), wanted.astype(np.float32))


def test_a_table_is_read_once_however_often_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """What each further mention costs are the literals of its line."""
    from passgraph.language import scope

    made = []
    number = scope.number
    monkeypatch.setattr(scope, "number", lambda value, span: made.append(value) or number(value, span))

    def numbers_of(lines: int) -> int:
        made.clear()
        sums = "x += T[0] + T[1] + T[2]\n" * lines
        pg.kernel(source="T = (" + "1, " * 1024 + ")\n" + body("x = 0.0\n" + sums + "return vec4(x)"), name="k")
        return len(made)

    assert numbers_of(1) >= 1024
    assert numbers_of(50) - numbers_of(1) < 49 * 10
