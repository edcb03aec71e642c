"""Plant random mistakes in the sources of a package, and report those that none of its tests catches.

``python -m tests.mutation.sample PACKAGE … [--conform BACKEND] [--count N] [--seed N] [--workers N]`` from the root of
the repository.  Exit status: 0 where every mistake is caught, 1 where some survive.  A survivor is a hole in the tests,
dead code, or a change without a visible effect: look at each.

With ``--conform`` the conformance suite judges, on a backend; a package is any folder of the sources, and shader text
in it is mistaken too.  Else pytest judges, and a package is a key of `TESTS`.  A case of conformance that catches a
mistake which no case in ``tests/conformance/catching.txt`` does belongs there: those run every time.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

from tests.mutation.mutant import Tree
from tests.mutation.places import ROOT, sources

#: Tests of each package, files or folders.
TESTS = {
    "backends/reference": ("tests/backends/test_reference.py", "tests/conformance/test_first_cases.py"),
    "effects/ambient": ("tests/effects/test_ambient_occlusion.py", "tests/effects/test_contact.py",
                        "tests/effects/test_contact_field.py"),
    "effects/antialias": ("tests/effects",),
    "effects/color": ("tests/effects",),
    "effects/filters": ("tests/effects",),
    "effects/lens": ("tests/effects",),
    "effects/light2d": ("tests/effects",),
    "effects/pictures": ("tests/effects",),
    "effects/planar_shadows": ("tests/effects",),
    "effects/screen": ("tests/effects",),
    "effects/shadows": ("tests/effects",),
    "effects/style": ("tests/effects",),
    "effects/surfaces": ("tests/effects",),
    "effects/temporal": ("tests/effects",),
    "passgraph/bench": ("tests/bench", "tests/commands/test_bench.py"),
    "passgraph/commands": ("tests/commands", "tests/files/test_apply.py"),
    "passgraph/engines": ("tests/engines",),
    "passgraph/files": ("tests/files", "tests/test_room.py"),
    "passgraph/glsl": ("tests/shaders",),
    "passgraph/graph": ("tests/plan", "tests/language", "tests/test_wrong_uses.py"),
    "passgraph/hosts": ("tests/host", "tests/engines", "tests/backends/test_opencl_host.py"),
    "passgraph/language": ("tests/language",),
    "passgraph/plan": ("tests/plan", "tests/backends/test_numpy_chains.py", "tests/test_execution.py",
                       "tests/cross/test_sampling.py", "tests/effects/test_mip_maps.py"),
    "passgraph/run": ("tests/test_execution.py", "tests/test_history.py", "tests/test_finite_inputs.py",
                      "tests/test_arrays_in_place.py", "tests/test_host_values.py", "tests/test_profile.py",
                      "tests/test_inspection.py", "tests/test_inspection_of_draws.py", "tests/test_lines.py",
                      "tests/test_long_arrays.py", "tests/engines/test_attachment.py"),
    "passgraph/scene": ("tests/test_camera.py", "tests/test_light.py", "tests/test_creases.py",
                        "tests/test_framing.py", "tests/test_ground.py", "tests/test_projection.py",
                        "tests/test_scene_gltf.py", "tests/test_scene_load.py", "tests/test_scene_mesh.py",
                        "tests/test_scene_sides.py", "tests/test_mesh_kept.py"),
    "passgraph/serialize": ("tests/serialize",),
    "passgraph/shaders": ("tests/shaders",),
    "passgraph/tiles": ("tests/files",),
    "passgraph/truth": ("tests/test_truth.py", "tests/bench", "tests/effects/test_own_planes.py"),
    "passgraph/verify": ("tests/oracle", "tests/test_compare.py", "tests/conformance", "tests/fuzz"),
    "passgraph/viewer": ("tests/viewer",),
    "passgraph/web": ("tests/web",),
}  # fmt: skip
#: Sources whose results are cached on disk, as code or as bounds: a mistake in them begins without a cache.
CACHED = ("backends/", "passgraph/graph", "passgraph/language", "passgraph/plan", "passgraph/run", "passgraph/verify")
#: A run that takes longer hangs, which counts as caught.
TIMEOUT_S = 900
_COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Add, ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv,
    ast.LShift: ast.RShift, ast.RShift: ast.LShift, ast.BitAnd: ast.BitOr,
}  # fmt: skip
#: Signs of shader text, and what they are mistaken for.
_SIGNS = {"<=": "<", ">=": ">", "<": "<=", ">": ">=", "==": "!=", "!=": "==", "+": "-", "-": "+", "*": "+", "&&": "||",
          "||": "&&", "min": "max", "max": "min", "floor": "ceil", "x": "y", "true": "false"}  # fmt: skip
#: The signs between spaces or brackets; longer ones first, so that ``<=`` is not taken for ``<``.
_SIGN = re.compile("(?<= )(?:<=|>=|==|!=|&&|[|]{2}|[-+*<>])(?= )|\\b(?:min|max|floor|x|true)\\b|\\b[0-9]+\\b")
#: Text with this is a shader's.
_STATEMENT = re.compile(r"[;{]\s*$", re.MULTILINE)


@dataclass(frozen=True)
class Mistake:
    """Bytes ``start`` to ``end`` of a file become ``new``."""

    file: str
    line: int
    start: int
    end: int
    new: str

    def planted(self) -> bytes:
        """Return the file's text with the mistake in it."""
        text = sources()[self.file].encode()
        return text[: self.start] + self.new.encode() + text[self.end :]

    def __str__(self) -> str:
        old = " ".join(sources()[self.file].encode()[self.start : self.end].decode().split())
        return f"{self.file}:{self.line}: {old} -> {self.new}"


def changed(node: ast.AST) -> ast.expr | None:
    """Return the expression with one thing wrong, or None where nothing is to be mistaken in it itself."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        return ast.Compare(node.left, [_COMPARISONS[type(node.ops[0])]()], node.comparators)
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        return ast.BinOp(node.left, _OPERATORS[type(node.op)](), node.right)
    if isinstance(node, ast.BoolOp):
        return ast.BoolOp(ast.And() if isinstance(node.op, ast.Or) else ast.Or(), node.values)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return node.operand
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        return ast.Constant(not node.value)
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return ast.Constant(node.value + 1 if node.value + 1 != node.value else node.value / 2)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("min", "max"):
        return ast.Call(ast.Name("max" if node.func.id == "min" else "min"), node.args, node.keywords)
    if isinstance(node, ast.IfExp):
        return ast.IfExp(node.test, node.orelse, node.body)
    return None


def expressions(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what is computed: no annotations, error messages or f-strings, whose parts have no place of their own."""
    skipped = (ast.Raise, ast.JoinedStr, ast.Assert)
    for name, field in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list"):
            continue
        for child in field if isinstance(field, list) else [field]:
            is_docstring = isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant)
            if isinstance(child, ast.AST) and not isinstance(child, skipped) and not is_docstring:
                yield child
                yield from expressions(child)


def of_shader(file: str, text: str, offset: int = 0, line: int = 1) -> Iterator[Mistake]:
    """Yield what can be mistaken in shader text that begins at a byte of a file, comments apart."""
    for sign in _SIGN.finditer(text):
        before = text[: sign.start()]
        if "//" not in before[before.rfind("\n") + 1 :]:
            start = offset + len(before.encode())
            new = str(int(sign[0]) + 1) if sign[0].isdigit() else _SIGNS[sign[0]]
            yield Mistake(file, line + before.count("\n"), start, start + len(sign[0]), new)


def mistakes(package: str, shaders: bool = False) -> list[Mistake]:
    """Return all that can be planted in a package, in the order of its sources."""
    found = []
    for file, text in sources().items():
        if not file.startswith(package + "/"):
            continue
        if not file.endswith(".py"):
            found += of_shader(file, text) if shaders else ()
            continue
        starts = [0]
        for line in text.encode().split(b"\n"):
            starts.append(starts[-1] + len(line) + 1)
        for node in expressions(ast.parse(text)):
            wrong = changed(node)
            if shaders and isinstance(node, ast.Constant) and isinstance(node.value, str):
                start = starts[node.lineno - 1] + node.col_offset
                end = starts[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)
                written = text.encode()[start:end].decode()
                found += of_shader(file, written, start, node.lineno) if _STATEMENT.search(written) else ()
            if wrong is not None and isinstance(node, ast.expr):
                start = starts[node.lineno - 1] + node.col_offset
                end = starts[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)
                new = f"({ast.unparse(ast.fix_missing_locations(wrong))})"
                found.append(Mistake(file, node.lineno, start, end, new))
    return found


def copied(folder: Path) -> Path:
    """Return a copy of the checkout, for one mistake at a time, with what stands beside it."""
    tree = folder / "tree"
    ignored = shutil.ignore_patterns(".git", ".venv*", "__pycache__", "site", "*-pytest-*")
    shutil.copytree(ROOT, tree, symlinks=True, ignore=ignored)
    (folder / "shared").symlink_to(ROOT.parent / "shared")
    return tree


def ordered(mistake: Mistake, tests: tuple[str, ...]) -> list[str]:
    """Return the files of tests, those first that name the module with the mistake."""
    named = re.compile(rf"\b{Path(mistake.file).stem}\b")
    files = [
        path for test in tests
        for path in ([ROOT / test] if test.endswith(".py") else sorted((ROOT / test).rglob("test_*.py")))
    ]  # fmt: skip
    files.sort(key=lambda path: named.search(path.read_text(encoding="utf-8")) is None)
    return [path.relative_to(ROOT).as_posix() for path in files]


def caught_by(mistake: Mistake, tree: Path, tests: tuple[str, ...]) -> str:
    """Return the first test that fails with a mistake, or an empty text where all pass."""
    path = tree / mistake.file
    kept = path.read_bytes()
    path.write_bytes(mistake.planted())
    environment = os.environ | {
        "PYTHONPATH": str(tree), "PASSGRAPH_CACHE": str(tree.parent / "cache"), "PYTHONDONTWRITEBYTECODE": "1",
        "GALLIVM_PERF": "nopt", "POCL_EXTRA_BUILD_FLAGS": "-cl-opt-disable", "PASSGRAPH_EXPECT": "",
    }  # fmt: skip
    if mistake.file.startswith(CACHED):
        shutil.rmtree(tree.parent / "cache", ignore_errors=True)
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "-p",
        "no:cacheprovider",
        "-m",
        "not slow",
        *ordered(mistake, tests),
    ]
    try:
        ended = subprocess.run(
            command, capture_output=True, text=True, env=environment, cwd=tree, timeout=TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return "the limit of time"
    finally:
        path.write_bytes(kept)
    if ended.returncode == 0:
        return ""
    failed = [line for line in ended.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return failed[0].split(" - ")[0] if failed else ended.stdout.strip()[-200:] or ended.stderr.strip()[-200:]


def tested(mistakes_: list[Mistake], tests: tuple[str, ...], folder: Path, workers: int) -> Iterator[str]:
    """Yield the test that catches each mistake, or an empty text where all pass."""
    trees: SimpleQueue[Path] = SimpleQueue()
    for number in range(workers):
        (folder / str(number)).mkdir(parents=True)
        trees.put(copied(folder / str(number)))

    def fate(mistake: Mistake) -> str:
        tree = trees.get()
        try:
            return caught_by(mistake, tree, tests)
        finally:
            trees.put(tree)

    with ThreadPoolExecutor(workers) as pool:
        yield from pool.map(fate, mistakes_)


def conforming(mistakes_: list[Mistake], backend: str, folder: Path, workers: int) -> Iterator[str]:
    """Yield the case of conformance that catches each mistake, or an empty text where all pass."""
    trees: SimpleQueue[Tree] = SimpleQueue()
    for number in range(workers):
        trees.put(Tree(folder / str(number), folder / "bounds"))
    tree = trees.get()
    accepted = tree.passing(backend, (), everything=True)
    trees.put(tree)

    def fate(mistake: Mistake) -> str:
        tree = trees.get()
        try:
            found = tree.judge_text(mistake.file, mistake.planted().decode(), backend, (), accepted, everything=True)
            return f"{found.outcome} {found.case}".strip()
        finally:
            trees.put(tree)

    with ThreadPoolExecutor(workers) as pool:
        yield from pool.map(fate, mistakes_)


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("packages", nargs="+", metavar="PACKAGE")
    parser.add_argument("--conform", metavar="BACKEND", help="judge by the conformance suite on this backend")
    parser.add_argument("--count", type=int, default=10, help="mistakes in each package")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(words)
    packages = list(TESTS) if options.packages == ["all"] else options.packages
    unknown = [name for name in packages if name not in TESTS and not options.conform]
    if unknown or not all(mistakes(name) for name in packages):
        parser.error(f"a package is one of {', '.join(TESTS)}; with --conform any folder of the sources")
    survived = 0
    with tempfile.TemporaryDirectory(prefix="passgraph-mutants-") as folder:
        for package in packages:
            possible = mistakes(package, shaders=bool(options.conform))
            chosen = random.Random(options.seed).sample(possible, min(options.count, len(possible)))
            if options.conform:
                fates = conforming(chosen, options.conform, Path(folder) / package.replace("/", "-"), options.workers)
            else:
                fates = tested(chosen, TESTS[package], Path(folder) / package.replace("/", "-"), options.workers)
            caught = 0
            for mistake, fate in zip(chosen, fates, strict=True):
                print(f"{mistake}\n    {fate or 'SURVIVED'}", flush=True)
                caught += bool(fate)
            print(f"{package}: {caught} of {len(chosen)} caught, of {len(possible)} possible", flush=True)
            survived += len(chosen) - caught
    return 1 if survived else 0


if __name__ == "__main__":
    sys.exit(main())
