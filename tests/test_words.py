"""Public docstrings are plain: they begin with what a thing is or does, and use the field's words."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import passgraph as pg
from passgraph import effects

#: A docstring that begins so tells a riddle before it names the thing.
OPENINGS = {"What", "How", "Of", "Those", "Where", "Such"}
#: Words of ours for which the field has others: serialized, borrowed, untrusted input, given.
OWN_WORDS = re.compile(
    r"\b(lent|lends?|strangers?|unkind|told|nobody|whoever|at home|the house|travels?)\b", re.IGNORECASE
)


def public_docstrings() -> Iterator[tuple[str, str]]:
    for module in (pg, effects):
        for name in module.__all__:
            thing = getattr(module, name)
            if not (inspect.isclass(thing) or callable(thing)):
                continue
            yield name, inspect.getdoc(thing) or ""
            for member, value in vars(thing).items() if inspect.isclass(thing) else ():
                if not member.startswith("_") and (callable(value) or isinstance(value, (property, classmethod))):
                    yield f"{name}.{member}", inspect.getdoc(value) or ""


DOCSTRINGS = dict(public_docstrings())


def test_there_are_docstrings_to_look_at() -> None:
    assert len(DOCSTRINGS) > 300


@pytest.mark.parametrize("name", [name for name, text in DOCSTRINGS.items() if text])
def test_a_public_docstring_is_plain(name: str) -> None:
    text = DOCSTRINGS[name]
    assert text.split()[0].strip(",.") not in OPENINGS
    assert OWN_WORDS.findall(text) == []


ROOT = Path(pg.__file__).resolve().parent.parent
#: A column of a generated table has "told" as its name.
ALLOWED = {"conformance.md": "told"}


def all_docstrings() -> Iterator[tuple[str, str]]:
    for folder in ("passgraph", "backends", "effects"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
                    yield path.name, ast.get_docstring(node) or ""


def pages() -> Iterator[tuple[str, str]]:
    for path in (*(ROOT / "docs").glob("*.md"), *ROOT.glob("*.md")):
        yield path.name, re.sub("`[^`]*`", "", path.read_text("utf-8"))


@pytest.mark.parametrize("texts", [all_docstrings, pages])
def test_texts_use_the_words_of_the_field(texts: Callable[[], Iterator[tuple[str, str]]]) -> None:
    found = {(name, word.lower()) for name, text in texts() for word in OWN_WORDS.findall(text)}
    assert {(name, word) for name, word in found if ALLOWED.get(name) != word} == set()


#: Files of users that texts speak of.
USERS = {"FILE.py", "mine.py", "own.py", "passgraph-script.py", "reproduce.py"}


def test_files_that_the_source_speaks_of_exist() -> None:
    files = {
        folder: list((ROOT / folder).rglob("*.py")) for folder in ("passgraph", "backends", "effects", "docs", "tests")
    }
    known = {path.name for paths in files.values() for path in paths} | USERS
    source = [path for folder in ("passgraph", "backends", "effects") for path in files[folder]]
    spoken = {
        (path.name, name) for path in source for name in re.findall(r"\b[\w-]+\.py\b(?!\.txt)", path.read_text("utf-8"))
    }
    assert len(spoken) > 20
    assert [pair for pair in sorted(spoken) if pair[1] not in known] == []
