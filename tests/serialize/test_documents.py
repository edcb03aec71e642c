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
from passgraph.language.lower_cache import LoweredPrograms, lower_once
from passgraph.serialize.encode import VERSION
from passgraph.serialize.reader import MOST_PARTS
from tests.serialize.documents import graph, places, spoiled

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


def definition(text: str, names: dict[str, Any] | None = None, **parts: Any) -> dict[str, Any]:
    return {"file": "<a stranger's>", "line": 1, "text": text, "names": names or {}, **parts}


SHADER = {
    "text": "uniform sampler2D a; void main() { gl_FragColor = texelFetch(a, ivec2(gl_FragCoord.xy), 0); }",
    "name": "made", "file": "<a stranger's>", "entry": "main", "prelude": "", "prelude_file": "<prelude>",
    "postlude": "", "defines": {}, "values": {}, "rows_up": True, "included": {},
}  # fmt: skip


def document(kernel: dict[str, Any], *definitions: dict[str, Any]) -> Any:
    """A document of one kernel over one input, ``a``."""
    return {
        "passgraph": "graph", "version": VERSION, "definitions": [*definitions], "kernels": [kernel], "values": [],
        "meshes": [],
        "inputs": [{"name": "frame", "format": None, "size": None, "static": False, "default": None}],
        "targets": [{"name": "made", "format": "rgba32f", "size": None, "clear": None, "notes": [],
                     "initial": [0.0]}],
        "passes": [{"name": "made", "kernel": 0, "images": {"a": {"input": 0, "border": "clamp"}}, "values": {},
                    "constants": {}, "into": [0]}],
        "outputs": [["made", {"pass": 0, "slot": 0, "border": "clamp"}]],
    }  # fmt: skip


def of_text(text: str, names: dict[str, Any] | None = None, *before: dict[str, Any]) -> Any:
    """The document of a kernel of some text, behind definitions that it may name by their numbers."""
    kernel = {"stage": "pixel", "function": len(before), "known_sizes": False, "math": None}
    return document(kernel, *before, definition(text, names))


def of_shader(**parts: Any) -> Any:
    return document({"glsl": {**SHADER, **parts}, "known_sizes": False, "math": None})


COPY = "def copy(a: Image) -> vec4: return a[0, 0]"
GROWING = "def grow(a: Image) -> vec4: return a[0, 0] * K"


@pytest.mark.parametrize("made", [of_text(COPY), of_shader()])
def test_the_smallest_documents_run(made: Any) -> None:
    with pg.compile(pg.from_data(made), "reference") as program:
        assert program(frame=FRAME)["made"].tobytes() == FRAME.tobytes()


WRONG_TEXTS = {
    "no Python": "def copy(a: Image) -> vec4 return a[0, 0]",
    "no function": "vec4(1.0)",
    "nothing": "",
    "two functions": f"{COPY}\n{COPY}",
    "a call around it": f"exec('1')\n{COPY}",
    "an import": f"import os\n{COPY}",
    "a class of functions": "class Copy:\n    def copy(a: Image) -> vec4: return a[0, 0]",
    "a base class": "class Copy(object):\n    x: float",
    "a lambda": "copy = lambda a: a[0, 0]",
    "an async function": f"async {COPY}",
}
WRONG_NAMES = {
    "a call": "__import__('os').system('false')",
    "an attribute": "pi.__class__",
    "a comprehension": "[x for x in (1, 2)]",
    "two expressions": "1\n2",
    "an assignment": "K = 1",
    "no name of the language": "print",
    "text": "'a'",
    "a number beyond 32 bits": "1e39",
    "a range of calls": "Range(len((1, 2)))",
    "letters of others": "vec4(1.0)  # é",
    "itself": 0,
    "a definition to come": 1,
    "no number": 0.5,
}


@pytest.mark.parametrize("what", WRONG_TEXTS)
def test_what_is_no_definition_is_refused(what: str) -> None:
    with pytest.raises(pg.InputError, match=r"graph data, (definitions|kernels)\[0\].*: "):
        pg.from_data(of_text(WRONG_TEXTS[what]))


@pytest.mark.parametrize("what", WRONG_NAMES)
def test_names_stand_for_constants_and_definitions_before_them(what: str) -> None:
    with pytest.raises(pg.InputError, match=r"graph data, definitions\[0\].names.K: "):
        pg.from_data(of_text(GROWING, {"K": WRONG_NAMES[what]}))


def test_nothing_that_text_calls_is_executed(tmp_path: Path) -> None:
    mark = tmp_path / "executed"
    call = f"__import__('pathlib').Path({str(mark)!r}).touch()"
    texts = [
        f"def copy(a: Image, b: float = {call}) -> vec4: return a[0, 0]",
        f"def copy(a: {call}) -> vec4: return a[0, 0]",
        f"def copy(a: Image) -> vec4: return a[0, 0] if {call} else a[0, 0]",
        f"class Copy:\n    x: float = {call}",
    ]
    for made in (*map(of_text, texts), of_text(GROWING, {"K": call})):
        with pytest.raises(pg.InputError, match=r"^graph data, "):
            pg.from_data(made)
    # What marks a function is not looked at, and the text of a kernel is one that is marked.
    pg.from_data(of_text(f"@({call})\n{COPY}"))
    assert not mark.exists()


REFUSED_KERNELS = {
    "another stage": "def copy(a: Image, v: Vertex) -> vec4: return a[0, 0]",
    "a name that stands for nothing": GROWING,
    "a variable without a value": "def copy(a: Image) -> vec4:\n  if uv().x > 0.5:\n   x = uv()\n  return x.xyxy",
    "another type": "def copy(a: Image) -> vec4: return a[0, 0].x",
    "an endless loop": "def copy(a: Image) -> vec4:\n    while True:\n        pass\n    return a[0, 0]",
    "an endless array": "def copy(a: Image, b: Array[Array[float, 8192], 4096]) -> vec4: return a[0, 0]",
    "more images than a kernel reads": "def copy(a: Image, b: Array[Image, 1000]) -> vec4: return a[0, 0]",
    "more images than an array holds": "def copy(a: Image, b: Array[Image, 1025]) -> vec4: return a[0, 0]",
    "itself": "def copy(a: Image) -> vec4: return copy(a)",
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED_KERNELS)
def test_kernels_are_held_to_the_rules_of_text(what: str) -> None:
    with pytest.raises(pg.InputError, match=r"graph data, kernels\[0\]: <a stranger's>:\d"):
        pg.from_data(of_text(REFUSED_KERNELS[what]))


@pytest.mark.parametrize("stage", ["vertex", "fragment"])
def test_only_pixel_kernels_read_beside_their_pixel(stage: str) -> None:
    document = copy.deepcopy(DATA)
    number = next(kernel["function"] for kernel in document["kernels"] if kernel["stage"] == stage)
    made = document["definitions"][number]
    assert read(document) is not None
    made["text"] = (
        made["text"]
        .replace("picture.texel(ivec2(1, 2))", "picture[0, 0]")
        .replace("picture.texel(pixel())", "picture[0, 0]")
    )
    with pytest.raises(pg.InputError, match=r"graph data, kernels\[\d\]: .*:\d+: "):
        pg.from_data(document)


@pytest.mark.parametrize("name", ["a b", "a;}void main(){", "", "1a", "a\n#version 100"])
def test_names_in_generated_code_are_names(name: str) -> None:
    for text in (f"def {name}(a: Image) -> vec4: return a[0, 0]", f"def f(a: Image, {name}: float) -> vec4: return a"):
        with pytest.raises(pg.InputError, match=r"^graph data, "):
            pg.from_data(of_text(text))


def test_calls_of_calls_of_calls_are_refused_by_what_they_come_to() -> None:
    """Each function calls the one before it twice: thirty of them say a thousand million additions."""
    once = definition("def one(x: float) -> float: return x + 1.0")
    twice = [definition("def more(x: float) -> float: return less(x) + less(x + 1.0)", {"less": n}) for n in range(29)]
    kernel = "def all_of_it(a: Image) -> float: return most(a[0, 0].x)"
    with pytest.raises(pg.InputError, match="grows past 20000 statements"):
        pg.from_data(of_text(kernel, {"most": 29}, once, *twice))
    made = of_text(kernel, {"most": 11}, once, *twice)
    with pytest.raises(pg.InputError, match=f"more than {MOST_PARTS} parts"):
        pg.from_data({**made, "kernels": made["kernels"] * 1000})


def test_expressions_and_blocks_nest_no_deeper_than_those_of_text() -> None:
    def nested(times: int) -> Any:
        text = "def copy(a: Image) -> vec4:\n" + "".join(f"{' ' * i}if pixel().x > {i}:\n" for i in range(1, times + 1))
        return of_text(f"{text}{' ' * (times + 1)}pass\n return a[0, 0]")

    with pg.compile(pg.from_data(nested(90)), "reference") as program:
        assert program(frame=FRAME)["made"].tobytes() == FRAME.tobytes()
    with pytest.raises(pg.InputError, match=r"nests? deeper than 100|too many levels"):
        pg.from_data(nested(102))
    deep = "-" * 300
    for made in (of_text(f"def copy(a: Image) -> vec4: return {deep}a[0, 0]"), of_text(GROWING, {"K": f"{deep}1.0"})):
        with pytest.raises(pg.InputError, match=r"nests deeper than|too deeply"):
            pg.from_data(made)


def test_texts_and_tables_are_no_longer_than_those_of_text() -> None:
    for made in (of_text(COPY + " " * 200_000), of_text(GROWING, {"K": "(" + "1.0, " * 100_000 + ")"})):
        with pytest.raises(pg.InputError, match="must be a text of at most"):
            pg.from_data(made)
    with pytest.raises(pg.InputError, match="has 2000 entries; kernels capture at most 1024"):
        pg.from_data(of_text("def copy(a: Image) -> vec4: return vec4(K[0])", {"K": "(" + "1.0, " * 2000 + ")"}))
    with pytest.raises(pg.InputError, match=f"more than {MOST_PARTS} parts"):
        pg.from_data(of_text(COPY, {f"K{i}": "(" + "1.0, " * 1000 + ")" for i in range(200)}))


@pytest.mark.parametrize("path", ["/etc/passwd", "../secret.glsl", "secret.glsl", "lib/../../secret.glsl"])
def test_shaders_include_what_the_document_holds_and_no_file(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "secret.glsl").write_text("\n")
    (tmp_path / "here" / "secret.glsl").write_text("\n")
    monkeypatch.chdir(tmp_path / "here")
    text = f'#include "{path}"\n{SHADER["text"]}'
    for included in ({}, {"b.glsl": ""}):
        with pytest.raises(pg.InputError, match=r"graph data, kernels\[0\]: .*#include|there is no file"):
            pg.from_data(of_shader(text=text, included=included))
    assert read(of_shader(text=f'#include "b.glsl"\n{SHADER["text"]}', included={"b.glsl": "\n"})) is not None


@pytest.mark.parametrize("backend", ["gl", "opencl", "webgpu", "numpy"])
def test_names_of_shaders_are_no_code(backend: str) -> None:
    made = of_shader(name="a\n#error b", file="*/ #error c", prelude_file="\n#error d")
    with pg.compile(pg.from_data(made), backend) as program:
        assert program(frame=FRAME)["made"].tobytes() == FRAME.tobytes()


def test_shaders_count_by_what_they_come_to() -> None:
    many = document({"glsl": SHADER, "known_sizes": False, "math": None})
    with pytest.raises(pg.InputError, match=f"more than {MOST_PARTS} parts"):
        pg.from_data({**many, "kernels": many["kernels"] * 10_000})


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
    ("kernels",), ("kernels", 0), ("kernels", 0, "function"), ("definitions",), ("definitions", 0),
    ("definitions", 0, "text"), ("definitions", 0, "names"),
    ("passes", 0, "values"), ("inputs", 1, "default", "shape"), ("targets", 0, "notes"),
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
    with pytest.raises(pg.InputError, match="reads version 5, got 2; write the data anew"):
        pg.from_data({**DATA, "version": 2})
    for wrong in (None, [], "graph", {}, {"version": 1}):
        with pytest.raises(pg.InputError, match=r"must be what pg.to_data made"):
            pg.from_data(wrong)


def test_kernels_of_strangers_are_told_by_what_they_are(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What other processes find on disk for a kernel was made from that kernel."""
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    one, other = (
        pg.from_data(of_text(f"def copy(a: Image) -> vec4: return a[0, 0].{order}")) for order in ("xyzw", "zyxw")
    )
    programs = [target["made"].made_by.kernel.program for target in (one, other)]  # type: ignore[union-attr]
    assert len({lower_once(program, Facts(), known).key for known in [LoweredPrograms()] for program in programs}) == 2


@pytest.mark.parametrize("default", [[0.0, []], [[1.0], [1.0, 2.0]], [[], 0.0]])
def test_defaults_of_values_have_rows_of_one_length(default: Any) -> None:
    """Else a graph would be read that cannot be written again."""
    gain = pg.kernel(source="def gain(c: Image, by: vec2) -> vec4: return c[0, 0] * by.x")
    data = pg.to_data(gain(pg.Input("frame"), pg.Value("by", pg.vec2, default=(1.0, 2.0))))
    assert pg.to_data(pg.from_data(data)) == data
    data["values"][0]["default"] = default
    with pytest.raises(pg.InputError, match=r"values\[0\].default.*rows of one length"):
        pg.from_data(data)
