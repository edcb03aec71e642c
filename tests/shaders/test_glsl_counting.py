"""How many trips loops make: those that counters tell, and those that are refused since too few are left for them."""

from __future__ import annotations

import numpy as np
import pytest
from agreement_glsl import run

import passgraph as pg
from passgraph.glsl import loops, parse
from passgraph.glsl.loops import MOST_STEPS
from passgraph.language import ir


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


@pytest.mark.parametrize(
    ("statement", "expected", "most"),
    [
        ("int i = 0; do { s++; i++; } while (i < 5);", 5, 5),
        ("int i = 0; while (i < 5) { s++; i++; }", 5, 5),
        ("int i = 0; while (i < 5) { ++i; s++; }", 5, 5),
        ("for (int i = 0; i < 5;) { i += 1; s++; }", 5, 5),
        ("float x = 1.0; do { s++; x *= 2.0; } while (x < 100.0);", 7, 7),
        ("int i = 9; do { s += float(i); i--; } while (i > 3); s += 100.0 * float(i);", 339, 6),
        ("int i = 0; do { s++; if (s > 2.0) break; i++; } while (i < 5); s += 10.0 * float(i);", 23, 5),
        ("int i = 0; while (i < 5) { i++; if (i == 2) continue; s++; }", 4, 5),
        ("int i = 0; do { int k = i; switch (k) { case 1: break; default: s++; } i++; } while (i < 5);", 4, 5),
        ("for (int k = 0; k < 3; k++) { int i = 0; do { s++; i++; } while (i < k); }", 4, 3),
        ("int i = 0; float t = s; r.x = 1.0; while (i < 5 && t < 9.0) { s++; i++; }", 5, 6),
    ],
)
def test_a_step_within_the_block_counts(statement: str, expected: int, most: int) -> None:
    text = f"void main() {{ float s = 0.0; vec3 r; {statement} gl_FragColor = vec4(s); }}"
    for backend in ("reference", "numpy"):
        assert run(parse(text), (1, 1), {}, backend=backend)[0, 0, 0] == expected
    assert trips(statement)[0] == most


@pytest.mark.parametrize(
    ("statement", "expected"),
    [
        ("int i = 7; do { s++; i++; } while (i < 5);", 1),
        ("int i = 5; do { s++; i--; if (s > 39.0) break; } while (i < 5);", 40),
        ("int i = 0; do { s++; if (s < 20.0) continue; i++; } while (i < 5);", 24),
        ("int i = 0; while (i < 5) { s++; if (s > 20.0) i++; }", 25),
        ("int i = 0; while (i < 5) { s++; i++; if (s < 20.0) i = 0; }", 24),
        ("int i = 0; while (i < 5) { int k = int(s) / 20; s++; i += k; }", 25),
        ("int i = 0; while (i < 5) { float i = 0.0; s++; i++; if (s > 20.0) break; }", 21),
    ],
)
def test_what_no_step_ends_is_open(statement: str, expected: int) -> None:
    """A first trip that is not tested, a step that trips leave out, and one that is not the counter's alone."""
    shader = parse(f"void main() {{ float s = 0.0; {statement} gl_FragColor = vec4(s); }}")
    assert any("the end of this loop is not known here" in note.text for note in shader.notes)
    assert run(shader, (1, 1), {}, backend="numpy")[0, 0, 0] == expected


def test_nested_loops_with_steps_in_their_blocks_are_read_as_for_is() -> None:
    """Open ones would have too few trips for each other."""
    text = "s++;"
    for name in "abcd":
        text = f"int {name} = 0; do {{ {text} {name}++; }} while ({name} < 7);"
    assert trips(text) == [7, 7, 7, 7]
    shader = parse(f"void main() {{ float s = 0.0; {text} gl_FragColor = vec4(s); }}")
    assert run(shader, (1, 1), {}, backend="numpy")[0, 0, 0] == 7**4


def test_blocks_of_many_steps_are_read_in_time_that_grows_with_them() -> None:
    """Only the first few steps may be a counter's."""
    looked = 0

    def counting(*given: object) -> None:
        nonlocal looked
        looked += 1

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loops, "counted", counting)
        parse(f"void main() {{ int i = 0; while (i < 5) {{ {'i++; ' * 400} }} gl_FragColor = vec4(float(i)); }}")
    assert looked == MOST_STEPS


def test_what_variables_hold_is_known_behind_other_loops() -> None:
    """Those that branches and loops leave alone."""
    left = "int k = 2; for (int i = 0; i < 3; i++) s += 0.0; if (s > 5.0) s = 5.0; for (int j = -k; j <= k; j++) s++;"
    assert trips(left) == [3, 5]
    for changed in ("if (gl_FragCoord.x > 0.0) k = 4;", "for (int i = 0; i < 2; i++) k++;"):
        shader = parse(
            f"void main() {{ float s = 0.0; int k = 2; {changed} for (int j = -k; j <= k; j++) s++; "
            "gl_FragColor = vec4(s); }"
        )
        assert any("the end of this loop" in note.text for note in shader.notes)
        assert run(shader, (1, 1), {}, backend="numpy")[0, 0, 0] == 9


def test_open_loops_within_each_other_have_as_many_trips_each() -> None:
    """As in a mean over a picture, whose sides nobody knows: a dear read leaves both of them some tens."""
    text = """uniform sampler2D t; void main() {
        vec2 many = floor(vec2(textureSize(t, 0)) / 8.0); float s = 0.0;
        for (float i = 0.0; i <= many.x; i++) {
            for (float j = 0.0; j <= many.y; j++) { s += textureLod(t, vec2(i, j) / (many + 1.0), 1.5).r + 1.0; }
        }
        gl_FragColor = vec4(s);
    }"""
    told = [int(note.text.split()[-4]) for note in parse(text, levels=("t",)).notes if "end of this loop" in note.text]
    assert len(told) == 2
    assert min(told) >= 20
    assert max(told) <= 1.2 * min(told)
    frame = np.zeros((8 * 11, 8 * 17, 4), np.float32)
    assert run(parse(text), (1, 1), {"t": frame}, backend="numpy")[0, 0, 0] == 12 * 18
