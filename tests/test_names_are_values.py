"""Names of builtins, images and parameters are values: no module between the parser and the drivers takes text apart.

Each place that splits text at a separator of such names is listed here with what it splits.
"""

from __future__ import annotations

import ast
from pathlib import Path

import passgraph
import passgraph.backends

SPLITTING = {"split", "rsplit", "partition", "rpartition", "removeprefix", "removesuffix", "startswith", "endswith"}
#: Separators of spelled names, and the kinds of builtins before one.
SEPARATORS = ("/", ".", "@")
KINDS = ("pixel.", "output_size.", "size.", "pitch.", "vertex.", "varying.", "source.", "destination.")
ALLOWED = {
    "language/signature.py": "names of Python",
    "language/scope.py": "names of Python",
    "serialize/kernel_text.py": "names of Python",
    "backends/numpy/vector/lanes.py": "names of LLVM's intrinsics",
}


def _splits(node: ast.AST) -> bool:
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in SPLITTING):
        return False
    parts = [one for part in node.args for one in ast.walk(part)]
    if any(isinstance(one, ast.Name) and one.id == "MIPS" for one in parts):
        return True
    texts = [one.value for one in parts if isinstance(one, ast.Constant)]
    return any(isinstance(text, str) and (text in SEPARATORS or text.startswith(KINDS)) for text in texts)


def test_no_name_is_taken_apart_as_text() -> None:
    product, drivers = Path(passgraph.__file__).parent, Path(passgraph.backends.__file__).parent
    folders = [product / name for name in ("graph", "language", "plan", "run", "web", "verify", "serialize")]
    found = set()
    for folder in (*folders, drivers):
        root = drivers.parent if folder == drivers else product
        for file in folder.rglob("*.py"):
            if any(map(_splits, ast.walk(ast.parse(file.read_text("utf-8"))))):
                found.add(file.relative_to(root).as_posix())
    assert found == set(ALLOWED)


def test_a_split_name_is_seen() -> None:
    for text in (
        'name.partition(".")',
        'name.startswith(f"size.{image}")',
        'a.startswith(("size.", "x"))',
        'a.split("/", 1)',
        "name.endswith(MIPS)",
    ):
        assert any(map(_splits, ast.walk(ast.parse(text)))), text
    for text in ('name.kind == "size"', '", ".join(names)', 'name.startswith("pg_")', "text.split()"):
        assert not any(map(_splits, ast.walk(ast.parse(text)))), text
