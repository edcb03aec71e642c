"""Derivatives over quads: what dfdx, dfdy and fwidth give, against pictures' differences, OpenGL and a plain walk."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray
from quad_truth import walking
from test_programs import BY_CHANCE

import passgraph as pg
from passgraph import Image, dfdx, dfdy, fwidth, vec4
from passgraph.graph.calls import kernel
from passgraph.language.lower import lower
from passgraph.verify.compare import compare
from passgraph.verify.fuzz.cases import inputs_of, output_of
from passgraph.verify.fuzz.random_expressions import Features
from passgraph.verify.fuzz.random_kernels import kernel_texts
from tests.conftest import present_devices
from tests.offscreen import offscreen

Picture = NDArray[Any]
PADS = {"clamp": "edge", "zero": "constant", "repeat": "wrap", "mirror": "symmetric"}


def output(text: str, border: str = "clamp") -> pg.Target:
    made: pg.Target = kernel(source=text)(pg.Input("c").border(border), into=pg.target("out", "rgba32f"))
    return made


def computed(text: str, picture: Picture, border: str = "clamp", backend: str = "reference") -> Picture:
    with pg.compile(output(text, border), backend=backend, non_finite="keep") as program:
        return np.asarray(program(c=picture)["out"])


def picture(width: int, height: int) -> Picture:
    """Whole numbers, whose sums and products are exact."""
    return np.random.default_rng(5).integers(0, 8, (height, width, 4)).astype(np.float32)


def differences(values: Picture, border: str = "clamp") -> tuple[Picture, Picture]:
    """Along x and y, from values at pixels; the pixels outside are what the border rule finds there."""
    height, width = values.shape[:2]
    padded = np.pad(values, ((0, 1), (0, 1), (0, 0)), PADS[border])  # type: ignore[call-overload]
    y, x = np.mgrid[0:height, 0:width]
    return padded[y, x | 1] - padded[y, x & ~1], padded[y | 1, x] - padded[y & ~1, x]


@pytest.mark.parametrize("size", [(1, 1), (2, 2), (1, 4), (7, 1), (7, 5), (8, 6)])
@pytest.mark.parametrize("border", PADS)
def test_they_are_the_odd_pixel_less_the_even_one(size: tuple[int, int], border: str) -> None:
    given = picture(*size)
    across, down = differences(given, border)
    for text, expected in (
        ("dfdx(c[0, 0])", across), ("dfdy(c[0, 0])", down), ("fwidth(c[0, 0])", abs(across) + abs(down)),
        ("dfdy(dfdx(c[0, 0]))", differences(across, border)[1]), ("dfdx(dfdx(c[0, 0]))", 0 * across),
    ):  # fmt: skip
        np.testing.assert_array_equal(computed(f"def k(c: Image) -> vec4: return {text}", given, border), expected)


def test_pixel_and_uv_grow_to_the_right_and_down() -> None:
    text = "def k(c: Image) -> vec4: return vec4(dfdx(uv()), dfdy(uv())) + vec4(dfdx(pixel()), dfdy(pixel()))"
    made = computed(text, picture(5, 3))
    np.testing.assert_allclose(made, np.broadcast_to([1 + 1 / 5, 0, 0, 1 + 1 / 3], made.shape), rtol=1e-6)


def test_python_functions_take_them_and_glsl_spells_them() -> None:
    @pg.kernel
    def ours(c: Image) -> vec4:
        return dfdx(c[0, 0]) + 2 * dfdy(c[0, 0]) + fwidth(c[0, 0])

    with pg.compile(ours(pg.Input("c"), into=pg.target("out", "rgba32f")), backend="reference") as program:
        made = program(c=picture(5, 3))["out"]
    text = "def k(c: Image) -> vec4: return dFdx(c[0, 0]) + 2 * dFdy(c[0, 0]) + fwidth(c[0, 0])"
    np.testing.assert_array_equal(made, computed(text, picture(5, 3)))


def test_what_is_not_finite_stays_so() -> None:
    given = picture(4, 2)
    text = "def k(c: Image) -> vec4: return vec4(dfdx(float(pixel().x) / 0.0), dfdx(sqrt(-1.0 - c[0, 0].xyz)))"
    made = computed(text, given)
    assert np.isnan(made[:, :2, 1:]).all()
    np.testing.assert_array_equal(made[0, :, 0], [np.nan, np.nan, np.nan, np.nan])
    assert np.isinf(computed("def k(c: Image) -> vec4: return vec4(dfdx(1.0 / float(pixel().x)))", given)[0, 0, 0])


#: Values of four channels in GLSL and in ours, from ``t``, this pixel's texel, and ``p``, its place.
VALUES = {
    "a sum": ("vec4 v = t * float(p.x + 3 * p.y) - t.wxyz;", "v = t * float(p.x + 3 * p.y) - t.wxyz"),
    "a branch": ("vec4 v = t; if (t.x > 3.0) v = t.yzwx * 2.0; else if (p.y > 2) v += 5.0;",
                 "v = t\nif t.x > 3.0:\n    v = t.yzwx * 2.0\nelif p.y > 2:\n    v += 5.0"),
    "a loop": ("vec4 v = t; for (int i = 0; i < 9; i++) { if (v.y > 20.) break; if (i == p.x) continue; v += t.yyxx; }",
               "v = t\nfor i in range(9):\n    if v.y > 20.0:\n        break\n    if i == p.x:\n        continue\n"
               "    v += t.yyxx"),
}  # fmt: skip
GLSL = """
#version 450
uniform sampler2D c;
out vec4 made;
void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    vec4 t = texelFetch(c, clamp(p, ivec2(0), textureSize(c, 0) - 1), 0);
    %s
    made = vec4(%s);
}
"""
EXACT = "dFdxFine(v.x), dFdyFine(v.y), fwidthFine(v.z), dFdxFine(v.w + dFdyFine(v.x))"
PLAIN = "dFdx(v)"


def drawn(shader: str, given: Picture) -> Picture:
    """A fragment shader over a picture, row 0 first, as quads lie."""
    height, width = given.shape[:2]
    with offscreen() as context:
        corners = (
            "#version 450\nvoid main() { gl_Position = vec4(gl_VertexID % 2 * 4 - 1, gl_VertexID / 2 * 4 - 1, 0, 1); }"
        )
        program = context.program(vertex_shader=corners, fragment_shader=shader)
        context.texture((width, height), 4, given.tobytes(), dtype="f4").use()
        made = context.texture((width, height), 4, dtype="f4")
        context.framebuffer([made]).use()
        context.vertex_array(program, []).render(moderngl.TRIANGLES, 3)
        return np.frombuffer(made.read(), np.float32).reshape(height, width, 4)


@pytest.mark.gl
@pytest.mark.parametrize("size", [(8, 6), (7, 5)])
@pytest.mark.parametrize("name", VALUES)
def test_they_are_opengl_s_fine_ones(name: str, size: tuple[int, int]) -> None:
    theirs, ours = VALUES[name]
    given = picture(*size)
    before = "".join(f"    {line}\n" for line in ("t = c[0, 0]", "p = pixel()", *ours.split("\n")))
    text = (
        f"def k(c: Image) -> vec4:\n{before}    return vec4(dfdx(v.x), dfdy(v.y), fwidth(v.z), dfdx(v.w + dfdy(v.x)))"
    )
    np.testing.assert_array_equal(computed(text, given), drawn(GLSL % (theirs, EXACT), given))
    # One for each quad where a driver makes them coarse: that of one of its rows.
    rows = computed(f"def k(c: Image) -> vec4:\n{before}    return dfdx(v)", given)
    plain = drawn(GLSL % (theirs, PLAIN), given)
    other = rows[np.minimum(np.arange(size[1]) ^ 1, size[1] - 1)]
    inside = slice(0, size[1] & ~1)
    assert ((plain == rows) | (plain == other))[inside].all()


def reference(text: str, side: int = 5) -> Picture:
    case = {"format": "rgba32f", "border": "mirror", "special": False, "seed": 1, "side": side}
    out = output_of(case, text)
    with pg.compile({"out": out}, backend="reference", non_finite="keep") as program:
        return np.asarray(program(**inputs_of(case, out))["out"])


def assert_walked(text: str) -> None:
    made = reference(text)
    with walking():
        expected = reference(text)
    np.testing.assert_array_equal(made, expected, text)


def short(text: str) -> str:
    """With no long loops: every pixel walks again through what is around a derivative, four times a level."""
    return text.replace("range(70)", "range(2)").replace("range(1, 6, 2)", "range(1, 4, 2)")


@pytest.mark.slow
@settings(BY_CHANCE, max_examples=40)
@given(kernel_texts(Features()))
def test_random_kernels_compute_what_quads_walking_through_them_do(text: str) -> None:
    assert_walked(short(text))


@pytest.mark.slow
@settings(BY_CHANCE, max_examples=1000)
@given(kernel_texts(Features()))
def test_many_random_kernels_compute_what_quads_walking_through_them_do(text: str) -> None:
    assert_walked(short(text))


#: Around derivatives: branches, loops and jumps that lead out of them, variables that they hand on.
INSIDE = {
    "a branch": """
def k(c: Image) -> vec4:
    v = c[0, 0]
    w = v
    if v.x > 0.0:
        w = v.yzwx * 2.0
        w += fwidth(w)
    return w + dfdx(w)
""",
    "a loop with jumps": """
def k(c: Image) -> vec4:
    v, w = c[0, 0], vec4(0.0)
    for i in range(6):
        v += 0.5
        if v.x > 2.0:
            v = -v
            break
        if int(v.y) == i:
            continue
        w += dfdx(v * float(i)) + dfdy(v.wzyx)
    return w + fwidth(v) + dfdy(w)
""",
    "loops in loops": """
def k(c: Image) -> vec4:
    v, w = c[0, 0], vec4(0.0)
    for i in range(3):
        last = v
        for j in range(3):
            if float(j) > v.x + 1.0:
                break
            v = v.yzwx + dfdx(last) * 0.25 + float(i * j)
        if v.y < 0.0:
            for j in range(2):
                v += c[j, i]
        w += dfdy(v + last)
    return w
""",
    "an early return": """
def half(v: vec4, n: int) -> vec4:
    for i in range(4):
        if i == n:
            return v * 0.5 + dfdx(v)
        v += 1.0
    return v

def k(c: Image) -> vec4:
    v = c[0, 0]
    if v.w > 1.0:
        return dfdy(v)
    u = half(v, int(v.x * 4.0))
    if u.x < 0.0:
        return fwidth(u)
    return dfdx(half(u, pixel().x))
""",
    "divided by its own": """
def k(c: Image) -> vec4:
    v = c[0, 0]
    for i in range(2):
        v = v / (0.125 + fwidth(v))
    return v
""",
}


@pytest.mark.parametrize("name", INSIDE)
def test_pixels_enter_what_is_around_a_derivative_together(name: str) -> None:
    assert_walked(INSIDE[name])


def test_pixels_go_round_loops_around_a_derivative_as_often_as_their_own_data_say() -> None:
    assert_walked("""
def k(c: Image) -> vec4:
    p = c[0, 0]
    for i in range(clamp(int(p.x), -2, 2), clamp(int(p.y * 4.0), -3, 5), clamp(int(p.w * 2.0), -2, 2)):
        p += dfdx(p * float(i)) + p.yzwx
    return fwidth(p)
""")


@pytest.mark.sampled
@pytest.mark.parametrize("name", INSIDE)
def test_backends_agree_on_what_is_around_a_derivative(name: str) -> None:
    given = np.random.default_rng(3).integers(-8, 8, (5, 7, 4)).astype(np.float32) / 4
    for report in compare(output(INSIDE[name]), present_devices(), c=given).backends:
        assert report.within_bounds, report.failed or str(report.first_divergence)


def test_only_what_feeds_them_is_computed_again() -> None:
    plain = "def k(c: Image) -> vec4:\n    v = sin(c[0, 0] * 9.0)\n    return v * {}"
    factors = ("1.5", "dfdx(uv().x)", "fwidth(uv().x)", "fwidth(v)")
    none, one, both, all_ = (len(lower(kernel(source=plain.format(f)).program).body) for f in factors)
    assert none < one < both < 1.25 * none
    assert 2.5 * none < all_ < 3.25 * none


def test_a_pass_reads_one_texel_farther_and_no_more() -> None:
    (use,) = lower(kernel(source="def k(c: Image) -> vec4: return dfdx(c[2, 0]) + c[0, 0]").program).images
    assert (use.x, use.y) == ((0, 3), (0, 0))


PASSES = {
    "read at this pixel alone": ("c[0, 0] * fwidth(uv().x * 3.0)", 1),
    "read at the others too": ("c[0, 0] + fwidth(c[0, 0])", 2),
}


@pytest.mark.parametrize("name", PASSES)
def test_a_pass_is_fused_where_derivatives_do_not_read_it(name: str) -> None:
    expression, steps = PASSES[name]
    first = kernel(source="def one(c: Image) -> vec4: return c[0, 0] * 2.0 + dfdx(c[0, 0])")
    second = kernel(source=f"def two(c: Image) -> vec4: return {expression}")
    between = first(pg.Input("c"), into=pg.target("between", "rgba32f"))
    made = second(between, into=pg.target("out", "rgba32f"))
    results = []
    for fuse in (True, False):
        with pg.compile(made, backend="numpy", options=pg.Options(fuse=fuse)) as program:
            results.append(program(c=picture(7, 5))["out"])
            assert len(program.plan.steps) == (steps if fuse else 2)
    np.testing.assert_array_equal(*results)


def test_known_sizes_and_constants_change_nothing() -> None:
    text = """
@kernel
def k(c: Image, n: Const[int] = 3) -> vec4:
    v = c[0, 0]
    for i in range(n):
        v += c[i, -i] + dfdx(v) * uv().x
    return v
"""
    made = []
    for known in (False, True):
        out = kernel(source=text, known_sizes=known)(pg.Input("c"), into=pg.target("out", "rgba32f"))
        with pg.compile(out, backend="numpy") as program:
            made.append(program(c=picture(7, 5))["out"])
    np.testing.assert_array_equal(*made)


def test_branches_around_them_cost_no_copies() -> None:
    """Nothing behind the branches hangs on the derivative: each pixel's own way through them is not asked for."""
    lengths = []
    for depth in (10, 20, 40):
        lines = [f"{'    ' * level}if v.x > {level}.0:" for level in range(1, depth)]
        lines += [f"{'    ' * depth}v += fwidth(v)", "    return v"]
        program = kernel(source="\n".join(["def k(c: Image) -> vec4:", "    v = c[0, 0]", *lines])).program
        lengths.append(str(program.body).count("Assign("))
    assert lengths[2] - lengths[1] == 2 * (lengths[1] - lengths[0])


@pytest.mark.parametrize(("turned", "level"), [
    ("uv() * 4.0", 2.0), ("uv().yx * vec2(0.25, 2.0)", 1.0), ("uv() * vec2(3.0, 4.0) + uv().yx * vec2(4.0, 0.0)", 2.5),
    ("vec2(0.5)", -np.inf),
])  # fmt: skip
def test_the_level_of_detail_is_the_log2_of_the_longer_derivative(turned: str, level: float) -> None:
    """Of a picture as large as the target: (3, 0) along x and (4, 4) along y in the third."""
    made = computed(f"def k(c: Image) -> vec4: return vec4(c.lod({turned}))", picture(8, 8))
    np.testing.assert_allclose(made, level, atol=1e-5)


@pytest.mark.parametrize("name", INSIDE)
def test_kernels_with_derivatives_travel(name: str) -> None:
    given = picture(5, 3)
    with pg.compile(output(INSIDE[name]), backend="reference") as program:
        expected, data = program(c=given)["out"], program.to_data()
    with pg.compile(pg.from_data(data), backend="reference") as program:
        np.testing.assert_array_equal(program(c=given)["out"], expected)
