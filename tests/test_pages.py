"""Pages for readers: links lead somewhere, what is named exists, and commands have the options that are shown."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from functools import lru_cache
from importlib import import_module
from pathlib import Path

import pytest

import passgraph as pg
from docs import machines
from docs.conformance import MUTANTS, PARTS, mutant_text
from docs.folders import PICTURE, drawn, folder_graph
from docs.sentences import riddles, sentences, words
from passgraph.effects.effect_table import EFFECTS
from tests.commands.told import Outcome

ROOT = Path(__file__).resolve().parents[1]
TOP = ("README.md", "CONTRIBUTING.md", "SECURITY.md")
PAGES = {page.name: page for page in (*(ROOT / name for name in TOP), *sorted((ROOT / "docs").glob("*.md")))}
BLOCK = re.compile(r"^```(\S*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
#: Files of the reader's own, which examples name.
READERS = {"dimmed.py", "dream.py", "effect.json", "inside.py", "program.json", "warm.py"}
#: Average words in a sentence of a page.
MOST_WORDS = 20


def text_of(page: str) -> str:
    return PAGES[page].read_text(encoding="utf-8")


@lru_cache
def anchors(page: Path) -> frozenset[str]:
    """Of each heading what GitHub makes of it: small letters, hyphens for spaces, no other signs."""
    headings = re.findall(r"^#+ (.*)", BLOCK.sub("", page.read_text(encoding="utf-8")), re.MULTILINE)
    return frozenset(re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings)


@lru_cache
def files() -> tuple[str, ...]:
    """Every file of the project, from its top level."""
    folders = ("passgraph", "backends", "effects", "tests", "docs")
    found = (path for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file())
    return tuple("/" + path.relative_to(ROOT).as_posix() for path in found)


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", BLOCK.sub("", text_of(page))):
        if link.startswith(("http:", "https:")):
            continue
        file, _, anchor = link.partition("#")
        there = (PAGES[page].parent / file) if file else PAGES[page]
        assert there.exists(), f"{page}: {link} is no file"
        assert not anchor or anchor in anchors(there), f"{page}: {link}: no such heading there"


@pytest.mark.parametrize("page", PAGES)
def test_what_is_named_exists(page: str) -> None:
    text = text_of(page)
    for name in re.findall(r"`([\w/.-]+\.(?:py|pyi|cl|ll|sh|json|md))(?:::\w+)?`", text):
        assert name in READERS or any(file.endswith(f"/{name}") for file in files()), f"{page}: {name} is no file"
    for name in set(re.findall(r"\bpg\.([A-Za-z_]\w*)", text)):
        assert hasattr(pg, name), f"{page}: passgraph has no {name}"
    for name in set(re.findall(r"(?<![\w./-])passgraph((?:\.[A-Za-z_]\w*)+)", text)):
        if name == ".js":
            continue  # a file of an export
        assert reached("passgraph" + name), f"{page}: there is no passgraph{name}"


def reached(name: str) -> bool:
    """Whether a dotted name is a module, or something in one."""
    for end in range(len(parts := name.split(".")), 0, -1):
        try:
            found: object = import_module(".".join(parts[:end]))
        except ModuleNotFoundError:
            continue
        for part in parts[end:]:
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


@pytest.mark.parametrize("page", PAGES)
def test_sentences_are_short_and_use_the_terms_of_the_field(page: str) -> None:
    lengths = [words(sentence) for sentence in sentences(text_of(page))]
    assert not lengths or sum(lengths) / len(lengths) < MOST_WORDS
    assert riddles(text_of(page)) == []


def test_sentences_are_found_outside_of_code_and_tables() -> None:
    text = "# Head\n\nOne two. Three `a.b` four!\n\n```python\nx = 1.0\n```\n\n- five six\n- seven\n\n| a | b |\n"
    assert [words(sentence) for sentence in sentences(text)] == [2, 3, 2, 1]
    assert riddles("It travels from the house.") == ["travels", "the house"]


def test_the_drawing_of_the_folders_is_that_of_the_imports() -> None:
    assert PICTURE.read_text(encoding="utf-8") == drawn(folder_graph()), "run: python docs/folders.py"


def commands(text: str) -> Iterator[list[str]]:
    """The words behind ``passgraph``, of each command in a block for the shell or within a sentence."""
    lines = [line for language, block in BLOCK.findall(text) if language == "sh" for line in block.splitlines()]
    lines += re.findall(r"`(passgraph [^`]+)`", BLOCK.sub("", text))
    for line in lines:
        words = shlex.split(line.replace("\n", " "), comments=True)
        while "passgraph" in words:
            words = words[words.index("passgraph") + 1 :]
            yield words[: words.index("|")] if "|" in words else words


@pytest.mark.parametrize("page", PAGES)
def test_commands_have_the_options_that_are_shown(
    page: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT / "docs" / "shaders")
    for command in commands(text_of(page)):
        known = options(command, capsys)
        missing = [word for word in command if re.match("--?[a-z]", word) and word not in known]
        assert not missing, f"{page}: passgraph {shlex.join(command)}: there is no {', '.join(missing)}"


def options(command: list[str], capsys: pytest.CaptureFixture[str]) -> set[str]:
    """What a command takes, with the parameters of the effect that it names; a reader's own file takes anything."""
    name, about = command[0], command[1:2]
    if name == "apply" and about and not Path(about[0]).exists() and about[0] not in EFFECTS:
        return set(command)
    if name == "render" and "--effect" in command:
        about = command[(at := command.index("--effect")) : at + 2]
    elif name != "apply":
        about = []
    told = Outcome(capsys, name, *about, "--help")
    assert told.status == 0, told.err
    return set(re.findall(r"(?<![\w-])--?[A-Za-z][\w-]*", told.out))


def test_every_mistake_has_a_row_on_the_page_of_conformance() -> None:
    rows = json.loads(MUTANTS.read_text(encoding="utf-8"))
    counts = re.findall(r"^\| (.+) \| (\d+) \| \d+(?: \(.*\))? \| (\d+) \|$", mutant_text(rows), re.MULTILINE)
    assert [part for part, *_ in counts] == [*PARTS, "all"]
    planted = [int(mistakes) + int(harmless) for _, mistakes, harmless in counts]
    assert planted[-1] == sum(planted[:-1]) > 0


# Supported systems


def test_the_page_of_systems_is_written_from_its_rows() -> None:
    rows = json.loads(machines.ROWS.read_text(encoding="utf-8"))
    assert machines.page(rows) == machines.PAGE.read_text(encoding="utf-8")


def test_a_row_names_the_extras_that_do_not_install() -> None:
    """A step that the script did not reach is told apart from one that passed."""
    seen = "system\tDebian 20\nfirst command\tpassed\nextra gl\tpassed\nextra view\tfailed\nextra web\tfailed\n"
    row = machines.row(seen)
    assert row["extras"] == "view, web"
    page = machines.page({"debian20": row})
    assert "| install, render a picture | passed |" in page
    assert "| tests | not tried |" in page
    assert machines.row("extra gl\tpassed\n")["extras"] == "none of 1"


def test_the_table_of_wheels_names_versions_of_python() -> None:
    missing = {
        "Linux": {"3.11": {}, "3.12": {"gl": ["one"]}},
        "macOS": {python: {"gl": ["two"]} for python in ("3.11", "3.12")},
    }
    table = machines.wheels_table({"extras": ["all", "gl", "passgraph"], "missing": missing})
    assert "of 3.11 to 3.12." in table
    assert table.endswith("|---|---|---|---|\n| `gl` | one, two | 3.12 | each |\n")
