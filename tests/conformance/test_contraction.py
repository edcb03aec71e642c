"""Native math rounds a product and a sum once, where the device has one instruction for both."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.numpy.machine.compiler import host
from passgraph.backends.registry import open_backend
from passgraph.language.facts import Facts
from passgraph.language.lower import lower
from passgraph.language.operations import OPERATIONS
from passgraph.language.scalar import Op, walk
from passgraph.plan.data import DrawStep
from passgraph.verify.compare import compare
from passgraph.verify.function_errors import measure_functions
from tests.conftest import require

has_fma = pytest.mark.skipif("+fma" not in host()[1].split(","), reason="this processor has no fused multiplication")
#: Texels from 1 to 2: sums of a product and a third one have at most 50 bits, so that float64 has them exactly.
TEXELS = (1.0 + np.random.default_rng(2).integers(0, 2**23, (64, 64, 4)) / 2.0**23).astype(np.float32)
SUMS = {
    "product first": ("a * b + c", lambda a, b, c: a * b + c),
    "product second": ("c + a * b", lambda a, b, c: a * b + c),
    "a difference": ("a * b - c", lambda a, b, c: a * b - c),
    "a product subtracted": ("c - a * b", lambda a, b, c: c - a * b),
    "a function": ("fma(a, b, c)", lambda a, b, c: a * b + c),
}

CORNER = """
class Corner:
    position: vec4
    uv: vec2

"""
PLACE = "def place(v: Vertex) -> Corner: return Corner(vec4(v.position * 0.7 + vec3(0.25), 1.0), v.uv)"
SHADE = "def shade(corner: Corner) -> vec4: return vec4(corner.uv * 0.7 + vec2(0.25), 0.0, 1.0)"


def drawn() -> pg.Target:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], np.float32)
    mesh = SimpleNamespace(positions=corners, triangles=np.array([[0, 1, 2]], np.int32), uvs=corners[:, :2])
    place, shade = pg.vertex(source=CORNER + PLACE, name="place"), pg.fragment(source=CORNER + SHADE, name="shade")
    return pg.draw(mesh, vertex=place, fragment=shade, into=pg.target("drawn", "rgba32f", size=(16, 16)))


def kernel_of(expression: str) -> pg.Kernel:
    return pg.kernel(
        source=f"""
def k(image: Image) -> vec4:
    a = image[0, 0]
    b, c = a.yzwx, a.zwxy
    return {expression}
"""
    )


def run(kernel: pg.Kernel, backend: str, math: str, **options: bool) -> np.ndarray:
    output = kernel(pg.Input("image", "rgba32f"))
    with pg.compile(output, backend, options=pg.Options(math=math, **options)) as program:  # type: ignore[arg-type]
        return np.asarray(program(image=TEXELS)["k"])


def operations(text: str, contracts: bool = True) -> list[str]:
    body = lower(pg.kernel(source=text).program, Facts(contracts=contracts)).body
    return [i.operation for i in walk(body) if isinstance(i, Op)]


@has_fma
@pytest.mark.parametrize("name", ["numpy", "opencl"])
@pytest.mark.parametrize("case", SUMS)
def test_a_sum_with_a_product_is_rounded_once(case: str, name: str) -> None:
    expression, of_float64 = SUMS[case]
    a = TEXELS.astype(np.float64)
    once = of_float64(a, np.roll(a, -1, 2), np.roll(a, -2, 2)).astype(np.float32)
    kernel = kernel_of(expression)
    assert (run(kernel, name, "native") == once).all()
    assert not (run(kernel, name, "exact") == once).all(), "exact math rounds twice, alike on all backends"


@pytest.mark.parametrize("name", ["gl", "opencl", "webgpu", "numpy"])
def test_fused_results_lie_within_the_bounds_of_both_forms(name: str) -> None:
    kernel = kernel_of("normalize(a * b - c) + mix(a, b, c) - dot(a, b) * exp(-a) + fract(a * b)")
    report = compare(kernel(pg.Input("image", "rgba32f")), [name], math="native", image=TEXELS)
    assert report.passed, str(report)


def test_gl_prints_a_call() -> None:
    require("gl")
    output = kernel_of("a * b + c")(pg.Input("image", "rgba32f", (8, 8)))
    for math in ("exact", "native"):
        with pg.compile(output, "gl", (8, 8), pg.Options(math=math)) as program:  # type: ignore[arg-type]
            program.run(image=TEXELS[:8, :8])
            assert program.plan is not None
            text = "".join(program.backend.code(step, {}) or "" for step in program.plan.steps)
        assert ("= FMA(" in text) == (math == "native"), math


def test_only_sums_of_floats_are_fused() -> None:
    assert "fma" not in operations("def k(c: Image) -> float: return float(pixel().x * 3 + pixel().y)")
    assert operations("def k(c: Image) -> float: return c[0, 0].x * c[0, 0].y + 1.0", contracts=False) == ["mul", "add"]
    assert operations("def k(c: Image) -> float: return c[0, 0].x * c[0, 0].y + 1.0") == ["fma"]


def test_a_footprint_may_follow_from_a_fused_product() -> None:
    text = """
def k(c: Image) -> vec4:
    t = vec4(0)
    for i in range(100): t += c[int(float(i) * 0.5 + 1.5), 0]
    return t
"""
    program = lower(pg.kernel(source=text).program, Facts(contracts=True))
    assert "fma" in [i.operation for i in walk(program.body) if isinstance(i, Op)]
    low, high = program.images[0].x
    assert (low, high) == (1, 51)


def test_factors_of_an_abandoned_unrolling_are_forgotten() -> None:
    """Loops are unrolled to see whether that is shorter; if not, the numbers of their values are used again."""
    text = """
def k(c: Image) -> vec4:
    t = vec4(0)
    for i in range(-9, 10):
        for j in range(-9, 10):
            w = exp(-c[i, j] * c[i, j] * 3.0) * float(i * j)
            t += c[i, j] * w + w * 0.5
    return t * 0.25 + 1.0
"""
    output = pg.kernel(source=text)(pg.Input("image", "rgba32f"))
    results = []
    for math in ("exact", "native"):
        with pg.compile(output, "numpy", options=pg.Options(math=math)) as program:  # type: ignore[arg-type]
            results.append(np.asarray(program(image=TEXELS)["k"]))
    assert results[1] == pytest.approx(results[0], rel=1e-4, abs=1e-3)


def test_vertex_kernels_are_left_as_they_are() -> None:
    """Passes that draw one mesh with a depth test of equality need the same depths."""
    with pg.compile(drawn(), "numpy", (16, 16), pg.Options(math="native")) as program:
        assert program.plan is not None
        (step,) = (step for step in program.plan.steps if isinstance(step, DrawStep))
    assert step.fragment is not None
    fused = [
        "fma" in [i.operation for i in walk(part.body) if isinstance(i, Op)] for part in (step.vertex, step.fragment)
    ]
    assert fused == [False, True]


@has_fma
def test_fused_functions_keep_the_promise_of_the_exact_ones() -> None:
    with open_backend("numpy") as backend:
        found = {one.name: one for one in measure_functions(backend, "native", side=128)}
    assert found["exp"].promised == "3 ULP"
    for one in found.values():
        row = OPERATIONS[one.name]
        unit = float(np.spacing(np.float32(abs(float(row.reference(*map(np.float64, one.worst_at)))))))
        assert one.worst * unit <= row.ulp * unit + row.absolute + 2.0**-149, one
