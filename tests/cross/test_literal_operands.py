"""Every operation with a special number written on one side, against variables that hold special numbers.

Compilers of shaders fold such expressions (``0 / x`` to 0, where x may be 0 or NaN).  What is right is NumPy's float32,
not the reference.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.foreseen import foreseen_values
from passgraph.backends.registry import open_backend
from passgraph.language import scalar as s
from passgraph.language.lower import lower
from tests.conftest import require

Numbers = NDArray[np.float32]
Meaning = Callable[[Any, Any], Any]

#: Quotients of these are not too small for float32; 1e20 and 1e-20 make products that are too large or small.
VALUES = np.float32([0.0, -0.0, 1, -1, 0.5, -2.5, 2, 7.25, 1e20, -1e20, 1e-20, np.inf, -np.inf, np.nan])
WRITTEN = {
    "0.0": 0.0, "1.0": 1.0, "(-1.0)": -1.0, "0.5": 0.5, "2.0": 2.0,
    "float_from_bits(0x7F800000)": np.inf, "float_from_bits(0x7FC00000)": np.nan,
}  # fmt: skip
OPERATIONS: dict[str, Meaning] = {
    "{} + {}": np.add,
    "{} - {}": np.subtract,
    "{} * {}": np.multiply,
    "{} / {}": np.divide,
    "{} // {}": lambda a, b: np.floor(a / b),
    "floor({} * {})": lambda a, b: np.floor(a * b),
    "min({}, {})": lambda a, b: np.where(b < a, b, a),
    "max({}, {})": lambda a, b: np.where(a < b, b, a),
    "float({} < {})": np.less,
    "float({} <= {})": np.less_equal,
    "float({} > {})": np.greater,
    "float({} >= {})": np.greater_equal,
    "float({} == {})": np.equal,
    "float({} != {})": np.not_equal,
    "float(isnan({} / {}))": lambda a, b: np.isnan(a / b),
    "1.0 - {} / {}": lambda a, b: np.float32(1) - a / b,
    "1.0 if {} / {} == 0.0 else 2.0": lambda a, b: np.where(a / b == 0, 1, 2),
    "pow({}, {})": lambda a, b: np.where(
        np.isnan(b) | ((a < 0) & (np.floor(b) != b)), np.nan, np.power(np.abs(a) if np.ndim(b) == 0 else a, b)
    ),
}
#: Constants that show only when a loop is unrolled: expressions of i = 0, 1, 2 whose terms are added up.
UNROLLED: dict[str, Callable[[Numbers, np.float32], Numbers]] = {
    "float(i) / x": lambda x, i: i / x,
    "float(i) * x": lambda x, i: i * x,
    "x / float(i)": lambda x, i: x / i,
    "TABLE[i] / x": lambda x, i: i / x,
    "x * TABLE[2 - i]": lambda x, i: x * (2 - i),
    "float(i & n) / x": lambda x, i: np.float32(int(i) & 5) / x,
    "(0.0 if i < 2 else 1.0) * x": lambda x, i: np.float32(i >= 2) * x,
}


@pytest.fixture(scope="module", params=["numpy", "gl", "opencl", "webgpu"])
def device(request: pytest.FixtureRequest) -> Iterator[Backend]:
    require(request.param)
    with open_backend(request.param) as opened:
        yield opened


def run(device: Backend, text: str, outputs: int) -> NDArray[np.float32]:
    """(outputs, values): the first channel of each pixel, of a picture that pairs all values."""
    picture = np.zeros((len(VALUES), len(VALUES), 4), np.float32)
    picture[..., 0], picture[..., 1] = VALUES[:, None], VALUES
    into = tuple(pg.target(f"o{k}", "rgba32f") for k in range(outputs))
    made = pg.kernel(source=text)(pg.Input("c"), into=into if outputs > 1 else into[0])
    with pg.compile(made, backend=device, non_finite="keep") as program, np.errstate(all="ignore"):
        result = program(c=picture)
    return np.concatenate([np.moveaxis(result[target.name], -1, 0) for target in into]).reshape(4 * outputs, -1)


def differing(got: Numbers, want: NDArray[Any]) -> NDArray[np.intp]:
    """Sure zeros may have either sign, quotients are off by an ULP or two, and small numbers may be 0."""
    with np.errstate(all="ignore"):
        want = np.asarray(want, np.float32)
        near = np.abs(got - want) <= 1e-5 * np.abs(want) + 2.0**-126
        either = np.isinf(want) & (np.abs(got) == np.inf)
    return np.flatnonzero(~np.where(np.isnan(want), np.isnan(got), np.where(np.isfinite(want), near, either)))


def judged(device: Backend, cases: list[tuple[str, NDArray[Any]]], head: str = "", body: str = "") -> None:
    """Sixteen expressions a kernel: most of the time is compiling."""
    for first in range(0, len(cases), 16):
        part = cases[first : first + 16]
        outputs = -(-len(part) // 4)
        names = [f"e{k}" for k in range(len(part))] + ["0.0"] * (4 * outputs - len(part))
        lines = body or "".join(f"    e{k} = {text}\n" for k, (text, _) in enumerate(part))
        shown = ", ".join(f"vec4({', '.join(names[4 * k : 4 * k + 4])})" for k in range(outputs))
        kind = f"tuple[{', '.join(['vec4'] * outputs)}]" if outputs > 1 else "vec4"
        values = "    x, y = c[0, 0].x, c[0, 0].y\n"
        got = run(device, f"{head}def k(c: Image) -> {kind}:\n{values}{lines}    return {shown}\n", outputs)
        for (text, want), column in zip(part, got, strict=False):
            bad = differing(column, want)
            x, y = VALUES.repeat(len(VALUES)), np.tile(VALUES, len(VALUES))
            assert len(bad) == 0, f"{text}: (x, y, got, want) {[(x[i], y[i], column[i], want[i]) for i in bad[:4]]}"


@pytest.mark.sampled
@pytest.mark.parametrize("operation", OPERATIONS)
def test_a_written_number_beside_a_variable(device: Backend, operation: str) -> None:
    x, y = VALUES.repeat(len(VALUES)), np.tile(VALUES, len(VALUES))
    meaning, cases = OPERATIONS[operation], []
    with np.errstate(all="ignore"):
        for text, number in WRITTEN.items():
            cases.append((operation.format(text, "x"), meaning(np.float32(number), x)))
            if not operation.startswith("pow"):
                cases.append((operation.format("x", text), meaning(x, np.float32(number))))
        if not operation.startswith("pow"):
            cases.append((operation.format("x", "x"), meaning(x, x)))
            cases.append((operation.format("(0.0 * x)", "y"), meaning(np.float32(0) * x, y)))
            cases.append((operation.format("(0.0 / x)", "y"), meaning(np.float32(0) / x, y)))
    judged(device, cases)


def test_constants_of_unrolled_loops(device: Backend) -> None:
    """Neither is the loop unrolled here, as it may be left, nor may a driver that unrolls it fold."""
    x = VALUES.repeat(len(VALUES))
    body = "    n = 5 + int(y * 0.0)\n"
    names = [f"e{k}" for k in range(len(UNROLLED))]
    body += "".join(f"    {name} = 0.0\n" for name in (*names, "q", "r"))
    body += "    for i in range(3):\n        if c[0, 0].w > 5.0:\n            break\n"
    body += "".join(f"        {name} += {text}\n" for name, text in zip(names, UNROLLED, strict=True))
    body += "        q = q / x\n        r = r * x\n"
    body += f"    e{len(names)} = q\n    e{len(names) + 1} = r\n"
    with np.errstate(all="ignore"):
        cases = [(text, sum(of(x, np.float32(i)) for i in range(3))) for text, of in UNROLLED.items()]
        cases += [("q = q / x", np.float32(0) / x), ("r = r * x", np.float32(0) * x)]
    judged(device, [(text, np.asarray(want)) for text, want in cases], "TABLE = (0.0, 1.0, 2.0)\n", body)


#: Masks: 0 or 1 by a condition.
CHOSEN = {
    "float(y < 1.0) * x": lambda x, y: np.float32(y < 1) * x,
    "x / 2.0 * float(y < 1.0)": lambda x, y: x / np.float32(2) * np.float32(y < 1),
    "(1.0 - float(y < 1.0)) * x": lambda x, y: np.float32(~(y < 1)) * x,
    "(0.0 if y < 1.0 else -1.0) * x": lambda x, y: -np.float32(~(y < 1)) * x,
    "float(y < 1.0) / x": lambda x, y: np.float32(y < 1) / x,
    "y + float(y < 1.0) * (x - y)": lambda x, y: y + np.float32(y < 1) * (x - y),
    "y * (1.0 - float(x < 1.0)) + x * float(x < 1.0)": lambda x, y: y * np.float32(~(x < 1)) + x * np.float32(x < 1),
}


def test_a_choice_of_zero_beside_a_variable(device: Backend) -> None:
    """Mesa takes 0 for its product with NaN: 26.1 for each product, 22.3 where two values are mixed."""
    x, y = VALUES.repeat(len(VALUES)), np.tile(VALUES, len(VALUES))
    with np.errstate(all="ignore"):
        judged(device, [(text, of(x, y)) for text, of in CHOSEN.items()])


CONSTANT_VARYING = """
class Corner:
    position: vec4
    nothing: float
    x: float

def place(vertex: Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0), 0.0, 0.0 * vertex.uv.x)

def paint(corner: Corner) -> vec4:
    return vec4(corner.nothing / corner.x, 1.0, 1.0, 1.0)
"""


def test_a_varying_that_is_constant(device: Backend) -> None:
    """A driver that links stages knows it in the fragment shader."""
    mesh = pg.Mesh.make([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], [[0, 1, 2]])
    place, paint = (
        pg.vertex(source=CONSTANT_VARYING, name="place"),
        pg.fragment(source=CONSTANT_VARYING, name="paint"),
    )
    color = pg.draw(mesh, vertex=place, fragment=paint, into=pg.target("color", "rgba32f"))
    with pg.compile(color, backend=device, size=(4, 4)) as program:
        assert np.isnan(program()["color"][..., 0]).all()


def test_only_what_may_become_constant_is_foreseen() -> None:
    """Hiding costs an instruction; straight code has nothing to hide but its zeros."""
    straight = "def k(c: Image) -> vec4: return c[0, 0] * 2.0 / (c[0, 0] + 1.0)"
    assert not foreseen_values(lower(pg.kernel(source=straight).program)).constants
    loop = """
def k(c: Image, limit: float) -> vec4:
    total = vec4(0.0)
    for i in range(5):
        if total.x > limit:
            break
        total += c.texel(ivec2(i, 0)) * limit
    return total
"""
    program = lower(pg.kernel(source=loop).program)
    multiplied = [i for i in s.walk(program.body) if isinstance(i, s.Op) and i.operation == "mul" and i.on == "float"]
    foreseen = foreseen_values(program)
    assert multiplied
    assert not any(foreseen.may_be_zero(a) for i in multiplied for a in i.arguments)


def test_choices_between_constants_are_foreseen() -> None:
    """Also through arithmetic; a choice that is never 0, and one of a value and 0, are none to hide."""
    text = """
def k(c: Image) -> vec4:
    x = c[0, 0].x
    mask = float(x < 1.0)
    return vec4(mask * x, (1.0 - mask) * x, (1.0 if x < 2.0 else 3.0) * x, (x if x < 2.0 else 0.0) * x)
"""
    program = lower(pg.kernel(source=text).program)
    foreseen = foreseen_values(program)
    multiplied = [i for i in s.walk(program.body) if isinstance(i, s.Op) and i.operation == "mul"]
    hidden = [any(foreseen.may_choose_zero(a) for a in i.arguments) for i in multiplied]
    assert hidden == [True, True, False, False]
    assert not any(foreseen.may_be_zero(a) for i in multiplied for a in i.arguments)
