"""Print the average number of words in a sentence of each page: python docs/sentences.py [PAGE...]"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")] + sorted((ROOT / "docs").glob("*.md"))
#: Words that describe by a riddle what the field has a term for.
RIDDLES = (
    "nobody has any more", "travels", "travel", "lent", "the house", "at home", "doors", "rooms", "strangers", "unkind",
)  # fmt: skip


def sentences(text: str) -> list[str]:
    """The sentences of a page: of paragraphs and list items, without code, tables, headings and pictures."""
    text = re.sub(r"^---\n.*?^---\n", "", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^(`{3,}|:{3,}).*?^\1`*:*$", "\n", text, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"^(#|\||!\[).*$", "\n", text, flags=re.MULTILINE)
    text = re.sub(r"`[^`]*`", "x", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"^\s*(?:[-*]|\d+\.) ", "\n\n", text, flags=re.MULTILINE)
    found = []
    for paragraph in re.split(r"\n\s*\n", text):
        if paragraph.count("·") > 5:  # a list of names in one line
            continue
        flat = " ".join(paragraph.replace("**", "").split())
        found += [one for one in re.split(r"(?<=[.!?])\s+(?=[A-Zx(\d])", flat) if re.search(r"\w", one)]
    return found


def words(sentence: str) -> int:
    return len(re.findall(r"[\w'’-]+", sentence))


def riddles(text: str) -> list[str]:
    """Which of `RIDDLES` a page has, outside of code."""
    prose = " ".join(sentences(text)).lower()
    return [word for word in RIDDLES if re.search(rf"\b{word}\b", prose)]


def main(pages: list[Path]) -> None:
    counts = []
    for page in pages:
        text = page.read_text(encoding="utf-8")
        lengths = [words(sentence) for sentence in sentences(text)]
        counts += lengths
        if lengths:
            found = riddles(text)
            print(f"{sum(lengths) / len(lengths):6.1f}  {len(lengths):4}  {page.name}  {', '.join(found)}".rstrip())
    print(f"{sum(counts) / len(counts):6.1f}  {len(counts):4}  all")


if __name__ == "__main__":
    main([Path(name) for name in sys.argv[1:]] or PAGES)
