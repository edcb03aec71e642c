"""What the printers of all languages have in common; no device is needed."""

from __future__ import annotations

import pytest

from passgraph.backends.gl.glsl import GLSL
from passgraph.backends.opencl.opencl_c import OpenCLPrinter
from passgraph.backends.printing import Printer
from passgraph.language.operations import OPERATIONS


@pytest.mark.parametrize("printer", [GLSL, OpenCLPrinter])
def test_every_primitive_is_spelled_and_nothing_else(printer: type[Printer]) -> None:
    """To mend: the operation's spelling belongs into the ``SPELLED`` of the language, or of all that are like C."""
    wanted = {(kind, row.name) for row in OPERATIONS.values() for kind in row.types}
    assert {(kind, name) for kind, names in printer.spelled.items() for name in names} == wanted
