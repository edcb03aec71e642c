"""The site builds without a warning, and has an entry for every public name, effect, engine and option."""

from __future__ import annotations

import os
import posixpath
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import click
import pytest

import passgraph as pg
from passgraph import language
from passgraph.commands.entry import COMMANDS, group
from passgraph.effects.effect_table import EFFECTS

ROOT = Path(__file__).resolve().parents[1]


def build_site(folder: Path, *settings: str) -> None:
    """Build the site with settings of docs/conf.py; the scripts of its gallery are run by tests/test_examples.py."""
    options = [word for setting in ("plot_gallery=0", *settings) for word in ("-D", setting)]
    build = ["bash", str(ROOT / "docs" / "build.sh"), str(folder), *options]
    done = subprocess.run(build, env={**os.environ, "PYTHON": sys.executable}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_every_notebook_runs(tmp_path: Path) -> None:
    build_site(tmp_path)
    assert len(list((tmp_path / "html").glob("notebook-*.html"))) == 5


@pytest.fixture(scope="module")
def entries(tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    """Names in the index of a newly built site, by kind."""
    from sphinx.util.inventory import InventoryFile

    folder = tmp_path_factory.mktemp("site")
    build_site(folder, "nb_execution_mode=off", "suppress_warnings=myst-nb.lexer")
    with (folder / "html" / "objects.inv").open("rb") as file:
        inventory = InventoryFile.load(file, "", posixpath.join)
    python = {name for kind, names in inventory.items() if kind.startswith("py:") for name in names}
    return {"python": python, "options": set(inventory["std:cmdoption"])}


def test_every_public_name_has_an_entry(entries: dict[str, set[str]]) -> None:
    public = {name for name in dir(pg) if not name.startswith("_")} - {"Any", "TYPE_CHECKING", "annotations"}
    modules = {name for name in public - set(pg.__all__) if isinstance(getattr(pg, name), ModuleType)}
    expected = {f"passgraph.{name}" for name in public - modules - set(language.__all__)}
    expected |= {f"passgraph.language.{name}" for name in language.__all__}
    assert sorted(expected - entries["python"]) == []


def test_every_effect_has_an_entry(entries: dict[str, set[str]]) -> None:
    own = [effect.path.replace(":", ".") for effect in EFFECTS.values() if effect.path.startswith("passgraph.")]
    assert [path for path in own if path not in entries["python"]] == []


def test_every_engine_has_an_entry(entries: dict[str, set[str]]) -> None:
    modules = (ROOT / "passgraph" / "engines").glob("*.py")
    engines = [module.stem for module in modules if "\ndef attach(" in module.read_text(encoding="utf-8")]
    assert len(engines) > 5
    assert [name for name in engines if f"passgraph.engines.{name}.attach" not in entries["python"]] == []


def test_every_option_has_an_entry(entries: dict[str, set[str]]) -> None:
    context = click.Context(group, info_name="passgraph")
    for name in COMMANDS:
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):  # apply: one command for each effect; a table has the effect's own options
            command = command.get_command(context, "fog")
            assert command is not None
            own = {f"--{parameter.name.replace('_', '-')}" for parameter in EFFECTS["fog"].parameters}
        else:
            own = set()
        options = {spelling for param in command.params if isinstance(param, click.Option) for spelling in param.opts}
        missing = [spelling for spelling in options - own if f"passgraph-{name}.{spelling}" not in entries["options"]]
        assert not missing, f"passgraph {name}: {missing}"
