"""Who has a program's device, and what becomes of it in the end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from passgraph.errors import GraphError

if TYPE_CHECKING:
    from passgraph.backends.base import Backend
    from passgraph.run.execution import Execution
    from passgraph.run.program import Program


@dataclass
class Held:
    """What a program must give back: known to its finaliser, which cannot know the program."""

    backend: Backend
    owns: bool
    execution: Execution | None = None

    def abandoned(self) -> None:
        """The program was dropped without being closed; this may run in any thread, in the middle of anything."""
        execution, self.execution = self.execution, None
        if execution is None:
            return
        if self.owns:
            # Nobody else has this backend: it goes with the last reference to it.
            execution.forget()
        else:
            self.backend.turn.later(execution.release)


class Alone:
    """Around what one thread does with a program; a class, since every call passes here."""

    __slots__ = ("program", "what")

    def __init__(self, program: Program, what: str) -> None:
        self.program, self.what = program, what

    def __enter__(self) -> None:
        program = self.program
        program.backend.turn.__enter__()
        # Only this thread can have come here twice.
        if program._busy or (program._closed and self.what != "closed"):
            program.backend.turn.__exit__()
            program._check_open()
            raise GraphError(
                f"a program cannot be {self.what} from inside its own run; an observer, or a value's function, "
                "keeps what it needs and does this after the run"
            )
        program._busy = True

    def __exit__(self, *_: object) -> None:
        self.program._busy = False
        self.program.backend.turn.__exit__()
