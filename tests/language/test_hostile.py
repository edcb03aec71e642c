"""Kernel text from strangers: never executed; every text ends quickly, in a program or in a KernelError."""

from __future__ import annotations

import contextlib
import cProfile
import resource
from pathlib import Path

import pytest

from passgraph.errors import PassgraphError
from passgraph.graph.calls import kernel
from passgraph.language.lower import lower

#: Calls of functions in Python that a text may cost.  The longest takes 2.4 million, a second or two on its own.
CALLS = 2_900_000
MEGABYTES = 600
#: Calls that each character of a text may cost.
CALLS_A_CHARACTER = 80


def body(text: str) -> str:
    return f"def k(c: Image) -> float:\n    x = c[0, 0].x\n    {text}\n"


def doubling(levels: int, first: str = "x * 1.5", call: str = "f{0}(x) + f{0}(x + 1.0)") -> str:
    lines = [f"def f0(x: float) -> float: return {first}"]
    lines += [f"def f{n + 1}(x: float) -> float: return {call.format(n)}" for n in range(levels)]
    return "\n".join(lines) + "\n" + body(f"return f{levels}(x)")


def nested_loops(depth: int, trips: int | str, inner: str) -> str:
    lines = [f"{'    ' * (n + 1)}for i{n} in range({trips}):" for n in range(depth)]
    inner = "    " * (depth + 1) + inner
    return "\n".join(["def k(c: Image) -> float:", "    x = c[0, 0].x", *lines, inner, "    return x\n"])


def nested_ifs(depth: int) -> str:
    lines = [f"{'    ' * (n + 1)}if x > {n}.0:" for n in range(depth)]
    inner = "    " * (depth + 1) + "x = 1.0"
    return "\n".join(["def k(c: Image) -> float:", "    x = c[0, 0].x", *lines, inner, "    return x\n"])


WIDE = "vec4(" * 60 + "x" + ").x" * 60
HOSTILE = {
    "a chain of sums": body("return " + " + ".join(["x"] * 40_000)),
    "parentheses": body("return " + "(" * 5000 + "x" + ")" * 5000),
    "unary signs": body("return " + "-" * 90_000 + "x"),
    "nots": body("return 1.0 if " + "not " * 4000 + "x > 1.0 else 0.0"),
    "a chain of attributes": body("return x" + ".x" * 4000),
    "a chain of subscripts": body("return x" + "[0]" * 3000),
    "a chain of calls": body("return " + "abs(" * 3000 + "x" + ")" * 3000),
    "a chain of comparisons": body("return 1.0 if " + " < ".join(["x"] * 3000) + " else 0.0"),
    "conditionals": body("return " + "1.0 if x > 1.0 else " * 3000 + "x"),
    "powers": body("return " + "x**" * 3000 + "2"),
    "elif": body(
        "if x > 0.0:\n        x = 1.0\n"
        + "".join(f"    elif x > {n}.0:\n        x = 2.0\n" for n in range(2000))
        + "    return x"
    ),
    "nested ifs": nested_ifs(90),
    "too deep ifs": nested_ifs(150),
    "a million characters": body("return x  #" + "a" * 1_000_000),
    "a long line": body("return " + " + ".join(["x"] * 10_000)),
    "many lines": body("\n    ".join(["x = x + 1.0"] * 15_000) + "\n    return x"),
    "many lines with wide letters": body("\n    ".join(["x = x + 1.0  # é日本語"] * 8_000) + "\n    return x"),
    "a long integer": body("return x + " + "9" * 100_000),
    "a long hexadecimal integer": body("return x + 0x" + "f" * 9_000),
    "a huge integer": body("return x + " + str(2**4000)),
    "a huge float": body("return x + 1e400 - 1e39"),
    "a huge range": body("for i in range(2000000000): x = x + 1.0\n    return x"),
    "huge nested ranges": nested_loops(5, 60_000, "x = x + 1.0"),
    "nested ranges": nested_loops(16, 2, "x = x * 1.5 + 1.0"),
    "nested ranges of nothing": nested_loops(18, 1, "x = x * 1.5 + 1.0"),
    "nested constant ranges": nested_loops(4, 16, "x = x + float(i0 * i1 * i2 * i3)"),
    "nested ranges of long bodies": nested_loops(8, 4, "x = " + " + ".join(["x * 1.5"] * 90)),
    "ranges of data": nested_loops(4, "clamp(int(x), 0, 16)", "x = x + float(i0 * i1 * i2 * i3)"),
    "nested ranges of endless data": nested_loops(3, "min(int(x), 60000)", "x = x + 1.0"),
    "bounds of bounds": body(
        "n = clamp(int(x), 0, 9)\n    "
        + "\n    ".join(["n = min(n + n, max(n - n, n * n))"] * 3000)
        + "\n    for i in range(n): x = x + 1.0\n    return x"
    ),
    "bounds in bounds": body(
        "for i in range(" + "min(9, max(-9, " * 40 + "int(x)" + "))" * 40 + "): x = x + 1.0\n    return x"
    ),
    "many loops of data": body(
        "\n    ".join(["for i in range(min(int(x), 99)): x = x * 1.5"] * 1500) + "\n    return x"
    ),
    "a match of many cases": body(
        "match int(x):\n" + "".join(f"        case {n}: x = {n}.0\n" for n in range(5000)) + "    return x"
    ),
    "matches in matches": "def k(c: Image) -> float:\n    x = c[0, 0].x\n"
    + "".join(f"{'  ' * n}    match int(x):\n{'  ' * n}     case {n}:\n" for n in range(60))
    + "  " * 60
    + "    x = 1.0\n    return x",
    "many alternatives": body(
        "match int(x):\n        case " + " | ".join(map(str, range(1500))) + ": x = 1.0\n    return x"
    ),
    "discards": body("\n    ".join(f"if x > {n}.0: discard()" for n in range(3000)) + "\n    return x"),
    "a zero step": body("for i in range(0, 9, 0): x = x + 1.0\n    return x"),
    "a long array": body("a = [x] * 1000000000\n    return a[0]"),
    "an array of matrices": body(
        "a = [mat4(x)] * 1024\n    for i in range(65000): a[i] = a[i + 1]\n    return a[0][0].x"
    ),
    "array shifts": body(
        "a = [x] * 1024\n    "
        + "\n    ".join(f"for i in range(60000): a[{n}] = a[{n + 1}]" for n in range(9))
        + "\n    return a[0]"
    ),
    "an array parameter": "def k(a: Array[mat4, 1000000000]) -> float: return a[0][0].x",
    "functions that double": doubling(30),
    "functions that quadruple": doubling(20, call="f{0}(x) + f{0}(x) + f{0}(x) + f{0}(x)"),
    "big functions many times": doubling(9, first=" * ".join(["(x + 1.5)"] * 150)),
    "functions that recurse": "def f(x: float) -> float: return f(x) + 1.0\n" + body("return f(x)"),
    "functions that recurse in a ring": (
        "def f(x: float) -> float: return g(x)\ndef g(x: float) -> float: return f(x)\n" + body("return f(x)")
    ),
    "splats of splats": body(f"return {WIDE}"),
    "selects of selects": body("v = vec4(x)\n    return " + "select(less(v, v), v, " * 60 + "v" + ")" * 60 + ".x"),
    "conversions of conversions": body("return " + "float(int(" * 60 + "x" + "))" * 60),
    "vector conversions": body("v = vec4(x)\n    return " + "vec4(ivec4(" * 60 + "v" + "))" * 60 + ".x"),
    "matrix sums": body("m = mat4(x)\n    return (" + "(" * 60 + "m" + " + m)" * 60 + ")[0].x"),
    "matrices of matrices": body("m = mat4(x)\n    return " + "mat4(" * 60 + "m" + ")" * 60 + "[0].x"),
    "inverses": body("m = mat4(x)\n    return " + "inverse(" * 100 + "m" + ")" * 100 + "[0].x"),
    "tuples of tuples": body("t = (x, x)\n" + "    t = (t[0], t[1])\n" * 3000 + "    return t[0]"),
    "growing tuples": body(
        "a0 = (x, x)\n" + "".join(f"    a{n + 1} = (a{n}, a{n})\n" for n in range(40)) + "    return x"
    ),
    "constants that grow": "A0 = (1, 1)\n"
    + "".join(f"A{n + 1} = (A{n}, A{n})\n" for n in range(60))
    + body("return x"),
    "a constant product": "N = " + "*".join(["2147483647"] * 150) + "\n" + body("return x + N"),
    "structs of structs": "class S0:\n    v: float\n"
    + "".join(f"class S{n + 1}:\n    a: S{n}\n    b: S{n}\n" for n in range(40))
    + "def k(s: S40) -> float: return 1.0",
    "annotations in strings": "def k(c: " + "'" + "Image" + "'" * 99 + ") -> float: return 1.0",
    "an annotation with a null": "def k(c: 'Im\\0age') -> float: return 1.0",
    "a deep annotation": "def k(c: 'tuple[" + "tuple[" * 90 + "float" + "]" * 91 + "') -> float: return 1.0",
    "a null": "def k(c: Image) -> float:\0 return 1.0",
    "a surrogate": "def k(c: Image) -> float: return 1.0  # \udcff",
    "arrays of arrays": body("a = " + "[" * 200 + "x" + "] * 2" * 200 + "\n    return a[0]"),
    "tables of tables": body(
        f"t = [{', '.join(['1.5'] * 32)}]\n"
        + f"    x += [{','.join('t' * 32)}][int(x)][int(x)]\n" * 240
        + "    return x"
    ),
    "an array of arrays of arrays": "def k(a: " + "Array[" * 90 + "float" + ", 2]" * 90 + ") -> float: return 1.0",
    "arrays of images": "def k("
    + ", ".join(f"p{n}: Array[Array[Image, 32], 32]" for n in range(3000))
    + ") -> float: return 1.0",
    "rows of rows": "def k(a: Array[Array[float, 512], 2]) -> float:\n    x = a[0][0]\n"
    + "    r = a[int(x)]\n" * 10_000
    + "    return r[0]",
    "rows that are written": "def k(a: Array[Array[float, 512], 2]) -> float:\n"
    + "    a[int(a[0][1])] = a[int(a[1][0])]\n" * 4_000
    + "    return a[0][0]",
    "images of images": "def k(a: Array[Image, 128]) -> float:\n    return "
    + "a[int(" * 90
    + "1.0"
    + ")].sample(vec2(0.5)).x" * 90,
    "arrays of structs of arrays": "class S0:\n    v: Array[float, 2]\n"
    + "".join(f"class S{n}:\n    v: Array[S{n - 1}, 2]\n    w: S{n - 1}\n" for n in range(1, 40))
    + "def k(s: S39) -> float: return 1.0",
    "many parameters": "def k(" + ", ".join(f"p{n}: mat4" for n in range(5000)) + ") -> float: return 1.0",
    "dead branches": body("\n    ".join(f"if x > {n}.0: x = x + 1.0" for n in range(3000)) + "\n    return x"),
    "returns in branches": body("\n    ".join(f"if x > {n}.0: return x" for n in range(3000)) + "\n    return x"),
    "decorators": "@kernel(__import__('os').system('touch /tmp/passgraph-was-here'))\n" + body("return x"),
}


@pytest.mark.sampled
@pytest.mark.parametrize("name", HOSTILE)
def test_every_text_ends_quickly(name: str) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    message, counted = "", cProfile.Profile(builtins=False)
    counted.enable()
    try:
        lower(kernel(source=HOSTILE[name], name="k").program)
    except PassgraphError as error:
        message = str(error)
    finally:
        counted.disable()
    assert len(message) < 3000
    # Built-in functions apart, whose code is a text: Python 3.14 counts them whatever Profile(builtins=False) says.
    assert sum(entry.callcount for entry in counted.getstats() if not isinstance(entry.code, str)) < CALLS
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024 < MEGABYTES


#: Texts that repeat a table or a struct by its name. What they mean is many times as long as they are.
_TABLE = "A = (" + "(1.0, 2.0, 3.0, 4.0),\n" * 1000 + ")\n"
_STRUCT = "class S:\n" + "".join(f"    a{n}: float\n" for n in range(256))
REPEATED = {
    "a table in a table": _TABLE + "B = (" + "A,\n" * 2000 + ")\n" + body("return x"),
    "a table by other names": _TABLE + "".join(f"B{n} = A\n" for n in range(2000)) + body("return x"),
    "a table of several functions": _TABLE
    + "".join(f"def g{n}(x: float) -> float: return A[0][0]\n" for n in range(500))
    + body("".join(f"x += g{n}(x)\n    " for n in range(500)) + "return x"),
    "a table as a default": _TABLE
    + "class T:\n"
    + "".join(f"    a{n}: Array[vec4, 1000] = A\n" for n in range(256))
    + body("return x"),
    "a table in a vector": _TABLE + "B = vec4(" + "A,\n" * 2000 + ")\n" + body("return x"),
    "a struct in structs": _STRUCT + "".join(f"class T{n}:\n    a: S\n" for n in range(1000)) + body("return x"),
    "a struct in a struct": _STRUCT + "class T:\n" + "".join(f"    b{n}: S\n" for n in range(2000)) + body("return x"),
    "a struct as parameters": _STRUCT
    + "def k(\n"
    + "".join(f"    b{n}: S,\n" for n in range(2000))
    + ") -> float: return 1.0",
}


@pytest.mark.parametrize("name", REPEATED)
def test_what_a_name_repeats_is_counted_before_it_is_made(name: str) -> None:
    """A text costs as much as it is long, until its limit is told or it is taken."""
    counted = cProfile.Profile()
    counted.enable()
    with contextlib.suppress(PassgraphError):
        kernel(source=REPEATED[name], name="k")
    counted.disable()
    assert sum(entry.callcount for entry in counted.getstats()) < CALLS_A_CHARACTER * len(REPEATED[name])


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os')",
        "__import__('os').system('true')",
        "open('/etc/passwd')",
        "eval('1')",
        "exec('1')",
        "getattr(x, 'y')",
        "().__class__.__bases__[0].__subclasses__()",
        "x.__class__",
        "c.__init__",
        "c[0, 0].__class__",
        "pg.__loader__",
        "passgraph.__dict__",
        "passgraph.errors",
        "passgraph.sys",
        "globals()",
        "vec3.__init__",
        "vec3.__mro__",
        "dot.name",
        "(lambda: 1.0)()",
        "[x for x in (1, 2)][0]",
        "f'{x}'",
        "'a' * 9",
        "b'1'",
        "1j",
        "...",
        "None",
        "print(x)",
        "len.__self__",
        "int('5')",
        "float('nan')",
        "range(3)",
        "x if (y := 2) else x",
        "abs.__call__(x)",
        "type(x)",
        "Image",
        "Const",
        "kernel",
    ],
)
def test_nothing_of_python_can_be_reached(text: str) -> None:
    source = f"import passgraph\nimport passgraph as pg\ndef k(c: Image) -> float:\n    x = 1.0\n    return {text}\n"
    with pytest.raises(PassgraphError) as caught:
        kernel(source=source)
    assert "<kernel text>:5" in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "import os",
        "from os import system",
        "import passgraph.run.program",
        "from . import x",
        "raise SystemExit",
        "x = open('a')",
        "x = [1 for _ in range(9)]",
        "while True: pass",
        "if True:\n    pass",
        "def f(): pass\nf()",
        "x: int = 3",
        "x, y = 1, 2",
        "del dot",
        "class A(print('a')):\n    x: float",
        "class A:\n    x: float = open('a')",
        "class A:\n    def f(self): pass",
    ],
)
def test_text_holds_definitions_only(text: str) -> None:
    with pytest.raises(PassgraphError):
        kernel(source=f"{text}\n{body('return x')}")


def test_names_that_look_alike_are_what_python_takes_them_for() -> None:
    """Python folds full-width letters to plain ones; Cyrillic ones stay strangers."""
    lower(kernel(source=body("return ａｂｓ(x)")).program)
    with pytest.raises(PassgraphError, match="not defined"):
        kernel(source=body("return аbs(x)"))


def test_hostile_text_ran_nothing() -> None:
    assert not Path("/tmp/passgraph-was-here").exists()
