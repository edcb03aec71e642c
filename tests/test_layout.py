"""The shape of the repository: packages, types, and weight of the import.

`lint-imports` (pyproject.toml) holds the direction of imports.
"""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from functools import cache
from pathlib import Path

import networkx
import pytest
from packaging.requirements import Requirement

root = Path(__file__).resolve().parent.parent
package = root / "passgraph"

#: Most functions called while passgraph is imported, after NumPy; it was 2,359 on Python 3.11, 2,461 on 3.14.
CALLS_OF_IMPORT = 4_000


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


def test_skipped_tests_are_counted_by_what_they_need(tmp_path: Path) -> None:
    """At the end of a run, also one of several processes; doctests that are never run are none."""
    (tmp_path / "test_needs.py").write_text(
        "import pytest\n"
        "@pytest.mark.parametrize('n', range(3))\n"
        "def test_it(n): pytest.importorskip('no_such_package')\n"
        "def test_other():\n"
        '    """>>> 1 # doctest: +SKIP"""\n'
    )
    arguments = ["-p", "tests.conftest", "-n", "2", "--doctest-modules", str(tmp_path)]
    environment = {**os.environ, "PYTHONPATH": str(root)}
    command = [sys.executable, "-m", "pytest", "-c", os.devnull, "--rootdir", str(tmp_path), *arguments]
    printed = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path, check=False).stdout
    summary = printed.partition("= skipped =")[2]
    assert "   3 could not import 'no_such_package'" in summary, printed
    assert "+SKIP" not in summary


# Packages


BUILD = """
import sys
from setuptools import build_meta
print(getattr(build_meta, f"build_{sys.argv[1]}")(sys.argv[2]), file=sys.stderr)
"""


def built(kind: str, tree: Path, out: Path) -> Path:
    """A distribution of a tree, by the build backend that pyproject.toml names."""
    command = [sys.executable, "-W", "ignore", "-c", BUILD, kind, str(out)]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=True, timeout=120)
    return out / done.stderr.splitlines()[-1]


def test_distributions_hold_every_package_and_the_picture_of_the_readme(tmp_path: Path) -> None:
    """The wheel of a checkout is that of its source distribution, which has no symbolic links and no tests.

    And of a checkout by git on Windows, where links are files of text.
    """
    pytest.importorskip("setuptools", minversion="77")
    tree = tmp_path / "tree"
    for name in ("passgraph", "backends", "effects", "docs/images"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(root / name, tree / name, symlinks=True, ignore=ignored)
    for name in (
        "pyproject.toml",
        "setup.py",
        "MANIFEST.in",
        "README.md",
        "LICENSE",
        "CHANGELOG.md",
        "tests/test_layout.py",
    ):
        (tree / name).parent.mkdir(exist_ok=True)
        shutil.copy(root / name, tree / name)
    with tarfile.open(built("sdist", tree, tmp_path)) as archive:
        archive.extractall(tmp_path, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
        members = {member.name.partition("/")[2]: member for member in archive.getmembers()}
    assert set(re.findall(r"!\[.*?\]\((.*?)\)", (root / "README.md").read_text())) <= members.keys()
    assert not any(name.startswith("tests") or member.issym() for name, member in members.items())
    (unpacked,) = tmp_path.glob("passgraph-*/")
    without_links = tmp_path / "without links"
    shutil.copytree(tree, without_links, symlinks=True, ignore=shutil.ignore_patterns("build", "*.egg-info"))
    for name in ("backends", "effects"):
        (without_links / "passgraph" / name).unlink()
        (without_links / "passgraph" / name).write_text(f"../{name}")
    contents = []
    for number, source in enumerate((tree, unpacked, without_links)):
        (tmp_path / str(number)).mkdir()
        with zipfile.ZipFile(built("wheel", source, tmp_path / str(number))) as wheel:
            contents.append(sorted(name for name in wheel.namelist() if ".dist-info/" not in name))
    held = {path.relative_to(root).as_posix() for path in modules().values()}
    data = {"passgraph/py.typed", "passgraph/assets/teapot.json", "passgraph/language/functions.pyi",
            "passgraph/backends/numpy/raster/fixed/tiles.ll", "passgraph/backends/opencl/helpers.cl",
            "passgraph/viewer/page/page.js", "passgraph/web/page/page.js"}  # fmt: skip
    assert held | data <= set(contents[0])
    assert {name for name in contents[0] if name.endswith(".py")} == held
    assert contents[0] == contents[1] == contents[2]


def test_all_installs_every_option() -> None:
    """Every extra but those of developers, whatever they are called."""
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    named = [name for text in extras.pop("all") for name in Requirement(text).extras]
    assert sorted(named) == sorted(extras.keys() - {"dev", "docs"})


def test_wheels_were_asked_for_every_extra() -> None:
    """And those that all leaves out are the ones that have no wheel on Linux: python -m tests.wheels."""
    asked = json.loads((root / "docs" / "wheels.json").read_text())
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert asked["extras"] == sorted({"passgraph", *extras} - {"dev", "docs"})
    for python, gaps in asked["missing"]["Linux x86_64"].items():
        environment = {"python_version": python}
        named = [one for one in map(Requirement, extras["all"]) if not one.marker or one.marker.evaluate(environment)]
        assert gaps.keys() == extras.keys() - {"all", "dev", "docs"} - {name for one in named for name in one.extras}


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


# Circles of imports

#: Modules that still import each other when imports for types and inside of functions count. None may join, and those
#: that are mended go from the list.
CIRCLES = [
    "backends.gl: backend counts measured passes transfers",
    "backends.opencl: backend counts pixel raster transfers",
    "backends.webgpu: backend counts passes transfers",
    "glsl: function_calls glsl_body glsl_expressions glsl_statements loops places",
    "hosts: opencl opencl_borrowed",
    "language: assignments composites expressions function_body quad_derivatives statements",
    "language: lower lower_loops",
    "plan: data explain",
]


def imported(name: str) -> set[str]:
    """Modules that a module imports, at the top, inside functions, or for types."""
    found = set[str]()
    for node in ast.walk(ast.parse(modules()[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            inner = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= inner & modules().keys() or {str(node.module)}
    return found & modules().keys() - {name}


def test_no_new_modules_import_each_other() -> None:
    graph = networkx.DiGraph((name, other) for name in modules() for other in imported(name))
    circles = [sorted(names) for names in networkx.strongly_connected_components(graph) if len(names) > 1]
    allowed = {frozenset(f"passgraph.{folder}.{name}" for name in names.split())
               for folder, names in (line.split(": ") for line in CIRCLES)}  # fmt: skip
    assert {frozenset(names) for names in circles} == allowed


# Weight of the import


def test_import_is_light() -> None:
    """By what it runs: functions called, those of importing itself and of C too.  NumPy's own depend on its version."""
    code = "import cProfile, numpy; p = cProfile.Profile(); p.enable(); import passgraph; p.disable()"
    code += "; print(sum(entry.callcount for entry in p.getstats()))"
    assert int(run_python(code)) <= CALLS_OF_IMPORT


def test_import_loads_no_driver_and_no_compiler() -> None:
    heavy = {
        "numba", "llvmlite", "trimesh", "scipy", "moderngl", "OpenGL", "pyopencl", "PIL", "OpenEXR", "av", "rich",
        "passgraph.files", "passgraph.tiles", "passgraph.effects", "passgraph.glsl",
    }  # fmt: skip
    loaded = run_python("import passgraph, sys; print(*sys.modules)").split()
    assert heavy & set(loaded) == set()


@pytest.mark.parametrize(
    "module", ["arguments", "effects", "files.run", "graph.targets", "language.ir", "plan.data", "run.program", "scene"]
)
def test_a_module_can_be_the_first_that_is_imported(module: str) -> None:
    """Names of the package are imported at their first use, which must not need the module that asks for one."""
    subprocess.run([sys.executable, "-c", f"import passgraph.{module}"], check=True, timeout=60)
