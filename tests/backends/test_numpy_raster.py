"""Shading a tile at once against shading in order: the same bits, whatever the kernel and the draw's state."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.numpy.raster import draw as raster
from passgraph.backends.numpy.raster import entries, fragments
from passgraph.backends.numpy.raster.setup import holds
from passgraph.language.kernel import Kernel, kernel_from_text
from passgraph.plan.data import Options

SIZE = (75, 70)  # two tiles each way, neither filled

KERNELS = """
class Corner:
    position: vec4
    color: vec4
    place: vec2

def lean(vertex: Vertex) -> Corner:
    w = 1.5 + vertex.position.x
    return Corner(vec4(vertex.position.xy, vertex.position.z * w, w), vertex.color, vertex.position.xy * 9.0)

def branches(corner: Corner) -> vec4:
    shade = 0.0
    if corner.place.x > 0.0:
        shade = corner.color.r
        if corner.place.y > corner.place.x:
            shade = shade + 1.0
        else:
            for i in range(5):
                shade = shade + corner.color.g * float(i)
    else:
        shade = -corner.color.b if front_facing() else fragment_depth()
    return vec4(shade, corner.color.gba)

def loops(corner: Corner) -> vec4:
    total = 0.0
    for i in range(12):
        if float(i) > abs(corner.place.x):
            break
        if i % 3 == 1 and corner.place.y > 0.0:
            continue
        for j in range(4):
            if float(j) * corner.color.r > 1.5:
                break
            total = total + corner.color.g
        total = total + 1.0
    return vec4(total, float(pixel().x), float(pixel().y), 1.0)

def tables(corner: Corner, weights: Array[float, 6]) -> tuple[vec4, float]:
    k = int(corner.color.r * 5.0)
    near = weights[k] if corner.place.x > 0.0 else 0.5
    return vec4(near, float(k // 2), float(-k % 3), uv().x), corner.color.g / max(corner.color.b, 0.1)

def holes(corner: Corner) -> vec4:
    if (pixel().x + pixel().y) % 3 == 0:
        discard()
    return corner.color

def pictures(corner: Corner, picture: Image) -> tuple[vec4, vec3]:
    at = ivec2(floor(corner.place * 3.0))
    return picture.texel(at), picture.sample(corner.place).rgb + picture.texel(at - 40).rgb
"""


def stage(name: str) -> Kernel:
    kind = "vertex" if name == "lean" else "fragment"
    return Kernel(kernel_from_text(KERNELS, name), kind)


def mesh(count: int, size: float) -> pg.Mesh:
    """Triangles of all sizes up to ``size``, facing both ways, some across the near plane and the sides."""
    random = np.random.default_rng(count)
    centres = random.uniform(-1.2, 1.2, (count, 1, 3))
    corners = centres + random.normal(size=(count, 3, 3)) * random.uniform(0.0, size, (count, 1, 1))
    return pg.Mesh.make(
        corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3), colors=random.uniform(0.0, 1.0, (3 * count, 4))
    )


def drawn(name: str, geometry: pg.Mesh, backend: str = "numpy", **state: object) -> list[NDArray[np.float32]]:
    formats = {"tables": ("rgba32f", "r32f"), "pictures": ("rgba16f", "rgb32f")}.get(name, ("rgba32f",))
    into = tuple(pg.target(f"out{k}", format_, clear=0.25) for k, format_ in enumerate(formats))
    values = {
        "tables": {"weights": (0.1, 0.7, 0.3, 0.9, 0.2, 0.4)},
        "pictures": {"picture": pg.Input("picture").border(str(state.pop("border", "clamp")))},
    }.get(name, {})
    # In the middle of the range, so that fragments pass whichever way they are compared.
    depth = pg.target("depth", "depth32f_stencil8" if "stencil" in state else "depth32f", clear=0.5)
    made = pg.draw(
        geometry, vertex=stage("lean"), fragment=stage(name), into=into if len(into) > 1 else into[0], depth=depth,
        values=values, **state,
    )  # fmt: skip
    results = list(made) if isinstance(made, tuple) else [made]
    given = (
        {"picture": np.random.default_rng(1).random((SIZE[1], SIZE[0], 4), np.float32)} if name == "pictures" else {}
    )
    with pg.compile([*results, results[0].depth], backend=backend, size=SIZE) as program:
        found = program(**given)
        return [np.array(found[key]) for key in found]


def both(monkeypatch: pytest.MonkeyPatch, name: str, geometry: pg.Mesh, **state: object) -> None:
    at_once = drawn(name, geometry, **dict(state))
    monkeypatch.setattr(raster, "is_deferred", lambda step: False)
    in_order = drawn(name, geometry, **dict(state))
    assert np.count_nonzero(at_once[0] != 0.25) > 100  # something was drawn
    for one, other in zip(at_once, in_order, strict=True):
        np.testing.assert_array_equal(one.view(np.int32), other.view(np.int32))


@pytest.mark.sampled
@pytest.mark.parametrize("name", ["branches", "loops", "tables", "pictures"])
@pytest.mark.parametrize(("count", "size"), [(30, 0.8), (700, 0.03)])
def test_kernels_in_lanes_give_the_bits_of_kernels_one_by_one(
    monkeypatch: pytest.MonkeyPatch, name: str, count: int, size: float
) -> None:
    both(monkeypatch, name, mesh(count, size))


@pytest.mark.parametrize("border", ["zero", "repeat", "mirror", "reflect-101"])
def test_borders_give_the_same_texels(monkeypatch: pytest.MonkeyPatch, border: str) -> None:
    both(monkeypatch, "pictures", mesh(30, 0.8), border=border)


@pytest.mark.parametrize(
    "state",
    [
        {"depth_compare": "greater_equal", "cull": "back"},
        {"depth_compare": "always"},
        {"depth_compare": "not_equal", "cull": "front"},
        {"depth_compare": "less_equal", "depth_write": False},
        {"polygon_offset": (1.5, 20.0)},
    ],
    ids=str,
)
def test_states_decide_the_same_fragments(monkeypatch: pytest.MonkeyPatch, state: dict[str, object]) -> None:
    both(monkeypatch, "branches", mesh(60, 0.6), **state)


MARKED = pg.Stencil("not_equal", 2, read_mask=3, write_mask=7, passed="increment", depth_fail="invert", fail="zero")


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("name", "state"),
    [
        ("branches", {"blend": "alpha"}),
        ("tables", {"blend": ("premultiplied", None), "color_mask": ((True, False, True, True), (True,) * 4)}),
        ("pictures", {"blend": ("multiply", "add"), "depth_compare": "not_equal"}),
        ("holes", {"stencil": MARKED, "depth_compare": "less_equal"}),
        ("holes", {"depth_compare": "greater"}),
        ("loops", {"stencil": MARKED, "color_mask": (False,) * 4}),
    ],
    ids=str,
)
def test_vectors_of_eight_and_of_sixteen_give_the_same_bits_in_order(
    monkeypatch: pytest.MonkeyPatch, name: str, state: dict[str, object]
) -> None:
    found = []
    for width in (8, 16):
        monkeypatch.setattr(fragments, "lanes", lambda width=width: width)
        found.append(drawn(name, mesh(80, 0.5), **state))
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one.view(np.int32), other.view(np.int32))


def test_a_triangle_between_centres_is_left_out_and_one_over_a_centre_is_kept() -> None:
    # In 1/256 pixel: the centre of pixel (0, 0) is (128, 128); rows run downward.
    assert holds(100, 100, 160, 100, 100, 200, 128, 128)
    assert not holds(130, 100, 160, 100, 130, 200, 128, 128)
    # The left edge belongs to the triangle, the right edge does not.
    assert holds(128, 100, 228, 100, 128, 200, 128, 128)
    assert not holds(28, 100, 128, 100, 128, 200, 128, 128)


def test_scratch_is_kept_from_frame_to_frame() -> None:
    geometry = mesh(300, 0.2)
    made = pg.draw(
        geometry, vertex=stage("lean"), fragment=stage("loops"), into=pg.target("out"),
        depth=pg.target("depth", "depth32f"),
    )  # fmt: skip
    made_by: list[raster.Raster] = []
    call = raster.Raster.__call__

    def watched(self: raster.Raster, *arguments: object) -> None:
        made_by.append(self)
        call(self, *arguments)  # type: ignore[arg-type]

    with pytest.MonkeyPatch.context() as patch, pg.compile(made, size=SIZE, options=Options(static=False)) as program:
        patch.setattr(raster.Raster, "__call__", watched)
        program.run()
        kept = {name: id(value) for name, value in vars(made_by[0]).items() if isinstance(value, np.ndarray)}
        program.run()
        assert {name: id(vars(made_by[1])[name]) for name in kept} == kept
        assert len(kept) > 8


def test_arrays_of_another_kind_are_refused() -> None:
    good = [np.zeros((1, 3), np.int32), np.zeros(1, np.uint8), np.zeros(1, np.uint8), np.zeros((1, 2), np.int64)]
    call = entries.classify.call()
    call.bound(*good)(0, 1, 0)
    assert good[3].tolist() == [[1, 0]]
    for wrong in (np.zeros((1, 3), np.int64), np.zeros(3, np.int32), np.zeros((3, 2), np.int32).T):
        with pytest.raises(AssertionError):
            call.bound(wrong, *good[1:])
