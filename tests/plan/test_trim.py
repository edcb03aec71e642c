"""Targets of passes that nobody reads are not there: their memory, their attachment, and what only they need."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.plan.build import build
from passgraph.plan.data import DrawStep, Options, Plan
from tests.conftest import require

SIZE = (9, 7)
MESH = pg.Mesh.make(
    np.array([[-1, -1, 0.1], [1, -1, 0.4], [0, 1, 0.9], [0.9, 0.8, 0.3]], np.float32), np.array([[0, 1, 2], [0, 2, 3]])
)
KERNELS = """
class Corner:
    position: vec4
    place: vec2
    height: float

def put(vertex: Vertex, shift: float) -> Corner:
    at = vertex.position
    return Corner(vec4(at.x + shift, at.y, at.z, 1.0), at.xy, at.z)

def paint(corner: Corner, picture: Image) -> tuple[vec4, vec4, float]:
    return vec4(corner.place, 1.0, 0.5), picture.texel(pixel()), dfdx(corner.height)

def holed(corner: Corner, picture: Image) -> tuple[vec4, vec4, float]:
    if corner.place.x > 0.2:
        discard()
    return vec4(corner.place, 0.0, 0.5), picture.texel(pixel()), corner.height
"""
PUT = pg.vertex(source=KERNELS, name="put")
PAINT, HOLED = (pg.fragment(source=KERNELS, name=name) for name in ("paint", "holed"))
FRAME = pg.Input("frame", "rgba32f", SIZE)
DOUBLE = pg.kernel(source="def double(color: Image) -> vec4: return color[0, 0] * 2.0")


def drawn() -> tuple[pg.Target, ...]:
    """Two draws into colour, what a pass made of the frame, a height, and depth."""
    doubled = DOUBLE(FRAME, into=pg.target("doubled", "rgba32f"))
    color, seen, height = (pg.target(*row) for row in (("color", "rgba16f"), ("seen", "rgba32f"), ("height", "r32f")))
    depth = pg.target("depth", "depth32f")
    told = {"vertex": PUT, "picture": doubled}
    made = pg.draw(MESH, fragment=PAINT, into=(color, seen, height), depth=depth, shift=0.0, **told)
    mask = ((True,) * 4, (True, False, True, True), (True,) * 4)
    over = pg.draw(
        MESH, fragment=HOLED, into=made, depth=made[0].depth, shift=0.5, blend=("alpha", None, "add"), color_mask=mask,
        name="over", **told,
    )  # fmt: skip
    return (*over, over[0].depth)


OUTPUTS = drawn()
NAMES = ("color", "seen", "height", "depth")


def planned(*wanted: str, **options: bool) -> Plan:
    return build({name: OUTPUTS[NAMES.index(name)] for name in wanted}, options=Options(**options))


def draws(plan: Plan) -> list[DrawStep]:
    return [step for step in plan.steps if isinstance(step, DrawStep)]


def written(plan: Plan) -> list[list[str]]:
    return [[plan.resources[resource].name for resource in step.writes] for step in plan.steps]


@pytest.mark.sampled
@pytest.mark.parametrize("wanted", [("color",), ("seen",), ("height", "color"), ("depth",), ("depth", "seen")])
@pytest.mark.parametrize("name", ["numpy", "gl", "opencl", "webgpu", "reference"])
def test_what_is_left_is_the_same_bits(name: str, wanted: tuple[str, ...]) -> None:
    require(name)
    picture = np.random.default_rng(4).random((*SIZE[::-1], 4), np.float32)
    results = []
    for cull in (True, False):
        outputs = {each: OUTPUTS[NAMES.index(each)] for each in wanted}
        with pg.compile(outputs, backend=name, options=Options(cull=cull)) as program:
            results.append(program(frame=picture))
    for each in wanted:
        np.testing.assert_array_equal(results[0][each], results[1][each])
        assert np.ptp(results[0][each]) > 0


def test_targets_that_nobody_reads_are_not_written() -> None:
    assert written(planned("color")) == [["color", "depth"]] * 2
    assert written(planned("height", "color")) == [["color", "height", "depth"]] * 2
    assert written(planned(*NAMES)) == [["doubled"], ["color", "seen", "height", "depth"], [*NAMES]]
    assert written(planned("color", cull=False)) == written(planned(*NAMES))


def test_nor_is_what_only_they_need() -> None:
    """The pass behind a picture that only they read, and what corners hand over for them."""
    plan = planned("color")
    assert not plan.inputs and not any(step.images for step in draws(plan))
    assert [tuple(map(str, step.varyings)) for step in draws(plan)] == [("varying.place.0", "varying.place.1")] * 2
    why = ": nothing that reaches an output reads it"
    told = [f"left out seen, height of pass {name}{why}" for name in ("color+seen+height", "over")]
    assert set(plan.notes) >= {*told, f"left out pass doubled{why}"}
    assert not any(note.startswith("left out") for note in planned(*NAMES).notes)


def test_states_stay_with_their_targets() -> None:
    _, over = draws(planned("seen"))
    assert over.state.blend == (None,) and over.state.color_mask == ((True, False, True, True),)
    _, over = draws(planned("height"))
    assert over.state.blend[0] is not None and over.state.color_mask == ((True,) * 4,)


def test_a_kernel_that_discards_stays_where_depth_alone_is_read() -> None:
    first, over = draws(planned("depth"))
    assert first.fragment is None and not first.outputs
    assert over.fragment is not None and len(over.outputs) == 1


def test_content_that_is_drawn_over_where_nobody_looks_goes_with_its_draw() -> None:
    """The first draw has nothing else that anybody reads."""
    kernels = KERNELS.split("def holed")[0]
    two = kernels.replace("tuple[vec4, vec4, float]", "tuple[vec4, vec4]").replace(", dfdx(corner.height)", "")
    one = two.replace("tuple[vec4, vec4]", "vec4").replace("return vec4(corner.place, 1.0, 0.5), ", "return ")
    told = {"vertex": PUT, "picture": FRAME, "shift": 0.0}
    first = pg.draw(MESH, fragment=pg.fragment(source=one, name="paint"), into=pg.target("seen"), name="first", **told)
    paint = pg.fragment(source=two, name="paint")
    color, _ = pg.draw(MESH, fragment=paint, into=(pg.target("color"), first), name="second", **told)
    plan = build({"color": color})
    assert [step.name for step in plan.steps] == ["second"] and written(plan) == [["color"]]
    assert len(draws(build({"color": color}, options=Options(cull=False)))) == 2


@pytest.mark.parametrize("fuse", [True, False])
@pytest.mark.parametrize("wanted", [0, 1, 2])
def test_results_of_pixel_passes_go_too(wanted: int, fuse: bool) -> None:
    """And with them the passes that they alone read; fused, a pass gives the result that is left."""
    source = """
def three(color: Image, other: Image, last: Image) -> tuple[vec4, float, vec4]:
    return color[0, 0] + 0.25, other[0, 0].g * 0.5, last[-1, 0] - color[0, 0]
"""
    three, add = pg.kernel(source=source), pg.kernel(source="def add(a: Image) -> vec4: return a[0, 0] + 1.0")
    frame = pg.Input("frame", "rgba32f", SIZE)
    parts = [DOUBLE(frame, into=pg.target(name, "rgba32f")) for name in ("a", "b", "c")]
    specs = [pg.target(*row) for row in (("x", "rgba16f"), ("y", "r32f"), ("z", "rgba32f"))]
    out = add(three(*parts, into=specs)[wanted], into=pg.target("out", "rgba32f"))
    picture = np.random.default_rng(2).random((*SIZE[::-1], 4), np.float32)
    results = []
    for options in (Options(fuse=fuse), Options(fuse=False, cull=False)):
        with pg.compile(out, options=options) as program:
            results.append(program(frame=picture)["out"])
            names = {resource.name for resource in program.plan.resources}
        left = ("", "", "c")[wanted] if fuse else ("ax", "by", "acz")[wanted]
        assert names == {"frame", "out", *(left if options.cull else "abcxyz")}
    np.testing.assert_array_equal(*results)


def test_what_the_next_run_reads_stays() -> None:
    height = pg.target("height", "rgba32f")
    color = pg.target("color", "rgba32f")
    kernels = KERNELS.replace("tuple[vec4, vec4, float]", "tuple[vec4, vec4]").replace(", dfdx(corner.height)", "")
    paint = pg.fragment(source=kernels.split("def holed")[0], name="paint")
    made = pg.draw(MESH, vertex=PUT, fragment=paint, into=(height, color), shift=0.0, picture=pg.previous(height))
    (step,) = draws(build({"color": made[1]}, SIZE))
    assert len(step.outputs) == 2
