"""Errors: every text is provoked, says the right words, and points at the right place."""

from __future__ import annotations

import ast
import code
import linecache
import sys
import textwrap
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from runpy import run_path
from typing import Any

import pytest
from error_calls import CALLS
from error_cases import BODIES, HEAD, HELPER, STAGES, STRUCT, TEXTS

import passgraph.language.source as source_module
from passgraph.errors import KernelError, PassgraphError
from passgraph.graph.calls import kernel
from passgraph.language.lower import lower

PACKAGE = Path(source_module.__file__).parent.parent
OTHERS = ("graph/calls", "graph/drawing", "graph/targets", "graph/draw_state", "formats")
MODULES = [*sorted((PACKAGE / "language").glob("*.py")), *(PACKAGE / f"{name}.py" for name in OTHERS)]
#: Broken promises between our own modules, not errors of users.
INTERNAL = {"types.py", "library.py", "operations.py", "prelude.py"}

EXTRA = f"""{STRUCT}{HELPER}
def g(i: Image) -> vec4: return i[0, 0]
def h(s: S) -> float: return s.a
V = vec3(1, 2, 3)
"""


def raised(action: Callable[[], Any]) -> PassgraphError:
    with pytest.raises(PassgraphError) as caught:
        action()
    return caught.value


def compile_text(stage: Callable[..., Any], text: str) -> Any:
    return lower(stage(source=text, name="k").program)


def texts() -> Iterator[tuple[Callable[..., Any], str, str]]:
    """Every kernel text of the tables with its marks, and the words of its message."""
    for body, words in BODIES:
        yield kernel, EXTRA + HEAD + body, words
    for text, words in TEXTS:
        yield kernel, text, words
    yield from STAGES


@dataclass(frozen=True)
class Told:
    """An error's text, and the file and line of ours that raised it."""

    message: str
    site: tuple[str, int]

    @classmethod
    def of(cls, action: Callable[[], Any]) -> Told:
        error = raised(action)
        return cls(str(error), site_of(error))


@cache
def of_text(stage: Callable[..., Any], marked: str) -> Told:
    """Of a text of the tables; two tests ask for each."""
    return Told.of(lambda: compile_text(stage, unmarked(marked)[0]))


@cache
def of_call(action: Callable[[], Any]) -> Told:
    return Told.of(action)


def unmarked(marked: str) -> tuple[str, int, int, int]:
    """The text, and the line (from 1), column and end that «…» marked."""
    before = marked[: marked.index("«")]
    inside = marked[marked.index("«") + 1 : marked.index("»")]
    line, column = before.count("\n") + 1, len(before) - (before.rfind("\n") + 1)
    first = inside.split("\n")[0]
    return marked.replace("«", "").replace("»", ""), line, column, column + max(1, len(first))


@pytest.mark.parametrize(("stage", "marked", "words"), [pytest.param(*t, id=t[2][:40]) for t in texts()])
def test_text_errors_say_what_and_point_where(stage: Callable[..., Any], marked: str, words: str) -> None:
    text, line, column, end = unmarked(marked)
    message = of_text(stage, marked).message
    first, shown, caret = message.split("\n")
    assert any(part in first for part in words.split("|"))
    assert first.startswith(f"<kernel text>:{line}: ")
    source = text.split("\n")[line - 1].rstrip()
    if len(source) <= 160:
        assert shown == "    " + source
        assert caret.index("^") - 4 == column
        whole_line = text.split("\n")[line - 1][column:].strip().startswith(("def ", "class ", "while "))
        assert whole_line or len(caret) - 4 == end
    else:  # a long line is shown around the caret
        assert len(shown) < 200
        at = caret.index("^")
        assert shown[at : at + 3] == source[column : column + 3]


@pytest.mark.parametrize(("action", "words"), [pytest.param(*c, id=c[1][:40]) for c in CALLS])
def test_other_errors_say_what_and_how_to_mend_it(action: Callable[[], Any], words: str) -> None:
    message = of_call(action).message
    assert any(part in message for part in words.split("|"))


def sites() -> set[tuple[str, int]]:
    """File and line of every place that raises an error on purpose."""
    found = set()
    for path in MODULES:
        if path.name in INTERNAL:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            is_fail = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "fail"
            is_raise = (
                isinstance(node, ast.Raise)
                and isinstance(node.exc, ast.Call)
                and isinstance(node.exc.func, ast.Name)
                and node.exc.func.id.endswith("Error")
                and node.exc.func.id not in ("KeyError", "TypeError")
            )
            if is_fail or is_raise:
                found.add((path.name, node.lineno))
    return found


def site_of(error: PassgraphError) -> tuple[str, int]:
    frames = []
    traceback = error.__traceback__
    while traceback is not None:
        frames.append(
            (Path(traceback.tb_frame.f_code.co_filename).name, traceback.tb_lineno, traceback.tb_frame.f_code.co_name)
        )
        traceback = traceback.tb_next
    file, line, name = frames[-1]
    if name == "fail" and file == "source.py":
        file, line, _ = frames[-2]
    return file, line


def test_every_error_is_provoked_by_a_case() -> None:
    """A new error without a case fails here."""
    hit = {of_text(stage, marked).site for stage, marked, _ in texts()}
    hit |= {of_call(action).site for action, _ in CALLS}
    # These have tests of their own, below, in tests/test_pickling.py and tests/test_editor_types.py.
    alone = {
        "has no attribute",
        "captured",
        "is no longer available",
        "is a plain dataclass",
        "cannot be found",
        "program.source.point_at",
    }
    alone |= {"pickle", "this is a fault of passgraph"}
    # A fail() of its own is what all others go through.
    left = []
    for file, line in sorted(sites() - hit):
        path = next(p for p in MODULES if p.name == file)
        text = "".join(path.read_text(encoding="utf-8").splitlines(keepends=True)[line - 2 : line + 5])
        if not any(words in text for words in alone) and "def fail" not in text:
            left.append(f"{file}:{line} {text.split(chr(10))[1].strip()}")
    assert not left


# Kernels as Python functions


IMPORTS = """from __future__ import annotations
from passgraph.graph.calls import kernel
from passgraph.language.functions import *
from passgraph.language.kernel import function, struct
from passgraph.language.primitives import *
from passgraph.language.symbols import *
from passgraph.language.vectors import *
"""


def module_from(tmp_path: Path, text: str, name: str = "made") -> types.ModuleType:
    """A module written to a file and imported."""
    path = tmp_path / f"{name}.py"
    path.write_text(IMPORTS + textwrap.dedent(text), encoding="utf-8")
    module = types.ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    linecache.checkcache(str(path))
    try:
        exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), vars(module))
    finally:
        del sys.modules[name]
    return module


def test_decorated_kernels_show_their_file_and_line(tmp_path: Path) -> None:
    with pytest.raises(KernelError) as caught:
        module_from(
            tmp_path,
            """
            if True:
                @kernel
                def bad(c: Image) -> vec4:
            # a comment at the left
                    return c[0, 0] + "red"
            """,
        )
    message = str(caught.value)
    path = tmp_path / "made.py"
    line = path.read_text().splitlines().index('        return c[0, 0] + "red"') + 1
    assert message.startswith(f"{path}:{line}: the kernel language has numbers and bools, not str")
    assert message.split("\n")[2].index("^") - 4 == message.split("\n")[1].index('"red"') - 4


def test_closures_and_modules_are_captured_by_value(tmp_path: Path) -> None:
    made = module_from(
        tmp_path,
        """
        import math
        GAIN = 2.0

        @function
        def louder(v: vec4) -> vec4:
            return v * GAIN

        def effect(strength, weights):
            @kernel
            def scaled(c: Image) -> vec4:
                return louder(c[0, 0]) * strength * weights[1] * math.tau
            return scaled

        one, two = effect(0.5, (1.0, 2.0)), effect(0.25, (1.0, 2.0))
        """,
    )
    assert lower(made.one.program).key != lower(made.two.program).key
    made.one.check_constants()
    made.GAIN = 3.0  # captured by the function that the kernel calls
    for scaled in (made.one, made.two):
        with pytest.raises(KernelError, match="captured GAIN by value, and it changed since; make it a parameter"):
            scaled.check_constants()


def test_what_cannot_be_captured_is_named(tmp_path: Path) -> None:
    for value, words in {
        "lambda: 1": "X is a Python function; mark it with @pg.function",
        "'text'": "X is a str, which kernels cannot use",
        "dict": "X is the class dict",
        "__import__('dataclasses').make_dataclass('D', ['a'])": "X is a plain dataclass; mark it with @pg.struct",
    }.items():
        with pytest.raises(KernelError) as caught:
            module_from(tmp_path, f"X = {value}\n@kernel\ndef k(c: Image) -> float: return X\n")
        assert words in str(caught.value)


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("return c.sample(uv())", "it: from passgraph.language import uv"),
        (
            "return mix(c[0, 0], vec4(uv().x + max(1.0, pi)), 0.5) + length(nonsense)",
            "them: from passgraph.language import length, mix, uv",
        ),
    ],
)
def test_names_to_import_are_told_at_once(tmp_path: Path, body: str, told: str) -> None:
    """Not what Python has itself, what is there, attributes, or names that are not the language's."""
    text = f"from passgraph import Image, kernel, vec4\n@kernel\ndef k(c: Image) -> vec4:\n    x = uv()\n    {body}\n"
    (tmp_path / "lean.py").write_text(text)
    with pytest.raises(KernelError) as caught:
        run_path(str(tmp_path / "lean.py"))
    assert f"'uv' is not defined here; import {told}\n" in str(caught.value)


@pytest.mark.parametrize("value", ["float('nan')", "-0.0", "True", "[1.0, float('nan')]"])
def test_constants_that_stay_are_not_taken_for_changed(tmp_path: Path, value: str) -> None:
    index = "[1]" if "[" in value else ""
    made = module_from(tmp_path, f"X = {value}\n@kernel\ndef k(c: Image) -> float: return float(X{index})\n")
    made.k.check_constants()
    made.X = 0.0 if value == "-0.0" else 1
    with pytest.raises(KernelError, match="captured X by value"):
        made.k.check_constants()


def test_a_default_is_taken_once_as_python_takes_it(tmp_path: Path) -> None:
    made = module_from(tmp_path, "X = 2.0\n@kernel\ndef k(c: Image, gain: float = X) -> float: return gain\n")
    made.X = 3.0
    made.k.check_constants()
    assert made.k.parameters[1].default == 2.0


def test_a_file_that_changed_after_import_is_noticed(tmp_path: Path) -> None:
    made = module_from(tmp_path, "\n\ndef k(c: Image) -> float:\n    return 1.0\n")
    path = tmp_path / "made.py"
    path.write_text("# nothing\n" * 8 + "def other() -> float:\n    return 1.0\n")
    with pytest.raises(KernelError, match=r"is no longer available|cannot be found"):
        kernel(made.k)


def test_the_plain_prompt_keeps_no_source_and_the_error_says_what_to_do() -> None:
    shell = code.InteractiveInterpreter()
    shell.runsource("from passgraph.graph.calls import kernel; from passgraph.language.symbols import *", "<stdin>")
    shell.runsource("def k(c: Image) -> float: return 1.0\n", "<stdin>", "single")
    with pytest.raises(KernelError, match=r"the source of k cannot be found.*pg\.kernel\(source=\.\.\.\)"):
        kernel(shell.locals["k"])  # type: ignore[call-overload]


CELL = """from __future__ import annotations
from passgraph.graph.calls import kernel
from passgraph.language.kernel import struct
from passgraph.language.symbols import Image, vec3, vec4

@struct
class Sun:
    color: vec3
    strength: float = 1.0

@kernel
def lit(c: Image, sun: Sun) -> vec4:
    return vec4(c[0, 0].rgb * sun.color * sun.strength, {alpha})
"""


@pytest.mark.parametrize("name", ["<ipython-input-7-1f2e3d>", "<python-input-3>"])
def test_notebook_cells_and_newer_prompts_work_through_linecache(name: str) -> None:
    """IPython and the prompt of Python 3.13 register their text there; classes are found there too."""
    for alpha in ("1.0", "'one'"):
        text = CELL.format(alpha=alpha)
        linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
        space = {"__name__": "__main__"}
        if alpha == "1.0":
            exec(compile(text, name, "exec"), space)
            lower(space["lit"].program)  # type: ignore[attr-defined]
        else:
            with pytest.raises(KernelError, match=f"{name}:13: the kernel language has numbers and bools, not str"):
                exec(compile(text, name, "exec"), space)
    del linecache.cache[name]


# Carets


@pytest.mark.parametrize(("line", "under"), [
    ("    größe = x + «y»", "y"),
    ("    x = x + «y»  # é", "y"),
    ("    \tx = x + «y»", "y"),
    ("    日本 = «y»", "y"),
])  # fmt: skip
def test_carets_stand_under_the_name_whatever_letters_come_before(line: str, under: str) -> None:
    lead = "    if x > 0.0:\n" if "\t" in line else ""
    text = f"def k(c: Image) -> float:\n    x = c[0, 0].x\n{lead}{line}\n    return x"
    message = str(raised(lambda: kernel(source=text.replace("«", "").replace("»", ""))))
    _, shown, caret = message.split("\n")
    before = shown[: shown.index(f" {under}") + 1]
    width = sum(2 if letter in "日本" else 1 for letter in before)
    assert caret.index("^") == width
    assert [c for c in caret if c == "\t"] == [c for c in before if c == "\t"]


def test_running_out_of_stack_is_a_kernel_error() -> None:
    text = "def k(c: Image) -> float: return " + "abs(" * 80 + "c[0, 0].x" + ")" * 80
    program = kernel(source=text).program
    depth = 0
    frame = sys._getframe()
    while frame is not None:
        depth, frame = depth + 1, frame.f_back  # type: ignore[assignment]
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(depth + 90)
    try:
        with pytest.raises(KernelError, match="nests too deeply"):
            lower(program)
    finally:
        sys.setrecursionlimit(limit)
