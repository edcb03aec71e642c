"""Smaller levels in GLSL: the handle that is passed decides, and what is read is what OpenGL reads of real mip maps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from agreement_glsl import Picture
from original import HEAD, Original, original

import passgraph as pg
from passgraph.glsl import parse
from passgraph.language import ir

BACKENDS = ["reference", "numpy", "gl", "opencl"]
SIZE = (23, 19)
#: GL filters with fixed-point weights of 8 bits a direction, and so between two levels.
HARDWARE = 6 * 2.0**-8
#: llvmpipe's logarithm of squared lengths is a straight line between powers of 2: so far is half of it off.
LOG2 = 0.0431
NEWER = HEAD.replace("330", "430")
#: What chooses a level; ``p`` goes from (0, 0) to (1, 1), and grows alike everywhere.
READS = {
    "itself": "texture(t, p * 2.31)",
    "along one side": "texture(t, p * vec2(0.3, 4.7) + 0.17)",
    "turned": "texture(t, mat2(1.5, 2.5, -2.0, 0.75) * p)",
    "enlarged": "texture(t, p * 0.21)",
    "a bias": "texture(t, p * 2.31, 1.25) + texture(t, p * 2.31, -1.5)",
    "an old name": "texture2D(t, p * 2.31, 1.25)",
    "projected": "textureProj(t, vec3(p * 4.62, 2.0)) + textureProj(t, vec4(p * 4.62, 0.0, 2.0), 0.7)",
    "an offset": "textureOffset(t, p * 2.31, ivec2(3, -2)) + textureOffset(t, p * 2.31, ivec2(-1, 2), 1.6)",
    "a level": "textureLod(t, p * 1.31, 0.0) + textureLod(t, p * 1.31, 1.375) + textureLod(t, p, 7.0)",
    "a level of data": "textureLod(t, p * 1.31, p.x * 5.0 - 0.5)",
    "a level and an offset": "textureLodOffset(t, p * 1.31, 1.0, ivec2(2, 1))",
    "a level, projected": "textureProjLod(t, vec3(p, 0.7), 2.25)",
    "derivatives": "textureGrad(t, p, vec2(0.1, 0.02), vec2(-0.03, 0.2))",
    "derivatives and an offset": "textureGradOffset(t, p, vec2(0.1, 0.02), vec2(-0.03, 0.2), ivec2(0, 3))",
    "texels": "texelFetch(t, ivec2(p * vec2(7.9, 3.9)), 2) + texelFetchOffset(t, ivec2(p * 7.0), 1, ivec2(1, 0))",
    "sizes": "vec4(textureSize(t, 0), textureSize(t, 3)) + vec4(textureSize(t, 5), textureQueryLevels(t), 0)",
    "asked": "vec4(textureQueryLod(t, p * 2.31), textureQueryLod(t, p * 0.1))",
}


@pytest.fixture(scope="module")
def gl() -> Iterator[Original]:
    with original() as context:
        yield context


def picture(width: int = 32, height: int = 16) -> Picture:
    return np.random.default_rng(width * 100 + height).random((height, width, 4), np.float32)


def text(read: str) -> str:
    return f"uniform sampler2D t; void main() {{ vec2 p = pg_position; gl_FragColor = {read}; }}"


def drawn(
    handle: pg.Target, read: str, backend: str = "reference", given: Picture | None = None, size: tuple[int, int] = SIZE
) -> Picture:
    made = pg.kernel(glsl=text(read))(handle, into=pg.target("out", "rgba32f", size))
    with pg.compile(made, backend=backend, non_finite="keep") as program:
        return np.array(program(t=picture() if given is None else given)["out"])


@pytest.mark.sampled
@pytest.mark.parametrize("nearest", [False, True])
@pytest.mark.parametrize("read", READS)
def test_reads_choose_levels_as_gl_does(gl: Original, read: str, nearest: bool) -> None:
    expected = gl.run(text(READS[read]), SIZE, {"t": picture()}, {}, NEWER, levels=True, nearest=nearest, repeat=True)
    got = drawn(repeated("nearest" if nearest else "linear").mipmaps(), READS[read])
    bound = LOG2 if read == "asked" else 2e-6 if read in ("texels", "sizes") else HARDWARE
    assert np.abs(got - expected).max() <= bound


def repeated(filter: Any) -> pg.Target:
    return pg.Input("t").border("repeat").filter(filter)


@pytest.mark.parametrize(
    ("filter", "read"), [("linear", "textureOffset(t, p * 2.31, ivec2(3, -2), 0.3)"), ("nearest", READS["texels"])]
)
def test_backends_choose_the_same_levels(filter: str, read: str) -> None:
    expected = drawn(repeated(filter).mipmaps(), read)
    for backend in BACKENDS[1:]:
        np.testing.assert_allclose(drawn(repeated(filter).mipmaps(), read, backend), expected, atol=2e-5)


@pytest.mark.parametrize("filter", ["linear", "nearest"])
def test_a_handle_without_levels_has_one(gl: Original, filter: str) -> None:
    """Whatever level is asked for; and nothing is computed for levels that there are not."""
    nearest = filter == "nearest"
    read = " + ".join(READS[name] for name in ("itself", "a bias", "a level of data", "derivatives"))
    expected = gl.run(text(read), SIZE, {"t": picture()}, {}, NEWER, nearest=nearest, repeat=True)
    assert np.abs(drawn(repeated(filter), read) - expected).max() <= HARDWARE
    assert drawn(repeated(filter), "vec4(textureSize(t, 2), textureQueryLevels(t), 0)").max() == 32
    # Where to read is computed from p.x too, so that both have as much to compute.
    assert len(_body("textureLod(t, p, p.x * 9.0)")) == len(_body("texture(t, p)")) < len(_body("texture(t, p * p.x)"))


def _body(read: str) -> tuple[Any, ...]:
    """The instructions of a kernel whose picture has no levels."""
    made = pg.kernel(glsl=text(read))(pg.Input("t", "rgba32f", (4, 4)))
    with pg.compile(made, backend="null") as program:
        return program.plan.steps[0].program.body


def test_rows_of_levels_count_from_the_bottom() -> None:
    """A level of odd sides is the mean over areas, which is how OpenGL leaves it open; here for each of its rows."""
    given = picture(13, 7)
    across = np.zeros((6, 13))
    for i in range(6):
        across[i, 2 * i : 2 * i + 3] = np.array([6 - i, 6, i + 1]) / 13
    down = np.zeros((3, 7))
    for i in range(3):
        down[i, 2 * i : 2 * i + 3] = np.array([3 - i, 3, i + 1]) / 7
    level = np.einsum("rh,hwk,cw->rck", down, given.astype(np.float64), across)
    handle = pg.Input("t").mipmaps()
    got = drawn(handle, "texelFetch(t, ivec2(gl_FragCoord.xy), 1)", given=given, size=(6, 3))
    np.testing.assert_allclose(got, level, atol=1e-6)
    turned = drawn(handle, "textureLod(t, p, 1.0)", given=given, size=(6, 3))
    np.testing.assert_allclose(turned, level, atol=1e-6)
    beside = drawn(handle, "texelFetchOffset(t, ivec2(gl_FragCoord.xy), 1, ivec2(0, 1))", given=given, size=(6, 3))
    np.testing.assert_allclose(beside[1:], level[:-1], atol=1e-6)
    edges = drawn(handle, "texelFetch(t, ivec2(0, 99), 3) - texelFetch(t, ivec2(0), 77)", given=given, size=(1, 1))
    assert edges.tolist() == [[[0, 0, 0, 0]]]


def test_a_level_is_chosen_where_texture_stands_in_a_branch_or_a_loop() -> None:
    """Where GLSL leaves it open: by the pixel beside, which goes the same way."""
    looped = """uniform sampler2D t; uniform float k; void main() {
        vec4 sum = vec4(0);
        for (int i = 0; i < 3; i++) { if (gl_FragCoord.x < 12.0 * k) sum += texture(t, pg_position * float(i + 1)); }
        gl_FragColor = sum; }"""
    handle = repeated("linear").mipmaps()
    made = pg.kernel(glsl=looped)(handle, k=1.0, into=pg.target("out", "rgba32f", SIZE))
    with pg.compile(made, backend="reference") as program:
        got = np.array(program(t=picture())["out"])
    plain = drawn(handle, "texture(t, p) + texture(t, p * 2.0) + texture(t, p * 3.0)")
    np.testing.assert_allclose(got[:, :12], plain[:, :12], atol=1e-5)
    assert not got[:, 12:].any()


def test_each_picture_of_a_shader_has_its_own_levels() -> None:
    """An array of samplers, and one beside it; travelled, too."""
    several = """uniform sampler2D maps[2]; uniform sampler2D t; void main() {
        vec2 p = pg_position * 2.31;
        gl_FragColor = vec4(texture(maps[0], p).r, texture(maps[1], p).r, texture(t, p).r, 1.0); }"""
    handle = repeated("linear")
    kernel = pg.kernel(glsl=several)
    made = kernel([handle, handle.mipmaps()], handle, into=pg.target("out", "rgba32f", SIZE))
    first, deep = drawn(handle, "texture(t, p * 2.31)")[..., 0], drawn(handle.mipmaps(), "texture(t, p * 2.31)")[..., 0]
    expected = np.stack([first, deep, first, np.ones_like(first)], axis=-1)
    for graph in ({"out": made}, pg.from_data(pg.to_data({"out": made}))):
        with pg.compile(graph, backend="reference") as program:
            assert np.array_equal(program(t=picture())["out"], expected)
    assert np.abs(first - deep).max() > 0.1
    again = kernel([handle, handle], handle, into=pg.target("out", "rgba32f", SIZE))
    with pg.compile(again, backend="reference") as program:
        assert np.array_equal(program(t=picture())["out"][..., 1], first), "a call changes the kernel for no other one"


def test_hostile_levels_and_offsets_end() -> None:
    """Ends of int, infinities and NaN choose some level of those that there are."""
    values = ("1e38 * 1e38", "-1e38 * 1e38", "log(-1.0)", "3e38", "-0.0")
    reads = [f"textureLod(t, p, {value}) + textureGrad(t, p, vec2({value}), vec2(0))" for value in values]
    assert np.isfinite(drawn(pg.Input("t").mipmaps(), " + ".join(reads))).all()
    fetched = (
        "texelFetch(t, ivec2(0), 2147483647) + texelFetch(t, ivec2(2147483647, -2147483647), int(p.x) - 2147483647)"
    )
    assert np.isfinite(drawn(pg.Input("t").mipmaps(), fetched, "numpy")).all()


@pytest.mark.parametrize(
    ("read", "told"),
    [
        ("textureLod(t, p)", "takes a sampler, a position, a level; got 2 arguments"),
        ("textureGrad(t, p, p)", "takes a sampler, a position, two derivatives; got 3 arguments"),
        ("textureOffset(t, p)", "takes a sampler, a position, an offset, perhaps a bias; got 2 arguments"),
        ("texture(t, p, 1.0, 2.0)", "takes a sampler, a position, perhaps a bias; got 4 arguments"),
        ("texture(t)", "where to read is missing"),
        ("texture(t, p, p)", "a bias must be float, got vec2"),
        ("textureLod(t, p, p)", "a level must be float, got vec2"),
        ("textureGrad(t, p, 1.0, p)", "a derivative must be vec2, got float"),
        ("textureOffset(t, p, p)", "an offset must be ivec2, got vec2"),
        ("texelFetch(t, ivec2(p), 1.5)", "a level must be int, got float"),
        ("textureProj(t, p)", "a projected read takes a vec3 or a vec4"),
    ],
)
def test_wrong_reads_are_told(read: str, told: str) -> None:
    with pytest.raises(pg.PassgraphError, match=f"<shader>:1: .*{told}"):
        parse(text(read))


@pytest.mark.parametrize(
    ("read", "count"),
    [("texture(t, p)", 0), ("texture(t, p, 1.0)", 1), ("textureLod(t, p, 0.0)", 0), ("textureLod(t, p, 1.0)", 1),
     ("texelFetch(t, ivec2(p), 0)", 0), ("textureGrad(t, p, p, p)", 1)],
)  # fmt: skip
def test_what_may_read_smaller_levels_is_noted(read: str, count: int) -> None:
    assert [note.span.line for note in parse(text(read)).notes] == [1] * count


def test_a_trilinear_read_is_short_in_the_representation() -> None:
    """A read is a fixed number of nodes, so that kernels with many stay within limits and documents small."""

    def nodes(block: Any) -> int:
        parts = [getattr(one, name, ()) for one in block for name in ("then", "orelse", "body")]
        values = [one.value for one in block if isinstance(one, ir.Assign)]
        return sum(map(nodes, parts)) + sum(1 for value in values for _ in ir.expressions(value))

    read = "o += textureLod(t, pg_position, 1.5);"
    head = "uniform sampler2D t; void main() { vec4 o = vec4(0);"
    counts = [nodes(parse(f"{head} {read * n} gl_FragColor = o; }}").program.body) for n in (0, 1, 3)]
    assert counts[1] - counts[0] < 1300
    assert counts[2] - counts[1] == 2 * (counts[1] - counts[0])
