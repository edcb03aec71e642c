"""Handle Ctrl-C and SIGTERM in the ``passgraph`` command: no traceback, and no temporary files left behind.

Only the command's process installs this (:func:`is_command`, and `passgraph.commands.main`); a program that imports
passgraph keeps its own handlers.  This module imports nothing of the package, so that it is active before slow imports.

While a command runs, the first signal raises KeyboardInterrupt, so that open files and processes are closed.  A second
signal, and one before or after the command, ends the process at once.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
from types import FrameType
from typing import Any

_raises = False
_received: int | None = None


def is_command() -> bool:
    """Return True in the process of the installed script, or of ``python -m passgraph``."""
    first = next(iter(getattr(sys, "argv", [])), "")  # a program that embeds Python may have none
    if first != "-m":  # while Python looks for the module
        return os.path.basename(first) in ("passgraph", "passgraph.exe", "passgraph-script.py")
    module = sys.orig_argv[sys.orig_argv.index("-m") + 1 :][:1] if "-m" in sys.orig_argv else []
    return module in (["passgraph"], ["passgraph.__main__"])


def install() -> None:
    """Handle SIGINT and SIGTERM unless the process ignores them; call from the main thread only."""
    try:
        for number, default in ((signal.SIGINT, signal.default_int_handler), (signal.SIGTERM, signal.SIG_DFL)):
            if signal.getsignal(number) is default:
                signal.signal(number, _on_signal)
                sys.unraisablehook = _on_unraisable
                # Python restores the default handlers late in its shutdown, when all work is done.
                atexit.register(signal.signal, number, signal.SIG_IGN)
    except ValueError:  # not the main thread
        return


def raise_them(raises: bool) -> None:
    """Set whether a signal raises KeyboardInterrupt, as it does while a command runs."""
    global _raises
    _raises = raises


def received() -> int | None:
    """Return the number of the first signal received; None if there was none."""
    return _received


def status() -> int:
    """Return the exit status of an interrupted command: 130 for SIGINT, 143 for SIGTERM."""
    return 128 + (_received or signal.SIGINT)


def _on_signal(number: int, frame: FrameType | None) -> None:
    global _received
    if not _raises or _received is not None:
        _exit_at_once(number)
    _received = number
    raise KeyboardInterrupt


def _on_unraisable(problem: Any) -> None:
    """Exit on a KeyboardInterrupt inside a destructor or callback, which Python would only print."""
    if _received is not None and issubclass(problem.exc_type, KeyboardInterrupt):
        _exit_at_once(_received)
    sys.__unraisablehook__(problem)


def _exit_at_once(number: int) -> None:
    writing = sys.modules.get("passgraph.writing")
    if writing is not None and hasattr(writing, "discard_unfinished"):
        writing.discard_unfinished()
    os._exit(128 + number)
