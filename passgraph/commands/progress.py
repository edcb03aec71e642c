"""What is being done, shown on stderr while it lasts, and only on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from passgraph.frames.frame import Outcome


@contextmanager
def progress(first: str) -> Iterator[Callable[[str], None]]:
    """A spinner with a text; the function given changes the text."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console

    with Console(stderr=True).status(first) as status:
        yield status.update


@contextmanager
def frame_progress(
    name: str, count: int | None, complaint: Callable[[Outcome], str]
) -> Iterator[Callable[[Outcome], None]]:
    """A bar with frames a second and the time left; the function given is told of each frame.

    ``complaint`` is what is printed of a frame that failed, on a terminal or not.
    """
    if not sys.stderr.isatty():
        yield lambda outcome: click.echo(complaint(outcome), err=True) if outcome.state == "failed" else None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn
    from rich.progress import TimeRemainingColumn as TimeLeft
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task: Task) -> Text:
            return Text(f"{task.speed:.1f} frames/s" if task.speed else "")

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), Rate(), TimeLeft())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(name, total=count)

        def step(outcome: Outcome) -> None:
            if outcome.state == "failed":
                console.print(complaint(outcome), markup=False, highlight=False, soft_wrap=True)
            bar.advance(task)

        yield step
