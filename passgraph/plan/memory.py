"""The memory that a plan may take: checked before anything is allocated."""

from __future__ import annotations

import os
import re
from functools import cache
from pathlib import Path

from passgraph import arguments
from passgraph.errors import GraphError, InputError
from passgraph.plan.data import Plan

_UNITS = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "t": 10**12}
_BINARY = {"ki": 1 << 10, "mi": 1 << 20, "gi": 1 << 30, "ti": 1 << 40}
#: A number of bytes beyond this is a typing error.
MOST_BYTES = 1 << 52
#: Of the machine's memory, what a plan takes by default at most.
SHARE = 0.5
#: Where control groups say how much a container may take (version 2, version 1).
_CGROUPS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
#: Targets that a message names.
_NAMED = 3


def bytes_of(memory: object) -> int:
    """A number of bytes, such as ``1_000_000``, ``"1 GB"`` or ``"512 MiB"``.

    >>> bytes_of("1 GB"), bytes_of("1.5 KiB")
    (1000000000, 1536)
    """
    if isinstance(memory, str):
        found = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([kmgt]?i?)b?\s*", memory.lower())
        unit = None if found is None else {**_UNITS, **_BINARY}.get(found[2])
        if found is None or unit is None:
            raise InputError(f"memory must be bytes, such as '1 GB' or '512 MiB', got {arguments.shown(memory)}")
        memory = int(float(found[1]) * unit)
    return arguments.whole(memory, "memory (bytes)", 1, MOST_BYTES, InputError)


def told(count: int) -> str:
    """Bytes as messages tell them."""
    return f"{count / 1e9:.1f} GB" if count >= 10**9 else f"{-(-count // 10**6)} MB"


@cache
def machine_memory() -> int:
    """The memory of the machine, or of the container that this process runs in; bytes."""
    found = [_physical_memory()]
    for name in _CGROUPS:
        try:
            found.append(int(Path(name).read_text()))
        except (OSError, ValueError):  # no such group, or "max"
            continue
    return min(found)


def _physical_memory() -> int:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # not POSIX
        return MOST_BYTES


def check_memory(plan: Plan, allowed: int | None) -> None:
    """Refuse a plan that allocates more than ``allowed`` bytes, or than half of the machine's memory.

    Raises
    ------
    GraphError
        With the largest targets and their sizes.
    """
    limit = int(SHARE * machine_memory()) if allowed is None else allowed
    if plan.bytes <= limit:
        return
    largest = sorted(plan.resources, key=lambda resource: -plan.memories[resource.memory].bytes)[:_NAMED]
    named = ", ".join(
        f"{resource.name} {resource.size[0]}x{resource.size[1]} {resource.format.name} "
        f"({told(plan.memories[resource.memory].bytes)})"
        for resource in largest
    )
    why = "half of this machine's memory" if allowed is None else "the memory that is given"
    raise GraphError(
        f"the targets of this graph take {told(plan.bytes)}, and at most {told(limit)} are allowed, {why}; the largest "
        f"are {named}. Make them smaller, compute in tiles (pg.tiled), or allow more: pg.compile(…, memory='16 GB')"
    )
