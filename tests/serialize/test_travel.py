"""A graph that travelled as plain data is the graph that set out: the same plan, the same bits, the same errors."""

from __future__ import annotations

import json
from collections.abc import Mapping
from enum import IntEnum
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.effect_table import EFFECTS
from passgraph.language.lower import lower
from passgraph.verify.conformance import case_inputs
from passgraph.verify.conformance.effect_cases import VARIANTS
from tests.serialize.documents import graph

#: Every variant; on gl, where drivers take their time, the first of each effect.
PICTURES = [
    (effect.name, variant, backend)
    for effect in EFFECTS.values()
    if effect.takes.startswith("picture")
    for number, variant in enumerate(VARIANTS.get(effect.name, [{}]))
    for backend in (["numpy", "gl"] if number == 0 else ["numpy"])
]
FRAME = np.random.default_rng(7).random((6, 8, 4), np.float32)
INVERT = "def invert(color: Image, share: float = 1.0) -> vec4: return vec4(share - color[0, 0].rgb, 1.0)"


def travelled(outputs: Any) -> dict[str, pg.Target]:
    return pg.from_data(json.loads(json.dumps(pg.to_data(outputs))))


def assert_same_runs(outputs: Any, backend: str, runs: int, **given: Any) -> None:
    with pg.compile(outputs, backend) as here, pg.compile(travelled(outputs), backend) as there:
        for _ in range(runs):
            ours, theirs = here(**given), there(**given)
            assert list(ours) == list(theirs)
            for name, picture in ours.items():
                assert picture.tobytes() == theirs[name].tobytes(), name
        assert here.plan.explain() == there.plan.explain()


@pytest.mark.sampled
@pytest.mark.parametrize(("name", "variant", "backend"), PICTURES, ids=str)
def test_every_effect_on_pictures_travels_to_the_same_bits(name: str, variant: Mapping[str, Any], backend: str) -> None:
    effect = EFFECTS[name]
    names = ["frame", "depth"] if effect.takes == "picture+depth" else ["frame"]
    pictures = {"frame": case_inputs.picture(), "depth": case_inputs.depth()}
    assert_same_runs(
        effect.build(*map(pg.Input, names), **variant), backend, 1, **{each: pictures[each] for each in names}
    )


@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl", "webgpu", "reference"])
def test_every_kind_of_part_travels_to_the_same_bits(backend: str) -> None:
    """History over three runs, sizes of others, two results, a struct, run values, a draw over a draw with stencil."""
    assert_same_runs(graph(), backend, 3, frame=FRAME, share=0.25)


def test_data_is_plain_and_comes_out_as_it_went_in() -> None:
    data = pg.to_data(graph())
    through = json.loads(json.dumps(data, allow_nan=False))
    assert through == data
    assert pg.to_data(pg.from_data(through)) == data
    with pg.compile(pg.from_data(data), "null", (8, 6)) as program:
        assert program.to_data() == data


def test_numbers_travel_exactly() -> None:
    hard = (-0.0, float("inf"), float("-inf"), 5e-324)
    keep = pg.kernel(source="def keep(a: Image, k: vec4, n: Array[int, 2]) -> vec4: return k")
    made = travelled(keep(pg.Input("frame"), hard, (-(2**31), 2**31 - 1)))["keep"].made_by
    assert [number.hex() for number in made.values["k"]] == [number.hex() for number in hard]  # type: ignore[union-attr]
    assert made.values["n"] == (-(2**31), 2**31 - 1)  # type: ignore[union-attr]
    value = pg.Value("k", pg.vec4, default=(float("nan"), *hard[1:]))
    back = travelled(keep(pg.Input("frame"), value, (0, 1)))["keep"].made_by.values["k"]  # type: ignore[union-attr]
    assert np.array(back.default).tobytes() == np.array(value.default).tobytes()


def test_kernels_of_every_number_and_part_lower_to_the_same_program() -> None:
    """The captured constants of a kernel too: literals of each type, tables, NaN."""
    text = """
TABLE = (1, 2, 3)
FLOATS = (0.5, -0.0, 1e999)

def every(a: Image, place: ivec2, on: bool) -> vec4:
    grid = [0.0] * 80
    for i in range(8):
        if i == place.x:
            continue
        grid[place.y + i] = FLOATS[place.x] + float(TABLE[place.y])
    m = mat3(mat4(2.0))
    both = select(a.texel(place).xyz > vec3(0.5), m[place.x], m * vec3(1.0, 2.0, 3.0))
    return vec4(both, grid[place.x]) if on and not (place.x == 0x80000000) else a[0, 0].wzyx
"""
    made = pg.kernel(source=text)(pg.Input("frame"), (1, 2), True)
    ours, theirs = (target.made_by.kernel.program for target in (made, travelled(made)["every"]))  # type: ignore[union-attr]
    assert ours == theirs
    assert lower(ours).key == lower(theirs).key


@pg.struct
class Inner:
    offset: pg.vec2 = (0.25, -0.0)


Tone = Inner


@pg.struct
class Inner:  # type: ignore[no-redef]
    scale: pg.Array[float, 2]


@pg.struct
class Outer:
    tone: Tone
    inner: Inner
    both: pg.Array[pg.Array[Inner, 2], 2]


class Choice(IntEnum):
    FIRST, SECOND = range(2)


K, CHOICE = 4.0, Choice.SECOND
PARTS = pg.Range(1, 9, "µm", odd=True)


@pg.function
def scaled(x: float, by: float = K) -> float:
    return x * by + SHIFT


SHIFT = -0.125


def capturing() -> Any:
    """A kernel that captures a constant of every kind, from around it and from modules, under names of its own."""
    import math as maths

    from passgraph import vec3 as triple

    K, UP, BITS, WORD = 0.5, triple(0, 1, 0), 0xFFFFFFF0, pg.uint(0xFFFFFFF0)
    TABLE, ROWS = np.array([[1, 2], [3, 4], [5, 6]]), [[0.1, float("inf")], [float("nan"), 2.0]]
    MATRIX, ON, LONG = pg.mat2(1, 2, 3, 4), np.bool_(True), np.linspace(0, 1, 1024, dtype=np.float32)
    ONE = (0.75,)

    def captures(a: pg.Image, n: Annotated[int, PARTS], s: Outer, at: int = CHOICE) -> pg.vec4:
        c = a[0, 0].rgb * UP + triple(MATRIX * ROWS[1] if ON else ROWS[0], scaled(K))
        c += pg.vec3(float(BITS & 255), float(WORD >> 28), float(TABLE[at].y)) + maths.pi + LONG[n] + ONE[0]
        tone = Tone()
        return pg.vec4(c * pg.smoothstep(0.0, K, s.both[1][0].scale[1]), tone.offset.x + s.tone.offset.y)

    return pg.kernel(captures)


def test_captured_constants_functions_and_structs_travel_to_the_same_bits() -> None:
    """Names stand where the graph arrives for what they stood for where the kernel was written."""
    kernel = capturing()
    scale = SimpleNamespace(scale=(0.25, 0.125))
    given = SimpleNamespace(tone=SimpleNamespace(offset=(1.0, 2.0)), inner=scale, both=[[scale, scale]] * 2)
    made = kernel(pg.Input("frame"), 3, given)
    data = pg.to_data(made)
    assert pg.to_data(pg.from_data(data)) == data
    names = [one["names"] for one in data["definitions"]]
    captured = next(one for one in names if "UP" in one)
    assert (captured["UP"], captured["K"], captured["maths.pi"]) == ("vec3(0.0, 1.0, 0.0)", "0.5", "3.1415927410125732")
    assert captured["BITS"] == "0xfffffff0"
    assert next(one for one in names if "SHIFT" in one) == {"K": "4.0", "SHIFT": "-0.125"}
    for backend in ("numpy", "reference"):
        assert_same_runs(made, backend, 1, frame=FRAME)
    there = travelled(made)["captures"].made_by.kernel  # type: ignore[union-attr]
    assert there.parameters[1].range == PARTS
    assert there.parameters[2].type == kernel.parameters[2].type


def test_constants_travel_as_they_were_captured() -> None:
    """A table that changed since is refused where the kernel is called, and not read where the graph is written."""
    table = np.arange(4.0)

    @pg.kernel
    def reading(a: pg.Image) -> float:
        return a[0, 0].x * table[pg.pixel().x]

    made = reading(pg.Input("frame", "rgba32f", (4, 2)))
    before = pg.to_data(made)
    table[:] = 7.0
    assert pg.to_data(made) == before


def test_shaders_travel_with_the_files_that_they_include(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "a.glsl").write_text('#pragma once\n#include "b.glsl"\n')
    (tmp_path / "lib" / "b.glsl").write_text("vec4 twice(vec4 c) { return c * AS_MUCH; }\n")
    file = tmp_path / "a shader.glsl"
    file.write_text(
        "#define AS_MUCH 2.0\n#include <lib/a.glsl>\n#include <lib/a.glsl>\nuniform sampler2D t; uniform float k;\n"
        "void main() { gl_FragColor = twice(texture2D(t, pg_position * 3.0)) * k; }\n"
    )
    effect = pg.load_shader(file)
    made = effect(pg.Input("frame").mipmaps(), k=0.5)
    data = json.dumps(pg.to_data(made))
    here = pg.compile(made)(frame=FRAME)["a shader"].copy()
    for path in (file, tmp_path / "lib" / "a.glsl", tmp_path / "lib" / "b.glsl"):
        path.unlink()
    there = pg.compile(pg.from_data(json.loads(data)))(frame=FRAME)["a shader"]
    assert here.tobytes() == there.tobytes()
    assert pg.to_data(pg.from_data(json.loads(data))) == json.loads(data)
    flat = pg.compile(effect(pg.Input("frame"), k=0.5))(frame=FRAME)["a shader"]
    assert flat.tobytes() != there.tobytes(), "the levels are read"


def test_errors_show_the_line_of_the_kernel_after_the_journey() -> None:
    far = pg.kernel(source="def far(color: Image, n: Const[int]) -> vec4:\n    return color[n * color.size.x, 0]")
    made = travelled(far(pg.Input("frame"), 3))
    with pytest.raises(pg.KernelError) as raised, pg.compile(made, "null") as program:
        program(frame=FRAME)
    assert "<kernel text>:2" in str(raised.value)
    assert "return color[n * color.size.x, 0]" in str(raised.value)


def test_long_chains_and_deep_expressions_travel() -> None:
    invert = pg.kernel(source=INVERT)
    target: Any = pg.Input("frame")
    for number in range(2_000):
        target = invert(target, name=f"step{number}")
    assert len(pg.to_data(target)["passes"]) == 2_000
    assert travelled(target)["step1999"].made_by is not None
    deep = pg.kernel(source=f"def deep(a: Image, n: int) -> vec4: return vec4({' + '.join(['n'] * 190)} + 0.5)")
    assert_same_runs(deep(pg.Input("frame"), 2), "reference", 1, frame=FRAME)


class Marked:
    """A class of a caller's own."""


REFUSED = {
    "a function": (lambda: pg.Value("stops").map(abs), "computed from 'stops' by a Python function"),
    "a class": (lambda: pg.Value("camera", pg.Camera), "value 'camera' is of class Camera, which cannot be serialized"),
    "a class of one's own": (lambda: pg.Value("mark", Marked), "value 'mark' is of class Marked"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_travel_is_named_with_its_pass(what: str) -> None:
    make, message = REFUSED[what]
    made = pg.kernel(source=INVERT)(pg.Input("frame"), make(), name="first")
    with pytest.raises(pg.GraphError) as raised:
        pg.to_data(made)
    assert str(raised.value).startswith("pass 'first', parameter 'share': ")
    assert message in str(raised.value)
    assert "give" in str(raised.value), "how to mend it"


def test_formats_of_ones_own_do_not_travel() -> None:
    from passgraph.formats import Format

    made = pg.kernel(source=INVERT)(pg.Input("frame"), into=pg.target("odd", Format("odd", 4, 32)))
    with pytest.raises(pg.GraphError, match=r"target 'odd': format 'odd' is not one of passgraph.formats.FORMATS"):
        pg.to_data(made)
