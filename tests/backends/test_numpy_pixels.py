"""Pixel passes of the numpy backend where vectors begin and end: against slices of padded arrays, to the bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.numpy.pixels.buffer_layout import MANY, Layout, StageLayout
from passgraph.backends.numpy.pixels.chains import single_stage
from passgraph.plan.data import PixelStep

#: The border rules as NumPy pads.
PADS = {"clamp": "edge", "zero": "constant", "repeat": "wrap", "mirror": "symmetric", "reflect-101": "reflect"}
#: How far the kernels below read: left, right, up, down.
LEFT, RIGHT, UP, DOWN = 5, 2, 3, 1
ALIKE = pg.kernel(
    source="def alike(c: Image) -> vec4: return c[-5, 0] * 0.5 + c[2, 1] * 0.25 + c[0, -3] * 0.125 + c[-1, -1]"
)
MIXED = pg.kernel(
    source="def mixed(c: Image) -> vec4:\n"
    "    return (c[-5, 0] * 0.5 + c[2, 1] * 0.25 + c[0, -3] * 0.125 + c[-1, -1]).bgra * vec4(1.0, 2.0, 4.0, 8.0)"
)
LOOPED = pg.kernel(
    source="def looped(c: Image, reach: Const[int] = 8) -> vec4:\n"
    "    total = vec4(0.0)\n"
    "    for i in range(-5, 3):\n"
    "        for j in range(-3, 2):\n"
    "            total += c[i, j] * float(i * 8 + j) if i * j != 2 else c[0, j]\n"
    "    return total"
)


def padded(picture: np.ndarray, border: str) -> np.ndarray:
    """The picture with what reads beyond its edges see.  NumPy repeats a narrow picture often enough by itself."""
    return np.pad(picture, ((UP, DOWN), (LEFT, RIGHT), (0, 0)), PADS[border])  # type: ignore[call-overload,no-any-return]


def expected(name: str, picture: np.ndarray, border: str) -> np.ndarray:
    height, width, _ = picture.shape
    around = padded(picture, border)

    def at(x: int, y: int) -> np.ndarray:
        return around[UP + y : UP + y + height, LEFT + x : LEFT + x + width]

    if name == "looped":
        total = np.zeros_like(picture)
        for i in range(-5, 3):
            for j in range(-3, 2):
                total = total + (at(i, j) * np.float32(i * 8 + j) if i * j != 2 else at(0, j))
        return total
    half, quarter, eighth = (np.float32(2.0**-k) for k in (1, 2, 3))
    total = at(-5, 0) * half + at(2, 1) * quarter + at(0, -3) * eighth + at(-1, -1)
    if name == "mixed":
        return total[..., [2, 1, 0, 3][: total.shape[-1]]] * np.array([1, 2, 4, 8], np.float32)
    return total


@pytest.mark.sampled
@pytest.mark.parametrize("border", list(PADS))
@pytest.mark.parametrize("kernel", [ALIKE, MIXED, LOOPED], ids=lambda kernel: str(kernel.name))
def test_rows_of_every_width_meet_their_edges(kernel: pg.Kernel, border: str) -> None:
    """Narrower than a reach, as wide as one vector or several, one pixel more and one less."""
    rng = np.random.default_rng(5)
    for width in (1, 2, 3, 6, 7, 8, 11, 12, 13, 15, 16, 17, 18, 19, 24, 31, 32, 33, 37, 47, 48, 49, 50, 67):
        picture = rng.random((11, width, 4), np.float32)
        made = kernel(pg.Input("frame", "rgba32f", (width, 11), border=border), into=pg.target("out", "rgba32f"))
        with pg.compile(made, "numpy:1") as program:
            found = program(frame=picture)["out"]
        np.testing.assert_array_equal(found, expected(kernel.name, picture, border), err_msg=f"{width} wide")


@pytest.mark.parametrize(("width", "lanes"), [(1, 4), (3, 4), (5, 4), (8, 8), (11, 8), (16, 16)])
@pytest.mark.parametrize("kernel", [ALIKE, MIXED], ids=lambda kernel: str(kernel.name))
def test_slender_pictures_have_vectors_that_fit_their_rows(kernel: pg.Kernel, width: int, lanes: int) -> None:
    """The same bits as NumPy's, of floats and of halves; small pictures of that width have the code of wide ones."""
    height = MANY // width + 1
    whole = np.random.default_rng(width).random((height, width, 4), np.float32)
    for format_, picture in (("rgba32f", whole), ("rgba16f", whole.astype(np.float16))):
        made = kernel(pg.Input("frame", format_, (width, height)), into=pg.target("out", "rgba32f"))
        with pg.compile(made, "numpy:2") as program:
            (step,) = program.plan.steps
            found = program(frame=picture)["out"]
        np.testing.assert_array_equal(found, expected(kernel.name, picture.astype(np.float32), "clamp"))
        assert isinstance(step, PixelStep)
        layout = Layout.for_chain(single_stage(step), 16)
        alike = 1 << min(4 * width, 16).bit_length() - 1  # of four channels
        assert layout.stages[0].lanes == (lanes if kernel is MIXED else alike)
        assert Layout.for_chain(single_stage(replace(step, size=(width, 9))), 16).stages[0].lanes == 16


@pytest.mark.parametrize("width", [2, 5, 13])
def test_slender_pictures_of_bytes_are_exact(width: int) -> None:
    """Channels that change places, and numbers that a pass only chooses among."""
    turned = pg.kernel(source="def turned(c: Image) -> vec3: return vec3(c[0, 0].b, c[0, 0].r, c[-1, 0].g)")
    least = pg.kernel(source="def least(c: Image) -> vec3: return min(c[0, 0], c[-1, 0]).rgb")
    picture = np.random.default_rng(width).integers(0, 256, (MANY // width + 1, width, 3)).astype(np.uint8)
    before = np.concatenate([picture[:, :1], picture[:, :-1]], 1)
    frame = pg.Input("c")
    outputs = [kernel(frame, into=pg.target(kernel.name, "rgb8")) for kernel in (turned, least)]
    with pg.compile(outputs, "numpy:2", results="stored") as program:
        made = program(c=picture)
    assert np.array_equal(made["turned"], np.stack([picture[..., 2], picture[..., 0], before[..., 1]], -1))
    assert np.array_equal(made["least"], np.minimum(picture, before))


FAR = pg.kernel(source="def far(c: Image) -> vec4: return c[-70, -1].abgr * 0.5 + c[60, 0] + c[-3, -1] * 0.25")


@pytest.mark.parametrize("border", list(PADS))
def test_reads_far_beyond_an_edge(border: str) -> None:
    """What is cut off a row's ends is then longer than several vectors."""
    for width in (9, 70, 71, 128, 135, 200):
        picture = np.random.default_rng(8).random((4, width, 4), np.float32)
        around = np.pad(picture, ((1, 0), (70, 60), (0, 0)), PADS[border])  # type: ignore[call-overload]
        expected = around[:-1, :width, ::-1] * np.float32(0.5) + around[1:, 130:]
        expected += around[:-1, 67 : 67 + width] * np.float32(0.25)
        made = FAR(pg.Input("frame", "rgba32f", (width, 4), border=border), into=pg.target("out", "rgba32f"))
        with pg.compile(made, "numpy:1") as program:
            np.testing.assert_array_equal(program(frame=picture)["out"], expected, err_msg=f"{width} wide")


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("height", [1, 2, 3, 7, 8, 9, 23])
def test_several_rows_at_once_end_with_the_picture(height: int, channels: int) -> None:
    format_ = {1: "r32f", 2: "rg32f", 3: "rgb32f", 4: "rgba32f"}[channels]
    kind = {1: "float", 2: "vec2", 3: "vec3", 4: "vec4"}[channels]
    part = {1: ".r", 2: ".rg", 3: ".rgb", 4: ""}[channels]
    text = f"def down(c: Image) -> {kind}:\n    return c[0, -3]{part} * 0.5 + c[0, 1]{part} * 0.25 + c[0, 0]{part}"
    picture = np.random.default_rng(6).random((height, 29, channels), np.float32)
    made = pg.kernel(source=text)(pg.Input("frame", format_, (29, height)), into=pg.target("out", format_))
    with pg.compile(made, "numpy:2") as program:
        (step,) = program.plan.steps
        found = program(frame=picture)["out"].reshape(picture.shape)
    assert isinstance(step, PixelStep)
    assert StageLayout(single_stage(step), 0, 16).rows == min(8, 1 << (height.bit_length() - 1))
    around = np.pad(picture, ((3, 1), (0, 0), (0, 0)), "edge")
    above, below = around[:height] * np.float32(0.5), around[4:] * np.float32(0.25)
    np.testing.assert_array_equal(found, above + below + picture)


@pytest.mark.parametrize("width", [1, 5, 16, 21])
def test_several_targets_of_rows_shorter_than_a_turn(width: int) -> None:
    """Several rows and formats at once, into memory of the caller's: what lies beside it stays as it was."""
    results = "max(c[0, -1], c[0, 1]), c[0, -1].r * 0.5 + c[1, 1].g"
    kernel = pg.kernel(source=f"def two(c: Image) -> tuple[vec4, float]: return {results}")
    stored = np.random.default_rng(9).integers(0, 256, (10, width, 4)).astype(np.uint8)
    targets = pg.target("most", "rgba8"), pg.target("sum", "r32f")
    made = kernel(pg.Input("frame", "rgba8", (width, 10)), into=targets)
    outer = [np.full((10, width + 150, 4), 7, np.uint8), np.full((10, width + 150, 1), 7, np.float32)]
    wanted = [array.copy() for array in outer]
    around = np.pad(stored, ((1, 1), (0, 1), (0, 0)), "edge")
    values = np.divide(around, np.float32(255), dtype=np.float32)
    wanted[0][:, 3 : 3 + width] = np.maximum(around[:-2, :-1], around[2:, :-1])
    wanted[1][:, 3 : 3 + width] = values[:-2, :-1, :1] * np.float32(0.5) + values[2:, 1:, 1:2]
    inner = {name: array[:, 3 : 3 + width] for name, array in zip(("most", "sum"), outer, strict=True)}
    with pg.compile(made, "numpy:1") as program:
        program(frame=stored, into=inner)
    for found, expected in zip(outer, wanted, strict=True):
        np.testing.assert_array_equal(found, expected)


LEAVING = pg.kernel(
    source="""
def leaving(c: Image) -> vec4:
    n = 0
    skipped = 0
    last = 0
    for i in range(50):
        n += 1
        for j in range(9):
            last = j
            if j * 3 > pixel().x:
                break
        if (i + pixel().x) % 3 == 0:
            skipped += 1
            continue
        if i > pixel().x + 2 * pixel().y:
            break
    return vec4(float(n), float(skipped), float(last), c[0, 0].a)
"""
)


def test_lanes_that_left_a_loop_change_nothing_in_it() -> None:
    """Neighbours leave after different numbers of trips; what comes before the break must count for none of them."""
    width, height = 37, 6
    expected = np.zeros((height, width, 4), np.float32)
    for y in range(height):
        for x in range(width):
            skipped = 0
            for i in range(50):
                n = i + 1
                last = next((j for j in range(9) if j * 3 > x), 8)
                if (i + x) % 3 == 0:
                    skipped += 1
                    continue
                if i > x + 2 * y:
                    break
            expected[y, x] = n, skipped, last, 1.0
    made = LEAVING(pg.Input("frame", "rgba32f", (width, height)), into=pg.target("out", "rgba32f"))
    with pg.compile(made, "numpy") as program:
        np.testing.assert_array_equal(program(frame=np.ones((height, width, 4), np.float32))["out"], expected)


ANYWHERE = pg.kernel(
    source="""
def anywhere(where: Image, c: Image, table: Array[float, 5], k: int = 2) -> vec4:
    p = ivec2(where[0, 0].xy)
    here = c.texel(p)
    if k > 1:
        here += c.texel(ivec2(k, k))
    return vec4(here.g * table[p.x % 5], here.r, where.texel(p.yx).y, here.b)
"""
)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_texels_anywhere_have_their_channels(channels: int) -> None:
    """Channels that an image lacks are 0, 0, 1."""
    width, height = 21, 18
    format_ = {1: "r32f", 2: "rg32f", 3: "rgb32f", 4: "rgba32f"}[channels]
    rng = np.random.default_rng(7)
    where = rng.integers(-9, 30, (height, width, 2)).astype(np.float32)
    picture = rng.random((height, width, channels), np.float32)
    table = np.arange(1.0, 6.0, dtype=np.float32)
    size = (width, height)
    made = ANYWHERE(
        pg.Input("where", "rg32f", size), pg.Input("c", format_, size), table=table.tolist(),
        into=pg.target("out", "rgba32f"),
    )  # fmt: skip
    with pg.compile(made, "numpy") as program:
        found = program(where=where, c=picture)["out"]
    full = np.concatenate([picture, np.zeros((height, width, 3), np.float32)], 2)[..., :3]
    px, py = where[..., 0].astype(int), where[..., 1].astype(int)
    here = full[np.clip(py, 0, height - 1), np.clip(px, 0, width - 1)] + full[2, 2]
    turned = where[np.clip(px, 0, height - 1), np.clip(py, 0, width - 1), 1]
    expected = np.stack([here[..., 1] * table[px % 5], here[..., 0], turned, here[..., 2]], 2)
    np.testing.assert_array_equal(found, expected)


SIDE_BY_SIDE = pg.kernel(
    source="""
def side_by_side(where: Image, c: Image) -> vec4:
    p = ivec2(where[0, 0].xy)
    total = 0.0
    if where[0, 0].x > -40.0:
        total += c.texel(p + ivec2(-6, 0)).r + c.texel(p + ivec2(-1, 0)).r * 2.0 + c.texel(p).r * 4.0
        total += c.texel(p + ivec2(7, 0)).r * 8.0 + c.texel(p + ivec2(1, 0)).r * 16.0
    return vec4(total, c.texel(p + ivec2(2, 1)).r, c.texel(p + ivec2(3, 1)).r, c.texel(p + ivec2(2, -3)).r)
"""
)


@pytest.mark.parametrize("border", list(PADS))
@pytest.mark.parametrize("size", [(1, 1), (3, 2), (13, 9), (14, 5), (60, 40)])
def test_texels_side_by_side_meet_the_edges(size: tuple[int, int], border: str) -> None:
    """Some vectors lie inside, some partly outside, some lanes far away or idle."""
    width, height = size
    rng = np.random.default_rng(9)
    x, y = np.meshgrid(np.arange(70), np.arange(30))
    near = np.stack([x * width // 70, y * height // 30], 2) + rng.integers(-2, 3, (30, 70, 2)) * (
        x[..., None] % 32 < 16
    )
    far = rng.integers(-50, 50, (30, 70, 2))
    where = np.where((rng.random((30, 70, 1)) < 0.05) & (y[..., None] > 15), far, near).astype(np.float32)
    picture = rng.random((height, width), np.float32)
    frame, other = pg.Input("where", "rg32f", (70, 30)), pg.Input("c", "r32f", size, border=border)
    with pg.compile(SIDE_BY_SIDE(frame, other, into=pg.target("out", "rgba32f")), "numpy") as program:
        found = program(where=where, c=picture)["out"]
    around = np.pad(picture, 64, PADS[border])  # type: ignore[call-overload]
    px, py = (where[..., axis].astype(int) + 64 for axis in range(2))

    def texel(dx: int, dy: int = 0) -> np.ndarray:
        return around[py + dy, px + dx]

    steps = [texel(dx) * np.float32(2**k) for k, dx in enumerate((-6, -1, 0, 7, 1))]
    total = ((steps[0] + steps[1]) + steps[2]) + (steps[3] + steps[4])
    expected = [np.where(where[..., 0] > -40, total, np.float32(0)), texel(2, 1), texel(3, 1), texel(2, -3)]
    np.testing.assert_array_equal(found, np.stack(expected, 2))


@pytest.mark.parametrize("number", [np.uint8, np.uint16])
def test_pixels_of_three_whole_numbers_are_moved_exactly(number: type) -> None:
    """Every width of a vector's rest, to the bit: channels change places, and nothing beside them is written."""
    turned = pg.kernel(source="def turned(c: Image) -> vec3: return vec3(c[0, 0].b, c[0, 0].r, c[-1, 0].g)")
    name = f"rgb{8 * np.dtype(number).itemsize}"
    most = np.iinfo(number).max
    for width in [*range(1, 68), 200]:
        picture = np.random.default_rng(width).integers(0, most + 1, (3, width, 3)).astype(number)
        room = np.full((3, width + 200, 3), 7, number)
        with pg.compile(turned(pg.Input("c"), into=pg.target("made", name)), backend="numpy") as program:
            program(c=picture, into={"made": room[:, :width]})
        before = np.concatenate([picture[:, :1], picture[:, :-1]], 1)
        assert np.array_equal(room[:, :width], np.stack([picture[..., 2], picture[..., 0], before[..., 1]], -1))
        assert (room[:, width:] == 7).all()


@pytest.mark.parametrize("name", ["r8", "rgba8", "rgb8", "r16", "rgba16"])
def test_numbers_that_are_passed_on_are_what_they_were(name: str) -> None:
    """All that a format holds, beside one channel that is computed."""
    passed = pg.kernel(source="def passed(c: Image) -> vec4: return vec4(c[0, 0].rgb, c[0, 0].a * 0.0)")
    channels, bits = len(name.rstrip("0123456789")), int(name.lstrip("rgba"))
    numbers = np.arange(1 << bits, dtype=np.uint8 if bits == 8 else np.uint16).reshape(-1, 16, 1)
    picture = np.repeat(numbers, channels, axis=2)
    kind = {1: "float", 3: "vec3", 4: "vec4"}[channels]
    same = pg.kernel(source=f"def same(c: Image) -> {kind}: return c[0, 0].{'rgba'[:channels]}")
    kernel = passed if channels == 4 else same
    with pg.compile(kernel(pg.Input("c"), into=pg.target("made", name)), backend="numpy", results="stored") as program:
        made = program(c=picture)["made"]
    assert np.array_equal(made[..., : min(3, channels)], picture[..., :3])
    assert channels < 4 or not made[..., 3].any()


def test_numbers_that_are_passed_on_to_another_format_are_converted() -> None:
    same = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
    bytes_ = np.arange(256, dtype=np.uint8).reshape(-1, 16, 4)
    for picture, name, expected in (
        (bytes_, "rgba16", bytes_.astype(np.uint16) * 257),
        (bytes_.astype(np.uint16) * 257, "rgba8", bytes_),
    ):
        with pg.compile(same(pg.Input("c"), into=pg.target("made", name)), "numpy", results="stored") as program:
            assert np.array_equal(program(c=picture)["made"], expected)
