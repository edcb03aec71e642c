"""The disk cache: whole files in a folder that only this user can write to.

Cached machine code is executed, so an attacker must not be able to replace it.  Each folder on the way is opened
relative to its parent, and ownership is checked on the opened folder, so swapping folders or links meanwhile has no
effect.  A file begins with a checksum of its content, name and kind, so files cannot be exchanged.
"""

from __future__ import annotations

import hashlib
import os
import platform
import stat
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from time import time

from passgraph.errors import BackendError

#: The folder of this package; files there that changed later may differ from what this process has imported.
PACKAGE, _IMPORTED = os.path.dirname(os.path.abspath(__file__)), time()
#: Environment variable that names another cache folder.
CACHE_VARIABLE = "PASSGRAPH_CACHE"
#: Most bytes in a folder, checked when a process first writes there; the oldest files are removed.
FOLDER_BYTES = 256 * 1024**2
#: Most links followed in one path, as on Linux.
MAX_LINKS = 40
_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_FOLDER_FLAGS = os.O_RDONLY | getattr(os, "O_DIRECTORY", 0) | getattr(os, "O_NOFOLLOW", 0)
#: Opening a pipe must not block; non-regular files are detected after opening.
_FILE_FLAGS = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
#: What names of temporary files begin with, and their age in seconds when their process is gone.
_TEMPORARY, _STALE_S = ".pg_", 3600
#: True once this process has warned that the cache is off; and the folders that it has pruned.
_said: set[str] = set()
_pruned: set[Path] = set()


def cache_path(part: str) -> Path:
    """Return the folder of one kind of file."""
    given = os.environ.get(CACHE_VARIABLE)
    try:
        base = Path(given) if given else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "passgraph"
    except RuntimeError as error:  # no HOME, and no such user
        raise BackendError(f"there is no home folder for the cache ({error}); name one in {CACHE_VARIABLE}") from None
    return Path(os.path.abspath(base)) / part


@contextmanager
def cache_folder(part: str, make: bool = True) -> Iterator[int | None]:
    """Open the user's own folder for one kind of file; yields None on systems where only paths work.

    ``make``: create it if it is missing.

    Raises
    ------
    BackendError
        If it, or a folder on the way, belongs to someone else or is writable by others: code from there is executed.
    FileNotFoundError
        If it is missing and ``make`` is False.
    """
    path = cache_path(part)
    try:
        if sys.platform == "win32":
            if make:
                path.mkdir(parents=True, exist_ok=True)
            folder = None
        else:
            folder = _opened(path, make)
    except OSError as error:
        if not make and isinstance(error, FileNotFoundError):
            raise
        raise BackendError(
            f"the cache folder {path} cannot be made or opened ({error}); name another one in {CACHE_VARIABLE}"
        ) from error
    try:
        yield folder
    finally:
        if folder is not None:
            os.close(folder)


def _opened(path: Path, make: bool) -> int:
    """Open a folder through all of its parents, each opened relative to the last one and checked once it is open."""
    pending = list(path.parts[:0:-1])
    folder, links, way = os.open(path.anchor, _FOLDER_FLAGS), 0, path.anchor
    try:
        _check_ancestor(os.fstat(folder), way)
        while pending:
            name = pending.pop()
            target = _link(name, folder)
            if target is not None:
                links += 1
                if links > MAX_LINKS:
                    raise OSError(f"more than {MAX_LINKS} links")
                pending += list(Path(target).parts[::-1])
                continue
            inner_path = os.path.join(way, name)
            inner = _open_child(name, folder, make)
            os.close(folder)
            folder, way = inner, "/" if os.path.isabs(name) else inner_path
            if pending:
                _check_ancestor(os.fstat(folder), way)
        _check_own(os.fstat(folder), way)
    except BaseException:
        os.close(folder)
        raise
    return folder


def _link(name: str, folder: int) -> str | None:
    """Return the target of a link made by root or this user; None if it is no link."""
    try:
        status = os.stat(name, dir_fd=folder, follow_symlinks=False)
    except FileNotFoundError:
        return None
    if not stat.S_ISLNK(status.st_mode):
        return None
    if status.st_uid not in (0, _user()):
        raise BackendError(f"the link {name!r} on the way to the cache folder belongs to another user: {_mend()}")
    return os.readlink(name, dir_fd=folder)


def _user() -> int:
    """Return the number of this user; on Windows, where users have none, 0, as `os.stat` says of every file there."""
    if sys.platform == "win32":
        return 0
    return os.getuid()


def _open_child(name: str, folder: int, make: bool) -> int:
    try:
        return os.open(name, _FOLDER_FLAGS, dir_fd=folder)
    except FileNotFoundError:
        if not make:
            raise
        with suppress(FileExistsError):
            os.mkdir(name, 0o700, dir_fd=folder)
        return os.open(name, _FOLDER_FLAGS, dir_fd=folder)


def _check_ancestor(status: os.stat_result, way: str) -> None:
    """Raise BackendError if another user owns the folder, or can write to it without a sticky bit."""
    mode = status.st_mode
    open_to_others = mode & stat.S_IWOTH or (mode & stat.S_IWGRP and not _private_group(status.st_gid))
    if status.st_uid not in (0, _user()) or (open_to_others and not mode & stat.S_ISVTX):
        raise BackendError(
            f"the folder {way} on the way to the cache folder belongs to another user or others may write to it: "
            f"{_mend()}"
        )


def _check_own(status: os.stat_result, way: str) -> None:
    if status.st_uid != _user() or status.st_mode & _OTHERS:
        raise BackendError(
            f"the cache folder {way} belongs to another user or others may write to it; "
            f"it holds code that is run: mend it (chmod 700) or name another one in {CACHE_VARIABLE}"
        )


def _mend() -> str:
    return f"code from there is run; name another folder in {CACHE_VARIABLE}"


@cache
def _private_group(group: int) -> bool:
    """Return True if a group is this user's alone; many systems give each user a group of the same name."""
    if sys.platform == "win32":
        return False
    import grp
    import pwd

    try:
        user, found = pwd.getpwuid(_user()).pw_name, grp.getgrgid(group)
    except KeyError:
        return False
    return found.gr_name == user and set(found.gr_mem) <= {user}


@cache
def text_digest(place: Path, endings: tuple[str, ...] = (".py",)) -> str:
    """Return a digest of a package's or file's source text: part of the cache keys of what it generates."""
    files = [place] if place.is_file() else sorted(path for path in place.rglob("*") if path.suffix in endings)
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


@cache
def package_stamp() -> str | None:
    """Return a digest of what this package computes by itself depends on; None if a file changed after it was imported.

    It holds the size and the time of the last change of every file of the package, as Python's own cache of byte code
    has it, and the versions of Python and NumPy.
    """
    import numpy  # here, since commands that compute nothing do without it

    files = sorted(_files(PACKAGE))
    if any(changed > _IMPORTED for *_, changed in files):
        return None
    parts = PACKAGE, platform.python_version(), platform.machine(), numpy.__version__, repr(files)
    return hashlib.sha256("\0".join(parts).encode(errors="surrogatepass")).hexdigest()


def _files(folder: str) -> Iterator[tuple[str, int, float]]:
    """Yield the path, size in bytes and time of the last change of each file in a folder, without byte code."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if "." in entry.name[1:]:
                status = entry.stat()
                yield entry.path, status.st_size, status.st_mtime
            elif entry.name != "__pycache__" and entry.is_dir():
                yield from _files(entry.path)


def recall(part: str, name: str) -> bytes | None:
    """Return what :func:`remember` wrote; None if it is missing, damaged or someone else's, or if the cache is off."""
    try:
        with cache_folder(part, make=False) as folder:
            data = _read(_file_name(part, name, folder), folder)
    except FileNotFoundError:
        return None
    except (BackendError, OSError) as error:
        _warn_once(error)
        return None
    return data[32:] if data[:32] == _seal(part, name, data[32:]) else None


def remember(part: str, name: str, data: bytes) -> None:
    """Write a file to the cache; if that fails, warn once and go on without the cache."""
    try:
        with cache_folder(part) as folder:
            if cache_path(part) not in _pruned:
                _pruned.add(cache_path(part))
                prune(cache_path(part), folder)
            _write(part, name, _seal(part, name, data) + data, folder)
    except (BackendError, OSError) as error:
        _warn_once(error)


def _seal(part: str, name: str, data: bytes) -> bytes:
    return hashlib.sha256(b"\0".join((part.encode(), name.encode(), data))).digest()


def _file_name(part: str, name: str, folder: int | None) -> str:
    """Return a file's name relative to its opened folder, or its path where folders cannot be opened."""
    return name if folder is not None else str(cache_path(part) / name)


def _read(name: str, folder: int | None) -> bytes:
    with os.fdopen(os.open(name, os.O_RDONLY | _FILE_FLAGS, dir_fd=folder), "rb") as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode) or status.st_size > FOLDER_BYTES:
            return b""
        if sys.platform != "win32" and (status.st_uid != _user() or status.st_mode & _OTHERS):
            return b""
        return file.read()


def _write(part: str, name: str, data: bytes, folder: int | None) -> None:
    """Write a file atomically: another process may write the same file at the same time, with equivalent content."""
    temporary = _file_name(part, f"{_TEMPORARY}{os.urandom(8).hex()}.tmp", folder)
    try:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | _FILE_FLAGS
        with os.fdopen(os.open(temporary, flags, 0o600, dir_fd=folder), "wb") as file:
            file.write(data)
        os.replace(temporary, _file_name(part, name, folder), src_dir_fd=folder, dst_dir_fd=folder)
    except BaseException:
        with suppress(OSError):
            os.unlink(temporary, dir_fd=folder)
        raise


def _warn_once(error: Exception) -> None:
    """Warn once per process: the cache only saves time."""
    if not _said:
        _said.add(str(error))
        warnings.warn(f"passgraph cannot use its disk cache, so each process compiles again: {error}", stacklevel=3)


def prune(path: Path, folder: int | None = None, most: int = FOLDER_BYTES) -> None:
    """Remove the oldest files until a folder that exceeds ``most`` bytes holds at most half of that.

    Temporary files of an hour ago are removed too: a killed process has left them. Another process may read or remove
    the same files; removed files are compiled again.
    """
    found = []
    for name in os.listdir(path if folder is None else folder):
        place = name if folder is not None else str(path / name)
        with suppress(OSError):
            status = os.stat(place, dir_fd=folder, follow_symlinks=False)
            if name.startswith(_TEMPORARY) and status.st_mtime < time() - _STALE_S:
                os.unlink(place, dir_fd=folder)
                continue
            found.append((status.st_mtime, status.st_size, place))
    total = sum(size for _, size, _ in found)
    if total <= most:
        return
    for _, size, place in sorted(found):
        if total <= most // 2:
            return
        with suppress(OSError):
            os.unlink(place, dir_fd=folder)
            total -= size
