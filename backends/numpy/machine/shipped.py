"""LLVM text of functions that are written for numba, made once and shipped: only who changes them needs numba."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from passgraph.errors import BackendError


@dataclass(frozen=True)
class Shipped:
    """Texts in one folder, a file a function, and what they were made from.

    Attributes
    ----------
    folder : of the texts, ``name.ll``
    sources : the Python files that decide them
    command : what makes them anew
    """

    folder: Path
    sources: tuple[Path, ...]
    command: str

    def text(self, name: str, make: Callable[[], str]) -> str:
        """A function's text; where the sources have changed since, what ``make`` gives, which needs numba.

        Raises
        ------
        BackendError
            The text is missing or older than its sources, and numba is not installed.
        """
        if self.is_current(name):
            return self._file(name).read_text(encoding="utf-8")
        if find_spec("numba") is None:
            raise BackendError(
                f"{self._file(name)} is missing or older than the functions that it is made from "
                f"({', '.join(source.name for source in self.sources)}); make it anew with numba: "
                f"pip install 'passgraph[dev]', then {self.command}"
            )
        return make()

    def is_current(self, name: str) -> bool:
        """Whether a function's text was made from the sources as they are."""
        try:
            with self._file(name).open(encoding="utf-8") as file:
                return file.readline() == self._heading()
        except FileNotFoundError:
            return False

    def write(self, name: str, text: str) -> None:
        """Keep a text that was made from the sources as they are."""
        self.folder.mkdir(exist_ok=True)
        self._file(name).write_text(f"{self._heading()}; Made by `{self.command}`.\n\n{text}", encoding="utf-8")

    def _file(self, name: str) -> Path:
        return self.folder / f"{name}.ll"

    def _heading(self) -> str:
        """The first line of every text.  Read as text, a source is the same with any system's ends of lines."""
        texts = [part for source in self.sources for part in (source.name, source.read_text(encoding="utf-8"))]
        digest = hashlib.sha256("\0".join(texts).encode()).hexdigest()
        return f"; Sources {digest}\n"
