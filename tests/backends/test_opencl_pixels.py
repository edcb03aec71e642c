"""What pixel passes compute on OpenCL."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph import vec3
from passgraph.backends.opencl import OpenCLBackend
from passgraph.backends.opencl.pixel import GROUP, inner_block, pixel_source, run_of
from passgraph.backends.opencl.storage import ImageLayout, Placement
from passgraph.formats import FORMATS
from passgraph.language.lower import Facts, ImageFacts, lower
from tests.conftest import require

pytestmark = pytest.mark.opencl
INT_MIN, INT_MAX = -(2**31), 2**31 - 1
Picture = NDArray[np.float32]


@pytest.fixture
def device() -> Iterator[OpenCLBackend]:
    require("opencl")
    with OpenCLBackend() as opened:
        yield opened


def noise(width: int, height: int, channels: int = 4) -> Picture:
    return np.random.default_rng(3).random((height, width, channels), np.float32)


def run(device: OpenCLBackend, text: str, picture: Picture, border: str = "clamp", format_: str = "rgba32f") -> Picture:
    """The result of a kernel with one image parameter."""
    kernel = pg.kernel(source=text)
    letters = "rgba"[: picture.shape[2]] if picture.shape[2] > 1 else "r"
    source = pg.Input("frame", f"{letters}32f", border=border)
    target = kernel(source, into=pg.target("out", format_))
    with pg.compile(target, backend=device, non_finite="keep") as program:
        return program(frame=picture)["out"]


PAD = {"clamp": "edge", "zero": "constant", "repeat": "wrap", "mirror": "symmetric", "reflect-101": "reflect"}


@pytest.mark.sampled
@pytest.mark.parametrize("size", [(1, 1), (3, 2), (130, 5), (300, 9)])
@pytest.mark.parametrize("border", list(PAD))
def test_neighbours_outside_follow_the_border_rule(device: OpenCLBackend, border: str, size: tuple[int, int]) -> None:
    """Sums of exact values, at sizes with and without an inner block."""
    picture = np.rint(noise(*size) * 64).astype(np.float32)
    text = "def box(c: Image) -> vec4: return c[-1, 0] + c[2, 0] + c[0, -2] + c[0, 1]"
    padded = np.pad(picture, ((2, 2), (2, 2), (0, 0)), mode=PAD[border])  # type: ignore[call-overload]
    width, height = size
    expected = sum(
        padded[2 + dy : 2 + dy + height, 2 + dx : 2 + dx + width] for dx, dy in ((-1, 0), (2, 0), (0, -2), (0, 1))
    )
    np.testing.assert_array_equal(run(device, text, picture, border), expected)


def test_absolute_texels_take_any_coordinate(device: OpenCLBackend) -> None:
    picture = noise(5, 4)
    text = "def far(c: Image) -> vec4: return c.texel(ivec2(-2000000000, 2000000000) + pixel() * 0)"
    np.testing.assert_array_equal(run(device, text, picture), np.broadcast_to(picture[3, 0], picture.shape))


def test_missing_channels_read_0_0_1(device: OpenCLBackend) -> None:
    got = run(device, "def whole(c: Image) -> vec4: return c[0, 0]", np.full((2, 2, 1), 0.5, np.float32))
    np.testing.assert_array_equal(got, np.broadcast_to(np.float32([0.5, 0, 0, 1]), (2, 2, 4)))


def test_pixel_and_size_are_those_of_the_picture(device: OpenCLBackend) -> None:
    text = "def where(c: Image) -> vec4: return vec4(vec2(pixel()), vec2(output_size() + c.size))"
    got = run(device, text, noise(200, 3))
    rows, columns = np.mgrid[0:3, 0:200]
    np.testing.assert_array_equal(got[..., 0], columns)
    np.testing.assert_array_equal(got[..., 1], rows)
    np.testing.assert_array_equal(got[0, 0, 2:], [400, 6])


@pytest.mark.parametrize("format_", ["rgba8", "rgba16", "rgba16f", "rgba32f", "rgba8_srgb"])
def test_what_is_stored_is_read_back_the_same(device: OpenCLBackend, format_: str) -> None:
    """A second pass sees exactly what the first one's target holds."""
    store = pg.kernel(source="def store(c: Image) -> vec4: return c[0, 0] * 1.2 - 0.1")
    double = pg.kernel(source="def load(c: Image) -> vec4: return c[1, 0]")
    first = store(pg.Input("frame", "rgba32f"), into=pg.target("first", format_))
    second = double(first, into=pg.target("second", "rgba32f"))
    with pg.compile([first, second], backend=device) as program:
        result = program(frame=noise(140, 3))
    expected = result["first"]
    if format_.endswith("srgb"):
        # Kernels read linear values.
        rgb = expected[..., :3].astype(np.float64)
        expected = expected.copy()
        expected[..., :3] = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        np.testing.assert_allclose(result["second"][:, :-1], expected[:, 1:], rtol=1e-5)
    else:
        np.testing.assert_array_equal(result["second"][:, :-1], expected[:, 1:])


def test_halves_are_rounded_to_nearest_even(device: OpenCLBackend) -> None:
    special = [
        0.0,
        -0.0,
        1e-8,
        5.9e-8,
        6.1e-5,
        0.1,
        1 / 3,
        2049.0,
        2051.0,
        65504.0,
        65519.9,
        65520.0,
        np.inf,
        -np.inf,
    ]
    picture = np.array(special, np.float32).reshape(1, -1, 1)
    got = run(device, "def copy(c: Image) -> float: return c[0, 0].r", picture, format_="r16f")
    with np.errstate(over="ignore"):
        np.testing.assert_array_equal(got, picture.astype(np.float16).astype(np.float32))


def test_nan_passes_through_a_half_target(device: OpenCLBackend) -> None:
    picture = np.full((1, 1, 1), np.nan, np.float32)
    assert np.isnan(run(device, "def copy(c: Image) -> float: return c[0, 0].r", picture, format_="r16f")).all()


def ints(device: OpenCLBackend, expression: str, a: list[int], b: list[int]) -> list[int]:
    """An int expression of ``a`` and ``b`` for each pair; values travel as bits."""
    pairs = np.array([a, b], np.int64).astype(np.uint32).astype(np.int64)
    halves = np.stack([pairs[0] >> 16, pairs[0] & 0xFFFF, pairs[1] >> 16, pairs[1] & 0xFFFF], axis=-1)
    text = f"""
def whole(c: Image) -> vec4:
    t = c[0, 0]
    a = (int(t.r) << 16) | int(t.g)
    b = (int(t.b) << 16) | int(t.a)
    r = {expression}
    return vec4(float((r >> 16) & 65535), float(r & 65535), 0.0, 0.0)
"""
    got = run(device, text, halves.reshape(1, -1, 4).astype(np.float32)).astype(np.int64)[0]
    return ((got[:, 0] << 16) | got[:, 1]).astype(np.uint32).astype(np.int32).tolist()  # type: ignore[no-any-return]


A = [7, -7, 7, -7, 5, INT_MIN, INT_MAX, INT_MIN, 0]
B = [3, 3, -3, -3, 0, -1, 2, 5, -4]


@pytest.mark.parametrize(
    ("expression", "meaning"),
    [
        ("a // b", lambda a, b: a // b if b else 0),
        ("a % b", lambda a, b: a % b if b else 0),
        ("a + b", lambda a, b: a + b),
        ("a - b", lambda a, b: a - b),
        ("a * b", lambda a, b: a * b),
        ("-a", lambda a, b: -a),
        ("abs(a)", lambda a, b: abs(a)),
        ("a << b", lambda a, b: a << (b & 31)),
        ("a >> b", lambda a, b: a >> (b & 31)),
    ],
)
def test_ints_are_pythons_in_32_bits(device: OpenCLBackend, expression: str, meaning: object) -> None:
    expected = [(meaning(a, b) + 2**31) % 2**32 - 2**31 for a, b in zip(A, B, strict=True)]  # type: ignore[operator]
    assert ints(device, expression, A, B) == expected


def test_floats_become_ints_saturated_and_nan_0(device: OpenCLBackend) -> None:
    special = np.array([1.9, -1.9, 3e9, -3e9, np.inf, -np.inf, np.nan, 2147483520.0], np.float32)
    text = """
def whole(c: Image) -> vec4:
    n = int(c[0, 0].r)
    return vec4(float(n >> 16), float(n & 65535), 0.0, 0.0)
"""
    got = run(device, text, special.reshape(1, -1, 1)).astype(np.int64)[0]
    expected = [1, -1, INT_MAX, INT_MIN, INT_MAX, INT_MIN, 0, 2147483520]
    assert (got[:, 0] * 65536 + got[:, 1]).tolist() == expected


def test_nan_and_infinity_are_told_apart(device: OpenCLBackend) -> None:
    picture = np.array([0, np.nan, np.inf, -np.inf, 3e38], np.float32).reshape(1, -1, 1)
    text = """
def tell(c: Image) -> vec2:
    x = c[0, 0].r
    return vec2(1.0 if isnan(x) else 0.0, 1.0 if isinf(x) else 0.0)
"""
    got = run(device, text, picture, format_="rg32f")
    assert got[0].tolist() == [[0, 0], [1, 0], [0, 1], [0, 1], [0, 0]]


def test_division_by_zero_is_that_of_ieee_754(device: OpenCLBackend) -> None:
    picture = np.array([1, -1, 0], np.float32).reshape(1, -1, 1)
    got = run(device, "def d(c: Image) -> float: return c[0, 0].r / (c[0, 0].r * 0.0)", picture, format_="r32f")[
        0, :, 0
    ]
    assert got[0] == np.inf
    assert got[1] == np.inf
    assert np.isnan(got[2])


def test_sums_are_not_contracted_or_reordered(device: OpenCLBackend) -> None:
    """a * b + c rounds twice, as NumPy does."""
    picture = noise(257, 16)
    got = run(
        device,
        "def m(c: Image) -> float:\n    t = c[0, 0]\n    return t.r * t.g + t.b",
        picture,
        format_="r32f",
    )
    np.testing.assert_array_equal(got[..., 0], picture[..., 0] * picture[..., 1] + picture[..., 2])


def test_branches_and_loops_with_breaks(device: OpenCLBackend) -> None:
    text = """
def count(c: Image) -> float:
    x = c[0, 0].r
    n = 0
    for i in range(100):
        if float(i) > x:
            break
        n = n + i
    return float(n)
"""
    picture = np.arange(40, dtype=np.float32).reshape(1, 40, 1)
    got = run(device, text, picture, format_="r32f")
    assert got[0, :, 0].tolist() == [sum(range(k + 1)) for k in range(40)]


def test_tables_are_read_by_computed_index(device: OpenCLBackend) -> None:
    text = "T = (3.0, 1.0, 4.0, 1.5)\ndef look(c: Image) -> float: return T[int(c[0, 0].r)]"
    got = run(device, text, np.array([[[2], [0], [3], [9]]], np.float32), format_="r32f")
    assert got[0, :, 0].tolist() == [4, 3, 1.5, 1.5]


@pg.kernel
def split(c: pg.Image) -> tuple[vec3, float]:
    return c[0, 0].rgb, c[0, 0].a


def test_several_results(device: OpenCLBackend) -> None:
    into = (pg.target("rgb", "rgb32f"), pg.target("alpha", "r16"))
    picture = noise(6, 5)
    with pg.compile(list(split(pg.Input("frame"), into=into)), backend=device) as program:
        result = program(frame=picture)
    np.testing.assert_array_equal(result["rgb"], picture[..., :3])
    np.testing.assert_allclose(result["alpha"][..., 0], picture[..., 3], atol=1 / 65535)


def test_changed_values_reach_the_next_run(device: OpenCLBackend) -> None:
    kernel = pg.kernel(source="def gain(c: Image, by: float) -> vec4: return c[0, 0] * by")
    with pg.compile(kernel(pg.Input("frame"), pg.Value("by", float)), backend=device) as program:
        picture = np.ones((2, 2, 4), np.float32)
        seen = [program(frame=picture, by=by)["gain"][0, 0, 0] for by in (2.0, 2.0, 3.0)]
    assert seen == [2, 2, 3]


def test_two_runs_give_the_same_bits(device: OpenCLBackend) -> None:
    text = "def wave(c: Image) -> vec4: return sin(c[1, 1] * 40.0) + exp(c[-1, 0]) + sqrt(c[0, 2])"
    picture = noise(333, 77)
    first, second = (run(device, text, picture) for _ in range(2))
    assert first.tobytes() == second.tobytes()


@pytest.mark.parametrize(
    ("width", "reads"),
    [
        *((width, "c[-7, 0] + c[3, -2] + c[0, 5]") for width in (138, 139)),
        *((200, reads) for reads in ("c[0, -3]", "c[0, 1]", "c[-2, 0]", "c[1, 0]")),
    ],
)
def test_the_inner_block_and_what_surrounds_it_are_the_picture(device: OpenCLBackend, width: int, reads: str) -> None:
    """With rows above, below or both, columns left, right or both, and neither; against NumPy."""
    picture = np.rint(noise(width, 9) * 64).astype(np.float32)
    got = run(device, f"def around(c: Image) -> vec4: return {reads}", picture, "zero")
    padded = np.pad(picture, ((9, 9), (9, 9), (0, 0)))
    offsets = [tuple(map(int, pair)) for pair in re.findall(r"(-?\d+), (-?\d+)", reads)]
    expected = sum(padded[9 + dy : 18 + dy, 9 + dx : 9 + dx + width] for dx, dy in offsets)
    np.testing.assert_array_equal(got, expected)


def test_a_block_that_leaves_more_pixels_than_int_counts_is_none() -> None:
    program = lower(
        pg.kernel(source="def far(c: Image) -> vec4: return c[0, 60000]").program, Facts(images={"c": ImageFacts(4)})
    )
    assert inner_block(program, (30_000, 70_000), 128) == (0, 0, 30_000, 10_000)
    assert inner_block(program, (40_000, 70_000), 128) == (0, 0, 0, 0)


class Limited:
    """A device that takes smaller groups than it could."""

    def __init__(self, inner: object, sizes: tuple[int, int, int], most: int) -> None:
        self.inner, self.max_work_item_sizes, self.max_work_group_size = inner, sizes, most

    def __getattr__(self, name: str) -> object:
        return getattr(self.inner, name)


Launched = list[tuple[tuple[int, int], tuple[int, int] | None]]


@pytest.fixture
def launched(device: OpenCLBackend, monkeypatch: pytest.MonkeyPatch) -> Launched:
    """Work-items and group of each kernel that runs from now on."""
    noted: Launched = []
    enqueue = device.cl.enqueue_nd_range_kernel

    def note(queue: object, kernel: object, items: tuple[int, int], group: tuple[int, int] | None, *rest: Any) -> None:
        # PoCL compiles a kernel again for work-items that are counted from elsewhere than 0.
        assert not rest
        noted.append((items, group))
        enqueue(queue, kernel, items, group)

    monkeypatch.setattr(device.cl, "enqueue_nd_range_kernel", note)
    return noted


@pytest.mark.parametrize("height", [9, 600])
def test_what_surrounds_the_inner_block_is_one_kernel_of_one_size_of_group(
    device: OpenCLBackend, height: int, launched: Launched
) -> None:
    """Which PoCL compiles once."""
    picture = np.rint(noise(200, height) * 64).astype(np.float32)
    got = run(device, "def both(c: Image) -> vec4: return c[1, 0] + c[0, 1]", picture)
    padded = np.pad(picture, ((0, 1), (0, 1), (0, 0)), mode="edge")
    np.testing.assert_array_equal(got, padded[:-1, 1:] + padded[1:, :-1])
    pixels = 200 + height - 1
    assert launched[1:] == [((-(-pixels // 64) * 64, 1), (64, 1))]


def test_long_code_has_groups_of_one_run(device: OpenCLBackend, launched: Launched) -> None:
    if not device.is_cpu:
        pytest.skip("graphics processors have no runs")
    for terms in (2, 150):
        text = "c[0, 0]" + "".join(f" * 1.5 + vec4({k}.0)" for k in range(terms))
        run(device, f"def long(c: Image) -> vec4: return {text}", noise(256, 8))
    assert launched == [((2, 8), (2, 4)), ((2, 8), (1, 1))]


@pytest.mark.sampled
@pytest.mark.parametrize("height", [12, 9, 10, 7])
@pytest.mark.parametrize(
    ("sizes", "most"),
    [((4096,) * 3, 4096), ((4096,) * 3, 6), ((4096, 1, 1), 4096), ((2, 4096, 1), 4096), ((1, 1, 1), 1)],
)
def test_groups_stay_within_what_the_device_takes(
    device: OpenCLBackend, sizes: tuple[int, int, int], most: int, height: int, monkeypatch: pytest.MonkeyPatch,
    launched: Launched,
) -> None:  # fmt: skip
    """Three runs across, the last one over a part of the second; rows in groups of 4, 3, 2 or 1."""
    monkeypatch.setattr(device, "device", Limited(device.device, sizes, most))
    monkeypatch.setattr(device, "is_cpu", True)
    picture = noise(300, height)
    got = run(device, "def shifted(c: Image) -> vec4: return c[1, 0]", picture)
    np.testing.assert_array_equal(got, picture[:, np.minimum(np.arange(300) + 1, 299)])
    assert launched[0][0] == (3, height) and len(launched) == 2
    for items, group in launched:
        assert group is not None
        assert group[0] <= sizes[0] and group[1] <= sizes[1] and group[0] * group[1] <= most
        assert items[0] % group[0] == items[1] % group[1] == 0


def test_runs_cover_rows_of_any_width_and_little_twice() -> None:
    for width in range(GROUP, 4 * GROUP + 1):
        run = run_of(width)
        items = -(-width // run)
        assert run % 16 == 0 and GROUP // 2 <= run <= GROUP
        assert (items - 1) * run < width and items * run - width < 16 * items


@pytest.mark.parametrize(
    ("placement", "row", "pixel"), [(None, 300 * 4, 4), (Placement(5 * 1600, -1600, 5, (1, 2, 3, 0)), -1600, 5)]
)
def test_neighbors_are_at_a_fixed_distance_in_memory(placement: Placement | None, row: int, pixel: int) -> None:
    """Compilers then see that the texels of neighboring pixels are adjacent, also where rows are bottom up."""
    kernel = pg.kernel(source="def three(c: Image) -> vec4: return c[0, 0] + c[-2, 1] + c[3, 0]")
    program = lower(kernel.program, Facts(images={"c": ImageFacts(4)}))
    image, target = (ImageLayout(FORMATS["rgba16f"], (300, 9), where) for where in (placement, None))
    text = pixel_source(program, [("c", image)], [target], True, 64, inner_block(program, (300, 9), 64)).text
    inner = text[text.index("void pg_inner") : text.index("void pg_pixel")]
    channels = placement.channels if placement else range(4)
    origin = re.search(r"int (v\d+) = .*\by\b", inner)
    assert origin is not None
    read = [int(d.replace(" ", "") or 0) for d in re.findall(rf"image0\[{origin.group(1)}(.*?)\]", inner)]
    assert read == [row * y + pixel * x + channel for x, y in ((0, 0), (-2, 1), (3, 0)) for channel in channels]
