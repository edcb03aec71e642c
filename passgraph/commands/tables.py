"""Tables on standard output."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.text import Text

#: Columns of the output without a terminal, so that tables are not wrapped.
WIDTH = 200


def show_table(title: str, words: Sequence[str], numbers: Sequence[str], rows: Iterable[Sequence[str | Text]]) -> None:
    """Print a table: columns of words, then columns of numbers, which are aligned to the right."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left", box=box.SIMPLE_HEAD)
    for heading in words:
        table.add_column(heading, overflow="fold")
    for heading in numbers:
        table.add_column(heading, justify="right", overflow="fold")
    for row in rows:
        table.add_row(*(escape(cell) if isinstance(cell, str) else cell for cell in row))
    Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH).print(table)


def marked(text: str, passed: bool) -> Text:
    """Return a cell, in red if something did not pass."""
    from rich.text import Text

    return Text(text, "" if passed else "bold red")
