"""Texts that mean harm: all end, soon, with an error that names a limit or with a kernel."""

from __future__ import annotations

import contextlib
import cProfile
import random
import re

import pytest
from test_glsl_meaning import CASES

from passgraph.errors import KernelError, PassgraphError
from passgraph.glsl import parse

#: Calls of functions in Python that each character of a text may cost.
CALLS_A_CHARACTER = 80
DOUBLING = "#define A0 1.0\n" + "".join(f"#define A{i} A{i - 1} + A{i - 1}\n" for i in range(1, 64))
CHAIN = "".join(f"#define B{i} B{i + 1}\n" for i in range(5000))


def body(text: str) -> str:
    return f"void main() {{ {text} gl_FragColor = vec4(1); }}"


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x" * 10_000_000, "at most 500000 are read"),
        (DOUBLING + body("float a = A63;"), "macros bring more than"),
        ("#define F(x) x x x x\n" + body("F(" * 40 + "1" + ")" * 40), "macros bring more than"),
        (CHAIN + body("B0;"), "macros nest deeper"),
        ("#define F(x) x\n" + body("F(" * 3000 + "1" + ")" * 3000), "macros nest deeper"),
        ("#if " + "(" * 5000 + "1" + ")" * 5000 + "\n#endif", "nests deeper"),
        ("#if " + "!" * 5000 + "1\n#endif", "nests deeper"),
        ("#if 1\n" * 5000, "conditions nest deeper"),
        ("#define N 9\n" * 20000 + "#if 1 << 63 << 63\n#error small\n#endif\n#error end", "the shader says: end"),
        (body("float a = " + "(" * 5000 + "1.0" + ")" * 5000 + ";"), "nests deeper"),
        (body("float a = " + "-" * 5000 + "1.0;"), "nests deeper"),
        (body("float a = 1.0" + " + 1.0" * 5000 + ";"), "nest deeper"),
        (body("vec2 a; a" + ".xy" * 5000 + ";"), "nest deeper"),
        (body("bool a = true; a = " + "a ? a : " * 5000 + "a;"), "nests deeper"),
        (body("float a; a" + " = a" * 5000 + ";"), "nests deeper"),
        (body("{" * 5000 + "}" * 5000), "nests deeper"),
        (body("if (true) " * 5000 + ";"), "nests deeper"),
        (body("int i; " + "for (;;) " * 150 + "i++;"), "nests too deeply"),
        ("float f0(float x) { return x; }" + "".join(
            f"float f{i}(float x) {{ return f{i - 1}(x) + f{i - 1}(x); }}" for i in range(1, 30)
        ) + body("f29(1.0);"), "once its functions are inlined"),
        (body("float a[32], x; int n;" + f"x += float[32][32]({','.join('a' * 32)})[n][n];" * 240),
         "its arrays written out"),
        (body("float a[1024]; float b[2000];"), "b would hold Array[float, 2000]"),
        ("struct S0 { float a; };" + "".join(f"struct S{i} {{ S{i - 1} a, b; }};" for i in range(1, 20)) + body(""),
         "fields, nested ones too"),
        ("uniform sampler2D s[100], t[100]; " + body(""), "takes 200 images"),
        ("layout(location = 9999999999) out vec4 o; " + body(""), "whole number"),
        ("int a = 1" + "0" * 100_000 + ";" + body(""), "this word has 100001 characters"),
        ("float " + "a" * 2000 + ";" + body(""), "this word has 2000 characters"),
        ("\0\0\0" + body(";"), ""),
        ("".join(f"uniform float u{i};" for i in range(20_000)) + body(""), ""),
        ("\ufeff" + body("\\\n;"), ""),
    ],
)  # fmt: skip
def test_texts_without_measure_meet_a_limit(text: str, told: str) -> None:
    if not told:
        assert parse(text).program.results
        return
    with pytest.raises(KernelError) as caught:
        parse(text)
    assert told in str(caught.value)
    assert len(str(caught.value)) < 2000


#: A struct that texts repeat by its name. What they mean is many times as long as they are.
_STRUCT = "struct S { float " + ", ".join(f"a{i}" for i in range(256)) + "; };"


@pytest.mark.parametrize(
    "text",
    [
        _STRUCT + "uniform S " + ", ".join(f"u{i}" for i in range(3000)) + ";" + body(""),
        _STRUCT + "".join(f"struct T{i} {{ S a; }};" for i in range(2000)) + body(""),
        _STRUCT + "struct T { S " + ", ".join(f"u{i}" for i in range(3000)) + "; };" + body(""),
        _STRUCT + "float f(" + ", ".join(f"S p{i}" for i in range(1000)) + ") { return 1.0; } S s;"
        + body(f"f({', '.join(['s'] * 1000)});"),
        _STRUCT + "S s; " + body("float x = 0.0;" + "x += s.a0;" * 2000),
        _STRUCT + "float f(S s) { return 1.0; } S s; " + body("float x = 0.0;" + "x += f(s);" * 2000),
    ],
)  # fmt: skip
def test_what_a_name_repeats_is_counted_before_it_is_made(text: str) -> None:
    """A text costs as much as it is long, until its limit is told or it is taken."""
    counted = cProfile.Profile()
    counted.enable()
    with contextlib.suppress(KernelError):
        parse(text)
    counted.disable()
    assert sum(entry.callcount for entry in counted.getstats()) < CALLS_A_CHARACTER * len(text)


_WORD = re.compile(r"\w+|\s+|[^\w\s]")
_STRANGE = ["#define", "\n#if", "\n#endif\n", "(", ")", "{", "}", "[", "##", "0x", "1e99", "for", "uint", "a(", "?",
            ",", "mat4", "void", "struct S{", "return", "discard;", "const", "in", "/*", "//", "\\\n",
            "layout(local_size_x = 8) in;", "shared", "image2D", "barrier();", "if (true)", "textureLod(t, p, 9.)",
            "\U0001f600"]  # fmt: skip


def mutated(text: str, chance: random.Random) -> str:
    """A text with a character changed, a line dropped, a word doubled, swapped or put in."""
    kind = chance.randrange(5)
    if kind == 0:
        at = chance.randrange(len(text))
        return text[:at] + chr(chance.randrange(256)) + text[at + 1 :]
    if kind == 1:
        lines = text.split("\n")
        del lines[chance.randrange(len(lines))]
        return "\n".join(lines)
    words = _WORD.findall(text)
    i, j = chance.randrange(len(words)), chance.randrange(len(words))
    if kind == 2:
        words.insert(i, words[i])
    elif kind == 3:
        words[i], words[j] = words[j], words[i]
    else:
        words.insert(i, chance.choice(_STRANGE))
    return "".join(words)


def survives(count: int, seed: int) -> int:
    """Mutants of the cases that still are shaders; any error but our own goes on to the caller."""
    chance, texts, found = random.Random(seed), list(CASES.values()), 0
    for _ in range(count):
        text = chance.choice(texts)
        for _ in range(chance.randrange(1, 4)):
            text = mutated(text, chance) or "x"
        try:
            shader = parse(text)
            if not chance.randrange(4):
                shader.leveled(frozenset(p.name for p in shader.program.parameters))
            found += 1
        except PassgraphError:
            pass
    return found


def test_mutants_are_shaders_or_errors() -> None:
    assert 20 < survives(300, seed=1) < 280


@pytest.mark.slow
def test_ten_thousand_mutants_are_shaders_or_errors() -> None:
    assert survives(10_000, seed=2) > 1000
