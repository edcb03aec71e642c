"""How much loops become when they are unrolled: counted in instructions, wherever they stand."""

from __future__ import annotations

import numpy as np
from running import lowered, run_program

from passgraph.graph.calls import kernel
from passgraph.language import scalar as s
from passgraph.language.lower import lower
from passgraph.language.lower_loops import MAX_UNROLLED_INSTRUCTIONS, MAX_UNROLLED_TOGETHER

#: As screens of printed dots are made: for each ink the dots of 9 cells around a pixel, dozens of instructions each.
HALFTONE = """
def share(at: vec2, where: vec2, radius: float, amount: float) -> float:
    reach = 1.3 * radius * (1.0 - amount) ** 2.0
    return smoothstep(-0.5, 0.5, reach - length(where - at))

def ink(frame: Image, p: vec2, size: vec2, angle: float, radius: float, channel: Const[int]) -> float:
    c = cos(angle)
    s = sin(angle)
    corner = floor(vec2(c * p.x + s * p.y, c * p.y - s * p.x) / radius)
    most = 0.0
    for j in range(-1, 2):
        for i in range(-1, 2):
            cell = (corner + vec2(float(i), float(j))) * radius
            where = vec2(c * cell.x - s * cell.y, s * cell.x + c * cell.y)
            most = max(most, share(p, where, radius, frame.sample(where / size)[channel]))
    return most

def halftone(frame: Image, radius: float = 4.0, turn: vec4 = (0.26, 0.52, 0.78, 1.1)) -> vec4:
    p = vec2(pixel()) + 0.5
    size = vec2(output_size())
    total = vec4(0.0)
INKS    return total
"""


def halftone(inks: int) -> s.ScalarProgram:
    lines = (f"    total += ink(frame, p, size, turn.x, radius * {1 + k / 7}, {k % 3})\n" for k in range(inks))
    return lower(kernel(source=HALFTONE.replace("INKS", "".join(lines)), name="halftone").program)


def length(program: s.ScalarProgram) -> int:
    return sum(1 for _ in s.walk(program.body))


def loops(program: s.ScalarProgram) -> int:
    return sum(isinstance(i, s.For) for i in s.walk(program.body))


def test_many_loops_unroll_up_to_a_length_together() -> None:
    """Each alone is short enough; all together would be 9,300 instructions."""
    one, all_ = halftone(1), halftone(14)
    assert loops(one) == 0
    assert 14 * length(one) > 2.5 * MAX_UNROLLED_TOGETHER
    assert 0 < loops(all_) < 2 * 14  # some loops stay, and some do not
    assert length(all_) < 1.5 * MAX_UNROLLED_TOGETHER


def test_what_is_unrolled_inside_a_loop_counts() -> None:
    inner = "        for j in range(20): y = y * 1.5 + sqrt(abs(y + float(j) * x))\n"
    program = lowered("y = x\n" + 60 * f"for i in range(99):\n    for k in range(1):\n{inner}" + "return y")
    assert loops(program) > 60  # the loops of 99 trips, and those of 20 that the length leaves
    assert length(program) < 1.5 * MAX_UNROLLED_TOGETHER


def test_a_loop_whose_later_trips_are_longer_is_given_up_there() -> None:
    heavy = "".join(f"        y = y * 0.25 + sqrt(abs(y + {k}.5 * x))\n" for k in range(30))
    body = f"y = x\nfor i in range(40):\n    if i > 2:\n{heavy}    y = y * 0.5 + float(i)\nreturn y"
    program = lowered(body)
    assert MAX_UNROLLED_INSTRUCTIONS < 40 * 30 * 4
    assert loops(program) == 1
    assert length(program) < 200
    x = np.float32([0.0, 1.0, -2.5])
    want = x
    for i in range(40):
        for k in range(30 if i > 2 else 0):
            want = want * np.float32(0.25) + np.sqrt(np.abs(want + np.float32(k + 0.5) * x))
        want = want * np.float32(0.5) + np.float32(i)
    np.testing.assert_allclose(run_program(program, x)[0], want, rtol=1e-5)


def test_an_entry_of_an_array_loads_that_entry_only() -> None:
    """So that 64 taps with a weight each are short enough to unroll."""
    text = """
        def taps(c: Image, weights: Array[float, 64]) -> float:
            total = 0.0
            for i in range(64): total += c[i, 0].x * weights[i]
            return total
        """
    program = lower(kernel(source=text).program)
    assert loops(program) == 0
    assert sum(isinstance(i, s.LoadUniform) for i in program.body) == 64
    assert length(program) == 4 * 64
    assert program.float_count == 64
