"""The reference backend against what can be computed by hand: it is the meaning, so nothing else may vouch for it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.scene import Mesh

CORNER = """
class Corner:
    position: vec4
    uv: vec2

def place(vertex: Vertex, m: mat4) -> Corner:
    return Corner(m * vec4(vertex.position, 1.0), vertex.uv)

def show(corner: Corner) -> vec4:
    return vec4(corner.uv, fragment_depth(), 1.0)
"""
PADS = {"clamp": "edge", "repeat": "wrap", "mirror": "symmetric", "zero": "constant"}


def pixels(text: str, frame: NDArray[np.float32], border: str = "clamp", **values: object) -> NDArray[np.float32]:
    kernel = pg.kernel(source=text)
    out = kernel(pg.Input("frame", border=border), into=pg.target("out", "rgba32f"), **values)
    with pg.compile(out, backend="reference") as program:
        return program(frame=frame)["out"]


def draw(mesh: Mesh, matrix: NDArray[np.float64], size: tuple[int, int], **state: object) -> pg.Result:
    place, show = pg.vertex(source=CORNER, name="place"), pg.fragment(source=CORNER, name="show")
    color = pg.draw(
        mesh, vertex=place, fragment=show, m=matrix, into=pg.target("color", "rgba32f"),
        depth=pg.target("depth", "depth32f"), **state,
    )  # fmt: skip
    with pg.compile([color, color.depth], backend="reference", size=size) as program:
        return program()


def picture(width: int = 7, height: int = 5) -> NDArray[np.float32]:
    return np.random.default_rng(4).random((height, width, 4), np.float32)


@pytest.mark.parametrize("border", PADS)
def test_borders_are_those_of_numpy_pad(border: str) -> None:
    frame = picture()
    padded = np.pad(frame, ((3, 3), (3, 3), (0, 0)), PADS[border])  # type: ignore[call-overload]
    got = pixels("def far(c: Image) -> vec4: return c[-3, 2]", frame, border)
    np.testing.assert_array_equal(got, padded[5 : 5 + 5, 0:7])


def test_filtered_reads_are_bilinear() -> None:
    frame = picture(4, 1)
    got = pixels("def between(c: Image) -> vec4: return c.sample(vec2(0.5, 0.5))", frame)
    np.testing.assert_allclose(got[0, 0], (frame[0, 1].astype(float) + frame[0, 2]) / 2, rtol=2**-23)


def test_loops_leave_and_skip_as_in_python() -> None:
    text = """
def walk(c: Image) -> vec4:
    total = 0.0
    for i in range(10):
        if float(i) > c[0, 0].r * 10.0:
            break
        if i % 3 == 1:
            continue
        total += float(i)
    if total > 20.0:
        return vec4(-1.0)
    return vec4(total)
"""
    frame = picture()

    def by_hand(limit: float) -> float:
        total = 0.0
        for i in range(10):
            if i > limit:
                break
            if i % 3 == 1:
                continue
            total += i
        return -1.0 if total > 20 else total

    expected = [[by_hand(float(v) * 10.0) for v in row] for row in frame[..., 0]]
    np.testing.assert_array_equal(pixels(text, frame)[..., 0], expected)


def test_arrays_and_parts_are_assigned() -> None:
    text = """
def turn(c: Image) -> vec4:
    values = [0.0] * 4
    for i in range(4):
        values[3 - i] = c[0, 0][i]
    v = vec4(values[0], values[1], values[2], values[3])
    v.xw = v.wx
    return v
"""
    frame = picture()
    np.testing.assert_array_equal(pixels(text, frame), frame[..., [0, 2, 1, 3]])


def test_matrices_multiply_as_in_mathematics() -> None:
    matrix = np.arange(16.0).reshape(4, 4)
    text = "def times(c: Image, m: mat4) -> vec4: return m * c[0, 0]"
    frame = picture()
    np.testing.assert_allclose(pixels(text, frame, m=matrix), frame.astype(float) @ matrix.T, rtol=2**-22)


@pytest.mark.parametrize(("fmt", "dtype"), [("rgba16f", np.float16), ("rgba8", np.uint8), ("rgba16", np.uint16)])
def test_formats_round_to_nearest_even(fmt: str, dtype: type) -> None:
    frame = np.linspace(0, 1, 4 * 777, dtype=np.float32).reshape(1, 777, 4)
    kernel = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
    with pg.compile(kernel(pg.Input("frame"), into=pg.target("out", fmt)), backend="reference") as program:
        got = program(frame=frame)["out"]
    if dtype is np.float16:
        expected = frame.astype(np.float16).astype(np.float32)
    else:
        steps = np.float32(np.iinfo(dtype).max)  # counted in float32, as every backend's kernels count them
        expected = np.rint(frame * steps) / steps
    np.testing.assert_array_equal(got, expected)


def test_srgb_is_stored_encoded_and_read_linear() -> None:
    frame = np.linspace(0, 1, 400, dtype=np.float32).reshape(1, 100, 4)
    kernel = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
    stored = kernel(pg.Input("frame"), into=pg.target("stored", "rgba8_srgb"), name="store")
    linear = kernel(stored, into=pg.target("linear", "rgba32f"), name="read")
    with pg.compile([stored, linear], backend="reference") as program:
        result = program(frame=frame)
    x = frame[..., :3].astype(np.float64)
    encoded = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(result["stored"][..., :3], np.rint(encoded * 255) / 255, atol=2**-24)
    np.testing.assert_allclose(result["linear"][..., :3], x, atol=0.5 / 255 * 2.4)


def floor(depth: float = 20.0) -> Mesh:
    """A floor below the eye that runs from behind it to far ahead; uv are its x and -z."""
    corners = np.array([[-9, -1, 5], [9, -1, 5], [9, -1, -depth], [-9, -1, -depth]], np.float64)
    return Mesh.make(corners, [[0, 1, 2], [0, 2, 3]], uvs=np.stack([corners[:, 0], -corners[:, 2]], -1))


def projection(near: float = 0.5, far: float = 50.0) -> NDArray[np.float64]:
    """90 degrees in both directions."""
    a, b = -(far + near) / (far - near), -2 * far * near / (far - near)
    return np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, a, b], [0, 0, -1, 0]], float)


def test_varyings_are_perspective_correct_and_the_near_plane_cuts() -> None:
    """Each pixel's ray meets the floor at a point that is known; the floor begins behind the eye."""
    size = (64, 48)
    result = draw(floor(), projection(), size)
    x = (np.arange(size[0]) + 0.5) / size[0] * 2 - 1
    y = 1 - (np.arange(size[1]) + 0.5) / size[1] * 2
    far = np.where(y < 0, 1 / np.maximum(-y, 1e-9), np.inf)  # distance along -z at which a row meets y = -1
    z = np.broadcast_to(far[:, None], (size[1], size[0]))
    across = x[None, :] * z
    hit = (z <= 20) & (z >= 0.5) & (np.abs(across) <= 9)
    inner = hit & (z < 19) & (np.abs(across) < 8.7)
    color, depth = result["color"].astype(float), result["depth"][..., 0].astype(float)
    assert (color[..., 3] > 0)[inner].all() and not (color[..., 3] > 0)[~hit & (z > 21)].any()
    np.testing.assert_allclose(color[..., 1][inner], z[inner], rtol=2e-3)  # corners are snapped to 1/256 pixel
    np.testing.assert_allclose(color[..., 0][inner], across[inner], rtol=2e-3, atol=2e-2)
    a, b = projection()[2, 2], projection()[2, 3]
    expected = (a * -z[inner] + b) / z[inner] * 0.5 + 0.5
    np.testing.assert_allclose(depth[inner], expected, atol=2e-4)
    np.testing.assert_array_equal(color[..., 2][inner], depth[inner])


def test_a_centre_on_an_edge_belongs_to_the_top_left() -> None:
    """A square from pixel centre to pixel centre covers its left and top rows of centres, not its right and bottom."""
    low, high = -0.75, 0.25  # centres of pixels 0 and 4 of 8, in clip space
    corners = np.array([[low, -high - 0.5, 0], [high, -high - 0.5, 0], [high, -low - 0.5, 0], [low, -low - 0.5, 0]])
    corners[:, 0] += -1 / 8
    corners[:, 1] += 1 / 8
    mesh = Mesh.make(corners, [[0, 1, 2], [0, 2, 3]], uvs=np.zeros((4, 2)))
    covered = draw(mesh, np.eye(4), (8, 8))["color"][..., 3] > 0
    rows, columns = np.flatnonzero(covered.any(axis=1)), np.flatnonzero(covered.any(axis=0))
    assert covered.sum() == 16
    left = (corners[0, 0] * 0.5 + 0.5) * 8 - 0.5
    top = (0.5 - corners[2, 1] * 0.5) * 8 - 0.5
    assert left == round(left) and top == round(top), "the corners must lie on centres, or this shows nothing"
    assert (columns[0], columns[-1]) == (left, left + 3)
    assert (rows[0], rows[-1]) == (top, top + 3)


def test_culling_knows_front_from_back() -> None:
    mesh = Mesh.make([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], [[0, 1, 2]], uvs=np.ones((3, 2)))
    shown = {cull: draw(mesh, np.eye(4), (4, 4), cull=cull)["color"].any() for cull in ("none", "back", "front")}
    assert shown == {"none": True, "back": True, "front": False}


def test_polygon_offset_adds_slope_and_units() -> None:
    mesh = Mesh.make([[-1, -1, -1], [3, -1, 1], [-1, 3, -1]], [[0, 1, 2]], uvs=np.zeros((3, 2)))
    flat, moved = (draw(mesh, np.eye(4), (16, 16), polygon_offset=o)["depth"] for o in ((0.0, 0.0), (2.0, 64.0)))
    slope = 1 / 32  # depth runs from 0 to 1 over 32 pixels
    inner = (moved < 1) & (flat < 1)
    np.testing.assert_allclose((moved - flat)[inner], 2 * slope + 64 * 2.0**-23, atol=1e-6)


def test_null_lists_what_would_run() -> None:
    kernel = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0] * 2.0")
    out = kernel(pg.Input("frame", "rgba32f", (4, 4)), into=pg.target("out", "rgba32f"))
    with pg.compile(out, backend="null") as program:
        assert not program(frame=np.ones((4, 4, 4), np.float32))["out"].any()
        assert program.backend.calls == ["out"]  # type: ignore[attr-defined]
