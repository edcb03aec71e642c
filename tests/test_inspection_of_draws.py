"""`Program.inspect` of draws: coverage against exact fractions, values against NumPy, targets against the picture."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference import rasterizer
from passgraph.backends.reference.traced import KEPT_ENDS, KEPT_RUNS
from passgraph.commands.entry import run
from passgraph.effects.surfaces.marks import instances, points

TEXT = """
class Corner:
    position: vec4
    uv: vec2
    bend: vec3

def place(v: Vertex, push: float = 0.0) -> Corner:
    w = 1.0 + v.uv.x
    clip = vec4((v.position + vec3(push, 0.0, 0.0)) * w, w)
    return Corner(clip, v.uv, vec3(v.uv, 7.0))

def shade(c: Corner, gain: float = 2.0) -> vec4:
    t = c.uv * gain
    if t.x > 1.0:
        t.y = 0.25
    return vec4(t, c.uv.x, 0.5)

def holes(c: Corner) -> vec4:
    least = 0.5
    if c.uv.x < least: discard()
    return vec4(c.uv, 0.0, 1.0)

def grows(c: Corner) -> vec4:
    square = c.uv.x * c.uv.y
    return vec4(dfdx(square), dfdy(square), fwidth(c.uv.y), 1.0)
"""
SIZE = (6, 5)
FULL = [[-1, -1], [3, -1], [-1, 3]]


def layers(*depths: float, uvs: Any = None) -> pg.Mesh:
    """A triangle over the whole target at each depth in clip space; uv is (0, 0) at its corners unless told."""
    corners = np.array([[x, y, z] for z in depths for x, y in FULL], np.float32).reshape(-1, 3)
    uv = np.zeros((len(corners), 2), np.float32) if uvs is None else np.asarray(uvs, np.float32)
    return pg.Mesh.make(corners, np.arange(len(corners)).reshape(-1, 3), uvs=uv)


def soup(count: int = 30) -> pg.Mesh:
    random = np.random.default_rng(4)
    corners = random.uniform(-1.6, 1.6, (3 * count, 3)).astype(np.float32)
    return pg.Mesh.make(corners, np.arange(3 * count).reshape(-1, 3), uvs=random.random((3 * count, 2)))


def drawn(mesh: Any, entry: str = "shade", **more: Any) -> pg.Target:
    more = {"into": pg.target("made", "rgba32f", SIZE), "depth": pg.target("depth", "depth32f", SIZE)} | more
    return pg.draw(  # type: ignore[no-any-return]
        mesh, vertex=pg.vertex(source=TEXT, name="place"), fragment=pg.fragment(source=TEXT, name=entry), **more
    )


def looked(made: Any, *place: Any, **given: Any) -> Any:
    with pg.compile(made, "reference") as program:
        return program.inspect(*place, **given)


def fates(found: Any) -> list[tuple[int, str]]:
    return [(each.triangle, each.fate) for each in found.drawn.fragments]


def near(found: object, expected: object) -> bool:
    return bool(np.allclose(found, expected, rtol=1e-6, atol=1e-7))


def covering(mesh: Any, x: int, y: int) -> list[int] | None:
    """Triangles over the centre of a pixel by exact edge functions; None where an edge is too near to tell."""
    centre = Fraction(2 * x + 1, SIZE[0]) - 1, 1 - Fraction(2 * y + 1, SIZE[1])
    found = []
    for number, triangle in enumerate(mesh.triangles):
        corners = [tuple(map(Fraction, map(float, mesh.positions[vertex]))) for vertex in triangle]
        sides = []
        for (ax, ay, _), (bx, by, _) in zip(corners, corners[1:] + corners[:1], strict=True):
            sides.append((bx - ax) * (centre[1] - ay) - (by - ay) * (centre[0] - ax))
        if min(map(abs, sides)) < Fraction(1, 200):
            return None
        if len({side > 0 for side in sides}) == 1:
            found.append(number)
    return found


def test_triangles_over_a_pixel_are_those_of_exact_arithmetic() -> None:
    random = np.random.default_rng(8)
    flat = random.uniform(-1, 1, (18, 3)).astype(np.float32) * np.array([1, 1, 0], np.float32)
    mesh = pg.Mesh.make(flat, np.arange(18).reshape(-1, 3), uvs=np.zeros((18, 2)))
    told = []
    with pg.compile(drawn(mesh, depth=None), "reference") as program:
        for y in range(SIZE[1]):
            for x in range(SIZE[0]):
                expected = covering(mesh, x, y)
                if expected is not None:
                    found = program.inspect(x, y).drawn
                    assert found is not None and [each.triangle for each in found.fragments] == expected
                    assert (found.covering, found.triangles) == (len(expected), 6)
                    told.append(len(expected))
    assert len(told) > 10 and {0, 1, 2} <= set(told)


@pytest.mark.parametrize("more", [{}, {"blend": "alpha", "depth_compare": "always"}, {"cull": "back"}])
def test_every_pixel_is_that_of_the_picture(more: dict[str, Any]) -> None:
    made = drawn(soup(), "holes", **more)
    with pg.compile({"made": made, "depth": made.depth}, "reference") as program:
        picture = program()
        seen = 0
        for y in range(0, SIZE[1], 2):
            for x in range(SIZE[0]):
                found = program.inspect(x, y)
                assert near(found.stored["made"], picture["made"][y, x])
                assert found.stored["depth"] == picture["depth"][y, x]
                if "blend" not in more and found.drawn is not None and found.drawn.visible is not None:
                    assert near(found.results["made"], picture["made"][y, x])
                    assert np.float32(found.drawn.visible.depth) == picture["depth"][y, x]
                    seen += 1
        assert seen > 5 or "blend" in more


def test_depths_decide_in_the_order_of_the_mesh() -> None:
    found = looked(drawn(layers(0.5, -0.5, 0.0)), 2, 1)
    assert fates(found) == [(0, "passed"), (1, "passed"), (2, "depth")]
    assert [(each.depth, each.tested_against) for each in found.drawn.fragments] == [
        (0.75, 1.0),
        (0.25, 0.75),
        (0.5, 0.25),
    ]
    assert [each.triangle for each in found.drawn.detailed] == [1, 0] and found.drawn.visible.triangle == 1
    assert found.stored["depth"] == 0.25
    text = str(found)
    assert "3 of 3 triangles cover the pixel, in this order:\n" in text
    assert "  triangle 0, front, depth 0.75: passes (less against 1), drawn over\n" in text
    assert "  triangle 1, front, depth 0.25: passes (less against 0.75), visible\n" in text
    assert "  triangle 2, front, depth 0.5: fails the depth test (less against 0.25)\n" in text
    assert text.index("\ntriangle 1:\n") < text.index("\ntriangle 0:\n") and text.endswith("\ndepth holds 0.25")


def test_lines_and_corners_are_those_of_numpy() -> None:
    uvs = np.array([[0.25, 0.5], [0.75, 0.25], [0.5, 1.0]], np.float32)
    mesh = layers(0.0, uvs=uvs)
    with pg.compile(drawn(mesh), "reference") as program:
        program.set("made", "gain", 3.0)
        found = program.inspect(4, 1)
    assert found.drawn is not None and found.drawn.visible is not None
    w = 1.0 + uvs[:, 0].astype(np.float64)
    for corner, number in zip(found.drawn.visible.corners, range(3), strict=True):
        assert corner.vertex == number
        assert near(corner.values["position"], [*(np.array([*FULL[number], 0]) * w[number]), w[number]])
        assert corner.values["uv"] == tuple(uvs[number])
        assert corner.values["bend"] == (*uvs[number], 7.0)
    # Where the centre lies in the triangle, and perspective: weights over w.
    ndc = np.array([2 * 4.5 / SIZE[0] - 1, 1 - 2 * 1.5 / SIZE[1], 1.0])
    weights = np.linalg.solve(np.array([[*corner, 1.0] for corner in FULL]).T, ndc) / w
    uv = weights @ uvs / weights.sum()
    assert found.drawn.visible.lines is not None and near(found.drawn.visible.lines.inputs["varying.uv"], uv)
    assert found.parameters == {"gain": 3.0} and near(found.values("t")[0], 3.0 * uv)
    assert near(found.results["made"], [3.0 * uv[0], 0.25 if 3.0 * uv[0] > 1.0 else 3.0 * uv[1], uv[0], 0.5])


def test_a_triangle_that_is_clipped_keeps_its_number_and_corners() -> None:
    corners = np.array([[5, 5, 0], [6, 5, 0], [5, 6, 0], [-1, -1, 0.5], [3, -1, -3], [-1, 3, 0.5]], np.float32)
    mesh = pg.Mesh.make(corners, [[0, 1, 2], [5, 3, 4]], uvs=np.zeros((6, 2)))
    found = looked(drawn(mesh), 0, 2)
    assert fates(found) == [(1, "passed")] and found.drawn.triangles == 2
    assert [corner.vertex for corner in found.drawn.visible.corners] == [5, 3, 4]
    assert [corner.values["position"][:3] for corner in found.drawn.visible.corners] == [
        tuple(corners[vertex]) for vertex in (5, 3, 4)
    ]


def test_discarded_fragments_are_told_after_visible_ones() -> None:
    uvs = [[0.75, 0.0]] * 3 + [[0.25, 0.0]] * 3
    found = looked(drawn(layers(0.5, 0.0, uvs=uvs), "holes"), 0, 0)
    assert fates(found) == [(0, "passed"), (1, "discarded")] and found.drawn.fragments[1].tested_against is None
    assert [each.triangle for each in found.drawn.detailed] == [0, 1] and near(found.stored["made"], [0.75, 0, 0, 1])
    found = looked(drawn(layers(0.0, uvs=uvs[3:]), "holes", into=pg.target("made", "rgba32f", SIZE, clear=0.5)), 0, 0)
    assert fates(found) == [(0, "discarded")] and found.drawn.visible is None and found.results == {}
    assert found.stored == {"made": (0.5,) * 4, "depth": 1.0} and "depth 0.5: discarded" in str(found)
    assert "if c.uv.x < least: discard()" in str(found) and "  holds\n" in str(found) and "made = " not in str(found)


def test_blended_fragments_all_count() -> None:
    uvs = np.repeat([[0.25, 0.0], [0.5, 0.0], [1.0, 0.0]], 3, axis=0)
    made = drawn(layers(0.0, 0.0, 0.0, uvs=uvs), blend="alpha", depth=None)
    found, held = looked(made, 3, 3), 0.0
    for red in (0.5, 1.0, 2.0):
        held = float(np.float32(red * 0.5 + held * 0.5))
    assert near(found.stored["made"][0], held) and near(found.results["made"][0], 2.0)
    assert [each.triangle for each in found.drawn.detailed] == [2, 1, 0] and str(found).count("passes, blended") == 3


def test_the_stencil_test_is_told_apart() -> None:
    depth = pg.target("depth", "depth32f_stencil8", SIZE)
    stencil = pg.Stencil(compare="equal", reference=0, passed="increment")
    found = looked(drawn(layers(0.0, -0.5, 0.5), depth=depth, stencil=stencil), 1, 1)
    assert fates(found) == [(0, "passed"), (1, "stencil"), (2, "stencil")]
    assert found.stored["depth"] == 0.5 and found.stored["depth (stencil)"] == 1
    assert "triangle 1, front, depth 0.25: fails the stencil test\n" in str(found)
    stencil = pg.Stencil(compare="less_equal", reference=0, depth_fail="increment")
    found = looked(drawn(layers(0.0, 0.5), depth=depth, stencil=stencil), 1, 1)
    assert fates(found) == [(0, "passed"), (1, "depth")] and found.stored["depth (stencil)"] == 1


@pytest.mark.parametrize("place", [(2, 2), (3, 1), (5, 4)])
def test_derivatives_name_the_pixels_beside(place: tuple[int, int]) -> None:
    uvs = np.array([[1, 0], [1, 4], [1, 0]], np.float32)  # w is 2 everywhere: uv.y grows by 2 over the width
    found = looked(drawn(layers(0.0, uvs=uvs), "grows"), *place)
    inputs, x = found.drawn.visible.lines.inputs, place[0]
    own, beside = ((2 * at + 1) / SIZE[0] for at in (x, x ^ 1))
    assert near(inputs["varying.uv"], (1, own)) and near(inputs["varying@x.uv"], (1, beside))
    assert near(found.results["made"], (2 / SIZE[0], 0, 2 / SIZE[0], 1)) and near(found.values("square"), [own])
    assert "  varying@x.uv = (1, " in str(found)


def test_marks_and_copies_have_their_own_triangles() -> None:
    text = """
class Mark:
    position: vec4
    number: float

def copy(v: Vertex) -> Mark: return Mark(vec4(v.position, 1.0), v.instance)
def mark(v: Vertex) -> Mark: return Mark(vec4(v.uv * 4.0 - 2.0, 0.0, 1.0), v.instance)
def tell(m: Mark) -> float: return m.number
"""
    into = pg.target("made", "r32f", SIZE)
    for mesh, entry, copies, expected in (
        (instances(layers(0.0), 3), "copy", 1, [0, 1, 2]),
        (points([[0, 0, 0], [0, 0, 0]]), "mark", 2, [0, 1]),
    ):
        made = pg.draw(
            mesh, vertex=pg.vertex(source=text, name=entry), fragment=pg.fragment(source=text, name="tell"), into=into
        )
        found = looked(made, 2, 2)
        assert [each.triangle // copies for each in found.drawn.fragments] == expected
        assert near(found.results["made"], expected[-1])


def test_a_draw_over_another_starts_from_what_it_left() -> None:
    first = drawn(layers(0.0, uvs=[[0.25, 0.0]] * 3))
    half = pg.Mesh.make(np.array([[-1, -1, -0.5], [0, -1, -0.5], [-1, 3, -0.5]], np.float32), [[0, 1, 2]],
                        uvs=np.full((3, 2), 0.5))  # fmt: skip
    second = drawn(half, into=first, depth=first.depth, name="over")
    with pg.compile(second, "reference") as program:
        beside, on = program.inspect(5, 4), program.inspect(0, 4)
        below = program.inspect(0, 4, "made")
    assert beside.step == "over" and beside.drawn is not None and beside.drawn.covering == 0
    assert beside.stored == {"made": (0.5, 0.0, 0.25, 0.5), "depth": 0.5} and beside.results == {}
    assert "none of 1 triangles covers the pixel\nmade holds (0.5, 0, 0.25, 0.5)\n" in str(beside)
    assert on.drawn is not None and on.drawn.fragments[0].tested_against == 0.5 and on.stored["depth"] == 0.25
    assert below.step == "made" and below.stored == beside.stored


def test_passes_of_one_name_have_numbers() -> None:
    made = drawn(layers(0.0), name="draw")
    for depth in (-0.25, -0.5):
        made = drawn(layers(depth), into=made, depth=made.depth, name="draw")
    with pg.compile(made, "reference") as program:
        held = [program.inspect(1, 2, name).stored["depth"] for name in ("draw 1", "draw 2", "draw 3", "draw", None)]
        assert held == [0.5, 0.375, 0.25, 0.25, 0.25]
        with pytest.raises(pg.GraphError, match=r"there is no pass 'draw 4'.*; there are draw 1, draw 2, draw 3"):
            program.inspect(1, 2, "draw 4")


def test_a_draw_of_depth_alone_has_no_lines() -> None:
    made = pg.draw(
        layers(0.0, 0.5), vertex=pg.vertex(source=TEXT, name="place"), depth=pg.target("depth", "depth32f", SIZE)
    )
    found = looked(made, 0, 0)
    assert found.kernel == "place" and fates(found) == [(0, "passed"), (1, "depth")] and found.results == {}
    assert found.drawn.visible.lines is None and len(found.drawn.visible.corners) == 3
    assert found.stored == {"depth": 0.5}


def test_many_triangles_are_told_in_part() -> None:
    count = 3000
    mesh = layers(*np.linspace(-0.5, 0.5, count, dtype=np.float32))
    found = looked(drawn(mesh, depth_compare="greater", depth=pg.target("d", "depth32f", SIZE, clear=0.0)), 1, 1)
    assert found.drawn.covering == count and len(found.drawn.detailed) == KEPT_RUNS
    ends = [*range(KEPT_ENDS), *range(count - KEPT_ENDS, count)]
    assert [each.order for each in found.drawn.fragments] == ends and found.drawn.visible.triangle == count - 1
    assert f"\n  … {count - 2 * KEPT_ENDS} more\n" in str(found)
    found = looked(drawn(mesh), 1, 1)
    assert found.drawn.visible.order == 0 and fates(found)[1:] == [(at, "depth") for at in ends[1:]]


def test_batches_of_fragments_go_on_where_others_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    made = drawn(layers(*np.linspace(0.5, -0.5, 20)))
    whole = looked(made, 4, 3)
    monkeypatch.setattr(rasterizer, "ROWS_AT_ONCE", 70)  # fragments; a triangle has 30
    parts = looked(made, 4, 3)
    assert str(parts) == str(whole) and parts.drawn == whole.drawn and whole.drawn.covering == 20


def test_backs_are_told_from_fronts() -> None:
    mesh = layers(0.0, -0.5)
    turned = pg.Mesh.make(mesh.positions, [[0, 1, 2], [3, 5, 4]], uvs=mesh.uvs)
    found = looked(drawn(turned), 0, 0)
    assert [each.front for each in found.drawn.fragments] == [True, False]
    assert [corner.vertex for corner in found.drawn.visible.corners] == [3, 5, 4]
    assert "  triangle 1, back, depth 0.25: passes" in str(found)


def test_what_is_not_there_is_said() -> None:
    culled = looked(drawn(layers(0.0, 0.5), cull="front"), 0, 0)
    assert (culled.drawn.covering, culled.drawn.triangles, culled.drawn.detailed) == (0, 2, ())
    assert "none of 2 triangles covers the pixel" in str(culled)
    with pytest.raises(pg.GraphError, match=r"inspect: x, in pass 'made' must be a whole number from 0 to 5, got 6"):
        looked(drawn(layers(0.0)), 6, 0)
    behind_and_nowhere = np.repeat([[-3.0, 0], [-1, 0], [0, 0]], 3, axis=0)  # w is -2, 0 and 1
    assert fates(looked(drawn(layers(0.0, 0.0, 0.0, uvs=behind_and_nowhere)), 0, 0)) == [(2, "passed")]


def test_the_command_shows_a_draw(capsys: pytest.CaptureFixture[str]) -> None:
    told = ["inspect", "-e", "soft-shadow", "--size", "16x9", "--at", "1,8", "--pass", "surfaces: floor"]
    assert run(told) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("pass surfaces: floor at (1, 8) of 16x9: kernel textured, ")
    assert "1 of 2 triangles covers the pixel, in this order:" in lines
    assert sum(line.startswith("  vertex ") for line in lines) == 3
    assert any(line.startswith("base_color holds (") for line in lines)
