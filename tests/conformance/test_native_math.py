"""Programs that call their device's own functions: judged by what its specification promises."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import mpmath
import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.gl.glsl import SPELLED
from passgraph.backends.registry import open_backend
from passgraph.language.native import OPENCL
from passgraph.language.operations import OPERATIONS
from passgraph.language.scalar import Op
from passgraph.run.program import Program
from passgraph.serialize import from_data, to_data
from passgraph.verify.compare import compare
from passgraph.verify.conformance import cases, judge
from passgraph.verify.function_errors import MEASURED, SPECIAL, measure_functions, ulp_errors
from tests.respelling import respelled

#: Operations whose cases GLSL's precisions decide, so that they can fail.
DECIDED = ("exp", "exp2", "inversesqrt")
glow = pg.kernel(source="def glow(c: Image) -> vec4: return exp2(c[0, 0]) + sin(c[0, 0])")


@pytest.fixture(params=["gl", "webgpu", "opencl", "numpy"])
def backend(request: pytest.FixtureRequest) -> Iterator[Backend]:
    with open_backend(request.param) as opened:
        yield opened


def picture() -> np.ndarray:
    return np.random.default_rng(5).uniform(-2, 2, (16, 16, 4)).astype(np.float32)


def run(backend: Backend | str, output: pg.Target, **options: str) -> np.ndarray:
    with pg.compile(output, backend, options=pg.Options(**options)) as program:
        return np.asarray(program(c=picture())[output.name])


def outcomes_of(backend: Backend) -> dict[str, str]:
    """The outcome of each measured function's case, none of them a fault."""
    outcomes: dict[str, str] = {}
    for case in cases(["operations"]):
        if case.name in MEASURED:
            (verdict,) = judge(case, [backend], "native")
            outcomes[case.name] = verdict.outcome
            assert verdict.outcome in ("passed", "undecided"), str(verdict)
    return outcomes


def test_cases_of_operations_lie_within_the_specifications_bounds(backend: Backend) -> None:
    outcomes = outcomes_of(backend)
    assert len(outcomes) == len(MEASURED)
    # What is promised narrowly is decided, so that this test can fail.
    assert {outcomes[name] for name in DECIDED} == {"passed"}


@pytest.mark.slow
def test_the_whole_suite_lies_within_the_specifications_bounds(backend: Backend) -> None:
    for case in cases():
        (verdict,) = judge(case, [backend], "native")
        assert verdict.outcome in ("passed", "undecided"), str(verdict)


def test_an_undecided_case_names_the_functions_without_a_promise() -> None:
    case = next(case for case in cases(["operations"]) if case.name == "sin")
    with open_backend("gl") as backend:
        (verdict,) = judge(case, [backend], "native")
    assert verdict.outcome == "undecided"
    assert "sin of the device" in verdict.reason


@pytest.mark.parametrize(("name", "wrong"), [("exp2", "exp({0})"), ("log", "log2({0})"), ("inversesqrt", "sqrt({0})")])
def test_a_wrong_spelling_is_found(name: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    respelled(monkeypatch, SPELLED["float"], name, wrong)
    case = next(case for case in cases(["operations"]) if case.name == name)
    with open_backend("gl") as backend:
        (verdict,) = judge(case, [backend], "native")
    assert verdict.outcome == "diverged"


@pytest.mark.parametrize(
    ("name", "call", "wrong"),
    [
        ("fract", "fract(c[0, 0])", "({0} - trunc({0}))"),
        ("mod", "mod(c[0, 0], 0.7)", "({0} - {1} * trunc({0} / {1}))"),
        ("smoothstep", "smoothstep(-1.5, 1.25, c[0, 0])", "clamp(({2} - {0}) / ({1} - {0}), 0.0, 1.0)"),
    ],
)
def test_functions_that_glsl_defines_by_a_formula_have_its_bounds(
    name: str, call: str, wrong: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = pg.kernel(source=f"def f(c: Image) -> vec4: return {call}")(pg.Input("c", "rgba32f"))
    report = compare(output, ["gl", "webgpu"], math="native", c=picture())
    assert report.passed, str(report)
    with pg.compile(output, "gl", options=pg.Options(math="native")) as program:
        program.run(c=picture())
        assert f"{name}(" in "".join(program.backend.code(step, {}) or "" for step in program.plan.steps)
    respelled(monkeypatch, SPELLED["float"], name, wrong)
    assert not compare(output, ["gl"], math="native", c=picture()).passed


def test_an_undefined_smoothstep_is_undecided() -> None:
    """GLSL leaves it undefined where the first edge is not below the second."""
    falling = pg.kernel(source="def f(c: Image) -> vec4: return smoothstep(1.25, -1.5, c[0, 0])")
    report = compare(falling(pg.Input("c", "rgba32f")), ["gl"], math="native", c=picture())
    assert "smoothstep of the device" in str(report)


def test_native_functions_are_called_only_where_they_are_chosen() -> None:
    def code(output: pg.Target, math: str) -> str:
        with pg.compile(output, "gl", size=(8, 8), options=pg.Options(math=math)) as program:
            assert program.plan is not None
            return "\n".join(program.backend.code(step, {}) or "" for step in program.plan.steps)

    frame = pg.Input("c", "rgba32f", (8, 8))
    for kernel, math, native in (
        (glow, "exact", False), (glow, "native", True),
        (glow.with_math("native"), "exact", True), (glow.with_math("exact"), "native", False),
    ):  # fmt: skip
        text = code(kernel(frame), math)
        assert ("sin(" in text) == native, (kernel.math, math)


def test_numpy_and_opencl_on_a_cpu_keep_the_exact_functions() -> None:
    output = glow(pg.Input("c", "rgba32f", (16, 16)))
    for name in ("numpy", "opencl"):
        with pg.compile(output, name, (16, 16), pg.Options(math="native")) as program:
            assert program.plan is not None
            called = {i.operation for step in program.plan.steps for i in step.program.body if isinstance(i, Op)}
        assert "fma" in called
        assert not called & set(OPENCL), name


def test_opencl_calls_its_functions_where_they_are_faster() -> None:
    """As on a GPU: OpenCL C promises few ULP, so all cases are decided."""
    with open_backend("opencl") as backend:
        backend.limits = replace(backend.limits, native=OPENCL)
        outcomes = outcomes_of(backend)
    assert list(outcomes.values()).count("passed") >= len(MEASURED) - 4


@pytest.mark.parametrize("name", ["gl", "numpy"])
def test_passes_of_one_graph_may_differ_and_fuse(name: str) -> None:
    frame = pg.Input("c", "rgba32f")
    both = glow.with_math("native")(glow(frame, name="first"), name="both")
    fused, apart = (run(name, both, fuse=fuse) for fuse in (True, False))  # type: ignore[arg-type]
    assert fused.tobytes() == apart.tobytes()


def test_a_kernels_choice_is_serialized() -> None:
    output = glow.with_math("native")(pg.Input("c", "rgba32f"))
    data = to_data(output)
    (again,) = from_data(data).values()
    assert again.made_by is not None
    assert [kernel.math for kernel in again.made_by.kernels] == ["native"]
    (record,) = data["kernels"]
    record["math"] = "fast"
    with pytest.raises(pg.InputError, match="one of exact, native"):
        from_data(data)


@pytest.mark.parametrize("name", ["gl", "webgpu"])
@pytest.mark.parametrize("upward", [False, True], ids=["from the top", "from the bottom"])
def test_samples_are_filtered_by_the_device(name: str, upward: bool) -> None:
    """Rows of shaders count from the bottom."""
    text = "uniform sampler2D c; void main() { gl_FragColor = texture2D(c, pg_position * 0.83 + 0.07); }"
    own = pg.kernel(source="def k(c: Image) -> vec4: return c.sample(uv() * 0.83 + 0.07)", name="k")
    output = (pg.kernel(glsl=text, name="k") if upward else own)(pg.Input("c", "rgba32f", (16, 16)))
    report = compare({"k": output}, [name], math="native", c=picture())
    assert report.passed, str(report)
    with pg.compile(output, name, (16, 16), pg.Options(math="native")) as program:
        assert program.plan is not None
        assert any("by the device's own filter" in note for note in program.plan.notes)


def test_other_words_are_refused() -> None:
    with pytest.raises(pg.GraphError, match="exact, native"):
        pg.Options(math="fast")  # type: ignore[arg-type]
    with pytest.raises(pg.GraphError, match="exact, native"):
        glow.with_math("fast")  # type: ignore[arg-type]


def test_comparison_of_backends_takes_the_specifications_bounds() -> None:
    output = pg.kernel(source="def e(c: Image) -> vec4: return exp(c[0, 0])")(pg.Input("c", "rgba32f"))
    report = compare(output, ["gl", "numpy", "opencl"], math="native", c=picture())
    assert report.passed, str(report)


@pytest.mark.parametrize("name", ["numpy", "gl"])
def test_measured_errors_are_within_the_languages_own_promise(name: str) -> None:
    with open_backend(name) as backend:
        for found in measure_functions(backend, side=128):
            row = OPERATIONS[found.name]
            arguments = [np.float64(x) for x in found.worst_at]
            value = float(row.reference(*arguments))
            unit = float(np.spacing(np.float32(abs(value))))
            assert found.worst * unit <= row.ulp * unit + row.absolute + 2.0**-149, found
            assert found.typical <= 1.0, found


@pytest.mark.parametrize("name", ["numpy", "gl"])
def test_results_of_zeros_denormals_infinities_and_nan_are_those_of_float64(name: str) -> None:
    """Infinities and NaN where NumPy has them; the sign of zero is free, and denormals may count as zero."""
    with open_backend(name) as backend:
        measured = {found.name: found.special for found in measure_functions(backend, side=8)}
    assert len(measured["exp"]) == len(SPECIAL)
    for function, special in measured.items():
        for x, result in special if function != "inversesqrt" else ():
            arguments = [np.float64(np.float32(x)), np.float64(0.0 if abs(x) < 1e-38 else x)]
            with np.errstate(all="ignore"):
                allowed = [float(OPERATIONS[function].reference(argument)) for argument in arguments]
            assert any(np.isclose(result, y, rtol=1e-5, atol=1e-37, equal_nan=True) for y in allowed), (function, x)


def test_measured_native_errors_are_within_what_is_promised() -> None:
    with open_backend("gl") as backend:
        found = {one.name: one for one in measure_functions(backend, "native", side=128)}
    assert set(found) == set(MEASURED)
    for name in ("exp", "exp2"):
        assert found[name].worst <= 3.0 + 2.0 * abs(found[name].worst_at[0])
    assert found["inversesqrt"].worst <= 2.0
    assert found["sin"].promised == "nothing"


def test_errors_are_counted_as_mpmath_counts_them() -> None:
    x = np.float32([0.3, 2.0, 7.0])
    got = np.exp(x) * np.float32(1.0 + 3e-7)
    with mpmath.workprec(120):
        exact = [mpmath.exp(mpmath.mpf(float(v))) for v in x]
        expected = [float(abs(mpmath.mpf(float(g)) - e)) / float(np.spacing(np.float32(float(e))))
                    for g, e in zip(got, exact, strict=True)]  # fmt: skip
    assert ulp_errors(got, np.float64([float(e) for e in exact])) == pytest.approx(expected, rel=1e-6)


def test_special_results_count_as_errors() -> None:
    results = np.float32([np.inf, np.nan, 0.0, np.inf, np.nan])
    exact = np.float64([1e39, 1.0, 1e-42, 2.0, np.nan])
    assert list(ulp_errors(results, exact)) == [0.0, np.inf, 0.0, np.inf, 0.0]


def test_programs_say_which_math_they_have() -> None:
    with pg.compile(glow(pg.Input("c", "rgba32f", (4, 4))), "null", options=pg.Options(math="native")) as program:
        assert isinstance(program, Program)
        assert program.plan is not None
        assert program.plan.options.math == "native"
