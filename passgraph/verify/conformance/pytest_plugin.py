"""The suite as pytest tests: ``pytest --passgraph-backend NAME`` adds a test for each case, in any project.

pytest finds this plugin through its entry point.  ``-k`` selects ``conformance[backend-group/name]`` like other tests.
In JUnit's files (``--junitxml``) the backend is part of each test's class and name, and its device a property.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from passgraph.backends.base import Backend
    from passgraph.verify.conformance.case import Case

_backend: pytest.StashKey[Backend] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("passgraph", "conformance of a passgraph backend")
    group.addoption("--passgraph-backend", metavar="NAME", help="test this backend, such as gl or your own")
    group.addoption("--passgraph-group", metavar="GROUP", action="append", help="only this group; may be repeated")
    group.addoption("--passgraph-quick", action="store_true", help="leave out cases that are near others")


@pytest.hookimpl(tryfirst=True)  # so that -k and -m also select among the added tests
def pytest_collection_modifyitems(session: pytest.Session, config: pytest.Config, items: list[pytest.Item]) -> None:
    backend = config.getoption("passgraph_backend")
    if not backend:
        return
    from passgraph.errors import InputError
    from passgraph.verify.conformance.suite import cases

    parent = Conformance.from_parent(session, name="passgraph", nodeid=f"passgraph/{backend}")
    try:
        for case in cases(config.getoption("passgraph_group"), quick=config.getoption("passgraph_quick")):
            items.append(CaseItem.from_parent(parent, name=f"conformance[{backend}-{case.id}]", case=case))
    except InputError as error:
        raise pytest.UsageError(str(error)) from error


def pytest_unconfigure(config: pytest.Config) -> None:
    if _backend in config.stash:
        config.stash[_backend].close()


class NotConforming(Exception):
    """A case that did not pass; the text is its verdict."""


class Conformance(pytest.Collector):
    """The parent node of the tests; it has no file."""

    def collect(self) -> list[pytest.Item]:
        return []


class CaseItem(pytest.Item):
    """A case as a test."""

    def __init__(self, *, case: Case, **options: Any) -> None:
        super().__init__(**options)
        self.case = case

    def runtest(self) -> None:
        from passgraph.verify.conformance.judging import judge

        backend = self._opened()
        info = backend.device_info()
        self.user_properties += [("device", info.name), ("driver", info.driver), ("version", info.version)]
        (verdict,) = judge(self.case, [backend])
        if verdict.outcome == "unsupported":
            pytest.skip(str(verdict))
        if verdict.outcome != "passed":
            raise NotConforming(str(verdict))

    def _opened(self) -> Backend:
        """Return the backend; opened once and closed with the session."""
        from passgraph.backends.registry import open_backend

        if _backend not in self.config.stash:
            self.config.stash[_backend] = open_backend(self.config.getoption("passgraph_backend"))
        return self.config.stash[_backend]

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        if isinstance(excinfo.value, NotConforming):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, None, str]:
        return self.path, None, self.name
