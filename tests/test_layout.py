"""The shape of the repository: packages, types, weight of the import, and imports that go one way."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import networkx as nx
import pytest

root = Path(__file__).resolve().parent.parent
package = root / "passgraph"

#: Functions called while passgraph is imported, NumPy within it, against NumPy alone; it was 1.385.
IMPORT_OF_NUMPY = 1.4


@cache
def modules() -> dict[str, Path]:
    """Every module by its installed name, found through the symbolic links."""
    found: dict[str, Path] = {}
    for folder, folders, files in os.walk(package, followlinks=True):
        folders[:] = [name for name in folders if name != "__pycache__"]
        for file in files:
            if file.endswith(".py"):
                path = Path(folder, file)
                parts = path.relative_to(root).with_suffix("").parts
                found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def packages() -> set[str]:
    return {name for name, path in modules().items() if path.name == "__init__.py"}


def run_python(code: str) -> str:
    """What a new interpreter prints; the checkout comes first, so that this passgraph is the one tested."""
    environment = {**os.environ, "PYTHONPATH": str(root)}
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_the_steps_before_the_tests_passed() -> None:
    """tests/run.sh names what failed in it; without it there is nothing to repeat."""
    assert os.environ.get("PASSGRAPH_FAILED_STEPS", "") == ""


# Packages


def test_pyproject_lists_the_packages_that_exist() -> None:
    listed = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    assert sorted(listed) == sorted(packages())


def test_all_installs_every_option() -> None:
    """Every extra but those of developers, whatever they are called."""
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    [one] = extras.pop("all")
    named = one.removeprefix("passgraph[").removesuffix("]").split(",")
    assert sorted(named) == sorted(extras.keys() - {"dev", "docs"})


def test_every_module_is_in_a_package() -> None:
    homeless = {name for name in modules() if name != "passgraph" and name.rpartition(".")[0] not in packages()}
    assert homeless == set(), "folders without __init__.py are left out of the wheel"


@pytest.mark.parametrize("name", ["backends", "effects"])
def test_links_lead_to_the_top_level(name: str) -> None:
    assert (package / name).is_symlink()
    assert os.readlink(package / name) == f"../{name}"


def test_bare_names_stay_free() -> None:
    code = "import sys, passgraph.backends, passgraph.effects; print({'backends', 'effects'} & set(sys.modules))"
    assert run_python(code) == "set()\n"


def test_entry_points_name_classes_that_exist() -> None:
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    targets = [*project["scripts"].values(), *project["entry-points"]["passgraph.backends"].values()]
    for target in targets:
        module, name = target.split(":")
        source = ast.parse(modules()[module].read_text())
        bound = {node.name for node in source.body if isinstance(node, ast.ClassDef | ast.FunctionDef)}
        bound |= {
            alias.asname or alias.name
            for node in source.body
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        assert name in bound, target


def test_mypy_sees_every_module(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the folder mapping alone mypy would miss what lies behind the links, and pass."""
    from mypy.main import process_options

    monkeypatch.chdir(root)
    sources, _ = process_options(["--config-file", "pyproject.toml"])
    assert set(modules()) - {source.module for source in sources} == set()


# Weight of the import


def test_import_is_light() -> None:
    """By what it runs: functions called, those of importing itself and of C too, beside NumPy's own import."""
    code = "import cProfile; p = cProfile.Profile(); p.enable(); import {}; p.disable()"
    code += "; print(sum(entry.callcount for entry in p.getstats()))"
    numpy, whole = (int(run_python(code.format(name))) for name in ("numpy", "passgraph"))
    assert whole <= IMPORT_OF_NUMPY * numpy


def test_import_loads_no_driver_and_no_compiler() -> None:
    heavy = {
        "numba", "llvmlite", "trimesh", "scipy", "moderngl", "OpenGL", "pyopencl", "PIL", "OpenEXR", "av", "rich",
        "passgraph.frames",
    }  # fmt: skip
    loaded = run_python("import passgraph, sys; print(*sys.modules)").split()
    assert heavy & set(loaded) == set()


# Direction of imports


def imported(tree: ast.Module, *, inside_functions: bool) -> Iterator[str]:
    """What a module imports when it runs: modules, and `module.name` for `from module import name`."""
    pending: list[ast.AST] = list(tree.body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            pending += node.orelse
        elif inside_functions or not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            pending += ast.iter_child_nodes(node)


@cache
def import_graph(*, inside_functions: bool) -> nx.DiGraph:
    """An edge from each module to those of passgraph that it imports."""
    known = modules()
    graph = nx.DiGraph()
    graph.add_nodes_from(known)
    for name, path in known.items():
        for target in imported(ast.parse(path.read_text()), inside_functions=inside_functions):
            module = target if target in known else target.rpartition(".")[0]
            if module in known and module != name:
                graph.add_edge(name, module)
    return graph


def is_in(module: str, part: str) -> bool:
    return f"{module}.".startswith(f"passgraph.{part}.")


#: In the order in which data go through them.
STOREYS = [
    "language", "shaders.glsl", "graph", "scene", "plan", "travel", "backends", "run", "frames", "effects", "engines",
    "verify", "commands",
]  # fmt: skip


@pytest.mark.parametrize(
    ("part", "later"),
    [
        ("errors", ["pictures", *STOREYS]),
        ("pictures", STOREYS),
        ("language", STOREYS[1:]),
        ("shaders.glsl", STOREYS[2:]),
        ("graph", STOREYS[3:]),
        ("scene", STOREYS[4:]),
        ("plan", ["travel", "run", "frames", "backends", "effects", "verify", "commands"]),
        ("travel", ["run", "frames", "backends", "effects", "verify", "commands"]),
        ("backends", ["travel", "run", "frames", "effects", "engines", "verify", "commands"]),
        ("run", ["frames", "effects", "engines", "verify", "commands"]),
        ("frames", ["effects", "verify", "commands"]),
        ("backends.numpy.machine", ["backends.numpy.vector", "backends.numpy.pixels", "backends.numpy.raster"]),
        ("backends.numpy.vector", ["backends.numpy.pixels", "backends.numpy.raster"]),
        ("backends.numpy.pixels", ["backends.numpy.raster"]),
        ("backends.numpy.raster", ["backends.numpy.pixels"]),
        ("effects", ["frames", "engines", "verify", "commands"]),
        ("engines", ["frames", "verify", "commands"]),
        ("verify", ["commands"]),
    ],
)
def test_imports_go_one_way(part: str, later: list[str]) -> None:
    """Imports inside functions count too: what a part needs must come before it."""
    backwards = [
        f"{source} imports {target}"
        for source, target in import_graph(inside_functions=True).edges
        if is_in(source, part) and any(is_in(target, name) for name in later)
    ]
    assert backwards == []


def test_no_modules_import_each_other_in_a_circle() -> None:
    """Not inside functions either; only names in annotations may come from a module that comes later."""
    circles = [sorted(part) for part in nx.strongly_connected_components(import_graph(inside_functions=True))]
    assert [circle for circle in circles if len(circle) > 1] == []
