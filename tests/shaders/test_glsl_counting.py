"""How many trips loops make: those that counters tell, and those that are refused since too few are left for them."""

from __future__ import annotations

import numpy as np
import pytest
from agreement_glsl import run

import passgraph as pg
from passgraph.language import ir
from passgraph.shaders.glsl import parse


def trips(statement: str) -> list[int]:
    """The most trips of each loop, outermost first."""
    shader = parse(f"void main() {{ float s = 0.0; vec3 r; {statement} gl_FragColor = vec4(s); }}")
    assert not any("the end of this loop" in note.text for note in shader.notes)
    found, pending = [], list(shader.program.body)
    while pending:
        one = pending.pop(0)
        if isinstance(one, ir.For):
            assert isinstance(one.stop, ir.Literal)
            found.append(int(one.stop.value))
            pending += one.body
        elif isinstance(one, ir.If):
            pending += [*one.then, *one.orelse]
    return found


@pytest.mark.parametrize(
    ("statement", "expected"),
    [
        ("for (r.x = -3.0; r.x <= 3.0; r.x++) s++;", 7),
        ("for (r.x = 3.0; r.x > -3.0; r.x -= 0.5) s++;", 12),
        ("for (int i = 0; i < 5 && s < 100.0; i++) s++;", 5),
        ("for (int i = 2147483600; i > 2147483590; i -= 3) s++;", 4),
    ],
)
def test_a_counter_is_followed_to_its_end(statement: str, expected: int) -> None:
    assert (
        run(parse(f"void main() {{ float s = 0.0; vec3 r; {statement} gl_FragColor = vec4(s); }}"), (1, 1), {})[0, 0, 0]
        == expected
    )
    assert expected <= trips(statement)[0] <= expected + 2


@pytest.mark.parametrize(
    "loop",
    [
        "for (r.x = 0.0; r.x + 1e8 <= 1e8; r.x++) s++;",
        "for (r.x = 0.0; r.x - 1e8 >= -1e8; r.x--) s++;",
        "for (r.x = 0.0; r.x + 16777216.0 <= 16777216.0; r.x += 0.25) s++;",
        "for (r.x = 999996.0; r.x + 0.03 <= 1e6; r.x++) s++;",
    ],
)
def test_trips_that_rounding_adds_are_made(loop: str) -> None:
    shader = parse(f"void main() {{ float s = 0.0; vec3 r; {loop} gl_FragColor = vec4(s); }}")
    assert run(shader, (1, 1), {}, backend="numpy")[0, 0, 0] == 5  # float32 rounds sums to even
    assert trips(loop)[0] < 64


def test_bounds_come_from_the_counters_around() -> None:
    outer, inner = trips("for (r.x = -9.0; r.x <= 9.0; r.x++) for (r.y = -abs(r.x); r.y <= abs(r.x); r.y++) s++;")
    assert 19 <= outer <= 21
    assert 19 <= inner <= 21


@pytest.mark.parametrize(
    "loop",
    [
        "for (float x = 1e8; x < 2e8; x += 1.0) s++;",  # a step that float32 loses
        "for (r.x = 0.0; r.x < 5.0; r.x += s) s++;",
        "for (r.x = s / s; r.x < 5.0; r.x++) s++;",
        "for (r.x = 0.0; r.x < 5.0; r.x--) { s++; if (s > 9.0) break; }",
        "for (int i = 2147483600; i >= 0 && s < 9.0; i++) s++;",
        "for (r.x = 0.0; r.x < 60000.0; r.x++) for (r.y = r.x; r.y < 60000.0; r.y++) { s++; if (s > 9.0) break; }",
        "for (int i = 0; i++ < 5; i -= 2) { s++; if (s > 9.0) break; }",
        "for (r.x = 0.0; r.x < 5.0; r.x++) { s++; r.s -= 0.5; }",
        "for (r.x = 0.0; r.x < 5.0; r.x++) { s++; r = r * 0.5; if (s > 9.0) break; }",
        "for (uint i = 5u; i >= 0u && s < 9.0; i--) s++;",
        "for (int i = 1; i + 2147483647 < 10 && s < 9.0; i++) s++;",  # what is compared begins anew at the lowest int
        "for (int i = -2; i - 2147483647 > -10 && s < 9.0; i--) s++;",
        "for (float x = 0.0; x < 1.0 && s < 9.0; x = x + 1e8 - 1e8 + 0.25) s++;",
    ],
)
def test_counters_that_tell_no_end_leave_a_note(loop: str) -> None:
    shader = parse(f"void main() {{ float s = 0.0; vec3 r; {loop} gl_FragColor = vec4(s); }}")
    assert [note.text for note in shader.notes if "the end of this loop is not known here" in note.text]


def test_bounds_are_variables_that_the_loop_leaves_alone() -> None:
    ends = "float low = ceil(-0.5 * 7.0 - vec2(0.0))[1], high = floor(0.5 * 7.0 - vec2(0.0))[0];"
    assert 7 <= trips(f"{ends} for (float k = low; k <= high; k++) s++;")[0] <= 9
    for change, expected in (("high = 20.0;", 24.0), ("{ low++; high += 1.0; }", 10.0)):
        text = (
            f"void main() {{ float s = 0.0; {ends} for (float k = low; k <= high; k++) {{ s++; if (s < 4.0) {change} }}"
        )
        shader = parse(f"{text} gl_FragColor = vec4(s); }}")
        assert any("the end of this loop" in note.text for note in shader.notes)
        assert run(shader, (1, 1), {})[0, 0, 0] == expected


def test_a_loop_that_too_few_trips_are_left_for_is_refused_with_its_line() -> None:
    text = "uniform float t;\nvoid main() {\n  float s = 0.0;\n" + "  while (s < t)\n" * 5 + "  s++;\n}"
    with pytest.raises(
        pg.KernelError, match=r":8: the end of this loop is not known here, and too few trips \(\d+\) are left"
    ):
        parse(text)


def test_five_nested_loops_by_components_make_all_their_trips() -> None:
    text = """void main() {
        vec3 r, p; vec4 sum = vec4(0);
        for (r.z = 0.0; r.z < 2.0; r.z++)
        for (r.x = -4.0; r.x <= 4.0; r.x++) for (r.y = -4.0; r.y <= 4.0; r.y++)
        for (p.x = -2.0; p.x <= 2.0; p.x++) for (p.y = -2.0; p.y <= 2.0; p.y++)
            sum += vec4(1.0, r.x * p.x + r.z, r.y * r.y, abs(p.y));
        gl_FragColor = sum;
    }"""
    z, x, y, a, b = np.meshgrid([0, 1], *[range(-4, 5)] * 2, *[range(-2, 3)] * 2, indexing="ij")
    expected = [z.size, (x * a + z).sum(), (y * y).sum(), np.abs(b).sum()]
    np.testing.assert_array_equal(run(parse(text), (1, 1), {}, backend="numpy")[0, 0], expected)
