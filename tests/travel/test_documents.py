"""Data from strangers: whatever they say, reading them ends in little memory, with a graph or an InputError."""

from __future__ import annotations

import copy
import random
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.language.facts import Facts
from passgraph.language.lower_cache import Programs, lower_once
from passgraph.serialize.document import MOST_PARTS
from passgraph.serialize.encode import VERSION
from tests.travel.documents import graph, places, spoiled

FRAME = np.random.default_rng(7).random((6, 8, 4), np.float32)
DATA = pg.to_data(graph())
#: Of reading one spoiled document; the whole one takes a tenth of it.
MOST_BYTES = 16 << 20


def read(document: Any) -> dict[str, pg.Target] | None:
    """The graph; None where it is refused as it should be."""
    try:
        return pg.from_data(document)
    except pg.InputError as error:
        message = str(error)
    assert message.startswith("graph data, ")
    return None


def judge(document: Any) -> str:
    """What became of it: nothing but refusal, or a graph that compiles and runs, or is refused as any graph may be."""
    outputs = read(document)
    if outputs is None:
        return "refused"
    again = pg.to_data(outputs)
    assert pg.to_data(pg.from_data(again)) == again
    try:
        with pg.compile(outputs, "reference") as program:
            program(frame=FRAME)
    except pg.PassgraphError:
        return "refused later"
    return "ran"


def sweep(seeds: range) -> list[str]:
    ways = places(DATA)
    return [judge(spoiled(DATA, ways, random.Random(seed))) for seed in seeds]


def test_spoiled_documents_are_refused_or_run() -> None:
    found = sweep(range(60))
    # The sweep would show nothing if it met one end only.
    assert found.count("refused") > 40
    assert "ran" in found


@pytest.mark.slow
def test_ten_thousand_spoiled_documents_are_refused_or_run() -> None:
    assert {"refused", "ran"} <= set(sweep(range(300, 10_300)))


def test_spoiled_documents_take_little_memory() -> None:
    ways = places(DATA)
    tracemalloc.start()
    try:
        for seed in range(10):
            document = spoiled(DATA, ways, random.Random(seed))
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            read(document)
            assert tracemalloc.get_traced_memory()[1] - before < MOST_BYTES, seed
    finally:
        tracemalloc.stop()


def changed(*path: Any, to: Any) -> Any:
    made = copy.deepcopy(DATA)
    holder = made
    for key in path[:-1]:
        holder = holder[key]
    holder[path[-1]] = to
    return made


def kernel(rows: list[Any], **parts: Any) -> Any:
    """A document of one kernel over one input, of these rows; by default its result is the last expression."""
    texel = [["literal", "int", 0, None], ["texel", "vec4", "a", 0, 0, True, None]]
    whole = {
        "name": "made", "stage": "pixel", "parameters": [["a", "Image", False, None]], "results": [["", "vec4", 1]],
        "keep": None, "body": [], "source": None, "rows": texel + rows, "spans": [], "lines": [], **parts,
    }  # fmt: skip
    return {
        "passgraph": "graph", "version": VERSION, "kernels": [whole], "values": [], "meshes": [],
        "inputs": [{"name": "frame", "format": None, "size": None, "static": False, "default": None}],
        "targets": [{"name": "made", "format": "rgba32f", "size": None, "clear": None, "notes": [],
                     "initial": [0.0]}],
        "passes": [{"name": "made", "kernel": 0, "images": {"a": {"input": 0, "border": "clamp"}}, "values": {},
                    "constants": {}, "into": [0], "known_sizes": False}],
        "outputs": [["made", {"pass": 0, "slot": 0, "border": "clamp"}]],
    }  # fmt: skip


def test_the_smallest_document_runs() -> None:
    with pg.compile(pg.from_data(kernel([])), "reference") as program:
        assert program(frame=FRAME)["made"].tobytes() == FRAME.tobytes()


def loop(body: list[int], name: str = "i") -> list[Any]:
    return ["for", name, 0, 2, 2, body, None]


ONE = ["literal", "int", 1, None]
TRUE = ["literal", "bool", True, None]
UNTYPED = {
    "a component that is not there": [["swizzle", "float", 1, [5], None]],
    "a swizzle of a scalar": [["swizzle", "float", 0, [0], None]],
    "a type that does not follow": [["apply", "vec3", "add", [1, 1], None]],
    "an operation that is not there": [["apply", "vec4", "system", [1, 1], None]],
    "an argument too few": [["apply", "vec4", "add", [1], None]],
    "an int where floats are": [["apply", "vec4", "cross", [1, 0], None]],
    "a choice by a number": [["select", "vec4", 0, 1, 1, None]],
    "components too few": [["construct", "vec4", [0, 0], None]],
    "another image": [["texel", "vec4", "b", 0, 0, True, None]],
    "a parameter that is not there": [["uniform", "float", "k", False, None]],
    "a builtin of another stage": [["builtin", "vec3", "vertex.position", None]],
    "a table too short": [["table", ["int", 8], [1, 2], None]],
    "an endless array": [["local", ["mat4", 10**9], "x", None]],
    "a number beyond its type": [["literal", "int", 2**31, None]],
    "a float beyond float32": [["literal", "float", 1e39, None]],
    "a row of the future": [["literal", "int", 0, None], ["index", "float", 1, 5, None]],
    "itself": [["apply", "int", "neg", [2], None]],
}
BROKEN: dict[str, tuple[list[Any], list[int]]] = {
    "a variable without a value": ([["local", "int", "x", None], ["assign", "y", 2, None]], [3]),
    "a value in one branch only": (
        [ONE, TRUE, ["assign", "x", 2, None], ["if", 3, [4], [], None], ["local", "int", "x", None],
         ["assign", "y", 6, None]],
        [5, 7],
    ),
    "a value from a loop": (
        [ONE, ["assign", "x", 2, None], loop([3]), ["local", "int", "x", None], ["assign", "y", 5, None]], [4, 6]
    ),
    "two types": ([["assign", "x", 0, None], ["assign", "x", 1, None]], [2, 3]),
    "a jump out of nothing": ([["break", None]], [2]),
    "an index that is assigned": ([ONE, ["assign", "i", 2, None], loop([3])], [4]),
    "a condition that is a number": ([["if", 0, [], [], None]], [2]),
    "an expression as a statement": ([], [1]),
}  # fmt: skip


@pytest.mark.parametrize("what", UNTYPED)
def test_rows_that_no_parser_makes_are_refused(what: str) -> None:
    with pytest.raises(pg.InputError, match=r"graph data, kernels\[0\].rows\[\d\].*: must be "):
        pg.from_data(kernel(UNTYPED[what]))


@pytest.mark.parametrize("what", BROKEN)
def test_statements_that_no_parser_makes_are_refused(what: str) -> None:
    rows, body = BROKEN[what]
    with pytest.raises(pg.InputError, match=r"graph data, kernels\[0\].body: must be "):
        pg.from_data(kernel(rows, body=body))


@pytest.mark.parametrize(
    ("type_", "told"),
    [
        (
            [["float", 1 << 12], 1 << 13],
            r"parameters\[1\]: must be within the language's limits: .* has 33554432 elements, those of arrays in it",
        ),
        (["Image", 1025], r"parameters\[1\]: must be .* has 1025 elements, .* at most 1024"),
        (["Image", 1000], r"parameters: must be within the language's limits: a kernel takes 1001 images"),
    ],
)
def test_signatures_keep_to_the_limits_of_text(type_: Any, told: str) -> None:
    with pytest.raises(pg.InputError, match=r"graph data, kernels\[0\]\." + told):
        pg.from_data(kernel([], parameters=[["a", "Image", False, None], ["b", type_, False, None]]))


@pytest.mark.parametrize("stage", ["vertex", "fragment"])
def test_only_pixel_kernels_read_beside_their_pixel(stage: str) -> None:
    document = copy.deepcopy(DATA)
    row = next(row for k in document["kernels"] if k["stage"] == stage for row in k["rows"] if row[0] == "texel")
    assert read(document) is not None
    row[5] = True
    with pytest.raises(
        pg.InputError, match=r"graph data, kernels\[\d\].rows\[\d+\].*: must be a texel at an absolute place"
    ):
        pg.from_data(document)


@pytest.mark.parametrize("name", ["a b", "a;}void main(){", "", "1a", "a\n#version 100"])
def test_names_in_generated_code_are_names(name: str) -> None:
    for parts in ({"name": name}, {"parameters": [["a", "Image", False, None], [name, "float", False, None]]}):
        with pytest.raises(pg.InputError, match="a name as Python has them"):
            pg.from_data(kernel([], **parts))


def doubled(times: int) -> list[Any]:
    return [["apply", "vec4", "add", [number + 1, number + 1], None] for number in range(times)]


def test_sums_of_sums_of_sums_are_refused_by_what_they_stand_for() -> None:
    """A row may be used twice: thirty rows say a thousand million additions."""
    with pytest.raises(pg.InputError, match="has more than 1048576 expressions"):
        pg.from_data(kernel(doubled(30)))
    nested = [["apply", "vec4", "add", [number + 1, 1], None] for number in range(5_000)]
    with pytest.raises(pg.InputError, match="nest deeper than"):
        pg.from_data(kernel(nested))


def test_blocks_nest_no_deeper_than_those_of_text() -> None:
    def nested(times: int) -> Any:
        tower = [["if", 3, [number + 3 if number else 2], [], None] for number in range(times)]
        rows = [["assign", "x", 0, None], ["apply", "bool", "less", [0, 0], None], *tower]
        return kernel(rows, body=[times + 3])

    with pg.compile(pg.from_data(nested(100)), "reference") as program:
        assert program(frame=FRAME)["made"].tobytes() == FRAME.tobytes()
    with pytest.raises(pg.InputError, match="blocks at most 100 deep"):
        pg.from_data(nested(102))


CYCLE: list[Any] = []
CYCLE.append(CYCLE)
ROUND: dict[str, Any] = {}
ROUND["float"] = ROUND
LAUGHS: Any = ["ha"]
for _ in range(40):
    LAUGHS = [LAUGHS] * 10
DEEP: Any = 0
for _ in range(100_000):
    DEEP = [DEEP]
MONSTERS = {"a cycle": CYCLE, "an object in itself": ROUND, "ten times ten times ten": LAUGHS, "a tower": DEEP}
HOLDERS = [
    ("kernels",), ("kernels", 0), ("kernels", 0, "rows"), ("kernels", 0, "rows", 0), ("kernels", 0, "rows", 0, 2),
    ("kernels", 0, "parameters"), ("passes", 0, "values"), ("inputs", 1, "default", "shape"), ("targets", 0, "notes"),
    ("values", 0, "default"), ("targets", 0, "size"), ("passes", 0), ("outputs",), ("outputs", 0),
]  # fmt: skip


@pytest.mark.parametrize("what", MONSTERS)
@pytest.mark.parametrize("holder", HOLDERS, ids=lambda path: ".".join(map(str, path)))
def test_cycles_towers_and_multitudes_are_refused(holder: tuple[Any, ...], what: str) -> None:
    made = {**DATA}
    inner: Any = made
    for key in holder[:-1]:
        inner[key] = inner[key].copy()
        inner = inner[key]
    inner[holder[-1]] = MONSTERS[what]
    with pytest.raises(pg.InputError, match=r"^graph data, "):
        pg.from_data(made)


def test_one_part_in_a_million_places_is_counted_at_each() -> None:
    with pytest.raises(pg.InputError, match=f"more than {MOST_PARTS} parts"):
        pg.from_data({**DATA, "kernels": [DATA["kernels"][0]] * 100_000})


def test_pictures_are_as_large_as_they_say() -> None:
    huge = {"type": "f8", "shape": [30_000, 30_000, 4], "base64": ""}
    with pytest.raises(pg.InputError, match="at most 268435456 bytes of arrays"):
        pg.from_data(changed("inputs", 1, "default", to=huge))
    short = {"type": "u1", "shape": [2, 4, 1], "base64": "AAAA"}
    with pytest.raises(pg.InputError, match="must be the 8 bytes of the array in base64"):
        pg.from_data(changed("inputs", 1, "default", to=short))


def test_another_version_is_refused_with_what_to_do() -> None:
    with pytest.raises(pg.InputError, match="reads version 2, got 3; write the data anew"):
        pg.from_data({**DATA, "version": 3})
    for wrong in (None, [], "graph", {}, {"version": 1}):
        with pytest.raises(pg.InputError, match=r"must be what pg.to_data made"):
            pg.from_data(wrong)


def test_kernels_of_strangers_are_told_by_what_they_are(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What other processes find on disk for a kernel was made from that kernel."""
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    one, other = (pg.from_data(kernel([["swizzle", "vec4", 1, order, None]], results=[["", "vec4", 2]]))
                  for order in ([0, 1, 2, 3], [2, 1, 0, 3]))  # fmt: skip
    programs = [target["made"].made_by.kernel.program for target in (one, other)]  # type: ignore[union-attr]
    assert len({lower_once(program, Facts(), known).key for known in [Programs()] for program in programs}) == 2
