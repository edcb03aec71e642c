"""The gallery's scripts run, write pictures that differ, use public names only, and show every effect."""

from __future__ import annotations

import ast
import runpy
import shutil
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from passgraph.effects.effect_table import EFFECTS

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs" / "examples"
SCRIPTS = {script.relative_to(FOLDER).as_posix(): script for script in sorted(FOLDER.glob("*/plot_*.py"))}
#: Modules of passgraph whose names pages for users mention; scripts import from no other.
PUBLIC = {
    "passgraph", "passgraph.effects", "passgraph.effects.light2d", "passgraph.effects.light2d.picture",
    "passgraph.effects.surfaces.engine_depth", "passgraph.language",
}  # fmt: skip
#: Packages that a reader has: Python's own, dependencies of passgraph, and scikit-image.
INSTALLED = {"dataclasses", "math", "numpy", "skimage", "trimesh"}


def imports(script: Path) -> list[tuple[str, str]]:
    """Return module and name of everything that a script imports."""
    nodes = list(ast.walk(ast.parse(script.read_text(encoding="utf-8"))))
    plain = [(alias.name, "") for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    return plain + [
        (node.module or "", alias.name) for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names
    ]


@pytest.mark.sampled
@pytest.mark.parametrize("name", SCRIPTS)
def test_an_example_writes_pictures_that_differ(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for file in SCRIPTS[name].parent.iterdir():
        if file.suffix not in (".py", ".rst"):
            shutil.copy(file, tmp_path)  # shader files, which a script's docstring links
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(SCRIPTS[name]), run_name="__main__")
    pictures = {}
    for file in tmp_path.glob("*.png"):
        with Image.open(file) as image:
            pictures[file.stem] = np.asarray(image.convert("RGB"), np.int16)
    assert pictures
    assert [name for name, picture in pictures.items() if np.ptp(picture) < 64] == []
    for (one, a), (other, b) in combinations(pictures.items(), 2):
        assert a.shape != b.shape or np.abs(a - b).max() > 8, f"{one} and {other} look the same"


@pytest.mark.parametrize("name", SCRIPTS)
def test_an_example_uses_public_names_only(name: str) -> None:
    for module, imported in imports(SCRIPTS[name]):
        assert module in PUBLIC or module.partition(".")[0] in INSTALLED, f"{module} is not for users"
        assert not imported.startswith("_")


def test_every_effect_is_shown() -> None:
    used = {name for script in SCRIPTS.values() for _, name in imports(script)}
    shipped = {effect.path.partition(":")[2] for effect in EFFECTS.values() if effect.path.startswith("passgraph.")}
    assert len(shipped) > 50
    assert shipped - used == set()
