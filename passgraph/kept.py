"""What one process leaves on disk for the next: whole files in the user's own folder, each behind its checksum."""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

from passgraph.errors import BackendError

#: Environment variable with another folder for all that is kept.
CACHE_VARIABLE = "PASSGRAPH_CACHE"
#: A folder holds at most this much, looked at when a process first writes there; then the oldest files go.
FOLDER_BYTES = 256 * 1024**2


def cache_folder(part: str) -> Path:
    """The user's own folder for one kind of file, made where it is missing.

    Raises
    ------
    BackendError
        When it belongs to someone else or others may write to it: code from there is executed.
    """
    given = os.environ.get(CACHE_VARIABLE)
    base = Path(given) if given else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "passgraph"
    folder = base / part
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        status = folder.stat()
    except OSError as error:
        raise BackendError(
            f"the cache folder {folder} cannot be made ({error}); name another one in {CACHE_VARIABLE}"
        ) from error
    if os.name == "posix" and (status.st_uid != os.getuid() or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
        raise BackendError(
            f"the cache folder {folder} belongs to another user or others may write to it; "
            f"it holds code that is run: mend it (chmod 700) or name another one in {CACHE_VARIABLE}"
        )
    return folder


@cache
def text_digest(folder: Path) -> str:
    """Stands for the text of a package: part of every name of what all of it decides."""
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(folder.glob("*.py")))).hexdigest()


def kept(path: Path) -> bytes | None:
    """What :func:`keep` wrote, unless it is missing or damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    return data[32:] if hashlib.sha256(data[32:]).digest() == data[:32] else None


def keep(path: Path, data: bytes) -> None:
    prune(path.parent)
    write_whole(path, hashlib.sha256(data).digest() + data)


def write_whole(path: Path, data: bytes) -> None:
    """Another process may write the same file: both replace it whole, with what serves both."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".pg_", suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


@cache
def prune(folder: Path, most: int = FOLDER_BYTES) -> None:
    """Remove the files that were written first, down to half of ``most``, where a folder holds more.

    Another process may read or remove the same files: what is gone is made anew.
    """
    found = []
    for path in folder.iterdir():
        with suppress(OSError):
            status = path.stat()
            found.append((status.st_mtime, status.st_size, path))
    held = sum(size for _, size, _ in found)
    if held <= most:
        return
    for _, size, path in sorted(found):
        if held <= most // 2:
            return
        with suppress(OSError):
            path.unlink()
            held -= size


def recall(part: str, name: str) -> bytes | None:
    """A file of what is only quicker to read than to compute again; None where it, or the folder, is not there."""
    try:
        return kept(cache_folder(part) / name)
    except BackendError:
        return None


def remember(part: str, name: str, data: bytes) -> None:
    """Keep such a file; where that cannot be, nothing is lost."""
    try:
        keep(cache_folder(part) / name, data)
    except (BackendError, OSError):
        return
