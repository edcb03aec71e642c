"""Histograms against NumPy, and counting in every way that a backend has against what the counting program means."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.gl.backend import GLBackend
from passgraph.backends.registry import open_backend
from passgraph.graph.reductions import count_bins, count_rows
from passgraph.plan.build import build
from passgraph.plan.data import CountStep, PixelStep
from tests.conftest import require

Picture = NDArray[Any]
#: Backends, and ways that the machine of these tests does not take by itself: those of graphics processors, and OpenGL
#: without compute shaders.
WAYS = ("numpy", "opencl", "gl", "gles", "opencl in groups", "gl in groups", "gl without compute shaders", "webgpu")


@pytest.fixture(params=WAYS, scope="module")
def device(request: pytest.FixtureRequest) -> Iterator[Backend]:
    name, _, way = request.param.partition(" ")
    require(name)
    with open_backend(name) as opened:
        if way == "in groups" and name == "opencl":
            opened.is_cpu = False  # type: ignore[attr-defined]
        elif way == "in groups":
            assert isinstance(opened, GLBackend) and opened.count_group == 16
            opened.count_group = 256
        elif way:
            opened.count_group = 0  # type: ignore[attr-defined]
        yield opened


@pytest.mark.sampled
@pytest.mark.parametrize("size", [(1, 1), (16384, 1), (3, 150), (130, 65)], ids=str)
def test_bytes_are_counted_as_by_bincount(device: Backend, size: tuple[int, int]) -> None:
    picture = np.random.default_rng(1).integers(0, 256, (size[1], size[0], 3)).astype(np.uint8)
    with pg.compile(pg.histogram(pg.Input("frame", "rgb8"), channel=2, name="counts"), backend=device) as program:
        counts = program(frame=picture)["counts"]
    assert counts.shape == (1, 256, 1)
    assert np.array_equal(counts[0, :, 0], np.bincount(picture[..., 2].ravel(), minlength=256))


@pytest.mark.sampled
@pytest.mark.parametrize("bins", [1, 7, 2048])
def test_floats_are_counted_as_by_numpy(device: Backend, bins: int) -> None:
    """Ends, beyond them and NaN; numbers lie in the middle of bins, so that no rounding moves one."""
    random = np.random.default_rng(2)
    low, high = -1.5, 2.5
    picture = (random.integers(-bins // 4 - 1, bins + 2, (40, 33, 1)) + 0.5) * ((high - low) / bins) + low
    picture.reshape(-1)[:6] = low, high, np.nan, np.inf, -np.inf, np.nextafter(high, 9)
    picture = picture.astype(np.float32)
    picture[1, 0] = np.nextafter(np.float32(high), np.float32(9))
    made = pg.histogram(pg.Input("f", "r32f"), bins, channel=0, low=pg.Value("low", float), high=high)
    with pg.compile(made, backend=device, non_finite="keep") as program:
        counts = program(f=picture, low=low)["f.histogram"][0, :, 0]
    assert np.array_equal(counts, np.histogram(picture[np.isfinite(picture)], bins, (low, high))[0])


@pytest.mark.sampled
@pytest.mark.parametrize(("format_", "kind"), [("rgba8", np.uint8), ("rgba16f", np.float16), ("rgba32f", np.float32)])
def test_each_channel_of_each_format_is_counted(device: Backend, format_: str, kind: type) -> None:
    """Steps of an eighth, which all of these hold near enough to stay in their bins."""
    levels = np.random.default_rng(6).integers(0, 8, (19, 45, 4))
    values = (levels + 0.5) / 8
    picture = np.round(values * 255).astype(kind) if kind is np.uint8 else values.astype(kind)
    frame = pg.Input("frame", format_)
    outputs = [pg.histogram(frame, 8, channel=channel, name=f"counts {channel}") for channel in (0, 1, 2, 3)]
    with pg.compile(outputs, backend=device) as program:
        result = program(frame=picture)
    for channel in range(4):
        expected = np.bincount(levels[..., channel].ravel(), minlength=8)
        assert np.array_equal(result[f"counts {channel}"][0, :, 0], expected), channel


@pytest.mark.sampled
def test_counts_go_from_frame_to_frame(device: Backend) -> None:
    """Tables begin at nothing in each run, pictures that are bound anew are counted, and the target is that given."""
    spec = pg.target("counts", "r32f")
    add = pg.kernel(source="def add(a: Image, b: Image) -> float: return a[0, 0].r + b[0, 0].r")
    counts = pg.histogram(pg.Input("frame", "r8"), 5, channel=0, into=spec)
    both = add(counts, pg.previous(spec), into=pg.target("both", "r32f"))
    with pg.compile(both, backend=device) as program:
        made = [program(frame=np.full((2, 3), level, np.uint8))["both"][0, :, 0].tolist() for level in (0, 255, 128)]
    assert made == [[6, 0, 0, 0, 0], [6, 0, 0, 0, 6], [0, 0, 6, 0, 6]]


def counted_alone() -> tuple[pg.Target, Picture, list[list[int]]]:
    """The counting by itself, of 48 bins, on a picture that anybody may have written, and what it means: rows beyond
    the picture count nothing."""
    random = np.random.default_rng(4)
    picture = random.integers(-3, 52, (21, 177)).astype(np.float32)
    wild = np.array([np.nan, np.inf, -np.inf, 3e38, -3e38, 4294967297, 0.5, 1.5, 48.01, 49, 1e-30, -0.0], np.float32)
    picture.reshape(-1)[random.permutation(picture.size)[: 9 * wild.size]] = np.tile(wild, 9)
    counts = count_rows(pg.Input("numbers", "r32f"), pg.target("counts", "rgba32f", (12, 23)), "counts")
    expected = [[int((row == number).sum()) for number in range(1, 49)] for row in picture] + [[0] * 48] * 2
    return counts, picture, expected


@pytest.mark.parametrize("as_kernel", [False, True], ids=["count", "kernel"])
def test_counting_is_the_kernel_whatever_a_picture_holds(device: Backend, as_kernel: bool) -> None:
    counts, picture, expected = counted_alone()
    if as_kernel:
        counts = count_bins(pg.Input("numbers", "r32f").border("zero"), into=counts.spec)
    with pg.compile(counts, backend=device, non_finite="keep") as program:
        made = program(numbers=picture[..., None])["counts"]
        (step,) = program.plan.steps
    assert made.reshape(23, 48).tolist() == expected
    assert isinstance(step, CountStep) != as_kernel


@pytest.mark.parametrize("change", ["r16f numbers", "rgba16f counts", "more bins"])
def test_a_count_of_other_formats_runs_its_kernel(device: Backend, change: str) -> None:
    """Documents may hold such counts; backends count in r32f and rgba32f, and have tables of 2048 bins."""
    picture = np.array([[1, 2, 2, 5, np.nan, 2400]], np.float32)
    spec = pg.target("counts", "rgba16f" if "counts" in change else "rgba32f", (600 if "bins" in change else 2, 1))
    counts = count_rows(pg.Input("numbers", "r16f" if "numbers" in change else "r32f"), spec, "counts")
    with pg.compile(counts, backend=device, non_finite="keep") as program:
        made = program(numbers=picture[..., None])["counts"].ravel()
        assert [type(step) for step in program.plan.steps] == [PixelStep]
    assert made[:8].tolist() == [1, 2, 0, 0, 1, 0, 0, 0] and made.sum() == 4 + ("bins" in change)


def test_counts_go_where_each_picture_lies(device: Backend) -> None:
    """In memory of the caller's whose rows lie apart, and from the bottom up."""
    counts, picture, expected = counted_alone()
    for step in (1, -1):
        outer = np.full((23, 103, 4), 7, np.float32)
        with pg.compile(counts, backend=device, non_finite="keep") as program:
            program(numbers=picture[..., None], into={"counts": outer[::step, :12]})
        assert outer[::step, :12].reshape(23, 48).tolist() == expected
        assert (outer[:, 12:] == 7).all()


@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_pictures_of_a_host_are_counted_where_they_lie_and_it_is_told(isolation: Any) -> None:
    """Read and written in an engine's own textures, their rows from the bottom up, and one a part of a larger."""
    require("gl")
    from tests.offscreen import offscreen

    counts, picture, expected = counted_alone()
    padded = np.full((40, 200), 5, np.float32)
    padded[4:25, 10:187] = picture[::-1]
    with offscreen(430) as context, pg.gl.Host.current(isolation) as host:
        numbers = context.texture((200, 40), 1, padded.tobytes(), dtype="f4")
        texture = context.texture((12, 23), 4, dtype="f4")
        with pg.compile(counts, backend=host, non_finite="keep") as program:
            program.run(
                numbers=host.texture(numbers.glo, region=(10, 4, 177, 21)), into={"counts": host.texture(texture.glo)}
            )
            assert [line for line in program.explain().splitlines() if "in a compute shader" in line]
            (step,) = program.plan.steps
            assert isinstance(step, CountStep)
            assert ("", step.program.key) not in [key[:2] for key in host.programs.made]  # its program is not even made
        made = np.frombuffer(texture.read(), np.float32).reshape(23, 48)[::-1]
    assert made.tolist() == expected


def test_the_reference_counts_by_the_kernel() -> None:
    """What the oracle judges by, against NumPy."""
    counts, picture, expected = counted_alone()
    with pg.compile(counts, backend="reference", non_finite="keep") as program:
        made = program(numbers=picture[..., None])
    assert made["counts"].reshape(23, 48).tolist() == expected


def test_a_histogram_counts_in_a_step_of_its_own_from_a_document_too() -> None:
    made = pg.histogram(pg.Input("frame", "rgb8", (64, 48)), 15)
    data = pg.to_data({"made": made})
    assert [sorted(one) for one in data["passes"] if "kernel" not in one] == [["count", "into", "name"]]
    for outputs in ({"made": made}, pg.from_data(data)):
        steps = [step for step in build(outputs).steps if isinstance(step, CountStep)]
        assert [(step.name, step.bins) for step in steps] == [("frame.histogram rows", 16)]


def test_a_document_from_before_counts_were_passes_counts_by_its_kernel() -> None:
    """Its counting pass has a kernel, as any pixel pass, and counts the same."""
    counts, picture, expected = counted_alone()
    kernel = count_bins(pg.Input("numbers", "r32f").border("zero"), into=counts.spec)
    data = pg.to_data(kernel)
    assert [sorted(one) for one in data["passes"]] == [["constants", "images", "into", "kernel", "name", "values"]]
    with pg.compile(pg.from_data(data), backend="numpy", non_finite="keep") as program:
        assert program(numbers=picture[..., None])["counts"].reshape(23, 48).tolist() == expected


def test_a_count_is_not_fused_into_its_reader() -> None:
    counts, picture, expected = counted_alone()
    twice = pg.kernel(source="def twice(counts: Image) -> vec4: return 2.0 * counts[0, 0]")
    with pg.compile(twice(counts), backend="numpy", non_finite="keep") as program:
        assert (
            program(numbers=picture[..., None])["twice"].reshape(23, 48).tolist() == (2 * np.array(expected)).tolist()
        )
        assert [type(step) for step in program.plan.steps] == [CountStep, PixelStep]


@pytest.mark.sampled
def test_it_is_told_which_way_counts(device: Backend) -> None:
    made = pg.histogram(pg.Input("frame", "r8", (8, 8)), name="counts")
    for options in (pg.Options(), pg.Options(fuse=False)):
        with pg.compile(made, backend=device, options=options) as program:
            lines = [line for line in program.explain().splitlines() if "in this device's own way" in line]
            ran = program.profile(1, frame=np.zeros((8, 8), np.uint8)).passes
        assert [row.passes for row in ran if "counts rows" in row.passes] == [("counts rows",)]
        plain = isinstance(device, GLBackend) and not device.count_group
        assert [line.partition(" implemented in this")[0] for line in lines] == ([] if plain else ["- counts rows is"])


@pytest.mark.parametrize("backend", ["numpy", "opencl", "gl", "webgpu"])
def test_a_count_beyond_what_floats_hold_is_near(backend: str) -> None:
    """An odd number of texels above 2^24, all of them in one bin: the sum of rows that the passes make, to the bit."""
    require(backend)
    width, height = 16_383, 1_025
    with pg.compile(pg.histogram(pg.Input("frame", "r8"), 4, channel=0), backend=backend) as program:
        counts = program(frame=np.full((height, width), 255, np.uint8))["frame.histogram"][0, :, 0].astype(np.float64)
    assert counts.tolist() == [0, 0, 0, 16_792_576]
    assert 0 < abs(counts[3] - width * height) <= 2.0**-20 * width * height


LOOPING = """
def looping(a: Image, b: Image) -> float:
    found = a[1, -1].r
    for i in range(300):
        if b[0, 0].r * 300.0 <= float(i):
            break
        found = max(found, a.texel(ivec2(pixel().x + i, pixel().y)).r)
    return found
"""


@pytest.mark.sampled
def test_what_is_fused_into_a_histogram_is_counted(device: Backend) -> None:
    """Of two pictures, one with a border and read by place, in a loop that uses up a device's trips."""
    random = np.random.default_rng(8)
    frame, reach = (random.random((40, 700, 1)).astype(np.float32) for _ in range(2))
    looping = pg.kernel(source=LOOPING)
    most = looping(pg.Input("a", "r32f").border("mirror"), pg.Input("b", "r32f"), into=pg.target("most", "r32f"))
    outputs = {"counts": pg.histogram(most, 37, channel=0)}
    kept = {**outputs, "most": most}
    with pg.compile(outputs, backend=device) as program, pg.compile(kept, backend=device) as apart:
        made, given = program(a=frame, b=reach)["counts"], apart(a=frame, b=reach)
        assert program.plan.steps[0].work.startswith("pixels with most")
    expected = np.histogram(given["most"], 37, (0, 1))[0]
    assert np.abs(made[0, :, 0] - expected).sum() <= 2  # a number beside an edge
    assert np.array_equal(made, given["counts"])


@pytest.mark.sampled
def test_every_texel_of_one_bin_is_counted(device: Backend) -> None:
    """All add to one entry of a table, in groups that share it."""
    with pg.compile(pg.histogram(pg.Input("frame", "r8"), 2048, channel=0), backend=device) as program:
        for level in (0, 255):
            counts = program(frame=np.full((301, 517), level, np.uint8))["frame.histogram"][0, :, 0]
            assert counts[-1 if level else 0] == counts.sum() == 301 * 517


@pytest.mark.sampled
def test_histograms_of_one_picture_go_beside_one_another_and_in_threads(device: Backend) -> None:
    random = np.random.default_rng(9)
    pictures = [random.integers(0, 256, (33, 70, 4)).astype(np.uint8) for _ in range(4)]
    frame = pg.Input("frame", "rgba8")
    outputs = [pg.histogram(frame, channel=channel, name=f"{channel}") for channel in (0, 3)]

    def count(picture: Picture) -> None:
        with pg.compile(outputs, backend=device) as program:
            for _ in range(3):
                made = program(frame=picture)
        for channel in (0, 3):
            expected = np.bincount(picture[..., channel].ravel(), minlength=256)
            assert np.array_equal(made[f"{channel}"][0, :, 0], expected)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(count, pictures))


@pytest.mark.parametrize("format_", ["r8", "rg16f", "r32f"])
def test_luma_of_one_or_two_channels_is_the_first(format_: str) -> None:
    """A target that a kernel wrote a brightness into is counted as bright as it is."""
    levels = np.random.default_rng(7).integers(0, 8, (9, 11, 4))
    first = pg.kernel(source="def first(c: Image) -> float: return c[0, 0].r")
    both = pg.kernel(source="def both(c: Image) -> vec2: return c[0, 0].rg")
    made = (both if format_ == "rg16f" else first)(pg.Input("frame", "rgba8"), into=pg.target("light", format_))
    with pg.compile([pg.histogram(made, 8), pg.reduce(made, "arg_max", channel="luma")]) as program:
        result = program(frame=np.round((levels + 0.5) / 8 * 255).astype(np.uint8))
    assert np.array_equal(result["light.histogram"][0, :, 0], np.bincount(levels[..., 0].ravel(), minlength=8))
    row, column = np.unravel_index(levels[..., 0].argmax(), (9, 11))
    assert result["light.arg_max"][0, 0].tolist() == [column, row]


def test_luma_is_weighted() -> None:
    picture = np.zeros((1, 4, 3), np.float32)
    picture[0, 1:] = np.eye(3)
    with pg.compile(pg.histogram(pg.Input("frame", "rgb32f"), 100)) as program:
        counts = program(frame=picture)["frame.histogram"][0, :, 0]
    assert np.flatnonzero(counts).tolist() == [0, 7, 21, 71]


def test_an_opengl_that_has_compute_shaders_by_extensions_counts_in_them() -> None:
    """As of 4.2, whose shaders say which extensions they are of."""
    require("gl")
    picture = np.random.default_rng(10).integers(0, 9, (20, 30)).astype(np.uint8)
    with open_backend("gl") as opened:
        assert isinstance(opened, GLBackend)
        opened.context.gl.has = replace(opened.context.gl.has, version=(4, 2))
        with pg.compile(pg.histogram(pg.Input("frame", "r8"), channel=0), backend=opened) as program:
            counts = program(frame=picture)["frame.histogram"][0, :, 0]
        assert [key for key, *_ in opened.programs.made if key.startswith("256 in groups")]
    assert np.array_equal(counts, np.bincount(picture.ravel(), minlength=256))
