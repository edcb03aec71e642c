"""A lock that a fork waits for, so that a child does not inherit a half-imported module of a thread that it lacks.

Python resets no module's import lock in a child. It is made here, before anything else is imported: functions that are
registered while another thread is about to fork run after the fork only, and would release what was not acquired.
"""

from __future__ import annotations

import os
from threading import RLock

#: Held while the core of the package is imported, and while a kernel is parsed.
importing = RLock()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=importing.acquire, after_in_parent=importing.release, after_in_child=importing.release)
