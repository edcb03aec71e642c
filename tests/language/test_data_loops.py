"""Loops whose bounds come from data: what they cost, and what of whole pictures they may go through."""

from __future__ import annotations

import numpy as np
import pytest
from running import lowered, parsed, run_program

import passgraph as pg
from passgraph.errors import KernelError
from passgraph.language import scalar as s
from passgraph.language.lower import Facts, ImageFacts, lower
from passgraph.language.sized import loops_over_sizes

#: As kernels have to be when every optimisation is off, too.
BOTH = pytest.mark.parametrize("simplify", [True, False])
WIDE = np.array([0.0, 1.0, 2.5, -3.0, 9.0, 70.0, 3e9, -3e9, np.inf, -np.inf, np.nan], np.float32)


def whole(x: np.float32) -> int:
    return 0 if np.isnan(x) else int(np.clip(x, -(2.0**31), 2.0**31 - 1))


def loops(program: s.ScalarProgram) -> list[s.For]:
    return [i for i in s.walk(program.body) if isinstance(i, s.For)]


@BOTH
def test_any_number_may_bound_a_loop(simplify: bool) -> None:
    """Infinities, NaN and what no int holds too."""
    columns = [column.ravel() for column in np.meshgrid(WIDE, WIDE, WIDE)]
    text = (
        "t = 0\nfor i in range(clamp(int(x), -5, 60), clamp(int(y), -7, 64), clamp(int(z), -3, 3)):\n"
        "    t = t * 3 + i\nreturn float(t % 65521)"
    )
    (found,) = run_program(lowered(text, simplify=simplify), *columns)
    expected = []
    for x, y, z in zip(*columns, strict=True):
        start, stop, step = np.clip(whole(x), -5, 60), np.clip(whole(y), -7, 64), np.clip(whole(z), -3, 3)
        t = 0
        for i in range(start, stop, step) if step else ():
            t = (t * 3 + int(i) + 2**31) % 2**32 - 2**31
        expected.append(t % 65521)
    assert found.tolist() == expected


@BOTH
def test_a_loop_from_data_stays_one_loop_of_its_greatest_trips(simplify: bool) -> None:
    def trips(bounds: str) -> int:
        text = f"n = int(x)\np = pixel()\nfor i in range({bounds}): y = y * 1.5 + float(i)\nreturn y"
        (loop,) = loops(lowered(text, simplify=simplify))
        return loop.trips

    assert trips("clamp(n, -3, 20)") == 20
    assert trips("clamp(n, 0, 9), 40, 7") == 6
    assert trips("40, clamp(n, 0, 9), -7") == 6
    assert trips("0, 30, clamp(n, 3, 9)") == 10
    assert trips("p.x - 3, p.x + 4") == 7
    assert trips("max(p.y - 3, n), min(p.y + 4, int(y))") == 7
    assert trips("p.x - (n & 3), p.x + 2, 2") == 3
    assert trips("int(saturate(x) * 12.0)") == 12


def test_bounds_that_allow_no_trip_leave_no_loop() -> None:
    assert not loops(lowered("for i in range(clamp(int(x), -9, 0)): y = y + 1.0\nreturn y"))
    assert not loops(lowered("for i in range(9, clamp(int(x), -9, 9)): y = y + 1.0\nreturn y"))


def test_offsets_reach_as_far_as_the_index() -> None:
    text = "for i in range(clamp(int(x), -4, 2), clamp(int(y), 1, 6)): z = z + c[i, -i].x\nreturn z"
    use = lowered(text).image("c")
    assert (use.x, use.y) == ((-4, 5), (-5, 4))
    use = lowered("for i in range(clamp(int(x), -4, 2), -6, -3): z = z + c[0, i].x\nreturn z").image("c")
    assert use.y == (-5, 2)


WHOLE = "for v in range(c.size.y):\n    for u in range(c.size.x): x = max(x, c.texel(ivec2(u, v)).x)\nreturn x"


def sized(image: tuple[int, int], target: tuple[int, int]) -> s.ScalarProgram:
    return lower(parsed(WHOLE).program, Facts(images={"c": ImageFacts(size=image)}, size=target))


def test_whole_pictures_are_gone_through_on_small_targets_only() -> None:
    assert [loop.trips for loop in loops(sized((3840, 2160), (1, 1)))] == [2160, 3840]
    sized((3840, 2160), (4, 4))
    sized((1920, 1080), (64, 1))
    sized((256, 256), (1920, 1080))
    for image, target, most in (((3840, 2160), (5, 4), 6_710_886), ((8192, 1025), (1, 1), 8_388_608)):
        with pytest.raises(KernelError, match=f"at most {most} are allowed together"):
            sized(image, target)
    with pytest.raises(KernelError, match="at most 65536 are allowed together"):
        sized((257, 256), (1920, 1080))


def test_a_long_body_takes_its_share_of_a_pixels_instructions() -> None:
    body = "for i in range(c.size.x * 1024):\n    " + "x = sin(x) + cos(x)\n    " * 4 + "y = y + x\nreturn y"
    with pytest.raises(KernelError, match="instructions a pixel, loops run; at most 268435456"):
        lower(parsed(body).program, Facts(images={"c": ImageFacts(size=(4096, 1))}, size=(1, 1)))


def test_kernels_that_loop_over_sizes_are_told_through_variables() -> None:
    def told(body: str) -> bool:
        return loops_over_sizes(parsed(body).program)

    assert told(WHOLE)
    assert told("n = 1\nif x > 2.0: n = output_size().y // 2\nm = n + 1\nfor i in range(m): x = x + 1.0\nreturn x")
    assert not told("n = c.size.x\nfor i in range(9): x = x + float(n)\nreturn x")
    assert not told("return x + float(c.size.x)")


def test_another_size_compiles_the_kernel_anew() -> None:
    kernel = parsed("x = -9.0\n" + WHOLE, parameters="c: Image, n: float")
    program = pg.compile(kernel(pg.Input("c"), n=1.0, into=pg.target("out", "r32f", size=(1, 1))))
    for height, width in ((5, 7), (1, 1), (11, 3)):
        picture = np.random.default_rng(height).random((height, width, 4)).astype(np.float32)
        assert np.asarray(program(c=picture)["out"]).ravel()[0] == picture[..., 0].max()


def test_what_no_branch_comes_to_assigns_nothing() -> None:
    """A known condition leaves the loop before the variable has a value; another branch gives it one."""
    text = (
        "for j in range(70):\n    if y > 0.5:\n        if 1 < 2: break\n        a = x\n"
        "    if z > 0.5:\n        a = c[1, 0].x\n        w += a\nreturn w"
    )
    columns = [np.array(column, np.float32) for column in ([2, 2, 2], [0, 0, 1], [0, 1, 1], [3, 3, 3])]
    (found,) = run_program(lowered(text), *columns)
    assert found.tolist() == [3, 143, 3]
