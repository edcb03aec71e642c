"""Nearest samples, gathers, levels and volumes, held on every backend against NumPy, SciPy, OpenCV and GLSL's own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.glsl import parse
from passgraph.graph.calls import PixelKernel
from passgraph.verify.compare import compare
from tests.conftest import require

Floats = NDArray[np.float32]
Border = Literal["clamp", "zero", "repeat", "mirror", "reflect-101"]
BORDERS: tuple[Border, ...] = get_args(Border)
#: GL filters with fixed-point weights of 8 bits a direction: of the span of the texels, both directions and the
#: rounding of the position.
HARDWARE = 3 * 2.0**-8


@pytest.fixture(scope="module", params=["reference", "numpy"])
def quick(request: pytest.FixtureRequest) -> Iterator[Backend]:
    """Where conformance holds the other backends to what is right here."""
    with open_backend(request.param) as opened:
        yield opened


@pytest.fixture(scope="module")
def glsl() -> Iterator[Any]:
    require("gl")
    from tests.offscreen import offscreen

    with offscreen(400) as made:
        yield made


def picture(width: int, height: int) -> Floats:
    return np.random.default_rng(width * 100 + height).random((height, width, 4), np.float32)


def run(device: Backend, text: str, size: tuple[int, int], *images: tuple[pg.Target, Floats], **more: Any) -> Floats:
    """One kernel ``k`` over handles and their pictures."""
    into = pg.target("out", "rgba32f", size)
    made = pg.kernel(source=text, name="k")(*(handle for handle, _ in images), into=into, **more)
    with pg.compile(made, backend=device, non_finite="keep") as program:
        return np.array(program(**{handle.name: given for handle, given in images})["out"])


def inside(border: Border, at: int, size: int) -> int | None:
    """Which texel a read finds, by exact whole numbers."""
    if border == "repeat":
        return at % size
    if border == "mirror":
        return min(at % (2 * size), 2 * size - 1 - at % (2 * size))
    if border == "reflect-101":
        return 0 if size == 1 else size - 1 - abs(at % (2 * size - 2) - (size - 1))
    near = min(max(at, 0), size - 1)
    return None if border == "zero" and near != at else near


def in_glsl(context: Any, size: tuple[int, int], expression: str, texture: Any, kind: str = "sampler2D") -> Floats:
    """What GLSL's own function gives at the middle of each pixel, row 0 on top."""
    quad = context.program(
        vertex_shader="""#version 400
            out vec2 uv; void main() { uv = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
            gl_Position = vec4(uv * 2.0 - 1.0, 0, 1); }""",
        fragment_shader=f"#version 400\nuniform {kind} t; in vec2 uv; out vec4 c; void main() {{ c = {expression}; }}",
    )
    target = context.texture(size, 4, dtype="f4")
    frame = context.framebuffer([target])
    frame.use()
    texture.use(0)
    context.vertex_array(quad, []).render(vertices=3)
    # Uploaded top row first, so that v goes down as ours does; the target likewise.
    return np.frombuffer(target.read(), np.float32).reshape(size[1], size[0], 4)


# Nearest

UVS = np.float32(
    [0.0, -0.0, 1e-30, -1e-30, 0.125, 0.25, 0.5, 1.0, 1.25, -0.125, 0.9999999, 2.5, -3.75, 1e20, -1e20, np.inf, -np.inf]
)


@pytest.mark.sampled
@pytest.mark.parametrize("border", BORDERS)
def test_nearest_finds_the_texel_by_exact_numbers(device: Backend, border: Border) -> None:
    """Edges, zeros of both signs, far away and infinite: floor of the float32 product, brought inside."""
    places = np.zeros((1, len(UVS), 4), np.float32)
    places[0, :, 0], places[0, :, 1] = UVS, UVS[::-1]
    handle = pg.Input("c").border(border).filter("nearest")
    text = "def k(at: Image, c: Image) -> tuple[vec4, vec4]: return c.nearest(at[0, 0].xy), c.sample(at[0, 0].xy)"
    into = [pg.target(name, "rgba32f", (len(UVS), 1)) for name in ("nearest", "sample")]
    made = pg.kernel(source=text)(pg.Input("at"), handle, into=into)
    with pg.compile(made, backend=device, non_finite="keep") as program:
        for width in (8, 7, 1):
            given = 1 + np.arange(width * width * 4, dtype=np.float32).reshape(width, width, 4)
            got = {name: np.array(picture) for name, picture in program(at=places, c=given).items()}
            with np.errstate(invalid="ignore", over="ignore"):
                texels = np.clip(np.floor(np.float64(places[0, :, :2] * np.float32(width))), -(2**31), 2**31 - 1)
            for lane, (x, y) in enumerate(texels):
                column, row = inside(border, int(x), width), inside(border, int(y), width)
                expected = np.zeros(4) if column is None or row is None else given[row, column]
                assert got["nearest"][0, lane].tolist() == expected.tolist(), (border, places[0, lane])
            # The filter of the handle makes sample() the same read.
            assert np.array_equal(got["nearest"], got["sample"])


@pytest.mark.sampled
@pytest.mark.parametrize("size", [(1, 1), (2, 5), (7, 1), (33, 21)])
def test_a_filter_with_opencv_s_default_border(device: Backend, size: tuple[int, int]) -> None:
    """``reflect-101`` is OpenCV's default and SciPy's mirror; small whole numbers, so that every sum is exact."""
    cv2, ndimage = pytest.importorskip("cv2"), pytest.importorskip("scipy.ndimage")
    weights = np.random.default_rng(3).integers(-3, 4, (5, 5)).astype(np.float32)
    given = np.random.default_rng(5).integers(0, 8, (size[1], size[0], 4)).astype(np.float32)
    text = """
def k(c: Image, weights: Array[float, 25]) -> vec4:
    total = vec4(0.0)
    for y in range(5):
        for x in range(5):
            total += c[x - 2, y - 2] * weights[y * 5 + x]
    return total
"""
    handle = pg.Input("c").border("reflect-101")
    got = run(device, text, size, (handle, given), weights=weights.ravel().tolist())
    np.testing.assert_array_equal(got, cv2.filter2D(given, cv2.CV_32F, weights))
    np.testing.assert_array_equal(got, ndimage.correlate(given, weights[:, :, None], mode="mirror"))


def test_nearest_at_nan_is_the_first_texel(device: Backend) -> None:
    nan = np.full((1, 1, 4), np.nan, np.float32)
    given = picture(3, 3)
    text = "def k(at: Image, c: Image) -> vec4: return c.nearest(vec2(at[0, 0].x, 0.5))"
    assert (
        run(device, text, (1, 1), (pg.Input("at"), nan), (pg.Input("c"), given))[0, 0].tolist() == given[1, 0].tolist()
    )


def test_a_nearest_sample_reads_one_texel() -> None:
    """The filter is known when the graph is compiled: no branch is left, and one read."""
    made = pg.kernel(source="def k(c: Image) -> vec4: return c.sample(uv() * 0.7)")
    for filter, count in (("nearest", 1), ("linear", 4)):
        frame = pg.Input("c", "rgba32f", (4, 4)).filter(filter)
        with pg.compile(made(frame), backend="null") as program:
            body = program.plan.steps[0].program.body
            assert [type(i).__name__ for i in body].count("LoadTexel") == count
            assert "If" not in [type(i).__name__ for i in body]


def test_nearest_is_gls(device: Backend, glsl: Any) -> None:
    """GLSL's texture() under GL_NEAREST, away from the edges of texels."""
    given = picture(13, 9)
    texture = glsl.texture((13, 9), 4, given.tobytes(), dtype="f4")
    texture.filter = glsl.NEAREST, glsl.NEAREST
    expected = in_glsl(glsl, (31, 23), "texture(t, uv * 2.1 - 0.53)", texture)
    text = "def k(c: Image) -> vec4: return c.sample(uv() * 2.1 - 0.53)"
    frame = pg.Input("c").border("repeat").filter("nearest")
    assert np.array_equal(run(device, text, (31, 23), (frame, given)), expected)


def test_a_shader_obeys_the_filter_of_the_handle(device: Backend, glsl: Any) -> None:
    """texture() of a shader read here, whose rows go up, beside the same call on OpenGL."""
    given = picture(13, 9)
    texture = glsl.texture((13, 9), 4, given[::-1].tobytes(), dtype="f4")
    texture.filter = glsl.NEAREST, glsl.NEAREST
    expected = in_glsl(glsl, (31, 23), "texture(t, uv * 2.1 - 0.53)", texture)[::-1]
    text = "uniform sampler2D t; void main() { gl_FragColor = texture(t, pg_position * 2.1 - 0.53); }"
    made = PixelKernel.of_program(parse(text).program)
    frame = pg.Input("c").border("repeat").filter("nearest")
    with pg.compile(made(frame, into=pg.target("out", "rgba32f", (31, 23))), backend=device) as program:
        assert np.array_equal(program(c=given)["out"], expected)


# The device's own filter


@pytest.mark.parametrize(
    ("form", "border"),
    [(form, "clamp") for form in ("rgba32f", "rgba16f", "rgba8", "r8", "rgba16")]
    + [(form, border) for form in ("rgba32f", "r8") for border in ("zero", "repeat", "mirror")],
)
def test_a_devices_filter_stays_within_its_weights(form: str, border: Border) -> None:
    """Where the graph allows it OpenGL filters by itself; the oracle knows how coarsely, others compute as before."""
    require("gl")
    text = "def k(c: Image) -> vec4: return c.sample(uv() * 1.9 - 0.5)"
    handle = pg.Input("c", form, (53, 37)).border(border)
    given = picture(53, 37)[..., : handle.spec.format.channels]  # type: ignore[union-attr]
    made = {
        hardware: pg.kernel(source=text)(
            handle.filter("linear", hardware=hardware), into=pg.target("out", "rgba32f", (101, 83))
        )
        for hardware in (True, False)
    }
    report = compare({"out": made[True]}, ["gl", "numpy"], c=given)
    assert all(each.targets[0].outside == 0 and not each.failed for each in report.backends)
    with pg.compile(made[True], backend="numpy") as one, pg.compile(made[False], backend="numpy") as other:
        assert np.array_equal(one(c=given)["out"], other(c=given)["out"])
    with pg.compile(made[True], backend="gl") as program:
        assert "pass out samples c by the device's own filter, whose weights have 8 bits" in program.plan.explain()
        got = np.array(program(c=given)["out"])
    # What is allowed is no wider than the weights make it: a filter of half the bits would be found out.
    with pg.compile(made[False], backend="reference") as program:
        assert np.abs(got - program(c=given)["out"]).max() <= HARDWARE


@pytest.mark.parametrize(
    ("border", "form", "text"),
    [
        ("reflect-101", "rgba8", "c.sample(uv() * 1.3)"),
        ("clamp", "rgba8_srgb", "c.sample(uv() * 1.3)"),
        ("clamp", "depth32f", "c.sample(uv() * 1.3)"),
        ("clamp", "rgba8", "c.sample(uv() * 1.3) + c.texel(pixel())"),
    ],
)
def test_a_devices_filter_is_left_where_it_means_something_else(border: Border, form: str, text: str) -> None:
    require("gl")
    made = pg.kernel(source=f"def k(c: Image) -> vec4: return {text}")
    handle = pg.Input("c", form, (7, 5)).border(border).filter("linear", hardware=True)
    with pg.compile(made(handle, into=pg.target("out", "rgba32f", (9, 9))), backend="gl") as program:
        assert "the device's own filter" not in program.plan.explain()


@pytest.mark.parametrize("name", ["gl", "gles", "webgpu"])
@pytest.mark.parametrize("border", ["clamp", "zero", "repeat", "mirror", "reflect-101"])
def test_every_border_rule_is_kept_in_native_math(name: str, border: Border) -> None:
    """Samplers wrap as the rule says; reflect-101 has no such mode, and zero none on WebGPU."""
    require(name)
    made = pg.kernel(source="def k(c: Image) -> vec4: return c.sample(uv() * 5.3 - 2.1)", name="k")
    handle = pg.Input("c", "rgba32f", (13, 9)).border(border)
    output, given = made(handle, into=pg.target("out", "rgba32f", (101, 83))), picture(13, 9)
    report = compare({"out": output}, [name], math="native", c=given)
    assert report.passed, report.backends
    with pg.compile(output, name, options=pg.Options(math="native")) as program:
        by_device = "the device's own filter" in program.plan.explain()
        found = np.array(program(c=given)["out"])
    assert by_device == (border in ("clamp", "repeat", "mirror") or (border == "zero" and name != "webgpu"))
    with pg.compile(output, "reference") as program:
        assert np.abs(found - program(c=given)["out"]).max() <= HARDWARE


@pytest.mark.parametrize("name", ["gl", "webgpu"])
def test_one_picture_may_be_filtered_under_several_rules(name: str) -> None:
    require(name)
    text = """
def k(a: Image, b: Image, c: Image) -> vec4:
    p = uv() * 3.0 - 1.0
    return a.sample(p) + 2.0 * b.sample(p) + 4.0 * c.sample(p)
"""
    frame = pg.Input("c", "rgba32f", (13, 9))
    rules = [frame.border(rule) for rule in ("clamp", "repeat", "mirror")]
    output = pg.kernel(source=text, name="k")(*rules, into=pg.target("out", "rgba32f", (101, 83)))
    report = compare({"out": output}, [name], math="native", c=picture(13, 9))
    assert report.passed, report.backends


@pytest.mark.parametrize("name", ["gl", "webgpu"])
@pytest.mark.parametrize("border", ["clamp", "repeat", "mirror"])
def test_far_places_are_filtered_alike_and_farther_ones_are_undecided(name: str, border: Border) -> None:
    """No specification says what a device makes of NaN and of very large places."""
    require(name)
    text = "def k(c: Image, p: Image) -> vec4: return c.sample(p[0, 0].xy + float_from_bits(int(p[0, 0].z)))"
    places = np.zeros((1, 8, 4), np.float32)
    places[0, :, 0] = [0.3, 40.31, -900.27, 1200.5, 3e4, -1e6, 1e30, 0.0]
    places[0, 7, 2] = 0x7FC00000  # the bits of NaN
    handles = pg.Input("c", "rgba32f", (13, 9)).border(border), pg.Input("p", "rgba32f", (8, 1))
    output = pg.kernel(source=text, name="k")(*handles, into=pg.target("out", "rgba32f", (8, 1)))
    given = {"c": picture(13, 9), "p": places}
    (target,) = compare(output, [name], math="native", **given).backends[0].targets
    assert target.outside == 0
    with pg.compile(output, name, options=pg.Options(math="native")) as program:
        found = np.array(program(**given)["out"])
    with pg.compile(output, "numpy") as program:
        exact = np.array(program(**given)["out"])
    # Up to 2**14 texels outside.
    assert np.abs(found - exact)[0, :4].max() <= HARDWARE


# Gather


def test_gather_is_gls(device: Backend, glsl: Any) -> None:
    given = picture(7, 5)
    texture = glsl.texture((7, 5), 4, given.tobytes(), dtype="f4")
    place = "uv{} * 1.31 - 0.17"
    calls = "textureGather(t, {0}, 0) + 2.0 * textureGather(t, {0}, 1) + 4.0 * textureGather(t, {0}, 2)"
    expected = in_glsl(glsl, (17, 11), calls.format(place.format("")), texture)
    text = "def k(c: Image) -> vec4: return c.gather({0}, 0) + 2.0 * c.gather({0}, 1) + 4.0 * c.gather({0}, 2)"
    frame = pg.Input("c").border("repeat")
    assert run(device, text.format(place.format("()")), (17, 11), (frame, given)) == pytest.approx(expected, abs=1e-6)


# Levels

SIZES = [(13, 10), (1, 9), (9, 1), (1, 1), (5, 3), (4097, 3)]


def halved(level: Floats, axis: int) -> Floats:
    """Means over areas along an axis: differences of the integral."""
    count = level.shape[axis]
    half = max(1, count // 2)
    rows = np.moveaxis(level.astype(np.float64), axis, 0).reshape(count, -1)
    integral = np.concatenate([np.zeros((1, rows.shape[1])), np.cumsum(rows, axis=0)])
    edges = np.arange(half + 1) * (count / half)
    at = [np.interp(edges, np.arange(count + 1), column) for column in integral.T]
    made = np.diff(np.stack(at, axis=1), axis=0) * (half / count)
    return np.moveaxis(made.reshape(half, *np.moveaxis(level, axis, 0).shape[1:]), 0, axis).astype(np.float32)


@pytest.mark.sampled
@pytest.mark.parametrize("size", SIZES)
def test_levels_are_means_over_areas(quick: Backend, size: tuple[int, int]) -> None:
    """Each level is the area mean of the one before, odd sides too; OpenCV's where its own rounding allows it."""
    cv2 = pytest.importorskip("cv2")
    given, count = picture(*size), max(size).bit_length()
    text = f"""
def k(c: Image, n: int, m: ivec2) -> vec4:
    return c.texel(pixel(), n) if all(c.size_of(n) == m) and c.levels == {count} else vec4(-1)
"""
    more = pg.Value("n", int), pg.Value("m", pg.ivec2)
    made = pg.kernel(source=text)(pg.Input("c").mipmaps(), *more, into=pg.target("out", "rgba32f", size))
    level = given
    with pg.compile(made, backend=quick) as program:
        for number in range(count):
            height, width = level.shape[:2]
            got = np.array(program(c=given, n=number, m=(width, height))["out"])[:height, :width]
            assert np.allclose(got, level, rtol=0, atol=5e-7), number
            halves = halved(halved(level, 0), 1)
            if max(size) < 100:
                area = cv2.resize(level, halves.shape[1::-1], interpolation=cv2.INTER_AREA)
                assert np.allclose(halves, area.reshape(halves.shape), rtol=0, atol=1e-6)
            level = halves
        assert np.array_equal(program(c=given, n=99, m=(1, 1))["out"][:1, :1], got[:1, :1])


LODS = (-1.0, 0.0, 0.5, 1.0, 2.25, 3.0, 9.0)


@pytest.mark.sampled
@pytest.mark.parametrize(("border", "filter"), [("clamp", "linear"), ("repeat", "nearest"), ("repeat", "linear")])
def test_lod_is_gls(quick: Backend, glsl: Any, border: Border, filter: str) -> None:
    """GLSL's textureLod() on glGenerateMipmap's levels, within the weights of hardware."""
    given = picture(32, 16)
    texture = glsl.texture((32, 16), 4, given.tobytes(), dtype="f4")
    texture.build_mipmaps()
    linear = filter == "linear"
    texture.filter = (glsl.LINEAR_MIPMAP_LINEAR, glsl.LINEAR) if linear else (glsl.NEAREST_MIPMAP_NEAREST, glsl.NEAREST)
    texture.repeat_x = texture.repeat_y = border == "repeat"
    frame = pg.Input("c").border(border).filter(filter).mipmaps()
    made = pg.kernel(source="def k(c: Image, lod: float) -> vec4: return c.sample(uv() * 1.31 - 0.17, lod=lod)")
    with pg.compile(made(frame, pg.Value("lod"), into=pg.target("out", "rgba32f", (23, 19))), backend=quick) as program:
        for lod in LODS:
            expected = in_glsl(glsl, (23, 19), f"textureLod(t, uv * 1.31 - 0.17, {lod})", texture)
            got = np.array(program(c=given, lod=lod)["out"])
            assert np.abs(got - expected).max() <= (HARDWARE if linear else 1e-6), lod


def test_lod_nan_and_of_pictures_without_levels_is_0(quick: Backend) -> None:
    given, nan = picture(9, 7), np.full((1, 1, 4), np.nan, np.float32)
    plain = run(quick, "def k(c: Image) -> vec4: return c.sample(uv())", (5, 4), (pg.Input("c"), given))
    text = "def k(c: Image, n: Image) -> vec4: return c.sample(uv(), {})"
    for handle, lod in ((pg.Input("c").mipmaps(), "n.texel(ivec2(0)).x"), (pg.Input("c"), "3.0 + n.texel(ivec2(0)).x")):
        more = (pg.Input("n"), nan)
        assert np.array_equal(run(quick, text.format(lod), (5, 4), (handle, given), more), plain)


@pytest.mark.parametrize("border", BORDERS)
def test_borders_hold_in_every_level(quick: Backend, border: Border) -> None:
    """Texels outside of a level, by exact whole numbers from that level inside."""
    given = picture(11, 6)
    frame = pg.Input("c").border(border).mipmaps()
    level = run(quick, "def k(c: Image) -> vec4: return c.texel(pixel(), 1)", (5, 3), (frame, given))
    outside = run(quick, "def k(c: Image) -> vec4: return c.texel(pixel() - 9, 1)", (24, 20), (frame, given))
    for y in range(20):
        for x in range(24):
            column, row = inside(border, x - 9, 5), inside(border, y - 9, 3)
            expected = np.zeros(4) if column is None or row is None else level[row, column]
            assert outside[y, x].tolist() == expected.tolist()


def test_levels_of_history_formats_and_fragments(quick: Backend) -> None:
    """Levels of last frame's content, of an sRGB format (means of linear light), of depth, read by a fragment too."""
    halves = pg.kernel(source="def halves(c: Image) -> vec4: return c.texel(ivec2(0), 9)")
    store = pg.kernel(source="def store(c: Image) -> vec4: return c[0, 0]")
    stored = store(pg.Input("c"), into=pg.target("stored", "rgba8_srgb"))
    one = pg.target("one", "rgba32f", (1, 1))
    last = halves(pg.previous(stored).mipmaps(), into=one)
    now = halves(stored.mipmaps(), into=pg.target("now", "rgba32f", (1, 1)))
    given = np.zeros((2, 2, 4), np.float32)
    given[0] = 1.0
    with pg.compile({"last": last, "now": now, "stored": stored}, backend=quick) as program:
        first = {name: np.array(made) for name, made in program(c=given).items()}
        assert first["last"].max() == 0
        assert first["now"] == pytest.approx(np.full((1, 1, 4), 0.5), abs=0.01)
        assert np.array_equal(program(c=1 - given)["last"], first["now"])


def test_reads_by_place_stop_fusion() -> None:
    """What is read at computed places must be there whole: its pass stays one of its own."""
    dim = pg.kernel(source="def dim(c: Image) -> vec4: return c[0, 0] * 0.5")
    for text in ("c.nearest(uv())", "c.gather(uv(), 0)", "c.sample(uv(), lod=1.0)", "c.sample3(vec3(uv(), 0.5))"):
        made = pg.kernel(source=f"def k(c: Image) -> vec4: return {text}")
        handle = dim(pg.Input("c", "rgba32f", (8, 8)), into=pg.target("dim", "rgba32f")).mipmaps()
        out = made(handle, into=pg.target("k", "rgba32f"))
        with pg.compile(out, backend="null") as program:
            names = [step.name for step in program.plan.steps]
        levels = ["dim level 1", "dim level 2", "dim level 3", "dim levels"] if "lod" in text else []
        # Levels that nothing reads are not made.
        assert names == ["dim", *levels, "k"]


# Volumes


@pytest.mark.parametrize("filter", ["linear", "nearest"])
def test_a_volume_is_scipys(device: Backend, filter: str) -> None:
    """SciPy's interpolation of the array itself, its order z, y, x; clamped at its faces."""
    ndimage = pytest.importorskip("scipy.ndimage")
    depth, height, width = 5, 4, 3
    volume = np.random.default_rng(3).random((depth, height, width, 4), np.float32)
    frame = pg.Input("t").filter(filter).slices(depth)
    text = "def k(t: Image) -> vec4: return t.sample3(vec3(uv() * 1.5 - 0.25, fract(uv().x * 7.0) * 1.3 - 0.1))"
    got = run(device, text, (20, 15), (frame, pg.stacked(volume)))
    u = (np.arange(20) + 0.5) / 20
    x, y = np.meshgrid(u * 1.5 - 0.25, (np.arange(15) + 0.5) / 15 * 1.5 - 0.25)
    z = np.broadcast_to((u * 7) % 1 * 1.3 - 0.1, x.shape)
    at = np.stack([z * depth, y * height, x * width]) - 0.5
    if filter == "nearest":
        at = np.rint(at)  # no position lies on an edge
    for channel in range(4):
        expected = ndimage.map_coordinates(volume[..., channel].astype(float), at, order=1, mode="nearest")
        assert np.abs(got[..., channel] - expected).max() < 5e-6


def test_a_volume_is_gls(quick: Backend, glsl: Any) -> None:
    volume = np.random.default_rng(4).random((6, 5, 4, 4), np.float32)
    texture = glsl.texture3d((4, 5, 6), 4, volume.tobytes(), dtype="f4")
    texture.repeat_x = texture.repeat_y = texture.repeat_z = True
    expected = in_glsl(glsl, (17, 13), "texture(t, vec3(uv * 1.7 - 0.3, uv.x * 2.0))", texture, "sampler3D")
    text = "def k(t: Image) -> vec4: return t.sample3(vec3(uv() * 1.7 - 0.3, uv().x * 2.0))"
    got = run(quick, text, (17, 13), (pg.Input("t").border("repeat").slices(6), pg.stacked(volume)))
    assert np.abs(got - expected).max() <= 1.5 * HARDWARE


def test_a_colour_table_is_scipys(device: Backend) -> None:
    """The effect of docs/kernels.md with 33 entries a side, of which the first and the last are those of 0 and 1."""
    interpolate = pytest.importorskip("scipy.interpolate")
    table = np.random.default_rng(6).random((33, 33, 33, 3), np.float32)
    text = """
def k(color: Image, table: Image) -> vec4:
    count = vec3(ivec3(table.size.x, table.size.y // table.slices, table.slices))
    c = color[0, 0]
    return vec4(table.sample3((c.rgb * (count - 1.0) + 0.5) / count).rgb, c.a)
"""
    given = picture(19, 7)
    given[0, 0], given[0, 1, :3] = 0.0, 1.0
    got = run(device, text, (19, 7), (pg.Input("c"), given), (pg.Input("t").slices(33), pg.stacked(table)))
    entries = np.linspace(0, 1, 33)
    lookup = interpolate.RegularGridInterpolator((entries,) * 3, table.astype(float))
    assert np.abs(got[..., :3] - lookup(given[..., 2::-1].astype(float))).max() < 2e-5
    assert np.array_equal(got[..., 3], given[..., 3])


def test_slices_that_do_not_fit_are_refused() -> None:
    made = pg.kernel(source="def k(t: Image) -> vec4: return t.sample3(vec3(0.5))")
    with pytest.raises(pg.GraphError, match=r"pass 'k' reads 't' as 3 slices, and it is 2x8: its height must be a mul"):
        pg.compile(made(pg.Input("t", "rgba32f", (2, 8)).slices(3)), backend="null")
