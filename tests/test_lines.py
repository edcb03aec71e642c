"""Values of each line on a backend: those that `inspect` notes, bounds that hold, and the first line that is wrong."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.stage import ReferencePixelPass
from passgraph.backends.reference.traced import Event, Loop, Taken
from passgraph.backends.registry import open_backend
from passgraph.language import ir
from passgraph.plan.data import PixelStep
from passgraph.verify.lines import Lines, lines_at

TEXT = """
def turned(a: vec3, k: int) -> vec3:
    if k % 2 == 0:
        return a * 1.1
    return a + 0.1

def mixed(color: Image, gain: float = 1.0) -> vec4:
    a = color[0, 0].rgb * gain
    n = 0
    for i in range(4):
        a = turned(a, i) + color.sample((vec2(pixel()) + 0.5 + float(i)) / vec2(output_size())).rgb * 0.1
        n = n + i
        if n > 2:
            break
    u = uint(n) * uint(3)
    below = a.rg < vec2(1.5)
    m = mat2(a.x, 2.0, 3.0, 4.0)
    s = sin(a) * float(u)
    return vec4(s if below.x else s * 0.5, m[0].x)
"""
FRAME = np.random.default_rng(0).random((9, 16, 4)).astype(np.float32)
mixed = pg.kernel(source=TEXT, name="mixed")


class Wrong(ReferenceBackend):
    """The reference, which takes one operation for another."""

    name = "wrong"

    def __init__(self, operation: str, other: str) -> None:
        super().__init__()
        self.operation, self.other = operation, other

    def pixel_pass(self, step: PixelStep) -> ReferencePixelPass:
        kernel = step.source.kernel
        body = tuple(map(self._statement, kernel.program.body))
        changed = kernel.computing(replace(kernel.program, body=body))
        return super().pixel_pass(replace(step, source=replace(step.source, kernel=changed)))

    def _statement(self, statement: ir.Stmt) -> ir.Stmt:
        changes = {}
        for name in ir.PARTS[type(statement)]:
            part = getattr(statement, name)
            is_block = isinstance(part, tuple)
            changes[name] = tuple(map(self._statement, part)) if is_block else self._expression(part)
        return replace(statement, **changes)

    def _expression(self, expression: ir.Expr) -> ir.Expr:
        made = ir.with_parts(expression, self._expression)
        is_wrong = isinstance(made, ir.Apply) and made.operation == self.operation
        return replace(made, operation=self.other) if is_wrong else made


def flat(events: Sequence[Event]) -> Iterator[tuple[int, list[float]]]:
    """Each value of an inspection: the line, and its numbers; of a matrix column by column."""
    for event in events:
        if isinstance(event, Loop):
            for index, inner in event.trips:
                yield event.span.line, [index]
                yield from flat(inner)
        elif isinstance(event, Taken):
            is_matrix = isinstance(event.value, tuple) and isinstance(event.value[0], tuple)
            for part in event.value if is_matrix else [event.value]:
                yield event.span.line, np.ravel(part).astype(float).tolist()
        else:
            yield event.span.line, [float(event.holds)]


def looked_at(backend: str | ReferenceBackend, x: int = 5, y: int = 7) -> Lines:
    target = mixed(pg.Input("frame"), gain=pg.Value("gain", default=1.0))
    with open_backend(backend) if isinstance(backend, str) else backend as opened:
        return lines_at(target, opened, (x, y), {"frame": FRAME, "gain": 1.5})


@pytest.mark.sampled
@pytest.mark.parametrize("backend", ["reference", "numpy", "gl", "opencl", "webgpu"])
@pytest.mark.parametrize("pixel", [(5, 7), (0, 0), (15, 8)])
def test_values_are_those_of_inspect_and_within_bounds(backend: str, pixel: tuple[int, int]) -> None:
    found = looked_at(backend, *pixel)
    with pg.compile(mixed(pg.Input("frame"), gain=1.5), "reference") as program:
        noted = list(flat(program.inspect(*pixel, frame=FRAME).events))
    assert [value.probe.span.line for value in found.values] == [line for line, _ in noted]
    for value, (_, numbers) in zip(found.values, noted, strict=True):
        assert value.reference == pytest.approx(numbers, rel=1e-6)
        assert value.value == pytest.approx(numbers, rel=1e-4)
        assert all(low <= number <= high for low, number, high in zip(value.low, value.value, value.high, strict=True))
    assert found.first_wrong is None


@pytest.mark.parametrize(("operation", "other", "line"), [("sin", "cos", 18), ("int_mod", "min", 3), ("mul", "add", 8)])
def test_the_first_wrong_line_is_found(operation: str, other: str, line: int) -> None:
    found = looked_at(Wrong(operation, other))
    assert found.first_wrong is not None
    assert found.values[found.first_wrong].probe.span.line == line
    assert all(value.allowed for value in found.values[: found.first_wrong])


def test_another_branch_is_the_first_wrong_line_though_its_values_are_right() -> None:
    text = "def f(color: Image) -> float:\n    if color[0, 0].r < 0.5:\n        return 1.0\n    return 1.0"
    target = pg.kernel(source=text)(pg.Input("frame"))
    with Wrong("less", "greater") as backend:
        found = lines_at(target, backend, (0, 0), {"frame": np.zeros((1, 1, 4), np.float32)})
    assert [value.allowed for value in found.values] == [False, False]
    assert found.values[0].probe.kind == "branch"


def test_the_pass_reads_what_the_backend_wrote_before_it() -> None:
    """The wrong pass is named, not those behind it."""
    wave, double = (
        pg.kernel(source=f"def f(color: Image) -> vec4: return {text}")
        for text in ("sin(color[0, 0])", "color[1, 0] * 2.0")
    )
    first = wave(pg.Input("frame"), into=pg.target("first", "rgba16f"))
    target = double(first, into=pg.target("second", "rgba32f"))
    with Wrong("sin", "cos") as backend:
        assert lines_at(target, backend, (3, 3), {"frame": FRAME}, step="first").first_wrong == 0
        second = lines_at(target, backend, (3, 3), {"frame": FRAME})
    assert second.inspection.step == "second"
    assert second.first_wrong is None
    assert second.values[0].value[0] == pytest.approx(2 * np.cos(FRAME[3, 4, 0]), rel=1e-3)


@pytest.mark.sampled
@pytest.mark.parametrize("rule", ["clamp", "zero", "mirror"])
@pytest.mark.parametrize("kind", ["u8", "one channel", "nan"])
def test_pictures_of_all_kinds_are_read_as_the_pass_reads_them(rule: str, kind: str) -> None:
    frame = {
        "u8": np.arange(3 * 5 * 4, dtype=np.uint8).reshape(3, 5, 4), "one channel": FRAME[:3, :5, :1],
        "nan": np.where(FRAME[:3, :5] < 0.5, np.float32(np.nan), FRAME[:3, :5]),
    }[kind]  # fmt: skip
    text = "def f(color: Image) -> vec4:\n    a = color[-1, -1]\n    return a + color.sample(vec2(0.7)) * -0.5"
    target = pg.kernel(source=text)(pg.Input("frame").border(rule))
    with pg.compile(target, "reference", non_finite="keep") as program, open_backend("numpy") as backend:
        expected = program(frame=frame)["f"]
        for x, y in [(0, 0), (4, 2)]:
            found = lines_at(target, backend, (x, y), {"frame": frame})
            assert found.first_wrong is None
            np.testing.assert_allclose(found.values[-1].reference, expected[y, x], rtol=1e-6)
            np.testing.assert_allclose(found.inspection.results["f"], expected[y, x], rtol=1e-6)


def test_an_image_and_a_value_may_have_one_name() -> None:
    kernel = pg.kernel(source="def f(x: Image, y: float) -> vec4: return x[0, 0] * y")
    with open_backend("numpy") as backend:
        found = lines_at(kernel(pg.Input("frame"), pg.Value("x")), backend, (0, 0), {"frame": FRAME, "x": 2.0})
    assert found.values[0].value == pytest.approx(FRAME[0, 0] * 2)


def test_run_values_and_sizes_are_those_of_the_whole_graph() -> None:
    text = "def f(size: vec2, n: int) -> vec4:\n    s = vec2(output_size())\n    return vec4(size, s.x, float(n))"
    target = pg.kernel(source=text)(size=pg.OUTPUT_SIZE, n=pg.FRAME_INDEX)
    with open_backend("numpy") as backend:
        found = lines_at(target, backend, (1, 1), {"frame_index": 4}, size=(7, 3))
    assert found.values[-1].value == (7.0, 3.0, 7.0, 4.0)


def test_what_has_no_lines_is_refused() -> None:
    with open_backend("reference") as backend:
        with pytest.raises(pg.GraphError, match="outside of 16x9"):
            lines_at(mixed(pg.Input("frame")), backend, (16, 0), {"frame": FRAME})
        corner = "class Corner:\n    position: vec4\n"
        place = pg.vertex(source=f"{corner}def v(v: Vertex) -> Corner: return Corner(vec4(v.position, 1.0))", name="v")
        shade = pg.fragment(
            source="class Corner:\n    position: vec4\ndef s(c: Corner) -> vec4: return vec4(1.0)", name="s"
        )
        mesh = pg.Mesh.make(np.eye(3, dtype=np.float32), [[0, 1, 2]])
        drawn = pg.draw(mesh, vertex=place, fragment=shade, into=pg.target("drawn", "rgba8", (4, 4)))
        with pytest.raises(pg.GraphError, match="draws triangles"):
            lines_at(drawn, backend, (0, 0), {})
