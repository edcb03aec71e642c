"""The generators: what they can make, that planted mistakes are found, and that failures shrink."""

from __future__ import annotations

import ast
import re
from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings

from passgraph.backends.base import Backend
from passgraph.backends.gl.glsl import SPELLED
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.registry import open_backend
from passgraph.graph.calls import kernel
from passgraph.graph.draw_state import COMPARE, CULL, EQUATIONS, FACTORS, STENCIL_OPERATIONS
from passgraph.language import ir
from passgraph.language.operations import OPERATIONS
from passgraph.verify.fuzz import search
from passgraph.verify.fuzz.cases import EXACT, Tally, inputs_of, output_of, run
from passgraph.verify.fuzz.random_draws import draws
from passgraph.verify.fuzz.random_expressions import CALLS, WHOLE, Features
from passgraph.verify.fuzz.random_graphs import OPERATIONS as STEPS
from passgraph.verify.fuzz.random_graphs import graphs
from passgraph.verify.fuzz.random_kernels import kernel_around, kernel_texts, kernels
from passgraph.verify.fuzz.search import outcome
from passgraph.verify.fuzz.variants import REWRITINGS, rewritten
from tests.conftest import require
from tests.respelling import respelled

MANY = settings(
    max_examples=150, deadline=None, database=None, phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)  # fmt: skip


def operations_of(node: Any, found: Counter[str]) -> None:
    """Every operation in a piece of typed IR."""
    if isinstance(node, ir.Apply):
        found[node.operation] += 1
    if isinstance(node, (tuple, list)):
        for part in node:
            operations_of(part, found)
    elif hasattr(node, "__dataclass_fields__"):
        for name in node.__dataclass_fields__:
            operations_of(getattr(node, name), found)


#: What kernels may have beside operations.
WORDS = {
    "for ", "if ", "elif ", "else:", "break", "continue", "return", ".sample(", ".texel(", ".nearest(", ".gather(",
    ".sample3(", "c[", "Const[", "pair.",
    "weights", "TABLE", "helper(", "blend(", ".size", "pixel()", "bits_from_float(",
}  # fmt: skip


@pytest.mark.slow
def test_kernels_use_the_whole_language_and_are_taken() -> None:
    found: Counter[str] = Counter()

    @settings(MANY, max_examples=50)
    @given(kernel_texts(Features(wild=False)), kernel_texts(Features(wild=True)))
    def collect(tame: str, wild: str) -> None:
        for text in (tame, wild):
            program = kernel(source=text, name="k").program
            operations_of((program.body, program.results), found)
            found.update(word for word in WORDS if word in text)

    wanted = {*OPERATIONS, *WORDS}
    # First those that drew rare ones; all others, where the generator draws otherwise now.
    for round_ in (6, 11, *range(24)):
        if wanted - set(found):
            seed(round_)(collect)()
    assert wanted - set(found) == set()


def test_graphs_and_draws_use_every_step_and_state() -> None:
    seen: Counter[Any] = Counter()

    @seed(0)
    @MANY
    @given(graphs(), draws())
    def collect(graph: dict[str, Any], draw: dict[str, Any]) -> None:
        seen.update(step[0] for step in graph["steps"])
        for state in draw["draws"]:
            seen.update((state["cull"], state["depth_compare"]))
            seen.update((state["blend"] or {}).values())
            seen.update((state["stencil"] or {}).values())

    collect()
    wanted = {*STEPS, *CULL, *COMPARE, *FACTORS, *EQUATIONS, *STENCIL_OPERATIONS}
    assert wanted - set(seen) == set()


def test_tame_kernels_stay_in_their_ranges() -> None:
    """Every float variable of a run on ordinary values: finite, and within the range that the generator promises."""
    with ReferenceBackend() as backend:

        @seed(0)
        @settings(MANY, max_examples=60)
        @given(kernels(Features()))
        def check(case: dict[str, Any]) -> None:
            names = [n for n in re.findall(r"^    (\w+) = ", case["text"], re.MULTILINE) if n[0] in "xyf"]
            plain = {**case, "special": False, "format": "rgba32f"}
            if "return" in case["text"].rsplit("\n    return", 1)[0] or not names:
                return
            head, _, _ = case["text"].rpartition("\n    return")
            text = f"{head}\n    return vec4({names[-1]}, x, y, 1.0)\n"
            out = output_of(plain, text)
            picture = run({"out": out}, backend, None, **inputs_of(plain, out))["out"]
            assert np.isfinite(picture).all()
            assert np.abs(picture).max() <= WHOLE[1]

        check()


def test_one_seed_gives_the_same_cases() -> None:
    def cases(number: int) -> list[dict[str, Any]]:
        seen: list[dict[str, Any]] = []

        class Watching(ReferenceBackend):
            pass

        with pytest.MonkeyPatch.context() as patch, Watching() as backend:
            patch.setattr(search, "outcome", lambda case, *_: seen.append(case) or "")
            search.batch(kernels(), [backend], number, Tally(), 20)
        return seen

    assert cases(4) == cases(4) != cases(5)


# Planted mistakes


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "kind", "text"),
    [
        ("sub", "float", "({1} - {0})"),
    ],
)
def test_a_planted_operation_is_found_and_shrunk(
    name: str, kind: str, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    require("gl")
    with open_backend("gl") as backend, monkeypatch.context() as patch:
        patch.setattr(search, "SHRINK_SECONDS", 10.0)
        respelled(patch, SPELLED[kind], name, text)
        failures = (search.batch(kernels(Features()), [backend], number, Tally(), 40) for number in range(6))
        failure = next((one for one in failures if one is not None), None)
    assert failure is not None
    assert "gl: pass out, target out: outside its bounds" in failure.why
    # The head has five lines and the least that a kernel does one or two; functions that it calls come before it.
    assert len(failure.case["text"].splitlines()) <= 20, failure.case["text"]
    with open_backend("gl") as backend:
        assert outcome(failure.case, [backend]) == ""


class Hasty(ReferenceBackend):
    """A backend that raises what no backend should."""

    name = "hasty"

    def pixel_pass(self, step: Any) -> Any:
        raise ZeroDivisionError("planted")


def test_an_exception_is_a_failure() -> None:
    with Hasty() as backend:
        failure = search.batch(kernels(), [backend], 0, Tally(), 3)
    assert failure is not None
    assert failure.why == "hasty failed: ZeroDivisionError: planted"


def test_after_its_time_nothing_runs() -> None:
    tally = Tally()
    assert search.batch(kernels(), [], 0, tally, 10, until=0.0) is None
    assert not tally.cases


# Rewriting


TEXT = kernel_around("""\
    p = c[0, 0]
    x, y, u, v = p.x, p.y, p.zw, p.xyz
    n, a, m = int(p.w), [p.x, p.y, 1.0, 4.0], mat3(p.z)
    x = blend(v, vec3(1.0), 0.25).x + 2
    y = p.x * 3.0
    if x > y:
        v = vec3(x)
    for i1 in range(3):
        x += y
    return vec4(v, x) + vec4(y)""")


@pytest.mark.parametrize("name", REWRITINGS)
@pytest.mark.parametrize("place", range(3))
def test_a_rewriting_changes_the_text_and_not_the_meaning(name: str, place: int) -> None:
    other = rewritten(TEXT, name, place)
    skipped = name == "inlined" and place % 3  # there is one call only
    assert (ast.dump(ast.parse(other)) != ast.dump(ast.parse(TEXT))) is not bool(skipped)
    case = {"kind": "variant", "text": TEXT, "other": other, "format": "rgba32f", "border": "clamp", "special": True,
            "seed": 0}  # fmt: skip
    with ReferenceBackend() as backend:
        tally = Tally()
        assert outcome(case, [backend], tally) == ""
        assert not tally.refused


@pytest.mark.parametrize(
    ("old", "new"), [("p.x * 3.0", "p.x * 3.0000002"), ("x > y", "x >= y + 1.0"), ("+= y", "-= y")]
)
def test_a_rewriting_with_another_meaning_is_found(old: str, new: str, backend: Backend) -> None:
    case = {"kind": "variant", "text": TEXT, "other": TEXT.replace(old, new), "format": "rgba32f", "border": "clamp",
            "special": False, "seed": 0}  # fmt: skip
    why = outcome(case, [backend])
    # Bits may differ for other reasons there, and the rewritten form by itself is within its own bounds.
    assert why == ("" if backend.name not in EXACT else f"{backend.name}: the rewritten kernel gives other bits")


def test_every_call_has_a_range_that_literals_fit() -> None:
    for operands, (low, high) in CALLS.values():
        for a, b in (*operands, (low, high)):
            assert a < b
            assert (a * 8, b * 8) == (int(a * 8), int(b * 8)), "range ends lie on steps of 1/8"


def test_refused_text_counts_as_refused() -> None:
    tally = Tally()
    assert (
        outcome({"kind": "kernel", "text": "def k(c: Image) -> vec4: return x\n", "border": "clamp"}, [], tally) == ""
    )
    assert tally.refused == 1
