"""The processor, as the system tells it."""

from __future__ import annotations

import sys
from pathlib import Path

#: What LLVM's names of processors and features hang on.
_FIELDS = ("vendor_id", "cpu family", "model", "model name", "stepping", "flags")


def told_by_linux(file: Path = Path("/proc/cpuinfo")) -> tuple[str, frozenset[str]] | None:
    """A text that tells an x86 processor from others, and its instruction sets; None where nothing says so.

    The kernel leaves out of ``flags`` what it does not let programs use, as LLVM does.
    """
    if sys.platform != "linux":
        return None
    try:
        first = file.read_text("ascii", "replace").partition("\n\n")[0]
    except OSError:
        return None
    split = (line.partition(":") for line in first.splitlines())
    found = {name.strip(): value.strip() for name, _, value in split}
    if not all(found.get(field) for field in _FIELDS):
        return None
    *name, flags = (found[field] for field in _FIELDS)
    return "\n".join(name), frozenset(flags.split())
