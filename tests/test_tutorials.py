"""Every command and every piece of Python of the tutorials runs, in the order of the page."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```(python|sh|glsl)\n(.*?)^```", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"^(?:#|//) file: (\S+)\n")
#: Pages, with the packages that they need; those of README that install and test are left out.
PAGES = {
    "README.md": ("av",),
    "docs/first-effect.md": ("moderngl",),
    "docs/shader-on-photos.md": ("av",),
    "docs/effect-in-pyvista.md": ("pyvista", "moderngl"),
    "docs/finish-shots.md": ("av",),
    "docs/engine-window.md": ("moderngl", "moderngl_window"),
    "docs/test-a-backend.md": (),
}
#: Commands that take minutes, are random, act on the checkout, or whose status is the driver's.
NOT_RUN = re.compile(r"venv|tests/run\.sh|--report|passgraph fuzz|passgraph probe")


def pieces(page: str) -> list[tuple[str, str]]:
    """Language and text of each block of a page that is run."""
    found = BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))
    return [(language, text) for language, text in found if not (language == "sh" and NOT_RUN.search(text))]


@pytest.mark.parametrize("page", PAGES)
def test_every_piece_of_a_page_runs(page: str, tmp_path: Path) -> None:
    missing = [name for name in PAGES[page] if find_spec(name) is None]
    if missing:
        pytest.skip(f"{page} needs {', '.join(missing)}")
    if page == "README.md":
        make_photos(tmp_path)
    environment = {
        **os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path)]),
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
    }  # fmt: skip
    ran, python = 0, ""
    for language, text in pieces(page):
        if file := FILE.match(text):
            (tmp_path / file[1]).write_text(text, encoding="utf-8")
        elif language == "python":  # pieces of a page share their names
            python += text
        else:
            run(["bash", "-euc", text.replace("docs/", f"{ROOT}/docs/")], tmp_path, environment)
            ran += 1
    if python:
        (tmp_path / "page.py").write_text(python, encoding="utf-8")
        run([sys.executable, "page.py"], tmp_path, environment)
    assert ran or python


def make_photos(folder: Path) -> None:
    """The reader's photos."""
    (folder / "photos").mkdir()
    for name in ("photo.png", "a.png", "b.png", "photos/c.png"):
        pg.save(folder / name, np.random.default_rng(len(name)).random((36, 64, 4), np.float32))


def run(command: list[str], folder: Path, environment: dict[str, str]) -> None:
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command[-1]}\n{done.stdout}{done.stderr}"
