"""A graph that travelled as plain data is the graph that set out: the same plan, the same bits, the same errors."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, get_args

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.effect_table import EFFECTS
from passgraph.language import ir
from passgraph.language.lower import lower
from passgraph.serialize.kernel_rows import ROWS
from passgraph.verify.conformance import case_inputs
from passgraph.verify.conformance.effect_cases import VARIANTS
from tests.travel.documents import graph

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


@pytest.mark.parametrize(("name", "variant", "backend"), PICTURES, ids=str)
def test_every_effect_on_pictures_travels_to_the_same_bits(name: str, variant: Mapping[str, Any], backend: str) -> None:
    effect = EFFECTS[name]
    names = ["frame", "depth"] if effect.takes == "picture+depth" else ["frame"]
    pictures = {"frame": case_inputs.picture(), "depth": case_inputs.depth()}
    assert_same_runs(
        effect.made(*map(pg.Input, names), **variant), backend, 1, **{each: pictures[each] for each in names}
    )


@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl", "reference"])
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


def test_errors_show_the_line_of_the_kernel_after_the_journey() -> None:
    far = pg.kernel(source="def far(color: Image, n: Const[int]) -> vec4:\n    return color[n * color.size.x, 0]")
    made = travelled(far(pg.Input("frame"), 3))
    with pytest.raises(pg.KernelError) as raised, pg.compile(made, "null") as program:
        program(frame=FRAME)
    assert "<kernel text>:2" in str(raised.value)
    assert "return color[n * color.size.x, 0]" in str(raised.value)


def test_every_field_of_the_representation_is_told() -> None:
    """A field that is added to it must be added to what travels."""
    parts = {*get_args(ir.Expr), *get_args(ir.Stmt)}
    assert set(ROWS) == parts
    for part, told in ROWS.items():
        assert [*told] == [field.name for field in fields(part) if field.compare]  # others are of the text


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
    "a class": (lambda: pg.Value("camera", pg.Camera), "value 'camera' is of class Camera, which does not travel"),
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
