"""Names of other languages: each is told with what kernels write, and that is kernel text which does it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import passgraph as pg
from passgraph import Image, vec4
from passgraph.errors import KernelError
from passgraph.language.scope import FORMS, OWN, TYPES, WORDS, mending

HEAD = (
    "def k(image: Image, a: vec3, b: vec3, v: vec3, w: vec3, c: vec3, t: float, x: float, y: float, z: float, n: int, "
    "p: ivec2, low: float, high: float, test: bool, u: uint, other: int, offset: int, bits: int, rgba: vec4, xy: vec2) "
    "-> vec4:\n"
)
#: Forms of matrices, and those of names that are not in every version of the language.
OF_MATRICES = {"a @ b": "mat3(a, b, v) @ mat3(a, b, v)"}
LATER = ("dfdx", "dfdy")


def refusal(text: str) -> str:
    with pytest.raises(KernelError) as caught:
        pg.kernel(source=text)
    return str(caught.value)


@pytest.mark.parametrize("form", dict.fromkeys(FORMS.values()))
def test_each_form_is_kernel_text(form: str) -> None:
    if form.partition("(")[0] in LATER and form.partition("(")[0] not in OWN:
        assert all(mending(name) == "" or "did you mean" in mending(name) for name, f in FORMS.items() if f == form)
        return
    stage = pg.fragment if form == "front_facing()" else pg.kernel
    text = HEAD.replace("v: vec3", "uv: vec2, v: vec3") if "(uv)" in form else HEAD
    stage(source=f"{text}    r = {OF_MATRICES.get(form, form)}\n    return vec4(x)\n")


@pytest.mark.parametrize("name", [*FORMS, *TYPES, *WORDS])
def test_no_name_of_the_language_is_called_foreign(name: str) -> None:
    assert name not in set(OWN) - {"pi"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("lerp(x, y, t)", "name 'lerp' is not defined here; write mix(a, b, t)"),
        ("frac(x)", "write fract(x)"),
        ("atan2(y, x)", "write atan(y, x)"),
        ("rsqrt(x)", "write inversesqrt(x)"),
        ("fmod(x, y)", "write x - y * trunc(x / y)"),
        ("mul(a, b)", "write a * b"),
        ("sinf(x)", "write sin(x)"),
        ("smoothstp(x, y, t)", "did you mean 'smoothstep'?"),
        ("lenght(a)", "did you mean 'length'?"),
        ("hihg + 1.0", "did you mean 'high'?"),
        ("float4(x)", "write vec4"),
        ("half3(x)", "write vec3"),
        ("float3x3(x)", "write mat3"),
        ("texture(image, a.xy)", "write image.sample(uv)"),
        ("tex2D(image, a.xy)", "write image.sample(uv)"),
        ("texelFetch(image, p, 0)", "write image.texel(p)"),
        ("textureSize(image, 0)", "write image.size"),
        ("gl_FragCoord", "write pixel()"),
        ("iTime", "a time is a parameter: time: float"),
        ("print(x)", "look at a pixel with passgraph inspect"),
        ("image.shape", "not .shape; write image.size"),
        ("image.width", "not .width; write image.size.x"),
        ("a.length()", "values have no methods; got .length(); write length(v)"),
        ("a.dot(b)", "got .dot(); write dot(v, …)"),
        ("a.normalized()", "got .normalized(); write normalize(v)"),
        ("a.length", "vec3 has no attribute 'length'; write length(v)"),
        ("qqq", "name 'qqq' is not defined here; a kernel sees its parameters"),
    ],
)
def test_what_is_meant_is_told_at_the_caret(text: str, words: str) -> None:
    first, line, caret = refusal(f"{HEAD}    r = {text}\n    return vec4(x)\n").split("\n")
    assert words in first and "<kernel text>:2:" in first
    assert line.strip() == f"r = {text}" and caret.index("^") == line.index(text.partition("(")[0])


def test_types_of_other_languages_in_a_signature() -> None:
    assert "name 'float4' is not defined here; write vec4" in refusal("def k(c: Image) -> float4: return c[0, 0]")
    assert "name 'sampler2D' is not defined here; write Image" in refusal("def k(c: sampler2D) -> vec4: return c[0, 0]")


def test_functions_of_numpy_and_math() -> None:
    with pytest.raises(
        KernelError, match=r"np\.sin is a ufunc, which kernels cannot use; write sin\(x\), with: from pa"
    ):

        @pg.kernel
        def one(c: Image) -> vec4:
            return vec4(np.sin(c[0, 0].x))

    with pytest.raises(KernelError, match=r"np\.linalg\.norm is .*, which kernels cannot use; write length\(v\)"):

        @pg.kernel
        def two(c: Image) -> vec4:
            return vec4(np.linalg.norm(c[0, 0].xyz))

    with pytest.raises(KernelError, match=r"math\.sqrt is .* which kernels cannot use; write sqrt\(x\)"):

        @pg.kernel
        def three(c: Image) -> vec4:
            return vec4(math.sqrt(c[0, 0].x))

    with pytest.raises(KernelError, match=r"module numpy has no 'lerp'; write mix\(a, b, t\)"):

        @pg.kernel
        def four(c: Image) -> vec4:
            return vec4(np.lerp(c[0, 0].x, 1.0, 0.5))  # type: ignore[attr-defined]

    with pytest.raises(KernelError, match=r"np\.float32 is the class float32, which kernels cannot use; write float"):

        @pg.kernel
        def five(c: Image, x: np.float32) -> vec4:
            return c[0, 0] * x

    with pytest.raises(KernelError, match=r"module passgraph has no 'smoothstp'; did you mean 'smoothstep'\?"):

        @pg.kernel
        def six(c: Image) -> vec4:
            return pg.smoothstp(0.0, 1.0, c[0, 0])  # type: ignore[attr-defined]


def test_a_name_of_the_language_that_is_not_imported() -> None:
    with pytest.raises(KernelError, match=r"here; import it: from passgraph.language import smoothstep"):

        @pg.kernel
        def one(c: Image) -> vec4:
            return smoothstep(0.0, 1.0, c[0, 0])  # type: ignore[name-defined]  # noqa: F821

    with pytest.raises(KernelError, match=r"name 'pi' is not defined here; write math\.pi, with: import math"):

        @pg.kernel
        def two(c: Image) -> vec4:
            return c[0, 0] * pi  # type: ignore[name-defined]  # noqa: F821


def test_a_function_of_ones_own_keeps_its_mend() -> None:
    def lerp(a: float, b: float, t: float) -> float:
        return a + (b - a) * t

    with pytest.raises(KernelError, match=r"lerp is a Python function; mark it with @pg\.function"):

        @pg.kernel
        def one(c: Image) -> vec4:
            return vec4(lerp(0.0, 1.0, c[0, 0].x))


def test_long_names_cost_nothing() -> None:
    assert mending("s" * 9_000, ["s" * 8_999] * 1000) == ""
