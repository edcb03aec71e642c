"""Scalar programs: the same meaning however they are simplified, and no more code than needed."""

from __future__ import annotations

import math
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from evaluate import evaluate
from hypothesis import HealthCheck, given, settings
from running import lowered, parsed, run, run_program

from passgraph.graph.calls import kernel
from passgraph.language import scalar as s
from passgraph.language.lower import Facts, Fused, ImageFacts, lower
from passgraph.verify.fuzz.random_expressions import Features
from passgraph.verify.fuzz.random_kernels import kernel_texts

SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, 2.5, -3.75, 7.0, 31.0, 1e-40, 1e30, -3e38, math.inf, -math.inf, math.nan, 1e9]
PICTURE = np.array(
    [[a, b, c, d] for a in SPECIAL for b in SPECIAL for c, d in zip(SPECIAL, SPECIAL[::-1], strict=True)]
)


def bits(values: list[list[np.ndarray]]) -> list[np.ndarray]:
    """Comparable bits: every NaN is one NaN."""
    flat = [v for output in values for v in output]
    return [np.where(np.isnan(v), np.int32(0x7FC00000), v.astype(np.float32).view(np.int32)) for v in flat]


BY_CHANCE = settings(
    deadline=None, derandomize=True, database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example],
)  # fmt: skip


@settings(BY_CHANCE, max_examples=100)
@given(kernel_texts(Features(wild=True, reads=False)))
def test_simplified_and_plain_programs_give_the_same_bits(text: str) -> None:
    assert_simplified_gives_the_same_bits(text)


@pytest.mark.slow
@settings(BY_CHANCE, max_examples=400)
@given(kernel_texts(Features(wild=True, reads=False)))
def test_many_simplified_and_plain_programs_give_the_same_bits(text: str) -> None:
    assert_simplified_gives_the_same_bits(text)


def assert_simplified_gives_the_same_bits(text: str) -> None:
    program = kernel(source=text, name="k").program
    inputs = {"c": PICTURE[::17].astype(np.float32)}
    plain, short = lower(program, Facts(simplify=False)), lower(program)
    assert defined_before_use(short)
    assert defined_before_use(plain)
    lanes = len(inputs["c"])
    for a, b in zip(bits(evaluate(plain, inputs, lanes)), bits(evaluate(short, inputs, lanes)), strict=True):
        np.testing.assert_array_equal(a, b)


def defined_before_use(program: s.ScalarProgram) -> bool:
    """Every value is defined once, in a block around its use; every variable is declared; nothing follows a jump."""
    seen: set[int] = set()
    variables = dict(program.variables)

    def visible(operands: tuple[s.Operand, ...], known: set[int]) -> bool:
        return all(isinstance(o, s.Lit) or o.id in known for o in operands)

    def block(body: tuple[s.Instruction, ...], known: set[int]) -> bool:
        known = set(known)
        for position, i in enumerate(body):
            if not visible(s.operands_of(i), known):
                return False
            if isinstance(i, (s.Read, s.Write)) and i.variable not in variables:
                return False
            if isinstance(i, s.If) and not (block(i.then, known) and block(i.orelse, known)):
                return False
            if isinstance(i, s.For) and not block(i.body, known | {i.index.id}):
                return False
            if isinstance(i, (s.Break, s.Continue)) and position != len(body) - 1:
                return False
            new = {v.id for v in s.results_of(i)}
            if new & seen:
                return False
            seen.update(new)
            known |= new
        outputs[0] = known
        return True

    outputs: list[set[int]] = [set()]
    roots = tuple(v for o in program.outputs for v in o.values) + ((program.keep,) if program.keep is not None else ())
    return block(program.body, set()) and visible(roots, outputs[0])


def count(program: s.ScalarProgram, kind: type | str) -> int:
    """Instructions of a kind, or operations of a name."""
    found = s.walk(program.body)
    return sum(getattr(i, "operation", "") == kind if isinstance(kind, str) else isinstance(i, kind) for i in found)


# Control flow, against Python's own


X = np.float32([0, 1, 2, 3, 4, 5, -1, 9])
#: Loops and branches over x, written once and run by Python and by the kernel language.
FLOW = {
    "a return from an inner loop leaves both": """
        for i in range(4):
            for j in range(4):
                if float(i * 4 + j) > x: return float(i * 10 + j)
        return -1.0
        """,
    "code behind an inner return is guarded": """
        y = 0.0
        for i in range(3):
            for j in range(3):
                if float(i + j) == x: return y
            y = y + 1.0
        return y * 100.0
        """,
    "a return in one branch": """
        if x > 2.0:
            if x > 4.0: return 1.0
            y = 2.0
        else:
            y = 3.0
        return y
        """,
    "continue and break": """
        y = 0.0
        for i in range(9):
            if i % 2 == 1: continue
            if float(i) > x: break
            y = y + float(i)
        return y
        """,
    "break at once": """
        y = 0.0
        for i in range(5):
            y = y + x
            if True: break
            y = y + 100.0
        return y
        """,
    "both branches jump": """
        y = 0.0
        for i in range(5):
            y = y + 1.0
            if y > x:
                break
            else:
                continue
            y = 50.0
        return y
        """,
    "a branch that leaves has no say": """
        y = 0.0
        for i in range(5):
            if float(i) < x: continue
            else: a = float(i)
            y = y + a
        return y
        """,
    "the index lives on in an int": """
        i = 7
        for i in range(3): x = x + 1.0
        return x + float(i)
        """,
    "an int keeps its value where the loop makes no trip": """
        i = 7
        for i in range(0): x = x + 1.0
        return x + float(i)
        """,
    "one index for two loops in a row": """
        y = 0.0
        for i in range(3): y = y + float(i)
        for i in range(2): y = y + float(i)
        return y + x
        """,
    "swaps": """
        y = 1.0
        x, y = y, x
        t = (x, y)
        t = (t[1], t[0])
        return t[0] * 10.0 + t[1]
        """,
    "a count down": """
        y = 0.0
        for i in range(9, 0, -3): y = y * 10.0 + float(i)
        return y + x
        """,
    "arrays": """
        a = [x] * 3
        for i in range(3): a[i] = a[i] + float(i)
        return a[0] + 10.0 * a[1] + 100.0 * a[2]
        """,
    "a chain of comparisons": """
        return 1.0 if 0.0 < x <= 3.0 < 4.0 else 0.0
        """,
    "powers": """
        return x**3 + x**0 + x**1
        """,
}


@pytest.mark.parametrize("name", FLOW)
@pytest.mark.parametrize("simplify", [True, False])
def test_control_flow_means_what_python_means(name: str, simplify: bool) -> None:
    space: dict[str, object] = {}
    body = textwrap.dedent(FLOW[name]).strip()
    exec("def python(x):\n" + textwrap.indent(body, "    "), space)
    python = space["python"]
    want = [python(float(v)) for v in X]  # type: ignore[operator]
    np.testing.assert_array_equal(run_program(lowered(body, simplify=simplify), X)[0], np.float32(want))


def test_fields_are_exchanged_all_at_once() -> None:
    before = "class S:\n    a: float\n    b: float\n"
    body = "s = S(x, 7.0)\ns = S(s.b, s.a)\ns.a, s.b = s.b, s.a\ns.a = s.a + 1.0\nreturn s.a * 10.0 + s.b"
    np.testing.assert_array_equal(run_program(lowered(body, before=before), X)[0], (X + 1) * 10 + 7)


def test_unrolled_and_looped_forms_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    body = "y = x\nfor i in range(9):\n    y = y * 1.5 + float(i) if y < 50.0 else y - float(i)\nreturn y"
    unrolled = lowered(body)
    monkeypatch.setattr("passgraph.language.lower_loops.MAX_UNROLLED_INSTRUCTIONS", 5)
    looped = lowered(body)
    assert count(unrolled, s.For) == 0
    assert count(looped, s.For) == 1
    np.testing.assert_array_equal(run_program(unrolled, X), run_program(looped, X))


@pytest.mark.parametrize("simplify", [True, False])
def test_bounds_may_be_computed_from_constants(simplify: bool) -> None:
    text = """
        def k(c: Image, r: Const[int] = 2, wide: Const[bool] = True) -> float:
            n = r * 2 if wide else 1
            total = 0.0
            for i in range(-r, r + n // 4): total += c[i, 0].x
            return total
        """
    program = lower(kernel(source=text).program, Facts(simplify=simplify))
    assert program.image("c").x == (-2, 2)


def test_loops_unroll_up_to_their_bound_only() -> None:
    assert count(lowered("y = x\nfor i in range(64): y = y * 1.5\nreturn y"), s.For) == 0
    assert count(lowered("y = x\nfor i in range(65): y = y * 1.5\nreturn y"), s.For) == 1
    assert count(lowered("y = x\nfor i in range(9):\n    if y > 2.0: break\n    y = y * 1.5\nreturn y"), s.For) == 1


def test_dead_code_goes_away() -> None:
    program = lowered("y = exp(x) + c[3, 3].x\nfor i in range(99): y = y + sin(y)\nreturn x")
    assert len(program.body) == 1
    assert program.images == (s.ImageUse("c", 4, (0, 0), (0, 0), relative=True),)  # c[3, 3] is not read any more
    assert program.variables == ()
    texel = lowered("return c[0, 0].y").body[0]
    assert isinstance(texel, s.LoadTexel)
    assert texel.to[0] is None
    assert len(texel.to) == 2


def test_what_is_common_is_computed_once() -> None:
    assert count(lowered("return exp(x + y) * exp(y + x)"), "add") == count(lowered("return exp(x + y)"), "add")
    assert count(lowered("return c[1, 0].x + c[1, 0].y + c[1, 0].z"), s.LoadTexel) == 1


def test_constants_fold_and_known_branches_vanish() -> None:
    program = lowered("y = 2.0 * 3.0 + sqrt(16.0)\nif y > 5.0: return y\nreturn exp(x)")
    assert program.body == ()
    assert program.outputs[0].values == (s.Lit("float", 10.0),)


def test_constants_are_found_in_tables_by_address() -> None:
    before = "W = (1.0, 2.0, 4.0, 8.0)\nF = ((1.0, 2.0), (3.0, 4.0))\n"
    program = lowered("return W[int(x)] + W[int(x) + 1] * 100.0 + F[int(x)].y * 1000.0", before=before)
    assert len(program.tables) == 2
    got = run_program(program, np.float32([0, 1, 2, 9, -5]))[0]
    np.testing.assert_array_equal(got, [2201, 4402, 4804, 4808, 2101])
    assert lowered("return W[2]", before=before).body == ()


def test_whole_arrays_of_ints_pass_where_floats_are_wanted() -> None:
    before = "W = (1, 2, 4)\ndef total(w: Array[float, 3]) -> float: return w[0] + w[1] + w[2]\n"
    np.testing.assert_array_equal(run("total(W) + total([1, 1, 1])", np.float32([0]), before=before), [10])


# Footprints


@pytest.mark.parametrize(("body", "x", "y"), [
    ("return c[0, 0].x", (0, 0), (0, 0)),
    ("return c[-2, 1].x + c[3, 0].x", (-2, 3), (0, 1)),
    ("y = 0.0\nfor i in range(-4, 5): y = y + c[i, 0].x\nreturn y", (-4, 4), (0, 0)),
    ("y = 0.0\nfor i in range(0, 9, 4): y = y + c[0, i * 2 - 3].x\nreturn y", (0, 0), (-3, 13)),
    ("y = 0.0\nfor i in range(100): y = y + c[i // 10, -(i % 10)].x\nreturn y", (0, 9), (-9, 0)),
    ("y = 0.0\nfor i in range(99):\n    for j in range(99):\n        if y > 9.0: break\n"
     "        y = y + c[min(i, 5), max(-j, -3)].x\nreturn y", (0, 5), (-3, 0)),
    ("y = 0.0\nfor i in range(99): y = y + c[abs(i - 50), 2 if x > 1.0 else -1].x\nreturn y", (0, 50), (-1, 2)),
])  # fmt: skip
@pytest.mark.parametrize("simplify", [True, False])
def test_footprints_cover_exactly_what_is_read(
    body: str, x: tuple[int, int], y: tuple[int, int], simplify: bool
) -> None:
    program = kernel(source="def k(c: Image, x: float) -> float:\n    " + body.replace("\n", "\n    ")).program
    use = lower(program, Facts(simplify=simplify)).image("c")
    assert (use.x, use.y, use.relative, use.absolute) == (x, y, True, False)


def test_absolute_reads_are_told_apart() -> None:
    body = "return c.sample(uv()) + d.texel(pixel()) + e[0, 1] + float(c.size.x)"
    text = f"def k(c: Image, d: Image, e: Image) -> vec4: {body}"
    program = lower(kernel(source=text).program)
    assert [(u.name, u.absolute, u.relative, u.pointwise) for u in program.images] == [
        ("c", True, False, False), ("d", True, False, False), ("e", False, True, False),
    ]  # fmt: skip


# Fusion


def test_a_fused_producer_is_there_wherever_it_is_read() -> None:
    """The read stands in a branch and behind it: what the branch computed would not be visible there."""
    producer = kernel(source="def p(c: Image) -> vec4: return exp(c[0, 0]) * 2.0").program
    text = """
        def k(b: Image, c: Image) -> vec4:
            r = vec4(0)
            if c[0, 0].x > 0.0:
                r = b[0, 0] * c[0, 0].y
                for i in range(70): r = r + b[0, 0]
            return r + b[0, 0]
        """
    facts = ImageFacts(fused=Fused(producer, Facts(), 3, 0))
    program = lower(kernel(source=text).program, Facts(images={"b": facts}))
    assert defined_before_use(program)
    texels = np.float32([[0.5, 1, 2, 3], [-0.5, 1, 2, 3]])
    got = np.stack(evaluate(program, {"c": texels, "p3/c": texels}, 2)[0], -1)
    b = np.exp(texels) * 2
    want = np.where(texels[:, :1] > 0, b * texels[:, 1:2] + 71 * b, b)
    np.testing.assert_allclose(got, want, rtol=1e-5)


# Keys


def key(body: str, before: str = "", **facts: object) -> str:
    return lower(parsed(body, before=before).program, Facts(**facts)).key  # type: ignore[arg-type]


def test_keys_do_not_depend_on_names_or_places() -> None:
    assert key("a = x + 1.0\nreturn a") == key("# a comment\nother = x + 1.0\nreturn other")
    one = kernel(source="def first(c: Image) -> vec4: return c[0, 0]").program
    two = kernel(source="\n\n\ndef second(c: Image) -> vec4:\n    '''Doc.'''\n    return c[0, 0]").program
    assert lower(one).key == lower(two).key


def test_keys_depend_on_constants_borders_and_formats() -> None:
    keys = [
        key("return x + 1.0"), key("return x + 2.0"),
        key("return x + W", "W = 3.0\n"), key("return x + W", "W = 4.0\n"),
        key("return x + 1.0", images={"c": ImageFacts(border="zero")}),
        key("return x + 1.0", images={"c": ImageFacts(channels=1)}),
        key("return x + 1.0", images={"c": ImageFacts(decode="decode_srgb")}), key("return x + 1.0", simplify=False),
        key("return x + 1.0", stores=(((("quantize_half",),), ()),)), key("return x - 0.0"), key("return x + -0.0"),
        key("return W[int(x)]", "W = (0.0, 1.0)\n"), key("return W[int(x)]", "W = (-0.0, 1.0)\n"),
    ]  # fmt: skip
    assert len(set(keys)) == len(keys)


def test_keys_are_the_same_in_every_process() -> None:
    text = """
        def k(c: Image, a: float, b: vec3) -> vec4:
            r = c[0, 0]
            for i in range(99):
                if r.x > a: r = r * vec4(b, a)
                r.y = sin(r.y)
            return r
        """
    script = "from passgraph.graph.calls import kernel\nfrom passgraph.language.lower import lower\n"
    script += f"print(lower(kernel(source={text!r}).program).key)"
    keys = {lower(kernel(source=text).program).key}
    for seed in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=True,
            env={"PYTHONHASHSEED": seed, "PYTHONPATH": ":".join(sys.path)},
        )  # fmt: skip
        keys.add(done.stdout.strip())
    assert len(keys) == 1
