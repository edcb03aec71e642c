"""Compile programs in a child process first, for a driver that ends the process over some of them.

PoCL 6 runs a pass of LLVM with a check of LLVM's own tests: that a second run of the pass changes nothing
(https://github.com/pocl/pocl/issues/1608).  Of LLVM 18 on, the process ends where it does.  By then PoCL has put
values of branches and loops on the stack, if groups have more than two work-items (PHIsToAllocas.cc).  No kernel with
smaller groups has failed.

The child compiles each kernel for groups of any size and runs none.  PoCL fixes the size after that pass, so the result
holds for each size.  PoCL keeps on disk what the child has parsed, for this process.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import weakref
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from passgraph import disk_cache

#: Platform versions of drivers with the check.
CHECKED = re.compile(r"PoCL 6\..*LLVM (1[89]|[2-9]\d)\.")
#: Text before and after a source, and further options, in the order in which they are tried; the last one is not tried.
#: A soft shadow frame takes 1.8 times as long with the second, and 2.5 times with the last, which does not optimize.
WAYS: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("", "", ()),
    (
        "#pragma clang attribute push(__attribute__((minsize)), apply_to = function)\n",
        "\n#pragma clang attribute pop\n",
        (),
    ),
    ("", "", ("-cl-opt-disable",)),
)
#: Folder of the disk cache: a number of `WAYS` for each program.
PART = "opencl-ways"
#: Beginnings of environment variables that change what is compiled.
VARIABLES = ("POCL_", "PYOPENCL_")
#: Signals with which a compiler ends its process.
ENDED = (-signal.SIGABRT, -signal.SIGSEGV)
_CHILD = Path(__file__).with_name("trial_child.py")


class Trial:
    """Finds a way to compile each program, once per driver; see `WAYS`.

    Parameters
    ----------
    driver : names driver and device in the disk cache
    command : starts the child, see trial_child.py; a signal of `ENDED` ends it over a program that does not compile
    """

    def __init__(self, driver: str, command: Sequence[str]) -> None:
        self.driver, self.command = driver, command
        self._child: subprocess.Popen[str] | None = None
        self._stop: Any = None

    def safe(self, source: str, options: Sequence[str]) -> tuple[str, list[str]]:
        """Return source and options that this driver compiles; as given if no child can be started."""
        variables = sorted(f"{name}={value}" for name, value in os.environ.items() if name.startswith(VARIABLES))
        name = hashlib.sha256("\0".join((self.driver, source, *options, *variables)).encode()).hexdigest()
        known = disk_cache.recall(PART, name)
        if known is not None and len(known) == 1 and known[0] < len(WAYS):
            return _in_way(known[0], source, options)
        for way in range(len(WAYS) - 1):
            compiles = self._compiles(*_in_way(way, source, options))
            if compiles is None:
                return source, [*options]
            if compiles:
                break
        else:
            way = len(WAYS) - 1
        disk_cache.remember(PART, name, bytes([way]))
        return _in_way(way, source, options)

    def _compiles(self, source: str, options: Sequence[str]) -> bool | None:
        """Return False if the program ends the child, and None if that cannot be found out here."""
        try:
            child = self._started()
            if child is None or child.stdin is None or child.stdout is None:
                self.close()
                return None
            child.stdin.write(json.dumps([source, options]) + "\n")
            child.stdin.flush()
            if child.stdout.readline():
                return True
            ended = child.wait() in ENDED
            self.close()
            return False if ended else None
        except OSError:  # no such program, or the pipe is closed
            self.close()
            return None
        except BaseException:
            self.close()  # interrupted: its answer would be taken for the next program's
            raise

    def _started(self) -> subprocess.Popen[str] | None:
        """Return the child; None if it does not start."""
        if self._child is None:
            # In a session of its own, so that Ctrl-C does not end it over a program.
            self._child = child = subprocess.Popen(
                self.command, text=True, encoding="utf-8", start_new_session=True,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            )  # fmt: skip
            self._stop = weakref.finalize(self, _stopped, child)
            if child.stdout is None or not child.stdout.readline():
                return None
        return self._child

    def close(self) -> None:
        """End the child; another one starts at the next program."""
        if self._stop is not None:
            self._stop()
        self._child = self._stop = None


def trial_of(device: Any) -> Trial | None:
    """Return a trial for a device whose driver has the check.

    None for others, and where Python is part of another program, which `sys.executable` would start.
    """
    if not CHECKED.search(device.platform.version) or not Path(sys.executable or "").stem.startswith("python"):
        return None
    number = device.platform.get_devices().index(device)
    command = [sys.executable, "-P", str(_CHILD), device.platform.version, str(number)]
    return Trial(f"{device.platform.version} {device.name}", command)


def _in_way(way: int, source: str, options: Sequence[str]) -> tuple[str, list[str]]:
    before, after, more = WAYS[way]
    return before + source + after, [*options, *more]


def _stopped(child: subprocess.Popen[str]) -> None:
    child.kill()
    with suppress(OSError), child:  # closes its pipes and waits
        pass
