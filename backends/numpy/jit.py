"""Compiles generated Python to machine code with numba, and keeps the result on disk.

Generated text is written as a module named by its key into the user's own cache folder and imported, because
numba caches only what has a file.  A second process starts with the compiled code.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from passgraph.errors import BackendError

#: Environment variable with another folder for compiled code.
CACHE_VARIABLE = "PASSGRAPH_CACHE"


@lru_cache(maxsize=1)
def dispatcher_class() -> type[Any]:
    """numba's CPU dispatcher whose functions promise that their arrays do not overlap.

    Without that promise LLVM must assume that a store into the output changes the inputs, and gathers stay scalar: a
    3x3 neighbourhood runs at half the speed.  numba has the flag but no option for it, so the target options are
    swapped for a subclass that sets it; pinned by a test that looks for ``noalias`` in the compiled code.
    """
    from numba.core.cpu import CPUTargetOptions
    from numba.core.registry import CPUDispatcher, CPUTarget, cpu_target

    class NoAliasOptions(CPUTargetOptions):  # type: ignore[misc]
        def finalize(self, flags: Any, options: Any) -> None:
            super().finalize(flags, options)
            flags.noalias = True

    class NoAliasTarget(CPUTarget):  # type: ignore[misc]
        options = NoAliasOptions

        # One context for all: types and compiled functions are those of the ordinary target.
        @property
        def typing_context(self) -> Any:
            return cpu_target.typing_context

        @property
        def target_context(self) -> Any:
            return cpu_target.target_context

    class NoAliasDispatcher(CPUDispatcher):  # type: ignore[misc]
        targetdescr = NoAliasTarget("cpu")

    return NoAliasDispatcher


def compiled(function: Callable[..., Any]) -> Any:
    """A function of a cached module as a dispatcher: no GIL, IEEE arithmetic, arrays apart."""
    options = {"nopython": True, "nogil": True, "error_model": "numpy", "boundscheck": False}
    dispatcher = dispatcher_class()(py_func=function, targetoptions=options)
    dispatcher.enable_caching()
    return dispatcher


def cache_folder() -> Path:
    """The user's own folder for compiled code, made where it is missing.

    Raises
    ------
    BackendError
        When it belongs to someone else or others may write to it: code from there is executed.
    """
    given = os.environ.get(CACHE_VARIABLE)
    base = Path(given) if given else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "passgraph"
    folder = base / "numba"
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        status = folder.stat()
    except OSError as error:
        raise BackendError(f"the cache folder {folder} cannot be made ({error}); name another one in {CACHE_VARIABLE}") from error
    if os.name == "posix" and (status.st_uid != os.getuid() or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
        raise BackendError(
            f"the cache folder {folder} belongs to another user or others may write to it; "
            f"it holds code that is run: mend it (chmod 700) or name another one in {CACHE_VARIABLE}"
        )
    return folder


def module_key(text: str) -> str:
    """Names a generated module: its text, and what turns it into machine code."""
    import numba

    parts = (numba.__version__, sys.version.split()[0], text)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:40]


_loaded: dict[str, Any] = {}


def load_module(text: str, hint: str) -> Any:
    """Import generated text through the cache folder."""
    key = module_key(text)
    if key in _loaded:
        return _loaded[key]
    path = cache_folder() / f"pg_{key}.py"
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        _write_whole(path, text)
    name = f"passgraph_generated_{key}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise BackendError(f"generated code for {hint} cannot be imported from {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # numba finds a function's module by name when it reads its cache
    spec.loader.exec_module(module)
    _loaded[key] = module
    return module


def _write_whole(path: Path, text: str) -> None:
    """Another process may write the same file: both replace it whole, with equal text."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".pg_", suffix=".tmp")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
