"""What long programs compute again and again becomes functions, and means the same."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.numpy.pixels.body import body_text
from passgraph.backends.numpy.pixels.buffer_layout import Layout
from passgraph.backends.numpy.pixels.chains import single_stage
from passgraph.backends.opencl.opencl_c import OpenCLPrinter
from passgraph.backends.opencl.storage import ImageLayout
from passgraph.formats import format_named
from passgraph.graph.calls import PixelKernel
from passgraph.language import scalar as s
from passgraph.language.emitter import MIN_PROGRAM, repeated
from passgraph.language.lower import lower
from passgraph.plan.data import PixelStep

#: Powers of a texel and of numbers that are alike in all pixels, sines with cosines of the same angle, in a branch that
#: some pixels take and in a loop that some leave.
TEXT = """
def long(color: Image, k: vec4, turn: float) -> vec4:
    c = color[0, 0]
    total = vec4(0.0)
POWERS
    if c.x > 0.5:
        total.x += sin(c.y) * cos(c.y) + sin(c.z) * cos(c.z) + sin(c.w) * cos(c.w)
    for i in range(70):
        if float(i) > 9.0 * c.z:
            break
        total.y += sin(c.x + float(i)) * 0.125
    return total + vec4(pow(k.x, 1.25), pow(k.y, 1.25), sin(turn), cos(turn))
"""
POWERS = "".join(f"    total.{'xyzw'[n % 4]} += pow(c.{'xyzw'[n % 4]} + {n}.5, 1.25)\n" for n in range(40))


def long() -> PixelKernel[object]:
    return pg.kernel(source=TEXT.replace("POWERS", POWERS), name="long")


def meant(c: NDArray[np.float64], k: tuple[float, ...], turn: float) -> NDArray[np.float64]:
    total = np.zeros_like(c)
    for n in range(40):
        total[..., n % 4] += (c[..., n % 4] + n + 0.5) ** 1.25
    x, y, z, w = np.moveaxis(c, -1, 0)
    total[..., 0] += np.where(x > 0.5, sum(np.sin(v) * np.cos(v) for v in (y, z, w)), 0.0)
    for i in range(70):
        total[..., 1] += np.where(i > 9.0 * z, 0.0, np.sin(x + i) * 0.125)
    return total + np.array([k[0] ** 1.25, k[1] ** 1.25, np.sin(turn), np.cos(turn)])


def test_calls_compute_what_is_written_on_every_backend() -> None:
    """On gl, whose text has no calls, the same bits."""
    color = np.random.default_rng(2).random((33, 150, 4)).astype(np.float32)
    given = {"k": (0.75, 3.0, 0.0, 0.0), "turn": 2.5}
    target = long()(pg.Input("color", "rgba32f"), into=pg.target("out", "rgba32f"), **given)
    found = {}
    for backend in ("gl", "numpy", "opencl"):
        with pg.compile(target, backend=backend) as program:
            found[backend] = program(color=color)["out"]
    np.testing.assert_allclose(found["numpy"], meant(color.astype(np.float64), **given), rtol=2e-6)
    for backend in ("numpy", "opencl"):
        np.testing.assert_array_equal(found[backend].view(np.int32), found["gl"].view(np.int32), backend)


def test_powers_share_one_function_and_pairs_another() -> None:
    program = lower(long().program)
    calls = repeated(program)
    assert s.count(program.body) > MIN_PROGRAM
    keys = [call.key for call in calls.values()]
    counts = sorted(keys.count(key) for key in set(keys))
    assert counts == [4, 42]  # sines, with what their cosines share, and powers; the loop's sine stands alone
    assert sum(len(call.wanted) > 1 for call in calls.values()) == 4
    assert sum(len(call.instructions) for call in calls.values()) > 0.9 * s.count(program.body)


def test_a_value_that_others_use_is_never_lost() -> None:
    """Every operand is made by an instruction that stands in place, or is what a call gives."""
    program = lower(long().program)
    calls = repeated(program)
    inside = {i.to.id: first for first, call in calls.items() for i in call.instructions}
    wanted = {value.id for call in calls.values() for value in call.wanted}
    for i in s.walk(program.body):
        user = inside.get(s.results_of(i)[0].id) if s.results_of(i) else None
        for operand in s.operands_of(i):
            if isinstance(operand, s.Val) and operand.id in inside and inside[operand.id] != user:
                assert operand.id in wanted
    for call in calls.values():
        made = {i.to.id for i in call.instructions}
        used = {x.id for i in call.instructions for x in s.operands_of(i) if isinstance(x, s.Val)}
        assert used - made == {value.id for value in call.given}


def test_short_programs_and_rare_calls_stay_as_they_are() -> None:
    short = POWERS[: POWERS.index("    total.w")]
    assert not repeated(lower(pg.kernel(source=TEXT.replace("POWERS", short)).program))
    lines = "".join(f"    total.x += pow(c.x + {n}.5, {1 + n / 64 + 1 / 128})\n" for n in range(45))
    each_its_own = lower(pg.kernel(source=TEXT.replace("POWERS", lines)).program)
    assert s.count(each_its_own.body) > MIN_PROGRAM
    assert len(repeated(each_its_own)) == 4  # the sines


def test_a_loop_that_is_given_up_leaves_no_calls_behind() -> None:
    """Its numbers are given to other values, which must not count as parts of calls that there are not."""
    leaving = "        if float(i) > 9.0 * c.z:\n            break\n"
    powers = "        total.z += pow(c.x, 1.75) + pow(c.y + float(i), turn)\n"
    text = TEXT.replace("range(70)", "range(60)").replace(leaving, powers)
    program = lower(pg.kernel(source=text.replace("POWERS", POWERS)).program)
    assert any(isinstance(i, s.For) for i in program.body)
    defined = [value.id for i in s.walk(program.body) for value in s.results_of(i)]
    assert len(defined) == len(set(defined))
    last = 0
    for first, end in program.calls:
        assert last < first <= end
        last = end


def test_each_function_is_printed_once_and_called_from_everywhere() -> None:
    """In OpenCL C, and in vectors in machine code; of numbers that all pixels share nothing is called there."""
    with pg.compile(long()(pg.Input("color", "rgba32f", (64, 48)), k=(1.0,) * 4, turn=0.5), backend="null") as program:
        (step,) = program.plan.steps
    assert isinstance(step, PixelStep)
    text = body_text(Layout.for_chain(single_stage(step), 16).stages[0], "body")
    assert len(re.findall(r"^define internal .*@call_", text, re.MULTILINE)) == 2
    assert len(re.findall(r" = call .*@call_", text)) == 40 + 3
    layout = ImageLayout(format_named("rgba32f"), (64, 48))
    printer = OpenCLPrinter(step.program, {"pixel.0": "x"}, {"color": ("image0", layout)}, inner=True, prefix="f_")
    printer.functions()
    functions = printer.listing().text
    printer.block(step.program.body)
    assert len(re.findall(r"^__attribute__.*f_call", functions, re.MULTILINE)) == 2
    assert len(re.findall(r" = f_call", printer.listing().text)) == 42 + 4
