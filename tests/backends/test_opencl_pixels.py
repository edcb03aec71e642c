"""How pixel passes run on OpenCL: the inner block, runs and groups; what they compute is in tests/cross."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.opencl import OpenCLBackend
from passgraph.backends.opencl.pixel import GROUP, inner_block, pixel_source, run_of
from passgraph.backends.opencl.storage import ImageLayout
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


@pytest.mark.parametrize("lies", [(0, 1200, 4, (0, 1, 2, 3)), (5 * 1600, -1600, 5, (1, 2, 3, 0))])
def test_neighbors_are_at_a_fixed_distance_in_memory(lies: tuple[int, int, int, tuple[int, ...]]) -> None:
    """Compilers then see that the texels of neighboring pixels are adjacent, also where rows are bottom up."""
    kernel = pg.kernel(source="def three(c: Image) -> vec4: return c[0, 0] + c[-2, 1] + c[3, 0]")
    program = lower(kernel.program, Facts(images={"c": ImageFacts(4)}))
    format_, size, (_, row, pixel, channels) = FORMATS["rgba16f"], (300, 9), lies
    image, target = ImageLayout(format_, size, *lies), ImageLayout.tight(format_, size)
    text = pixel_source(program, [("c", image)], [target], True, 64, inner_block(program, (300, 9), 64)).text
    inner = text[text.index("void pg_inner") : text.index("void pg_pixel")]
    origin = re.search(r"int (v\d+) = .*\by\b", inner)
    assert origin is not None
    read = [int(d.replace(" ", "") or 0) for d in re.findall(rf"image0\[{origin.group(1)}(.*?)\]", inner)]
    assert read == [row * y + pixel * x + channel for x, y in ((0, 0), (-2, 1), (3, 0)) for channel in channels]
